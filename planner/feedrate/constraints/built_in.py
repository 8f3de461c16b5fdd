"""The planner's own limits, by what they hold.

**Speeds**, caps of x = feed^2:

    feed <= F               programmed feed: the F word or the machine's largest feed
    |r'_k| feed <= v_k      axis velocities, so x <= min_k (v_k / r'_k)^2

At a point between two blocks the smaller F counts. With rotary axes F is the speed of the linear ones
(geometry/word_feed.py): on a curve that rounds a corner or a spline their part of the path is another one
than on the block, and F holds there too. Between the points r' turns; the share of the interval's `margin`
(samples.py) makes that good.

**What a curve bends by**, caps of x by the effective curvature kappa of an interval:

    kappa x <= A                        normal acceleration (paper 002, eq. (19))
    kappa x dt^2/8 <= eps_ch            chord error, dt^2/32 with cubics (eq. (19), approximate form)
    kappa x sum_i T_i^2/24 <= eps_fir   error of moving averages of lengths T_i behind the setpoints (papers 000/001, par. 21)
    feed kappa (sum_i T_i)/2 <= phi     phase lag: on a circle the filtered point runs behind by that delay (paper 001, par. 26)

A is the machine's (inf if it names none), and never more than what its axes give in the direction of the
path's normal, and what the error budget leaves of it (corners/budget.py). Between two setpoints the machine
cuts off the curve by the chord, all axes at once, where it runs "linear" and where it jumps ("hold"); a
"cubic" of both ends is off by a quarter of that at most, where the normal acceleration steps from nothing to
kappa x, as at the end of an arc. The form is rigorous, because the interpolator advances the arc length
feed*dt per period (docs/papers.md D). eps_ch and eps_fir are parts of the error budget (on_grid.py); where
the filters' error is measured (planning/optimal/behind_filters.py), what is found makes a cap of the same
name. The machine file names phi, or none (`Fir.phase_lag_max`); the judge does not look at it.

**Axis accelerations, jerks and powers**; the first two by differentiating r(s(t)):

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

**Along the path**, the tangential acceleration and jerk: |d feed/dt| <= A_t, the acceleration along the path
of x, y and z together, and |d2 feed/dt2| <= J_t, how fast that changes. With l the length run in x, y and z,
l' = dl/ds = |(r'_x, r'_y, r'_z)|, they are rows like those of an axis,

    | l' u + l'' x | <= A_t,     | l' j + 3 l'' feed u + l''' feed^3 | <= J_t,

where l' = 1 and the others are 0 if no other axes move, and of a motion in time with t = v/|v| of x, y and z

    | a.t | <= A_t,              | j.t + |a - (a.t) t|^2/|v| | <= J_t.

Rotary axes and u, v, w do not count: turning alone is not limited by them. No motion has more acceleration
than the norm of what x, y and z accelerate with: a limit above that is none, and nothing is done for it. The
jerk along a path that turns may be more than that of the axes together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import RAD_PER_DEG
from planner.corners.budget import NORMAL, chord_rate
from planner.feedrate.constraints.limit import AxisLimit, Cap, Limit, RowLimit, RowPoint, by_axis, over
from planner.feedrate.constraints.on_grid import OnGrid, Side
from planner.machine import LINEAR_AXES, TANGENTIAL, Machine
from planner.machine.user_limit import PathLimit, Place

JUMP = "curvature_jump"  # the name of the cap, with the axis behind it
REACHABLE = 1.0 - 1e-12  # of what the axes' own limits give at most: rounding [-]


class ProgrammedFeed(Limit):
    """feed <= F."""

    name, unit, order = "feed", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        feed_sq = self.inside(grid)
        cap = np.minimum(feed_sq[grid.left], feed_sq[grid.right])
        if set(grid.axes) - set(LINEAR_AXES):
            for side in (grid.left, grid.right):
                cap = np.minimum(cap, grid.feed_of_words(side) ** 2)
        yield Cap(self.name, cap)

    def inside(self, grid: OnGrid) -> FloatArray:
        return grid.samples.path.toolpath.feed[grid.samples.segment] ** 2


def feed_sq_max(d1: FloatArray, limits: FloatArray) -> tuple[FloatArray, Array]:
    """(P,) x <= min_k (v_k/|r'_k|)^2 [mm2/s2] for d1 (P, A), `limits` (A,); and the axis (P,)."""
    ratio = np.abs(d1) / limits
    axis = ratio.argmax(axis=1)
    return 1.0 / ratio[np.arange(len(d1)), axis] ** 2, axis


class AxisVelocity(AxisLimit):
    """|r'_k| feed <= v_k."""

    name, unit, order = "velocity", "mm/s", 1

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        bound, axis = feed_sq_max(grid.samples.d1, self.of(grid.machine, grid.axes))
        margin = grid.samples.margin
        bound = bound * (1.0 - np.maximum(margin[grid.left], margin[grid.right]))
        yield from by_axis(self.name, grid.axes, bound, axis)

    def inside(self, grid: OnGrid) -> FloatArray:
        return feed_sq_max(grid.samples.d1, self.of(grid.machine, grid.axes))[0]


def feed_sq_within(kappa: FloatArray, allowed: FloatArray | float, rate: float = 1.0) -> FloatArray:
    """(P,) kappa x rate <= allowed [mm2/s2], for curvatures (P,) [1/mm], `allowed` (P,) or a number; else inf."""
    return over(allowed, kappa * rate)


def feed_sq_of_filters(
    kappa: FloatArray, tol: FloatArray, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) kappa x sum T^2/24 <= tol [mm], averages of lengths T = time_constants [s]; else inf."""
    return over(tol, kappa * sum(T * T for T in time_constants) / 24.0)


def feed_sq_of_lag(
    kappa: FloatArray, angle: float, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) feed kappa sum T/2 <= angle [rad], a bound of feed^2; T = time_constants [s]; else inf."""
    return over(angle, kappa * sum(time_constants) / 2.0) ** 2


class NormalAcceleration(Limit):
    """kappa x <= A, on machines that name A."""

    name, unit, order = NORMAL, "mm/s2", 2
    key = NORMAL

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.normal_acceleration is not None:
            yield Cap(self.name, feed_sq_within(side.kappa, machine.normal_acceleration))


class ChordError(Limit):
    """kappa x dt^2/8 <= eps_ch."""

    name, unit, order = "chord_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        yield Cap(self.name, feed_sq_within(side.kappa, side.tol_chord, chord_rate(machine)))


class FilterError(Limit):
    """kappa x sum T^2/24 <= eps_fir, on machines with filters."""

    name, unit, order = "filter_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None:
            yield Cap(self.name, feed_sq_of_filters(side.kappa, side.tol_filter, machine.fir.time_constants))


class PhaseLag(Limit):
    """feed kappa sum T/2 <= phi, on machines with filters that name phi."""

    name, unit, order = "phase_lag", "rad", 1

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None and machine.fir.phase_lag_max is not None:
            angle = machine.fir.phase_lag_max * RAD_PER_DEG
            yield Cap(self.name, feed_sq_of_lag(side.kappa, angle, machine.fir.time_constants))


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


def binding(machine: Machine, axes: tuple[str, ...], acceleration: FloatArray) -> tuple[float, float]:
    """A_t [mm/s2] and J_t [mm/s3]; inf where none is named, and A_t where it is above what the axes give.

    acceleration : (A,) of the axes [mm/s2]
    """
    largest = machine.tangential_acceleration or np.inf
    reached = float(np.linalg.norm(acceleration[np.isin(axes, LINEAR_AXES)]))
    return np.inf if largest >= reached * REACHABLE else largest, machine.tangential_jerk or np.inf


class _Row(PathLimit):
    """Acceleration and jerk along the path of x, y and z, at most `largest` [mm/s2] and `fastest` [mm/s3]."""

    name, counts = TANGENTIAL, LINEAR_AXES

    def __init__(self, largest: float, fastest: float):
        self.largest, self.fastest = largest, fastest
        both = (AxisAcceleration.name, largest), (AxisJerk.name, fastest)
        self.bounded = tuple(name for name, bound in both if np.isfinite(bound))

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """The same everywhere [mm/s2], [mm/s3]."""
        return np.inf, self.largest, self.fastest


class TangentialAcceleration(Limit):
    """|l' u + l'' x| <= A_t, on machines that name A_t; `along` has the row of the jerk too."""

    name, unit, order = AxisAcceleration.called(TANGENTIAL), "mm/s2", 2
    key = "tangential_acceleration"

    def along(self, machine: Machine, axes: tuple[str, ...]) -> PathLimit | None:
        bounds = binding(machine, axes, machine.limits("acceleration", axes))
        return _Row(*bounds) if np.isfinite(bounds).any() else None


class TangentialJerk(Limit):
    """|l' j + 3 l'' feed u + l''' feed^3| <= J_t, on machines that name J_t."""

    name, unit, order = AxisJerk.called(TANGENTIAL), "mm/s3", 3
    key = "tangential_jerk"
