"""Every method, and the optimum on every corner shape, on the same jobs, machine, tolerance and verifier.

    python -m benchmarks.methods [FILE ...] [--methods optimal/fir kinematic ...] [--name RESULT]

The jobs: pentagon, zig-zag, circle and spiral of chords and paper 002's 5-point path of problems.py; the NURBS butterfly of curves.json
as chords within a tenth of the tolerance (for fir-spline also as the curve itself); with FILEs, NC or HPGL programs come after them.
The machine is v 100 mm/s, a 2000 mm/s2, j 2e5 mm/s3, tolerance 0.05 mm, 1 ms. `optimal` and `second-order` smooth the path in several
ways, and have a row for each: optimal/spline, optimal/bezier and so on.

Results: benchmarks/results/RESULT.json and .md. Below the table stand the jobs on which the optimum with the best of its corners is
slower than another method that holds the same limits.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks import problems
from benchmarks.record import markdown, write_results
from planner.base.errors import PlannerError
from planner.base.names import METHODS, OPTIMAL, SECOND_ORDER, SMOOTHINGS
from planner.geometry.nurbs import Nurbs
from planner.job.plan import Plan
from planner.machine import Machine
from planner.methods.fir_spline import FirSplineMethod
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.report.compare import Row, best_of, refused, row_of_plan

ROUNDING = (OPTIMAL, SECOND_ORDER)
LABELS = tuple(
    label
    for name in METHODS
    for label in ([f"{name}/{corner}" for corner in SMOOTHINGS] if name in ROUNDING else [name])
)
CURVE_CHORDS = 0.1  # of the tolerance: what the chords of a curve may leave it by [-]
ERROR_TRUE = 2.0  # ratios to the tolerance from here on may be a lost place, no distance [-]
SLOWER = 1e-4  # a ratio of cycle times up to here is the grid's resolution [-]


def butterfly() -> Nurbs:
    """The curve of curves.json."""
    given = json.loads((Path(__file__).parent / "curves.json").read_text(encoding="utf-8"))["butterfly"]
    columns = {name: np.array(given[name], float) for name in ("points", "knots", "weights")}
    return Nurbs(degree=given["degree"], **columns)


def jobs(files: list[Path], machine: Machine) -> dict[str, Program]:
    """The jobs by name, files read once."""
    made = {
        "pentagon": problems.pentagon(),
        "zig-zag": problems.zigzag(),
        "circle": problems.chord_circle(),
        "spiral": problems.star_spiral(),
        "five points": problems.five_points(),
        "butterfly": butterfly().to_program(CURVE_CHORDS * machine.tolerance, problems.FEED),
    }
    return made | {file.name.rpartition("__")[2]: read_program(file, machine) for file in files}


def main() -> None:
    """Run all methods on all jobs and write the table, as far as it has come, after every job."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--methods", nargs="+", default=list(LABELS), choices=LABELS, metavar="METHOD")
    parser.add_argument("--name", default="methods")
    given = parser.parse_args()
    machine = problems.machine()
    table: dict[str, list[Row]] = {}
    for name, job in jobs(given.files, machine).items():
        table[name] = []
        for label in given.methods:
            table[name].append(_row(label, job, machine))
            if (name, label) == ("butterfly", "fir-spline"):
                table[name].append(_row("fir-spline on the curve", butterfly(), machine))
        for row in table[name]:
            print(name, row.method, row.outcome, row.cycle_time, flush=True)
        plain = {"jobs": {job: _plain(rows) for job, rows in table.items()}}
        write_results(given.name, plain, _markdown(table))


def _row(label: str, job: Program | Nurbs, machine: Machine) -> Row:
    try:
        return row_of_plan(label, _plan(label, job, machine))
    except PlannerError as fault:
        return refused(label, fault)


def _plan(label: str, job: Program | Nurbs, machine: Machine) -> Plan:
    if isinstance(job, Nurbs):
        return FirSplineMethod().plan_curve(job, machine, problems.FEED)
    method, _, corner = label.partition("/")
    return planner.plan(job, machine, method=method, **({"corner": corner} if corner else {}))


def _plain(rows: list[Row]) -> list[dict[str, Any]]:
    """For JSON; of the summary only what the row does not say."""
    kept = ("status", "stop_time_s", "blocks", "grid_points", "timings_s")
    return [
        dataclasses.asdict(row)
        | {"summary": {key: row.summary[key] for key in kept} if row.summary else None}
        for row in rows
    ]


def _markdown(table: dict[str, list[Row]]) -> str:
    """Cycle times, then what was exceeded and how long planning took, a method a row."""
    labels = list(dict.fromkeys(row.method for rows in table.values() for row in rows))
    found = {(name, row.method): row for name, rows in table.items() for row in rows}
    best = {name: best_of(rows) for name, rows in table.items()}
    text = "Cycle time [s]; the best that holds all limits in bold, * a limit is exceeded.\n\n"
    text += markdown(
        ["", *table],
        [[label, *(_time(found.get((name, label)), best[name]) for name in table)] for label in labels],
    )
    text += "\n`second-order` does not limit the jerk; the others are judged with it.\n"
    text += "\nLargest ratio to a limit that is exceeded, or of the error to the tolerance; no number where the distance is\n"
    text += "not known.\n\n"
    broken = [
        label
        for label in labels
        if any(row.outcome == "failed" for row in found.values() if row.method == label)
    ]
    text += markdown(
        ["", *table], [[label, *(_excess(found.get((name, label))) for name in table)] for label in broken]
    )
    text += "\nPlanning time [s], without reading, sampling and verification.\n\n"
    text += markdown(
        ["", *table], [[label, *(_planning(found.get((name, label))) for name in table)] for label in labels]
    )
    text += "\nWhere the optimum with the best of its corners is slower than another method that holds the same limits:\n\n"
    return text + ("\n".join(_slower(table)) or "nowhere") + "\n"


def _time(row: Row | None, best: Row | None) -> str:
    if row is None:
        return ""
    if row.cycle_time is None:
        return row.outcome
    cell = f"{row.cycle_time:.4f}"
    return f"**{cell}**" if row is best else cell if row.passed else f"{cell} *"


def _excess(row: Row | None) -> str:
    if row is None or row.worst is None or row.passed:
        return ""
    ratio, name = max(
        (ratio, name) for quantity, (ratio, name) in row.worst.items() if quantity not in row.free
    )
    error = max(row.contour_error or 0.0, row.vertex_error or 0.0) / problems.machine().tolerance
    return f"{name} {ratio:.6g}" if ratio > error else f"error {error:.3f}" if error < ERROR_TRUE else "error"


def _planning(row: Row | None) -> str:
    return "" if row is None or row.planning_time is None else f"{row.planning_time:.3f}"


def _slower(table: dict[str, list[Row]]) -> list[str]:
    said = []
    for name, rows in table.items():
        holding = [row for row in rows if row.passed and not row.free and row.cycle_time]
        optimum = best_of([row for row in holding if row.method.startswith("optimal")])
        other = best_of([row for row in holding if not row.method.startswith("optimal")])
        if optimum and other and optimum.cycle_time and other.cycle_time:
            ratio = optimum.cycle_time / other.cycle_time
            if ratio > 1 + SLOWER:
                said.append(
                    f"* {name}: {optimum.method} takes {100 * (ratio - 1):.2f} % longer than {other.method}"
                )
    return said


if __name__ == "__main__":
    main()
