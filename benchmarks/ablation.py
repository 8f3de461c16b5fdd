"""What each heuristic of the loop is worth: how often it ran, how often its result was kept, what it gained, and what it cost.

    python -m benchmarks.ablation [--jobs 150] [--traces FILE] [--report]     into results/ablation.json and .md

The random jobs of benchmarks/random_lines.py, and the programs of ../shared/nc up to `NC_BYTES` on machine "mill", are planned by
`optimal` with a trace (planner/job/trace.py), in one process. A trace has every try with the cycle time of what it competed with, so
that one run tells of all heuristics. Traces are added to FILE, one job a line; jobs in it are not planned again, and --report plans
none.

Gains are shares of the cycle time, summed over all tries that were kept and divided by the number of jobs; costs are computing times,
shares of that of all jobs. A gain counts where it was made: in a plan that another one replaced later it is counted too, so that the
gains are upper bounds.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.random_lines import job
from benchmarks.record import markdown, write_results
from benchmarks.tries import add_row, programs, read_rows, summed
from planner.base.errors import PlannerError
from planner.job.trace import Trace
from planner.machine import Machine
from planner.methods.optimal import OptimalMethod
from planner.nc.program import Program

JOBS = 150
NC_BYTES = 20_000
SOLVER = "windows", "other starts", "divided", "standstills"


def jobs(count: int) -> Iterator[tuple[str, Program, Machine]]:
    """Two thirds of the random jobs, the programs, and the rest of the random jobs."""
    seeds = [(f"random {seed}", *job(seed)) for seed in range(count)]
    yield from seeds[: 2 * count // 3]
    yield from programs(NC_BYTES)
    yield from seeds[2 * count // 3 :]


def traced(program: Program, machine: Machine) -> dict[str, Any]:
    """Steps and outcome of one job."""
    trace = Trace()
    try:
        plan = OptimalMethod().plan(program, machine, log=trace)
    except PlannerError as fault:
        return {"outcome": str(fault), "cycle_time": None, "steps": trace.as_json()}
    time = plan.trajectory.cycle_time if plan.trajectory is not None else None
    return {"outcome": plan.sentence, "cycle_time": time, "steps": trace.as_json()}


def report(rows: list[dict[str, Any]]) -> tuple[dict[str, Any], str]:
    """Numbers and table over all jobs."""
    total = sum(row["steps"][-1]["at"] for row in rows if row["steps"])
    found = summed(rows, total)
    solver = {name: sum(step.get(name, 0) for row in rows for step in row["steps"]) for name in SOLVER}
    columns = [
        "heuristic",
        "jobs",
        "ran",
        "kept",
        "gain, mean over all jobs",
        "most",
        "share of computing time",
    ]
    table = [
        [
            name,
            str(entry["jobs"]),
            str(entry["ran"]),
            str(entry["kept"]),
            f"{entry['gain']:.1e}",
            f"{entry['most']:.1e}",
            f"{entry['took']:.1%}",
        ]
        for name, entry in sorted(found.items())
    ]
    solved = sum(row["cycle_time"] is not None for row in rows)
    windows = ", ".join(f"{name} {count}" for name, count in solver.items())
    text = f"{len(rows)} jobs, {solved} solved, {total:.0f} s of computing. Of the interior-point solver: {windows}.\n\n"
    return {"jobs": len(rows), "heuristics": found, "solver": solver}, text + markdown(columns, table)


def main() -> None:
    """Plan what is missing, and report."""
    parser = argparse.ArgumentParser(description="what each heuristic of the loop is worth")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--traces", type=Path)
    parser.add_argument("--report", action="store_true", help="plan nothing")
    chosen = parser.parse_args()
    rows = read_rows(chosen.traces)
    known = {row["job"] for row in rows}
    for name, program, machine in () if chosen.report else jobs(chosen.jobs):
        if name in known:
            continue
        rows.append({"job": name, **traced(program, machine)})
        add_row(chosen.traces, rows[-1])
        print(name, rows[-1]["cycle_time"], len(rows[-1]["steps"]), flush=True)
    numbers, text = report(rows)
    print(text)
    write_results("ablation", numbers, text)


if __name__ == "__main__":
    main()
