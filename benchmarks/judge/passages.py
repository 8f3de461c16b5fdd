"""Where a motion passes the vertices of a path, and whether the feed holds on the blocks between them, with numpy alone.

A motion is on the blocks in their order, and goes over from one to the next where it is nearest to the vertex between them; of several
vertices those places count, in order and within the tolerance of each, whose squares of the distances have the least sum. It shares
nothing with the package.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray
AROUND = 3  # chords on either side of where a vertex is passed that are looked at finely
FINE = 64  # places of such a chord
FIRM = 1e6  # how much more a square counts beyond what it may be [-]
# What rounding leaves of a place and of a distance [mm].
ROUNDING = 1e-7


class Motion(NamedTuple):
    """Setpoints: times (n,) [s], positions and velocities (n, A) [mm], [mm/s]."""

    t: Array
    position: Array
    velocity: Array


def passed(motion: Motion, vertices: Array, within: Array) -> tuple[Array, Array]:
    """From where to where along the chords the vertices (V, A) [mm] may be passed, two (V,) [mm]: to the next of the places that are
    looked at, on the chords and on the cubics between the setpoints.

    within : (V,) as far from it as this at most [mm]
    """
    p = motion.position
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1)))
    # distances of chords say nothing of the order within one: of long ones too little is asked, of places between setpoints too much
    squares = _chord_distances(p, vertices), np.array([_dot(off, off) for off in p - vertices[:, None]])
    near = np.concatenate([_in_order(square, within) for square in squares])
    chords = np.unique(np.clip(near[:, None] + np.arange(-AROUND, AROUND + 1), 0, len(p) - 2))
    w = np.linspace(0.0, 1.0, FINE + 1)[1:]
    places, low, high = (
        (along[chords, None] + w * (along[chords + 1] - along[chords])[:, None]).ravel(),
        [],
        [],
    )
    for points in (_on_lines(motion, chords, w), _on_cubics(motion, chords, w)):
        at = _in_order(((points[:, None] - vertices) ** 2).sum(axis=2).T, within)
        low.append(places[np.maximum(at - 1, 0)])
        high.append(places[np.minimum(at + 1, len(places) - 1)])
    return np.min(low, axis=0) - ROUNDING, np.max(high, axis=0) + ROUNDING


def _in_order(square: Array, within: Array) -> Array:
    """(V,) the places, in order, whose squares (V, n) of distances have the least sum, with as little as can be of what a distance is
    more than it may be, `within` (V,)."""
    least, chosen = np.zeros(square.shape[1]), []
    for row, most in zip(square, within, strict=True):
        cost = least + row + FIRM * np.maximum(row - (most + ROUNDING) ** 2, 0.0)
        least = np.minimum.accumulate(cost)
        chosen.append(np.maximum.accumulate(np.where(cost <= least, np.arange(len(cost)), 0)))
    at, last = np.zeros(len(square), dtype=int), square.shape[1] - 1
    for i in range(len(square) - 1, -1, -1):
        last = at[i] = chosen[i][last]
    return at


def _chord_distances(p: Array, vertices: Array) -> Array:
    """(V, n-1) squared distances of vertices (V, A) from the chords of points (n, A)."""
    way = np.diff(p, axis=0)
    square, rows = np.maximum(_dot(way, way), 1e-300), []
    for vertex in vertices:
        off = vertex - p[:-1]
        off -= np.clip(_dot(off, way) / square, 0.0, 1.0)[:, None] * way
        rows.append(_dot(off, off))
    return np.array(rows)


def _dot(one: Array, other: Array) -> Array:
    """(n,) of rows (n, A): a sum over an axis of three numbers takes several times as long."""
    return np.einsum("na,na->n", one, other)


def _on_lines(motion: Motion, chords: Array, w: Array) -> Array:
    """(C W, A) places on chords (C,), at the shares w (W,) of them."""
    p, w = motion.position, w[:, None]
    return ((1 - w) * p[chords, None] + w * p[chords + 1, None]).reshape(-1, p.shape[1])


def _on_cubics(motion: Motion, chords: Array, w: Array) -> Array:
    """(C W, A) the same on the cubics with the positions and velocities of the setpoints, at shares of the time."""
    t, p, v = motion
    h, w = (t[chords + 1] - t[chords])[:, None, None], w[:, None]
    curve = (1 + 2 * w) * (1 - w) ** 2 * p[chords, None] + w * (1 - w) ** 2 * h * v[chords, None]
    curve = curve + w**2 * (3 - 2 * w) * p[chords + 1, None] - w**2 * (1 - w) * h * v[chords + 1, None]
    return curve.reshape(-1, p.shape[1])


def saved(motion: Motion, vertices: Array, within: Array, feeds: Array) -> float:
    """The most time by which a motion runs through any stretch of its way sooner than the blocks on it take at their F [s].

    vertices : (B-1, A) between the B blocks [mm]
    within   : (B-1,) how far from them they are passed at most [mm]
    feeds    : (B,) [mm/s]; where it is not known on which of several blocks a place is, the largest counts
    """
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(motion.position, axis=0), axis=1)))
    low, high = passed(motion, vertices, within)
    low, high = np.minimum.accumulate(low[::-1])[::-1], np.maximum.accumulate(high)
    begin, end = np.append(-np.inf, low), np.append(high, np.inf)  # of the blocks
    edges = np.unique(np.clip(np.concatenate([along, low, high]), 0.0, along[-1]))
    middle = (edges[1:] + edges[:-1]) / 2
    on = (begin[:, None] <= middle) & (middle <= end[:, None])
    needs = np.append(0.0, np.cumsum(np.diff(edges) / np.where(on, feeds[:, None], 0.0).max(axis=0)))
    ahead = np.interp(along, edges, needs) - motion.t
    return float((ahead - np.minimum.accumulate(ahead)).max())
