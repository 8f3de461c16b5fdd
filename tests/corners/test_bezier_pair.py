"""The Bezier pair: control points, errors, curvature and continuity.

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

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.corners.bezier import BezierCorner
from planner.corners.blend import middle_from_tolerance
from planner.geometry.build import toolpath_from_program
from planner.nc.program import Program

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
