"""Derivatives by the arithmetic of `Series` are those of differences."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.series import Series

FUNCTIONS = {
    "sum": lambda x, y: 2.0 + x - 3.0 * y - (-x) + +y,
    "product": lambda x, y: x * y * x,
    "quotient": lambda x, y: (1.0 + y) / (2.0 + x),
    "powers": lambda x, y: x**3 - y**0.5 + x**y,
    "roots": lambda x, y: np.sqrt(x) + np.square(y) + np.reciprocal(x) + np.abs(-y),
    "exponential": lambda x, y: np.exp(x * y) + np.log(x),
    "circle": lambda x, y: np.sin(x) * np.cos(y) + np.tan(x / 4),
    "arcs": lambda x, y: np.arcsin(x / 4) + np.arccos(y / 4) + np.arctan(x),
    "angle": lambda x, y: np.arctan2(y - 1.5, x),
    "length": lambda x, y: np.hypot(x, y),
    "hyperbolic": lambda x, y: np.sinh(x) + np.cosh(y),
}


def _at(s):
    """x and y as functions of s, with their derivatives."""
    x = np.stack([1.0 + 0.4 * s**3, 1.2 * s**2, 2.4 * s, 2.4 + 0.0 * s])
    y = np.stack([1.2 + np.sin(s), np.cos(s), -np.sin(s), -np.cos(s)])
    return x, y


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives_are_those_of_differences(name):
    f, s, h = FUNCTIONS[name], np.array([0.3, 0.7, 1.1]), 1e-4
    found = f(*(Series(table) for table in _at(s))).derivatives

    def exact(place):
        return f(*(Series(table) for table in _at(place))).derivatives

    assert found[0] == pytest.approx(f(*(table[0] for table in _at(s))), rel=1e-14)
    for order in range(3):
        slope = (exact(s + h)[order] - exact(s - h)[order]) / (2.0 * h)
        assert found[order + 1] == pytest.approx(slope, rel=1e-6, abs=1e-6)


def test_what_has_no_derivatives_is_refused():
    x = Series(_at(np.array([0.5]))[0])
    with pytest.raises(TypeError, match="floor has no derivatives here"):
        np.floor(x)
