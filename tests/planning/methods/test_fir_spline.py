"""Method `fir-spline` (paper 001): its closed forms on circles against the filters themselves, and the motions it makes.

The patent's formulas are lost; docs/papers.md has them reconstructed. The oracle is the mean of the unfiltered point with the
filters' kernel
as weight, by quadrature: no formula of the package.
"""

from __future__ import annotations

import numpy as np
import pytest
from curves import circle, curve_named, strong, wave
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.jobs import problems
from planner.baselines.fir.chord_guide import ChordGuide
from planner.baselines.fir.chord_speeds import circle_error, filter_lengths, two_nodes, v_eps, v_ph, v_sc
from planner.geometry.build import toolpath_from_program
from planner.geometry.nurbs import Nurbs
from planner.machine import Axis, Machine
from planner.motion.filters import Filters
from planner.planning.methods.fir_spline import FirSplineMethod, guide_of

MACHINE = problems.machine()
T1, T2 = 0.05, 0.03  # the papers' filters
GAUSS, WEIGHT = np.polynomial.legendre.leggauss(40)


def mean_on_circle(rho: float, v: float, T1: float, T2: float) -> complex:
    """The filtered point of rho exp(i v t/rho) at t = 0, for filters that end there: a double quadrature."""
    one, other = ((GAUSS + 1) / 2 * T for T in (T1, T2))
    weights = np.outer(WEIGHT, WEIGHT) / 4
    return complex((rho * np.exp(-1j * v / rho * (one[:, None] + other)) * weights).sum())


def guide_on(curve: Nurbs, machine: Machine, feed: float = 100.0) -> ChordGuide:
    return guide_of(toolpath_from_program(curve.exact_program(feed), machine), machine)


# --- the closed forms on a circle -----------------------------------------------------------------------------------------

radii, shares = st.floats(0.1, 100.0), st.floats(0.05, 1.0)


@pytest.mark.shows("fir-spline", "exact: the filtered error on a circle")
@given(rho=radii, lag=st.floats(0.01, 3.0), T1=st.floats(0.005, 0.1), ratio=shares)
def test_the_error_on_a_circle_is_exact(rho, lag, T1, ratio):
    """rho [1 - sinc sinc]; docs/papers.md 001: simulation = formula."""
    T2 = T1 * ratio
    v = 2 * lag * rho / (T1 + T2)
    error = rho - abs(mean_on_circle(rho, v, T1, T2))
    assert circle_error(np.array(rho), np.array(v), T1, T2) == pytest.approx(error, rel=1e-9, abs=1e-13 * rho)


@pytest.mark.parametrize(
    ("phi_deg", "more_percent"), [(10, 0.10), (30, 0.92), (60, 3.7), (90, 8.6), (180, 38.0)]
)
def test_the_second_order_over_estimates_by_what_papers_says(phi_deg, more_percent):
    """Par. 21, v^2 (T1^2 + T2^2)/(24 rho), beside the exact error at a phase lag phi, 50 and 30 ms; so v_eps is safe on a circle."""
    rho = 7.0
    v = 2 * rho * np.deg2rad(phi_deg) / (T1 + T2)
    second = v**2 * (T1**2 + T2**2) / (24 * rho)
    assert 100 * (second / circle_error(np.array(rho), np.array(v), T1, T2) - 1) == pytest.approx(
        more_percent, rel=0.06
    )


@given(rho=radii, tol=st.floats(1e-4, 0.1), T1=st.floats(0.005, 0.1), ratio=shares)
def test_v_eps_uses_the_tolerance_and_does_not_exceed_it(rho, tol, T1, ratio):
    """Par. 24. With 12 in the place of 24 (the variance forgotten to be halved) or T1 alone it would miss one or the other."""
    T2, tol = T1 * ratio, tol * min(rho, 1.0)
    v = v_eps(np.array(1 / rho), np.array(tol), T1, T2)
    error = rho - abs(mean_on_circle(rho, float(v), T1, T2))
    lag = float(v) * (T1 + T2) / (2 * rho)
    assert error <= tol * (1 + 1e-9)
    if lag <= 0.5:  # x^2/20 off, x the lag, if T2 = 0
        assert error >= 0.987 * tol


def test_v_eps_is_a_normal_acceleration():
    """24 eps/(T1^2 + T2^2) = 705.9 mm/s2 for 0.1 mm, 50 and 30 ms; it is below v_acc at 2000 mm/s2 iff eps < 0.2833 mm."""
    for rho in (0.5, 20.0):
        assert v_eps(np.array(1 / rho), np.array(0.1), T1, T2) ** 2 / rho == pytest.approx(705.9, abs=0.05)
        at = v_eps(np.array(1 / rho), np.array(0.2833), T1, T2) ** 2 / rho
        assert at == pytest.approx(2000.0, rel=1e-3)


@given(rho=radii, phi=st.floats(0.01, 1.5), T1=st.floats(0.005, 0.1), ratio=shares)
def test_v_ph_is_the_lag_of_the_filtered_point(rho, phi, T1, ratio):
    """Par. 26: at v_ph the filtered point is phi behind, exactly (docs/papers.md G1)."""
    T2 = T1 * ratio
    v = float(v_ph(np.array(1 / rho), phi, T1, T2))
    assert v == pytest.approx(2 * rho * phi / (T1 + T2))
    assert -np.angle(mean_on_circle(rho, v, T1, T2)) == pytest.approx(phi, rel=1e-9)


normals = st.tuples(*(st.floats(-1, 1) for _ in range(3))).filter(lambda n: np.linalg.norm(n) > 0.1)


@pytest.mark.slow
@given(rho=st.floats(0.5, 50.0), normal=normals | st.sampled_from([(0, 0, 1), (1, 0, 0), (0, 1, 0)]))
@settings(max_examples=30)
def test_v_acc_and_v_jerk_reach_the_axes_limits_on_any_circle(rho, normal):
    """Par. 9 to 17 in any plane, also the one in which par. 9's e1 is 0/0: amplitudes v^2/rho and v^3/rho^2 times sqrt(1 - n_k^2).

    v_jerk is from the derivative of the acceleration; the text's derivative of v_acc is 0 on a circle and would limit nothing
    (docs/papers.md G2).
    """
    machine = problems.machine(
        velocity=1e4,
        axes={
            k: Axis(velocity=1e4, acceleration=a, jerk=j)
            for k, a, j in zip("xyz", (900, 2000, 5000), (1e5, 4e5, 5e4), strict=True)
        },
    )
    guide = guide_on(circle(rho, normal), machine, 1e4)
    n = np.asarray(normal) / np.linalg.norm(normal)
    angle = np.linspace(0, 2 * np.pi, 100_000)[:, None]
    e1 = np.linalg.svd(n[None])[2][1]
    around = np.abs(np.cos(angle) * e1 + np.sin(angle) * np.cross(n, e1)).max(
        axis=0
    )  # direction of a; j is at right angles to it
    inner = guide.length > 0
    for speeds, order, quantity in ((guide.v_acc, 2, "acceleration"), (guide.v_jerk, 3, "jerk")):
        limits = machine.limits(quantity, ("x", "y", "z"))
        worst = (speeds[inner, None] ** order / rho ** (order - 1) * around / limits).max(axis=1)
        np.testing.assert_allclose(worst, 1.0, rtol=1e-6)


def test_the_paper_takes_the_smallest_of_all_five():
    """Par. 29 has v_p missing in the min: on a straight line, where the others are infinite, nothing else would be left."""
    rho, ones = 2.0, np.ones(1)
    machine = problems.machine(acceleration=1e4, jerk=1e7)
    bent, straight = circle(rho), wave(0, sway=0.0)
    for feed in (5.0, 1e3):
        guide = guide_on(bent, machine, feed)
        inner = guide.length > 0
        by_error = np.sqrt(24 * rho * 0.99 * machine.tolerance / (T1**2 + T2**2))
        for phi in (0.5, 3.0):
            v = v_sc(guide, T1 * ones, T2 * ones, phi)[inner]
            np.testing.assert_allclose(v, min(feed, by_error, 2 * rho * phi / (T1 + T2)), rtol=1e-6)
        guide = guide_on(straight, machine, feed)
        np.testing.assert_allclose(v_sc(guide, T1 * ones, T2 * ones, 0.5)[guide.length > 0], min(feed, 100.0))


@given(
    V=st.floats(1.0, 300.0), a=st.floats(200.0, 2e4), j=st.floats(1e4, 1e6),
    direction=st.tuples(*(st.floats(0.1, 1.0) for _ in range(2))),
)  # fmt: skip
@settings(max_examples=30)
def test_the_filters_are_the_shortest_that_an_isolated_step_allows(V, a, j, direction):
    """Par. 19: V/T1 and V/(T1 T2) reach the limits of an axis; where V < a^2/j only the jerk, with both filters the same."""
    curve = Nurbs(
        degree=1, points=np.array([[0, 0], 50 * np.array(direction)]), knots=[0, 0, 1, 1], weights=[1, 1]
    )
    machine = problems.machine(velocity=1e4, acceleration=a, jerk=j)
    guide = guide_on(curve, machine, V)
    speed = np.where(guide.length > 0, V, 0.0)
    one, two = filter_lengths(guide, speed, machine, np.ones((1, 2)))
    along = V * np.max(direction) / np.linalg.norm(direction)
    assert one[0] >= two[0] * (1 - 1e-12)
    assert along / (one[0] * two[0]) == pytest.approx(j)
    if along >= a**2 / j:
        assert along / one[0] == pytest.approx(a)
    else:
        assert one[0] == pytest.approx(two[0])
        assert along / one[0] < a


# --- motions ----------------------------------------------------------------------------------------------------------------


GIVEN = FirSplineMethod(plain=True, profile_filters=(T1, T2), phase_lag=np.deg2rad(170.0))


@pytest.mark.parametrize("rho", [1.0, 5.0, 20.0])
def test_the_plain_motion_on_a_circle_runs_on_the_one_further_inside(rho):
    """In the steady part the radius is rho less the exact error, at the speed v_eps in time, within what the chords leave."""
    machine = strong(dt=1e-4)
    made = GIVEN.plan(circle(rho, turns=6).exact_program(1e3), machine)
    tol = machine.tolerance * 0.99
    v = np.sqrt(24 * rho * tol / (T1**2 + T2**2))
    t = made.trajectory
    steady = (t.t > T1 + T2) & (t.t < t.cycle_time - T1 - T2)
    radius = np.linalg.norm(t.position[steady], axis=1)
    error = circle_error(np.array(rho), np.array(v), T1, T2)
    np.testing.assert_allclose(rho - radius, error, atol=0.02 * machine.tolerance)
    np.testing.assert_allclose(t.feed[steady], v * (rho - error) / rho, rtol=2e-3)
    assert made.verdict.passed, made.verdict.faults


def excess(made) -> dict[str, float]:
    """Worst ratios of acceleration and jerk, and of the error to the tolerance."""
    v = made.verdict
    worst = {
        q: max(c.ratio for n, c in v.limits.items() if n.startswith(q)) for q in ("acceleration", "jerk")
    }
    return worst | {"error": max(v.contour_error_mm, v.vertex_error_mm) / made.machine.tolerance}


@pytest.mark.parametrize(
    ("name", "tolerance", "exceeded"),
    [
        ("butterfly", 0.05, "jerk error"),
        ("butterfly", 0.3, "acceleration jerk"),
        ("trident", 0.1, "jerk error"),
    ],
)
def test_on_varying_curvature_the_plain_mode_exceeds_and_says_so_and_the_safe_one_does_not(
    name, tolerance, exceeded
):
    """docs/papers.md G3: v_sc varies within the window, so none of the formulas is a bound; the verdict shows it. v_ph, when it is
    not left out of the way, hides most of it. Papers' limits: 2000 mm/s2 and 66 667 mm/s3, filters of 50 and 30 ms."""
    curve, machine = curve_named(name), problems.machine(jerk=66_667.0, tolerance=tolerance)
    plain = GIVEN.plan(curve.exact_program(100.0), machine)
    worst = excess(plain)
    assert not plain.verdict.passed
    assert {name for name, ratio in worst.items() if ratio > 1.05} == set(exceeded.split())
    assert all(ratio < 2.0 for ratio in worst.values())  # docs/papers.md: up to 1.46, 1.93 and 1.07
    safe = FirSplineMethod().plan(curve.exact_program(100.0), machine)
    assert safe.verdict.passed, safe.verdict.faults
    assert max(excess(safe).values()) > 0.9  # no large margins are left


@pytest.mark.parametrize("lengths", [(0.05, 0.05), (0.05, 0.02), (0.05, 1e-3)])
def test_the_rule_with_two_nodes_has_the_kernels_moments(lengths):
    """2 w x^2 = mu2 and 2 w x^4 = mu4 of the kernel about its middle."""
    filters = Filters(lengths)
    t = np.linspace(0.0, filters.delay, 200_001)
    weight = filters.kernel(t) * (t[1] - t[0])
    (x,), (w,) = two_nodes(*(np.array([T]) for T in lengths))
    for power in (2, 4):
        assert 2 * w * x**power == pytest.approx(weight @ (t - filters.delay / 2) ** power, rel=1e-4)
