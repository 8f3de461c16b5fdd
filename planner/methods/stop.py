"""Method `stop`: every block from rest to rest, jerk-limited through ruckig. The baseline the papers compare with."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.errors import NotSolvedError
from planner.feedrate.rest_to_rest import block_limits, rest_to_rest_phases
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.methods.plan import Plan
from planner.methods.stages import Progress, Stages, deliver, stop_time
from planner.nc.program import Program
from planner.path import sample_path
from planner.timing import Motion, law_of_phases


@dataclass(frozen=True, kw_only=True)
class StopMethod:
    """A full stop at the end of every block."""

    def plan(
        self,
        program: Program,
        machine: Machine,
        tolerance: float | None = None,
        progress: Progress | None = None,
    ) -> Plan:
        """Plan a program. Raises InputError for what cannot be planned; an unsolved problem is the plan's status."""
        stages = Stages(progress)
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
            exact = _stopping(toolpath)
            samples = sample_path(round_corners(exact, machine, BezierCorner()), machine)
        status, sentence = Status.OPTIMAL, "every block runs from rest to rest in the shortest time"
        trajectory = verdict = None
        try:
            with stages.stage("solve") as report:
                limits = block_limits(exact, machine)
                lengths = np.diff(samples.s[np.append(samples.piece[:-1], len(samples) - 1)])
                duration, jerk = rest_to_rest_phases(lengths, *limits, progress=report)
        except NotSolvedError as fault:
            status, sentence = Status.NUMERICAL_ERROR, str(fault)
        else:
            motion = Motion(samples=samples, law=law_of_phases(samples, duration, jerk))
            trajectory, verdict = deliver(motion, toolpath, machine, stages)
        return Plan(
            method="stop",
            corner=None,
            solver="ruckig",
            program=program,
            machine=machine,
            toolpath=toolpath,
            status=status,
            sentence=sentence,
            trajectory=trajectory,
            verdict=verdict,
            corners=None,
            grid=None,
            stop_time=stop_time(toolpath, machine),
            grid_points=len(samples),
            timings=stages.timings,
        )


def _stopping(toolpath: Toolpath) -> Toolpath:
    """The same path with a full stop at every joint."""
    return dataclasses.replace(toolpath, joint=np.full(len(toolpath) + 1, Joint.STOP))
