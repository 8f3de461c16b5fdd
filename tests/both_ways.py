"""A dozen jobs, planned in a process of their own with the sizes that PLANNER_SIZES names: `python -m tests.both_ways FOLDER`.

Each job leaves its setpoints, its verdict and its files, so that the ways of large jobs can be held against those of small ones
(tests/base/test_sizes.py).
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.jobs import problems
from planner.machine import Axis, Fir, Machine
from planner.nc.program import Program
from planner.report.export import write_plan

# In one direction without a corner; turns, arcs and changes of F; a chain of short chords; dwells, rapids, full stops.
STRAIGHT = "G21 G90 F900\nG1 X7\nG1 X15\nM2\n"
TURNS = "G21 G90 G64 P0.03 F3000\nG1 X6\nY5\nG3 X0 Y11 J6\nF1500 G1 X-7\nG2 X-7 Y3 I0 J-4\nG1 X-2 Y1\nM2\n"
CHORDS = "G21 G90 G64 P0.02 F2400\n" + "".join(
    f"G1 X{0.4 * k:.3f} Y{2.0 * np.sin(0.31 * k) + 0.3 * np.cos(1.7 * k):.3f}\n" for k in range(1, 61)
)
STOPS = (
    "G21 G90 F2000\nG0 X4 Z2\nG1 Z-1 F600\nG4 P0.02\nG61.1\nG1 X9 Y3\nX3 Y6\nG64 P0.02\nX1 Y1\nG0 Z4\nM2\n"
)
PRINT = "G21 G90 M83 F2400\nG1 X5 E0.4\nX9 Y4 E0.4\nG1 E-1 F1800\nG0 X9 Y9\nG1 E1 F1800\nG1 X2 Y9 E0.5 F2400\nX0 Y5 E0.4\nM2\n"
# A picture for a laser: short lines, each with its power.
RASTER = "G21 G90 G64 P0.05 F3000\nM4 S0\n" + "".join(
    f"G1 X{0.7 * (x if y % 2 else 11 - x):.1f} Y{0.2 * y:.1f} S{37 * x * (y + 1) % 1000}\n"
    for y in range(8)
    for x in range(12)
)
LOOP = "G21 G90 G64 P0.02 F1800\n#1=0\nO100 WHILE [#1 LT 30]\n#1=[#1+1]\nG1 X[#1*0.7] Y[#1-2*FIX[#1/2]]\nO100 ENDWHILE\nM2\n"


@dataclass(frozen=True)
class Job:
    """A program, its machine, and how it is planned."""

    name: str
    program: Program | str
    method: str = "optimal"
    machine: Machine = field(default_factory=problems.machine)
    settings: dict[str, Any] = field(default_factory=dict)


def with_filters() -> Machine:
    """Behind which nothing is run slower by what the verdict measures: its rounding would count in the setpoints."""
    return problems.machine(fir=Fir(time_constants=(0.006, 0.003)))


def with_extruder() -> Machine:
    axis = Axis(velocity=100.0, acceleration=2000.0, jerk=2e5)
    return problems.machine(
        axes=dict.fromkeys("xyz", axis) | {"e": Axis(velocity=60.0, acceleration=1500.0, jerk=4e4)}
    )


def jobs() -> list[Job]:
    return [
        Job("straight", STRAIGHT),
        Job("turns", TURNS),
        Job("chords", CHORDS),
        Job("stops", STOPS),
        Job("loop", LOOP),
        Job("quick", CHORDS, settings={"effort": "quick"}),
        Job("corners", TURNS, settings={"corner": "bezier"}),
        Job("filters", TURNS, machine=with_filters(), settings={"effort": "quick"}),
        Job("print", PRINT, machine=with_extruder(), settings={"effort": "quick"}),
        Job("second-order", CHORDS, method="second-order"),
        Job("kinematic", CHORDS, method="kinematic"),
        Job("raster", RASTER + "M5\nM2\n", method="kinematic"),
        Job("bezier", TURNS, method="bezier"),
        Job("fir", problems.pentagon(), method="fir"),
        Job("fir-spline", problems.pentagon(), method="fir-spline"),
        Job("stop", STOPS, method="stop"),
    ]


def main(folder: Path) -> None:
    for job in jobs():
        program: Program | Path
        if isinstance(job.program, str):
            program = folder / f"{job.name}.ngc"
            program.write_text(job.program, encoding="utf-8")
        else:
            program = job.program
        made = planner.plan(program, job.machine, method=job.method, **job.settings)
        assert made.trajectory is not None
        assert made.verdict is not None
        write_plan(made, folder / job.name)
        found = made.trajectory
        np.savez(
            folder / f"{job.name}.npz",
            **{name: getattr(found, name) for name in ("t", "position", "velocity", "acceleration", "line")},
        )
        verdict = {
            "passed": made.verdict.passed,
            "kind": type(found).__name__,
            "time": made.cycle_time,
            "ratios": {name: check.ratio for name, check in made.verdict.limits.items()},
            "corners": int(np.isfinite(made.verdict.corners.budget_ratio).sum()),
        }
        (folder / f"{job.name}.json").write_text(json.dumps(verdict), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
