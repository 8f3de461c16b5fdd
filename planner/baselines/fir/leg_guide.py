"""Paper 000's guide: a program as straight legs between joints. Arcs become chords, collinear lines of one feed are one leg."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.baselines.fir.guide import Guide, per_joint, per_leg
from planner.geometry.chords import chorded, parted_by_feed
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine

# Fraction of the tolerance that the chords of arcs may use [-]. The filters' error on an arc grows with feed^2, so that this costs
# half of it in feed.
CHORD_FRACTION = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class LegGuide(Guide):
    """The legs of a program, with what paper 000's rules need of them.

    lines     : the toolpath with its arcs as chords
    joint_at  : (R+1,) index of each joint among those of `lines`
    slower    : (R,) True where the program asks for less than on another leg of the run
    a_max     : (R,) acceleration along the leg that the axes allow [mm/s2]
    j_max     : (R,) jerk along the leg that the axes allow [mm/s3]
    tol       : (R+1,) contour error budget at the joint [mm]
    sin_half  : (R+1,) sine of half the turning angle at the joint, 0 at full stops
    """

    lines: Toolpath
    joint_at: Array = per_joint(np.int64)
    slower: Array = per_leg(np.bool_)
    a_max: FloatArray = per_leg()
    j_max: FloatArray = per_leg()
    tol: FloatArray = per_joint()
    sin_half: FloatArray = per_joint()

    @property
    def budget(self) -> FloatArray:
        """(R, 2) the tolerance of the nearer joint [mm]."""
        return np.stack([self.tol[:-1], self.tol[1:]], axis=1)

    def stopping(self, joints: Array) -> Self:
        """The same guide with full stops, without dwells, at the joints (n,) too."""
        first = np.union1d(self.first, joints)
        dwell = np.zeros(len(first))
        dwell[np.searchsorted(first, self.first)] = self.dwell
        sin_half = self.sin_half.copy()
        sin_half[joints] = 0.0
        return dataclasses.replace(self, first=first, dwell=dwell, sin_half=sin_half)


def guide_of_legs(toolpath: Toolpath, machine: Machine, own: tuple[float, float] | None = None) -> LegGuide:
    """The legs of a toolpath.

    own : lengths of the two filters of every run [s]; None to choose them
    """
    lines = chorded(toolpath, CHORD_FRACTION, np.zeros(len(toolpath), bool))
    legs = legs_of(parted_by_feed(lines))
    at = legs.first
    point = np.vstack([lines.start[at[:-1]], lines.end[-1:]])
    length = np.linalg.norm(np.diff(point, axis=0), axis=1)
    direction = np.diff(point, axis=0) / length[:, None]
    first = np.flatnonzero(lines.joint[at] == Joint.STOP)
    sin_half = np.zeros(len(point))
    sin_half[1:-1] = np.linalg.norm(np.diff(direction, axis=0), axis=1) / 2
    sin_half[first] = 0.0
    programmed = lines.feed[at[:-1]]
    most = np.repeat(np.maximum.reduceat(programmed, first[:-1]), np.diff(first))
    with np.errstate(divide="ignore", over="ignore"):  # infinite for axes that stand still
        v, a, j = (
            (machine.limits(q, lines.axes) / np.abs(direction)).min(axis=1)
            for q in ("velocity", "acceleration", "jerk")
        )
    return LegGuide(
        axes=lines.axes,
        lines=lines,
        joint_at=at,
        length=length,
        direction=direction,
        point=point,
        s=np.concatenate([[0.0], np.cumsum(length)]),
        feed=np.minimum(programmed, v),
        slower=programmed < most,
        a_max=a,
        j_max=j,
        tol=lines.tolerance[at],
        sin_half=sin_half,
        first=first,
        dwell=lines.dwell[at[first]],
        own=own,
    )
