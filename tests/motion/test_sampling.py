"""Arc length inverted: every sample lies where its arc length says, on spans, corners, arcs and lines."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from whole_plans import smooth_path

from benchmarks.jobs import problems
from planner.base.arrays import read_only
from planner.corners.elements import ElementTable, element_length, element_point
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.spline import span_dtype
from planner.motion.sampling import LENGTH_ROUNDING, ONE_STEP, Grid, inverses, sample
from planner.nc.reader import parse_program
from planner.smoothing.spline_path import spline_shape, with_spline

MACHINE = problems.machine()
LOOKED_AT = 15  # intervals of each path, about
SHARES = np.array([0.1, 0.3, 0.6, 0.9])
HELIX = "G21 G90 G17 G64 P0.05 F3000\nG1 X10\nG2 X10 Y10 J5 Z1\nG1 X0 Y11\nM2\n"


@cache
def paths() -> dict[str, PathSamples]:
    corners = smooth_path(problems.pentagon(), MACHINE)
    arcs = smooth_path(parse_program(HELIX, MACHINE), MACHINE)
    splines = with_spline(corners, spline_shape(corners, MACHINE))
    assert len(splines.spline)
    fine = {"corners": corners, "arcs": arcs, "splines": splines}
    grids = {name: sample_path(path, MACHINE, 0.02, third_order=True) for name, path in fine.items()}
    return {**grids, "coarse": sample_path(splines, MACHINE, 1.0)}


def grid_of(samples: PathSamples) -> Grid:
    columns = (getattr(samples, name) for name in ("piece", "s", "element", "w0", "w1", "segment"))
    return Grid(*columns, samples.path.passed)


def nearly_a_cusp() -> tuple[ElementTable, Grid]:
    """One span (w - 1/2)^3 + 0.1 w, on which no polynomial of the arc length is any good."""
    table = paths()["corners"].table
    spans = np.zeros(1, span_dtype(3))
    spans["coef"][0, :4, 0], spans["width"] = (-0.125, 0.85, -1.5, 1.0), 1.0
    table, element = table._replace(spans=spans), len(table.legs)
    length = element_length(*table, element, 0.0, 1.0, 0.5, np.empty((4, 3)))
    ends = np.array([0.0, 1.0]), np.array([1.0, 1.0])
    piece, s = np.array([0, 2]), np.array([0.0, length])
    columns = piece, s, np.full(2, element), *ends, np.zeros(2, dtype=np.int64)
    return table, Grid(*map(read_only, columns), np.array([0.0, 1.0]))


NAMES = ("corners", "arcs", "splines", "coarse", "cusp")


@cache
def case(name: str) -> tuple[ElementTable, Grid, int]:
    """The elements, the grid and the number of axes of a path."""
    if name == "cusp":
        return *nearly_a_cusp(), 3
    samples = paths()[name]
    return samples.table, grid_of(samples), samples.d1.shape[1]


@pytest.mark.parametrize("name", NAMES)
def test_samples_lie_where_their_arc_length_says(name):
    """At a constant feed of 1 mm/s from each grid point on: four samples in every interval, s known, the position by hand."""
    table, grid, axes = case(name)
    inverse = inverses(table, grid, axes)
    interval = np.setdiff1d(np.arange(len(grid.s)), grid.piece[1:] - 1)
    interval = interval[:: max(1, len(interval) // LOOKED_AT)]
    h = grid.s[interval + 1] - grid.s[interval]
    times = (grid.s[interval, None] + h[:, None] * SHARES).ravel()
    position, velocity, *_, s, _, _ = sample(table, even_law(grid), grid, inverse, read_only(times), axes)
    np.testing.assert_allclose(s, times, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 1.0, rtol=1e-12)
    work, out = np.empty((2, 4, axes)), np.empty((4, axes))
    for row, i in enumerate(interval):
        w0, w1, ref = grid.w0[i], grid.w1[i], 0.5 * (grid.w0[i] + grid.w1[i])
        for column, share in enumerate(SHARES):
            low, high = w0, w1
            for _ in range(60):  # halves, without what is tested
                w = 0.5 * (low + high)
                long = element_length(*table, grid.element[i], w0, w, ref, out) > share * h[row]
                low, high = (low, w) if long else (w, high)
            element_point(*table, grid.element[i], w, ref, work, out)
            off = np.abs(position[row * len(SHARES) + column] - out[0]).max()
            assert off <= 4.0 * LENGTH_ROUNDING * h[row] + 2e-13 * max(1.0, np.abs(out[0]).max())


def even_law(grid: Grid) -> tuple[object, ...]:
    """1 mm/s all along."""
    run = np.repeat(np.arange(len(grid.piece) - 1), np.diff(grid.piece))
    one = np.ones(len(grid.s))
    columns = map(read_only, (grid.s, grid.s, one, 0.0 * one, 0.0 * one, run))
    return *columns, float(grid.s[-1]) + 1.0


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_does_not_depend_on_the_others_beside_it(name):
    """Each time alone, to the last digit: chunks of any size give the same bytes."""
    table, grid, axes = case(name)
    inverse, law = inverses(table, grid, axes), even_law(grid)
    times = np.linspace(0.0, grid.s[-1], 53)
    together = sample(table, law, grid, inverse, read_only(times), axes)
    for n, time in enumerate(times):
        for whole, single in zip(
            together, sample(table, law, grid, inverse, read_only(np.array([time])), axes), strict=True
        ):
            assert np.array_equal(whole[n], single[0])


def test_each_way_of_inverting_is_taken():
    """By the polynomial alone, with a step by the slope, and by the curve."""
    off = np.concatenate([inverses(*case(name))[:, 0] for name in NAMES])
    assert ((off > 0.0) & (off <= LENGTH_ROUNDING)).any()
    assert ((off > LENGTH_ROUNDING) & (off <= ONE_STEP)).any()
    assert (off > ONE_STEP).any()
