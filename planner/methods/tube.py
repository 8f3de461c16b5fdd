"""Method `tube`: geometry and feed found together, anywhere inside the tolerance: the physical limit, for short jobs.

All other methods round the path first and then find the feed. Here the motion of the axes itself is what is sought (tube/nlp.py), so
nothing is given away between the two; what is still lost against the true limit is the step (5e-5) and what a better local optimum
would gain. It takes about a second per corner where the others take milliseconds, hence `LEGS_MAX`.

1. The path falls into courses between full stops, each a problem of its own (tube/course.py).
2. Method `optimal` makes the motion from which the search starts (tube/guess.py).
3. ipopt finds the motion; it is integrated exactly and slowed down by what rounding exceeds (tube/motion.py).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Array, FloatArray
from planner.axis_motion import AxisMotion
from planner.errors import InputError
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.methods.job import Job, Method
from planner.methods.optimal import OptimalMethod
from planner.methods.plan import Plan
from planner.methods.stages import Stages
from planner.nc.program import Program
from planner.trajectory import Trajectory
from planner.tube.course import Course, courses_of
from planner.tube.guess import guess_from
from planner.tube.motion import Steps, steps_of
from planner.tube.nlp import TubeNLP

# A job may have this many legs (arcs count as many as the steps they need). Measured, beside other work: a spiral of 100 chords takes
# 7 s, one of 400 two minutes and 0.44 GB.
LEGS_MAX = 500
# The start is sampled at this share of a/j, the time an axis needs for its acceleration [-], but not more often than that in all.
START_PERIOD, START_SAMPLES = 0.02, 200_000
# Of the start, what is slower than this share of its fastest counts as standing [-].
STANDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class TubeMethod(Method):
    """The free optimum inside the tolerance.

    start  : the method whose motion the search starts from
    solver : settings of the search
    """

    start: OptimalMethod = field(default_factory=lambda: OptimalMethod(corner="bezier"))
    solver: TubeNLP = field(default_factory=TubeNLP)

    def plan_job(self, job: Job) -> Plan:
        toolpath = job.toolpath
        with job.stage("geometry"):
            courses = list(courses_of(toolpath, job.machine))
            _check_size(courses, job.program)
        with job.stage("start"):
            start = self.start.plan_job(_often_sampled(job))
        status, sentence = start.status, start.sentence
        steps: list[Steps] = []
        places: list[FloatArray] = []
        with job.stage("solve") as report:
            for done, course in enumerate(courses):
                if start.trajectory is None:
                    break
                window, vertex_time = _passed(course, start.trajectory, toolpath)
                guess = guess_from(course, window, vertex_time)
                solution = self.solver.solve(course, guess)
                if solution.h is None or solution.place is None:
                    status = solution.status
                    sentence = f"lines {_lines(course, toolpath)}: {solution.sentence}"
                    break
                if not steps or solution.status is Status.ACCEPTABLE:  # the worse one stands for all courses
                    status, sentence = solution.status, solution.sentence
                steps.append(steps_of(course, guess, solution))
                places.append((solution.place[:-1] + solution.place[1:]) / 2)
                report((done + 1) / len(courses))
        made = None
        if start.trajectory is not None and len(steps) == len(courses):
            made = job.deliver(job.behind_filters(_motion(courses, steps, places, toolpath)))
            sentence += f"; {start.method} with corner {start.corner}, its start, took {start.trajectory.cycle_time:.6g} s"
        return job.plan(
            made,
            method="tube",
            corner=None,
            solver=repr(self.solver),
            status=status,
            sentence=sentence,
            grid_points=sum(len(part.h) + 1 for part in steps),
        )


def _check_size(courses: list[Course], program: Program) -> None:
    legs = sum(float(np.maximum(np.ceil(course.length / course.step_max), 1.0).sum()) for course in courses)
    if legs > LEGS_MAX:
        raise InputError(
            f"{legs:.0f} lines and parts of arcs; method tube is for short jobs and takes at most {LEGS_MAX}: split the program, "
            "or plan with method optimal",
            source=program.source,
        )


def _often_sampled(job: Job) -> Job:
    """The job with a period short enough to see every phase of the start, and a clock of its own."""
    acceleration, jerk = (job.machine.limits(q, job.toolpath.axes) for q in ("acceleration", "jerk"))
    period = max(START_PERIOD * float((acceleration / jerk).min()), job.stop_time / START_SAMPLES)
    machine = job.machine.model_copy(update={"dt": min(job.machine.dt, period)})
    return dataclasses.replace(job, machine=machine, stages=Stages(), noted=[])


def _passed(course: Course, start: Trajectory, toolpath: Toolpath) -> tuple[Trajectory, FloatArray]:
    """The part of the start that runs a course from rest to rest, and when it passes the course's vertices (R+1,) [s]."""
    begins = np.append(toolpath.block, toolpath.block[-1] + 1)[course.first]
    sample = np.searchsorted(start.block, begins)
    moving = sample[0] + np.flatnonzero(start.feed[sample[0] : sample[-1]] > STANDING * start.feed.max())
    window = slice(max(moving[0] - 1, 0), moving[-1] + 2)
    columns = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")
    part = dataclasses.replace(start, **{name: getattr(start, name)[window] for name in columns})
    t = start.t[np.minimum(sample, len(start) - 1)].copy()
    t[[0, -1]] = part.t[[0, -1]]
    # Blocks so short that no sample falls on them share the time of their neighbours.
    seen = np.append(np.diff(t) > 0, True)
    return part, np.interp(course.offset, course.offset[seen], t[seen])


def _motion(
    courses: list[Course], steps: list[Steps], places: list[FloatArray], toolpath: Toolpath
) -> AxisMotion:
    """The motions along all courses, one after the other, with the dwells between them; places: of every step's middle [mm]."""
    along = np.append(0.0, np.cumsum(toolpath.length))
    h, segment = [], []
    columns: dict[str, list[FloatArray]] = {"position": [], "velocity": [], "acceleration": [], "jerk": []}
    for course, part, place in zip(courses, steps, places, strict=True):
        first, last = course.first[0], course.first[-1]
        standing = int(toolpath.dwell[first] > 0)  # a step without motion before the others
        h += [toolpath.dwell[[first] * standing], part.h]
        inside = np.searchsorted(along[first + 1 : last], along[first] + place, side="right")
        segment += [[first] * standing, first + inside]
        for name, column in columns.items():
            whole = np.zeros((standing + len(part.h), len(toolpath.axes)))
            if name == "position":
                whole += toolpath.start[first]
            whole[standing:, course.axis] = getattr(part, name)
            column.append(whole)
    t = np.append(0.0, np.cumsum(np.concatenate(h)))
    of: Array = np.concatenate(segment).astype(np.int64)
    return AxisMotion(
        axes=toolpath.axes,
        t=t[:-1],
        block=toolpath.block[of],
        line=toolpath.line[of],
        end=float(t[-1] + toolpath.dwell[-1]),
        **{name: np.concatenate(column) for name, column in columns.items()},
    )


def _lines(course: Course, toolpath: Toolpath) -> str:
    return f"{toolpath.line[course.first[0]]} to {toolpath.line[course.first[-1] - 1]}"
