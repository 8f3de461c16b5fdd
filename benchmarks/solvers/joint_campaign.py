"""Is the search for geometry and feed together ever slower than `optimal` without it, and how many of its windows converge?

    python -m benchmarks.solvers.joint_campaign [--jobs 250] [--processes 2]     into results/joint-campaign.json and .md
    python -m benchmarks.solvers.joint_campaign --hard                           into results/joint-hard.json and .md

The random programs of jobs/random_lines.py, or those on which the search is hard: tolerances of a micrometre, legs of very different
lengths, a low normal acceleration. Each is planned on the built-in `mill` and on the machine of jobs/problems.py, by `optimal` along
splines, and by `optimal` as it is by default.
"""

from __future__ import annotations

import argparse
import itertools
import os
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems, random_lines
from benchmarks.record import markdown, write_results
from planner.base.errors import PlannerError
from planner.base.threads import use_threads
from planner.joint.groups import Search
from planner.joint.guess import Guess
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.run import TubeRun
from planner.machine import Machine
from planner.nc.program import Program
from planner.planning.job.plan import Plan
from planner.planning.job.trace import Trace

ALLOWED = 1e-4  # share of the cycle time by which the search may end slower than `optimal` [-]
NICE = 10  # of the processes
# Of the hard jobs: tolerances [mm], shares of a long leg over a short one, normal accelerations [mm/s2].
TOLERANCES, SHARES, NORMAL = (0.001, 0.0001), (30.0, 1000.0), (200.0, 20.0)
LONG, LEGS = 50.0, 12  # [mm], legs of each kind


@cache
def counted() -> list[TubeSolution]:
    """What all searches of this process find from now on."""
    planner.plan(problems.pentagon(), "mill")  # kernels are loaded
    found: list[TubeSolution] = []
    search = TubeOwn.search

    def search_and_count(self: TubeOwn, run: TubeRun, guess: Guess) -> Search[TubeSolution]:
        ended = yield from search(self, run, guess)
        found.append(ended)
        return ended

    TubeOwn.search = search_and_count  # type: ignore[method-assign]
    return found


def machines() -> dict[str, Machine]:
    """The machines of the campaign."""
    return {"mill": planner.load_machine("mill"), "peers": problems.machine()}


def legs_of_two_lengths(share: float) -> Program:
    """Long and short legs in turn, every one turned by 60 degrees from the one before, to the left and to the right in pairs."""
    heading = np.cumsum(np.resize([1.0, 1.0, -1.0, -1.0], 2 * LEGS)) * np.pi / 3
    length = np.resize([LONG, LONG / share], 2 * LEGS)
    steps = length[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), source=f"legs of 1:{share:g}")


def hard() -> dict[str, tuple[Program, dict[str, Any]]]:
    """The hard programs and settings of the machine."""
    shapes = {
        "pentagon": problems.pentagon(),
        "zig-zag": problems.zigzag(),
        "circle": problems.chord_circle(),
    }
    found: dict[str, tuple[Program, dict[str, Any]]] = {}
    for (name, program), tolerance in itertools.product(shapes.items(), TOLERANCES):
        found[f"{name}, tolerance {1e3 * tolerance:g} um"] = program, {"tolerance": tolerance}
    for share, tolerance in itertools.product(SHARES, (0.02, 0.001)):
        name = f"legs of 1:{share:g}, tolerance {1e3 * tolerance:g} um"
        found[name] = legs_of_two_lengths(share), {"tolerance": tolerance}
    for (name, program), normal in itertools.product(shapes.items(), NORMAL):
        found[f"{name}, normal acceleration {normal:g} mm/s2"] = program, {"normal_acceleration": normal}
    return found


def made(job: int | str, name: str) -> dict[str, Any]:
    """A random job, or a hard one by its name, with and without the search."""
    os.nice(max(NICE - os.nice(0), 0))
    use_threads(1)
    program, settings = (random_lines.job(job)[0], {}) if isinstance(job, int) else hard()[job]
    machine, found, trace = machines()[name].model_copy(update=settings), counted(), Trace()
    row: dict[str, Any] = {"job": job, "machine": name, "blocks": len(program.kind)}
    try:
        row |= _of("optimal", planner.plan(program, machine, geometry="spline"))
        found.clear()
        began = time.process_time()
        row |= _of("search", planner.plan(program, machine, log=trace))
    except PlannerError as fault:
        return row | {"fault": str(fault)}
    searches = [step for step in trace.steps if step.name == "search"]
    return row | {
        "at_once": bool(searches and searches[0].kept),
        "searches": len(searches),
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
        (row["search_s"] / row["optimal_s"] - 1.0, row["job"], row["machine"])
        for row in rows
        if row.get("optimal_s")
        and row.get("search_s")
        and row["search_s"] > row["optimal_s"] * (1.0 + ALLOWED)
    )
    text = markdown(columns, cells)
    if slow:
        text += (
            "\nSlower: "
            + ", ".join(f"job {job} on {name} by {by:.1e}" for by, job, name in slow[::-1])
            + ".\n"
        )
    for row in rows:
        if "fault" in row:
            text += f"\nJob {row['job']} on {row['machine']} was refused: {row['fault']}\n"
    return "`optimal` as it is by default against `optimal` along splines.\n\n" + text


def table_of_hard(rows: list[dict[str, Any]]) -> str:
    """A line for each of the hard jobs."""
    columns = [
        "job",
        "machine",
        "`optimal` without search [s]",
        "with [s]",
        "gain",
        "passed",
        "at the first attempt",
        "CPU s",
    ]
    cells = []
    for row in rows:
        start = [str(row["job"]), row["machine"]]
        if "fault" in row or not row["optimal_s"] or not row["search_s"]:
            cells.append([*start, row.get("fault", "not planned"), *[""] * 5])
            continue
        cells.append(
            [
                *start,
                f"{row['optimal_s']:.5f}",
                f"{row['search_s']:.5f}",
                f"{1.0 - row['search_s'] / row['optimal_s']:.2%}",
                "both" if row["optimal_passed"] and row["search_passed"] else "no",
                "yes" if row["at_once"] else f"no, {row['searches']} searches",
                f"{row['cpu_s']:.2f}",
            ]
        )
    return markdown(columns, cells)


def main() -> None:
    """Plan all jobs, and write the table."""
    parser = argparse.ArgumentParser(description="the search in time against optimal without it")
    parser.add_argument("--jobs", type=int, default=250, help="random programs, each on both machines")
    parser.add_argument("--hard", action="store_true", help="the hard ones instead")
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    jobs: list[int | str] = [*hard()] if asked.hard else [*range(asked.jobs)]
    with ProcessPoolExecutor(asked.processes) as pool:
        planned = [pool.submit(made, job, name) for name in machines() for job in jobs]
        rows = []
        for one in planned:
            rows.append(one.result())
            print(rows[-1], flush=True)
    if asked.hard:
        write_results("joint-hard", {"jobs": rows}, table_of_hard(rows))
    else:
        write_results("joint-campaign", {"jobs": rows}, table(rows))


if __name__ == "__main__":
    main()
