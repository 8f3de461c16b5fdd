"""Plans on splines: laws that their cycle times obey, and that every one of them passes."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_polylines import random_polyline

from benchmarks.jobs import problems
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import OptimalMethod

MACHINE = problems.machine()
seeds = st.integers(0, 10**6)
AS_IT_IS = OptimalMethod(corner="spline")


def time_of(program, machine=MACHINE, tolerance=None, method=AS_IT_IS):
    plan = method.plan(program, machine, tolerance)
    assert plan.verdict.passed, plan.verdict.faults
    return plan.trajectory.cycle_time


def test_refining_collinear_points_changes_nothing():
    points = random_polyline(np.random.default_rng(3), 6)
    finer = np.vstack([np.linspace(p, r, 4, endpoint=False) for p, r in itertools.pairwise(points)])
    assert time_of(problems.polyline(np.vstack([finer, points[-1:]]))) == pytest.approx(
        time_of(problems.polyline(points)), rel=1e-3
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_turned_and_mirrored_jobs_take_the_same_time(seed):
    points = random_polyline(np.random.default_rng(seed), 8)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    expected = time_of(problems.polyline(points))
    for matrix in (quarter, np.diag([1.0, 1.0, -1.0])):
        assert time_of(problems.polyline(points @ matrix.T)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_scaled_jobs_take_the_same_time(seed):
    """Inches or metres: lengths and limits by k keep the time."""
    points, k = random_polyline(np.random.default_rng(seed), 8), 25.4
    program = problems.polyline(points)
    assert time_of(*larger(program, k)) == pytest.approx(time_of(program), rel=1e-6)


@pytest.mark.parametrize("k", [0.1, 3.0, 25.4])
def test_a_job_with_a_straight_way_inside_the_tolerance_is_the_same_in_all_units(k):
    """The third derivatives of its spline fall to rounding; minimised further, rounding decides."""
    program = parse_program("G21 G64 P0.04 F6000\nG1 X0.34 Y0.09\nX0.3375 Y0.0905\n", MACHINE)
    method = OptimalMethod(corner="spline", effort="quick")
    expected = time_of(program, method=method)
    assert time_of(*larger(program, k), method=method) == pytest.approx(expected, rel=1e-6)


def larger(program, k):
    """A program and `MACHINE` with all lengths times k, of the limits too."""
    axes = {
        name: axis.model_copy(update={q: getattr(axis, q) * k for q in ("velocity", "acceleration", "jerk")})
        for name, axis in MACHINE.axes.items()
    }
    machine = MACHINE.model_copy(update={"axes": axes, "tolerance": MACHINE.tolerance * k})
    lengths = {name: getattr(program, name) * k for name in ("start", "end", "feed", "tolerance")}
    return dataclasses.replace(program, **lengths), machine


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_more_tolerance_does_not_cost_time(seed):
    program = problems.polyline(random_polyline(np.random.default_rng(seed), 10))
    times = [time_of(program, tolerance=tol) for tol in (0.01, 0.02, 0.05, 0.1)]
    assert (np.diff(times) <= 1e-3 * times[0]).all()


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "shortest"), [(1e-3, 0.5), (1.0, -1.0), (0.05, -3.0)])
def test_extreme_tolerances_are_kept(tolerance, shortest):
    """1 um; 1 mm on segments of 0.1 mm; segments of 1 um."""
    rng = np.random.default_rng(5)
    points = random_polyline(rng, 40, shortest=shortest, sharpest=60.0)
    time_of(problems.polyline(points), tolerance=tolerance)


@pytest.mark.slow
@given(seeds)
@settings(max_examples=12)
def test_random_polylines_are_verified(seed):
    rng = np.random.default_rng(seed)
    time_of(problems.polyline(random_polyline(rng, 12, axes=int(rng.integers(2, 4)), sharpest=179.0)))


def test_arcs_become_part_of_the_curve():
    program = parse_program(
        "G21 G90 G17 F6000\nG1 X5\nG2 X10 Y-5 R5\nG1 Y-8\nG3 X12 Y-10 I2 J0\nG1 X20\nM2\n"
    )
    corners = OptimalMethod(corner="bezier").plan(program, MACHINE)
    spline = AS_IT_IS.plan(program, MACHINE)
    assert spline.verdict.passed
    assert spline.trajectory.cycle_time < corners.trajectory.cycle_time


def test_feed_changes_keep_their_place():
    lines = "".join(
        f"G1 X{0.2 * k:.1f} Y{0.02 * (k % 2):.2f} F{6000 if k < 50 else 600}\n" for k in range(1, 101)
    )
    plan = AS_IT_IS.plan(parse_program("G21 G90\n" + lines + "M2\n"), MACHINE)
    assert plan.verdict.passed, plan.verdict.faults
    slow = plan.trajectory.position[:, 0] > 9.8 + 0.1
    assert plan.trajectory.feed[slow].max() <= 10.0 * (1 + 1e-6)
    assert plan.trajectory.feed.max() > 50.0
