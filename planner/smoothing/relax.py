"""Smooth curves inside the tube: each run relaxed to the least integral of its squared third derivative, and proved to be inside.

Third derivatives by the place along the path are jerks at constant feed, which is a good guess where no feed is known yet;
methods/reshape.py weights them by what the time-optimal motion pays for.

**Certificate.** On a piece of a span between neighbouring sites and vertices the curve is a polynomial, which lies in the convex hull
of its six Bezier points. If these are within r of the chord that the piece belongs to, so is the piece, since what is within r of a
chord is convex. The largest such r, plus the chord's sagitta on arcs, bounds the deviation of the path from the curve and back;
vertices lie on it because neighbouring pieces share their ends. Where the bound exceeds the tolerance, the sites around are
tightened by as much and the run is relaxed again.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planner.smoothing.basis import DEGREE, ORDER, derivatives, span_basis
from planner.smoothing.interior import minimise
from planner.smoothing.lay import _clamped, follow

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, NODE_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0  # exact for squares of third derivatives
RELATIVE_GAP = 1e-2  # the integral need not be smaller than this [-]
ITERATIONS = 60
FIRST_GAP = 30.0  # gap of the first multipliers [of the last gap], where no energy is known
TUBE = 0.998  # of the tolerance that sites may use at first [-]
TIGHTENED = 0.995  # a tightened site aims at this share of the tolerance [-]
ROUNDS = 5  # of tightening
AGAIN = 0.9  # a tightened window starts from so far between the first spline and its result [-] ...
INSIDE = 1.002  # ... with tubes at least so much wider than it needs [-]
WINDOW, OVERLAP = 240, 30  # control points relaxed at a time, and of them with the next window again
PARTS = 8  # into which a piece is cut if its bound is too large


@njit(cache=True, error_model="numpy")
def third_derivatives(breaks, basis, weights, H):
    """Add the integral of weights_k |p_k'''|^2 to the bands H (A, n, 6)."""
    rows = np.empty((4, ORDER))
    for i in range(len(breaks) - 1):
        h = breaks[i + 1] - breaks[i]
        for q in range(len(NODES)):
            derivatives(basis[i], NODES[q], h, rows)
            for k in range(len(weights)):
                add_square(H[k], i, rows[3], weights[k] * NODE_WEIGHTS[q] * h)


@njit(cache=True, error_model="numpy")
def add_square(band, i, row, weight):
    """Add weight (row . c_i..i+5)^2 to a band (n, 6), so that it counts 1/2 c'Hc."""
    for b in range(ORDER):
        value = 2.0 * weight * row[b]
        for a in range(b + 1):
            band[i + b, ORDER - 1 - b + a] += value * row[a]


@njit(cache=True, error_model="numpy")
def _piece_error(basis, control, i, a, b, chord_start, along, length, bezier):
    """Largest distance of the Bezier points of span i between tau = a and b from a chord."""
    axes = control.shape[1]
    step = b - a
    for k in range(axes):
        # power coefficients, shifted to a and scaled to the piece, then to Bernstein form
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
def certify(
    place,
    point,
    along,
    tol,
    tol_chord,
    breaks,
    basis,
    control,
    span,
    weights_place,
    ratio_site,
    ratio_span,
    left,
):
    """Bounds of the deviation over the tolerance: of each span into ratio_span (S,), and around each site into ratio_site (J,);
    into left (S,) what the bound leaves of the tolerance [mm]. weights_place (J,) is the place of each site."""
    bezier = np.empty((ORDER, control.shape[1]))
    spans, sites = len(breaks) - 1, len(span)
    for i in range(spans):
        ratio_span[i], left[i] = 0.0, np.inf
    for j in range(sites):
        ratio_site[j] = 0.0
    v, i, j = 0, 0, 0
    u = breaks[0]
    end = breaks[spans]
    while u < end:
        while v + 2 < len(place) and place[v + 1] <= u:
            v += 1
        while i + 1 < spans and breaks[i + 1] <= u:
            i += 1
        while j < sites and weights_place[j] <= u:
            j += 1
        following = min(breaks[i + 1], place[v + 1])
        if j < sites:
            following = min(following, weights_place[j])
        if not following > u:  # the last piece, by rounding
            break
        h = breaks[i + 1] - breaks[i]
        length = 0.0
        for k in range(point.shape[1]):
            length += (point[v + 1, k] - point[v, k]) * along[v, k]
        tau, step = (u - breaks[i]) / h, (following - u) / h
        error = _piece_error(basis, control, i, tau, tau + step, point[v], along[v], length, bezier)
        if (
            error > tol_chord[v]
        ):  # the points of smaller pieces are nearer to the curve, by the square of their size
            error = 0.0
            for part in range(PARTS):
                a, b = tau + step * part / PARTS, tau + step * (part + 1) / PARTS
                error = max(error, _piece_error(basis, control, i, a, b, point[v], along[v], length, bezier))
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


@njit(cache=True, error_model="numpy")
def _distance(c, j, span, weights, target, direction, slide):
    """|e_j| of a site (interior.py) [mm]."""
    dot, square = 0.0, 0.0
    for k in range(c.shape[1]):
        value = -target[j, k]
        for d in range(ORDER):
            value += weights[j, d] * c[span[j] + d, k]
        dot += value * direction[j, k]
        square += value * value
    return np.sqrt(max(square - (1.0 - slide[j] * slide[j]) * dot * dot, 0.0))


@njit(cache=True, error_model="numpy")
def _first_site(span, value):
    """Index of the first site whose span is not before `value`."""
    lo, hi = 0, len(span)
    while lo < hi:
        mid = (lo + hi) // 2
        if span[mid] < value:
            lo = mid + 1
        else:
            hi = mid
    return lo


@njit(cache=True, error_model="numpy")
def _energy(cut, basis, weights, c, first, last):
    """Integral of the squared third derivatives times weights (A,) over the spans first .. last - 1."""
    total = 0.0
    rows = np.empty((4, ORDER))
    for i in range(first, last):
        h = cut[i + 1] - cut[i]
        for q in range(len(NODES)):
            derivatives(basis[i], NODES[q], h, rows)
            for k in range(c.shape[1]):
                value = 0.0
                for d in range(ORDER):
                    value += rows[3, d] * (c[i + d, k] - c[i, k])
                total += weights[k] * NODE_WEIGHTS[q] * h * value * value
    return total


@njit(cache=True, error_model="numpy")
def relax_run(
    place, point, along, tol, tol_chord, cut, basis, c, c0, H, linear, fixed_first, fixed_last, span, weights, site_place, target,
    direction, slide, used, axis_weights, gap_last, relative, left,
):  # fmt: skip
    """Relax one run, `c` (n, A) inside the tube of radii `used` (J,), window by window; returns whether the result has a certificate,
    and the iterations. `c0` is a path well inside the tube."""
    n, axes = c.shape
    sites, spans = len(span), len(cut) - 1
    ratio_site, ratio_span = np.zeros(sites), np.empty(spans)
    end = n - fixed_last
    origin = np.empty(axes)
    count = 0
    for attempt in range(ROUNDS):
        lo = fixed_first
        while lo < end:
            hi = min(lo + WINDOW, end)
            if end - hi < OVERLAP:
                hi = end
            a, b = max(lo - DEGREE, 0), min(hi + DEGREE, n)
            j0, j1 = _first_site(span, a), _first_site(span, min(hi, spans))
            dirty = attempt == 0
            for j in range(j0, j1):
                if ratio_site[j] > 1.0:
                    dirty = True
            if dirty:
                if attempt > 0:
                    for i in range(lo, hi):
                        taper = min(min(i - lo + 1, hi - i) / OVERLAP, 1.0)
                        for k in range(axes):
                            c[i, k] += (1.0 - AGAIN) * taper * (c0[i, k] - c[i, k])
                    for j in range(j0, j1):
                        if ratio_site[j] > 1.0:
                            used[j] *= TIGHTENED / ratio_site[j]
                        used[j] = max(
                            used[j], INSIDE * _distance(c, j, span, weights, target, direction, slide)
                        )
                part, free = np.empty((axes, b - a, ORDER)), np.zeros(b - a, np.bool_)
                near, aim = np.empty((b - a, axes)), np.empty((j1 - j0, axes))  # from `origin`
                for k in range(axes):
                    origin[k] = c[a, k]
                for i in range(a, b):
                    free[i - a] = lo <= i < hi
                    for k in range(axes):
                        near[i - a, k] = c[i, k] - origin[k]
                        for d in range(ORDER):
                            part[k, i - a, d] = H[k, i, d]
                here = np.empty(j1 - j0, np.int64)
                for j in range(j0, j1):
                    here[j - j0] = span[j] - a
                    for k in range(axes):
                        aim[j - j0, k] = target[j, k] - origin[k]
                energy = 0.0
                if relative > 0.0:
                    energy = _energy(cut, basis, axis_weights, c, a, min(hi, spans))
                _, steps = minimise(
                    part, linear[a:b], free, here, weights[j0:j1], aim, direction[j0:j1], slide[j0:j1], used[j0:j1], near, energy,
                    energy + FIRST_GAP * gap_last, gap_last, relative, ITERATIONS,
                )  # fmt: skip
                for i in range(lo, hi):
                    for k in range(axes):
                        c[i, k] = near[i - a, k] + origin[k]
                count += steps
            if hi == end:
                break
            lo = hi - OVERLAP
        certify(
            place, point, along, tol, tol_chord, cut, basis, c, span, site_place, ratio_site, ratio_span, left
        )  # fmt: skip
        if ratio_span.max() <= 1.0:
            return True, count
    return False, count


@njit(cache=True, error_model="numpy")
def relax(
    first, place, point, along, tol, tol_chord, span_first, breaks, control, site_first, span, weights, site_place, target, direction,
    slide, used, fits, fixed_first, fixed_last, axis_weights, left, iterations,
):  # fmt: skip
    """Relax all runs: moves `control`, sets what is `used` of the radii, clears `fits` where the certificate fails; `left` (S,) is
    what it leaves of the tolerance, `iterations` (Q,)."""
    axes = point.shape[1]
    for q in range(len(fits)):
        iterations[q] = 0
        if not fits[q]:
            continue
        s0, s1 = span_first[q], span_first[q + 1]
        j0, j1 = site_first[q], site_first[q + 1]
        a, b = first[q], first[q + 1]
        cut = breaks[s0 + q : s1 + q + 1]
        basis = span_basis(_clamped(cut))
        c = control[s0 + DEGREE * q : s1 + DEGREE * (q + 1)]
        H = np.zeros((axes, len(c), ORDER))
        third_derivatives(cut, basis, axis_weights, H)
        fits[q], iterations[q] = relax_run(
            place[a:b], point[a:b], along[a:b], tol[a:b], tol_chord[a:b], cut, basis, c, c.copy(), H, np.zeros_like(c), fixed_first[q],
            fixed_last[q], span[j0:j1], weights[j0:j1], site_place[j0:j1], target[j0:j1], direction[j0:j1], slide[j0:j1],
            used[j0:j1], axis_weights, 0.0, RELATIVE_GAP, left[s0:s1],
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _add_prices(basis, control, cut, i, tau, v, a, jerk, weight, limits, own, H, Q):
    """Add what one end of a grid interval pays to H, and its own weight to Q (module text of reshape.py).

    v, a, jerk : along the path; weight (A, 3) of squared velocity, acceleration and jerk over their `limits` (2, A); own: of Q [s]
    """
    axes = control.shape[1]
    rows = np.empty((4, ORDER))
    derivatives(basis[i], tau, cut[i + 1] - cut[i], rows)
    jet = np.zeros((3, axes))
    for k in range(axes):
        for m in range(3):
            for d in range(ORDER):
                jet[m, k] += rows[m + 1, d] * control[i + d, k]
    speed_sq, along2, along3, bend = 0.0, 0.0, 0.0, 0.0
    for k in range(axes):
        speed_sq += jet[0, k] * jet[0, k]
        along2 += jet[0, k] * jet[1, k]
        along3 += jet[0, k] * jet[2, k]
        bend += jet[1, k] * jet[1, k]
    speed = np.sqrt(speed_sq)
    grows = along2 / speed  # d|p'|/du, and then its derivative
    grows2 = along3 / speed + (bend - grows * grows) / speed
    du = v / speed
    ddu = (a - grows * du * du) / speed
    dddu = (jerk - grows2 * du * du * du - 3.0 * grows * du * ddu) / speed
    row_v, row_a, row_j = np.empty(ORDER), np.empty(ORDER), np.empty(ORDER)
    for d in range(ORDER):
        row_v[d] = rows[1, d] * du
        row_a[d] = rows[2, d] * du * du + rows[1, d] * ddu
        row_j[d] = rows[3, d] * du * du * du + 3.0 * rows[2, d] * du * ddu + rows[1, d] * dddu
    for k in range(axes):
        if weight[k, 0] > 0.0:
            add_square(H[k], i, row_v, weight[k, 0])
        if weight[k, 1] > 0.0:
            add_square(H[k], i, row_a, weight[k, 1] / limits[0, k] ** 2)
        share = 1.0 / limits[1, k] ** 2
        if weight[k, 2] > 0.0:
            add_square(H[k], i, row_j, weight[k, 2] * share)
        add_square(Q[k], i, row_j, own * share)


@njit(cache=True, error_model="numpy")
def reshape(
    first, place, point, along, tol, tol_chord, span_first, breaks, control, site_first, span, weights, site_place, target, direction,
    slide, used, fits, fixed_first, fixed_last, left, interval, of_span, tau, v, a, jerk, duration, price, limits, force, gap,
    memory, share,
):  # fmt: skip
    """One round of reshape.py for all runs that fit: moves `control`, or leaves a run as it is where the certificate fails.

    interval    : (Q+1,) the grid intervals of each run; of_span (I,) their span, counted within the run; tau (I, 2) its part
    v, a        : (I, 2) feed and acceleration along the path at both ends; jerk, duration (I,)
    price       : (I, 2, A, 3) weights of squared velocity, acceleration and jerk
    limits      : (2, A) of acceleration and jerk
    force       : (Q,) how much the shape resists; gap (Q,) of each run [s]
    memory      : (A, n, 6) mean of the prices' bands over the rounds, of which `share` is new
    """
    axes = point.shape[1]
    ones = np.ones(axes)
    moved = np.zeros(len(fits), np.bool_)
    for q in range(len(fits)):
        s0, s1 = span_first[q], span_first[q + 1]
        if not fits[q] or not force[q] < np.inf or interval[q + 1] == interval[q]:
            continue
        j0, j1 = site_first[q], site_first[q + 1]
        b0, b1 = first[q], first[q + 1]
        cut = breaks[s0 + q : s1 + q + 1]
        basis = span_basis(_clamped(cut))
        old = control[s0 + DEGREE * q : s1 + DEGREE * (q + 1)]
        n = len(old)
        H, Q = np.zeros((axes, n, ORDER)), np.zeros((axes, n, ORDER))
        for i in range(interval[q], interval[q + 1]):
            for e in range(2):
                _add_prices(
                    basis, old, cut, of_span[i], tau[i, e], v[i, e], a[i, e], jerk[i], price[i, e], limits, 0.5 * duration[i], H, Q,
                )  # fmt: skip
        for k in range(axes):
            for i in range(n):
                for d in range(ORDER):
                    m = memory[k, s0 + DEGREE * q + i, d]
                    H[k, i, d] = m + share * (H[k, i, d] - m)
                    memory[k, s0 + DEGREE * q + i, d] = H[k, i, d]
        # prices from here, and a pull towards here:  H + force Q, linear part - force Q c
        linear = np.zeros((n, axes))
        for k in range(axes):
            for i in range(n):
                for d in range(min(i, DEGREE) + 1):
                    pull = force[q] * Q[k, i, DEGREE - d]
                    H[k, i, DEGREE - d] += pull
                    linear[i, k] -= pull * (old[i - d, k] - old[0, k])
                    if d > 0:
                        linear[i - d, k] -= pull * (old[i, k] - old[0, k])
        start, c = np.empty((n, axes)), np.empty((n, axes))
        follow(place[b0:b1], point[b0:b1], cut, start)
        for i in range(n):
            for k in range(axes):
                c[i, k] = old[i, k] + (1.0 - AGAIN) * (start[i, k] - old[i, k])
        tube, kept = used[j0:j1].copy(), left[s0:s1].copy()
        moved[q], _ = relax_run(
            place[b0:b1], point[b0:b1], along[b0:b1], tol[b0:b1], tol_chord[b0:b1], cut, basis, c, start, H, linear, fixed_first[q],
            fixed_last[q], span[j0:j1], weights[j0:j1], site_place[j0:j1], target[j0:j1], direction[j0:j1], slide[j0:j1], tube, ones,
            gap[q], 0.0, kept,
        )  # fmt: skip
        if moved[q]:
            for i in range(n):
                for k in range(axes):
                    old[i, k] = c[i, k]
            for j in range(j1 - j0):
                used[j0 + j] = tube[j]
            for i in range(s1 - s0):
                left[s0 + i] = kept[i]
    return moved
