"""Paper 001's guide: a smooth path as chords so fine that they are the path.

The chords leave the path by a fraction of its tolerance at most (`SAGITTA`), which is taken off the
tolerance, and turn by little from one to the next. Each chord knows the largest curvature beside it, and how
fast the limits of the axes let a point go round a circle of this curvature in the osculating plane (paper
001, par. 9 to 17): with the unit vectors T along the path and N towards the centre

    |a_k| <= kappa v^2 amplitude_k,   |j_k| <= kappa^2 v^3 amplitude_k,   amplitude_k = sqrt(T_k^2 + N_k^2) = sqrt(1 - n_k^2).
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.fir.command import lower_between
from planner.baselines.fir.guide import Guide, per, picked
from planner.corners.elements import ElementIntervals, element_point, to_arc_length
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine import Machine

# Deviation of chords from the path [fraction of the tolerance], their turning to the next one [rad].
SAGITTA, TURN = 0.01, 0.1
# Times for which a lower feed may have to hold on beside its block, where chords are cut [s]: 2 ms to 0.35 s,
# as filters come.
CUTS = 2e-3 * 1.6 ** np.arange(12)
STRAIGHT = 1e-12  # a curvature below this is rounding [1/mm]


@dataclass(frozen=True, eq=False, kw_only=True)
class ChordGuide(Guide):
    """The chords of a smooth path, with what paper 001's formulas need of each."""

    feed: FloatArray = per("leg", finite=False)
    programmed: FloatArray = per("leg", finite=False)  # (R,) programmed feed, inf for rapids [mm/s]
    kappa: FloatArray = per("leg")  # (R,) largest curvature of the path at the chord [1/mm]
    # (R,) speed that the axes' accelerations allow on a circle of it [mm/s] (par. 13); inf if straight
    v_acc: FloatArray = per("leg", finite=False)
    v_jerk: FloatArray = per("leg", finite=False)  # (R,) the same for their jerks (par. 17)
    tol: FloatArray = per("leg")  # (R,) what filters and interpolation may use of the tolerance [mm]
    corner: Array = per("leg", np.int64)  # (R,) joint whose corner the chord belongs to, ascending, or -1
    sin_half: FloatArray = per("leg")  # (R,) sine of half the turning angle there [-]
    whole: FloatArray = per("leg")  # (R,) tolerance, with what the rounding uses of it [mm]
    segment: Array = per("leg", np.int64)  # (R,) segment of the toolpath

    @property
    def budget(self) -> FloatArray:
        """(R, 2) the same on both halves of a chord [mm]."""
        return np.stack([self.tol, self.tol], axis=1)


def cut_beside_slower(guide: ChordGuide) -> ChordGuide:
    """The same guide with its chords cut beside feeds that are lower than theirs, at the lengths that these run in the
    times `CUTS`: filters make the lower feed hold on there (`feeds_held`), and a long chord should not as a whole."""
    change = np.flatnonzero((guide.programmed[1:] != guide.programmed[:-1]) & guide.inner[1:-1]) + 1
    before, after = guide.programmed[change - 1], guide.programmed[change]
    beside = np.where(before < after, before, -after)[:, None] * CUTS
    run = np.repeat(guide.run[change], len(CUTS))
    s = (guide.s[change, None] + beside).ravel()
    inside = (s > guide.s[guide.first[run]]) & (s < guide.s[guide.first[run + 1]])
    s = np.setdiff1d(s[inside], guide.s)
    at = np.searchsorted(guide.s, s, side="right") - 1  # the chord that is cut
    rows = np.insert(np.arange(len(guide)), at + 1, at)
    columns = picked(guide, {"leg": rows, "joint": np.arange(len(guide) + 1)})
    cuts = guide.point[at] + (s - guide.s[at])[:, None] * guide.direction[at]
    columns["point"] = np.insert(guide.point, at + 1, cuts, axis=0)
    columns["s"] = np.insert(guide.s, at + 1, s)
    columns["length"] = np.diff(columns["s"])
    first = guide.first + np.searchsorted(at, guide.first)
    return dataclasses.replace(guide, first=first, **columns)


def feeds_held(guide: ChordGuide, T1: FloatArray, T2: FloatArray) -> FloatArray:
    """Speeds (R,) [mm/s] at which chords keep the programmed feeds behind filters T1, T2 (S,) [s] of runs.

    Where the filtered motion is at s, the command has been within V Td/2 of it if it ran there at V at most;
    so a feed V that is lower than those beside it has to hold on V Td/2 before and behind.
    """
    speed = guide.programmed.copy()
    edge = np.flatnonzero(~guide.inner[:-1] | (guide.programmed != np.roll(guide.programmed, 1)))
    run, value = guide.run[edge], guide.programmed[edge]
    ends = np.append(edge[1:], len(guide))  # one behind the last chord of each feed
    beside = np.append(run[1:] == run[:-1], False)
    lower = np.append(value[1:] > value[:-1], False) & beside
    lower[1:] |= (value[:-1] > value[1:]) & beside[:-1]
    edge, ends, run, value = edge[lower], ends[lower], run[lower], value[lower]
    reach = value * (T1 + T2)[run] / 2
    low, high = guide.first[run], guide.first[run + 1]
    begin = np.searchsorted(guide.s, guide.s[edge] - reach, side="right") - 1
    end = np.searchsorted(guide.s, guide.s[ends] + reach, side="left")
    order = np.argsort(value)
    lower_between(order, value, np.maximum(begin, low), np.clip(end, edge + 1, high), speed)
    return speed


def guide_of_path(
    samples: PathSamples, machine: Machine, profile_filters: tuple[float, float] | None = None
) -> ChordGuide:
    """The chords of a smooth path, cut beside lower feeds too (`cut_beside_slower`); `profile_filters` as of `Guide`."""
    path, segment = samples.path, samples.segment
    toolpath = path.toolpath
    corner = np.where(samples.element < 0, ~samples.element, -1)
    whole = np.where(corner >= 0, path.tol[corner], toolpath.along[segment])
    tol = whole - np.where(corner >= 0, path.tol_ap[corner], 0.0)
    behind = np.linalg.norm(np.append(samples.d2_left[1:], samples.d2_left[-1:], axis=0), axis=1)
    kappa = np.maximum(np.linalg.norm(samples.d2_right, axis=1), behind)
    h = np.diff(samples.s, append=samples.s[-1])
    chords = np.ceil(np.maximum(h * np.sqrt(kappa / (8.0 * SAGITTA * tol)), h * kappa / TURN))
    chords = np.maximum(chords, 1).astype(np.int64)
    chords[samples.piece[1:] - 1] = 1
    start, end = (np.empty((chords.sum(), 4, len(toolpath.axes))) for _ in range(2))
    on = ElementIntervals(*samples.table, samples.element, samples.w0, samples.w1)
    _evaluate(on, chords, start, end)
    row = np.repeat(np.arange(len(samples)), chords)
    first = np.concatenate([[0], np.cumsum(chords)])[samples.piece]
    chord = end[:, 0] - start[:, 0]
    chord[first[1:] - 1] = 0.0  # each run ends with one that has no length
    length = np.linalg.norm(chord, axis=1)
    moving = length > 0
    start, end, chord, length, row = start[moving], end[moving], chord[moving], length[moving], row[moving]
    axes, programmed, at_corner = toolpath.axes, toolpath.feed[segment][row], corner[row]
    with np.errstate(divide="ignore", over="ignore"):
        axes_allow = length * (machine.limits("velocity", axes) / np.abs(chord)).min(axis=1)
    speeds = [_circle_speeds(side, machine, axes) for side in (start, end)]
    made = ChordGuide(
        axes=axes,
        profile_filters=profile_filters,
        first=np.append(0, np.cumsum(moving)[first[1:] - 1]),
        dwell=toolpath.dwell[path.legs.first[samples.stop]],
        point=np.vstack([start[:, 0], end[-1:, 0]]),
        s=np.append(0.0, np.cumsum(length)),
        length=length,
        direction=chord / length[:, None],
        feed=np.minimum(programmed, axes_allow),
        programmed=programmed,
        kappa=np.maximum(*(np.linalg.norm(side[:, 2], axis=1) for side in (start, end))),
        v_acc=np.minimum(speeds[0][0], speeds[1][0]),
        v_jerk=np.minimum(speeds[0][1], speeds[1][1]),
        tol=tol[row] * (1 - SAGITTA),
        corner=at_corner,
        sin_half=np.where(at_corner >= 0, np.sin(path.theta[at_corner] / 2), 0.0),
        whole=whole[row],
        segment=segment[row],
    )
    return cut_beside_slower(made)


def _circle_speeds(
    by_s: FloatArray, machine: Machine, axes: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """v_acc and v_jerk (P,) from point and derivatives by the arc length (P, 4, A)."""
    kappa = np.linalg.norm(by_s[:, 2], axis=1)
    bent = kappa[:, None] > STRAIGHT
    normal = np.divide(by_s[:, 2], kappa[:, None], out=np.zeros_like(by_s[:, 2]), where=bent)
    amplitude = np.where(bent, np.sqrt(by_s[:, 1] ** 2 + normal**2), 0.0)
    with np.errstate(divide="ignore", over="ignore"):
        a, j = ((machine.limits(q, axes) / amplitude).min(axis=1) for q in ("acceleration", "jerk"))
        return np.sqrt(a / kappa), np.cbrt(j / kappa**2)


@njit(cache=True, error_model="numpy")
def _evaluate(on, chords, start, end):
    """Point and arc-length derivatives at start and end of all chords, into start and end (n, 4, A)."""
    work = np.empty((2, 4, start.shape[2]))
    n = 0
    for i in range(len(on.element)):
        w_ref = 0.5 * (on.w0[i] + on.w1[i])
        for p in range(chords[i]):
            for side in range(2):
                out = start[n] if side == 0 else end[n]
                w = on.w0[i] + (on.w1[i] - on.w0[i]) * (p + side) / chords[i]
                element_point(on.legs, on.corners, on.spans, on.element[i], w, w_ref, work, out)
                to_arc_length(out)
            n += 1
