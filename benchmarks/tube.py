"""How far is the optimum on rounded corners from what method `tube` finds? Every corner shape against it.

    python -m benchmarks.tube [--resume]

Single corners of 15 to 170 degrees between legs of 20 mm, pentagon, zig-zag, paper 002's 5-point path and a spiral of 100 chords, on
the machine of problems.py (v 100 mm/s, a 2000 mm/s2, j 2e5 mm/s3, tolerance 0.05 mm, 1 ms). `tube` seeks the motion of the axes itself,
its path included, and ends in a local optimum; a ratio below 1 would say that it missed a better one.

Results: benchmarks/results/tube.json and .md, as far as they have come, after every job; `--resume` keeps those that are there.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import numpy as np

import planner
from benchmarks import problems
from benchmarks.record import RESULTS, markdown, write_results
from planner.base.errors import PlannerError
from planner.base.names import SMOOTHINGS
from planner.nc.program import Program

ANGLES = (15, 30, 45, 60, 75, 90, 105, 120, 135, 150, 160, 170)  # [deg]
LEG = 20.0  # [mm]


def corner(degrees: float) -> Program:
    """Two legs, the first along x."""
    at = np.deg2rad(degrees)
    return problems.polyline([[0.0, 0.0], [LEG, 0.0], [LEG * (1.0 + np.cos(at)), LEG * np.sin(at)]])


def jobs() -> dict[str, Program]:
    """The jobs by name."""
    made = {f"corner {degrees}": corner(degrees) for degrees in ANGLES}
    return made | {
        "pentagon": problems.pentagon(),
        "five points": problems.five_points(),
        "zig-zag": problems.zigzag(),
        "spiral of 100": problems.star_spiral(100),
    }


def measured(job: Program, **named: str) -> dict[str, Any]:
    """Cycle time and planning time [s], verdict and sentence of one method; a refusal is its sentence."""
    began = time.perf_counter()
    try:
        made = planner.plan(job, problems.machine(), **named)
    except PlannerError as fault:
        return {"cycle_time_s": None, "passed": False, "sentence": str(fault)}
    return {
        "cycle_time_s": made.trajectory.cycle_time if made.trajectory is not None else None,
        "passed": made.verdict is not None and made.verdict.passed,
        "status": made.status.value,
        "sentence": made.sentence,
        "points": made.grid_points,
        "planning_time_s": time.perf_counter() - began,
    }


def main() -> None:
    """Run all jobs and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resume", action="store_true", help="keep the jobs of an earlier run")
    rows: dict[str, dict[str, Any]] = {}
    if parser.parse_args().resume:
        rows = json.loads((RESULTS / "tube.json").read_text(encoding="utf-8"))["jobs"]
    for name, job in jobs().items():
        if name in rows:
            continue
        rows[name] = {"tube": measured(job, method="tube")}
        rows[name] |= {shape: measured(job, method="optimal", corner=shape) for shape in SMOOTHINGS}
        print(name, {label: row["cycle_time_s"] for label, row in rows[name].items()}, flush=True)
        write_results("tube", {"jobs": rows}, _table(rows))


def _table(rows: dict[str, dict[str, Any]]) -> str:
    lines = []
    for name, row in rows.items():
        limit = row["tube"]["cycle_time_s"]
        cells = [name, _cell(row["tube"], None)]
        cells += [_cell(row[shape], limit) for shape in SMOOTHINGS]
        took = row["tube"].get("planning_time_s")
        lines.append([*cells, str(row["tube"].get("points", "")), f"{took:.1f}" if took else ""])
    columns = [
        "job",
        "tube [s]",
        *(f"optimal, {shape} [s]" for shape in SMOOTHINGS),
        "points",
        "planning [s]",
    ]
    text = "Cycle times, and in brackets their ratio to `tube`; * the verdict failed. Points and planning time are those of `tube`.\n\n"
    return text + markdown(columns, lines)


def _cell(row: dict[str, Any], limit: float | None) -> str:
    if row["cycle_time_s"] is None:
        return str(row.get("status", "refused"))
    ratio = f" ({row['cycle_time_s'] / limit:.4f})" if limit else ""
    return f"{row['cycle_time_s']:.4f}{ratio}{'' if row['passed'] else ' *'}"


if __name__ == "__main__":
    main()
