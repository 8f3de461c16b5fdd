"""Arcs and curves as the judge sees them: their pieces, and the nearest point of a piece.

An arc or helix is p(x) = center + radius (cos(rate x) e1 + sin(rate x) e2) + drift x. A curve is a rational
cubic, C(u) = sum b_i P_i / sum b_i with b_i the Bernstein polynomials of degree three times weights 1, w1,
w2, 1, and is cut at even steps of u into pieces that turn by little. The nearest point solves g(x) = (p(x) -
q) . p'(x) = 0 by Newton's method: on an arc from the polar angle of q, which it is without drift; on a curve
from the nearest of `STARTS` places.

The distance itself is taken from the vector p(x) - q, never from an expanded square, which loses half the
digits; at the nearest point an error of x enters it only squared.
"""

import math

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.kernel import kernel

CENTER, E1, E2, DRIFT = range(4)  # in `frame` of `ProgramPieces`
RADIUS, RATE = range(2)  # in `turn`
# Of the largest angle of a piece that pieces of curves turn by on the mean [-]: they turn unevenly.
CURVE_TURN = 0.7
PLACES = 64  # on a curve, at which its turning is looked at
STARTS = 5  # places on a piece of which the nearest is where Newton's method starts
# Nearly all random pieces settle within these steps; another place is on the path too.
NEWTON_STEPS = 8
SETTLED = 1e-13  # a step of Newton's method below this fraction of the piece is none [-]


def arc_points(frame: FloatArray, turn: FloatArray, x: FloatArray) -> FloatArray:
    """(n, A) points of arcs with `frame` (n, 4, A) and `turn` (n, 2) at the parameters x (n,)."""
    angle = turn[:, RATE] * x
    circle = np.cos(angle)[:, None] * frame[:, E1] + np.sin(angle)[:, None] * frame[:, E2]
    points: FloatArray = frame[:, CENTER] + turn[:, RADIUS, None] * circle + frame[:, DRIFT] * x[:, None]
    return points


def curve_points(points: FloatArray, weight: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points and u-derivatives (n, A) of rational cubics at u (n,).

    points : (n, 4, A) control points
    weight : (n, 2) of the inner two
    """
    v, ones = 1.0 - u, np.ones(len(u))
    w = np.stack([ones, weight[:, 0], weight[:, 1], ones], axis=1)
    basis = w * np.stack([v**3, 3 * u * v**2, 3 * u**2 * v, u**3], axis=1)
    slope = w * np.stack([-3 * v**2, 3 * v**2 - 6 * u * v, 6 * u * v - 3 * u**2, 3 * u**2], axis=1)
    total = basis.sum(axis=1)[:, None]
    point = np.einsum("ni,nia->na", basis, points) / total
    rate = (np.einsum("ni,nia->na", slope, points) - slope.sum(axis=1)[:, None] * point) / total
    return point, rate


def curve_counts(points: FloatArray, weight: FloatArray, angle: float) -> Array:
    """(K,) into how many pieces of even steps each curve is cut, to turn by `CURVE_TURN` of `angle` each.

    points, weight : (K, 4, A), (K, 2) of the curves as of `curve_points`
    angle          : [rad]
    """
    curves = len(points)
    row, u = np.repeat(np.arange(curves), PLACES), np.tile(np.linspace(0.0, 1.0, PLACES), curves)
    rate = curve_points(points[row], weight[row], u)[1]
    tangent = (rate / np.linalg.norm(rate, axis=1)[:, None]).reshape(curves, PLACES, points.shape[2])
    half_chord = np.minimum(0.5 * np.linalg.norm(np.diff(tangent, axis=1), axis=2), 1.0)
    turned = 2.0 * np.arcsin(half_chord).sum(axis=1)
    return np.maximum(np.ceil(turned / (CURVE_TURN * angle)), 1).astype(np.int64)


@kernel()
def reach_bend(pieces, i, q, radius):
    """Which part of piece i of `ProgramPieces`, of an arc or a curve, is within `radius` of q (A,), as
    `reach_piece`."""
    x0, x1 = pieces.piece[i]["x0"], pieces.piece[i]["x1"]
    x, distance_sq, g, slope = nearest_on_bend(pieces, i, q)
    distance = math.sqrt(distance_sq)
    if distance > radius:
        return 1.0, 0.0, distance
    if slope <= 0.0:
        return 0.0, 1.0, distance
    # distance^2 + 2 g D + slope D^2 = radius^2 about the nearest point
    root = math.sqrt(g * g + slope * (radius * radius - distance_sq))
    low, high = x + (-g - root) / slope, x + (-g + root) / slope
    span = x1 - x0
    return max(low - x0, 0.0) / span, min(high - x0, span) / span, distance


@kernel()
def nearest_on_bend(pieces, i, q):
    """The parameter at which piece i, of an arc or a curve, is nearest to q (A,), and what `_apart` gives there."""
    x0, x1 = pieces.piece[i]["x0"], pieces.piece[i]["x1"]
    x = _at_polar_angle(pieces, i, q) if pieces.piece[i]["arc"] >= 0 else _nearest_start(pieces, i, q)
    distance_sq, g, slope = _apart(pieces, i, q, x)
    for _ in range(NEWTON_STEPS):
        # q is beyond the centre of curvature: one of the ends is nearest, which x already is
        if slope <= 0.0:
            break
        better = min(max(x - g / slope, x0), x1)
        if abs(better - x) <= SETTLED * (x1 - x0):
            break
        x = better
        distance_sq, g, slope = _apart(pieces, i, q, x)
    return x, distance_sq, g, slope


@kernel()
def _at_polar_angle(pieces, i, q):
    k, x0, x1 = pieces.piece[i]["arc"], pieces.piece[i]["x0"], pieces.piece[i]["x1"]
    rate, frame = pieces.turn[k, RATE], pieces.frame
    middle, across, along = 0.5 * (x0 + x1), 0.0, 0.0
    for n in range(len(q)):
        w = q[n] - frame[k, CENTER, n] - middle * frame[k, DRIFT, n]
        across += w * frame[k, E2, n]
        along += w * frame[k, E1, n]
    angle = math.atan2(across, along) - rate * middle
    angle -= 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    return float(min(max(middle + angle / rate, x0), x1))


@kernel()
def _nearest_start(pieces, i, q):
    x0, x1 = pieces.piece[i]["x0"], pieces.piece[i]["x1"]
    x, least = x0, np.inf
    for n in range(STARTS):
        place = x0 + (x1 - x0) * n / (STARTS - 1.0)
        distance_sq, _, _ = _apart(pieces, i, q, place)
        if distance_sq < least:
            x, least = place, distance_sq
    return float(x)


@kernel()
def _apart(pieces, i, q, x):
    """|p(x) - q|^2, g = (p - q).p' and g' of the arc or curve of piece i."""
    arc, (c, s) = pieces.piece[i]["arc"] >= 0, _direction(pieces, i, x)
    distance_sq, g, slope = 0.0, 0.0, 0.0
    for n in range(len(q)):
        at, rate, change = _on_arc(pieces, i, x, c, s, n) if arc else _on_curve(pieces, i, x, n)
        off = at - q[n]
        distance_sq += off * off
        g += off * rate
        slope += rate * rate + off * change
    return distance_sq, g, slope


@kernel()
def _direction(pieces, i, x):
    """Cosine and sine on the arc of piece i at x; of a curve none."""
    if pieces.piece[i]["arc"] < 0:
        return 0.0, 0.0
    angle = pieces.turn[pieces.piece[i]["arc"], RATE] * x
    return math.cos(angle), math.sin(angle)


@kernel()
def _on_arc(pieces, i, x, c, s, n):
    """Coordinate n of the arc of piece i at x, and its first two derivatives."""
    k, frame = pieces.piece[i]["arc"], pieces.frame
    radius, rate = pieces.turn[k, RADIUS], pieces.turn[k, RATE]
    circle = radius * (c * frame[k, E1, n] + s * frame[k, E2, n])
    turned = radius * rate * (c * frame[k, E2, n] - s * frame[k, E1, n])
    at = frame[k, CENTER, n] + circle + frame[k, DRIFT, n] * x
    return at, turned + frame[k, DRIFT, n], -rate * rate * circle


@kernel()
def _on_curve(pieces, i, u, n):
    """Coordinate n of the curve of piece i at u, and its first two derivatives."""
    k = -2 - pieces.piece[i]["arc"]
    w1, w2, v = pieces.turn[k, 0], pieces.turn[k, 1], 1.0 - u
    p0, p1 = pieces.frame[k, 0, n], pieces.frame[k, 1, n]
    p2, p3 = pieces.frame[k, 2, n], pieces.frame[k, 3, n]
    b0, b1, b2, b3 = v * v * v, 3.0 * w1 * u * v * v, 3.0 * w2 * u * u * v, u * u * u
    s0, s1 = -3.0 * v * v, 3.0 * w1 * v * (v - 2.0 * u)
    s2, s3 = 3.0 * w2 * u * (2.0 * v - u), 3.0 * u * u
    c0, c1, c2, c3 = 6.0 * v, 6.0 * w1 * (u - 2.0 * v), 6.0 * w2 * (v - 2.0 * u), 6.0 * u
    w, wa, wb = b0 + b1 + b2 + b3, s0 + s1 + s2 + s3, c0 + c1 + c2 + c3
    at = (b0 * p0 + b1 * p1 + b2 * p2 + b3 * p3) / w
    rate = (s0 * p0 + s1 * p1 + s2 * p2 + s3 * p3 - wa * at) / w
    change = (c0 * p0 + c1 * p1 + c2 * p2 + c3 * p3 - 2.0 * wa * rate - wb * at) / w
    return at, rate, change


@kernel()
def apart_on_bend(pieces, i, q, counts):
    """Squared distance of q (A,) from its nearest point on piece i, an arc or a curve, in axes that `counts` (A,)."""
    (x, _, _, _), apart_sq = nearest_on_bend(pieces, i, q), 0.0
    arc, (c, s) = pieces.piece[i]["arc"] >= 0, _direction(pieces, i, x)
    for n in range(len(q)):
        at, _, _ = _on_arc(pieces, i, x, c, s, n) if arc else _on_curve(pieces, i, x, n)
        apart_sq += counts[n] * (at - q[n]) ** 2
    return apart_sq
