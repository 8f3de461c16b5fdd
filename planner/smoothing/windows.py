"""Windows of a long spline: which control points are relaxed at a time, or tightened (relax.py)."""

from typing import NamedTuple

import numpy as np

from planner.base.kernels import njit
from planner.base.search import first_not_before
from planner.base.sizes import SIZES
from planner.smoothing.basis import DEGREE, ORDER
from planner.smoothing.sites import site_distance

TIGHTENED = 0.998  # a tightened site aims at this share of the tolerance [-]: below 1, or rounds would creep towards it
AGAIN = 0.9  # a tightened window starts from so far between the first spline and its result [-] ...
WIDER = 1.002  # ... with radii at least so much wider than it needs [-]: strictly inside, as the interior-point method needs it


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
