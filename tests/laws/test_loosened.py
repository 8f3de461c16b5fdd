"""What is loosened costs no time: the tolerance is kept for chords as far as a motion needs it, and the path has the rest."""

from __future__ import annotations

import pytest

import planner
from planner.machine import Machine, load_machine

CORNERS = "G21 G90 G64 P{tolerance:g}\nG0 X0 Y0\nG1 F20000 X0.8 Y0.5\nX1.7 Y-0.4\nX2.1 Y0.9\nX3.4 Y0.2\nX3.1 Y-0.7\nM2\n"
ACCELERATION, JERK = 20_000.0, 2e6  # [mm/s2], [mm/s3]
# What the search may end apart by: its reserve follows a motion in long steps [share of the time].
APART = 3e-3


def machine(times: float, period: float) -> Machine:
    mill = load_machine("mill")
    axes = {
        name: axis.model_copy(update={"acceleration": ACCELERATION * times, "jerk": JERK})
        for name, axis in mill.axes.items()
    }
    return mill.model_copy(update={"axes": axes, "dt": period})


def cycle_time(times: float, tolerance: float, period: float) -> float:
    made = planner.plan(
        planner.read_program(text=CORNERS.format(tolerance=tolerance)), machine(times, period)
    ).require()
    assert made.verdict.passed
    return made.cycle_time


@pytest.mark.parametrize(("tolerance", "period"), [(0.05, 0.002), (0.02, 0.001), (0.2, 0.004)])
def test_more_acceleration_costs_no_time(tolerance: float, period: float):
    """Chords of the largest acceleration that the axes give would take up to half of the tolerance from the path."""
    as_it_is = cycle_time(1.0, tolerance, period)
    for times in (1.86, 4.0):
        assert cycle_time(times, tolerance, period) <= as_it_is * (1.0 + APART)


def test_longer_periods_cost_what_their_chords_need():
    """Jerk-limited corners have a fraction of the normal acceleration that the axes could give."""
    short, long = (cycle_time(4.0, 0.05, period) for period in (0.00025, 0.002))
    assert short < long < short * 1.02
