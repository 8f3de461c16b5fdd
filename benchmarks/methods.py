"""Every method on the same jobs, machine, tolerance and verifier: cycle times and verdicts side by side.

    python -m benchmarks.methods [FILE ...] [--methods optimal kinematic ...] [--name RESULT]

The jobs are those of problems.py: pentagon, zig-zag, circle and spiral of chords; with FILEs, NC or HPGL programs come after them.
The machine is v 100 mm/s, a 2000 mm/s2, j 2e5 mm/s3, tolerance 0.05 mm, 1 ms.
Results: benchmarks/results/RESULT.json and .md.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import planner
from benchmarks import problems
from benchmarks.record import markdown, write_results
from planner.errors import PlannerError
from planner.methods.names import METHODS
from planner.nc.program import Program

JOBS = {
    "pentagon": problems.pentagon,
    "zig-zag": problems.zigzag,
    "circle": problems.chord_circle,
    "spiral": problems.star_spiral,
}


def main() -> None:
    """Run all methods on all jobs and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    parser.add_argument("--name", default="methods")
    given = parser.parse_args()
    jobs: dict[str, Program | Path] = {name: make() for name, make in JOBS.items()}
    jobs |= {file.name: file for file in given.files}
    machine = problems.machine()
    rows = []
    for name, job in jobs.items():
        for method in given.methods:
            rows.append({"job": name, "method": method} | _run(job, machine, method))
            print(rows[-1], flush=True)
    write_results(given.name, {"rows": rows}, _table(rows, given.methods))


def _run(job: Program | Path, machine: planner.Machine, method: str) -> dict[str, Any]:
    began = time.perf_counter()
    try:
        plan = planner.plan(job, machine, method=method)
    except PlannerError as fault:
        return {"outcome": "refused", "message": str(fault)}
    took = round(time.perf_counter() - began, 3)
    if plan.trajectory is None or plan.verdict is None:
        return {"outcome": plan.status.value, "message": plan.sentence, "wall_s": took}
    return {
        "outcome": "passed" if plan.verdict.passed else "failed",
        "cycle_time_s": plan.trajectory.cycle_time,
        "worst": {limit: check.ratio for limit, check in plan.verdict.limits.items()},
        "faults": [str(fault) for fault in plan.verdict.faults],
        "status": plan.status.value,
        "grid_points": plan.grid_points,
        "wall_s": took,
    }


def _table(rows: list[dict[str, Any]], methods: list[str]) -> str:
    """Cycle times in seconds, a job a row; with a mark where the verdict failed or there is no motion."""
    cells: dict[str, dict[str, str]] = {}
    for row in rows:
        cell = f"{row['cycle_time_s']:.4f}" if "cycle_time_s" in row else row["outcome"]
        cells.setdefault(row["job"], {})[row["method"]] = cell + (
            " (breaks a limit)" if row["outcome"] == "failed" else ""
        )
    table = markdown(
        ["cycle time [s]", *methods], [[job, *(found[m] for m in methods)] for job, found in cells.items()]
    )
    return table + "\n`toppra` does not limit the jerk. All others are judged with it.\n"


if __name__ == "__main__":
    main()
