"""Where a spline passes the joints of the blocks that it stands for.

A span stands for what is programmed between two places (geometry/spline.py), but only the run as a whole does
so within the tolerance: its shape slides along the path, by several tolerances where that is faster. So the
curve is matched with the path in order (geometry/point_matching.py), at points whose chords leave it by
`CHORD_FRACTION` of the tolerance at most. A joint V is passed where the curve C is nearest to it, (C - V) . C'
= 0, next to where it was matched; those that would not be in order are passed together, V the mean of them.
Points of an arc that are `ARC_ANGLE` apart are passed likewise. Behind the place of a joint the feed is that
of the next block; it is found to rounding where the feed changes.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.geometry.chords import points_on
from planner.geometry.legs import Legs
from planner.geometry.point_matching import CHORD_FRACTION, SAME_PLACE, PathChain, chain_of, in_order
from planner.geometry.spline import Spline, span_point
from planner.geometry.toolpath import Toolpath

LOOKED_AT = 5  # places on a span at which its bend is looked at
# Between points of an arc passed in order [rad]: an arc may not be passed backwards.
ARC_ANGLE = np.pi / 8
# Bisections of two chords for the nearest place: where the feed changes, and elsewhere.
FINE, COARSE = 50, 10


def passed_places(toolpath: Toolpath, legs: Legs, spline: Spline) -> FloatArray:
    """(M+1,) where the smooth path passes the start of each of M segments, counted like `Legs.place` [mm].

    Where a run of the spline replaces the legs it is the place that the spans give the curve's point there,
    elsewhere `Legs.place`.
    """
    place = legs.place.copy()
    if not len(spline):
        return place
    begin = place[legs.first[spline.joint_first - 1]] + spline.x_first
    end = place[legs.first[spline.joint_last]] + spline.x_last
    low = np.clip(np.searchsorted(place, begin, side="right") - 1, 0, len(toolpath) - 1)
    high = np.clip(np.searchsorted(place, end, side="left") - 1, low, len(toolpath) - 1)
    chain = chain_of(toolpath)
    _pass_runs(spline.spans, spline.first, (low, high), chain, _marks(toolpath, chain), place)
    return place


class _Marks(NamedTuple):
    """Points that are passed in order: the start of each segment, and points of arcs."""

    segment: Array  # (K,) it is on, first (M+1,) mark of each segment
    first: Array
    point: FloatArray  # (K, A) [mm]
    link: Array  # (K,) of the chain (point_matching.py)
    fine: Array  # (K,) whether the feed changes there


def _marks(toolpath: Toolpath, chain: PathChain) -> _Marks:
    is_arc = toolpath.arc >= 0
    count = np.ones(len(toolpath), dtype=np.int64)
    angle = np.abs(toolpath.arcs.rate[toolpath.arc[is_arc]]) * toolpath.length[is_arc]
    count[is_arc] = np.maximum(1, np.ceil(angle / ARC_ANGLE - SAME_PLACE))
    segment = np.repeat(np.arange(len(toolpath)), count)
    first = np.append(0, np.cumsum(count))
    share = (np.arange(len(segment)) - first[segment]) / count[segment]
    point = toolpath.start[segment].copy()
    inner = np.flatnonzero(share)
    point[inner] = points_on(toolpath, segment[inner], toolpath.length[segment[inner]] * share[inner])
    links = np.diff(chain.first)[segment]
    changes = np.append(False, toolpath.feed[1:] != toolpath.feed[:-1])
    return _Marks(
        segment=segment,
        first=first,
        point=point,
        link=chain.first[segment] + (share * links).astype(np.int64),
        fine=changes[segment] & (share == 0.0),
    )


@njit(cache=True, error_model="numpy")
def _chords(spans, i, tolerance, out):
    """How many chords of span i leave it by `CHORD_FRACTION` of the tolerance: a chord over a fraction h of
    it by |r''| h^2/8."""
    most_sq = 0.0
    for n in range(LOOKED_AT):
        span_point(spans, i, n / (LOOKED_AT - 1.0), out)
        bend_sq = 0.0
        for k in range(out.shape[1]):
            bend_sq += out[2, k] * out[2, k]
        most_sq = max(most_sq, bend_sq)
    return max(int(np.ceil(np.sqrt(np.sqrt(most_sq) / (8.0 * CHORD_FRACTION * tolerance)))), 2)


@njit(cache=True, error_model="numpy")
def _away(spans, of, x, vertex, out):
    """(C - V) . C' at the place x [mm] on span `of`: how the distance grows; negative where it falls."""
    span_point(spans, of, min(max((x - spans[of].begin) / spans[of].width, 0.0), 1.0), out)
    grows = 0.0
    for k in range(out.shape[1]):
        grows += (out[0, k] - vertex[k]) * out[1, k]
    return grows


@njit(cache=True, error_model="numpy")
def _apart_sq(point, vertex):
    square = 0.0
    for k in range(len(point)):
        square += (point[k] - vertex[k]) ** 2
    return square


@njit(cache=True, error_model="numpy")
def _nearest(spans, of, points, near, least, vertex, bisections, out):
    """The place [mm] nearest to a vertex, downhill from the point `near` and not before `least`."""
    point, at = points
    m, last = near, len(at) - 1
    while m < last and (at[m] < least or _apart_sq(point[m + 1], vertex) < _apart_sq(point[m], vertex)):
        m += 1
    while m > 0 and at[m - 1] > least and _apart_sq(point[m - 1], vertex) < _apart_sq(point[m], vertex):
        m -= 1
    if m > 0 and at[m] > least and _away(spans, of[m - 1], at[m], vertex, out) > 0.0:
        m -= 1
    low, high = max(at[m], least), at[min(m + 1, last)]
    on = of[m]
    if high <= low or _away(spans, on, low, vertex, out) >= 0.0:
        return low
    for _ in range(bisections):
        middle = 0.5 * (low + high)
        if _away(spans, on, middle, vertex, out) < 0.0:
            low = middle
        else:
            high = middle
    return high


@njit(cache=True, error_model="numpy")
def _in_order_places(spans, of, points, near, marks, begin, end, out, passes):
    """The places (end - begin,) [mm] of the marks from `begin` on, each the nearest one next to the chord
    `near`. Where these are not in order the marks are passed together, at the place nearest to the mean of
    them: the sum of their squares is least there."""
    at = points[1]
    group = np.empty(end - begin, np.int64)  # the first mark of each group
    groups = 0
    for i in range(end - begin):
        group[groups], groups = i, groups + 1
        steps = FINE if marks.fine[begin + i] else COARSE
        passes[i] = _nearest(spans, of, points, near[i], at[0], marks.point[begin + i], steps, out)
        while groups > 1 and passes[i] < passes[group[groups - 1] - 1]:
            groups -= 1
            low = group[groups - 1]
            middle = np.zeros(out.shape[1])
            for m in range(low, i + 1):
                for k in range(len(middle)):
                    middle[k] += marks.point[begin + m, k] / (i + 1 - low)
            together = _nearest(spans, of, points, near[i], at[0], middle, FINE, out)
            for m in range(low, i + 1):
                passes[m] = together


@njit(cache=True, error_model="numpy")
def _pass_runs(spans, run_first, segments, chain, marks, place):
    """Write into place (M+1,) where the runs (Q,) pass the starts of their segments but the first."""
    low, high = segments
    vertex, at_vertex, budget, skipped, feed, segment_of, first = chain
    axes = vertex.shape[1]
    out = np.empty((4, axes))
    passes = np.empty(len(marks.link))
    for q in range(len(low)):
        a, b = first[low[q]], first[high[q] + 1]
        tolerance = at_vertex[a]
        for i in range(a, b + 1):
            tolerance = min(tolerance, at_vertex[i])
        count = 1
        for i in range(run_first[q], run_first[q + 1]):
            count += _chords(spans, i, tolerance, out)
        point, at, of = np.empty((count, axes)), np.empty(count), np.empty(count, np.int64)
        n = 0
        for i in range(run_first[q], run_first[q + 1]):
            chords = _chords(spans, i, tolerance, out)
            for m in range(chords + (i + 1 == run_first[q + 1])):
                tau = m / chords
                span_point(spans, i, tau, out)
                point[n], at[n], of[n] = out[0], spans[i].begin + tau * spans[i].width, i
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
        begin, end = marks.first[low[q]] + 1, marks.first[high[q]] + 1
        near = np.empty(end - begin, np.int64)
        for mark in range(begin, end):
            near[mark - begin] = min(int(crossed[marks.link[mark] - a]), count - 2)
        _in_order_places(spans, of, (point, at), near, marks, begin, end, out, passes[begin:end])
        for mark in range(begin, end):
            if marks.first[marks.segment[mark]] == mark:
                place[marks.segment[mark]] = passes[mark]
