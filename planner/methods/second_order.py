"""Method `toppra`: smoothed path, all second-order constraints, time-optimal by reachability analysis.

The machine's jerk limits are not used: the acceleration steps at grid points. The verdict reports the jerk as not limited. Splines
are reshaped as in method `optimal`, by the multipliers of this motion (feedrate/costates.py).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from planner.constraints.problem import FeedrateProblem
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.feedrate.costates import second_order_multipliers
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.solvers import REACHABILITY, second_order_solver
from planner.job.job import Job, Method
from planner.job.plan import Plan
from planner.motion.time_law import law_of_solution
from planner.motion.timing import Motion
from planner.optimal.between_points import without_seen_excess
from planner.optimal.geometry import AUTO
from planner.optimal.on_path import best_on_path, corner_shape, plan_of_solution
from planner.optimal.reshape import OnPath
from planner.optimal.second_order import second_order
from planner.optimal.shaped import shaped_plan
from planner.optimal.within_filters import within_filters
from planner.path.samples import RESOLUTION, sample_path

# Of 40 random polylines one exceeded an acceleration by 4e-4 between grid points; at most so often the whole is slowed down by that.
SEEN_ROUNDS = 3


@dataclass(frozen=True, kw_only=True)
class ToppraMethod(Method):
    """Second-order time-optimal planning on rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : name of the solver, "reachability" (own kernel) or "toppra" (the package, for comparison), or a solver
    rounds : of reshaping splines (optimal/reshape.py); None for as many as the size of the job lets pay
    shaped : deliver set points that leave the machine's vibration modes at rest (optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | FeedrateSolver = REACHABILITY
    rounds: int | None = None
    shaped: bool = False

    ways = ((0.5, 1.0), (0.1, 1.0))

    @property
    def _solver(self) -> FeedrateSolver:
        return second_order_solver(self.solver)

    def _best(self, job: Job) -> OnPath:
        """The time-optimal motion of a job, and the path that it is on."""
        machine = job.machine
        with job.stage("geometry"):
            shape = corner_shape(self.corner, machine, job.toolpath)
            path = round_corners(job.toolpath, machine, shape)

        def on_path(path: SmoothPath, finer: float) -> OnPath:
            with job.stage("geometry"):
                samples = sample_path(path, machine, None if finer == 1.0 else RESOLUTION * finer)
            with job.stage("solve"):
                if (
                    self.shaped
                ):  # limits become smaller in places on straight stretches too, which one interval cannot say
                    samples = refine_for_jerk(samples, machine)
                planned = second_order(path, samples, machine, self._solver)
                if not planned.solution.solved:
                    return planned
                multipliers = second_order_multipliers(planned.problem, planned.solution)
                solution = dataclasses.replace(planned.solution, multipliers=multipliers)
                return dataclasses.replace(planned, solution=solution)

        return best_on_path(job, path, self.corner, on_path, blend_tangents=False, rounds=self.rounds)

    def plan_job(self, job: Job) -> Plan:
        if self.shaped:
            plain = dataclasses.replace(self, rounds=self.rounds or 0)
            return shaped_plan(
                job,
                plain._best,
                self._solver.solve,
                method="toppra",
                corner=self.corner,
                not_limited=("jerk",),
            )
        best = self._best(job)
        motion = made = None
        if best.solution.solved:
            motion = Motion(samples=best.samples, law=law_of_solution(best.samples, best.solution))

            def again(planned: OnPath, problem: FeedrateProblem) -> tuple[OnPath, Motion] | None:
                other = dataclasses.replace(planned, problem=problem, solution=self._solver.solve(problem))
                if not other.solution.solved:
                    return None
                return other, Motion(
                    samples=other.samples, law=law_of_solution(other.samples, other.solution)
                )

            with job.stage("filters"):
                best, motion = within_filters(best, motion, again, job.real)
            made = job.deliver(motion, not_limited=("jerk",))
            for once_more in range(SEEN_ROUNDS):
                gentler = without_seen_excess(motion, made[1], once_more)
                if gentler is None:
                    break
                motion = gentler
                made = job.deliver(motion, not_limited=("jerk",), seed=once_more + 1)
        return plan_of_solution(job, best, made, method="toppra", corner=self.corner)
