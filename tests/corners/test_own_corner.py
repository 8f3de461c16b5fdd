"""Corner shapes of one's own: the derivatives of the polynomial, the error bound, continuity, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from whole_plans import evaluate_corner

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.corners.blend import error_from_middle
from planner.corners.own import PolynomialCorner
from planner.geometry.build import toolpath_from_program

MACHINE = problems.machine()


class Wide(PolynomialCorner):
    name = "wide"

    def retreat(self, w):
        return (1 - w) ** 3 * (1 + w)


def _corner(theta, d, w):
    points = [[-10.0, 0, 0], [0, 0, 0], [10.0 * np.cos(theta), 6.0 * np.sin(theta), 8.0 * np.sin(theta)]]
    toolpath = toolpath_from_program(problems.polyline(points), MACHINE)
    params = Wide().params(np.array([d]), np.array([100.0]))[0]
    return evaluate_corner(toolpath, 1, Wide(), params, w).by_s


def test_the_coefficients_are_those_of_the_function():
    """(1-w)^3 (1+w) = 2 z^3 - z^4 with z = 1 - w."""
    assert Wide().coefficients == pytest.approx(
        [2.0, -1.0] + [0.0] * 8, abs=1e-8
    )  # of which the shape itself feels 1e-14


@pytest.mark.parametrize("theta", [0.1, 1.0, 2.0, 3.0])
def test_it_misses_the_vertex_by_what_the_bound_says_and_leaves_straight(theta):
    d, w = 1.5, np.linspace(0.0, 1.0, 201)
    by_s = _corner(theta, d, w)
    middle = Wide().middle(np.array([d]), np.array([100.0]))
    bound = error_from_middle(middle, np.sin(theta / 2), np.zeros(1))[0]
    assert np.linalg.norm(by_s[100, 0]) == pytest.approx(bound, rel=1e-9)
    assert by_s[0, 0] == pytest.approx([-d, 0, 0], abs=1e-9)
    assert by_s[[0, -1], 2] == pytest.approx(
        np.zeros((2, 3)), abs=1e-9
    )  # no curvature where it meets its legs


def test_derivatives_along_the_path_are_those_of_differences():
    h, w = 1e-5, np.linspace(0.1, 0.9, 9)
    here, before, after = (_corner(1.0, 1.5, w + k) for k in (0.0, -h, h))
    step = np.linalg.norm(after[:, 0] - before[:, 0], axis=1)[:, None]
    for order in (1, 2):
        slope = (after[:, order] - before[:, order]) / step
        assert here[:, order + 1] == pytest.approx(slope, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda w: 2.0 * (1 - w) ** 3, "must fall from 1 to 0"),
        (lambda w: (1 - w) ** 2, "triple zero"),
        (lambda w: np.where(w < 0.5, 1.0 - w, 0.0), "polynomial of degree 12"),
        (lambda w: (1 - w) ** 3 * (1 + 3 * w + 6 * w**2), "must fall all the way"),
        (lambda w: (1 - w) ** 3 * (1 + 6 * w), "must fall all the way"),
    ],
)
def test_functions_that_are_no_corners_are_refused(function, said):
    class Odd(PolynomialCorner):
        name = "odd"

        def retreat(self, w):
            return function(w)

    with pytest.raises(InputError, match=said):
        _ = Odd().coefficients
