"""Programs that have broken planners before, each small: needles, reversals, blocks of a rounding, turns of a circle, far places,
extreme limits. And three of the quick suite."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.jobs import problems
from planner.machine import Machine
from planner.nc.program import Program

HEAD = "G21 G17 G90 G94 F6000\n"
STOPS = """G21 G17 G90 G94 F6000
G1 X8
G3 X12 Y4 I0 J4
G4 P0.1
G61.1 G1 Y8
X6 Y9
G61 X2 Y8.5
G64 P0.02 X0 Y6
G1 Z2 F1500
M2
"""
LINES_AND_ARCS = (
    "G21 G17 G90 G94 F6000\nG1 X4\nG3 X8 Y4 I0 J4\nG2 X12 Y8 Z1 I4 J0\nG1 X15 Y6\nG2 X18 Y6 I1.5 J0\nM2\n"
)


def small_relief(blocks: int = 150) -> Program:
    """Rows of short chords over a wavy surface with flats."""
    per_row, step = 50, 0.3
    rng = np.random.default_rng(3)
    size, wave, phase = rng.normal(size=12), rng.uniform(0.05, 0.6, (12, 2)), rng.uniform(0, 6.28, 12)
    points = []
    for k in range(blocks + 1):
        row, column = divmod(k, per_row)
        x, y = step * (column if row % 2 == 0 else per_row - 1 - column), 0.4 * row
        z = float((0.4 * size * np.sin(wave[:, 0] * x + wave[:, 1] * y + phase)).sum())
        points.append((x, y, 0.8 + 0.3 * (z - 0.8) if z > 0.8 else z))
    return problems.polyline(np.array(points) - points[0], source="relief")


def _moves(points: list[tuple[float, ...]], digits: int = 4) -> str:
    lines = [
        "G1 " + " ".join(f"{letter}{value:.{digits}f}" for letter, value in zip("XYZ", point, strict=False))
        for point in points
    ]
    return HEAD + "\n".join([*lines, "M2", ""])


def _teeth(count: int, height: float, width: float) -> str:
    """A saw: `count` teeth of a height and a width [mm]."""
    return _moves([(0.5 * width * (k + 1), height * (k % 2 == 0)) for k in range(2 * count)])


PROGRAMS: dict[str, str] = {
    "reversal": _moves([(10.0, 0.0), (0.0, 0.0), (10.0, 0.0)]),
    "almost a reversal": _moves([(10.0, 0.0), (0.0, 0.01), (10.0, 0.02)]),
    "needles": _teeth(6, 5.0, 0.01),
    "saw of 0.1 mm": _teeth(20, 0.1, 0.1),
    "blocks of a rounding": _moves([(0.001 * k, 0.001 * (k % 2)) for k in range(1, 60)], 3),
    "long, short, long": _moves([(20.0, 0.0), (20.0, 0.002), (40.0, 0.002), (40.0, 20.0)]),
    "the same point twice": HEAD + "G1 X5\nX5\nX5 Y5\nX5 Y5\nX0 Y5\nM2\n",
    "a tiny circle": HEAD + "G1 X5\nG2 X5 Y0 I0.003 J0\nG1 X10\nM2\n",
    "full circles": HEAD + "G2 X0 Y0 I5 J0\nG2 X0 Y0 I5 J0\nG3 X0 Y0 Z1 I-4 J0 P3\nM2\n",
    "arcs against each other": HEAD + "G2 X4 Y0 R2\nG3 X8 Y0 R2\nG2 X12 Y0 R2\nG2 X8 Y0 R2.5\nM2\n",
    "far away": HEAD + "G0 X2000 Y2000\nG1 X2001\nY2001\nX2000\nM2\n",
    "feeds over decades": HEAD + "G1 X5 F60000\nY1 F30\nX0 F6000\nY0.98 F1\nX0.01 F6000\nX10\nM2\n",
    "rapids between": HEAD + "G0 X10\nG1 Y10\nG0 X0\nG1 Y0 F600\nG0 Z5\nM2\n",
    "modes mixed": HEAD + "G1 X5\nG61 Y5\nG61.1 X0\nG64 P0.001 Y2\nX5\nG64 P0.5 Y8\nX0\nG4 P0.05\nY0\nM2\n",
    "loose tolerance": _moves([(2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)]),
    "tight tolerance": _moves([(2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)]),
    "slow jerk": _moves([(8.0, 0.0), (8.0, 8.0), (16.0, 8.0)]),
    "fast jerk": _moves([(8.0, 0.0), (8.0, 8.0), (16.0, 8.0)]),
    "a weak axis": _moves([(8.0, 0.0, 1.0), (8.0, 8.0, -1.0), (16.0, 8.0, 0.0)]),
    "a long period": _moves([(1.0, 0.0), (1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (3.0, 2.0)]),
}
QUICK = ("almost a reversal", "long, short, long", "rapids between", "arcs against each other")


def _weak() -> Machine:
    """A z axis with a hundredth of the others' limits."""
    strong = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 2e5}
    weak = {name: 0.01 * value for name, value in strong.items()}
    return problems.machine(axes={"x": strong, "y": strong, "z": weak})


MACHINES: dict[str, Callable[[], Machine]] = {
    "far away": partial(problems.machine, velocity=1e3),
    "loose tolerance": partial(problems.machine, tolerance=1.0),
    "tight tolerance": partial(problems.machine, tolerance=1e-4),
    "slow jerk": partial(problems.machine, jerk=2e3),
    "fast jerk": partial(problems.machine, jerk=2e8),
    "a weak axis": _weak,
    "a long period": partial(problems.machine, dt=0.016),
}
