"""What the filters are led along: straight legs between joints, in runs between full stops.

Filters are empty at a full stop, so every run may have its own. Paper 000 runs along the program itself (leg_guide.py),
paper 001 along the fine chords of a smooth path (chord_guide.py).
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.baselines.fir.columns import chosen_rows, freeze_columns, per_joint, per_leg, picked


@dataclass(frozen=True, eq=False, kw_only=True)
class Guide(ABC):
    """R legs over A axes, R+1 joints, S runs; joints first[k] .. first[k+1] belong to run k, its ends are full stops.

    The legs of a guide are straight: legs of the program, or chords of a smooth path.

    axes      : axis letters
    own       : lengths of the two filters that every run has [s]; None to choose them
    first     : (S+1,) first joint of each run, and the last joint of all
    dwell     : (S+1,) standstill before the first run and after each [s]
    point     : (R+1, A) the joints [mm]
    s         : (R+1,) length from the start [mm]
    length    : (R,) [mm]
    direction : (R, A) unit vectors
    feed      : (R,) programmed feed, at most what the axes' velocities allow along the leg [mm/s]
    """

    axes: tuple[str, ...]
    own: tuple[float, float] | None = None
    first: Array
    dwell: FloatArray
    point: FloatArray = per_joint(axes=True)
    s: FloatArray = per_joint()
    length: FloatArray = per_leg()
    direction: FloatArray = per_leg(axes=True)
    feed: FloatArray = per_leg()

    def __post_init__(self) -> None:
        freeze(self, "first", np.int64, (None,))
        freeze(self, "dwell", np.float64, (len(self.first),))
        legs = len(self.length)
        freeze_columns(self, {"leg": legs, "joint": legs + 1}, len(self.axes))

    def __len__(self) -> int:
        return len(self.length)

    @property
    @abstractmethod
    def budget(self) -> FloatArray:
        """(R, 2) what filters and interpolation may use of the tolerance on the first and the second half of each leg [mm]."""

    @property
    def runs(self) -> int:
        """S, the number of runs."""
        return len(self.first) - 1

    @cached_property
    def run(self) -> Array:
        """(R,) run of each leg."""
        return np.repeat(np.arange(self.runs), np.diff(self.first))

    @cached_property
    def inner(self) -> Array:
        """(R+1,) True at joints that are no full stops."""
        inner = np.ones(len(self) + 1, bool)
        inner[self.first] = False
        return inner

    def largest(self, value: FloatArray) -> FloatArray:
        """(S,) the largest of a value per leg (R,) in each run."""
        return np.maximum.reduceat(value, self.first[:-1])

    def total(self, value: FloatArray) -> FloatArray:
        """(S,) the sum of a value per leg (R,) over each run."""
        return np.add.reduceat(value, self.first[:-1])

    def given_filters(self) -> tuple[FloatArray, FloatArray]:
        """T1 >= T2 (S,) [s]: the filters `own` for every run."""
        T2, T1 = sorted(self.own or (0.0, 0.0))
        return np.full(self.runs, T1), np.full(self.runs, T2)

    def pick(self, chosen: Array) -> Self:
        """The runs `chosen` (S,), each shifted to where the one before ends, without the dwells: good for planning only."""
        columns = picked(self, chosen_rows(self.first, chosen))
        along = np.cumsum(columns["length"][:, None] * columns["direction"], axis=0)
        columns["point"] = np.vstack([np.zeros((1, len(self.axes))), along])
        columns["s"] = np.concatenate([[0.0], np.cumsum(columns["length"])])
        first = np.concatenate([[0], np.cumsum(np.diff(self.first)[chosen])])
        return dataclasses.replace(self, first=first, dwell=np.zeros(len(first)), **columns)
