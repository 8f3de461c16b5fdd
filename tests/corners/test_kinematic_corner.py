"""Paper 003's corner: limits, error and branch on random corners, the misprinted rule, identities with FIR and Bezier corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import entry_length
from whole_plans import evaluate_corner, smooth_path

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.corners import kinematic
from planner.corners.bezier import BezierCorner
from planner.corners.fir import FirCorner
from planner.corners.kinematic import KinematicCorner
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint

seeds = st.integers(0, 2**32 - 1)


class Corners(NamedTuple):
    """n random corners in 2 to 4 axes, the limits of these, and the tolerances."""

    u1: FloatArray
    u2: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    eps: FloatArray

    @property
    def s(self) -> FloatArray:
        return np.linalg.norm(self.u2 - self.u1, axis=1) / 2

    @property
    def rates(self) -> tuple[FloatArray, FloatArray]:
        across = self.u2 - self.u1
        return kinematic.ratio_min(self.acceleration, across), kinematic.ratio_min(self.jerk, across)


def random_corners(seed: int, count: int = 200) -> Corners:
    rng = np.random.default_rng(seed)
    axes = rng.integers(2, 5)
    u1, other = rng.normal(size=(2, count, axes))
    u1 /= np.linalg.norm(u1, axis=1, keepdims=True)
    other -= (other * u1).sum(axis=1, keepdims=True) * u1
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    theta = np.deg2rad(rng.uniform(1.0, 179.0, (count, 1)))
    u2 = np.cos(theta) * u1 + np.sin(theta) * other
    return Corners(
        u1=u1,
        u2=u2 / np.linalg.norm(u2, axis=1, keepdims=True),
        acceleration=10 ** rng.uniform(2, 4.5, axes),
        jerk=10 ** rng.uniform(3, 7, axes),
        eps=10 ** rng.uniform(-2, 2, count),  # 10 um to 100 mm
    )


def zero_entry(c: Corners) -> tuple[FloatArray, FloatArray, FloatArray]:
    alpha, eta = c.rates
    V = kinematic.speed_from_middle(c.eps / (2 * c.s), alpha, eta)
    return V, *kinematic.phase_times(V, alpha, eta)


def ramp_response(t: FloatArray, T1: float, T2: float) -> FloatArray:
    """R(t), the trapezoid integrated twice from node to node: no formula of the package. Its kinks are nodes, so that between two of
    them it is straight, the trapezoidal rule is exact for its integral S, and Simpson's for that of S."""
    kinks = [0.0, T2, T1, T1 + T2]
    nodes = np.union1d(kinks, t)
    h = np.interp(nodes, kinks, [0, 1 / T1, 1 / T1, 0])
    step = np.diff(nodes)
    middle = (h[1:] + h[:-1]) / 2
    S = np.concatenate([[0], np.cumsum(middle * step)])
    halfway = S[:-1] + (h[:-1] + middle) / 2 * step / 2
    R = np.concatenate([[0], np.cumsum((S[:-1] + 4 * halfway + S[1:]) / 6 * step)])
    return R[np.searchsorted(nodes, t)]


@pytest.mark.shows("kinematic", "exact: one limit reached and none exceeded, the error at the vertex")
@given(seeds)
@settings(max_examples=40)
def test_with_zero_entry_acceleration_one_limit_is_reached_and_none_exceeded(seed):
    c = random_corners(seed)
    V, T1, T2 = zero_entry(c)
    change = np.abs(c.u2 - c.u1) * V[:, None]
    worst = np.maximum(
        (change / T1[:, None] / c.acceleration).max(axis=1),
        (change / (T1 * T2)[:, None] / c.jerk).max(axis=1),
    )
    np.testing.assert_allclose(worst, 1.0, rtol=1e-12)
    assert (T2 <= T1 * (1 + 1e-12)).all()


@pytest.mark.shows("kinematic", "exact: one limit reached and none exceeded, the error at the vertex")
@given(seeds)
@settings(max_examples=40)
def test_with_zero_entry_acceleration_the_error_is_exact(seed):
    """eq. (3): the middle of the corner, which is its nearest point, is eps from the vertex; and a numerical corner agrees."""
    c = random_corners(seed)
    V, T1, T2 = zero_entry(c)
    eps = V * c.s * (3 * T1**2 + T2**2) / (12 * T1)
    np.testing.assert_allclose(eps, c.eps, rtol=1e-11)
    np.testing.assert_allclose(2 * c.s * kinematic.middle(V, *c.rates), c.eps, rtol=1e-11)
    i = int(seed % len(V))
    t = np.linspace(0, T1[i] + T2[i], 501)
    R = ramp_response(t, T1[i], T2[i])
    length = kinematic.approach(V, *c.rates)[i]
    p = -length * c.u1[i] + V[i] * t[:, None] * c.u1[i] + V[i] * R[:, None] * (c.u2[i] - c.u1[i])
    distance = np.linalg.norm(p, axis=1)
    assert distance.min() == pytest.approx(c.eps[i], rel=1e-9)  # the nearest of the samples
    assert distance.argmin() == 250
    np.testing.assert_allclose(p[-1], length * c.u2[i], atol=1e-9 * length)


@given(seeds)
@settings(max_examples=25)
def test_no_other_phase_times_are_faster(seed):
    """Brute force: corners of other phase times that keep error and limits are not faster (dF/dT1 >= 0)."""
    c = random_corners(seed, 50)
    V, _, _ = zero_entry(c)
    alpha, eta = c.rates
    rng = np.random.default_rng(seed)
    for _ in range(200):
        T1 = V / np.minimum(alpha, np.sqrt(V * eta)) * 10 ** rng.uniform(-1, 1, len(V))
        T2 = T1 * 10 ** rng.uniform(-1.5, 0, len(V))
        by_error = c.eps * 12 * T1 / (c.s * (3 * T1**2 + T2**2))
        other = np.minimum(by_error, np.minimum(alpha * T1, eta * T1 * T2))
        assert (other <= V * (1 + 1e-9)).all()


def test_the_printed_rule_is_imaginary_or_too_slow():
    """The paper takes min(V_gw1, V_gw2). V_gw1 is imaginary for eps < eps*/4 and too slow for the other jerk-limited corners
    (docs/papers.md F2)."""
    c = random_corners(1, 4000)
    V, T1, T2 = zero_entry(c)
    alpha, eta = c.rates
    limit = c.s * alpha**3 / (3 * eta**2)  # eps*
    jerk_limited = c.eps < limit
    assert 500 < jerk_limited.sum() < 3500
    square = 4 * alpha * c.eps / c.s - alpha**4 / (3 * eta**2)
    gw2 = np.cbrt(9 * c.eps**2 * eta / c.s**2)
    np.testing.assert_array_equal(square < 0, c.eps < limit / 4)
    real = jerk_limited & (square >= 0)
    printed = np.minimum(np.sqrt(square[real]), gw2[real])
    assert real.sum() > 100
    assert (printed <= V[real]).all()
    assert printed.min() < 0.2 * V[real][printed.argmin()]
    np.testing.assert_allclose(V[jerk_limited], gw2[jerk_limited], rtol=1e-12)
    np.testing.assert_allclose(T1[jerk_limited], T2[jerk_limited], rtol=1e-6)
    np.testing.assert_allclose(V[~jerk_limited], np.sqrt(square[~jerk_limited]), rtol=1e-12)
    # ... and there V_gw2 would break the acceleration limit
    assert (gw2[~jerk_limited] >= V[~jerk_limited]).all()


@given(seeds)
@settings(max_examples=40)
def test_length_and_speed_belong_together(seed):
    c = random_corners(seed)
    alpha, eta = c.rates
    V = 10 ** np.random.default_rng(seed).uniform(-3, 3, len(c.eps))
    length = kinematic.approach(V, alpha, eta)
    np.testing.assert_allclose(kinematic.speed_from_approach(length, alpha, eta), V, rtol=1e-11)
    np.testing.assert_allclose(
        kinematic.speed_from_middle(kinematic.middle(V, alpha, eta), alpha, eta), V, rtol=1e-10
    )
    # docs/papers.md: 2 eps/s <= l <= 3 eps/s, the second where only jerk limits
    V, _, _ = zero_entry(c)
    ratio = kinematic.approach(V, alpha, eta) * c.s / c.eps
    assert (ratio >= 2 * (1 - 1e-9)).all()
    assert (ratio <= 3 * (1 + 1e-9)).all()


@given(seeds)
@settings(max_examples=40)
def test_with_entry_deceleration_limits_hold_and_the_error_is_exact(seed):
    c = random_corners(seed)
    a, J = kinematic.entry_limits(c.u1, c.u2, c.acceleration, c.jerk)
    V = kinematic.entry_speed_from_middle(c.eps / (2 * c.s), a, J)
    A, d = kinematic.entry_acceleration(V, a, J), entry_length(V, a, J)
    T = 2 * V / A
    np.testing.assert_allclose(A, np.minimum(a, np.cbrt(24 * J**2 * c.eps / c.s)), rtol=1e-11)
    np.testing.assert_allclose(d, A * T**2 / 6, rtol=1e-11)
    np.testing.assert_allclose(d * c.s / 4, c.eps, rtol=1e-11)
    w = np.linspace(0, 1, 41)[:, None, None]
    acceleration = A[:, None] * (-(1 - w) * c.u1 + w * c.u2)
    jerk = np.abs(A[:, None] * (c.u1 + c.u2)) / T[:, None]
    used = np.maximum((np.abs(acceleration) / c.acceleration).max(axis=(0, 2)), (jerk / c.jerk).max(axis=1))
    np.testing.assert_allclose(used, 1.0, rtol=1e-9)
    speed = np.linalg.norm(V[:, None] * ((1 - w) ** 2 * c.u1 + w**2 * c.u2), axis=2)
    assert (speed <= V * (1 + 1e-12)).all()
    np.testing.assert_allclose(kinematic.entry_speed_from_length(d, a, J), V, rtol=1e-11)


@given(seeds)
@settings(max_examples=20)
def test_both_families_grow_with_the_speed(seed):
    """Lowering a speed never lengthens a corner nor raises its error: what the look-ahead lives on."""
    c = random_corners(seed, 20)
    alpha, eta = c.rates
    a, J = kinematic.entry_limits(c.u1, c.u2, c.acceleration, c.jerk)
    V = np.geomspace(1e-3, 1e3, 60)[:, None]
    for value in (
        kinematic.approach(V, alpha, eta),
        kinematic.middle(V, alpha, eta),
        entry_length(V, a, J),
        kinematic.entry_acceleration(V, a, J),
    ):
        assert (np.diff(value, axis=0) >= 0).all()


def straight_corner(theta: float):
    return toolpath_from_program(
        problems.polyline([[-500, 0], [0, 0], [500 * np.cos(theta), 500 * np.sin(theta)]]), problems.machine()
    )


@pytest.mark.parametrize("theta", [5.0, 60.0, 90.0, 150.0])
@pytest.mark.parametrize("eps", [0.01, 0.3])
def test_it_is_the_fir_corner_with_complete_overlap(theta, eps):
    """docs/papers.md F1: T1' = Tj + Ta, T2' = Tj, Tk = Td, as a curve and in time."""
    theta = np.deg2rad(theta)
    limits = np.full(2, 2000.0), np.full(2, 66_667.0)
    u1, u2 = np.array([[1.0, 0.0]]), np.array([[np.cos(theta), np.sin(theta)]])
    family = KinematicCorner(acceleration=limits[0], jerk=limits[1]).at(u2 - u1)
    middle, feed = np.array([eps / (2 * np.sin(theta / 2))]), np.array([1e9])
    length = family.reach(middle, feed)
    V, T1, T2, Td = family.params(length, feed)[0]
    assert Td == pytest.approx(T1 + T2)
    assert family.middle(length, feed)[0] == pytest.approx(middle[0], rel=1e-12)
    w = np.linspace(0, 1, 101)
    toolpath = straight_corner(theta)
    shape = evaluate_corner(
        toolpath, 1, KinematicCorner(acceleration=limits[0], jerk=limits[1]), np.array([V, T1, T2, Td]), w
    )
    t = w * Td
    x = -length[0] * u1 + V * t[:, None] * u1 + V * ramp_response(t, T1, T2)[:, None] * (u2 - u1)
    np.testing.assert_allclose(shape.by_w[:, 0, :2], x, atol=1e-5 * length[0])
    fir = FirCorner(T1=T1, T2=T2, feed_max=V)
    assert fir.reach(middle, feed)[0] == pytest.approx(length[0], rel=1e-9)
    assert np.linalg.norm(shape.by_w[50, 0]) == pytest.approx(eps, rel=1e-9)


@pytest.mark.parametrize("theta", [5.0, 60.0, 90.0, 150.0])
def test_with_entry_deceleration_it_is_the_polynomial_pair(theta):
    """docs/papers.md B1, F5: the cubic, run through with uniform parameter speed."""
    theta = np.deg2rad(theta)
    u1, u2 = np.array([1.0, 0.0]), np.array([np.cos(theta), np.sin(theta)])
    a, J = kinematic.entry_limits(u1[None], u2[None], np.full(2, 2000.0), np.full(2, 66_667.0))
    V = kinematic.entry_speed_from_middle(np.array([0.1 / (2 * np.sin(theta / 2))]), a, J)
    A, d = kinematic.entry_acceleration(V, a, J)[0], entry_length(V, a, J)
    T = 2 * V[0] / A
    w = np.linspace(0, 1, 33)
    pair = BezierCorner(sigma2=1.0)
    shape = evaluate_corner(straight_corner(theta), 1, pair, pair.params(d, V)[0], w)
    t = (w * T)[:, None]
    x = -d[0] * u1 + V[0] * t * u1 - A * t**2 / 2 * u1 + A / T * t**3 / 6 * (u1 + u2)
    np.testing.assert_allclose(shape.by_w[:, 0, :2], x, atol=1e-13)


@pytest.mark.shows("corner-kinematic", "certified: what the rounding uses of the tolerance")
@given(seed=seeds, tolerance=st.floats(1e-3, 0.5))
@settings(max_examples=15)
def test_as_a_shape_it_stays_within_the_budget(seed, tolerance):
    machine = problems.machine(tolerance=tolerance)
    shape = KinematicCorner.from_machine(machine, ("x", "y", "z"))
    path = smooth_path(problems.random_polyline(np.random.default_rng(seed), blocks=12), machine, shape)
    assert (path.joint == Joint.CORNER).any()
    assert (path.tol_ap <= path.tol).all()
    assert (path.d[:-1] + path.d[1:] <= path.legs.length * (1 + 1e-12)).all()


@pytest.mark.parametrize("theta", [3.0, 45.0, 120.0, 170.0])
def test_as_a_shape_it_uses_the_whole_budget_where_legs_are_long(theta):
    machine = problems.machine()
    shape = KinematicCorner.from_machine(machine, ("x", "y", "z"))
    theta = np.deg2rad(theta)
    points = [[-500, 0], [0, 0], [500 * np.cos(theta), 500 * np.sin(theta)]]
    path = smooth_path(problems.polyline(points), machine, shape)
    assert path.tol_ap[1] + path.normal_max[1] * machine.dt**2 / 8 == pytest.approx(
        machine.tolerance, rel=1e-3
    )


def test_the_shape_has_its_own_times_at_every_corner():
    """T2/T1 follows the corner's branch: 1 where only jerk limits, below where acceleration is reached."""
    machine = problems.machine(jerk=2e4, tolerance=0.02)
    sharp_after_shallow = problems.polyline([[0, 0], [40, 0], [80, 2], [80, 60], [20, 10]])
    path = smooth_path(sharp_after_shallow, machine, KinematicCorner.from_machine(machine, ("x", "y", "z")))
    ratio = path.params[1:-1, 2] / path.params[1:-1, 1]
    assert ratio[0] == pytest.approx(1.0)
    path = smooth_path(
        sharp_after_shallow,
        problems.machine(jerk=2e6),
        KinematicCorner.from_machine(problems.machine(jerk=2e6), ("x", "y", "z")),
    )
    ratio = path.params[1:-1, 2] / path.params[1:-1, 1]
    assert (ratio < 0.5).all()
    assert len(np.unique(ratio.round(6))) == 3
