"""Laws of every method on random polylines: 2 to 4 axes, turns of 1 to 179 degrees, legs of 10 um to 100 mm.

Those that promise the limits hold them, by the verifier's judgement; those of the papers that do not stay below what
docs/papers.md proves;
and at a corner by itself each misses the vertex by what it promises.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from quick import slow_but

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.planning.methods.optimal import SIGMA2
from planner.planning.methods.registry import METHODS, plan
from planner.verifier.pieces import RATIO_ROUNDING

PLAIN = {"fir-plain", "fir-spline-plain"}
# `tube` takes seconds per corner: tests/planning/methods/test_tube.py has its laws.
HOLDING = tuple(name for name in METHODS if name not in PLAIN | {"tube"})
# Methods that choose a full stop where it is faster: never slower than stopping everywhere, to the accuracy of their grids.
NOT_SLOWER = {"optimal": 2e-3, "bezier": 1e-6, "kinematic": 1e-6, "second-order": 1e-6, "stop": 1e-9}
seeds = st.integers(0, 10**6)
UNITS = {"x": 1.0, "y": 1.0, "z": 1.0, "a": 180.0 / np.pi}  # a machine file's rotary axes are in degrees


def random_job(seed: int, axes: int) -> Program:
    """G1 moves; in four axes the fourth is rotary, in rad."""
    rng = np.random.default_rng(seed)
    u, points = np.eye(axes)[0], [np.zeros(axes)]
    for leg in range(int(rng.integers(2, 13))):
        if leg:
            across = rng.normal(size=axes)
            across -= (across @ u) * u
            turn = np.deg2rad(rng.uniform(1.0, 179.0))
            u = np.cos(turn) * u + np.sin(turn) * across / np.linalg.norm(across)
        points.append(points[-1] + u * 10 ** rng.uniform(-2.0, 2.0))
    made = through(np.array(points))
    if seed % 2:  # a feed of its own for every block
        made = dataclasses.replace(made, feed=10 ** rng.uniform(0.5, 2.3, len(made)))
    return made


def through(points) -> Program:
    points = np.asarray(points, float)
    made = problems.polyline(points[:, : min(3, points.shape[1])])
    if points.shape[1] < 4:
        return made
    return dataclasses.replace(
        made, axes=("x", "y", "z", "a"), start=points[0], end=points[1:], arc_center=np.zeros((0, 4))
    )


def machine(seed: int = 0, **more) -> Machine:
    """Different limits on every axis; the rotary one's come out like a linear one's."""
    rng = np.random.default_rng(seed)
    a, j = rng.uniform(1e3, 4e3, 4), 10 ** rng.uniform(4.5, 5.5, 4)
    axes = {
        letter: Axis(velocity=100.0 * unit, acceleration=a[k] * unit, jerk=j[k] * unit)
        for k, (letter, unit) in enumerate(UNITS.items())
    }
    return problems.machine(
        **({"axes": axes, "rotary_radius": 1.0, "tolerance": 10 ** rng.uniform(-2.0, -0.7)} | more)
    )


@pytest.mark.shows("axis-limits", "sampled: random polylines, every method")
@pytest.mark.slow
@pytest.mark.parametrize(
    "method", slow_but(set(HOLDING) - {"optimal", "second-order", "fir-spline"}, HOLDING)
)
@given(seed=seeds, axes=st.integers(2, 4))
@settings(max_examples=6)
def test_tolerance_and_limits_hold(method, seed, axes):
    """`optimal` in up to three axes: tests/laws/test_axes.py has searches in four and five."""
    few, most = ({"effort": "quick"}, 3) if method == "optimal" else ({}, 4)
    made = plan(random_job(seed, min(axes, most)), machine(seed), method=method, **few)
    assert made.require().verdict.passed, made.verdict.faults
    free = {"jerk"} if method == "second-order" else set()
    for name, check in made.verdict.limits.items():
        assert check.limited == (name.partition(".")[0] not in free)
        assert check.ratio <= 1 + RATIO_ROUNDING or not check.limited
    np.testing.assert_allclose(made.trajectory.position[-1], made.toolpath.end[-1], atol=1e-9)
    if method in NOT_SLOWER:
        assert made.trajectory.cycle_time <= made.stop_time * (1 + NOT_SLOWER[method])


@pytest.mark.shows("fir-plain", "sampled: what they exceed is said, and is no more than proved")
@given(seed=seeds, axes=st.integers(2, 4))
@settings(max_examples=15)
def test_the_plain_pulses_exceed_no_more_than_proved(seed, axes):
    """docs/papers.md A, universal identity: |a| <= 2 V/T1 and |j| <= 4 V/(T1 T2) for any path; T1 = V/A and T2 = A/J are the
    paper's. The
    deviation, by eq. 14 the tolerance, is at most it plus the bow between samples where blends stay apart."""
    limits = problems.machine(
        axes={k: Axis(velocity=100.0 * u, acceleration=2000.0 * u, jerk=2e5 * u) for k, u in UNITS.items()}
    )
    made = plan(random_job(2 * seed, axes), limits, method="fir-plain")  # one feed for all
    for name, check in made.verdict.limits.items():
        most = {"velocity": 1.0, "acceleration": 2.0, "jerk": 4.0, "feed": 1.0}[name.partition(".")[0]]
        assert check.ratio <= most * (1 + 1e-6), name


def test_the_plain_pulses_do_reach_it():
    """docs/papers.md A: both factors are attained by zig-zags without dwell, that of the jerk by legs of 70 ms for filters of 50
    and 30 ms;
    almost, as motions along a fixed path rest at complete reversals."""
    limits = problems.machine(jerk=2000.0 / 0.03, tolerance=50.0)
    turn = np.deg2rad(87.0)
    steps = 7.0 * np.array([[np.cos(turn), np.sin(turn) * (-1) ** k] for k in range(12)])
    made = plan(through(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])), limits, method="fir-plain")
    assert made.verdict.limits["jerk.y"].ratio == pytest.approx(4 * np.sin(turn), rel=1e-6)
    assert made.verdict.limits["acceleration.y"].ratio > 1.2
    assert not made.verdict.passed


# --- a corner by itself: the error is what is promised -----------------------------------------------------------------------

corners = st.floats(1.0, 174.0).map(np.deg2rad)  # beyond, motions along a fixed path rest
LONG = 60.0  # [mm]: any of these corners ends before the middle of the leg


def corner_job(theta: float, axes: int, seed: int) -> Program:
    """One corner in a random plane."""
    rng = np.random.default_rng(seed)
    u, v = np.linalg.qr(rng.normal(size=(axes, 2)))[0].T
    return through([-LONG * u, np.zeros(axes), LONG * (np.cos(theta) * u + np.sin(theta) * v)])


@pytest.mark.slow
@given(theta=corners, axes=st.integers(2, 3), seed=seeds, eps=st.floats(-3.0, 0.0).map(lambda x: 10**x))
@settings(max_examples=20)
def test_equation_15_misses_the_vertex_by_the_tolerance(theta, axes, seed, eps):
    """`fir-plain`: exactly, or by eps_2, the most that a complete overlap can. By the interior angle it would be another error.

    In linear axes: F is the speed of x, y and z alone, and with a rotary axis beside them the two legs have speeds of their own."""
    limits = problems.machine(
        tolerance=eps, dt=2e-4, rotary_radius=1.0,
        axes={k: Axis(velocity=1e4 * u, acceleration=2000.0 * u, jerk=66_667.0 * u) for k, u in UNITS.items()},
    )  # fmt: skip
    made = plan(corner_job(theta, axes, seed), limits, method="fir-plain")
    T1, T2, s = 0.05, 2000.0 / 66_667.0, np.sin(theta / 2)
    expected = min(eps, 100.0 * s * (3 * T1**2 + T2**2) / (12 * T1))
    bow = 2 * 2000.0 * limits.dt**2 / 8
    assert made.verdict.vertex_error_mm == pytest.approx(expected, rel=1e-4, abs=bow)


@pytest.mark.slow
@given(theta=corners, axes=st.integers(2, 4), seed=seeds)
@settings(max_examples=20)
def test_a_kinematic_corner_misses_the_vertex_by_the_tolerance(theta, axes, seed):
    """At most, where it is run through; exactly 0 where it is stopped at. With more tolerance alone it is missed by more, or the feed
    makes it as fast as it is."""
    limits = machine(seed, dt=1e-4)
    made = plan(corner_job(theta, axes, seed), limits, method="kinematic")
    missed, bow = made.verdict.vertex_error_mm, 1e4 * limits.dt**2 / 8
    assert missed <= limits.tolerance
    if made.sentence.startswith("0 corners"):
        assert missed <= bow
    elif missed < limits.tolerance * (1 - 2e-3) - bow:
        wider = limits.model_copy(update={"tolerance": 1.5 * limits.tolerance})
        again = plan(corner_job(theta, axes, seed), wider, method="kinematic")
        assert again.trajectory.cycle_time == pytest.approx(made.trajectory.cycle_time, rel=1e-6)


@pytest.mark.slow
@given(theta=corners, axes=st.integers(2, 4), seed=seeds)
@settings(max_examples=15)
def test_the_optimum_misses_the_vertex_by_the_share_of_its_rounding(theta, axes, seed):
    """`optimal` and `second-order` stay on the rounded path: eps_ap of eq. (20) at the apex, plus at most the bow of a period."""
    limits = machine(seed, dt=1e-4)
    for method in ("optimal", "second-order"):
        made = plan(corner_job(theta, axes, seed), limits, method=method, corner="bezier")
        assume(not made.corners.stands.any())
        path = round_corners(made.toolpath, limits, BezierCorner(sigma2=SIGMA2), blend_tangents=True)
        share, bow = path.tol_ap[1], 1e4 * limits.dt**2 / 8
        assert share * (1 - 1e-6) <= made.verdict.vertex_error_mm <= share + bow


@given(theta=corners, axes=st.integers(2, 4), seed=seeds)
@settings(max_examples=10)
def test_stopping_misses_nothing(theta, axes, seed):
    made = plan(corner_job(theta, axes, seed), machine(seed), method="stop")
    bow = 1e4 * made.machine.dt**2 / 8
    assert made.verdict.vertex_error_mm <= bow
    assert made.verdict.contour_error_mm <= bow
