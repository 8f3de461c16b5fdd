"""NURBS curves: points and derivatives to the third order, arc length, and chords for an NC program.

A curve of degree p with control points P_i, weights w_i and knots u_i is r(u) = sum N_i w_i P_i / sum N_i w_i, on the domain
[u_p, u_n]. Numerator and denominator are polynomials between two knots (scipy's B-splines), the quotient's derivatives follow from
r w = n:

    r' = (n' - w' r)/w,    r'' = (n'' - 2 w' r' - w'' r)/w,    r''' = (n''' - 3 w' r'' - 3 w'' r' - w''' r)/w,

and those by the arc length s, with sigma = |r'| = ds/du, from

    sigma' = r'.r''/sigma,   sigma'' = (r''.r'' + r'.r''' - sigma'^2)/sigma,
    r_s = r'/sigma,   r_ss = (r'' - r_s sigma')/sigma^2,   r_sss = (r''' - 3 r_ss sigma sigma' - r_s sigma'')/sigma^3.

At a knot derivatives may differ on both sides, and at one of full multiplicity the tangent too: a kink.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.errors import InputError
from planner.geometry.build import COLLINEAR_ANGLE, turning_angle
from planner.machine import LINEAR_AXES
from planner.nc.bezier import DEGREE_MAX, cubic_pieces, homogeneous
from planner.nc.program import Kind, PathControl, Program, SplineTable

# Gauss points of an arc length, and steps of a knot span that they are applied to: good to 1e-9 of the butterfly's length (tested).
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
GAUSS_NODES, GAUSS_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0
LENGTH_STEPS = 64
# Chords: how many a span has to begin with, halvings at most, places at which the deviation of a chord is measured [fraction of the
# chord].
CHORDS_MIN, HALVINGS = 4, 40
MEASURED = (0.25, 0.5, 0.75)
# The deviation between these places may be larger; chords stay below this fraction of what is allowed [-].
CHORD_SAFETY = 0.9


@dataclass(frozen=True, eq=False, kw_only=True)
class Nurbs:
    """A NURBS curve over the first A linear axes.

    degree  : p >= 1
    points  : (n, A) control points [mm], A = 2 or 3
    knots   : (n + p + 1,) non-decreasing
    weights : (n,) > 0

    Raises InputError for data that do not define a curve.
    """

    degree: int
    points: FloatArray
    knots: FloatArray
    weights: FloatArray

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
    def breaks(self) -> FloatArray:
        """(m+1,) the different knots of the domain."""
        return np.unique(self.knots[self.degree : len(self.points) + 1])

    @cached_property
    def _polynomials(self) -> FloatArray:
        """(p+1, m, A+1) coefficients of numerator and denominator on each span, highest power first."""
        from scipy.interpolate import BSpline  # 0.3 s, and few programs have a NURBS

        homogeneous = np.column_stack([self.points * self.weights[:, None], self.weights])
        spline = BSpline(self.knots, homogeneous, self.degree)
        powers = range(self.degree, -1, -1)
        return np.array([spline(self.breaks[:-1], nu=power) / factorial(power) for power in powers])

    def at(self, u: FloatArray, *, before: bool = False) -> FloatArray:
        """Point and derivatives by u at the parameters u (n,).

        before : take the values just before a knot instead of just behind it

        Returns (n, 4, A): point [mm] and first to third derivative.
        """
        u = np.asarray(u, float)
        side: Any = "left" if before else "right"
        span = np.clip(np.searchsorted(self.breaks, u, side=side) - 1, 0, len(self.breaks) - 2)
        x, c = (u - self.breaks[span])[:, None], self._polynomials[:, span]
        value = np.zeros((4, *c.shape[1:]))
        for order in range(4):
            for k in range(self.degree - order + 1):
                power = self.degree - k
                factor = np.prod(np.arange(power - order + 1, power + 1, dtype=float))
                value[order] = value[order] * x + factor * c[k]
        n, w = value[..., :-1], value[..., -1:]
        r = n[0] / w[0]
        r1 = (n[1] - w[1] * r) / w[0]
        r2 = (n[2] - 2.0 * w[1] * r1 - w[2] * r) / w[0]
        r3 = (n[3] - 3.0 * w[1] * r2 - 3.0 * w[2] * r1 - w[3] * r) / w[0]
        return np.stack([r, r1, r2, r3], axis=1)

    def along(self, u: FloatArray, *, before: bool = False) -> FloatArray:
        """(n, 4, A) point [mm] and derivatives by the arc length at the parameters u (n,); `before` as of `at`."""
        r, r1, r2, r3 = (self.at(u, before=before)[:, k] for k in range(4))
        sigma = np.linalg.norm(r1, axis=1)[:, None]
        sigma1 = (r1 * r2).sum(axis=1)[:, None] / sigma
        sigma2 = ((r2**2 + r1 * r3).sum(axis=1)[:, None] - sigma1**2) / sigma
        s1 = r1 / sigma
        s2 = (r2 - s1 * sigma1) / sigma**2
        s3 = (r3 - 3.0 * s2 * sigma * sigma1 - s1 * sigma2) / sigma**3
        return np.stack([r, s1, s2, s3], axis=1)

    def length_between(self, u0: FloatArray, u1: FloatArray) -> FloatArray:
        """(n,) arc length between the parameters u0 and u1 (n,), each pair within one span [mm]."""
        u0, step = np.asarray(u0, float), np.asarray(u1, float) - u0
        inside = u0[:, None] + step[:, None] * GAUSS_NODES
        rate = np.linalg.norm(self.at(inside.ravel())[:, 1], axis=1).reshape(inside.shape)
        return step * (rate @ GAUSS_WEIGHTS)

    @cached_property
    def _lengths(self) -> tuple[FloatArray, FloatArray]:
        """Parameters, and the arc length up to them."""
        steps = np.linspace(self.breaks[:-1], self.breaks[1:], LENGTH_STEPS, endpoint=False, axis=1).ravel()
        u = np.append(steps, self.breaks[-1])
        return u, np.concatenate([[0.0], np.cumsum(self.length_between(u[:-1], u[1:]))])

    @property
    def length(self) -> float:
        """Length of the whole curve [mm]."""
        return float(self._lengths[1][-1])

    @cached_property
    def kinks(self) -> FloatArray:
        """(k,) parameters inside the domain at which the tangent jumps."""
        inner = self.breaks[1:-1]
        tangents = [self.at(inner, before=side)[:, 1] for side in (True, False)]
        units = [t / np.linalg.norm(t, axis=1, keepdims=True) for t in tangents]
        return inner[turning_angle(*units) > COLLINEAR_ANGLE]

    def stations(self, sagitta: float) -> FloatArray:
        """(k,) parameters, all knots among them, between which the chords leave the curve by at most `sagitta` [mm].

        Raises InputError unless that is positive.
        """
        if not sagitta > 0:
            raise InputError(f"chords with a deviation of {sagitta} mm; it must be positive")
        ends = np.linspace(self.breaks[:-1], self.breaks[1:], CHORDS_MIN, endpoint=False, axis=1).ravel()
        u = np.append(ends, self.breaks[-1])
        for _ in range(HALVINGS):
            wide = np.flatnonzero(self._deviation(u[:-1], u[1:]) > CHORD_SAFETY * sagitta)
            if not len(wide):
                break
            u = np.insert(u, wide + 1, 0.5 * (u[wide] + u[wide + 1]))
        return u

    def _deviation(self, u0: FloatArray, u1: FloatArray) -> FloatArray:
        """Distances of the curve from the chords between u0 and u1 (n,), the largest of three places."""
        start, end = self.at(u0)[:, 0], self.at(u1, before=True)[:, 0]
        chord = end - start
        size_sq = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
        worst = np.zeros(len(u0))
        for fraction in MEASURED:
            off = self.at(u0 + fraction * (u1 - u0))[:, 0] - start
            along = np.clip((off * chord).sum(axis=1) / size_sq, 0.0, 1.0)
            worst = np.maximum(worst, np.linalg.norm(off - along[:, None] * chord, axis=1))
        return worst

    def to_program(self, sagitta: float, feed: float, *, source: str = "NURBS") -> Program:
        """The curve as a program of G1 moves.

        sagitta : largest distance of a chord from the curve [mm]; its ends are on the curve
        feed    : programmed feed [mm/s]

        Raises InputError unless both are positive and finite.
        """
        if not 0 < feed < np.inf:
            raise InputError(f"feed {feed} mm/s; it must be positive and finite")
        points = self.at(self.stations(sagitta))[:, 0]
        return chords(points, self.axes, feed, source)

    def exact_program(self, feed: float, *, source: str = "NURBS") -> Program:
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
        program = chords(points[[0, -1], [0, -1]], self.axes, feed, source)
        splines = SplineTable(block=np.zeros(len(pieces)), points=points, weights=weights)
        return dataclasses.replace(program, kind=np.full(1, Kind.SPLINE), splines=splines)


def chords(points: FloatArray, axes: tuple[str, ...], feed: float, source: str) -> Program:
    """A program of G1 moves at `feed` [mm/s] through points (B+1, A) [mm]; the machine stands at the first of them."""
    blocks = len(points) - 1
    none: Array = np.zeros(0)
    return Program(
        source=source,
        axes=axes,
        start=points[0],
        kind=np.full(blocks, Kind.LINE),
        end=points[1:],
        feed=np.full(blocks, feed),
        dwell=np.zeros(blocks),
        line=np.arange(1, blocks + 1),
        path_control=np.full(blocks, PathControl.BLEND),
        tolerance=np.full(blocks, np.nan),
        arc_block=none,
        arc_center=np.zeros((0, len(axes))),
        arc_normal=none,
        arc_sweep=none,
    )
