"""What splines leave of the tolerance for chord errors is there: what they use and what they leave is no more than all of it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.budget import error_rate
from planner.corners.smooth import round_corners
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.smoothing.spline_path import spline_shape, with_spline


def distance(points, vertices):
    """(n,) from the polyline (m, A)."""
    a, step = vertices[:-1], np.diff(vertices, axis=0)
    share = np.einsum("nma,ma->nm", points[:, None] - a, step) / (step**2).sum(axis=1)
    near = a + np.clip(share, 0.0, 1.0)[..., None] * step
    return np.linalg.norm(points[:, None] - near, axis=2).min(axis=1)


@pytest.mark.parametrize("dt", [1e-3, 4e-3])
@pytest.mark.parametrize(
    "program", [problems.zigzag(10), problems.chord_circle(40)], ids=lambda own: own.source
)
def test_what_is_used_and_what_is_left_is_the_tolerance(program, dt):
    machine = problems.machine(dt=dt)
    rounded = round_corners(
        toolpath_from_program(program, machine), machine, BezierCorner(), blend_tangents=True
    )
    path = with_spline(rounded, spline_shape(rounded, machine))
    samples = sample_path(path, machine, third_order=True)
    span = samples.element - len(samples.table.legs)
    on = span >= 0
    assert on.sum() > 20
    used = distance(samples.position[on], np.vstack([program.start, program.end]))
    left = path.spline.budget[span[on]]
    assert (used + left <= machine.tolerance * (1 + 1e-6)).all()
    # Enough for the chords of the largest acceleration, but for what eq. (20) cuts off.
    most = error_rate(machine) * np.linalg.norm(machine.limits("acceleration", "xyz"))
    assert left.min() >= 0.1 * min(most, machine.tolerance / 2)
