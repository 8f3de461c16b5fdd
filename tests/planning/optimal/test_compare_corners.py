"""Single corners between full stops instead of splines, where they are faster."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from quick import slow_but

from benchmarks.cost.growth import relief
from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.samples import RESOLUTION, sample_path
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.nc.reader import parse_program
from planner.planning.job.trace import tell_nobody
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal import compare_corners
from planner.planning.optimal.compare_corners import (
    COMPARED_POINTS,
    CornerBounds,
    corner_bounds,
    with_corners,
)
from planner.planning.optimal.effort import COARSE, Grids
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import second_order
from planner.smoothing.spline_path import spline_shape, with_spline

MACHINE = problems.machine()
SOLVER = JerkLimited(tol=1e-7)
JOBS = problems.all_jobs()
QUIET = SimpleNamespace(tell=tell_nobody)  # what comparing corners asks of a job


def planned_on(path, grid=None, shape=None):
    samples = grid or refine_for_jerk(sample_path(path, MACHINE, third_order=True), MACHINE)
    problem = feedrate_problem(samples, MACHINE)
    return OnPath(path=path, samples=samples, problem=problem, solution=SOLVER.solve(problem), shape=shape)


GRIDS = Grids(np.inf, COARSE, RESOLUTION)


class Recorded:
    """An order that keeps count of the paths it is asked for."""

    def __init__(self):
        self.paths = []

    def solve(self, path, job, resolution):
        self.paths.append(path)
        return planned_on(path)


def shaped(program):
    toolpath = toolpath_from_program(program, MACHINE)
    rounded = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    return rounded, spline_shape(rounded, MACHINE)


@pytest.mark.shows("optimal", "sampled: never slower than single corners")
@pytest.mark.parametrize("name", slow_but("five points", JOBS))
def test_auto_is_never_slower_than_single_corners(name):
    auto = OptimalMethod().plan(JOBS[name], MACHINE)
    assert auto.corner == "auto"
    for corner in ("bezier", "spline"):
        single = OptimalMethod(corner=corner).plan(JOBS[name], MACHINE)
        assert auto.trajectory.cycle_time <= single.trajectory.cycle_time * (1 + 1e-6)


@pytest.mark.parametrize("limited", [True, False], ids=["third order", "second order"])
@pytest.mark.parametrize(
    "program",
    [problems.zigzag(), problems.star_spiral(60), problems.chord_circle(60)],
    ids=lambda own: own.source,
)
@pytest.mark.usual_sizes
def test_bounds_are_less_than_what_corners_take(program, limited):
    """What `auto` does not even try could not have been faster: the coarse time is not above the exact one."""
    rounded = round_corners(toolpath_from_program(program, MACHINE, None), MACHINE, BezierCorner())
    if limited:
        rounded = round_corners(rounded.toolpath, MACHINE, BezierCorner(), blend_tangents=True)
        exact = planned_on(rounded)
    else:
        exact = second_order(rounded, sample_path(rounded, MACHINE), MACHINE, Reachability())
    bounds = corner_bounds(rounded, MACHINE)
    assert (bounds.time < exact.stop_to_stop()).all()
    grid = sample_path(rounded, MACHINE, third_order=True)
    assert 0.3 * len(grid) < bounds.points.sum() < 3.0 * len(grid)


def test_the_bound_rules_out_corners_on_dense_chords():
    """On a relief of 60 chords single corners take longer than splines by what the bound says."""
    program = parse_program(relief(60), MACHINE)
    rounded, shape = shaped(program)
    splines = planned_on(with_spline(rounded, shape), shape=shape)
    assert corner_bounds(rounded, MACHINE).time.sum() > splines.solution.cycle_time


def test_of_corners_on_too_many_points_nothing_is_known(monkeypatch):
    rounded, _ = shaped(problems.zigzag())
    known = corner_bounds(rounded, MACHINE)
    monkeypatch.setattr(compare_corners, "COMPARED_POINTS", 10)
    bounds = corner_bounds(rounded, MACHINE)
    assert (bounds.time == 0.0).all()
    assert 0.3 * known.points.sum() < bounds.points.sum() < 3.0 * known.points.sum()


def test_corners_that_win_are_planned_by_themselves_on_both_grids_and_then_with_the_whole_path():
    points = np.array([[k, 0.6 * (k % 2)] for k in range(8)] + [[7.0, 20.0], [7.0, 5.0]])
    rounded, shape = shaped(problems.polyline(points))
    splines = planned_on(with_spline(rounded, shape), shape=shape)
    first = splines.samples.piece[1]
    duration = splines.solution.duration * np.where(np.arange(len(splines.samples)) < first, 2.0, 1.0)
    slow = dataclasses.replace(splines, solution=dataclasses.replace(splines.solution, duration=duration))
    order = Recorded()
    pieces = len(splines.samples.piece) - 1
    assert pieces == 2
    corners = CornerBounds(np.zeros(pieces), np.full(pieces, 100.0))
    best, left = with_corners(rounded, slow, corners, QUIET, order, GRIDS)
    assert not len(left)
    assert [len(path.legs) for path in order.paths] == [8, 8, 9]
    assert not best.shape.splines.fits.any()
    assert best.solution.cycle_time < slow.solution.cycle_time


@pytest.mark.usual_sizes
def test_a_part_of_a_path_is_the_same_path_there():
    """Pieces between full stops alone: the same corners, and the same time on each."""
    points = np.array([[k, 0.6 * (k % 2)] for k in range(8)])
    toolpath = toolpath_from_program(problems.polyline(points), MACHINE).with_joints([2, 5], Joint.STOP)
    rounded = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    times = planned_on(rounded).stop_to_stop()
    for kept in ([True, False, True], [False, True, False], [False, False, True]):
        part = rounded.part(np.array(kept))
        np.testing.assert_allclose(planned_on(part).stop_to_stop(), times[kept], rtol=1e-6)
    with pytest.raises(ValueError, match="without splines"):
        with_spline(rounded, spline_shape(rounded, MACHINE)).part(np.array([True, False, False]))


def test_corners_that_need_too_large_a_grid_are_left_and_named():
    points = np.array([[k, 0.6 * (k % 2)] for k in range(8)] + [[7.0, 20.0], [7.0, 5.0]])
    rounded, shape = shaped(problems.polyline(points))
    splines = planned_on(with_spline(rounded, shape), shape=shape)
    corners = CornerBounds(np.zeros(2), np.array([2.0 * COMPARED_POINTS, 10.0]))
    order = Recorded()
    best, left = with_corners(rounded, splines, corners, QUIET, order, GRIDS)
    assert not order.paths
    assert list(left) == [0]
    assert best is splines


@pytest.mark.usual_sizes
def test_corners_that_no_grid_follows_are_no_rivals(monkeypatch):
    toolpath = toolpath_from_program(problems.star_spiral(60), MACHINE)
    stopping = toolpath.with_joints(np.array([20, 40]), Joint.STOP)
    path = round_corners(stopping, MACHINE, BezierCorner(), blend_tangents=True)
    known = corner_bounds(path, MACHINE)
    assert np.isfinite(known.time).all()
    sampled = compare_corners.sample_path

    def too_coarse_in_the_middle(path, *given, **named):
        samples = sampled(path, *given, **named)
        margin = samples.margin.copy()
        if len(samples.piece) == 4:
            margin[samples.piece[1]] = 1.0
        return dataclasses.replace(samples, margin=margin)

    monkeypatch.setattr(compare_corners, "sample_path", too_coarse_in_the_middle)
    bounds = corner_bounds(path, MACHINE)
    assert bounds.time[1] == np.inf
    np.testing.assert_allclose(bounds.time[[0, 2]], known.time[[0, 2]], rtol=1e-9)
    np.testing.assert_array_equal(bounds.points, known.points)
