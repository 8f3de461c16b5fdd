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
