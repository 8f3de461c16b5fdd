"""How often each retry fires, and what it brings: from traces (planner/job/trace.py) and from counters (`watch`).

Counters are put around functions that tell nobody; loops of compiled functions run as Python for that. Traces are kept in files, one
plan a line.
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from planner.base.errors import PlannerError
from planner.feedrate.jerk import chain, part, window
from planner.machine import Machine, load_machine
from planner.nc.program import Program
from planner.nc.reader import read_program
from planner.optimal import reshape
from planner.smoothing import initial, relax, spline_path

NC = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[2] / "shared")) / "nc"
WHOLE_PLANS = "compare", "another method", "share of tolerance"
Steps = list[dict[str, Any]]

counts: Counter[str] = Counter()


def count_steps(steps: list[dict[str, Any]]) -> None:
    """Count what a trace tells."""
    stops = corners = filters = 0
    candidates: list[str] = []
    winner = ""
    for step in steps:
        name = step["name"]
        filters = filters + 1 if name == "filters" else 0
        if name == "filters":
            counts[f"filters, round {filters}"] += 1
        elif name == "shaped":
            again = candidates.count(f"{step['limits']:g}") > 0
            candidates.append(f"{step['limits']:g}")
            if step["kept"]:
                winner = f"shaped: {candidates[-1]} times the limits" + ", no stops added" * again
        stops = stops + 1 if name == "splines" and step["stops_added"] else 0 if name == "splines" else stops
        corners = corners + 1 if name == "corners" else 0 if name == "bound on corners" else corners
        if name == "splines" and step["stops_added"]:
            counts[f"stops for splines, round {stops}"] += 1
        elif name in ("slower for verdict", "less for the period"):
            counts[f"{name}, round {step['round']}"] += 1
        elif name == "corners":
            counts[f"corners, solve {corners}"] += 1
    if winner:
        counts[winner] += 1


def watch() -> None:
    """Count what the trace does not tell."""
    for module, names in ((relax, ("_relax", "_finish", "_relax_run")), (initial, ("_lay", "_lay_run"))):
        for name in names:
            setattr(module, name, getattr(module, name).py_func)
    _around(spline_path, "relax", _labelled("first shape"))
    _around(reshape, "relax", _labelled("reshaped"))
    _around(relax, "certify", _certified)
    _around(relax, "_relax_run", _run_relaxed)
    _around(initial, "_denser", _counted("laid denser"))
    _around(initial, "_lay_run", _counted("runs laid"))
    _around(spline_path, "cusps", _cusps)
    _around(reshape, "cusps", _cusps)
    _around(window.ScaledWindow, "_from", _tried)
    _around(window.ScaledWindow, "_tracked", _tracked)
    _around(chain.Chain, "_unfelt", _unfelt)
    _around(part.Part, "_join", _joined)


def _around(owner: Any, name: str, wrapper: Callable[..., Any]) -> None:
    inner = getattr(owner, name)
    setattr(owner, name, lambda *args, **more: wrapper(inner, *args, **more))


def _counted(name: str) -> Callable[..., Any]:
    def wrapper(inner: Callable[..., Any], *args: Any) -> Any:
        counts[name] += 1
        return inner(*args)

    return wrapper


_label = [""]
_attempts = [0]


def _labelled(label: str) -> Callable[..., Any]:
    def wrapper(inner: Callable[..., Any], *args: Any, **more: Any) -> Any:
        _label[0] = label
        return inner(*args, **more)

    return wrapper


def _certified(inner: Callable[..., Any], *args: Any) -> Any:
    _attempts[0] += 1
    return inner(*args)


def _run_relaxed(inner: Callable[..., Any], *args: Any) -> Any:
    _attempts[0] = 0
    found = inner(*args)
    counts[f"{_label[0]}: runs relaxed"] += 1
    counts[f"{_label[0]}: runs tightened"] += _attempts[0] > 1
    counts[f"{_label[0]}: runs tightened more than twice"] += _attempts[0] > 3
    counts[f"{_label[0]}: runs without a certificate"] += not found[0]
    return found


def _cusps(inner: Callable[..., Any], laid: Any) -> Any:
    found = inner(laid)
    counts[f"{_label[0]}: runs with a cusp"] += int(found.sum())
    return found


def _tried(inner: Callable[..., Any], *args: Any) -> Any:
    found, most, starts = inner(*args)
    counts["windows"] += 1
    if found is None:
        counts["windows: no start converged"] += 1
    elif starts > 1:
        counts[f"windows: start {starts} converged"] += 1
    return found, most, starts


def _tracked(inner: Callable[..., Any], *args: Any) -> Any:
    found = inner(*args)
    counts["starts tracked" if found is not None else "starts not tracked"] += 1
    return found


def _unfelt(inner: Callable[..., Any], self: Any, begin: int, end: int, found: Any) -> int:
    keep: int = inner(self, begin, end, found)
    counts["windows: made larger"] += keep == begin
    return keep


def _joined(inner: Callable[..., Any], *args: Any) -> bool:
    met: bool = inner(*args)
    counts["pieces joined in the middle" if met else "pieces not joined in the middle"] += 1
    return met


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
