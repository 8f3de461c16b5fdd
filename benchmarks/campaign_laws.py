"""Laws that plans of a campaign keep: which change of a job changes nothing, and which one does not cost time."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

import planner
from benchmarks.campaign_jobs import Job
from planner.base.arrays import FloatArray
from planner.machine import Axis, Machine
from planner.nc.program import Kind, Program

ALLOWED = 1e-3  # share of the cycle time [-]
LARGER, LOOSER, WIDER = 2.0, 1.1, 1.5  # of all lengths, of the limits of the axes, of the tolerance [-]
COUNTED = "scaled", "reversed", "mirrored", "cut in two"  # laws that hold in both directions


def asked(job: Job, plan: Any) -> dict[str, float]:
    """By what share of the time each law is missed [-]; 0 or less where a law asks for no more time."""
    found: dict[str, float] = {}
    for name, program, machine, tolerance in _changed(job):
        other = planner.plan(program, machine, method=job.method, tolerance=tolerance, **job.settings)
        if other.trajectory is None or other.verdict is None or not other.verdict.passed:
            found[name] = float("inf")
            continue
        off = other.cycle_time / plan.cycle_time - 1.0
        found[name] = abs(off) if name in COUNTED else off
    return found


def _changed(job: Job) -> Iterator[tuple[str, Program, Machine, float | None]]:
    program, machine, tolerance = job.program, job.machine, job.tolerance
    assert program is not None
    simple = machine.fir is None and not machine.modes and set(program.axes) == set("xyz")
    if not simple or len(program.splines.block) or len(program.synchronised):
        return
    axes = {letter: _axis(axis, LOOSER, LOOSER, LOOSER) for letter, axis in machine.axes.items()}
    yield "looser limits", program, machine.model_copy(update={"axes": axes}), tolerance
    wide = tolerance * WIDER if tolerance is not None else None
    both = machine.model_copy(update={"tolerance": machine.tolerance * WIDER})
    yield "wider tolerance", dataclasses.replace(program, tolerance=program.tolerance * WIDER), both, wide
    yield _scaled(program, machine, tolerance)
    if not len(program.arc_block) and (program.kind == Kind.LINE).all():
        yield (
            "reversed",
            _lines(program, np.vstack([program.start, program.end])[::-1], program.feed[::-1]),
            machine,
            tolerance,
        )
        yield (
            "mirrored",
            _lines(program, -np.vstack([program.start, program.end]), program.feed),
            machine,
            tolerance,
        )
        yield "cut in two", _cut(program), machine, tolerance


def _axis(axis: Axis, velocity: float, acceleration: float, jerk: float) -> Axis:
    return Axis(
        velocity=axis.velocity * velocity,
        acceleration=axis.acceleration * acceleration,
        jerk=axis.jerk * jerk,
        wrapped=axis.wrapped,
    )


def _scaled(
    program: Program, machine: Machine, tolerance: float | None
) -> tuple[str, Program, Machine, float | None]:
    k = LARGER
    update: dict[str, Any] = {
        "axes": {letter: _axis(axis, k, k, k) for letter, axis in machine.axes.items()},
        "tolerance": machine.tolerance * k,
        "feed_default": machine.feed_default * k,
    }
    for name in ("feed_max", "normal_acceleration"):
        if getattr(machine, name) is not None:
            update[name] = getattr(machine, name) * k
    larger = dataclasses.replace(
        program,
        start=program.start * k, end=program.end * k, feed=program.feed * k,
        tolerance=program.tolerance * k, arc_center=program.arc_center * k,
    )  # fmt: skip
    return "scaled", larger, machine.model_copy(update=update), None if tolerance is None else tolerance * k


def _lines(program: Program, points: FloatArray, feed: FloatArray) -> Program:
    """Lines through points, where path control and tolerance are the same all along; else the program as it is."""
    return dataclasses.replace(program, start=points[0].copy(), end=points[1:].copy(), feed=feed.copy())


def _cut(program: Program) -> Program:
    """Every line in two halves."""
    points = np.vstack([program.start, program.end])
    ends = np.stack([(points[:-1] + points[1:]) / 2.0, points[1:]], axis=1).reshape(-1, points.shape[1])
    twice = {
        name: np.repeat(getattr(program, name), 2)
        for name in ("kind", "feed", "dwell", "line", "path_control", "tolerance")
    }
    return dataclasses.replace(program, end=ends, frame=np.repeat(program.frame, 2), **twice)
