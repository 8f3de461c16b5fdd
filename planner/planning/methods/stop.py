"""Method `stop`: every block from rest to rest, jerk-limited, in closed form: the papers' baseline."""

from dataclasses import dataclass

import numpy as np

from planner.baselines.lookahead.rest_to_rest import parts_of, stop_phases
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint
from planner.motion.timing import Motion, law_of_moves
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.page import Method


@dataclass(frozen=True, kw_only=True)
class StopMethod(Method):
    """A full stop at the end of every block, and where a spline has a kink or a jump of its curvature.

    join_lines : none between lines that go straight on at the same feed
    """

    join_lines: bool = False

    def plan_job(self, job: Job) -> Plan:
        machine = job.machine
        with job.stage("geometry"):
            parts = parts_of(job.toolpath, self.join_lines)
            exact = job.toolpath.with_joints(parts.first[parts.still], Joint.STOP)
            samples = sample_path(round_corners(exact, machine, BezierCorner()), machine)
        with job.stage("solve"):
            interval = samples.intervals
            interval = interval[np.searchsorted(samples.segment[interval], np.arange(len(exact)))]
            at = np.append(samples.s[interval], samples.s[-1])[parts.first]  # where parts begin
            run = np.cumsum(parts.still[:-1]) - 1
            law = law_of_moves(samples, run, at[:-1], *stop_phases(exact, machine, parts, np.diff(at)))
            motion = Motion(samples=samples, law=law)
        made = job.deliver_in_time(motion)
        return job.plan(
            made,
            method="stop",
            corner=None,
            solver="closed form",
            status=Status.OPTIMAL,
            sentence=f"every {'straight way' if self.join_lines else 'block'} runs from rest to rest in the shortest time",
            grid_points=len(samples),
        )
