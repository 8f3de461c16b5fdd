"""Executing blocks in the order of RS274NGC, as LinuxCNC's interpreter has it:

    F, S, T, M6, M3-M9, M48/M49, G4, plane, units, G40, tool length, work offset, path control, distance modes, G28/G30/G92,
    motion, M0/M1/M60/M2/M30

Two consequences surprise. F is read in the units in force *before* a G20 or G21 on its line. M3 and M8 act before the line's move
and M0 after it. G53 holds for its line only; a motion code alone on a line moves nothing.

Rows that are plain straight moves run in `plain`; this file is for the others. A fault is recorded and reading goes on with the
next line, so that `info` can show them all; `reader` refuses a program that has any.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import FloatArray
from planner.machine import LINEAR_AXES, Machine
from planner.nc import codes
from planner.nc.arcs import AXES, IN_PLANE, Arc, ArcError, arc_from_centre, arc_from_radius, closes
from planner.nc.block import Block, read_block
from planner.nc.faults import Fault
from planner.nc.lexer import Words
from planner.nc.plain import run_plain
from planner.nc.program import Kind, PathControl, Program
from planner.nc.state import NO_MOTION, REFUSED_MOTION, Setup, set_units
from planner.nc.store import Store
from planner.units import SECONDS_PER_MINUTE

_INTEGER_ROUNDING = {"T": 1e-4, "H": 1e-4, "P": 1e-3}  # what RS274NGC rounds away
_PATH_CONTROLS = {610: PathControl.EXACT_PATH, 611: PathControl.EXACT_STOP, 640: PathControl.BLEND}
_ROWS_AT_ONCE = 2  # blocks that one line can give beyond one per line (G28 through an intermediate point, a dwell, M6, M0)


class _LineFault(Exception):
    """The line cannot be executed further; carries the word and the message."""

    def __init__(self, word: int, message: str):
        self.word, self.message = word, message


class Interpreter:
    """Runs the words of one program. After `run`: `program()`, `faults`, `notes`."""

    def __init__(self, words: Words, machine: Machine | None, source: str):
        self.words, self.source = words, source
        self.setup = Setup.of(machine)
        self.state = self.setup.start()
        self.store = Store(len(words.line))
        self.faults: list[Fault] = []
        self.notes: dict[str, None] = {}  # ordered, each once

    def program(self) -> Program:
        return self.store.finish(self.source, tuple(self.notes))

    def run(self) -> None:
        row, rows, begun, ended = 0, len(self.words.line), False, False
        while row < rows and not ended:
            self.store.make_room(rows - row + 3 * _ROWS_AT_ONCE)
            after = run_plain(self.words, row, self.state, self.store)
            begun |= after > row
            if after < rows:
                block = read_block(self.words, after, self.report)
                if block is not None and block.ended:
                    ended = begun  # the first % starts the program
                elif block is not None:
                    ended = self._execute_or_report(block)
                begun = True
                after += 1
            row = after
        if not (self.words.letter[self.words.first[row] :] == ord("%")).all():
            end, after = int(self.words.line[row - 1]), int(self.words.line[row])
            self.note(f"the program ends on line {end}; what follows from line {after} on is not read")

    def report(self, word: int, message: str) -> None:
        line = int(self.words.line[np.searchsorted(self.words.first, word, side="right") - 1])
        self.faults.append(Fault(line, self.words.column(word), self.words.text(word), message))

    def note(self, text: str) -> None:
        self.notes[text] = None

    def _execute_or_report(self, block: Block) -> bool:
        try:
            return self._execute(block)
        except _LineFault as fault:
            self.report(fault.word, fault.message)
            return block.m.get("stopping") in (20, 300)

    def _execute(self, block: Block) -> bool:
        """Execute one block; True if it ends the program."""
        self._feed(block)
        self._events(block)
        if block.g.get("one-shot") == 40:
            self._dwell(block)
        self._modes(block)
        if not block.foreign:
            self._one_shot(block)
            self._motion(block)
        stop = block.m.get("stopping")
        if stop in (0, 10, 600):
            self.store.add(Kind.STOP, block.line, self.state)
        if block.refused_motion:
            self.state.motion = REFUSED_MOTION
        return stop in (20, 300)

    # --- what is said before anything moves -------------------------------------------------------------------------------

    def _feed(self, block: Block) -> None:
        if "F" not in block.value:
            return
        feed = block.value["F"]
        if not feed > 0:
            raise _LineFault(
                block.at["F"],
                "a feed must be positive; write the feed of the moves that follow, such as F1000",
            )
        self.state.feed = feed * self.state.unit / SECONDS_PER_MINUTE
        code = block.g.get("units")
        if code is not None and (code == 200) != (self.state.unit != 1.0):
            unit = "mm" if self.state.unit == 1.0 else "inch"
            self.note(
                f"line {block.line}: F{feed:g} is {unit} per minute: F acts before G{codes.number(code)} on the same line"
            )

    def _events(self, block: Block) -> None:
        state, store, line = self.state, self.store, block.line
        if "S" in block.value:
            if block.value["S"] < 0:
                raise _LineFault(
                    block.at["S"], "a spindle speed must not be negative; write M4 to turn the other way"
                )
            store.add_event("S", block.value["S"], line)
        if "T" in block.value:
            state.tool_selected = self._integer(block, "T", 0)
            store.add_event("T", state.tool_selected, line)
        if "tool change" in block.m:
            state.tool_loaded = state.tool_selected
            store.add(Kind.STOP, line, state)
        for group in ("spindle", "coolant", "override"):
            if group in block.m:
                store.add_event("M", block.m[group] / 10, line)
        for code in block.g.values():
            if code in codes.G_EVENTS:
                store.add_event("G", code / 10, line)

    def _dwell(self, block: Block) -> None:
        seconds = block.value.get("P")
        if seconds is None or seconds < 0:
            word = block.at["one-shot"] if seconds is None else block.at["P"]
            raise _LineFault(
                word, "a dwell needs its seconds as a P word that is not negative, such as G4 P0.5"
            )
        self.store.add_dwell(seconds, block.line, self.state)

    def _modes(self, block: Block) -> None:
        state, g = self.state, block.g
        if "plane" in g:
            state.normal = {170: 2, 180: 1, 190: 0}[g["plane"]]
        if "units" in g:
            set_units(state, g["units"])
        if "tool length" in g:
            state.tool_length = self._tool_length(block) if g["tool length"] == 430 else 0.0
        if "work offset" in g:
            state.system = g["work offset"]
            if state.system not in self.setup.systems and state.system != 540:
                self.note(f"G{codes.number(state.system)} has no offset in the machine file: 0")
        if "path control" in g:
            self._path_control(block)
        if "distance mode" in g:
            state.absolute = g["distance mode"] == 900
        if "arc centre mode" in g:
            state.absolute_centre = g["arc centre mode"] == 901
        self.setup.apply_offsets(state)

    def _tool_length(self, block: Block) -> float:
        tool = self._integer(block, "H", 0) if "H" in block.value else self.state.tool_loaded
        if tool not in self.setup.tools and tool != 0:
            self.note(f"tool {tool} has no length in the machine file: 0")
        return self.setup.tools.get(tool, 0.0)

    def _path_control(self, block: Block) -> None:
        state = self.state
        state.path_control, state.tolerance = _PATH_CONTROLS[block.g["path control"]], np.nan
        if "P" in block.value and block.g["path control"] == 640:
            tolerance = block.value["P"]
            if tolerance < 0:
                raise _LineFault(block.at["P"], "a tolerance must not be negative; write G64 P0.05")
            if tolerance > 0:
                state.tolerance = tolerance * state.unit
            else:
                self.note(f"line {block.line}: G64 P0 gives no tolerance; the machine's holds")
        if "Q" in block.value:
            self.note("G64 Q is not used: the tolerance of P bounds every deviation")

    # --- what moves ---------------------------------------------------------------------------------------------------------

    def _one_shot(self, block: Block) -> None:
        code = block.g.get("one-shot")
        if code is None or code in (40, 530):
            return
        covets_axes = code in (280, 300, 920)
        motion = block.g.get("motion")
        if covets_axes and motion is not None and (motion != 800 or block.has("XYZ")):
            raise _LineFault(
                block.at["one-shot"],
                f"G{codes.number(code)} and G{codes.number(motion)} both use the axis words of the line; write two lines",
            )
        if code in (280, 300):
            self._go_home(block, code)
        else:
            self._shift_origin(block, code)

    def _go_home(self, block: Block, code: int) -> None:
        """G28, G30: through the intermediate point, if there is one, to the machine's position (of the axes given)."""
        state, name = self.state, f"G{codes.number(code)}"
        if code not in self.setup.positions:
            self.note(f"{name} has no position in the machine file: machine zero")
        home = self.setup.positions.get(code, np.zeros(3))
        if block.has("XYZ"):
            state.position[:] = self._target(block)
            self.store.add(Kind.RAPID, block.line, state)
        for axis, letter in enumerate("XYZ"):
            if letter in block.value or not block.has("XYZ"):
                state.position[axis] = home[axis]
        self.store.add(Kind.RAPID, block.line, state)

    def _shift_origin(self, block: Block, code: int) -> None:
        """G92 makes the current position have the given coordinates; G92.1, G92.2 take that back, G92.3 brings it again."""
        state = self.state
        if code == 920:
            if not block.has("XYZ"):
                raise _LineFault(
                    block.at["one-shot"],
                    "G92 needs at least one of X, Y and Z: the coordinates to give to this place",
                )
            for axis, letter in enumerate("XYZ"):
                if letter in block.value:
                    without = state.offset[axis] - state.g92[axis]
                    state.g92[axis] = state.position[axis] - block.value[letter] * state.unit - without
            state.g92_saved = state.g92.copy()
        else:
            state.g92 = state.g92_saved.copy() if code == 923 else np.zeros(3)
            if code == 921:
                state.g92_saved = np.zeros(3)
        self.setup.apply_offsets(state)

    def _motion(self, block: Block) -> None:
        state, code, one_shot = self.state, block.g.get("motion"), block.g.get("one-shot")
        if code is not None:
            state.motion = code // 10 if code != 800 else NO_MOTION
        if one_shot in (280, 300, 920):
            return
        if one_shot == 530:
            self._check_machine_coordinates(block)
        self._check_arc_words(block)
        if not block.has("XYZ") and not (state.motion in (2, 3) and (code is not None or block.has("IJKR"))):
            return
        if state.motion < 0:
            found = (
                "G80 is"
                if code == 800
                else "a motion code that is not supported is"
                if state.motion == REFUSED_MOTION
                else "no motion code is"
            )
            raise _LineFault(
                block.first_of("XYZ"),
                f"an axis word while {found} in force; write G0, G1, G2 or G3 before it",
            )
        if state.motion > 0 and not state.feed > 0:
            word = block.at.get("motion", block.first_of("XYZIJKR") if block.has("XYZIJKR") else 0)
            raise _LineFault(
                word, f"G{state.motion} moves without a feed; write an F word on this line or before it"
            )
        if state.motion < 2:
            state.position[:] = self._target(block)
            self.store.add(Kind.LINE if state.motion == 1 else Kind.RAPID, block.line, state)
        else:
            self._arc(block)

    def _check_machine_coordinates(self, block: Block) -> None:
        if self.state.motion not in (0, 1) or not ("motion" in block.g or block.has("XYZ")):
            raise _LineFault(block.at["one-shot"], "G53 goes with G0 or G1 only; write G53 G0 or G53 G1")
        if not self.state.absolute:
            raise _LineFault(
                block.at["one-shot"], "G53 goes with absolute coordinates only; write G90 before it"
            )

    def _check_arc_words(self, block: Block) -> None:
        """I J K R, and a P that no G4 or G64 uses, need an arc."""
        if self.state.motion in (2, 3):
            return
        taken = block.g.get("one-shot") == 40 or block.g.get("path control") == 640
        for letter in "IJKR" if taken else "IJKRP":
            if letter in block.value and self.state.motion != REFUSED_MOTION:
                raise _LineFault(
                    block.at[letter],
                    f"{letter} word without {codes.LETTER_NEEDS[letter]}, which would use it; remove it",
                )

    def _target(self, block: Block) -> FloatArray:
        """Where the block's axis words lead, in machine coordinates."""
        state = self.state
        target = state.position.copy()
        for axis, letter in enumerate("XYZ"):
            if letter in block.value:
                length = block.value[letter] * state.unit
                if block.g.get("one-shot") == 530:
                    target[axis] = length
                else:
                    target[axis] = length + (state.offset[axis] if state.absolute else target[axis])
        return target

    def _arc(self, block: Block) -> None:
        state, target = self.state, self._target(block)
        word = block.at.get("motion", block.first_of("XYZIJKR") if block.has("XYZIJKR") else 0)
        try:
            arc = self._solve_arc(block, target)
        except ArcError as fault:
            state.position[:] = target
            raise _LineFault(word, str(fault)) from fault
        state.position[:] = target
        self.store.add_arc(arc, block.line, state)

    def _solve_arc(self, block: Block, target: FloatArray) -> Arc:
        state = self.state
        a, b = IN_PLANE[state.normal]
        outside = "IJK"[state.normal]
        turns = self._integer(block, "P", 1) if "P" in block.value and block.g.get("one-shot") != 40 else 1
        if outside in block.value:
            raise ArcError(
                f"{outside} in the {AXES[a]} {AXES[b]} plane; write the plane (G17, G18 or G19) that the centre lies in"
            )
        shape = {"normal": state.normal, "clockwise": state.motion == 2, "turns": turns, "unit": state.unit}
        if "R" in block.value:
            if block.has("IJK"):
                raise ArcError("R and I J K on one line both define the centre; write one of them")
            if not block.has("XYZ"[a] + "XYZ"[b]):
                raise ArcError(f"an arc with R needs an end point: {AXES[a]} or {AXES[b]} in this plane")
            return arc_from_radius(state.position, target, block.value["R"] * state.unit, **shape)
        if not block.has("IJK"):
            raise ArcError(f"an arc needs a centre or a radius; write {'IJK'[a]} and {'IJK'[b]}, or R")
        centre = self._centre(block, absolute=state.absolute_centre)
        try:
            return arc_from_centre(state.position, target, centre, **shape)
        except ArcError as fault:
            other = self._centre(block, absolute=not state.absolute_centre)
            if (
                block.has("IJK"[a])
                and block.has("IJK"[b])
                and closes(state.position, target, other, normal=state.normal, unit=state.unit)
            ):
                way = "incremental: write G91.1" if state.absolute_centre else "absolute: write G90.1"
                raise ArcError(f"{fault}; the arc would close if its centre were {way} before it") from fault
            raise ArcError(f"{fault}; correct the centre or the end point") from fault

    def _centre(self, block: Block, *, absolute: bool) -> FloatArray:
        state, centre = self.state, self.state.position.copy()
        for axis in IN_PLANE[state.normal]:
            letter = "IJK"[axis]
            if letter in block.value:
                length = block.value[letter] * state.unit
                centre[axis] = length + (state.offset[axis] if absolute else centre[axis])
            elif absolute and state.absolute_centre:
                raise ArcError(f"{letter} is missing; with absolute centres (G90.1) both are needed")
        return centre

    def _integer(self, block: Block, letter: str, least: int) -> int:
        value = block.value[letter]
        whole = round(value)
        if abs(value - whole) > _INTEGER_ROUNDING[letter] or whole < least:
            raise _LineFault(block.at[letter], f"{letter} must be a whole number, {least} or more")
        return whole


assert tuple(AXES) == LINEAR_AXES
