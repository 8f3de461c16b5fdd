"""Method `stop`: every block from rest to rest, jerk-limited, in closed form. The baseline the papers compare with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint
from planner.job.job import Job
from planner.job.method import Method
from planner.job.plan import Plan
from planner.lookahead.rest_to_rest import block_limits, block_moves, rest_to_rest_phases
from planner.motion.time_law import law_of_phases
from planner.motion.timing import Motion
from planner.path.samples import sample_path


@dataclass(frozen=True, kw_only=True)
class StopMethod(Method):
    """A full stop at the end of every block, and where a spline has a kink or a jump of its curvature."""

    def plan_job(self, job: Job) -> Plan:
        machine = job.machine
        with job.stage("geometry"):
            moves = block_moves(job.toolpath)
            exact = job.toolpath.with_joints(moves, Joint.STOP)
            samples = sample_path(round_corners(exact, machine, BezierCorner()), machine)
        with job.stage("solve"):
            lengths = np.diff(samples.s[np.append(samples.piece[:-1], len(samples) - 1)])
            limits = (np.minimum.reduceat(limit, moves[:-1]) for limit in block_limits(exact, machine))
            law = law_of_phases(samples, *rest_to_rest_phases(lengths, *limits))
            motion = Motion(samples=samples, law=law)
        made = job.deliver(job.behind_filters(motion))
        return job.plan(
            made,
            method="stop",
            corner=None,
            solver="closed form",
            status=Status.OPTIMAL,
            sentence="every block runs from rest to rest in the shortest time",
            grid_points=len(samples),
        )
