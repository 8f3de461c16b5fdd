"""Is the search for geometry and feed together ever slower than `optimal` without it, and how many of its windows converge?

    python -m benchmarks.joint_campaign [--jobs 250] [--first 0] [--processes 2]     into results/joint-campaign.json and .md

The random programs of random_lines.py on the built-in `mill` and on the machine of problems.py; every program on both. Compared are
`optimal` with the rounds of reshaping that effort `normal` has and no search, and `optimal` as it is by default. Jobs that the results
hold already are not made again.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from typing import Any

import numpy as np

import planner
from benchmarks import problems, random_lines
from benchmarks.record import RESULTS, markdown, write_results
from planner.base.errors import PlannerError
from planner.base.threads import use_threads
from planner.job.plan import Plan
from planner.job.trace import Trace
from planner.machine import Machine
from planner.optimal.effort import EFFORTS
from planner.tube.guess import Guess
from planner.tube.outcome import TubeSolution
from planner.tube.own import TubeOwn
from planner.tube.run import TubeRun

NAME = "joint-campaign"
ALLOWED = 1e-4  # share of the cycle time by which the search may end slower than `optimal` [-]
NICE = 10  # of the processes
ROUNDS = EFFORTS["normal"].rounds


@cache
def counted() -> list[TubeSolution]:
    """What all searches of this process find from now on."""
    found: list[TubeSolution] = []
    solve = TubeOwn.solve

    def solve_and_count(self: TubeOwn, run: TubeRun, guess: Guess) -> TubeSolution:
        found.append(solve(self, run, guess))
        return found[-1]

    TubeOwn.solve = solve_and_count  # type: ignore[method-assign]
    return found


def machines() -> dict[str, Machine]:
    """The machines of the campaign."""
    return {"mill": planner.load_machine("mill"), "peers": problems.machine()}


def made(seed: int, name: str) -> dict[str, Any]:
    """One job with and without the search."""
    os.nice(max(NICE - os.nice(0), 0))
    use_threads(1)
    program, _ = random_lines.job(seed)
    machine, found, trace = machines()[name], counted(), Trace()
    row: dict[str, Any] = {"seed": seed, "machine": name, "blocks": len(program.kind)}
    try:
        row |= _of("optimal", planner.plan(program, machine, rounds=ROUNDS))
        found.clear()
        began = time.process_time()
        row |= _of("search", planner.plan(program, machine, log=trace))
    except PlannerError as fault:
        return row | {"fault": str(fault)}
    searches = [step for step in trace.steps if step.name == "search"]
    return row | {
        "at_once": bool(searches and searches[0].kept),
        "cpu_s": time.process_time() - began,
        "windows": sum(one.windows for one in found),
        "solved": sum(one.solved for one in found),
        "iterations": sum(one.iterations for one in found),
    }


def _of(name: str, plan: Plan) -> dict[str, Any]:
    if plan.trajectory is None or plan.verdict is None:
        return {f"{name}_s": None, f"{name}_passed": False}
    return {f"{name}_s": plan.trajectory.cycle_time, f"{name}_passed": plan.verdict.passed}


def table(rows: list[dict[str, Any]]) -> str:
    """What came of it, by machine."""
    cells = []
    for name in (*machines(), "both"):
        own = [row for row in rows if name in (row["machine"], "both") and "fault" not in row]
        whole = [row for row in own if row["optimal_passed"] and row["search_passed"]]
        gain = np.array([1.0 - row["search_s"] / row["optimal_s"] for row in whole])
        if not len(gain):
            continue
        windows, solved = (sum(row[key] for row in own) for key in ("windows", "solved"))
        cells.append(
            [
                name,
                str(len(own)),
                str(sum(not row["search_passed"] for row in own)),
                f"{windows}",
                f"{solved / max(windows, 1):.1%}",
                f"{np.mean([row['at_once'] for row in own]):.1%}",
                f"{gain.mean():.2%}",
                f"{np.median(gain):.2%}",
                f"{gain.max():.1%}",
                str(int((gain < -ALLOWED).sum())),
                f"{max(-gain.min(), 0.0):.1e}",
            ]
        )
    columns = ["machine", "jobs", "verdicts failed", "windows", "converged", "jobs at the first attempt"]
    columns += [
        "faster than `optimal` on the mean",
        "median",
        "at most",
        f"slower by more than {ALLOWED:g}",
        "at most slower",
    ]
    slow = sorted(
        (row["search_s"] / row["optimal_s"] - 1.0, row["seed"], row["machine"])
        for row in rows
        if row.get("optimal_s")
        and row.get("search_s")
        and row["search_s"] > row["optimal_s"] * (1.0 + ALLOWED)
    )
    text = markdown(columns, cells)
    if slow:
        text += (
            "\nSlower: "
            + ", ".join(f"job {seed} on {name} by {by:.1e}" for by, seed, name in slow[::-1])
            + ".\n"
        )
    for row in rows:
        if "fault" in row:
            text += f"\nJob {row['seed']} on {row['machine']} was refused: {row['fault']}\n"
    return (
        "`optimal` as it is by default against `optimal` with rounds of reshaping and no search.\n\n" + text
    )


def main() -> None:
    """Run what is missing."""
    parser = argparse.ArgumentParser(description="the search in time against optimal without it")
    parser.add_argument("--jobs", type=int, default=250, help="programs, each on both machines")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    file = RESULTS / f"{NAME}.json"
    rows: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))["jobs"] if file.exists() else []
    have = {(row["seed"], row["machine"]) for row in rows}
    seeds = range(asked.first, asked.first + asked.jobs)
    todo = [(seed, name) for seed in seeds for name in machines() if (seed, name) not in have]
    with ProcessPoolExecutor(asked.processes) as pool:
        for n, done in enumerate(as_completed([pool.submit(made, *one) for one in todo])):
            rows.append(done.result())
            if n % 3 == 0 or n == len(todo) - 1:
                rows.sort(key=lambda row: (row["seed"], row["machine"]))
                write_results(NAME, {"jobs": rows}, table(rows))


if __name__ == "__main__":
    main()
