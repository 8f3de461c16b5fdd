"""The kernels behind feedrate/sampling/samples.py: where the grid points go, and what the path is there.

`divide` halves the rows of feedrate/sampling/rows.py until the errors of feedrate/sampling/samples.py's text
are small enough, `grade` until no interval is much longer than its neighbours; `evaluate` then fills in arc
length, derivatives, margins and effective curvatures. All are linear in the number of points.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.sizes import SIZES
from planner.base.threads import in_parts
from planner.corners.elements import ElementTable, element_length, element_point, is_straight, to_arc_length
from planner.feedrate.sampling.rows import PathLimits, grown, set_row

# The midpoint is not quite the worst place of an interval: safety factor on the margin [-].
MARGIN_SAFETY = 1.25
POINTS_SHARED = SIZES.grid_shared
# The jerk between grid points may be off by so many times `resolution` [-], made good by slowing down.
JERK_SHARE = 5.0
# Halvings of one interval at most, and so its smallest part; 2^-20 of a corner is below a nanometre.
HALVINGS_MAX = 20
SMALLEST = 2.0**-HALVINGS_MAX
# Intervals may be this share of their distance from the nearest full stop [-], for solvers of third order.
REST_GROWTH = 0.5
# Neighbouring intervals on curves, third order: at most so many times as long [-], growing with the distance.
STEEPEST, SLOPE = 4.0, 1.0
# ... but not down to neighbours, nor parts of them, that are shorter than this share of them [-]: those are rounding.
FINEST = 1e-4


class Intervals(NamedTuple):
    """Where the P points of a grid are: the interval to the right of each (`PathSamples`)."""

    element: Array
    w0: FloatArray
    w1: FloatArray
    segment: Array
    last: Array  # True at the ends of pieces


class Columns(NamedTuple):
    """The path at the P points of a grid; see `PathSamples`."""

    s: FloatArray
    position: FloatArray
    d1: FloatArray
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    margin: FloatArray
    kappa_left: FloatArray
    kappa_right: FloatArray


@njit(cache=True, error_model="numpy")
def _interval_error(points, x, u, h, acceleration, jerk):
    """max_k e_k / a_k of the module's text, from arc-length derivatives (3, 4, A) at left end, middle and
    right end."""
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
def _fastest(point, feed_max, limits):
    """Bounds (x, u) of feed^2 and of the acceleration along the path that the limits allow at a point (4,
    A)."""
    _, velocity, acceleration, jerk = limits
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
    a = np.sqrt(a_sq)
    jerk_max = np.sqrt(j_sq) + 3.0 * np.sqrt(np.sqrt(kappa_sq) * a) * a
    if jerk_max * jerk_max < x * x * x * slope_sq:
        x = np.cbrt(jerk_max * jerk_max / slope_sq)
    return x, u


@njit(cache=True, error_model="numpy")
def _measure(table, element, segment, ends, limits, work, points):
    """Evaluate the interval with the ends (wa, wb) at left end, middle and right end into points (3, 4, A),
    with `work` (2, 4, A) for what is in between; returns its interpolation error."""
    legs, corners, spans = table
    wa, wb = ends
    w_ref = 0.5 * (wa + wb)
    x_ends = 0.0
    x, u, speed = 0.0, 0.0, 0.0
    for j in range(3):
        w = wa if j == 0 else (w_ref if j == 1 else wb)
        element_point(legs, corners, spans, element, w, w_ref, work, points[j])
        speed_here = to_arc_length(points[j])
        x_here, u_here = _fastest(points[j], limits.feed[segment], limits)
        if j == 1:
            x, u, speed = x_here, u_here, speed_here
        else:
            x_ends = max(x_ends, x_here)
    return _interval_error(points, min(x, x_ends), u, speed * (wb - wa), limits.acceleration, limits.jerk)


@njit(cache=True, error_model="numpy")
def _subdivide(table, row, limits, resolution, rest, work, out):
    """Halve a row until every part's error is below `resolution`; right ends into out, returns their number.
    Intervals grow in proportion to their distance from the nearer full stop, of which `rest` tells."""
    from_a, from_b, to_next, shortest = rest
    wa, wb = row.w0, row.w1
    stack = np.empty(HALVINGS_MAX + 1)
    stack[0] = wb
    depth = 1
    count = 0
    left = wa
    while depth > 0:
        right = stack[depth - 1]
        error = _measure(table, row.curve, row.segment, (left, right), limits, work[:2], work[2:])
        middle = 0.5 * (left + right)
        share = (middle - wa) / (wb - wa)
        away = from_a + (from_b - from_a) * share
        away = min(away, to_next - away)
        h = (from_b - from_a) * (right - left) / (wb - wa)
        coarse = error > resolution or h > max(shortest, REST_GROWTH * away)
        divisible = left < middle < right and right - left > SMALLEST * (wb - wa)
        if coarse and divisible and count + depth < len(out):
            stack[depth] = middle
            depth += 1
        else:
            out[count] = right
            count += 1
            depth -= 1
            left = right
    return count


@njit(cache=True, error_model="numpy", nogil=True)
def divide(table, rows, limits, resolution, shortest):
    """The rows of feedrate/sampling/rows.py with those on curves divided into the intervals of the grid.

    table    : `ElementTable` (corners/elements.py); limits : `PathLimits` (feedrate/sampling/rows.py)
    shortest : length of the first interval after a full stop [mm]; inf for second-order solvers
    """
    work = np.empty((5, 4, len(limits.velocity)))
    ends = np.empty(1 << 14)
    out = np.empty(2 * len(rows) + 64, rows.dtype)
    n = 0
    since, beyond = 0.0, 0.0  # the last full stop and the next one
    fresh = True
    for r in range(len(rows)):
        row = rows[r]
        if fresh:
            since, ahead = row.begin, r
            while not rows[ahead].last:
                ahead += 1
            beyond = rows[ahead].begin
        fresh = row.last
        count = 1
        ends[0] = row.w1
        if not row.last and not is_straight(table.legs, row.curve):
            rest = (row.begin - since, row.end - since, beyond - since, shortest)
            count = _subdivide(table, row, limits, resolution, rest, work, ends)
        out = grown(out, n + count)
        left = row.w0
        for c in range(count):
            _set_part(out[n], row, left, ends[c])
            left = ends[c]
            n += 1
    return out[:n].copy()


@njit(cache=True, error_model="numpy")
def _set_part(out, row, w0, w1):
    """The part of a row from w0 to w1."""
    rate = (row.end - row.begin) / (row.w1 - row.w0) if row.w1 > row.w0 else 0.0
    begin, end = row.begin + rate * (w0 - row.w0), row.begin + rate * (w1 - row.w0)
    set_row(out, row.curve, row.segment, w0, w1, begin, end, row.last)


@njit(cache=True, error_model="numpy", nogil=True)
def grade(legs, rows):
    """Halve intervals on curves until they are no longer than `STEEPEST` times their neighbours plus `SLOPE`
    times the distance from them: between a short and a long interval the kinematics of a jerk-limited profile
    are far from linear."""
    # at the start of each row; a closing row parts what is before it from what is after it
    size = np.empty(len(rows) + 1)
    for r in range(len(rows)):
        here = rows[r].end - rows[r].begin
        if rows[r].last:
            size[r] = np.inf if r == 0 else rows[r - 1].end - rows[r - 1].begin
        elif r == 0 or rows[r - 1].last:
            size[r] = here
        else:
            before = rows[r - 1].end - rows[r - 1].begin
            size[r] = max(min(here, before), FINEST * max(here, before))
    size[len(rows)] = np.inf
    for r in range(1, len(rows)):
        if not rows[r - 1].last:
            size[r] = min(size[r], size[r - 1] + SLOPE * (rows[r - 1].end - rows[r - 1].begin))
    for r in range(len(rows) - 2, -1, -1):
        if not rows[r].last:
            size[r] = min(size[r], size[r + 1] + SLOPE * (rows[r].end - rows[r].begin))
    out = np.empty(2 * len(rows), rows.dtype)
    stack = np.empty(HALVINGS_MAX + 1)
    n = 0
    for r in range(len(rows)):
        row = rows[r]
        if row.last or is_straight(legs, row.curve):
            out = grown(out, n + 1)
            _set_part(out[n], row, row.w0, row.w1)
            n += 1
            continue
        stack[0] = row.w1
        depth = 1
        left = row.w0
        whole = row.end - row.begin
        while depth > 0:
            right = stack[depth - 1]
            a, b = (left - row.w0) / (row.w1 - row.w0), (right - row.w0) / (row.w1 - row.w0)
            allowed = min(size[r] + SLOPE * whole * a, size[r + 1] + SLOPE * whole * (1.0 - b))
            middle = 0.5 * (left + right)
            if (b - a) * whole > STEEPEST * allowed and b - a > FINEST and left < middle < right:
                stack[depth] = middle
                depth += 1
            else:
                out = grown(out, n + 1)
                _set_part(out[n], row, left, right)
                n += 1
                depth -= 1
                left = right
    return out[:n].copy()


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


def evaluate(table: ElementTable, grid: Intervals, limits: PathLimits) -> Columns:
    """The path evaluated on a grid."""
    points, axes = len(grid.w0), len(limits.velocity)
    found = Columns(np.zeros(points), *np.empty((6, points, axes)), *np.zeros((3, points)))

    def work(first: int, beyond: int) -> None:
        _evaluate(table, grid, limits, _begin(grid.last, first), _begin(grid.last, beyond), found)

    in_parts(points, POINTS_SHARED, work)
    _sum_up(grid.last, found.s)
    return found


def _begin(last: Array, point: int) -> int:
    """The point, or the first one behind it that does not end a piece: the rest of it is found with that."""
    while point < len(last) and last[point]:
        point += 1
    return point


@njit(cache=True, error_model="numpy", nogil=True)
def _evaluate(table, grid, limits, first, beyond, found):
    """The `Columns` of the intervals first .. beyond - 1, with the length of each in place of s of its
    end."""
    legs, corners, spans = table
    element, w0, w1, segment, last = grid
    axes = len(limits.velocity)
    work = np.empty((2, 4, axes))
    ends = np.empty((3, 4, axes))
    left, right = ends[0], ends[2]
    fresh = first == 0 or last[first - 1]  # the point starts a piece: nothing to its left
    for i in range(first, beyond):
        if last[i]:
            found.kappa_right[i] = found.kappa_left[i]
            for k in range(axes):
                found.d2_right[i, k], found.d3_right[i, k] = found.d2_left[i, k], found.d3_left[i, k]
            fresh = True
            continue
        error = _measure(table, element[i], segment[i], (w0[i], w1[i]), limits, work, ends)
        found.margin[i] = MARGIN_SAFETY * error
        found.kappa_right[i], found.kappa_left[i + 1] = _effective_curvature(ends)
        if fresh:
            found.kappa_left[i] = found.kappa_right[i]
        for k in range(axes):
            if fresh:
                found.position[i, k], found.d1[i, k] = left[0, k], left[1, k]
                found.d2_left[i, k], found.d3_left[i, k] = left[2, k], left[3, k]
            found.d2_right[i, k], found.d3_right[i, k] = left[2, k], left[3, k]
            found.position[i + 1, k], found.d1[i + 1, k] = right[0, k], right[1, k]
            found.d2_left[i + 1, k], found.d3_left[i + 1, k] = right[2, k], right[3, k]
        fresh = False
        w_ref = 0.5 * (w0[i] + w1[i])
        found.s[i + 1] = element_length(legs, corners, spans, element[i], w0[i], w1[i], w_ref, left)


@njit(cache=True, error_model="numpy", nogil=True)
def _sum_up(last, s):
    """The arc lengths s (P,) of the points, in place of the lengths of the intervals before them."""
    for i in range(len(s) - 1):
        if last[i]:
            s[i + 1] = s[i]
        else:  # metres into a job a length may be below the last digit of s
            s[i + 1] = max(s[i] + s[i + 1], np.nextafter(s[i], np.inf))
