"""The corridor of each run: the path as a chain of chords with tolerances, for a spline inside.

A straight leg is one chord, or one for each of its programmed feeds: a spline may slide along a chord, but
has to pass the place where the feed changes. An arc becomes chords whose sagitta is at most `SAGITTA` of the
tolerance. The chain stands for the path only where distances are bounded; no motion follows it.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array
from planner.base.kernels import njit
from planner.corners.smooth import SmoothPath
from planner.geometry.legs import leg_point
from planner.smoothing.runs import SplineRuns

SAGITTA = 0.01  # of chords on arcs [share of the tolerance], which the corridor is narrower there
# A change of the feed so near to a run's end is there [share of the tolerance]: no chord is shorter.
APART = 1e-3


class Corridor(NamedTuple):
    """V vertices of all runs, run q holds first[q] : first[q+1]; or of one run (`run_corridor`)."""

    first: Array  # (Q+1,)
    place: Array  # (V,) along the legs from the start of the job [mm]
    point: Array  # (V, A) [mm]
    turn: Array  # (V,) turning angle between the chords before and after [rad], 0 at the ends of a run
    along: Array  # (V, A) direction of the chord that follows
    tol: Array  # (V,) tolerance at the vertex [mm]
    tol_chord: Array  # (V,) tolerance of the chord that follows, less its sagitta [mm]


class FeedChanges(NamedTuple):
    """Places on legs where the programmed feed changes, in order; leg r has first[r] : first[r+1]."""

    first: Array  # (R+1,)
    place: Array  # along their leg [mm]


def find_corridor(path: SmoothPath, runs: SplineRuns, tol: Array) -> Corridor:
    """The corridors of all runs; `tol` (M+1,) at the toolpath's joints [mm]."""
    at = path.legs.first
    of_leg = np.minimum.reduceat(np.minimum(tol[:-1], tol[1:]), at[:-1])
    place = np.concatenate([[0.0], np.cumsum(path.legs.length)])
    return Corridor(
        *_corridor(path.legs.table, place, of_leg, _feed_changes(path), runs, len(path.toolpath.axes))
    )


def _feed_changes(path: SmoothPath) -> FeedChanges:
    legs, feed = path.legs, path.toolpath.feed
    inside = np.ones(len(feed), dtype=bool)
    inside[legs.first[:-1]] = False
    at = np.flatnonzero(inside & np.append(False, feed[1:] != feed[:-1]))
    return FeedChanges(np.searchsorted(at, legs.first), legs.offset[at])


@njit(cache=True, error_model="numpy")
def run_corridor(whole, q):
    """The corridor of run q."""
    first, place, point, turn, along, tol, tol_chord = whole
    a, b = first[q], first[q + 1]
    return Corridor(first[:0], place[a:b], point[a:b], turn[a:b], along[a:b], tol[a:b], tol_chord[a:b])


@njit(cache=True, error_model="numpy")
def _chords(leg, tol, begin, end, changes):
    """Into how many chords a leg is cut from begin to end, and the index of the first of the feed changes on
    it."""
    if leg.round:
        curvature = abs(leg.radius * leg.rate * leg.rate)
        return int(np.ceil((end - begin) / np.sqrt(8.0 * SAGITTA * tol / curvature))) + 1, 0
    chords, first = 1, 0
    for k in range(len(changes)):
        if changes[k] < begin + APART * tol:
            first = k + 1
        elif changes[k] < end - APART * tol:
            chords += 1
    return chords, first


@njit(cache=True, error_model="numpy")
def _vertices(runs, legs, tol, changes):
    """(Q+1,) where the vertices of each run begin."""
    first = np.zeros(len(runs.joint_first) + 1, np.int64)
    for q in range(len(runs.joint_first)):
        n = first[q] + 1
        for leg in range(runs.joint_first[q] - 1, runs.joint_last[q] + 1):
            begin, end = _extent(runs, q, leg, legs[leg].length)
            own = changes.place[changes.first[leg] : changes.first[leg + 1]]
            n += _chords(legs[leg], tol[leg], begin, end, own)[0]
        first[q + 1] = n
    return first


@njit(cache=True, error_model="numpy")
def _extent(runs, q, leg, length):
    """Which part of a leg belongs to run q [mm]."""
    begin = runs.x_first[q] if leg == runs.joint_first[q] - 1 else 0.0
    end = runs.x_last[q] if leg == runs.joint_last[q] else length
    return begin, end


@njit(cache=True, error_model="numpy")
def _corridor(legs, starts, tol, changes, runs, axes):
    """Columns of `Corridor`; starts, tol (R,) place along the legs and tolerance of each leg [mm]."""
    first = _vertices(runs, legs, tol, changes)
    total = first[-1]
    place, turn = np.empty(total), np.zeros(total)
    point, along = np.empty((total, axes)), np.zeros((total, axes))
    tol_here, tol_chord = np.empty(total), np.empty(total)
    out = np.empty((4, axes))
    for q in range(len(runs.joint_first)):
        n = first[q]
        for leg in range(runs.joint_first[q] - 1, runs.joint_last[q] + 1):
            begin, end = _extent(runs, q, leg, legs[leg].length)
            own = changes.place[changes.first[leg] : changes.first[leg + 1]]
            chords, change = _chords(legs[leg], tol[leg], begin, end, own)
            bend = abs(legs[leg].radius * legs[leg].rate * legs[leg].rate) if legs[leg].round else 0.0
            sagitta = bend * ((end - begin) / chords) ** 2 / 8.0
            for c in range(chords + (1 if leg == runs.joint_last[q] else 0)):
                x = begin + (end - begin) * c / chords
                if not legs[leg].round and 0 < c < chords:
                    x = own[change + c - 1]
                leg_point(legs, leg, x, out)
                place[n + c] = starts[leg] + x
                for k in range(axes):
                    point[n + c, k] = out[0, k]
                tol_here[n + c] = tol[leg]
                if c == 0 and leg >= runs.joint_first[q]:
                    tol_here[n] = min(tol[leg - 1], tol[leg])
                tol_chord[n + c] = tol[leg] - sagitta
            n += chords
        for v in range(first[q], first[q + 1] - 1):
            size = 0.0
            for k in range(axes):
                along[v, k] = point[v + 1, k] - point[v, k]
                size += along[v, k] * along[v, k]
            size = np.sqrt(size)
            for k in range(axes):
                along[v, k] /= size
            if v > first[q]:
                across = 0.0
                for k in range(axes):
                    across += (along[v, k] - along[v - 1, k]) ** 2
                turn[v] = 2.0 * np.arcsin(min(0.5 * np.sqrt(across), 1.0))
    return first, place, point, turn, along, tol_here, tol_chord
