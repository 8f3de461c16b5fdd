"""The joint search of a job, run by run: from a motion on a path to path and feed found together.

A run is what lies between two full stops. Runs are searched side by side, long ones first, their windows in
groups (joint/groups.py); what is found does not depend on that, nor on the number of threads. The motion
from which the search begins may keep its limits at the points of a coarse grid only: where the search leaves
no step of it nothing else is asked of it, and a run on which the search does not end, or that is not
searched (G61, threads), is planned by itself in another way (runs_alone.py). Or it keeps them everywhere:
then it stays where the search does not end.
"""

import dataclasses
from collections.abc import Callable, Container, Mapping
from functools import partial
from itertools import accumulate, pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array
from planner.corners.budget import filters_count
from planner.feedrate.solution import Status
from planner.joint.groups import Search as Searching
from planner.joint.groups import searched
from planner.joint.guess import Cut, Guess
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.parts import FoundRun, SplicedRun, parts_of
from planner.joint.refine import divided, searched_again
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.joint.solvers import TubeSolver, search_with
from planner.motion.slowed import times_of_pieces
from planner.motion.timing import Motion
from planner.planning.job.by_run import RunsInTime, full_stops
from planner.planning.job.job import Job
from planner.planning.job.plan import NO_TABLES, Delivered, Plan, Tables
from planner.planning.job.runs_alone import ALONE_MOST, Alone, with_runs_alone
from planner.planning.joint_start import Start, between_leads, with_leads
from planner.planning.optimal.effort import Search, Settings
from planner.planning.optimal.notes import noted, path_notes
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.path_motion import priced
from planner.sensitivity.activity import history
from planner.sensitivity.found_activity import found_history
from planner.sensitivity.found_prices import found_prices
from planner.sensitivity.records import GridHistory

# What a search in long steps takes, and those in shorter and shorter ones, against each other [-].
SEARCHES = (1.0, 1.2, 2.3)
# Share of the time without prices from which that is said, and from which there are none [-].
UNPRICED, UNPRICED_MOST = 0.01, 0.5
OF_THE_START = "what limits cost is told of the motion before geometry and feed were found together"

Report = Callable[[float], None]


class Others(NamedTuple):
    """What there is of runs that are not searched, or not found.

    alone : plans one of them, as a job
    kept  : the motion of the whole job on a path, its limits kept everywhere, for as many as are not planned
            each by itself; None where there is none. What is asked for once more is not planned again
    """

    alone: Callable[[Job], Plan]
    kept: Callable[[Job], tuple[OnPath, Motion] | None]


class Joint(NamedTuple):
    """How the joint search of a job ends.

    plan   : None where it does not pass or is not searched
    steps  : of the motion
    slower : where there is no plan, that of the motion which passes when it is run slower in places; else None
    """

    plan: Plan | None
    steps: int
    slower: Plan | None = None


def searchable(job: Job, *, jerk_limited: bool) -> bool:
    """Whether the search knows all that the motion has to keep: no limits that it does not keep, no thread
    behind filters; and whether there is a run to be searched. Limits of the user whose bounds change are
    left to the motion on a path where no jerk is limited: that jumps from one bound to the next at once, and steps need their
    time."""
    machine, toolpath = job.real
    own = all(
        getattr(limit, "searched", True) and (jerk_limited or getattr(limit, "constant", False))
        for limit in machine.own
    )
    if not own or (machine.fir is not None and toolpath.held.any()):
        return False
    left = np.logical_or.reduceat(toolpath.exact | toolpath.held, full_stops(toolpath)[:-1])
    return not bool(left.all())


def joint_plan(
    job: Job,
    settings: Settings,
    planned: list[OnPath],
    search: Search,
    others: Others,
    motion: Motion | None = None,
) -> Joint:
    """The plan of the joint search from a motion on a path.

    planned : that motion alone, which is taken out: of one that does not stay nothing but its notes is kept meanwhile
    search  : how finely, and up to which size
    others  : what there is where the search does not end, or the verdict finds something
    motion  : that on the path with its limits kept: it stays where the search does not end; else None
    """
    stays, led = motion is not None, with_leads(job)
    with job.stage("search") as report:
        runs = list(tube_runs_of(job.toolpath, job.machine, jerk_limited=settings.order.jerk_limited))
        path = planned.pop()
        start = Start(motion or between_leads(path.motion(), job, led), job, runs, search.cut)
        at_joints, solver = noted(led.toolpath, path), path.solution.solver
        kept_path = (path, motion) if motion else None
        del path
        steps = sum(map(len, start.guesses.values()))
        if steps > search.steps_max:
            job.tell("search", steps=steps, of=search.steps_max)
            return Joint(None, steps)
        search = search.of(steps)
        if not search.finer:
            start.forget(stays=stays)
        found = searched_runs(runs, start, search, report, stays=stays)
        start.forget(stays=stays)
    made, looked = None, found
    while looked and (made is None or made.delivered.slower):
        if any(one.whole or (stays and one.steps) for one in looked):
            parts = [_parts(job, one, start.spliced(k) if stays else None) for k, one in enumerate(looked)]
            other = with_runs_alone(
                job,
                parts,
                others.alone,
                ALONE_MOST if led is job else 0,
                settings.not_limited,
                kept=lambda: (
                    None if led is not job or (path := others.kept(job)) is None else RunsInTime(path[1], job)
                ),
            )
            if other is not None and (made is None or _time(other) < _time(made)):
                made, found = other, looked
        # shorter steps find what the verdict refuses where longer ones did not: more effort takes no more time
        coarser = any(one.coarser for one in looked)
        looked = [one.coarser or one for one in looked] if coarser else []
    slower = made.delivered.slower if made else None
    time = made.delivered.trajectory.cycle_time if made and not slower else np.nan
    count, kept = len(made.plans) if made else 0, made is not None and slower is None
    job.tell("search", found=time, before=start.end, kept=kept, steps=steps, alone=count)
    if made is None:
        return Joint(None, steps)
    delivered = slower or made.delivered
    for k in (*made.plans, *made.stays):
        why = found[k].sentence if not found[k].whole else "what was found there does not pass its verdict"
        found[k] = FoundRun(found[k].run, Status.ACCEPTABLE, why)
    left = [k for k, one in enumerate(found) if one.steps is None]
    if len(left) == len(found) and not made.plans:  # the motion is the start's, which others deliver
        return Joint(None, steps)
    status, sentence = said(job, start, found, left, "", "a path first, then its feed")
    stayed = others.kept(job) if made.stays else kept_path
    held = history(stayed[0].problem, stayed[0].solution, *times_of_pieces(stayed[1])) if stayed else None
    alone_held = {k: plan.grid for k, plan in made.plans.items()}
    tables, notes = tabled(job, held, delivered, found, left, alone_held)
    if tables.prices is None and kept_path and priced(kept_path[0], job.machine):
        tables = dataclasses.replace(tables, priced=kept_path[0])
        notes = (OF_THE_START,)
    of_path = path_notes(led.toolpath, at_joints, _stays(led, found, made.plans))
    plan = job.plan(
        delivered._replace(filtered=filters_count(*job.real)),
        method=settings.method,
        corner=settings.corner_name,
        solver=solver,
        status=status,
        sentence=sentence,
        grid_points=sum(len(one.steps.h) + 1 for one in found if one.steps is not None),
        tables=tables,
        notes=(*made.notes, *(of_path if led is job else ()), *notes),
    )
    return Joint(plan, steps) if slower is None else Joint(None, steps, slower=plan)


def _without(found: list[FoundRun], stays: list[int]) -> list[FoundRun]:
    """The runs but for those in `stays`."""
    left = set(stays)
    return [one for k, one in enumerate(found) if k not in left]


def _time(made: Alone) -> float:
    return (made.delivered.slower or made.delivered).trajectory.cycle_time


def _parts(job: Job, found: FoundRun, start: SplicedRun | None) -> list[SplicedRun] | None:
    """The parts of the motion along a run; None where it has to be planned by itself; start: as of `parts_of`."""
    if found.whole or (start is not None and found.steps is not None):
        return parts_of(job.toolpath, found, start)
    return None if start is None else [start]


def _stays(job: Job, found: list[FoundRun], alone: Container[int]) -> Array:
    """(M+1,) the joints of the runs on which something of the motion on the path is delivered."""
    at = np.zeros(len(job.toolpath) + 1, bool)
    for k, one in enumerate(found):
        if not one.whole and k not in alone:
            at[one.run.first] = True
    return at


class InTwo(NamedTuple):
    """A search in long steps, and from what it finds, if that is all of a run, in shorter and shorter ones; else in the
    first of the shorter ones from the start."""

    first: TubeOwn
    finer: tuple[tuple[Cut, TubeOwn], ...]


def solver_of(search: Search, report: Report, *, stays: bool) -> TubeOwn | InTwo:
    """The solver as the effort has it."""
    own = partial(TubeOwn, smooth=search.smooth)
    if stays and not search.finer:
        return own(search.gap, progress=report)
    ends = list(accumulate((0.0, *SEARCHES[: len(search.finer) + 1])))
    parts = pairwise(end / ends[-1] for end in ends)
    shares = [lambda done, a=a, b=b: report(a + done * (b - a)) for a, b in parts]
    return InTwo(
        own(search.gap, stays=False, progress=shares[0]),
        tuple(
            (cut, own(gap, stays=stays, progress=share))
            for (cut, gap), share in zip(search.finer, shares[1:], strict=True)
        ),
    )


def searched_runs(
    runs: list[TubeRun], start: Start, search: Search, report: Report, *, stays: bool
) -> list[FoundRun]:
    """The solution on each run."""
    size = np.array([len(start.guesses[k]) for k in range(len(runs))])
    order, done = np.argsort(-size, kind="stable").tolist(), np.zeros(len(runs))  # shares

    def one(k: int) -> Searching[FoundRun]:
        solver = solver_of(search, partial(done.__setitem__, k), stays=stays)
        within = start.lasting(k) if stays else np.inf
        found = yield from search_run(k, runs[k], start, solver, within)
        done[k] = 1.0
        return found

    found = searched(map(one, order), int(size.sum()), lambda: report(float(done @ size) / size.sum()))
    return [found[k] for k in np.argsort(order).tolist()]


def search_run(
    k: int, run: TubeRun, start: Start, solver: TubeSolver | InTwo, within: float = np.inf
) -> Searching[FoundRun]:
    """The solution of the search along run k; of no use if it takes as long as `within` [s]."""
    if run.left:
        return FoundRun(run, Status.ACCEPTABLE, run.left)
    if isinstance(solver, InTwo):
        taken = yield from _in_two(k, run, start, solver)
    else:
        guess = start.guesses.pop(k)
        taken = [(guess, (yield from search_with(solver, run, guess)))]
    found = FoundRun(run, Status.ACCEPTABLE, taken[-1][1].sentence)
    for guess, solution in taken:
        steps = solution.steps
        if steps is None:
            continue
        if steps.h.sum() >= within:
            found = FoundRun(run, Status.ACCEPTABLE, "the search did not end faster than its start")
            continue
        times = start.departure[k] + np.append(0.0, np.cumsum(guess.h))
        of_steps = solution.place, times, solution.kept, solution.price
        coarser = None if found.steps is None else found
        found = FoundRun(run, solution.status, solution.sentence, steps, *of_steps, coarser)
    return found


def _in_two(k: int, run: TubeRun, start: Start, solver: InTwo) -> Searching[list[tuple[Guess, TubeSolution]]]:
    """The steps from which each search began whose motion was taken, and its solution, the last one in the shortest steps."""
    guess = start.guesses.pop(k)
    found = yield from solver.first.search(run, guess)
    if found.steps is None or (found.kept is not None and found.kept.any()):
        if not solver.finer:
            return [(guess, found)]
        cut, own = solver.finer[0]
        (guess,) = start.cut(k, [run], cut)
        return [(guess, (yield from own.search(run, guess)))]
    taken = [(guess, found)]
    for cut, own in solver.finer:
        finer = divided(run, guess.leg, found, cut)
        again = yield from searched_again(run, found, finer, own)
        if again is None or again.steps is None:
            continue
        if own.smooth or again.steps.h.sum() <= found.steps.h.sum():
            guess, found = finer.guess, again
            taken.append((guess, found))
    return taken


def tabled(
    job: Job,
    start: GridHistory | None,
    made: Delivered,
    found: list[FoundRun],
    stays: list[int],
    alone: Mapping[int, GridHistory | None] = MappingProxyType({}),
) -> tuple[Tables, tuple[str, ...]]:
    """The active limits of the delivered motion, and the prices of limits and tolerance
    (sensitivity/found_*.py), of the search where it tells: not on the runs in `stays`, of which a note
    speaks, and not behind filters.

    start : what holds the motion that stays there
    alone : what holds runs that are planned each by itself
    """
    if job.real[0].fir is not None:
        return NO_TABLES, ()
    with job.stage("report"):
        taken = _without(found, stays)
        prices = found_prices(job.toolpath, job.machine, taken, made.trajectory.cycle_time)
        grid = found_history(job.toolpath, made.motion, found, stays, start, alone)
    moving = made.trajectory.cycle_time - float(job.toolpath.dwell.sum())
    unpriced = 1.0 - sum(one.priced_time() for one in taken) / moving
    if prices is None or unpriced > UNPRICED_MOST:
        return Tables(grid=grid), ()
    note = f"what limits cost leaves out {unpriced:.2g} of the time, on which the motion before stays"
    return Tables(grid=grid, prices=prices), (note,) if unpriced > UNPRICED else ()


def said(
    job: Job, first: Start, found: list[FoundRun], stays: list[int], why: str, what: str
) -> tuple[Status, str]:
    """Status and sentence: of the worst search, and where the start stays. `what` the start is."""
    took = _without(found, stays)
    worst = next((one for one in took if one.status is Status.ACCEPTABLE), took[0] if took else None)
    text = worst.sentence if worst else "no motion faster than the start's was found"
    text += f"; before that ({what}) {first.end:.6g} s"
    if stays:
        run, line = found[stays[0]].run, job.toolpath.line
        why = why or found[stays[0]].sentence
        text += (
            f" and stays on {len(stays)} of {len(found)} runs between full stops, the first on lines "
            f"{line[run.first[0]]} to {line[run.first[-1] - 1]}: {why}"
        )
    return worst.status if worst and not stays else Status.ACCEPTABLE, text
