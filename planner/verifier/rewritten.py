"""Whether two programs move along the same path, within a distance, in order, with the same feeds.

Both paths are divided where a feed, a mode or a standstill changes, where something else happens, and where a
move is no line and no arc. The runs must be as many, in the same modes, and begin and end in the same
places. Two runs are within a distance d of each other if both can be run through side by side, never
going back, and never further apart: the Frechet distance, which bounds the distances both ways and keeps the
order. Of polylines it is decided exactly, by the places of one that can be reached beside each vertex of the
other (Alt and Godau 1995); arcs are polylines here, whose height over their chords is added.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.verifier.bends import arc_points
from planner.verifier.kernel import kernel
from planner.verifier.pieces import PLACE_ROUNDING, RATIO_ROUNDING

FLAT = 0.005  # of the allowed distance: the height of arcs over the chords that they are taken for
FINE = 0.01  # of the allowed distance: how finely the distance is found


@dataclass(frozen=True, kw_only=True)
class SamePath:
    """What was found."""

    within: float  # a bound of the distance of the paths, both ways and in order [mm]; inf where `fault` is not ""
    fault: str = ""  # "" if the paths are within the allowed distance and all else is the same
    line: int = 0  # of the second program, where the fault is


class _Runs(NamedTuple):
    """S runs of a path."""

    first: Array  # (S+1,) segments where they begin, and the number of segments
    mode: FloatArray  # (S, 6) feed, rapid, exact, held, standstill at the end, curve


def same_path(
    one: Toolpath, other: Toolpath, allowed: float, marks: tuple[Array, Array] | None = None
) -> SamePath:
    """Compare two paths.

    allowed : the distance [mm]
    marks   : (n,) and (m,) blocks of each before which something else happens, ascending; None for none

    Raises ValueError for paths of other axes.
    """
    if one.axes != other.axes:
        raise ValueError(f"axes {one.axes} and {other.axes}")
    none = np.zeros(0, dtype=np.int64)
    mine, theirs = (_runs(p, m) for p, m in zip((one, other), marks or (none, none), strict=True))
    fault, line = _difference(one, mine, other, theirs)
    if fault:
        return SamePath(within=math.inf, fault=fault, line=line)
    flat, found = FLAT * allowed, 0.0
    room = allowed - 2.0 * flat
    for k in range(len(mine.mode)):
        a, b = _chords(one, mine, k, flat), _chords(other, theirs, k, flat)
        if mine.mode[k, -1] or np.array_equal(a, b):
            continue
        found = _least(a, b, found, room, FINE * allowed)
        if found == math.inf:
            line = int(other.line[theirs.first[k]])
            return SamePath(within=math.inf, fault="the paths are further apart", line=line)
    return SamePath(within=found + 2.0 * flat if found else 0.0)


def _runs(path: Toolpath, marks: Array) -> _Runs:
    """Divide a path."""
    bend = path.curve >= 0
    kind = np.stack([path.feed, path.rapid, path.exact, path.held, bend], axis=1)
    new = np.append(True, (kind[1:] != kind[:-1]).any(axis=1)) | bend
    new[1:] |= path.dwell[1:-1] > 0
    new[1:] |= np.diff(np.searchsorted(marks, path.block, side="right")) > 0
    first = np.append(np.flatnonzero(new), len(path))
    mode = np.column_stack([kind[first[:-1], :4], path.dwell[first[1:]], kind[first[:-1], 4]])
    return _Runs(first, mode)


def _difference(one: Toolpath, mine: _Runs, other: Toolpath, theirs: _Runs) -> tuple[str, int]:
    """What differs beside the way from one end of a run to the other, and the line; "" for nothing."""
    count = min(len(mine.mode), len(theirs.mode))
    a, b = mine.first[:count], theirs.first[:count]
    last_a, last_b = mine.first[1 : count + 1] - 1, theirs.first[1 : count + 1] - 1
    ends = [np.abs(one.start[a] - other.start[b]), np.abs(one.end[last_a] - other.end[last_b])]
    bad_mode = ~np.isclose(mine.mode[:count], theirs.mode[:count], rtol=RATIO_ROUNDING, atol=0.0)
    bent = mine.mode[:count, -1] > 0
    shape = np.zeros(count, dtype=bool)
    rows, same = one.curve[a[bent]], other.curve[b[bent]]
    if bent.any() and not bad_mode[:, -1].any():
        gap = np.abs(one.curves.points[rows] - other.curves.points[same]).max(axis=(1, 2))
        unlike = one.curves.weight[rows] != other.curves.weight[same]
        shape[bent] = (gap > PLACE_ROUNDING) | unlike.any(axis=1)
    for bad, what in (
        (bad_mode.any(axis=1), "feed, mode or standstill differs"),
        ((np.maximum(*ends) > PLACE_ROUNDING).any(axis=1), "a run begins or ends elsewhere"),
        (shape, "a curve differs"),
    ):
        if bad.any():
            return what, int(other.line[theirs.first[int(np.argmax(bad))]])
    if len(mine.mode) != len(theirs.mode):
        return f"{len(mine.mode):,} runs, and {len(theirs.mode):,} in the other", int(other.line[-1])
    return "", 0


def _chords(path: Toolpath, runs: _Runs, k: int, flat: float) -> FloatArray:
    """(n+1, A) the points of a run, between which its arcs are no further than `flat` from their chords."""
    begin, end = int(runs.first[k]), int(runs.first[k + 1])
    arc = path.arc[begin:end]
    straight = np.vstack([path.start[begin : begin + 1], path.end[begin:end]])
    if (arc < 0).all():
        return straight
    arcs = path.arcs
    parts = [straight[:1]]
    for i, row in zip(range(begin, end), arc.tolist(), strict=True):
        if row >= 0:
            turn = abs(float(arcs.rate[row])) * float(path.length[i])
            # a drift goes on evenly with the angle, so that the arc is off its chord by r turn^2 / 8 at most
            pieces = math.ceil(turn * math.sqrt(float(arcs.radius[row]) / (8.0 * flat)))
            x: FloatArray = np.linspace(0.0, float(path.length[i]), max(pieces, 1) + 1)[1:-1]
            frame = np.stack([arcs.center[row], arcs.e1[row], arcs.e2[row], arcs.drift[row]])
            circle = np.array([arcs.radius[row], arcs.rate[row]])
            parts.append(arc_points(frame[None], circle[None], x))
        parts.append(path.end[i : i + 1])
    points: FloatArray = np.vstack(parts)
    return points


def _least(a: FloatArray, b: FloatArray, low: float, high: float, fine: float) -> float:
    """A distance within which two polylines are, at most `fine` above the least that is not below `low`; inf where
    that is above `high`."""
    ranges = np.empty((len(b), 2)), np.empty((len(b), 2))
    if low and _reaches(a, b, low, *ranges):
        return low
    if not _reaches(a, b, high, *ranges):
        return math.inf
    while high - low > fine:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _reaches(a, b, middle, *ranges) else (middle, high)
    return high


@kernel()
def _reaches(a, b, within, left, new):
    """Whether two polylines (n+1, A), (m+1, A) can be run through side by side within a distance.

    left, new : (m+1, 2) to work in: the part of each edge of b that is reached beside a vertex of a, empty
                where it begins after its end
    """
    n, m = len(a) - 1, len(b) - 1
    bottom, top = 0, 0  # edges of b that are reached beside the vertex
    while top < m:
        low, high = _part(b, top, a, 0, within)
        if low > 0.0 or low > high:
            break
        left[top, 0], left[top, 1] = low, high
        top += 1
        if high < 1.0:
            break
    low_edge = top > 0
    for i in range(n):
        # reached of edge i of a beside vertex `bottom` of b; beside the first one only in one go from the start
        begin, end = 1.0, 0.0
        if low_edge:
            begin, end = _part(a, i, b, 0, within)
            low_edge = begin <= 0.0 <= end and end >= 1.0
            if begin > 0.0:
                begin, end = 1.0, 0.0
        j, first, last = bottom, -1, -1
        if begin <= end:
            j = 0
        while j < m and (j < top or begin <= end):
            reached = bottom <= j < top and left[j, 0] <= left[j, 1]
            right, right_end = _part(b, j, a, i + 1, within)
            over, over_end = _part(a, i, b, j + 1, within)
            if begin > end:
                right = max(right, left[j, 0]) if reached else 2.0
            if not reached:
                over = max(over, begin) if begin <= end else 2.0
            new[j, 0], new[j, 1] = right, right_end
            if right <= right_end:
                first, last = (j if first < 0 else first), j + 1
            begin, end = over, over_end
            j += 1
        if first < 0:
            return False
        for k in range(first, last):
            left[k, 0], left[k, 1] = new[k, 0], new[k, 1]
        bottom, top = first, last
    return top == m and left[m - 1, 0] <= left[m - 1, 1] and left[m - 1, 1] >= 1.0


@kernel(inline=True)
def _part(line, edge, other, vertex, within):
    """The part of an edge of a polyline that is within a distance of a vertex of another: from 0 to 1, a lower
    end above the upper one for none. The ends of the edge count by themselves: 0 and 1 without rounding."""
    along, square, off, size, tail = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(line.shape[1]):
        step = line[edge + 1, k] - line[edge, k]
        away = other[vertex, k] - line[edge, k]
        size += step * step
        along += step * away
        square += away * away
        tail += (away - step) ** 2
    limit = within * within
    if size <= 0.0:
        return (0.0, 1.0) if square <= limit else (1.0, 0.0)
    place = along / size
    for k in range(line.shape[1]):
        off += (other[vertex, k] - line[edge, k] - place * (line[edge + 1, k] - line[edge, k])) ** 2
    if off > limit:
        return 1.0, 0.0
    half = math.sqrt((limit - off) / size)
    low = 0.0 if square <= limit else max(place - half, 0.0)
    high = 1.0 if tail <= limit else min(place + half, 1.0)
    return (low, high) if low <= high else (1.0, 0.0)
