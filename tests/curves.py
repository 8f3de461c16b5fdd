"""Curves: those of the papers, exact circles, and random waves; and a machine that hardly limits what moves along them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.geometry.nurbs import Nurbs
from planner.machine import Machine
from planner.motion.trajectory import Trajectory

CURVES = json.loads(
    (Path(__file__).parents[1] / "benchmarks" / "solvers" / "curves.json").read_text(encoding="utf-8")
)


def curve_named(name: str) -> Nurbs:
    given_ = CURVES[name]
    return Nurbs(
        **{key: np.array(given_[key], float) for key in ("points", "knots", "weights")},
        degree=given_["degree"],
    )


def chord_error(motion: Trajectory) -> float:
    """The largest bow of a motion over a period [mm], |normal acceleration| dt^2 / 8."""
    speed = np.maximum(np.linalg.norm(motion.velocity, axis=1), 1e-9)[:, None]
    along = (motion.acceleration * motion.velocity).sum(axis=1, keepdims=True) / speed**2
    across = np.linalg.norm(motion.acceleration - along * motion.velocity, axis=1)
    return float(across[speed[:, 0] > 1e-6].max()) * motion.dt**2 / 8.0


def circle(rho: float, normal: FloatArray = (0.0, 0.0, 1.0), turns: int = 1) -> Nurbs:
    """A circle as the exact rational quadratic of its square, in the plane with that normal, run through `turns` times."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    e1 = np.linalg.svd(normal[None])[2][1]
    e2 = np.cross(normal, e1)
    square = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]], float)
    corners = rho * np.vstack([np.tile(square, (turns, 1)), square[:1]])
    inner = np.repeat(np.arange(1, 4 * turns), 2)
    return Nurbs(
        degree=2,
        points=corners @ np.array([e1, e2]),
        knots=np.concatenate([[0, 0, 0], inner, 3 * [4 * turns]]).astype(float),
        weights=np.append(np.tile([1.0, np.sqrt(0.5)], 4 * turns), 1.0),
    )


def wave(seed: int, axes: int = 2, points: int = 12, step: float = 4.0, sway: float = 3.0) -> Nurbs:
    """A cubic with random control points along x: curvature from nothing to sharp."""
    rng = np.random.default_rng(seed)
    where = rng.normal(scale=sway, size=(points, axes))
    where[:, 0] += step * np.arange(points)
    knots = np.concatenate([np.zeros(3), np.linspace(0, 1, points - 2), np.ones(3)])
    return Nurbs(degree=3, points=where, knots=knots, weights=rng.uniform(0.5, 2.0, points))


def strong(**more: Any) -> Machine:
    """A machine whose limits are above what filters ask for."""
    return problems.machine(velocity=1e3, acceleration=1e5, jerk=1e8, **more)
