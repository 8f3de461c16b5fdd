"""One pair of job and way, measured in this process.

warm-up       two small jobs by the same way load kernels and packages
repeats       at most `repeats` calls, no further one after `ENOUGH` processor seconds
processor     seconds of this process and of children it has waited for (getrusage), the least of the repeats
quiet         a fixed loop before and after the calls, over the fastest one that this process has seen
limit         processor seconds of a single call; a call above it is ended (SIGPROF) and its row says so. Compiled code that does not
              come back for `NATIVE` times the limit and `LATE` more ends with its process (SIGVTALRM). RLIMIT_CPU is of no use here:
              it counts ticks, which can differ from the time that a process knows of itself by half, from its start on
"""

from __future__ import annotations

import dataclasses
import resource
import signal
import time
from dataclasses import dataclass, field
from types import FrameType

import numpy as np

from benchmarks.jobs import problems
from benchmarks.runner import nasty
from benchmarks.runner.judged import Judged, NotApplicable, NotHere
from benchmarks.runner.rows import (
    ERROR,
    FAILED,
    NOT_APPLICABLE,
    NOT_SOLVED,
    OVER_LIMIT,
    PASSED,
    SKIPPED,
    SOLVED,
    Row,
)
from benchmarks.runner.suites import SUITES, Job
from benchmarks.runner.ways import Made, Way
from planner.base.errors import InputError, NotSolvedError
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.report.compare import row_of_plan
from planner.sensitivity.activity import NONE, REST
from planner.sensitivity.records import GridHistory
from planner.verifier import Verdict

REPEATS, ENOUGH = 3, 2.0  # calls, and the processor seconds after which none follows [s]
LOOP = 60_000  # turns of the calibration loop: some 5 ms
LOOPS = 5  # of which the fastest counts on either side of a measure
NATIVE, LATE = 1.5, 1.0  # of the limit, and seconds, after which the process is ended [-], [s]
FIRST_LOOPS = 40  # at the start, to know what a quiet core does


class OverTheLimit(BaseException):
    """The call has used the processor time that it was given; no handler of errors stops it on its way."""


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """How a pair is measured.

    repeats : calls at most
    limit   : of one call [CPU s]; None for no limit
    """

    repeats: int = REPEATS
    limit: float | None = None


@dataclass
class Calibration:
    """The fixed loop: how fast it was at best in this process [s]."""

    best: float = field(default_factory=lambda: min(_loop() for _ in range(FIRST_LOOPS)))

    def seconds(self) -> float:
        """The loop now [s]."""
        now = min(_loop() for _ in range(LOOPS))
        self.best = min(self.best, now)
        return now


def _loop() -> float:
    began = time.perf_counter()
    total = 0
    for k in range(LOOP):
        total += k & 7
    return time.perf_counter() - began


def processor_seconds() -> float:
    """Of this process and of the children it has waited for [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def warm_up(way: Way) -> None:
    """Small jobs by a way, so that kernels and packages are loaded; what becomes of them says nothing."""
    for program in (problems.pentagon(), parse_program(nasty.LINES_AND_ARCS)):
        _called(way, Job(name="warm-up", program=lambda machine, program=program: program))


def measured(way: Way, job: Job, blank: Row, protocol: Protocol, calibration: Calibration) -> Row:
    """The row of a pair; `blank` names it. Whatever is raised is the row's status and message."""
    before = calibration.seconds()
    calls: list[tuple[float, float]] = []
    row = blank
    while len(calls) < protocol.repeats and sum(cpu for cpu, _ in calls) < ENOUGH:
        cpu, wall = processor_seconds(), time.perf_counter()
        row = _limited(way, job, blank, protocol.limit)
        calls.append((processor_seconds() - cpu, time.perf_counter() - wall))
        if row.status != SOLVED:
            break
    quiet = max(before, calibration.seconds()) / calibration.best
    least = min(calls)
    return dataclasses.replace(
        row,
        cpu_s=_digits(least[0]),
        wall_s=_digits(least[1]),
        cpu_all=tuple(_digits(cpu) for cpu, _ in calls),
        quiet=round(quiet, 3),
    )


def outcome(way: Way, job: Job, blank: Row) -> Row:
    """The row of a pair without its times."""
    found, blocks = _called(way, job)
    if isinstance(found, Exception):
        return dataclasses.replace(_of_fault(found, blank), blocks=blocks)
    return dataclasses.replace(_of_made(found, blank), blocks=blocks)


def _limited(way: Way, job: Job, blank: Row, limit: float | None) -> Row:
    """`outcome` with a limit of processor time, in the main thread."""
    if limit is None:
        return outcome(way, job, blank)
    was = signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, NATIVE * limit + LATE)
    signal.setitimer(signal.ITIMER_PROF, limit, 1.0)
    try:
        try:
            return outcome(way, job, blank)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
    except OverTheLimit:  # from within the call, or on its way to the timer's end
        return dataclasses.replace(blank, status=OVER_LIMIT, message=f"more than {limit:g} CPU s")
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGPROF, was)


def _stop(number: int, frame: FrameType | None) -> None:
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    raise OverTheLimit("over the limit of processor time")


def _called(way: Way, job: Job) -> tuple[Made | Exception, int | None]:
    """What a way makes of a job, or what it raises; and the number of blocks, if the program could be made."""
    blocks = None
    try:
        machine = job.machine()
        program = job.program(machine)
        blocks = len(program)
        return way.plan(program, machine, job.tolerance), blocks
    except Exception as fault:  # whatever a peer or a method raises is what the row is about
        return fault, blocks


def _of_fault(fault: Exception, blank: Row) -> Row:
    kinds = {
        NotHere: SKIPPED,
        NotApplicable: NOT_APPLICABLE,
        InputError: NOT_APPLICABLE,
        NotSolvedError: NOT_SOLVED,
    }
    status = next((status for kind, status in kinds.items() if isinstance(fault, kind)), ERROR)
    said = " ".join(str(fault).split())
    return dataclasses.replace(
        blank, status=status, message=f"{type(fault).__name__}: {said}" if status == ERROR else said
    )


def _of_made(found: Made, blank: Row) -> Row:
    if isinstance(found, Plan):
        return _of_plan(found, blank)
    if isinstance(found, Judged):
        row = dataclasses.replace(blank, status=SOLVED, cycle_s=found.cycle_s, free=found.free)
        return _judged(found.verdict, row)
    return dataclasses.replace(blank, status=SOLVED, cycle_s=found, message="a time only, no motion to judge")


def _of_plan(plan: Plan, blank: Row) -> Row:
    row = dataclasses.replace(blank, points=plan.grid_points, message=plan.sentence)
    if plan.trajectory is None or plan.verdict is None:
        return dataclasses.replace(row, status=NOT_SOLVED)
    row = dataclasses.replace(
        row, status=SOLVED, cycle_s=plan.trajectory.cycle_time, free=row_of_plan(plan.method, plan).free
    )
    if row.suite in SUITES and SUITES[row.suite].merits:
        row = dataclasses.replace(row, bound_s=plan.least_time, active=_active(plan.grid))
    return _judged(plan.verdict, row)


def _active(history: GridHistory | None) -> float | None:
    """Share of the time in which something is active (Liang et al. 2022's saturation of constraints) [-]."""
    if history is None:
        return None
    share = dict(zip(history.active_names, history.share, strict=True))
    return round(1.0 - float(share[NONE] + share[REST]), 6)


def _judged(verdict: Verdict, row: Row) -> Row:
    ratios = [check.ratio for check in verdict.limits.values() if check.limited and np.isfinite(check.ratio)]
    errors = [check.ratio for check in (verdict.contour, verdict.vertex) if np.isfinite(check.ratio)]
    return dataclasses.replace(
        row,
        verdict=PASSED if verdict.passed else FAILED,
        message=row.message if verdict.passed else verdict.sentences[0],
        excess=round(max(ratios, default=0.0), 9),
        error=round(max(errors, default=0.0), 9),
    )


def _digits(seconds: float) -> float:
    """Six significant digits are more than a clock has."""
    return float(f"{seconds:.6g}")
