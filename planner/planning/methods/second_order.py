"""Method `second-order`: all limits but jerk, time-optimal on a smoothed path, by reachability analysis.

The machine's jerk limits are not used: the acceleration steps at grid points. The verdict reports the jerk as
not limited. The algorithm is that of method `optimal` on a path (planning/optimal/path_motion.py), with
another solver; splines are reshaped by the multipliers of this motion (feedrate/costates.py).
"""

from __future__ import annotations

from dataclasses import dataclass

from planner.base.names import AUTO, NORMAL, effort_name
from planner.corners.smooth import CornerShape
from planner.feedrate.solution import FeedrateSolver
from planner.feedrate.solvers import REACHABILITY, second_order_solver
from planner.planning.attempts import ON_PATH
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import EFFORTS, Settings
from planner.planning.optimal.order import SecondOrder
from planner.planning.optimal.shaped import shaped_plan
from planner.planning.page import Method, best_of


@dataclass(frozen=True, kw_only=True)
class SecondOrderMethod(Method):
    """The fastest motion under all limits but jerk, on splines or rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with
             settings of your own
    solver : name of the solver, "reachability" (own kernel) or "toppra" (the package, for comparison), or a
             solver
    effort : "quick", "normal" or "best": grids and rounds of reshaping (planning/optimal/effort.py)
    rounds : of reshaping splines (planning/optimal/reshape.py); None for those of the effort
    shaped : deliver setpoints that leave the machine's vibration modes at rest (planning/optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | FeedrateSolver = REACHABILITY
    effort: str = NORMAL
    rounds: int | None = None
    shaped: bool = False

    ways, measures_filters = ((0.5, 1.0), (0.1, 1.0)), True

    def plan_job(self, job: Job) -> Plan:
        order = SecondOrder(second_order_solver(self.solver), to_tighten=self.shaped)
        effort = EFFORTS[effort_name(self.effort)]
        settings = Settings(
            method="second-order", corner=self.corner, order=order, effort=effort, rounds=self.rounds
        )
        return shaped_plan(job, settings) if self.shaped else best_of(ON_PATH, job, settings)
