"""How far a motion is from the programmed path, by the planner's own matching (point_matching.py).

The path is cut into pieces, arcs and curves at most every `PIECE_ANGLE`. Each place of the motion is put down
to the link of the path that the best assignment in order gives it, where a block left out and a feed cost
nothing; its distance is that from the line, arc or curve itself. A vertex between two pieces is compared with
the chords of the motion that run along the halves of the pieces beside it.

A motion that leaves the tolerance is matched again with budgets `WIDER` times as large: what exceeds them is
then measured, where a motion matched closely would run past a vertex and be far off from all that follows.
Where another way along the path fits these, what was found first counts.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.geometry.legs import leg_point, legs_of
from planner.geometry.point_matching import chain_of, from_chord, links_anywhere
from planner.geometry.toolpath import Toolpath

SPARE = 2e-3  # of the tolerance, what measuring at other times may find more [-]
PIECE_ANGLE = np.pi / 8.0  # by which a piece of an arc turns at most [rad]
WIDER = 16.0
NOT_PASSED = 2.0 * WIDER  # budgets that a vertex counts as missed by which the motion does not come to [-]
# Steps of Newton's method without the curvature's share, from the foot on a chord.
NEAREST_STEPS = 3

Places = Iterable[tuple[FloatArray, FloatArray]]  # times (T,) [s] and positions (T, A) [mm], in parts


class Errors(NamedTuple):
    """How far a motion is from the program, in tolerances [-]; up to 1 - SPARE places are not told."""

    time: FloatArray  # (n,) of places where the contour leaves the tolerance [s]
    ratio: FloatArray  # (n,) there
    piece: Array  # (n,) and the piece of the path that they are at
    near: FloatArray  # (N+1,) of every vertex
    near_time: FloatArray  # (N+1,) when the motion is nearest to it [s]
    worst: FloatArray  # (N,) the largest of the contour on each piece

    @property
    def over(self) -> bool:
        """True if the motion leaves the tolerance."""
        return bool(len(self.time)) or bool((self.near > 1.0 - SPARE).any())


class _Pieces(NamedTuple):
    """N pieces of a chain of K links."""

    of: Array  # (K,) the piece of each link
    first: Array  # (N+1,) the first link of each piece; last, K
    leg: Array  # (K,) leg of a link that is a chord of an arc or curve, -1 for a line
    x: FloatArray  # (K,) the leg's parameter where the link begins [mm]
    step: FloatArray  # (K,) by how much it grows along the link [mm]
    length: FloatArray  # (K,) range of the leg's parameter [mm]


class PathErrors:
    """Measures motions along one path of M segments, cut into N pieces.

    joint : (M+1,) the vertex, of N+1, that each joint of the path is
    """

    def __init__(self, toolpath: Toolpath):
        chain = chain_of(toolpath)
        links = len(chain.budget)
        self._chain = chain._replace(skipped=np.zeros(links), feed=np.full(links, np.inf))
        legs = legs_of(toolpath)
        self._legs = legs.table
        count, segment = np.diff(chain.first), chain.segment
        turning = np.where(toolpath.straight, 0.0, toolpath.curvature * toolpath.length)
        pieces = np.clip(np.ceil(turning / PIECE_ANGLE * (1.0 - 1e-6)).astype(np.int64), 1, count)
        part = np.arange(links) - chain.first[segment]
        begins = part * pieces[segment] % count[segment] < pieces[segment]
        of, x = np.cumsum(begins) - 1, toolpath.length / count
        leg = np.repeat(np.arange(len(legs)), np.diff(legs.first))
        self._pieces = _Pieces(
            of=of,
            first=np.append(np.flatnonzero(begins), links),
            leg=np.where(toolpath.straight, -1, leg)[segment],
            x=part * x[segment],
            step=x[segment],
            length=toolpath.length[segment],
        )
        self.joint = np.append(of[chain.first[:-1]], of[-1] + 1)

    def of(self, places: Places) -> Errors:
        """The errors of a motion."""
        t, point = (np.concatenate(column) for column in zip(*places, strict=True))
        close = self._measured(t, point, 1.0)
        if not close.over:
            return close
        wide = self._measured(t, point, WIDER)
        return wide if wide.over else close

    def _measured(self, t: FloatArray, point: FloatArray, wider: float) -> Errors:
        """The errors of a motion matched with budgets `wider` times as large."""
        chain, pieces = self._chain, self._pieces
        link = links_anywhere(
            chain._replace(budget=wider * chain.budget, at_vertex=wider * chain.at_vertex), point
        )
        near, near_time = np.full(len(pieces.first), np.inf), np.zeros(len(pieces.first))
        worst, ratio = np.zeros(len(near) - 1), np.empty(len(t))
        last = _measure(chain, pieces, self._legs, t, point, link, near, near_time, worst, ratio)
        near[: last + 1] /= chain.at_vertex[pieces.first[: last + 1]]
        near[last + 1 :] = NOT_PASSED
        near_time[last + 1 :] = near_time[last]
        far = np.flatnonzero(ratio > 1.0 - SPARE)
        return Errors(t[far], ratio[far], pieces.of[link[far]], near, near_time, worst)


@njit(cache=True, error_model="numpy")
def _from_link(chain, pieces, legs, i, q, out):
    """Distance of the point q (A,) from the segment of link i near that link [mm], and where on the link its
    foot is, 0 to 1; out (4, A) for the leg's point and derivatives."""
    off_sq, share = from_chord(chain.vertex[i], chain.vertex[i + 1], q)
    leg = pieces.leg[i]
    if leg < 0:
        return np.sqrt(off_sq), share
    x = pieces.x[i] + share * pieces.step[i]
    for step in range(NEAREST_STEPS + 1):
        leg_point(legs, leg, x, out)
        along, slope_sq, off_sq = 0.0, 0.0, 0.0
        for k in range(len(q)):
            away = q[k] - out[0, k]
            off_sq += away * away
            along += away * out[1, k]
            slope_sq += out[1, k] * out[1, k]
        if step < NEAREST_STEPS:
            x = min(max(x + along / slope_sq, 0.0), pieces.length[i])
    return np.sqrt(off_sq), share


@njit(cache=True, error_model="numpy", nogil=True)
def _measure(chain, pieces, legs, t, point, link, near, near_time, worst, ratio):
    """The errors of n places at times `t` (n,) [s] and points (n, A) [mm], which are at the links `link` (n,); returns the
    vertex next to the last place.

    near, near_time : (N+1,) of the vertices [mm] [s], written where the motion passes them
    worst           : (N,) of the pieces [-], raised
    ratio           : (n,) error over budget of each place, written
    """
    out, at = np.empty((4, point.shape[1])), 0
    for n in range(len(link)):
        i, q, m = link[n], point[n], max(n - 1, 0)
        piece = pieces.of[i]
        distance, share = _from_link(chain, pieces, legs, i, q, out)
        if link[m] != i:  # it went over between the two, and may still be at the one before
            distance = min(distance, _from_link(chain, pieces, legs, link[m], q, out)[0])
        ratio[n] = distance / chain.budget[i]
        worst[piece] = max(worst[piece], ratio[n])
        first, last = pieces.first[piece], pieces.first[piece + 1]
        now = piece + (1 if 2.0 * (i + share) >= first + last else 0)
        for j in range(min(at, now), max(at, now) + 1):
            off_sq, _ = from_chord(point[m], q, chain.vertex[pieces.first[j]])
            if off_sq < near[j] * near[j]:
                near[j], near_time[j] = np.sqrt(off_sq), t[n]
        at = now
    return at
