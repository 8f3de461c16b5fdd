"""The smooth path: the legs of a toolpath with each corner rounded within its tolerance.

Corners are data, not objects. For each of the R+1 joints between legs the record holds how far the corner
reaches back (d), the parameters of its shape, what it uses of the tolerance, and the normal acceleration that
is left for the motion.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.corners.blend import BEND_MAX, Shape, error_from_middle, middle_from_tolerance
from planner.corners.budget import allocate, error_rate, normal_at_corners, normal_within_budget
from planner.corners.sharing import share_legs
from planner.geometry.legs import Legs, legs_of
from planner.geometry.spline import Spline, no_spline
from planner.geometry.spline_joints import passed_places
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine


class CornerFamily(Protocol):
    """Corners at n given joints: tangent length d and middle value m by each other (corners/blend.py)."""

    def reach(self, middle: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) tangent lengths d [mm] for middle values m (n,) [mm] at feeds `feed` (n,) [mm/s]."""
        ...

    def middle(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) middle values m [mm] for tangent lengths d = `reach` (n,) [mm] at feeds `feed` (n,) [mm/s]."""
        ...

    def params(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n, 4) parameters for tangent lengths d = `reach` (n,) [mm] at feeds `feed` (n,) [mm/s]."""
        ...


class CornerShape(Protocol):
    """A shape of corners. To add one: docs/algorithm.md."""

    name: str
    shape: Shape

    def at(self, change: FloatArray) -> CornerFamily:
        """The corners at n joints where the directions of the axes change by `change` (n, A)."""
        ...

    def breaks(self, params: FloatArray) -> tuple[float, ...]:
        """Parameters w in (0, 1) of a corner with these `params` (4,) at which two of its curves meet."""
        ...


# A leg whose free part is a smaller fraction of it is closed by scaling up one of its corners [-].
CLOSE = 1e-4
# Curvatures are the same below this fraction of the larger one [-]: arc centres are printed to 1e-4.
SAME_CURVATURE = 1e-6


@dataclass(frozen=True, eq=False, kw_only=True)
class SmoothPath:
    """Legs and corners of a job; R legs, R+1 joints between and around them."""

    toolpath: Toolpath
    legs: Legs
    corner: CornerShape
    joint: Array  # (R+1,) `Joint`: STOP, SMOOTH (tangent, passed as it is) or CORNER (blended)
    d: FloatArray  # (R+1,) tangent length of the corner [mm]; 0 where there is none
    params: FloatArray  # (R+1, 4) parameters of the corner's shape
    # (R+1, 2) factors on the tangent lengths before and after the vertex, 1 or a little more (`CLOSE`)
    scale: FloatArray
    tol: FloatArray  # (R+1,) contour error budget eps [mm]
    tol_ap: FloatArray  # (R+1,) what the rounding uses of it, E(m) [mm]
    normal_max: FloatArray  # (R+1,) largest kappa feed^2 within the corner [mm/s2] (eq. (18)-(20))
    spline: Spline  # runs of joints that are replaced by curves, where d is 0

    def __post_init__(self) -> None:
        joints = len(self.legs) + 1
        freeze(self, "joint", np.uint8, (joints,))
        freeze(self, "params", np.float64, (joints, 4))
        freeze(self, "scale", np.float64, (joints, 2))
        freeze(self, "d tol tol_ap normal_max", np.float64, (joints,))

    @property
    def d_in(self) -> FloatArray:
        """(R+1,) what corner or spline take of the leg before each joint [mm]."""
        taken, spline, length = self.d * self.scale[:, 0], self.spline, self.legs.length
        inside = self._inside_runs()
        taken[inside] = length[inside - 1]
        taken[spline.joint_first] = length[spline.joint_first - 1] - spline.x_first
        return taken

    @property
    def d_out(self) -> FloatArray:
        """(R+1,) what corner or spline take of the leg after each joint [mm]."""
        taken = self.d * self.scale[:, 1]
        taken[self.spline.joint_last] = self.spline.x_last
        return taken

    @property
    def run(self) -> Array:
        """(R+1,) the run of the spline that begins before each joint, or -1."""
        run = np.full(len(self.d), -1)
        run[self.spline.joint_first] = np.arange(len(self.spline))
        return run

    def _inside_runs(self) -> Array:
        """Joints of runs but for the first of each."""
        count = self.spline.joint_last - self.spline.joint_first
        first = np.repeat(self.spline.joint_first - (np.cumsum(count) - count), count)
        return first + np.arange(count.sum()) + 1

    @cached_property
    def passed(self) -> FloatArray:
        """(M+1,) where the path passes each segment's start, like `Legs.place` [mm] but on splines."""
        return passed_places(self.toolpath, self.legs, self.spline)

    @property
    def theta(self) -> FloatArray:
        """(R+1,) turning angle at each joint [rad]."""
        return self.toolpath.theta[self.legs.first]

    def part(self, pieces: Array) -> SmoothPath:
        """Some pieces (G,) between full stops one after the other, of a path without splines."""
        if len(self.spline):
            raise ValueError("SmoothPath.part: of a path without splines only")
        stop = np.flatnonzero(self.joint == Joint.STOP)
        legs = np.repeat(pieces, np.diff(stop))
        joints = np.append(True, legs)  # with the joint behind each leg
        # the path may stop where the program does not
        parted = self.toolpath.with_joints(self.legs.first[stop], Joint.STOP)
        toolpath = parted.part(np.repeat(legs, np.diff(self.legs.first)))
        columns = {name: getattr(self, name)[joints] for name in ("joint", "d", "params", "scale")}
        columns |= {name: getattr(self, name)[joints] for name in ("tol", "tol_ap", "normal_max")}
        return dataclasses.replace(self, toolpath=toolpath, legs=legs_of(toolpath), **columns)


def round_corners(
    toolpath: Toolpath,
    machine: Machine,
    corner: CornerShape,
    *,
    blend_tangents: bool = False,
    free: float = 0.0,
) -> SmoothPath:
    """Blend every corner of the toolpath within its budget; where it turns right back the path has a full stop.

    blend_tangents : blend tangent joints too where the curvature jumps, as a jerk-limited motion needs it;
                     such a corner has theta = 0, bends off both legs within the tolerance, and has no jump
                     left. Where the path is to be followed exactly (G61) it is a full stop
    free           : fraction of every leg that corners leave free [-], for changes of speed between them

    Raises InputError if the machine lacks an axis of the toolpath.
    """
    legs = legs_of(toolpath)
    at = legs.first
    joint = toolpath.resting().joint[at].copy()
    if blend_tangents:
        jumps = (joint == Joint.SMOOTH) & curvature_jumps(toolpath, at)
        joint[jumps] = np.where(_exact(toolpath, at[jumps]), Joint.STOP, Joint.CORNER)
    blend = joint == Joint.CORNER
    theta, tol = toolpath.theta[at], toolpath.tolerance[at]
    sin_half = np.sin(theta / 2)
    before, after = _neighbours(at, len(toolpath))
    curvature = toolpath.curvature[before] + toolpath.curvature[after]
    feed = np.minimum(_finite_feed(toolpath, machine, before), _finite_feed(toolpath, machine, after))

    u1, u2 = toolpath.tangent_end[before], toolpath.tangent_start[after]
    reachable = normal_at_corners(machine, toolpath.axes, u1, u2, curvature)
    rate = error_rate(machine)

    usable = (1.0 - free) * legs.length
    longest = usable[np.clip([np.arange(len(at)) - 1, np.arange(len(at))], 0, len(legs) - 1)].min(axis=0)
    wanted = np.zeros(len(at))
    middle = middle_from_tolerance(allocate(tol, reachable, rate), sin_half, curvature)[blend]
    bent = np.zeros(len(at))  # what the legs' curvature adds to sin(theta/2) in E(m) = 2 (s + bent) m
    bent[blend] = 0.5 * curvature[blend] * np.minimum(middle, longest[blend])
    across = np.abs(toolpath.tangent_start[after] - toolpath.tangent_end[before]) + 2.0 * bent[:, None]
    corners = corner.at(across[blend])
    wanted[blend] = np.minimum(corners.reach(middle, feed[blend]), longest[blend])
    bend = np.maximum(toolpath.curvature[before], toolpath.curvature[after])
    room = np.maximum(BEND_MAX - theta, 0.0)
    wanted = np.minimum(wanted, np.divide(room, bend, out=np.full(len(at), np.inf), where=bend > 0))
    ease = np.cos(theta / 2) ** 2 / np.maximum(sin_half + bent, 1e-12)
    d = share_legs(wanted / (1.0 + 2.0 * CLOSE), np.maximum(ease, 1e-12), usable)
    scale = _close_legs(d, legs.length)

    params = np.zeros((len(at), 4))
    params[blend] = corners.params(d[blend], feed[blend])
    tol_ap = np.zeros(len(at))
    middle = corners.middle(d[blend], feed[blend]) * scale[blend].max(axis=1)
    tol_ap[blend] = error_from_middle(middle, sin_half[blend], curvature[blend])
    return SmoothPath(
        toolpath=toolpath,
        legs=legs,
        corner=corner,
        joint=joint,
        d=d,
        params=params,
        scale=scale,
        tol=tol,
        tol_ap=tol_ap,
        normal_max=normal_within_budget(tol, tol_ap, reachable, rate),
        spline=no_spline(len(toolpath.axes)),
    )


def _close_legs(d: FloatArray, length: FloatArray) -> FloatArray:
    """(R+1, 2) factors on tangent lengths that close legs with next to nothing between their corners."""
    scale = np.ones((len(d), 2))
    free = length - d[:-1] - d[1:]
    leg = np.flatnonzero(free < CLOSE * length)
    before = d[leg] >= d[leg + 1]
    left, right = leg[before], leg[~before]
    scale[left, 1] = 1.0 + free[left] / d[left]
    scale[right + 1, 0] = 1.0 + free[right] / d[right + 1]
    return scale


def curvature_jumps(toolpath: Toolpath, at: Array) -> Array:
    """(R+1,) True where the curvature vector differs across the joints `at`."""
    arcs, curve = toolpath.arcs, np.flatnonzero(toolpath.curve >= 0)
    size = arcs.radius * arcs.rate**2
    angle = arcs.rate * toolpath.length[toolpath.arc >= 0]
    vectors = np.zeros((2, *toolpath.start.shape))  # at the start and at the end of every segment
    curved = toolpath.arc >= 0
    vectors[0, curved] = -size[:, None] * arcs.e1
    vectors[1, curved] = -size[:, None] * (
        np.cos(angle)[:, None] * arcs.e1 + np.sin(angle)[:, None] * arcs.e2
    )
    row, length = toolpath.curve[curve], toolpath.length[curve]
    vectors[0, curve] = toolpath.curves.at(row, length, np.zeros(len(row)))[:, 2]
    vectors[1, curve] = toolpath.curves.at(row, length, length)[:, 2]
    before, after = _neighbours(at, len(toolpath))
    jump = np.linalg.norm(vectors[0, after] - vectors[1, before], axis=1)
    return jump > SAME_CURVATURE * np.maximum(toolpath.curvature[before], toolpath.curvature[after])


def _exact(toolpath: Toolpath, at: Array) -> Array:
    """(n,) True for the joints `at` (n,) beside a segment that is to be followed exactly."""
    before, after = _neighbours(at, len(toolpath))
    exact: Array = toolpath.exact[before] | toolpath.exact[after]
    return exact


def exact_stops(toolpath: Toolpath) -> Array:
    """(n,) joints that are full stops for motions with limited jerk alone: tangent ones where the curvature
    jumps and the path is to be followed exactly."""
    at = np.arange(len(toolpath) + 1)
    found: Array = np.flatnonzero(
        (toolpath.joint == Joint.SMOOTH) & _exact(toolpath, at) & curvature_jumps(toolpath, at)
    )
    return found


def _neighbours(at: Array, segments: int) -> tuple[Array, Array]:
    """Segments before and after each joint; at the path's ends the only one there is."""
    return np.maximum(at - 1, 0), np.minimum(at, segments - 1)


def _finite_feed(toolpath: Toolpath, machine: Machine, segment: Array) -> FloatArray:
    """Programmed feed, on rapids what the fastest axis allows [mm/s]."""
    return np.minimum(toolpath.feed[segment], machine.limits("velocity", toolpath.axes).max())
