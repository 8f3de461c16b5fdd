"""Method `optimal`: smoothed path, all limits with jerk, time-optimal by the interior-point kernel. The algorithm is optimal/loop.py.

Corners are rounded, tangent joints with a jump of the curvature too: a jump would need infinite jerk.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from planner.base.names import AUTO, BEST, NORMAL, effort_name
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape
from planner.feedrate.solvers import OWN, ThirdOrderSolver, third_order_solver
from planner.job.job import Job
from planner.job.method import Method
from planner.job.plan import Plan
from planner.methods.kinematic import KinematicMethod
from planner.methods.stop import StopMethod
from planner.optimal.effort import EFFORTS
from planner.optimal.loop import Settings, fastest_plan
from planner.optimal.order import ThirdOrder
from planner.optimal.shaped import shaped_plan

# The shape number of Bezier corners that is fastest with jerk limits; 0.9, which has the smaller curvature, takes 0.1 to 0.9 % longer
# (pentagon, zig-zag, circle and spiral of chords at 2e5 mm/s3; 0.92 to 0.97 are within 0.3 % of each other).
SIGMA2 = 0.94


@dataclass(frozen=True, kw_only=True)
class OptimalMethod(Method):
    """Time-optimal planning with jerk limits on rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : name of the solver, "own", "ipopt", "fatrop" or "sequential-convex" (feedrate/solvers.py), or a solver
    effort : "quick", "normal" or "best": grids and rounds of reshaping (optimal/effort.py); with "best" and geometry "auto" the
             motion is then improved without a path parameter (free.py)
    rounds : of reshaping splines (optimal/reshape.py); None for those of the effort
    shaped : deliver setpoints that leave the machine's vibration modes at rest (optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | ThirdOrderSolver = OWN
    effort: str = NORMAL
    rounds: int | None = None
    shaped: bool = False

    ways = ((0.5, 1.0), (0.1, 1.0))

    @property
    def instead(self) -> tuple[Method, ...]:  # type: ignore[override]
        """Single corners, method kinematic and full stops, where the chords between samples take tolerance from splines."""
        if self.corner != AUTO or self.shaped:
            return ()
        corners = (dataclasses.replace(self, corner=corner) for corner in ("bezier", "fir", "kinematic"))
        return (*corners, KinematicMethod(), StopMethod())

    def plan_job(self, job: Job) -> Plan:
        settings = Settings(
            method="optimal",
            corner=self.corner,
            order=ThirdOrder(third_order_solver(self.solver)),
            bezier=BezierCorner(sigma2=SIGMA2),
            effort=EFFORTS[effort_name(self.effort)],
            rounds=self.rounds,
        )
        if self.shaped:
            return shaped_plan(job, settings)
        plan = fastest_plan(job, settings)
        if self.effort != BEST or self.corner != AUTO:
            return plan
        from planner.methods.free import freed  # other plans need not load what it uses

        return freed(job, plan)
