"""Arc length inverted: every sample lies where its arc length says, on spans, corners, arcs and lines."""

from __future__ import annotations

import numpy as np
import pytest
from whole_plans import smooth_path

from benchmarks import problems
from planner.corners.elements import element_length, element_point
from planner.motion.sampling import LENGTH_ROUNDING, ONE_STEP, Grid, inverses, sample
from planner.nc.reader import parse_program
from planner.path.samples import PathSamples, sample_path
from planner.smoothing.spline_path import spline_shape, with_spline

MACHINE = problems.machine()
LOOKED_AT = 15  # intervals of each path, about
SHARES = np.array([0.1, 0.3, 0.6, 0.9])
HELIX = "G21 G90 G17 G64 P0.05 F3000\nG1 X10\nG2 X10 Y10 J5 Z1\nG1 X0 Y11\nM2\n"


def paths() -> dict[str, PathSamples]:
    corners = smooth_path(problems.pentagon(), MACHINE)
    arcs = smooth_path(parse_program(HELIX, MACHINE), MACHINE)
    splines = with_spline(corners, spline_shape(corners, MACHINE))
    assert len(splines.spline)
    fine = {"corners": corners, "arcs": arcs, "splines": splines}
    grids = {name: sample_path(path, MACHINE, 0.02, third_order=True) for name, path in fine.items()}
    return {**grids, "coarse": sample_path(splines, MACHINE, 1.0)}


PATHS = paths()


@pytest.mark.parametrize("name", list(PATHS))
def test_samples_lie_where_their_arc_length_says(name):
    """At a constant feed of 1 mm/s from each grid point on: four samples in every interval, s known, the position by hand."""
    grid_of = PATHS[name]
    grid = Grid(
        grid_of.piece,
        grid_of.s,
        grid_of.element,
        grid_of.w0,
        grid_of.w1,
        grid_of.segment,
        grid_of.path.passed,
    )
    table, axes = grid_of.table, grid_of.d1.shape[1]
    inverse = inverses(table, grid, axes)
    interval = grid_of.intervals[:: max(1, len(grid_of.intervals) // LOOKED_AT)]
    h = grid_of.s[interval + 1] - grid_of.s[interval]
    run = np.repeat(np.arange(len(grid_of.piece) - 1), np.diff(grid_of.piece))
    one = np.ones(len(grid_of.s))
    law = (grid_of.s, grid_of.s, one, 0.0 * one, 0.0 * one, run, float(grid_of.s[-1]) + 1.0)
    times = (grid_of.s[interval, None] + h[:, None] * SHARES).ravel()
    position, velocity, *_, s, _, _ = sample(table, law, grid, inverse, times, axes)
    np.testing.assert_allclose(s, times, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 1.0, rtol=1e-12)
    work, out = np.empty((2, 4, axes)), np.empty((4, axes))
    for row, i in enumerate(interval):
        w0, w1, ref = grid_of.w0[i], grid_of.w1[i], 0.5 * (grid_of.w0[i] + grid_of.w1[i])
        for column, share in enumerate(SHARES):
            low, high = w0, w1
            for _ in range(60):  # halves, without what is tested
                w = 0.5 * (low + high)
                long = element_length(*table, grid_of.element[i], w0, w, ref, out) > share * h[row]
                low, high = (low, w) if long else (w, high)
            element_point(*table, grid_of.element[i], w, ref, work, out)
            off = np.abs(position[row * len(SHARES) + column] - out[0]).max()
            assert off <= 4.0 * LENGTH_ROUNDING * h[row] + 2e-13 * max(1.0, np.abs(out[0]).max())


def test_each_way_of_inverting_is_taken():
    """Straight lines exactly, most curves with a step by the slope, and some by the curve."""
    off = np.concatenate(
        [
            inverses(
                p.table, Grid(p.piece, p.s, p.element, p.w0, p.w1, p.segment, p.path.passed), p.d1.shape[1]
            )[:, 0]
            for p in PATHS.values()
        ]
    )
    assert (off <= LENGTH_ROUNDING).any()
    assert ((off > LENGTH_ROUNDING) & (off <= ONE_STEP)).any()
    assert (off > ONE_STEP).any()
