"""The spline kernels against scipy: basis polynomials, banded factorisation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from planner.smoothing.basis import DEGREE, ORDER, clamped, derivatives, span_basis
from planner.smoothing.interior_point import factorise, solve

seeds = st.integers(0, 10**6)


def random_breaks(rng, spans):
    return np.cumsum(10.0 ** rng.uniform(-2.0, 1.0, spans + 1))


@given(seeds, st.integers(1, 12))
@settings(max_examples=40)
def test_basis_is_that_of_scipy(seed, spans):
    rng = np.random.default_rng(seed)
    breaks = random_breaks(rng, spans)
    knots = clamped(breaks)
    control = rng.normal(size=(spans + DEGREE, 2))
    spline = BSpline(knots, control, DEGREE)
    basis, out = span_basis(knots), np.empty((4, ORDER))
    for i in range(spans):
        tau = rng.uniform()
        h = breaks[i + 1] - breaks[i]
        derivatives(basis[i], tau, h, out)
        for order in range(4):
            expected = spline.derivative(order)(breaks[i] + tau * h) if order else spline(breaks[i] + tau * h)
            np.testing.assert_allclose(
                out[order] @ control[i : i + ORDER], expected, rtol=1e-7, atol=1e-9 * np.abs(out[order]).max()
            )


@given(seeds, st.integers(9, 40), st.integers(1, 9))
@settings(max_examples=40)
def test_banded_solution_is_that_of_scipy(seed, n, width):
    rng = np.random.default_rng(seed)
    band = rng.normal(size=(n, width))
    for i in range(n):  # nothing right of the last column
        band[i, n - i :] = 0.0
    band[:, 0] = width + rng.uniform(size=n) * 3.0 + np.abs(band[:, 1:]).sum()  # diagonally dominant
    lower = band.T.copy()
    rhs = rng.normal(size=n)
    expected = solveh_banded(lower, rhs, lower=True)
    assert factorise(band)
    solve(band, rhs)
    np.testing.assert_allclose(rhs, expected, rtol=1e-8, atol=1e-10)


def test_an_indefinite_matrix_is_told():
    assert not factorise(np.array([[1.0, 2.0], [1.0, 0.0]]))


@pytest.mark.parametrize("spans", [1, 5])
def test_basis_sums_up_to_one(spans):
    basis = span_basis(clamped(random_breaks(np.random.default_rng(spans), spans)))
    np.testing.assert_allclose(basis.sum(axis=1)[:, 0], 1.0)
    np.testing.assert_allclose(basis.sum(axis=1)[:, 1:], 0.0, atol=1e-12)
