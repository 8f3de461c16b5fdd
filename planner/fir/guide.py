"""What the filters are led along: a smooth path, or a curve, as chords so fine that they are the path.

The chords leave the path by a share of its tolerance at most (`SAGITTA`), which is taken off the tolerance, and turn by little from one
to the next. Each chord knows the largest curvature beside it, and how fast the limits of the axes let a point go round a circle of
this curvature in the osculating plane (paper 001, par. 9 to 17): with the unit vectors T along the path and N towards the centre

    |a_k| <= kappa v^2 amplitude_k,   |j_k| <= kappa^2 v^3 amplitude_k,   amplitude_k = sqrt(T_k^2 + N_k^2) = sqrt(1 - n_k^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.corners.elements import element_point, to_arc_length
from planner.fir.schedule import lower_between
from planner.geometry.nurbs import Nurbs
from planner.machine import Machine
from planner.path.samples import PathSamples

SAGITTA = 0.01  # deviation of the chords from the path [share of the tolerance]
TURN = 0.1  # from one chord to the next [rad]
# Times for which a lower feed may have to hold on beside its block, in which chords are cut there [s].
CUTS = 2e-3 * 1.6 ** np.arange(12)
STRAIGHT = 1e-12  # a curvature below this is rounding [1/mm]
COLUMNS = (
    "point",
    "s",
    "length",
    "feed",
    "programmed",
    "kappa",
    "v_acc",
    "v_jerk",
    "tol",
    "corner",
    "sin_half",
    "whole",
    "segment",
)


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
    programmed : (P,) programmed feed, inf for rapids [mm/s]
    kappa   : (P,) largest curvature of the path at the chord [1/mm]
    v_acc, v_jerk : (P,) speeds that the axes' accelerations and jerks allow on a circle of that curvature [mm/s]; inf if straight
    tol     : (P,) what filters and interpolation may use of the tolerance [mm]
    corner  : (P,) joint whose rounded corner the chord belongs to, ascending, or -1
    sin_half: (P,) sine of half the turning angle there
    whole   : (P,) tolerance, with what the rounding uses of it [mm]
    segment : (P,) segment of the toolpath
    """

    axes: tuple[str, ...]
    first: Array
    dwell: FloatArray
    point: FloatArray
    s: FloatArray
    length: FloatArray
    feed: FloatArray
    programmed: FloatArray
    kappa: FloatArray
    v_acc: FloatArray
    v_jerk: FloatArray
    tol: FloatArray
    corner: Array
    sin_half: FloatArray
    whole: FloatArray
    segment: Array

    def __post_init__(self) -> None:
        points = len(self.point)
        freeze(self, "first", np.int64, (None,))
        freeze(self, "dwell", np.float64, (len(self.first),))
        freeze(self, "point", np.float64, (points, len(self.axes)))
        for name in ("s", "length", "kappa", "tol", "sin_half", "whole"):
            freeze(self, name, np.float64, (points,))
        for name in ("feed", "programmed", "v_acc", "v_jerk"):
            freeze(self, name, np.float64, (points,), finite=False)
        for name in ("corner", "segment"):
            freeze(self, name, np.int64, (points,))

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
        length = self.length[:, None]
        return np.divide(way, length, out=np.zeros_like(way), where=length > 0)

    def largest(self, value: FloatArray) -> FloatArray:
        """(G,) the largest of a value per chord (P,) in each run."""
        return np.maximum.reduceat(value, self.first[:-1])

    def pick(self, chosen: Array) -> Guide:
        """The runs `chosen` (G,) by themselves, without dwells."""
        rows = chosen[self.run]
        size = np.diff(self.first)[chosen]
        return Guide(
            axes=self.axes,
            first=np.concatenate([[0], np.cumsum(size)]),
            dwell=np.zeros(len(size) + 1),
            **{name: getattr(self, name)[rows] for name in COLUMNS},
        )


def cut_beside_slower(guide: Guide) -> Guide:
    """The same guide with its chords cut beside feeds that are lower than theirs, by what those run in the times `CUTS`: filters make
    them hold on there (`feeds_held`), and a long chord should not have to as a whole."""
    change = np.flatnonzero(guide.programmed[1:] != guide.programmed[:-1]) + 1
    change = change[np.diff(guide.run)[change - 1] == 0]
    before, after = guide.programmed[change - 1], guide.programmed[change]
    way = np.where(before < after, before, -after)[:, None] * CUTS
    run = np.repeat(guide.run[change], len(CUTS))
    s = (guide.s[change, None] + way).ravel()
    inside = (s > guide.s[guide.first[run]]) & (s < guide.s[guide.first[run + 1] - 1])
    s = np.setdiff1d(s[inside], guide.s)
    at = np.searchsorted(guide.s, s, side="right") - 1  # the chord that is cut
    rows = np.insert(np.arange(len(guide)), at + 1, at)
    new = np.insert(np.zeros(len(guide), bool), at + 1, True)
    columns = {name: getattr(guide, name)[rows] for name in COLUMNS}
    columns["s"][new] = s
    columns["point"][new] += (s - guide.s[at])[:, None] * guide.direction[at]
    columns["length"] = np.where(columns["length"] > 0, np.append(np.diff(columns["s"]), 0.0), 0.0)
    first = guide.first + np.searchsorted(at, guide.first - 1, side="right")
    return Guide(axes=guide.axes, first=first, dwell=guide.dwell, **columns)


def feeds_held(guide: Guide, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """Speeds (P,) up to which the chords keep the programmed feeds behind filters T1, T2 (G,) of the runs.

    Where the filtered motion is at s, the command has been within V Td/2 of it if it ran there at V at most; so a feed V that is lower
    than those beside it has to hold on V Td/2 before and behind.
    """
    speed = guide.programmed.copy()
    new_run = np.diff(guide.run, prepend=-1) != 0
    edge = np.flatnonzero(new_run | (guide.programmed != np.roll(guide.programmed, 1)))
    run, value = guide.run[edge], guide.programmed[edge]
    ends = np.append(edge[1:], len(guide))  # one behind the last chord of each feed
    beside = np.append(run[1:] == run[:-1], False)
    lower = np.append(value[1:] > value[:-1], False) & beside
    lower[1:] |= (value[:-1] > value[1:]) & beside[:-1]
    edge, ends, run, value = edge[lower], ends[lower], run[lower], value[lower]
    reach = value * (T1 + T2)[run] / 2
    low, high = guide.first[run], guide.first[run + 1] - 1
    begin = np.searchsorted(guide.s, guide.s[edge] - reach, side="right") - 1
    end = np.searchsorted(guide.s, guide.s[np.minimum(ends, high)] + reach, side="left")
    order = np.argsort(value)
    lower_between(order, value, np.maximum(begin, low), np.clip(end, edge + 1, high), speed)
    return speed


def guide_of_path(samples: PathSamples, machine: Machine) -> Guide:
    """The chords of a smooth path."""
    path, segment = samples.path, samples.segment
    toolpath = path.toolpath
    corner = np.where(samples.element < 0, ~samples.element, -1)
    beside = np.minimum(toolpath.tolerance[segment], toolpath.tolerance[segment + 1])
    whole = np.where(corner >= 0, path.tol[corner], beside)
    tol = whole - np.where(corner >= 0, path.tol_ap[corner], 0.0)
    behind = np.linalg.norm(np.append(samples.d2_left[1:], samples.d2_left[-1:], axis=0), axis=1)
    kappa = np.maximum(np.linalg.norm(samples.d2_right, axis=1), behind)
    h = np.diff(samples.s, append=samples.s[-1])
    parts = np.ceil(np.maximum(h * np.sqrt(kappa / (8.0 * SAGITTA * tol)), h * kappa / TURN))
    parts = np.maximum(parts, 1).astype(np.int64)
    parts[samples.piece[1:] - 1] = 1
    start, end = (np.empty((parts.sum(), 4, len(toolpath.axes))) for _ in range(2))
    _evaluate(*samples.table, samples.element, samples.w0, samples.w1, parts, start, end)
    row = np.repeat(np.arange(len(samples)), parts)
    first = np.concatenate([[0], np.cumsum(parts)])[samples.piece]
    made = _guide(
        machine,
        start,
        end,
        axes=toolpath.axes,
        first=first,
        dwell=toolpath.dwell[path.legs.first[samples.stop]],
        feed=toolpath.feed[segment][row],
        tol=tol[row],
        corner=corner[row],
        sin_half=np.where(corner >= 0, np.sin(path.theta[corner] / 2), 0.0)[row],
        whole=whole[row],
        segment=segment[row],
    )
    return cut_beside_slower(made)


def guide_of_curve(
    curve: Nurbs, machine: Machine, feed: float, tolerance: float, blocks: FloatArray, reversals: FloatArray
) -> Guide:
    """The chords of a curve at `feed` [mm/s] within `tolerance` [mm]; full stops at its kinks and reversals.

    blocks    : (B+1,) parameters of the ends of the program's blocks
    reversals : (R,) those of them at which the blocks turn back: cusps sharper than the chords
    """
    u = curve.stations(SAGITTA * tolerance)
    kappa = [
        np.linalg.norm(curve.along(at, before=side)[:, 2], axis=1)
        for at, side in ((u[:-1], False), (u[1:], True))
    ]
    turn = curve.length_between(u[:-1], u[1:]) * np.maximum(*kappa)
    parts = np.maximum(np.ceil(turn / TURN), 1).astype(np.int64)
    share = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    u = np.append(np.repeat(u[:-1], parts) + share * np.repeat(np.diff(u) / parts, parts), u[-1])
    stops = np.append(np.union1d(curve.kinks, reversals), u[-1])
    closing = np.insert(np.zeros(len(u) - 1, bool), np.searchsorted(u, stops), True)
    at = u[np.arange(len(closing)) - np.cumsum(closing) + closing]  # a kink's parameter is there twice
    start, end = curve.along(at), curve.along(np.append(at[1:], at[-1]), before=True)
    start[closing] = end[closing] = curve.along(at[closing], before=True)
    count = len(at)
    return _guide(
        machine,
        start,
        end,
        axes=curve.axes,
        first=np.concatenate([[0], np.flatnonzero(closing) + 1]),
        dwell=np.zeros(len(stops) + 1),
        feed=np.full(count, feed),
        tol=np.full(count, tolerance),
        corner=np.full(count, -1),
        sin_half=np.zeros(count),
        whole=np.full(count, tolerance),
        segment=np.clip(np.searchsorted(blocks, at, side="right") - 1, 0, len(blocks) - 2),
    )


def _guide(
    machine: Machine,
    start: FloatArray,
    end: FloatArray,
    *,
    axes: tuple[str, ...],
    first: Array,
    feed: FloatArray,
    tol: FloatArray,
    **columns: Array,
) -> Guide:
    """From points and arc-length derivatives (P, 4, A) at start and end of each chord, and the columns of the record."""
    way = end[:, 0] - start[:, 0]
    way[first[1:] - 1] = 0.0
    length = np.linalg.norm(way, axis=1)
    velocity, acceleration, jerk = (machine.limits(q, axes) for q in ("velocity", "acceleration", "jerk"))
    with np.errstate(divide="ignore", invalid="ignore"):
        axes_allow = np.where(length > 0, length * (velocity / np.abs(way)).min(axis=1), np.inf)
    speeds = [_circle_speeds(side, acceleration, jerk) for side in (start, end)]
    return Guide(
        axes=axes,
        first=first,
        point=start[:, 0],
        s=np.concatenate([[0.0], np.cumsum(length)[:-1]]),
        length=length,
        feed=np.minimum(feed, axes_allow),
        programmed=feed,
        kappa=np.maximum(*(np.linalg.norm(side[:, 2], axis=1) for side in (start, end))),
        v_acc=np.minimum(speeds[0][0], speeds[1][0]),
        v_jerk=np.minimum(speeds[0][1], speeds[1][1]),
        tol=tol - SAGITTA * tol,
        **columns,
    )


def _circle_speeds(
    by_s: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """v_acc and v_jerk (P,) from point and derivatives by the arc length (P, 4, A)."""
    kappa = np.linalg.norm(by_s[:, 2], axis=1)
    bent = kappa[:, None] > STRAIGHT
    normal = np.divide(by_s[:, 2], kappa[:, None], out=np.zeros_like(by_s[:, 2]), where=bent)
    amplitude = np.where(bent, np.sqrt(by_s[:, 1] ** 2 + normal**2), 0.0)
    with np.errstate(divide="ignore"):
        a, j = ((limit / amplitude).min(axis=1) for limit in (acceleration, jerk))
        return np.sqrt(a / kappa), np.cbrt(j / kappa**2)


@njit(cache=True, error_model="numpy")
def _evaluate(legs, corners, spans, element, w0, w1, parts, start, end):
    """Point and arc-length derivatives at start and end of all parts of the intervals, into start and end (n, 4, A)."""
    work = np.empty((2, 4, start.shape[2]))
    n = 0
    for i in range(len(element)):
        w_ref = 0.5 * (w0[i] + w1[i])
        for p in range(parts[i]):
            for side in range(2):
                out = start[n] if side == 0 else end[n]
                w = w0[i] + (w1[i] - w0[i]) * (p + side) / parts[i]
                element_point(legs, corners, spans, element[i], w, w_ref, work, out)
                to_arc_length(out)
            n += 1
