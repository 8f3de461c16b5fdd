"""A second judge of motions, which shares no code with the planner: from the delivered positions alone, by finite differences.

The mean of a velocity over a period is no larger than the largest one, nor is the second difference of positions over dt2 larger than
the largest acceleration, or the third over dt3 than the largest jerk. So nothing that keeps its limits is refused here, however coarse
the period is. The way is judged by the samples' distance from the blocks, in their order, and by the vertices' distance from the
samples' chords.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

ROUNDING = 1e-6  # of limits and tolerances [-]
DIGITS = 4.0 * np.finfo(float).eps  # of a position, over its size [-]
SAGITTA = 1e-3  # of chords that stand for arcs, over the tolerance [-]
CLOSE = 1e-6  # [mm]; of lengths
Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Way:
    """What was programmed: B blocks with their points (one line or the chords of an arc), tolerance [mm] and feed [mm/s]."""

    points: list[Array]
    tolerance: Array
    feed: Array


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Limits of the axes (A,): velocity, acceleration, jerk; inf where one is not limited."""

    velocity: Array
    acceleration: Array
    jerk: Array


def judged(
    position: Array, dt: float, ends: tuple[Array, Array], bounds: Bounds, way: Way | None
) -> list[str]:
    """Faults of a motion (T, A) at the period dt [s] between two places (A,); `way` None where only limits and ends are judged."""
    faults = [
        f"{what} is {far:.3g} from where it should be"
        for what, sample, place in (
            ("the first sample", position[0], ends[0]),
            ("the last sample", position[-1], ends[1]),
        )
        if (far := float(np.abs(sample - place).max())) > CLOSE
    ]
    size = np.maximum(np.abs(position).max(axis=0), 1.0) * DIGITS
    for order, (name, limit) in enumerate(vars(bounds).items(), start=1):
        if len(position) <= order:
            continue
        found = np.abs(np.diff(position, n=order, axis=0)).max(axis=0) / dt**order
        over = found > limit * (1.0 + ROUNDING) + 2.0**order * size / dt**order
        faults += [
            f"{name} of axis {k}: {found[k]:.9g}, allowed {limit[k]:.9g}" for k in np.flatnonzero(over)
        ]
    return faults if way is None else faults + _of_way(position, dt, bounds, way)


def _of_way(position: Array, dt: float, bounds: Bounds, way: Way) -> list[str]:
    """Faults of the way in the first three axes."""
    x, faults = position[:, :3], []
    near = np.stack([_distance(x, points) for points in way.points], axis=1)
    allowed = near <= way.tolerance * (1.0 + ROUNDING + SAGITTA) + CLOSE
    at = 0
    for k in range(len(x)):
        there = np.flatnonzero(allowed[k, at:])
        if not len(there):
            worst = int(np.argmin(near[k] / way.tolerance))
            return [
                *faults,
                f"sample {k} is {near[k, worst]:.6g} from block {worst}, the nearest from block {at} on",
            ]
        at += int(there[0])
    if not allowed[-1, -1]:
        faults.append("the motion does not end on the last block")
    faults += _vertices(x, way, float(np.linalg.norm(bounds.acceleration[:3])) * dt**2 / 8.0)
    speed = np.linalg.norm(np.diff(x, axis=0), axis=1) / dt
    # feeds of all blocks that both samples may be on
    may = allowed[:-1] | allowed[1:]
    most = np.where(may, way.feed, 0.0).max(axis=1)
    fast = np.flatnonzero(speed > most * (1.0 + ROUNDING) + 8.0 * DIGITS * np.abs(x).max() / dt)
    return faults + [f"feed {speed[k]:.9g} at sample {k}, allowed {most[k]:.9g}" for k in fast[:1]]


def _vertices(x: Array, way: Way, bow: float) -> list[str]:
    """Ends of blocks that the motion misses, or passes out of order; between samples it may leave their chord by `bow` [mm]."""
    at = 0
    for block, points in enumerate(way.points):
        budget = way.tolerance[block : block + 2].max() * (1.0 + ROUNDING + SAGITTA) + CLOSE + bow
        far = _chord_distance(points[-1], x)
        there = np.flatnonzero(far[at:] <= budget)
        if not len(there):
            return [f"the end of block {block} is {far[at:].min():.6g} from the motion from sample {at} on"]
        at += int(there[0])
    return []


def _distance(x: Array, points: Array) -> Array:
    """(T,) distance of places from the chords between points."""
    found = np.full(len(x), np.inf)
    for begin, end in pairwise(points):
        along = end - begin
        share = np.clip((x - begin) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(x - begin - share[:, None] * along, axis=1))
    return found


def _chord_distance(place: Array, x: Array) -> Array:
    """(T - 1,) distance of a place from each chord between samples."""
    along = np.diff(x, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((place - x[:-1]) * along).sum(axis=1) / square, 0.0, 1.0)
    return np.linalg.norm(place - x[:-1] - share[:, None] * along, axis=1)


def arc_points(start: Array, end: Array, center: Array, normal: int, sweep: float, tolerance: float) -> Array:
    """(n, 3) points of a helical arc about the axis `normal` through its centre, by `sweep` [rad]."""
    first, second = (normal + 1) % 3, (normal + 2) % 3
    radius = float(np.hypot(start[first] - center[first], start[second] - center[second]))
    chord = 2.0 * np.sqrt(2.0 * SAGITTA * tolerance / max(radius, 1e-12))
    count = int(np.clip(np.ceil(abs(sweep) / max(chord, 1e-4)), 2, 20_000))
    share = np.linspace(0.0, 1.0, count + 1)
    begin = np.arctan2(start[second] - center[second], start[first] - center[first])
    last = float(np.hypot(end[first] - center[first], end[second] - center[second]))
    points = start + share[:, None] * (end - start)
    radii = radius + share * (last - radius)
    points[:, first] = center[first] + radii * np.cos(begin + share * sweep)
    points[:, second] = center[second] + radii * np.sin(begin + share * sweep)
    return points
