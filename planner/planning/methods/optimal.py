"""Method `optimal`: all limits with jerk, path and feed together where possible (attempts.py).

Corners are rounded, tangent joints with a jump of the curvature too: a jump would need infinite jerk.
"""

import dataclasses
from dataclasses import dataclass

from planner.base.names import AUTO, NORMAL, known_name
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape
from planner.feedrate.solvers import OWN, ThirdOrderSolver, third_order_solver
from planner.planning.attempts import attempts_at, is_searched
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.effort import EFFORTS, Settings
from planner.planning.optimal.order import ThirdOrder
from planner.planning.optimal.shaped import shaped_plan
from planner.planning.page import Method, best_of

# The shape number of Bezier corners that is fastest with jerk limits; 0.9 has a smaller curvature.
SIGMA2 = 0.94
NOT_SMOOTHER = "smooth has no effect: geometry and feed were not searched together, or setpoints are shaped"


@dataclass(frozen=True, kw_only=True)
class OptimalMethod(Method):
    """The fastest motion under all limits, that of the jerk included: path and feed together, or on splines.

    corner : "auto", "spline", "bezier", "fir", "kinematic", or a shape with settings of your own
    solver : name of the solver, "own", "ipopt" or "fatrop" (feedrate/solvers.py), or a solver
    effort : "quick", "normal" or "best": grids, and how finely and up to which size path and feed are searched
             together (planning/optimal/effort.py); that is with corner "auto", the own solver and no shaping
    smooth : weight of the squares of all jerks, as shares of their limits, against the time [-], 0 or more:
             with more the joint search finds a smoother and slower motion; at 0 jerk is small only where it
             costs no time (joint/step_limits.py)
    shaped : deliver setpoints that leave the machine's vibration modes at rest (planning/optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | ThirdOrderSolver = OWN
    effort: str = NORMAL
    smooth: float = 0.0
    shaped: bool = False

    ways, measures_filters, in_motion = ((0.5, 1.0), (0.1, 1.0)), True, True

    @property
    def keeps_power(self) -> bool:
        return self._joint

    @property
    def _joint(self) -> bool:
        return self.corner == AUTO and self.solver == OWN

    def plan_job(self, job: Job) -> Plan:
        effort = EFFORTS[known_name("effort", self.effort, EFFORTS)]
        search = dataclasses.replace(effort.search, smooth=0.0 if self.shaped else self.smooth)
        settings = Settings(
            method="optimal",
            corner=self.corner,
            order=ThirdOrder(third_order_solver(self.solver)),
            bezier=BezierCorner(sigma2=SIGMA2),
            effort=dataclasses.replace(effort, search=search),
            joint=self._joint,
        )
        made = shaped_plan(job, settings) if self.shaped else best_of(attempts_at(job), job, settings)
        if self.smooth and (self.shaped or not is_searched(job, settings)):
            made = dataclasses.replace(made, notes=(*made.notes, NOT_SMOOTHER))
        return made
