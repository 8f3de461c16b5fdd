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
from planner.smoothing.basis import ORDER, derivatives
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
    reserve: float  # the part of the tolerance that it leaves to chord and filter errors [mm]

    def laid(self) -> "SplineShape":
        """The same without corridor and sites, which only laying the splines needs: half a kilobyte a leg."""
        corridor = Corridor(*(column[:0].copy() for column in self.corridor))
        sites = Sites(*(column[:0].copy() for column in self.splines.sites))
        return dataclasses.replace(self, corridor=corridor, splines=self.splines._replace(sites=sites))


def spline_shape(path: SmoothPath, machine: Machine) -> SplineShape:
    """Splines inside the tolerance for all runs of a path with rounded corners: laid (initial.py), relaxed
    with a certificate (relax.py), and without a cusp. A run that gets none has `fits` False.

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
    # the longest span of a run: of its slowest leg
    of_run = _smallest(longest, runs)
    splines = lay(corridor, of_run)
    jerk = machine.limits("jerk", axes)
    weights = (jerk.min() / jerk) ** 2
    goal = Goal(RELATIVE_GAP, weights, REACH)
    relaxed = relax(corridor, splines, runs, goal)
    splines = splines._replace(control=relaxed.control)
    splines = splines._replace(fits=relaxed.certified & ~cusps(splines))
    reserve = float((tolerance - tol).min())
    return SplineShape(runs=runs, corridor=corridor, splines=splines, left=relaxed.left, reserve=reserve)


def cusps(splines: Splines) -> Array:
    """(Q,) True for runs with a cusp (`cusp_spans`)."""
    if not len(splines.fits):
        return splines.fits
    return np.asarray(np.logical_or.reduceat(cusp_spans(splines), splines.span_first[:-1]))


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
    spans = np.flatnonzero(lost & (splines.outside | (shape.left < 0.0) | cusp_spans(splines)))
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
