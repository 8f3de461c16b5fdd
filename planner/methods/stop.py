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
from planner.lookahead.stop_moves import block_moves, stop_phases
from planner.motion.time_law import law_of_moves
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
            interval = samples.intervals
            interval = interval[np.searchsorted(samples.segment[interval], np.arange(len(exact)))]
            at = np.append(samples.s[interval], samples.s[-1])  # where segments begin
            run = np.repeat(np.arange(len(moves) - 1), np.diff(moves))
            law = law_of_moves(samples, run, at[:-1], *stop_phases(exact, machine, np.diff(at)))
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
