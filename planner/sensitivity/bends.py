"""Parts of a motion that bends, or turns back between extremes in a direction, and the best division of a run into
parts and legs (least_time.py).

From t_i over t_j to t_k a coordinate n.q, n across the chord from P_i to P_k towards P_j, which is s off it, is above a straight line
between its ends by s - e_j - max(e_i, e_k) at least, and by A (t_j - t_i)(t_k - t_j)/2 at most, with its acceleration A: so

    t_k - t_i >= sqrt(8 (s - e_j - max(e_i, e_k)) / A).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.sensitivity.straight_time import End, straight_time
from planner.sensitivity.waypoints import Way

# Legs of a part. All numbers up to 128 in steps of a tenth make bounds of generated reliefs and spirals 4e-3 better at most.
SIZES = np.array([2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64])


class Chains(NamedTuple):
    """(P,) first leg of lines one after the other, the leg behind the last one, and what they take longer than their legs [s]."""

    begin: Array
    end: Array
    gain: FloatArray


class Events(NamedTuple):
    """(E,) the waypoints, ascending, at which a part that turns back may end (first) or begin, with which extreme, by number among
    all directions', and whether others may come before it; and (K,) from each extreme to the next [s]."""

    waypoint: Array
    begins: Array
    extreme: Array
    stands_out: Array
    time: FloatArray


@njit(cache=True, error_model="numpy")
def bend_time(point, within, push, i, k):
    """The time from waypoint i to k at least [s], 0 where the way between them does not bend enough.

    point, within : (N+1, A), (N+1,) [mm]
    push          : (A,) [mm/s2]
    """
    axes, best, at = point.shape[1], 0.0, -1
    chord = 0.0
    for a in range(axes):
        chord += (point[k, a] - point[i, a]) ** 2
    share_of = 0.0
    for j in range(i + 1, k):
        share, square = 0.0, 0.0
        for a in range(axes):
            off = point[j, a] - point[i, a]
            share, square = share + off * (point[k, a] - point[i, a]), square + off * off
        share = share / chord if chord > 0.0 else 0.0
        far = np.sqrt(max(square - share * share * chord, 0.0)) - within[j]
        if far > best:
            best, at, share_of = far, j, share
    least = best - max(within[i], within[k])
    if at < 0 or least <= 0.0:
        return 0.0
    strength = 0.0
    for a in range(axes):
        strength += push[a] * abs(point[at, a] - point[i, a] - share_of * (point[k, a] - point[i, a]))
    return np.sqrt(8.0 * least * (best + within[at]) / strength)


@njit(cache=True, error_model="numpy")
def best_division(point, within, push, known, chains, events):
    """What a run takes at least [s]: its legs, or chains or parts that bend, turn back, come from rest or go there, where these
    take longer.

    known : (7, N+1) what legs take up to each waypoint, and if they end there, a part begins; what the tolerance lets legs behind
            begin later by; from rest to there, and if legs go on; the same to rest [s]
    """
    total, ended, later, head, head_on, tail, tail_on = known
    closed, reached = np.empty(len(total)), np.zeros(len(events.time))
    best, gain, chain_gain, c, e = total[-1], 0.0, 0.0, 0, 0
    for k in range(len(total)):
        value = head[k]
        for size in SIZES:
            if size > k:
                break
            lasting = bend_time(point, within, push, k - size, k)
            if lasting > 0.0:
                value = max(value, closed[k - size] + lasting)
        while e < len(events.waypoint) and events.waypoint[e] == k and not events.begins[e]:
            value = max(value, reached[events.extreme[e]])
            e += 1
        best, value = max(best, ended[k] + gain + tail_on[k]), max(value, ended[k] + gain)
        if c < len(chains.begin) and chains.begin[c] == k:  # the leg before it goes on
            chain_gain = gain + chains.gain[c]
        gain = max(gain, max(value, head_on[k]) - total[k] - later[k])
        if c < len(chains.begin) and chains.end[c] == k:  # so does the one behind it
            gain, value = max(gain, chain_gain), max(value, total[k] + chain_gain - later[k])
            c += 1
        closed[k] = value
        best = max(best, value + tail[k])
        while e < len(events.waypoint) and events.waypoint[e] == k:
            n = events.extreme[e]
            entered = closed[k] if events.stands_out[e] else 0.0
            reached[n] = max(reached[n - 1] + events.time[n - 1], entered)
            e += 1
    return max(best, total[-1] + gain)


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
