"""The feedrate problem: the fastest speed profile along a sampled path.

In x = feed^2 and u = acceleration along the path (dx/ds = 2 u), u constant on each interval:

    minimise   T = sum_i 2 h_i / (sqrt(x_i) + sqrt(x_{i+1}))
    subject to x_{i+1} = x_i + 2 h_i u_i
               0 <= x_i <= feed_sq_max_i
               | r'_k u_i + r''_k x | <= a_k (1 - margin_i)     at the left end (x = x_i, r'' to the right of the point)
                                                                and the right end (x = x_{i+1}, r'' to its
                                                                left), every axis k
               x = 0 at both ends of each piece.

`margin` is the grid's interpolation error (feedrate/sampling/samples.py), so that the constraint holds in
between as well. The jerk limits are carried along for solvers of third order; a second-order solver says that
it does not use them.

`limit_scale` is the factor lam by which the motion has to be slower around a point than path and machine ask
for (planning/optimal/tighten.py): every row of the point has the limit

    feed_sq_max / lam^2,     a_k / lam^2  (times 1 - margin),     j_k / lam^3.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze

# What a problem says of each of its points, beside where it is and limits of one's own.
ROWS = (
    "d1",
    "d2_left",
    "d2_right",
    "d3_left",
    "d3_right",
    "feed_sq_max",
    "feed_sq_bound",
    "margin",
    "limit_scale",
)


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
    limit_scale           : (P,) by what factor motions have to be slower around points [-]; 1 if not given
    own                   : how many of the axes, the last ones, are limits of one's own
                            (machine/user_limit.py): functions of the position with rows like an axis
    own_here              : (2, P, own) by what factors their acceleration and jerk limits are larger [-]
    own_least             : (3, own) their least bounds of velocity, acceleration and jerk on the path, in
                            units of their own; inf where they bound nothing

    Solvers take limits from `feed_sq_limit`, `acceleration_limit` and `jerk_limit`, which have the scale in
    them and are made when they are asked for: of a long job there are several problems, and these take 7
    bytes in 10 of what one has of its own.
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
    limit_scale: FloatArray = field(default_factory=lambda: np.ones(()))
    own: int = 0
    own_here: FloatArray | None = None
    own_least: FloatArray | None = None

    def __post_init__(self) -> None:
        points, axes = np.shape(self.d1)
        freeze(self, "piece", np.int64, (None,))
        freeze(self, "s", np.float64, (points,))
        freeze(self, "d1 d2_left d2_right d3_left d3_right", np.float64, (points, axes))
        freeze(self, "velocity acceleration jerk", np.float64, (axes,))
        if np.ndim(self.limit_scale) == 0:
            object.__setattr__(self, "limit_scale", np.full(points, float(self.limit_scale)))
        freeze(self, "feed_sq_max margin limit_scale", np.float64, (points,))
        freeze(self, "feed_sq_bound", np.int64, (points,))
        if self.own:
            freeze(self, "own_here", np.float64, (2, points, self.own))
            freeze(self, "own_least", np.float64, (3, self.own), finite=False)
        self._check()

    def _check(self) -> None:
        for name in ("velocity", "acceleration", "jerk", "feed_sq_max", "limit_scale"):
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

    def __len__(self) -> int:
        return len(self.s)

    @property
    def feed_sq_limit(self) -> FloatArray:
        """(P,) largest x at each point [mm2/s2]."""
        return self.feed_sq_max / self.limit_scale**2

    @property
    def acceleration_limit(self) -> FloatArray:
        """(P, A) axis accelerations at each point, without the margin [mm/s2]."""
        return self._here(0, self.acceleration / self.limit_scale[:, None] ** 2)

    @property
    def jerk_limit(self) -> FloatArray:
        """(P, A) axis jerks at each point [mm/s3]."""
        return self._here(1, self.jerk / self.limit_scale[:, None] ** 3)

    def _here(self, quantity: int, limit: FloatArray) -> FloatArray:
        if self.own_here is not None:
            limit[:, -self.own :] *= self.own_here[quantity]
        return limit

    @property
    def machine_axes(self) -> int:
        """How many of the axes are the machine's; the others are limits of one's own."""
        return len(self.axes) - self.own

    def part(self, pieces: Array) -> FeedrateProblem:
        """The problem of some of the pieces (n,) alone, ascending."""
        size = np.diff(self.piece)[pieces]
        at = np.concatenate([np.arange(self.piece[g], self.piece[g + 1]) for g in pieces])
        return replace(
            self,
            piece=np.concatenate([[0], np.cumsum(size)]),
            own_here=None if self.own_here is None else self.own_here[:, at],
            **{name: getattr(self, name)[at] for name in ("s", *ROWS)},
        )

    @property
    def interval(self) -> Array:
        """(P,) True where a point has an interval to its right."""
        inner = np.ones(len(self), dtype=bool)
        inner[self.piece[1:] - 1] = False
        return inner
