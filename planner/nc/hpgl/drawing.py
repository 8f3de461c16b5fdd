"""User units of a plotter file.

IP gives the scaling points P1 and P2 in plotter units, SC their user
coordinates:

    SC xmin,xmax,ymin,ymax                     each axis by itself
    SC xmin,xmax,ymin,ymax,1[,left,bottom]     both axes alike, the smaller factor; what is left over lies to the left and
                                               below, in percent (50 each without the last two numbers)
    SC xmin,xfactor,ymin,yfactor,2             P1 and plotter units per user unit
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from planner.nc.hpgl.instructions import FORMS

Point = tuple[float, float]
SAME_FACTOR = 1e-9  # of two axes [-]: the rounding of the file's numbers
# The fifth number of SC: what the scales of the two axes are.
_ANISOTROPIC, _ISOTROPIC, _POINT_FACTOR = 0.0, 1.0, 2.0
_MIDDLE = (50.0, 50.0)  # percent
_NO_POINTS = (
    "user units without IP: where they lie depends on the paper in the plotter; write IP with both scaling points before it, or "
    "export in plotter units"
)


class NotDrawn(ValueError):
    """The instruction cannot be executed; the text says why."""


@dataclass(frozen=True)
class Scaling:
    """plotter units = origin + factor * user units;  p1, p2 : scaling points, None for unknown."""

    p1: Point | None = None
    p2: Point | None = None
    origin: Point = (0.0, 0.0)
    factor: Point = (1.0, 1.0)
    user: tuple[float, ...] = ()  # numbers of the SC in force

    def place(self, x: float, y: float) -> Point:
        """A point in user units, in plotter units."""
        return self.origin[0] + self.factor[0] * x, self.origin[1] + self.factor[1] * y

    def handedness(self) -> float:
        """1 where a left turn stays one, -1 where it is mirrored. Raises NotDrawn for ellipses."""
        fx, fy = self.factor
        if abs(abs(fx) - abs(fy)) > SAME_FACTOR * abs(fx):
            scales = f"SC scales x by {fx:g} and y by {fy:g}"
            raise NotDrawn(f"a circle becomes an ellipse: {scales}; give both the same scale")
        return math.copysign(1.0, fx * fy)

    def with_points(self, numbers: Sequence[float]) -> Scaling:
        """After IP. Raises NotDrawn if an SC in force cannot be used with the new points."""
        p1 = (numbers[0], numbers[1]) if numbers else None
        p2 = (numbers[2], numbers[3]) if len(numbers) == 4 else None
        # P2 keeps its distance
        if p2 is None and p1 is not None and self.p1 is not None and self.p2 is not None:
            p2 = self.p2[0] + p1[0] - self.p1[0], self.p2[1] + p1[1] - self.p1[1]
        return dataclasses.replace(self, p1=p1, p2=p2).with_range(self.user)

    def with_range(self, numbers: Sequence[float]) -> Scaling:
        """After SC; without numbers scaling is off. Raises NotDrawn."""
        if not numbers:
            return Scaling(self.p1, self.p2)
        kind = numbers[4] if len(numbers) > 4 else _ANISOTROPIC
        if kind not in (_ANISOTROPIC, _ISOTROPIC, _POINT_FACTOR):
            raise NotDrawn(f"no scaling of type {kind:g}; allowed are 0, 1 and 2")
        if self.p1 is None or (self.p2 is None and kind != _POINT_FACTOR):
            raise NotDrawn(_NO_POINTS)
        if self.p2 is None or kind == _POINT_FACTOR:
            factor, left_over = (numbers[1], numbers[3]), (0.0, 0.0)
        else:
            size = numbers[1] - numbers[0], numbers[3] - numbers[2]
            if 0.0 in size:
                raise NotDrawn(f"a range of user units is empty; write {FORMS['SC']}")
            window = self.p2[0] - self.p1[0], self.p2[1] - self.p1[1]
            factor, left_over = _factors(window, size, numbers, kind)
        if 0.0 in factor:
            raise NotDrawn("a scale of 0 leaves nothing of the drawing; check IP and SC")
        x, y = (self.p1[k] + left_over[k] - factor[k] * numbers[2 * k] for k in range(2))
        return Scaling(self.p1, self.p2, (x, y), factor, tuple(numbers))


def _factors(window: Point, size: Point, numbers: Sequence[float], kind: float) -> tuple[Point, Point]:
    """Plotter units per user unit, and what is left over of the window before the drawing [plotter units]."""
    fx, fy = window[0] / size[0], window[1] / size[1]
    if kind != _ISOTROPIC:
        return (fx, fy), (0.0, 0.0)
    both = min(abs(fx), abs(fy))
    factor = math.copysign(both, fx), math.copysign(both, fy)
    before = numbers[5:7] if len(numbers) == 7 else _MIDDLE
    x, y = ((window[k] - factor[k] * size[k]) * before[k] / 100.0 for k in range(2))
    return factor, (x, y)
