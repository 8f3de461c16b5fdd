"""What is known about the numbers of a trajectory: which of them were delivered, and to how many digits."""

from __future__ import annotations

from dataclasses import dataclass

from planner.base.arrays import FloatArray, freeze

DERIVATIVES = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False, kw_only=True)
class Given:
    """How much of a trajectory was given, and how exactly; without arguments all of it, in float64.

    columns           : derivatives that were delivered; the others were derived from the positions by whoever read them, and only
                        the positions are judged for them
    position_rounding : (A,) largest error of a position by the digits it is written with [mm, rad], or () for none
    time_rounding     : the same of every time [s]
    end_rounding      : the same of the last time alone [s]: the others may lie on a grid, and be known by it
    extruder_rounding : largest error of the extruder's place by its digits [mm of filament]
    """

    columns: tuple[str, ...] = DERIVATIVES
    position_rounding: FloatArray | tuple[float, ...] = ()
    time_rounding: float = 0.0
    end_rounding: float = 0.0
    extruder_rounding: float = 0.0

    def __post_init__(self) -> None:
        freeze(self, "position_rounding", float, (None,))
        unknown = set(self.columns) - set(DERIVATIVES)
        if unknown:
            raise ValueError(
                f"Given.columns: {', '.join(sorted(unknown))}; there are {', '.join(DERIVATIVES)}"
            )


WHOLE = Given()
