"""Method `tube`: path and feed found together within the tolerance, from another method's motion.

What is found is the best motion near the one from which the search starts (joint/rows.py, joint/nlp.py), with
no certificate that there is no better one elsewhere. Where no search ends faster than the start, its motion
stays, run by run and window by window (joint/parts.py): the plan is never slower. `optimal` searches in the
same way; this method has the reference solvers.
"""

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from planner.base.errors import InputError
from planner.base.names import QUICK
from planner.joint.groups import searched
from planner.joint.parts import FoundRun, Spliced, parts_of
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.joint.solvers import TubeSolver, tube_solver
from planner.nc.program import Program
from planner.planning.job.job import Job
from planner.planning.job.plan import Delivered, Plan
from planner.planning.joint_search import OF_THE_START, said, search_run, tabled
from planner.planning.joint_start import Start
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.page import Method, within_tolerance


@dataclass(frozen=True, kw_only=True)
class TubeMethod(Method):
    """The best motion inside the tolerance near that of another method.

    start  : the method whose motion the search starts from, and than which the plan is never slower
    solver : name of the solver, "own", "ipopt" or "fatrop" (joint/solvers.py), or a solver
    """

    start: Method = field(default_factory=lambda: OptimalMethod(effort=QUICK))
    solver: str | TubeSolver = "own"

    @property
    def keeps_power(self) -> bool:
        return True

    def plan_job(self, job: Job) -> Plan:
        solver = tube_solver(self.solver)
        with job.stage("geometry"):
            runs = list(tube_runs_of(job.toolpath, job.machine))
            _check_size(runs, job.program, solver)
        with job.stage("start"):
            first = within_tolerance(job.with_own_clock(), self.start)
        plan = partial(job.plan, method="tube", corner=None, solver=repr(self.solver))
        if first.making is None:
            sentence = f"no motion to start from: {first.sentence}"
            return plan(None, status=first.status, sentence=sentence, grid_points=0)
        start, found = Start(first.making.motion, job, runs), list[FoundRun]()
        with job.stage("solve") as report:
            for k, run in enumerate(runs):
                steps = len(start.guesses[k])
                found += searched([search_run(k, run, start, solver, within=start.lasting(k))], steps)
                report((k + 1) / len(runs))
        made, stays, why = _delivered(job, first, start, found)
        corner = f" with corner {first.corner}" if first.corner else ""
        status, sentence = said(job, start, found, stays, why, f"{first.method}{corner}")
        grid_points = sum(len(one.steps.h) + 1 for one in found if one.steps) or first.grid_points
        tables, notes = tabled(job, first.grid, made, found, stays)
        if tables.prices is None and (first.prices is not None or first.making.priced is not None):
            tables = replace(tables, prices=first.prices, priced=first.making.priced)
            notes = (OF_THE_START,)
        return plan(
            made, status=status, sentence=sentence, grid_points=grid_points, tables=tables, notes=notes
        )


def _delivered(
    job: Job, first: Plan, start: Start, found: list[FoundRun]
) -> tuple[Delivered, list[int], str]:
    """The motions found, and the start's where there are none; on which runs it stays, and why on those where
    one was found: a motion that does not pass its verdict, or becomes slower by its standstills between
    samples, is not delivered."""
    assert first.making is not None
    assert first.trajectory is not None
    assert first.verdict is not None
    stays, why = [k for k, one in enumerate(found) if one.steps is None], ""
    filtered = job.real[0].fir is not None  # what goes on between two stops is felt behind them
    if len(stays) < len(found) and (not filtered or all(one.whole for one in found)):
        parts = [
            [start.spliced(k)] if k in stays else parts_of(job.toolpath, one, start.spliced(k))
            for k, one in enumerate(found)
        ]
        motion = Spliced(runs=tuple(part for of_run in parts for part in of_run))
        made = job.deliver(job.behind_filters(motion.whole()) if filtered else motion)
        passed = made.verdict.passed or not first.verdict.passed
        if passed and made.trajectory.cycle_time <= first.trajectory.cycle_time:
            return made, stays, why
        why = "what was found there is slower with its standstills" if passed else str(made.verdict.faults[0])
    return Delivered(first.trajectory, first.verdict, *first.making[:3]), list(range(len(found))), why


def _check_size(runs: list[TubeRun], program: Program, solver: TubeSolver) -> None:
    """Raise InputError for a job with more legs, or steps on arcs, than the solver takes."""
    legs = sum(float(np.maximum(np.ceil(run.length / run.step_max), 1.0).sum()) for run in runs)
    if legs > solver.legs_max:
        raise InputError(
            f"{legs:.0f} lines and steps on arcs; this solver takes at most {solver.legs_max:g}: plan with the solver own, or with "
            "method optimal",
            source=program.source,
        )
