"""Method `optimal` beside optima that are known exactly: how far is it from them?

    python -m benchmarks.judge.known_optima [--share 1] [--first 0] [--processes 1]            into results/known-optima.json and .md

The jobs of benchmarks/jobs/known.py, 3,000 of them; `--share` of each sort. Every plan has to pass its verdict.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

import planner
from benchmarks.jobs.known import SORTS, Known, job
from benchmarks.record import markdown, write_results
from planner.base.threads import use_threads
from planner.nc.program import Program

WITHIN = 1e-4  # of the least time, asked of every plan [-]
SHARES = (0.5, 0.9, 0.99, 1.0)  # quantiles of the table


def above(known: Known) -> float:
    """By how much of its time the plan is slower than the least [-]; NaN where none passes. What is known of the difference
    of two jobs counts by it."""
    time = _time(known, known.program)
    less = 0.0 if known.less is None else _time(known, known.less)
    return (time - less) / known.least - 1.0


def _time(known: Known, program: Program) -> float:
    plan = planner.plan(program, known.machine)
    return plan.cycle_time if plan.verdict is not None and plan.verdict.passed else np.nan


def row(sort: int, seed: int) -> dict[str, Any]:
    """What came of a job: of the sort with that place in `SORTS`."""
    use_threads(1)
    make = SORTS[sort][0]
    found: dict[str, Any] = {"sort": make.__name__.replace("_", " "), "seed": seed}
    try:
        known = job(make, seed)
    except RuntimeError as error:
        return found | {"not_known": str(error)}
    return found | {"least_s": float(known.least), "error": float(known.error), "above": float(above(known))}


def main() -> None:
    """Plan, compare, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=1.0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=1)
    asked = parser.parse_args()
    tasks = [
        (sort, seed)
        for sort, (_, count) in enumerate(SORTS)
        for seed in range(asked.first, asked.first + round(asked.share * count))
    ]
    rows = []
    with ProcessPoolExecutor(asked.processes) as pool:
        for found in pool.map(row, *zip(*tasks, strict=True)):
            rows.append(found)
            if not found.get("above", 0.0) <= WITHIN:
                print(found, flush=True)
    write_results("known-optima", {"jobs": rows}, _table(rows))


def _table(rows: list[dict[str, Any]]) -> str:
    known = [row for row in rows if "above" in row]
    cells = []
    for sort in dict.fromkeys(row["sort"] for row in known):
        mine = [row for row in known if row["sort"] == sort]
        slower = np.array([row["above"] for row in mine])
        passed = slower[np.isfinite(slower)]
        counts = f"{len(mine)}", f"{len(mine) - len(passed)}", f"{(passed > WITHIN).sum()}"
        shares = [f"{share:.1e}" for share in np.quantile(passed, SHARES)]
        error = max(row["error"] for row in mine)
        cells.append([sort, *counts, f"{error:.0e}", f"{passed.min():.1e}", *shares])
    heads = [f"above, {100 * share:g} % of them" for share in SHARES]
    columns = ["sort", "jobs", "not passed", f"more than {WITHIN:g} above", "known to", "least above", *heads]
    left_out = (
        f"\nThe optimum of {len(rows) - len(known)} more jobs was not found.\n"
        if len(rows) > len(known)
        else ""
    )
    return markdown(columns, cells) + left_out


if __name__ == "__main__":
    main()
