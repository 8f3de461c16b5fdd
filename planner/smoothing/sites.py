"""The splines of a path, one a run, and their sites: where the distance from the path is bounded.

Sites are all vertices of the corridor, each with a ball around it, and between distant ones places on the
chords `SITE_SPACING` of a span apart, around which the spline may slide along the chord. Site j bounds the
weighted distance

    |e_j| <= radius_j,     e_j = d_j - (1 - slide_j) t_j (t_j . d_j),     d_j = p(u_j) - q_j,

q_j its target and t_j the direction of the chord, along which the spline may leave q_j by radius_j/slide_j;
slide = 1 is a ball. What happens between sites is up to the certificate (certificate.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, ORDER, knots_at


class Splines(NamedTuple):
    """All runs one after the other; run q holds the breaks span_first[q] + q : span_first[q+1] + q + 1, the
    control points span_first[q] + 5 q : span_first[q+1] + 5 (q+1), and the sites site_first[q] :
    site_first[q+1]."""

    span_first: Array  # (Q+1,)
    breaks: FloatArray  # (S+Q,) along the legs [mm]
    control: FloatArray  # (n, A) [mm]
    site_first: Array  # (Q+1,)
    sites: Sites  # (J, ..), their radii the whole tolerance
    outside: Array  # (S,) spans with a site that the first spline passes too far away
    fits: Array  # (Q,) True if it is inside the corridor everywhere


@njit(cache=True, error_model="numpy")
def run_knots(splines, q):
    """The knots of run q."""
    return knots_at(splines.breaks[splines.span_first[q] + q : splines.span_first[q + 1] + q + 1])


@njit(cache=True, error_model="numpy")
def control_first(splines, q):
    """Number of the first control point of run q."""
    return splines.span_first[q] + DEGREE * q


@njit(cache=True, error_model="numpy")
def run_control(splines, q):
    """The control points of run q."""
    return splines.control[control_first(splines, q) : control_first(splines, q + 1)]


@njit(cache=True, error_model="numpy")
def run_sites(splines, q):
    """The sites of run q."""
    return sites_between(splines.sites, splines.site_first[q], splines.site_first[q + 1])


# These constants decide how much the certificate has to ask for later.
SITE_SPACING = 0.5  # of sites on chords [spans]
SITE_EDGE = 0.1  # no site on a chord so close to its ends, which are sites themselves [spans]
# Vertices nearer than this to the site before are left to the certificate [spans] ...
SITES_DENSE = 0.125
DENSE_TURN = 0.1  # ... unless the path turns there by more [rad]
SLIDE = 0.1  # a site on a chord may slide along it by its radius over this, less near the chord's ends [-]


class Sites(NamedTuple):
    """J sites of a spline over A axes, ascending; or of all splines of a path one after the other."""

    span: Array  # (J,) span of each site, counted within its run; also the first of its six control points
    place: FloatArray  # (J,) along the legs [mm]
    weights: FloatArray  # (J, 6) the basis functions there
    target: FloatArray  # (J, A) q [mm]
    along: FloatArray  # (J, A) t
    slide: FloatArray  # (J,)
    radius: FloatArray  # (J,) [mm]


@njit(cache=True, error_model="numpy")
def site_distance(sites, j, control, begin, e):
    """e_j (module text) into e (A,); returns |e_j| [mm]. `control` holds the control points from number
    `begin` on."""
    axes = len(e)
    dot = 0.0
    for k in range(axes):
        d = -sites.target[j, k]
        for b in range(ORDER):
            d += sites.weights[j, b] * control[sites.span[j] - begin + b, k]
        e[k] = d
        dot += d * sites.along[j, k]
    square = 0.0
    for k in range(axes):
        e[k] -= (1.0 - sites.slide[j]) * dot * sites.along[j, k]
        square += e[k] * e[k]
    return np.sqrt(square)


@njit(cache=True, error_model="numpy")
def used_share(sites, control):
    """(J,) |e_j| over the radius."""
    used, e = np.empty(len(sites.span)), np.empty(control.shape[1])
    for j in range(len(used)):
        used[j] = site_distance(sites, j, control, 0, e) / sites.radius[j]
    return used


@njit(cache=True, error_model="numpy")
def sites_between(sites, a, b):
    """The sites a .. b - 1."""
    span, place, weights, target, along, slide, radius = sites
    return Sites(span[a:b], place[a:b], weights[a:b], target[a:b], along[a:b], slide[a:b], radius[a:b])


@njit(cache=True, error_model="numpy")
def with_radius(sites, radius):
    """The sites with other radii (J,)."""
    return Sites(sites.span, sites.place, sites.weights, sites.target, sites.along, sites.slide, radius)


@njit(cache=True, error_model="numpy")
def _places(corridor, breaks):
    """Places, vertices or chords (~chord) and radii (J,) of the sites of a run."""
    place = corridor.place
    vertices, spans = len(place), len(breaks) - 1
    parts = int(np.ceil(1.0 / SITE_SPACING))
    # at most every vertex, and on every part of a chord within a span its places there
    most = vertices + (spans + vertices) * parts
    where, owner, radius = np.empty(most), np.empty(most, np.int64), np.empty(most)
    n = 0
    span = 0
    before = -np.inf
    for v in range(vertices):
        inner = 0 < v < vertices - 1
        while span + 1 < spans and breaks[span + 1] <= place[v]:
            span += 1
        dense = place[v] - before < SITES_DENSE * (breaks[span + 1] - breaks[span])
        if inner and (corridor.turn[v] > DENSE_TURN or not dense):
            where[n], owner[n], radius[n] = place[v], v, corridor.tol[v]
            n += 1
            before = place[v]
        if v + 1 == vertices:
            break
        # on the chord that follows
        i = span
        while i < spans and breaks[i] < place[v + 1]:
            h = breaks[i + 1] - breaks[i]
            for part in range(parts):
                u = breaks[i] + h * (part + 0.5) / parts
                if place[v] + SITE_EDGE * h < u < place[v + 1] - SITE_EDGE * h:
                    where[n], owner[n], radius[n] = u, ~v, corridor.tol_chord[v]
                    n += 1
            i += 1
    return where[:n].copy(), owner[:n], radius[:n].copy()


@njit(cache=True, error_model="numpy")
def sites_of_run(corridor, knots):
    """The sites of one run, their radii the whole tolerance."""
    where, owner, radius = _places(corridor, knots.breaks)
    n, axes = len(where), corridor.point.shape[1]
    span, weights, slide = np.empty(n, np.int64), np.empty((n, ORDER)), np.ones(n)
    target, along = np.empty((n, axes)), np.empty((n, axes))
    i = 0
    for j in range(n):
        while i + 2 < len(knots.breaks) and knots.breaks[i + 1] <= where[j]:
            i += 1
        span[j] = i
        tau = (where[j] - knots.breaks[i]) / (knots.breaks[i + 1] - knots.breaks[i])
        for d in range(ORDER):
            value = 0.0
            for p in range(DEGREE, -1, -1):
                value = value * tau + knots.basis[i, d, p]
            weights[j, d] = value
        v = owner[j] if owner[j] >= 0 else ~owner[j]
        for k in range(axes):
            along[j, k] = corridor.along[v, k]
            target[j, k] = corridor.point[v, k]
        if owner[j] < 0:  # an ellipse inside what is within the radius of the chord
            since, until = where[j] - corridor.place[v], corridor.place[v + 1] - where[j]
            near = min(since, until)
            slide[j] = max(radius[j] / (near + radius[j]), SLIDE)
            for k in range(axes):
                step = corridor.point[v + 1, k] - corridor.point[v, k]
                target[j, k] += since / (corridor.place[v + 1] - corridor.place[v]) * step
    return Sites(span, where, weights, target, along, slide, radius)
