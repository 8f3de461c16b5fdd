"""Laws of the campaign: the same job, changed, and what that may do to its time.

    scale      lengths, limits and tolerance times k; angles as they are at a radius times k: the same time
    mirror     x to -x: the same time
    reverse    the program from its end to its start: the same time
    split      a line as two: the same time
    looser     one limit of the machine, the feed or the tolerance larger: no more time

Each is allowed `ALLOWED` of the time, and for the periods that the delivered samples are rounded to, one for each full stop. Not every
method promises every law (`BREAKS`).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import Array
from planner.geometry.build import ZERO_LENGTH
from planner.machine import Axis, Machine
from planner.machine.parts import MAGNITUDE_MAX
from planner.nc.program import Kind, PathControl, Program, SplineTable

ALLOWED = 1e-3  # of the time [-]
LAWS = ("scale", "mirror", "reverse", "split", "looser")
LOOSER = ("velocity", "acceleration", "jerk", "tolerance", "feed")
# What a method does not promise. `stop` stops where a line is split; the papers' methods as they are filter by V/A and A/J whatever
# that costs (fir-plain by twice sqrt(V/J), which is less, where A is large).
BREAKS = {
    "stop": ("split",),
    "fir-plain": ("looser velocity", "looser feed"),
    "fir-spline-plain": ("looser velocity", "looser feed", "looser acceleration"),
}
LINEAR, ROTARY = "xyzuvw", "abc"
Rng = np.random.Generator


@dataclass(frozen=True, eq=False, kw_only=True)
class Changed:
    """A law's name, and the job that it speaks of."""

    law: str
    program: Program
    machine: Machine
    tolerance: float | None


def changed(program: Program, machine: Machine, tolerance: float | None, rng: Rng) -> Changed | None:
    """A job changed by a law of those that apply to it; None for programs with an extruder or a thread, whose feeds are not free."""
    if len(program.extruded) or len(program.synchronised) or program.tool_point is not None:
        return None
    law = str(rng.choice(LAWS))
    if law == "scale":
        k = float(10 ** rng.uniform(-1.0, 1.0))
        more = None if tolerance is None else tolerance * k
        return Changed(
            law=law, program=scaled(program, k), machine=scaled_machine(machine, k), tolerance=more
        )
    if law == "mirror":
        return Changed(law=law, program=mirrored(program), machine=machine, tolerance=tolerance)
    if law == "reverse":
        if len(np.unique(program.path_control)) > 1 or not (tolerance or ends_alike(program)):
            return None
        return Changed(law=law, program=reversed_program(program), machine=machine, tolerance=tolerance)
    if law == "split":
        other = split(program, rng)
        return (
            None if other is None else Changed(law=law, program=other, machine=machine, tolerance=tolerance)
        )
    return looser(program, machine, tolerance, str(rng.choice(LOOSER)), float(rng.uniform(1.05, 2.0)))


def broken(changed: Changed, before: float, after: float, slack: float) -> float:
    """By what share of the time a law is broken; 0 where it holds. Times [s], slack [s] for the rounding to periods."""
    off = (
        after - before if changed.law.startswith("looser") or changed.law == "split" else abs(after - before)
    )
    return max(0.0, (off - slack) / before - ALLOWED)


def holds(law: str, method: str) -> bool:
    """Whether a method promises a law: all but those of `BREAKS`."""
    return law not in BREAKS.get(method, ())


def scaled(program: Program, k: float) -> Program:
    """All lengths times k, and the feeds of what moves them."""
    of = np.array([k if letter in LINEAR else 1.0 for letter in program.axes])
    position = np.vstack([program.start, program.end])
    linear = np.array([letter in LINEAR for letter in program.axes])
    moves = (np.abs(np.diff(position, axis=0))[:, linear] > 0).any(axis=1)
    moves[program.arc_block] = True
    moves[program.splines.block] = True
    return dataclasses.replace(
        program,
        start=program.start * of,
        end=program.end * of,
        arc_center=program.arc_center * of,
        feed=program.feed * np.where(moves, k, 1.0),
        tolerance=program.tolerance * k,
        splines=dataclasses.replace(program.splines, points=program.splines.points * of),
    )


def scaled_machine(machine: Machine, k: float) -> Machine:
    """The machine whose lengths are times k."""
    axes = {
        letter: axis
        if letter in ROTARY
        else Axis(velocity=axis.velocity * k, acceleration=axis.acceleration * k, jerk=axis.jerk * k)
        for letter, axis in machine.axes.items()
    }
    update: dict[str, Any] = {
        "axes": axes,
        "tolerance": machine.tolerance * k,
        "rotary_radius": machine.radius * k,
    }
    for name in ("feed_max", "normal_acceleration"):
        value = getattr(machine, name)
        update[name] = None if value is None else min(value * k, MAGNITUDE_MAX)  # no limit at all
    return machine.model_copy(update=update)


def mirrored(program: Program) -> Program:
    """x to -x."""
    of = np.array([-1.0 if letter == "x" else 1.0 for letter in program.axes])
    return dataclasses.replace(
        program,
        start=program.start * of,
        end=program.end * of,
        arc_center=program.arc_center * of,
        arc_sweep=np.where(program.arc_normal == 0, program.arc_sweep, -program.arc_sweep),
        splines=dataclasses.replace(program.splines, points=program.splines.points * of),
    )


def reversed_program(program: Program) -> Program:
    """The way back: path control and tolerance of a joint, which the last block says that moves before it, stay those of the joint."""
    position = np.vstack([program.start, program.end])
    count = len(program)
    says = _moving_before(program)
    control, joint_tolerance = program.path_control[says], program.tolerance[says]
    arc_end = position[program.arc_block + 1]
    center = program.arc_center.copy()
    rows = np.arange(len(center))
    center[rows, program.arc_normal] = arc_end[rows, program.arc_normal]
    center[:, 3:] = arc_end[:, 3:]
    table = program.splines
    return dataclasses.replace(
        program,
        start=position[-1],
        end=position[-2::-1],
        arc_block=(count - 1 - program.arc_block)[::-1],
        arc_center=center[::-1],
        arc_normal=program.arc_normal[::-1],
        arc_sweep=-program.arc_sweep[::-1],
        splines=SplineTable(
            block=(count - 1 - table.block)[::-1],
            points=table.points[::-1, ::-1],
            weights=table.weights[::-1, ::-1],
        ),
        path_control=np.append(control[-2::-1], control[-1:]),
        tolerance=np.append(joint_tolerance[-2::-1], joint_tolerance[:1]),
        events=(),
        frame=np.zeros(0, dtype=np.int32),
        frames=(),
        **{name: getattr(program, name)[::-1] for name in ("kind", "feed", "dwell", "line")},
    )


def _moving_before(program: Program) -> Array:
    """(B,) the last block up to each that moves; for those before the first one that one."""
    position = np.vstack([program.start, program.end])
    moves = np.linalg.norm(np.diff(position, axis=0), axis=1) > ZERO_LENGTH
    moves[program.arc_block] = moves[program.splines.block] = True
    last = np.maximum.accumulate(np.where(moves, np.arange(len(program)), -1))
    return np.where(last < 0, moves.argmax(), last)


def ends_alike(program: Program) -> bool:
    """Whether the last two blocks that move have the same tolerance: the way back has that of the joint between them at its start."""
    said = program.tolerance[np.unique(_moving_before(program))]
    return bool(np.array_equal(said[-2:-1], said[-1:], equal_nan=True)) or len(said) < 2


def split(program: Program, rng: Rng) -> Program | None:
    """A line as two blocks, one straight after the other; None for a program without lines."""
    position = np.vstack([program.start, program.end])
    long = np.linalg.norm(np.diff(position, axis=0), axis=1) > 1e-3
    lines = np.flatnonzero(long & np.isin(program.kind, (Kind.LINE, Kind.RAPID)))
    if not len(lines):
        return None
    k = int(rng.choice(lines))
    share = float(rng.uniform(0.2, 0.8))
    rows = np.insert(np.arange(len(program)), k, k)
    end = program.end[rows].copy()
    end[k] = position[k] + share * (position[k + 1] - position[k])
    control = program.path_control[rows].copy()
    if control[k] == PathControl.EXACT_STOP:
        control[k] = PathControl.EXACT_PATH
    table = program.splines
    return dataclasses.replace(
        program,
        end=end,
        path_control=control,
        arc_block=program.arc_block + (program.arc_block > k),
        splines=dataclasses.replace(table, block=table.block + (table.block > k)) if len(table) else table,
        events=(),
        frame=np.zeros(0, dtype=np.int32),
        frames=(),
        **{name: getattr(program, name)[rows] for name in ("kind", "feed", "dwell", "line", "tolerance")},
    )


def looser(program: Program, machine: Machine, tolerance: float | None, what: str, by: float) -> Changed:
    """One limit larger by a factor."""
    law = f"looser {what}"
    if what == "tolerance":
        program = dataclasses.replace(program, tolerance=program.tolerance * by)
        machine = machine.model_copy(update={"tolerance": machine.tolerance * by})
        tolerance = None if tolerance is None else tolerance * by
    elif what == "feed":
        program = dataclasses.replace(program, feed=program.feed * by)
        if machine.feed_max is not None:
            machine = machine.model_copy(update={"feed_max": machine.feed_max * by})
    else:
        axes = {
            letter: axis.model_copy(update={what: getattr(axis, what) * by})
            for letter, axis in machine.axes.items()
        }
        machine = machine.model_copy(update={"axes": axes})
    return Changed(law=law, program=program, machine=machine, tolerance=tolerance)
