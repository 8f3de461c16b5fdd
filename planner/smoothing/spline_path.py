"""From a path with rounded corners to one with splines in their place."""

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.corners.budget import allocate, error_rate
from planner.corners.smooth import SmoothPath
from planner.geometry.spline import Spline, span_dtype
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.smoothing.basis import DEGREE, ORDER, derivatives
from planner.smoothing.corridor import Corridor, find_corridor
from planner.smoothing.initial import lay
from planner.smoothing.relax import REACH, Goal, relax
from planner.smoothing.runs import SplineRuns, find_runs, longest_span
from planner.smoothing.sites import Sites, Splines, run_control, run_knots

CUSP = 1e-2  # slowest advance of a curve per mm of the programmed path [-] ...
CUSP_PLACES = 17  # ... looked for at so many places per span: |p_u|^2 is of degree 8, with two places for each of its extremes
# Gap of the first shape, share of its integral of squared third derivatives [-]: only a guess.
RELATIVE_GAP = 0.1


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class SplineShape:
    """The splines of a path with what is needed to change their shape within the tolerance."""

    # what the splines replace, the corridor along which they are laid, and the splines
    runs: SplineRuns
    corridor: Corridor
    splines: Splines
    # (S,) what the certificate leaves of the tolerance a shape may use [mm]; negative without one
    left: FloatArray
    cusp: Array  # (S,) spans with a cusp (`cusp_spans`)
    reserve: float  # the part of the tolerance that it leaves to chord and filter errors [mm]

    def laid(self) -> "SplineShape":
        """The same without corridor and sites, which only laying the splines needs: half a kilobyte a leg."""
        corridor = Corridor(*(column[:0].copy() for column in self.corridor))
        sites = Sites(*(column[:0].copy() for column in self.splines.sites))
        return dataclasses.replace(self, corridor=corridor, splines=self.splines._replace(sites=sites))


def spline_shape(path: SmoothPath, machine: Machine, before: SplineShape | None = None) -> SplineShape:
    """Splines inside the tolerance for all runs of a path with rounded corners: laid (initial.py), relaxed
    with a certificate (relax.py), and without a cusp. A run that gets none has `fits` False.

    before : of the same path with fewer full stops: runs that are the same have the same splines

    Raises InputError if the machine lacks an axis of the path.
    """
    tolerance = path.toolpath.tolerance
    axes = path.toolpath.axes
    reach = np.full(
        len(tolerance), np.linalg.norm(machine.limits("acceleration", axes)[_moving(path.toolpath)])
    )
    tol = allocate(tolerance, reach, error_rate(machine))
    at = path.legs.first
    of_leg = np.minimum.reduceat(np.minimum(tol[:-1], tol[1:]), at[:-1])
    longest = longest_span(path, machine, of_leg)
    runs = find_runs(path, machine, longest)
    corridor = find_corridor(path, runs, tol)
    jerk = machine.limits("jerk", axes)
    weights = (jerk.min() / jerk) ** 2
    goal = Goal(RELATIVE_GAP, weights, REACH)
    # the longest span of a run: of its slowest leg
    of_run = _smallest(longest, runs)
    known = np.full(len(of_run), -1) if before is None else _known(runs, corridor, before)
    new = np.flatnonzero(known < 0)
    of_new = SplineRuns(*(column[new] for column in runs))
    around = corridor if before is None else find_corridor(path, of_new, tol)
    splines = lay(around, of_run[new])
    relaxed = relax(around, splines, of_new, goal)
    splines = splines._replace(control=relaxed.control)
    cusp = cusp_spans(splines)
    of_runs = np.logical_or.reduceat(cusp, splines.span_first[:-1]) if len(new) else np.zeros(0, bool)
    splines = splines._replace(fits=relaxed.certified & ~of_runs)
    shape = SplineShape(
        runs=runs,
        corridor=corridor,
        splines=splines,
        left=relaxed.left,
        cusp=cusp,
        reserve=float((tolerance - tol).min()),
    )
    if before is None:
        return shape
    known[new] = len(before.splines.fits) + np.arange(len(new))
    return _with_known(shape, before, known)


def _known(runs: SplineRuns, corridor: Corridor, before: SplineShape) -> Array:
    """(Q,) which run of another shape each run is, with the same corridor; -1 where there is none."""
    if not len(before.splines.fits) or not len(runs.joint_first):
        return np.full(len(runs.joint_first), -1)
    there = np.searchsorted(before.runs.joint_first, runs.joint_first)
    there = np.minimum(there, len(before.splines.fits) - 1)
    vertices, others = np.diff(corridor.first), np.diff(before.corridor.first)
    same = vertices == others[there]
    for mine, other in zip(runs, before.runs, strict=True):
        same &= mine == other[there]
    if not same.any():
        return np.full(len(same), -1)
    rows, of = _rows(vertices, np.flatnonzero(same)), _rows(others, there[same])
    equal = np.ones(len(rows), bool)
    for mine, other in zip(corridor[1:], before.corridor[1:], strict=True):
        equal &= (mine[rows] == other[of]).reshape(len(rows), -1).all(axis=1)
    edges = np.append(0, np.cumsum(vertices[same]))[:-1]
    same[same] = np.logical_and.reduceat(equal, edges)
    return np.where(same, there, -1)


def _rows(counts: Array, chosen: Array) -> Array:
    """Numbers of the rows of the `chosen` (k,) runs, of which each run has so many (Q,), one after the other."""
    first, many = np.cumsum(counts) - counts, counts[chosen]
    return np.repeat(first[chosen] - (np.cumsum(many) - many), many) + np.arange(many.sum())


def _with_known(shape: SplineShape, before: SplineShape, chosen: Array) -> SplineShape:
    """The shape, of new runs alone, with those of the runs of another one: `chosen` (Q,) of these and the new ones behind
    them."""
    both = before.splines, shape.splines
    spans = np.concatenate([np.diff(one.span_first) for one in both])
    sites = np.concatenate([np.diff(one.site_first) for one in both])

    def of(counts: Array, *columns: Array) -> Array:
        return np.concatenate(columns)[_rows(counts, chosen)]

    splines = Splines(
        span_first=np.append(0, np.cumsum(spans[chosen])),
        breaks=of(spans + 1, *(one.breaks for one in both)),
        control=of(spans + DEGREE, *(one.control for one in both)),
        site_first=np.append(0, np.cumsum(sites[chosen])),
        sites=Sites(*(of(sites, *columns) for columns in zip(*(one.sites for one in both), strict=True))),
        outside=of(spans, *(one.outside for one in both)),
        fits=np.concatenate([one.fits for one in both])[chosen],
    )
    left, cusp = of(spans, before.left, shape.left), of(spans, before.cusp, shape.cusp)
    return dataclasses.replace(shape, splines=splines, left=left, cusp=cusp)


@njit(cache=True, error_model="numpy", nogil=True)
def cusp_spans(splines):
    """(S,) True for spans on which the curve all but stands still somewhere (`CUSP`), or turns back between
    two places that are looked at: no motion along it has a direction there."""
    span_first, axes = splines.span_first, splines.control.shape[1]
    found = np.zeros(span_first[-1], np.bool_)
    rows, tangent, before = np.empty((4, ORDER)), np.empty(axes), np.empty(axes)
    for q in range(len(span_first) - 1):
        cut, basis = run_knots(splines, q)
        control = run_control(splines, q)
        for i in range(len(cut) - 1):
            for place in range(CUSP_PLACES):
                derivatives(basis[i], place / (CUSP_PLACES - 1.0), cut[i + 1] - cut[i], rows)
                square, forward = 0.0, 0.0
                for k in range(axes):
                    before[k], tangent[k] = tangent[k], 0.0
                    for d in range(ORDER):
                        tangent[k] += rows[1, d] * control[i + d, k]
                    square += tangent[k] * tangent[k]
                    forward += tangent[k] * before[k]
                if square < CUSP * CUSP or (place > 0 and forward <= 0.0):
                    found[span_first[q] + i] = True
    return found


def lost_joints(path: SmoothPath, shape: SplineShape, fence: bool = False) -> Array:
    """(k,) joints of the toolpath where runs are to be cut that do not fit: at each of their places outside
    of the corridor, without a certificate or with a cusp, of the joints around it the one that turns most, or
    those on both sides of it (`fence`), which leave a run of a few joints there."""
    splines, runs = shape.splines, shape.runs
    lost = np.repeat(~splines.fits, np.diff(splines.span_first))
    spans = np.flatnonzero(lost & (splines.outside | (shape.left < 0.0) | shape.cusp))
    run = np.searchsorted(splines.span_first, spans, side="right") - 1
    begin, end = splines.breaks[spans + run], splines.breaks[spans + run + 1]
    place = path.legs.place[path.legs.first]
    first = np.searchsorted(place, begin - (end - begin), side="left")
    last = np.searchsorted(place, end + (end - begin), side="right") - 1
    # one at least, and inside the run
    first = np.clip(np.minimum(first, last), runs.joint_first[run], runs.joint_last[run])
    last = np.clip(last, first, runs.joint_last[run])
    if fence:
        before = np.maximum(first - 1, runs.joint_first[run])
        after = np.minimum(last + 1, runs.joint_last[run])
        return path.legs.first[np.unique(np.concatenate([before, after]))]
    theta = path.theta
    most = [a + int(np.argmax(theta[a : b + 1])) for a, b in zip(first, last, strict=True)]
    return path.legs.first[np.unique(np.array(most, dtype=np.int64))]


def _polynomials(splines: Splines, q: int) -> tuple[FloatArray, FloatArray]:
    """Breaks (S+1,) of run q, and its spans as polynomials (S, 6, A) (geometry/spline.py)."""
    breaks, basis = run_knots(splines, q)
    of_span = run_control(splines, q)[np.arange(len(basis))[:, None] + np.arange(ORDER)]
    return breaks, np.einsum("sbm,sbk->smk", basis, of_span)


def _moving(toolpath: Toolpath) -> Array:
    """(A,) True for axes that a toolpath moves: the others accelerate nowhere on its splines either."""
    points = np.vstack([toolpath.start, toolpath.end])
    arcs = np.vstack([toolpath.arcs.e1, toolpath.arcs.e2, toolpath.arcs.drift])
    curves = (np.ptp(toolpath.curves.points, axis=1) > 0.0).any(axis=0)
    return np.asarray((np.ptp(points, axis=0) > 0.0) | (arcs != 0.0).any(axis=0) | curves)


def _smallest(longest: FloatArray, runs: SplineRuns) -> FloatArray:
    """(Q,) smallest of `longest` over the legs of each run."""
    if not len(runs.joint_first):
        return np.zeros(0)
    edges = np.stack([runs.joint_first - 1, runs.joint_last + 1], axis=1).ravel()
    least = np.minimum.reduceat(np.append(longest, np.inf), edges)
    return least[::2].copy()  # in one piece: for another layout the kernel would be compiled again


def with_spline(path: SmoothPath, shape: SplineShape) -> SmoothPath:
    """The path with the splines of the runs that fit, each span a polynomial (geometry/spline.py)."""
    runs, splines = shape.runs, shape.splines
    axes = len(path.toolpath.axes)
    kept = np.flatnonzero(splines.fits)
    tables = []
    for q in kept:
        cut, coef = _polynomials(splines, int(q))
        table = np.zeros(len(coef), span_dtype(axes))
        table["begin"], table["width"], table["coef"][..., :axes] = cut[:-1], np.diff(cut), coef
        tables.append(table)
    count = splines.span_first[kept + 1] - splines.span_first[kept]
    of_span = np.repeat(splines.fits, np.diff(splines.span_first))
    spline = Spline(
        first=np.concatenate([[0], np.cumsum(count)]),
        joint_first=runs.joint_first[kept],
        joint_last=runs.joint_last[kept],
        x_first=runs.x_first[kept],
        x_last=runs.x_last[kept],
        spans=np.concatenate(tables) if tables else np.zeros(0, span_dtype(axes)),
        budget=shape.left[of_span] + shape.reserve,
    )
    d = path.d.copy()
    for first, last in zip(spline.joint_first, spline.joint_last, strict=True):
        d[first : last + 1] = 0.0
    return dataclasses.replace(path, d=d, spline=spline)
