"""Splines inside the tolerance: certified against brute force, smooth, and with the laws of a geometry that users can rely on."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_polylines import random_polyline

from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.geometry.build import toolpath_from_program
from planner.geometry.spline import DEGREE, span_point
from planner.geometry.toolpath import Joint
from planner.nc.reader import parse_program, read_program
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal.geometry import splined_with_stops
from planner.smoothing import initial as lay
from planner.smoothing import spline_path
from planner.smoothing.initial import greville_control
from planner.smoothing.relax import REACH, WIDER, ControlWindow, Relaxed, relax, tighten_window
from planner.smoothing.sites import site_distance, used_share, with_radius
from planner.smoothing.spline_path import cusp_spans, lost_joints, spline_shape, with_spline

MACHINE = problems.machine()
seeds = st.integers(0, 10**6)
AS_IT_IS = OptimalMethod(corner="spline")


def splined(program, machine=MACHINE, tolerance=None):
    toolpath = toolpath_from_program(program, machine, tolerance)
    path = round_corners(toolpath, machine, BezierCorner(), blend_tangents=True)
    shape = spline_shape(path, machine)
    return with_spline(path, shape), shape


def frechet(curve, vertices):
    """Discrete Frechet distance between two finely sampled curves."""
    distance = np.linalg.norm(curve[:, None] - vertices[None], axis=2)
    reach = np.full(distance.shape[1], np.inf)
    for i, row in enumerate(distance):
        before = reach.copy()
        for j in range(len(row)):
            best = before[j] if i else np.inf
            if j:
                best = min(best, reach[j - 1], before[j - 1] if i else np.inf)
            elif i == 0:
                best = 0.0
            reach[j] = max(row[j], best)
    return reach[-1]


@pytest.mark.shows("splines", "certified: deviation of the splines, against brute force")
@pytest.mark.slow
@given(seeds)
@settings(max_examples=15)
def test_certificate_holds_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    points = random_polyline(rng, 4, shortest=-1.0)
    path, shape = splined(problems.polyline(points))
    assert shape.splines.fits.all()
    out = np.empty((4, len(path.toolpath.axes)))
    for q in range(len(path.spline)):
        curve = []
        for i in range(path.spline.first[q], path.spline.first[q + 1]):
            for tau in np.linspace(0.0, 1.0, 12, endpoint=False):
                span_point(path.spline.spans, i, tau, out)
                curve.append(out[0].copy())
        a, b = shape.corridor.first[q], shape.corridor.first[q + 1]
        chain = shape.corridor.point[a:b]
        fine = np.vstack([np.linspace(p, r, 60, endpoint=False) for p, r in itertools.pairwise(chain)])
        fine = np.vstack([fine, chain[-1:]])
        step = max(np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in (np.array(curve), fine))
        assert frechet(np.array(curve), fine) <= MACHINE.tolerance - path.spline.budget.min() + step


@given(seeds)
@settings(max_examples=15)
def test_pieces_of_a_run_join_with_four_derivatives(seed):
    path, _shape = splined(problems.polyline(random_polyline(np.random.default_rng(seed), 6)))
    spans = path.spline.spans
    factorial = np.array([1.0, 1.0, 2.0, 6.0, 24.0, 120.0])
    for q in range(len(path.spline)):
        for i in range(path.spline.first[q], path.spline.first[q + 1] - 1):
            left, right = spans[i], spans[i + 1]
            for order in range(DEGREE):
                m = np.arange(order, DEGREE + 1)
                at_end = (factorial[m] / factorial[m - order]) @ left["coef"][m] / left["width"] ** order
                at_start = factorial[order] * right["coef"][order] / right["width"] ** order
                size = (
                    (factorial[m] / factorial[m - order]) @ np.abs(left["coef"][m]) / left["width"] ** order
                )
                rounding = 1e-11 / min(left["width"], right["width"]) ** order  # of positions of some 10 mm
                np.testing.assert_allclose(at_end, at_start, atol=1e-9 * size.max() + rounding)


def test_long_straight_legs_stay_straight_and_join_smoothly():
    program = parse_program("G21 G90 F6000\nG1 X100\nY100\nX200\nM2\n")
    path, _shape = splined(program)
    assert len(path.spline) == 2
    free = path.legs.length - path.d_out[:-1] - path.d_in[1:]
    assert (free > 50.0).all()
    for q in range(2):
        begin, end = path.spline.spans[path.spline.first[q]], path.spline.spans[path.spline.first[q + 1] - 1]
        np.testing.assert_allclose(
            begin["coef"][2:5], 0.0, atol=1e-9
        )  # straight, at constant parameter speed
        at_end = np.array([[0, 0, 2, 6, 12, 20], [0, 0, 0, 6, 24, 60], [0, 0, 0, 0, 24, 120]]) @ end["coef"]
        np.testing.assert_allclose(at_end, 0.0, atol=1e-8)
        np.testing.assert_allclose(np.linalg.norm(begin["coef"][1]), begin["width"], rtol=1e-9)


def test_full_stops_are_kept():
    program = parse_program("G21 G90 F6000\nG64\nG1 X1\nX2 Y1\nG4 P0.1\nX3 Y0\nX4 Y1\nX3 Y0\nM2\n")
    path, _shape = splined(program)
    stops = np.flatnonzero(path.joint == Joint.STOP)
    assert len(stops) == 4  # both ends, the dwell, the reversal
    for first, last in zip(path.spline.joint_first, path.spline.joint_last, strict=True):
        assert not ((stops >= first) & (stops <= last)).any()
    plan = AS_IT_IS.plan(program, MACHINE)
    assert plan.verdict.passed, plan.verdict.faults


def circle_of_chords(chords, radius=10.0):
    angle = np.linspace(0.0, 2.0 * np.pi, chords + 1)
    return problems.polyline(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def test_a_circle_of_chords_gives_back_the_circle():
    """Away from the ends the curvature is that of a circle inside the tolerance."""
    path, _ = splined(circle_of_chords(360))
    out = np.empty((4, len(path.toolpath.axes)))
    middle = range(len(path.spline.spans) // 4, 3 * len(path.spline.spans) // 4)
    for i in middle:
        span_point(path.spline.spans, i, 0.5, out)
        curvature = abs(out[1, 0] * out[2, 1] - out[1, 1] * out[2, 0]) / np.linalg.norm(out[1]) ** 3
        assert 1.0 / curvature == pytest.approx(10.0, rel=0.02)
        assert np.linalg.norm(out[0]) == pytest.approx(10.0, abs=0.05)


@pytest.mark.parametrize("before", [1, 40])  # blocks on one straight leg
def test_a_cusp_is_found_at_the_joint_that_turns_there(before):
    step = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    corners = np.vstack([np.zeros(2), np.cumsum([step * [1, (-1) ** k] for k in range(50)], axis=0)])
    straight = np.linspace([-5.0, 0.0], [0.0, 0.0], before + 1)[:-1]
    toolpath = toolpath_from_program(problems.polyline(np.vstack([straight, corners])), MACHINE, None)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    shape = spline_shape(path, MACHINE)
    assert not shape.cusp.any()
    assert not len(lost_joints(path, shape))
    # six control points in one place: the curve stands still on the span between them
    span = len(shape.left) // 2
    control = shape.splines.control.copy()
    control[span : span + DEGREE + 1] = control[span]
    splines = shape.splines._replace(control=control)
    assert cusp_spans(splines)[span]
    none = splines._replace(fits=np.zeros(1, bool))
    lost = dataclasses.replace(shape, splines=none, cusp=cusp_spans(splines))
    joints = lost_joints(path, lost)
    place = path.legs.place[joints]
    begin, end = splines.breaks[span], splines.breaks[span + 1]
    near = np.abs(path.legs.place - (begin + end) / 2).min()
    assert len(joints)
    assert np.abs(place - (begin + end) / 2).min() <= max(near, 2.0 * (end - begin))


@pytest.mark.slow
def test_stops_at_cusps_keep_the_splines_around_them(shared_dir):
    """A plotter's drawing with five loops smaller than the tolerance."""
    program = read_program(shared_dir / "nc" / "aiten__CNCLib__hedgehog.hpgl", MACHINE)
    toolpath = toolpath_from_program(program, MACHINE, None)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    before = spline_shape(path, MACHINE)
    assert len(lost_joints(path, before))
    after, shape = splined_with_stops(path, MACHINE, blend_tangents=True)
    assert shape.splines.fits.all()
    assert (after.joint == Joint.STOP).sum() > (path.joint == Joint.STOP).sum()


@pytest.mark.parametrize("stops", [[20], [1, 2], [12, 25, 40], [30, 31, 59]])
def test_splines_of_runs_that_a_stop_leaves_as_they_are_are_those_of_all_runs_again(stops):
    """To the last bit, whichever runs stay: all but those around new stops."""
    path = one_run()

    def stopped(at):
        of_stops = path.toolpath.with_joints(path.legs.first[np.array(at)], Joint.STOP)
        return round_corners(of_stops, MACHINE, path.corner, blend_tangents=True)

    before = spline_shape(stopped([15, 30, 45]), MACHINE)
    new = stopped(sorted({15, 30, 45, *stops}))
    shape, again = spline_shape(new, MACHINE, before), spline_shape(new, MACHINE)
    assert len(shape.splines.fits) >= len(before.splines.fits)
    for name in ("left", "cusp"):
        np.testing.assert_array_equal(getattr(shape, name), getattr(again, name))
    for mine, other in ((shape.splines, again.splines), (shape.splines.sites, again.splines.sites)):
        for a, b in zip(mine, other, strict=True):
            if isinstance(a, np.ndarray):
                np.testing.assert_array_equal(a, b)


def used_of_corridor(shape):
    """(J,) share of its radius that each site of the first spline uses."""
    assert len(shape.splines.fits) == 1
    return used_share(shape.splines.sites, shape.splines.control)


def one_run():
    """Sixty steps of 0.4 mm, each to the other side by up to 40 degrees."""
    angle = np.deg2rad(np.random.default_rng(8).uniform(10.0, 40.0, 60)) * np.where(np.arange(60) % 2, 1, -1)
    points = np.cumsum(0.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    toolpath = toolpath_from_program(problems.polyline(points), MACHINE, None)
    return round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)


@pytest.fixture
def loose_knots(monkeypatch):
    """No knots are added, so that first splines use more of the tolerance than `ROOM`."""
    kernel = "_lay_run"
    monkeypatch.setattr(lay, kernel, getattr(lay, kernel).py_func)
    monkeypatch.setattr(lay, "DENSER_MAX", 0)
    monkeypatch.setattr(lay, "ROOM", 0.3)

    def certain(corridor, splines, runs, goal):  # as if all had certificates
        return Relaxed(splines.fits, splines.control, np.full(splines.span_first[-1], np.inf))

    monkeypatch.setattr(spline_path, "relax", certain)
    return monkeypatch


def test_a_first_spline_inside_the_corridor_is_one_however_much_room_it_should_have_left(loose_knots):
    path = one_run()
    first = used_of_corridor(spline_shape(path, MACHINE))
    assert lay.ROOM < first.max() < lay.INSIDE
    loose_knots.setattr(spline_path, "relax", relax)
    shape = spline_shape(path, MACHINE)
    assert shape.splines.fits.all()
    assert (shape.left >= 0.0).all()


def test_a_place_outside_of_the_corridor_costs_a_full_stop_there_and_nothing_else(loose_knots):
    path = one_run()
    first = spline_shape(path, MACHINE)
    used = used_of_corridor(first)
    loose_knots.setattr(lay, "INSIDE", np.sort(used)[-2])  # all but the worst site are inside
    whole = spline_shape(path, MACHINE)
    assert not whole.splines.fits.any()
    place = first.splines.sites.place[np.argmax(used)]
    joints = lost_joints(path, whole)
    assert len(joints) == 1
    assert np.abs(path.legs.place[joints] - place).max() < 1.0
    after, shape = splined_with_stops(path, MACHINE, blend_tangents=True)
    stops = np.flatnonzero((after.joint == Joint.STOP) & (path.joint != Joint.STOP))
    assert 1 <= len(stops) <= 6
    corners = shape.runs.joint_last - shape.runs.joint_first + 1
    assert corners[shape.splines.fits].sum() >= 0.8 * len(path.d)


def test_a_place_that_never_gets_a_certificate_loses_its_own_corners_only(monkeypatch):
    path = one_run()
    place = 0.5 * path.legs.place[-1]

    def no_certificate(corridor, splines, *given):
        relaxed = relax(corridor, splines, *given)
        certified, left, first = relaxed.certified.copy(), relaxed.left.copy(), splines.span_first
        for q in range(len(certified)):
            own = splines.breaks[first[q] + q : first[q + 1] + q + 1]
            if own[0] + 0.1 < place < own[-1] - 0.1:
                certified[q] = False
                left[first[q] + np.searchsorted(own, place) - 1] = -1.0
        return relaxed._replace(certified=certified, left=left)

    monkeypatch.setattr(spline_path, "relax", no_certificate)
    after, shape = splined_with_stops(path, MACHINE, blend_tangents=True)
    corners = shape.runs.joint_last - shape.runs.joint_first + 1
    assert corners[~shape.splines.fits].sum() <= 8
    assert corners[shape.splines.fits].sum() >= 0.75 * len(path.d)
    assert (after.joint == Joint.STOP).sum() <= 12


def test_feed_changes_on_a_straight_leg_keep_their_place():
    """A spline may slide along a straight leg by many tolerances, but not past a change of the feed."""
    program = parse_program("G21 G90\nG1 X1 Z-0.7 F300\nX1.3 Z-7 F150\nX1.6\nX4.3 F300\nX4.6 Z-6.9\nM2\n")
    path, shape = splined(program)
    change = np.flatnonzero(path.legs.offset > 0.0)
    assert len(change) == 1
    assert np.isclose(shape.corridor.place, path.legs.place[change[0]]).any()
    plan = AS_IT_IS.plan(program, MACHINE)
    assert plan.verdict.passed, plan.verdict.faults


def test_tightening_leaves_every_site_inside_and_widens_those_that_the_taper_pushes_out():
    _, shape = splined(problems.zigzag())
    sites, control = shape.splines.sites, shape.splines.control.copy()
    middle = greville_control(shape.corridor, shape.splines.breaks)
    e = np.empty(control.shape[1])

    def distances():
        return np.array([site_distance(sites, j, control, 0, e) for j in range(len(sites.span))])

    given = np.maximum(
        1.0005 * distances(), 0.5 * shape.splines.sites.radius
    )  # sites at their radii, as after an optimum
    used, ratio = given.copy(), np.ones(len(given))
    worst = int(np.argmax(distances() / given))
    ratio[worst] = 1.01
    lo = max(sites.span[worst] - REACH.overlap, 0)
    hi = min(sites.span[worst] + REACH.overlap + DEGREE + 1, len(control))
    first, last = np.searchsorted(sites.span, [lo - DEGREE, hi])
    window = ControlWindow(lo, hi, first, last)
    control[lo:hi], used[first:last] = tighten_window(
        window, with_radius(sites, given), control, middle, ratio, REACH.overlap
    )
    assert (distances() < used).all()
    wider = used > given
    np.testing.assert_allclose(used[wider], WIDER * distances()[wider])
    assert wider.sum() <= 1
    assert used[worst] < 0.995 * given[worst]
