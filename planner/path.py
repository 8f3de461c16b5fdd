"""The smooth path sampled along its arc length, on a grid that adapts until linear interpolation is good enough.

A second-order solver sees the axis acceleration g(s) = r'(s) u + r''(s) x(s) only at grid points; in an interval u is constant
and x = feed^2 linear. Between the points g leaves the chord of its end values by at most (midpoint values, one interval of
length h, fastest x and largest u that the limits allow there)

    e_k = x |r''_mid - (r''_0 + r''_1)/2|  +  u h |r''_1 - r''_0|/2  +  u |r'_mid - (r'_0 + r'_1)/2|        per axis k

(the second term comes from the product of two linear functions). An interval is halved until max_k e_k / a_k is below
`RESOLUTION`; for solvers of third order the error of the axis jerk at constant speed, relative to its limit, may be `JERK_SHARE`
times as large, and x is bounded by the jerk limits as well. What remains is kept per interval as `margin`, and the constraints are
tightened by it, so that they hold between
grid points and not only at them. Straight stretches need one interval: there g is exactly linear.

Limits of the form kappa x <= X hold between the points by another device that costs nothing at the apex of a corner. A cap X/kappa
is convex there, so a line through two caps would cut the corner; the end with the larger curvature keeps its cap and the other
end gets a slightly larger *effective* curvature, such that the line meets X/kappa_mid in the middle:

    1/kappa_low = min(1/kappa_low, 2/kappa_mid - 1/kappa_high);     both ends kappa_mid where that is the largest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from planner.arrays import Array, FloatArray, freeze
from planner.corners.blend import shape_at
from planner.corners.elements import (
    ElementTable,
    element_length,
    element_point,
    element_table,
    to_arc_length,
)
from planner.corners.smooth import SmoothPath
from planner.geometry.toolpath import Joint
from planner.machine import Machine

# Interpolation error of the axis accelerations that the grid may have [share of the limit]. The cycle time is then 0.6e-3 to 3e-3
# above that of an infinitely fine grid on the shared jobs (tests/path): first order in the step, because u is constant on it.
RESOLUTION = 2e-3
# The midpoint is not quite the worst place of an interval: safety factor on the margin [-].
MARGIN_SAFETY = 1.25
# Jobs with more corners than the first number get the second resolution instead, or their grids would fill the memory (a relief of
# 170,000 sharp corners: 20 million points); it costs another 0.3 to 0.5 % of the cycle time.
MANY_CORNERS, COARSE_RESOLUTION = 50_000, 1e-2
# The jerk between grid points may be off by so many times `resolution` [-]: 1 %, made good by slowing down (methods/optimal.py).
JERK_SHARE = 5.0
# Halvings of one interval at most; 2^-20 of a corner is below a nanometre.
HALVINGS_MAX = 20
# Arcs start with intervals of at most this angle [rad], so that no full turn hides between two equal points.
ARC_STEP = np.pi / 8
# ... and with so many at least, so that a short arc between two stops can start and stop.
ARC_PARTS_MIN = 4
# For solvers of third order an interval on an arc lasts at most this share of a/j, the time an axis needs for its acceleration [-].
ARC_PERIOD = 0.5
# ... and the first interval after a full stop is what the jerk makes of this share of a/j; from there intervals may be this share
# of their distance from the stop [-].
REST_PERIOD = 0.25
REST_GROWTH = 0.5
# Free parts of legs shorter than this share of the leg are nothing but rounding: longer ones are at least CLOSE [-].
FREE_PART_MIN = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class PathSamples:
    """The path on a grid: G pieces between full stops, P points in all, one interval to the right of every point but the last of
    each piece. At a full stop the point is there twice, as the end of one piece and the start of the next.

    piece     : (G+1,) piece g holds the points piece[g] : piece[g+1]
    stop      : (G+1,) joint (0..R) at which each piece starts; the last entry is the end of the path
    s         : (P,) arc length from the start of the job [mm]
    position  : (P, A) [mm]
    d1        : (P, A) r' = dr/ds
    d2_left, d2_right : (P, A) r'' just before and just after the point [1/mm]; they differ where the curvature jumps
    d3_left, d3_right : (P, A) r''' [1/mm2]
    element   : (P,) element of the interval to the right (corners/elements.py); of the last interval at a piece's end
    w0, w1    : (P,) parameter range of that interval on its element
    segment   : (P,) toolpath segment of that interval
    margin    : (P,) interpolation error of that interval, share of the acceleration limits [-]
    kappa_left, kappa_right : (P,) effective curvature in the intervals to the left and to the right [1/mm]
    """

    path: SmoothPath
    table: ElementTable
    piece: Array
    stop: Array
    s: FloatArray
    position: FloatArray
    d1: FloatArray
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    element: Array
    w0: FloatArray
    w1: FloatArray
    segment: Array
    margin: FloatArray
    kappa_left: FloatArray
    kappa_right: FloatArray

    def __post_init__(self) -> None:
        points, axes = np.shape(self.position)
        freeze(self, "piece", np.int64, (None,))
        freeze(self, "stop", np.int64, (len(self.piece),))
        for name in ("s", "w0", "w1", "margin", "kappa_left", "kappa_right"):
            freeze(self, name, np.float64, (points,))
        for name in ("position", "d1", "d2_left", "d2_right", "d3_left", "d3_right"):
            freeze(self, name, np.float64, (points, axes))
        for name in ("element", "segment"):
            freeze(self, name, np.int64, (points,))

    def __len__(self) -> int:
        return len(self.s)

    @property
    def intervals(self) -> Array:
        """Indices of the points that have an interval to their right."""
        inner = np.ones(len(self), dtype=bool)
        inner[self.piece[1:] - 1] = False
        return np.flatnonzero(inner)


def sample_path(
    path: SmoothPath, machine: Machine, resolution: float | None = None, *, third_order: bool = False
) -> PathSamples:
    """Sample a smooth path on an adaptive grid.

    resolution  : interpolation error allowed between grid points [share of the acceleration limits]; None for `RESOLUTION`, or
                  `COARSE_RESOLUTION` where there are many corners
    third_order : the grid is for a solver with jerk limits

    Raises InputError if the machine lacks an axis of the path.
    """
    axes = path.toolpath.axes
    if resolution is None:
        resolution = RESOLUTION if np.count_nonzero(path.d) <= MANY_CORNERS else COARSE_RESOLUTION
    table = element_table(path)
    velocity, acceleration = machine.limits("velocity", axes), machine.limits("acceleration", axes)
    jerk, longest, shortest = np.full(len(axes), np.inf), np.inf, np.inf
    if third_order:
        jerk = machine.limits("jerk", axes)
        delay = float((acceleration / jerk).min())
        longest = ARC_PERIOD * delay
        shortest = float(jerk.min()) * (REST_PERIOD * delay) ** 3 / 6.0
    if machine.normal_acceleration is not None:
        acceleration = np.minimum(acceleration, machine.normal_acceleration)
    element, w0, w1, segment, last = _grid(
        table.legs,
        table.corners,
        path.legs.first,
        path.legs.offset,
        path.d_in,
        path.d_out,
        path.joint == Joint.STOP,
        _corner_breaks(path),
        path.toolpath.feed,
        velocity,
        acceleration,
        jerk,
        resolution,
        longest,
        shortest,
    )
    ends = np.flatnonzero(last)  # the points that close a piece
    piece = np.concatenate([[0], ends + 1])
    stop = np.flatnonzero(path.joint == Joint.STOP)
    feed = path.toolpath.feed
    columns = _evaluate(
        table.legs, table.corners, element, w0, w1, segment, last, feed, velocity, acceleration, jerk
    )
    names = (
        "s",
        "position",
        "d1",
        "d2_left",
        "d2_right",
        "d3_left",
        "d3_right",
        "margin",
        "kappa_left",
        "kappa_right",
    )
    return PathSamples(
        path=path,
        table=table,
        piece=piece,
        stop=stop,
        element=element,
        w0=w0,
        w1=w1,
        segment=segment,
        **dict(zip(names, columns, strict=True)),
    )


def insert_points(samples: PathSamples, interval: Array, s: FloatArray) -> PathSamples:
    """Add grid points at arc lengths `s` (n,) inside straight intervals (n,), sorted by place.

    Raises ValueError if one of the intervals is not straight: on curves a new point needs new geometry.
    """
    table = samples.table
    element = samples.element[interval]
    if (element < 0).any() or table.legs["round"][np.maximum(element, 0)].any():
        raise ValueError("insert_points: only straight intervals can be split")
    after = interval + 1
    ds = s - samples.s[interval]
    w = samples.w0[interval] + ds

    def put(values: Array, new: Array | float) -> Array:
        return np.insert(values, after, new, axis=0)

    w0 = put(samples.w0, w)
    w1 = put(samples.w1, samples.w1[interval])
    place = interval + 1 + np.arange(len(interval))  # where the new points are now
    w1[place - 1] = w
    zero = np.zeros((len(interval), samples.d1.shape[1]))
    return PathSamples(
        path=samples.path,
        table=table,
        piece=samples.piece + np.searchsorted(interval, samples.piece, side="left"),
        stop=samples.stop,
        s=put(samples.s, s),
        position=put(samples.position, samples.position[interval] + ds[:, None] * samples.d1[interval]),
        d1=put(samples.d1, samples.d1[interval]),
        d2_left=put(samples.d2_left, zero),
        d2_right=put(samples.d2_right, zero),
        d3_left=put(samples.d3_left, zero),
        d3_right=put(samples.d3_right, zero),
        element=put(samples.element, element),
        w0=w0,
        w1=w1,
        segment=put(samples.segment, samples.segment[interval]),
        margin=put(samples.margin, samples.margin[interval]),
        kappa_left=put(samples.kappa_left, 0.0),
        kappa_right=put(samples.kappa_right, 0.0),
    )


def _corner_breaks(path: SmoothPath) -> FloatArray:
    """(R+1, B) parameters where each corner starts with a grid point, ascending, padded with 1.

    Quarters besides the shape's own breaks, so that no symmetric half is mistaken for a straight line.
    """
    always = (0.25, 0.5, 0.75)
    blended = np.flatnonzero(path.d > 0)
    width = 3 if not len(blended) else max(len(path.corner.breaks(path.params[blended[0]])), 1) + 8
    out = np.ones((len(path.d), width))
    if path.corner.shape == 0:
        out[:, :3] = always
        return out
    for k in blended:
        points = sorted(set(path.corner.breaks(path.params[k])) | set(always))
        out[k, : len(points)] = points
    return out


@njit(cache=True, error_model="numpy")
def _interval_error(points, x, u, h, acceleration, jerk):
    """max_k e_k / a_k of the module's text, from arc-length derivatives (3, 4, A) at left end, middle and right end."""
    worst = 0.0
    for k in range(points.shape[2]):
        left, mid, right = points[0, 2, k], points[1, 2, k], points[2, 2, k]
        curve = x * abs(mid - 0.5 * (left + right))
        product = 0.5 * u * h * abs(right - left)
        turn = u * abs(points[1, 1, k] - 0.5 * (points[0, 1, k] + points[2, 1, k]))
        bend = x * np.sqrt(x) * abs(points[1, 3, k] - 0.5 * (points[0, 3, k] + points[2, 3, k]))
        worst = max(worst, (curve + product + turn) / acceleration[k], bend / (JERK_SHARE * jerk[k]))
    return worst


@njit(cache=True, error_model="numpy")
def _fastest(point, feed, velocity, acceleration, jerk):
    """Bounds (x, u) of feed^2 and of the acceleration along the path that the limits allow at a point (4, A)."""
    feed_max = feed
    u = 0.0
    normal = 0.0
    kappa_sq, slope_sq, a_sq, j_sq = 0.0, 0.0, 0.0, 0.0
    for k in range(point.shape[1]):
        along = abs(point[1, k])
        if along * feed_max > velocity[k]:
            feed_max = velocity[k] / along
        u += along * acceleration[k]
        normal += abs(point[2, k]) * acceleration[k]
        kappa_sq += point[2, k] * point[2, k]
        slope_sq += point[3, k] * point[3, k]
        a_sq += acceleration[k] * acceleration[k]
        j_sq += jerk[k] * jerk[k]
    x = feed_max * feed_max
    if normal < x * kappa_sq:  # kappa x at most sum_k a_k |n_k|, the support of the box along the normal
        x = normal / kappa_sq
    # the third derivative times v^3 is at most |j| + 3 kappa v |a|, and kappa v^2 at most |a|
    jerk_max = np.sqrt(j_sq) + 3.0 * np.sqrt(np.sqrt(kappa_sq)) * a_sq**0.75
    if jerk_max * jerk_max < x * x * x * slope_sq:
        x = (jerk_max * jerk_max / slope_sq) ** (1.0 / 3.0)
    return x, u


@njit(cache=True, error_model="numpy")
def _measure(legs, corners, element, wa, wb, feed, velocity, acceleration, jerk, work, points):
    """Evaluate an interval at left end, middle and right end into points (3, 4, A); returns its interpolation error."""
    w_ref = 0.5 * (wa + wb)
    x_ends = 0.0
    x, u, speed = 0.0, 0.0, 0.0
    for j in range(3):
        w = wa if j == 0 else (w_ref if j == 1 else wb)
        element_point(legs, corners, element, w, w_ref, work, points[j])
        speed_here = to_arc_length(points[j])
        x_here, u_here = _fastest(points[j], feed, velocity, acceleration, jerk)
        if j == 1:
            x, u, speed = x_here, u_here, speed_here
        else:
            x_ends = max(x_ends, x_here)
    return _interval_error(points, min(x, x_ends), u, speed * (wb - wa), acceleration, jerk)


@njit(cache=True, error_model="numpy")
def _subdivide(
    legs, corners, element, wa, wb, feed, velocity, acceleration, jerk, resolution, rest, work, points, out
):
    """Halve [wa, wb] until every part's error is below `resolution`; right ends into out, returns their number.

    rest : distances from the last full stop of wa and wb, of the next stop from the last, and the length of the first interval
           after a stop; intervals grow in proportion to their distance from the nearer stop
    """
    from_a, from_b, to_next, shortest = rest
    stack = np.empty(HALVINGS_MAX + 1)
    stack[0] = wb
    depth = 1
    count = 0
    left = wa
    while depth > 0:
        right = stack[depth - 1]
        error = _measure(
            legs, corners, element, left, right, feed, velocity, acceleration, jerk, work, points
        )
        share = (0.5 * (left + right) - wa) / (wb - wa)
        away = from_a + (from_b - from_a) * share
        away = min(away, to_next - away)
        h = (from_b - from_a) * (right - left) / (wb - wa)
        coarse = error > resolution or h > max(shortest, REST_GROWTH * away)
        if coarse and depth <= HALVINGS_MAX and count + depth < len(out):
            stack[depth] = 0.5 * (left + right)
            depth += 1
        else:
            out[count] = right
            count += 1
            depth -= 1
            left = right
    return count


@njit(cache=True, error_model="numpy")
def _corner_parameter(corners, k, z):
    """w of corner k whose matched point lies z [mm] after the vertex, Y(w) - X(w) = z (corners/blend.py)."""
    wa, wb = 0.0, 1.0
    for _ in range(60):
        w = 0.5 * (wa + wb)
        X, Y = shape_at(corners[k], w, w)
        if Y[0] - X[0] < z:
            wa = w
        else:
            wb = w
    return 0.5 * (wa + wb)


@njit(cache=True, error_model="numpy")
def _grown(array, needed):
    if needed <= len(array):
        return array
    out = np.empty(max(2 * len(array), needed), array.dtype)
    for i in range(len(array)):  # a slice assignment costs 4 s of compilation for its error message
        out[i] = array[i]
    return out


@njit(cache=True, error_model="numpy")
def _arc_feed(leg, feed, velocity, acceleration):
    """A bound of the feed on an arc: programmed, what all axes reach together, and what they can turn with."""
    v_sq, a_sq = 0.0, 0.0
    for k in range(len(velocity)):
        v_sq += velocity[k] * velocity[k]
        a_sq += acceleration[k] * acceleration[k]
    return min(feed, np.sqrt(v_sq), np.sqrt(np.sqrt(a_sq) / (leg.radius * leg.rate * leg.rate)))


@njit(cache=True, error_model="numpy")
def _grid(
    legs,
    corners,
    first,
    offset,
    d_in,
    d_out,
    is_stop,
    breaks,
    feed,
    velocity,
    acceleration,
    jerk,
    resolution,
    longest,
    shortest,
):
    """Intervals of the whole path in order; a closing row (w0 = w1) where a piece ends.

    longest  : duration of an interval on arcs at the fastest feed [s]
    shortest : length of the first interval after a full stop [mm]; both inf for second-order solvers

    Returns element, w0, w1, segment (P,) and `last` (P,), True on closing rows.
    """
    axes = len(velocity)
    work = np.empty((2, 4, axes))
    points = np.empty((3, 4, axes))
    ends = np.empty(1 << 14)
    size = 8 * len(legs) + 64
    element, segment = np.empty(size, np.int64), np.empty(size, np.int64)
    w0, w1 = np.empty(size), np.empty(size)
    last = np.empty(size, np.bool_)
    n = 0
    since, to_next = (
        0.0,
        0.0,
    )  # distance of the leg's start from the last full stop, and of the next stop from it
    for leg in range(len(legs)):
        length = legs[leg].length
        if is_stop[leg]:
            since, to_next = 0.0, 0.0
            for ahead in range(leg, len(legs)):
                to_next += legs[ahead].length
                if is_stop[ahead + 1]:
                    break
        curved = legs[leg].round
        # The leg's free part, then the corner behind it: spans (curve, wa, wb, seg) cut at the block boundaries.
        for half in range(3):  # 0: free part, 1: corner before its apex, 2: after it
            k = leg + 1
            if half == 0:
                if length - d_out[leg] - d_in[k] <= FREE_PART_MIN * length:
                    continue
            elif d_in[k] <= 0.0:
                continue
            owner = k if half == 2 else leg
            for seg in range(first[owner], first[owner + 1]):
                begin = offset[seg]
                end = offset[seg + 1] if seg + 1 < first[owner + 1] else legs[owner].length
                if half == 0:
                    wa, wb = max(begin, d_out[leg]), min(end, length - d_in[k])
                    if wb - wa <= FREE_PART_MIN * length:
                        continue
                    curve = leg
                elif half == 1:
                    if end <= length - d_in[k]:
                        continue
                    wa = _corner_parameter(corners, k, begin - length) if begin > length - d_in[k] else 0.0
                    wb = _corner_parameter(corners, k, end - length) if seg + 1 < first[owner + 1] else 0.5
                    curve = ~k
                else:
                    if begin >= d_out[k]:
                        break
                    wa = _corner_parameter(corners, k, begin) if seg > first[owner] else 0.5
                    wb = _corner_parameter(corners, k, end) if end < d_out[k] else 1.0
                    curve = ~k
                parts = 1
                if half == 0 and curved:
                    reach = longest * _arc_feed(legs[leg], feed[seg], velocity, acceleration)
                    parts = max(abs(legs[leg].rate) * (wb - wa) / ARC_STEP, (wb - wa) / reach, ARC_PARTS_MIN)
                    parts = int(np.ceil(parts))
                cut = 0
                left = wa
                while left < wb:
                    right = wb
                    if half == 0:
                        cut += 1
                        if cut < parts:
                            right = wa + (wb - wa) * cut / parts
                    else:
                        while cut < breaks.shape[1] and breaks[k, cut] <= left:
                            cut += 1
                        if cut < breaks.shape[1]:
                            right = min(wb, breaks[k, cut])
                    count = 1
                    ends[0] = right
                    if half > 0 or curved:
                        if half == 0:
                            rest = (since + left, since + right, to_next, shortest)
                        else:
                            vertex = since + length
                            X, Y = shape_at(corners[k], left, left)
                            from_left = vertex + Y[0] - X[0]
                            X, Y = shape_at(corners[k], right, right)
                            rest = (from_left, vertex + Y[0] - X[0], to_next, shortest)
                        count = _subdivide(
                            legs, corners, curve, left, right, feed[seg], velocity, acceleration, jerk, resolution,
                            rest, work, points, ends,
                        )  # fmt: skip
                    if n + count + 1 > len(w0):
                        element, segment = _grown(element, n + count + 1), _grown(segment, n + count + 1)
                        w0, w1, last = (
                            _grown(w0, n + count + 1),
                            _grown(w1, n + count + 1),
                            _grown(last, n + count + 1),
                        )
                    for c in range(count):
                        element[n], segment[n], last[n] = curve, seg, False
                        w0[n], w1[n] = left, ends[c]
                        left = ends[c]
                        n += 1
        since += length
        if is_stop[leg + 1]:
            if n + 1 > len(w0):
                element, segment = _grown(element, n + 1), _grown(segment, n + 1)
                w0, w1, last = _grown(w0, n + 1), _grown(w1, n + 1), _grown(last, n + 1)
            element[n], segment[n], last[n] = element[n - 1], segment[n - 1], True
            w0[n], w1[n] = w1[n - 1], w1[n - 1]
            n += 1
    return element[:n].copy(), w0[:n].copy(), w1[:n].copy(), segment[:n].copy(), last[:n].copy()


@njit(cache=True, error_model="numpy")
def _effective_curvature(points):
    """Effective curvatures of an interval's two ends (module text) from its points (3, 4, A)."""
    kappa = np.empty(3)
    for j in range(3):
        total = 0.0
        for k in range(points.shape[2]):
            total += points[j, 2, k] * points[j, 2, k]
        kappa[j] = np.sqrt(total)
    left, mid, right = kappa
    if mid >= max(left, right):
        return mid, mid
    if mid > 0.0:
        low = 1.0 / (2.0 / mid - 1.0 / max(left, right))
        if left < right:
            left = max(left, low)
        else:
            right = max(right, low)
    return left, right


@njit(cache=True, error_model="numpy")
def _evaluate(legs, corners, element, w0, w1, segment, last, feed, velocity, acceleration, jerk):
    """Arc length, position, derivatives and margins at all points; see `PathSamples`."""
    points, axes = len(w0), len(velocity)
    s = np.zeros(points)
    position, d1 = np.empty((points, axes)), np.empty((points, axes))
    d2_left, d2_right = np.empty((points, axes)), np.empty((points, axes))
    d3_left, d3_right = np.empty((points, axes)), np.empty((points, axes))
    margin, kappa_left, kappa_right = np.zeros(points), np.zeros(points), np.zeros(points)
    work = np.empty((2, 4, axes))
    ends = np.empty((3, 4, axes))
    left, right = ends[0], ends[2]
    fresh = True  # the point starts a piece: nothing to its left
    for i in range(points):
        if last[i]:
            kappa_right[i] = kappa_left[i]
            for k in range(axes):
                d2_right[i, k], d3_right[i, k] = d2_left[i, k], d3_left[i, k]
            if i + 1 < points:
                s[i + 1] = s[i]
            fresh = True
            continue
        error = _measure(
            legs,
            corners,
            element[i],
            w0[i],
            w1[i],
            feed[segment[i]],
            velocity,
            acceleration,
            jerk,
            work,
            ends,
        )
        margin[i] = MARGIN_SAFETY * error
        kappa_right[i], kappa_left[i + 1] = _effective_curvature(ends)
        if fresh:
            kappa_left[i] = kappa_right[i]
        for k in range(axes):
            if fresh:
                position[i, k], d1[i, k] = left[0, k], left[1, k]
                d2_left[i, k], d3_left[i, k] = left[2, k], left[3, k]
            d2_right[i, k], d3_right[i, k] = left[2, k], left[3, k]
            position[i + 1, k], d1[i + 1, k] = right[0, k], right[1, k]
            d2_left[i + 1, k], d3_left[i + 1, k] = right[2, k], right[3, k]
        fresh = False
        w_ref = 0.5 * (w0[i] + w1[i])
        s[i + 1] = s[i] + element_length(legs, corners, element[i], w0[i], w1[i], w_ref, left)
    return s, position, d1, d2_left, d2_right, d3_left, d3_right, margin, kappa_left, kappa_right
