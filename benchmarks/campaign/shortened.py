"""Jobs of the campaign in few samples: the same motion in less time, by faster limits and feeds and a longer period."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from planner.machine import Axis, Machine
from planner.machine.parts import MAGNITUDE_MAX
from planner.nc.program import Program

DWELL_MAX = 0.05  # [s]
VELOCITY_MAX, ACCELERATION_MAX, JERK_MAX = 4e3, 1e5, 3e7  # of a job that is made quicker [mm/s, mm/s2, mm/s3]


def shortened(program: Program, machine: Machine, samples: int, period_max: float) -> tuple[Program, Machine]:
    """The job with a larger period, faster limits and shorter dwells, if its motion would have more samples than that;
    periods are at most `period_max` [s]."""
    program = dataclasses.replace(program, dwell=np.minimum(program.dwell, DWELL_MAX))
    time = duration(program, machine)
    dt = float(np.clip(time / samples, machine.dt, period_max))
    machine = machine.model_copy(update={"dt": dt})
    faster = time / (samples * dt)
    for _ in range(2):  # the second time for what the limits do not allow
        if faster > 1.0:
            program, machine = quicker(program, machine, faster)
            faster = duration(program, machine) / (samples * dt)
    return program, machine


def quicker(program: Program, machine: Machine, by: float) -> tuple[Program, Machine]:
    """The same motion in a time that is shorter by a factor: feeds, velocities, accelerations and jerks by its powers, as
    far as a machine goes."""
    axes = {
        letter: Axis(
            velocity=max(min(a.velocity * by, VELOCITY_MAX), a.velocity),
            acceleration=max(min(a.acceleration * by**2, ACCELERATION_MAX), a.acceleration),
            jerk=max(min(a.jerk * by**3, JERK_MAX), a.jerk),
            wrapped=a.wrapped,
        )
        for letter, a in machine.axes.items()
    }
    update: dict[str, Any] = {"axes": axes}
    if machine.feed_max is not None:
        update["feed_max"] = machine.feed_max * by
    if machine.normal_acceleration is not None:
        update["normal_acceleration"] = min(machine.normal_acceleration * by**2, MAGNITUDE_MAX)
    return dataclasses.replace(program, feed=program.feed * by), machine.model_copy(update=update)


def duration(program: Program, machine: Machine) -> float:
    """How long the program takes from stop to stop, about [s]."""
    position = np.vstack([program.start, program.end])
    way = np.abs(np.diff(position, axis=0))
    for k, block in enumerate(program.arc_block):
        radius = np.linalg.norm((position[block] - program.arc_center[k])[:3])
        way[block, :3] = np.maximum(way[block, :3], radius * abs(program.arc_sweep[k]))
    for block, points in zip(program.splines.block, program.splines.points, strict=True):
        way[block] += np.abs(np.diff(points, axis=0)).sum(axis=0)
    rotary = np.array([letter in "abc" for letter in program.axes])
    angular = np.where(rotary, 180.0 / np.pi, 1.0)
    total = float(program.dwell.sum())
    feed = np.where(np.isfinite(program.feed), program.feed, np.inf)
    total += float((np.linalg.norm(way, axis=1) / feed).sum())
    for k, letter in enumerate(program.axes):
        if letter in machine.axes:
            axis, run = machine.axes[letter], way[:, k] * angular[k]
            total += float(
                (
                    run / axis.velocity + 2 * np.sqrt(run / axis.acceleration) + 3 * np.cbrt(run / axis.jerk)
                ).sum()
            )
    if machine.feed_max is not None:
        total += float(np.linalg.norm(way, axis=1).sum()) / machine.feed_max
    return total
