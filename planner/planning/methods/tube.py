"""Method `tube`: geometry and feed found together, anywhere inside the tolerance.

All other methods round the path first and then find the feed. Here the motion of the axes itself is what is sought (joint/rows.py,
joint/nlp.py), so nothing is given away between the two. What is found is the best motion near the one from which the search starts,
with no certificate that there is no better one elsewhere.

1. The path is divided into runs between full stops; each is a problem of its own (joint/run.py).
2. Methods of `starts` make motions from which the search begins (joint/guess.py): the first one's, and where that does not lead to a
   faster one the next one's.
3. A solver finds the motion: the own one window by window (joint/own.py), ipopt and fatrop a whole run at a time.
4. Where no search ends faster than the first start, its motion stays, run by run and window by window (joint/parts.py): the plan is
   never slower.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.base.errors import InputError
from planner.base.names import QUICK
from planner.feedrate.solution import Status
from planner.joint.parts import FoundRun
from planner.joint.run import TubeRun, tube_runs_of
from planner.joint.solvers import TubeSolver, tube_solver
from planner.nc.program import Program
from planner.planning.job.job import Job
from planner.planning.job.method import Method
from planner.planning.job.plan import Plan
from planner.planning.methods.free import Starts, delivered, said, search, tabled
from planner.planning.methods.optimal import OptimalMethod
from planner.sensitivity.records import NO_TABLES, Delivered, Tables


@dataclass(frozen=True, kw_only=True)
class TubeMethod(Method):
    """The best motion inside the tolerance near those of other methods.

    starts : methods whose motions the search starts from; the first one's is what the plan is never slower than
    solver : name of the solver, "own", "ipopt" or "fatrop" (joint/solvers.py), or a solver
    """

    starts: tuple[Method, ...] = field(
        default_factory=lambda: (OptimalMethod(effort=QUICK), OptimalMethod(corner="bezier"))
    )
    solver: str | TubeSolver = "own"

    def plan_job(self, job: Job) -> Plan:
        with job.stage("geometry"):
            runs = list(tube_runs_of(job.toolpath, job.machine))
            _check_size(runs, job.program, tube_solver(self.solver))
        with job.stage("start"):
            starts = Starts(self.starts, job)
            first = next(iter(starts), None)
        found: list[FoundRun] = []
        with job.stage("solve") as report:
            for k, run in enumerate(runs if first else ()):
                found.append(search(k, run, starts, tube_solver(self.solver)))
                report((k + 1) / len(runs))
        if first is None:
            failed = starts.failed[0]
            return self._plan(job, None, failed.status, f"no motion to start from: {failed.sentence}", 0)
        assert first.plan is not None
        made, kept, why = delivered(job, first, found)
        corner = f" with corner {first.plan.corner}" if first.plan.corner else ""
        status, sentence = said(job, first, found, kept, why, f"{first.plan.method}{corner}")
        grid_points = sum(len(one.steps.h) + 1 for one in found if one.steps) or first.plan.grid_points
        tables = tabled(job, first.plan, made, found, kept)
        return self._plan(job, made, status, sentence, grid_points, tables)

    def _plan(
        self,
        job: Job,
        made: Delivered | None,
        status: Status,
        sentence: str,
        grid_points: int,
        tables: Tables = NO_TABLES,
    ) -> Plan:
        """The plan of this method with what was delivered."""
        return job.plan(
            made,
            method="tube",
            corner=None,
            solver=repr(self.solver),
            status=status,
            sentence=sentence,
            grid_points=grid_points,
            tables=tables,
        )


def _check_size(runs: list[TubeRun], program: Program, solver: TubeSolver) -> None:
    """Raise InputError for a job with more legs, or steps on arcs, than the solver takes."""
    legs = sum(float(np.maximum(np.ceil(run.length / run.step_max), 1.0).sum()) for run in runs)
    if legs > solver.legs_max:
        raise InputError(
            f"{legs:.0f} lines and steps on arcs; this solver takes at most {solver.legs_max:g}: plan with the solver own, or with "
            "method optimal",
            source=program.source,
        )
