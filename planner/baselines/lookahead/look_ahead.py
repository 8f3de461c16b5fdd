"""Look-ahead over legs and the corners between them: the speed of every corner, or a stop.

A leg is what has the same limits along the path between two joints; at a joint there is a corner, or the
limits change. Corners are candidates of a kind (ramps.JointKind); passed with the speed V a corner of that
kind has a start deceleration (and end acceleration) A, takes l of the legs beside it and lasts T. A and l
grow with V (or do not depend on it), so every candidate is a family with one parameter. What a leg can do
between two corners is in baselines/lookahead/ramps.py, with V' and x as there.

Acceleration has to change its sign on the leg, at a speed not below either V + A^2/(2j); so a leg is feasible
iff from the slower of its ends that speed of the faster one is within reach: W_fast <= V' + x.

1. Candidate by candidate, one sweep backwards and one forwards lower the speeds until every leg is feasible:
   a lower speed never lengthens a corner, so two sweeps are enough.
2. Faster corners are not always better. Over all choices of a candidate or a stop per corner, the fastest is
   found by dynamic programming; between two corners the speeds where only limits change are the largest ones.
   All stops, and every candidate throughout, are among the choices: the result is never slower than these.

Everything is linear in the number of joints.
"""

from collections.abc import Sequence

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.baselines.lookahead.ramps import (
    ENTRY,
    PASS,
    PHASES,
    WAY,
    ZERO,
    corner_at,
    gain_max,
    leg_end,
    leg_phases,
    leg_time,
)

# The choice may lack this fraction of a leg's length [-]: rounding of sums of lengths.
LENGTH_ROUNDING = 1e-14
BISECTIONS = 60  # of a speed's bracket: to its last digit
# A speed in closed form is lowered by this until it is feasible [-]: two units of its last digit.
SPEED_ROUNDING = 4e-16


def look_ahead(legs: np.recarray, candidates: Sequence[np.recarray]) -> tuple[np.recarray, FloatArray]:
    """The fastest choice at every joint, and (n+1,) when the motion is past each joint's corner [s].

    Joints that every candidate passes (`JointKind.PASS`) are no corners: others tell their speed.

    legs       : (n,) records `LEG`
    candidates : (n+1,) records `WAY` each; may overlap nowhere on a leg at their speeds (see `capped`)
    """
    wished = np.stack(candidates)
    straight = (wished["kind"] == PASS).all(axis=0)
    rows = np.concatenate([np.zeros((1, len(legs) + 1), WAY), wished])
    for way in rows[1:]:
        _sweep(way, legs)
    rows["V"][1:, straight] = wished["V"][:, straight]
    ways, time = _choose(rows, straight, legs)
    return ways.view(np.recarray), time


def swept(legs: np.recarray, ways: np.recarray) -> np.recarray:
    """The same ways (n+1,), lowered to the largest speeds at which every leg can be run."""
    lower = ways.copy()
    _sweep(lower, legs)
    return lower


def capped(ways: np.recarray, legs: np.recarray, room: FloatArray) -> np.recarray:
    """The same candidates, slowed down until they have room and their ramps stay below the legs' speeds.

    room : (n+1,) what each may need of the leg before it and of the one behind, ramps included [mm]
    """
    lower = ways.copy()
    _cap(lower, legs, room)
    return lower


@njit(cache=True, error_model="numpy")
def moves(ways, legs):
    """Durations [s] and jerks along the path [mm/s3], (n, 8): the corner before each leg, then its phases."""
    duration, jerk = np.zeros((len(legs), 1 + PHASES)), np.zeros((len(legs), 1 + PHASES))
    phases = np.empty((2, PHASES))
    for i in range(len(legs)):
        one, other = _leg_ends(ways, legs, i)
        leg_phases(one, other, legs[i], phases)
        duration[i, 0] = corner_at(ways[i], ways[i].V, True)[2]
        duration[i, 1:], jerk[i, 1:] = phases[0], phases[1]
    return duration, jerk


# ---- speeds that fit


@njit(cache=True, error_model="numpy")
def _leg_ends(ways, legs, i):
    """Both ends of leg i."""
    begin = leg_end(ways[i], ways[i].V, legs[i].j, True)
    return begin, leg_end(ways[i + 1], ways[i + 1].V, legs[i].j, False)


@njit(cache=True, error_model="numpy")
def _feasible(one, other, leg, slack):
    """Whether a leg with the ends `one`, `other` can be run, up to `slack` of its length."""
    fast, slow = (one, other) if one.top >= other.top else (other, one)
    D = leg.length * (1.0 + slack) - one.corner - other.corner - fast.ramp + slow.pre
    # gains are compared, not speeds: see leg_top
    return D >= 0.0 and fast.top - slow.start <= gain_max(slow.start, D, leg.a, leg.j)


@njit(cache=True, error_model="numpy")
def needed(ways, legs):
    """(n+1,) length that each of the ways needs of its legs, ramps included [mm]."""
    out = np.zeros(len(ways))
    for i in range(1, len(ways) - 1):
        way = ways[i]
        before, after = leg_end(way, way.V, legs[i - 1].j, False), leg_end(way, way.V, legs[i].j, True)
        out[i] = before.corner + max(before.ramp, after.ramp)
    return out


@njit(cache=True, error_model="numpy")
def _cap(ways, legs, room):
    """Lower the speeds of the ways, in place, as `capped` says."""
    for i in range(1, len(ways) - 1):
        way, low, high, trial = ways[i], 0.0, ways[i].V, ways[i].V
        for _ in range(BISECTIONS):
            before, after = leg_end(way, trial, legs[i - 1].j, False), leg_end(way, trial, legs[i].j, True)
            fits = before.corner + max(before.ramp, after.ramp) <= room[i]
            if fits and before.top <= legs[i - 1].v and after.top <= legs[i].v:
                low = trial
                if trial == high:
                    break
            else:
                high = trial
            trial = 0.5 * (low + high)
        ways[i].V = low


@njit(cache=True, error_model="numpy")
def _lowered(way, V, behind, fixed, leg):
    """The largest speed up to V at which a leg begins (`behind`), or ends, feasible towards its other end `fixed`; but
    not below that end's W."""
    here = leg_end(way, V, leg.j, behind)
    if here.top <= fixed.top or _feasible(here, fixed, leg, 0.0):
        return V
    low, high = 0.0, V
    if way.kind != ENTRY and way.kind != ZERO:  # what they take of the leg does not depend on the speed
        D = leg.length - here.corner - fixed.corner + fixed.pre
        trial = min(V, fixed.start + gain_max(fixed.start, max(D, 0.0), leg.a, leg.j))
        for _ in range(BISECTIONS):
            here = leg_end(way, trial, leg.j, behind)
            if here.top <= fixed.top or _feasible(here, fixed, leg, 0.0):
                return trial
            trial *= 1.0 - SPEED_ROUNDING
    for _ in range(BISECTIONS):
        trial = 0.5 * (low + high)
        here = leg_end(way, trial, leg.j, behind)
        if here.top <= fixed.top or _feasible(here, fixed, leg, 0.0):
            low = trial
        else:
            high = trial
    return low


@njit(cache=True, error_model="numpy")
def _sweep(ways, legs):
    """Lower the speeds of the ways (n+1,), in place, until every leg is feasible."""
    for i in range(len(legs) - 1, -1, -1):
        fixed = leg_end(ways[i + 1], ways[i + 1].V, legs[i].j, False)
        ways[i].V = _lowered(ways[i], ways[i].V, True, fixed, legs[i])
    for i in range(len(legs)):
        fixed = leg_end(ways[i], ways[i].V, legs[i].j, True)
        ways[i + 1].V = _lowered(ways[i + 1], ways[i + 1].V, False, fixed, legs[i])


# ---- the fastest choice


@njit(cache=True, error_model="numpy")
def _between(ways, first, last, legs):
    """Time [s] from the joint `first` to the joint `last`, the corner at that one not counted; inf if that is
    impossible. In between there is no corner: there the speeds are lowered, in place, to the largest ones."""
    for i in range(first, last - 1):
        fixed = leg_end(ways[i], ways[i].V, legs[i].j, True)
        ways[i + 1].V = _lowered(ways[i + 1], ways[i + 1].V, False, fixed, legs[i])
    for i in range(last - 1, first, -1):
        fixed = leg_end(ways[i + 1], ways[i + 1].V, legs[i].j, False)
        ways[i].V = _lowered(ways[i], ways[i].V, True, fixed, legs[i])
    time = 0.0
    for i in range(first, last):
        one, other = _leg_ends(ways, legs, i)
        if not _feasible(one, other, legs[i], LENGTH_ROUNDING):
            return np.inf
        time += leg_time(one, other, legs[i])
    return time


@njit(cache=True, error_model="numpy")
def _choose(rows, straight, legs):
    """The fastest choice (n+1,) among the rows (R, n+1), and the time at the end of each corner; row 0 is the
    stop."""
    count, joints = rows.shape
    best, back = np.full((joints, count), np.inf), np.zeros((joints, count), np.int64)
    best[0, 0] = 0.0
    ways, corners, at = rows[count - 1].copy(), np.flatnonzero(~straight), 0
    for n in range(1, len(corners)):
        i, at = corners[n - 1], corners[n]
        for t in range(count):
            if t > 0 and rows[t, at].V <= 0.0:
                continue  # the stop already
            lasting = corner_at(rows[t, at], rows[t, at].V, True)[2]
            for s in range(count):
                time = best[i, s] + lasting
                if time < best[at, t]:
                    ways[i : at + 1] = rows[count - 1, i : at + 1]
                    ways[i], ways[at] = rows[s, i], rows[t, at]
                    time += _between(ways, i, at, legs)
                    if time < best[at, t]:
                        best[at, t], back[at, t] = time, s
    row = 0
    ways[:] = rows[count - 1]
    for n in range(len(corners) - 1, -1, -1):
        ways[corners[n]] = rows[row, corners[n]]
        row = back[corners[n], row]
    time = np.zeros(joints)
    for n in range(1, len(corners)):
        _between(ways, corners[n - 1], corners[n], legs)
        for i in range(corners[n - 1], corners[n]):
            one, other = _leg_ends(ways, legs, i)
            lasting = corner_at(ways[i + 1], ways[i + 1].V, True)[2]
            time[i + 1] = time[i] + lasting + leg_time(one, other, legs[i])
    return ways, time
