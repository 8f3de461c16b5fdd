"""What the planner does, job by job: recorded at one commit, compared at another.

    python -m benchmarks.net.golden_net FILE [--campaign 2000] [--every 1]     record; rows that FILE has are not made again
    python -m benchmarks.net.golden_net FILE --against OTHER                   compare FILE with OTHER, plan nothing

The jobs: suite `quick` by all its methods (98 plans), suite `random` by `optimal` (100 plans), and jobs of the campaign as they come. A
row has what the planner did: outcome, cycle time, method, solver, sentence, a hash of the setpoints, the prices, and how often it took
each step of the trace. All plans are made on one thread. Recorded: results/golden-net.jsonl.gz. A plan that takes longer than the limit
is no row to compare.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import json
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from benchmarks.campaign import jobs as campaign_jobs
from benchmarks.record import planner_state
from benchmarks.runner.suites import SUITES
from planner.base.errors import PlannerError
from planner.base.threads import use_threads
from planner.planning.job.plan import Plan
from planner.planning.job.trace import Trace
from planner.planning.methods.registry import plan

FIRST = 2_000_000  # seed of the first campaign job
SAME, WORST = 1e-4, 1e-3  # of the cycle time: what a removal may change, on the mean and at worst [-]
DIGITS = 4  # of a price
Row = dict[str, Any]


class TooLong(BaseException):
    """The plan has used its processor time."""


def jobs(campaign: int) -> Iterator[tuple[str, Callable[[Trace], Plan | str]]]:
    """Name of a job, and what plans it; a sentence where the job is refused before."""
    for suite in ("quick", "random"):
        for job in SUITES[suite].jobs():
            for way in SUITES[suite].ways if suite == "quick" else ("optimal",):
                yield f"{suite} {job.name} {way}", lambda log, job=job, way=way: _of_suite(job, way, log)
    for seed in range(FIRST, FIRST + campaign):
        yield f"campaign {seed}", lambda log, seed=seed: _of_campaign(seed, log)


def _of_suite(job: Any, way: str, log: Trace) -> Plan:
    machine = job.machine()
    method, _, effort = way.partition(":")
    return plan(
        job.program(machine), machine, method=method, effort=effort or None, tolerance=job.tolerance, log=log
    )


def _of_campaign(seed: int, log: Trace) -> Plan | str:
    made = campaign_jobs.job(seed)
    if made.program is None:
        return made.refusal
    return plan(
        made.program, made.machine, method=made.method, tolerance=made.tolerance, log=log, **made.settings
    )


def row_of(name: str, planned: Callable[[Trace], Plan | str], limit: float) -> Row:
    """What the planner does with a job; nothing that it raises is raised here."""
    began, trace = time.process_time(), Trace()
    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        row = _about(planned(trace))
    except TooLong:
        row = {"outcome": "too long"}
    except PlannerError as fault:
        row = {"outcome": "refused", "said": str(fault)}
    except Exception as fault:
        row = {"outcome": "crash", "said": f"{type(fault).__name__}: {fault}"}
    finally:
        with suppress(TooLong):
            signal.setitimer(signal.ITIMER_PROF, 0.0)
    steps = Counter(
        " ".join([step.name, *(str(step.facts[k]) for k in ("method", "corner") if k in step.facts)])
        for step in trace.steps
    )
    return {"name": name} | row | {"steps": dict(steps), "cpu": round(time.process_time() - began, 3)}


def _stop(number: int, frame: FrameType | None) -> None:
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    raise TooLong


def _about(made: Plan | str) -> Row:
    if isinstance(made, str):
        return {"outcome": "refused", "said": made}
    if made.trajectory is None or made.verdict is None:
        return {"outcome": "not solved", "said": made.sentence}
    motion = made.trajectory
    found = hashlib.sha256()
    for array in (motion.position, motion.velocity, motion.acceleration):
        found.update(np.ascontiguousarray(array).tobytes())
    priced = None
    if made.prices is not None:
        priced = {name: float(f"{saved:.{DIGITS}g}") for name, saved in made.prices.saved.items()}
    return {
        "outcome": "passed" if made.verdict.passed else "failed",
        "time": made.cycle_time,
        "solver": f"{made.method} {made.corner} {made.solver}",
        "said": made.sentence,
        "setpoints": found.hexdigest()[:16],
        "prices": priced,
    }


def read(file: Path) -> dict[str, Row]:
    """The rows of a file by their names; none where there is no file."""
    if not file.exists():
        return {}
    text = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
    rows = [json.loads(line) for line in text.splitlines() if line]
    return {row["name"]: row for row in rows}


def compared(before: dict[str, Row], after: dict[str, Row]) -> str:
    """What has changed, as text: counts, and every row whose cycle time or outcome is another."""
    both = [(before[name], row) for name, row in after.items() if name in before]
    both = [pair for pair in both if "too long" not in (pair[0]["outcome"], pair[1]["outcome"])]
    lines = []
    timed = [(a, b) for a, b in both if "time" in a and "time" in b and a["outcome"] == b["outcome"]]
    longer = np.array([b["time"] / a["time"] - 1.0 for a, b in timed] or [0.0])
    lines.append(
        f"{len(both)} jobs; same setpoints {sum(a['setpoints'] == b['setpoints'] for a, b in timed)} of {len(timed)}"
    )
    lines.append(
        f"cycle time: mean {longer.mean():+.2e}, longest {longer.max():+.2e}, shortest {longer.min():+.2e}"
    )
    lines.append(f"prices changed: {sum(a['prices'] != b['prices'] for a, b in timed)}")
    lines.append(
        f"CPU s: {sum(a['cpu'] for a, _ in both):.1f} before, {sum(b['cpu'] for _, b in both):.1f} after"
    )
    lines += [
        f"  {a['name']}: {a['outcome']} -> {b['outcome']}: {b.get('said', '')}"
        for a, b in both
        if a["outcome"] != b["outcome"]
    ]
    lines += [
        f"  {a['name']}: {a['time']:.6f} -> {b['time']:.6f} s ({b['time'] / a['time'] - 1.0:+.1e}) {a['solver']} -> {b['solver']}"
        for a, b in timed
        if abs(b["time"] / a["time"] - 1.0) > SAME
    ]
    return "\n".join(lines)


def main() -> int:
    """Record, or compare."""
    parser = argparse.ArgumentParser(description="what the planner does, job by job")
    parser.add_argument("file", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--campaign", type=int, default=2000)
    parser.add_argument("--every", type=int, default=1, help="only every so many of the campaign's jobs")
    parser.add_argument("--seconds", type=float, default=np.inf, help="of computing at most")
    parser.add_argument("--limit", type=float, default=20.0, help="processor seconds of one plan")
    chosen = parser.parse_args()
    if chosen.against is not None:
        print(compared(read(chosen.against), read(chosen.file)))
        return 0
    use_threads(1)
    known = read(chosen.file)
    commit = planner_state()
    for name, planned in jobs(chosen.campaign):
        if name in known or (name.startswith("campaign") and int(name.split()[1]) % chosen.every):
            continue
        if time.process_time() > chosen.seconds:
            print("no time left", file=sys.stderr)
            break
        row = row_of(name, planned, chosen.limit) | {"commit": commit}
        with open(chosen.file, "a", encoding="utf-8") as lines:
            lines.write(json.dumps(row) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
