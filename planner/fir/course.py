"""The course: a program as straight legs between joints, in stretches between full stops.

Arcs become chords, collinear lines of one feed are one leg. Filters are empty at a full stop, so every stretch may have its own.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.geometry.chords import chorded, parted_by_feed
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine

# Share of the tolerance that the chords of arcs may use [-]. The filters' error on an arc grows with feed^2, so that this costs
# half of it in feed; a tenth of it would need three times as many chords.
CHORD_SHARE = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class Course:
    """R legs over A axes, R+1 joints, S stretches; joints first[k] .. first[k+1] belong to stretch k, its ends are full stops.

    lines     : the toolpath with its arcs as chords
    joint_at  : (R+1,) index of each joint among those of `lines`
    length    : (R,) [mm]
    direction : (R, A) unit vectors
    point     : (R+1, A) the joints [mm]
    s         : (R+1,) length from the start [mm]
    feed      : (R,) programmed feed, at most what the axes' velocities allow along the leg [mm/s]
    slower    : (R,) True where the program asks for less than on another leg of the stretch
    a_max     : (R,) acceleration along the leg that the axes allow [mm/s2]
    j_max     : (R,) jerk along the leg that the axes allow [mm/s3]
    tol       : (R+1,) contour error budget at the joint [mm]
    sin_half  : (R+1,) sine of half the turning angle at the joint, 0 at full stops
    first     : (S+1,)
    dwell     : (S+1,) standstill before the first stretch and after each [s]
    own       : lengths of the two filters that every stretch has [s]; None to choose them
    """

    lines: Toolpath
    joint_at: Array
    length: FloatArray
    direction: FloatArray
    point: FloatArray
    s: FloatArray
    feed: FloatArray
    slower: Array
    a_max: FloatArray
    j_max: FloatArray
    tol: FloatArray
    sin_half: FloatArray
    first: Array
    dwell: FloatArray
    own: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        legs, axes = len(self.length), len(self.lines.axes)
        freeze(self, "joint_at", np.int64, (legs + 1,))
        for name in ("length", "feed", "a_max", "j_max"):
            freeze(self, name, np.float64, (legs,))
        freeze(self, "direction", np.float64, (legs, axes))
        freeze(self, "slower", np.bool_, (legs,))
        for name in ("s", "tol", "sin_half"):
            freeze(self, name, np.float64, (legs + 1,))
        freeze(self, "point", np.float64, (legs + 1, axes))
        freeze(self, "first", np.int64, (None,))
        freeze(self, "dwell", np.float64, (len(self.first),))

    def __len__(self) -> int:
        return len(self.length)

    @property
    def stretches(self) -> int:
        """S."""
        return len(self.first) - 1

    @cached_property
    def stretch(self) -> Array:
        """(R,) stretch of each leg."""
        return np.repeat(np.arange(self.stretches), np.diff(self.first))

    @cached_property
    def inner(self) -> Array:
        """(R+1,) True at joints that are no full stops."""
        inner = np.ones(len(self) + 1, bool)
        inner[self.first] = False
        return inner

    def largest(self, value: FloatArray) -> FloatArray:
        """(S,) the largest of a value per leg (R,) in each stretch."""
        return np.maximum.reduceat(value, self.first[:-1])

    def total(self, value: FloatArray) -> FloatArray:
        """(S,) the sum of a value per leg (R,) over each stretch."""
        return np.add.reduceat(value, self.first[:-1])

    def pick(self, chosen: Array) -> Course:
        """The stretches `chosen` (S,), each shifted to where the one before ends, without the dwells: good for planning only."""
        stretch = np.flatnonzero(chosen)
        legs = np.concatenate([np.arange(self.first[k], self.first[k + 1]) for k in stretch])
        joints = np.append(legs, self.first[stretch[-1] + 1])
        length = self.length[legs]
        first = np.concatenate([[0], np.cumsum(np.diff(self.first)[stretch])])
        return Course(
            lines=self.lines,
            joint_at=self.joint_at[joints],
            length=length,
            direction=self.direction[legs],
            point=np.vstack(
                [
                    np.zeros((1, self.point.shape[1])),
                    np.cumsum(length[:, None] * self.direction[legs], axis=0),
                ]
            ),
            s=np.concatenate([[0.0], np.cumsum(length)]),
            feed=self.feed[legs],
            slower=self.slower[legs],
            a_max=self.a_max[legs],
            j_max=self.j_max[legs],
            tol=self.tol[joints],
            sin_half=self.sin_half[joints],
            first=first,
            dwell=np.zeros(len(first)),
            own=self.own,
        )

    def stopping(self, joints: Array) -> Course:
        """The same with full stops at the joints (n,) too."""
        first = np.union1d(self.first, joints)
        dwell = np.zeros(len(first))
        dwell[np.searchsorted(first, self.first)] = self.dwell
        sin_half = self.sin_half.copy()
        sin_half[joints] = 0.0
        return dataclasses.replace(self, first=first, dwell=dwell, sin_half=sin_half)


def course_of(toolpath: Toolpath, machine: Machine, own: tuple[float, float] | None = None) -> Course:
    """Lay out a toolpath as a course; `own`: lengths of the two filters [s], None to choose them."""
    lines = chorded(toolpath, CHORD_SHARE, np.zeros(len(toolpath), bool))
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
    return Course(
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
