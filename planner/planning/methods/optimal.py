"""Method `optimal`: smoothed path, all limits with jerk, time-optimal by the interior-point kernel (planning/optimal/loop.py); then
geometry and feed together, without a path parameter (free.py).

Corners are rounded, tangent joints with a jump of the curvature too: a jump would need infinite jerk.

The search for geometry and feed together ends where it ends from any start nearby, so it begins on the first splines, which no
round has reshaped, with a motion that need not be fit for delivery (at_once.py). Runs of which it leaves something, or the job
where that is most of it, are planned again: it begins on the plan of the first splines; where it leaves much of that, or the path
of a small job doubles back within the tolerance, the splines are reshaped and it begins there once more; the fastest plan is taken,
and that of effort "quick" where no other is faster. With a limit of the normal acceleration it goes on with reshaped splines at
once: from a plan on the first ones it ended up to 1e-2 slower than these without it (`benchmarks.solvers.joint_campaign --hard`).
Rounds of reshaping alone end up to 5e-2 slower (docs/joint.md).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.names import AUTO, NORMAL, QUICK, effort_name
from planner.base.sizes import SIZES
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape
from planner.feedrate.solvers import OWN, ThirdOrderSolver, third_order_solver
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint
from planner.planning.job.job import Job
from planner.planning.job.method import Method, faster
from planner.planning.job.plan import Plan
from planner.planning.optimal.compare_plans import Stopped, with_closed_forms
from planner.planning.optimal.effort import EFFORTS, Settings
from planner.planning.optimal.loop import fastest_plan, first_motion
from planner.planning.optimal.order import ThirdOrder
from planner.planning.optimal.shaped import shaped_plan

# The shape number of Bezier corners that is fastest with jerk limits; 0.9, which has the smaller curvature, takes 0.1 to 0.9 % longer
# (pentagon, zig-zag, circle and spiral of chords at 2e5 mm/s3; 0.92 to 0.97 are within 0.3 % of each other).
SIGMA2 = 0.94
# A motion of more steps than the second that takes no more than the first over what its feed asks for is not searched [-]: on 30,000
# lines of dense chords the search took half of the computing and found nothing; on a random job of ten blocks it found 9e-4. Nor are
# the splines of such a motion reshaped because its path doubles back somewhere: 4,153 blocks of a V-carving took 50 CPU s instead of 19
# for 8e-5 of the time.
LEAST_LEFT, CHEAP = 1e-3, SIZES.searched_again
# Steps that a motion has on a leg at least (joint/guess.py).
LEAST_STEPS = 2


@dataclass(frozen=True, kw_only=True)
class OptimalMethod(Method):
    """The fastest motion under all limits, that of the jerk included: on splines first, then geometry and feed together.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : name of the solver, "own", "ipopt", "fatrop" or "sequential-convex" (feedrate/solvers.py), or a solver
    effort : "quick", "normal" or "best": grids, rounds of reshaping, and the size up to which geometry and feed are searched together
             (planning/optimal/effort.py); that is with corner "auto", the own solver, no filters, no shaping, and `rounds` None
    rounds : of reshaping splines (planning/optimal/reshape.py); None for those of the effort
    shaped : deliver setpoints that leave the machine's vibration modes at rest (planning/optimal/shaped.py)
    """

    corner: str | CornerShape = AUTO
    solver: str | ThirdOrderSolver = OWN
    effort: str = NORMAL
    rounds: int | None = None
    shaped: bool = False

    ways, measures_filters = ((0.5, 1.0), (0.1, 1.0)), True

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
        if self.corner != AUTO or self.solver != OWN or self.rounds is not None:
            return fastest_plan(job, settings)
        return _freed_plan(job, settings)


def _freed_plan(job: Job, settings: Settings) -> Plan:
    """The plan after the search for geometry and feed together, as far as the effort goes and the search can."""
    dial = settings.effort.search
    steps = LEAST_STEPS * len(legs_of(job.toolpath).first)
    if steps > dial.steps_max:
        return fastest_plan(job, settings)
    from planner.planning.methods.at_once import searched_at_once  # other plans need not load what they use
    from planner.planning.methods.free import searchable

    if not searchable(job):
        return fastest_plan(job, settings)
    first = first_motion(job, settings)
    if first.too_large:
        return fastest_plan(job.afresh(), settings)
    begun = first.planned
    once: Plan | None = None
    if begun is not None:
        if steps > CHEAP and begun.solution.cycle_time < (1.0 + LEAST_LEFT) * _at_feed(job):
            job.tell("search", left=begun.solution.cycle_time / _at_feed(job) - 1.0)
            return fastest_plan(job.afresh(), settings)
        again = job.afresh()
        found = searched_at_once(again, settings, begun, lambda part: _from_plans(part, settings, None))
        once, steps = found.plan, found.steps
        if once is not None:
            once = with_closed_forms(once, again, Stopped(again))
        # from a plan, too, it has as many steps: 112,143 instead of 114,552 on 20,000 blocks of stellabee1
        if once is not None and not (dial.of(steps).again and steps <= CHEAP and _doubles_back(job)):
            return once
    if steps > dial.steps_max or not dial.of(steps).again:
        return fastest_plan(job.afresh(), settings)
    return _from_plans(job, settings, once)


def _from_plans(job: Job, settings: Settings, once: Plan | None) -> Plan:
    """The plan after a search that begins on plans; never slower than the plan with `QUICK`.

    once : of the search from the first motion; None where that found none
    """
    from planner.planning.methods.from_plan import freed

    dial = settings.effort.search
    if not dial.again:
        return fastest_plan(job.afresh(), settings)
    best = once
    if best is None:  # a search in longer steps may pass its verdict where shorter ones do not
        best = _freed_plan(job.afresh(), dataclasses.replace(settings, effort=EFFORTS[QUICK]))
        if job.machine.normal_acceleration is None:
            again = job.afresh()
            on_first = dataclasses.replace(settings, effort=EFFORTS[QUICK], rounds=0)
            on_these = freed(again, fastest_plan(again, on_first), dial)
            best = faster(on_these.plan, best)
            if on_these.kept <= dial.kept:
                return best
    again = job.afresh()
    return faster(freed(again, fastest_plan(again, settings), dial).plan, best)


def _doubles_back(job: Job) -> bool:
    """Whether the path turns back on both ends of a block so short that one place is within the tolerance of both: splines that are
    reshaped find a way without the detour, the search does not find it from the first ones (7 of 320 random jobs, by up to 12 %)."""
    path = job.toolpath
    turn = np.sum(path.tangent_end[:-1] * path.tangent_start[1:], axis=1)
    back = (turn < 0.0) & (path.joint[1:-1] != Joint.STOP)
    short = (path.length < path.tolerance[:-1] + path.tolerance[1:])[1:-1]
    return bool((short & back[:-1] & back[1:]).any())


def _at_feed(job: Job) -> float:
    """Time of the moves at their programmed feed [s]."""
    return float(np.sum(job.toolpath.length / job.toolpath.feed))
