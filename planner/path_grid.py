"""The kernels behind path.py: where the grid points go, and what the path is there.

`make_grid` walks over the elements of the path and halves their intervals until the errors of path.py's text are small enough;
`evaluate` then fills in arc length, derivatives, margins and effective curvatures. Both are linear in the number of points.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planner.corners.blend import shape_at
from planner.corners.elements import element_length, element_point, to_arc_length

# The midpoint is not quite the worst place of an interval: safety factor on the margin [-].
MARGIN_SAFETY = 1.25
# The jerk between grid points may be off by so many times `resolution` [-]: 1 %, made good by slowing down (methods/optimal.py).
JERK_SHARE = 5.0
# Halvings of one interval at most; 2^-20 of a corner is below a nanometre.
HALVINGS_MAX = 20
# Arcs start with intervals of at most this angle [rad], so that no full turn hides between two equal points.
ARC_STEP = np.pi / 8
# ... and with so many at least, so that a short arc between two stops can start and stop.
ARC_PARTS_MIN = 4
# Free parts of legs shorter than this share of the leg are nothing but rounding: longer ones are at least CLOSE [-].
FREE_PART_MIN = 1e-9
# Intervals may be this share of their distance from the nearest full stop [-], for solvers of third order.
REST_GROWTH = 0.5


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
def make_grid(
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
def evaluate(legs, corners, element, w0, w1, segment, last, feed, velocity, acceleration, jerk):
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
        h = element_length(legs, corners, element[i], w0[i], w1[i], w_ref, left)
        s[i + 1] = max(
            s[i] + h, np.nextafter(s[i], np.inf)
        )  # metres into a job h may be below the last digit of s
    return s, position, d1, d2_left, d2_right, d3_left, d3_right, margin, kappa_left, kappa_right
