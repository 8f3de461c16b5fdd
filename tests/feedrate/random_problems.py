"""Feedrate problems made directly as arrays, for tests of the solvers alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem

AXES = "xyzabc"


def make_problem(
    s: ArrayLike,
    d1: ArrayLike,
    d2_left: ArrayLike,
    d2_right: ArrayLike | None = None,
    *,
    feed_sq_max: ArrayLike = 1e4,
    acceleration: ArrayLike = 2e3,
    piece: ArrayLike | None = None,
    **fields: Any,
) -> FeedrateProblem:
    """A problem of one piece, with what second-order solvers do not read filled in."""
    d1, d2_left = np.asarray(d1, dtype=float), np.asarray(d2_left, dtype=float)
    points, axes = d1.shape
    piece = np.array([0, points]) if piece is None else np.asarray(piece)
    values: dict[str, Any] = {
        "piece": piece,
        "s": np.asarray(s, dtype=float),
        "axes": tuple(AXES[:axes]),
        "d1": d1,
        "d2_left": d2_left,
        "d2_right": d2_left if d2_right is None else d2_right,
        "d3_left": np.zeros_like(d1),
        "d3_right": np.zeros_like(d1),
        "velocity": np.full(axes, 1e3),
        "acceleration": np.broadcast_to(np.asarray(acceleration, dtype=float), (axes,)).copy(),
        "jerk": np.full(axes, 1e6),
        "feed_sq_max": np.broadcast_to(np.asarray(feed_sq_max, dtype=float), (points,)).copy(),
        "feed_sq_bound": np.zeros(points, dtype=int),
        "bound_names": ("feed",),
        "margin": np.zeros(points),
    }
    return FeedrateProblem(**(values | fields))


def line(
    length: float, points: int = 2, *, start: float = 0.0, direction: ArrayLike = (1.0, 0.0), **fields: Any
) -> FeedrateProblem:
    """A straight line on a uniform grid."""
    unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    d1 = np.tile(unit, (points, 1))
    return make_problem(start + np.linspace(0.0, length, points), d1, np.zeros_like(d1), **fields)


def circle(radius: float, turn: float, points: int, **fields: Any) -> FeedrateProblem:
    """An arc of `turn` [rad]."""
    angle = np.linspace(0.0, turn, points)
    d1 = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    d2 = np.stack([-np.cos(angle), -np.sin(angle)], axis=1) / radius
    return make_problem(radius * angle, d1, d2, **fields)


def random_curve(rng: np.random.Generator, points: int, axes: int) -> tuple[FloatArray, ...]:
    """Arc length (n,), r' and r'' before and after each point (n, axes) of a curve of n - 1 circular arcs that turn by up to 0.1
    rad each, in planes that drift, with a jump of the curvature now and then; a few mm to a metre long."""
    size = 10.0 ** rng.uniform(-1.0, 1.0)  # typical step [mm]
    step = size * rng.uniform(0.2, 1.8, points - 1)
    tangent = rng.normal(size=axes)
    tangent /= np.linalg.norm(tangent)
    bend = np.zeros(axes)
    d1, d2_left, d2_right = (np.zeros((points, axes)) for _ in range(3))
    d1[0] = tangent
    for i in range(points - 1):
        jump = rng.uniform() < 0.03
        bend = (0.0 if jump else 0.97) * bend + (0.04 if jump else 0.006) / size * rng.normal(size=axes)
        bend -= (bend @ tangent) * tangent
        kappa = np.linalg.norm(bend)
        normal, angle = bend / kappa, kappa * step[i]
        d2_right[i] = bend
        tangent, normal = (
            np.cos(angle) * tangent + np.sin(angle) * normal,
            np.cos(angle) * normal - np.sin(angle) * tangent,
        )
        bend = kappa * normal
        d1[i + 1], d2_left[i + 1] = tangent, bend
    d2_left[0], d2_right[-1] = d2_right[0], d2_left[-1]
    return np.concatenate([[0.0], np.cumsum(step)]), d1, d2_left, d2_right


def random_problem(seed: int) -> FeedrateProblem:
    """Seeded problem in 2, 3 or 6 dimensions: several pieces, jumps of the curvature and of the feed, margins."""
    rng = np.random.default_rng([20, seed])
    axes = (2, 3, 6)[seed % 3]
    counts = rng.integers(3, 200, rng.integers(1, 4))
    parts = [random_curve(rng, count, axes) for count in counts]
    piece = np.concatenate([[0], np.cumsum(counts)])
    s, d1, d2_left, d2_right = (np.concatenate([part[k] for part in parts]) for k in range(4))
    for k in range(1, len(counts)):
        s[piece[k] : piece[k + 1]] += s[piece[k] - 1]
    points = len(s)
    acceleration = 10.0 ** rng.uniform(3.0, 4.0, axes)
    feed = np.repeat(rng.uniform(20.0, 200.0, points), 1 + rng.integers(0, 100, points))[:points]
    jump = (np.abs(d2_right - d2_left) / acceleration).max(axis=1)
    feed_sq_max = np.minimum(feed**2, 1.0 / np.maximum(jump, 1e-12))
    return make_problem(
        s,
        d1,
        d2_left,
        d2_right,
        feed_sq_max=feed_sq_max,
        acceleration=acceleration,
        piece=piece,
        margin=rng.uniform(0.0, 0.02, points),
    )


def reversed_problem(problem: FeedrateProblem) -> FeedrateProblem:
    """The same path run backwards."""
    points = len(problem)
    margin = np.zeros(points)
    inner = np.flatnonzero(problem.interval)
    margin[points - 2 - inner] = problem.margin[inner]
    return dataclasses.replace(
        problem,
        piece=points - problem.piece[::-1],
        s=problem.s[-1] - problem.s[::-1],
        d1=-problem.d1[::-1],
        d2_left=problem.d2_right[::-1],
        d2_right=problem.d2_left[::-1],
        d3_left=-problem.d3_right[::-1],
        d3_right=-problem.d3_left[::-1],
        feed_sq_max=problem.feed_sq_max[::-1],
        feed_sq_bound=problem.feed_sq_bound[::-1],
        margin=margin,
    )


def in_units(problem: FeedrateProblem, length: float, time: float = 1.0) -> FeedrateProblem:
    """The same problem with lengths and times multiplied: `length` 1e-3 gives metres instead of millimetres."""
    feed_sq = (length / time) ** 2
    return dataclasses.replace(
        problem,
        s=problem.s * length,
        d2_left=problem.d2_left / length,
        d2_right=problem.d2_right / length,
        d3_left=problem.d3_left / length**2,
        d3_right=problem.d3_right / length**2,
        velocity=problem.velocity * (length / time),
        acceleration=problem.acceleration * (length / time**2),
        jerk=problem.jerk * (length / time**3),
        feed_sq_max=problem.feed_sq_max * feed_sq,
    )
