"""A program that a control's own planner runs best: the planned path as straight moves at the planned feeds, if that is faster.

grbl, Klipper and Marlin stay on the path and slow down at its corners, so a smooth path inside the tolerance can let them go faster,
with F words that keep the axes within their limits in its bends; how far apart its points should be depends on how they look ahead
and on the time of a line. Their times are predicted by short models (models.py), for the program as it is and for the planned path
with chords of several widths (`SHARES` of what is allowed); the fastest is written. For LinuxCNC there is no model: the planned path
is written, with narrow chords and G64 P for the rest of the room, and benchmarks/results/controls.md says how it did.

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
LINUXCNC = "linuxcnc"


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What was written.

    file      : its name
    sentence  : what it holds
    predicted : predicted times by candidate [s]; empty for LinuxCNC
    """

    file: str
    sentence: str
    predicted: dict[str, float]


def write_program(directory: Path, plan: Plan, control: str, tolerance: float) -> Exported:
    """Write a program for a control into an existing directory.

    control   : "grbl", "klipper", "marlin" or "linuxcnc"
    tolerance : of the path [mm], which plan and chords share

    Raises InputError if the plan leaves no room for chords, or leaves the program.
    """
    room = _room(plan, tolerance)
    dialect = DIALECTS[control]
    candidates: dict[str, Polyline] = {}
    for share in SHARES if control != LINUXCNC else SHARES[-1:]:
        candidates[f"planned path, chords within {share * room / MICROMETRE:.3g} um"] = planned_polyline(
            plan, share * room
        )
    predicted: dict[str, float] = {}
    if control != LINUXCNC:
        candidates["program as it is"] = programmed_polyline(plan, room)
        predicted = {name: _predicted(line, plan, control) for name, line in candidates.items()}
    name = min(predicted, key=predicted.__getitem__) if predicted else next(iter(candidates))
    line = candidates[name]
    mode = f"G64 P{(1.0 - SHARES[-1]) * room:.4f} Q0" if control == LINUXCNC else ""
    text = polyline_text(
        line, plan.program, _axes(plan), _rapid_speed(line, plan.machine, _axes(plan)), dialect, mode
    )
    file = f"{control}.{'ngc' if control == LINUXCNC else 'gcode'}"
    (directory / file).write_text(text, encoding="ascii", errors="replace")
    return Exported(file=file, sentence=f"{name}, {len(line.feed):,} moves", predicted=predicted)


def _axes(plan: Plan) -> tuple[str, ...]:
    return plan.toolpath.axes


def _room(plan: Plan, tolerance: float) -> float:
    """How far chords may miss the planned motion [mm]. Raises InputError if that is nothing."""
    verdict = plan.verdict
    assert verdict is not None
    if verdict.contour_error_mm is None or verdict.vertex_error_mm is None:
        raise InputError(
            "the motion leaves the program, so there is no telling what chords may add; see its verdict"
        )
    used = max(verdict.contour_error_mm, verdict.vertex_error_mm)
    if tolerance - used < 2.0 * ROUNDING:
        raise InputError(
            f"the plan uses {used / MICROMETRE:.3f} of {tolerance / MICROMETRE:g} um, which leaves no room for chords: plan with "
            f"--tolerance {0.9 * tolerance:.4g}, and export with --tolerance {tolerance:g}"
        )
    return tolerance - used - ROUNDING


def _predicted(line: Polyline, plan: Plan, control: str) -> float:
    """Time that a control takes for a polyline, dwells included [s]."""
    program = plan.program
    stands = np.zeros(len(line.points), dtype=bool)
    still = np.flatnonzero(~np.isin(np.arange(len(program)), plan.toolpath.block))
    stands[np.searchsorted(line.block, still)] = True
    feed = np.where(line.rapid, np.inf, line.feed)
    moving = predicted_time(line.points, feed, stands, plan.machine, _axes(plan), CONTROLS[control])
    return moving + float(program.dwell.sum())


def _rapid_speed(line: Polyline, machine: Machine, axes: tuple[str, ...]) -> FloatArray:
    """(n,) highest speed of each move by the velocities of the axes [mm/s]."""
    step = np.diff(line.points, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        found: FloatArray = np.nanmin(machine.limits("velocity", axes) / np.abs(step / length), axis=1)
    return found
