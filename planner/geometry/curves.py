"""Curves: rational Bezier cubics as segments of a toolpath, over all but their arc length x.

A segment of length L is C(u), u in [0, 1], of nc/bezier.py with 1 for its outer weights. Corners and grids
want a parameter in mm with
|dp/dx| = 1 where legs meet, so u is a quintic of t = x/L with, at both ends, that speed and no acceleration along the path,

    u(0) = 0,   u'(0) = L/|C'|,   u''(0) = -L^2 (C'.C'')/|C'|^4,     and the mirror image at t = 1,

which changes nothing of the curve. Between the ends |dp/dx| differs from 1; the curves of a program are
halved until it does by less than `UNEVEN`, and until they turn by less than `TURN_MAX`. At their ends p'' is
the curvature vector.

Where C' = 0, at a control point that stands on an end of the curve or at a cusp, the curvature is infinite
and no halving helps; where it is all but 0 many would be needed. What is left there, within `CHORD_SHARE` of
the tolerance of its chord, is run as that chord.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.nc.bezier import evenly_weighted, halves, lengths

UNEVEN = 0.02  # of |dp/dx| [-]: corners of curves are as long as they are meant to be to so much
TURN_MAX = np.pi / 2  # of a segment [rad]: its ends and its chord do not oppose each other
# Places at which a segment is looked at, and what is added to the largest curvature and third derivative
# found there [-]: between two of 33 places a cubic's change is below a percent.
PLACES, BETWEEN = 33, 1.02
# The same for the fourth derivative, taken from differences of the third: in 2,000 random segments it was up to
# 1.196 times what these tell [-].
BETWEEN_FOURTH = 1.25
# The least curvature that counts [1/mm], so that none is divided by: it bends by 1e-4 mm on a metre.
BEND_MIN = 1e-9
# Control points off their chord by less than this fraction of it are on it [-]: the rounding of coordinates.
STRAIGHT = 1e-12
NOWHERE = 1e-9  # a chord shorter than this is none [mm]: the rounding of coordinates around 1e3 mm
# What is not even after so many halvings becomes a chord if it is near enough to it.
HALVINGS_EVEN, HALVINGS_MOST = 8, 60
CHORD_SHARE = 0.01  # of the tolerance [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class Curves:
    """K rational cubics, one row each (module text)."""

    points: FloatArray  # (K, 4, A) control points [mm]
    weight: FloatArray  # (K, 2) weights of the inner two, > 0; those of the outer two are 1 [-]
    twist: FloatArray  # (K,) bound of |d3p/ds3|, s the arc length [1/mm2]

    def __post_init__(self) -> None:
        curves, _, axes = np.shape(self.points)
        freeze(self, "points", np.float64, (curves, 4, axes))
        freeze(self, "weight", np.float64, (curves, 2))
        freeze(self, "twist", np.float64, (curves,))

    def __len__(self) -> int:
        return len(self.twist)

    def at(self, row: Array, length: FloatArray, x: FloatArray) -> FloatArray:
        """(n, 4, A) points [mm], three x-derivatives of curves `row` (n,), `length` (n,) [mm], at x (n,)."""
        out = np.empty((len(row), 4, self.points.shape[2]))
        _at(self.points, self.weight, row, length, np.asarray(x, float), out)
        return out

    def part(self, rows: Array) -> Curves:
        """The curves in these rows (n,)."""
        return Curves(points=self.points[rows], weight=self.weight[rows], twist=self.twist[rows])

    def further_bounds(self, length: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(K,) bounds of |d3p/dx3| [1/mm2] and |d4p/dx4| [1/mm3] on the curves, `length` (K,) [mm] long."""
        x = (length[:, None] * np.linspace(0.0, 1.0, PLACES)).ravel()
        row = np.repeat(np.arange(len(self)), PLACES)
        third = self.at(row, length[row], x)[:, 3].reshape(len(self), PLACES, -1)
        change = np.linalg.norm(np.diff(third, axis=1), axis=2) * (PLACES - 1) / length[:, None]
        largest = np.linalg.norm(third, axis=2).max(axis=1, initial=0.0)
        return BETWEEN * largest, BETWEEN_FOURTH * change.max(axis=1, initial=0.0)


class CurveSegments(NamedTuple):
    """The segments (n,) that the curves of a program are divided into, in order."""

    owner: Array  # (n,) row of the program's piece
    chord: Array  # (n,) True for what is run as a chord; then the rest is that of a straight curve
    curves: Curves  # the segments
    length: FloatArray  # (n,) arc length [mm]
    curvature: FloatArray  # (n,) bound of |d2p/dx2| and of the curvature [1/mm]
    ends: FloatArray  # (n, 2, 4, A) points and x-derivatives at both ends


def curve_segments(pieces: FloatArray, near: FloatArray) -> CurveSegments:
    """Divide rational cubics until each has a parameter like its arc length.

    pieces : (K, 4, A+1) homogeneous, as in nc/bezier.py
    near   : (K,) largest distance of a chord from what it stands for [mm], > 0
    """
    axes = pieces.shape[2] - 1
    owner, rank, open_ = np.arange(len(pieces)), np.zeros(len(pieces)), evenly_weighted(_straightened(pieces))
    done: list[tuple[Array, FloatArray, FloatArray, Array]] = []
    for halving in range(HALVINGS_MOST + 1):
        good = _even(open_)
        chord = np.zeros(len(good), bool)
        if halving >= HALVINGS_EVEN:
            chord = ~good & ((_off_chord(open_) <= near[owner]) | (halving == HALVINGS_MOST))
            open_ = np.where(chord[:, None, None], _chords(open_), open_)
        good |= chord
        done.append((owner[good], rank[good], open_[good], chord[good]))
        owner, rank, open_ = owner[~good], rank[~good], open_[~good]
        if not len(owner):
            break
        left, right = halves(open_)
        owner = np.concatenate([owner, owner])
        rank = np.concatenate([rank, rank + 0.5 ** (halving + 1)])
        open_ = evenly_weighted(_straightened(np.concatenate([left, right])))
    found, where, even, chord = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.lexsort([where, found])
    order = order[~chord[order] | (np.ptp(even[order][..., :-1], axis=1).max(axis=1, initial=0.0) > NOWHERE)]
    found, even, chord = found[order], even[order], chord[order]
    length, curves = lengths(even), _curves(even, np.zeros(len(even)))
    x = np.linspace(0.0, 1.0, PLACES)
    row = np.repeat(np.arange(len(even)), PLACES)
    p = curves.at(row, length[row], (length[:, None] * x).ravel()).reshape(-1, PLACES, 4, axes)
    second, twist = _bounds(p)
    return CurveSegments(
        owner=found,
        chord=chord,
        curves=_curves(even, BETWEEN * twist),
        length=length,
        curvature=np.maximum(BETWEEN * second, BEND_MIN),
        ends=p[:, [0, -1]],
    )


def _straightened(pieces: FloatArray) -> FloatArray:
    """The same pieces (K, 4, A+1), straight ones with their control points a third apart: many have them at
    the ends, where the parameter then stands still although the curve goes on."""
    points = pieces[..., :-1] / pieces[..., -1:]
    chord = points[:, 3] - points[:, 0]
    size = np.linalg.norm(chord, axis=1)
    along = np.einsum("kpa,ka->kp", points, chord)
    straight = (np.diff(along, axis=1) >= 0.0).all(axis=1) & (_off_chord(pieces) <= STRAIGHT * size)
    return np.where(straight[:, None, None], _chords(pieces), pieces)


def _off_chord(pieces: FloatArray) -> FloatArray:
    """(K,) largest distance of the control points, and so of the curve, from the chord [mm]."""
    off = pieces[..., :-1] / pieces[..., -1:] - pieces[:, :1, :-1] / pieces[:, :1, -1:]
    chord = off[:, 3]
    size_sq = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
    along = np.clip(np.einsum("kpa,ka->kp", off, chord) / size_sq[:, None], 0.0, 1.0)
    return np.asarray(
        np.linalg.norm(off - along[..., None] * chord[:, None], axis=2).max(axis=1, initial=0.0)
    )


def _chords(pieces: FloatArray) -> FloatArray:
    """(K, 4, A+1) the chords of pieces, as cubics."""
    first, last = (pieces[:, k, :-1] / pieces[:, k, -1:] for k in (0, 3))
    thirds = np.arange(4)[:, None] / 3.0
    points = first[:, None] + thirds * (last - first)[:, None]
    return np.concatenate([points, np.ones((*points.shape[:2], 1))], axis=2)


def _curves(even: FloatArray, twist: FloatArray) -> Curves:
    """The record of evenly weighted pieces (K, 4, A+1)."""
    weights = even[..., -1]
    return Curves(points=even[..., :-1] / weights[..., None], weight=weights[:, 1:3], twist=twist)


def _even(pieces: FloatArray) -> Array:
    """(K,) True for evenly weighted pieces that are as the module text wants them."""
    if not len(pieces):
        return np.zeros(0, bool)
    with np.errstate(all="ignore"):  # of a piece that stands still at an end nothing is finite
        length, curves = lengths(pieces), _curves(pieces, np.zeros(len(pieces)))
        row = np.repeat(np.arange(len(pieces)), PLACES)
        x = (length[:, None] * np.linspace(0.0, 1.0, PLACES)).ravel()
        rate = curves.at(row, length[row], x)[:, 1].reshape(len(pieces), PLACES, -1)
        speed = np.linalg.norm(rate, axis=2)
        u = rate / speed[..., None]
        forward = np.einsum("ka,kpa->kp", u[:, 0], u)
        turned = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(np.diff(u, axis=1), axis=2), 1.0)).sum(
            axis=1
        )
        even = (np.abs(speed - 1.0) < UNEVEN).all(axis=1) & (forward > 0.0).all(axis=1)
        return np.asarray(even & (turned < TURN_MAX))


def _bounds(p: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(K,) largest |d2p/dx2| / |dp/dx|^2 and |d3p/ds3| among points and x-derivatives (K, n, 4, A)."""
    speed = np.linalg.norm(p[:, :, 1], axis=2)[..., None]
    t = p[:, :, 1] / speed
    along, along3 = ((t * p[:, :, n]).sum(axis=2, keepdims=True) for n in (2, 3))
    bend = (p[:, :, 2] - t * along) / speed**2
    third = (p[:, :, 3] - t * along3) / speed**3 - 3.0 * along * bend / speed**2
    third -= t * (bend**2).sum(axis=2, keepdims=True)
    second = np.linalg.norm(p[:, :, 2], axis=2) / speed[..., 0].min(axis=1, keepdims=True) ** 2
    return second.max(axis=1, initial=0.0), np.linalg.norm(third, axis=2).max(axis=1, initial=0.0)


@njit(cache=True, error_model="numpy")
def _at_end(p0, p1, p2, w1, w2):
    """|C'| and C'.C'' at the end p0 of a cubic with weights 1, w1, w2, 1, counted from there."""
    rate_sq, along = 0.0, 0.0
    for k in range(len(p0)):
        rate = 3.0 * w1 * (p1[k] - p0[k])
        change = 6.0 * (w2 * (p2[k] - p0[k]) - w1 * (p1[k] - p0[k]) * 2.0) - 6.0 * (w1 - 1.0) * rate
        rate_sq += rate * rate
        along += rate * change
    return np.sqrt(rate_sq), along


@njit(cache=True, error_model="numpy")
def _quintic(b1, b2, b3, b4, t):
    """Quintic Bernstein polynomial with coefficients 0, b1, b2, b3, b4, 1 and its three derivatives at t."""
    s = 1.0 - t
    value = (
        5.0 * b1 * t * s**4 + 10.0 * b2 * t**2 * s**3 + 10.0 * b3 * t**3 * s**2 + 5.0 * b4 * t**4 * s + t**5
    )
    d0, d1, d2, d3, d4 = b1, b2 - b1, b3 - b2, b4 - b3, 1.0 - b4
    first = 5.0 * (d0 * s**4 + 4.0 * d1 * t * s**3 + 6.0 * d2 * t**2 * s**2 + 4.0 * d3 * t**3 * s + d4 * t**4)
    e0, e1, e2, e3 = d1 - d0, d2 - d1, d3 - d2, d4 - d3
    second = 20.0 * (e0 * s**3 + 3.0 * e1 * t * s**2 + 3.0 * e2 * t**2 * s + e3 * t**3)
    third = 60.0 * ((e1 - e0) * s**2 + 2.0 * (e2 - e1) * s * t + (e3 - e2) * t**2)
    return value, first, second, third


@njit(cache=True, error_model="numpy")
def _ordinates(p0, p1, p2, p3, w1, w2, length):
    """The inner four of the Bernstein ordinates of u(t) (module text)."""
    rate, along = _at_end(p0, p1, p2, w1, w2)
    b1 = length / (5.0 * rate)
    b2 = 2.0 * b1 - length * length * along / (20.0 * rate**4)
    rate, along = _at_end(p3, p2, p1, w2, w1)
    b4 = length / (5.0 * rate)
    b3 = 2.0 * b4 - length * length * along / (20.0 * rate**4)
    return b1, b2, 1.0 - b3, 1.0 - b4


@njit(cache=True, error_model="numpy")
def ordinates(points, weight, length):
    """(K, 4) the inner Bernstein ordinates of u(t) of curves: points (K, 4, A), weight (K, 2), length (K,) [mm]."""
    out = np.empty((len(length), 4))
    for n in range(len(length)):
        p, w = points[n], weight[n]
        out[n] = _ordinates(p[0], p[1], p[2], p[3], w[0], w[1], length[n])
    return out


@njit(cache=True, error_model="numpy")
def _parameter(p0, p1, p2, p3, w1, w2, length, x):
    """u and three derivatives by t at x = length t (module text)."""
    b1, b2, b3, b4 = _ordinates(p0, p1, p2, p3, w1, w2, length)
    return _quintic(b1, b2, b3, b4, x / length)


@njit(cache=True, error_model="numpy")
def curve_point(points, weights, length, x, out):
    """Point [mm] and three x-derivatives of a curve at x [mm] (module text), into out (4, A).

    points : four control points (A,) [mm]; weights : of the inner two
    """
    (p0, p1, p2, p3), (w1, w2) = points, weights
    u, u1, u2, u3 = _parameter(p0, p1, p2, p3, w1, w2, length, x)
    u1, u2, u3 = u1 / length, u2 / length**2, u3 / length**3
    v = 1.0 - u
    q1, q2 = w1 - 1.0, w2 - 1.0  # weights over those of the ends
    w = 1.0 + 3.0 * u * v * (q1 * v + q2 * u)
    wa = 3.0 * (q1 * v * v + 2.0 * (q2 - q1) * u * v - q2 * u * u)
    wb = 6.0 * ((q2 - 2.0 * q1) * v + (q1 - 2.0 * q2) * u)
    wc = 18.0 * (q1 - q2)
    for k in range(out.shape[1]):
        # relative to the start, so that the rounding is that of the curve's size and not of the coordinates
        a1, a2, a3 = w1 * (p1[k] - p0[k]), w2 * (p2[k] - p0[k]), p3[k] - p0[k]
        r = (3.0 * u * v * (a1 * v + a2 * u) + a3 * u**3) / w
        ra = (3.0 * (a1 * v * v + 2.0 * (a2 - a1) * u * v + (a3 - a2) * u * u) - wa * r) / w
        rb = (6.0 * ((a2 - 2.0 * a1) * v + (a3 - 2.0 * a2 + a1) * u) - 2.0 * wa * ra - wb * r) / w
        rc = (6.0 * (a3 - 3.0 * a2 + 3.0 * a1) - 3.0 * wa * rb - 3.0 * wb * ra - wc * r) / w
        out[0, k] = p0[k] + r
        out[1, k] = ra * u1
        out[2, k] = rb * u1 * u1 + ra * u2
        out[3, k] = rc * u1**3 + 3.0 * rb * u1 * u2 + ra * u3


@njit(cache=True, error_model="numpy")
def curve_tangent(points, weights, length, x, out):
    """First x-derivative of a curve at x [mm], into out (A,); the others as of `curve_point`."""
    (p0, p1, p2, p3), (w1, w2) = points, weights
    u, u1, _, _ = _parameter(p0, p1, p2, p3, w1, w2, length, x)
    v = 1.0 - u
    q1, q2 = w1 - 1.0, w2 - 1.0
    w = 1.0 + 3.0 * u * v * (q1 * v + q2 * u)
    wa = 3.0 * (q1 * v * v + 2.0 * (q2 - q1) * u * v - q2 * u * u)
    for k in range(len(out)):
        a1, a2, a3 = w1 * (p1[k] - p0[k]), w2 * (p2[k] - p0[k]), p3[k] - p0[k]
        r = (3.0 * u * v * (a1 * v + a2 * u) + a3 * u**3) / w
        out[k] = (3.0 * (a1 * v * v + 2.0 * (a2 - a1) * u * v + (a3 - a2) * u * u) - wa * r) / w * u1 / length


@njit(cache=True, error_model="numpy")
def _at(points, weight, row, length, x, out):
    """`Curves.at`, into out (n, 4, A)."""
    for n in range(len(row)):
        p, w = points[row[n]], weight[row[n]]
        curve_point((p[0], p[1], p[2], p[3]), (w[0], w[1]), length[n], x[n], out[n])
