"""Shares of the time: how long each limit is active, in closed form."""

from __future__ import annotations

import pytest

import planner
from planner.machine import Machine
from planner.nc.reader import parse_program

V, A, FEED = 120.0, 1500.0, 40.0


def machine() -> Machine:
    axis = {"velocity": V, "acceleration": A, "jerk": 1e6}
    return Machine(name="m", dt=0.001, tolerance=0.02, axes={"x": axis, "y": axis})


def held(text: str, on: Machine) -> dict[str, float]:
    plan = planner.plan(parse_program(text, on), on, method="second-order")
    assert plan.grid is not None
    return dict(plan.grid.ranked())


@pytest.mark.shows("activity", "exact: closed forms")
def test_a_straight_move_is_at_its_acceleration_then_at_its_feed() -> None:
    """Two ramps of F/a and L/F - F/a in between."""
    length, ramp = 50.0, FEED / A
    total = length / FEED + ramp
    found = held(f"G21 G1 X50 F{60 * FEED}\n", machine())
    assert found["feed"] == pytest.approx((total - 2 * ramp) / total, abs=0.01)
    assert found["acceleration.x"] == pytest.approx(2 * ramp / total, abs=0.01)
    assert found.get("none", 0.0) < 0.01


@pytest.mark.shows("activity", "exact: closed forms")
def test_limits_that_are_active_together_count_in_full_each() -> None:
    """On a diagonal both axes speed up and brake at their limits together: each for the whole of the ramps, v/a of both."""
    length, ramp = 50.0 * 2**0.5, FEED / (A * 2**0.5)
    share = 2 * ramp / (length / FEED + ramp)
    found = held(f"G21 G1 X50 Y50 F{60 * FEED}\n", machine())
    assert found["acceleration.x"] == found["acceleration.y"] == pytest.approx(share, abs=0.01)
    assert found["feed"] == pytest.approx(1.0 - share, abs=0.01)
    assert sum(found.values()) == pytest.approx(1.0 + share, abs=0.02)


@pytest.mark.shows("activity", "exact: closed forms")
def test_dwells_are_nothing_of_the_motion() -> None:
    total = 50.0 / FEED + FEED / A + 0.75
    found = held(f"G21 G1 X20 F{60 * FEED}\nG4 P0.75\nX50\n", machine())
    assert found["rest"] == pytest.approx(0.75 / (total + FEED / A), abs=0.005)


@pytest.mark.parametrize(("share", "is_held"), [(0.993, True), (0.987, False)])
def test_within_one_percent_of_a_limit_is_at_it(share: float, is_held: bool) -> None:
    """At a feed that is this share of what the axis can do, for most of a long move."""
    found = held(f"G21 G1 X400 F{60 * share * V}\n", machine())
    assert found["feed"] > 0.9
    assert (found.get("velocity.x", 0.0) > 0.9) == is_held
