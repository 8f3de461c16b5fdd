"""Method `bezier`: paper 002. Bezier pairs, error allocation, S-curves between constant speeds.

1. Every corner, and every tangent joint where the curvature jumps, is rounded by a Bezier pair that uses the
   fraction of the tolerance that eq. (20) gives it (rounding, chord error, filters that follow).
2. Each corner has the largest constant speed that eq. (19) with the rest of the tolerance and the limits of
   the axes, jerk included, allow (lookahead/constant_speed_corners.py).
3. A look-ahead (lookahead/look_ahead.py) chooses the speed of every corner, or a full stop at its vertex
   where that is faster; on arcs the limits are constant.
4. What the samples of a corner may have missed is made good by slowing down; usually nothing.
"""

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.lookahead.constant_speed_corners import constant_speeds, corner_chain
from planner.baselines.lookahead.look_ahead import look_ahead, moves, swept
from planner.baselines.lookahead.ramps import JointKind
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import SmoothPath, exact_stops, round_corners
from planner.feedrate.sampling.samples import PathSamples, sample_path
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint
from planner.machine import Machine
from planner.motion.timing import Motion, law_of_moves
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.optimal.notes import exact_note
from planner.planning.optimal.tighten import slowed
from planner.planning.page import CLOSED_FORM_WAYS, Method

# The fraction of every leg that corners leave free [-]: with none all are as slow as the first.
FREE_FRACTION = 0.3
# Interpolation period [s] for which the corners are rounded without allocation: its chord error is nothing.
NO_PERIOD = 1e-9


@dataclass(frozen=True, kw_only=True)
class BezierMethod(Method):
    """Bezier pairs with error allocation.

    corner   : shape numbers of the pair
    allocate : share the tolerance between rounding and chord error, eq. (18)-(20); without, each has all of
               it for itself, as in paper 002's figure 7, and the verdict may report that the tolerance is
               exceeded
    """

    corner: BezierCorner = field(default_factory=BezierCorner)
    allocate: bool = True

    ways = CLOSED_FORM_WAYS

    @property
    def keeps_tolerance(self) -> bool:
        return self.allocate

    def plan_job(self, job: Job) -> Plan:
        machine = job.machine
        with job.stage("geometry"):
            shares = machine if self.allocate else machine.model_copy(update={"dt": NO_PERIOD, "fir": None})
            path = round_corners(job.toolpath, shares, self.corner, blend_tangents=True, free=FREE_FRACTION)
            samples = sample_path(path, shares)
        with job.stage("solve"):
            speed = constant_speeds(samples, shares)
            chain = corner_chain(samples, machine, speed)
            chosen, _ = look_ahead(chain.legs, [chain.passage])
            stops = chain.joint[(chain.joint >= 0) & (chosen.kind == JointKind.STOP)]
        with job.stage("geometry"):
            path = _stopped(path, stops)
            samples = sample_path(path, shares) if len(stops) else samples
        with job.stage("solve"):
            passed = len(np.unique(samples.element[samples.element < 0]))
            motion = slowed(_motion(samples, machine, speed), job.toolpath, machine)
        motion = job.behind_filters(motion)
        made = job.deliver(motion, as_it_is=not self.allocate)
        return job.plan(
            made,
            method="bezier",
            corner=self.corner.name,
            solver="look-ahead",
            status=Status.OPTIMAL,
            sentence=f"{passed} corners are run through, {len(stops)} are faster as full stops",
            grid_points=len(samples),
            notes=exact_note(job.toolpath, exact_stops(job.toolpath)),
        )


def _stopped(path: SmoothPath, joint: Array) -> SmoothPath:
    """The same path with full stops at the vertices of some corners."""
    columns = {name: getattr(path, name).copy() for name in ("joint", "d", "params", "scale", "tol_ap")}
    columns["joint"][joint] = Joint.STOP
    columns["scale"][joint] = 1.0
    for name in ("d", "params", "tol_ap"):
        columns[name][joint] = 0.0
    return dataclasses.replace(path, **columns)


def _motion(samples: PathSamples, machine: Machine, speed: FloatArray) -> Motion:
    """The motion with the corners at most at the speeds (R+1,)."""
    chain = corner_chain(samples, machine, speed)
    passage = swept(chain.legs, chain.passage)
    duration, jerk = moves(passage, chain.legs)
    law = law_of_moves(samples, chain.run, chain.begin, passage.V[:-1], duration, jerk)
    return Motion(samples=samples, law=law)
