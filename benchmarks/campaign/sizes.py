"""Campaign jobs on the ways of large jobs: the same verdicts and setpoints?

    python -m benchmarks.campaign.sizes [--count N] [--seed S] [--seconds T] [--limit C] [--ways small] [--summary]

Each job of the campaign (jobs.py) is planned in processes of their own: with the usual sizes, with those of kind `parts`
small, with those of kind `routes`, and with all of them small (planner/base/sizes.py), or with the usual and the named ones only. In
parts verdict and setpoints have to be the same to rounding, on other routes verdict and time, with all sizes small the verdict; how
much longer less effort makes a motion is told. Rows go to results/sizes.jsonl, --summary writes results/sizes.md from them. A job that
takes more than C processor seconds on one of the ways is not compared there, nor tried on those after it.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
from collections import Counter
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from benchmarks.campaign import Compiling, Worker
from benchmarks.campaign.jobs import job
from benchmarks.campaign.tally import CRASH, FAILED, PASSED, REFUSED, TOO_LONG, UNSOLVED
from benchmarks.record import RESULTS, provenance
from planner.base import kernel_files
from planner.base.errors import InputError
from planner.base.sizes import PARTS, ROUTES, SMALL, VARIABLE
from planner.planning.methods.registry import plan

ROWS, SUMMARY = RESULTS / "sizes.jsonl", RESULTS / "sizes.md"
USUAL = "usual"
WAYS = {USUAL: "", PARTS: PARTS, ROUTES: ROUTES, SMALL: SMALL}
OTHERS = tuple(WAYS)[1:]
LIMIT = 10.0  # of a job on one way [CPU s]
SAME = 1e-7  # setpoints that differ by less of the column's largest value are the same [-]: accelerations at jumps are rounding
ANOTHER_ROUTE = 1e-4  # of the time, which the other way to the same optimum may end from it [-]
COLUMNS = ("t", "position", "velocity")
Row = dict[str, Any]


def served(ends: Connection) -> None:
    """Plan jobs by their seeds, and send what came out of each."""
    compiling = Compiling(ends)
    kernel_files.at_compilation(compiling)
    while True:
        try:
            seed = ends.recv()
        except EOFError:
            return
        began, before = time.process_time(), compiling.took
        made = found(seed)
        ends.send(made | {"cpu": round(time.process_time() - began - (compiling.took - before), 2)})


def found(seed: int) -> Row:
    """What planning the job of a seed gives: outcome, cycle time and setpoints."""
    try:
        drawn = job(seed)
        if drawn.program is None:
            return {"outcome": REFUSED}
        made = plan(
            drawn.program, drawn.machine, method=drawn.method, tolerance=drawn.tolerance, **drawn.settings
        )
    except InputError:
        return {"outcome": REFUSED}
    except Exception as fault:  # a finding, whatever it is
        return {"outcome": CRASH, "said": f"{type(fault).__name__}: {fault}"}
    if made.trajectory is None or made.verdict is None:
        return {"outcome": UNSOLVED}
    return {
        "outcome": PASSED if made.verdict.passed else FAILED,
        "method": drawn.method,
        "time": made.cycle_time,
        "said": made.verdict.sentences[0] if made.verdict.sentences else "",
        "columns": {name: np.array(getattr(made.trajectory, name)) for name in COLUMNS},
    }


def compared(usual: Row, other: Row, way: str) -> str:
    """What differs between a job on two ways and should not; empty if nothing does."""
    if TOO_LONG in (usual["outcome"], other["outcome"]):
        return ""
    if usual["outcome"] != other["outcome"]:
        return f"{usual['outcome']} / {other['outcome']}: {usual.get('said', '')} / {other.get('said', '')}"
    if "time" not in usual or way == SMALL:
        return ""
    more = other["time"] / usual["time"] - 1.0
    if way == ROUTES:
        return f"time {more:+.1e} ({usual['method']})" if abs(more) > ANOTHER_ROUTE else ""
    for name, before in usual["columns"].items():
        after = other["columns"][name]
        if before.shape != after.shape:
            return f"{name}: {before.shape} / {after.shape}"
        off = float(np.abs(after - before).max()) / (float(np.abs(before).max()) or 1.0)
        if off > SAME:
            return f"{name}: {off:.1e}"
    return ""


def started(kinds: str) -> Worker:
    """A process in which the sizes of these kinds are small."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = kinds
    try:
        here, there = multiprocessing.Pipe()
        process = multiprocessing.get_context("spawn").Process(target=served, args=(there,), daemon=True)
        process.start()
        there.close()
    finally:
        os.environ.pop(VARIABLE)
        if before is not None:
            os.environ[VARIABLE] = before
    return Worker(process, here)


def rows_of(seeds: list[int], ways: list[str], seconds: float, limit: float) -> Any:
    """A row for each job as it is done on these ways; no job is begun after so many seconds."""
    end = time.monotonic() + seconds
    workers: dict[str, Worker] = {}
    for seed in seeds:
        if time.monotonic() > end:
            return
        made: dict[str, Row] = {}
        for way in ways:
            if way not in workers or not workers[way].process.is_alive():
                workers[way] = started(WAYS[way])
            workers[way].give(seed)
            row = None
            while row is None:
                workers[way].ends.poll(0.5)
                row = workers[way].result(limit)
            made[way] = row
            if row["outcome"] == TOO_LONG:
                break
        row = {"seed": seed} | {
            way: {k: v for k, v in one.items() if k != "columns"} for way, one in made.items()
        }
        row["differs"] = {way: compared(made[USUAL], one, way) for way, one in made.items() if way != USUAL}
        yield row


def summary(rows: list[Row]) -> str:
    """The table of results/sizes.md."""
    about = provenance()
    seeds = sorted(row["seed"] for row in rows)
    begins = [seed for seed in seeds if seed - 1 not in seeds]
    ranges = ", ".join(
        f"{begin} to {end}"
        for begin, end in zip(begins, [seed for seed in seeds if seed + 1 not in seeds], strict=True)
    )
    lines = [
        f"Made by `python -m benchmarks.campaign.sizes --summary` at {about['commit']} on {about['date']} "
        f"({about['machine']}). Seeds {ranges}.",
        "",
        f"{len(rows)} jobs, each planned with the usual sizes and with others: those of kind `parts` small (samples on demand, chunks,",
        "threads), those of kind `routes` (windows and ranges), all of them (`PLANNER_SIZES=small`). Commits: "
        f"{', '.join(sorted({row['commit'][:8] for row in rows}))}.",
        "",
        "| | " + " | ".join(WAYS) + " |",
        "|---|" + "---:|" * len(WAYS),
    ]
    outcomes = {way: Counter(row[way]["outcome"] for row in rows if way in row) for way in WAYS}
    for name in sorted(set().union(*outcomes.values())):
        lines.append(f"| {name} | " + " | ".join(str(outcomes[way][name]) for way in WAYS) + " |")
    differ = {way: sum(bool(row["differs"].get(way)) for row in rows) for way in WAYS}
    lines.append("| not as it should be | | " + " | ".join(str(differ[way]) for way in OTHERS) + " |")
    for share in (0.5, 0.9, 1.0):
        more = {
            way: f"{np.quantile(_longer(rows, way), share):+.1e}" if _longer(rows, way) else ""
            for way in OTHERS
        }
        lines.append(f"| time, quantile {share:g} | | " + " | ".join(more.values()) + " |")
    lines += [
        "",
        "Not as it should be: another outcome; in parts setpoints that differ by more than rounding; on other routes a time that",
        f"differs by more than {ANOTHER_ROUTE:g}. Splines that no search of geometry and feed follows are what their windows make of",
        "them, up to some 1e-3 of the time. With all sizes small the time is that of less effort, which the quantiles show. Jobs",
        "that took more than their share of processor time on a way (`too long`) are not compared there, nor tried on those after it.",
        "",
        "What differs:",
        "",
    ]
    lines += [
        f"* {row['seed']}, {way}: {said}" for row in rows for way, said in row["differs"].items() if said
    ] or ["nothing"]
    return "\n".join(lines) + "\n"


def _longer(rows: list[Row], way: str) -> list[float]:
    """By how much the jobs that were planned both ways take longer [-]."""
    both = [row for row in rows if way in row and "time" in row[way] and "time" in row[USUAL]]
    return [row[way]["time"] / row[USUAL]["time"] - 1.0 for row in both]


def main(argv: list[str] | None = None) -> int:
    """Run what is not there; the exit code is 0, whatever was found."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.campaign.sizes", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first job")
    parser.add_argument("--seconds", type=float, default=np.inf, help="begin no job after so many")
    parser.add_argument("--limit", type=float, default=LIMIT, help="CPU s of a job on one way")
    parser.add_argument("--ways", nargs="+", choices=OTHERS, default=OTHERS, help="beside the usual one")
    parser.add_argument("--summary", action="store_true", help="write the table of the rows that are there")
    options = parser.parse_args(argv)
    kept = (
        [json.loads(line) for line in ROWS.read_text(encoding="utf-8").splitlines()] if ROWS.exists() else []
    )
    if options.summary:
        SUMMARY.write_text(summary(kept), encoding="utf-8")
        return 0
    known = {row["seed"] for row in kept}
    commit = provenance()["commit"]
    seeds = [seed for seed in range(options.seed, options.seed + options.count) if seed not in known]
    with ROWS.open("a", encoding="utf-8") as file:
        for row in rows_of(seeds, [USUAL, *options.ways], options.seconds, options.limit):
            file.write(json.dumps(row | {"commit": commit}) + "\n")
            file.flush()
            if any(row["differs"].values()):
                print(json.dumps(row), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
