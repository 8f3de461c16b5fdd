"""User units of a plotter file (IP and SC): how coordinates become plotter units.

IP gives the scaling points P1 and P2 in plotter units; SC the user coordinates that they shall have:

    SC xmin,xmax,ymin,ymax                     each axis by itself
    SC xmin,xmax,ymin,ymax,1[,left,bottom]     both axes alike, the smaller factor; what is left over lies to the left and
                                               below, in percent (50 each without the last two numbers)
    SC xmin,xfactor,ymin,yfactor,2             P1 and plotter units per user unit

Without IP the scaling points depend on the paper in the plotter, which a file does not know: SC is then refused.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from planner.nc.hpgl.instructions import FORMS

SAME_FACTOR = 1e-9  # of two axes [-]: the rounding of the file's numbers
# The fifth number of SC: what the scales of the two axes are.
_ANISOTROPIC, _ISOTROPIC, _POINT_FACTOR = 0.0, 1.0, 2.0
_MIDDLE = (50.0, 50.0)  # percent

Point = tuple[float, float]


class ScalingError(ValueError):
    """The scaling cannot be used; the text says why."""


@dataclass(frozen=True)
class Scaling:
    """plotter units = origin + factor * user units; p1, p2 are the scaling points in plotter units, None where unknown."""

    p1: Point | None = None
    p2: Point | None = None
    origin: Point = (0.0, 0.0)
    factor: Point = (1.0, 1.0)
    user: tuple[float, ...] = ()  # numbers of the SC in force

    def place(self, x: float, y: float) -> Point:
        """A point in user units, in plotter units."""
        return self.origin[0] + self.factor[0] * x, self.origin[1] + self.factor[1] * y

    def handedness(self) -> float:
        """1 where a left turn stays one, -1 where the scaling mirrors. Raises ScalingError where circles become ellipses."""
        fx, fy = self.factor
        if abs(abs(fx) - abs(fy)) > SAME_FACTOR * abs(fx):
            raise ScalingError(
                f"a circle becomes an ellipse: SC scales x by {fx:g} and y by {fy:g}; give both the same scale"
            )
        return math.copysign(1.0, fx * fy)

    def with_points(self, numbers: Sequence[float]) -> Scaling:
        """After IP. Raises ScalingError if an SC in force cannot be used with the new points."""
        p1 = p2 = None
        if numbers:
            p1 = numbers[0], numbers[1]
        if len(numbers) == 4:
            p2 = numbers[2], numbers[3]
        elif p1 is not None and self.p1 is not None and self.p2 is not None:  # P2 keeps its distance
            p2 = self.p2[0] + p1[0] - self.p1[0], self.p2[1] + p1[1] - self.p1[1]
        return dataclasses.replace(self, p1=p1, p2=p2).with_range(self.user)

    def with_range(self, numbers: Sequence[float]) -> Scaling:
        """After SC; without numbers scaling is off. Raises ScalingError."""
        if not numbers:
            return Scaling(self.p1, self.p2)
        kind = numbers[4] if len(numbers) > 4 else _ANISOTROPIC
        if kind not in (_ANISOTROPIC, _ISOTROPIC, _POINT_FACTOR):
            raise ScalingError(f"no scaling of type {kind:g}; allowed are 0, 1 and 2")
        if kind == _POINT_FACTOR:
            if self.p1 is None:
                raise ScalingError(_NO_POINTS)
            low, factor = (numbers[0], numbers[2]), (numbers[1], numbers[3])
            left_over = (0.0, 0.0)
        else:
            if self.p1 is None or self.p2 is None:
                raise ScalingError(_NO_POINTS)
            low, size = (numbers[0], numbers[2]), (numbers[1] - numbers[0], numbers[3] - numbers[2])
            if 0.0 in size:
                raise ScalingError(f"a range of user units is empty; write {FORMS['SC']}")
            window = self.p2[0] - self.p1[0], self.p2[1] - self.p1[1]
            factor, left_over = _factors(window, size, numbers, kind)
        if 0.0 in factor:
            raise ScalingError("a scale of 0 leaves nothing of the drawing; check IP and SC")
        origin = tuple(
            p + rest - f * u for p, rest, f, u in zip(self.p1, left_over, factor, low, strict=True)
        )
        return Scaling(self.p1, self.p2, (origin[0], origin[1]), factor, tuple(numbers))


_NO_POINTS = (
    "user units without IP: where they lie depends on the paper in the plotter; write IP with both scaling points before it, or "
    "export in plotter units"
)


def _factors(window: Point, size: Point, numbers: Sequence[float], kind: float) -> tuple[Point, Point]:
    """Plotter units per user unit, and what is left over of the window before the drawing [plotter units]."""
    fx, fy = window[0] / size[0], window[1] / size[1]
    if kind != _ISOTROPIC:
        return (fx, fy), (0.0, 0.0)
    both = min(abs(fx), abs(fy))
    factor = math.copysign(both, fx), math.copysign(both, fy)
    left, bottom = numbers[5:7] if len(numbers) == 7 else _MIDDLE
    rest = (
        (window[0] - factor[0] * size[0]) * left / 100.0,
        (window[1] - factor[1] * size[1]) * bottom / 100.0,
    )
    return factor, rest
