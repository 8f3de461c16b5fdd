"""A plan's motion made faster, geometry and feed together: from where the search begins (joint/) to what is delivered."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.delivery.periods import missed
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.joint.guess import DEFAULT_CUT, Cut, Guess, guess_from
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.parts import FoundRun, parts_of
from planner.joint.refine import divided, reserve_for, searched_again
from planner.joint.run import TubeRun, with_reserve
from planner.joint.solvers import TubeSolver
from planner.joint.splice import Spliced, SplicedRun
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory
from planner.planning.job.by_run import RunsInTime
from planner.planning.job.job import Job
from planner.planning.job.method import Method
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import Search
from planner.sensitivity.found_activity import found_history
from planner.sensitivity.found_prices import found_prices
from planner.sensitivity.records import NO_TABLES, Delivered, GridHistory, Tables

# Times nearer to each other than this share of a leg's mean time are one [-].
LEAST_APART = 1e-6
# What a search in long steps takes, and those that go on from there in shorter and shorter ones, against each other [-].
SEARCHES = (1.0, 1.2, 2.3)
# Share of the time without prices from which that is said, and from which those of the start say more [-].
UNPRICED, UNPRICED_MOST = 0.01, 0.5


def searchable(job: Job) -> bool:
    """Whether the search knows all that the motion has to keep: no filters, no splines of the program, no limits of one's own, no
    range in step with the spindle; and whether the path leaves it anything to find."""
    machine, toolpath = job.real
    return (
        machine.fir is None
        and not machine.own
        and not (toolpath.curve >= 0).any()
        and not toolpath.held.any()
        and not toolpath.exact.all()
    )


class InTwo(NamedTuple):
    """A search in long steps, and from what it finds, if that is all of a run, in shorter and shorter ones; else in the first of
    those from the start."""

    first: TubeOwn
    finer: tuple[tuple[Cut, TubeOwn], ...]


def solver_of(dial: Search, report: Callable[[float], None], *, divide: bool) -> TubeOwn | InTwo:
    """The search as the effort has it; `divide` windows that fail."""
    if not dial.finer:
        return TubeOwn(dial.gap, divide=divide, progress=report)
    ends = np.cumsum([0.0, *SEARCHES[: len(dial.finer) + 1]])
    parts = [_part(report, *own) for own in pairwise((ends / ends[-1]).tolist())]
    return InTwo(
        TubeOwn(dial.gap, divide=False, progress=parts[0]),
        tuple(
            (cut, TubeOwn(gap, divide=divide, progress=part))
            for (cut, gap), part in zip(dial.finer, parts[1:], strict=True)
        ),
    )


def _part(report: Callable[[float], None], begin: float, end: float) -> Callable[[float], None]:
    """Tells the share of the whole, from that of the part between two shares of it."""
    return lambda share: report(begin + share * (end - begin))


class Start(RunsInTime):
    """A motion from which the search begins, and where in it the runs are.

    cut  : how finely it is cut into steps
    plan : of the motion; None for one that is searched from and not delivered
    """

    def __init__(self, motion: MotionInTime, job: Job, cut: Cut = DEFAULT_CUT, plan: Plan | None = None):
        super().__init__(motion, job)
        self.plan, self.cut, self._job = plan, cut, job
        self._guesses: dict[int, Guess] = {}

    def with_reserve(self, run: TubeRun, leg: Array, found: TubeSolution) -> TubeRun:
        """A run whose budgets leave room for the chords of the motion that was found along it, and no more; leg (N,) of its steps."""
        job = self._job
        return with_reserve(run, job.toolpath, job.machine, reserve_for(run, leg, found, job.machine.dt))

    def guess(self, k: int, run: TubeRun) -> Guess:
        """The motion along run k, cut into steps."""
        if k not in self._guesses:
            self._guesses[k] = self.guess_in(k, run, self.cut)
        return self._guesses[k]

    def guess_in(self, k: int, run: TubeRun, cut: Cut) -> Guess:
        """The motion along run k, cut into steps; at the nodes it is exactly what it is there, so that parts of it can stay."""
        guess = guess_from(run, *self.window(k, run), cut)
        inner = self.departure[k] + np.cumsum(guess.h[:-1])
        seen = self.motion.at(inner, 1.0)
        state = guess.state.copy()
        for m, name in enumerate(("position", "velocity", "acceleration")):
            state[1:-1, m] = getattr(seen, name)[:, run.axis]
        return dataclasses.replace(guess, state=state)

    def window(self, k: int, run: TubeRun) -> tuple[Trajectory, FloatArray]:
        """The motion along run k, and when it passes the run's vertices (R+1,) [s]."""
        begin, end = self.departure[k], self.arrival[k + 1]
        inside = np.searchsorted(self.seen.t, [begin, end])
        window = slice(inside[0], inside[1] + 1)
        columns = {name: getattr(self.seen, name)[window] for name in self.seen.columns}
        along = dataclasses.replace(self.seen, **columns)
        t = np.clip(self.times[run.first], begin, end)
        t[[0, -1]] = begin, end
        # Blocks so short that the motion is nearest to both of their ends at the same time share the time of their neighbours.
        apart = LEAST_APART * (end - begin) / len(run)
        seen = np.append(True, np.diff(t) > apart)
        seen[1:] &= t[1:] < end - apart
        seen[-1] = True
        return along, np.interp(run.offset, run.offset[seen], t[seen])


class Starts:
    """The motions of the starting methods, made when they are asked for."""

    def __init__(self, methods: tuple[Method, ...], job: Job):
        self.made: list[Start] = []
        self.failed: list[Plan] = []
        self._methods, self._job = list(methods), job

    def __iter__(self) -> Iterator[Start]:
        yield from list(self.made)
        while self._methods:
            own_clock = dataclasses.replace(self._job, stages=self._job.stages.own_clock(), noted=[])
            plan = self._methods.pop(0).plan_best(own_clock)
            if plan.making is None:
                self.failed.append(plan)
                continue
            self.made.append(Start(plan.making.motion, self._job, plan=plan))
            yield self.made[-1]


def search(k: int, run: TubeRun, starts: Iterable[Start], solver: TubeSolver | InTwo) -> FoundRun:
    """What the search along run k leads to from one start after the other, until it is faster than the first start."""
    least: float = np.inf
    why: list[str] = []
    for start in starts:
        first = not why
        least = start.lasting(k) if first else least
        if run.left:
            why.append(run.left)
            break
        guess = start.guess(k, run)
        if isinstance(solver, InTwo):
            run, guess, solution = _in_two(k, run, start, solver)
        else:
            solution = solver.solve(run, guess)
        steps, kept = solution.steps, solution.kept
        if steps is None:
            why.append(solution.sentence)
            continue
        # parts of another start's motion do not join those of the first one
        other = kept is not None and kept.any() and not first
        if other or (start.plan is not None and steps.h.sum() >= least):
            why.append("the search did not end faster than its start")
            continue
        times = start.departure[k] + np.append(0.0, np.cumsum(guess.h))
        return FoundRun(
            run, solution.status, solution.sentence, steps, solution.place, times, kept, solution.price
        )
    return FoundRun(run, Status.ACCEPTABLE, why[0])


def _in_two(k: int, run: TubeRun, start: Start, solver: InTwo) -> tuple[TubeRun, Guess, TubeSolution]:
    """The run with the budgets that the last of the searches had, the steps from which that began, and its solution."""
    guess = start.guess(k, run)
    found = solver.first.solve(run, guess)
    if found.steps is None or (found.kept is not None and found.kept.any()):
        cut, own = solver.finer[0]
        guess = start.guess_in(k, run, cut)
        return run, guess, own.solve(run, guess)
    for cut, own in solver.finer:
        wider = start.with_reserve(run, guess.leg, found)
        finer = divided(wider, guess.leg, found, cut)
        again = searched_again(wider, found, finer, own)
        if again is not None and again.steps is not None and again.steps.h.sum() <= found.steps.h.sum():
            run, guess, found = wider, finer.guess, again
    return run, guess, found


def delivered(job: Job, first: Start, found: list[FoundRun]) -> tuple[Delivered, list[int], str]:
    """The motions found, and the start's where there are none; on which runs it stays, and why on those where one was found: a
    motion that does not pass its verdict, or becomes slower by its standstills between samples, is not delivered."""
    assert first.plan is not None
    assert first.plan.trajectory is not None
    assert first.plan.verdict is not None
    assert first.plan.making is not None
    start = Delivered(
        first.plan.trajectory, first.plan.verdict, first.plan.making.motion, first.plan.making.slower
    )
    kept, why = [k for k, one in enumerate(found) if one.steps is None], ""
    filtered = job.real[0].fir is not None  # what goes on between two stops is felt behind them
    if filtered and not all(one.whole for one in found):
        kept = list(range(len(found)))
    while len(kept) < len(found):
        parts: list[SplicedRun] = []
        for k, one in enumerate(found):
            own = first.spliced(k)
            parts += [own] if k in kept else parts_of(job.toolpath, one, own)
        motion = Spliced(runs=tuple(parts))
        made = job.deliver(job.behind_filters(motion.whole()) if filtered else motion)
        passed = made.verdict.passed or not start.verdict.passed
        if passed and made.trajectory.cycle_time <= start.trajectory.cycle_time:
            return made, kept, why
        why = "what was found there is slower with its standstills" if passed else str(made.verdict.faults[0])
        missed = set() if filtered else _missed(job, motion, found) - set(kept)
        kept = sorted(missed | set(kept)) if missed else list(range(len(found)))
    return start, kept, why


def tabled(
    job: Job,
    start: Plan | None,
    made: Delivered,
    found: list[FoundRun],
    kept: list[int],
    alone: Mapping[int, GridHistory | None] = MappingProxyType({}),
) -> Tables:
    """What holds the motion that was delivered, and what limits and tolerance cost (sensitivity/found_*.py), of the search where it
    tells: not on the runs in `kept`, of which a note speaks, and not behind filters.

    alone : what held runs that are planned each by itself
    """
    if job.real[0].fir is not None:
        return NO_TABLES
    with job.stage("report"):
        taken = [one for k, one in enumerate(found) if k not in kept]
        prices = found_prices(job.toolpath, job.machine, taken, made.trajectory.cycle_time)
        grid = found_history(job.toolpath, made.motion, found, kept, start.grid if start else None, alone)
    moving = made.trajectory.cycle_time - float(job.toolpath.dwell.sum())
    unpriced = 1.0 - sum(one.priced_time() for one in taken) / moving
    pricing = None
    if prices is None or unpriced > UNPRICED_MOST:
        prices, pricing = (start.prices, start.making and start.making.pricing) if start else (None, None)
        if prices is not None or pricing is not None:
            job.note("what limits cost is told of the motion before geometry and feed were found together")
    elif unpriced > UNPRICED:
        job.note(f"what limits cost leaves out {unpriced:.2g} of the time, on which the motion before stays")
    return Tables(grid=grid, prices=prices, pricing=pricing)


def _missed(job: Job, motion: MotionInTime, found: list[FoundRun]) -> set[int]:
    """The runs on which chords between samples miss vertices by more than the tolerance."""
    machine, toolpath = job.real
    _, far = missed(motion, toolpath, machine.dt)
    over = np.flatnonzero(far > toolpath.tolerance)
    return {
        k for k, one in enumerate(found) if ((over > one.run.first[0]) & (over < one.run.first[-1])).any()
    }


def said(
    job: Job, first: Start, found: list[FoundRun], kept: list[int], why: str, what: str
) -> tuple[Status, str]:
    """Status and sentence: of the worst search, and where the start stays. `what` the start is."""
    took = [one for k, one in enumerate(found) if k not in kept]
    worst = next((one for one in took if one.status is Status.ACCEPTABLE), took[0] if took else None)
    text = worst.sentence if worst else "no motion faster than the start's was found"
    text += f"; its start ({what}) took {first.motion.end:.6g} s"
    if kept:
        run = found[kept[0]].run
        why = why or found[kept[0]].sentence
        text += (
            f" and stays on {len(kept)} of {len(found)} runs between full stops, the first on lines "
            f"{_lines(run, job.toolpath)}: {why}"
        )
    return worst.status if worst and not kept else Status.ACCEPTABLE, text


def _lines(run: TubeRun, toolpath: Toolpath) -> str:
    """The source lines of a run."""
    return f"{toolpath.line[run.first[0]]} to {toolpath.line[run.first[-1] - 1]}"
