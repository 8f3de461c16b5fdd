"""The shape of splines: runs that are relaxed side by side."""

from __future__ import annotations

import numpy as np

from benchmarks.jobs import problems
from planner.base.threads import use_threads
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.smoothing import relax as relax_module
from planner.smoothing.spline_path import spline_shape

MACHINE = problems.machine()


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
