"""What prices foretell where geometry and feed are found together, and what planning again finds.

    python -m benchmarks.solvers.found_prices [JOB ...]

Jobs that are named are made again, the others stay as they are in the results. Each is planned by method `tube` from a quick start,
then with 2 % less, 2 % more and 10 % more of the feed, of every limit of an axis whose 2 % are foretold to change the time by
`WORTH` of it, and of the tolerance; and with 10 % more tolerance at the dearest corners alone (G64 P of the block). Foretold is
what `planner what-if` tells (commands/study/what_if.py), the middle of its range. A plan made again ends elsewhere by some 1e-4 of
the time for no other reason, so that a forecast counts as right within 10 % of what was found or within `NOISE` of the time, and a
hint (report) if its range holds what was found, to that noise.

Results: benchmarks/results/found_prices.json and .md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems, random_lines
from benchmarks.record import RESULTS, markdown, write_results
from benchmarks.solvers.prices import BRACKET, time_of
from planner.commands.study.settings import Setting
from planner.commands.study.what_if import Forecast, forecast
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod
from planner.sensitivity.prices import more_of

RATIOS = 0.98, 1.02, 1.1
WORTH = 3e-4  # by how much a limit's 2 % have to change the time to be planned again [share of the time]
RIGHT, NOISE = 0.1, 2e-4  # how far a forecast may be off, as a share of what was found, and of the time [-]
CORNERS = 2  # dearest ones
RANDOM = 3  # job of jobs/random_lines.py
METHOD = TubeMethod(start=OptimalMethod(effort="quick"))


def jobs() -> dict[str, Callable[[], tuple[Program, Machine]]]:
    """The jobs."""
    peers, mill = problems.machine(), load_machine("mill")
    return {
        "pentagon, mill": lambda: (problems.pentagon(), mill),
        "zig-zag, mill": lambda: (problems.zigzag(), mill),
        "pentagon, peers": lambda: (problems.pentagon(), peers),
        "zig-zag, peers": lambda: (problems.zigzag(), peers),
        "arcs, peers": lambda: (problems.arcs(), peers),
        f"random {RANDOM}": lambda: random_lines.job(RANDOM),
        "bracket, mill": lambda: (read_program(BRACKET, mill), mill),
    }


def planned(program: Program, machine: Machine, tolerance: float | None = None) -> Plan:
    """The plan of a job."""
    return planner.plan(program, machine, method=METHOD, tolerance=tolerance).require()


def foretold(plan: Plan, machine: Machine, setting: Setting, tolerance: float) -> Forecast:
    """The change of the cycle time by a setting [s]."""
    told = forecast(plan.prices, [setting], machine, tolerance)
    assert told is not None
    return told


def changes(
    plan: Plan, program: Program, machine: Machine, tolerance: float
) -> Iterator[tuple[str, float, Forecast, Callable[[], Plan]]]:
    """Name, ratio, change foretold and the plan with the change, of all that is changed."""
    prices, cycle_time = plan.prices, time_of(plan)
    assert prices is not None
    for name in prices.limits:
        quantity, _, axis = name.partition(".")
        value, key = getattr(machine.axes[axis], quantity), f"axes.{axis}.{quantity}"
        small = foretold(plan, machine, Setting(name=key, value=0.98 * value), tolerance)
        for ratio in RATIOS if small.least >= WORTH * cycle_time else ():
            told = foretold(plan, machine, Setting(name=key, value=ratio * value), tolerance)
            changed = more_of(machine, name, ratio - 1.0)
            yield name, ratio, told, partial(planned, program, changed)
    for ratio in RATIOS if -prices.feed * 0.02 >= WORTH * cycle_time else ():
        told = foretold(plan, machine, Setting(name="feed", value=ratio), tolerance)
        faster = dataclasses.replace(program, feed=program.feed * ratio)
        raised = machine
        if machine.feed_max is not None:
            raised = machine.model_copy(update={"feed_max": machine.feed_max * ratio})
        yield "feed", ratio, told, partial(planned, faster, raised)
    for ratio in RATIOS:
        told = foretold(plan, machine, Setting(name="tolerance", value=ratio * tolerance), tolerance)
        yield "tolerance", ratio, told, partial(planned, program, machine, ratio * tolerance)
    yield from corners(plan, program, machine)


def corners(
    plan: Plan, program: Program, machine: Machine
) -> Iterator[tuple[str, float, Forecast, Callable[[], Plan]]]:
    """The same of the tolerance of the dearest corners, each alone."""
    assert plan.prices is not None
    dear, toolpath = plan.prices.corners, plan.toolpath
    assert dear is not None
    own = np.where(np.isnan(program.tolerance), machine.tolerance, program.tolerance)
    for k in range(min(CORNERS, len(dear))):
        distance = np.linalg.norm(toolpath.end - dear.position[k], axis=1)
        block = int(toolpath.block[np.argmin(distance + 1e9 * (toolpath.line != dear.line[k]))])
        wider = own.copy()
        wider[block] *= RATIOS[-1]
        straight = float(dear.price[k] * (wider[block] - own[block]))
        told = Forecast(straight, straight)
        changed = dataclasses.replace(program, tolerance=wider)
        yield (
            f"tolerance, line {dear.line[k]}",
            RATIOS[-1],
            told,
            partial(planned, changed, machine),
        )


def compared(name: str, program: Program, machine: Machine) -> dict[str, Any]:
    """Foretold and found for one job."""
    plan = planned(program, machine)
    assert plan.prices is not None
    cycle_time, rows = time_of(plan), []
    tolerance = float(np.median(plan.toolpath.tolerance))
    for what, ratio, told, again in changes(plan, program, machine, tolerance):
        other = again()
        found, middle = time_of(other) - cycle_time, 0.5 * (told.least + told.most)
        noise = NOISE * cycle_time
        rows.append(
            {
                "changed": what,
                "ratio": ratio,
                "foretold_s": middle,
                "least_s": told.least,
                "most_s": told.most,
                "hint": ratio > 1.0 and what in plan.prices.hints,
                "found_s": found,
                "near": bool(abs(middle - found) <= RIGHT * abs(found)),
                "in_noise": bool(abs(middle - found) <= noise),
                "in_range": bool(told.least - noise <= found <= told.most + noise),
                "passed": other.verdict is not None and other.verdict.passed,
            }
        )
        print(f"{name}: {what} {ratio:g} foretold {middle:.4g} found {found:.4g}", flush=True)
    return {"job": name, "cycle_time_s": cycle_time, "rows": rows}


def verdict(row: dict[str, Any]) -> str:
    """In what sense a change was foretold."""
    if row["near"]:
        return "10 %"
    if row["in_noise"]:
        return "noise"
    return "range" if row["hint"] and row["in_range"] else "NO"


def table(results: list[dict[str, Any]]) -> str:
    """The results in Markdown."""
    rows = [
        row | {"job": result["job"], "T": result["cycle_time_s"]}
        for result in results
        for row in result["rows"]
    ]
    lines = [
        [
            row["job"],
            f"{row['changed']} x {row['ratio']:g}",
            f"{row['foretold_s']:.4g}",
            f"{row['found_s']:.4g}",
            f"{row['foretold_s'] / row['found_s']:.3f}" if row["found_s"] else "",
            f"{row['found_s'] / row['T']:.1e}",
            verdict(row),
        ]
        for row in rows
    ]
    told = [verdict(row) for row in rows]
    said = (
        f"Of {len(rows)} changes {told.count('10 %')} were foretold within {100 * RIGHT:g} % of what was found, "
        f"{told.count('noise')} more within {NOISE:g} of the time (noise), {told.count('range')} by a range only (a hint), "
        f"{told.count('NO')} not.\n\n"
    )
    return said + markdown(
        ["job", "change", "foretold [s]", "found [s]", "ratio", "found / T", "right"], lines
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("jobs", nargs="*")
    given = parser.parse_args()
    results: list[dict[str, Any]] = []
    before: Path = RESULTS / "found_prices.json"
    if given.jobs and before.exists():
        results = json.loads(before.read_text(encoding="utf-8"))["jobs"]
    for name, job in jobs().items():
        if given.jobs and name not in given.jobs:
            continue
        results = [result for result in results if result["job"] != name]
        results.append(compared(name, *job()))
        write_results("found_prices", {"jobs": results}, table(results))


if __name__ == "__main__":
    main()
