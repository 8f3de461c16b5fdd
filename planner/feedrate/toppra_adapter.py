"""The package toppra as a second solver of the same problem, to compare the own kernel with.

toppra (H. Pham, MIT) solves one linear programme in (u, x) per grid point and pass with Seidel's method. It
is given exactly the rows of `FeedrateProblem`, for the left and the right end of every interval (|a u + b x|
<= 1 after division by the limit; see reachability.py), declared as "collocation": its interpolation scheme
would take one r'' per point, and a jump of the curvature would be lost.

toppra 0.6 adds silently, in its own units: bounds |u|, |x| <= 1e8 (a rapid of 10 m/s in mm/s is there); x_{i+1}
lowered by min(1e-8, 1e-4 x_{i+1}) on every forward step, by which u_i and x_{i+1} - x_i then differ; the
objective x - 1e-9 u; rows within 1e-10 of parallel are not intersected, and rows are met to 1e-10; and a walk
of 1e10 along a row ends at "infinity", which a row without u (r'_k = 0) reaches: four of our six jobs failed
as "uncontrollable" until u was given bounds of its own.

So the adapter chooses the units: the largest u is about 1 and the largest x about `FEED_SQ_SCALE`, so large
that a slack of 1e-8 is 1e-14 of it and yet far from 1e8; powers of two, so that scaling rounds nothing. On 200
random problems cycle times then differ by 3e-8 from the own kernel's, feeds by 2e-7 at worst (with the largest
x at 1 by 3e-5 and 2e-4), on real paths by 1e-12.
"""

import logging
import math
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import import_needed
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.solution import FeedrateSolution, Status

# Largest x in toppra's eyes [-]: 1e-8 must be small against it, and it against 1e8 (module text).
FEED_SQ_SCALE = 1e6
# The limit in every row [-], the mean of 1 and `FEED_SQ_SCALE`: no coefficient is near 1e-10 then.
ROW_SCALE = 1e3


@dataclass(frozen=True, kw_only=True)
class ToppraSolver:
    """toppra's TOPPRA with Seidel's solver; it has no settings."""

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Time-optimal second-order profile."""
        toppra = _import_toppra()
        began = time.perf_counter()
        x, u = np.empty(len(problem)), np.zeros(len(problem))
        with _silent(logging.getLogger("toppra")):
            for g in range(len(problem.piece) - 1):
                first, last = problem.piece[g], problem.piece[g + 1] - 1
                failure = _solve_piece(toppra, problem, g, x[first : last + 1], u[first:last])
                if failure is not None:
                    sentence = f"piece {g} (from s = {problem.s[first]:.6g} mm): {failure}"
                    took = time.perf_counter() - began
                    return FeedrateSolution.failed(
                        problem, Status.NUMERICAL_ERROR, sentence, repr(self), took
                    )
        return FeedrateSolution.second_order(
            problem,
            feed_sq=x,
            acc_s=u,
            sentence="time-optimal for the second-order limits",
            solver=repr(self),
            solve_time=time.perf_counter() - began,
        )


def _algorithm(toppra: Any, problem: FeedrateProblem, g: int) -> tuple[Any, float, float]:
    """toppra's algorithm for piece g, and the units of length [mm] and time [s] that it works in."""
    length, time_unit = _units(problem, g)
    grid, rows = _rows(problem, g, length, time_unit)
    constraint = toppra.constraint.LinearConstraint()
    constraint.identical = True
    constraint.compute_constraint_params = lambda *_: rows
    path = SimpleNamespace(path_interval=grid[[0, -1]], duration=grid[-1], dof=problem.d1.shape[1])
    algorithm = toppra.algorithm.TOPPRA([constraint], path, gridpoints=grid, solver_wrapper="seidel")
    return algorithm, length, time_unit


def _solve_piece(toppra: Any, problem: FeedrateProblem, g: int, x: FloatArray, u: FloatArray) -> str | None:
    """Solve piece g into x (n+1,) and u (n,); on failure why, with a remedy."""
    algorithm, length, time_unit = _algorithm(toppra, problem, g)
    feed = length / time_unit
    algorithm.compute_parameterization(0.0, 0.0)
    data = algorithm.problem_data
    codes = toppra.algorithm.algorithm.ParameterizationReturnCode
    if data.return_code != codes.Ok or not (
        np.isfinite(data.sd_vec).all() and np.isfinite(data.sdd_vec).all()
    ):
        return f"toppra ended with {data.return_code.name}; use the solver Reachability"
    x[:] = (data.sd_vec * feed) ** 2
    u[:] = data.sdd_vec * (length / time_unit**2)
    return None


def _units(problem: FeedrateProblem, g: int) -> tuple[float, float]:
    """Units of length [mm] and time [s], powers of two, in which the largest u of piece g is about 1 and the
    largest x about `FEED_SQ_SCALE`."""
    first, last = problem.piece[g], problem.piece[g + 1] - 1
    along = np.abs(problem.d1[first : last + 1]) / problem.acceleration_limit[first : last + 1]
    u_max = float((1.0 / along.max(axis=1)).max())
    reachable = u_max * (problem.s[last] - problem.s[first])
    x_max = float(min(problem.feed_sq_limit[first : last + 1].max(), reachable))
    length = x_max / (u_max * FEED_SQ_SCALE)
    return 2.0 ** round(math.log2(length)), 2.0 ** round(0.5 * math.log2(length / u_max))


def _rows(
    problem: FeedrateProblem, g: int, length: float, time_unit: float
) -> tuple[FloatArray, tuple[FloatArray | None, ...]]:
    """Grid (n+1,) of piece g and toppra's a, b, c, F, g, bounds of u, bounds of x in the given units."""
    points = slice(problem.piece[g], problem.piece[g + 1])
    d1, d2_left, d2_right = problem.d1[points], problem.d2_left[points], problem.d2_right[points]
    size, axes = d1.shape
    step = np.diff(problem.s[points])[:, None]
    room = 1.0 - problem.margin[points][:-1, None]
    limit, limit_end = (
        problem.acceleration_limit[points][:-1] * room,
        problem.acceleration_limit[points][1:] * room,
    )
    a, b = np.zeros((size, 2 * axes)), np.zeros((size, 2 * axes))  # no rows at the last point
    a[:-1, :axes], b[:-1, :axes] = d1[:-1] / limit, d2_right[:-1] / limit
    a[:-1, axes:], b[:-1, axes:] = (d1[1:] + 2.0 * step * d2_left[1:]) / limit_end, d2_left[1:] / limit_end
    feed_sq, acc = (length / time_unit) ** 2, length / time_unit**2
    x_max = problem.feed_sq_limit[points] / feed_sq
    a, b = a * (ROW_SCALE * acc), b * (ROW_SCALE * feed_sq)
    both = np.vstack([np.eye(2 * axes), -np.eye(2 * axes)])
    # Bounds of u that the rows imply, twice over: or a walk along a row with a = 0 ends at "infinity".
    with np.errstate(divide="ignore"):
        u_max = 2.0 * ((ROW_SCALE + np.abs(b) * x_max[:, None]) / np.abs(a)).min(axis=1)
    u_bounds = np.stack([-u_max, u_max], axis=1)
    x_bounds = np.stack([np.zeros(size), x_max], axis=1)
    rows = (a, b, np.zeros_like(a), both, np.full(len(both), ROW_SCALE), u_bounds, x_bounds)
    return problem.s[points] / length, rows


def _import_toppra() -> Any:
    """The package, imported when it is first needed: 0.9 s, because it loads pyplot."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of escapes in its sources, by newer Pythons
        return import_needed("toppra", "solver toppra")


@contextmanager
def _silent(logger: logging.Logger) -> Iterator[None]:
    """Mute a logger for a while: what toppra warns of is in the status."""
    was = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(was)
