"""Motions of other programs on a polyline at a control's period: ruckig in one and in three axes, TOPP-RA; lines from rest to rest.

A control begins its next move with its next period, so every line takes a whole number of periods: the last sample of a line, where it
rests, is the first of the next.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import Machine

BELOW = 0.999999  # of every limit: rounding adds up
AXES = ("x", "y", "z")
Line = Callable[[FloatArray, FloatArray, float, Machine], tuple[float, Callable[[FloatArray], FloatArray]]]


def along(points: FloatArray, feed: float, machine: Machine, line: Line) -> tuple[FloatArray, FloatArray]:
    """(T,) times [s] and (T, 3) positions [mm] at the machine's period of lines (points (M + 1, 3) [mm], feed [mm/s]), one by one.

    line : of start and end, feed and machine: its duration, and its positions (T, 3) at times from 0
    """
    parts = [points[:1]]
    for start, end in pairwise(points):
        duration, positions = line(start, end, feed, machine)
        count = int(np.ceil(duration / machine.dt - 1e-9))
        x = positions(np.minimum(machine.dt * np.arange(1, count + 1), duration))
        x[-1] = end
        parts.append(x)
    x = np.concatenate(parts)
    return machine.dt * np.arange(len(x)), x


def at_times(
    points: FloatArray, feed: float, machine: Machine, line: Line, clock: Callable[[float], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """The lines as in `along`, each from where the one before ends, at the times that a clock makes of their duration [s]."""
    moves = [line(start, end, feed, machine) for start, end in pairwise(points)]
    begins = np.append(0.0, np.cumsum([duration for duration, _ in moves]))
    t = clock(float(begins[-1]))
    x = np.empty((len(t), points.shape[1]))
    on = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(moves) - 1)
    for k, (duration, positions) in enumerate(moves):
        if (on == k).any():
            x[on == k] = positions(np.clip(t[on == k] - begins[k], 0.0, duration))
    x[-1] = points[-1]
    return t, x


def every_period(dt: float) -> Callable[[float], FloatArray]:
    """The clock of a control: times from 0 at dt [s], the last period shorter, but no shorter than 1 us."""

    def times(end: float) -> FloatArray:
        t = np.append(np.arange(0.0, end, dt), end)
        return np.delete(t, -2) if t[-1] - t[-2] < 1e-6 else t

    return times


def _of_way(
    start: FloatArray, end: FloatArray, feed: float, machine: Machine
) -> tuple[FloatArray, list[float]]:
    """The direction of a line, and the limits of velocity, acceleration and jerk along it."""
    u = (end - start) / np.linalg.norm(end - start)
    with np.errstate(divide="ignore"):
        limits = [
            float((machine.limits(q, AXES) / np.abs(u)).min()) for q in ("velocity", "acceleration", "jerk")
        ]
    return u, [BELOW * min(limits[0], feed), BELOW * limits[1], BELOW * limits[2]]


def ruckig_way(start: FloatArray, end: FloatArray, feed: float, machine: Machine) -> Any:
    """Ruckig's move of the way along a line."""
    u, limits = _of_way(start, end, feed, machine)
    move = _ruckig([0.0], [float(np.linalg.norm(end - start))], [[limit] for limit in limits])
    return move.duration, lambda t: start + np.array([move.at_time(each)[0][0] for each in t])[:, None] * u


def ruckig_axes(start: FloatArray, end: FloatArray, feed: float, machine: Machine) -> Any:
    """Ruckig's move of three axes, in phase: on the line."""
    u, limits = _of_way(start, end, feed, machine)
    of_axes = [[max(limit * abs(c), limit * 1e-6) for c in u] for limit in limits]
    move = _ruckig(start.tolist(), end.tolist(), of_axes)
    return move.duration, lambda t: np.array([move.at_time(each)[0] for each in t])


def _ruckig(start: list[float], end: list[float], limits: list[list[float]]) -> Any:
    import ruckig

    task = ruckig.InputParameter(len(start))
    task.current_position, task.target_position = start, end
    task.max_velocity, task.max_acceleration, task.max_jerk = limits
    task.synchronization = ruckig.Synchronization.Phase
    move = ruckig.Trajectory(len(start))
    result = ruckig.Ruckig(len(start)).calculate(task, move)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise RuntimeError(f"ruckig: {result}")
    return move


def seven_phase_line(start: FloatArray, end: FloatArray, feed: float, machine: Machine) -> Any:
    """A line from rest to rest in closed form: in phases of constant jerk."""
    u, (v, a, j) = _of_way(start, end, feed, machine)
    length = float(np.linalg.norm(end - start))
    durations, jerks = _seven_phases(length, v, a, j)

    def positions(t: FloatArray) -> FloatArray:
        return start + np.minimum(_way(t, durations, jerks), length)[:, None] * u

    return float(durations.sum()), positions


def _seven_phases(length: float, v: float, a: float, j: float) -> tuple[FloatArray, FloatArray]:
    """(7,) durations and jerks of a way from rest to rest: jerk up, constant acceleration, jerk down, constant speed, and back."""
    low, high = 0.0, v
    for _ in range(100):  # the peak speed by bisection: the way from rest to rest grows with it
        peak = 0.5 * (low + high)
        up = max(peak / a + a / j, 2.0 * np.sqrt(peak / j)) if peak * j > a * a else 2.0 * np.sqrt(peak / j)
        low, high = (peak, high) if peak * up < length else (low, peak)
    peak = low
    ramp = a / j if peak * j > a * a else np.sqrt(peak / j)
    hold = max(peak / (j * ramp) - ramp, 0.0)
    cruise = length / peak - 2.0 * ramp - hold
    return np.array([ramp, hold, ramp, max(cruise, 0.0), ramp, hold, ramp]), j * np.array(
        [1.0, 0, -1, 0, -1, 0, 1]
    )


def _way(t: FloatArray, durations: FloatArray, jerks: FloatArray) -> FloatArray:
    s = v = a = 0.0
    way, begin = np.zeros(len(t)), 0.0
    for duration, jerk in zip(durations, jerks, strict=True):
        tau = np.clip(t - begin, 0.0, duration)
        inside = t >= begin
        way[inside] = (s + tau * (v + tau * (a / 2 + tau * jerk / 6)))[inside]
        s, v, a = (
            s + duration * (v + duration * (a / 2 + duration * jerk / 6)),
            v + duration * (a + duration * jerk / 2),
            a + duration * jerk,
        )
        begin += duration
    return way


def toppra_line(start: FloatArray, end: FloatArray, feed: float, machine: Machine) -> Any:
    """TOPP-RA's move of three axes along a line, under limits of velocity and acceleration."""
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("ERROR")
    length = float(np.linalg.norm(end - start))
    path = toppra.SplineInterpolator([0.0, length], np.stack([start, end]))
    v, a = (BELOW * machine.limits(q, AXES) for q in ("velocity", "acceleration"))
    v = np.minimum(v, BELOW * feed * np.abs(end - start) / length + 1e-9)
    limits = [
        constraint.JointVelocityConstraint(np.stack([-v, v], axis=1)),
        constraint.JointAccelerationConstraint(np.stack([-a, a], axis=1)),
    ]
    move = algorithm.TOPPRA(
        limits, path, gridpoints=np.linspace(0.0, length, 201), parametrizer="ParametrizeConstAccel"
    ).compute_trajectory()
    if move is None:
        raise RuntimeError("toppra: no motion")
    return float(move.duration), lambda t: np.asarray(move(np.minimum(t, move.duration)))


# By name: how a line is moved, and if jerk is limited.
PROGRAMS: dict[str, tuple[Line, bool]] = {
    "ruckig along the lines": (ruckig_way, True),
    "ruckig, three axes in phase": (ruckig_axes, True),
    "TOPP-RA": (toppra_line, False),
}
