"""Plans of method `fir-spline`: random curves, kinks, cusps, feeds of blocks, rapids, and settings that are refused."""

from __future__ import annotations

import numpy as np
import pytest
from curves import circle, curve_named, strong, wave
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.geometry.nurbs import Nurbs
from planner.machine import Axis
from planner.nc.reader import parse_program
from planner.planning.methods.fir_spline import FirSplineMethod
from planner.planning.methods.registry import plan
from planner.verifier.pieces import RATIO_ROUNDING

MACHINE = problems.machine()
T1, T2 = 0.05, 0.03  # the papers' filters


@pytest.mark.shows("fir-spline", "sampled: random curves within tolerance and limits")
@pytest.mark.slow
@given(seed=st.integers(0, 10**6), axes=st.integers(2, 3), tolerance=st.floats(-2.5, -0.7))
@settings(max_examples=12)
def test_the_safe_mode_holds_tolerance_and_limits_on_random_curves(seed, axes, tolerance):
    machine = problems.machine(
        tolerance=10**tolerance,
        axes={
            k: Axis(velocity=100.0, acceleration=a, jerk=j)
            for k, a, j in zip("xyz", (2000, 1200, 3000), (2e5, 1e5, 3e4), strict=True)
        },
    )
    made = FirSplineMethod().plan(wave(seed, axes).exact_program(100.0), machine)
    assert made.verdict.passed, made.verdict.faults
    assert max(check.ratio for check in made.verdict.limits.values()) <= 1 + RATIO_ROUNDING
    np.testing.assert_allclose(made.trajectory.position[-1], wave(seed, axes).points[-1], atol=1e-9)


def test_given_filters_are_kept_and_the_safe_mode_slows_down_for_them():
    curve = curve_named("trident")
    plain, safe = (
        FirSplineMethod(plain=p, profile_filters=(T1, T2)).plan(
            curve.exact_program(100.0), strong(tolerance=0.02)
        )
        for p in (True, False)
    )
    assert safe.verdict.passed, safe.verdict.faults
    for made in (plain, safe):
        assert made.sentence == "filters of 80 to 80 ms in all"


def test_a_kink_is_a_corner():
    """docs/papers.md: rho -> 0 makes v_ph 0, the scheme stalls at corners; a curve's kink is rounded within the tolerance."""
    points = np.array([[0, 0], [5, 0], [10, 0], [10, 5], [10, 10]], float)
    curve = Nurbs(degree=2, points=points, knots=np.array([0, 0, 0, 1, 1, 2, 2, 2.0]), weights=np.ones(5))
    made = FirSplineMethod().plan(curve.exact_program(100.0), MACHINE)
    apart = np.linalg.norm(made.trajectory.position - [10, 0], axis=1)
    assert made.verdict.passed, made.verdict.faults
    assert 1e-3 < apart.min() <= MACHINE.tolerance
    assert made.trajectory.feed[apart.argmin()] > 1.0


def test_a_curve_that_all_but_turns_back_is_followed():
    """Its chords turn back, where a program has a full stop, and the curve just so does not."""
    made = FirSplineMethod().plan(wave(441).exact_program(100.0), problems.machine(tolerance=0.1))
    assert made.verdict.passed, made.verdict.faults


def test_corners_of_a_program_are_rounded_or_stopped_at():
    made = plan(problems.pentagon(), MACHINE, method="fir-spline")
    assert made.verdict.passed, made.verdict.faults
    assert made.trajectory.cycle_time < made.stop_time
    assert made.verdict.vertex_error_mm > 1e-3
    plain = plan(problems.pentagon(), MACHINE, method="fir-spline-plain")
    assert plain.method == "fir-spline-plain"
    assert plain.trajectory.cycle_time > made.trajectory.cycle_time  # v_sc creeps through corners


@pytest.mark.parametrize("bend", [0.0, 2.0])
def test_a_lower_feed_holds_beside_its_block(bend):
    """The filters still see the faster feed when a slow block begins, and see it again before it ends; the plain mode says so. It has
    to hold on for V Td/2, not along the whole of the next block."""
    program = parse_program(f"G21\nG1 X10 F6000\nX20 Y{bend} F1200\nX30 F6000\n")
    made, plain = (FirSplineMethod(plain=p).plan(program, MACHINE) for p in (False, True))
    assert made.verdict.passed, made.verdict.faults
    assert made.verdict.limits["feed"].ratio > 0.999
    assert plain.verdict.limits["feed"].ratio > 1.5
    assert made.trajectory.cycle_time < 1.1 * plain.trajectory.cycle_time


@pytest.mark.parametrize("plain", [True, False])
def test_rapids_have_no_feed_and_stops_none_either(plain):
    """G0 runs at the limits of the axes; its end, a full stop, is a point of the guide without a chord."""
    made = FirSplineMethod(plain=plain).plan(
        parse_program("G21 F3000\nG0 X10\nG1 X20 Y5\nG0 X0 Y0\n"), MACHINE
    )
    assert made.trajectory.feed.max() > 99.0
    np.testing.assert_allclose(made.trajectory.position[-1], 0.0, atol=1e-9)


@pytest.mark.parametrize("feed", [0.0, -1.0, np.inf, np.nan])
def test_an_impossible_feed_is_refused(feed):
    with pytest.raises(InputError, match="feed"):
        FirSplineMethod().plan(circle(5.0).exact_program(feed), MACHINE)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan])
def test_an_impossible_tolerance_is_refused(tolerance):
    with pytest.raises(InputError):
        FirSplineMethod().plan(circle(5.0).exact_program(100.0), MACHINE, tolerance)


def test_the_plain_filters_are_those_of_paragraph_19():
    """T1 = v_p / a, T2 = a / j: 50 ms and 10 ms."""
    made = FirSplineMethod(plain=True).plan(circle(20.0).exact_program(100.0), MACHINE)
    assert made.sentence == "filters of 60 to 60 ms in all"


@pytest.mark.shows("fir-spline-plain", "exact: the filters and speed of the paper")
def test_the_plain_speed_on_a_weak_machine_is_v_acc():
    """sqrt(a rho) where everything else allows more; the setpoints run at it, less what the filters cut off."""
    machine = problems.machine(acceleration=100.0, jerk=1e8, tolerance=5.0)
    method = FirSplineMethod(plain=True, profile_filters=(0.01, 0.005), phase_lag=3.0)
    made = method.plan(circle(5.0, turns=3).exact_program(100.0), machine)
    t = made.trajectory
    steady = (t.t > 0.3 * t.t[-1]) & (t.t < 0.7 * t.t[-1])
    np.testing.assert_allclose(t.feed[steady], np.sqrt(100.0 * 5.0), rtol=5e-3)
