"""Random programs on random machines by random methods: every plan verified, and judged once more by code of its own.

    python -m benchmarks campaign [--count 1000] [--seed 0] [--processes 2] [--limit 180]
    python -m benchmarks campaign --again 17 23         these jobs once more, told on the terminal

The jobs are those of campaign_jobs.py: programs of all of the language, limits over decades, up to nine axes, filters, vibration modes,
tolerances from 1 um to 1 mm, periods from 0.25 to 16 ms, all methods. Each is planned in a process that is killed after `--limit`
seconds: that is a hang. An error that is none of the planner's own is a crash. A refusal has a message. The second judge
(campaign_judge.py) has the positions only. Of every tenth job the laws are asked (campaign_laws.py): twice the size at twice the
limits takes the same time, a tenth more of all limits or half as much more tolerance is not slower, lines in the other direction,
mirrored or cut in two take as long.

Rows: benchmarks/results/campaign.jsonl, one for each job; a job that is there is not made again. Summary: campaign.json and .md.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import sys
import time
import traceback
import warnings
from multiprocessing.connection import Connection, wait
from typing import Any

import numpy as np

from benchmarks import campaign_jobs, campaign_judge, campaign_laws
from benchmarks.record import RESULTS, markdown, write_results

ROWS = RESULTS / "campaign.jsonl"
LAWS_EVERY = 10
SAID = 200  # characters of a fault in the summary
PASSED, REFUSED, UNSOLVED, FAILED, CRASH, HANG = (
    "passed",
    "refused",
    "not solved",
    "verdict failed",
    "crash",
    "hang",
)
Row = dict[str, Any]


def made(seed: int) -> Row:
    """One job: planned, verified, judged again, and perhaps its laws."""
    import planner
    from planner.base.errors import PlannerError

    began = time.process_time()
    row: Row = {"seed": seed}
    try:
        job = campaign_jobs.job(seed)
        row |= {"source": job.source, "way": job.way, "axes": len(job.machine.axes)}
        if job.program is None:
            return row | {"status": REFUSED, "message": job.refusal, "cpu_s": time.process_time() - began}
        row |= {"blocks": len(job.program), "dt": job.machine.dt, "filters": job.machine.fir is not None}
        plan = planner.plan(
            job.program, job.machine, method=job.method, tolerance=job.tolerance, **job.settings
        )
        row |= {"plan_cpu_s": time.process_time() - began, "sentence": plan.sentence}
        if plan.trajectory is None or plan.verdict is None:
            return row | {"status": UNSOLVED, "message": plan.sentence, "cpu_s": time.process_time() - began}
        row |= {
            "status": PASSED if plan.verdict.passed else FAILED,
            "message": "; ".join(plan.verdict.faults[:2]),
        }
        row |= {"cycle_s": plan.cycle_time, "second": second(job, plan)[:3]}
        if seed % LAWS_EVERY == 0 and plan.verdict.passed:
            row["laws"] = campaign_laws.asked(job, plan)
    except PlannerError as fault:
        row |= {"status": REFUSED, "message": str(fault)}
    except Exception:
        row |= {"status": CRASH, "message": traceback.format_exc()[-1500:]}
    return row | {"cpu_s": time.process_time() - began}


def second(job: campaign_jobs.Job, plan: Any) -> list[str]:
    """What the second judge finds."""
    axes, program = plan.trajectory.axes, job.program
    own = [program.axes.index(letter) for letter in axes]
    column = {name: job.machine.limits(name, axes) for name in ("velocity", "acceleration", "jerk")}
    judged = {check.split(".")[0] for check, one in plan.verdict.limits.items() if one.limited}
    free = set(column) - judged
    column |= {name: np.full(len(axes), np.inf) for name in free}
    # angles have the unit of the trajectory: its degrees are `in_degrees` times that
    turned = np.array([letter in "abc" for letter in axes])
    unit = np.where(turned, np.rad2deg(1.0) / plan.trajectory.in_degrees, 1.0)
    ends = program.start[own] * unit, program.end[-1][own] * unit
    return campaign_judge.judged(
        plan.trajectory.position, job.machine.dt, ends, campaign_judge.Bounds(**column), _way(job)
    )


def _way(job: campaign_jobs.Job) -> campaign_judge.Way | None:
    """What was programmed, of lines and arcs in x, y, z at a feed in mm/s; None for the others."""
    program, machine = job.program, job.machine
    assert program is not None
    splines, rotary = len(program.splines.block) > 0, any(letter in "abcuvw" for letter in program.axes)
    if splines or rotary or len(program.synchronised):
        return None
    default = machine.tolerance if job.tolerance is None else job.tolerance
    own = np.isfinite(program.tolerance) if job.tolerance is None else np.zeros(len(program), dtype=bool)
    tolerance = np.where(own, program.tolerance, default)
    position, arcs = (
        np.vstack([program.start, program.end])[:, :3],
        dict(zip(program.arc_block.tolist(), range(len(program.arc_block)), strict=True)),
    )
    points, moves = [], []
    for block in range(len(program)):
        begin, end = position[block], position[block + 1]
        k = arcs.get(block)
        if k is not None:
            arc = program.arc_center[k][:3], int(program.arc_normal[k]), float(program.arc_sweep[k])
            points.append(campaign_judge.arc_points(begin, end, *arc, float(tolerance[block])))
        elif (begin != end).any():
            points.append(np.stack([begin, end]))
        else:
            continue
        moves.append(block)
    if not moves:
        return None
    return campaign_judge.Way(points=points, tolerance=tolerance[moves], feed=program.feed[moves])


# ---- processes ---------------------------------------------------------------------------------------------------------------


def _work(pipe: Connection) -> None:
    """Make the jobs that come through the pipe."""
    from planner.base.threads import use_threads

    warnings.simplefilter("ignore")
    use_threads(1)
    while (seed := pipe.recv()) is not None:
        pipe.send(made(seed))


class _Worker:
    """A process and its present job."""

    def __init__(self) -> None:
        self.pipe, there = multiprocessing.Pipe()
        self.process = multiprocessing.get_context("spawn").Process(target=_work, args=(there,), daemon=True)
        self.process.start()
        there.close()
        self.seed, self.since = -1, 0.0

    def give(self, seed: int) -> None:
        """The next job."""
        self.seed, self.since = seed, time.monotonic()
        self.pipe.send(seed)

    def row(self, limit: float) -> Row | None:
        """What became of the job; None as long as it runs."""
        try:
            if self.pipe.poll():
                return dict(self.pipe.recv())
        except EOFError:
            return {
                "seed": self.seed,
                "status": CRASH,
                "message": f"the process ended: {self.process.exitcode}",
            }
        if time.monotonic() - self.since > limit:
            self.process.kill()
            return {"seed": self.seed, "status": HANG, "message": f"after {limit:g} s"}
        return None


def run(seeds: list[int], processes: int, limit: float) -> None:
    """Make the jobs, a row each at once."""
    left = collections.deque(seeds)
    workers: list[_Worker] = []
    with ROWS.open("a", encoding="utf-8") as file:
        while left or workers:
            while left and len(workers) < processes:
                workers.append(_Worker())
                workers[-1].give(left.popleft())
            wait([worker.pipe for worker in workers], timeout=1.0)
            for worker in list(workers):
                row = worker.row(limit)
                if row is None:
                    continue
                file.write(json.dumps(row) + "\n")
                file.flush()
                if row["status"] == HANG or not worker.process.is_alive():
                    workers.remove(worker)
                elif left:
                    worker.give(left.popleft())
                else:
                    worker.pipe.send(None)
                    workers.remove(worker)


# ---- summary -----------------------------------------------------------------------------------------------------------------


def summary(rows: list[Row]) -> tuple[dict[str, Any], str]:
    """Counts, and what went wrong, as data and as Markdown."""
    status = collections.Counter(row["status"] for row in rows)
    wrong = [row for row in rows if row["status"] in (CRASH, HANG, FAILED) or row.get("second")]
    seconds = [row for row in rows if "second" in row]
    laws = [(row["seed"], name, off) for row in rows for name, off in row.get("laws", {}).items()]
    broken = [one for one in laws if one[2] > campaign_laws.ALLOWED]
    by_law = collections.defaultdict(list)
    for _, name, off in laws:
        by_law[name].append(off)
    sources = sorted({row.get("source", "?") for row in rows})
    cells = [
        [
            name,
            str(len(own)),
            *(
                str(sum(row["status"] == one for row in own))
                for one in (PASSED, REFUSED, UNSOLVED, FAILED, CRASH, HANG)
            ),
        ]
        for name in sources
        if (own := [row for row in rows if row.get("source", "?") == name])
    ]
    text = f"{len(rows):,} jobs, {sum(row.get('cpu_s', 0.0) for row in rows):,.0f} CPU s.\n\n"
    text += markdown(["programs", "jobs", PASSED, REFUSED, UNSOLVED, FAILED, CRASH, HANG], cells)
    agree = sum(not row["second"] for row in seconds if row["status"] == PASSED)
    text += f"\nOf {sum(row['status'] == PASSED for row in seconds):,} that passed the second judge found nothing in {agree:,}.\n\n"
    text += markdown(
        ["law", "jobs", f"off by more than {campaign_laws.ALLOWED:g}", "at most"],
        [
            [name, str(len(off)), str(sum(one > campaign_laws.ALLOWED for one in off)), f"{max(off):.1e}"]
            for name, off in sorted(by_law.items())
        ],
    )
    text += "".join(f"\n- {_sentence(row)}" for row in wrong[:40])
    worst = sorted(broken, key=lambda one: -one[2])[:20]
    text += "".join(f"\n- seed {seed}: {name} off by {off:.2e}" for seed, name, off in worst) + "\n"
    refusals = collections.Counter(
        row["message"].split(": ", 1)[-1][:60] for row in rows if row["status"] == REFUSED
    )
    data = {
        "status": dict(status),
        "agree": agree,
        "wrong": wrong,
        "laws_broken": broken,
        "refusals": refusals.most_common(40),
    }
    return data, text


def _sentence(row: Row) -> str:
    said = row.get("message") or "; ".join(row.get("second", []))
    said = " ".join(said.split())[-SAID:]
    return f"seed {row['seed']}, {row.get('source')}, {row.get('way')}: {row['status']}: {said}"


def main(argv: list[str] | None = None) -> int:
    """Make the jobs that are not there yet."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks campaign", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first job")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--limit", type=float, default=180.0, help="for a job [s]")
    parser.add_argument("--again", type=int, nargs="+", help="jobs to be made once more; nothing is kept")
    given = parser.parse_args(argv)
    if given.again:
        for seed in given.again:
            print(json.dumps(made(seed), indent=1))
        return 0
    rows = (
        [json.loads(line) for line in ROWS.read_text(encoding="utf-8").splitlines()] if ROWS.exists() else []
    )
    have = {row["seed"] for row in rows}
    try:
        run(
            [seed for seed in range(given.seed, given.seed + given.count) if seed not in have],
            given.processes,
            given.limit,
        )
    except KeyboardInterrupt:
        print("stopped; what was made is kept", file=sys.stderr)
    rows = [json.loads(line) for line in ROWS.read_text(encoding="utf-8").splitlines()]
    data, text = summary(rows)
    write_results("campaign", data, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
