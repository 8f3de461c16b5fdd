"""Look-ahead over straight legs and kinematic corners (paper 003): at which speed every corner is taken, or whether it is a stop.

Corners are candidates of a kind; at a joint passed with the speed V a corner of that kind has a start deceleration (and end
acceleration) A, reaches back by l and takes T. Both grow with V, so every candidate is a family with one parameter. What a leg can do
between two corners is in lookahead/ramps.py, with V' and x as there.

Acceleration has to change its sign on the leg, at a speed not below either V + A^2/(2j); so a leg is feasible iff from the slower
of its ends that speed of the faster one is within reach of what the corners leave: W_fast <= k (V' + x). The factor k, 0 < k <= 1,
is paper 003's for short segments (eq. (9) as docs/papers.md reads it); with k = 1 the leg is used completely.

1. Candidate by candidate, one sweep backwards and one forwards lower the speeds until every leg is feasible. Lowering a speed
   shortens its corner, which leaves the neighbouring leg feasible, so two sweeps are enough.
2. Faster corners are not always better (zero entry acceleration makes the deceleration die out twice). Over all choices of a
   candidate or a stop per joint, the fastest is found by dynamic programming. All stops, and every candidate throughout, are among
   the choices: the result is never slower than any of them. (Candidates at 0.2 to 0.8 of their speed too save 0.02 % at most on
   five NC programs, and take twice as long.)

Everything is linear in the number of joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.lookahead.ramps import ENTRY, corner_at, leg_end, leg_time, reach

LENGTH_ROUNDING = 1e-14  # the choice may lack this share of a leg's length [-]: rounding of sums of lengths
BISECTIONS = 60  # of a speed's bracket: to its last digit


@dataclass(frozen=True, eq=False, kw_only=True)
class Legs:
    """Limits of n straight legs.

    length : (n,) [mm], > 0
    v      : (n,) largest speed [mm/s]: programmed feed and axis speeds
    a, j   : (n,) acceleration and jerk along the leg [mm/s2], [mm/s3]
    """

    length: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray

    def __post_init__(self) -> None:
        for name in ("length", "v", "a", "j"):
            freeze(self, name, np.float64, (len(self.length),))

    def __len__(self) -> int:
        return len(self.length)


@dataclass(frozen=True, eq=False, kw_only=True)
class Passage:
    """One way of passing each of the n+1 joints; the first and the last are stops.

    kind : (n+1,) `Kind`
    V    : (n+1,) speed [mm/s], 0 at stops; of candidates the largest
    p, q : (n+1,) parameters of the kind
    """

    kind: Array
    V: FloatArray
    p: FloatArray
    q: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "kind", np.int64, (None,))
        for name in ("V", "p", "q"):
            freeze(self, name, np.float64, (len(self.kind),))


def look_ahead(legs: Legs, candidates: Sequence[Passage], k: float = 1.0) -> tuple[Passage, FloatArray]:
    """The fastest choice of a candidate or a stop at every joint, and when (n+1,) the motion is past each joint's corner [s].

    candidates : may overlap nowhere on a leg at their speeds (see `capped`)
    k          : factor of the short-segment rule, 0 < k <= 1
    """
    joints = len(legs) + 1
    kind, V, p, q = (
        np.stack([np.zeros(joints), *(getattr(one, name) for one in candidates)])
        for name in ("kind", "V", "p", "q")
    )
    kind = kind.astype(np.int64)
    for row in range(1, len(kind)):
        _sweep(kind[row], V[row], p[row], q[row], legs.length, legs.a, legs.j, k)
    chosen, time = _choose(kind, V, p, q, legs.length, legs.v, legs.a, legs.j, k)
    at = np.arange(joints)
    return Passage(kind=kind[chosen, at], V=V[chosen, at], p=p[chosen, at], q=q[chosen, at]), time


def capped(passage: Passage, legs: Legs, room: FloatArray) -> Passage:
    """The same candidates, slowed down until each needs at most `room` (n+1,) of both legs [mm], ramps included, and the ramps
    stay below the legs' speeds."""
    V = passage.V.copy()
    _cap(passage.kind, V, passage.p, passage.q, legs.v, legs.j, room)
    return Passage(kind=passage.kind, V=V, p=passage.p, q=passage.q)


def needed(passage: Passage, legs: Legs) -> FloatArray:
    """(n+1,) length that each candidate needs of its legs, ramps included [mm]."""
    return _needed(passage.kind, passage.V, passage.p, passage.q, legs.j)


# ---- speeds that fit -------------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _feasible(one, other, length, a, j, k, slack):
    """Whether a leg with the ends `one`, `other` (as of `leg_end`) can be run, up to `slack` of its length."""
    fast, slow = (one, other) if one[3] >= other[3] else (other, one)
    D = length * (1.0 + slack) - one[0] - other[0] - fast[4] + slow[2]
    # gains are compared, not speeds: see leg_top
    return D >= 0.0 and fast[3] - k * slow[1] <= k * reach(slow[1], D, a, j)


@njit(cache=True, error_model="numpy")
def _needed(kind, V, p, q, j):
    out = np.zeros(len(V))
    for i in range(1, len(V) - 1):
        before, after = leg_end(kind[i], V[i], p[i], q[i], j[i - 1]), leg_end(kind[i], V[i], p[i], q[i], j[i])
        out[i] = before[0] + max(before[4], after[4])
    return out


@njit(cache=True, error_model="numpy")
def _cap(kind, V, p, q, v, j, room):
    for i in range(1, len(V) - 1):
        low, high = 0.0, V[i]
        trial = high
        for _ in range(BISECTIONS):
            before, after = (
                leg_end(kind[i], trial, p[i], q[i], j[i - 1]),
                leg_end(kind[i], trial, p[i], q[i], j[i]),
            )
            fits = (
                before[0] + max(before[4], after[4]) <= room[i] and before[3] <= v[i - 1] and after[3] <= v[i]
            )
            if fits:
                low = trial
                if trial == high:
                    break
            else:
                high = trial
            trial = 0.5 * (low + high)
        V[i] = low


@njit(cache=True, error_model="numpy")
def _lowered(kind, V, p, q, fixed, length, a, j, k):
    """The largest speed up to V with which a leg is feasible towards its other end `fixed`, but not below that end's W."""
    here = leg_end(kind, V, p, q, j)
    if here[3] <= fixed[3] or _feasible(here, fixed, length, a, j, k, 0.0):
        return V
    low, high = 0.0, V
    for _ in range(BISECTIONS):
        trial = 0.5 * (low + high)
        here = leg_end(kind, trial, p, q, j)
        if here[3] <= fixed[3] or _feasible(here, fixed, length, a, j, k, 0.0):
            low = trial
        else:
            high = trial
    return low


@njit(cache=True, error_model="numpy")
def _sweep(kind, V, p, q, length, a, j, k):
    """Lower the speeds V (n+1,), in place, until every leg is feasible."""
    legs = len(length)
    if k < 1.0:  # where both ends want the same speed, the rule bounds that speed
        for i in range(legs):
            _lower_both(kind, V, p, q, i, length[i], a[i], j[i], k)
    for i in range(legs - 1, -1, -1):
        fixed = leg_end(kind[i + 1], V[i + 1], p[i + 1], q[i + 1], j[i])
        V[i] = _lowered(kind[i], V[i], p[i], q[i], fixed, length[i], a[i], j[i], k)
    for i in range(legs):
        fixed = leg_end(kind[i], V[i], p[i], q[i], j[i])
        V[i + 1] = _lowered(kind[i + 1], V[i + 1], p[i + 1], q[i + 1], fixed, length[i], a[i], j[i], k)


@njit(cache=True, error_model="numpy")
def _at_most(kind, V, p, q, j, W):
    """The largest speed up to V whose W = V + A^2/(2j) is at most `W`."""
    if leg_end(kind, V, p, q, j)[3] <= W:
        return V
    if kind != ENTRY:
        return W
    return min(V, max(W - 0.5 * p * p / j, W / (1.0 + q / j)))


@njit(cache=True, error_model="numpy")
def _lower_both(kind, V, p, q, i, length, a, j, k):
    """Lower both ends of leg i to the largest common W at which the leg is feasible."""
    one, other = (
        leg_end(kind[i], V[i], p[i], q[i], j),
        leg_end(kind[i + 1], V[i + 1], p[i + 1], q[i + 1], j),
    )
    low, high = 0.0, min(one[3], other[3])
    trial = high
    for _ in range(BISECTIONS):
        V1 = _at_most(kind[i], V[i], p[i], q[i], j, trial)
        V2 = _at_most(kind[i + 1], V[i + 1], p[i + 1], q[i + 1], j, trial)
        one, other = leg_end(kind[i], V1, p[i], q[i], j), leg_end(kind[i + 1], V2, p[i + 1], q[i + 1], j)
        if _feasible(one, other, length, a, j, k, 0.0) and _feasible(other, one, length, a, j, k, 0.0):
            low = trial
            if trial == high:
                return
        else:
            high = trial
        trial = 0.5 * (low + high)
    V[i] = _at_most(kind[i], V[i], p[i], q[i], j, low)
    V[i + 1] = _at_most(kind[i + 1], V[i + 1], p[i + 1], q[i + 1], j, low)


# ---- the fastest choice ----------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _choose(kind, V, p, q, length, v, a, j, k):
    """Row (n+1,) of the fastest choice, and the time at the end of each corner; row 0 is the stop."""
    rows, joints = kind.shape
    best, back = np.full((joints, rows), np.inf), np.zeros((joints, rows), np.int64)
    best[0, 0] = 0.0
    for i in range(joints - 1):
        for t in range(rows):
            if t > 0 and V[t, i + 1] <= 0.0:
                continue  # the stop already
            A2, _, lasting = corner_at(kind[t, i + 1], V[t, i + 1], p[t, i + 1], q[t, i + 1])
            other = leg_end(kind[t, i + 1], V[t, i + 1], p[t, i + 1], q[t, i + 1], j[i])
            for s in range(rows):
                if not best[i, s] < best[i + 1, t]:
                    continue
                A1, _, _ = corner_at(kind[s, i], V[s, i], p[s, i], q[s, i])
                one = leg_end(kind[s, i], V[s, i], p[s, i], q[s, i], j[i])
                if not _feasible(one, other, length[i], a[i], j[i], k, LENGTH_ROUNDING):
                    continue
                time = best[i, s] + lasting + leg_time(one, other, A1, A2, length[i], v[i], a[i], j[i])
                if time < best[i + 1, t]:
                    best[i + 1, t], back[i + 1, t] = time, s
    chosen, time = np.zeros(joints, np.int64), np.zeros(joints)
    for i in range(joints - 1, 0, -1):
        time[i] = best[i, chosen[i]]
        chosen[i - 1] = back[i, chosen[i]]
    return chosen, time
