"""Method `fir`: paper 000's velocity pulses, overlapped at the corners and smoothed by two FIR filters.

1. Arcs become chords. Between full stops the filters are chosen anew (fir/design.py), unless the machine has filters of its own.
2. At sharp corners the command waits for the gap that eq. 15 leaves of the filters' delay; through curves it flows without a gap,
   at a speed at which the filters stay within the tolerance (fir/schedule.py).
3. The filtered motion is made exactly, in pieces of constant jerk (fir/superpose.py).
4. Its deviation from the path, its accelerations and its jerks are measured exactly, and where one is too large the command slows
   down (fir/audit.py, fir/settle.py): what the filters promise for isolated pulses, |a| <= V/T1 and |j| <= V/(T1 T2), holds for
   no chain of pulses (up to 2 V/T1 and 4 V/(T1 T2), PAPERS), and eq. 14 not for short ones.

`plain` is the paper without 4: T1 = V/A, T2 = A/J, eq. 15 at every corner. Its verdict shows what that exceeds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.axis_motion import AxisMotion
from planner.errors import InputError
from planner.feedrate.solution import Status
from planner.fir.course import Course, course_of
from planner.fir.design import plain_plan
from planner.fir.schedule import Schedule
from planner.fir.search import fastest
from planner.fir.settle import make
from planner.fir.superpose import Pieces
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine
from planner.methods.plan import Plan
from planner.methods.stages import Progress, Stages, deliver, stop_time
from planner.nc.program import Program


@dataclass(frozen=True, kw_only=True)
class FirMethod:
    """Overlapped pulses through two FIR filters.

    plain : the paper's rules as they are, whatever they exceed
    """

    plain: bool = False

    def plan(
        self,
        program: Program,
        machine: Machine,
        tolerance: float | None = None,
        progress: Progress | None = None,
    ) -> Plan:
        """Plan a program. Raises InputError for what cannot be planned."""
        if machine.fir is not None and len(machine.fir.time_constants) != 2:
            raise InputError(
                f"machine '{machine.name}' has {len(machine.fir.time_constants)} filters in fir.time_constants; "
                "method fir plans for two (or give none, and it chooses them)"
            )
        stages = Stages(progress)
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
            course = course_of(toolpath, machine)
        with stages.stage("solve"):
            if self.plain:
                schedule = plain_plan(course, machine)
            else:
                course, schedule = fastest(course, machine)
            pieces = make(course, machine, schedule).pieces
        trajectory, verdict = deliver(motion_of(course, pieces), toolpath, machine, stages)
        return Plan(
            method="fir-plain" if self.plain else "fir",
            corner="fir",
            solver="pulses",
            program=program,
            machine=machine,
            toolpath=toolpath,
            status=Status.ACCEPTABLE,
            sentence=_sentence(course, schedule),
            trajectory=trajectory,
            verdict=verdict,
            corners=None,
            grid=None,
            stop_time=stop_time(toolpath, machine),
            grid_points=len(pieces),
            timings=stages.timings,
        )


def motion_of(course: Course, pieces: Pieces) -> AxisMotion:
    """The axes of the filtered motion; each piece belongs to the block that its middle has reached along the course."""
    lines, axes = course.lines, course.point.shape[1]
    middle = (pieces.t + np.append(pieces.t[1:], pieces.end[-1])) / 2 - pieces.t
    place, speed, push, jerk = (
        getattr(pieces, name)[:, axes] for name in ("position", "velocity", "acceleration", "jerk")
    )
    along = place + middle * (speed + middle * (push / 2 + middle * jerk / 6))
    ends = course.joint_at[course.first]
    stretch = np.repeat(np.arange(course.stretches), np.diff(pieces.first))
    segment = np.clip(
        np.searchsorted(np.cumsum(lines.length), along, side="right"), ends[stretch], ends[stretch + 1] - 1
    )
    columns = {
        name: getattr(pieces, name)[:, :axes] for name in ("position", "velocity", "acceleration", "jerk")
    }
    t = pieces.t
    if t[0] > 0:  # a standstill before the first move
        t, segment = np.insert(t, 0, 0.0), np.insert(segment, 0, 0)
        columns = {
            name: np.vstack([course.point[:1] if name == "position" else np.zeros((1, axes)), column])
            for name, column in columns.items()
        }
    return AxisMotion(
        axes=lines.axes,
        t=t,
        block=lines.block[segment],
        line=lines.line[segment],
        end=float(pieces.end[-1]),
        **columns,
    )


def _sentence(course: Course, plan: Schedule) -> str:
    waits = int((plan.gap(course)[course.inner] > 0).sum())
    turns = int((course.sin_half > 0).sum())
    longest = plan.T1 + plan.T2
    return (
        f"{waits} of {turns} corners are waited at, the others run through; filters of {1e3 * longest.min():.3g} to "
        f"{1e3 * longest.max():.3g} ms in all"
    )
