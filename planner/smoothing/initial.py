"""A first spline inside the corridor of each run, with its knots and its sites.

The control points of the first spline are the places of the corridor's chain at the spline's Greville
abscissae: a smoothed chain that leaves it only at corners, and the less, the denser the knots are. Where it
uses more than `ROOM` of the tolerance, knots are added, which moves the knots of the whole run a little: on a
long run some site always ends a little beyond `ROOM`. That does no harm: what is within `INSIDE` of the
tolerance is a start for the relaxation (relax.py). So after `ROOMY` times only a run that uses more than
`INSIDE` gets more, `DENSER_MAX` times at most. Only spans with sites outside of that are no spline, and the run
is to be cut there (spline_path.py).

Knots are near to each other where the path turns much within its tolerance. A control polygon that follows
the path leaves it by about a quarter of the turning between two knots times their distance. So knots stand at
distances

    h(u) = the longest h with  turning within h around u  *  h <= FITTING * tolerance,

one corner of theta: h = FITTING tol/theta; an arc of radius R: h = sqrt(FITTING tol R), however it is cut
into chords. They grow by `GROWTH` of the distance from there, and stay below what a motion needs to build up
its acceleration.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.base.search import first_not_before
from planner.smoothing.basis import DEGREE, ORDER, clamped, knots_at
from planner.smoothing.corridor import Corridor, run_corridor
from planner.smoothing.sites import Sites, Splines, sites_of_run, used_share

# Control points on the path leave a corner by 0.28 theta h, so by 0.56 of the tolerance.
FITTING = 2.0
# Neighbouring spans then differ by a third at most.
GROWTH = 0.3
STEP = 0.1  # of the distance between knots, to integrate its inverse in [-]: over a step it changes by GROWTH STEP = 3 %
BEYOND = 1e-3  # ... or up to so little beyond a place, so that the next step begins after the kink there [-]
TURN_MIN = 1e-12  # [rad]: a tangent joint, for which knots may stand as far apart as they like


@njit(cache=True, error_model="numpy")
def graded(place, h):
    """h (m,) lowered to grow by no more than GROWTH of the distance from place to place."""
    m = len(place)
    h = h.copy()
    for k in range(1, m):
        h[k] = min(h[k], h[k - 1] + GROWTH * (place[k] - place[k - 1]))
    for k in range(m - 2, -1, -1):
        h[k] = min(h[k], h[k + 1] + GROWTH * (place[k + 1] - place[k]))
    return h


@njit(cache=True, error_model="numpy")
def spacing(place, turn, tol, longest):
    """Largest distance between knots (m,) at the turns `turn` [rad] at ascending places (m,) [mm]; `tol`
    (m,), `longest` [mm]."""
    m = len(place)
    h = np.empty(m)
    begin = 0
    total = 0.0
    # windows that end at turn k shrink from the left until they fit; turns inside take their length
    for k in range(m):
        h[k] = min(longest, FITTING * tol[k] / max(turn[k], TURN_MIN))
    for k in range(m):
        total += turn[k]
        while begin < k and total * (place[k] - place[begin]) > FITTING * tol[k]:
            # turns begin .. k do not fit into one interval: the next ones must be nearer than they are
            width = place[k] - place[begin]
            for j in (begin, k):
                h[j] = min(h[j], max(width, FITTING * tol[j] / total))
            total -= turn[begin]
            begin += 1
    return graded(place, h)


@njit(cache=True, error_model="numpy")
def spread(place, h, begin, end, longest, least):
    """Breaks (S+1,) from begin to end whose distances follow h at the places and grow by GROWTH from there,
    at most `longest`; at least `least` spans."""
    # density 1/h integrated in small steps: between two places h is the smaller of the two cones
    count = 0.0
    for sweep in range(2):
        if sweep == 1:
            spans = max(int(np.ceil(count)), least)
            breaks = np.empty(spans + 1)
            breaks[0] = begin
            target = count / spans
            filled = 1
        u = begin
        done = 0.0
        k = 0
        while u < end:
            while k < len(place) and place[k] < u:
                k += 1
            here = longest
            ahead = end
            if k < len(place):
                here = min(here, h[k] + GROWTH * (place[k] - u))
                ahead = min(ahead, place[k])
            if k > 0:
                here = min(here, h[k - 1] + GROWTH * (u - place[k - 1]))
            du = min(STEP * here, end - u)
            if ahead > u:
                du = min(du, ahead - u + BEYOND * here)
            part = du / here
            if sweep == 1:
                while filled < spans and done + part >= target * filled:
                    breaks[filled] = u + du * (target * filled - done) / part
                    filled += 1
            done += part
            u += du
        count = done
    breaks[filled:] = end
    return breaks


ROOM = 0.85  # of the tolerance that a first spline should use [-]
DENSER = 0.75  # factor on the distance of knots where it uses more [-]
ROOMY = 8  # so many times for `ROOM` alone: a relief of 6,000 blocks in one run takes as many, one of 30,000 would never end
DENSER_MAX = 16  # so many times at most: knots are 100 times as dense then
INSIDE = 0.99  # of the tolerance that it may use in the end [-]: the relaxation starts strictly inside of its own corridor, relax.USED
SPANS_MIN = 8  # of a run: with five control points fixed at either end three are left to move


def lay(corridor: Corridor, longest: FloatArray) -> Splines:
    """The first splines in the corridors of all runs (module text).

    longest : (Q,) longest span of each run [mm]
    """
    laid = [_lay_run(run_corridor(corridor, q), longest[q]) for q in range(len(longest))]
    axes = corridor.point.shape[1]
    none = Sites(
        np.empty(0, np.int64), *(np.empty((0, *size)) for size in ((), (ORDER,), (axes,), (axes,), (), ()))
    )
    sites = [run[2] for run in laid]
    return Splines(
        span_first=np.cumsum([0, *(len(run[3]) for run in laid)]),
        breaks=np.concatenate([np.empty(0), *(run[0] for run in laid)]),
        control=np.concatenate([np.empty((0, axes)), *(run[1] for run in laid)]),
        site_first=np.cumsum([0, *(len(one.span) for one in sites)]),
        sites=Sites(*(np.concatenate(columns) for columns in zip(none, *sites, strict=True))),
        outside=np.concatenate([np.empty(0, np.bool_), *(run[3] for run in laid)]),
        fits=np.array([not run[3].any() for run in laid], dtype=np.bool_),
    )


@njit(cache=True, error_model="numpy")
def greville_control(corridor, breaks):
    """Control points (n, A) [mm] of one run on its chain, at the Greville abscissae: each at the mean of the
    five knots inside its basis function, where the spline of a straight chain is the chain itself. breaks :
    (S+1,) [mm]"""
    place, point, knots = corridor.place, corridor.point, clamped(breaks)
    control = np.empty((len(breaks) - 1 + DEGREE, point.shape[1]))
    v = 0
    for i in range(len(control)):
        u = 0.0
        for d in range(1, ORDER):
            u += knots[i + d] / DEGREE
        while v + 2 < len(place) and place[v + 1] < u:
            v += 1
        share = (u - place[v]) / (place[v + 1] - place[v])
        share = min(max(share, 0.0), 1.0)
        for k in range(control.shape[1]):
            control[i, k] = point[v, k] + share * (point[v + 1, k] - point[v, k])
    return control


@njit(cache=True, error_model="numpy")
def _denser(h, inner, sites, breaks, used):
    """Distances h (m,) of knots at the places `inner` (m,), smaller around sites that use more than
    `ROOM`."""
    h = h.copy()
    for j in range(len(used)):
        if used[j] > ROOM:
            width = breaks[sites.span[j] + 1] - breaks[sites.span[j]]
            near = first_not_before(inner, sites.place[j] - 2.0 * width)
            while near < len(inner) and inner[near] <= sites.place[j] + 2.0 * width:
                h[near] = min(h[near], DENSER * width)
                near += 1
    return graded(inner, h)


@njit(cache=True, error_model="numpy", nogil=True)
def _lay_run(corridor, longest):
    """The first spline of one run: breaks, control points, sites, and the spans (S,) with one outside."""
    inner = corridor.place[1:-1]
    h = spacing(inner, corridor.turn[1:-1], corridor.tol[1:-1], longest)
    attempt = 0
    while True:
        breaks = spread(inner, h, corridor.place[0], corridor.place[-1], longest, SPANS_MIN)
        control = greville_control(corridor, breaks)
        sites = sites_of_run(corridor, knots_at(breaks))
        used = used_share(sites, control)
        room = ROOM if attempt < ROOMY else INSIDE
        if attempt == DENSER_MAX or not (used > room).any():
            break
        attempt += 1
        h = _denser(h, inner, sites, breaks, used)
    outside = np.zeros(len(breaks) - 1, np.bool_)
    for j in range(len(used)):
        if used[j] > INSIDE:
            outside[sites.span[j]] = True
    return breaks, control, sites, outside
