"""Paper 002, eq. (2) to (14), as statements about rational cubics: which of them say what they are said to say.

Two curves with control points Q0..Q3 and Q3..Q6 and weights of their own; no formula of the package.
"""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.base.arrays import FloatArray


def derivatives(points: FloatArray, weights: FloatArray, t: float) -> FloatArray:
    """(4, 2) point and derivatives of a rational cubic."""
    power = np.polynomial.Polynomial
    basis = [power([0, 1]) ** k * power([1, -1]) ** (3 - k) * comb(3, k) for k in range(4)]
    top = [
        sum((b * (w * p[axis]) for b, w, p in zip(basis, weights, points, strict=True)), power([0]))
        for axis in range(2)
    ]
    below = sum((b * w for b, w in zip(basis, weights, strict=True)), power([0]))
    n = np.array([[(c.deriv(k) if k else c)(t) for c in top] for k in range(4)])
    w = [(below.deriv(k) if k else below)(t) for k in range(4)]
    out = np.zeros((4, 2))
    for k in range(4):
        out[k] = (n[k] - sum(comb(k, i) * w[i] * out[k - i] for i in range(1, k + 1))) / w[0]
    return out


def curvature(points: FloatArray, weights: FloatArray, t: float) -> tuple[float, float]:
    """Signed curvature and its slope along the arc length."""
    _, r1, r2, r3 = derivatives(points, weights, t)
    speed = np.linalg.norm(r1)
    bend = r1[0] * r2[1] - r1[1] * r2[0]
    kappa = bend / speed**3
    slope = (r1[0] * r3[1] - r1[1] * r3[0]) / speed**3 - 3 * bend * (r1 @ r2) / speed**5
    return kappa, slope / speed


def area(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    return 0.5 * abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])


def shape_numbers(weights: FloatArray) -> tuple[float, float]:
    """Eq. (2), (3)."""
    w0, w1, w2, w3 = weights
    return w0 * w2 / w1**2, w1 * w3 / w2**2


def equation_8(Q: FloatArray) -> float:
    """What sigma2/sigma1bar must be: (S345/S123)(l23/l34)^3."""
    l23, l34 = np.linalg.norm(Q[3] - Q[2]), np.linalg.norm(Q[4] - Q[3])
    return area(Q[3], Q[4], Q[5]) / area(Q[1], Q[2], Q[3]) * (l23 / l34) ** 3


def equation_14(Q: FloatArray) -> float:
    """What the paper wants sigma1/sigma2bar to be: (S123/S345)^2 (l34/l23)^3."""
    l23, l34 = np.linalg.norm(Q[3] - Q[2]), np.linalg.norm(Q[4] - Q[3])
    return (area(Q[1], Q[2], Q[3]) / area(Q[3], Q[4], Q[5])) ** 2 * (l34 / l23) ** 3


def halves(points: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """De Casteljau: control points of both parts."""
    rows = [points]
    while len(rows[-1]) > 1:
        rows.append((1 - t) * rows[-1][:-1] + t * rows[-1][1:])
    return np.array([row[0] for row in rows]), np.array([row[-1] for row in rows[::-1]])


@given(
    sigma=st.tuples(*(st.floats(0.3, 3.0) for _ in range(3))),
    seed=st.integers(0, 10**6),
    scale=st.floats(0.3, 3.0),
)
@settings(max_examples=30)
def test_equation_8_with_the_bar_is_the_g2_condition(sigma, seed, scale):
    """kappa1(1) = (2/3) sigma2 h/a^2, kappa2(0) = (2/3) sigma1bar h'/a'^2 (docs/papers.md C4): equal iff sigma2/sigma1bar is eq.
    (8)'s right side.
    As printed, with sigma1 of the *first* curve, it is another condition."""
    rng = np.random.default_rng(seed)
    joint, tangent = rng.normal(size=2), np.array([1.0, 0.0])
    left, right = rng.uniform(0.5, 2.0, 2), rng.uniform(0.5, 2.0, 2)
    Q = np.array([
        joint + 3.0 * np.array((-1.0, 0.7)), joint - left[0] * tangent + [-left[1], 0.7], joint - left[0] * tangent, joint,
        joint + scale * right[0] * tangent, joint + scale * (right[0] * tangent + [right[1], 0.9]), joint + 3.0 * np.array((1.0, 0.7)),
    ])  # fmt: skip
    s1, s2, b2 = sigma
    b1 = s2 / equation_8(Q)  # the condition
    first, second = weights_of(s1, s2), weights_of(b1, b2)
    one, two = curvature(Q[:4], first, 1.0)[0], curvature(Q[3:], second, 0.0)[0]
    assert one == pytest.approx(two, rel=1e-9)
    a, h = left[0], 0.7
    assert abs(one) == pytest.approx(2 / 3 * s2 * h / a**2, rel=1e-9)
    if abs(s1 / b1 - 1) > 1e-3:  # as printed: sigma2/sigma1 = the right side
        printed = weights_of(s1, s1 * equation_8(Q))
        assert curvature(Q[:4], printed, 1.0)[0] != pytest.approx(two, rel=1e-6)


def weights_of(sigma1: float, sigma2: float) -> FloatArray:
    """w0 = w3 = 1."""
    return np.array([1.0, (sigma1**2 * sigma2) ** (-1 / 3), (sigma1 * sigma2**2) ** (-1 / 3), 1.0])


@given(sigma1=st.floats(0.3, 3.0), sigma2=st.floats(0.3, 3.0))
def test_the_weights_have_their_shape_numbers(sigma1, sigma2):
    assert shape_numbers(weights_of(sigma1, sigma2)) == pytest.approx((sigma1, sigma2))


@given(seed=st.integers(0, 10**6), sigma1=st.floats(0.3, 3.0), sigma2=st.floats(0.3, 3.0))
@settings(max_examples=40)
def test_equation_7_needs_its_factor_of_one_sixth(seed, sigma1, sigma2):
    """r''(1) = -6 (w1/w3) P1P3 + (18 w2^2/w3^2 - 6 w2/w3) P2P3 (docs/papers.md C7): solved for P1P3 there is the 6 that is missing
    in print."""
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(4, 2))
    w = weights_of(sigma1, sigma2)
    second = derivatives(P, w, 1.0)[2]
    P1P3, P2P3 = P[3] - P[1], P[3] - P[2]
    rest = (6 * w[2] / w[3] - 18 * w[2] ** 2 / w[3] ** 2) * P2P3 + second
    np.testing.assert_allclose(-w[3] / (6 * w[1]) * rest, P1P3, rtol=1e-7, atol=1e-9)
    printed = -w[3] / w[1] * rest
    assert np.abs(printed - P1P3).max() > 1e-3 * np.abs(P1P3).max()


def test_equation_14_is_not_necessary_for_g3():
    """docs/papers.md H2: the two parts of one cubic, d2/d1 = 2, are C-infinity at their joint; all weights are 1, and eq. 14 would
    want 0.288."""
    d1, d2 = 1.0, 2.0
    whole = np.array([[-d1, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, d2]])
    first, second = halves(whole, 0.3977)
    Q = np.vstack([first, second[1:]])
    ones = np.ones(4)
    before, after = curvature(first, ones, 1.0), curvature(second, ones, 0.0)
    np.testing.assert_allclose(before, after, rtol=1e-9)
    assert equation_8(Q) == pytest.approx(1.0, rel=1e-9)  # eq. (8) does hold
    assert equation_14(Q) == pytest.approx(0.288, abs=0.002)


def test_equation_14_is_not_sufficient_for_g3():
    """docs/papers.md H3: the mirrored pair with sigma = (2, 1) satisfies (8) and (14); its curvature slope jumps."""
    s = np.sqrt(0.5)
    Q = np.array([[-1, 0], [-0.5, 0], [-0.25, 0], [-0.125, 0.125], [0, 0.25], [0, 0.5], [0, 1]], float)
    first, second = weights_of(2.0, 1.0), weights_of(1.0, 2.0)  # read from the joint: (1, 2) backwards
    assert shape_numbers(first)[1] / shape_numbers(second)[0] == pytest.approx(equation_8(Q))
    assert shape_numbers(first)[0] / shape_numbers(second)[1] == pytest.approx(equation_14(Q))
    before, after = curvature(Q[:4], first, 1.0), curvature(Q[3:], second, 0.0)
    assert before[0] == pytest.approx(after[0])
    assert abs(before[1]) == pytest.approx(32 / 3 * s / s**3, rel=1e-9)  # 21.3
    assert before[1] == pytest.approx(-after[1])


@given(sigma2=st.floats(0.8, 1.5), theta=st.floats(5.0, 170.0).map(np.deg2rad))
@settings(max_examples=30)
def test_the_right_condition_is_sigma1_4_minus_3_over_sigma2(sigma2, theta):
    """C.G3, independent of the angle; the slope is the closed form (2/9) sa [9 a h + a sa sb y3 - 6 b h sa]/a^4 of a planar cubic."""
    u1, u2 = np.array([1.0, 0.0]), np.array([np.cos(theta), np.sin(theta)])
    joint = (u2 - u1) / 8
    Q = np.array([-u1, -u1 / 2, -u1 / 4, joint, u2 / 4, u2 / 2, u2])
    sigma1 = 4 - 3 / sigma2
    first, second = weights_of(sigma1, sigma2), weights_of(sigma2, sigma1)
    before, after = curvature(Q[:4], first, 1.0), curvature(Q[3:], second, 0.0)
    np.testing.assert_allclose(before, after, rtol=1e-7, atol=1e-7 * abs(before[0]))
    start, slope = curvature(Q[3:], second, 0.0)
    T = (Q[4] - Q[3]) / np.linalg.norm(Q[4] - Q[3])
    N = np.array([-T[1], T[0]])
    a, b, h, y3 = np.linalg.norm(Q[4] - Q[3]), (Q[5] - Q[3]) @ T, (Q[5] - Q[3]) @ N, (Q[6] - Q[3]) @ N
    sa, sb = shape_numbers(second)
    assert start == pytest.approx(2 / 3 * sa * h / a**2, rel=1e-9)
    assert slope == pytest.approx(
        2 / 9 * sa * (9 * a * h + a * sa * sb * y3 - 6 * b * h * sa) / a**4, abs=1e-7 * abs(start) / a
    )
