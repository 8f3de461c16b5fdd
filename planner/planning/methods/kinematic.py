"""Method `kinematic`: paper 003's jerk-limited corners between straight legs, with look-ahead.

1. Arcs are cut into chords (half of the tolerance), or run whole between full stops where that is faster;
   curves are always cut.
2. Every corner has its candidates with the largest speed that tolerance, limits and legs allow: zero entry
   acceleration, entry deceleration (corners/kinematic.py), and where drives start with a step of velocity the
   vertex itself at that step.
3. The look-ahead lowers the speeds until every leg can be run, and chooses per corner a candidate or a full
   stop, so that the whole is fastest (baselines/lookahead/look_ahead.py).
4. Legs and corners are pieces of constant jerk of every axis (baselines/lookahead/corner_pieces.py): nothing
   is sampled.

A run between full stops that is not faster than stopping at every block is made as method `stop` makes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.point_to_point import rest_to_rest_times
from planner.baselines.lookahead.corner_pieces import along_axes, corner_pieces
from planner.baselines.lookahead.kinematic_corners import corner_passages, fitted, leg_limits
from planner.baselines.lookahead.look_ahead import look_ahead
from planner.baselines.lookahead.ramps import JointKind
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.corners import kinematic as corner
from planner.feedrate.constraints.limits import TANGENTIAL, TANGENTIAL_JERK
from planner.feedrate.solution import Status
from planner.geometry.build import COLLINEAR_ANGLE
from planner.geometry.chords import arc_sagitta, chorded, parted_by_feed
from planner.geometry.legs import Legs, legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.motion.axis_motion import AxisMotion
from planner.nc.program import PathControl
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.planning.page import CLOSED_FORM_WAYS, Method

# Fraction of the tolerance that chords of arcs may use; half is enough for corners that fill them.
CHORD_FRACTION = 0.5


@dataclass(frozen=True, kw_only=True)
class KinematicMethod(Method):
    """Kinematic corners with look-ahead.

    start_stop : step of velocity that the drives make from standstill, the same for every axis [mm/s]: a
                 corner may be passed at the vertex where no axis steps by more. Such a step breaks the limits
                 of acceleration and jerk, and the verdict says so
    """

    start_stop: float = 0.0

    ways, keeps_tangential = CLOSED_FORM_WAYS, False

    def __post_init__(self) -> None:
        if not 0 <= self.start_stop < np.inf:
            raise InputError(f"start_stop = {self.start_stop} mm/s; it must be finite and not negative")

    def plan_job(self, job: Job) -> Plan:
        exact = job.program.path_control[job.toolpath.block] != PathControl.BLEND
        with job.stage("solve"):
            # legs alone could keep tangential limits, corners would not begin as they end
            machine = job.machine.model_copy(update={TANGENTIAL.key: None, TANGENTIAL_JERK.key: None})
            chain = self._chain(job.toolpath, machine, exact)
            motion = _motion(chain)
        made = job.deliver_in_time(motion, as_it_is=self.start_stop > 0)
        return job.plan(
            made,
            method="kinematic",
            corner="kinematic",
            solver="look-ahead",
            status=Status.OPTIMAL,
            sentence=_sentence(chain),
            grid_points=len(chain.path) + 1,
            notes=_curve_notes(job.toolpath, exact),
        )

    def _chain(self, toolpath: Toolpath, machine: Machine, exact: Array) -> _Chain:
        """Look ahead, arcs as chords where that is faster; `exact` (M,) blocks keep to the path."""
        curved = toolpath.arc >= 0
        whole = curved & (exact | _faster_whole(toolpath, machine))
        while True:
            chain = self._look_ahead(toolpath, machine, whole)
            slow = curved & ~whole & _slower_than_stops(chain, toolpath, machine)
            if not slow.any():
                return chain
            whole |= slow

    def _look_ahead(self, toolpath: Toolpath, machine: Machine, whole: Array) -> _Chain:
        """The chain with the arcs `whole` (M,) as they are, and all others as chords."""
        lines = parted_by_feed(chorded(toolpath, CHORD_FRACTION, whole))
        path = legs_of(lines)
        legs = leg_limits(path, lines, machine)
        ways = corner_passages(path, lines, legs, machine, self.start_stop)
        passage, time = look_ahead(legs, [fitted(way, legs) for way in ways])
        return _Chain(lines=lines, path=path, legs=legs, passage=passage, time=time)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Chain:
    """A program as a chain of n legs with n+1 joints, and how the look-ahead passes them."""

    lines: Toolpath  # with its arcs as chords
    path: Legs
    legs: np.recarray  # (n,) records of what they allow (baselines/lookahead/ramps.py)
    passage: np.recarray  # (n+1,) records of what was chosen at the joints
    time: FloatArray  # (n+1,) when each joint's corner is over, standstills not counted [s]

    @property
    def turns(self) -> Array:
        """(n+1,) True where there is a corner to be taken."""
        at = self.path.first
        return (self.lines.joint[at] == Joint.CORNER) & (self.lines.theta[at] >= COLLINEAR_ANGLE)


def _curve_notes(toolpath: Toolpath, exact: Array) -> list[str]:
    """The notes on splines whose blocks are among the `exact` (M,) ones."""
    found = np.flatnonzero((toolpath.curve >= 0) & exact)
    if not len(found):
        return []
    blocks = len(np.unique(toolpath.block[found]))
    return [
        f"line {toolpath.line[found[0]]}: G61 asks for the exact path; method kinematic runs splines as chords within the tolerance "
        f"({blocks} blocks)"
    ]


def _faster_whole(toolpath: Toolpath, machine: Machine) -> Array:
    """(M,) True for arcs that are faster from rest to rest than as chords at the speed of their corners."""
    arc = np.flatnonzero(toolpath.arc >= 0)
    whole = np.zeros(len(toolpath), bool)
    count, _ = arc_sagitta(toolpath, CHORD_FRACTION)
    chord = toolpath.length[arc] / count[arc]
    bend = np.minimum(toolpath.curvature[arc] * chord, np.pi)
    a, j = (machine.limits(q, toolpath.axes).max() / bend for q in ("acceleration", "jerk"))
    speed = np.minimum(corner.speed_from_approach(chord / 2, a, j), toolpath.feed[arc])
    limits = (limit[arc] for limit in block_limits(toolpath, machine))
    whole[arc] = toolpath.length[arc] / speed > rest_to_rest_times(toolpath.length[arc], *limits)
    return whole


def _slower_than_stops(chain: _Chain, toolpath: Toolpath, machine: Machine) -> Array:
    """(M,) True for the segments between two full stops that take longer than with stops at all blocks."""
    lines, at = chain.lines, chain.path.first
    stop = np.flatnonzero(lines.joint[at] == Joint.STOP)
    lasting = np.diff(chain.time[stop])
    first = np.searchsorted(toolpath.block, lines.block[np.minimum(at[stop], len(lines) - 1)])
    first[-1] = len(toolpath)
    times = rest_to_rest_times(toolpath.length, *block_limits(toolpath, machine))
    return np.repeat(lasting > np.add.reduceat(times, first[:-1]), np.diff(first))


def _motion(chain: _Chain) -> AxisMotion:
    """The pieces of legs and corners, along the axes."""
    pieces = corner_pieces(chain.passage, chain.legs, chain.path, chain.lines.dwell[chain.path.first])
    state, end = along_axes(pieces, chain.path, chain.lines), np.cumsum(pieces.duration)
    return AxisMotion.of(state, np.insert(end[:-1], 0, 0.0), float(end[-1]), chain.lines, pieces.segment)


def _sentence(chain: _Chain) -> str:
    """The plan's sentence on its corners."""
    turns, kind = chain.turns, chain.passage.kind
    if not turns.any():
        return "there is no corner between full stops; every run takes the shortest time"
    stops, steps = (int((turns & (kind == which)).sum()) for which in (JointKind.STOP, JointKind.PASS))
    text = f"{int(turns.sum()) - stops} corners are run through"
    text += f", {steps} of them with a step of velocity, which breaks acceleration and jerk" if steps else ""
    return text + (f", {stops} are full stops because that is faster" if stops else "")
