"""The corner as a curve: Bezier pair against its control points, errors, curvature, continuity, and the proof for arcs.

Each law is written so that the misprints of the papers break it: cos instead of sin in eq. (16), the interior angle in
eq. (14)/(15), the missing factor of eq. (7), G3 from "mirrored weights" alone (eq. (14)).
"""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from whole_plans import evaluate_corner, smooth_path

from benchmarks import problems
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.bezier import BezierCorner, kappa_max
from planner.corners.blend import BEND_MAX, error_from_middle, middle_from_tolerance, shape_at
from planner.corners.elements import element_table
from planner.corners.fir import FirCorner
from planner.geometry.build import toolpath_from_program
from planner.geometry.legs import leg_point
from planner.geometry.toolpath import Joint
from planner.nc.program import Program
from planner.nc.reader import parse_program

DEFAULT, POLYNOMIAL = BezierCorner(), BezierCorner(sigma2=1.0)
# docs/papers.md C.G3: the angles for which the default weights were compared with the polynomial pair [deg].
ANGLES_14 = (2, 5, 10, 15, 30, 45, 60, 75, 90, 105, 120, 135, 150, 175)
MACHINE = problems.machine()

thetas = st.floats(0.01, 179.9).map(np.deg2rad)
sigmas = st.floats(0.76, 1.5)


def two_legs(theta: float, length: float = 10.0) -> Program:
    """Leg 0 along x to the vertex at the origin, leg 1 turned by theta in a tilted plane."""
    normal = np.array([0.0, 0.6, 0.8])
    return problems.polyline(
        [
            [-length, 0, 0],
            [0, 0, 0],
            length * (np.cos(theta) * np.array([1.0, 0, 0]) + np.sin(theta) * normal),
        ]
    )


def corner(theta: float, shape: BezierCorner, d: float, w: FloatArray, side: FloatArray | None = None):
    toolpath = toolpath_from_program(two_legs(theta), MACHINE)
    params = shape.params(np.array([d]), np.array([100.0]))[0]
    return evaluate_corner(toolpath, 1, shape, params, w, side), toolpath


def planar_curvature(by_s: FloatArray, toolpath) -> tuple[FloatArray, FloatArray]:
    """Signed curvature and its slope along s from arc-length derivatives: kappa = r''.N, kappa' = r'''.N, N = n x T."""
    u1, u2 = toolpath.tangent_end[0], toolpath.tangent_start[1]
    plane = np.cross(u1, u2) / np.linalg.norm(np.cross(u1, u2))
    normal = np.cross(plane, by_s[:, 1])
    return (by_s[:, 2] * normal).sum(axis=1), (by_s[:, 3] * normal).sum(axis=1)


# --- the Bezier pair ------------------------------------------------------------------------------------------------------


def rational_cubic(points: list[FloatArray], weights: list[float], t: FloatArray) -> FloatArray:
    basis = np.stack([comb(3, k) * t**k * (1 - t) ** (3 - k) * weights[k] for k in range(4)], axis=1)
    return basis @ np.array(points) / basis.sum(axis=1, keepdims=True)


@given(theta=thetas, sigma1=st.floats(0.1, 2.0), sigma2=sigmas, d=st.floats(1e-3, 5.0))
@settings(max_examples=40)
def test_the_pair_is_what_its_control_points_and_weights_say(theta, sigma1, sigma2, d):
    toolpath = toolpath_from_program(two_legs(theta), MACHINE)
    P, u1, u2 = toolpath.start[1], toolpath.tangent_end[0], toolpath.tangent_start[1]
    # w0 = w3 = 1 and eq. (2), (3): sigma1 = w0 w2/w1^2, sigma2 = w1 w3/w2^2
    w1 = 1.0
    for _ in range(200):  # w2 = sigma1 w1^2 and w1 = sigma2 w2^2, solved in logarithms
        w1 = np.exp((np.log(w1) + -(2 * np.log(sigma1) + np.log(sigma2)) / 3) / 2)
    w2 = sigma1 * w1**2
    assert w1 / w2**2 == pytest.approx(sigma2, rel=1e-9)
    joint = P + d / 8 * (u2 - u1)
    t = np.linspace(0, 1, 21)
    first = rational_cubic([P - d * u1, P - d / 2 * u1, P - d / 4 * u1, joint], [1, w1, w2, 1], t)
    second = rational_cubic([joint, P + d / 4 * u2, P + d / 2 * u2, P + d * u2], [1, w2, w1, 1], t)
    shape = BezierCorner(sigma1=sigma1, sigma2=sigma2)
    params = shape.params(np.array([d]), np.array([1.0]))[0]
    whole = evaluate_corner(toolpath, 1, shape, params, np.concatenate([t / 2, 0.5 + t / 2])).by_w[:, 0]
    np.testing.assert_allclose(whole, np.concatenate([first, second]), atol=2e-14 + 1e-13 * d)


@given(theta=thetas, sigma2=sigmas, eps=st.floats(1e-4, 0.1))
@settings(max_examples=40)
def test_the_vertex_error_is_the_tolerance_and_the_contour_error_its_cosine_share(theta, sigma2, eps):
    shape = BezierCorner(sigma2=sigma2)
    half = theta / 2
    middle = middle_from_tolerance(np.array([eps]), np.array([np.sin(half)]), np.array([0.0]))
    d = shape.reach(middle, np.array([1.0]))[0]
    assert d == pytest.approx(
        4 * eps / np.sin(half), rel=1e-12
    )  # eq. (15); eq. (16) prints 4 eps cos(theta/2)
    length = 2 * d
    toolpath = toolpath_from_program(two_legs(theta, length), MACHINE)
    params = shape.params(np.array([d]), np.array([1.0]))[0]
    points = evaluate_corner(toolpath, 1, shape, params, np.linspace(0, 1, 201)).by_w[:, 0]
    from_vertex = np.linalg.norm(points - toolpath.start[1], axis=1)
    assert from_vertex.argmin() == 100
    assert from_vertex[100] == pytest.approx(eps, rel=1e-9)
    from_legs = np.min([ray_distance(points, toolpath.start[1], u)
                        for u in (-toolpath.tangent_end[0], toolpath.tangent_start[1])], axis=0)  # fmt: skip
    assert from_legs.max() == pytest.approx(eps * np.cos(half), rel=1e-6, abs=1e-12)
    assert from_legs.argmax() == 100 or from_legs[100] == pytest.approx(from_legs.max(), rel=1e-6, abs=1e-12)


def ray_distance(points: FloatArray, start: FloatArray, direction: FloatArray) -> FloatArray:
    along = np.maximum((points - start) @ direction, 0.0)
    return np.linalg.norm(points - start - along[:, None] * direction, axis=1)


@pytest.mark.parametrize("theta_deg", [30.0, 90.0, 150.0])
def test_the_planned_corner_uses_exactly_its_share_of_the_tolerance(theta_deg):
    """Eq. (16) as printed would use half of it at 90 degrees; the interior angle would use 3.7 times as much at 150."""
    theta = np.deg2rad(theta_deg)
    for name in ("bezier", "fir"):
        path = smooth_path(two_legs(theta, 50.0), MACHINE, name)
        apex = evaluate_corner(path.toolpath, 1, path.corner, path.params[1], np.array([0.5]))
        met = np.linalg.norm(apex.by_w[0, 0] - apex.vertex)
        if name == "bezier" or met < path.tol_ap[1] * (
            1 - 1e-9
        ):  # the FIR corner stops growing at a full overlap
            assert path.d[1] < 25.0
        assert met == pytest.approx(path.tol_ap[1], rel=1e-9)
        share = MACHINE.tolerance - MACHINE.dt**2 / 8 * reachable(theta)
        assert path.tol_ap[1] <= share * (1 + 1e-12)
        assert path.tol_ap[1] == pytest.approx(
            share, rel=3e-4
        )  # a little is kept for closing legs (smooth.CLOSE)


def reachable(theta: float) -> float:
    """Axis limits (2000 each) projected on the bisector of `two_legs`."""
    u1, u2 = np.array([1.0, 0, 0]), np.array([np.cos(theta), 0.6 * np.sin(theta), 0.8 * np.sin(theta)])
    return 2000.0 * np.abs(u2 - u1).sum() / np.linalg.norm(u2 - u1)


@given(theta=thetas, sigma2=st.floats(0.83, 1.5), d=st.floats(1e-3, 5.0))
@settings(max_examples=40)
def test_curvature_is_largest_at_the_joint_and_is_equation_17(theta, sigma2, d):
    shape = BezierCorner(sigma2=sigma2)
    found, toolpath = corner(theta, shape, d, np.linspace(0, 1, 401))
    kappa, _ = planar_curvature(found.by_s, toolpath)
    expected = sigma2 * 8 * np.sin(theta / 2) / (3 * d * np.cos(theta / 2) ** 2)
    assert kappa[200] == pytest.approx(expected, rel=1e-6)
    assert kappa_max(d, theta, sigma2) == pytest.approx(expected, rel=1e-12)
    assert kappa.max() <= expected * (1 + 1e-6)


def test_close_to_three_quarters_the_maximum_leaves_the_joint():
    """Below sigma2 = 0.82 shallow corners bend up to 0.3 % more beside the joint: the reason to stay above."""
    found, toolpath = corner(np.deg2rad(1.0), BezierCorner(sigma2=0.76), 1.0, np.linspace(0, 1, 1001))
    kappa, _ = planar_curvature(found.by_s, toolpath)
    assert kappa.max() / kappa[500] == pytest.approx(1.00284, abs=1e-4)


@pytest.mark.parametrize("theta_deg", ANGLES_14)
def test_the_default_weights_beat_the_polynomial_pair_in_curvature_and_its_slope(theta_deg):
    w = np.linspace(0, 1, 2001)
    peaks = []
    for shape in (DEFAULT, POLYNOMIAL):
        found, toolpath = corner(np.deg2rad(theta_deg), shape, 1.0, w)
        kappa, slope = planar_curvature(found.by_s, toolpath)
        peaks.append((kappa.max(), np.abs(slope).max()))
    assert peaks[0][0] == pytest.approx(0.9 * peaks[1][0], rel=1e-6)
    assert peaks[0][1] < peaks[1][1]


@given(theta=st.floats(1.0, 175.0).map(np.deg2rad), sigma2=sigmas, off=st.sampled_from([0.0, -0.2, 0.3]))
@settings(max_examples=40)
def test_the_joint_is_g3_exactly_for_the_right_pair_of_weights(theta, sigma2, off):
    sigma1 = (4 - 3 / sigma2) * (1 + off)
    assume(sigma1 * sigma2 <= 3.0)  # others are refused
    shape = BezierCorner(sigma1=sigma1, sigma2=sigma2)
    joint, toolpath = corner(theta, shape, 1.0, np.array([0.5, 0.5]), np.array([0.4, 0.6]))
    kappa, slope = planar_curvature(joint.by_s, toolpath)
    s, C = np.sin(theta / 2), np.cos(theta / 2)
    expected = (
        32 / 3 * sigma2 * (sigma1 * sigma2 - 4 * sigma2 + 3) * s / C**3
    )  # docs/papers.md C.G3, away from the joint
    np.testing.assert_allclose(joint.by_s[0, :2], joint.by_s[1, :2], atol=1e-12)
    np.testing.assert_allclose(kappa[0], kappa[1], rtol=1e-7)
    size = sigma2 * s / C**3
    np.testing.assert_allclose(slope, [-expected, expected], atol=1e-5 * size)
    assert (abs(slope[0] - slope[1]) < 1e-4 * size) == (off == 0.0)


def test_mirrored_weights_alone_are_not_g3():
    """sigma = (2, 1) satisfies the paper's eq. (8) and (14); its curvature slope jumps from -21.3 to 21.3 at 90 deg
    (docs/papers.md H3)."""
    shape = BezierCorner(sigma1=2.0, sigma2=1.0)
    joint, toolpath = corner(np.pi / 2, shape, 1.0, np.array([0.5, 0.5]), np.array([0.4, 0.6]))
    _, slope = planar_curvature(joint.by_s, toolpath)
    np.testing.assert_allclose(slope, [-64 / 3, 64 / 3], rtol=1e-9)


@given(theta=st.floats(0.1, 179.0).map(np.deg2rad), sigma2=sigmas, d=st.floats(0.01, 5.0))
@settings(max_examples=30)
def test_the_line_junction_is_g2_and_never_g3(theta, sigma2, d):
    shape = BezierCorner(sigma2=sigma2)
    sigma1 = 4 - 3 / sigma2
    ends, toolpath = corner(theta, shape, d, np.array([0.0, 1.0]))
    kappa, slope = planar_curvature(ends.by_s, toolpath)
    jump = 2 / 9 * sigma1**2 * sigma2 * np.sin(theta) / d**2
    np.testing.assert_allclose(kappa, 0.0, atol=1e-9 / d)
    np.testing.assert_allclose(slope, [jump, -jump], rtol=1e-6, atol=1e-9 / d**2)
    u1, u2 = toolpath.tangent_end[0], toolpath.tangent_start[1]
    np.testing.assert_allclose(ends.by_s[:, 1], [u1, u2], atol=1e-12)
    np.testing.assert_allclose(ends.by_w[:, 0], [-d * u1, d * u2], atol=1e-13)


@pytest.mark.parametrize(
    ("settings_", "message"),
    [({"sigma2": 0.75}, "3/4"), ({"sigma2": float("nan")}, "3/4"), ({"sigma2": float("inf")}, "3/4"),
     ({"sigma1": 0.0}, "0 < sigma1"), ({"sigma1": float("nan")}, "0 < sigma1")],
)  # fmt: skip
def test_impossible_weights_are_refused(settings_, message):
    with pytest.raises(ValueError, match=message):
        BezierCorner(**settings_)


# --- the proof of the error bound -----------------------------------------------------------------------------------------


def shape_values(
    shape, params: FloatArray, w: FloatArray, stretch=(1.0, 1.0)
) -> tuple[FloatArray, FloatArray]:
    from planner.corners.blend import CORNER_DTYPE

    record = np.zeros(1, CORNER_DTYPE)
    record["shape"], record["params"], record["stretch"] = int(shape.shape), params, stretch
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


@pytest.mark.parametrize("name", ARC_JOBS)
@pytest.mark.parametrize("kind", ["bezier", "fir"])
def test_a_corner_on_arcs_stays_within_its_bound_in_order(name, kind):
    program = parse_program("G21 G17 G90 F6000\n" + ARC_JOBS[name], source=name)
    path = smooth_path(program, MACHINE, kind)
    assert (path.joint == Joint.CORNER).any()
    legs = element_table(path).legs
    for k in np.flatnonzero(path.joint == Joint.CORNER):
        w = np.linspace(0, 1, 401)
        found = evaluate_corner(path.toolpath, k, path.corner, path.params[k], w, stretch=path.stretch[k])
        X, Y = shape_values(path.corner, path.params[k], w, path.stretch[k])
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
@settings(max_examples=60)
def test_random_arc_corners_are_regular_and_within_tolerance(theta, radii, turns, rise, sweep):
    program = arc_pair(np.deg2rad(theta), radii, turns, rise, sweep)
    path = smooth_path(program, MACHINE)
    if path.joint[1] != Joint.CORNER:
        return
    w = np.linspace(0, 1, 201)
    found = evaluate_corner(path.toolpath, 1, path.corner, path.params[1], w, stretch=path.stretch[1])
    X, Y = shape_values(path.corner, path.params[1], w, path.stretch[1])
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
