"""What the filters are led along: a smooth path, or a curve, as chords so fine that they are the path.

The chords leave the path by a share of its tolerance at most (`SAGITTA`), which is taken off the tolerance, and turn by little from one
to the next. Each chord knows the largest curvature next to it, and how fast the limits of the axes let a point go round a circle of
this curvature in the osculating plane (paper 001, par. 9 to 17): with the unit vectors T along the path and N to the centre

    |a_k| <= kappa v^2 amplitude_k,   |j_k| <= kappa^2 v^3 amplitude_k,   amplitude_k = sqrt(T_k^2 + N_k^2) = sqrt(1 - n_k^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from planner.arrays import Array, FloatArray, freeze
from planner.corners.elements import element_point, to_arc_length
from planner.corners.smooth import SmoothPath
from planner.geometry.nurbs import Nurbs
from planner.machine import Machine
from planner.path import PathSamples

SAGITTA = 0.01  # deviation of the chords from the path [share of the tolerance]
TURN = 0.05  # from one chord to the next [rad]
STRAIGHT = 1e-12  # curvature below this is rounding [1/mm]


@dataclass(frozen=True, eq=False, kw_only=True)
class Guide:
    """P points in G runs from rest to rest: first[g] .. first[g+1] - 1, the last of them the run's end, which is the next one's start.

    Values of the chord from each point to the next; at the end of a run there is none, its length is 0.

    axes    : axis letters
    first   : (G+1,)
    dwell   : (G+1,) standstill before the first run and after each [s]
    point   : (P, A) [mm]
    s       : (P,) length along the chords from the start of the job [mm]
    length  : (P,) of the chord [mm]
    feed    : (P,) programmed feed, at most what the axes' velocities allow [mm/s]
    kappa   : (P,) largest curvature of the path at the chord [1/mm]
    v_acc, v_jerk : (P,) speeds that the axes' accelerations and jerks allow on a circle of that curvature [mm/s]; inf if straight
    tol     : (P,) what filters and interpolation may use of the tolerance [mm]
    segment : (P,) segment of the toolpath
    """

    axes: tuple[str, ...]
    first: Array
    dwell: FloatArray
    point: FloatArray
    s: FloatArray
    length: FloatArray
    feed: FloatArray
    kappa: FloatArray
    v_acc: FloatArray
    v_jerk: FloatArray
    tol: FloatArray
    segment: Array

    def __post_init__(self) -> None:
        points = len(self.point)
        freeze(self, "first", np.int64, (None,))
        freeze(self, "dwell", np.float64, (len(self.first),))
        freeze(self, "point", np.float64, (points, len(self.axes)))
        for name in ("s", "length", "kappa", "tol"):
            freeze(self, name, np.float64, (points,))
        for name in ("feed", "v_acc", "v_jerk"):
            freeze(self, name, np.float64, (points,), finite=False)
        freeze(self, "segment", np.int64, (points,))

    def __len__(self) -> int:
        return len(self.point)

    @property
    def runs(self) -> int:
        """G."""
        return len(self.first) - 1

    @property
    def run(self) -> Array:
        """(P,) run of each point."""
        return np.repeat(np.arange(self.runs), np.diff(self.first))

    @property
    def direction(self) -> FloatArray:
        """(P, A) unit vector of each chord; 0 at the end of a run."""
        way = np.diff(self.point, axis=0, append=self.point[-1:])
        return np.divide(way, self.length[:, None], out=np.zeros_like(way), where=self.length[:, None] > 0)

    def pick(self, chosen: Array) -> Guide:
        """The runs `chosen` (G,) by themselves, without dwells."""
        rows = chosen[self.run]
        size = np.diff(self.first)[chosen]
        columns = ("point", "s", "length", "feed", "kappa", "v_acc", "v_jerk", "tol", "segment")
        return Guide(
            axes=self.axes,
            first=np.concatenate([[0], np.cumsum(size)]),
            dwell=np.zeros(len(size) + 1),
            **{name: getattr(self, name)[rows] for name in columns},
        )


def guide_of_path(samples: PathSamples, machine: Machine) -> Guide:
    """The chords of a smooth path."""
    path, at = samples.path, samples.intervals
    toolpath = path.toolpath
    tol = _budget(path, samples.element, samples.segment)
    kappa = np.maximum(np.linalg.norm(samples.d2_right, axis=1), np.linalg.norm(np.roll(samples.d2_left, -1, axis=0), axis=1))
    h = np.diff(samples.s, append=samples.s[-1])
    parts = np.ones(len(samples), np.int64)
    fine = np.maximum(h * np.sqrt(kappa / (8.0 * SAGITTA * tol)), h * kappa / TURN)
    parts[at] = np.maximum(np.ceil(fine[at]), 1)
    start, end = (np.empty((parts.sum(), 4, len(toolpath.axes))) for _ in range(2))
    _evaluate(*samples.table, samples.element, samples.w0, samples.w1, parts, start, end)
    first = np.concatenate([[0], np.cumsum(parts)])[samples.piece]
    closing = np.zeros(len(start), bool)
    closing[first[1:] - 1] = True
    row = np.repeat(np.arange(len(samples)), parts)
    return _guide(
        toolpath.axes, first, toolpath.dwell[path.legs.first[samples.stop]], start, end, closing,
        toolpath.feed[samples.segment][row], tol[row], samples.segment[row], machine,
    )  # fmt: skip


def guide_of_curve(curve: Nurbs, machine: Machine, feed: float, tolerance: float) -> Guide:
    """The chords of a curve at `feed` [mm/s] within `tolerance` [mm]; full stops at its kinks."""
    u = curve.stations(SAGITTA * tolerance)
    h = curve.length_between(u[:-1], u[1:])
    kappa = np.maximum(*(np.linalg.norm(curve.along(at, before=side)[:, 2], axis=1) for at, side in ((u[:-1], False), (u[1:], True))))
    parts = np.maximum(np.ceil(h * kappa / TURN), 1).astype(np.int64)
    inner = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    u = np.append(np.repeat(u[:-1], parts) + inner / np.repeat(parts, parts) * np.repeat(np.diff(u), parts), u[-1])
    stops = np.append(curve.kinks, u[-1])
    where = np.searchsorted(u, stops)
    closing = np.insert(np.zeros(len(u) - 1, bool), where, True)
    row = np.arange(len(closing)) - np.cumsum(closing) + closing  # of u, once more where a run ends
    start, end = curve.along(u[row]), curve.along(u[np.minimum(row + 1, len(u) - 1)], before=True)
    start[closing] = end[closing] = curve.along(u[row[closing]], before=True)
    count = len(row)
    return _guide(
        curve.axes, np.concatenate([[0], np.flatnonzero(closing) + 1]), np.zeros(len(stops) + 1), start, end, closing,
        np.full(count, feed), np.full(count, tolerance), np.zeros(count, np.int64), machine,
    )  # fmt: skip


def _guide(
    axes: tuple[str, ...], first: Array, dwell: FloatArray, start: FloatArray, end: FloatArray, closing: Array,
    feed: FloatArray, tol: FloatArray, segment: Array, machine: Machine,
) -> Guide:  # fmt: skip
    """From points and derivatives (P, 4, A) at the start and the end of each chord; `closing` (P,) ends a run."""
    way = np.where(closing[:, None], 0.0, end[:, 0] - start[:, 0])
    length = np.linalg.norm(way, axis=1)
    velocity, acceleration, jerk = (machine.limits(q, axes) for q in ("velocity", "acceleration", "jerk"))
    with np.errstate(divide="ignore", invalid="ignore"):
        axes_allow = (velocity / (np.abs(way) / length[:, None])).min(axis=1)
    speeds = [_circle_speeds(side, acceleration, jerk) for side in (start, end)]
    kappa = np.maximum(*(np.linalg.norm(side[:, 2], axis=1) for side in (start, end)))
    return Guide(
        axes=axes,
        first=first,
        dwell=dwell,
        point=start[:, 0],
        s=np.concatenate([[0.0], np.cumsum(length)[:-1]]),
        length=length,
        feed=np.where(closing, np.inf, np.minimum(feed, axes_allow)),
        kappa=kappa,
        v_acc=np.minimum(speeds[0][0], speeds[1][0]),
        v_jerk=np.minimum(speeds[0][1], speeds[1][1]),
        tol=(1.0 - SAGITTA) * tol,
        segment=segment,
    )


def _circle_speeds(by_s: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> tuple[FloatArray, FloatArray]:
    """v_acc and v_jerk (P,) from point and derivatives by the arc length (P, 4, A)."""
    kappa = np.linalg.norm(by_s[:, 2], axis=1)
    bent = kappa > STRAIGHT
    normal = np.divide(by_s[:, 2], kappa[:, None], out=np.zeros_like(by_s[:, 2]), where=bent[:, None])
    amplitude = np.sqrt(by_s[:, 1] ** 2 + normal**2)
    with np.errstate(divide="ignore"):
        a, j = (limit / np.where(bent[:, None], amplitude, 0.0) for limit in (acceleration, jerk))
        return np.sqrt(a.min(axis=1) / kappa), np.cbrt(j.min(axis=1) / kappa**2)


def _budget(path: SmoothPath, element: Array, segment: Array) -> FloatArray:
    """What the rounding leaves of the tolerance on each interval [mm]."""
    joint = np.where(element < 0, ~element, 0)
    tolerance = path.toolpath.tolerance
    return np.where(element < 0, path.tol[joint] - path.tol_ap[joint], np.minimum(tolerance[segment], tolerance[segment + 1]))


@njit(cache=True, error_model="numpy")
def _evaluate(legs, corners, element, w0, w1, parts, start, end):
    """Point and arc-length derivatives at start and end of all parts of the intervals, into start and end (n, 4, A)."""
    work = np.empty((2, 4, start.shape[2]))
    n = 0
    for i in range(len(element)):
        w_ref = 0.5 * (w0[i] + w1[i])
        for p in range(parts[i]):
            for side in range(2):
                out = start[n] if side == 0 else end[n]
                element_point(legs, corners, element[i], w0[i] + (w1[i] - w0[i]) * (p + side) / parts[i], w_ref, work, out)
                to_arc_length(out)
            n += 1
