"""What limits leave on a grid, by geometry that the tests know themselves."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.judge.setpoints import trajectory_of
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import CURVATURE_MARGIN, bounds_of
from planner.feedrate.constraints.limits import ACCELERATION, FEED, LIMITS, VELOCITY, Limits
from planner.feedrate.constraints.on_grid import OnGrid, interval_sides, remaining_budget
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.motion import limits_used
from planner.nc.reader import parse_program
from planner.smoothing.spline_path import spline_shape, with_spline


def grid_of(program, machine, resolution=1e-3):
    path = round_corners(toolpath_from_program(program, machine), machine, BezierCorner())
    return OnGrid(sample_path(path, machine, resolution), machine)


def test_between_the_points_of_a_coarse_grid_no_axis_is_faster_than_its_velocity():
    """A circle, on which max_k |r'_k| is largest between points. x = feed^2 is linear in the way between them."""
    radius, fastest = 10.0, 20.0
    machine = problems.machine(velocity=fastest)
    grid = grid_of(parse_program(f"G21 G17 F60000\nG3 X0 Y0 I-{radius:g} J0\n"), machine, 0.1)
    s, d1 = grid.samples.s, grid.samples.d1
    points = fastest**2 / np.abs(d1).max(axis=1) ** 2  # of each point alone
    allowed = np.min([cap.feed_sq for cap in VELOCITY.at_points(grid)], axis=0)
    along = np.linspace(0.0, s[-1], 20 * len(s))
    phi = along / radius
    turned = np.maximum(np.abs(np.sin(phi)), np.abs(np.cos(phi)))
    assert (np.sqrt(np.interp(along, s, points)) * turned).max() > 1.01 * fastest
    assert (np.sqrt(np.interp(along, s, allowed)) * turned).max() <= fastest * (1 + 1e-9)


def test_where_f_changes_the_smaller_one_counts_on_either_side():
    feeds = np.array([100.0, 40.0, 80.0])
    program = problems.polyline([[0, 0], [10, 0], [20, 0], [30, 0]], feed=feeds)
    grid = grid_of(program, problems.machine())
    (cap,) = FEED.at_points(grid)
    x = grid.samples.position[:, 0]
    expected = np.array(
        [40.0 if 10.0 - 1e-9 <= at <= 20.0 + 1e-9 else feeds[int(at / 10.0)] for at in x[:-1]]
    )
    assert np.isclose(x[:, None], [10.0, 20.0]).any(axis=0).all(), "both changes are at points"
    np.testing.assert_allclose(np.sqrt(cap.feed_sq[:-1]), expected)


def test_beside_rotary_axes_f_is_the_speed_of_x_and_y_on_a_rounded_corner_too():
    """Before the corner a turns much, behind it little: the curve has other parts in both than its blocks."""
    axis = problems.machine().axes["x"]
    machine = problems.machine(axes=dict.fromkeys("xyza", axis), tolerance=0.5)
    grid = grid_of(parse_program("G21 G90 G64 F600\nG1 X20 A60\nG1 Y20 A65\n", machine), machine)
    (cap,) = FEED.at_points(grid)
    assert (grid.samples.element[grid.right] < 0).sum() > 5
    cutting = np.sqrt(cap.feed_sq) * np.linalg.norm(grid.samples.d1[:, :3], axis=1)
    np.testing.assert_array_less(cutting, 10.0 * (1.0 + 1e-9))
    assert cutting[[0, -1]] == pytest.approx(10.0)


def test_from_one_arc_to_its_mirror_image_the_acceleration_steps_by_both():
    """An S: v^2/R on one side of the joint, and as much to the other side behind it; where a line meets an arc, once."""
    radius, most = 10.0, 2000.0
    program = "G21 G17 F60000\nG1 X20\nG3 X30 Y10 J10\nG2 X40 Y20 I10\n"
    grid = grid_of(parse_program(program), problems.machine(acceleration=most))
    allowed = np.min([cap.feed_sq for cap in ACCELERATION.at_jumps(grid)], axis=0)
    for place, size in (([20.0, 0.0], 1.0 / radius), ([30.0, 10.0], 2.0 / radius)):
        here = np.isclose(grid.samples.position[:, :2], place).all(axis=1)
        assert allowed[here] == pytest.approx(most / size)


@pytest.mark.parametrize("theta", [0.4, 1.3, 2.4])
def test_at_a_corner_chords_have_what_the_rounding_leaves_of_the_tolerance(theta):
    """Eq. (18): eps - eps_ap, with eps_ap the distance of the rounded corner from its vertex."""
    machine = problems.machine()
    vertex = np.array([20.0, 0.0])
    end = vertex + 20.0 * np.array([np.cos(theta), np.sin(theta)])
    grid = grid_of(problems.polyline([[0, 0], vertex, end]), machine)
    off = np.linalg.norm(grid.samples.position[:, :2] - vertex, axis=1).min()
    corner = grid.samples.element[grid.right] < 0
    assert corner.any()
    assert 0.1 * machine.tolerance < off < machine.tolerance
    assert grid.sides()[1].tol_chord[corner] == pytest.approx(machine.tolerance - off, rel=1e-3)
    assert grid.sides()[1].tol_chord[~corner] == pytest.approx(machine.tolerance)


def test_on_a_spline_chords_have_what_it_leaves_and_beside_it_all_of_the_tolerance():
    machine = problems.machine()
    program = problems.polyline([[0, 0], [40, 0], [40.5, 0.1], [41, 0.3], [41.4, 0.6], [60, 30]])
    toolpath = toolpath_from_program(program, machine)
    rounded = round_corners(toolpath, machine, BezierCorner(), blend_tangents=True)
    path = with_spline(rounded, spline_shape(rounded, machine))
    samples = sample_path(path, machine, 1e-2)
    span = samples.element - len(samples.table.legs)
    straight = (samples.element >= 0) & (span < 0)
    assert (span >= 0).any()
    assert straight.any()
    left = remaining_budget(samples)
    np.testing.assert_array_equal(left[span >= 0], path.spline.budget[span[span >= 0]])
    assert left[span >= 0].max() < machine.tolerance
    assert left[straight] == pytest.approx(machine.tolerance)
    alone = span == 0
    kept = {name: getattr(samples, name)[alone] for name in ("element", "segment")}
    of_one = remaining_budget(SimpleNamespace(path=path, table=samples.table, **kept))
    np.testing.assert_array_equal(of_one, path.spline.budget[0], "a curve that is one element")


def test_the_normal_acceleration_of_a_circle_is_told_as_it_is():
    """v^2/R across the motion, whatever it has along it."""
    radius, speed, along, most = 5.0, 40.0, 700.0, 250.0
    t = np.linspace(0.0, 0.3, 50)
    c, s, nothing = np.cos(t), np.sin(t), 0 * t
    velocity = speed * np.stack([-s, c, nothing], axis=1)
    motion = trajectory_of(t, radius * np.stack([c, s, nothing], axis=1), velocity)
    acceleration = along * velocity / speed - speed**2 / radius * np.stack([c, s, nothing], axis=1)
    motion = dataclasses.replace(motion, acceleration=acceleration)
    machine = problems.machine().model_copy(update={"normal_acceleration": most})
    ((order, ratio),) = limits_used.ratios(Limits.of(machine, motion.axes), motion)
    assert order == 2
    assert ratio == pytest.approx(speed**2 / radius / most, rel=1e-9)


def test_every_point_has_the_intervals_of_its_own_piece_beside_it():
    """Interval k is that from point k to point k + 1; none reaches from one piece to the next."""
    program = parse_program("G21 G61.1 F6000\nG1 X10\nG1 Y10\nG1 X0\n")
    samples = grid_of(program, problems.machine()).samples
    pieces = list(zip(samples.piece[:-1], samples.piece[1:], strict=True))
    assert len(pieces) == 3
    left, right = interval_sides(samples)
    for begin, end in pieces:
        intervals = np.arange(begin, end - 1)
        assert left[begin:end].tolist() == [begin, *intervals]
        assert right[begin:end].tolist() == [*intervals, end - 2]


def test_caps_from_curvatures_leave_their_margin():
    """For what the curvatures of points miss between them."""
    grid = grid_of(parse_program("G21 G17 F60000\nG3 X0 Y0 I-10 J0\n"), problems.machine())
    (chord,) = (limit for limit in LIMITS if limit.name == "chord_error")
    caps = [cap.feed_sq for side in grid.sides() for cap in chord.on_side(side, grid.machine)]
    expected = (1.0 - CURVATURE_MARGIN) * np.min(caps, axis=0)
    np.testing.assert_allclose(bounds_of(grid.samples, grid.machine, [chord]), expected, rtol=1e-12)
