"""Rational Bezier cubics: what every spline of a program is made of, whatever its degree (up to three), knots
and weights.

With the Bernstein polynomials B_i of degree three, control points P_i and weights w_i > 0 a piece is

    C(u) = sum_i B_i(u) w_i P_i / sum_i B_i(u) w_i,       u in [0, 1].

Here the (w_i P_i, w_i) are used as they stand, one more coordinate: knots are inserted, degrees raised and
pieces halved by averages of them, which keeps the curve exactly (Piegl and Tiller, The NURBS Book, ch. 5).
"""

from itertools import pairwise

import numpy as np

from planner.base.arrays import FloatArray

DEGREE_MAX = 3  # of the pieces: higher degrees are refused (splines.py)
# Nodes on every step, and steps of a piece, for its length: good to 1e-9 of that of the butterfly of paper 001.
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)
LENGTH_STEPS = 8


def homogeneous(points: FloatArray, weights: FloatArray) -> FloatArray:
    """(..., A+1) from control points (..., A) and weights (...)."""
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def cubic_pieces(control: FloatArray, knots: FloatArray, degree: int) -> FloatArray:
    """(K, 4, A+1) the pieces of a B-spline between its different knots, in order.

    control : (n, A+1) homogeneous control points
    knots   : (n + degree + 1,) not decreasing
    degree  : 1, 2 or 3
    """
    cuts = np.unique(knots[degree : len(control) + 1])
    steps, order = list(pairwise(cuts)), range(degree + 1)
    return raised(np.array([[_blossom(control, knots, degree, a, b, i) for i in order] for a, b in steps]))


def _blossom(control: FloatArray, knots: FloatArray, degree: int, a: float, b: float, i: int) -> FloatArray:
    """(A+1,) control point i of the piece from a to b: the polar form with i times b (de Boor)."""
    k = int(np.searchsorted(knots, a, side="right")) - 1
    points = control[k - degree : k + 1].copy()
    for r in range(1, degree + 1):
        at = b if r <= i else a
        for j in range(degree, r - 1, -1):
            low, high = knots[j + k - degree], knots[j + 1 + k - r]
            share = (at - low) / (high - low)
            points[j] = (1.0 - share) * points[j - 1] + share * points[j]
    return np.asarray(points[degree])


def raised(pieces: FloatArray) -> FloatArray:
    """(K, 4, A+1) the same pieces, of degree one or two (K, 2 or 3, A+1), as cubics."""
    while pieces.shape[1] < DEGREE_MAX + 1:
        n = pieces.shape[1]
        share = (np.arange(1, n) / n)[:, None]
        inner = share * pieces[:, :-1] + (1.0 - share) * pieces[:, 1:]
        pieces = np.concatenate([pieces[:, :1], inner, pieces[:, -1:]], axis=1)
    return pieces


def halves(pieces: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both halves (K, 4, A+1) of pieces (K, 4, A+1), by de Casteljau."""
    p = [pieces[:, i] for i in range(4)]
    ab, bc, cd = (0.5 * (p[i] + p[i + 1]) for i in range(3))
    abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
    middle = 0.5 * (abc + bcd)
    return np.stack([p[0], ab, abc, middle], axis=1), np.stack([middle, bcd, cd, p[3]], axis=1)


def evenly_weighted(pieces: FloatArray) -> FloatArray:
    """The same curves (K, 4, A+1) as `pieces` (K, 4, A+1), with 1 for the outer two weights: another parameter,
    u / (u + (1-u) c), and a common factor."""
    first, last = pieces[:, 0, -1], pieces[:, 3, -1]
    factor = np.cbrt(first / last)[:, None] ** np.arange(4) / first[:, None]
    return np.asarray(pieces * factor[..., None])


def at(pieces: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points and first two derivatives by u, (K, n, A) each, of pieces (K, 4, A+1) at parameters u (n,)."""
    v = 1.0 - u
    value = np.stack([v**3, 3 * u * v**2, 3 * u**2 * v, u**3], axis=1) @ pieces
    step, bend = np.diff(pieces, axis=1), np.diff(pieces, 2, axis=1)
    first = 3.0 * (np.stack([v**2, 2 * u * v, u**2], axis=1) @ step)
    second = 6.0 * (np.stack([v, u], axis=1) @ bend)
    w = value[..., -1:]
    point = value[..., :-1] / w
    rate = (first[..., :-1] - first[..., -1:] * point) / w
    change = (second[..., :-1] - 2.0 * first[..., -1:] * rate - second[..., -1:] * point) / w
    return point, rate, change


def lengths(pieces: FloatArray) -> FloatArray:
    """(K,) arc lengths of pieces (K, 4, A+1) [mm]."""
    inside = (np.arange(LENGTH_STEPS)[:, None] + 0.5 * (GAUSS_NODES + 1.0)) / LENGTH_STEPS
    speed = np.linalg.norm(at(pieces, inside.ravel())[1], axis=2)
    return np.asarray(speed @ np.tile(0.5 * GAUSS_WEIGHTS / LENGTH_STEPS, LENGTH_STEPS))
