"""What each heuristic of the loop is worth: how often it ran, how often its result was kept, what it gained, and what it cost.

    python -m benchmarks.ablation [--jobs 150] [--traces FILE] [--report]     into results/ablation.json and .md

The random jobs of benchmarks/never_slower.py, and the programs of ../shared/nc up to `NC_BYTES` on machine "mill", are planned by
`optimal` with a trace (planner/job/trace.py), in one process. A trace has every try with the cycle time of what it competed with, so
that one run tells of all heuristics. Traces are added to FILE, one job a line; jobs in it are not planned again, and --report plans
none.

Gains are shares of the cycle time, summed over all tries that were kept and divided by the number of jobs; costs are computing times,
shares of that of all jobs. A gain counts where it was made: in a plan that another one replaced later it is counted too, so that the
gains are upper bounds.
"""

from __future__ import annotations

import argparse
import json
import os
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.never_slower import job
from benchmarks.record import markdown, write_results
from planner.base.errors import PlannerError
from planner.job.trace import Trace
from planner.machine import Machine, load_machine
from planner.methods.optimal import OptimalMethod
from planner.nc.program import Program
from planner.nc.reader import read_program

JOBS = 150
NC = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[2] / "shared")) / "nc"
NC_BYTES = 20_000
WHOLE_PLANS = "compare", "another method", "share of tolerance"
SOLVER = "windows", "other starts", "divided", "standstills"
Steps = list[dict[str, Any]]


def programs() -> Iterator[tuple[str, Program, Machine]]:
    """The NC programs, small ones first; those that cannot be read are left out."""
    mill = load_machine("mill")
    for file in sorted(NC.glob("*"), key=lambda file: file.stat().st_size):
        if file.stat().st_size <= NC_BYTES and file.suffix != ".csv":
            try:
                yield file.name, read_program(file, mill), mill
            except PlannerError:
                continue


def jobs(count: int) -> Iterator[tuple[str, Program, Machine]]:
    """Two thirds of the random jobs, the programs, and the rest of the random jobs."""
    seeds = [(f"random {seed}", *job(seed)) for seed in range(count)]
    yield from seeds[: 2 * count // 3]
    yield from programs()
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


def tries(steps: Steps) -> Iterator[tuple[str, float, bool, float]]:
    """Of every try of a job: which heuristic it was, its computing time [s], whether it was kept, and what it gained [-]."""
    tightened = 0
    for k, step in enumerate(steps):
        name = step["name"]
        tightened = 0 if name == "between points" else tightened + (name == "tighten")
        if name in ("splines", "less for the period", "slower for verdict"):
            if name != "splines" or step["stops_added"]:
                number = f" {step['round']}" if "round" in step else ""
                yield (
                    ("stops for splines" if name == "splines" else name + number),
                    _took(steps, k),
                    True,
                    0.0,
                )
            continue
        if step["kept"] is None:
            continue
        if name.startswith("reshape"):
            n = int(re.findall(r"\d+", name)[0])
            rounds = "1-5" if n <= 5 else "6-10" if n <= 10 else "11-20" if n <= 20 else "21-40"
            name = f"reshape {rounds}" + (", mixed" if "mixed" in name else "")
        elif name == "tighten":
            name = f"tighten {tightened}"
        elif name in WHOLE_PLANS:
            name = f"{name}: {step.get('method', '')} {step.get('corner', '')}".replace(" none", "").rstrip()
        found, before = step["found"], step["before"]
        gain = 1.0 - found / before if step["kept"] and found and before else 0.0
        yield name, _took(steps, k), step["kept"], gain


def _took(steps: Steps, k: int) -> float:
    """Computing time of a try [s]: since the step before that is no solve, or of a whole plan since what came before that plan."""
    before = k - 1
    if steps[k]["name"] in WHOLE_PLANS:
        before = _before_plan(steps, before)
    while before >= 0 and steps[before]["name"] == "solve":
        before -= 1
    return steps[k]["at"] - (steps[before]["at"] if before >= 0 else 0.0)


def _before_plan(steps: Steps, last: int) -> int:
    """The step before a plan that ends at step `last`: another plan, a comparison, or the bound that asked for it."""
    ends = ("plan", "compare", "another method", "less for the period")
    for k in range(last - 1, -1, -1):
        if steps[k]["name"] in ends or (steps[k]["name"] == "bound on corners" and "corner" in steps[k]):
            return k
    return -1


def report(rows: list[dict[str, Any]]) -> tuple[dict[str, Any], str]:
    """Numbers and table over all jobs."""
    total = sum(row["steps"][-1]["at"] for row in rows if row["steps"])
    found: dict[str, dict[str, Any]] = defaultdict(
        lambda: {"ran": 0, "jobs": 0, "kept": 0, "gain": 0.0, "most": 0.0, "took": 0.0}
    )
    solver = dict.fromkeys(SOLVER, 0)
    for row in rows:
        names = set()
        for name, took, kept, gain in tries(row["steps"]):
            entry = found[name]
            entry["ran"] += 1
            entry["kept"] += kept
            entry["gain"] += gain / len(rows)
            entry["most"] = max(entry["most"], gain)
            entry["took"] += took / total
            names.add(name)
        for name in names:
            found[name]["jobs"] += 1
        for step in row["steps"]:
            for name in SOLVER:
                solver[name] += step.get(name, 0)
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
    rows = []
    if chosen.traces and chosen.traces.exists():
        rows = [json.loads(line) for line in chosen.traces.read_text(encoding="utf-8").splitlines()]
    known = {row["job"] for row in rows}
    for name, program, machine in () if chosen.report else jobs(chosen.jobs):
        if name in known:
            continue
        rows.append({"job": name, **traced(program, machine)})
        if chosen.traces:
            with chosen.traces.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        print(name, rows[-1]["cycle_time"], len(rows[-1]["steps"]), flush=True)
    numbers, text = report(rows)
    print(text)
    write_results("ablation", numbers, text)


if __name__ == "__main__":
    main()
