"""The jobs that tests, benchmarks and notebooks share. Every job is made here; nothing is read from files.

Each function returns a `Program`; sources are named where a job comes from somewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from planner.base.arrays import FloatArray
from planner.machine import Axis, Machine
from planner.nc.program import Kind, PathControl, Program
from planner.nc.reader import parse_program

FEED = 100.0  # programmed feed of the jobs [mm/s], F6000


def machine(
    *,
    velocity: float = 100.0,
    acceleration: float = 2000.0,
    jerk: float = 2e5,
    tolerance: float = 0.05,
    **more,
) -> Machine:
    """The machine on which peers were compared: v 100, a 2000, j 2e5 on every axis, eps 0.05 mm, dt 1 ms."""
    axis = Axis(velocity=velocity, acceleration=acceleration, jerk=jerk)
    settings = {"name": "peers", "dt": 0.001, "tolerance": tolerance, "axes": dict.fromkeys("xyz", axis)}
    return Machine(**(settings | more))


def polyline(
    points: ArrayLike,
    *,
    feed: float | FloatArray = FEED,
    path_control: PathControl | Sequence[int] = PathControl.BLEND,
    source: str = "polyline",
) -> Program:
    """G1 moves through points (n+1, 2 or 3) [mm]; the first is where the machine stands."""
    given = np.asarray(points, dtype=float)
    where = np.zeros((len(given), 3))
    where[:, : given.shape[1]] = given
    blocks = len(where) - 1
    return Program(
        source=source,
        axes=("x", "y", "z"),
        start=where[0],
        kind=np.full(blocks, Kind.LINE),
        end=where[1:],
        feed=np.broadcast_to(np.asarray(feed, dtype=float), (blocks,)).copy(),
        dwell=np.zeros(blocks),
        line=np.arange(1, blocks + 1),
        path_control=np.broadcast_to(np.asarray(path_control, dtype=np.uint8), (blocks,)).copy(),
        tolerance=np.full(blocks, np.nan),
        arc_block=np.zeros(0),
        arc_center=np.zeros((0, 3)),
        arc_normal=np.zeros(0),
        arc_sweep=np.zeros(0),
    )


def pentagon(side: float = 15.782) -> Program:
    """Regular pentagon, closed, from vertex to vertex (paper 000, reading (i) of its size)."""
    angle = np.deg2rad(72.0) * np.arange(5)
    steps = side * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), source="pentagon")


def corner(turn: float, leg: float = 20.0) -> Program:
    """Two legs of so many mm that turn by `turn` [rad], the first along x."""
    steps = leg * np.array([[1.0, 0.0], [np.cos(turn), np.sin(turn)]])
    return polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), source="corner")


def zigzag(count: int = 50, side: float = 2.0, half_turn: float = 30.0) -> Program:
    """Segments of `side` [mm] that turn by twice `half_turn` [deg], left and right in turn."""
    angle = np.deg2rad(half_turn) * np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    steps = side * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), source="zigzag")


def chord_circle(chords: int = 360, radius: float = 10.0) -> Program:
    """A full circle as chords."""
    angle = 2 * np.pi * np.arange(chords + 1) / chords
    return polyline(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), source="circle of chords")


@cache
@cache
def star_spiral(chords: int = 1000, chord: float = 0.2) -> Program:
    """Five-lobed star on an Archimedean spiral, chords of about `chord` [mm]."""
    t = np.linspace(0.0, 26.0, 200_001)
    r = (3 + 0.45 * t) * (1 + 0.2 * np.cos(5 * t))
    curve = np.stack([r * np.cos(t), r * np.sin(t)], axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = np.arange(chords + 1) * chord
    if at[-1] > length[-1]:
        raise ValueError(f"star_spiral: {at[-1]:g} mm asked for, the curve has {length[-1]:g} mm")
    points = np.stack([np.interp(at, length, curve[:, k]) for k in range(2)], axis=1)
    return polyline(points - points[0], source="star spiral")


def five_points() -> Program:
    """The 5-point path of paper 002 (docs/papers.md E: the reading with symmetric leg lengths), feed 5000 mm/min."""
    points = [(0, 0, 0), (0.5, 0, 0), (1.0, 0.4, 0.4), (0.6, 0.9, 0.8), (0.1, 0.9, 0.8)]
    return polyline(points, feed=5000 / 60, source="five points")


def five_points_machine() -> Machine:
    """Paper 002's limits: A_max 3.6e7 mm/min^2 normal, dt 4 ms, eps 0.05 mm; axes far too strong to matter."""
    return machine(velocity=1e3, acceleration=1e6, jerk=1e10, dt=0.004, normal_acceleration=1e4)


def random_axes(
    rng: np.random.Generator,
    *,
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
    jerk: tuple[float, float],
) -> dict[str, Axis]:
    """x, y and z with limits of their own, log-uniform between the powers of ten that are given."""
    return {
        letter: Axis(
            velocity=10 ** rng.uniform(*velocity),
            acceleration=10 ** rng.uniform(*acceleration),
            jerk=10 ** rng.uniform(*jerk),
        )
        for letter in "xyz"
    }


def random_polyline(
    rng: np.random.Generator,
    *,
    blocks: int = 12,
    dimensions: int = 3,
    shortest: float = 0.01,
    longest: float = 20.0,
) -> Program:
    """Random walk: leg lengths log-uniform [mm], directions uniform on the sphere."""
    length = np.exp(rng.uniform(np.log(shortest), np.log(longest), blocks))
    direction = rng.normal(size=(blocks, dimensions))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    steps = direction * length[:, None]
    points = np.vstack([np.zeros(dimensions), np.cumsum(steps, axis=0)])
    return polyline(points, source="random polyline")


ARCS = """G21 G17 G90 G94 F6000
G1 X10
G3 X20 Y10 I0 J10
G1 Y20
G2 X30 Y30 I10
G2 X40 Y20 J-10
G1 X40 Y12
G3 X50 Y12 I5 J0
G1 X60 Y20 Z2
G2 X60 Y20 Z6 I4 J3 P2
G18
G3 X70 Z6 I5 K0
G19
G2 Y30 Z6 J5
G17
G1 X0 Y0 Z0
M2
"""


def arcs() -> Program:
    """Lines, arcs in three planes, a helix of two turns; tangent and sharp joints between all of them."""
    return parse_program(ARCS, source="arcs")


def all_jobs() -> dict[str, Program]:
    """The named jobs, small enough for every test."""
    return {
        "pentagon": pentagon(),
        "zigzag": zigzag(),
        "circle": chord_circle(),
        "spiral": star_spiral(400),
        "five points": five_points(),
        "arcs": arcs(),
    }
