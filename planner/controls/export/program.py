"""A program that a control's own planner runs best: the planned path as straight moves at the planned feeds,
if that is faster.

grbl, Klipper and Marlin stay on the path and slow down at its corners, so a smooth path inside the tolerance
can let them go faster, with F words that keep the axes within their limits in its bends; how far apart its
points should be depends on how they look ahead and on the time of a line. Their times are predicted by short
models (controls/timing), for the program as it is and for the planned path with chords of several widths; the
fastest is written (candidates.py). LinuxCNC rounds corners itself; benchmarks/results/controls.md says how
they did.

Plan and chords share the tolerance: what the verdict found of the plan's errors, the chords, and the corners
of LinuxCNC add up to it at most. A plan that uses all of it leaves no room; one with a tenth less does.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.errors import InputError
from planner.controls.export.candidates import Candidate, Candidates, best_first, candidates
from planner.controls.export.controls import CONTROLS, LINUXCNC
from planner.controls.export.output import FIRST_RUN, assumptions
from planner.motion.trajectory import require_rest
from planner.planning.job.plan import Plan

NO_JERK = "has no limit of the jerk, which the plan keeps: so it can be faster than the plan"


@dataclass(frozen=True, kw_only=True)
class Exported:
    """The program as written."""

    file: str  # its name
    sentence: str  # what it holds
    # predicted times by candidate [s]; empty for a program that LinuxCNC gets as it is, with its own path
    # mode
    predicted: dict[str, float]
    assumptions: tuple[str, ...] = ()  # where coordinates and start are, and how a first run goes
    # what was left out or written another way, what the control needs, and what would leave the chords more
    # room
    notes: tuple[str, ...] = ()


def write_program(directory: Path, plan: Plan, control: str, tolerance: float) -> Exported:
    """Write a program for a control into an existing directory.

    control   : "grbl", "klipper", "marlin" or "linuxcnc"
    tolerance : of the path [mm], which plan and chords share

    Where the plan leaves no room for chords the program's own path is written, and a note says so. Raises
    InputError if the motion leaves the program or is not from rest to rest, for a program with the tool centre point on, and with its
    line for what the control has no words for.
    """
    if plan.joints is not None:
        raise InputError(
            "a program with the tool centre point on: chords and corners are reckoned in the axes, not at the tip; planned.ngc has its "
            "planned feeds, and --for linuxcnc-stream and --for pvt play the setpoints of its joints",
            source=plan.program.source,
        )
    require_rest(plan.trajectory is None or plan.trajectory.from_rest_to_rest)
    job = Candidates(plan, CONTROLS[control], tolerance)
    found = candidates(job)
    chosen, data, notes = _first_written(job, best_first(job, found))
    file = f"{control}.ngc" if control == LINUXCNC.name else f"{control}.gcode"
    (directory / file).write_bytes(data)
    if chosen.replaced is not None and job.why_not:
        notes = (f"the program as it is is no {control} program: {job.why_not}", *notes)
    if len(found) > 1 or job.room is None:
        notes = (*notes, *job.room_notes())
    if chosen.replaced is None:
        sentence = f"{chosen.name}, byte for byte" + f" behind a line G21 {chosen.mode}" * bool(chosen.mode)
    else:
        sentence = ", ".join(filter(None, (chosen.name, f"{len(chosen.line.feed):,} moves", chosen.mode)))
    return Exported(
        file=file,
        sentence=sentence,
        predicted={one.name: one.time for one in found if np.isfinite(one.time)},
        assumptions=(*assumptions(job.source, as_it_is=chosen.replaced is None), FIRST_RUN),
        notes=notes,
    )


def _first_written(job: Candidates, order: list[Candidate]) -> tuple[Candidate, bytes, tuple[str, ...]]:
    """The first candidate for which the control has the words. Raises InputError if there is none."""
    refused: InputError | None = None
    for one in order:
        try:
            return one, *job.written(one)
        except InputError as fault:
            refused = refused or fault
    assert refused is not None
    raise refused
