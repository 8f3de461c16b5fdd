"""What the free optimum is made of: legs, vertices, steps on arcs, and the motion that steps become."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.geometry.build import toolpath_from_program
from planner.joint import guess as guesses
from planner.joint import run as run_module
from planner.joint.checks import bend_of
from planner.joint.guess import Guess
from planner.joint.legs import formula_point, nearest_point
from planner.joint.motion import closed, integrated
from planner.joint.nlp import TubeNLP
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.nc.reader import parse_program

MACHINE = problems.machine()
ARCS = parse_program("G21 G17 G90 F6000\nG1 X4\nG3 X8 Y4 I0 J4\nG2 X12 Y8 Z1 I4 J0\nM2\n")
# a cubic that turns both ways, and a rational one
CURVES = parse_program(
    "G21 G17 G90 F6000\nG1 X4\nG5 X9 Y4 I3 J0 P1 Q-2\nG5.2 P1 L3\nX10 Y7\nX14 Y8 P2\nX15 Y4 P0.7\nG5.3\nM2\n"
)


def only_run(program) -> TubeRun:
    (run,) = tube_runs_of(toolpath_from_program(program, MACHINE), MACHINE)
    return run


def test_cutting_a_line_changes_no_leg():
    whole = only_run(problems.polyline([[0, 0], [4, 0], [4, 4]]))
    cut = only_run(problems.polyline([[0, 0], [1, 0], [2.5, 0], [4, 0], [4, 4]]))
    for name in ("length", "base", "drift", "budget", "vertex", "vertex_budget", "feed"):
        np.testing.assert_allclose(getattr(cut, name), getattr(whole, name), atol=1e-12)
    assert list(whole.axis) == [0, 1]  # z stands still


@pytest.mark.parametrize("program", [ARCS, CURVES], ids=["arcs", "curves"])
def test_a_run_is_the_programmed_path(program):
    toolpath = toolpath_from_program(program, MACHINE)
    run = only_run(program)
    legs = np.arange(len(run))
    np.testing.assert_allclose(run.points(legs, np.zeros(len(run))), toolpath.start[:, run.axis], atol=1e-9)
    np.testing.assert_allclose(run.points(legs, run.length), toolpath.end[:, run.axis], atol=1e-9)
    step = 1e-6
    slope = (run.points(legs, run.length / 2 + step) - run.points(legs, run.length / 2 - step)) / (2 * step)
    np.testing.assert_allclose(run.tangents(legs, run.length / 2), slope, atol=1e-8)


@pytest.mark.parametrize("program", [ARCS, CURVES], ids=["arcs", "curves"])
def test_kernels_see_the_legs_of_the_run(program):
    """Points and tangents as the run has them, their bends from differences, and the nearest place of a point beside the leg."""
    run = only_run(program)
    legs, axes = run.keeps.legs, len(run.axis)
    for r in range(len(run)):
        x, step = 0.4 * run.length[r], 1e-5 * run.length[r]
        point, tangent, bend = (np.empty(axes) for _ in range(3))
        formula_point(legs, r, x, point, tangent, bend)
        rows = np.full(2, r)
        np.testing.assert_allclose(point, run.points(rows[:1], np.array([x]))[0], atol=1e-12)
        np.testing.assert_allclose(tangent, run.tangents(rows[:1], np.array([x]))[0], atol=1e-12)
        ahead, behind = run.tangents(rows, np.array([x + step, x - step]))
        np.testing.assert_allclose(bend, (ahead - behind) / (2.0 * step), atol=1e-5)
        beside = point + 0.02 * np.array([-tangent[1], tangent[0], *np.zeros(axes - 2)])
        found = nearest_point(legs, r, beside, 0.45 * run.length[r], point, tangent)
        assert found == pytest.approx(x, abs=2e-4 * run.length[r])


def test_further_derivatives_of_curves_are_within_their_bounds():
    """kappa rate and kappa rate^2 of a leg, by differences of its second derivative."""
    run = only_run(CURVES)
    curves = np.flatnonzero(run.curve >= 0)
    assert len(curves) > 3
    for r in curves:
        x = np.linspace(0.0, run.length[r], 2001)
        second = run.curves.at(np.full(2001, run.curve[r]), np.full(2001, run.length[r]), x)[:, 2]
        third = np.diff(second, axis=0) / x[1]
        fourth = np.diff(third, axis=0) / x[1]
        assert np.linalg.norm(third, axis=1).max() <= run.curvature[r] * run.rate[r]
        assert np.linalg.norm(fourth, axis=1).max() <= run.curvature[r] * run.rate[r] ** 2


@pytest.mark.slow
@given(places=st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4), t=st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_a_leg_is_off_its_own_cubic_by_no_more_than_the_bound(places, t):
    """The cubic that meets the leg at both ends with its velocity, along any places that do not go back."""
    weights = np.array([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
    runs = (only_run(ARCS), only_run(CURVES))
    for run, leg in ((one, leg) for one in runs for leg in range(len(one))):
        s = np.sort(places) * min(run.step_max[leg], run.length[leg])
        rows = np.full(4, leg)
        ends, tangents = run.points(rows[:2], s[[0, 3]]), run.tangents(rows[:2], s[[0, 3]])
        inner = ends + np.array([[s[1] - s[0]], [s[2] - s[3]]]) * tangents
        cubic = weights @ np.array([ends[0], inner[0], inner[1], ends[1]])
        off = np.linalg.norm(cubic - run.points(rows[:1], (weights @ s)[None])[0])
        assert off <= bend_of(run.curvature[leg], run.rate[leg], s) + 1e-12 * run.length[leg]


@pytest.mark.parametrize("program", [ARCS, CURVES], ids=["arcs", "curves"])
def test_an_even_step_of_the_largest_length_is_off_by_its_fraction_at_most(program):
    run = only_run(program)
    for leg in range(1, len(run)):
        even = run.step_max[leg] * np.arange(4) / 3
        off = bend_of(run.curvature[leg], run.rate[leg], even)
        assert off <= run_module.ARC_FRACTION * run.budget[leg] * (1 + 1e-9)


def test_the_closing_jerks_are_what_the_motion_runs_too_far():
    run = only_run(problems.polyline([[0, 0], [4, 0], [4, 4]]))
    rng = np.random.default_rng(1)
    h, jerk = rng.uniform(1e-3, 5e-3, 30), rng.normal(size=(30, 2))
    begin, end = rng.normal(size=(3, 2)), rng.normal(size=(3, 2))
    begin[0], end[0] = run.vertex[0], run.vertex[-1]
    found = closed(begin, end, h, jerk)
    np.testing.assert_allclose(integrated(begin, h, found)[-1], end, atol=1e-9)
    # the smallest change: what keeps the end, per axis, is at right angles to it
    other = closed(begin, end, h, rng.normal(size=(30, 2)))
    change, rest = found - jerk, other - found
    sizes = np.linalg.norm(change, axis=0) * np.linalg.norm(rest, axis=0)
    np.testing.assert_allclose((change * rest).sum(axis=0) / sizes, 0.0, atol=1e-6)


def test_settings_and_guesses_are_checked():
    with pytest.raises(ValueError, match="tol: 0"):
        TubeNLP(tol=0)
    with pytest.raises(ValueError, match=r"Guess\.h"):
        Guess(leg=np.zeros(1), h=np.zeros(1), state=np.zeros((2, 3, 2)), place=np.zeros((1, 4)))


def test_a_jump_between_two_samples_at_nearly_the_same_time_is_spread() -> None:
    """Or the steps that it is worth, where no jerk is limited, would have no length."""
    (run,) = tube_runs_of(toolpath_from_program(ARCS, MACHINE), MACHINE, jerk_limited=False)
    apart = guesses.SEEN * guesses.unit_of(run)
    t = apart * np.array([0.0, 1.5, 3.0 - 1e-6, 3.0 + 1e-6, 4.5, 6.0])
    pushed = np.zeros((6, len(run.axis)))
    pushed[3:] = run.acceleration
    motion = SimpleNamespace(t=t, acceleration=pushed)
    spent = guesses.busy(run, motion, guesses.unit_of(run))
    assert spent[-1] > 0.0
    assert np.diff(spent)[2] < 1e-5 * spent[-1]
