"""A motion run slower in places: the same path at another pace, with nothing that jumps but the jerk.

With theta the time of the motion q as it was and tau the time in which it is run now,

    dtau/dtheta = p(theta) = 1 + sum_i d_i phi(x_i),     phi(x) = (1 + x) e^-x,

x_i the distance in theta from place i, in reaches w_i, 0 inside. With r = dtheta/dtau = 1/p it has

    velocity      q' r
    acceleration  q'' r^2 + q' r_1,                       r_1 = dr/dtau   = -p'/p^3
    jerk          q''' r^3 + 3 q'' r r_1 + q' r_2,        r_2 = d2r/dtau2 = (3 p'^2 - p p'')/p^5

What is across the path, the normal acceleration, gets r^2 of itself, and the feed r. **A motion that keeps
limits V, A, J of an axis, and is nowhere faster on it than v, keeps them at the new pace too, if the reach is
long enough:**

    w >= v / (2 A),      w >= (A + sqrt(A^2 + (16/9) v J)) / (2 J).

Proof: |phi'| <= phi and |phi''| <= phi, so that with u = p - 1 both |p'| <= u/w and |p''| <= u/w^2, of the
sum over places too. The acceleration is at most A/p^2 + v u/(w p^3), which is A or less if v/w <= A p (p +
1), and p >= 1. The jerk is at most J/p^3 + 3 A u/(w p^4) + v (3 u^2 + p u)/(w^2 p^5), which is J or less if 3
A/(w p) + v (3 u + p)/(w p)^2 <= J (p^2 + p + 1). The right side is 3 J or more, and (3 u + p)/p^2 = (4 p -
3)/p^2 <= 4/3. So room is needed nowhere: the slower pace itself makes it.

At a rest p may jump, as nothing moves: what is slower ends at the rests around a place. A place costs d
(length + 4 w) of time at most, and never more than the whole way between these rests at the slower pace.
Beyond `FAR` reaches nothing is left of phi but rounding.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory

FAR = 42.0  # reaches: (1 + FAR) e^-FAR is 2e-17
# Newton's method for theta: its error is less by p(1)/p(2) - 1 a step at least, and squared near the end.
STEPS, SETTLED = 60, 4e-16


class Place(NamedTuple):
    """Where a motion is run slower."""

    begin: float  # in the motion's own time [s]
    end: float  # [s]
    by: float  # d, the share by which it takes longer there [-]
    reach: float  # w, of what is slower before and behind [s]
    low: float = 0.0  # nothing is slower before this [s], >= 0: the motion rests there
    high: float = np.inf  # nor behind this [s]


def reach(v: float, A: float, J: float) -> float:
    """The least reach of an axis nowhere faster than v, with limits A and J [s]; inf if not limited."""
    of_jerk = 0.0
    if np.isfinite(J):
        of_jerk = (A + np.sqrt(A * A + 16.0 / 9.0 * v * J)) / (2.0 * J)
    return float(max(v / (2.0 * A), of_jerk))


class _Pace(NamedTuple):
    """At times theta (n,): tau [s], and p with its derivatives by theta."""

    tau: FloatArray
    p: FloatArray
    p1: FloatArray
    p2: FloatArray


def without_stands(stands: FloatArray, times: FloatArray) -> tuple[FloatArray, Array]:
    """Times of a motion with stands, in the time of that without (n,) [s], and whether it stands (n,).

    times  : (n,) [s]
    stands : (m, 2) when it rests, in the time without them, and for how much longer [s]; ascending
    """
    stood = np.append(0.0, np.cumsum(stands[:, 1]))
    k = np.searchsorted(stands[:, 0] + stood[:-1], times, side="right")
    tau = times - stood[k]
    at = np.append(-np.inf, stands[:, 0])[k]
    return np.maximum(tau, at), tau < at


@dataclass(frozen=True, eq=False, kw_only=True)
class Slowed:
    """A motion run slower in places, and standing longer where it rests."""

    motion: MotionInTime  # as it was
    places: tuple[Place, ...]  # where it is slower
    # (n, 2) when it rests [s], at the pace here without these rests, and how much longer [s]; ascending
    stands: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    def _pace(self, theta: FloatArray) -> _Pace:
        """The pace at ascending times theta (n,) [s]."""
        p1, p2, more = np.zeros_like(theta), np.zeros_like(theta), np.zeros_like(theta)
        behind, u = np.zeros(len(theta) + 1), np.zeros_like(theta)
        for begin, end, by, w, low, high in self.places:
            edges = [max(begin - FAR * w, low), begin, end, min(end + FAR * w, high)]
            a, b, c, d = np.searchsorted(theta, edges)
            before, after = (begin - theta[a:b]) / w, (theta[c:d] - end) / w
            e0, e1 = by * np.exp(-before), by * np.exp(-after)
            u[a:b] += (1.0 + before) * e0
            u[b:c] += by
            u[c:d] += (1.0 + after) * e1
            p1[a:b] += before * e0 / w
            p1[c:d] -= after * e1 / w
            p2[a:b] += (before - 1.0) * e0 / w**2
            p2[c:d] += (after - 1.0) * e1 / w**2
            # what is added from `low` to there: the integral of d phi
            none, rest = (
                w * by * (2.0 + x) * np.exp(-x)
                for x in ((begin - low) / w, (high - end) / w if high < np.inf else FAR)
            )
            more[a:b] += w * (2.0 + before) * e0 - none
            more[b:c] += by * (2.0 * w + theta[b:c] - begin) - none
            more[c:d] += by * (4.0 * w + end - begin) - w * (2.0 + after) * e1 - none
            behind[d] += by * (4.0 * w + end - begin) - none - rest
        return _Pace(theta + more + np.cumsum(behind[:-1]), 1.0 + u, p1, p2)

    def run_at(self, theta: FloatArray) -> FloatArray:
        """(n,) when the motion does what it did at ascending times theta (n,) [s]."""
        tau = self._pace(theta).tau
        return tau + self._stood[np.searchsorted(self.stands[:, 0], tau)]

    def was_at(self, times: FloatArray) -> FloatArray:
        """(n,) the times of the motion as it was [s], at ascending times (n,) [s]."""
        return self._theta(without_stands(self.stands, times)[0])

    def was_at_any(self, times: FloatArray) -> FloatArray:
        """The same at times (n, m) [s] in any order."""
        single, which = np.unique(times, return_inverse=True)
        return self.was_at(single)[which.ravel()].reshape(times.shape)

    def slowest(self, places: Sequence[Place]) -> list[float]:
        """The largest p in each of other places."""
        edges = np.sort([edge for place in self.places for edge in place[:2]])
        inside = [np.append(edges[(edges > each.begin) & (edges < each.end)], each[:2]) for each in places]
        return [float(self._pace(np.sort(times)).p.max()) for times in inside]

    @cached_property
    def _stood(self) -> FloatArray:
        """(n+1,) how much longer it has stood before each of its stands, and behind the last [s]."""
        return np.append(0.0, np.cumsum(self.stands[:, 1]))

    @cached_property
    def _knots(self) -> tuple[FloatArray, FloatArray]:
        """Times theta around all places, and tau there [s]."""
        steps = np.append(np.arange(0.0, 8.0, 0.5), [10.0, 14.0, 20.0, FAR])
        theta = [0.0, self.motion.end]
        for begin, end, _, w, low, high in self.places:
            theta += [low, *np.maximum(begin - w * steps, low), *np.minimum(end + w * steps, high)]
        knots = np.unique(np.clip(theta, 0.0, self.motion.end))
        return knots, self._pace(knots).tau

    def _theta(self, tau: FloatArray) -> FloatArray:
        """(n,) theta at ascending tau (n,) [s]."""
        knots, at = self._knots
        theta = np.interp(tau, at, knots)
        for _ in range(STEPS):
            pace = self._pace(theta)
            step = (tau - pace.tau) / pace.p
            theta = np.maximum.accumulate(np.clip(theta + step, 0.0, self.motion.end))
            if (np.abs(step) <= SETTLED * np.maximum(tau, 1.0)).all():
                break
        return theta

    @cached_property
    def t(self) -> FloatArray:
        """(L,) start of each smooth piece [s]: those of the motion, the edges of places and stands."""
        edges = [edge for place in self.places for edge in place[:2] if 0.0 < edge < self.motion.end]
        moving = self.run_at(np.sort(np.concatenate([self.motion.t, edges])))
        stands = self.stands[:, 0] + self._stood[:-1]
        return np.sort(np.concatenate([moving, stands, stands + self.stands[:, 1]]))

    @cached_property
    def end(self) -> float:
        """End of the motion [s]."""
        return float(self._pace(np.array([self.motion.end])).tau[0] + self._stood[-1])

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]; `dt` [s] is the trajectory's interpolation period."""
        tau, stands = without_stands(self.stands, times)
        theta = self._theta(tau)
        # two times next to each other may be one at another pace
        single, which = np.unique(theta, return_inverse=True)
        seen = self.motion.at(single, dt)
        _, p, p1, p2 = self._pace(theta)
        still = stands | (times >= self.end)
        r = np.where(still, 0.0, 1.0 / p)[:, None]
        r1, r2 = -(p1[:, None]) * r**3, (3.0 * p1**2 - p * p2)[:, None] * r**5
        v, a, j = (getattr(seen, name)[which] for name in ("velocity", "acceleration", "jerk"))
        kept: dict[str, Any] = {name: getattr(seen, name)[which] for name in ("position", "block", "line")}
        kept["s"] = seen.length.rows(which)
        return dataclasses.replace(
            seen,
            t=times,
            velocity=v * r,
            acceleration=a * r**2 + v * r1,
            jerk=j * r**3 + 3.0 * a * r * r1 + v * r2,
            feed=seen.feed[which] * r[:, 0],
            **kept,
        )

    def waiting(self, at: FloatArray, by: FloatArray) -> Slowed:
        """The motion standing longer by `by` (n,) [s] where it comes to rest, at the times `at` (n,) [s]."""
        new = np.stack([without_stands(self.stands, np.sort(at))[0], by[np.argsort(at)]], axis=1)
        stands = np.concatenate([self.stands, new])
        return dataclasses.replace(self, stands=stands[np.argsort(stands[:, 0], kind="stable")])


def times_of_pieces(motion: MotionInTime) -> tuple[FloatArray, float]:
    """(L,) when the pieces of a motion begin, or of the one that is slowed, and when it ends [s]."""
    return (motion.run_at(motion.motion.t) if isinstance(motion, Slowed) else motion.t), motion.end
