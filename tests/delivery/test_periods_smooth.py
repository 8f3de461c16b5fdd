"""Long periods on smooth paths: chords that use a little too much of the tolerance make the motion a little slower, not stop."""

from __future__ import annotations

import pytest

from benchmarks.jobs import problems
from planner.nc.reader import parse_program
from planner.planning.methods.registry import plan

TEXT = "G20\nG0 X1 Y2 Z3\nF120000\nG90 G5.1 X13.397 Y-17.91 I-10.207 J1.930\nM2\n"


@pytest.mark.parametrize(("effort", "most"), [("quick", 0.29), ("normal", 0.271)])
def test_more_acceleration_makes_a_curve_no_slower_where_chords_use_all_of_the_tolerance(effort, most):
    """Found by the campaign of random jobs: a contour error of 1.0002 of the tolerance made four full stops on a curve."""
    times = []
    for acceleration in (1e5, 127654.57115307987):
        machine = problems.machine(
            velocity=4000.0, acceleration=acceleration, jerk=3e7, dt=0.002, tolerance=0.020613872754349807
        )
        made = plan(parse_program(TEXT, machine), machine, effort=effort)
        assert made.verdict.passed, made.verdict.faults
        times.append(made.cycle_time)
    assert times[1] < times[0]
    assert times[0] < most
