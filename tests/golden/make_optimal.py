"""Makes optimal.json: `PYTHONPATH=. python tests/golden/make_optimal.py` in the repository. Read the diff before committing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks import problems
from planner.machine import Machine
from planner.methods.optimal import OptimalMethod
from planner.nc.program import Program
from planner.nc.reader import parse_program

HERE = Path(__file__).resolve().parent

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


def relief(blocks: int = 150) -> Program:
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


def jobs() -> dict[str, tuple[Program, Machine]]:
    """Eight small jobs: corners, chords, arcs, three axes, stops; tight and loose jerk."""
    peers = problems.machine()
    return {
        "pentagon": (problems.pentagon(), peers),
        "zigzag": (problems.zigzag(10), problems.machine(jerk=5e4)),
        "five points": (problems.five_points(), problems.five_points_machine()),
        "lines and arcs": (parse_program(LINES_AND_ARCS), peers),
        "circle": (problems.chord_circle(90), peers),
        "spiral": (problems.star_spiral(60), peers),
        "relief": (relief(), peers),
        "stops": (parse_program(STOPS), peers),
    }


def results() -> dict[str, dict[str, float]]:
    """Cycle time and contour error of the default method."""
    found = {}
    for name, (program, machine) in jobs().items():
        made = OptimalMethod().plan(program, machine).require()
        assert made.verdict is not None
        assert made.verdict.passed, made.verdict.faults
        assert made.trajectory is not None
        found[name] = {
            "cycle_time_s": made.trajectory.cycle_time,
            "vertex_error_mm": made.verdict.vertex_error_mm,
        }
    return found


if __name__ == "__main__":
    (HERE / "optimal.json").write_text(json.dumps(results(), indent=1) + "\n", encoding="utf-8")
