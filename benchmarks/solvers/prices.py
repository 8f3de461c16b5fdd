"""What more of a limit saves, foretold by a plan and found by planning again: ten programs, on Bezier corners and on splines.

    python -m benchmarks.solvers.prices [PROGRAM ...] [--nc DIR]

Programs that are named are made again, the others stay as they are in the results.
Everything goes through `planner.plan`. Made again are the plans with 10 % more feed (F words, and the machine's feed_max), with 10 %
more of each axis limit that is foretold to save 5e-4 of the time or more, and with 10 um more tolerance. A number counts as right
within 15 % or 1e-4 of the time, a hint if the range it is told by holds what was found, to 1e-4 of the time.
Results: benchmarks/results/prices.json and .md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems
from benchmarks.record import RESULTS, markdown, write_results
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.planning.job.plan import Plan
from planner.sensitivity.prices import HINT, HINT_LEAST, MORE_LIMIT, MORE_TOLERANCE, more_of

CORNERS = ("bezier", "auto")
WORTH = 5e-4  # what is foretold to save less is not planned again [share of the time]
NC = Path("../shared/nc")
BRACKET = Path(planner.__file__).parent / "examples" / "bracket.ngc"
RELIEF_BLOCKS, RELIEF_ROW, RELIEF_STEP = 400, 100, 0.3  # [-, blocks, mm]


def relief() -> Program:
    """A small relief: rows of short blocks over a sum of waves."""
    rng = np.random.default_rng(3)
    amplitude, wave, phase = (
        rng.normal(size=12),
        rng.uniform(0.05, 0.6, (12, 2)),
        rng.uniform(0.0, 2 * np.pi, 12),
    )
    row, k = np.divmod(np.arange(RELIEF_BLOCKS), RELIEF_ROW)
    x = RELIEF_STEP * np.where(row % 2 == 0, k, RELIEF_ROW - 1 - k)
    y = 0.4 * row
    z = (0.4 * amplitude * np.sin(np.outer(x, wave[:, 0]) + np.outer(y, wave[:, 1]) + phase)).sum(axis=1)
    return problems.polyline(np.stack([x, y, z], axis=1).round(3), source="relief")


def jobs(folder: Path) -> dict[str, Callable[[], tuple[Program, Machine]]]:
    """The ten programs, each with its machine."""
    peers = problems.machine()

    def recorded(name: str, machine: str) -> Callable[[], tuple[Program, Machine]]:
        return lambda: (
            read_program(next(folder.glob(f"*{name}*")), load_machine(machine)),
            load_machine(machine),
        )

    return {
        "pentagon": lambda: (problems.pentagon(), peers),
        "zig-zag": lambda: (problems.zigzag(), peers),
        "arcs": lambda: (problems.arcs(), peers),
        "five points": lambda: (problems.five_points(), problems.five_points_machine()),
        "spiral of chords": lambda: (problems.star_spiral(400), peers),
        "relief": lambda: (relief(), peers),
        "bracket": lambda: (read_program(BRACKET, load_machine("mill")), load_machine("mill")),
        "lathe_pawn": recorded("lathe_pawn", "mill"),
        "no_spaces": recorded("no_spaces", "router"),
        "cds": recorded("cds.ngc", "mill"),
    }


def with_more(program: Program, machine: Machine, name: str) -> tuple[Program, Machine]:
    """The job with more of something."""
    if name == "tolerance":
        return program, machine.model_copy(update={"tolerance": machine.tolerance + MORE_TOLERANCE})
    if name != "feed":
        return program, more_of(machine, name, MORE_LIMIT)
    if machine.feed_max is not None:
        machine = machine.model_copy(update={"feed_max": machine.feed_max * (1.0 + MORE_LIMIT)})
    return dataclasses.replace(program, feed=program.feed * (1.0 + MORE_LIMIT)), machine


def time_of(plan: Plan) -> float:
    """The cycle time of a solved plan [s]."""
    assert plan.trajectory is not None
    return plan.trajectory.cycle_time


def compared(
    name: str, program: Program, machine: Machine, corner: str, among: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Foretold and found for one program on one kind of corners, of everything worth it or of what is `among` some names."""
    began = time.process_time()
    plan = planner.plan(program, machine, method="optimal", corner=corner).require()
    took = time.process_time() - began
    prices, cycle_time = plan.prices, time_of(plan)
    rows: list[dict[str, Any]] = []
    for limit, saved in prices.saved.items() if prices is not None else ():
        if among and limit not in among:
            continue
        if limit not in ("feed", "tolerance") and saved < WORTH * cycle_time:
            continue
        # the program's own G64 P beats the machine's tolerance
        wider = float(plan.toolpath.tolerance.max()) + MORE_TOLERANCE if limit == "tolerance" else None
        more = with_more(program, machine, limit)
        again = planner.plan(*more, method="optimal", corner=corner, tolerance=wider).require()
        found = cycle_time - time_of(again)
        assert prices is not None
        least, most = prices.ranges[limit]
        room = HINT_LEAST * cycle_time
        hint = limit in prices.hints
        right = (
            least - room <= found <= most + room
            if hint
            else abs(saved - found) <= max(HINT * abs(found), room)
        )
        rows.append(
            {
                "limit": limit,
                "foretold_s": saved,
                "least_s": least,
                "most_s": most,
                "hint": hint,
                "found_s": found,
                "ratio": saved / found if found else float("nan"),
                "right": bool(right),
                "passed": again.verdict is not None and again.verdict.passed,
            }
        )
        print(f"{name} {corner} {limit}: {saved:.4g} [{least:.4g}, {most:.4g}] found {found:.4g}", flush=True)
    return {
        "program": name,
        "corner": corner,
        "machine": machine.name,
        "cycle_time_s": cycle_time,
        "cpu_s": took,
        "rows": rows,
    }


def table(results: list[dict[str, Any]]) -> str:
    """The results in Markdown."""
    lines = []
    for result in results:
        for row in result["rows"]:
            lines.append(
                [
                    f"{result['program']}, {result['corner']}",
                    row["limit"],
                    f"{row['least_s']:.3g} to {row['most_s']:.3g} (hint)"
                    if row["hint"]
                    else f"{row['foretold_s']:.4g}",
                    f"{row['found_s']:.4g}",
                    f"{row['ratio']:.3f}",
                    f"{row['found_s'] / result['cycle_time_s']:.1e}",
                    "yes" if row["right"] else "NO",
                ]
            )
        if not result["rows"]:
            lines.append([f"{result['program']}, {result['corner']}", "no prices", "", "", "", "", ""])
    rows = [row for result in results for row in result["rows"]]
    numbers = [row for row in rows if not row["hint"]]
    hints = [row for row in rows if row["hint"]]
    said = (
        f"{sum(row['right'] for row in numbers)} of {len(numbers)} numbers within {100 * HINT:g} % or {HINT_LEAST:g} of T; "
        f"{sum(row['right'] for row in hints)} of {len(hints)} hints with what was found inside their range. "
        "Ratio: foretold (a hint's middle) over found.\n\n"
    )
    columns = ["program", "more of", "foretold [s]", "found [s]", "ratio", "found / T", "right"]
    return said + markdown(columns, lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("programs", nargs="*")
    parser.add_argument("--nc", type=Path, default=NC, help="folder of the recorded programs")
    given = parser.parse_args()
    results: list[dict[str, Any]] = []
    before = RESULTS / "prices.json"
    if given.programs and before.exists():
        results = json.loads(before.read_text(encoding="utf-8"))["jobs"]
    for name, job in jobs(given.nc).items():
        if given.programs and name not in given.programs:
            continue
        program, machine = job()
        results = [result for result in results if result["program"] != name]
        results += [compared(name, program, machine, corner) for corner in CORNERS]
        write_results("prices", {"jobs": results}, table(results))


if __name__ == "__main__":
    main()
