"""A program that a control's own planner runs best: the planned path as straight moves at the planned feeds, if that is faster.

grbl, Klipper and Marlin stay on the path and slow down at its corners, so a smooth path inside the tolerance can let them go faster,
with F words that keep the axes within their limits in its bends; how far apart its points should be depends on how they look ahead
and on the time of a line. Their times are predicted by short models (models.py), for the program as it is and for the planned path
with chords of several widths (`SHARES` of what is allowed); the fastest is written. LinuxCNC rounds corners itself and has a model and
candidates of its own (for_linuxcnc.py); benchmarks/results/controls.md says how they did.

Plan and chords share the tolerance: what the verdict found of the plan's errors, the chords, and the corners of LinuxCNC add up to
it at most. A plan that uses all of it leaves no room; one with a tenth less does.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import MICROMETRE
from planner.control_files.chords import DECIMALS, Polyline, planned_polyline, programmed_polyline
from planner.control_files.dialect import DIALECTS, polyline_text
from planner.control_files.for_linuxcnc import best, own_words, standing, with_mode
from planner.control_files.for_linuxcnc import candidates as candidates_of
from planner.control_files.models import CONTROLS, predicted_time
from planner.job.plan import Plan
from planner.machine import Machine

SHARES = (
    1.0,
    0.5,
    0.25,
    0.1,
)  # of the room for chords: wider ones need fewer lines, narrower ones turn less at each
ROUNDING = 2.0 * 10.0**-DECIMALS  # room that coordinates need [mm]
LESS = 0.9  # of the tolerance: what a plan should take that leaves room for chords
LITTLE = 0.05  # of the tolerance: room below this is worth a note
LINUXCNC = "linuxcnc"


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What was written.

    file      : its name
    sentence  : what it holds
    predicted : predicted times by candidate [s]; empty for a program that LinuxCNC gets as it is, with a path mode of its own
    note      : what would leave the chords more room, or None
    """

    file: str
    sentence: str
    predicted: dict[str, float]
    note: str | None = None


def write_program(directory: Path, plan: Plan, control: str, tolerance: float) -> Exported:
    """Write a program for a control into an existing directory.

    control   : "grbl", "klipper", "marlin" or "linuxcnc"
    tolerance : of the path [mm], which plan and chords share

    Where the plan leaves no room for chords the program as it is is written, and a note says so. Raises InputError if the motion leaves
    the program, and for a program with the tool centre point on.
    """
    if plan.joints is not None:
        raise InputError(
            "a program with the tool centre point on: chords and corners are reckoned in the axes, not at the tip; planned.ngc has its "
            "planned feeds, and --for linuxcnc-stream and --for pvt play the setpoints of its joints",
            source=plan.program.source,
        )
    if control == LINUXCNC:
        return _for_linuxcnc(directory, plan, tolerance)
    room = _room(plan, tolerance)
    candidates: dict[str, Polyline] = {}
    for share in SHARES if room is not None else ():
        chords = share * (room or 0.0)
        candidates[f"planned path, chords within {chords / MICROMETRE:.3g} um"] = planned_polyline(
            plan, chords
        )
    candidates["program as it is"] = programmed_polyline(plan, room or tolerance)
    predicted = {name: _predicted(line, plan, control) for name, line in candidates.items()}
    name = min(predicted, key=predicted.__getitem__)
    line, file = candidates[name], f"{control}.gcode"
    _write(directory / file, line, plan, control, "")
    return Exported(
        file=file,
        sentence=f"{name}, {len(line.feed):,} moves",
        predicted=predicted,
        note=_no_room(plan, tolerance) if room is None else _little_room(room, plan, tolerance),
    )


def _for_linuxcnc(directory: Path, plan: Plan, tolerance: float) -> Exported:
    """`write_program` for LinuxCNC."""
    room, text = _room(plan, tolerance), own_words(plan.program, plan)
    found = candidates_of(plan, tolerance, room or 0.0, text)
    chosen, file = best(found), f"{LINUXCNC}.ngc"
    if chosen.line is None:
        assert text is not None
        (directory / file).write_bytes(with_mode(text, chosen.mode))
        said = "its own geometry and words"
    else:
        _write(directory / file, chosen.line, plan, LINUXCNC, chosen.mode)
        said = f"{len(chosen.line.feed):,} moves"
    note = _no_room(plan, tolerance) if room is None else _little_room(room, plan, tolerance)
    return Exported(
        file=file,
        sentence=", ".join(part for part in (chosen.name, said, chosen.mode) if part),
        predicted={one.name: one.time for one in found if np.isfinite(one.time)},
        note=note
        if len(found) > 1
        else None,  # a program with its own path mode is written as it is, whatever the room
    )


def _write(file: Path, line: Polyline, plan: Plan, control: str, mode: str) -> None:
    axes = _axes(plan)
    rapid = _rapid_speed(line, plan.machine, axes)
    text = polyline_text(line, plan.program, axes, rapid, DIALECTS[control], mode)
    file.write_text(text, encoding="ascii", errors="replace")


def _axes(plan: Plan) -> tuple[str, ...]:
    return plan.toolpath.axes


def _room(plan: Plan, tolerance: float) -> float | None:
    """How far chords may miss the planned motion [mm]; None if that is nothing. Raises InputError if the motion leaves the program."""
    left = tolerance - _used(plan)
    return None if left < 2.0 * ROUNDING else left - ROUNDING


def _used(plan: Plan) -> float:
    """What the plan takes of the tolerance [mm]. Raises InputError if the motion leaves the program."""
    verdict = plan.verdict
    assert verdict is not None
    if verdict.contour_error_mm is None or verdict.vertex_error_mm is None:
        raise InputError(
            "the motion leaves the program, so there is no telling what chords may add; see its verdict"
        )
    return max(verdict.contour_error_mm, verdict.vertex_error_mm)


def _no_room(plan: Plan, tolerance: float) -> str:
    return (
        f"the plan uses {_used(plan) / MICROMETRE:.3f} of {tolerance / MICROMETRE:g} um, which leaves no room for chords: plan with "
        f"--tolerance {LESS * tolerance:.4g}, and export with --tolerance {tolerance:g}"
    )


def _little_room(room: float, plan: Plan, tolerance: float) -> str | None:
    if room > LITTLE * tolerance:
        return None
    return (
        f"the plan uses {_used(plan) / MICROMETRE:.3f} of {tolerance / MICROMETRE:g} um, which leaves little room for chords: a plan "
        f"with --tolerance {LESS * tolerance:.4g}, exported with --tolerance {tolerance:g}, may be faster on the control"
    )


def _predicted(line: Polyline, plan: Plan, control: str) -> float:
    """Time that a control takes for a polyline, dwells included [s]."""
    stands = standing(plan, line)
    feed = np.where(line.rapid, np.inf, line.feed)
    moving = predicted_time(line.points, feed, stands, plan.machine, _axes(plan), CONTROLS[control])
    return moving + float(plan.program.dwell.sum())


def _rapid_speed(line: Polyline, machine: Machine, axes: tuple[str, ...]) -> FloatArray:
    """(n,) highest speed of each move by the velocities of the axes [mm/s]."""
    step = np.diff(line.points, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        found: FloatArray = np.nanmin(machine.limits("velocity", axes) / np.abs(step / length), axis=1)
    return found
