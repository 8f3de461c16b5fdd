"""The words without influence on the motion, in arrays; an `Event` is made when it is looked at (a laser file
has 110,000)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar, overload

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.nc.program import Event

One = TypeVar("One")


class MadeWhenAsked(Sequence[One]):
    """A sequence whose members are made when they are looked at."""

    def made(self, index: int) -> One:
        """The member of that number. Raises IndexError."""
        raise NotImplementedError

    @overload
    def __getitem__(self, index: int) -> One: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[One]: ...
    def __getitem__(self, index: int | slice) -> One | Sequence[One]:
        if isinstance(index, slice):
            return tuple(self.made(k) for k in range(*index.indices(len(self))))
        return self.made(index)


@dataclass(frozen=True, eq=False, kw_only=True)
class EventTable(MadeWhenAsked[Event]):
    """E events.

    block  : (E,) the block before which it happens
    line   : (E,) 1-based source line
    letter : (E,) "S", "T", "M" or "G", as its code
    value  : (E,) the word's number
    """

    block: Array
    line: Array
    letter: Array
    value: FloatArray

    def __post_init__(self) -> None:
        count = len(self.block)
        freeze(self, "block", np.int64, (count,))
        freeze(self, "line", np.int32, (count,))
        freeze(self, "letter", np.uint8, (count,))
        freeze(self, "value", np.float64, (count,))

    def __len__(self) -> int:
        return len(self.block)

    def made(self, index: int) -> Event:
        """The event of that number."""
        text = f"{chr(self.letter[index])}{plain(float(self.value[index]))}"
        return Event(block=int(self.block[index]), line=int(self.line[index]), text=text)


def plain(value: float) -> str:
    """A number without exponent and without needless zeros: 12000.0 -> "12000", 0.5 -> "0.5"."""
    return np.format_float_positional(value, trim="-")
