"""How often each retry of the planner fires, and what the plans lose without it.

    python -m benchmarks.retries [--jobs 300] --traces FILE [--seconds 700]     plan and count
    python -m benchmarks.retries --traces FILE --without NAME [--seconds 60]    the jobs on which NAME fired once more, without it
    python -m benchmarks.retries --traces FILE --report                         into results/ablation-retries.json and .md

The random jobs of benchmarks/random_lines.py, some of the first ones also behind filters (`FILTERED`) and shaped (`SHAPED`), and the
programs of ../shared/nc up to `NC_BYTES` with effort "quick", are planned by `optimal` on one thread with `ROUNDS` rounds of reshaping.
Counts come from the trace (planner/job/trace.py) and from counters (retry_counts.py). A retry whose effect the trace does not tell is
switched off (`SWITCHES`) on jobs where it fired, and cycle times are compared.

Traces are added to FILE, one plan a line; plans in it are not made again. Computing times are those of this process.
"""

from __future__ import annotations

import argparse
import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import random_lines
from benchmarks.record import markdown, write_results
from benchmarks.retry_counts import add_row, count_steps, counts, programs, read_rows, summed, watch
from planner.base.errors import PlannerError
from planner.base.threads import use_threads
from planner.feedrate.jerk import window
from planner.job import method
from planner.job.trace import Trace
from planner.machine import Fir, Machine, Mode
from planner.methods.optimal import OptimalMethod
from planner.nc.program import Program
from planner.optimal import behind_filters, geometry, loop, reshape, shaped
from planner.smoothing import initial, relax

JOBS, FILTERED, FILTERED_JOBS = 300, 3, 60
ROUNDS = 5  # of reshaping: later rounds have retries of the same kinds, and cost most of the time
SHAPED, SHAPED_JOBS, SHAPED_MODE = 4, 60, Mode(frequency=25.0, damping=0.03)
NC_BYTES = 50_000  # of a program: larger ones take more than 20 s
Planned = dict[str, Any]
Case = tuple[str, Program, Machine, OptimalMethod]


def cases(jobs: int) -> Iterator[Case]:
    """The programs behind the first of the random jobs."""
    usual = OptimalMethod(rounds=ROUNDS)
    for seed in range(jobs):
        if seed == FILTERED_JOBS:
            for name, program, machine in programs(NC_BYTES):
                yield name, program, machine, OptimalMethod(effort="quick")
        program, machine = random_lines.job(seed)
        yield f"random {seed}", program, machine, usual
        if seed < FILTERED_JOBS and seed % FILTERED == 0:
            delay = np.median([axis.acceleration / axis.jerk for axis in machine.axes.values()])
            behind = machine.model_copy(update={"fir": Fir(time_constants=(float(delay), float(delay / 2)))})
            yield f"filtered {seed}", program, behind, usual
        if seed < SHAPED_JOBS and seed % SHAPED == 0:
            ringing = machine.model_copy(update={"modes": (SHAPED_MODE,)})
            yield f"shaped {seed}", program, ringing, OptimalMethod(rounds=0, shaped=True)


def planned(case: Case) -> Planned:
    """One plan: its cycle time, None where it does not pass, its computing time, and what fired."""
    name, program, machine, how = case
    counts.clear()
    trace, began = Trace(), time.process_time()
    try:
        plan = how.plan(program, machine, log=trace)
    except PlannerError as fault:
        return {"job": name, "outcome": str(fault), "time": None, "took": 0.0, "counts": {}, "steps": []}
    passed = plan.trajectory is not None and plan.verdict is not None and plan.verdict.passed
    count_steps(trace.as_json())
    return {
        "job": name,
        "outcome": plan.sentence,
        "time": plan.trajectory.cycle_time if passed and plan.trajectory is not None else None,
        "took": time.process_time() - began,
        "counts": dict(counts),
        "steps": [step for step in trace.as_json() if step["name"] != "solve"],
    }


def _first_starts(count: int) -> Callable[[], None]:
    def switch() -> None:
        inner = window.ScaledWindow._starts
        window.ScaledWindow._starts = lambda self, *way: islice(inner(self, *way), count)  # type: ignore[method-assign]

    return switch


def _set(module: Any, name: str, value: Any) -> Callable[[], None]:
    return lambda: setattr(module, name, value)


# Without what: which counts show that it fired, and how it is switched off.
SWITCHES: dict[str, tuple[tuple[str, ...], Callable[[], None]]] = {
    "stops for splines": (("stops for splines",), _set(geometry, "STOP_ROUNDS", 0)),
    "stops for splines after round 1": (
        ("stops for splines, round 2",),
        _set(geometry, "STOP_ROUNDS", 1),
    ),
    "slower for verdict": (("slower for verdict",), _set(loop, "SEEN_ROUNDS", 0)),
    "slower for verdict after round 1": (("slower for verdict, round 2",), _set(loop, "SEEN_ROUNDS", 1)),
    "knots made denser": (("laid denser",), _set(initial, "DENSER_MAX", 0)),
    "sites tightened": (
        ("first shape: runs tightened", "reshaped: runs tightened"),
        _set(relax, "ROUNDS", 1),
    ),
    "sites tightened more than twice": (
        ("first shape: runs tightened more", "reshaped: runs tightened more"),
        _set(relax, "ROUNDS", 3),
    ),
    "windows around tightened sites in a round": (("reshaped: runs relaxed",), _set(reshape, "AGAIN", 0)),
    "windows around tightened sites for a second time": (
        ("reshaped: runs relaxed",),
        _set(reshape, "AGAIN", 1),
    ),
    "second start of a window": (("windows: start",), _first_starts(1)),
    "third start of a window": (("windows: start 3",), _first_starts(2)),
    "less for the period after round 1": (
        ("less for the period, round 2",),
        _set(method, "PERIOD_ROUNDS", 1),
    ),
    "feed around corners behind filters": (("filters, round 2",), _set(behind_filters, "ROUNDS", 1)),
    "feed around corners behind filters after round 5": (
        ("filters, round 6",),
        _set(behind_filters, "ROUNDS", 5),
    ),
    "all candidates but two behind a shaper": (
        ("shaped:",),
        _set(shaped.shaped, "__defaults__", ((shaped.CANDIDATES[0], shaped.CANDIDATES[2]),)),
    ),
}


def fired(row: Planned, names: tuple[str, ...]) -> int:
    """How often any of these counters did, or those whose names begin so."""
    return sum(count for name, count in row["counts"].items() if name.startswith(names))


# ---------------------------------------------------------------------------------------------------------------- report


def report(rows: list[Planned]) -> tuple[dict[str, Any], str]:
    """Numbers and tables of all plans."""
    usual = {row["job"]: row for row in rows if row["without"] is None and row["steps"]}
    total = sum(row["took"] for row in usual.values())
    jobs, times = Counter[str](), Counter[str]()
    for row in usual.values():
        times.update(row["counts"])
        jobs.update(name for name, count in row["counts"].items() if count)
    tries = summed(list(usual.values()), total)
    kinds = Counter(row["job"].split()[0] if " " in row["job"] else "programs" for row in usual.values())
    passed = sum(row["time"] is not None for row in usual.values())
    text = f"{len(usual)} plans ({', '.join(f'{kind} {count}' for kind, count in kinds.items())}), {passed} pass, "
    text += f"{total:.0f} s of computing.\n\n"
    text += "What the trace tells; gains are shares of the cycle time, mean over all plans and the largest one.\n\n"
    text += markdown(
        ["retry", "plans", "ran", "kept", "gain", "most", "share of computing time"],
        [
            [name, *(f"{e[k]:.0f}" for k in ("jobs", "ran", "kept")), f"{e['gain']:.1e}", f"{e['most']:.1e}", f"{e['took']:.1%}"]
            for name, e in sorted(tries.items())
        ],
    )  # fmt: skip
    text += "\nWhat counters tell.\n\n"
    text += markdown(
        ["event", "plans", "times"], [[name, str(jobs[name]), str(times[name])] for name in sorted(times)]
    )
    without: dict[str, Any] = {}
    for name in SWITCHES:
        pairs = [
            (usual[row["job"]], row)
            for row in rows
            if row["without"] == name and row["steps"] and row["job"] in usual
        ]
        if pairs:
            without[name] = _compared(pairs)
    text += "\nWithout a retry, on plans where it fired: how much longer they take, and how many no longer pass.\n\n"
    text += markdown(
        ["without", "plans", "longer, mean", "longest", "shortest", "fail now", "failed before", "computing"],
        [
            [name, str(e["plans"]), f"{e['mean']:+.1e}", f"{e['most']:+.1e}", f"{e['least']:+.1e}", str(e["fail"]), str(e["failed"]),
             f"{e['computing']:.2f}"]
            for name, e in without.items()
        ],
    )  # fmt: skip
    return {
        "events": {k: [jobs[k], times[k]] for k in sorted(times)},
        "tries": tries,
        "without": without,
    }, text


def _compared(pairs: list[tuple[Planned, Planned]]) -> dict[str, float]:
    longer = [b["time"] / a["time"] - 1.0 for a, b in pairs if a["time"] and b["time"]] or [np.nan]
    return {
        "plans": len(pairs),
        "mean": float(np.mean(longer)),
        "most": float(np.max(longer)),
        "least": float(np.min(longer)),
        "fail": sum(b["time"] is None and a["time"] is not None for a, b in pairs),
        "failed": sum(a["time"] is None and b["time"] is not None for a, b in pairs),
        "computing": sum(b["took"] for _, b in pairs) / max(sum(a["took"] for a, _ in pairs), 1e-9),
    }


def main() -> None:
    """Plan what is missing, or report."""
    parser = argparse.ArgumentParser(description="how often each retry of the planner fires, and what for")
    parser.add_argument("--jobs", type=int, default=JOBS)
    parser.add_argument("--traces", type=Path, required=True)
    parser.add_argument("--without", choices=list(SWITCHES))
    parser.add_argument("--seconds", type=float, default=np.inf, help="of computing at most")
    parser.add_argument("--report", action="store_true", help="plan nothing")
    chosen = parser.parse_args()
    rows = read_rows(chosen.traces)
    if chosen.report:
        numbers, text = report(rows)
        print(text)
        write_results("ablation-retries", numbers, text)
        return
    known = {row["job"] for row in rows if row["without"] == chosen.without}
    usual = {row["job"]: row for row in rows if row["without"] is None}
    use_threads(1)
    watch()
    names: tuple[str, ...] = ()
    if chosen.without:
        names, switch = SWITCHES[chosen.without]
        switch()
    for case in cases(chosen.jobs):
        name = case[0]
        if name in known or (chosen.without and (name not in usual or not fired(usual[name], names))):
            continue
        if time.process_time() > chosen.seconds:
            print("no time left")
            break
        with contextlib.suppress(RecursionError):
            row = {"without": chosen.without, **planned(case)}
            add_row(chosen.traces, row)
            print(name, row["time"], f"{row['took']:.1f} s", flush=True)


if __name__ == "__main__":
    main()
