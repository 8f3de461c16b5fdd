"""What the trace of a plan (planner/job/trace.py) tells of every heuristic that was tried, and the files that keep traces, one plan
a line: for benchmarks/retries.py."""

from __future__ import annotations

import json
import os
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from planner.base.errors import PlannerError
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program

NC = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[2] / "shared")) / "nc"
WHOLE_PLANS = "compare", "another method", "share of tolerance"
Steps = list[dict[str, Any]]


def programs(largest: int) -> Iterator[tuple[str, Program, Machine]]:
    """The NC programs of at most so many bytes, small ones first; those that cannot be read are left out."""
    mill = load_machine("mill")
    for file in sorted(NC.glob("*"), key=lambda file: file.stat().st_size):
        if file.stat().st_size <= largest and file.suffix != ".csv":
            try:
                yield file.name, read_program(file, mill), mill
            except PlannerError:
                continue


def read_rows(traces: Path | None) -> list[dict[str, Any]]:
    """The plans that a file of traces holds; none if there is no file."""
    if traces is None or not traces.exists():
        return []
    return [json.loads(line) for line in traces.read_text(encoding="utf-8").splitlines()]


def add_row(traces: Path | None, row: dict[str, Any]) -> None:
    """Add a plan to a file of traces, if there is one."""
    if traces is not None:
        with traces.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def summed(rows: list[dict[str, Any]], total: float) -> dict[str, dict[str, Any]]:
    """Of each heuristic: on how many plans it ran, how often, how often its result was kept, its gain [-] (mean over all plans, and
    the largest one), and its share of the computing time `total` [s]."""
    found: dict[str, dict[str, Any]] = defaultdict(
        lambda: {"ran": 0, "jobs": 0, "kept": 0, "gain": 0.0, "most": 0.0, "took": 0.0}
    )
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
    return found


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
