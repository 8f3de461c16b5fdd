"""`planner verify`: judge a trajectory file.

The command line says what to judge it against. Without -m and --tolerance a file that `plan` wrote is judged with its own machine and
tolerance, and its program is read as it was for the plan, unless the command line has settings of the reader; the output says so. With
-m the tolerance is that of the machine, unless the program (G64 P) or --tolerance sets another.
Limits that a file declares as not kept are reported, and judged all the same.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.commands.options import (
    DEFAULT_MACHINE,
    JsonOption,
    QuietOption,
    ToleranceOption,
    takes_reading,
)
from planner.commands.progress import ProgressBar
from planner.commands.terminal import FAILED, guarded, say, show
from planner.nc.reading import AS_USUAL, Reading

if TYPE_CHECKING:
    from planner.machine import Machine
    from planner.verifier import Verdict


@guarded
@takes_reading
def verify_command(
    trajectory: Annotated[
        Path,
        typer.Argument(
            metavar="TRAJECTORY",
            help="trajectory file (.parquet, .csv, .npz), or directory that 'plan -o' wrote",
        ),
    ],
    job: Annotated[
        Path | None, typer.Argument(metavar="JOB", help="NC program (default: the one that TRAJECTORY names)")
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--machine",
            metavar="FILE",
            help=f"machine file, or name of a built-in machine (default: the one in TRAJECTORY, else {DEFAULT_MACHINE})",
        ),
    ] = None,
    tolerance: ToleranceOption = None,
    not_limited: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY",
            help="report this limit without judging it, for example jerk for a plan that does not limit it",
        ),
    ] = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
    *,
    reading: Reading,
) -> None:
    """Judge a trajectory file, from any source, against its program and a machine."""
    from planner.geometry.build import toolpath_from_program
    from planner.nc.reader import read_program
    from planner.nc.set_limits import limited
    from planner.planning.job.at_tip import Judged, judged
    from planner.report.summary import corner_summary, verdict_summary
    from planner.report.tables import assumed_lines, verdict_table
    from planner.report.trajectory_reader import FORMATS, read_trajectory, trajectory_file
    from planner.verifier import NOT_LIMITED_NAMES, fit_axes

    unjudged = tuple(not_limited or ())
    for name in unjudged:
        known_name("limit", name, NOT_LIMITED_NAMES)
    if job is not None and job.suffix[1:].lower() in FORMATS and trajectory.suffix[1:].lower() not in FORMATS:
        raise InputError(f"the trajectory comes first: planner verify {job} {trajectory}")
    trajectory = trajectory_file(trajectory)
    read = read_trajectory(trajectory)
    says = FileSays.of(read.metadata)
    limits, from_file = _machine(machine, trajectory, says)
    job = says.program_at(trajectory) if job is None else job
    taken = says.tolerance if machine is None and tolerance is None else None
    as_planned = reading == AS_USUAL
    program = read_program(job, limits, says.reading if as_planned else reading)
    limits = limited(limits, program.limits)
    toolpath = toolpath_from_program(program, limits, tolerance if taken is None else taken)
    if not len(toolpath):
        raise InputError("the program moves nothing: there is nothing to judge", source=str(job))
    motion, given, fitted = fit_axes(read.trajectory, read.given, toolpath)
    with ProgressBar(quiet=quiet) as progress:
        verdict = judged(
            motion,
            Judged(
                program=program,
                toolpath=toolpath,
                machine=limits,
                given=given,
                not_limited=unjudged,
                progress=lambda fraction: progress("verify", fraction),
            ),
        )
    notes = [*read.notes, *fitted, *verdict.notes]
    notes += [f"the file says: {text}" for text in says.sentences(from_file, taken is not None, as_planned)]
    notes += says.remedies(verdict, unjudged)
    budgets = toolpath.tolerance
    if as_json:
        about = {
            "corners": corner_summary(verdict.corners),
            "machine": limits.name,
            "tolerance_mm": float(budgets[0]) if (budgets == budgets[0]).all() else None,
            "cycle_time_s": motion.cycle_time,
            "notes": notes,
        }
        said = {"assumptions": program.assumptions, **verdict_summary(verdict), **about}
        say(json.dumps(said, indent=2))
    else:
        for note in notes:
            say(f"note: {note}", err=True)
        low, high = float(budgets.min()), float(budgets.max())
        asked = {
            "cycle time": f"{motion.cycle_time:.4f} s",
            "tolerance": f"{low:g} mm" if low == high else f"{low:g} to {high:g} mm",
        }
        title = f"{trajectory} on {job}, machine {limits.name}"
        show(*assumed_lines(program.assumptions), verdict_table(verdict, title, asked))
    if not verdict.passed:
        raise typer.Exit(FAILED)


def _machine(machine: str | None, trajectory: Path, says: FileSays) -> tuple[Machine, bool]:
    """The machine of the command line, else the one that the file brings, else the default; True if it is the file's."""
    from planner.machine import load_machine, machine_from_dict

    if machine is None and says.machine is not None:
        return machine_from_dict(says.machine, source=f"{trajectory} (its own machine)"), True
    return load_machine(machine or DEFAULT_MACHINE), False


@dataclass(frozen=True, kw_only=True)
class FileSays:
    """What a trajectory file says about itself. It is used where the command line is silent, always reported, and never a reason to
    pass.

    machine     : its machine, as in a machine file, or None
    tolerance   : the tolerance it was planned with [mm], or None
    not_limited : quantities that its plan did not limit
    reading     : how its program was read
    program     : the file of its program; "<text>" and the like where it had none; None where the file does not say
    """

    machine: dict[str, Any] | None
    tolerance: float | None
    not_limited: tuple[str, ...]
    reading: Reading = AS_USUAL
    program: str | None = None

    @classmethod
    def of(cls, metadata: dict[str, Any]) -> FileSays:
        """From the metadata of a file; entries of another type than expected are ignored."""
        machine, tolerance = metadata.get("machine"), metadata.get("tolerance_mm")
        free = metadata.get("not_limited")
        number = isinstance(tolerance, (int, float)) and not isinstance(tolerance, bool)
        return cls(
            machine=machine if isinstance(machine, dict) else None,
            tolerance=float(tolerance) if number and 0.0 < tolerance < math.inf else None,  # type: ignore[arg-type,operator]
            not_limited=tuple(name for name in free if isinstance(name, str))
            if isinstance(free, list)
            else (),
            reading=Reading.saved(metadata.get("reading")),
            program=name if isinstance(name := metadata.get("program"), str) else None,
        )

    def program_at(self, trajectory: Path) -> Path:
        """Where the program is that the file names. Raises InputError if it names none, or if that is not there."""
        from planner.report.export import program_file

        found = None if self.program is None else Path(program_file(trajectory.parent, self.program))
        if found is None or not os.path.isfile(found):
            where = "names no program" if found is None else f"names the program {found}, which is not there"
            raise InputError(f"{where}: planner verify {trajectory} JOB", source=str(trajectory))
        return found

    def sentences(self, machine_taken: bool, tolerance_taken: bool, reading_taken: bool) -> list[str]:
        """What the file says, and whether it was used."""
        said = []
        if self.machine is not None:
            taken = "taken" if machine_taken else "not taken, -m is given"
            said.append(f"machine {self.machine.get('name')} ({taken})")
        if self.tolerance is not None:
            taken = "taken" if tolerance_taken else "not taken, -m or --tolerance is given"
            said.append(f"tolerance {self.tolerance:g} mm ({taken})")
        if self.reading != AS_USUAL:
            taken = "taken" if reading_taken else "not taken, the command line has its own"
            settings = ", ".join(f"{name} {value}" for name, value in self.reading.changed().items())
            said.append(f"program read with {settings} ({taken})")
        if self.not_limited:
            said.append(
                f"not limited: {', '.join(self.not_limited)} (judged all the same, unless --not-limited)"
            )
        return said

    def remedies(self, verdict: Verdict, unjudged: tuple[str, ...]) -> list[str]:
        """Sentences for limits that are exceeded and that the plan of the file did not keep."""
        broken = {name.partition(".")[0] for name, check in verdict.limits.items() if check.broken}
        return [
            f"{name} is exceeded; the file says that its plan did not limit it: --not-limited {name} reports it without judging"
            for name in self.not_limited
            if name in broken and name not in unjudged
        ]
