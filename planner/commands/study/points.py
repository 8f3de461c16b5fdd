"""Points of a sweep: one combination of values, planned; and the directory that keeps them.

    DIR/sweep.json        what is planned: program, machine, method, versions, and their digest
    DIR/points/*.json     one file for each combination, named by its values, written whole or not at all
    DIR/sweep.parquet     the table of all combinations that the command line names
    DIR/sweep.png         its picture

A sweep that was ended goes on where it stopped: points that are there are not planned again. Other ranges of
the same job use them as well. A program, machine or method that has changed since is refused, because its
points do not belong to the same table.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.commands.study.settings import Setting, StudiedJob
from planner.report.compare import tried
from planner.report.replace import check_output, replacing_file
from planner.report.summary import json_ready, versions

ABOUT, POINTS, TABLE, FIGURE = "sweep.json", "points", "sweep.parquet", "sweep.png"
PASSED, FAILED, NOT_SOLVED = "passed", "failed", "not solved"
_HELD = 3  # limits that a point names


def planned_point(job: StudiedJob, settings: Sequence[Setting]) -> dict[str, Any]:
    """Plan a job with some settings, in one thread; whatever comes of it is the row of the point, ready for
    JSON.

    outcome and sentence are as in `compare`; lengths are in mm, times in s. A worker of a cluster calls this.
    """
    import time

    from planner.base.threads import use_threads

    use_threads(1)
    began = time.process_time()
    row: dict[str, Any] = {setting.name: setting.value for setting in settings}
    try:
        made, plan = tried("", lambda: job.changed(settings).plan())
        row |= {"outcome": made.outcome, "sentence": made.sentence}
    except MemoryError as fault:
        row |= {"outcome": NOT_SOLVED, "sentence": f"the memory is used up ({fault})"}
        plan = None
    if plan is not None and made.cycle_time is not None:
        active = plan.grid.percents()[:_HELD] if plan.grid is not None else ()
        row |= {
            "cycle_time_s": made.cycle_time,
            "contour_error_mm": made.contour_error,
            "vertex_error_mm": made.vertex_error,
            "corner_ratio": made.corner_ratio,
            "held_by": ", ".join(f"{name} {percent} %" for name, percent in active),
        }
    return json_ready(row | {"planning_cpu_s": time.process_time() - began})


class SweepFolder:
    """The directory of a sweep of a job."""

    def __init__(self, directory: Path, job: StudiedJob):
        self.directory, self._points = directory, directory / POINTS
        said = {"program": job.program.source, "machine": job.machine.name, "tolerance_mm": job.tolerance}
        self._about = {
            "inputs": json_ready({**said, **job.how}),
            "digest": digest(job),
            "versions": versions(),
        }

    def open(self, *, force: bool = False) -> bool:
        """Make the directory, or take up the sweep in it; True if there is one.

        Raises InputError if it cannot be written, holds something else, or a sweep of another program,
        machine or method; with `force` the points of that are removed.
        """
        check_output(self.directory, ())
        about = self.directory / ABOUT
        if about.exists():
            changed = _changed(_read(about), self._about)
            if not changed:
                return True
            if not force:
                raise InputError(
                    f"holds a sweep with another {', '.join(changed)}; give another directory, or --force to begin anew",
                    source=str(self.directory),
                )
            for file in self._points.glob("*.json"):
                file.unlink()
        elif self.directory.is_dir() and any(self.directory.iterdir()) and not force:
            raise InputError(
                "is not empty and holds no sweep; give another directory, or --force",
                source=str(self.directory),
            )
        try:
            self._points.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise InputError(f"cannot be written: {fault.strerror}", source=str(self.directory)) from fault
        _write(about, self._about)
        return False

    def known(self, settings: Sequence[Setting]) -> dict[str, Any] | None:
        """The row of a point that was planned before; None if it was not, or its file is not whole."""
        file = self._file(settings)
        row = _read(file) if file.exists() else None
        wanted = {setting.name: setting.value for setting in settings}
        whole = row is not None and "outcome" in row and row.items() >= wanted.items()
        return row if whole else None

    def keep(self, settings: Sequence[Setting], row: dict[str, Any]) -> None:
        """Write the row of a point, whole or not at all. Raises InputError if it cannot be written."""
        _write(self._file(settings), row)

    def _file(self, settings: Sequence[Setting]) -> Path:
        values = json.dumps(sorted((setting.name, setting.value) for setting in settings))
        return self._points / f"{hashlib.sha256(values.encode()).hexdigest()[:16]}.json"


def digest(job: StudiedJob) -> dict[str, str]:
    """SHA-256 of the blocks of the program, of the machine and of how they are planned: what a table must
    have in common."""
    blocks = hashlib.sha256()
    program = job.program
    for column in (
        program.start, program.kind, program.end, program.feed, program.dwell, program.path_control, program.tolerance,
        program.arc_block, program.arc_center, program.arc_normal, program.arc_sweep,
        program.splines.block, program.splines.points, program.splines.weights,
    ):  # fmt: skip
        blocks.update(column.tobytes())
    machine = job.machine.model_dump_json(exclude_none=True)
    how = json.dumps({"tolerance": job.tolerance, **job.how}, sort_keys=True, default=str)
    return {
        "program": blocks.hexdigest(),
        "machine": hashlib.sha256(machine.encode()).hexdigest(),
        "method or tolerance": hashlib.sha256(how.encode()).hexdigest(),
    }


def _changed(before: dict[str, Any] | None, now: dict[str, Any]) -> list[str]:
    """The differences between the inputs of two sweeps."""
    old = (before or {}).get("digest")
    if not isinstance(old, dict):
        return ["description, which cannot be read"]
    return [name for name, value in now["digest"].items() if old.get(name) != value]


def _read(file: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(file.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _write(file: Path, value: dict[str, Any]) -> None:
    with replacing_file(file) as new:
        new.write_text(json.dumps(value, indent=1, allow_nan=False) + "\n", encoding="utf-8")
