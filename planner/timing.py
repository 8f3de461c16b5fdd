"""From a speed profile along the path to samples in time: the solution itself, integrated exactly, with nothing smoothed on top.

On the interval to the right of grid point i the acceleration u along the path is constant, hence

    t_{i+1} = t_i + 2 h / (feed_i + feed_{i+1}),      s(t) = s_i + feed_i tau + u tau^2/2,    tau = t - t_i,

and per axis, with r', r'', r''' at s(t):

    velocity      r' feed
    acceleration  r' u + r'' feed^2
    jerk          3 r'' feed u + r''' feed^3            (inside an interval; u jumps at grid points)

Samples lie at k dt and, last, at the end of the program, so the last period is usually shorter. Dwells hold the position.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit

from planner.arrays import Array, FloatArray, freeze
from planner.constraints.problem import FeedrateProblem
from planner.corners.elements import ElementTable, element_length, element_point, to_arc_length
from planner.feedrate.solution import FeedrateSolution, interval_times
from planner.path import PathSamples
from planner.trajectory import Trajectory

# Arc length is inverted to this share of the interval [-]: 1e-11 mm on a grid interval of 0.1 mm, below the rounding of coordinates.
LENGTH_ROUNDING = 1e-10
# Steps on s(w) at most; one is the rule where the interpolated inverse is not good enough by itself.
REFINE_STEPS = 12
# A step leaves about the cube of the miss, so that below this share of the interval no further check is needed [-].
CUBE_ROOT_ROUNDING = 4e-4
# Samples per chunk of a finely sampled motion: 20 MB with three axes.
CHUNK = 100_000


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """The planned motion as a function of time: P grid points with their times.

    axes          : axis letters
    table         : geometry of the elements
    t             : (P,) time of each grid point [s]; a dwell lies between the two points of a full stop
    s, feed, acc_s: (P,) arc length, ds/dt, and d2s/dt2 of the interval to the right
    element, w0, w1 : (P,) geometry of that interval
    position      : (P, A) at the grid points
    block, line   : (P,) program block and source line of that interval
    still         : (P,) True where no interval follows (end of a piece)
    end_time      : [s], including a dwell at the end
    """

    axes: tuple[str, ...]
    table: ElementTable
    t: FloatArray
    s: FloatArray
    feed: FloatArray
    acc_s: FloatArray
    element: Array
    w0: FloatArray
    w1: FloatArray
    position: FloatArray
    block: Array
    line: Array
    still: Array
    end_time: float

    def __post_init__(self) -> None:
        points = len(self.t)
        for name in ("t", "s", "feed", "acc_s", "w0", "w1"):
            freeze(self, name, np.float64, (points,))
        freeze(self, "position", np.float64, (points, len(self.axes)))
        for name in ("element", "block"):
            freeze(self, name, np.int64, (points,))
        freeze(self, "line", np.int32, (points,))
        freeze(self, "still", np.bool_, (points,))


def motion_of(samples: PathSamples, problem: FeedrateProblem, solution: FeedrateSolution) -> Motion:
    """Put times to a solved problem. Raises NotSolvedError without a solution."""
    times = interval_times(problem, solution.require().feed_sq)
    toolpath = samples.path.toolpath
    dwell = toolpath.dwell[samples.path.legs.first[samples.stop]]
    wait = np.zeros(len(samples))
    wait[samples.piece[:-1]] = dwell[:-1]  # before the first point of a piece
    t = np.concatenate([[0.0], np.cumsum(times)[:-1]]) + np.cumsum(wait)
    still = np.zeros(len(samples), dtype=bool)
    still[samples.piece[1:] - 1] = True
    return Motion(
        axes=problem.axes,
        table=samples.table,
        t=t,
        s=samples.s,
        feed=np.sqrt(solution.feed_sq),
        acc_s=solution.acc_s,
        element=samples.element,
        w0=samples.w0,
        w1=samples.w1,
        position=samples.position,
        block=toolpath.block[samples.segment],
        line=toolpath.line[samples.segment],
        still=still,
        end_time=float(t[-1] + dwell[-1]),
    )


def sample_motion(motion: Motion, dt: float) -> Trajectory:
    """The motion at the interpolation period dt [s], last partial period included."""
    return _trajectory(motion, _sample_times(motion.end_time, dt), dt)


def dense_motion(motion: Motion) -> Iterator[Trajectory]:
    """The motion between the samples: just after every grid point, in the middle and just before the next, in chunks.

    On an interval all speeds and accelerations are smooth and nearly linear, so that their extremes show there.
    """
    moving = np.flatnonzero(~motion.still)
    begin, end = motion.t[moving], motion.t[moving + 1]
    inside = np.stack([0.999 * begin + 0.001 * end, 0.5 * (begin + end), 0.001 * begin + 0.999 * end], axis=1)
    times = np.concatenate([[0.0], inside.ravel(), [motion.end_time]])
    times = times[np.concatenate([[True], np.diff(times) > 0])]
    for first in range(0, len(times), CHUNK):
        yield _trajectory(motion, times[first : first + CHUNK + 1], float(np.diff(times).max()))


def _sample_times(end: float, dt: float) -> FloatArray:
    """0, dt, 2 dt, ..., end; a remainder below a millionth of dt is rounding and joins the period before."""
    count = int(np.floor(end / dt * (1 + 1e-12)))
    times = np.arange(count + 1) * dt
    if end - times[-1] > 1e-6 * dt:
        return np.append(times, end)
    times[-1] = end
    return times


def _trajectory(motion: Motion, times: FloatArray, dt: float) -> Trajectory:
    position, velocity, acceleration, jerk, s, feed, point = _sample(
        motion.table.legs,
        motion.table.corners,
        times,
        motion.t,
        motion.s,
        motion.feed,
        motion.acc_s,
        motion.element,
        motion.w0,
        motion.w1,
        motion.position,
        motion.still,
    )
    return Trajectory(
        axes=motion.axes,
        dt=dt,
        t=times,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        jerk=jerk,
        s=s,
        feed=feed,
        block=motion.block[point],
        line=motion.line[point],
    )


@njit(cache=True, error_model="numpy")
def _invert(legs, corners, element, w0, w1, h, work, out, c):
    """Quintic c (6,) with w = w0 + (w1 - w0) sum c_n q^n, q = ds/h, matching w(s) and two derivatives at both ends.

    Returns whether it is accurate to `LENGTH_ROUNDING` in the middle, where it is worst.
    """
    c[:] = 0.0
    c[1] = 1.0
    if element >= 0 and not legs[element].round:
        return True
    w_ref, dw = 0.5 * (w0 + w1), w1 - w0
    slope, bend = np.empty(2), np.empty(2)  # dw/dq and d2w/dq2 over dw, at both ends
    for e in range(2):
        element_point(legs, corners, element, w1 if e else w0, w_ref, work, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        slope[e] = h / (np.sqrt(speed_sq) * dw)
        bend[e] = -along * h * h / (speed_sq * speed_sq * dw)
    c[1], c[2] = slope[0], 0.5 * bend[0]
    p, v, a = 1.0 - c[1] - c[2], slope[1] - c[1] - 2.0 * c[2], bend[1] - 2.0 * c[2]
    c[3], c[4], c[5] = 10.0 * p - 4.0 * v + 0.5 * a, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + 0.5 * a
    middle = w0 + dw * _horner(c, 0.5)
    return abs(element_length(legs, corners, element, w0, middle, w_ref, out) / h - 0.5) <= LENGTH_ROUNDING


@njit(cache=True, error_model="numpy")
def _horner(c, q):
    return q * (c[1] + q * (c[2] + q * (c[3] + q * (c[4] + q * c[5]))))


@njit(cache=True, error_model="numpy")
def _refine(legs, corners, element, w0, w1, w, ds, h, work, out):
    """Solve for the arc length ds from w0, starting from a good w: the inverse function's series to second order."""
    w_ref = 0.5 * (w0 + w1)
    for _ in range(REFINE_STEPS):
        miss = element_length(legs, corners, element, w0, w, w_ref, out) - ds
        if abs(miss) <= LENGTH_ROUNDING * h:
            break
        element_point(legs, corners, element, w, w_ref, work, out)
        speed_sq, along = 0.0, 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
            along += out[1, k] * out[2, k]
        step = miss / np.sqrt(speed_sq)
        w = min(max(w - step - 0.5 * along / speed_sq * step * step, w0), w1)
        if abs(miss) <= CUBE_ROOT_ROUNDING * h:
            break
    return w


@njit(cache=True, error_model="numpy")
def _sample(legs, corners, times, t, s, feed, acc_s, element, w0, w1, position, still):
    """Positions and derivatives at ascending times (T,); also the grid point whose interval each lies in."""
    count, axes = len(times), position.shape[1]
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed = np.empty(count), np.empty(count)
    point = np.empty(count, np.int64)
    work, here = np.empty((2, 4, axes)), np.empty((4, axes))
    inverse, inverse_of, exact = np.zeros(6), -1, False
    i = max(np.searchsorted(t, times[0], side="right") - 1, 0)
    for n in range(count):
        while i + 1 < len(t) and t[i + 1] <= times[n]:
            i += 1
        point[n] = i
        if still[i] or times[n] < t[i]:  # a dwell, at the end of a piece or before the first
            out_position[n] = position[i]
            out_velocity[n] = 0.0
            out_acceleration[n] = 0.0
            out_jerk[n] = 0.0
            out_s[n], out_feed[n] = s[i], 0.0
            continue
        tau = times[n] - t[i]
        h = s[i + 1] - s[i]
        ds = min(max((feed[i] + 0.5 * acc_s[i] * tau) * tau, 0.0), h)
        v, u = max(feed[i] + acc_s[i] * tau, 0.0), acc_s[i]
        if inverse_of != i:
            exact = _invert(legs, corners, element[i], w0[i], w1[i], h, work, here, inverse)
            inverse_of = i
        w = w0[i] + (w1[i] - w0[i]) * _horner(inverse, ds / h)
        if not exact:
            w = _refine(legs, corners, element[i], w0[i], w1[i], w, ds, h, work, here)
        element_point(legs, corners, element[i], w, 0.5 * (w0[i] + w1[i]), work, here)
        to_arc_length(here)
        for k in range(axes):
            out_position[n, k] = here[0, k]
            out_velocity[n, k] = here[1, k] * v
            out_acceleration[n, k] = here[1, k] * u + here[2, k] * v * v
            out_jerk[n, k] = 3.0 * here[2, k] * v * u + here[3, k] * v * v * v
        out_s[n], out_feed[n] = s[i] + ds, v
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, point
