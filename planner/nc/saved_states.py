"""Commands of printers that set coordinates, keep the state of a program or bring it back.

    SET_GCODE_OFFSET Z=0.1, Z_ADJUST=0.05    shifts what follows; with MOVE=1 the head goes along, at MOVE_SPEED [mm/s]
    SET_KINEMATIC_POSITION X=0               what the place of the head is called
    SAVE_GCODE_STATE NAME=a                  keeps G90 and G91, offsets, F, its factor (M220) and the place
    RESTORE_GCODE_STATE NAME=a MOVE=1        brings them back; with MOVE=1 the head goes to the place, at MOVE_SPEED
    G60 S0, G61 S0 X Y F                     keeps the place, goes back to it (Marlin), with the axes named, or all

How E counts is kept and brought back in extruder.py, by the `marks` of these commands.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.block_table import BlockTable
from planner.nc.moves import WordFault
from planner.nc.printer import OFFSET, PLACE, RESTORE, SAVE
from planner.nc.program import Kind
from planner.nc.settings import PRINTER_FEED, Setting
from planner.nc.state import State

_AXES = "xyz"


class _Kept(NamedTuple):
    """What SAVE_GCODE_STATE and G60 keep."""

    position: FloatArray
    absolute: bool
    g92: FloatArray
    shift: FloatArray
    feed: float
    feed_unit: float
    feed_factor: float


class SavedStates:
    """States by their names; `shift` (3,) is that of SET_GCODE_OFFSET [mm]."""

    def __init__(self) -> None:
        self.kept: dict[str, _Kept] = {}
        self.shift = np.zeros(3)
        self.marks: list[tuple[int, str, bool]] = []  # row, name, and whether the state is brought back

    def take(self, setting: Setting, state: State, table: BlockTable, line: int) -> None:
        """Execute a command. Raises WordFault for a state that was not kept."""
        name, given = setting.name, setting.values
        if name in (SAVE, "G60"):
            feeds = state.feed, state.feed_unit, state.feed_factor
            kept = _Kept(state.position.copy(), state.absolute, state.g92.copy(), self.shift.copy(), *feeds)
            self.kept[name[0] + setting.slot] = kept
            if name == SAVE:
                self.marks.append((table.frame, setting.slot, False))
        elif name in (RESTORE, "G61"):
            back = self.kept.get({RESTORE: "S", "G61": "G"}[name] + setting.slot)
            if back is None:
                raise WordFault(setting.word, f"{name} of a state that was not kept before it")
            self._restore(setting, back, state, table, line)
        elif name == PLACE:
            here = state.programmed()
            for axis, letter in enumerate(_AXES):
                if letter in given:
                    state.g92[axis] += here[axis] - given[letter]
            state.apply_offsets()
        elif name == OFFSET:
            shift = self.shift.copy()
            for axis, letter in enumerate(_AXES):
                shift[axis] = given.get(letter, shift[axis] + given.get(f"{letter}_adjust", 0.0))
            by, self.shift = shift - self.shift, shift
            state.g92[:3] += by
            state.apply_offsets()
            if given.get("move"):
                target = state.position.copy()
                target[:3] += by
                _go(target, given.get("move_speed"), state, table, line)

    def homed(self, axes: list[int], state: State) -> None:
        """What G92 has set of axes ends where they are homed, as Klipper and Marlin have it."""
        state.g92[axes] = self.shift[axes]
        state.apply_offsets()

    def _restore(self, setting: Setting, back: _Kept, state: State, table: BlockTable, line: int) -> None:
        given = setting.values
        if setting.name == "G61":
            speed = given["f"] * state.unit / SECONDS_PER_MINUTE if "f" in given else None
            target = state.position.copy()
            axes = [axis for axis, letter in enumerate(_AXES) if letter in given] or [0, 1, 2]
            target[axes] = back.position[axes]
            _go(target, speed, state, table, line)
            return
        self.marks.append((table.frame, setting.slot, True))
        state.absolute, self.shift = back.absolute, back.shift.copy()
        state.g92[:] = back.g92
        state.apply_offsets()
        state.feed, state.feed_unit, state.feed_factor = back.feed, back.feed_unit, back.feed_factor
        if given.get("move"):
            _go(back.position, given.get("move_speed"), state, table, line)


def _go(target: FloatArray, speed: float | None, state: State, table: BlockTable, line: int) -> None:
    """A straight move at a speed [mm/s], or at F where None is given."""
    before = state.feed
    state.feed = speed or before or PRINTER_FEED
    state.position[:] = target
    table.add(Kind.LINE, line, state)
    state.feed = before
