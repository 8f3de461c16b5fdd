"""The problem record refuses bad data, and every bound alone against its closed form."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_problems import line

from planner.base.errors import NotSolvedError
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints import built_in
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.reader import parse_program

positive = st.floats(1e-3, 1e3)
curvature = st.floats(1e-6, 1e3)

REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "zero velocity": ({"velocity": [0.0, 1.0]}, "velocity: every value must be positive"),
    "negative acceleration": ({"acceleration": [1.0, -1.0]}, "acceleration: every value must be positive"),
    "zero jerk": ({"jerk": [0.0, 0.0]}, "jerk: every value must be positive"),
    "zero bound": ({"feed_sq_max": [1.0, 0.0, 1.0]}, "feed_sq_max: every value must be positive"),
    "infinite bound": ({"feed_sq_max": [1.0, np.inf, 1.0]}, "inf at index .1,.; every value must be finite"),
    "NaN in the path": ({"d1": np.full((3, 2), np.nan)}, "d1: nan at index"),
    "standing still": ({"s": [0.0, 1.0, 1.0]}, "1.0 mm at point 2 does not increase"),
    "backwards": ({"s": [0.0, 2.0, 1.0]}, "does not increase"),
    "piece of one point": ({"piece": [0, 2, 3]}, "every piece needs at least two points"),
    "margin of everything": ({"margin": [0.0, 1.0, 0.0]}, r"margin: every value must be in \[0, 1\)"),
    "negative margin": ({"margin": [0.0, -0.1, 0.0]}, "margin: every value must be in"),
    "wrong length": ({"margin": [0.0, 0.0]}, r"margin: shape \(2,\), expected \(3,\)"),
    "wrong axes": ({"acceleration": [1.0]}, r"acceleration: shape \(1,\), expected \(2,\)"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_data_is_refused(case: str) -> None:
    fields, message = REFUSED[case]
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(line(10.0, 3), **fields)


def test_a_problem_cannot_be_written() -> None:
    problem: FeedrateProblem = line(10.0, 3)
    with pytest.raises(ValueError, match="read-only"):
        problem.s[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        problem.s = problem.s


def test_pieces_share_an_arc_length() -> None:
    """At a full stop s may repeat: there is no interval between the two points."""
    problem = dataclasses.replace(line(10.0, 4), s=[0.0, 1.0, 1.0, 2.0], piece=[0, 2, 4])
    np.testing.assert_array_equal(problem.interval, [True, False, True, False])


def test_a_path_that_no_grid_follows_is_not_solved() -> None:
    """The remaining interpolation error is taken off the limits; where it is all of them nothing is left."""
    machine = load_machine("mill")
    toolpath = toolpath_from_program(parse_program("G21 F600\nG1 X1\nY1\n", machine), machine)
    samples = sample_path(round_corners(toolpath, machine, BezierCorner()), machine)
    feedrate_problem(samples, machine)
    margin = np.where(np.arange(len(samples)) == len(samples) - 2, 1.5, 0.0)
    with pytest.raises(NotSolvedError, match=r"at line 3 .*--corner bezier"):
        feedrate_problem(dataclasses.replace(samples, margin=margin), machine)


def one(value: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([value])


@given(st.floats(0.0, 2 * np.pi), positive, positive)
def test_axis_velocity_is_used_up(angle: float, vx: float, vy: float) -> None:
    d1, limits = np.array([[np.cos(angle), np.sin(angle)]]), np.array([vx, vy])
    x, axis = built_in.feed_sq_max(d1, limits)
    used = np.abs(d1[0]) * np.sqrt(x[0]) / limits
    assert used.max() == pytest.approx(1.0)
    assert used.argmax() == axis[0] or used[0] == pytest.approx(used[1])


@given(curvature, positive)
def test_normal_acceleration_is_used_up(kappa: float, limit: float) -> None:
    assert kappa * built_in.feed_sq_within(one(kappa), limit)[0] == pytest.approx(limit)


@given(curvature, st.floats(1e-6, 1.0), st.floats(1e-4, 1e-2))
def test_chord_error_is_used_up(kappa: float, share: float, dt: float) -> None:
    """The sagitta R (1 - cos(F dt / 2R)) is within the tolerance, and equals it for tolerances small beside the radius."""
    tol = 0.2 * share / kappa
    x = built_in.feed_sq_within(one(kappa), one(tol), dt**2 / 8.0)[0]
    half = 0.5 * np.sqrt(x) * dt * kappa
    sagitta = 2.0 * np.sin(half / 2.0) ** 2 / kappa
    assert sagitta <= tol * (1 + 1e-12)
    assert sagitta == pytest.approx(tol, rel=0.2 * share)


@given(curvature, positive, st.lists(st.floats(1e-3, 0.1), min_size=1, max_size=3))
@settings(max_examples=30)
def test_filter_error_is_used_up(kappa: float, tol: float, lengths: list[float]) -> None:
    x = built_in.feed_sq_of_filters(one(kappa), one(tol), tuple(lengths))[0]
    assert kappa * x * sum(T * T for T in lengths) / 24.0 == pytest.approx(tol)


def test_filter_error_is_that_of_a_moving_average() -> None:
    """R = 5 mm at 50 mm/s, 20 ms: the average of the circle over the window lies 8.3292e-3 mm inside."""
    radius, length, feed = 5.0, 0.02, 50.0
    half = 0.5 * feed / radius * length
    error = radius * (1.0 - np.sin(half) / half)
    assert error == pytest.approx(8.3292e-3, rel=1e-5)
    x = built_in.feed_sq_of_filters(one(1.0 / radius), one(error), (length,))[0]
    assert x == pytest.approx(feed**2, rel=1e-3)
    assert x < feed**2


@given(curvature, st.floats(1e-3, 1.0), st.lists(st.floats(1e-3, 0.1), min_size=1, max_size=3))
def test_phase_lag_is_used_up(kappa: float, angle: float, lengths: list[float]) -> None:
    x = built_in.feed_sq_of_lag(one(kappa), angle, tuple(lengths))[0]
    assert np.sqrt(x) * kappa * sum(lengths) / 2.0 == pytest.approx(angle)


@given(curvature, st.floats(0.0, 2 * np.pi), positive, positive)
def test_curvature_jump_is_used_up(kappa: float, angle: float, ax: float, ay: float) -> None:
    before, after = np.zeros((1, 2)), kappa * np.array([[np.cos(angle), np.sin(angle)]])
    limits = np.array([ax, ay])
    for pair in ((before, after), (after, before)):
        x, _ = built_in.feed_sq_at_jump(*pair, limits)
        assert (np.abs(after - before)[0] * x[0] / limits).max() == pytest.approx(1.0)


def test_straight_lines_are_not_limited() -> None:
    flat = np.zeros(3)
    assert np.isinf(built_in.feed_sq_within(flat, 1.0)).all()
    assert np.isinf(built_in.feed_sq_within(flat, np.ones(3), 1e-7)).all()
    assert np.isinf(built_in.feed_sq_of_filters(flat, np.ones(3), (0.01,))).all()
    assert np.isinf(built_in.feed_sq_of_lag(flat, 0.1, (0.01,))).all()
    assert np.isinf(built_in.feed_sq_at_jump(np.zeros((3, 2)), np.zeros((3, 2)), np.ones(2))[0]).all()
