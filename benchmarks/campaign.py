"""Thousands of random jobs, planned, judged twice, and held against laws: what goes wrong?

    python -m benchmarks campaign [--count N] [--seed S] [--processes P] [--again SEED ...] [--seconds T] [--limit C]

A job follows from its seed (campaign_jobs.py): program, machine, tolerance, period, method. Its plan is judged by the planner's
verifier and by another judge that shares no code with the package (campaign_judge.py); every tenth job is planned once more,
changed by a law (campaign_laws.py). Each job has C processor seconds in a child process, which is ended if they do not suffice.

Every job is a row of results/campaign.jsonl at once, and counted in results/campaign.json at the end (campaign_tally.py), with a
summary in campaign.md. Jobs that are in one of them are not planned again; --again plans what is not as it should be.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign_course import Blocks, course
from benchmarks.campaign_jobs import Job, job
from benchmarks.campaign_judge import Motion, faults
from benchmarks.campaign_laws import broken, changed
from benchmarks.campaign_table import write_summary
from benchmarks.campaign_tally import (
    CRASH,
    DOCUMENTED,
    FAILED,
    PASSED,
    REFUSED,
    TOO_LONG,
    UNSOLVED,
    Tally,
    wrongs,
)
from benchmarks.record import RESULTS, provenance
from planner.base.errors import InputError
from planner.base.threads import use_threads
from planner.feedrate.solution import Status
from planner.job.plan import Plan
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.methods.registry import plan
from planner.nc.program import Kind, Program

KEPT, SUMMARY = RESULTS / "campaign.jsonl", RESULTS / "campaign.json"
LIMIT = 10.0  # of a job, its law included [CPU s]
WALL = 10.0  # times that, until a job is ended that takes no processor time
LAW_EVERY = 10  # jobs
NO_JERK_LIMIT = ("second-order",)
Row = dict[str, Any]


def outcome(seed: int) -> Row:
    """The row of the job of a seed. Nothing that drawing and planning raise is raised here."""
    began = time.process_time()
    try:
        row = row_of(job(seed))
    except Exception as fault:
        row = {"seed": seed} | _crash(fault)
    return row | {"cpu": round(time.process_time() - began, 3)}


def row_of(made: Job) -> Row:
    """The row of a job. Nothing that planning raises is raised here."""
    try:
        return _about(made) | _planned(made)
    except Exception as fault:
        return _about(made) | _crash(fault)


def _crash(fault: Exception) -> Row:
    at = traceback.extract_tb(fault.__traceback__)[-1]
    return {
        "outcome": CRASH,
        "said": f"{type(fault).__name__}: {fault} ({Path(at.filename).name}:{at.lineno})",
    }


def _about(made: Job) -> Row:
    machine = made.machine
    return {
        "seed": made.seed,
        "source": made.source,
        "way": made.way,
        "blocks": 0 if made.program is None else len(made.program),
        "axes": "".join(machine.axes),
        "dt": float(f"{machine.dt:.4g}"),
        "tolerance": float(f"{made.tolerance or machine.tolerance:.4g}"),
        "filters": 0 if machine.fir is None else len(machine.fir.time_constants),
        "modes": len(machine.modes),
    }


def _planned(made: Job) -> Row:
    if made.program is None:
        return {"outcome": REFUSED, "said": made.refusal}
    try:
        found = plan(
            made.program, made.machine, method=made.method, tolerance=made.tolerance, **made.settings
        )
    except InputError as fault:
        return {"outcome": REFUSED, "said": str(fault)}
    if found.trajectory is None or found.verdict is None:
        return {"outcome": UNSOLVED, "status": found.status.name, "said": found.sentence}
    second = second_verdict(found, made.tolerance)
    row: Row = {
        "outcome": PASSED if found.verdict.passed else FAILED,
        "status": found.status.name,
        "time": found.cycle_time,
        "samples": len(found.trajectory),
        "said": found.verdict.faults[0] if found.verdict.faults else "",
        "second": second,
    }
    if not found.verdict.passed and (why := documented(made, found.verdict.faults)):
        row |= {"outcome": DOCUMENTED, "why": why}
    return row | (_law(made, found) if made.seed % LAW_EVERY == 0 and found.verdict.passed else {})


def documented(made: Job, said: tuple[str, ...]) -> str:
    """Why docs/methods.md says that a method's verdict fails with these faults; empty where it does not."""
    if made.method.endswith("-plain"):
        return "methods as their papers describe them"
    assert made.program is not None
    under_g61 = (
        made.method in ("fir", "fir-spline")
        or "shaped" in made.settings
        or (made.method == "kinematic" and len(made.program.splines))
    )
    only = all(fault.startswith("exact path") for fault in said)
    return "chords within the tolerance under G61" if under_g61 and only else ""


def _law(made: Job, found: Plan) -> Row:
    assert made.program is not None
    rng = np.random.default_rng([43, made.seed])
    other = changed(made.program, made.machine, made.tolerance, rng)
    if other is None or (other.law == "split" and made.method == "stop"):  # which stops there
        return {}
    try:
        after = plan(
            other.program, other.machine, method=made.method, tolerance=other.tolerance, **made.settings
        )
    except InputError as fault:
        return {"law": other.law, "law_said": f"refused: {fault}"}
    if after.trajectory is None or after.verdict is None or not after.verdict.passed:
        said = after.sentence if after.verdict is None else after.verdict.faults[0]
        return {"law": other.law, "law_said": f"{after.status.name}: {said}"}
    stops = 1 + int(np.isin(made.program.kind, (Kind.STOP, Kind.DWELL, Kind.RAPID)).sum())
    slack = made.machine.dt * (
        stops if found.status in (Status.OPTIMAL, Status.ACCEPTABLE) else len(made.program)
    )
    return {
        "law": other.law,
        "law_time": after.cycle_time,
        "law_broken": broken(other, found.cycle_time, after.cycle_time, slack),
        "law_second": second_verdict(after, other.tolerance),
    }


def second_verdict(found: Plan, tolerance: float | None = None) -> list[str]:
    """What the second judge finds wrong with a plan's samples."""
    assert found.trajectory is not None
    axes = found.trajectory.axes
    asked = course(blocks_of(found.program, found.machine, axes, tolerance))
    return faults(motion_of(found), asked)


def motion_of(found: Plan) -> Motion:
    """The samples and limits of a plan, as arrays."""
    trajectory, machine = found.trajectory, found.machine
    assert trajectory is not None
    axes = trajectory.axes
    limits = np.array([machine.limits(name, axes) for name in ("velocity", "acceleration", "jerk")])
    if found.method in NO_JERK_LIMIT:
        limits[2] = np.inf
    return Motion(
        t=np.array(trajectory.t),
        q=np.array(trajectory.position),
        dt=machine.dt,
        limits=limits,
        linear=np.isin(axes, LINEAR_AXES),
        normal_acceleration=machine.normal_acceleration or np.inf,
        filters=machine.fir.time_constants if machine.fir is not None else (),
    )


def blocks_of(program: Program, machine: Machine, axes: tuple[str, ...], tolerance: float | None) -> Blocks:
    """A program as arrays, for the axes of its motion."""
    of = [program.axes.index(letter) for letter in axes]
    rotary = np.isin(axes, ROTARY_AXES)
    scale = np.where(rotary, machine.radius, 1.0)
    allowed = np.where(np.isnan(program.tolerance), machine.tolerance, program.tolerance)
    return Blocks(
        kind=program.kind,
        start=program.start[of] * scale,
        end=program.end[:, of] * scale,
        feed=program.feed,
        dwell=program.dwell,
        control=program.path_control,
        tolerance=allowed if tolerance is None else np.full(len(program), tolerance),
        arc_block=program.arc_block,
        arc_center=program.arc_center,
        arc_normal=program.arc_normal,
        arc_sweep=program.arc_sweep,
        spline_block=program.splines.block,
        spline_points=program.splines.points[:, :, of] * scale,
        spline_weights=program.splines.weights,
        linear=np.isin(axes, LINEAR_AXES),
        rotary=rotary,
        radius=machine.radius,
        feed_max=machine.feed_max or np.inf,
        blend_rapids=machine.blend_rapids,
    )


# ---- processes ---------------------------------------------------------------------------------------------------------------


@dataclass
class Worker:
    """A process that plans jobs, and the one it has now."""

    process: Any
    ends: Connection
    seed: int = -1
    began: float = 0.0
    before: float = 0.0

    @classmethod
    def started(cls) -> Worker:
        here, there = multiprocessing.Pipe()
        process = multiprocessing.get_context("spawn").Process(target=_serve, args=(there,), daemon=True)
        process.start()
        there.close()
        return cls(process, here)

    def give(self, seed: int) -> None:
        self.seed, self.began, self.before = seed, time.monotonic(), 0.0
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
        late = self.used() > limit or time.monotonic() - self.began > WALL * limit
        if not late and self.ends.poll():
            try:
                return dict(self.ends.recv())
            except EOFError:
                self.process.join()
                return {"seed": self.seed, "outcome": CRASH, "said": f"died with {self.process.exitcode}"}
        if not late:
            return None
        self.process.kill()
        self.process.join()
        try:
            about = _about(job(self.seed))
        except Exception:  # what cannot be drawn is named by its seed
            about = {"seed": self.seed}
        return about | {"outcome": TOO_LONG, "said": f"more than {limit:g} CPU s", "cpu": limit}


def _serve(ends: Connection) -> None:
    use_threads(1)
    while True:
        try:
            seed = ends.recv()
        except EOFError:
            return
        ends.send(outcome(seed))


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


def kept_rows(file: Path = KEPT) -> dict[int, Row]:
    """The rows of earlier runs by seed; the last one of each counts."""
    if not file.exists():
        return {}
    rows = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines() if line.endswith("}")]
    return {row["seed"]: row for row in rows}


def main(argv: list[str] | None = None) -> int:
    """Run what is not there, and write the summary. The exit code is 0, whatever was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks campaign", description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first job")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--again", type=int, nargs="*", help="these jobs, or all that failed, once more")
    parser.add_argument("--seconds", type=float, default=np.inf, help="begin no job after so many")
    parser.add_argument("--limit", type=float, default=LIMIT, help="CPU s of a job")
    parser.add_argument("--file", type=Path, default=KEPT)
    parser.add_argument("--show", type=int, metavar="SEED", help="print this job as JSON, and do no more")
    options = parser.parse_args(argv)
    if options.show is not None:
        print(json.dumps(job(options.show).data(), indent=1))
        return 0
    tally = Tally.read(SUMMARY) if options.file == KEPT else Tally()
    tally.add(kept_rows(options.file).values())
    seeds = [seed for seed in range(options.seed, options.seed + options.count) if seed not in tally]
    if options.again is not None:
        seeds = options.again or list(tally.wrong)
    commit = provenance()["commit"]
    options.file.parent.mkdir(exist_ok=True)
    with options.file.open("a", encoding="utf-8") as file:
        for row in rows_of(seeds, options.processes, options.seconds, options.limit):
            made = row | {"commit": commit}
            tally.add([made])
            file.write(json.dumps(made) + "\n")
            file.flush()
            if wrongs(row):
                print(json.dumps(row), flush=True)
    if options.file == KEPT:
        write_summary(tally)
    return 0
