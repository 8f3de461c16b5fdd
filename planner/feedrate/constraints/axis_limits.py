"""The limits of the axis accelerations, jerks and powers; the first two by differentiating r(s(t)):

    | r'_k u + r''_k x | <= a_k                                rows, at both ends of every interval, each with the r'' of its side
    | r''_k(s+) - r''_k(s-) | x <= a_k                         a cap where r'' jumps, as where a line meets an arc
    | r'_k j + 3 r''_k feed u + r'''_k feed^3 | <= j_k         rows, at both ends of every interval
    | v_k a_k | <= P_k                                         the power of a drive, in W for each kg that it moves

At a jump both rows of the point hold with the u of their intervals; the cap asks that the step in
acceleration itself be within the limit, too, so that setpoints across it show no more. At a constant speed, u
= j = 0, the jerks allow feed <= (j_k / |r'''_k|)^(1/3); methods of second order do not use them.

1 W/kg is 1 m2/s3, 1e6 mm2/s3; of rotary axes P is W for each kg m2 of their moment of inertia, rad2/s3. The
product of speed and acceleration is no row of a solver along a path, whose unknowns are the square of the feed
and its slope: the joint search keeps it (joint/laws.py), and what does not, is refused. An axis cannot exceed
what its velocity times its acceleration is: a limit above that is none.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limit import AxisLimit, Cap, RowLimit, RowPoint, by_axis, over
from planner.feedrate.constraints.on_grid import OnGrid
from planner.machine import Machine

JUMP = "curvature_jump"  # the name of the cap, with the axis behind it
REACHABLE = 1.0 - 1e-12  # of velocity times acceleration: rounding [-]


def feed_sq_at_jump(
    d2_left: FloatArray, d2_right: FloatArray, limits: FloatArray
) -> tuple[FloatArray, Array]:
    """(P,) |d2_right - d2_left| x <= limits for r'' (P, A) on both sides and every axis [mm2/s2]; also the
    index (P,) of the axis that limits."""
    ratio = np.abs(d2_right - d2_left) / limits
    axis = ratio.argmax(axis=1)
    return over(1.0, ratio[np.arange(len(ratio)), axis]), axis


def feed_sq_at_constant_speed(d3: FloatArray, limits: FloatArray) -> FloatArray:
    """(P,) x <= min_k (j_k/|r'''_k|)^(2/3) [mm2/s2]; r''' in d3 (P, A), limits (P, A) or (A,); or inf."""
    with np.errstate(divide="ignore"):
        return (np.abs(d3) / limits).max(axis=1) ** (-2.0 / 3.0)


class AxisAcceleration(RowLimit):
    """|r'_k u + r''_k x| <= a_k."""

    name, unit, order = "acceleration", "mm/s2", 2

    def at_jumps(self, grid: OnGrid) -> Iterator[Cap]:
        jump, axis = feed_sq_at_jump(*grid.jumps, self.of(grid.machine, grid.axes))
        yield from by_axis(JUMP, grid.axes, jump, axis)

    def row(self, at: RowPoint) -> FloatArray:
        return at.d1 * at.u + at.d2 * at.x

    @staticmethod
    def called_at_jump(axis: str) -> str:
        """The name of the cap with the axis: "curvature_jump.x"."""
        return f"{JUMP}.{axis}"


class AxisJerk(RowLimit):
    """|r'_k j + 3 r''_k feed u + r'''_k feed^3| <= j_k."""

    name, unit, order = "jerk", "mm/s3", 3

    def row(self, at: RowPoint) -> FloatArray:
        return at.d1 * at.jerk + np.sqrt(at.x) * (3.0 * at.d2 * at.u + at.d3 * at.x)


class DrivePower(AxisLimit):
    """|v a| <= P, on machines that name P."""

    name, unit, order = "power", "W/kg", 3

    @classmethod
    def of(cls, machine: Machine, axes: tuple[str, ...]) -> FloatArray:
        """(A,) the limits of the axes [mm2/s3]; inf where none is named, and where none can be reached."""
        most = machine.limits("velocity", axes) * machine.limits("acceleration", axes)
        named = machine.powers(axes)
        return np.where(named < most * REACHABLE, named, np.inf)
