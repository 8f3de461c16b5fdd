"""Look-ahead over a path of stretches: corners at constant speed, and jerk-limited S-curves on what is free between them (paper 002).

A job is a chain of stretches that meet with zero acceleration along the path. On a *free* stretch of length D with limits v, a, j
along the path the motion ramps from its first speed to a top speed and from there to its last speed; a *corner* is run through at
one speed. A free stretch from V1 to V2 can be run iff the faster of its ends is within `reach` of the slower one
(lookahead/look_ahead.py, Cardano), so one sweep backwards and one forwards,

    V_m <= V_{m+1} + reach(V_{m+1}, D),    V_{m+1} <= V_m + reach(V_m, D),        both speeds of a corner the same,

give the largest speeds at all stretch ends: lowering V_{m+1} in the second sweep leaves V_m <= V_{m+1}, so the first still holds.

Running through a corner is not always better than stopping at its vertex: the ramps before and after it must die out, and a corner at
low speed takes long. So each corner is run through at the speed that the sweeps allow, or it is a full stop at its vertex (without
rounding: what that took of both legs is free), such that the whole is fastest: dynamic programming over the corners. Stopping at
every corner is among the choices. Lower speeds in a corner are not; on 120 random paths none was ever chosen.

All of it is linear in the number of stretches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.lookahead.ramps import leg_top, reach

ROUNDING = 1e-12  # of speeds [-]
PHASES = 7  # of a free stretch: two ramps of three phases, and the cruise between them


@dataclass(frozen=True, eq=False, kw_only=True)
class Stretches:
    """M stretches; each run between full stops begins and ends with a free one, and there is at least one between two corners.

    run    : (M,) which run between full stops it belongs to, non-decreasing
    joint  : (M,) joint of a corner, -1 for a free stretch
    length : (M,) [mm]
    v      : (M,) largest speed [mm/s]
    a, j   : (M,) acceleration and jerk along a free stretch [mm/s2], [mm/s3]
    d_in, d_out : (M,) what a corner takes of the legs before and after its vertex [mm]; 0 for a free stretch
    """

    run: Array
    joint: Array
    length: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray
    d_in: FloatArray
    d_out: FloatArray

    def __post_init__(self) -> None:
        for name in ("run", "joint"):
            freeze(self, name, np.int64, (len(self.run),))
        for name in ("length", "v", "a", "j", "d_in", "d_out"):
            freeze(self, name, np.float64, (len(self.run),))

    def __len__(self) -> int:
        return len(self.run)


def better_stopped(stretches: Stretches) -> Array:
    """(M,) True for the corners that are full stops in the fastest choice."""
    V = largest_speeds(stretches)
    columns = (stretches.run, stretches.joint, stretches.length, stretches.v, stretches.a, stretches.j)
    return _choose(*columns, stretches.d_in, stretches.d_out, V)


def largest_speeds(stretches: Stretches) -> FloatArray:
    """(M+1,) largest speeds at the stretches' ends [mm/s]."""
    V = np.minimum(np.append(stretches.v, np.inf), np.insert(stretches.v, 0, np.inf))
    V[np.flatnonzero(np.diff(stretches.run, prepend=-1, append=-1))] = 0.0
    _sweep(V, stretches.joint >= 0, stretches.length, stretches.a, stretches.j)
    return V


def phases(stretches: Stretches, V: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Durations [s] and jerks [mm/s3], both (M, 7), of every stretch between the speeds V (M+1,); a corner is a cruise."""
    duration, jerk = np.zeros((len(stretches), PHASES)), np.zeros((len(stretches), PHASES))
    _phases(stretches.joint, stretches.length, stretches.v, stretches.a, stretches.j, V, duration, jerk)
    return duration, jerk


@njit(cache=True, error_model="numpy")
def _sweep(V, corner, length, a, j):
    """Lower the speeds V (M+1,), in place, until every stretch can be run."""
    for m in range(len(length) - 1, -1, -1):
        V[m] = min(V[m], V[m + 1] + (0.0 if corner[m] else reach(V[m + 1], length[m], a[m], j[m])))
    for m in range(len(length)):
        V[m + 1] = min(V[m + 1], V[m] + (0.0 if corner[m] else reach(V[m], length[m], a[m], j[m])))


@njit(cache=True, error_model="numpy")
def _end(V):
    """An end of a free stretch at the speed V, as `leg_top` takes it: no corner, no acceleration."""
    return 0.0, V, 0.0, V, 0.0


@njit(cache=True, error_model="numpy")
def _ramp_time(x, a, j):
    """Time [s] to change the speed by x [mm/s], without acceleration at both ends."""
    return x / a + a / j if x > a * a / j else 2.0 * np.sqrt(x / j)


@njit(cache=True, error_model="numpy")
def _free_time(V1, V2, length, v, a, j):
    """Shortest time [s] of a free stretch that can be run from V1 to V2."""
    if length <= 0.0:
        return 0.0
    W, up, down, rest = leg_top(_end(V1), _end(V2), length, v, a, j)
    return _ramp_time(up, a, j) + _ramp_time(down, a, j) + (rest / W if rest > 0.0 else 0.0)


@njit(cache=True, error_model="numpy")
def _between(first, last, V1, V2, more1, more2, length, v, a, j, V):
    """Time [s] of the free stretches first .. last from V1 to V2, the first longer by more1, the last by more2; inf if impossible.

    V (M+1,) is scratch.
    """
    V[first], V[last + 1] = V1, V2
    for m in range(first, last + 1):
        far = length[m] + (more1 if m == first else 0.0) + (more2 if m == last else 0.0)
        top = V[m] + reach(V[m], far, a[m], j[m])
        if m < last:
            V[m + 1] = min(v[m], v[m + 1], top)
        elif top * (1.0 + ROUNDING) < V2:
            return np.inf
    time = 0.0
    for m in range(last, first - 1, -1):
        far = length[m] + (more1 if m == first else 0.0) + (more2 if m == last else 0.0)
        top = V[m + 1] + reach(V[m + 1], far, a[m], j[m])
        if m > first:
            V[m] = min(V[m], top)
        elif top * (1.0 + ROUNDING) < V1:
            return np.inf
        time += _free_time(V[m], V[m + 1], far, v[m], a[m], j[m])
    return time


@njit(cache=True, error_model="numpy")
def _choose(run, joint, length, v, a, j, d_in, d_out, V):
    """(M,) True for the corners that are stops in the fastest choice; V (M+1,) are the speeds of those that are not."""
    stopped = np.zeros(len(run), np.bool_)
    back = np.zeros(
        (len(run), 2), np.int64
    )  # state of the corner before: 0 it is run through, 1 it is a stop
    best, now, work = np.empty(2), np.empty(2), np.empty(len(run) + 1)
    corners = np.empty(len(run), np.int64)  # of the run so far
    first, count = 0, 0
    for m in range(len(run)):
        ends = m + 1 == len(run) or run[m + 1] != run[m]
        if joint[m] < 0 and not ends:
            continue
        for state in range(2):
            stop = ends or state == 1
            lasting = 0.0 if stop else length[m] / V[m]
            more = d_in[m] if stop else 0.0
            now[state] = np.inf
            for before in range(2):
                if count == 0:
                    began, V1, ahead = 0.0, 0.0, 0.0
                else:
                    k = corners[count - 1]
                    began, V1, ahead = (
                        best[before],
                        (V[k] if before == 0 else 0.0),
                        (d_out[k] if before == 1 else 0.0),
                    )
                last = m if ends else m - 1
                time = began + lasting
                if time < now[state]:
                    time += _between(
                        first, last, V1, 0.0 if stop else V[m], ahead, more, length, v, a, j, work
                    )
                if time < now[state]:
                    now[state], back[m, state] = time, before
        first = m + 1
        if ends:
            state = back[m, 1]
            for c in range(count - 1, -1, -1):
                stopped[corners[c]] = state == 1
                state = back[corners[c], state]
            count = 0
        else:
            best[:] = now
            corners[count] = m
            count += 1
    return stopped


@njit(cache=True, error_model="numpy")
def _phases(joint, length, v, a, j, V, duration, jerk):
    for m in range(len(length)):
        if length[m] <= 0.0:
            continue
        if joint[m] >= 0:
            duration[m, 3] = length[m] / V[m]
            continue
        W, up, down, rest = leg_top(_end(V[m]), _end(V[m + 1]), length[m], v[m], a[m], j[m])
        for side in range(2):
            x = up if side == 0 else down
            peak = min(a[m], np.sqrt(j[m] * x))
            held = x / a[m] - a[m] / j[m] if x > a[m] * a[m] / j[m] else 0.0
            for part in range(3):
                f = part if side == 0 else 6 - part
                duration[m, f] = held if part == 1 else peak / j[m]
                jerk[m, f] = (1.0 - part) * j[m]
        duration[m, 3] = rest / W if rest > 0.0 else 0.0
