"""From a time law along the path to samples in time: the solution itself, integrated exactly, nothing smoothed on top.

With s(t) and its derivatives feed, u and jerk (motion/time_law.py), per axis, with r', r'', r''' at s(t):

    velocity      r' feed
    acceleration  r' u + r'' feed^2
    jerk          r' jerk + 3 r'' feed u + r''' feed^3            (inside a piece of the law; at its ends u may jump)

Samples lie at k dt and, last, at the end of the program, so the last period is usually shorter. Dwells hold the position.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.kernels import njit
from planner.base.search import last_not_after, nearest
from planner.corners.elements import element_length, element_point, is_straight, to_arc_length
from planner.motion.time_law import TimeLaw
from planner.motion.trajectory import Trajectory
from planner.path.samples import PathSamples

# Arc length is inverted to this share of the interval [-]: 1e-14 mm on 0.1 mm, below the rounding of coordinates, so that
# accelerations by differences of nearby positions are as good as the columns.
LENGTH_ROUNDING = 1e-13
# Steps on s(w) at most; one is the rule where the interpolated inverse is not good enough by itself. Halves alone take 43 for
# `LENGTH_ROUNDING`.
REFINE_STEPS = 60
# A step leaves about the cube of the miss, so that below this share of the interval no further check is needed [-].
CUBE_ROOT_ROUNDING = 4e-5
# Where a piece of the law is looked at [share of the piece].
WATCHED = np.array([0.05, 0.5, 0.95])
# Pieces shorter than this get no samples of their own [s]: the rounding of times puts them into their neighbours, and what happens
# there moves nothing (2e5 mm/s3 for 1e-9 s are 1e-13 mm/s).
SHORTEST_PIECE = 1e-9
# More samples than this are refused: with three axes they fill 14 GB.
SAMPLES_MAX = 1e8
# Samples per chunk of a finely sampled motion: 20 MB with three axes.
CHUNK = 100_000


class MotionInTime(Protocol):
    """A motion that can be evaluated at any time, in pieces on which everything is smooth."""

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece [s], non-decreasing."""
        ...

    @property
    def end(self) -> float:
        """End of the last piece [s]."""
        ...

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]; `dt` [s] is the trajectory's interpolation period."""
        ...

    def waiting(self, at: FloatArray, by: FloatArray) -> MotionInTime:
        """The motion standing longer by `by` (n,) [s] where it comes to rest, at the ends `at` (n,) of pieces [s]."""
        ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """A planned motion along a path: where the path goes, and when."""

    samples: PathSamples
    law: TimeLaw

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece of the law [s]."""
        return self.law.t

    @property
    def end(self) -> float:
        """End of the motion [s]."""
        return self.law.end

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]."""
        return _trajectory(self, times, dt)

    def waiting(self, at: FloatArray, by: FloatArray) -> Motion:
        """The motion standing longer by `by` (n,) [s] behind the runs that end nearest to the times `at` (n,) [s]."""
        law = self.law
        still = np.flatnonzero(
            np.append(law.run[1:] != law.run[:-1], True)
        )  # a run's last piece is its standstill
        more = np.zeros(len(law.t))
        np.add.at(more, still[nearest(law.t[still], at)], by)
        later = np.cumsum(more)
        new = dataclasses.replace(law, t=law.t + (later - more), end=float(law.end + later[-1]))
        return dataclasses.replace(self, law=new)


def sample_motion(motion: MotionInTime, dt: float) -> Trajectory:
    """The motion at the interpolation period dt [s], last partial period included."""
    return motion.at(_sample_times(motion.end, dt), dt)


def dense_motion(motion: MotionInTime, dt: float) -> Iterator[Trajectory]:
    """The motion between its samples at dt [s]: half-way between them and inside every piece, in chunks."""
    halves = np.arange(0.5 * dt, motion.end, dt)
    return in_chunks(
        motion, dt, np.concatenate([[0.0], inside_pieces(motion)[1].ravel(), halves, [motion.end]])
    )


def inside_pieces(motion: MotionInTime) -> tuple[Array, FloatArray]:
    """Pieces (n,) that last, and times (n, 3) near both ends and in the middle of each [s], at its shares `WATCHED`: all speeds,
    accelerations and jerks are smooth there, and peaks in between close to those of parabolas."""
    edges = np.append(motion.t, motion.end)
    pieces = np.flatnonzero(np.diff(edges) > SHORTEST_PIECE)
    return pieces, edges[pieces, None] * (1.0 - WATCHED) + edges[pieces + 1, None] * WATCHED


def in_chunks(motion: MotionInTime, dt: float, times: FloatArray) -> Iterator[Trajectory]:
    """The motion at the times (T,) [s], put in order, in chunks that share their ends; dt [s] is the trajectories' period."""
    times = np.unique(times)
    for first in range(0, len(times), CHUNK):
        yield motion.at(times[first : first + CHUNK + 1], dt)


def require_samples(end: float, dt: float) -> None:
    """Raise InputError if a motion of `end` seconds has more samples than are made."""
    if not end / dt <= SAMPLES_MAX:
        raise InputError(
            f"the motion takes {end:.6g} s, {end / dt:.3g} periods of {dt:g} s; at most {SAMPLES_MAX:.0e} samples are made: "
            "raise the feed or the machine's dt, or split the program"
        )


def _sample_times(end: float, dt: float) -> FloatArray:
    """0, dt, 2 dt, ..., end; a remainder below a millionth of dt is rounding and joins the period before."""
    require_samples(end, dt)
    count = int(np.floor(end / dt * (1 + 1e-12)))
    times: FloatArray = np.arange(count + 1, dtype=np.float64) * dt
    if count and end - times[-1] <= 1e-6 * dt:
        times[-1] = end
        return times
    return np.append(times, end)


def _trajectory(motion: Motion, times: FloatArray, dt: float) -> Trajectory:
    samples, law = motion.samples, motion.law
    toolpath = samples.path.toolpath
    timed = _Law(law.t, law.s, law.feed, law.acc_s, law.jerk_s, law.run, float(law.end))
    grid = _Grid(samples.piece, samples.s, samples.element, samples.w0, samples.w1)
    *columns, point, parameter = _sample(samples.table, timed, grid, times, samples.position.shape[1])
    names = ("position", "velocity", "acceleration", "jerk", "s", "feed")
    segment = _segment(samples, point, parameter)
    return Trajectory(
        axes=toolpath.axes,
        dt=dt,
        t=times,
        block=toolpath.block[segment],
        line=toolpath.line[segment],
        **dict(zip(names, columns, strict=True)),
    )


def _segment(samples: PathSamples, point: Array, parameter: FloatArray) -> Array:
    """The toolpath segment of each sample; an interval of a span may cover several."""
    segment = samples.segment[point]
    span = samples.element[point] - len(samples.table.legs)
    at = np.flatnonzero(span >= 0)
    if len(at):
        spans, of = samples.table.spans, span[at]
        place = spans["begin"][of] + spans["width"][of] * parameter[at]
        ends = samples.path.passed
        segment[at] = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, len(ends) - 2)
    return segment


class _Law(NamedTuple):
    """The fields of `TimeLaw`."""

    t: FloatArray
    s: FloatArray
    feed: FloatArray
    acc_s: FloatArray
    jerk_s: FloatArray
    run: Array
    end: float


class _Grid(NamedTuple):
    """The fields of `PathSamples` that say where its intervals are on the elements of the path."""

    piece: Array
    s: FloatArray
    element: Array
    w0: FloatArray
    w1: FloatArray


class _Interval(NamedTuple):
    """An interval of the grid: parameters w0 .. w1 of an element, over an arc length h [mm]."""

    element: int
    w0: float
    w1: float
    h: float


@njit(cache=True, error_model="numpy")
def _invert(table, on, work, out, c):
    """Quintic c (6,) with w = w0 + (w1 - w0) sum c_n q^n, q = ds/h, matching w(s) and two derivatives at both ends.

    Returns whether it is accurate to `LENGTH_ROUNDING` in the middle, where it is worst as a rule, and at its quarters.
    """
    legs, corners, spans = table
    element, w0, w1, h = on
    c[:] = 0.0
    c[1] = 1.0
    if is_straight(legs, element):
        return True
    w_ref, dw = 0.5 * (w0 + w1), w1 - w0
    slope, bend = np.empty(2), np.empty(2)  # dw/dq and d2w/dq2 over dw, at both ends
    for e in range(2):
        element_point(legs, corners, spans, element, w1 if e else w0, w_ref, work, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        slope[e] = h / (np.sqrt(speed_sq) * dw)
        bend[e] = -along * h * h / (speed_sq * speed_sq * dw)
    c[1], c[2] = slope[0], 0.5 * bend[0]
    p, v, a = 1.0 - c[1] - c[2], slope[1] - c[1] - 2.0 * c[2], bend[1] - 2.0 * c[2]
    c[3], c[4], c[5] = 10.0 * p - 4.0 * v + 0.5 * a, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + 0.5 * a
    for q in (0.5, 0.25, 0.75):
        w = w0 + dw * _horner(c, q)
        if not w0 <= w <= w1:
            return False
        if abs(element_length(legs, corners, spans, element, w0, w, w_ref, out) / h - q) > LENGTH_ROUNDING:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _horner(c, q):
    return q * (c[1] + q * (c[2] + q * (c[3] + q * (c[4] + q * c[5]))))


@njit(cache=True, error_model="numpy")
def _refine(table, on, w, ds, work, out):
    """Solve for the arc length ds from w0, starting from w: the inverse function's series to second order, and halves of what encloses
    the solution where that leads outside it (where an interval is a whole span it may)."""
    legs, corners, spans = table
    element, w0, w1, h = on
    w_ref = 0.5 * (w0 + w1)
    low, high = w0, w1
    w = min(max(w, w0), w1)
    for _ in range(REFINE_STEPS):
        miss = element_length(legs, corners, spans, element, w0, w, w_ref, out) - ds
        if abs(miss) <= LENGTH_ROUNDING * h:
            break
        if miss > 0.0:
            high = w
        else:
            low = w
        element_point(legs, corners, spans, element, w, w_ref, work, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        step = miss / np.sqrt(speed_sq)
        w = w - step - 0.5 * along / speed_sq * step * step
        if not low <= w <= high:
            w = 0.5 * (low + high)
            continue
        if abs(miss) <= CUBE_ROOT_ROUNDING * h:
            break
    return w


@njit(cache=True, error_model="numpy")
def _sample(table, law, grid, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times; also the grid point whose interval each lies in, and its
    parameter there."""
    legs, corners, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, w0, w1 = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed = np.empty(count), np.empty(count)
    point, parameter = np.empty(count, np.int64), np.empty(count)
    work, here = np.empty((2, 4, axes)), np.empty((4, axes))
    inverse, inverse_of, exact = np.zeros(6), -1, False
    on = _Interval(element[0], w0[0], w1[0], 0.0)
    m = last_not_after(t, times[0], 0, len(t) - 1)
    i = 0
    for n in range(count):
        while m + 1 < len(t) and t[m + 1] <= times[n]:
            m += 1
        tau = max(times[n] - t[m], 0.0)
        u, j = acc_s[m] + jerk_s[m] * tau, jerk_s[m]
        v = max(feed[m] + tau * (acc_s[m] + 0.5 * jerk_s[m] * tau), 0.0)
        s_here = s_law[m] + tau * (feed[m] + tau * (acc_s[m] / 2.0 + jerk_s[m] * tau / 6.0))
        if m + 1 < len(t):
            s_here = min(s_here, s_law[m + 1])
        if times[n] >= end:
            s_here, v, u, j = s[-1], 0.0, 0.0, 0.0
        elif times[n] < t[m]:  # a dwell before the first move
            v, u, j = 0.0, 0.0, 0.0
        first, last = piece[run[m]], piece[run[m] + 1] - 2  # the intervals of this run
        if i < first:
            i = last_not_after(s, s_here, first, last)
        while i < last and s[i + 1] <= s_here:
            i += 1
        point[n] = i
        h = s[i + 1] - s[i]
        ds = min(max(s_here - s[i], 0.0), h)
        if inverse_of != i:
            on = _Interval(element[i], w0[i], w1[i], h)
            exact = _invert(table, on, work, here, inverse)
            inverse_of = i
        w = w0[i] + (w1[i] - w0[i]) * _horner(inverse, ds / h)
        if not exact:
            w = _refine(table, on, w, ds, work, here)
        parameter[n] = w
        element_point(legs, corners, spans, element[i], w, 0.5 * (w0[i] + w1[i]), work, here)
        to_arc_length(here)
        for k in range(axes):
            out_position[n, k] = here[0, k]
            out_velocity[n, k] = here[1, k] * v
            out_acceleration[n, k] = here[1, k] * u + here[2, k] * v * v
            out_jerk[n, k] = here[1, k] * j + 3.0 * here[2, k] * v * u + here[3, k] * v * v * v
        out_s[n], out_feed[n] = s[i] + ds, v
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, point, parameter
