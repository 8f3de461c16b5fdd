"""Several methods on one job, side by side: a row per method, as a table, as JSON or as CSV.

The best is the fastest motion that passed with every quantity limited. A motion without a jerk limit (method second-order) is listed
beside it, and is the best only if no other passed.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner.base.errors import InputError, NotSolvedError
from planner.base.names import METHODS
from planner.base.units import MICROMETRE
from planner.constraints import normal_limit
from planner.machine import LINEAR_AXES, Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.report.export import summary, verdict_summary, versions
from planner.report.replace import check_file, replacing_file, starts_with
from planner.report.tables import ratio_text

if TYPE_CHECKING:
    from planner.constraints.own import OwnLimit
    from planner.job.method import Method
    from planner.job.plan import Plan
    from planner.job.stages import Progress
    from planner.verify import Verdict

SUFFIXES = (".json", ".csv")
# Stages of a plan that cost every method the same per second of motion; the others are its planning time.
AFTER_PLANNING = ("read", "sample", "verify")
QUANTITIES = ("velocity", "acceleration", "jerk", "feed", normal_limit.NAME)


@dataclass(frozen=True, kw_only=True)
class Row:
    """The result of one method.

    outcome       : "passed", "failed" (a limit or the tolerance is exceeded), "not solved" or "refused"
    sentence      : how the plan was solved, the first fault, or the reason why there is no motion
    cycle_time    : [s]; None without a motion, as the following fields
    worst         : for each quantity the largest ratio to its limit, and the name of that limit ("jerk.y")
    free          : quantities that this method does not limit
    contour_error, vertex_error : [mm]
    after_filters : the larger of both behind the filters of the machine [mm]; None without filters, or where it is not known
    corner_ratio  : the largest ratio of eq. 18-19 at the programmed corners [-]; None without corners
    gain          : median of the speed there over eq. 20 of the paper's corner [-]; None where it is not defined
    ringing       : largest amplitude of a linear axis at which a vibration mode rings after the motion [mm]; None without modes
    planning_time : computing time without reading, sampling and verification [s]
    summary       : the content of `summary.json`
    """

    method: str
    outcome: str
    sentence: str
    cycle_time: float | None = None
    worst: dict[str, tuple[float, str]] | None = None
    free: tuple[str, ...] = ()
    contour_error: float | None = None
    vertex_error: float | None = None
    corner_ratio: float | None = None
    gain: float | None = None
    after_filters: float | None = None
    ringing: float | None = None
    planning_time: float | None = None
    summary: dict[str, Any] | None = None

    @property
    def passed(self) -> bool:
        """Whether its motion passed the verdict."""
        return self.outcome == "passed"


def compare(
    program: Program | str | Path,
    machine: Machine | str | Path | None = None,
    methods: Sequence[str | Method] | None = None,
    *,
    limits: Sequence[OwnLimit] = (),
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Plan a program with several methods and put them side by side, judged by the same verifier.

    methods   : names, or methods with settings of your own; None for all that have names
    the others : as in `planner.plan`

    Raises InputError for a program or a machine that cannot be read; what a method cannot do is its row.
    """
    from planner.methods.registry import DEFAULT_MACHINE

    if not isinstance(machine, Machine):
        machine = load_machine(DEFAULT_MACHINE if machine is None else machine)
    if limits:
        machine = machine.with_own((*machine.own, *limits))
    if not isinstance(program, Program):
        program = read_program(program, machine)
    chosen = METHODS if methods is None else methods
    return [row_of(method, program, machine, tolerance, progress) for method in chosen]


def row_of(
    method: str | Method,
    program: Program,
    machine: Machine,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Row:
    """The row of a method, whatever comes of it."""
    from planner import plan

    label = method if isinstance(method, str) else _label(method)
    try:
        return row_of_plan(
            label, plan(program, machine, method=method, tolerance=tolerance, progress=progress)
        )
    except (InputError, NotSolvedError) as fault:
        return refused(label, fault)


def _label(method: Method) -> str:
    """A method's repr, which names its settings, or its class."""
    return type(method).__name__ if type(method).__repr__ is object.__repr__ else repr(method)


def row_of_plan(method: str, plan: Plan) -> Row:
    """The row of a plan, solved or not."""
    planning = sum(seconds for stage, seconds in plan.timings.items() if stage not in AFTER_PLANNING)
    if plan.trajectory is None or plan.verdict is None:
        return Row(method=method, outcome="not solved", sentence=plan.sentence, planning_time=planning)
    verdict = plan.verdict
    worst: dict[str, tuple[float, str]] = {}
    for name, check in verdict.limits.items():
        quantity = name.partition(".")[0]
        if np.isfinite(check.ratio) and check.ratio >= worst.get(quantity, (0.0, ""))[0]:
            worst[quantity] = (float(check.ratio), name)
    return Row(
        method=method,
        outcome="passed" if verdict.passed else "failed",
        sentence=plan.sentence if verdict.passed else verdict.faults[0],
        cycle_time=plan.trajectory.cycle_time,
        worst=worst,
        free=tuple(verdict_summary(verdict)["not_limited"]),
        contour_error=verdict.contour_error_mm,
        vertex_error=verdict.vertex_error_mm,
        corner_ratio=_known(verdict.corners.worst_ratio),
        gain=_known(verdict.corners.gains()[0]),
        after_filters=_after_filters(verdict),
        ringing=_ringing(verdict),
        planning_time=planning,
        summary=summary(plan),
    )


def _after_filters(verdict: Verdict) -> float | None:
    after = verdict.after_filters
    if after is None or after.contour_error_mm is None or after.vertex_error_mm is None:
        return None
    return max(after.contour_error_mm, after.vertex_error_mm)


def _ringing(verdict: Verdict) -> float | None:
    after = [
        amplitude
        for mode in verdict.ringing
        for axis, amplitude in zip(mode.axes, mode.after, strict=True)
        if axis in LINEAR_AXES
    ]
    return float(max(after)) if after else None


def refused(method: str, fault: Exception) -> Row:
    """The row of a method that cannot plan the job, with the reason."""
    return Row(method=method, outcome="refused", sentence=str(fault))


def best_of(rows: list[Row]) -> Row | None:
    """The fastest method that passed, among those that limit every quantity if there is one; None if none passed."""
    passed = [row for row in rows if row.passed]
    candidates = [row for row in passed if not row.free] or passed
    return min(candidates, key=lambda row: row.cycle_time or np.inf, default=None)


def comparison_table(rows: list[Row], title: str) -> Group:
    """The table for the terminal, followed by the reason for each method that did not pass."""
    best = best_of(rows)
    shown = [name for name in QUANTITIES if any(name in (row.worst or {}) for row in rows)]
    table = Table(box=None, pad_edge=False)
    table.add_column("method", no_wrap=True)
    for name in (
        "cycle\ntime s",
        "ratio to\nbest",
        *(f"{q.replace('_', chr(10), 1)}\n/ limit" for q in shown),
    ):
        table.add_column(name, justify="right", no_wrap=True)
    rings = any(row.ringing is not None for row in rows)
    filters = any(row.after_filters is not None for row in rows)
    law = ("eq. 18-19\nat most", "over\neq. 20")
    more = (["behind\nfilters"] if filters else []), (["rings\nµm"] if rings else [])
    for name in ("contour\nµm", "corners\nµm", *more[0], *law, *more[1], "planning\ns"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    said = []
    for row in rows:
        table.add_row(
            row.method,
            _number(row.cycle_time, ".4f"),
            _number(_to_best(row, best), ".4f"),
            *(_worst(row, quantity) for quantity in shown),
            _number(row.contour_error, ".4g", MICROMETRE),
            _number(row.vertex_error, ".4g", MICROMETRE),
            *([_number(row.after_filters, ".4g", MICROMETRE)] if filters else []),
            "-" if row.corner_ratio is None else ratio_text(row.corner_ratio),
            _number(row.gain, ".3f"),
            *([_number(row.ringing, ".4g", MICROMETRE)] if rings else []),
            _number(row.planning_time, ".3f"),
            Text(row.outcome, style="green" if row.passed else "bold red"),
        )
        if not row.passed:
            said.append(Text(f"{row.method}: {row.sentence}"))
    free = [f"{row.method} does not limit {', '.join(row.free)}" for row in rows if row.free]
    notes = [Text(f"(in brackets: not limited; {'; '.join(free)})")] if free else []
    return Group(Text(title, style="bold"), table, *notes, *said)


def comparison_dict(rows: list[Row], about: dict[str, Any]) -> dict[str, Any]:
    """The comparison, ready for JSON; `about` comes first."""
    best = best_of(rows)
    return {
        **about,
        "versions": versions(),
        "best": best.method if best else None,
        "methods": [
            {
                "method": row.method,
                "outcome": row.outcome,
                "sentence": row.sentence,
                "cycle_time_s": row.cycle_time,
                "ratio_to_best": _to_best(row, best),
                "worst": {
                    q: {"ratio": ratio, "limit": name} for q, (ratio, name) in (row.worst or {}).items()
                },
                "not_limited": list(row.free),
                "contour_error_mm": row.contour_error,
                "vertex_error_mm": row.vertex_error,
                "corner_ratio": row.corner_ratio,
                "gain": row.gain,
                "after_filters_mm": row.after_filters,
                "ringing_mm": row.ringing,
                "planning_time_s": row.planning_time,
                "summary": row.summary,
            }
            for row in rows
        ],
    }


def comparison_csv(rows: list[Row]) -> str:
    """The comparison as CSV, one row for each method; a cell is empty where there is no number."""
    best = best_of(rows)
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n")
    limits = [column for q in QUANTITIES for column in (f"{q}_ratio", f"{q}_limit")]
    head = ["method", "outcome", "cycle_time_s", "ratio_to_best"]
    tail = ["not_limited", "contour_error_mm", "vertex_error_mm", "corner_ratio", "gain"]
    tail += ["after_filters_mm", "ringing_mm", "planning_time_s", "sentence"]
    write.writerow([*head, *limits, *tail])
    for row in rows:
        worst = [cell for q in QUANTITIES for cell in (row.worst or {}).get(q, (None, None))]
        first = [row.method, row.outcome, row.cycle_time, _to_best(row, best)]
        errors = [
            row.contour_error,
            row.vertex_error,
            row.corner_ratio,
            row.gain,
            row.after_filters,
            row.ringing,
        ]
        last = [" ".join(row.free), *errors, row.planning_time, row.sentence]
        write.writerow([*first, *worst, *last])
    return out.getvalue()


def check_comparison_place(path: Path, inputs: Iterable[Path] = (), *, force: bool = False) -> None:
    """Raise InputError if a comparison cannot be written to a file.

    That is so for a suffix other than .json and .csv, for a directory, for one of the `inputs`, and for a file that is no comparison,
    unless `force` is set.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(SUFFIXES)}", source=str(path))
    check_file(path, inputs, _is_comparison, force=force)


def _is_comparison(path: Path) -> bool:
    if path.suffix == ".csv":
        return starts_with(path, comparison_csv([]).rstrip())
    try:
        return {"best", "methods", "versions"} <= set(json.loads(path.read_bytes()))
    except (ValueError, RecursionError, TypeError):
        return False


def write_comparison(path: Path, rows: list[Row], about: dict[str, Any]) -> None:
    """Write the comparison as JSON or CSV, the whole file or nothing. Raises InputError if it cannot be written."""
    text = comparison_csv(rows) if path.suffix == ".csv" else _json(comparison_dict(rows, about))
    with replacing_file(path) as new:
        new.write_text(text, encoding="utf-8")


def about_job(source: str, machine: Machine, tolerance: float | None) -> dict[str, Any]:
    """What all rows have in common. `tolerance` [mm] is None if the program or the machine sets it."""
    return {
        "program": source,
        "machine": machine.model_dump(mode="json", exclude_none=True),
        "tolerance_mm": tolerance,
    }


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def _to_best(row: Row, best: Row | None) -> float | None:
    if row.cycle_time is None or best is None or not best.cycle_time:
        return None
    return row.cycle_time / best.cycle_time


def _worst(row: Row, quantity: str) -> str:
    if not row.worst or quantity not in row.worst:
        return "-"
    ratio, name = row.worst[quantity]
    text = f"{ratio_text(ratio)} {name.partition('.')[2]}".rstrip()
    return f"({text})" if quantity in row.free else text


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _number(value: float | None, form: str, unit: float = 1.0) -> str:
    return "-" if value is None else format(value / unit, form)
