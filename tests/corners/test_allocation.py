"""The error budget: eq. (18)-(20) and its three-source version against brute force; corners capped by short legs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from whole_plans import apexes, smooth_path, solve

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.budget import (
    allocate,
    error_rate,
    normal_of_axes,
    normal_within_budget,
)
from planner.machine import Fir

budgets = st.floats(1e-4, 0.5)
accelerations = st.floats(10.0, 1e5)
rates = st.floats(1e-8, 1e-4)


def speed_sq(tol_ap, tol, acceleration, rate):
    """v^2 up to the angle's factor: X eps_ap with X = min(A, (eps - eps_ap)/c)."""
    return np.minimum(acceleration, (tol - tol_ap) / rate) * tol_ap


@pytest.mark.shows("corner-bezier", "exact: the error budget by brute force")
@given(tol=budgets, acceleration=accelerations, rate=rates)
@settings(max_examples=100)
def test_the_closed_form_is_the_brute_force_optimum(tol, acceleration, rate):
    """docs/papers.md D2."""
    tried = tol * np.linspace(0.0, 1.0, 20_001)
    best = speed_sq(tried, tol, acceleration, rate).max()
    chosen = allocate(np.array([tol]), np.array([acceleration]), rate)[0]
    assert 0 < chosen < tol
    assert speed_sq(chosen, tol, acceleration, rate) >= best * (1 - 1e-9)


@given(tol=budgets, acceleration=accelerations, dt=st.floats(1e-4, 1e-2),
       filters=st.tuples(st.floats(1e-3, 0.05), st.floats(1e-3, 0.05)))  # fmt: skip
@settings(max_examples=60)
def test_three_sources_use_the_whole_budget(tol, acceleration, dt, filters):
    """eps_ap + eps_ch + eps_fir = eps with X* = min(A, eps/2c), and no split of the three is faster (docs/papers.md D5)."""
    rate = error_rate(problems.machine(dt=dt, fir=Fir(time_constants=filters)))
    assert rate == pytest.approx(dt**2 / 8 + (filters[0] ** 2 + filters[1] ** 2) / 24, rel=1e-12)
    chosen = allocate(np.array([tol]), np.array([acceleration]), rate)
    X = normal_within_budget(np.array([tol]), chosen, np.array([acceleration]), rate)[0]
    assert pytest.approx(min(acceleration, tol / (2 * rate)), rel=1e-9) == X
    chord, fir = X * dt**2 / 8, X * sum(T * T for T in filters) / 24
    assert chosen[0] + chord + fir == pytest.approx(tol, rel=1e-9)
    best = 0.0
    for share_ap in np.linspace(0.01, 0.99, 99):  # brute force over two free shares
        share_chord = np.linspace(0.0, 1.0, 101)
        left = tol * (1 - share_ap)
        per_source = np.minimum(
            8 * left * share_chord / dt**2, 24 * left * (1 - share_chord) / sum(T * T for T in filters)
        )
        best = max(best, (np.minimum(acceleration, per_source) * share_ap * tol).max())
    assert X * chosen[0] >= best * (1 - 1e-9)


def test_equation_20_as_printed():
    """Paper 002's data: eps 0.05, A 1e4, Ts 4 ms give eps_ch = A Ts^2/8 = 0.020 and eps_ap = 0.030; tight budgets halve."""
    rate = error_rate(problems.five_points_machine())
    A = np.array([1e4])
    assert allocate(np.array([0.05]), A, rate)[0] == pytest.approx(0.03, rel=1e-12)
    assert allocate(np.array([0.04]), A, rate)[0] == pytest.approx(
        0.02, rel=1e-12
    )  # the threshold eps = A Ts^2/4
    assert allocate(np.array([0.01]), A, rate)[0] == pytest.approx(0.005, rel=1e-12)


@given(tol=budgets, acceleration=accelerations, rate=rates, cap=st.floats(0.01, 1.0))
def test_a_capped_corner_gives_what_it_cannot_use_to_the_chord(tol, acceleration, rate, cap):
    free = allocate(np.array([tol]), np.array([acceleration]), rate)[0]
    used = cap * free
    X = normal_within_budget(np.array([tol]), np.array([used]), np.array([acceleration]), rate)[0]
    assert pytest.approx(min(acceleration, (tol - used) / rate)) == X
    assert used + rate * X <= tol * (1 + 1e-12)
    tried = np.linspace(
        0.0, used, 501
    )  # docs/papers.md D6: with eps_ap <= the cap nothing is faster than the cap itself
    assert X * used >= speed_sq(tried, tol, acceleration, rate).max() * (1 - 1e-9)


@given(theta=st.floats(0.0, np.pi), seed=st.integers(0, 1000))
def test_the_axes_support_along_the_bisector(theta, seed):
    rng = np.random.default_rng(seed)
    limits = rng.uniform(100, 5000, 3)
    u1 = rng.normal(size=3)
    u1 /= np.linalg.norm(u1)
    side = np.cross(u1, rng.normal(size=3))
    side /= np.linalg.norm(side)
    u2 = np.cos(theta) * u1 + np.sin(theta) * side
    found = normal_of_axes(limits, u1[None], u2[None])[0]
    corners = np.array(np.meshgrid(*[(-a, a) for a in limits])).reshape(3, -1).T
    if theta > 1e-5:
        n = (u2 - u1) / np.linalg.norm(u2 - u1)
        assert found == pytest.approx((corners @ n).max(), rel=1e-9)
    assert found <= np.linalg.norm(limits) * (1 + 1e-12)


POLYNOMIAL_SPEEDS = (47.06, 28.31, 38.26)  # docs/papers.md E [mm/s]


@pytest.mark.parametrize(("sigma2", "gain"), [(1.0, 1.0), (0.9, np.sqrt(1 / 0.9))])
def test_paper_002s_five_points(sigma2, gain):
    solved = solve(problems.five_points(), problems.five_points_machine(), BezierCorner(sigma2=sigma2))
    table = apexes(solved.samples, np.sqrt(solved.solution.feed_sq))
    np.testing.assert_allclose(np.rad2deg(table.theta), [48.53, 73.70, 58.01], atol=0.005)
    np.testing.assert_allclose(table.d_in, [0.292, 0.200, 0.2475], atol=1e-4)
    np.testing.assert_allclose(table.tol_ap, 0.03, rtol=3e-4)
    assert (table.tol_ap <= 0.03 * (1 + 1e-12)).all()
    np.testing.assert_allclose(table.kappa, np.array([4.515, 12.48, 6.83]) * sigma2, rtol=1e-3)
    np.testing.assert_allclose(table.closed_form, np.array(POLYNOMIAL_SPEEDS) * gain, rtol=4e-4)
    np.testing.assert_allclose(table.planned, table.closed_form, rtol=1e-3)
    assert (table.planned <= table.closed_form * (1 + 1e-9)).all()


@pytest.mark.parametrize("job", list(problems.all_jobs()))
@pytest.mark.parametrize("kind", ["bezier", "fir"])
def test_no_corner_is_faster_than_its_closed_form(job, kind):
    solved = solve(problems.all_jobs()[job], problems.machine(), kind)
    table = apexes(solved.samples, np.sqrt(solved.solution.feed_sq))
    assert len(table.theta) > 0
    assert (table.planned <= table.closed_form * (1 + 1e-6)).all()


def test_the_budget_is_never_overdrawn():
    rng = np.random.default_rng(13)
    machine = problems.machine(dt=0.004, fir=Fir(time_constants=(0.02, 0.01)))
    for _ in range(10):
        path = smooth_path(problems.random_polyline(rng, blocks=20), machine)
        used = path.tol_ap + error_rate(machine) * path.normal_max
        assert (used <= path.tol * (1 + 1e-12)).all()
