"""The shape of splines: cusps seen at first sight, and runs and ranges that are laid and relaxed side by side."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.base.threads import use_threads
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.smoothing import initial as initial_module
from planner.smoothing import relax as relax_module
from planner.smoothing.basis import DEGREE, derivatives, knots_at
from planner.smoothing.spline_path import CUSP, spline_shape, turns_little

MACHINE = problems.machine()


def test_a_span_that_has_no_cusp_at_first_sight_has_none_at_any_place():
    rng = np.random.default_rng(7)
    seen = {True: 0, False: 0}
    for noise in (0.1, 0.4, 1.0, 3.0):
        knots = knots_at(np.cumsum(rng.uniform(0.2, 2.0, 60)))
        n = len(knots.basis) + DEGREE
        greville = np.interp(np.linspace(0, 1, n), np.linspace(0, 1, len(knots.breaks)), knots.breaks)
        control = greville[:, None] * np.array([0.8, 0.6]) + noise * rng.normal(size=(n, 2))
        rows = np.empty((4, DEGREE + 1))
        for i, poly in enumerate(knots.basis):
            h = knots.breaks[i + 1] - knots.breaks[i]
            sure = bool(turns_little(poly, control, i, h))
            seen[sure] += 1
            tangents = []
            for tau in np.linspace(0.0, 1.0, 101):
                derivatives(poly, tau, h, rows)
                tangents.append(rows[1] @ control[i : i + DEGREE + 1])
            tangents = np.array(tangents)
            if sure:
                assert np.linalg.norm(tangents, axis=1).min() > CUSP
                assert (tangents @ tangents.T).min() > 0.0
    assert min(seen.values()) > 10


def test_any_number_of_threads_lays_the_same_splines(monkeypatch):
    toolpath = toolpath_from_program(problems.star_spiral(200), MACHINE)
    stopping = toolpath.with_joints(np.array([40, 60, 100, 150, 190]), Joint.STOP)
    path = round_corners(stopping, MACHINE, BezierCorner(), blend_tangents=True)
    monkeypatch.setattr(relax_module, "SPANS_SHARED", 0)
    shapes = []
    try:
        for threads in (1, 3):
            use_threads(threads)
            shapes.append(spline_shape(path, MACHINE))
    finally:
        use_threads(None)
    one, many = shapes
    assert len(one.splines.fits) > 3
    assert one.splines.fits.any()
    for a, b in ((one.splines.control, many.splines.control), (one.left, many.left)):
        np.testing.assert_array_equal(a, b)


@pytest.fixture(scope="module")
def long_run():
    """Steps of 0.4 mm, each to the other side by up to 40 degrees: about 1,000 control points."""
    angle = np.deg2rad(np.random.default_rng(8).uniform(10.0, 40.0, 500)) * np.where(
        np.arange(500) % 2, 1, -1
    )
    points = np.cumsum(0.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    toolpath = toolpath_from_program(problems.polyline(points), MACHINE)
    return round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)


def test_knots_of_a_run_laid_in_ranges_are_as_dense(long_run, monkeypatch):
    whole = spline_shape(long_run, MACHINE).splines
    monkeypatch.setattr(initial_module, "RANGE", 100)
    laid = []
    distances = initial_module.needed_distances
    monkeypatch.setattr(
        initial_module, "needed_distances", lambda *given: (laid.append(given), distances(*given))[1]
    )
    ranges = spline_shape(long_run, MACHINE).splines
    assert len(laid) == 4
    assert not ranges.outside.any()
    assert abs(len(ranges.breaks) / len(whole.breaks) - 1.0) < 0.02
