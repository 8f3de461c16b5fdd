"""Where intervals may be longer than a part of a/j: nothing but points is lost."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.elements import element_table
from planner.corners.smooth import round_corners
from planner.feedrate.sampling import samples as path_module
from planner.feedrate.sampling.feed_limited import GROWTH, feed_limited, interval_ends, quiet_way
from planner.geometry.build import toolpath_from_program
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import OptimalMethod

EVERYWHERE = np.array([[-np.inf, np.inf]])
SHORT = problems.machine(acceleration=200.0, jerk=2e6)  # a/j = 0.1 ms


@given(st.integers(0, 10**6))
@settings(max_examples=60)
def test_intervals_grow_with_the_distance_from_what_is_not_calm_and_no_faster(seed):
    rng = np.random.default_rng(seed)
    base, quiet, start = 10.0 ** rng.uniform(-3, 0), 10.0 ** rng.uniform(-2, 1), rng.uniform(0, 100)
    edges = start + np.sort(rng.uniform(0, 100, 6))
    busy = np.concatenate([[[start - 1.0, start]], edges.reshape(3, 2), [[start + 101.0, start + 101.0]]])
    left, right = edges[1] - start, edges[2] - start  # between the first stretch and the second
    ends = interval_ends(start, left, right, base, np.inf, quiet, busy)
    assert ends[0] == left
    assert ends[-1] == right
    step = np.diff(ends)
    away = np.minimum(ends[:-1] - left, right - ends[1:]) - quiet
    assert (step > 0.0).all()
    assert (step <= 1.5 * np.maximum(base, GROWTH * away) * (1 + 1e-9)).all()
    assert len(step) <= 2.0 * (min(quiet, right - left) / base + np.log(1e8) / np.log1p(GROWTH)) + 2.0
    inside = interval_ends(start, *(edges[:2] - start), base, np.inf, quiet, busy)
    np.testing.assert_allclose(np.diff(inside), np.diff(inside)[0])
    assert np.diff(inside)[0] <= base * (1 + 1e-9)


def test_corners_stops_feed_changes_and_tight_arcs_are_not_calm():
    program = parse_program(
        "G21 G90 G17 G64\nG1 X20 F1200\nG3 X40 Y20 R20\nG1 Y40\nG1 Y60 F600\nG2 X40.1 Y60.1 R0.1\nG2 X60 Y80 R20\nM2\n"
    )
    path = round_corners(toolpath_from_program(program, SHORT), SHORT, BezierCorner(), blend_tangents=True)
    limits = tuple(SHORT.limits(q, path.toolpath.axes) for q in ("velocity", "acceleration", "jerk"))
    found = feed_limited(path, element_table(path), limits)
    assert (found.busy[1:, 0] > found.busy[:-1, 1]).all()

    def busy(place):
        return bool(((found.busy[:, 0] <= place) & (place <= found.busy[:, 1])).any())

    joint = path.legs.place[path.legs.first]
    assert all(busy(place) for place in joint)
    tight = int(np.argmin(np.where(path.legs.table["round"], path.legs.table["radius"], np.inf)))
    assert path.legs.table["radius"][tight] < 0.2
    assert busy(0.5 * (joint[tight] + joint[tight + 1]))
    wide = int(np.argmax(path.legs.table["radius"]))
    assert not busy(0.5 * (joint[wide] + joint[wide + 1]))
    change = path.legs.place[1:-1][np.diff(path.toolpath.feed) != 0.0]
    assert len(change)
    assert all(busy(place) for place in change)
    # arcs of radius 20 mm at 20 mm/s: r'' F^2 = 20 mm/s2, a tenth of the limit, and 1e-5 of that of the jerk
    assert found.feed_sq[wide] == pytest.approx(200.0 * 20.0, rel=0.02)


def test_the_speed_changes_within_the_quiet_way():
    """By F at half of the limits, from the closed forms of a jerk-limited change of speed."""
    for F in (1.0, 30.0, 1000.0):
        a, j = 100.0, 1e5
        reached = a * a / (2 * j) <= F  # half of the acceleration
        needed = F / (a / 2) + a / j if reached else 2.0 * np.sqrt(F / (j / 2))
        way = quiet_way(np.array([F]), np.array([a, 5 * a]), np.array([j, 5 * j]))[0]
        assert way >= F * needed * (1 - 1e-12)
        assert not reached or way <= 1.01 * F * needed


@pytest.mark.slow
@pytest.mark.parametrize("corner", ["bezier", "spline"])
def test_short_a_over_j_needs_no_more_points_and_no_more_time(corner, monkeypatch):
    program = parse_program("G21 G90 G17 F900\nG1 X10\nG3 X30 Y20 R20\nG2 X34 Y24 R4\nG1 X60 Y30\nM2\n")
    method = OptimalMethod(corner=corner)
    few = method.plan(program, SHORT)

    def nowhere(path, table, limits):
        none = feed_limited(path, table, limits)
        return none._replace(busy=EVERYWHERE, feed_sq=np.zeros(len(none.feed_sq)))

    monkeypatch.setattr(path_module, "feed_limited", nowhere)
    many = method.plan(program, SHORT)
    assert few.verdict.passed, few.verdict.faults
    assert many.grid_points > 10 * few.grid_points
    assert few.trajectory.cycle_time == pytest.approx(many.trajectory.cycle_time, rel=2e-4)


def test_points_do_not_depend_on_a_over_j_once_it_is_short():
    program = parse_program("G21 G90 G17 F900\nG1 X10\nG3 X30 Y20 R20\nG2 X34 Y24 R4\nG1 X60 Y30\nM2\n")
    counts = []
    for jerk in (2e5, 2e6, 2e7, 2e8):
        machine = problems.machine(acceleration=200.0, jerk=jerk)
        path = round_corners(
            toolpath_from_program(program, machine), machine, BezierCorner(), blend_tangents=True
        )
        counts.append(len(path_module.sample_path(path, machine, third_order=True)))
    assert max(counts) < 4 * min(counts)
    slow = dataclasses.replace(program, feed=program.feed / 30.0)
    path = round_corners(toolpath_from_program(slow, SHORT), SHORT, BezierCorner(), blend_tangents=True)
    assert len(path_module.sample_path(path, SHORT, third_order=True)) < 2 * max(counts)
