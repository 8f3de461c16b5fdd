"""A first spline inside the tube of each run, with its knots and the sites at which the tube is watched.

The control points of the first spline are the places of the guide at the spline's Greville abscissae: a smoothed guide that leaves it
only at corners, and the less, the denser the knots are. Where it uses more than `ROOM` of the tube, knots are added, which moves the
knots of the whole run a little: on a run of 100,000 corners some site always ends a little beyond `ROOM`. That does no harm: what is
within `INSIDE` of the tube is a start for the relaxation (relax.py). Only spans with sites outside of that are no spline, and the run
is to be cut there (spline_path.py).

Sites are all vertices, each with a ball around it, and between distant ones places on the chords `SITE_SPACING` of a span apart,
around which the path may slide along the chord.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, ORDER, clamped, span_basis
from planner.smoothing.corridor import Guide
from planner.smoothing.interior_point import site_distance
from planner.smoothing.knots import graded, spacing, spread
from planner.smoothing.runs import Runs

ROOM = 0.85  # of the tube that a first spline should use [-]
DENSER = 0.75  # factor on the distance of knots where it uses more [-]
DENSER_MAX = 16  # so many times at most
INSIDE = 0.99  # of the tube that it may use in the end [-]: the relaxation starts strictly inside of its own tube, relax.TUBE
SPANS_MIN = 8  # of a run
SITE_SPACING = 0.5  # of sites on chords [spans]
SITE_EDGE = 0.1  # no site on a chord so close to its ends [spans]
# Vertices nearer than this to the site before are left to the certificate [spans] ...
SITES_DENSE = 0.125
DENSE_TURN = 0.1  # ... unless the path turns there by more [rad]
SLIDE = 0.1  # a site on a chord may slide along it by its radius over this, less near the chord's ends


class Laid(NamedTuple):
    """All runs one after the other; run q holds the breaks span_first[q] + q : span_first[q+1] + q + 1, the control points
    span_first[q] + 5 q : span_first[q+1] + 5 (q+1), and the sites site_first[q] : site_first[q+1].

    span        : (J,) span of each site, counted within its run; also the first of its six control points
    place       : (J,) along the legs [mm]
    weights     : (J, 6) the basis functions there
    target, along, slide, radius : (J, ..) the site's tube (interior_point.py); radius is the whole tolerance [mm]
    outside     : (S,) spans with a site that the first spline passes too far away
    fits        : (Q,) True if it is inside the tube everywhere
    """

    span_first: Array
    breaks: FloatArray
    control: FloatArray
    site_first: Array
    span: Array
    place: FloatArray
    weights: FloatArray
    target: FloatArray
    along: FloatArray
    slide: FloatArray
    radius: FloatArray
    outside: Array
    fits: Array


def lay(guide: Guide, runs: Runs, longest: FloatArray) -> Laid:
    """The first splines; `longest` (Q,) span of each run [mm]."""
    return Laid(*_lay(*guide, longest))


@njit(cache=True, error_model="numpy")
def follow(place, point, breaks, control):
    """Control points (n, A) on the guide at the Greville abscissae."""
    knots = clamped(breaks)
    v = 0
    for i in range(len(control)):
        u = 0.0
        for d in range(1, ORDER):
            u += knots[i + d] / DEGREE
        while v + 2 < len(place) and place[v + 1] < u:
            v += 1
        share = (u - place[v]) / (place[v + 1] - place[v])
        share = min(max(share, 0.0), 1.0)
        for k in range(control.shape[1]):
            control[i, k] = point[v, k] + share * (point[v + 1, k] - point[v, k])


@njit(cache=True, error_model="numpy")
def _sites(place, turn, tol, tol_chord, breaks, sites):
    """Places, vertices or chords (~chord) and radii of the sites of a run into sites (3, ..); returns their number."""
    n = 0
    span = 0
    before = -np.inf
    for v in range(len(place)):
        inner = 0 < v < len(place) - 1
        while span + 2 < len(breaks) and breaks[span + 1] <= place[v]:
            span += 1
        dense = place[v] - before < SITES_DENSE * (breaks[span + 1] - breaks[span])
        if inner and (turn[v] > DENSE_TURN or not dense):
            sites[0, n], sites[1, n], sites[2, n] = place[v], v, tol[v]
            n += 1
            before = place[v]
        if v + 1 == len(place):
            break
        # on the chord that follows
        i = span
        while i + 1 < len(breaks) and breaks[i] < place[v + 1]:
            h = breaks[i + 1] - breaks[i]
            parts = int(np.ceil(1.0 / SITE_SPACING))
            for part in range(parts):
                u = breaks[i] + h * (part + 0.5) / parts
                if place[v] + SITE_EDGE * h < u < place[v + 1] - SITE_EDGE * h:
                    sites[0, n], sites[1, n], sites[2, n] = u, ~v, tol_chord[v]
                    n += 1
            i += 1
    return n


@njit(cache=True, error_model="numpy")
def _grown1(array, needed):
    if needed <= len(array):
        return array
    out = np.empty(max(2 * len(array), needed), array.dtype)
    for i in range(len(array)):
        out[i] = array[i]
    return out


@njit(cache=True, error_model="numpy")
def _grown2(array, needed):
    if needed <= len(array):
        return array
    out = np.empty((max(2 * len(array), needed), array.shape[1]))
    for i in range(len(array)):
        for k in range(array.shape[1]):
            out[i, k] = array[i, k]
    return out


@njit(cache=True, error_model="numpy")
def _lay(first, place, point, turn, along, tol, tol_chord, longest):
    runs, axes = len(longest), point.shape[1]
    span_first, site_first = np.zeros(runs + 1, np.int64), np.zeros(runs + 1, np.int64)
    fits, e = np.ones(runs, np.bool_), np.empty(axes)
    size = 4 * len(place) + 64 * runs
    breaks, control = np.empty(size), np.empty((size, axes))
    span, where, slide, radius = np.empty(size, np.int64), np.empty(size), np.empty(size), np.empty(size)
    weights, target, direction = np.empty((size, ORDER)), np.empty((size, axes)), np.empty((size, axes))
    outside = np.zeros(size, np.bool_)
    for q in range(runs):
        a, b = first[q], first[q + 1]
        here, points, inner = place[a:b], point[a:b], place[a + 1 : b - 1]
        h = spacing(inner, turn[a + 1 : b - 1], tol[a + 1 : b - 1], longest[q])
        for attempt in range(DENSER_MAX + 1):
            cut = spread(inner, h, here[0], here[-1], longest[q], SPANS_MIN)
            spans = len(cut) - 1
            basis = span_basis(clamped(cut))
            c = np.empty((spans + DEGREE, axes))
            follow(here, points, cut, c)
            # at most every vertex, and on every piece of a chord within a span its places there
            sites = np.empty((3, (b - a) + (spans + b - a) * int(np.ceil(1.0 / SITE_SPACING))))
            m = _sites(here, turn[a:b], tol[a:b], tol_chord[a:b], cut, sites)
            n = site_first[q] + m
            span, slide, radius = _grown1(span, n), _grown1(slide, n), _grown1(radius, n)
            where = _grown1(where, n)
            weights, target, direction = _grown2(weights, n), _grown2(target, n), _grown2(direction, n)
            outside = _grown1(outside, span_first[q] + spans)
            for i in range(spans):
                outside[span_first[q] + i] = False
            bad = 0
            i = 0
            for s in range(m):
                j = site_first[q] + s
                u, vertex = sites[0, s], int(sites[1, s])
                while i + 2 < len(cut) and cut[i + 1] <= u:
                    i += 1
                width = cut[i + 1] - cut[i]
                tau = (u - cut[i]) / width
                span[j], where[j], radius[j] = i, u, sites[2, s]
                for d in range(ORDER):
                    value = 0.0
                    for p in range(DEGREE, -1, -1):
                        value = value * tau + basis[i, d, p]
                    weights[j, d] = value
                chord = vertex if vertex >= 0 else ~vertex
                slide[j] = 1.0
                if vertex < 0:  # an ellipse inside what is within the radius of the chord
                    near = min(u - here[chord], here[chord + 1] - u)
                    slide[j] = max(radius[j] / (near + radius[j]), SLIDE)
                for k in range(axes):
                    direction[j, k] = along[a + chord, k]
                    target[j, k] = point[a + chord, k]
                    if vertex < 0:
                        target[j, k] += (
                            (u - here[chord])
                            / (here[chord + 1] - here[chord])
                            * (points[chord + 1, k] - points[chord, k])
                        )
                used = site_distance(j, c, span, weights, target, direction, slide, e) / radius[j]
                if used > INSIDE:
                    outside[span_first[q] + i] = True
                if used > ROOM:
                    bad += 1
                    # knots nearer to each other at the vertices around
                    lo, hi = 0, len(inner)
                    while lo < hi:
                        mid = (lo + hi) // 2
                        if inner[mid] < u - 2.0 * width:
                            lo = mid + 1
                        else:
                            hi = mid
                    while lo < len(inner) and inner[lo] <= u + 2.0 * width:
                        h[lo] = min(h[lo], DENSER * width)
                        lo += 1
            if bad == 0 or attempt == DENSER_MAX:
                break
            h = graded(inner, h)
        for i in range(spans):
            if outside[span_first[q] + i]:
                fits[q] = False
        span_first[q + 1], site_first[q + 1] = span_first[q] + spans, site_first[q] + m
        breaks = _grown1(breaks, span_first[q + 1] + q + 1)
        control = _grown2(control, span_first[q + 1] + DEGREE * (q + 1))
        for i in range(spans + 1):
            breaks[span_first[q] + q + i] = cut[i]
        for i in range(spans + DEGREE):
            for k in range(axes):
                control[span_first[q] + DEGREE * q + i, k] = c[i, k]
    m, n = site_first[runs], span_first[runs]
    return (
        span_first, breaks[: n + runs].copy(), control[: n + DEGREE * runs].copy(), site_first, span[:m].copy(), where[:m].copy(),
        weights[:m].copy(), target[:m].copy(), direction[:m].copy(), slide[:m].copy(), radius[:m].copy(),
        outside[:n].copy(), fits,
    )  # fmt: skip
