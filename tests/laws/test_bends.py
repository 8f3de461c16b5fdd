"""Arcs and curves that bend within the tolerance: the motion need not follow them."""

from itertools import pairwise

import pytest

import planner
from planner.nc.reader import parse_program

MILL = planner.load_machine("mill")
# Beside a line from X0 to X6, none of them as far from it as the tolerance of 0.1 mm, from `begin` to `end` in order.
DETOURS = {
    "half a circle": ("G2 X3.1 Y0 I0.05 J0", 3.1),
    "a circle": ("G3 X3 Y0 I0 J0.04", 3.0),
    "a curve that comes back": ("G5 X3.02 Y0 I0.2 J0.06 P-0.2 Q0.06", 3.02),
    "a helix": ("G17 G2 X3 Y0 Z0 I0.03 J0 P2", 3.0),
}


def planned(blocks: str, tolerance: float, feed: float = 4000.0):
    made = planner.plan(parse_program(f"G21 G90 G17 G64 P{tolerance} F{feed}\n{blocks}\nM2\n"), MILL)
    assert made.verdict.passed, made.verdict.faults
    return made


@pytest.mark.parametrize("name", DETOURS)
def test_a_detour_within_the_tolerance_costs_no_time(name):
    """A straight line is within the tolerance of it, in order."""
    detour, _ = DETOURS[name]
    straight = planned("G1 X6", 0.1).cycle_time
    assert planned(f"G1 X3\n{detour}\nG1 X6 Y0", 0.1).cycle_time == pytest.approx(straight, rel=2e-4)


def test_more_tolerance_at_a_narrow_bend_takes_less_time():
    """From where the curve is followed to where it is cut off: its smallest radius is 9 um."""
    bend = "G5 X0.21 Y0.24 I0.25 J-0.1 P-0.08 Q0.07\nG1 X0.5 Y0.8"
    times = [planned(bend, tolerance, 6000.0).cycle_time for tolerance in (0.003, 0.01, 0.03, 0.06, 0.1)]
    assert all(more < less * (1.0 - 1e-3) for less, more in pairwise(times))
