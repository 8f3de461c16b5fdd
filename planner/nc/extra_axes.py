"""State of the axes beside x, y and z (offsets.py has their rules)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine

LETTERS = "ABCUVW"
ROTARY = 3  # the first so many of them


def _zeros() -> FloatArray:
    return np.zeros(len(LETTERS))


@dataclass(slots=True)
class ExtraAxes:
    """Further axes, arrays (6,) in the order of `LETTERS`, in degrees and mm."""

    letters: str = ""  # those that the machine has and that are read
    wrapped: str = ""  # those of them that are wrapped
    position: FloatArray = field(default_factory=_zeros)  # in machine coordinates
    origins: dict[int, FloatArray] = field(default_factory=dict)  # of work systems, by code
    # g92 and g92_saved: the G92 offset, and what G92.3 brings back
    g92: FloatArray = field(default_factory=_zeros)
    g92_saved: FloatArray = field(default_factory=_zeros)
    homes: dict[int, FloatArray] = field(default_factory=dict)  # positions of G28 (280) and G30 (300)

    @property
    def columns(self) -> list[int]:
        """Indices of the axes that are read."""
        return [LETTERS.index(letter) for letter in self.letters]

    def offset(self, system: int) -> FloatArray:
        """(6,) machine position of the programmed zero in a work system."""
        return self.g92 + self.origins.get(system, _zeros())


def extra_axes_of(machine: Machine | None, code_of: Callable[[str], int]) -> ExtraAxes:
    """The further axes of a machine at their zero; none without a machine.

    code_of : code of a work system by its name in a machine file
    """
    if machine is None:
        return ExtraAxes()
    letters = "".join(letter for letter in LETTERS if letter.lower() in machine.axes)
    return ExtraAxes(
        letters=letters,
        wrapped="".join(letter for letter in letters if machine.axes[letter.lower()].wrapped),
        origins={code_of(name): _vector(given) for name, given in machine.work_offsets.items()},
        homes={280 if name == "g28" else 300: _vector(given) for name, given in machine.positions.items()},
    )


def _vector(given: dict[str, float]) -> FloatArray:
    return np.array([given.get(letter.lower(), 0.0) for letter in LETTERS])


def rotary_feed(feed: float, unit: float) -> float:
    """Feed [rad/s] of a block of rotary axes alone, by that in force [mm/s] and mm per programmed unit."""
    return feed / unit * RAD_PER_DEG
