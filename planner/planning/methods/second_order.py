"""Method `second-order`: the limits of `optimal` but the jerk, path and feed together if possible.

The search has no row of the jerk; its accelerations rise and fall in steps as short as it finds them best.
Where it does not run, the feed along a path is found by reachability analysis, accelerations step at grid
points. The verdict reports the jerk as not limited.
"""

from dataclasses import dataclass

from planner.base.names import AUTO, NORMAL, known_name
from planner.corners.smooth import CornerShape
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.solvers import REACHABILITY, second_order_solver
from planner.planning.attempts import attempts_at
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import EFFORTS, Settings
from planner.planning.optimal.order import SecondOrder
from planner.planning.optimal.shaped import shaped_plan
from planner.planning.page import Method, best_of


@dataclass(frozen=True, kw_only=True)
class SecondOrderMethod(Method):
    """The fastest motion under all limits but jerk: path and feed together, or on splines or rounded corners.

    corner : "auto", "spline", "bezier", "fir", "kinematic", or a shape with settings of your own
    solver : "reachability" (own kernel), "toppra" (the package, for comparison), or a solver
    effort : "quick", "normal" or "best": as of method `optimal` (planning/optimal/effort.py)
    shaped : deliver setpoints that leave the machine's vibration modes at rest (planning/optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | FeedrateSolver = REACHABILITY
    effort: str = NORMAL
    shaped: bool = False

    ways, measures_filters, in_motion = ((0.5, 1.0), (0.1, 1.0)), True, True

    def plan_job(self, job: Job) -> Plan:
        order = SecondOrder(second_order_solver(self.solver), to_tighten=self.shaped)
        effort = EFFORTS[known_name("effort", self.effort, EFFORTS)]
        settings = Settings(
            method="second-order",
            corner=self.corner,
            order=order,
            effort=effort,
            joint=self.corner == AUTO and self.solver == REACHABILITY,
        )
        return shaped_plan(job, settings) if self.shaped else best_of(attempts_at(job), job, settings)
