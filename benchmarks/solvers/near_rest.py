"""How acceleration and jerk of sequential_convex.py go on intervals near rest (its module text)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem

# Gauss' rule for the time of an interval: off by 4e-5 where feed^2 grows fourfold in it, 1e-3 where tenfold.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (1.0 + NODES) / 2.0, WEIGHTS / 2.0  # of the unit interval
NEAR = 100.0  # distance from rest up to which the acceleration is shaped like a cube root [lengths of the interval]


@dataclass(frozen=True, kw_only=True)
class IntervalShape:
    """How u goes from 0 to 1 on each of n intervals, over the share of the interval.

    mean                   : (n,)
    integrals              : (nodes, n) of the shape, from the start of the interval to the nodes of Gauss's
                             rule
    slope_start, slope_end : (n,) where an interval touches rest, the one there is infinite and not used
    """

    mean: FloatArray
    integrals: FloatArray
    slope_start: FloatArray
    slope_end: FloatArray

    @classmethod
    def of(cls, s: FloatArray) -> IntervalShape:
        """The shapes on a grid s (n+1,) [mm] from rest to rest: cube roots near its ends
        (sequential_convex.py), linear elsewhere."""
        ds = np.diff(s)
        back = s[-1] - s[1:] < s[:-1] - s[0]  # nearer to the last point: the mirror image
        away = np.where(back, s[-1] - s[1:], s[:-1] - s[0]) / ds
        linear, away = away > NEAR, np.minimum(away, NEAR)
        first, span = np.cbrt(away), np.cbrt(away + 1.0) - np.cbrt(away)

        def integral(share: FloatArray | float) -> FloatArray:
            rooted = (0.75 * ((away + share) * np.cbrt(away + share) - away * first) - first * share) / span
            return np.where(linear, share**2 / 2.0, rooted)

        mean = integral(1.0)
        at = NODES[:, None]
        with np.errstate(divide="ignore"):
            near, far = (np.where(linear, 1.0, (away + k) ** (-2 / 3) / (3.0 * span)) for k in (0.0, 1.0))
        return cls(
            mean=np.where(back, 1.0 - mean, mean),
            integrals=np.where(back, at - mean + integral(1.0 - at), integral(at)),
            slope_start=np.where(back, far, near),
            slope_end=np.where(back, near, far),
        )


def beside_rest(problem: FeedrateProblem, rest: int, step: int) -> tuple[float, tuple[int, int]]:
    """Largest x at the point before or after a rest, what the jerks on the interval between them allow
    (sequential_convex.py); also the axis of the jerk that says so, and its row in `Multipliers.rows`: 1 at
    the start of the interval, 2 at its end."""
    beside = rest + step
    d = abs(problem.s[beside] - problem.s[rest])
    d2 = problem.d2_left[beside] if step > 0 else problem.d2_right[beside]
    d3 = problem.d3_left[beside] if step > 0 else problem.d3_right[beside]
    jerk = 2.0 / (9.0 * d**2)  # of the motion, per x^(3/2)
    at_rest = np.abs(problem.d1[rest]) * jerk
    moving = np.abs(problem.d1[beside] * jerk + step * 2.0 / d * d2 + d3)
    ratio = np.column_stack([at_rest / problem.jerk_limit[rest], moving / problem.jerk_limit[beside]])
    k, where = np.unravel_index(int(ratio.argmax()), ratio.shape)
    row = 1 + where if step > 0 else 2 - where
    return float(ratio.max() ** (-2.0 / 3.0)), (int(k), int(row))
