"""Method `fir-spline`: paper 001. Closed-form feed limits along a smooth path, then two FIR filters.

1. Corners are rounded by Bezier pairs that use a small fraction of the tolerance. The path becomes chords so
   fine that they are the path (baselines/fir/chord_guide.py).
2. The command runs at the speed that the formulas allow, T1 = V/A and T2 = A/J, for a few largest speeds V of
   every run between full stops (baselines/fir/chord_speeds.py).
3. The filtered motion is made exactly and measured; where something is exceeded the command gets slower or
   the filters longer, until nothing is. The fastest of the V stays.

`plain` is the paper as it is: v_sc at every point and its filters, without 3. The formulas assume a constant
curvature within what the filters cover; elsewhere the verdict shows what they exceed (docs/papers.md, 001:
G3).
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.errors import InputError
from planner.baselines.fir.chord_guide import ChordGuide, guide_of_path
from planner.baselines.fir.chord_speeds import ChordSpeeds, fastest_speeds, promised, v_sc
from planner.baselines.fir.guide import check_profile_filters
from planner.baselines.fir.superpose import axes_of, reached, superpose
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.motion.axis_motion import AxisMotion
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.page import Method

# Fraction of the tolerance that the rounding of corners may use [-]; the filters round them anyhow.
ROUNDING_FRACTION = 0.1
# Interpolation error of the grid that the chords start from; they are refined by their angle.
RESOLUTION = 0.05
# Corners that turn by more than one of these angles may become full stops [rad]; the first is none of them.
STOP_ANGLES = tuple(np.deg2rad([180.0, 120.0, 80.0, 50.0, 25.0, 10.0]))
# Phase lag phi of v_ph [rad]: up to it the second-order error is good to 1 % (docs/papers.md).
PHASE_LAG = 0.5


@dataclass(frozen=True, kw_only=True)
class FirSplineMethod(Method):
    """Closed-form feed limits and two FIR filters along a smooth path.

    plain           : the paper's speeds and filters as they are, whatever they exceed
    profile_filters : lengths of the two filters that the setpoints are made with [s]; None to choose them
    phase_lag       : phi of v_ph [rad], for `plain`

    Raises InputError unless the lengths and phi are positive and finite.
    """

    plain: bool = False
    profile_filters: tuple[float, float] | None = None
    phase_lag: float = PHASE_LAG

    keeps_tangential = False
    ways = ((0.5, 1.0), (0.25, 1.0), (0.1, 1.0), (0.03, 1.0))

    def __post_init__(self) -> None:
        check_profile_filters(self.profile_filters)
        if not 0 < self.phase_lag < np.inf:
            raise InputError(f"phase_lag = {self.phase_lag} rad; it must be positive and finite")

    @property
    def keeps_tolerance(self) -> bool:
        return not self.plain

    def plan_job(self, job: Job) -> Plan:
        with job.stage("geometry"):
            stopping = job.toolpath if self.plain else self._with_stops(job.toolpath, job.machine)
            guide = guide_of(stopping, job.machine, self.profile_filters)
        with job.stage("solve"):
            alone = guide.pick(np.ones(guide.runs, bool))
            speeds = self._plain(alone, job.machine) if self.plain else fastest_speeds(alone, job.machine)
            motion = _motion(dataclasses.replace(speeds, guide=guide), job.toolpath)
        delay = 1e3 * (speeds.T1 + speeds.T2)
        return job.plan(
            job.deliver(motion, as_it_is=True) if self.plain else job.deliver_in_time(motion),
            method="fir-spline-plain" if self.plain else "fir-spline",
            corner="bezier",
            solver="filters",
            status=Status.ACCEPTABLE,
            sentence=f"filters of {delay.min():.3g} to {delay.max():.3g} ms in all",
            grid_points=len(guide) + guide.runs,
        )

    def _with_stops(self, toolpath: Toolpath, machine: Machine) -> Toolpath:
        """The toolpath with full stops at its sharp corners where that promises to be faster, for each run by
        itself: at a full stop the filters may change. Where it turns right back the rounded path rests."""
        toolpath = toolpath.resting()
        ends = np.flatnonzero(toolpath.joint == Joint.STOP)
        best, best_time = toolpath.joint, np.full(len(ends) - 1, np.inf)
        for angle in STOP_ANGLES:
            sharp = (toolpath.joint == Joint.CORNER) & (toolpath.theta > angle)
            if not sharp.any() and np.isfinite(best_time).all():
                continue
            stopping = toolpath.with_joints(sharp, Joint.STOP)
            joint = stopping.joint
            guide = guide_of(stopping, machine, self.profile_filters)
            time = promised(guide.pick(np.ones(guide.runs, bool)), machine)[1].min(axis=0)
            run = np.searchsorted(ends, np.flatnonzero(joint == Joint.STOP)[:-1], side="right") - 1
            time = np.bincount(run, time, len(ends) - 1)
            better = np.append(time < best_time, False)[
                np.searchsorted(ends, np.arange(len(joint)), side="right") - 1
            ]
            best, best_time = np.where(better, joint, best), np.minimum(time, best_time)
        return dataclasses.replace(toolpath, joint=best)

    def _plain(self, guide: ChordGuide, machine: Machine) -> ChordSpeeds:
        """Paper 001 as it is: T1 = v_p/a, T2 = a/j (par. 19), the largest v_p of a run, v_sc (par. 29)."""
        acceleration, jerk = (machine.limits(q, guide.axes).min() for q in ("acceleration", "jerk"))
        T1, T2 = guide.largest(guide.feed) / acceleration, acceleration / jerk
        T1, T2 = (
            (np.maximum(T1, T2), np.minimum(T1, T2))
            if guide.profile_filters is None
            else guide.given_filters()
        )
        v = v_sc(guide, T1, T2, self.phase_lag)
        return ChordSpeeds(guide=guide, v=v, T1=T1, T2=T2, margin=np.ones((guide.runs, 2)))


def guide_of(toolpath: Toolpath, machine: Machine, own: tuple[float, float] | None = None) -> ChordGuide:
    """The guide along a toolpath whose corners are rounded within a fraction of the tolerance.

    own : lengths of the two filters [s]; None to choose them
    """
    less = dataclasses.replace(toolpath, tolerance=ROUNDING_FRACTION * toolpath.tolerance)
    path = round_corners(less, machine.model_copy(update={"fir": None}), BezierCorner())
    # from here on the whole of it
    path = dataclasses.replace(path, toolpath=toolpath, tol=path.tol / ROUNDING_FRACTION)
    return guide_of_path(sample_path(path, machine, RESOLUTION), machine, own)


def _motion(speeds: ChordSpeeds, toolpath: Toolpath) -> AxisMotion:
    """The axes of the filtered motion; each piece belongs to the block its middle has reached."""
    guide, motion = speeds.guide, superpose(speeds.command())
    chord = np.searchsorted(guide.s, reached(motion), side="right") - 1
    run = np.repeat(np.arange(guide.runs), np.diff(motion.first))
    segment = guide.segment[np.clip(chord, guide.first[run], guide.first[run + 1] - 1)]
    return axes_of(motion, segment, segment[0], toolpath, guide.point[0])
