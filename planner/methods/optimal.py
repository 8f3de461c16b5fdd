"""Method `optimal`: smoothed path, all limits with jerk, time-optimal by the interior-point kernel.

1. Corners are rounded, tangent joints with a jump of the curvature too: a jump would need infinite jerk.
2. The second-order problem is solved first: it says where straight stretches need grid points (feedrate/grid.py).
3. The jerk-limited problem is solved on that grid (feedrate/jerk/solver.py).
4. Where the densely sampled motion exceeds a limit between grid points the problem is tightened and solved again; what is left,
   less than 0.05 % as a rule, every run between full stops is slowed down by (optimal/between_points.py).
5. With corner "auto", full stops, other corner shapes and method `kinematic` take its place where they take less time, or pass
   where it does not (methods/rivals.py).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

from planner.constraints.assemble import feedrate_problem
from planner.constraints.problem import FeedrateProblem
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.solvers import OWN, JerkLimitedSolver, third_order_solver
from planner.job.job import Job, Method
from planner.job.plan import Plan
from planner.job.stages import Stages
from planner.machine import Machine
from planner.methods.kinematic import KinematicMethod
from planner.methods.rivals import fastest
from planner.methods.stop import StopMethod
from planner.motion.timing import Motion
from planner.optimal.between_points import within_limits, without_seen_excess
from planner.optimal.geometry import AUTO
from planner.optimal.on_path import best_on_path, corner_shape, plan_of_solution
from planner.optimal.reshape import OnPath, tube_prices
from planner.optimal.shaped import shaped_plan
from planner.optimal.within_filters import within_filters
from planner.path.samples import RESOLUTION, sample_path
from planner.sensitivity.prices import MORE_TOLERANCE, SitePrices, price_list

# The shape number of Bezier corners that is fastest with jerk limits; 0.9, which has the smaller curvature, takes 0.1 to 0.9 % longer
# (pentagon, zig-zag, circle and spiral of chords at 2e5 mm/s3; 0.92 to 0.97 are within 0.3 % of each other).
SIGMA2 = 0.94
SEEN_ROUNDS = 3  # at most, each with ten times the margin of the one before


@dataclass(frozen=True, kw_only=True)
class OptimalMethod(Method):
    """Time-optimal planning with jerk limits on rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : name of the solver, "own", "ipopt", "fatrop" or "sequential-convex" (feedrate/solvers.py), or a solver
    rounds : of reshaping splines (optimal/reshape.py); None for as many as the size of the job lets pay
    shaped : deliver set points that leave the machine's vibration modes at rest (optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | JerkLimitedSolver = OWN
    rounds: int | None = None
    shaped: bool = False

    ways = ((0.5, 1.0), (0.1, 1.0))

    @property
    def _solver(self) -> JerkLimitedSolver:
        return third_order_solver(self.solver)

    @property
    def instead(self) -> tuple[Method, ...]:  # type: ignore[override]
        """Single corners, method kinematic and full stops, where the chords between samples take tolerance from splines."""
        if self.corner != AUTO or self.shaped:
            return ()
        corners = (dataclasses.replace(self, corner=corner) for corner in ("bezier", "fir", "kinematic"))
        return (*corners, KinematicMethod(), StopMethod())

    def plan_job(self, job: Job) -> Plan:
        if self.shaped:
            # reshaping makes paths for the motion as it is planned, not for the one behind the shaper
            plain = dataclasses.replace(self, rounds=self.rounds or 0)
            return shaped_plan(
                job,
                lambda job: plain._best(job, self.corner),
                self._solver.solve,
                method="optimal",
                corner=self.corner,
            )
        plan = self._on_corner(job, self.corner)
        if self.corner != AUTO:
            return plan
        return fastest(
            plan,
            job,
            self._on_corner,
            lambda path, coarser: self._on_path(path, job.machine, job.stages, finer=coarser),
        )

    def _on_corner(self, job: Job, corner: str | CornerShape) -> Plan:
        """The plan with corners rounded like that, or splines."""
        machine = job.machine
        best = self._best(job, corner)
        motion = made = prices = None
        if best.solution.solved:
            with job.stage("solve"):
                best, motion = within_limits(best, self._solver.solve, job.toolpath, machine)
            with job.stage("filters"):
                best, motion = within_filters(best, motion, self._again(job), job.real)
            made = job.deliver(motion)
            for again in range(SEEN_ROUNDS):
                gentler = without_seen_excess(motion, made[1], again)
                if gentler is None:
                    break
                motion = gentler
                made = job.deliver(motion, seed=again + 1)  # times from which nothing was fed back
            # behind filters what a limit costs is not the problem's to say
            if best.solution.multipliers and machine.fir is None:
                with job.stage("report"):
                    by_site = _site_prices(best)
                    prices = price_list(best.samples, best.problem, best.solution, machine, by_site)
        return plan_of_solution(job, best, made, method="optimal", corner=corner, prices=prices)

    def _best(self, job: Job, corner: str | CornerShape) -> OnPath:
        """The time-optimal motion with corners rounded like that, or on splines."""
        with job.stage("geometry"):
            shape = corner_shape(corner, job.machine, job.toolpath, bezier=BezierCorner(sigma2=SIGMA2))
            path = round_corners(job.toolpath, job.machine, shape, blend_tangents=True)
        return best_on_path(
            job,
            path,
            corner,
            lambda path, finer: self._on_path(path, job.machine, job.stages, finer=finer),
            blend_tangents=True,
            rounds=self.rounds,
        )

    def _again(self, job: Job) -> Callable[[OnPath, FeedrateProblem], tuple[OnPath, Motion] | None]:
        """The motion of another problem on the same grid, None if there is none."""

        def again(planned: OnPath, problem: FeedrateProblem) -> tuple[OnPath, Motion] | None:
            other = dataclasses.replace(planned, problem=problem, solution=self._solver.solve(problem))
            if not other.solution.solved:
                return None
            return within_limits(other, self._solver.solve, job.toolpath, job.machine)

        return again

    def _on_path(self, path: SmoothPath, machine: Machine, stages: Stages, finer: float = 1.0) -> OnPath:
        """The time-optimal motion on a path, on a grid of `finer` times the usual resolution."""
        with stages.stage("geometry"):
            samples = sample_path(
                path, machine, None if finer == 1.0 else RESOLUTION * finer, third_order=True
            )
        with stages.stage("solve") as report:
            samples = refine_for_jerk(samples, machine)
            problem = feedrate_problem(samples, machine, measured=True)
            return OnPath(
                path=path, samples=samples, problem=problem, solution=self._solver.solve(problem, report)
            )


def _site_prices(planned: OnPath) -> SitePrices | None:
    """What the tube of a path's splines costs; None where it has none."""
    shape = planned.shape
    if shape is None or not len(planned.path.spline):
        return None
    now, wider = (tube_prices(planned, shape, more) for more in (0.0, MORE_TOLERANCE))
    return SitePrices(place=shape.laid.place, now=now, wider=wider)
