"""What the extruder of a control is told: where its E is line by line, and E words for chords in place of an arc.

The rules are the control's own: E is a step after M83 and under G91; Marlin's G90 also ends M83. Where E is
at the start nothing tells, nor after a tool change or a macro; G92 and places do.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MM_PER_INCH
from planner.controls.export.controls import MARLIN, Control
from planner.controls.export.rows import Row, Word
from planner.machine import Machine
from planner.nc import codes

DECIMALS = 5  # of E in mm, as slicers write it


class Filament:
    """The extruder of a control behind the rows followed so far.

    place : what its E is called [mm], NaN where nothing has told it
    steps : E words are steps, whatever G90 and G91 say of the other axes
    """

    def __init__(self, control: Control, machine: Machine):
        self.one_mode = control.name == MARLIN.name  # G90 and G91 set it for E too
        self.macros = machine.macros
        self.place, self.steps = np.nan, False

    def shared(self, row: Row, points: FloatArray) -> list[float] | None:
        """The E of a row for each of the chords between points (n+1, 3) [mm], in proportion to their lengths, in
        all the row's own; None where it is a place and the one before is not known, and without a length."""
        word = row.value("E")
        assert word is not None
        end = _millimetres(word, row)
        begin = 0.0 if self.steps else self.place
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        if np.isnan(begin) or not along[-1] > 0.0:
            return None
        at = np.round(begin + along / along[-1] * (end - begin), DECIMALS)
        at[-1] = end
        shares: list[float] = np.round(np.diff(at) if self.steps else at[1:], DECIMALS).tolist()
        return shares

    def follow(self, row: Row) -> None:
        """Go on behind a row."""
        words = [*row.words, *(word for other in row.others for word in other)]
        said = {f"{word.letter}{codes.number(word.code)}" for word in words if word.letter in "GM"}
        if "M6" in said or not said.isdisjoint(self.macros):
            self.place = np.nan
        if not said.isdisjoint(("M82", "M83")):
            self.steps = "M83" in said
        if self.one_mode and not said.isdisjoint(("G90", "G91")):
            self.steps = "G91" in said
        amount = next((_millimetres(word, row) for word in words if word.letter == "E"), None)
        if amount is not None and ("G92" in said or row.feeds):
            adds = (self.steps or not (self.one_mode or row.absolute)) and "G92" not in said
            self.place = amount + (self.place if adds else 0.0)


def _millimetres(word: Word, row: Row) -> float:
    return word.value * (MM_PER_INCH if row.inch else 1.0)
