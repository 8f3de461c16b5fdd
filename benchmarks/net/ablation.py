"""What the default loses without each of its retries, those of the table of planner/planning/attempts.py, and without
single numbers of the joint search and of shaping (`NUMBERS`).

    python -m benchmarks.net.ablation ROWS --net NET [--without NAME] [--most 60]     plan without one of them, or all in turn
    python -m benchmarks.net.ablation ROWS --net NET --report                         into results/ablation.json and .md

NET is a file of benchmarks/net/golden_net.py: the jobs as `optimal` plans them. Without a retry those of its jobs are planned again in
whose trace it shows; no more than `--most` of them, evenly spread. Rows are added to the file ROWS.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.net.golden_net import SAME, Row, jobs, read, row_of
from benchmarks.record import markdown, write_results
from planner.base.threads import use_threads
from planner.delivery import mending
from planner.joint import guess, normal_rows, own, run
from planner.planning import attempts
from planner.planning.attempt import Attempt
from planner.planning.attempts import RETRIES
from planner.planning.job import less_tolerance, runs_alone
from planner.planning.methods import optimal, second_order
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal import behind_filters, geometry, path_motion, shaped, tighten

Switch = Callable[[], None]
NONE = Attempt("none", lambda *_: False, lambda job, settings, tried: tried)


def _set(owner: Any, name: str, value: Any) -> Switch:
    return lambda: setattr(owner, name, value)


def _no_attempt(name: str) -> Switch:
    """Without an attempt, in all lists of them."""

    def switch() -> None:
        for owner, listed in (
            (attempts, "ALONE"),
            (attempts, "ON_PATH"),
            (optimal, "ATTEMPTS"),
            (second_order, "ATTEMPTS"),
        ):
            kept = tuple(NONE if one.name == name else one for one in getattr(owner, listed))
            setattr(owner, listed, kept)

    return switch


def _no_corners(rounded: Any, best: Any, *more: Any) -> Any:
    return best, np.zeros(0, dtype=np.int64)


# How each of `RETRIES` is switched off, by its first step.
SWITCHES: dict[str, Switch] = {
    "search, once more": _no_attempt("search, once more"),
    "runs alone": _set(runs_alone, "VERDICTS", 0),
    "closed form": _no_attempt("closed form"),
    "splines": _set(geometry, "STOP_ROUNDS", 0),
    "corners": _set(path_motion, "with_corners", _no_corners),
    "tighten": _set(tighten, "TIGHTENING_ROUNDS", 0),
    "filters": _set(behind_filters, "ROUNDS", 1),
    "share of tolerance": _set(OptimalMethod, "ways", ()),
    "less for the period": _set(less_tolerance, "PERIOD_ROUNDS", 0),
    "slower in places": _set(mending, "ROUNDS", 0),
    "shaped": _set(shaped.shaped, "__defaults__", (shaped.CANDIDATES[:1],)),
}


def _stay_free() -> None:
    """A change of the velocity by itself costs nothing."""
    normal_rows.STAY = normal_rows.STAY_PRICED = 0.0


# Numbers, by the trace's step of the jobs in which they count: what is planned without them.
NUMBERS: dict[str, tuple[str, Switch]] = {
    "STAY, STAY_PRICED": ("search", _stay_free),
    "PERIODS": ("search", _set(guess, "PERIODS", 0.0)),
    "MORE": ("search", _set(own, "MORE", 1.0)),
    "PASSED": ("search", _set(run, "PASSED", 0.0)),
    "SHORTENED": ("search", _set(own, "SHORTENED", np.inf)),
    "LASTS": ("search", _set(own, "LASTS", 1e-9)),
    "SEARCHED": ("shaped", _set(shaped, "SEARCHED", np.inf)),
    "NOT_SEARCHED": ("shaped", _set(shaped, "NOT_SEARCHED", np.inf)),
}
SWITCHES |= {name: switch for name, (_, switch) in NUMBERS.items()}


def fires(name: str, row: Row) -> bool:
    """Whether a plan took a step of the retry, or one in which the number counts."""
    if name in NUMBERS:
        return NUMBERS[name][0] in row.get("steps", {})
    steps = next(retry.steps for retry in RETRIES if retry.steps[0] == name)
    return any(step.startswith(steps) for step in row.get("steps", {}))


def chosen_jobs(net: dict[str, Row], name: str, most: int) -> list[str]:
    """The names of the jobs on which a switch is tried: of method `optimal`, evenly spread."""
    ours = [
        row
        for row in net.values()
        if row["outcome"] in ("passed", "failed") and row["solver"].startswith("optimal ")
    ]
    names = [row["name"] for row in ours if fires(name, row)]
    at = np.unique(np.linspace(0, len(names) - 1, min(most, len(names))).astype(int))
    return [names[k] for k in at] if names else []


def rows_without(name: str, net: dict[str, Row], known: set[str], most: int, limit: float) -> Iterator[Row]:
    """Rows of the jobs without one of the switches."""
    wanted = set(chosen_jobs(net, name, most)) - known
    if not wanted:
        return
    SWITCHES[name]()
    for job, planned in jobs(10**6):
        if job in wanted:
            yield {"without": name} | row_of(job, planned, limit)
            wanted.discard(job)
        if not wanted:
            return


def report(net: dict[str, Row], rows: list[Row]) -> tuple[dict[str, Any], str]:
    """Per switch: jobs, how much longer they take without it, which fail, and the processor time saved."""
    table, numbers = [], {}
    ours = [
        row
        for row in net.values()
        if row["outcome"] in ("passed", "failed") and row["solver"].startswith("optimal ")
    ]
    for name in SWITCHES:
        pairs = [(net[row["name"]], row) for row in rows if row["without"] == name and row["name"] in net]
        pairs = [(a, b) for a, b in pairs if "too long" not in (a["outcome"], b["outcome"])]
        if not pairs:
            continue
        timed = [b["time"] / a["time"] - 1.0 for a, b in pairs if a["outcome"] == b["outcome"] == "passed"]
        longer = np.array(timed or [0.0])
        entry = {
            "fires": sum(fires(name, row) for row in ours),
            "of": len(ours),
            "jobs": len(pairs),
            "changed": int((np.abs(longer) > SAME).sum()),
            "mean": float(longer.mean()),
            "longest": float(longer.max()),
            "shortest": float(longer.min()),
            "fail": sum(a["outcome"] == "passed" != b["outcome"] for a, b in pairs),
            "pass": sum(b["outcome"] == "passed" != a["outcome"] for a, b in pairs),
            "computing": sum(b["cpu"] for _, b in pairs) / sum(a["cpu"] for a, _ in pairs),
        }
        numbers[name] = entry
        table.append(
            [
                name,
                f"{entry['fires']} of {entry['of']}",
                str(entry["jobs"]),
                str(entry["changed"]),
                f"{entry['mean']:+.1e}",
                f"{entry['longest']:+.1e}",
                f"{entry['shortest']:+.1e}",
                str(entry["fail"]),
                str(entry["pass"]),
                f"{entry['computing']:.2f}",
            ]
        )
    columns = [
        "without",
        "shows in",
        "planned",
        "other time",
        "longer, mean",
        "longest",
        "shortest",
        "fail",
        "pass now",
        "computing",
    ]
    return numbers, markdown(columns, table)


def main(argv: list[str] | None = None) -> int:
    """Plan without, or report."""
    parser = argparse.ArgumentParser(description="what the default loses without each of its retries")
    parser.add_argument("rows", type=Path)
    parser.add_argument("--net", type=Path, required=True)
    parser.add_argument("--without", choices=list(SWITCHES))
    parser.add_argument("--most", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of computing at most")
    parser.add_argument("--limit", type=float, default=20.0, help="processor seconds of one plan")
    parser.add_argument("--report", action="store_true")
    chosen = parser.parse_args(argv)
    net = read(chosen.net)
    text = chosen.rows.read_text(encoding="utf-8") if chosen.rows.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    if chosen.report:
        numbers, table = report(net, rows)
        print(table)
        write_results("ablation", numbers, table)
        return 0
    if chosen.without is None:  # each in a process of its own, as a switch stays switched
        for name in SWITCHES:
            again = [
                sys.executable,
                "-m",
                "benchmarks.net.ablation",
                *(argv or sys.argv[1:]),
                "--without",
                name,
            ]
            subprocess.run(again, check=True)
        return 0
    use_threads(1)
    known = {row["name"] for row in rows if row["without"] == chosen.without}
    for row in rows_without(chosen.without, net, known, chosen.most, chosen.limit):
        with open(chosen.rows, "a", encoding="utf-8") as lines:
            lines.write(json.dumps(row) + "\n")
        if time.process_time() > chosen.seconds:
            print("no time left", file=sys.stderr)
            break
    return 0


if __name__ == "__main__":
    sys.exit(main())
