"""Moves in step with the spindle: threads. Between run-in and run-out the turns say where the tool is.

From rest to the feed F, with the limits a and j of the axes along a straight move, no motion needs more than

    d = F T / 2,    T = F / a + a / j   if F > a^2 / j,   else 2 sqrt(F / j)         (the jerk-limited step, symmetric about its middle)

Further than d (1 + `MORE`) from both ends the place s along the move is that of a constant speed, s = F t + c
with one c for the move, to the contour tolerance eps: at every sample there

    | s - F t - c |  <=  eps,      c the mean of the largest and the smallest s - F t.

A speed of (1 - 1e-3) F is a fault on threads longer than 2000 eps; shorter moves are not judged.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, first_of
from planner.verifier.pieces import CONTOUR_ROUNDING
from planner.verifier.verdict import ThreadCheck

MORE = 0.02  # of d, by which a plan on a grid may take longer [-]


def thread_checks(
    trajectory: Trajectory, passed: FloatArray, toolpath: Toolpath, machine: Machine
) -> tuple[ThreadCheck, ...]:
    """How far each move in step with the spindle is out of step, in the order of the program; passed (M+1,): when the
    motion passes the joints of the path [s]."""
    held = np.flatnonzero(toolpath.held)
    if not len(held):
        return ()
    off = _out_of_step(trajectory, passed, toolpath, held, room_of(toolpath, machine, held))
    allowed = np.minimum(toolpath.tolerance[held], toolpath.tolerance[held + 1])
    columns = (column.tolist() for column in (toolpath.line[held], toolpath.feed[held], off, allowed))
    rows = zip(*columns, strict=True)
    return tuple(ThreadCheck(line=k, feed=f, error_mm=error, allowed_mm=most) for k, f, error, most in rows)


def thread_faults(threads: tuple[ThreadCheck, ...]) -> list[Fault]:
    """Moves that are not in step with the spindle; the largest errors first."""
    bad = sorted((thread for thread in threads if thread.broken), key=lambda thread: -thread.ratio)
    return first_of(bad, ThreadCheck.fault, "such moves")


def room_of(toolpath: Toolpath, machine: Machine, held: Array) -> FloatArray:
    """(H,) d of the moves `held` (H,) [mm]."""
    along = np.abs(toolpath.end[held] - toolpath.start[held]) / toolpath.length[held, None]
    with np.errstate(divide="ignore"):
        a = np.min(machine.limits("acceleration", toolpath.axes) / along, axis=1)
        j = np.min(machine.limits("jerk", toolpath.axes) / along, axis=1)
    feed = toolpath.feed[held]
    return 0.5 * feed * np.where(feed * j > a * a, feed / a + a / j, np.sqrt(4.0 * feed / j))


def _out_of_step(
    trajectory: Trajectory, passed: FloatArray, toolpath: Toolpath, held: Array, room: FloatArray
) -> FloatArray:
    """(H,) largest |s - F t - c| of the moves `held` (H,) [mm]; 0 without samples behind the run-in."""
    begin, end = passed[held], passed[held + 1]
    length, feed, start = toolpath.length[held], toolpath.feed[held], toolpath.start[held]
    direction = (toolpath.end[held] - start) / length[:, None]
    kept = room * (1.0 + MORE) + CONTOUR_ROUNDING
    low, high = np.full(len(held), np.inf), np.full(len(held), -np.inf)
    for chunk in trajectory.chunks():
        k = np.searchsorted(begin, chunk.t, side="right") - 1
        inside = np.flatnonzero((k >= 0) & (chunk.t <= end[np.maximum(k, 0)]))
        k = k[inside]
        s = np.einsum("na,na->n", chunk.position[inside] - start[k], direction[k])
        seen = (s > kept[k]) & (s < length[k] - kept[k])
        k, behind = k[seen], s[seen] - feed[k[seen]] * (chunk.t[inside[seen]] - begin[k[seen]])
        np.minimum.at(low, k, behind)
        np.maximum.at(high, k, behind)
    return np.where(high > low, 0.5 * (high - low), 0.0)
