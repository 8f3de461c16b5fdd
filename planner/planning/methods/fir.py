"""Method `fir`: paper 000's velocity pulses, overlapped at the corners and smoothed by two FIR filters.

1. Arcs become chords. The filters are chosen anew between full stops (baselines/fir/fastest_schedule.py),
   unless `profile_filters` says which.
2. At sharp corners the command waits for the gap that eq. 15 leaves of the filters' delay; through curves it
   flows, at a speed at which the filters stay within the tolerance (baselines/fir/rules.py).
3. The filtered motion is made exactly, in pieces of constant jerk (baselines/fir/superpose.py).
4. Its deviation, accelerations and jerks are measured exactly, and the command slows down where one is too
   large (baselines/fir/measure.py, slow_down.py): |a| <= V/T1 and |j| <= V/(T1 T2) hold for isolated pulses,
   not for chains of them (docs/papers.md), and eq. 14 not for short ones.

These filters make the setpoints; those that the machine has behind them (`[fir]`) come after.
`plain` is the paper without 4: T1 = V/A, T2 = A/J, eq. 15 at every corner, whatever that exceeds.
"""

from dataclasses import dataclass

import numpy as np

from planner.baselines.fir.fastest_schedule import fastest_schedule, plain_plan
from planner.baselines.fir.guide import LegGuide, check_profile_filters, guide_of_legs
from planner.baselines.fir.schedule import Schedule
from planner.baselines.fir.superpose import Filtered, axes_of, reached, superpose
from planner.feedrate.solution import Status
from planner.motion.axis_motion import AxisMotion
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.page import Method


@dataclass(frozen=True, kw_only=True)
class FirMethod(Method):
    """Overlapped pulses through two FIR filters.

    plain           : the paper's rules as they are, whatever they exceed
    profile_filters : lengths of the two filters that the setpoints are made with [s]; None to choose them

    Raises InputError unless these are two positive lengths.
    """

    plain: bool = False
    profile_filters: tuple[float, float] | None = None

    keeps_tangential = False
    ways = ((0.5, 1.0), (0.25, 1.0), (0.1, 1.0), (0.03, 1.0))

    def __post_init__(self) -> None:
        check_profile_filters(self.profile_filters)

    @property
    def keeps_tolerance(self) -> bool:
        return not self.plain

    def plan_job(self, job: Job) -> Plan:
        with job.stage("geometry"):
            guide = guide_of_legs(job.toolpath, job.machine, self.profile_filters)
        with job.stage("solve"):
            schedule = (plain_plan if self.plain else fastest_schedule)(guide, job.machine)
            filtered = superpose(schedule.command())
            motion = motion_of(schedule.guide, filtered)
        return job.plan(
            job.deliver(motion, as_it_is=True) if self.plain else job.deliver_in_time(motion),
            method="fir-plain" if self.plain else "fir",
            corner="fir",
            solver="pulses",
            status=Status.ACCEPTABLE,
            sentence=_sentence(schedule),
            grid_points=len(filtered.t),
        )


def motion_of(guide: LegGuide, motion: Filtered) -> AxisMotion:
    """The axes of a filtered motion along a guide; each piece belongs to the block its middle has reached."""
    ends = guide.joint_at[guide.first]
    run = np.repeat(np.arange(guide.runs), np.diff(motion.first))
    segment = np.searchsorted(np.cumsum(guide.lines.length), reached(motion), side="right")
    segment = np.clip(segment, ends[run], ends[run + 1] - 1)
    return axes_of(motion, segment, 0, guide.lines, guide.point[0])


def _sentence(plan: Schedule) -> str:
    """The plan's sentence on its corners and filters."""
    waits = int((plan.gap()[plan.guide.inner] > 0).sum())
    turns = int((plan.guide.sin_half > 0).sum())
    longest = plan.T1 + plan.T2
    return (
        f"{waits} of {turns} corners are waited at, the others run through; filters of {1e3 * longest.min():.3g} to "
        f"{1e3 * longest.max():.3g} ms in all"
    )
