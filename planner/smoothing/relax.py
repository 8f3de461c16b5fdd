"""Smooth curves inside the corridor: least integral of the squared third derivative, and the proof.

Third derivatives along the path are jerks at constant feed, a good guess while no feed is known.

A run is relaxed window by window. Where its certificate (certificate.py) fails, the sites around are
tightened by as much as the bound is too large, and relaxed again.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import first_not_before
from planner.base.sizes import SIZES
from planner.base.threads import in_parts
from planner.smoothing.basis import DEGREE, ORDER, Knots, derivatives, put, put_rows
from planner.smoothing.certificate import certify
from planner.smoothing.corridor import Corridor, run_corridor
from planner.smoothing.initial import greville_control
from planner.smoothing.interior_point import Accuracy, Problem, minimise_in_corridor
from planner.smoothing.runs import SplineRuns
from planner.smoothing.sites import (
    Sites,
    Splines,
    control_first,
    run_control,
    run_knots,
    run_sites,
    site_distance,
    with_radius,
)

ITERATIONS = 60  # of the interior-point method per window; 10 to 20 are the rule
# An energy below this share of the first one [-] is none: on a straight way it falls to rounding.
STRAIGHT = 1e-4
USED = 0.9995  # of the tolerance that sites may use at first [-]: the relaxation starts strictly inside of it
# Of tightening, in windows around the sites that need it. A run that needs more gets no spline.
ROUNDS = 20
SPANS_SHARED = SIZES.relaxed_shared
TIGHTENED = 0.998  # a tightened site aims at this share of the tolerance [-]: below 1, or rounds would creep towards it
AGAIN = 0.9  # a tightened window starts from so far between the first spline and its result [-] ...
WIDER = 1.002  # ... with radii at least so much wider than it needs [-]: strictly inside, as the interior-point method needs it
# Gauss-Legendre rule of three points on [0, 1], exact for squares of third derivatives, degree 4.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, NODE_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


class Reach(NamedTuple):
    """How many control points a window has at most, and how many it goes on over its neighbours. Kernels are
    given it: a constant would be compiled into them."""

    window: int
    overlap: int


REACH = Reach(SIZES.relaxed_window, SIZES.relaxed_overlap)


class ControlWindow(NamedTuple):
    """The control points lo .. hi - 1 of a run and the sites site .. site_end - 1 that they move."""

    lo: int
    hi: int
    site: int
    site_end: int


@njit(cache=True, error_model="numpy")
def next_window(attempt, done, site, fixed_first, end, span, ratio_site, reach):
    """Control points lo, hi of the next window to relax, and the first site after those that it is for; lo =
    end if there is none. At first windows as long as they may be after each other, the last of which ended at `done`;
    then around sites from `site` on whose bound is too large."""
    if attempt == 0:
        lo = max(done - reach.overlap, fixed_first)
        hi = min(lo + reach.window, end)
        if end - hi < reach.overlap:
            hi = end
        return (lo, hi, site) if done < end else (end, end, site)
    lo = hi = end
    for j in range(site, len(span)):
        if ratio_site[j] <= 1.0:
            continue
        first = max(span[j] - reach.overlap, fixed_first)
        last = min(span[j] + ORDER + reach.overlap, end)
        if lo == end:
            lo = first
        elif first > hi or last - lo > reach.window:
            return lo, hi, j
        hi = last
    return lo, hi, len(span)


@njit(cache=True, error_model="numpy")
def window_of(run, lo, hi):
    """The window of the control points lo .. hi - 1."""
    span, spans = run.sites.span, len(run.knots.breaks) - 1
    return ControlWindow(
        lo, hi, first_not_before(span, max(lo - DEGREE, 0)), first_not_before(span, min(hi, spans))
    )


@njit(cache=True, error_model="numpy")
def tighten_window(window, sites, control, middle, ratio_site, overlap):
    """Smaller radii for a window's sites whose bound is too large, and its control points a little closer to
    the spline `middle`, which is well inside, so that they are inside again: control points (hi - lo, A) and
    radii (site_end - site,)."""
    axes, (lo, hi, site, site_end) = control.shape[1], window
    begin = max(lo - DEGREE, 0)
    near, e = control[begin : hi + DEGREE].copy(), np.empty(axes)
    for i in range(lo, hi):
        taper = min(min(i - lo + 1, hi - i) / overlap, 1.0)
        for k in range(axes):
            near[i - begin, k] += (1.0 - AGAIN) * taper * (middle[i, k] - control[i, k])
    radius = sites.radius[site:site_end].copy()
    for j in range(site, site_end):
        used = sites.radius[j]
        needs = WIDER * site_distance(sites, j, near, begin, e)
        if needs >= WIDER * used:  # pushed out by the taper
            radius[j - site] = needs
        elif ratio_site[j] > 1.0:
            radius[j - site] = max(TIGHTENED / ratio_site[j] * used, min(needs, used))
    return near[lo - begin : hi - begin], radius


@njit(cache=True, error_model="numpy")
def add_third_derivatives(knots, weights, H):
    """Add the integral of the squared third derivatives times weights (A,) along one run to its bands H (A,
    n, 6)."""
    rows = np.empty((4, ORDER))
    for i in range(len(knots.breaks) - 1):
        h = knots.breaks[i + 1] - knots.breaks[i]
        for node in range(len(NODES)):
            derivatives(knots.basis[i], NODES[node], h, rows)
            for k in range(len(weights)):
                add_square(H[k], i, rows[3], weights[k] * NODE_WEIGHTS[node] * h)


@njit(cache=True, error_model="numpy")
def third_derivative_energy(knots, weights, c, first, last):
    """Integral of the squared third derivatives times weights (A,) over the spans first .. last - 1 [1/mm3],
    from the control points c (n, A) [mm] of the run."""
    cut, basis = knots
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
def add_square(band, i, row, weight):
    """Add weight (row . c_i..i+5)^2 to a band (n, 6), so that it counts 1/2 c'Hc."""
    for b in range(ORDER):
        value = 2.0 * weight * row[b]
        for a in range(b + 1):
            band[i + b, ORDER - 1 - b + a] += value * row[a]


class Goal(NamedTuple):
    """The aim of the control points: the least integral of the squared third derivatives, to a gap that is a
    share of it."""

    relative: float
    axis_weights: FloatArray  # (A,) of the squared third derivatives
    reach: Reach


class Relaxed(NamedTuple):
    """All runs relaxed. A run without a certificate, or that did not fit, is as before."""

    certified: Array  # (Q,)
    control: FloatArray  # (n, A)
    # (S,) what the certificate leaves of the tolerance: negative where it fails [mm]; inf of others
    left: FloatArray


class Run(NamedTuple):
    """One run that is relaxed: n control points, of which the first and last ones are fixed."""

    corridor: Corridor
    knots: Knots
    sites: Sites
    H: FloatArray  # (A, n, 6) lower bands
    middle: FloatArray  # (n, A) a spline well inside the corridor
    fixed_first: int
    fixed_last: int


@njit(cache=True, error_model="numpy")
def _relaxed_window(window, run, control, radius, goal):
    """The optimum (hi - lo, A) of a window's control points while the others stay."""
    n, (lo, hi, j0, j1), sites = len(control), window, run.sites
    a, b = max(lo - DEGREE, 0), min(hi + DEGREE, n)
    origin, free = control[a].copy(), np.zeros(b - a, np.bool_)
    free[lo - a : hi - a] = True
    part, near = run.H[:, a:b].copy(), control[a:b] - origin
    span, target = sites.span[j0:j1] - a, sites.target[j0:j1] - origin
    last = min(hi, len(run.knots.breaks) - 1)
    energy = third_derivative_energy(run.knots, goal.axis_weights, control, a, last)
    around = Sites(
        span, sites.place[j0:j1], sites.weights[j0:j1], target, sites.along[j0:j1], sites.slide[j0:j1], radius[j0:j1]
    )  # fmt: skip
    accuracy = Accuracy(energy, energy, STRAIGHT * energy, goal.relative)
    found = minimise_in_corridor(Problem(part, free, around), near, accuracy, ITERATIONS)
    return found.control[lo - a : hi - a] + origin


@njit(cache=True, error_model="numpy")
def _relax_run(run, start, goal):
    """One run relaxed window by window from control points `start` (n, A) inside the radii of its sites;
    returns whether the result has a certificate, its control points, and what the certificate leaves (S,)."""
    control, radius = start.copy(), run.sites.radius.copy()
    ratio_site = np.zeros(len(radius))
    left = np.empty(len(run.knots.breaks) - 1)
    end = len(control) - run.fixed_last
    for attempt in range(ROUNDS):
        done, site = run.fixed_first, 0
        while True:
            lo, hi, site = next_window(
                attempt, done, site, run.fixed_first, end, run.sites.span, ratio_site, goal.reach
            )
            if lo == end:
                break
            window = window_of(run, lo, hi)
            if attempt > 0:
                sites = with_radius(run.sites, radius)
                closer, smaller = tighten_window(
                    window, sites, control, run.middle, ratio_site, goal.reach.overlap
                )
                put_rows(control, lo, closer)
                put(radius, window.site, smaller)
            put_rows(control, lo, _relaxed_window(window, run, control, radius, goal))
            done = hi
        certificate = certify(run.corridor, run.knots, run.sites.place, control)
        ratio_site, left = certificate.site, certificate.left
        if certificate.span.max() <= 1.0:
            return True, control, left
    return False, control, left


@njit(cache=True, error_model="numpy", nogil=True)
def _relax(corridor, splines, runs, goal, own, found):
    """Write the runs `own` (k,), relaxed from a little further inside than they are, into the columns of
    `Relaxed`, which hold what was before."""
    certified, control, left = found
    for q in own:
        knots, start = run_knots(splines, q), run_control(splines, q).copy()
        sites = run_sites(splines, q)
        begin, along = control_first(splines, q), run_corridor(corridor, q)
        middle, H = greville_control(along, knots.breaks), np.zeros((start.shape[1], len(start), ORDER))
        add_third_derivatives(knots, goal.axis_weights, H)
        inside = with_radius(sites, USED * sites.radius)
        run = Run(along, knots, inside, H, middle, runs.fixed_first[q], runs.fixed_last[q])
        start += (1.0 - AGAIN) * (middle - start)
        certified[q], moved, kept = _relax_run(run, start, goal)
        if certified[q]:
            put_rows(control, begin, moved)
        put(left, splines.span_first[q], kept)


def relax(corridor: Corridor, splines: Splines, runs: SplineRuns, goal: Goal) -> Relaxed:
    """Relax the splines that fit, each run by itself; the same for any number of threads."""
    found = Relaxed(
        certified=np.zeros(len(splines.fits), dtype=np.bool_),
        control=splines.control.copy(),
        left=np.full(splines.span_first[-1], np.inf),
    )
    fitting = np.flatnonzero(splines.fits)

    def work(first: int, beyond: int) -> None:
        _relax(corridor, splines, runs, goal, fitting[first:beyond], found)

    if np.diff(splines.span_first)[fitting].sum() < SPANS_SHARED:
        work(0, len(fitting))
    else:
        in_parts(len(fitting), 1, work)
    return found
