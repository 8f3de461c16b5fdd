"""Random jobs of five axes with the tool centre point on: every kind of kinematics, lines and arcs, periods of 0.5 to 4 ms."""

from __future__ import annotations

import numpy as np

from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program

STREAM = 77  # of random numbers
KINDS = ("xyzac-trt", "xyzbc-trt", "head-table", "head-head")
PERIODS, TOLERANCES = (0.0005, 0.001, 0.002, 0.004), (0.005, 0.02, 0.05)  # [s], [mm]
# Powers of ten of the limits of every axis: [mm/s or deg/s], and so on.
VELOCITY, ACCELERATION, JERK = (1.7, 2.7), (3.0, 3.8), (4.3, 5.3)
LENGTH, TILT = (
    (-0.7, 1.4),
    (2.0, 60.0),
)  # of a block, as a power of ten [mm]; the least and the largest tilt [deg]
PER_LENGTH, LONGEST = (
    (1.0, 2.0),
    10.0,
)  # what tilt and c turn by, about [deg/mm], on so much of a block at most [mm]
ARCS, CHORD = 0.2, 2.0  # share of blocks with an arc behind them, and its chord [mm]


def job(seed: int) -> tuple[Program, Machine]:
    """Program and machine of that number."""
    rng = np.random.default_rng([STREAM, seed])
    machine = _machine(rng, KINDS[seed % len(KINDS)])
    assert machine.kinematics is not None
    return parse_program(_text(rng, machine.kinematics.rotary[0].upper()), machine), machine


def _machine(rng: np.random.Generator, kind: str) -> Machine:
    table = kind in KINDS[:2]
    tilt = kind[3] if table else str(rng.choice(["a", "b"]))
    data = {"type": kind, "tool_length": float(rng.uniform(30.0, 120.0))}
    if table:
        data |= {"z_rot_point": float(rng.uniform(-100.0, 0.0)), "z_offset": float(rng.uniform(-20.0, 40.0))}
    else:
        data |= {"tilt": tilt, "pivot_length": float(rng.uniform(50.0, 250.0))}
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION, "jerk": JERK}
    axes = {
        letter: Axis(**{name: float(10.0 ** rng.uniform(*powers)) for name, powers in limits.items()})
        for letter in ("x", "y", "z", tilt, "c")
    }
    period, tolerance = float(rng.choice(PERIODS)), float(rng.choice(TOLERANCES))
    return Machine(name=kind, dt=period, tolerance=tolerance, axes=axes, kinematics=data)


def _text(rng: np.random.Generator, tilt: str) -> str:
    lines = [f"G21 G90 G94 F{rng.integers(2000, 12000)}", "M428", f"G1 X20 Y0 Z10 {tilt}0 C0"]
    tip, angles = np.array([20.0, 0.0, 10.0]), np.zeros(2)
    for _ in range(rng.integers(4, 14)):
        length, way = 10.0 ** rng.uniform(*LENGTH), rng.normal(size=3)
        tip += way / np.linalg.norm(way) * length
        angles += rng.normal(size=2) * PER_LENGTH * min(length, LONGEST)
        angles[0] = np.clip(angles[0], *TILT)
        place = " ".join(f"{letter}{value:.4f}" for letter, value in zip("XYZ", tip, strict=True))
        lines.append(f"G1 {place} {tilt}{angles[0]:.4f} C{angles[1]:.4f}")
        if rng.random() < ARCS:
            tip[0] += CHORD
            lines.append(f"G2 X{tip[0]:.4f} Y{tip[1]:.4f} I{CHORD / 2} J0")
    return "\n".join([*lines, "M2", ""])
