"""The circle through three points, for AT and RT.

With a = through - start and b = end - start the centre is start + c,

    c = ( (b_y |a|^2 - a_y |b|^2),  (a_x |b|^2 - b_x |a|^2) ) / (2 (a_x b_y - a_y b_x)),

and the arc turns left where a x b > 0.
"""

from __future__ import annotations

import math

from planner.nc.hpgl.drawing import Point

# Three points are on a line where the area of their parallelogram is below this share of |a| |b| [-]: a radius of 1e9 times the chord.
ON_A_LINE = 1e-9


def circle_through(start: Point, through: Point, end: Point) -> tuple[Point, float] | None:
    """Centre [mm] and sweep [rad], counter-clockwise positive, of the arc from `start` through `through` to `end`.

    A full circle over the diameter start - through where the end is the start; None where the points are on a line.
    """
    ax, ay = through[0] - start[0], through[1] - start[1]
    bx, by = end[0] - start[0], end[1] - start[1]
    a, b = math.hypot(ax, ay), math.hypot(bx, by)
    if b == 0.0 and a > 0.0:
        return (start[0] + ax / 2.0, start[1] + ay / 2.0), 2.0 * math.pi
    cross = ax * by - ay * bx
    if abs(cross) <= ON_A_LINE * a * b:
        return None
    cx = (by * a * a - ay * b * b) / (2.0 * cross)
    cy = (ax * b * b - bx * a * a) / (2.0 * cross)
    angle = math.atan2(by - cy, bx - cx) - math.atan2(-cy, -cx)
    sweep = angle % (2.0 * math.pi)
    return (start[0] + cx, start[1] + cy), sweep if cross > 0 else sweep - 2.0 * math.pi
