"""Feedrate problems on smooth curves, made directly from splines: what solvers with jerk limits are compared on.

    random_path(seed)     2 to 6 axes, 200 to 2000 points, jerk from tight to loose
    copp_spline(seed)     the random splines that the authors of the package copp publish times for (tests/test_random_spline.rs)
    nurbs(name, points)   the butterfly and the trident of curves.json
    long_path(points)     3 axes, for how solvers grow

A curve r(p) with derivatives R1, R2, R3 by its parameter p becomes one along its arc length s, with sigma = |R1| = ds/dp, by

    sigma' = R1.R2 / sigma,                     sigma'' = (R2.R2 + R1.R3 - sigma'^2) / sigma
    r' = R1/sigma,    r'' = (R2 - r' sigma')/sigma^2,    r''' = (R3 - 3 r'' sigma sigma' - r' sigma'')/sigma^3.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints import built_in
from planner.feedrate.constraints.problem import FeedrateProblem

if (
    TYPE_CHECKING
):  # scipy.interpolate is half of what a process of the runner would import, and most have no use for it
    from scipy.interpolate import BSpline

AXES = "xyzabcd"
QUINTIC = 5
FINE = 20  # samples of a curve per grid point, from which its length and turning are summed up

LONG_SPACING, LONG_STEP = 50, 10.0  # grid points and mm between the waypoints of a long path
LONG_FINE = 4  # like FINE, for memory's sake

COPP_AXES, COPP_WAYPOINTS, COPP_POINTS = 7, 50, 1001
COPP_LIMITS = {"velocity": 1.0, "acceleration": 5.0, "jerk": 50.0}  # of each axis, times 0.9 to 1.1

CURVES = json.loads((Path(__file__).parent / "curves.json").read_text(encoding="utf-8"))
CURVE_LIMITS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 2e5}  # of the shared machine [mm, s]


@dataclass(frozen=True, eq=False, kw_only=True)
class Limits:
    """Of the axes (A,), and of the feed along the path [mm/s, mm/s2, mm/s3]."""

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    feed: float


def random_path(seed: int, points: int | None = None) -> FeedrateProblem:
    """Seeded: a quintic spline through 6 to 20 random points some 1 to 30 mm apart; axis velocities of 30 to 300 mm/s and
    accelerations of 1 to 10 m/s2; the jerk takes 0.03 to 3 times as long to reach the acceleration as that the velocity."""
    from scipy.interpolate import make_interp_spline

    rng = np.random.default_rng([31, seed])
    axes, waypoints = int(rng.integers(2, 7)), int(rng.integers(6, 21))
    steps = rng.normal(size=(waypoints, axes)) * 10.0 ** rng.uniform(0.0, 1.5) / np.sqrt(axes)
    chords = np.cumsum(np.linalg.norm(steps, axis=1))
    velocity = 10.0 ** rng.uniform(1.5, 2.5, axes)
    acceleration = 10.0 ** rng.uniform(3.0, 4.0, axes)
    jerk = acceleration**2 / velocity / 10.0 ** rng.uniform(-1.5, 0.5)
    limits = Limits(
        velocity=velocity, acceleration=acceleration, jerk=jerk, feed=10.0 ** rng.uniform(1.5, 2.5)
    )
    points = points or round(200.0 * 10.0 ** rng.uniform(0.0, 1.0))
    spline = make_interp_spline(chords, np.cumsum(steps, axis=0), k=QUINTIC)
    return _along_arc_length(_Pieces.of(spline), None, points, limits)


def copp_spline(seed: int) -> FeedrateProblem:
    """Seeded: a spline through 50 waypoints uniform in [-0.5, 0.5], 7 axes, 1001 stations uniform in the spline's parameter, which
    stands for the arc length (rad throughout). The spline is copp's default: quintic, its first and second derivatives 0 at both
    ends. Copp draws upper and lower limits separately; here they are equal."""
    from scipy.interpolate import make_interp_spline

    rng = np.random.default_rng([32, seed])
    waypoints = rng.uniform(-0.5, 0.5, (COPP_WAYPOINTS, COPP_AXES))
    drawn = {name: limit * rng.uniform(0.9, 1.1, COPP_AXES) for name, limit in COPP_LIMITS.items()}
    rest = [(1, np.zeros(COPP_AXES)), (2, np.zeros(COPP_AXES))]
    spline = make_interp_spline(
        np.linspace(0.0, 1.0, COPP_WAYPOINTS), waypoints, k=QUINTIC, bc_type=(rest, rest)
    )
    s = np.linspace(0.0, 1.0, COPP_POINTS)
    return _problem(s, *_sides(_Pieces.of(spline), None, s), Limits(**drawn, feed=np.inf))


def nurbs(name: str, points: int, jerk: float = CURVE_LIMITS["jerk"]) -> FeedrateProblem:
    """A curve of curves.json at the limits of the shared machine; every knot is a grid point, because r''' jumps there."""
    from scipy.interpolate import BSpline

    curve = CURVES[name]
    knots, degree = np.array(curve["knots"], dtype=float), curve["degree"]
    weights = np.array(curve["weights"], dtype=float)[:, None]
    numerator = _Pieces.of(BSpline(knots, np.array(curve["points"]) * weights, degree))
    limits = {name: np.full(2, limit) for name, limit in (CURVE_LIMITS | {"jerk": jerk}).items()}
    return _along_arc_length(
        numerator,
        _Pieces.of(BSpline(knots, weights, degree)),
        points,
        Limits(**limits, feed=CURVE_LIMITS["velocity"]),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Pieces:
    """A spline as polynomials: breaks (m + 1,) of the parameter; value and all derivatives (k + 1, m, A) where a piece begins."""

    breaks: FloatArray
    taylor: FloatArray

    @classmethod
    def of(cls, spline: BSpline) -> _Pieces:
        breaks = spline.t[spline.k : len(spline.t) - spline.k]
        taylor = [spline.derivative(order)(breaks[:-1]) for order in range(spline.k + 1)]
        return cls(breaks=breaks, taylor=np.array(taylor))

    def jet(self, parameter: FloatArray, piece: Array) -> list[FloatArray]:
        """Value and first three derivatives (n, A)."""
        step = (parameter - self.breaks[piece])[:, None]
        found = []
        for order in range(4):
            value = np.zeros((len(parameter), self.taylor.shape[2]))
            for power in range(len(self.taylor) - 1, order - 1, -1):
                value = value * step / (power - order + 1) + self.taylor[power, piece]
            found.append(value)
        return found


def long_path(points: int) -> FeedrateProblem:
    """A quintic spline in 3 axes with a waypoint every 50 points, some 10 mm apart, at the limits of the shared machine."""
    from scipy.interpolate import make_interp_spline

    rng = np.random.default_rng([34, points])
    steps = rng.normal(size=(max(points // LONG_SPACING, QUINTIC + 1), 3)) * LONG_STEP / np.sqrt(3.0)
    chords = np.cumsum(np.linalg.norm(steps, axis=1))
    limits = {name: np.full(3, limit) for name, limit in CURVE_LIMITS.items()}
    return _along_arc_length(
        _Pieces.of(make_interp_spline(chords, np.cumsum(steps, axis=0), k=QUINTIC)),
        None,
        points,
        Limits(**limits, feed=CURVE_LIMITS["velocity"]),
        fine=LONG_FINE,
    )


def _along_arc_length(
    numerator: _Pieces, denominator: _Pieces | None, points: int, limits: Limits, fine: int = FINE
) -> FeedrateProblem:
    """The problem on a grid of which one half is spread evenly along the curve and the other half over its turning."""
    sampled = np.linspace(numerator.breaks[0], numerator.breaks[-1], fine * points)
    _, (first, second, _) = _sides(numerator, denominator, sampled)
    length = np.linalg.norm(first, axis=1)
    tangent = first / length[:, None]
    turning = np.linalg.norm(second - tangent * (second * tangent).sum(axis=1)[:, None], axis=1) / length
    sums = [np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0)]) for rate in (length, turning)]
    share = (sums[0] / sums[0][-1] + sums[1] / sums[1][-1]) / 2.0
    parameter = np.interp(np.linspace(0.0, 1.0, points), share, sampled)
    knots = numerator.breaks[1:-1]
    after = np.searchsorted(parameter, knots)
    nearest = np.where(knots - parameter[after - 1] < parameter[after] - knots, after - 1, after)
    parameter[nearest] = knots
    left, right = (_by_arc_length(*side) for side in _sides(numerator, denominator, parameter))
    return _problem(_arc_length(numerator, denominator, parameter), left, right, limits)


def _sides(
    numerator: _Pieces, denominator: _Pieces | None, parameter: FloatArray
) -> tuple[list[FloatArray], list[FloatArray]]:
    """First three derivatives (n, A) by the parameter, before and after each point."""
    last = len(numerator.breaks) - 2
    after = np.clip(np.searchsorted(numerator.breaks, parameter, side="right") - 1, 0, last)
    before = np.clip(np.searchsorted(numerator.breaks, parameter, side="left") - 1, 0, last)
    return _derivatives(numerator, denominator, parameter, before), _derivatives(
        numerator, denominator, parameter, after
    )


def _derivatives(
    numerator: _Pieces, denominator: _Pieces | None, parameter: FloatArray, piece: Array
) -> list[FloatArray]:
    """First three derivatives of numerator / denominator, from the polynomials of the given pieces."""
    r, r1, r2, r3 = numerator.jet(parameter, piece)
    if denominator is None:
        return [r1, r2, r3]
    w, w1, w2, w3 = denominator.jet(parameter, piece)
    r = r / w
    r1 = (r1 - w1 * r) / w
    r2 = (r2 - 2.0 * w1 * r1 - w2 * r) / w
    r3 = (r3 - 3.0 * w1 * r2 - 3.0 * w2 * r1 - w3 * r) / w
    return [r1, r2, r3]


def _by_arc_length(first: FloatArray, second: FloatArray, third: FloatArray) -> list[FloatArray]:
    """Derivatives by the arc length from those by the parameter (module text)."""
    sigma = np.linalg.norm(first, axis=1)[:, None]
    sigma1 = (first * second).sum(axis=1)[:, None] / sigma
    sigma2 = ((second**2 + first * third).sum(axis=1)[:, None] - sigma1**2) / sigma
    d1 = first / sigma
    d2 = (second - d1 * sigma1) / sigma**2
    return [d1, d2, (third - 3.0 * d2 * sigma * sigma1 - d1 * sigma2) / sigma**3]


def _arc_length(numerator: _Pieces, denominator: _Pieces | None, parameter: FloatArray) -> FloatArray:
    """Arc length at the grid points, by Gauss's rule of five nodes per interval."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    half = np.diff(parameter)[:, None] / 2.0
    inside = parameter[:-1, None] + half * (1.0 + nodes)
    _, (first, _, _) = _sides(numerator, denominator, inside.ravel())
    rate = np.linalg.norm(first, axis=1).reshape(inside.shape)
    return np.concatenate([[0.0], np.cumsum((half * rate * weights).sum(axis=1))])


def _problem(
    s: FloatArray, left: list[FloatArray], right: list[FloatArray], limits: Limits
) -> FeedrateProblem:
    """From rest to rest. Bounds on the feed at the two ends, which are at rest, are those of their neighbours: where a spline
    starts with derivative 0, there would be none."""
    points, axes = right[0].shape
    bound, axis = built_in.feed_sq_max(right[0][1:-1], limits.velocity)
    slower = bound < limits.feed**2
    bound = np.where(slower, bound, limits.feed**2)
    return FeedrateProblem(
        piece=np.array([0, points]),
        s=s,
        axes=tuple(AXES[:axes]),
        d1=right[0],
        d2_left=left[1],
        d2_right=right[1],
        d3_left=left[2],
        d3_right=right[2],
        velocity=limits.velocity,
        acceleration=limits.acceleration,
        jerk=limits.jerk,
        feed_sq_max=np.pad(bound, 1, mode="edge"),
        feed_sq_bound=np.pad(np.where(slower, 1 + axis, 0), 1, mode="edge"),
        bound_names=("feed", *(f"velocity.{letter}" for letter in AXES[:axes])),
        margin=np.zeros(points),
    )
