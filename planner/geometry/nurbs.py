"""NURBS curves: points, and an NC program of the curve itself.

A curve of degree p with points P_i, weights w_i, knots u_i: r(u) = sum N_i w_i P_i / sum N_i w_i.
"""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.base.errors import InputError
from planner.machine import LINEAR_AXES
from planner.nc.bezier import DEGREE_MAX, cubic_pieces, homogeneous
from planner.nc.points import CURVE, program_of_points
from planner.nc.program import Kind, Program, SplineTable


@dataclass(frozen=True, eq=False, kw_only=True)
class Nurbs:
    """A NURBS curve over the first A linear axes.

    Raises InputError for data that do not define a curve.
    """

    degree: int  # p >= 1
    points: FloatArray  # (n, A) control points [mm], A = 2 or 3
    knots: FloatArray  # (n + p + 1,) non-decreasing
    weights: FloatArray  # (n,) > 0

    def __post_init__(self) -> None:
        freeze(self, "points", np.float64, (None, None))
        count, p = len(self.points), self.degree
        if p < 1 or count < p + 1:
            raise InputError(
                f"NURBS of degree {p} with {count} control points; needed are degree >= 1 and more points"
            )
        if self.points.shape[1] not in (2, 3):
            raise InputError(f"NURBS over {self.points.shape[1]} axes; allowed are 2 and 3")
        for name, size in (("knots", count + p + 1), ("weights", count)):
            given = np.shape(getattr(self, name))
            if given != (size,):
                raise InputError(
                    f"NURBS: {name} have the shape {given}; {count} points of degree {p} need {size}"
                )
            freeze(self, name, np.float64, (size,))
        if not (self.weights > 0).all():
            raise InputError(f"NURBS: weight {self.weights.min():g}; all must be positive")
        if not (np.diff(self.knots) >= 0).all() or not self.knots[p] < self.knots[count]:
            raise InputError(
                "NURBS: knots must not decrease, and the first and the last of the domain must differ"
            )
        inner = self.knots[(self.knots > self.knots[p]) & (self.knots < self.knots[count])]
        if np.unique(inner, return_counts=True)[1].max(initial=0) > p:
            raise InputError(f"NURBS: an inner knot occurs more than {p} times, which breaks the curve")

    @property
    def axes(self) -> tuple[str, ...]:
        """The axis letters."""
        return LINEAR_AXES[: self.points.shape[1]]

    @cached_property
    def _homogeneous(self) -> Any:
        """The spline of numerator and denominator."""
        from scipy.interpolate import BSpline  # 0.3 s, and few programs have a NURBS

        return BSpline(self.knots, homogeneous(self.points, self.weights), self.degree)

    def at(self, u: FloatArray) -> FloatArray:
        """(n, A) points [mm] at the parameters u (n,)."""
        value = self._homogeneous(u)
        points: FloatArray = value[..., :-1] / value[..., -1:]
        return points

    def exact_program(self, feed: float) -> Program:
        """The curve itself as a program of one block, as G6.2 is read: every method plans it.

        feed : programmed feed [mm/s]

        Raises InputError unless that is positive and finite, and for a degree above 3.
        """
        if not 0 < feed < np.inf:
            raise InputError(f"feed {feed} mm/s; it must be positive and finite")
        if self.degree > DEGREE_MAX:
            raise InputError(f"NURBS of degree {self.degree}; exact curves have degree 1, 2 or {DEGREE_MAX}")
        pieces = cubic_pieces(homogeneous(self.points, self.weights), self.knots, self.degree)
        points, weights = pieces[..., :-1] / pieces[..., -1:], pieces[..., -1]
        ends = points[[0, -1], [0, -1]]
        program = program_of_points(ends, np.full(1, feed), None, CURVE, self.axes)
        splines = SplineTable(block=np.zeros(len(pieces)), points=points, weights=weights)
        return dataclasses.replace(program, kind=np.full(1, Kind.SPLINE), splines=splines)
