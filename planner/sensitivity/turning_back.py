"""Parts of a motion between extremes in a direction, where it turns back (least_time.py)."""

import numpy as np

from planner.base.kernels import njit
from planner.sensitivity.bends import Events
from planner.sensitivity.straight_time import End, straight_time
from planner.sensitivity.waypoints import Way


def turns_of(run: Way) -> Events:
    """Where parts between extremes in the directions of the axes and of their diagonals may begin and end; the first extreme and
    the last are the start and the end of the run."""
    axes = run.point.shape[1]
    signs = np.array(list(np.ndindex(*(3,) * axes)))[3**axes // 2 + 1 :] - 1.0  # one of each and its opposite
    direction = signs / np.linalg.norm(signs, axis=1)[:, None]
    found, least, feed = spans(np.ascontiguousarray(direction @ run.point.T), run.tolerance, run.feed)
    of, begin, stands_out, end = found.T
    first, last = np.diff(of, prepend=-1) != 0, np.diff(of, append=-1) != 0
    bounds, _ = run.along(direction[of], feed)
    still = np.zeros(len(of))
    time = straight_time(least, End(still, first), End(still, np.append(last, False)[1:]), bounds)
    begins, ends = np.flatnonzero(~first), np.flatnonzero(~first & (end >= 0))
    events = np.zeros((len(begins) + len(ends), 4), dtype=np.int64)
    events[: len(begins)] = np.column_stack([begin[begins], 0 * begins + 1, begins, stands_out[begins]])
    events[len(begins) :, ::2] = np.column_stack([end[ends], ends])
    waypoint, begun, extreme, out = events[np.lexsort(events[:, 2::-1].T)].T.copy()
    return Events(waypoint, begun, extreme, out, np.where(last, 0.0, time))


@njit(cache=True, error_model="numpy")
def spans(place, tolerance, feed):
    """Of all extremes of `place` (D, N+1) in D directions, of those with more than the two ends: (K, 4) the direction; the last
    waypoint before it from which it stands out, if it does, else the extreme before; whether it does; and the first one behind it,
    -1 for none. (K,) the way to the next one at least, and the largest feed meanwhile."""
    width, last = 2.0 * tolerance.max(), place.shape[1] - 1
    found, least, most = [(0, 0, 0, 0) for _ in range(0)], [0.0 for _ in range(0)], [0.0 for _ in range(0)]
    for d in range(len(place)):
        along = place[d]
        at = extremes(along, width)
        many = len(at)
        if many < 3:
            continue
        for n in range(many):
            here = at[n]
            begin, out, end = at[max(n - 1, 0)], 0, last
            if 0 < n < many - 1:  # the start and the end do not stand out
                for k in range(here - 1, begin - 1, -1):
                    if abs(along[k] - along[here]) > width:
                        begin, out = k, 1
                        break
                end = -1
                for k in range(here + 1, at[n + 1] + 1):
                    if abs(along[k] - along[here]) > width:
                        end = k
                        break
            found.append((d, begin, out, end))
        for n in range(many):
            behind = min(n + 1, many - 1)
            _, begin, out, _ = found[len(found) - many + n]
            end = found[len(found) - many + behind][3]
            way = abs(along[at[behind]] - along[at[n]]) - tolerance[at[n]] - tolerance[at[behind]]
            least.append(max(way, 0.0))
            most.append(feed[begin if out else 0 : end if end >= 0 else last].max())
    rows = np.empty((len(found), 4), dtype=np.int64)
    for k in range(len(found)):
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = found[k]
    return rows, np.array(least), np.array(most)


@njit(cache=True, error_model="numpy")
def extremes(place, width):
    """(K,) indices of the first value, then in turn of maxima and minima, and of the last value.

    place : (N+1,) values
    width : by more than which maxima and minima differ from those beside them
    """
    found, count, high, low, up = np.zeros(len(place), dtype=np.int64), 1, 0, 0, 0
    for k in range(1, len(place)):
        high, low = (k if place[k] > place[high] else high), (k if place[k] < place[low] else low)
        at = -1
        if up >= 0 and place[high] - place[k] > width:
            at, up, low = high, -1, k
        elif up <= 0 and place[k] - place[low] > width:
            at, up, high = low, 1, k
        if at > found[count - 1]:
            found[count] = at
            count += 1
    found[count] = len(place) - 1
    return found[: count + 1]
