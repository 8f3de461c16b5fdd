"""Results as data: a file of rows, one JSON object a line, appended as soon as they are measured.

A line is a row, or `{"about": ...}` with the environment of the rows after it. Where a pair of job and way stands in several rows, the
last one holds.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.base.errors import InputError

SOLVED, NOT_SOLVED, NOT_APPLICABLE = "solved", "not solved", "not applicable"
OVER_LIMIT, ERROR, SKIPPED = "over the limit", "error", "skipped"
# From good to bad. A skipped pair (a package or a folder that is not here) is compared with nothing.
STATUSES = (SOLVED, NOT_SOLVED, NOT_APPLICABLE, OVER_LIMIT, ERROR, SKIPPED)
PASSED, FAILED, UNJUDGED = "passed", "failed", ""
METHOD, PEER, MODEL = "method", "peer", "model"
NOISY = 1.1  # calibration ratio above which the core was not quiet and the processor time says little [-]

Key = tuple[str, str, str]


@dataclass(frozen=True, kw_only=True)
class Row:
    """What one way made of one job.

    kind      : "method", "peer" or "model" (a model predicts a time and has no motion)
    status    : one of `STATUSES`
    verdict   : "passed", "failed", or "" without a motion
    message   : the sentence of the solution, the first fault, or why there is no motion
    cycle_s   : duration of the motion [s]
    cpu_s     : processor seconds of one whole call, verification included: the least of `cpu_all`, children included [s]
    wall_s    : of the call with the least processor time [s]
    quiet     : the calibration loop beside the calls over the fastest one of the process [-]; above `NOISY` the core was busy
    beside    : other ways that were measured at the same time (`run --processes`); the core then counts as busy
    blocks    : of the program
    points    : grid points of the problem that was solved
    excess    : largest ratio to a limit that is judged [-]
    error     : larger one of contour and vertex error over the tolerance [-]
    bound_s   : what no motion within tolerance, feed and limits falls short of [s], where the suite asks for it (`Suite.merits`)
    active    : share of the cycle time in which at least one limit, or the tolerance, is active [-], likewise
    free      : quantities that this way does not limit
    commit    : the last one that changed the planner, with "+" where the working tree has further changes
    """

    suite: str
    job: str
    way: str
    kind: str
    status: str
    verdict: str = UNJUDGED
    message: str = ""
    cycle_s: float | None = None
    cpu_s: float | None = None
    cpu_all: tuple[float, ...] = ()
    wall_s: float | None = None
    quiet: float | None = None
    beside: int = 0
    blocks: int | None = None
    points: int | None = None
    excess: float | None = None
    error: float | None = None
    bound_s: float | None = None
    active: float | None = None
    free: tuple[str, ...] = ()
    commit: str = ""

    @property
    def key(self) -> Key:
        """Suite, job and way."""
        return self.suite, self.job, self.way

    @property
    def comparable(self) -> bool:
        """Whether its motion passed the verdict with every quantity limited."""
        return self.verdict == PASSED and not self.free and self.kind != MODEL

    @property
    def noisy(self) -> bool:
        """Whether the core was busy beside the measure."""
        return self.beside > 0 or (self.quiet is not None and self.quiet > NOISY)


_FIELDS = {one.name: one for one in dataclasses.fields(Row)}
_NEEDED = ("suite", "job", "way", "kind", "status")


@dataclass(frozen=True, kw_only=True)
class Results:
    """The content of a file of rows: the last row of each pair in the order of the pairs' first rows, and the environments."""

    rows: dict[Key, Row] = field(default_factory=dict)
    abouts: tuple[dict[str, Any], ...] = ()


def line_of(row: Row) -> str:
    """The row as a line of JSON, without what is not known."""
    known = {name: value for name, value in dataclasses.asdict(row).items() if value != _FIELDS[name].default}
    return json.dumps(known)


def row_of_line(given: dict[str, Any], where: str) -> Row:
    """The row of a line's object. Raises InputError, naming `where`, for missing and unknown fields and for an unknown status."""
    missing, unknown = [name for name in _NEEDED if name not in given], sorted(given.keys() - _FIELDS.keys())
    if missing:
        raise InputError(f"{where}: no {', '.join(missing)}; a row has {', '.join(_NEEDED)}")
    if unknown:
        raise InputError(f"{where}: unknown {', '.join(unknown)}; a row has {', '.join(_FIELDS)}")
    if given["status"] not in STATUSES:
        raise InputError(f"{where}: status '{given['status']}'; there are {', '.join(STATUSES)}")
    lists = {name: tuple(given.get(name, ())) for name in ("cpu_all", "free")}
    return Row(**(given | lists))


def read(file: Path) -> Results:
    """The rows of a file. Raises InputError for a file that is not there, and for a line that is no row, naming it.

    A last line without its end is what an interrupted run leaves, and is passed over.
    """
    if not file.is_file():
        raise InputError(f"{file}: no such file; `python -m benchmarks run` makes it")
    rows: dict[Key, Row] = {}
    abouts = []
    text = file.read_text(encoding="utf-8")
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        where = f"{file}, line {number}"
        try:
            given = json.loads(line)
        except json.JSONDecodeError as fault:
            if number == len(lines) and not text.endswith("\n"):
                break
            raise InputError(f"{where}: no JSON: {fault.msg}; each line is a row") from fault
        if not isinstance(given, dict):
            raise InputError(f"{where}: found {type(given).__name__}; each line is an object")
        if "about" in given:
            abouts.append(given["about"])
            continue
        row = row_of_line(given, where)
        rows[row.key] = row
    return Results(rows=rows, abouts=tuple(abouts))


def append(file: Path, lines: Iterable[str]) -> None:
    """Add lines to a file, which is made where it is missing. What an interrupted run left of a line is cut off first."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a+b") as out:
        size = out.tell()
        if size:
            out.seek(0)
            whole = out.read()
            out.truncate(whole.rfind(b"\n") + 1)
        for line in lines:
            out.write(line.encode() + b"\n")


def about_line(about: dict[str, Any]) -> str:
    """The environment as a line."""
    return json.dumps({"about": about})


def compact(file: Path, jobs: Collection[str]) -> None:
    """Write a file anew with the last row of each pair of these jobs, and the last environment of each command and commit before
    them."""
    found = read(file)
    kept = [row for row in found.rows.values() if row.job in jobs]
    by_commit = {(about.get("commit"), about.get("command")): about for about in found.abouts}
    lines = [*map(about_line, by_commit.values()), *map(line_of, kept)]
    beside = file.with_suffix(".new")
    beside.write_text("".join(line + "\n" for line in lines), encoding="utf-8")
    beside.replace(file)
