"""Path and feed improved together: a convex step, the time-optimal motion's limits linearised in the control
points and in the time.

Let p(u(t)) be a motion along a spline. Its control points move by dc, and what took dt takes (1 + theta) dt.
To first order, with v, a and j what the motion has now, velocity, acceleration and jerk of an axis are then

    v + B1.dc - v theta
    a + B2.dc - 2 a theta - v theta'
    j + B3.dc - 3 j theta - 3 a theta' - v theta'',

B1, B2 and B3 the time derivatives of the basis functions along the motion, and the time changes by the
integral of theta. The feed is (v.e) + e.(B1.dc) - (v.e) theta with its direction e, and the acceleration
across the path likewise. With theta a spline over the same knots all that is linear in dc and theta. A step
minimises

    integral of theta + 1/2 |w|^2/v^2 + pull/2 (sum_k (B3.dc_k / jerk_k)^2 + SLOWER theta^2) dt

subject to the limits and to the corridor, whose sites stay balls (sites.py). The second term counts where the
motion goes at the programmed feed v: w is what B1.dc has across the path, and the speed with it is v +
|w|^2/(2 v); without it a wavy path seems to cost nothing. The third keeps the step where the first order
holds. Limits are kept at places inside the intervals of the grid, and a share may grow there by what the
interval leaves of the limit, its ends included: the motion keeps its limits at grid points, and the step must
not promise what it cannot have there.

Long runs are improved window by window (combined_solver.py); the longest in ranges of windows, side by side,
with `DEGREE` control points between them that stay, and then in one window around each gap, as in relax.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import first_not_before
from planner.base.sizes import SIZES
from planner.smoothing.basis import DEGREE, ORDER, Knots
from planner.smoothing.certificate import certify
from planner.smoothing.combined_places import Places, gain_of_step, objective_of_window, places_of_run
from planner.smoothing.combined_rows import rows_of_window
from planner.smoothing.combined_solver import CombinedProblem, improve_window
from planner.smoothing.corridor import Corridor, run_corridor
from planner.smoothing.forms import SplineMotion
from planner.smoothing.runs import SplineRuns
from planner.smoothing.sites import (
    Sites,
    Splines,
    control_first,
    run_control,
    run_knots,
    run_sites,
    sites_between,
    with_radius,
)
from planner.smoothing.windows import TIGHTENED, Reach, in_ranges, in_shares, next_window

WINDOWS = Reach(SIZES.improved_window, SIZES.improved_overlap)
RANGE = SIZES.improved_range
SPANS_SHARED = SIZES.improved_shared
ITERATIONS = 40  # per window; 10 to 25 are the rule
# Control points of theta that stay 0 where a run ends on a straight leg: speed and acceleration go on.
HELD = 3


class MotionLimits(NamedTuple):
    """Limits of the motion of A axes."""

    axes: FloatArray  # (3, A) velocity, acceleration and jerk
    pulled: FloatArray  # (A,) jerks that the pull counts in [mm/s3]
    along: FloatArray  # (I, 2) the feed [mm/s], and the acceleration across the path [mm/s2], in each interval of the motion


class StepAim(NamedTuple):
    """How far a step of Q runs goes."""

    pull: FloatArray  # (Q,) towards what is there; inf for runs that stay
    gap: float  # of the convex problem, share of the time [-]
    again: int  # times at most in windows around sites that are tightened
    windows: Reach
    tightened: Reach  # of windows around sites that are tightened


class Improved(NamedTuple):
    """All runs after a step; what does not fit has its control points from before."""

    control: FloatArray  # (n, A) [mm]
    used: FloatArray  # (J,) radius that each site may use, smaller where the certificate asked for it [mm]
    gain: FloatArray  # (Q,) of the time of each run, to first order [s]
    iterations: FloatArray  # (Q,) of its windows together


class CombinedRun(NamedTuple):
    """One run that is improved: n control points, in the A axes that it moves in."""

    corridor: Corridor  # in all axes
    knots: Knots
    sites: Sites
    whole: FloatArray  # (n, all axes) control points
    moving: Array  # (A,) its axes
    control: FloatArray  # (n, A)
    places: Places
    free: Array  # (n, A+1) False for what stays
    pulled: FloatArray  # (A,)
    pull: float
    gap: float  # share of a window's time [-]
    again: int  # times at most in windows around sites that are tightened
    windows: Reach
    tightened: Reach  # of windows around sites that are tightened


@njit(cache=True, error_model="numpy")
def _sites_of_window(sites, lo, hi, spans):
    """The sites that the control points lo .. hi - 1 move, their spans counted from the control point lo -
    DEGREE, or 0."""
    a = first_not_before(sites.span, max(lo - DEGREE, 0))
    b = first_not_before(sites.span, min(hi, spans))
    span, place, weights, target, along, slide, radius = sites_between(sites, a, b)
    return Sites(span - max(lo - DEGREE, 0), place, weights, target, along, slide, radius)


@njit(cache=True, error_model="numpy")
def _moving(control, sites):
    """(A,) axes in which a curve moves or is not where its sites want it: a step does nothing in the
    others."""
    found = np.zeros(control.shape[1], np.bool_)
    for k in range(control.shape[1]):
        still = control[0, k]
        for i in range(len(control)):
            found[k] |= control[i, k] != still
        for j in range(len(sites.span)):
            found[k] |= sites.target[j, k] != still
    return np.flatnonzero(found)


@njit(cache=True, error_model="numpy")
def _moved(run, y):
    """(n, all axes) control points after the step y (n, A+1)."""
    control = run.whole.copy()
    for i in range(len(control)):
        for k in range(len(run.moving)):
            control[i, run.moving[k]] += y[i, k]
    return control


@njit(cache=True, error_model="numpy")
def _free(n, axes, fixed):
    """(n, A+1) True for what a step may change; fixed : control points that stay at the first and at the last
    end."""
    free = np.ones((n, axes + 1), np.bool_)
    for end in range(2):
        held = 0 if fixed[end] == 1 else HELD
        for i in range(max(fixed[end], held)):
            at = i if end == 0 else n - 1 - i
            if i < fixed[end]:
                free[at, :axes] = False
            if i < held:
                free[at, axes] = False
    return free


@njit(cache=True, error_model="numpy")
def _improve_window(run, radius, lo, hi, y):
    """The step y (n, A+1) of a run's control points lo .. hi - 1 while the others stay, overwritten; returns
    the iterations.

    radius : (J,) of the sites
    """
    (n, axes), spans, places = run.control.shape, len(run.knots.breaks) - 1, run.places
    a, b = max(lo - DEGREE, 0), min(hi + DEGREE, n)
    first, last = first_not_before(places.span, a), first_not_before(places.span, min(hi, spans))
    free = np.zeros((b - a, axes + 1), np.bool_)
    free[lo - a : hi - a] = run.free[lo:hi]
    band, linear = np.zeros(((b - a) * (axes + 1), ORDER * (axes + 1))), np.zeros((b - a, axes + 1))
    objective_of_window(places, (first, last, a), run.pull, run.pulled, band, linear)
    rows = rows_of_window(places, first, last, a)
    sites = _sites_of_window(with_radius(run.sites, radius), lo, hi, spans)
    problem = CombinedProblem(band, linear, free, rows, run.control[a:b], sites)
    time = places.weight[first:last].sum()
    found, iterations = improve_window(problem, y[a:b], time, run.gap * time, ITERATIONS)
    y[a:b] = found
    return iterations


@njit(cache=True, error_model="numpy", nogil=True)
def improve_range(run, radius, begin, end, y):
    """The step y (n, A+1) of a run's control points begin .. end - 1, window by window, overwritten; returns
    the iterations."""
    lo, total = begin, 0
    while True:
        hi = end if end - lo <= run.windows.window + run.windows.overlap else lo + run.windows.window
        total += _improve_window(run, radius, lo, hi, y)
        if hi == end:
            return total
        lo = hi - run.windows.overlap


@njit(cache=True, error_model="numpy")
def _tighten(run, radius, y):
    """A step y (n, A+1) again around sites where the curve leaves the tolerance beside them; both it and the
    radii (J,) of these sites are overwritten. Returns the iterations."""
    n, total = len(run.control), 0
    for _ in range(run.again):
        certificate = certify(run.corridor, run.knots, run.sites.place, _moved(run, y))
        if certificate.span.max() <= 1.0:
            break
        for j in range(len(radius)):
            if certificate.site[j] > 1.0:
                radius[j] *= TIGHTENED / certificate.site[j]
        done, site = 0, 0
        while True:
            lo, hi, site = next_window(1, done, site, 0, n, run.sites.span, certificate.site, run.tightened)
            if lo == n:
                break
            total += _improve_window(run, radius, lo, hi, y)
            done = hi
    return total


@njit(cache=True, error_model="numpy", nogil=True)
def _begin(q, corridor, splines, runs, used, motion, limits, aim):
    """Run q, the radii (J,) of its sites, and a step (n, A+1) to begin with."""
    knots, whole = run_knots(splines, q), run_control(splines, q)
    first, last = motion.interval[q], motion.interval[q + 1]
    sites = run_sites(splines, q)
    moving = _moving(whole, sites)
    own = whole[:, moving]
    sites = Sites(
        sites.span, sites.place, sites.weights, sites.target[:, moving], sites.along[:, moving],
        sites.slide, used[splines.site_first[q] : splines.site_first[q + 1]],
    )  # fmt: skip
    places = places_of_run(knots, own, motion, limits.along, limits.axes[:, moving], first, last)
    free = _free(len(own), len(moving), (runs.fixed_first[q], runs.fixed_last[q]))
    pulled = limits.pulled[moving]
    run = CombinedRun(
        run_corridor(corridor, q), knots, sites, whole, moving, own, places, free, pulled, aim.pull[q], aim.gap, aim.again,
        aim.windows, aim.tightened,
    )  # fmt: skip
    return run, sites.radius.copy(), np.zeros((len(own), len(moving) + 1))


@njit(cache=True, error_model="numpy", nogil=True)
def _finish(q, run, radius, y, total, splines, found):
    """Write run q after a step of so many iterations into the columns of `Improved`, which hold what was
    before."""
    control, used, gain, iterations = found
    iterations[q] = total + _tighten(run, radius, y)
    moved, begin, site = _moved(run, y), control_first(splines, q), splines.site_first[q]
    control[begin : begin + len(moved)] = moved
    used[site : site + len(radius)] = radius
    gain[q] = gain_of_step(run.places, y)


@njit(cache=True, error_model="numpy", nogil=True)
def _improve(corridor, splines, runs, used, motion, limits, aim, own, found):
    """Write the runs `own` (k,) into the columns of `Improved`, which hold what was before."""
    for q in own:
        run, radius, y = _begin(q, corridor, splines, runs, used, motion, limits, aim)
        total = improve_range(run, radius, 0, len(y), y)
        _finish(q, run, radius, y, total, splines, found)


def _improve_long(
    q: int, begun: tuple[CombinedRun, FloatArray, FloatArray], splines: Splines, found: Improved
) -> None:
    """Write run q, improved in ranges (module text), into the columns of `Improved`."""
    run, radius, y = begun
    iterations: list[int] = []

    def work(begin: int, beyond: int) -> None:
        iterations.append(improve_range(run, radius, begin, beyond, y))

    in_ranges(0, len(y), RANGE, WINDOWS.window, work)
    _finish(q, run, radius, y, sum(iterations), splines, found)


def improve(
    corridor: Corridor,
    splines: Splines,
    runs: SplineRuns,
    used: FloatArray,
    motion: SplineMotion,
    limits: MotionLimits,
    aim: StepAim,
) -> Improved:
    """One step of all splines that fit (module text).

    used : (J,) radius that each site may use [mm]
    """
    count = len(splines.fits)
    found = Improved(splines.control.copy(), used.copy(), np.zeros(count), np.zeros(count))
    asked = np.flatnonzero(splines.fits & (aim.pull < np.inf))
    size = np.diff(splines.span_first)[asked]
    for q in asked[size >= 2 * RANGE].tolist():
        begun = _begin(q, corridor, splines, runs, used, motion, limits, aim)
        _improve_long(q, begun, splines, found)
    asked, size = asked[size < 2 * RANGE], size[size < 2 * RANGE]

    def work(own: Array) -> None:
        _improve(corridor, splines, runs, used, motion, limits, aim, own, found)

    in_shares(asked, size, SPANS_SHARED, work)
    return found
