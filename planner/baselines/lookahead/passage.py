"""The records of a look-ahead: what legs allow, and how their joints are passed; also as tables for its kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze

# The kernels' records: of a leg (`LegLimits`), and of a way to pass a joint (`Passage`).
LEG = np.dtype([(name, np.float64) for name in ("length", "v", "a", "j", "turning")])
WAY = np.dtype([("kind", np.int64), *((name, np.float64) for name in ("V", "p", "q", "r"))])


@dataclass(frozen=True, eq=False, kw_only=True)
class LegLimits:
    """Limits of n legs of a look-ahead.

    length  : (n,) from joint to joint, with what corners take of it [mm], > 0
    v       : (n,) largest speed [mm/s]: programmed feed and axis speeds
    a, j    : (n,) acceleration and jerk along the leg [mm/s2], [mm/s3]
    turning : (n,) of legs that are run as arcs from rest to rest [rad/mm], 0 on others; None if there are none
    """

    length: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray
    turning: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.turning is None:
            object.__setattr__(self, "turning", np.zeros(len(self.length)))
        freeze(self, "length v a j turning", np.float64, (len(self.length),))

    def __len__(self) -> int:
        return len(self.length)

    @cached_property
    def table(self) -> Array:
        """(n,) records `LEG`, the same for the kernels."""
        return _table(self, LEG)


@dataclass(frozen=True, eq=False, kw_only=True)
class Passage:
    """One way of passing each of the n+1 joints of n legs; the first and the last are stops.

    kind    : (n+1,) `JointKind` (baselines/lookahead/ramps.py)
    V       : (n+1,) speed [mm/s], 0 at stops; of candidates the largest
    p, q, r : (n+1,) parameters of the kind; r may be left out where no corner is of constant speed
    """

    kind: Array
    V: FloatArray
    p: FloatArray
    q: FloatArray
    r: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "kind", np.int64, (None,))
        if self.r is None:
            object.__setattr__(self, "r", np.zeros(len(self.kind)))
        freeze(self, "V p q r", np.float64, (len(self.kind),))

    @cached_property
    def table(self) -> Array:
        """(n+1,) records `WAY`, the same for the kernels."""
        return _table(self, WAY)


def _table(record: LegLimits | Passage, dtype: np.dtype) -> Array:
    """The columns of a record as a structured array."""
    names = dtype.names or ()
    table = np.empty(len(getattr(record, names[0])), dtype)
    for name in names:
        table[name] = getattr(record, name)
    return table


def passage_of(ways: Array) -> Passage:
    """The record of a table of ways (n+1,), records `WAY`."""
    return Passage(**{name: ways[name] for name in WAY.names or ()})
