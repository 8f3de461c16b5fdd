"""The proof that a curve is inside the tolerance: a bound for every part of every span, not samples.

On the part of a span between neighbouring sites and vertices the curve is a polynomial, which lies in the
convex hull of its six Bezier points. If these are within r of the chord that the part belongs to, so is the
part, since what is within r of a chord is convex. The largest such r, plus the chord's sagitta on arcs,
bounds the deviation of the path from the curve and back; vertices lie on it because neighbouring parts share
their ends.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, ORDER

CUT = 8  # into so many a part is cut if its bound is too large: their Bezier points are 64 times as near to the curve


class Certificate(NamedTuple):
    """Bounds of the deviation of a run with S spans and J sites."""

    site: FloatArray  # (J,) around each site, over the tolerance
    span: FloatArray  # (S,) on each span, over the tolerance: at most 1 everywhere is the proof
    left: FloatArray  # (S,) what the bound leaves of the tolerance [mm]


@njit(cache=True, error_model="numpy")
def _part_error(basis, control, i, a, b, chord, bezier):
    """Largest distance of the Bezier points of span i between tau = a and b from a chord (start, direction,
    length) [mm]; `bezier` (6, A) is overwritten."""
    chord_start, along, length = chord
    axes = control.shape[1]
    step = b - a
    for k in range(axes):
        # power coefficients, shifted to a and scaled to the part, then to Bernstein form
        for m in range(ORDER):
            value = 0.0
            for d in range(ORDER):
                value += basis[i, d, m] * control[i + d, k]
            bezier[m, k] = value
        for m in range(DEGREE):
            for n in range(DEGREE - 1, m - 1, -1):
                bezier[n, k] += a * bezier[n + 1, k]
        scale = 1.0
        for m in range(ORDER):
            bezier[m, k] *= scale
            scale *= step
        # b_i = sum_m C(i, m)/C(5, m) a_m by repeated sums of a_m / C(5, m)
        bezier[1, k] /= 5.0
        bezier[2, k] /= 10.0
        bezier[3, k] /= 10.0
        bezier[4, k] /= 5.0
        for m in range(DEGREE):
            for n in range(DEGREE, m, -1):
                bezier[n, k] += bezier[n - 1, k]
    worst = 0.0
    for m in range(ORDER):
        dot = 0.0
        for k in range(axes):
            dot += (bezier[m, k] - chord_start[k]) * along[k]
        dot = min(max(dot, 0.0), length)
        square = 0.0
        for k in range(axes):
            square += (bezier[m, k] - chord_start[k] - dot * along[k]) ** 2
        worst = max(worst, square)
    return np.sqrt(worst)


@njit(cache=True, error_model="numpy")
def certify(corridor, knots, site_place, control):
    """The certificate of one run: its corridor, its knots, and its control points (n, A) [mm].

    site_place : (J,) place of each site along the legs [mm], ascending
    """
    place, point, along, tol, tol_chord = (
        corridor.place, corridor.point, corridor.along, corridor.tol, corridor.tol_chord
    )  # fmt: skip
    breaks, basis = knots
    bezier = np.empty((ORDER, control.shape[1]))
    spans, sites = len(breaks) - 1, len(site_place)
    ratio_span, ratio_site, left = np.zeros(spans), np.zeros(sites), np.full(spans, np.inf)
    v, i, j = 0, 0, 0
    u = breaks[0]
    end = breaks[spans]
    while u < end:
        while v + 2 < len(place) and place[v + 1] <= u:
            v += 1
        while i + 1 < spans and breaks[i + 1] <= u:
            i += 1
        while j < sites and site_place[j] <= u:
            j += 1
        following = min(breaks[i + 1], place[v + 1])
        if j < sites:
            following = min(following, site_place[j])
        if not following > u:  # the last part, by rounding
            break
        h = breaks[i + 1] - breaks[i]
        length = 0.0
        for k in range(point.shape[1]):
            length += (point[v + 1, k] - point[v, k]) * along[v, k]
        tau, step = (u - breaks[i]) / h, (following - u) / h
        chord = point[v], along[v], length
        error = _part_error(basis, control, i, tau, tau + step, chord, bezier)
        if error > tol_chord[v]:  # smaller parts have points nearer to the curve, by the square of their size
            error = 0.0
            for part in range(CUT):
                a, b = tau + step * part / CUT, tau + step * (part + 1) / CUT
                error = max(error, _part_error(basis, control, i, a, b, chord, bezier))
        ratio = error / tol_chord[v]
        if following == place[v + 1]:
            square = 0.0
            for k in range(point.shape[1]):
                value = -point[v + 1, k]
                for d in range(ORDER):
                    total = 0.0
                    for m in range(DEGREE, -1, -1):
                        total = total * (tau + step) + basis[i, d, m]
                    value += total * control[i + d, k]
                square += value * value
            ratio = max(ratio, np.sqrt(square) / tol[v + 1])
            error = max(error, np.sqrt(square) - (tol[v + 1] - tol_chord[v]))
        ratio_span[i] = max(ratio_span[i], ratio)
        left[i] = min(left[i], tol_chord[v] - error)
        if j < sites:
            ratio_site[j] = max(ratio_site[j], ratio)
        if j > 0:
            ratio_site[j - 1] = max(ratio_site[j - 1], ratio)
        u = following
    return Certificate(ratio_site, ratio_span, left)
