"""A limit, as the planner sees it. Every limit is an object, listed in `limits.py`.

A limit takes part in the feedrate problem (problem.py) in one of three forms, x = feed^2, u, j:

    a cap    x <= ...  at a grid point. What it comes from says which method the limit has:
                 at_points   the point and the intervals beside it          programmed feed, axis velocity
                 on_side     the curve on one side of the point             normal acceleration, chord and filter error, phase lag
                 at_jumps    a difference of the two sides                  axis acceleration, where a line meets an arc
    a row    |row(r', r'', r'''; x, u, j)| <= limit of the axis, at both ends of every interval      axis acceleration, axis jerk
    along    both of one function of the path, as the user's limits have them (machine/user_limit.py)      tangential acceleration

The judge knows nothing of these objects: it has code of its own for every limit (verifier/), and
tests/verifier/test_laws_of_limits.py holds one against the other.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.on_grid import OnGrid, Side
from planner.machine import Machine
from planner.machine.user_limit import OwnLimit


class Cap(NamedTuple):
    """A bound on feed^2 at P points, inf where there is none."""

    name: str  # as it is printed, with the axis where there is one: "feed", "velocity.x"
    feed_sq: FloatArray  # (P,) [mm2/s2]


class RowPoint(NamedTuple):
    """One axis at n grid points, from one side: r', r'', r''', x = feed^2, u, jerk along the path (n,)."""

    d1: FloatArray
    d2: FloatArray
    d3: FloatArray
    x: FloatArray
    u: FloatArray
    jerk: FloatArray


class Limit:
    """One limit; it overrides the methods of the forms that it has."""

    name: ClassVar[str]  # as it is printed; of an axis limit with the axis behind it, see `AxisLimit.called`
    unit: ClassVar[str]  # of what is limited; rad stands for mm on rotary axes
    # slower by lam, a motion has 1/lam^order of it: speeds 1, accelerations and errors 2, jerks 3
    order: ClassVar[int]
    key: ClassVar[str] = ""  # of the machine file, if its value stands alone there

    def at_points(self, grid: OnGrid) -> Iterator[Cap]:
        """Caps from the points and the intervals beside them."""
        yield from ()

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        """Caps from the curve on one side of the points."""
        yield from ()

    def at_jumps(self, grid: OnGrid) -> Iterator[Cap]:
        """Caps from differences of the two sides."""
        yield from ()

    def inside(self, grid: OnGrid) -> FloatArray | None:
        """(P,) bound on feed^2 inside the interval to the right, if straight [mm2/s2]; None for none."""
        return None

    def along(self, machine: Machine, axes: tuple[str, ...]) -> OwnLimit | None:
        """The limit as a function of the path, with rows like an axis; None where it never binds."""
        return None


class AxisLimit(Limit):
    """A limit of every axis by itself, from the machine file: `name` is the key there."""

    @classmethod
    def called(cls, axis: str) -> str:
        """The name with the axis: "velocity.x"."""
        return f"{cls.name}.{axis}"

    @classmethod
    def of(cls, machine: Machine, axes: tuple[str, ...]) -> FloatArray:
        """(A,) the limits of the axes, in mm or rad. Raises InputError if the machine lacks one of them."""
        return machine.limits(cls.name, axes)  # type: ignore[arg-type]


class RowLimit(AxisLimit, ABC):
    """A limit of every axis with rows in the problem."""

    @abstractmethod
    def row(self, at: RowPoint) -> FloatArray:
        """(n,) what the axis limit bounds the size of, at n grid points [`unit`]."""


def over(value: FloatArray | float, by: FloatArray) -> FloatArray:
    """(P,) value/by for by (P,), and value (P,) or a number; inf where by is 0."""
    return np.divide(value, by, out=np.full(by.shape, np.inf), where=by > 0)


def by_axis(name: str, axes: tuple[str, ...], feed_sq: FloatArray, axis: FloatArray) -> Iterator[Cap]:
    """Caps feed_sq (P,) [mm2/s2] from one axis each, as caps of every axis; `axis` (P,) is its index."""
    for k, letter in enumerate(axes):
        yield Cap(f"{name}.{letter}", np.where(axis == k, feed_sq, np.inf))
