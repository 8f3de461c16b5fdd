"""Where the judge looks between the samples: at times of its own, which nobody can prepare for.

A planned motion can be asked at any time. Its pieces, on which everything is smooth, and the periods of the machine are cut into
cells, and every cell is looked at once, at a time drawn at random from a generator with a fixed seed:

    every piece    at least `PER_PIECE` cells: more than the three places at which the planner looks at a piece itself
    every period   at least `PER_PERIOD` cells, whatever the pieces are said to be, and as many as keep the chords between
                   the times from cutting corners: with an acceleration a they are off the motion by a h^2/8, which is kept below
                   `BOW` of the tolerance

so that a narrow peak cannot hide from all of them, two looks with one seed are the same, and with another seed they share no time
but the motion's first and last.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.sizes import SIZES
from planner.motion.trajectory import Trajectory

PER_PIECE = 4  # cells; the planner's own places are three a piece
PER_PERIOD = 2  # cells: chords between neighbouring times last less than a period, and cut no corner more than the machine's do
BOW, MOST_PER_PERIOD = 0.01, 16  # [share of the tolerance]; cells, where axes are strong enough for anything
SHORTEST_PIECE = 1e-9  # [s] shorter ones are not looked at: 1 m/s moves by the rounding of a position in it
CELLS = SIZES.places_at_once


class AnyMotion(Protocol):
    """A motion that can be asked at any time."""

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece on which everything is smooth [s], non-decreasing."""
        ...

    @property
    def end(self) -> float:
        """End of the motion [s]; it begins at 0."""
        ...

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at increasing times (T,) [s]; `dt` [s] is the interpolation period of the record that is returned."""
        ...


def cells_per_period(dt: float, tolerance: float, acceleration: float) -> int:
    """How many cells a period dt [s] needs for a tolerance [mm] under an acceleration [mm/s2] of all axes together."""
    gap = float(np.sqrt(8.0 * BOW * tolerance / acceleration))
    return int(
        min(max(PER_PERIOD, np.ceil(2.0 * dt / gap)), MOST_PER_PERIOD)
    )  # neighbouring times are up to two cells apart


def look(motion: AnyMotion, dt: float, seed: int, per_period: int = PER_PERIOD) -> Iterator[Trajectory]:
    """The motion at the judge's own times, from its beginning to its end, in chunks; dt is the machine's period [s]."""
    draw = np.random.default_rng(seed)
    edges = np.concatenate([[0.0], motion.t, [motion.end]])
    begin, lasting = edges[:-1], np.diff(edges)
    cells = np.maximum(PER_PIECE, np.ceil(per_period * lasting / dt)).astype(np.int64)
    cells[lasting <= SHORTEST_PIECE] = 0
    last = np.cumsum(cells)  # the number of cells up to the end of each piece
    width = lasting / np.maximum(cells, 1)
    seen, total = -np.inf, int(last[-1])
    for first in range(0, total, CELLS):
        beyond = min(first + CELLS, total)
        low, high = np.searchsorted(last, [first, beyond - 1], side="right")
        part = slice(low, high + 1)  # the pieces of these cells
        before = last[part] - cells[part]
        here = np.minimum(last[part], beyond) - np.maximum(before, first)  # how many cells of each
        place = np.arange(first, beyond) - np.repeat(before, here) + draw.random(beyond - first)
        times = np.repeat(begin[part], here) + np.repeat(width[part], here) * place
        times = np.concatenate([[0.0] if not first else [], times, [motion.end] if beyond == total else []])
        times = np.maximum.accumulate(np.clip(times, 0.0, motion.end))
        times = times[np.diff(times, prepend=seen) > 0.0]
        if len(times):
            seen = times[-1]
            yield motion.at(times, dt)
