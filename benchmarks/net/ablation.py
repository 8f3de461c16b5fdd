"""What the default loses without each of its retries, those of its table `RETRIES`, and without
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
from typing import Any, NamedTuple

import numpy as np

from benchmarks.net.golden_net import SAME, Row, jobs, read, row_of
from benchmarks.record import markdown, write_results
from planner.base.threads import use_threads
from planner.delivery import mending
from planner.joint import guess, normal_rows, own, run
from planner.planning import attempts
from planner.planning.job import less_tolerance, runs_alone
from planner.planning.methods import optimal, second_order
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal import behind_filters, geometry, path_motion, shaped, tighten
from planner.planning.page import Attempt

Switch = Callable[[], None]
NONE = Attempt("none", lambda *_: False, lambda job, settings, tried: tried)


class Retry(NamedTuple):
    """Something that is tried once more, or in another way.

    steps : in the trace, as they begin
    when  : and what
    most  : at most so often
    worth : how much longer plans are without it, on the mean and at worst [-], or what it saves from failing
    """

    steps: tuple[str, ...]
    when: str
    most: str
    worth: str


# All that is tried once more. `python -m benchmarks.net.ablation ROWS --net NET --without STEP` plans without
# it, on jobs of NET where it shows. Worth by these switches on those of 386 random jobs by the default
# (jobs/random_lines.py 0 to 329, campaign 7000000 to 7000059) where they show and that plan fastest, 5 to 32 each:
# runs alone, closed form, tighten, less for the period, slower in places; of the share of tolerance on 16 behind
# filters. That of the search, once more, on 106 programs of benchmarks/judge/feed_promise.py, whose F changes at every
# block; of the others by benchmarks/results/ablation.md.
RETRIES = (
    Retry(
        ("search, once more",),
        "the search has not ended: from a motion that stays where it fails",
        "1",
        "2e-2, 1.2",
    ),
    Retry(("runs alone",), "runs are not found, or the verdict finds something on few", "3", "1e-2, 2e-1"),
    Retry(("closed form",), "there is but a motion on a path, or full stops are sooner", "2", "2e-2, 2e-1"),
    Retry(("splines",), "full stops where a run gets no spline", "2", "3e-5, 6e-4"),
    Retry(("corners",), "single ones between full stops, where they may be faster", "2", "2e-3, 2e-2"),
    Retry(("tighten",), "limits, where they are exceeded between grid points", "2", "3e-5, 5e-4"),
    Retry(("filters",), "less feed where the tolerance is left behind filters", "16", "5e-1, 3"),
    Retry(("share of tolerance",), "behind long filters, less for the path", "2", "3e-3, 4e-2"),
    Retry(
        ("less for the period",), "chords between samples leave the tolerance", "8", "1e-1, 2e-1; saves plans"
    ),
    Retry(("slower in places",), "the verdict finds something", "6", "2e-2, 2e-1"),
    Retry(
        ("shaped",),
        "a shaper that takes more than the tolerance: more limits, less tolerance; at last gently",
        "5, 1",
        "1e-1, 3e-1",
    ),
)


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
