"""Thousands of random jobs, planned, judged twice, and held against laws: what goes wrong?

    python -m benchmarks campaign [--count N] [--seed S] [--processes P | --cluster ADDRESS] [--again SEED ...] [--seconds T]
                                  [--limit C] [--anew] [--sizes small]

A job follows from its seed (jobs.py): program, machine, tolerance, period, method; from seed 100,000 on half of the jobs have the
default method and effort. Its plan (rows.py) is judged by the planner's verifier and by another judge that shares no code with the
package (judge.py), and its time compared with the proved bound; every tenth job is planned once more, changed by a law (laws.py). Each
job has C processor seconds in a child process, which is ended if they do not suffice: P of them here, or those of the workers of a
Dask cluster (cluster.py).

Every job is a row of results/campaign.jsonl at once. At the end the rows are counted in results/campaign.json (tally.py),
with a summary in campaign.md, and removed. Jobs that are in one of them are not planned again. --again plans jobs once more; what comes
of that is told beside, and they count as they came out the first time. All jobs of a campaign are planned at one commit of the planner:
at another one, and after a change of the draws, --anew begins again. What compiling a kernel takes, once on a machine, is not counted:
a job that was ended in it would leave it to the next one. With --sizes jobs go the ways of large ones (planner/base/sizes.py), and
their rows to a file of their own; `python -m benchmarks.campaign.sizes` compares them.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign.cluster import rows_on_cluster
from benchmarks.campaign.jobs import fingerprint, job
from benchmarks.campaign.rows import Row, about, outcome
from benchmarks.campaign.table import write_summary
from benchmarks.campaign.tally import CRASH, TOO_LONG, Tally, wrongs
from benchmarks.record import RESULTS, planner_state
from planner.base import kernel_files, sizes
from planner.base.errors import InputError, NotSolvedError
from planner.base.threads import use_threads

KEPT, SUMMARY = RESULTS / "campaign.jsonl", RESULTS / "campaign.json"
LIMIT = 10.0  # of a job, its law included [CPU s]
WALL = 10.0  # times that, until a job is ended that takes no processor time


@dataclass
class Worker:
    """A process that plans jobs, and the one it has now."""

    process: Any
    ends: Connection
    seed: int = -1
    began: float = 0.0
    before: float = 0.0
    compiles: bool = False

    @classmethod
    def started(cls) -> Worker:
        here, there = multiprocessing.Pipe()
        process = multiprocessing.get_context("spawn").Process(target=_serve, args=(there,), daemon=True)
        process.start()
        there.close()
        return cls(process, here)

    def give(self, seed: int) -> None:
        self.seed, self.began, self.before, self.compiles = seed, time.monotonic(), 0.0, False
        self.before = self.used()
        self.ends.send(seed)

    def used(self) -> float:
        """Processor seconds of its job so far; where the system does not say, the time that has passed."""
        try:
            columns = (
                Path(f"/proc/{self.process.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            )
        except OSError:
            return time.monotonic() - self.began
        return (int(columns[11]) + int(columns[12])) / os.sysconf("SC_CLK_TCK") - self.before

    def result(self, limit: float) -> Row | None:
        """The row of its job, or None while it has time left, of `limit` [CPU s]."""
        late = not self.compiles and self.used() > limit
        late |= time.monotonic() - self.began > WALL * limit
        while not late and self.ends.poll():
            try:
                told = self.ends.recv()
            except EOFError:
                self.process.join()
                return {"seed": self.seed, "outcome": CRASH, "said": f"died with {self.process.exitcode}"}
            if isinstance(told, dict):
                return told
            self.compiles = told is None
            self.before += told or 0.0
        if not late:
            return None
        self.process.kill()
        self.process.join()
        try:
            row = about(job(self.seed))
        except Exception:  # what cannot be drawn is named by its seed
            row = {"seed": self.seed}
        return row | {"outcome": TOO_LONG, "said": f"more than {limit:g} CPU s", "cpu": limit}


class Compiling(kernel_files.Compilation):
    """Tells through a pipe that a kernel is being compiled, by None, and what that took [CPU s]."""

    def __init__(self, ends: Connection):
        self._ends, self._began, self.took = ends, 0.0, 0.0

    def begins(self, is_kept: bool) -> None:
        """A kernel is about to be compiled."""
        self._began = time.process_time()
        self._ends.send(None)

    def ends(self) -> None:
        """It is."""
        took = time.process_time() - self._began
        self.took += took
        self._ends.send(took)


def _serve(ends: Connection) -> None:
    use_threads(1)
    compiling = Compiling(ends)
    kernel_files.at_compilation(compiling)
    while True:
        try:
            seed = ends.recv()
        except EOFError:
            return
        before = compiling.took
        row = outcome(seed)
        ends.send(row | {"cpu": round(row["cpu"] - (compiling.took - before), 3)})


def rows_of(seeds: list[int], processes: int, seconds: float, limit: float = LIMIT) -> Iterator[Row]:
    """The rows of jobs as they are done, each with `limit` CPU s; no job is begun after so many seconds."""
    left, end = list(reversed(seeds)), time.monotonic() + seconds
    workers = [Worker.started() for _ in range(min(processes, len(seeds)))]
    for worker in workers:
        worker.give(left.pop())
    while workers:
        wait([worker.ends for worker in workers], timeout=1.0)
        for n in reversed(range(len(workers))):
            row = workers[n].result(limit)
            if row is None:
                continue
            yield row
            if not left or time.monotonic() > end:
                workers.pop(n).ends.close()
                continue
            if not workers[n].process.is_alive():
                workers[n] = Worker.started()
            workers[n].give(left.pop())


def kept_rows(file: Path = KEPT) -> list[Row]:
    """The rows of earlier runs, in their order."""
    if not file.exists():
        return []
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines() if line.endswith("}")]


def main(argv: list[str] | None = None) -> int:
    """Run what is not there, and write the summary. The exit code is 0, whatever was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks campaign", description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first job")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="of a Dask scheduler whose workers plan the jobs"
    )
    parser.add_argument(
        "--again", type=int, nargs="*", help="these jobs, or all that failed, once more; told beside"
    )
    parser.add_argument(
        "--anew", action="store_true", help="begin a new campaign; what there is of another is left out"
    )
    parser.add_argument("--seconds", type=float, default=np.inf, help="begin no job after so many")
    parser.add_argument("--limit", type=float, default=LIMIT, help="CPU s of a job")
    parser.add_argument("--file", type=Path, help=f"of the rows, default {KEPT.name}")
    parser.add_argument(
        "--sizes", default="", metavar="KINDS", help="that are small: small for all (planner/base/sizes.py)"
    )
    parser.add_argument("--show", type=int, metavar="SEED", help="print this job as JSON, and do no more")
    options = parser.parse_args(argv)
    if options.sizes:
        sizes.chosen(options.sizes)  # a word that it does not know
        os.environ[sizes.VARIABLE] = options.sizes  # for the processes that plan
    options.file = options.file or (RESULTS / f"campaign-{options.sizes}.jsonl" if options.sizes else KEPT)
    if options.show is not None:
        print(json.dumps(job(options.show).data(), indent=1))
        return 0
    draws, commit = fingerprint(), planner_state()
    tally = Tally.read(SUMMARY) if options.file == KEPT and not options.anew else Tally()
    if len(tally) and (tally.draws, tally.commit) != (draws, commit):
        parser.error(
            f"{SUMMARY.name} is of other draws of the seeds, or of planner {tally.commit} where this is {commit}; --anew begins again"
        )
    tally.draws, tally.commit = draws, commit
    if options.anew:
        options.file.unlink(missing_ok=True)
    try:
        tally.add(kept_rows(options.file))
    except ValueError as fault:
        parser.error(f"{options.file}: {fault}; --anew begins again")
    seeds = [seed for seed in range(options.seed, options.seed + options.count) if seed not in tally]
    if options.again is not None:
        seeds = options.again or list(tally.wrong)
    options.file.parent.mkdir(exist_ok=True)
    if options.cluster:
        rows = rows_on_cluster(options.cluster, seeds, options.seconds, options.limit)
    else:
        rows = rows_of(seeds, options.processes, options.seconds, options.limit)
    with options.file.open("a", encoding="utf-8") as file:
        try:
            for row in rows:
                made = row | {"commit": commit}
                tally.add([made])
                file.write(json.dumps(made) + "\n")
                file.flush()
                if wrongs(row):
                    print(json.dumps(row), flush=True)
        except (InputError, NotSolvedError) as fault:
            parser.error(f"{fault}; {len(tally)} jobs are done, and the same command goes on behind them")
    if options.file == KEPT:
        write_summary(tally)
        KEPT.unlink()  # counted: the next run would count it again
    return 0
