"""The proof of a corner's error bound, for every shape, on lines and on arcs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from whole_plans import evaluate_corner, smooth_path

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.bezier import BezierCorner
from planner.corners.blend import BEND_MAX, error_from_middle, middle_from_tolerance, shape_at
from planner.corners.elements import element_table
from planner.corners.fir import FirCorner
from planner.geometry.legs import leg_point
from planner.geometry.toolpath import Joint
from planner.nc.program import Program
from planner.nc.reader import parse_program

MACHINE = problems.machine()


def shape_values(shape, params: FloatArray, w: FloatArray, scale=(1.0, 1.0)) -> tuple[FloatArray, FloatArray]:
    from planner.corners.blend import CORNER_DTYPE

    record = np.zeros(1, CORNER_DTYPE)
    record["shape"], record["params"], record["scale"] = int(shape.shape), params, scale
    both = [shape_at(record[0], x, x) for x in w]
    return np.array([b[0][0] for b in both]), np.array([b[1][0] for b in both])


def assert_product_bound(shape, d: float) -> None:
    w = np.linspace(0, 1, 801)
    reach = np.array([d])
    X, Y = shape_values(shape, shape.params(reach, np.array([100.0]))[0], w)
    m = shape.middle(reach, np.array([100.0]))[0]
    assert X[400] == pytest.approx(m, rel=1e-9)
    assert Y[400] == pytest.approx(m, rel=1e-9)
    assert (X * Y).max() <= m**2 * (1 + 1e-9)
    assert (np.diff(X) <= 1e-15 * d).all()
    assert (np.diff(Y) >= -1e-15 * d).all()
    assert (X + Y).max() <= d * (1 + 1e-12)  # what the bound of the bend (BEND_MAX) rests on


@given(sigma2=st.floats(0.7501, 1.5), d=st.floats(1e-3, 10.0))
@settings(max_examples=30)
def test_retreat_times_advance_is_largest_in_the_middle_of_the_pair(sigma2, d):
    assert_product_bound(BezierCorner(sigma2=sigma2), d)


@given(T1=st.floats(1e-3, 0.2), ratio=st.floats(0.01, 1.0), share=st.floats(1e-4, 1.0))
@settings(max_examples=30)
def test_retreat_times_advance_is_largest_in_the_middle_of_the_fir_corner(T1, ratio, share):
    T2 = T1 * ratio
    shape = FirCorner(T1=T1, T2=T2, feed_max=100.0)
    assert_product_bound(shape, 100.0 * (T1 + T2) / 2 * share)


@pytest.mark.shows("corner-bezier", "certified: the error's bound for every accepted pair")
def test_the_product_bound_holds_for_every_accepted_pair():
    assert_product_bound(BezierCorner(sigma2=1.5), 1.0)
    with pytest.raises(InputError, match="sigma2 = 2"):
        BezierCorner(sigma2=2.0)


def test_the_product_bound_holds_for_every_accepted_sigma1():
    assert_product_bound(BezierCorner(sigma1=3.0, sigma2=1.0), 1.0)
    assert_product_bound(BezierCorner(sigma1=2.0, sigma2=1.5), 1.0)
    with pytest.raises(InputError, match=r"sigma1 = 20\.0"):
        BezierCorner(sigma1=20.0, sigma2=1.0)


@given(
    eps=st.floats(1e-6, 1.0), half=st.floats(1e-9, np.pi / 2), curvature=st.floats(0.0, 1e3)
)  # fmt: skip
def test_the_middle_uses_the_whole_tolerance(eps, half, curvature):
    s, k = np.array([np.sin(half)]), np.array([curvature])
    m = middle_from_tolerance(np.array([eps]), s, k)
    assert error_from_middle(m, s, k)[0] == pytest.approx(eps, rel=1e-9)


def test_what_does_not_bend_may_be_as_long_as_it_likes():
    assert np.isinf(middle_from_tolerance(np.array([0.1]), np.zeros(1), np.zeros(1))[0])


ARC_JOBS = {
    "line-arc sharp": "G1 X10\nG3 X10 Y10 I-3 J5",
    "arc-line sharp": "G2 X10 Y0 I5 J2\nG1 X15 Y-8",
    "arc-arc sharp": "G3 X4 Y4 I0 J4\nG3 X8 Y4 I2 J2",
    "arc-arc obtuse": "G3 X8 Y0 I4 J0\nG2 X8 Y8 I4 J4",
    "helix-line": "G3 X8 Y0 Z5 I4 J0\nG1 X18 Y4 Z6",
    "helix-arc": "G2 X8 Y0 Z-3 I4 J0\nG18\nG3 X14 Z-3 I3 K0",
    "tight arcs": "G3 X0.2 Y0.2 I0 J0.2\nG3 X0.4 Y0.2 I0.1 J0.1",
    "nearly tangent": "G1 X10\nG3 X20.001 Y10.002 I0.002 J10\nG1 X20.05 Y30",
    "corner bigger than its arcs": "G1 X5\nG2 X5.06 Y0 I0.03 J0\nG1 X9 Y3",
}


@pytest.mark.shows("corner-bezier, corner-fir", "certified: the error's bound on arcs, in order")
@pytest.mark.parametrize("name", ARC_JOBS)
@pytest.mark.parametrize("kind", ["bezier", "fir"])
def test_a_corner_on_arcs_stays_within_its_bound_in_order(name, kind):
    program = parse_program("G21 G17 G90 F6000\n" + ARC_JOBS[name], source=name)
    path = smooth_path(program, MACHINE, kind)
    assert (path.joint == Joint.CORNER).any()
    legs = element_table(path).legs
    for k in np.flatnonzero(path.joint == Joint.CORNER):
        w = np.linspace(0, 1, 401)
        found = evaluate_corner(path.toolpath, k, path.corner, path.params[k], w, scale=path.scale[k])
        X, Y = shape_values(path.corner, path.params[k], w, path.scale[k])
        along = Y - X
        assert (np.diff(along) >= -1e-12).all()  # the matching runs forward
        programmed = np.empty((len(w), 3))
        at = np.empty((4, 3))
        for i, z in enumerate(along):
            leg_point(legs, k - 1 if z < 0 else k, legs[k - 1]["length"] + z if z < 0 else z, at)
            programmed[i] = at[0]
        matched = np.linalg.norm(found.by_w[:, 0] - programmed, axis=1)
        assert matched.max() <= path.tol_ap[k] * (1 + 1e-9)
        assert frechet(found.by_w[::4, 0], programmed[::4]) <= matched.max() * (1 + 1e-12)
        assert path.tol_ap[k] <= path.tol[k]
        assert_joins_with_curvature(found, legs, k, path.d_in[k], path.d_out[k])


def frechet(one: FloatArray, other: FloatArray) -> float:
    """Discrete Frechet distance of two polylines."""
    gap = np.linalg.norm(one[:, None] - other[None], axis=2)
    reach = np.full_like(gap, np.inf)
    for i in range(len(one)):
        for j in range(len(other)):
            before = min(
                reach[i - 1, j] if i else np.inf,
                reach[i, j - 1] if j else np.inf,
                reach[i - 1, j - 1] if i and j else np.inf,
            )
            reach[i, j] = max(gap[i, j], before if i or j else 0.0)
    return float(reach[-1, -1])


def assert_joins_with_curvature(found, legs, k: int, d_in: float, d_out: float) -> None:
    """At w = 0 and w = 1 the corner has the leg's point, tangent and curvature vector."""
    at = np.empty((4, 3))
    for i, leg, x in ((0, k - 1, legs[k - 1]["length"] - d_in), (-1, k, d_out)):
        leg_point(legs, leg, x, at)
        speed = np.linalg.norm(at[1])
        tangent = at[1] / speed
        bend = (at[2] - tangent * (tangent @ at[2])) / speed**2
        np.testing.assert_allclose(found.by_s[i, 0], at[0], atol=1e-12)
        np.testing.assert_allclose(found.by_s[i, 1], tangent, atol=1e-12)
        np.testing.assert_allclose(found.by_s[i, 2], bend, atol=1e-6 * max(1.0, np.linalg.norm(bend)))


@given(
    theta=st.floats(0.0, 174.9), radii=st.tuples(st.floats(0.05, 50.0), st.floats(0.05, 50.0)),
    turns=st.tuples(st.sampled_from([-1, 1]), st.sampled_from([-1, 1])), rise=st.floats(0.0, 3.0),
    sweep=st.floats(0.2, 6.0),
)  # fmt: skip
@settings(max_examples=30)
def test_random_arc_corners_are_regular_and_within_tolerance(theta, radii, turns, rise, sweep):
    program = arc_pair(np.deg2rad(theta), radii, turns, rise, sweep)
    path = smooth_path(program, MACHINE)
    if path.joint[1] != Joint.CORNER:
        return
    w = np.linspace(0, 1, 201)
    found = evaluate_corner(path.toolpath, 1, path.corner, path.params[1], w, scale=path.scale[1])
    X, Y = shape_values(path.corner, path.params[1], w, path.scale[1])
    bound = path.d[1] * np.cos(
        BEND_MAX / 2
    )  # |B'| >= (|X'| + |Y'|) cos(bend/2), and |X'| + |Y'| >= 0.4 d on the pair
    assert np.linalg.norm(found.by_w[:, 1], axis=1).min() >= 0.4 * bound
    legs = element_table(path).legs
    at = np.empty((4, 3))
    for i, z in enumerate(Y - X):
        leg_point(legs, 0 if z < 0 else 1, legs[0]["length"] + z if z < 0 else z, at)
        assert np.linalg.norm(found.by_w[i, 0] - at[0]) <= path.tol_ap[1] * (1 + 1e-9) + 1e-12


def arc_pair(theta: float, radii, turns, rise: float, sweep: float) -> Program:
    """Two helical arcs that meet at the origin with a turn of theta in the plane."""
    from planner.nc.program import Kind

    one, two = turns
    # arc 1 ends at the origin with tangent +x, arc 2 starts there with tangent turned by theta
    centre1 = np.array([0.0, one * radii[0]])
    back = -one * sweep
    start = centre1 + rotate(np.array([0.0, -one * radii[0]]), back)
    normal2 = rotate(np.array([0.0, 1.0]), theta)
    centre2 = two * radii[1] * normal2
    end = centre2 + rotate(-centre2, two * sweep)
    return Program(
        source="two arcs", axes=("x", "y", "z"), start=np.array([*start, 0.0]), kind=[Kind.ARC, Kind.ARC],
        end=np.array([[0.0, 0.0, rise], [*end, 2 * rise]]), feed=[100.0, 100.0], dwell=[0.0, 0.0], line=[1, 2],
        path_control=[0, 0], tolerance=[np.nan, np.nan], arc_block=[0, 1],
        arc_center=np.array([[*centre1, 0.0], [*centre2, rise]]), arc_normal=[2, 2], arc_sweep=[one * sweep, two * sweep],
    )  # fmt: skip


def rotate(v: FloatArray, angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])
