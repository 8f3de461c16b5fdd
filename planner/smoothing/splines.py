"""The splines of a path: one for each run, all of them in one record of arrays."""

from __future__ import annotations

from typing import NamedTuple

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, knots_at
from planner.smoothing.sites import Sites


class Splines(NamedTuple):
    """All runs one after the other; run q holds the breaks span_first[q] + q : span_first[q+1] + q + 1, the control points
    span_first[q] + 5 q : span_first[q+1] + 5 (q+1), and the sites site_first[q] : site_first[q+1]."""

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
    a, b = splines.site_first[q], splines.site_first[q + 1]
    sites = splines.sites
    return Sites(
        sites.span[a:b],
        sites.place[a:b],
        sites.weights[a:b],
        sites.target[a:b],
        sites.along[a:b],
        sites.slide[a:b],
        sites.radius[a:b],
    )
