"""The words without influence on the motion, in arrays; an `Event` is made when it is looked at (a laser file
has 110,000)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.nc.program import Event


@dataclass(frozen=True, eq=False, kw_only=True)
class EventTable(Sequence[Event]):
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

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Event]: ...
    def __getitem__(self, index: int | slice) -> Event | Sequence[Event]:
        if isinstance(index, slice):
            return tuple(self[k] for k in range(*index.indices(len(self))))
        text = f"{chr(self.letter[index])}{plain(float(self.value[index]))}"
        return Event(block=int(self.block[index]), line=int(self.line[index]), text=text)


def plain(value: float) -> str:
    """A number without exponent and without needless zeros: 12000.0 -> "12000", 0.5 -> "0.5"."""
    return np.format_float_positional(value, trim="-")
