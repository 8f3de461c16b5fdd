"""Where a spline passes the joints of the blocks that it stands for.

A span stands for what is programmed between two places (geometry/spline.py), but only the run as a whole does so within the tolerance:
its shape slides along the path, by several tolerances where that is faster. So the curve is matched with the path in order
(geometry/point_matching.py), at points whose chords leave it by `CHORD_FRACTION` of the tolerance at most.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.geometry.legs import Legs
from planner.geometry.point_matching import CHORD_FRACTION, PathChain, chain_of, in_order
from planner.geometry.spline import Spline, span_point
from planner.geometry.toolpath import Toolpath

LOOKED_AT = 5  # places on a span at which its bend is looked at


def passed_places(toolpath: Toolpath, legs: Legs, spline: Spline) -> FloatArray:
    """(M+1,) where the smooth path passes the start of each of M segments, counted like `Legs.place` [mm].

    Where a run of the spline replaces the legs it is the place that the spans give the curve's point there, elsewhere `Legs.place`.
    """
    place = legs.place.copy()
    if not len(spline):
        return place
    begin = place[legs.first[spline.joint_first - 1]] + spline.x_first
    end = place[legs.first[spline.joint_last]] + spline.x_last
    low = np.clip(np.searchsorted(place, begin, side="right") - 1, 0, len(toolpath) - 1)
    high = np.clip(np.searchsorted(place, end, side="left") - 1, low, len(toolpath) - 1)
    _pass_runs(spline.spans, spline.first, (low, high), chain_of(toolpath), place)
    return place


@njit(cache=True, error_model="numpy")
def _chords(spans, i, tolerance, out):
    """How many chords of span i leave it by `CHORD_FRACTION` of the tolerance: a chord over a fraction h of it by |r''| h^2/8."""
    most_sq = 0.0
    for n in range(LOOKED_AT):
        span_point(spans, i, n / (LOOKED_AT - 1.0), out)
        bend_sq = 0.0
        for k in range(out.shape[1]):
            bend_sq += out[2, k] * out[2, k]
        most_sq = max(most_sq, bend_sq)
    return max(int(np.ceil(np.sqrt(np.sqrt(most_sq) / (8.0 * CHORD_FRACTION * tolerance)))), 2)


@njit(cache=True, error_model="numpy")
def _pass_runs(spans, run_first, segments, chain, place):
    """Write into place (M+1,) where the runs (Q,) pass the starts of their segments but the first.

    run_first : (Q+1,) first span of each run
    segments  : (Q,) first and (Q,) last segment of each run
    """
    low, high = segments
    vertex, at_vertex, budget, skipped, feed, segment_of, first = chain
    axes = vertex.shape[1]
    out = np.empty((4, axes))
    for q in range(len(low)):
        a, b = first[low[q]], first[high[q] + 1]
        tolerance = at_vertex[a]
        for i in range(a, b + 1):
            tolerance = min(tolerance, at_vertex[i])
        count = 1
        for i in range(run_first[q], run_first[q + 1]):
            count += _chords(spans, i, tolerance, out)
        point, at = np.empty((count, axes)), np.empty(count)
        n = 0
        for i in range(run_first[q], run_first[q + 1]):
            chords = _chords(spans, i, tolerance, out)
            for m in range(chords + (i + 1 == run_first[q + 1])):
                tau = m / chords
                span_point(spans, i, tau, out)
                point[n], at[n] = out[0], spans[i].begin + tau * spans[i].width
                n += 1
        links = PathChain(
            vertex[a : b + 1],
            at_vertex[a : b + 1],
            budget[a:b],
            skipped[a:b],
            feed[a:b],
            segment_of[a:b],
            first,
        )
        matched, _, crossed = in_order(links, point, np.zeros(count))
        if not matched:
            continue
        for segment in range(low[q] + 1, high[q] + 1):
            c = crossed[first[segment] - a]
            n = min(int(c), count - 2)
            place[segment] = at[n] + (c - n) * (at[n + 1] - at[n])
