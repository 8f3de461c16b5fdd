"""Smooth curves inside the tube: each run relaxed to the least integral of its squared third derivative, and proved to be inside.

Third derivatives by the place along the path are jerks at constant feed, which is a good guess where no feed is known yet;
optimal/reshape.py weights them by what the time-optimal motion pays for.

A run is relaxed window by window. Where its certificate (certificate.py) fails, the sites around are tightened by as much as the bound
is too large, and relaxed again.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import DEGREE, ORDER, clamped, span_basis
from planner.smoothing.certificate import certify
from planner.smoothing.forms import third_derivative_energy
from planner.smoothing.initial import follow
from planner.smoothing.interior_point import minimise, site_distance

ITERATIONS = 60  # of the interior-point method per window; 10 to 20 are the rule
FIRST_GAP = 30.0  # gap of the first multipliers [of the last gap], where no energy is known
TUBE = 0.9995  # of the tolerance that sites may use at first [-]
TIGHTENED = 0.998  # a tightened site aims at this share of the tolerance [-]
ROUNDS = 20  # of tightening, in windows around the sites that need it; 2 are the rule
AGAIN = 0.9  # a tightened window starts from so far between the first spline and its result [-] ...
INSIDE = 1.002  # ... with tubes at least so much wider than it needs [-]
WINDOW = 240  # control points relaxed at a time ...
OVERLAP = 30  # ... and of them again with the next window, or on each side of a tightened site


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
def _next_window(attempt, done, site, fixed_first, end, span, ratio_site):
    """Control points lo, hi of the next window to relax, and the first site after those that it is for; lo = end if there is none.
    At first windows of `WINDOW` after each other, the last of which ended at `done`; then around sites from `site` on whose bound is
    too large."""
    if attempt == 0:
        lo = max(done - OVERLAP, fixed_first)
        hi = min(lo + WINDOW, end)
        if end - hi < OVERLAP:
            hi = end
        return (lo, hi, site) if done < end else (end, end, site)
    lo = hi = end
    for j in range(site, len(span)):
        if ratio_site[j] <= 1.0:
            continue
        first, last = max(span[j] - OVERLAP, fixed_first), min(span[j] + ORDER + OVERLAP, end)
        if lo == end:
            lo = first
        elif first > hi or last - lo > WINDOW:
            return lo, hi, j
        hi = last
    return lo, hi, len(span)


@njit(cache=True, error_model="numpy")
def _tighten(lo, hi, j0, j1, c, c0, span, weights, target, direction, slide, used, ratio_site):
    """Smaller tubes for the sites j0 .. j1 - 1 whose bound is too large, and the control points lo .. hi - 1 a little closer to the
    path c0, which is well inside, so that they are inside again."""
    axes = c.shape[1]
    e = np.empty(axes)
    for i in range(lo, hi):
        taper = min(min(i - lo + 1, hi - i) / OVERLAP, 1.0)
        for k in range(axes):
            c[i, k] += (1.0 - AGAIN) * taper * (c0[i, k] - c[i, k])
    for j in range(j0, j1):
        needs = INSIDE * site_distance(j, c, span, weights, target, direction, slide, e)
        if needs >= INSIDE * used[j]:  # pushed out by the taper
            used[j] = needs
        elif ratio_site[j] > 1.0:
            used[j] = max(TIGHTENED / ratio_site[j] * used[j], min(needs, used[j]))


@njit(cache=True, error_model="numpy")
def _relax_window(
    lo, hi, j0, j1, cut, basis, c, H, linear, span, weights, target, direction, slide, used, axis_weights, gap_last, relative,
    multiplier,
):  # fmt: skip
    """Relax the control points lo .. hi - 1, in place, while the others stay; j0 .. j1 - 1 are the sites they move."""
    n, axes = c.shape
    a, b = max(lo - DEGREE, 0), min(hi + DEGREE, n)
    origin = c[a].copy()
    part, free = np.empty((axes, b - a, ORDER)), np.zeros(b - a, np.bool_)
    near, aim = np.empty((b - a, axes)), np.empty((j1 - j0, axes))  # from `origin`
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
        energy = third_derivative_energy(cut, basis, axis_weights, c, a, min(hi, len(cut) - 1))
    minimise(
        part, linear[a:b], free, here, weights[j0:j1], aim, direction[j0:j1], slide[j0:j1], used[j0:j1], near, multiplier[j0:j1],
        energy, energy + FIRST_GAP * gap_last, gap_last, relative, ITERATIONS,
    )  # fmt: skip
    for i in range(lo, hi):
        for k in range(axes):
            c[i, k] = near[i - a, k] + origin[k]


@njit(cache=True, error_model="numpy")
def relax_run(
    place, point, along, tol, tol_chord, cut, basis, c, c0, H, linear, fixed_first, fixed_last, span, weights, site_place, target,
    direction, slide, used, axis_weights, gap_last, relative, left, multiplier,
):  # fmt: skip
    """Relax one run, `c` (n, A) inside the tube of radii `used` (J,), window by window; returns whether the result has a certificate.
    `c0` is a path well inside the tube."""
    spans = len(cut) - 1
    ratio_site, ratio_span = np.zeros(len(span)), np.empty(spans)
    end = len(c) - fixed_last
    for attempt in range(ROUNDS):
        done, site = fixed_first, 0
        while True:
            lo, hi, site = _next_window(attempt, done, site, fixed_first, end, span, ratio_site)
            if lo == end:
                break
            j0, j1 = _first_site(span, max(lo - DEGREE, 0)), _first_site(span, min(hi, spans))
            if attempt > 0:
                _tighten(lo, hi, j0, j1, c, c0, span, weights, target, direction, slide, used, ratio_site)
            _relax_window(
                lo, hi, j0, j1, cut, basis, c, H, linear, span, weights, target, direction, slide, used, axis_weights, gap_last,
                relative, multiplier,
            )  # fmt: skip
            done = hi
        certify(
            place, point, along, tol, tol_chord, cut, basis, c, span, site_place, ratio_site, ratio_span, left
        )  # fmt: skip
        if ratio_span.max() <= 1.0:
            return True
    return False


@njit(cache=True, error_model="numpy")
def relax(
    first, place, point, along, tol, tol_chord, span_first, breaks, control, site_first, span, weights, site_place, target, direction,
    slide, used, fits, fixed_first, fixed_last, left, H_all, Q_all, force, axis_weights, gap, relative, good,
    multiplier,
):  # fmt: skip
    """Move the `control` of all runs that fit to the least 1/2 c'Hc + force/2 (c - c_now)'Q(c - c_now) inside the tube; a run without
    a certificate stays as it is, and is not `good` (Q,).

    used         : (J,) radius that each site may use, smaller afterwards where the certificate asked for it
    left         : (S,) what the certificate leaves of the tolerance; of a run that is not good, of its last try: negative where it
                   fails
    multiplier   : (J,) of the sites' constraints (interior_point.py)
    H_all, Q_all : (A, n, 6) bands of all runs
    force        : (Q,) of each run
    gap, relative : where to end: gap (Q,) in the units of H, or that share of the integral of squared third derivatives with the
                   weights axis_weights (A,), if H is its form
    """
    axes = point.shape[1]
    for q in range(len(fits)):
        if not fits[q]:
            continue
        s0, s1 = span_first[q], span_first[q + 1]
        j0, j1 = site_first[q], site_first[q + 1]
        b0, b1 = first[q], first[q + 1]
        cut = breaks[s0 + q : s1 + q + 1]
        basis = span_basis(clamped(cut))
        old = control[s0 + DEGREE * q : s1 + DEGREE * (q + 1)]
        n = len(old)
        H, linear = np.empty((axes, n, ORDER)), np.zeros((n, axes))
        for k in range(axes):
            for i in range(n):
                for d in range(ORDER):
                    at = s0 + DEGREE * q + i
                    pull = force[q] * Q_all[k, at, DEGREE - d]
                    H[k, i, DEGREE - d] = H_all[k, at, DEGREE - d] + pull
                    if d <= i:
                        linear[i, k] -= pull * (old[i - d, k] - old[0, k])
                        if d > 0:
                            linear[i - d, k] -= pull * (old[i, k] - old[0, k])
        start, c = np.empty((n, axes)), np.empty((n, axes))
        follow(place[b0:b1], point[b0:b1], cut, start)
        for i in range(n):
            for k in range(axes):
                c[i, k] = old[i, k] + (1.0 - AGAIN) * (start[i, k] - old[i, k])
        tube, kept = used[j0:j1].copy(), left[s0:s1].copy()
        good[q] = relax_run(
            place[b0:b1], point[b0:b1], along[b0:b1], tol[b0:b1], tol_chord[b0:b1], cut, basis, c, start, H, linear, fixed_first[q],
            fixed_last[q], span[j0:j1], weights[j0:j1], site_place[j0:j1], target[j0:j1], direction[j0:j1], slide[j0:j1], tube,
            axis_weights, gap[q], relative, kept, multiplier[j0:j1],
        )  # fmt: skip
        if good[q]:
            for i in range(n):
                for k in range(axes):
                    old[i, k] = c[i, k]
            for j in range(j1 - j0):
                used[j0 + j] = tube[j]
        for i in range(s1 - s0):
            left[s0 + i] = kept[i]
