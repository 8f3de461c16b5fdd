"""The time that no motion falls short of: how far motions are above it, and is any below?

    python -m benchmarks.judge.bound [--jobs 500] [--first 0]            into results/least-time.json and .md

The jobs of jobs/searched.py by the default method; then random jobs (jobs/random_lines.py), each planned by the closed forms and by
`optimal` and `second-order` with effort `quick`: a motion that passes its verdict and is below its bound breaks the law.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import random_lines
from benchmarks.jobs.searched import jobs
from benchmarks.record import markdown, write_results
from planner.base.errors import InputError
from planner.base.threads import use_threads
from planner.machine import Machine
from planner.nc.program import Program

QUICK = {"effort": "quick"}
WAYS: tuple[tuple[str, dict[str, Any]], ...] = (
    *((name, {}) for name in ("kinematic", "fir", "bezier", "stop")),
    *((name, QUICK) for name in ("optimal", "second-order")),
)
SHARES = (0.0, 0.1, 0.5, 0.9, 1.0)  # quantiles of the table


def above(program: Program, machine: Machine, method: str, settings: dict[str, Any]) -> dict[str, Any] | None:
    """How far a motion is above its bound; None where none passes, or there is no bound."""
    began = time.process_time()
    try:
        plan = planner.plan(program, machine, method=method, **settings)
    except InputError:
        return None
    planned = time.process_time() - began
    if plan.verdict is None or not plan.verdict.passed or plan.least_time is None:
        return None
    bounded = time.process_time() - began - planned
    return {
        "method": method,
        "time_s": plan.cycle_time,
        "least_s": plan.least_time,
        "planned": planned,
        "bounded": bounded,
    }


def main() -> None:
    """Plan, compare, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    use_threads(1)
    named = {}
    for name, (make, machine) in jobs().items():
        named[name] = above(make(), machine, "optimal", {})
        print(name, named[name], flush=True)
    rows = []
    for seed in range(asked.first, asked.first + asked.jobs):
        program, machine = random_lines.job(seed)
        for method, settings in WAYS:
            row = above(program, machine, method, settings)
            if row is not None:
                rows.append({"job": seed, **row})
                if row["least_s"] > row["time_s"]:
                    print("below its bound:", rows[-1], flush=True)
    write_results("least-time", {"jobs": named, "random": rows}, f"{_named(named)}\n{_random(rows)}")


def _named(rows: dict[str, Any]) -> str:
    cells = [
        [
            name,
            f"{row['time_s']:.6g}",
            f"{row['least_s']:.6g}",
            f"{100 * (row['time_s'] / row['least_s'] - 1):.2g} %",
            f"{100 * row['bounded'] / row['planned']:.2g} %",
        ]
        for name, row in rows.items()
        if row is not None
    ]
    return markdown(
        [
            "job",
            "cycle time [s]",
            "fastest possible, at least [s]",
            "at most above",
            "computing, of planning",
        ],
        cells,
    )


def _random(rows: list[dict[str, Any]]) -> str:
    cells = []
    for method, _ in WAYS:
        ratio = np.array([row["time_s"] / row["least_s"] - 1 for row in rows if row["method"] == method])
        if len(ratio):
            shares = [f"{100 * share:.2g} %" for share in np.quantile(ratio, SHARES)]
            cells.append([method, f"{len(ratio)}", f"{(ratio < 0).sum()}", *shares])
    columns = [
        "method",
        "motions",
        "below the bound",
        *(f"above, {100 * share:g} % of them" for share in SHARES),
    ]
    return "Random jobs, motions that pass their verdict:\n\n" + markdown(columns, cells)


if __name__ == "__main__":
    main()
