"""Method `stop`: every block from rest to rest, jerk-limited through ruckig. The baseline the papers compare with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.errors import NotSolvedError
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint
from planner.job.job import Job, Method
from planner.job.plan import Plan
from planner.lookahead.rest_to_rest import block_limits, rest_to_rest_phases
from planner.motion.time_law import law_of_phases
from planner.motion.timing import Motion
from planner.path.samples import sample_path


@dataclass(frozen=True, kw_only=True)
class StopMethod(Method):
    """A full stop at the end of every block."""

    def plan_job(self, job: Job) -> Plan:
        machine = job.machine
        with job.stage("geometry"):
            exact = job.toolpath.with_joints(slice(None), Joint.STOP)
            samples = sample_path(round_corners(exact, machine, BezierCorner()), machine)
        status, sentence = Status.OPTIMAL, "every block runs from rest to rest in the shortest time"
        made = None
        try:
            with job.stage("solve") as report:
                limits = block_limits(exact, machine)
                lengths = np.diff(samples.s[np.append(samples.piece[:-1], len(samples) - 1)])
                duration, jerk = rest_to_rest_phases(lengths, *limits, progress=report)
        except NotSolvedError as fault:
            status, sentence = Status.NUMERICAL_ERROR, str(fault)
        else:
            made = job.deliver(
                job.behind_filters(Motion(samples=samples, law=law_of_phases(samples, duration, jerk)))
            )
        return job.plan(
            made,
            method="stop",
            corner=None,
            solver="ruckig",
            status=status,
            sentence=sentence,
            grid_points=len(samples),
        )
