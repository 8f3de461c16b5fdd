"""When a motion passes the vertices of the programmed path, in their order, by the length that it has run.

From one vertex to the next the motion runs the length L of the block between them, give or take what it may
cut or round: every point of it is within eps of the path, and a corner within eps of its vertex saves no more
than 2 eps of the length on either side. So vertex i+1 is looked for where the length run since vertex i is
within `SLACK` eps of L, never before vertex i, at the nearest point of the chords there. Order and length
decide, not nearness alone: closed paths, full circles and neighbouring turns of a spiral are told apart.
Among blocks shorter than eps the nearest point may be behind those of the vertices after it: of a motion that
is known to its end, each vertex is passed while all after it can still be passed within their tolerances.
(Which block each point of a motion is at, by distances and budgets, is in geometry/point_matching.py.)
"""

from collections.abc import Iterable

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import nearest
from planner.geometry.toolpath import Joint, Toolpath
from planner.motion.trajectory import Trajectory

# By how much the length run between two vertices may differ from the block's [tolerances].
SLACK = 8.0
# A motion rests where it is slower than this fraction of its fastest [-]: rounding.
STANDING = 1e-9


def passing_times(motion: Trajectory, toolpath: Toolpath) -> FloatArray:
    """(M+1,) when a motion passes the joints of a path of M segments [s], non-decreasing; it is sampled so often that
    between samples it runs straight to within the tolerance. One with as many standstills as full stops passes the
    joints between two of these between them."""
    stop = np.flatnonzero(toolpath.joint == Joint.STOP)
    begin, end = _standing(motion, toolpath)
    if len(begin) != len(stop) or len(stop) == 2:
        stop, begin = np.array([0, len(toolpath)]), np.array([0, len(motion) - 1])
        end = begin
    times = np.empty(len(toolpath) + 1)
    for first, last, leaves, arrives in zip(stop[:-1], stop[1:], end[:-1], begin[1:], strict=True):
        run = slice(leaves, arrives + 1)
        seen = motion.position[run], motion.s[run], motion.t[run]
        wanted = _wanted(toolpath, first, last)
        of_run = times[first : last + 1]
        of_run[0] = motion.t[leaves]
        latest = _latest(seen, wanted, toolpath.tolerance[first : last + 1])
        _pass(seen, wanted, latest, of_run, 1, 0.0, True)
        of_run[-1] = motion.t[arrives]
    return times


def passing_times_of(chunks: Iterable[Trajectory], toolpath: Toolpath) -> FloatArray:
    """(M+1,) the same of a motion in chunks, each may begin with the last sample of the one before."""
    times = np.empty(len(toolpath) + 1)
    wanted, latest = _wanted(toolpath, 0, len(toolpath)), np.full(len(toolpath) + 1, np.inf)
    seen: tuple[FloatArray, ...] | None = None
    done, share = 1, 0.0
    for chunk in chunks:
        new = chunk.position, chunk.s, chunk.t
        if seen is None:
            seen, times[0] = new, chunk.t[0]
        else:
            fresh = int(np.searchsorted(chunk.t, seen[2][-1], side="right"))
            seen = tuple(np.concatenate([old, more[fresh:]]) for old, more in zip(seen, new, strict=True))
        done, k, share = _pass(seen, wanted, latest, times, done, share, False)
        seen = tuple(column[k:].copy() for column in seen)
    assert seen is not None
    _pass(seen, wanted, latest, times, done, share, True)
    return times


def standstills(motion: Trajectory, toolpath: Toolpath, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """When a motion, sampled at the ends of its pieces too, comes to rest at the G full stops of a path (G,) [s], and when
    it leaves them (G,) [s]; times (M+1,): from `passing_times`."""
    begin, end = _standing(motion, toolpath)
    count = end - begin + 1
    still = np.repeat(end + 1 - np.cumsum(count), count) + np.arange(count.sum())
    rest = np.repeat(np.arange(len(begin)), count)
    near = rest[nearest(motion.t[still], times[toolpath.joint == Joint.STOP])]
    # one rest for each stop, in order: of a short block the rest nearest in time may be the next one's
    stop = np.arange(len(near))
    spare = len(begin) - len(near)
    at = np.minimum(np.maximum.accumulate(near - stop), spare) + stop if spare >= 0 else near
    return motion.t[begin[at]], motion.t[end[at]]


def _standing(motion: Trajectory, toolpath: Toolpath) -> tuple[Array, Array]:
    """(n,) the first and the last sample of each time that the motion stands still, or of an end in motion."""
    stands = motion.feed <= STANDING * motion.feed.max()
    stands[[0, -1]] |= np.greater(toolpath.speeds, 0.0)
    still = np.flatnonzero(stands)
    new = np.diff(still) > 1
    return still[np.append(True, new)[: len(still)]], still[np.append(new, True)[: len(still)]]


def _wanted(toolpath: Toolpath, first: int, last: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`wanted` of `_pass` for the joints from one to another."""
    vertex = np.vstack([toolpath.start[first:last], toolpath.end[last - 1 : last]])
    slack = SLACK * np.maximum(toolpath.tolerance[first:last], toolpath.tolerance[first + 1 : last + 1])
    return vertex, toolpath.length[first:last], slack


@njit(cache=True, error_model="numpy")
def _foot(position, n, vertex, least):
    """Of chord n the share at which it is nearest to a vertex, `least` or more, and the square of the distance there."""
    along, size = 0.0, 0.0
    for axis in range(position.shape[1]):
        step = position[n + 1, axis] - position[n, axis]
        along += (vertex[axis] - position[n, axis]) * step
        size += step * step
    q = max(min(max(along / size, 0.0), 1.0) if size > 0.0 else 0.0, least)
    apart = 0.0
    for axis in range(position.shape[1]):
        there = position[n, axis] + q * (position[n + 1, axis] - position[n, axis])
        apart += (vertex[axis] - there) ** 2
    return q, apart


@njit(cache=True, error_model="numpy")
def _latest(seen, wanted, within):
    """(M+1,) the way run [mm] up to which a motion has to pass each vertex so that it still passes all that follow
    within their tolerances, `within` (M+1,) [mm]; seen, wanted as of `_pass`. Of vertices that it does not pass so it
    is that of the next one."""
    position, s, _ = seen
    vertex, length, slack = wanted
    latest, n = np.full(len(vertex), s[-1]), len(s) - 2
    for i in range(len(vertex) - 2, 0, -1):
        latest[i], k, least = latest[i + 1], n, latest[i + 1] - length[i] - slack[i]
        while k >= 0 and s[k + 1] >= least:
            q, apart = _foot(position, k, vertex[i], 0.0)
            if apart <= within[i] ** 2:
                latest[i], n = min(latest[i], s[k] + q * (s[k + 1] - s[k])), k
                break
            k -= 1
    return latest


@njit(cache=True, error_model="numpy")
def _pass(seen, wanted, latest, times, i, share, last_part):
    """Write into times (M+1,) when the polyline `seen` is nearest to each vertex from vertex i on, as far as
    it goes, and of the last part to the end; each at the way run `latest` [mm] at most. Returned are the next vertex,
    and the chord reached with the share of it.

    seen   : positions (T, A) [mm], way run (T,) [mm] and times (T,) [s], from the chord on that was reached
    wanted : vertices (M+1, A) [mm], lengths (M,) behind them, and by how much the way run may differ (M,) [mm]
    """
    position, s, t = seen
    vertex, length, slack = wanted
    last = len(t) - 2
    k = 0
    while i < len(vertex) and last >= 0:
        here = s[k] + share * (s[k + 1] - s[k])
        begin, end = here + length[i - 1] - slack[i - 1], here + length[i - 1] + slack[i - 1]
        if s[last + 1] <= end and not last_part:
            break
        begin, end = min(begin, latest[i]), min(end, latest[i])
        while k < last and s[k + 1] < begin:
            k, share = k + 1, 0.0
        nearest, best, best_share = np.inf, k, share
        n = k
        while n <= last and (n == k or s[n] <= end):
            q, apart = _foot(position, n, vertex[i], share if n == k else 0.0)
            if apart < nearest:
                nearest, best, best_share = apart, n, q
            n += 1
        k, share = best, best_share
        times[i] = t[k] + share * (t[k + 1] - t[k])
        i += 1
    return i, k, share
