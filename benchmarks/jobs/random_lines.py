"""Seeded random jobs of lines and arcs.

2 to 12 blocks in two or three axes, on machines whose limits differ by axis, with jerks from tight to loose, four tolerances and four
interpolation periods: suite `random`, and jobs of tests and other scripts.
"""

from __future__ import annotations

import numpy as np

from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program

TOLERANCES = 0.005, 0.02, 0.05, 0.2  # [mm]
PERIODS = 0.001, 0.002, 0.004, 0.016  # [s]
PLANES = {"G17": ("X", "Y", "Z"), "G18": ("Z", "X", "Y"), "G19": ("Y", "Z", "X")}


def job(seed: int) -> tuple[Program, Machine]:
    """The random job of that number."""
    rng = np.random.default_rng([13, seed])
    return _program(rng), _machine(rng)


def _program(rng: np.random.Generator) -> Program:
    three = rng.uniform() < 0.5
    scale = 10.0 ** rng.uniform(-0.5, 1.5)  # of the blocks [mm]
    lines, at = [f"G21 G90 G94 G17 F{60 * 10 ** rng.uniform(0.7, 2.3):.0f}"], np.zeros(3)
    for _ in range(int(rng.integers(2, 13))):
        step = rng.normal(size=3) * scale * 10.0 ** rng.uniform(-0.7, 0.3)
        step[2] *= three
        new = np.round(at + step, 3)
        if rng.uniform() < 0.3:
            plane = str(rng.choice(list(PLANES))) if three else "G17"
            first, second, third = PLANES[plane]
            index = ["XYZ".index(axis) for axis in (first, second)]
            chord = float(np.linalg.norm((new - at)[index]))
            if chord > 0.05:
                new["XYZ".index(third)] = at["XYZ".index(third)]
                words = " ".join(f"{'XYZ'[k]}{new[k]:.3f}" for k in index)
                radius = chord * rng.uniform(0.55, 3.0)
                lines.append(f"{plane} G{rng.integers(2, 4)} {words} R{radius:.4f}")
                at = new
                continue
        lines.append(f"G1 X{new[0]:.3f} Y{new[1]:.3f} Z{new[2]:.3f}")
        at = new
    return parse_program("\n".join([*lines, "M2"]) + "\n", source="random job")


def _machine(rng: np.random.Generator) -> Machine:
    acceleration, delay = 10.0 ** rng.uniform(2.3, 4.0), 10.0 ** rng.uniform(-2.5, -1.3)
    axes = {}
    for letter in "xyz":
        a = acceleration * rng.uniform(0.5, 1.5)
        axes[letter] = Axis(
            velocity=rng.uniform(60.0, 300.0), acceleration=a, jerk=a / (delay * rng.uniform(0.7, 1.4))
        )
    return Machine(
        name="random", dt=float(rng.choice(PERIODS)), tolerance=float(rng.choice(TOLERANCES)), axes=axes
    )
