"""The feedrate problem: the fastest speed profile along a sampled path.

In x = feed^2 and u = acceleration along the path (dx/ds = 2 u), with constant u on each of the N intervals of a piece:

    minimise   T = sum_i 2 h_i / (sqrt(x_i) + sqrt(x_{i+1}))
    subject to x_{i+1} = x_i + 2 h_i u_i
               0 <= x_i <= feed_sq_max_i
               | r'_k u_i + r''_k x | <= a_k (1 - margin_i)     at the left end (x = x_i, r'' to the right of the point)
                                                                and the right end (x = x_{i+1}, r'' to its left), every axis k
               x = feed_sq_start, feed_sq_end at the ends of each piece.

`margin` is the grid's interpolation error (path.py), so that the constraint holds in between as well. The jerk limits are carried
along for solvers of third order; a second-order solver says that it does not use them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.arrays import Array, FloatArray, freeze


@dataclass(frozen=True, eq=False, kw_only=True)
class FeedrateProblem:
    """G pieces over P grid points and A axes; piece g holds the points piece[g] : piece[g+1].

    s                     : (P,) arc length, strictly increasing inside a piece [mm]
    d1                    : (P, A) r'
    d2_left, d2_right     : (P, A) r'' before and after each point [1/mm]
    d3_left, d3_right     : (P, A) r''' [1/mm2]
    velocity, acceleration, jerk : (A,) axis limits
    feed_sq_max           : (P,) smallest of all bounds on x alone; inf never occurs
    feed_sq_bound         : (P,) index of that bound in `bound_names`
    bound_names           : names of the bounds on x ("feed", "velocity.x", "chord_error", ...)
    margin                : (P,) of the interval to the right, share of the acceleration limits [-]
    feed_sq_start, feed_sq_end : (G,) x at both ends of each piece; 0 = rest
    """

    piece: Array
    s: FloatArray
    axes: tuple[str, ...]
    d1: FloatArray
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    feed_sq_max: FloatArray
    feed_sq_bound: Array
    bound_names: tuple[str, ...]
    margin: FloatArray
    feed_sq_start: FloatArray
    feed_sq_end: FloatArray

    def __post_init__(self) -> None:
        points, axes = np.shape(self.d1)
        freeze(self, "piece", np.int64, (None,))
        pieces = len(self.piece) - 1
        freeze(self, "s", np.float64, (points,))
        for name in ("d1", "d2_left", "d2_right", "d3_left", "d3_right"):
            freeze(self, name, np.float64, (points, axes))
        for name in ("velocity", "acceleration", "jerk"):
            freeze(self, name, np.float64, (axes,))
        for name in ("feed_sq_max", "margin"):
            freeze(self, name, np.float64, (points,))
        freeze(self, "feed_sq_bound", np.int64, (points,))
        for name in ("feed_sq_start", "feed_sq_end"):
            freeze(self, name, np.float64, (pieces,))
        self._check()

    def _check(self) -> None:
        for name in ("velocity", "acceleration", "jerk", "feed_sq_max"):
            if not (getattr(self, name) > 0).all():
                raise ValueError(f"FeedrateProblem.{name}: every value must be positive")
        if not ((self.margin >= 0) & (self.margin < 1)).all():
            raise ValueError("FeedrateProblem.margin: every value must be in [0, 1); refine the grid")
        step = np.diff(self.s)
        inner = np.ones(len(step), dtype=bool)
        inner[self.piece[1:-1] - 1] = False
        if not (step[inner] > 0).all():
            bad = int(np.flatnonzero(inner & ~(step > 0))[0])
            raise ValueError(f"FeedrateProblem.s: {self.s[bad + 1]} mm at point {bad + 1} does not increase")
        if (np.diff(self.piece) < 2).any():
            raise ValueError("FeedrateProblem.piece: every piece needs at least two points")
        if (self.feed_sq_start < 0).any() or (self.feed_sq_end < 0).any():
            raise ValueError("FeedrateProblem: feed_sq at the ends of a piece must be >= 0")

    def __len__(self) -> int:
        return len(self.s)

    @property
    def interval(self) -> Array:
        """(P,) True where a point has an interval to its right."""
        inner = np.ones(len(self), dtype=bool)
        inner[self.piece[1:] - 1] = False
        return inner
