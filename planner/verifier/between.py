"""What the machine does between two setpoints, as the judge sees it: the signal that its filters get.

With the setpoints p0 and p1 at the ends of a period of length h, their velocities v0 and v1, and the share w of the period,

    linear   p0 + w (p1 - p0)
    cubic    p0 + w (b + w ((3 c - 2 b - d) + w (b + d - 2 c))),   b = h v0, d = h v1, c = p1 - p0:  the cubic of both ends
    hold     p0

before the first setpoint that one, and after the last one that. The periods need not be equal. Where a velocity was not delivered, it
is what whoever read the positions derived from them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine
from planner.motion.trajectory import Trajectory

# By how much the way between setpoints may leave a motion whose acceleration steps from nothing to a within a period h, over a h^2: a
# chord by 1/8, and the cubic of both ends by 1/32 (less where the acceleration changes steadily).
CHORD_BOW, CUBIC_BOW = 1.0 / 8.0, 1.0 / 32.0


def bow_share(machine: Machine | None = None) -> float:
    """The bow between setpoints over a h^2 [-]; of chords without a machine."""
    return CUBIC_BOW if machine is not None and machine.interpolation == "cubic" else CHORD_BOW


class At(NamedTuple):
    """The signal at T times.

    place  : (T, A) less the origin [mm]
    area   : (T, A) integral of that from the first setpoint kept [mm s]
    origin : (A,) [mm]
    """

    place: FloatArray
    area: FloatArray
    origin: FloatArray


class Signal:
    """The signal of setpoints, read chunk by chunk from its start to its end; only what is asked for next is kept."""

    def __init__(self, trajectory: Trajectory, interpolation: str):
        self._chunks = trajectory.chunks()
        self._of = {"linear": _linear, "cubic": _cubic, "hold": _hold}[interpolation]
        self._begin = np.nan
        self._t, self._p, self._v = np.empty(0), np.empty((0, 0)), np.empty((0, 0))
        self._areas = np.empty((0, 0))

    def take(self, begin: float, end: float) -> None:
        """Keep what the times from `begin` to `end` [s] need, counted from the first setpoint; `begin` never goes back."""
        kept = [(self._t, self._p, self._v)] if len(self._t) else []
        last = self._t[-1] if kept else -np.inf
        while last < end and (chunk := next(self._chunks, None)) is not None:
            if np.isnan(self._begin):
                self._begin = float(chunk.t[0])
            kept.append((chunk.t - self._begin, chunk.position, chunk.velocity))
            last = kept[-1][0][-1]
        self._t, self._p, self._v = (np.concatenate(columns) for columns in zip(*kept, strict=True))
        low = max(int(np.searchsorted(self._t, begin, side="right")) - 1, 0)
        self._t, self._p, self._v = self._t[low:], self._p[low:], self._v[low:]
        k = np.arange(len(self._t) - 1)
        _, areas = self._between(k, np.ones(len(k)))
        self._areas = np.concatenate([np.zeros((1, self._p.shape[1])), np.cumsum(areas, axis=0)])

    def at(self, times: FloatArray) -> At:
        """The signal at ascending times (T,) [s] of those that were taken."""
        t, origin = self._t, self._p[0]
        k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, max(len(t) - 2, 0))
        inside = np.clip(times, t[0], t[-1])
        beyond = (times - inside)[:, None]
        if len(t) < 2:
            return At(np.zeros((len(times), len(origin))), np.zeros((len(times), len(origin))), origin)
        place, part = self._between(k, (inside - t[k]) / (t[k + 1] - t[k]))
        ended = times >= t[-1]
        place[ended] = self._p[-1] - origin
        return At(place, self._areas[k] + part + beyond * place, origin)

    def _between(self, k: Array, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places (n, A) at the shares w (n,) of the periods k (n,), less the origin, and their integrals from the period's begin."""
        h = (self._t[k + 1] - self._t[k])[:, None]
        p0, p1 = self._p[k] - self._p[0], self._p[k + 1] - self._p[0]
        place, area = self._of(w[:, None], p0, p1 - p0, h * self._v[k], h * self._v[k + 1])
        return place, h * area


Pair = tuple[FloatArray, FloatArray]


def _linear(w: FloatArray, p: FloatArray, c: FloatArray, b: FloatArray, d: FloatArray) -> Pair:
    return p + w * c, w * (p + w * c / 2)


def _cubic(w: FloatArray, p: FloatArray, c: FloatArray, b: FloatArray, d: FloatArray) -> Pair:
    square, cube = 3 * c - 2 * b - d, b + d - 2 * c
    return p + w * (b + w * (square + w * cube)), w * (p + w * (b / 2 + w * (square / 3 + w * cube / 4)))


def _hold(w: FloatArray, p: FloatArray, c: FloatArray, b: FloatArray, d: FloatArray) -> Pair:
    return np.broadcast_to(p, np.broadcast_shapes(w.shape, p.shape)).copy(), w * p
