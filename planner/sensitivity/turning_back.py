"""Parts of a motion between extremes in a direction, where it turns back (least_time.py)."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.sensitivity.bends import Events
from planner.sensitivity.straight_time import End, straight_time
from planner.sensitivity.waypoints import Way


def turns_of(run: Way) -> Events:
    """Where parts between extremes in the directions of the axes and of their diagonals may begin and end; the first extreme and
    the last are the start and the end of the run."""
    events: list[tuple[int, bool, int, bool]] = []
    times, first, axes = [np.zeros(0)], 0, run.point.shape[1]
    width = 2.0 * float(run.tolerance.max())
    for signs in np.ndindex(*(3,) * axes):
        direction = np.array(signs) - 1.0
        nonzero = np.flatnonzero(direction)
        if not len(nonzero) or direction[nonzero[0]] < 0:
            continue
        direction /= np.linalg.norm(direction)
        place = run.point @ direction
        at = extremes(place, width)
        if len(at) > 2:
            time, begin, stands_out, end = _between(run, direction, place, at)
            for n in range(1, len(at)):
                events.append((int(begin[n]), True, first + n, bool(stands_out[n])))
                if end[n] >= 0:
                    events.append((int(end[n]), False, first + n, False))
            times.append(np.append(time, 0.0))
            first += len(at)
    waypoint, begins, extreme, out = np.array(sorted(events), dtype=np.int64).reshape(-1, 4).T.copy()
    return Events(waypoint, begins, extreme, out, np.concatenate(times))


def _between(
    run: Way, direction: FloatArray, place: FloatArray, at: Array
) -> tuple[FloatArray, Array, Array, Array]:
    """Of the extremes `at` (K,) of `place` (N+1,) in a direction: (K-1,) the time from each to the next [s]; (K,) the last waypoint
    before each from which it stands out, if it does, (K,), else the extreme before; and (K,) the first behind it, -1 for none."""
    width, last = 2.0 * float(run.tolerance.max()), len(place) - 1
    begin, end = np.append(0, at[:-1]), np.full(len(at), last)
    stands_out = np.zeros(len(at), dtype=bool)  # the start and the end do not
    for n in range(1, len(at) - 1):
        before, here, behind = at[n - 1 : n + 2]
        apart = np.flatnonzero(np.abs(place[before:here] - place[here]) > width)
        stands_out[n] = len(apart) > 0
        begin[n] += apart[-1] if len(apart) else 0
        apart = np.flatnonzero(np.abs(place[here + 1 : behind + 1] - place[here]) > width)
        end[n] = here + 1 + apart[0] if len(apart) else -1
    spans = np.column_stack(
        [np.where(stands_out[:-1], begin[:-1], 0), np.where(end[1:] < 0, last, end[1:])]
    ).ravel()
    feed = np.maximum.reduceat(np.append(run.feed, 0.0), spans)[::2]
    bounds, _ = run.along(np.broadcast_to(direction, (len(feed), len(direction))), feed)
    least = np.maximum(np.abs(np.diff(place[at])) - run.tolerance[at[:-1]] - run.tolerance[at[1:]], 0.0)
    still, rests = np.zeros(len(feed)), np.arange(len(feed))
    time = straight_time(least, End(still, rests == 0), End(still, rests == len(feed) - 1), bounds)
    return time, begin, stands_out, end


def extremes(place: FloatArray, width: float) -> Array:
    """(K,) indices of the first value, then in turn of maxima and minima, and of the last value.

    place : (N+1,) values
    width : by more than which maxima and minima differ from those beside them
    """
    turning = np.flatnonzero(np.diff(np.sign(np.diff(place)), prepend=0, append=0) != 0)
    found, high, low, up = [0], 0, 0, 0
    for k in [*turning.tolist(), len(place) - 1]:
        high, low = (k if place[k] > place[high] else high), (k if place[k] < place[low] else low)
        if up >= 0 and place[high] - place[k] > width:
            found, up, low = [*found, high], -1, k
        elif up <= 0 and place[k] - place[low] > width:
            found, up, high = [*found, low], 1, k
    return np.unique([*found, len(place) - 1])
