"""Prices by place: closed forms of a straight line, sums, and jobs planned again with more feed on one line."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import load_machine
from planner.nc.program import PathControl
from planner.planning.job.plan import Plan
from planner.sensitivity.path_prices import bounds_but_speeds, bounds_with
from planner.sensitivity.prices import MORE_LIMIT
from planner.sensitivity.records import PlacePrices

MILL = load_machine("mill")
TENTH = 1.0 - 1.0 / 1.1  # share of a time that a tenth more speed saves [-]


def places_of(plan: Plan) -> PlacePrices:
    assert plan.prices is not None
    assert plan.prices.places is not None
    return plan.prices.places


def test_a_straight_line_has_its_closed_form() -> None:
    """T = L/F + 2 (F/j)^(1/2) where the acceleration stays below its limit: all limits together, d/d(ln F) + d/d(ln j), save L/F."""
    length, feed, jerk = 100.0, 100.0, MILL.axes["x"].jerk
    plan = planner.plan(planner.path([[0, 0], [length, 0]], feed=feed), MILL)
    assert plan.cycle_time == pytest.approx(length / feed + 2.0 * np.sqrt(feed / jerk), rel=1e-3)
    places = places_of(plan)
    assert places.limits == pytest.approx([length / feed * TENTH], rel=1e-2)
    assert places.feed == pytest.approx([(length / feed - np.sqrt(feed / jerk)) * TENTH], rel=1e-2)


@pytest.fixture(scope="module")
def zigzag() -> Plan:
    program = planner.path([[0, 0], [30, 0], [35, 20], [60, 25], [60, 60]], feed=[40.0, 60.0, 80.0, 500.0])
    return planner.plan(program, MILL, geometry="corners")


@pytest.mark.parametrize("segment", [0, 2, 3])
def test_more_feed_on_one_line_saves_what_is_foretold(zigzag: Plan, segment: int) -> None:
    program = zigzag.program
    feed = program.feed.copy()
    feed[segment] *= 1.0 + MORE_LIMIT
    again = planner.plan(dataclasses.replace(program, feed=feed), MILL, geometry="corners")
    saved = zigzag.cycle_time - again.cycle_time
    told = places_of(zigzag).feed[segment]
    if segment == 3:  # no motion on the mill reaches 500 mm/s in 35 mm
        assert (saved, told) == pytest.approx((0.0, 0.0), abs=1e-4)
    else:
        assert told == pytest.approx(saved, rel=0.1)
        assert saved > 0.02


def test_places_add_up_to_the_whole(zigzag: Plan) -> None:
    assert zigzag.prices is not None
    places = places_of(zigzag)
    assert places.tolerance is None
    assert places.feed.sum() == pytest.approx(-zigzag.prices.feed * TENTH, rel=0.05)
    assert (places.limits >= places.feed - 1e-6).all()


def test_prices_of_a_joint_search_stand_where_the_motion_pays() -> None:
    """The last line alone is run at its feed, and saves what its length says; tolerance saves at corners, not at stops."""
    points, slow = [[0, 0], [30, 0], [35, 20], [60, 25], [60, 60]], 40.0
    control = [PathControl.BLEND, PathControl.EXACT_STOP, PathControl.BLEND, PathControl.BLEND]
    program = problems.polyline(points, feed=np.array([500.0, 500.0, 500.0, slow]), path_control=control)
    plan = planner.plan(program, MILL)
    places, stops = places_of(plan), plan.toolpath.joint == Joint.STOP
    assert places.feed[-1] == pytest.approx(35.0 / slow * TENTH, rel=0.05)
    assert places.feed[:-1] == pytest.approx([0.0] * 3, abs=1e-5)
    assert places.limits[-1] > 5.0 * places.limits[:-1].max()
    assert places.tolerance is not None
    assert stops.tolist() == [True, False, True, False, True]
    assert (places.tolerance[stops] == 0.0).all()
    assert (places.tolerance[~stops] < -0.1).all()


@pytest.mark.parametrize("change", ["feed", "velocity.x"])
def test_bounds_of_speeds_beside_those_of_all_other_limits_are_the_bounds_of_all(change: str) -> None:
    given = toolpath_from_program(problems.zigzag(), MILL)
    fast = np.where(np.arange(len(given)) % 2, 20.0, 1.0)  # half of it faster than the axes
    toolpath = dataclasses.replace(given, feed=fast * given.feed)
    path = round_corners(toolpath, MILL, BezierCorner(), blend_tangents=True)
    samples = sample_path(path, MILL, third_order=True)
    rest = bounds_but_speeds(samples, MILL)
    assert rest is not None
    assert np.isfinite(rest).any()
    more = bounds_with(samples, MILL, change, 0.1, rest)
    np.testing.assert_array_equal(more, bounds_with(samples, MILL, change, 0.1))
    assert (more != bounds_with(samples, MILL, change, 0.0, rest)).any()
