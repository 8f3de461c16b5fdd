"""What the machine's own filters make of a delivered motion: `[fir]`, moving averages in the drive or the control behind the setpoints.

A moving average of length T makes of x(t) the mean of the last T seconds,

    y(t) = (I(t) - I(t - T)) / T,     I' = x,          y'(t) = (x(t) - x(t - T)) / T,

and several are applied one after the other. Before its start and after its end the motion rests, so the result goes on for the
delay Td = sum T_i after the end, and arrives exactly where the motion does.

x is taken at times h apart with its velocity, as a cubic between them, whose integral is exact; y and y' at the same times are the
next filter's x. A cubic misses a jump j of the jerk by at most h^3 j / 162 and one a of the acceleration by h^2 a / 32, and a moving
average leaves h / T of that, so that with h <= T/8 not even a jump of 2000 mm/s2 leaves more than 1e-4 mm at T = 10 ms, and h <= dt/4
as a rule makes it some nanometres (measured in tests/verify/test_filtered.py). The integrals begin anew in every chunk: no digit is
lost in long motions.

The filtered motion is matched with the path like any other (matching.py): contour, vertices, order. Limits are judged on the setpoints:
a mean never exceeds what it is the mean of. A full stop is a vertex like any other: the filtered motion need not rest there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.verify import contour, findings
from planner.verify.findings import Look
from planner.verify.follow import Each, follow
from planner.verify.pieces import ProgramPieces
from planner.verify.times import AnyMotion
from planner.verify.verdict import AfterFilters

NOTE = "after the filters"
STEPS_PER_PERIOD, STEPS_PER_FILTER = 4, 8  # of the times at which filters are evaluated (module text)
CHUNK = 50_000  # times evaluated at once: 5 MB with three axes

At = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # times (T,) -> position, velocity (T, A)


def filtered(
    at: At, end: float, filters: tuple[float, ...], dt: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times (T,) and positions (T, A) of a motion behind moving averages, chunk by chunk, from its start until they are empty.

    at      : the motion at ascending times within [0, end]
    end     : of the motion [s]
    filters : their lengths [s]
    dt      : interpolation period [s]
    """
    h = min(dt / STEPS_PER_PERIOD, min(filters, default=np.inf) / STEPS_PER_FILTER)
    before = sum(int(np.ceil(T / h)) for T in filters)
    count = int(np.ceil((end + sum(filters)) / h)) + 1
    for first in range(0, count, CHUNK):
        t = h * np.arange(first - before, min(first + CHUNK, count), dtype=np.float64)
        inside = np.clip(t, 0.0, end)
        place, of = np.unique(inside, return_inverse=True)
        x, v = (column[of] for column in at(place))
        v[(t < 0.0) | (t > end)] = 0.0
        for T in filters:
            x, v = _mean(x, v, h, T)
        yield t[before:], x


def _mean(x: FloatArray, v: FloatArray, h: float, T: float) -> tuple[FloatArray, FloatArray]:
    """Mean over the last T of a motion at times h apart, and its derivative; from the first time on for which that is known."""
    behind = int(np.ceil(T / h))
    origin = x[0].copy()
    x = x - origin
    area = h * (x[:-1] + x[1:]) / 2.0 + h * h * (v[:-1] - v[1:]) / 12.0
    integral = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(area, axis=0)])
    # T ago lies in the interval that begins `behind` steps ago, at the share w of it.
    w = behind - T / h
    p, q = x[:-behind], x[1 : len(x) - behind + 1]
    dp, dq = h * v[:-behind], h * v[1 : len(x) - behind + 1]
    part = (
        p * (w - w**3 + w**4 / 2)
        + q * (w**3 - w**4 / 2)
        + dp * (w**2 / 2 - 2 * w**3 / 3 + w**4 / 4)
        + dq * (w**4 / 4 - w**3 / 3)
    )
    value = (
        p * (1 - 3 * w**2 + 2 * w**3)
        + q * (3 * w**2 - 2 * w**3)
        + dp * (w - 2 * w**2 + w**3)
        + dq * (w**3 - w**2)
    )
    mean = (integral[behind:] - integral[:-behind] - h * part) / T
    return mean + origin, (x[behind:] - value) / T


def motion_asked(motion: AnyMotion, dt: float) -> At:
    """A motion that can be asked at any time."""

    def at(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        seen = motion.at(times, dt)
        return seen.position, seen.velocity.copy()

    return at


def motion_of_samples(trajectory: Trajectory) -> At:
    """A motion of which samples are known and nothing else: cubics through the positions, of the velocities that their differences
    show, at rest at both ends."""
    t, p = trajectory.t, trajectory.position
    v = np.zeros_like(p)
    if len(t) > 2:
        v[1:-1] = np.gradient(p, t, axis=0)[1:-1]

    def at(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.clip(np.searchsorted(t, t[0] + times, side="right") - 1, 0, max(len(t) - 2, 0))
        if len(t) < 2:
            return np.repeat(p, len(times), axis=0), np.zeros((len(times), p.shape[1]))
        step = (t[k + 1] - t[k])[:, None]
        w = ((t[0] + times - t[k])[:, None]) / step
        chord = p[k + 1] - p[k]
        b, c = v[k] * step, v[k + 1] * step
        place = p[k] + w * (b + w * ((3 * chord - 2 * b - c) + w * (b + c - 2 * chord)))
        slope = b + w * (2 * (3 * chord - 2 * b - c) + w * 3 * (b + c - 2 * chord))
        return place, slope / step

    return at


def look_behind(
    at: At,
    end: float,
    filters: tuple[float, ...],
    dt: float,
    pieces: ProgramPieces,
    each: Each | None = None,
) -> Look:
    """Match the filtered motion with the path.

    each : called with times (T,) [s], distance over budget (T,) and places of every chunk
    """
    return follow(filtered(at, end, filters, dt), pieces, NOTE, each=each)


def after_filters(
    trajectory: Trajectory,
    motion: AnyMotion | None,
    toolpath: Toolpath,
    machine: Machine,
    pieces: ProgramPieces,
) -> AfterFilters | None:
    """What the machine's filters leave of the tolerance; None for a machine without.

    motion : what the samples were taken from; None for cubics through the samples
    """
    if machine.fir is None:
        return None
    at = motion_of_samples(trajectory) if motion is None else motion_asked(motion, machine.dt)
    end, lengths = trajectory.cycle_time if motion is None else motion.end, machine.fir.time_constants

    def read(pieces: ProgramPieces) -> list[Look]:
        return [look_behind(at, end, lengths, machine.dt, pieces)]

    looks = read(pieces)
    apart = contour.apart(looks, pieces, read)
    check = apart.contour_check(toolpath)
    faults = [check.sentence(toolpath.axes)] if check.broken else []
    faults += apart.vertex_faults(toolpath)
    faults += findings.order(looks, toolpath, pieces)[2]
    faults = faults or findings.out_of_order(looks, toolpath, pieces)
    return AfterFilters(
        contour=check,
        vertex=apart.vertex_check(toolpath),
        contour_error_mm=apart.contour_error(),
        vertex_error_mm=apart.vertex_error(),
        faults=tuple(faults),
    )
