"""A trajectory that was read or given, judged; and what its file says about itself."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.nc.feed_caps import read_feed_caps
from planner.nc.program import Program
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.set_limits import limited
from planner.planning.job.at_tip import judged
from planner.report.replace import FEED_CAPS
from planner.report.trajectory_reader import TrajectoryFile
from planner.verifier import NOT_LIMITED_NAMES, Verdict, fit_axes


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """A motion with the axes of a program, what it was judged by, and the verdict."""

    motion: Trajectory
    toolpath: Toolpath
    machine: Machine
    verdict: Verdict
    notes: tuple[str, ...]  # what was done to the axes, one sentence each


def judge(
    read: TrajectoryFile,
    program: Program,
    machine: Machine,
    *,
    tolerance: float | None = None,
    not_limited: tuple[str, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Judgement:
    """Judge a trajectory that was read against a program and a machine.

    tolerance   : contour error budget [mm]; None for that of the program or the machine
    not_limited : quantities that are reported and not judged
    progress    : called now and then with the fraction done (0 to 1)

    Raises InputError for other axes than the program's, and for a program that moves nothing.
    """
    machine = limited(machine, program.limits)
    toolpath = toolpath_from_program(program, machine, tolerance)
    if not len(toolpath):
        raise InputError("the program moves nothing: there is nothing to judge", source=program.source)
    motion, given, notes = fit_axes(read.trajectory, read.given, toolpath)
    verdict = judged(
        motion, program, toolpath, machine, given=given, not_limited=not_limited, progress=progress
    )
    return Judgement(motion=motion, toolpath=toolpath, machine=machine, verdict=verdict, notes=notes)


@dataclass(frozen=True, kw_only=True)
class FileSays:
    """The metadata of a trajectory file. It is used where nobody says otherwise, always reported, and never a
    reason to pass."""

    machine: dict[str, Any] | None  # its machine, as in a machine file, or None
    tolerance: float | None  # the tolerance it was planned with [mm], or None
    not_limited: tuple[str, ...]  # quantities that its plan did not limit
    reading: Reading = AS_USUAL  # how its program was read, without the feed caps
    capped: bool = False  # whether there were some
    # the file of its program; "<text>" and the like where it had none; None where the file does not say
    program: str | None = None
    kept: str = ""  # the name of the program beside it
    wrong: tuple[str, ...] = ()  # names of entries that no plan writes so

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> FileSays:
        """From the metadata of a file; entries of another type than expected count as missing."""
        machine, tolerance = metadata.get("machine"), metadata.get("tolerance_mm")
        free, program, kept = metadata.get("not_limited", []), metadata.get("program"), metadata.get("kept")
        known = isinstance(free, list) and all(isinstance(n, str) and n in NOT_LIMITED_NAMES for n in free)
        read_with = metadata.get("reading")
        number = float(tolerance) if is_number(tolerance) else math.nan  # type: ignore[arg-type]
        positive = 0.0 < number < math.inf
        right = {
            "machine": isinstance(machine, dict),
            "tolerance_mm": tolerance is None or positive,
            "not_limited": known,
        }
        return cls(
            machine=machine if isinstance(machine, dict) else None,
            tolerance=number if positive else None,
            not_limited=tuple(n for n in free if isinstance(n, str)) if isinstance(free, list) else (),
            reading=Reading.saved(read_with),
            capped=isinstance(read_with, dict) and "feed_caps" in read_with,
            program=program if isinstance(program, str) else None,
            kept=Path(kept).name if isinstance(kept, str) else "",
            wrong=tuple(name for name, fits in right.items() if not fits),
        )

    def program_at(self, trajectory: Path) -> Path:
        """Where the program is: beside the file, or else where it was planned. Raises InputError if the file
        names none, or if that is in neither place."""
        beside = trajectory.parent / self.kept
        if self.kept and os.path.isfile(beside):
            return beside
        if self.program is None or not os.path.isfile(self.program):
            named = f"{self.kept or self.program}, which is not there"
            where = "names no program" if self.program is None else f"names the program {named}"
            raise InputError(f"{where}: planner verify {trajectory} JOB", source=str(trajectory))
        return Path(self.program)

    def reading_at(self, trajectory: Path) -> Reading:
        """How the program was read, with the feed caps beside the file. Raises InputError without them."""
        if not self.capped:
            return self.reading
        caps = dataclasses.replace(
            read_feed_caps(trajectory.parent / FEED_CAPS), main=Path(self.program or "").name
        )
        return dataclasses.replace(self.reading, feed_caps=caps)

    def sentences(self, machine_taken: bool, tolerance_taken: bool, reading_taken: bool) -> list[str]:
        """The metadata in words, and whether they were used."""
        changed = self.reading.changed() | ({"feed_caps": FEED_CAPS} if self.capped else {})
        settings = ", ".join(f"{name} {value}" for name, value in changed.items())
        said = []
        tolerance = self.tolerance and f"tolerance {self.tolerance:g} mm"
        for what, taken, instead in (
            (self.machine and f"machine {self.machine.get('name')}", machine_taken, "-m is given"),
            (tolerance, tolerance_taken, "-m or --tolerance is given"),
            (settings and f"program read with {settings}", reading_taken, "the command line has its own"),
        ):
            if what:
                said.append(f"{what} ({'taken' if taken else f'not taken, {instead}'})")
        if self.not_limited:
            free = ", ".join(self.not_limited)
            said.append(f"not limited: {free} (judged all the same, unless --not-limited)")
        return said

    def remedies(self, verdict: Verdict, unjudged: tuple[str, ...]) -> list[str]:
        """Sentences for limits that are exceeded and that the plan of the file did not keep."""
        broken = {name.partition(".")[0] for name, check in verdict.limits.items() if check.broken}
        return [
            f"{name} is exceeded; the file says that its plan did not limit it: --not-limited {name} reports it without judging"
            for name in self.not_limited
            if name in broken and name not in unjudged
        ]


def is_number(value: Any) -> bool:
    """Whether a value of JSON is a number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)
