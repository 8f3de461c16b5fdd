"""What holds a motion whose geometry and feed were found together."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod

MACHINE = problems.machine()
PROGRAMS = {
    "corner": problems.polyline([[0, 0], [6, 0], [9, 4]], feed=90.0),
    "dwells": parse_program("G21 G90 F4800\nG4 P0.2\nG1 X6\nY6\nG4 P0.3\nX2\nM2\n"),
}


@cache
def made(name: str) -> Plan:
    return TubeMethod(start=OptimalMethod(corner="bezier")).plan(PROGRAMS[name], MACHINE).require()


@pytest.mark.parametrize("name", PROGRAMS)
def test_it_follows_the_delivered_motion(name):
    """Times, places and feeds are those of the samples, shares are times, and the motion is nearly always at something."""
    plan = made(name)
    grid, seen = plan.grid, plan.trajectory
    assert grid.t[0] == 0.0
    assert (np.diff(grid.t) >= 0).all()
    assert grid.t[-1] <= seen.cycle_time
    lasting = np.diff(grid.t, append=seen.cycle_time)
    np.testing.assert_allclose(grid.share, lasting @ grid.reached / seen.cycle_time, atol=2e-3)
    assert (grid.reached.any(axis=1)).all()
    assert grid.reached[np.arange(len(grid.t)), grid.active].all(), "what is shown is active"
    np.testing.assert_allclose(grid.s, np.interp(grid.t, seen.t, seen.s), atol=0.05)
    np.testing.assert_allclose(grid.feed, np.interp(grid.t, seen.t, seen.feed), atol=1.0)
    assert dict(grid.ranked()).get("none", 0.0) < 0.05
    rest = float(plan.toolpath.dwell.sum()) / seen.cycle_time
    assert dict(grid.ranked()).get("rest", 0.0) == pytest.approx(rest, rel=1e-2)
    assert np.count_nonzero(grid.active == grid.active_names.index("rest")) == np.count_nonzero(
        plan.toolpath.dwell
    )


def test_it_rests_where_the_motion_stands():
    """The program waits before its first move and before its last one."""
    plan = made("dwells")
    grid, seen = plan.grid, plan.trajectory
    rests = np.flatnonzero(grid.active == grid.active_names.index("rest"))
    lasting = np.diff(grid.t, append=seen.cycle_time)[rests]
    assert grid.t[rests[0]] == 0.0
    assert lasting == pytest.approx([0.2, 0.3], abs=2e-3)
    assert np.interp(grid.t[rests] + lasting / 2.0, seen.t, seen.feed) == pytest.approx(0.0, abs=1e-9)


def test_of_what_holds_a_corner_the_tolerance_is_shown_as_it_costs_most():
    """The vertex is in one step; an acceleration's price is paid in all the steps that are at it."""
    plan = made("corner")
    grid, names, prices = plan.grid, plan.grid.active_names, plan.prices
    corner, y = int(np.abs(grid.s - 6.0).argmin()), names.index("acceleration.y")
    assert grid.reached[corner, [y, names.index("tolerance")]].all()
    in_a_step = prices.limits["acceleration.y"] * MACHINE.axes["y"].acceleration / grid.reached[:, y].sum()
    assert prices.corners.price[0] * MACHINE.tolerance < 5.0 * in_a_step < 0.0
    assert names[grid.active[corner]] == "tolerance"


def test_the_limit_that_it_names_is_used():
    """Jerks, accelerations and the feed named for a step are within 2 % of the limits in the samples of the middle half of the step."""
    plan = made("corner")
    grid, seen = plan.grid, plan.trajectory
    end = np.append(grid.t[1:], seen.cycle_time)
    step = np.searchsorted(grid.t, seen.t, side="right") - 1
    inside = np.abs((seen.t - grid.t[step]) / (end - grid.t)[step] - 0.5) < 0.05
    names = np.array(grid.active_names)[grid.active[step]]
    looked = 0
    for k, axis in enumerate(seen.axes):
        for quantity in ("jerk", "acceleration"):
            rows = inside & (names == f"{quantity}.{axis}")
            share = np.abs(getattr(seen, quantity)[rows, k]) / MACHINE.limits(quantity, (axis,))[0]
            looked += rows.sum()
            assert (share > 0.98).all()
    assert (seen.feed[inside & (names == "feed")] > 0.98 * 90.0).all()
    assert looked > 5
