"""The search for geometry and feed together where it is hard: tolerances of a micrometre, legs of very different lengths, a low normal
acceleration. Does it work, and does it keep `optimal` where it does not?

    python -m benchmarks.joint_hard     into results/joint-hard.json and .md

Every job on the built-in `mill` and on the machine of problems.py, by `optimal` with rounds of reshaping and no search, and as it is
by default.
"""

from __future__ import annotations

import argparse
import itertools
import time
from typing import Any

import numpy as np

import planner
from benchmarks import problems
from benchmarks.record import markdown, write_results
from planner.base.errors import PlannerError
from planner.base.threads import use_threads
from planner.job.plan import Plan
from planner.job.trace import Trace
from planner.machine import Machine
from planner.nc.program import Program
from planner.optimal.effort import EFFORTS

ROUNDS = EFFORTS["normal"].rounds
TOLERANCES = 0.001, 0.0001  # [mm]
SHARES = 30.0, 1000.0  # of a long leg over a short one
NORMAL = 200.0, 20.0  # [mm/s2]
LONG, LEGS, FEED = 50.0, 12, 100.0  # [mm], legs of each kind, [mm/s]


def legs_of_two_lengths(share: float) -> Program:
    """Long and short legs in turn, every one turned by 60 degrees from the one before, to the left and to the right in pairs."""
    heading = np.cumsum(np.resize([1.0, 1.0, -1.0, -1.0], 2 * LEGS)) * np.pi / 3
    length = np.resize([LONG, LONG / share], 2 * LEGS)
    steps = length[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    points = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    return problems.polyline(points, feed=FEED, source=f"legs of 1:{share:g}")


def jobs() -> list[tuple[str, Program, dict[str, Any]]]:
    """Name, program, settings of the machine."""
    shapes = {
        "pentagon": problems.pentagon(),
        "zig-zag": problems.zigzag(),
        "circle": problems.chord_circle(),
    }
    found: list[tuple[str, Program, dict[str, Any]]] = []
    for (name, program), tolerance in itertools.product(shapes.items(), TOLERANCES):
        found.append((f"{name}, tolerance {1e3 * tolerance:g} um", program, {"tolerance": tolerance}))
    for share, tolerance in itertools.product(SHARES, (0.02, 0.001)):
        settings = {"tolerance": tolerance}
        text = f"legs of 1:{share:g}, tolerance {1e3 * tolerance:g} um"
        found.append((text, legs_of_two_lengths(share), settings))
    for (name, program), normal in itertools.product(shapes.items(), NORMAL):
        found.append(
            (f"{name}, normal acceleration {normal:g} mm/s2", program, {"normal_acceleration": normal})
        )
    return found


def measured(name: str, program: Program, machine: Machine) -> dict[str, Any]:
    """One job with and without the search."""
    trace = Trace()
    row: dict[str, Any] = {"job": name, "machine": machine.name}
    try:
        row |= _of("optimal", planner.plan(program, machine, rounds=ROUNDS))
        began = time.process_time()
        row |= _of("search", planner.plan(program, machine, log=trace))
    except PlannerError as fault:
        return row | {"fault": str(fault)}
    searches = [step for step in trace.steps if step.name == "search"]
    return row | {
        "cpu_s": time.process_time() - began,
        "searches": len(searches),
        "at_once": bool(searches and searches[0].kept),
    }


def _of(name: str, plan: Plan) -> dict[str, Any]:
    if plan.trajectory is None or plan.verdict is None:
        return {f"{name}_s": None, f"{name}_passed": False, f"{name}_sentence": plan.sentence}
    return {
        f"{name}_s": plan.cycle_time,
        f"{name}_passed": plan.verdict.passed,
        f"{name}_sentence": plan.sentence,
    }


def table(rows: list[dict[str, Any]]) -> str:
    """The rows as Markdown."""
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
        if "fault" in row or not row["optimal_s"] or not row["search_s"]:
            cells.append([row["job"], row["machine"], row.get("fault", "not planned"), *[""] * 5])
            continue
        cells.append(
            [
                row["job"],
                row["machine"],
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
    """All of them, or those with a word in their name."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="a part of the names of the jobs; nothing is written")
    only = parser.parse_args().only
    use_threads(1)
    planner.plan(problems.pentagon(), "mill")  # kernels are loaded
    rows = []
    for machine in (planner.load_machine("mill"), problems.machine()):
        for name, program, settings in jobs():
            if only not in name:
                continue
            rows.append(measured(name, program, machine.model_copy(update=settings)))
            print({key: value for key, value in rows[-1].items() if "sentence" not in key}, flush=True)
    if not only:
        write_results("joint-hard", {"jobs": rows}, table(rows))


if __name__ == "__main__":
    main()
