"""A motion in time that is given axis by axis: pieces on which the jerk of every axis is constant.

On the piece that begins at t_m, with tau = t - t_m, every axis follows

    p + v tau + a tau^2/2 + j tau^3/6,

so that position, velocity, acceleration and jerk are exact at any time. Its arc length is not given but
measured,

    s(t) = integral of |velocity|,

by Gauss quadrature with steps that adapt: the speed is the root of a polynomial of degree 4, a polynomial
itself on straight pieces. It has a kink where the motion turns back, hence steps end where an axis does.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze, read_only
from planner.base.kernels import njit
from planner.base.search import last_not_after, nearest
from planner.geometry.toolpath import Toolpath
from planner.motion.trajectory import COLUMNS, Lengths, Trajectory

# Arc lengths of a step by 5 Gauss points and by 2 x 5 agree to this fraction of it [-].
QUADRATURE_ROUNDING = 1e-9
# Smallest step of the quadrature [fraction of the piece]; near a kink it is worth its square.
SMALLEST_STEP = 2.0**-30
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
GAUSS_X, GAUSS_W = (1.0 + _NODES) / 2.0, _WEIGHTS / 2.0
LEVELS = COLUMNS[1:5]  # position, velocity, acceleration, jerk
OF_PIECES = ("t", *LEVELS, "block", "line")


class Pieces(NamedTuple):
    """The L pieces of n motions (`AxisMotion`) over the same axes, one motion after the other, each in its own time."""

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    block: Array
    line: Array
    first: Array  # (n+1,) piece of each motion
    end: FloatArray  # (n,) [s]

    @classmethod
    def of(cls, motions: Sequence[AxisMotion | None]) -> Pieces:
        """Those of several motions, which hold parts of these from then on; None stands for one without pieces."""
        given = [one for one in motions if one is not None]
        columns = {
            name: read_only(np.concatenate([getattr(one, name) for one in given])) for name in OF_PIECES
        }
        ends = np.cumsum([len(one) for one in given]).tolist()
        for one, end in zip(given, ends, strict=True):
            one.hold({name: column[end - len(one) : end] for name, column in columns.items()})
        first = np.append(0, np.cumsum([0 if one is None else len(one) for one in motions]))
        return cls(**columns, first=first, end=np.array([0.0 if one is None else one.end for one in motions]))

    def at(self, of: Array, times: FloatArray) -> dict[str, Any]:
        """The columns of a trajectory, but for the times and the arc length, of the motions `of` (T,) at their times (T,)
        within [0, end]; both ascend."""
        motion, feed, piece = _sample(self, of, times)
        found: dict[str, Any] = dict(zip(LEVELS, motion, strict=True))
        return found | {"feed": feed, "block": self.block[piece], "line": self.line[piece]}

    def length(self, s: FloatArray, of: Array, times: FloatArray) -> FloatArray:
        """(T,) arc length [mm] of the motions `of` (T,) at their times (T,) [s]; s (L + n,): `AxisMotion.s` of one after the
        other, 0 of a motion without pieces."""
        found = np.empty(len(times))
        _put_lengths(self, s, of, times, found)
        return found


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisMotion:
    """L pieces of constant jerk over A axes; standstills have no velocity, and behind the last all rests."""

    axes: tuple[str, ...]  # axis letters
    t: FloatArray  # (L,) start of each piece [s], non-decreasing; the first is 0
    position: FloatArray  # (L, A) there [mm]
    velocity: FloatArray  # (L, A) just after t [mm/s]
    acceleration: FloatArray  # (L, A) just after t [mm/s2]
    jerk: FloatArray  # (L, A) on the piece [mm/s3]
    block: Array  # (L,) index of the program's block
    line: Array  # (L,) source line of that block
    end: float  # end of the last piece [s]
    radius: float = 1.0  # at which the angles of rotary axes are lengths [mm]

    def __post_init__(self) -> None:
        pieces, axes = len(self.t), len(self.axes)
        freeze(self, "t", np.float64, (pieces,))
        freeze(self, "position velocity acceleration jerk", np.float64, (pieces, axes))
        freeze(self, "block", np.int64, (pieces,))
        freeze(self, "line", np.int32, (pieces,))
        if not pieces or self.t[0] != 0.0:
            raise ValueError("AxisMotion.t: the first piece must begin at 0 s")
        if not (np.diff(self.t) >= 0).all() or not self.t[-1] <= self.end < np.inf:
            raise ValueError("AxisMotion.t: pieces must follow one another, the last one ending at `end`")

    def __len__(self) -> int:
        return len(self.t)

    @classmethod
    def of(
        cls, state: Iterable[FloatArray], t: FloatArray, end: float, toolpath: Toolpath, segment: Array
    ) -> AxisMotion:
        """Pieces that begin at t (L,) [s] with a `state` (4, L, A), position to jerk, each on a `segment` (L,) of a path."""
        columns: dict[str, Any] = dict(zip(LEVELS, state, strict=True))
        columns |= {"block": toolpath.block[segment], "line": toolpath.line[segment]}
        return cls(axes=toolpath.axes, radius=toolpath.radius, t=t, end=end, **columns)

    @cached_property
    def s(self) -> FloatArray:
        """(L+1,) arc length at the start of each piece, and at the end of the motion [mm]."""
        s = np.zeros(len(self) + 1)
        _arc_lengths(np.append(self.t, self.end), self.velocity, self.acceleration, self.jerk, s)
        return s

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) within [0, end]; `dt` [s] is the trajectory's period."""
        of = np.zeros(len(times), dtype=np.int64)
        columns = self.pieces.at(of, times) | {"s": Lengths(self._length, (of, times))}
        return Trajectory(axes=self.axes, radius=self.radius, dt=dt, t=times, **columns)

    def _length(self, of: Array, times: FloatArray) -> FloatArray:
        return self.pieces.length(self.s, of, times)

    @cached_property
    def pieces(self) -> Pieces:
        """Those of this motion alone."""
        columns = {name: getattr(self, name) for name in OF_PIECES}
        return Pieces(**columns, first=np.array([0, len(self)]), end=np.array([float(self.end)]))

    def hold(self, columns: dict[str, Any]) -> None:
        """Hold these in place of `OF_PIECES`, of which they are a copy: part of what is kept anyway."""
        vars(self).update(columns)
        vars(self).pop("pieces", None)

    def waiting(self, at: FloatArray, by: FloatArray) -> AxisMotion:
        """The motion standing longer by `by` (n,) [s] at the piece ends nearest to `at` (n,), its rests."""
        before = nearest(np.append(self.t, self.end), at)
        place = self.at(self.t[before], 1.0).position  # a piece begins there
        later = np.zeros(len(self) + 1)
        np.add.at(later, before, by)
        t, segment = self.t + np.cumsum(later)[:-1], np.maximum(before - 1, 0)
        rows = {
            "t": t[before] - by,
            "block": self.block[segment],
            "line": self.line[segment],
            "position": place,
        }
        rows |= {name: np.zeros_like(place) for name in LEVELS[1:]}
        whole = dict(vars(self), t=t)
        columns = {name: np.insert(whole[name], before, row, axis=0) for name, row in rows.items()}
        return dataclasses.replace(self, end=self.end + float(by.sum()), **columns)


@njit(cache=True, error_model="numpy")
def _gauss(v, a, j, begin, h):
    """Arc length over [begin, begin + h] of one piece with velocity v, acceleration a and jerk j (A,) at its
    start."""
    total = 0.0
    for n in range(len(GAUSS_X)):
        tau, speed_sq = begin + h * GAUSS_X[n], 0.0
        for k in range(len(v)):
            speed_sq += (v[k] + tau * (a[k] + 0.5 * tau * j[k])) ** 2
        total += GAUSS_W[n] * np.sqrt(speed_sq)
    return h * total


@njit(cache=True, error_model="numpy")
def _next_reversal(v, a, j, begin, end):
    """First time in (begin, end) at which an axis reverses, v + a t + j t^2/2 = 0; `end` if there is none."""
    first = end
    for k in range(len(v)):
        under = a[k] * a[k] - 2.0 * j[k] * v[k]
        if under < 0.0:
            continue
        q = -(a[k] + np.copysign(np.sqrt(under), a[k]))
        for root in (q / j[k], 2.0 * v[k] / q):  # infinite or NaN where there is none
            if begin < root < first:
                first = root
    return first


@njit(cache=True, error_model="numpy")
def _arc_length(v, a, j, tau):
    """Arc length over [0, tau] of one piece."""
    begin, length = 0.0, 0.0
    while begin < tau:
        turn = _next_reversal(v, a, j, begin, tau)  # kinks at the ends of a step do no harm
        h = turn - begin
        while begin < turn:
            whole, half = _gauss(v, a, j, begin, h), 0.5 * h
            halves = _gauss(v, a, j, begin, half) + _gauss(v, a, j, begin + half, half)
            if abs(whole - halves) <= QUADRATURE_ROUNDING * halves or half <= SMALLEST_STEP * tau:
                begin, length, h = begin + h, length + halves, 4.0 * h
            h = min(0.5 * h, turn - begin)
        begin = turn
    return length


@njit(cache=True, error_model="numpy")
def _arc_lengths(t, velocity, acceleration, jerk, s):
    """Arc length s (L+1,) [mm] at the times t (L+1,) between the pieces, from s[0] = 0 on."""
    for m in range(len(velocity)):
        s[m + 1] = s[m] + _arc_length(velocity[m], acceleration[m], jerk[m], t[m + 1] - t[m])


@njit(cache=True, error_model="numpy")
def _sample(pieces, of, times):
    """Position and derivatives (4, T, A) of the motions `of` (T,) at their times (T,), and feed and piece there (T,)."""
    t, position, jerk = pieces.t, pieces.position, pieces.jerk
    velocity, acceleration = pieces.velocity, pieces.acceleration
    samples, axes = len(times), position.shape[1]
    columns = np.empty((4, samples, axes))
    feed, piece = np.empty(samples), np.empty(samples, np.int64)
    run, m, last, end = -1, 0, 0, 0.0
    for n in range(len(times)):
        if of[n] != run:
            run = of[n]
            last, end = pieces.first[run + 1] - 1, pieces.end[run]
            m = last_not_after(t, times[n], pieces.first[run], last)
        while m < last and t[m + 1] <= times[n]:
            m += 1
        over = times[n] >= end
        tau, speed_sq = min(times[n], end) - t[m], 0.0
        for k in range(axes):
            p, v, a, j = position[m, k], velocity[m, k], acceleration[m, k], jerk[m, k]
            columns[0, n, k] = p + tau * (v + tau * (a / 2.0 + tau * j / 6.0))
            columns[1, n, k] = 0.0 if over else v + tau * (a + tau * j / 2.0)
            columns[2, n, k] = 0.0 if over else a + tau * j
            columns[3, n, k] = 0.0 if over else j
            speed_sq += columns[1, n, k] ** 2
        feed[n], piece[n] = np.sqrt(speed_sq), m
    return columns, feed, piece


@njit(cache=True, error_model="numpy")
def _put_lengths(pieces, s, of, times, found):
    """Arc length (T,) of the motions `of` (T,) at their times (T,), into `found`."""
    run, m, last, end = -1, 0, 0, 0.0
    for n in range(len(times)):
        if of[n] != run:
            run = of[n]
            last, end = pieces.first[run + 1] - 1, pieces.end[run]
            m = last_not_after(pieces.t, times[n], pieces.first[run], last)
        while m < last and pieces.t[m + 1] <= times[n]:
            m += 1
        tau = min(times[n], end) - pieces.t[m]
        here = s[m + run] + _arc_length(pieces.velocity[m], pieces.acceleration[m], pieces.jerk[m], tau)
        found[n] = min(here, s[m + run + 1])
