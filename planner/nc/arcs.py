"""Centre and sweep of an arc from I J K or R, with the tolerances of RS274NGC as LinuxCNC applies them.

With r0 and r1 the distances of start p0 and end p1 from the centre, an arc is refused where a radius is below
RADIUS_MIN, and where

    |r0 - r1| > 100 T      or      |r0 - r1| > T  and  |r0 - r1| > 0.001 max(r0, r1),      T = CLOSURE

With R the centre lies on the perpendicular bisector of the chord of half length h, at sqrt(R^2 - h^2) from
it; R > 0 means at most half a turn, R < 0 more. h may exceed |R| by RADIUS_MIN, and where they agree to
HALF_CIRCLE the centre is the chord's middle: the square root would turn a rounding of 1e-13 into 4e-7.

The sweep is in (0, 2 pi]. An arc about a centre is a full turn where p1 is p0 to SAME_PLACE, as in LinuxCNC's
motion (pmCircleInit goes by a length, not by an angle). P adds P - 1 turns. Planes are right-handed: (x, y)
about z, (z, x) about y, (y, z) about x.
"""

import cmath
import math
from dataclasses import dataclass
from typing import NamedTuple

from planner.base.arrays import FloatArray
from planner.base.units import MM_PER_INCH

AXES = "xyz"
IN_PLANE = {2: (0, 1), 1: (2, 0), 0: (1, 2)}  # the plane's axes by its normal, right-handed
PLANES: dict[float, int] = {17: 2, 18: 1, 19: 0}  # normals by the G codes of their planes
# By programmed unit [mm]; LinuxCNC's own numbers, found again by bisection on it.
CLOSURE = {1.0: 0.02 * math.sqrt(2.0), MM_PER_INCH: 0.002 * math.sqrt(2.0) * MM_PER_INCH}
RADIUS_MIN = {1.0: 0.00127, MM_PER_INCH: 0.00005 * MM_PER_INCH}
CLOSURE_RELATIVE = 1e-3
HALF_CIRCLE = 1e-12  # relative
# two points are one [mm]: far below the finest digit of programs, far above the rounding of sums
SAME_PLACE = 1e-7
# Three points are on a line where the area of their parallelogram is below this share of that of a rectangle [-]: a
# radius of 1e9 times the chord.
ON_A_LINE = 1e-9
# Below this angle [rad] some controls make a full turn of an arc (grbl 5e-7, previews 1e-6); twice the
# rounding of a turn written out.
FULL_TURN = 1e-6


class ArcError(ValueError):
    """The arc's words contradict each other; the text says how, in mm."""


@dataclass(frozen=True)
class Arc:
    """centre : (3,), axially at the start [mm];  sweep [rad], positive counter-clockwise about the normal."""

    centre: FloatArray
    sweep: float


class ArcWay(NamedTuple):
    """How an arc leads from its start to its end."""

    normal: int  # index of the axis normal to its plane
    clockwise: bool
    turns: int  # 1 for less than a full turn, one more for every further turn
    unit: float  # mm per programmed length unit, which decides how far start and end may be off one circle


def arc_from_centre(start: FloatArray, end: FloatArray, centre: FloatArray, way: ArcWay) -> Arc:
    """The arc from start to end about a centre, all (3,) [mm]. Raises ArcError if it does not close."""
    fault = not_closed(start, end, centre, way.normal, way.unit)
    if fault:
        raise ArcError(fault)
    return Arc(centre, _sweep(start, end, centre, way))


def arc_from_radius(start: FloatArray, end: FloatArray, radius: float, way: ArcWay) -> Arc:
    """The arc of a given radius [mm], more than half a turn if it is negative, from start (3,) to end (3,)
    [mm]. Raises ArcError if there is none."""
    normal, clockwise, turns, unit = way
    a, b = IN_PLANE[normal]
    da, db = end[a] - start[a], end[b] - start[b]
    half, size = math.hypot(da, db) / 2.0, abs(radius)
    if half == 0.0:
        raise ArcError("an arc with R must not end where it starts; write a full circle with I J K")
    if half - size > RADIUS_MIN[unit] or size == 0.0:
        away = f"radius {size:.6g} mm does not reach the end point, which is {2 * half:.6g} mm away"
        least = f"at least {half:.6g} mm is needed (rounding of {RADIUS_MIN[unit]:.3g} mm allowed)"
        raise ArcError(f"{away}; {least}")
    height = math.sqrt((size - half) * (size + half)) if half < size * (1.0 - HALF_CIRCLE) else 0.0
    # left of the chord for a counter-clockwise arc of less than half a turn
    left = height if clockwise == (radius < 0) else -height
    centre = start.copy()
    centre[a] = (start[a] + end[a]) / 2.0 - left * db / (2.0 * half)
    centre[b] = (start[b] + end[b]) / 2.0 + left * da / (2.0 * half)
    angle = 2.0 * math.asin(min(half / size, 1.0)) if height else math.pi
    angle = (angle if radius > 0.0 else 2.0 * math.pi - angle) + 2.0 * math.pi * (turns - 1)
    return Arc(centre, -angle if clockwise else angle)


def not_closed(start: FloatArray, end: FloatArray, centre: FloatArray, normal: int, unit: float) -> str:
    """Why start and end do not lie on one circle about the centre, (3,) each [mm]; empty where they do."""
    a, b = IN_PLANE[normal]
    r0 = math.hypot(start[a] - centre[a], start[b] - centre[b])
    r1 = math.hypot(end[a] - centre[a], end[b] - centre[b])
    radii = f"the arc has radius {r0:.6g} mm at its start and {r1:.6g} mm at its end"
    if r0 < RADIUS_MIN[unit] or r1 < RADIUS_MIN[unit]:
        return f"{radii}; at least {RADIUS_MIN[unit]:.3g} mm"
    gap, closure = abs(r0 - r1), CLOSURE[unit]
    allowed = min(100.0 * closure, max(closure, CLOSURE_RELATIVE * max(r0, r1)))
    centred = f"(centre at {AXES[a]} {centre[a]:.6g}, {AXES[b]} {centre[b]:.6g})"
    apart = f"{radii}: {gap:.6g} mm apart, allowed are {allowed:.6g} mm {centred}"
    return apart if gap > allowed else ""


def _sweep(start: FloatArray, end: FloatArray, centre: FloatArray, way: ArcWay) -> float:
    normal, clockwise, turns, _ = way
    a, b = IN_PLANE[normal]
    ua, ub = start[a] - centre[a], start[b] - centre[b]
    da, db = end[a] - start[a], end[b] - start[b]
    # the cross product with the chord, not with the other radius: that loses the digits of the chord where
    # the radius is large
    angle = math.atan2(ua * db - ub * da, ua * (ua + da) + ub * (ub + db))
    if clockwise:
        angle = -angle
    if math.hypot(da, db) <= SAME_PLACE:
        angle = 2.0 * math.pi
    elif angle <= 0.0:
        angle += 2.0 * math.pi
    angle += 2.0 * math.pi * (turns - 1)
    return -angle if clockwise else angle


def in_plane(point: FloatArray, normal: int) -> complex:
    """A point (3,) in the plane of a normal axis."""
    a, b = IN_PLANE[normal]
    return complex(point[a], point[b])


def at_place(place: complex, others: FloatArray, normal: int) -> FloatArray:
    """(3,) a point of the plane, with the coordinate along the normal of `others`."""
    point = others.copy()
    a, b = IN_PLANE[normal]
    point[a], point[b] = place.real, place.imag
    return point


def arc_through(start: complex, through: complex, end: complex) -> tuple[complex, float] | None:
    """Centre and sweep [rad], counter-clockwise positive, of the arc from `start` through `through` to `end` in a plane; a full
    turn over the diameter start - through where the end is the start. None where the points are on a line.

    With a = through - start, b = end - start the centre is start + i (|b|^2 a - |a|^2 b) / (2 a x b), and it turns left
    where a x b > 0.
    """
    a, b = through - start, end - start
    if b == 0.0 and a != 0.0:
        return start + a / 2.0, 2.0 * math.pi
    cross = (a.conjugate() * b).imag
    if abs(cross) <= ON_A_LINE * abs(a) * abs(b):
        return None
    spoke = (abs(b) ** 2 * a - abs(a) ** 2 * b) * 0.5j / cross
    sweep = cmath.phase((b - spoke) / -spoke) % (2.0 * math.pi)
    return start + spoke, sweep if cross > 0 else sweep - 2.0 * math.pi
