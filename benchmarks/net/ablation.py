"""What the default loses without each of its retries, rivals, rounds and second starts.

    python -m benchmarks.net.ablation ROWS --net NET [--without NAME] [--most 60]     plan without one of them, or all in turn
    python -m benchmarks.net.ablation ROWS --net NET --report                         into results/ablation.json and .md

NET is a file of benchmarks/net/golden_net.py: the jobs as `optimal` plans them. Without a retry those of its jobs are planned again in
whose trace it shows; no more than `--most` of them, evenly spread. Rows are added to the file ROWS.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.net.golden_net import SAME, Row, jobs, read, row_of
from benchmarks.record import markdown, write_results
from planner.base.threads import use_threads
from planner.delivery import mending
from planner.feedrate.jerk import window
from planner.joint import own
from planner.planning.job import method
from planner.planning.methods import at_once, optimal
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal import behind_filters, geometry, loop, shaped, tighten
from planner.planning.optimal.effort import EFFORTS
from planner.smoothing import initial, relax

Switch = Callable[[], None]
Fires = Callable[[Row], bool]
ANY_TENTH = 10


def _set(owner: Any, name: str, value: Any) -> Switch:
    return lambda: setattr(owner, name, value)


def _step(*names: str, least: int = 1) -> Fires:
    """Whether steps whose names begin so were taken so often."""
    return lambda row: sum(n for step, n in row.get("steps", {}).items() if step.startswith(names)) >= least


def _round(name: str, number: int) -> Fires:
    return lambda row: row.get("steps", {}).get(name, 0) >= number


def _all(row: Row) -> bool:
    return True


def _searches(row: Row) -> bool:
    return row.get("steps", {}).get("search", 0) > 0


def _starts(count: int) -> Switch:
    def switch() -> None:
        inner = window.ScaledWindow._starts
        window.ScaledWindow._starts = lambda self, *way: islice(inner(self, *way), count)  # type: ignore[method-assign]

    return switch


def _fallback(kind: str) -> Switch:
    """What is planned where the search from the first motion does not take all of a job."""

    def planned(job: Any, settings: Any, once: Any) -> Any:
        from planner.planning.methods.from_plan import freed

        again = job.afresh()
        if kind == "path":
            return loop.fastest_plan(again, settings)
        rounds = 0 if kind == "first splines" else settings.rounds
        effort = EFFORTS["quick"] if kind == "first splines" else settings.effort
        start = loop.fastest_plan(again, dataclasses.replace(settings, effort=effort, rounds=rounds))
        made = freed(again, start, settings.effort.search).plan
        return made if once is None else method.faster(made, once)

    return _set(optimal, "_from_plans", planned)


def _no_corners(rounded: Any, best: Any, *more: Any) -> Any:
    return best, np.zeros(0, dtype=np.int64)


def _one_search() -> None:
    usual = EFFORTS["normal"]
    EFFORTS["normal"] = dataclasses.replace(usual, search=dataclasses.replace(usual.search, finer=()))


# What it is called; in which jobs it shows; how it is switched off.
SWITCHES: dict[str, tuple[Fires, Switch]] = {
    "search on reshaped splines where small paths double back": (
        _step("search", least=2),
        _set(optimal, "_doubles_back", lambda job: False),
    ),
    "fallback: start on reshaped splines": (_step("reshape"), _fallback("first splines")),
    "fallback: start on first splines": (_step("search", least=2), _fallback("reshaped")),
    "fallback: any search": (_step("search", least=2), _fallback("path")),
    "fallback: runs planned by themselves": (
        lambda row: row.get("steps", {}).get("plan optimal auto", 0) > 1,
        _set(at_once, "ALONE_MOST", 0),
    ),
    "search: second verdict": (_searches, _set(at_once, "VERDICTS", 1)),
    "search: finer steps after long ones": (_searches, _one_search),
    "search: second and third tuning of a window": (_searches, _set(own, "TRIES", own.TRIES[:1])),
    "search: normal acceleration tightened": (_searches, _set(own, "TIGHTENED", 1)),
    "search: division of windows": (_searches, _set(own, "LEAST", 10**9)),
    "search: start made nearer for finer steps": (_searches, _set(own, "NEAR", own.FAR)),
    "corners between full stops": (_step("bound on corners"), _set(loop, "with_corners", _no_corners)),
    "fir corners as a whole plan": (
        _step("bound on corners fir", "compare optimal fir"),
        _set(loop, "fir_corners_may_be_faster", lambda *_: False),
    ),
    "runs alone where the verdict finds something": (
        _step("runs alone"),
        _set(method.Method, "_runs_alone", lambda *_: None),
    ),
    "less for the period": (_step("less for the period"), _set(method, "PERIOD_ROUNDS", 0)),
    "less for the period: rounds after 2": (
        _round("less for the period", 3),
        _set(method, "PERIOD_ROUNDS", 2),
    ),
    "less for the period: rounds after 4": (
        _round("less for the period", 5),
        _set(method, "PERIOD_ROUNDS", 4),
    ),
    "shares of the tolerance behind filters": (_step("share of tolerance"), _set(OptimalMethod, "ways", ())),
    "shares of the tolerance: 0.1": (_step("share of tolerance"), _set(OptimalMethod, "ways", ((0.5, 1.0),))),
    "slower in places: rounds after 2": (_round("slower in places", 3), _set(mending, "ROUNDS", 2)),
    "slower in places": (_step("slower in places"), _set(mending, "ROUNDS", 0)),
    "tighten": (_step("tighten"), _set(tighten, "TIGHTENING_ROUNDS", 0)),
    "stops for splines": (_step("splines"), _set(geometry, "STOP_ROUNDS", 0)),
    "stops for splines: second round": (_step("splines", least=2), _set(geometry, "STOP_ROUNDS", 1)),
    "knots made denser": (_all, _set(initial, "DENSER_MAX", 0)),
    "sites tightened more than twice": (_all, _set(relax, "ROUNDS", 3)),
    "second start of a feed window": (_all, _starts(1)),
    "third start of a feed window": (_all, _starts(2)),
    "feed at corners behind filters": (_step("filters"), _set(behind_filters, "ROUNDS", 1)),
    "feed at corners behind filters: rounds after 5": (
        _round("filters", 6),
        _set(behind_filters, "ROUNDS", 5),
    ),
    "candidates behind a shaper but two": (
        _step("shaped"),
        _set(shaped.shaped, "__defaults__", ((shaped.CANDIDATES[0], shaped.CANDIDATES[2]),)),
    ),
}


def chosen_jobs(net: dict[str, Row], fires: Fires, most: int) -> list[str]:
    """The names of the jobs on which a switch is tried: of method `optimal`, evenly spread."""
    ours = [
        row
        for row in net.values()
        if row["outcome"] in ("passed", "failed") and row["solver"].startswith("optimal ")
    ]
    names = [row["name"] for row in ours if fires(row)]
    at = np.unique(np.linspace(0, len(names) - 1, min(most, len(names))).astype(int))
    return [names[k] for k in at] if names else []


def rows_without(name: str, net: dict[str, Row], known: set[str], most: int, limit: float) -> Iterator[Row]:
    """Rows of the jobs without one of the switches."""
    fires, switch = SWITCHES[name]
    wanted = set(chosen_jobs(net, fires, most)) - known
    if not wanted:
        return
    switch()
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
    for name, (fires, _) in SWITCHES.items():
        pairs = [(net[row["name"]], row) for row in rows if row["without"] == name and row["name"] in net]
        pairs = [(a, b) for a, b in pairs if "too long" not in (a["outcome"], b["outcome"])]
        if not pairs:
            continue
        timed = [b["time"] / a["time"] - 1.0 for a, b in pairs if a["outcome"] == b["outcome"] == "passed"]
        longer = np.array(timed or [0.0])
        entry = {
            "fires": sum(fires(row) for row in ours),
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
