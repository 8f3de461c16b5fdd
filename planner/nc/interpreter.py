"""Executing blocks in the order of RS274NGC, as LinuxCNC's interpreter has it:

    F, S, T, M6, M3-M9, M48/M49, G4, plane, units, G40, tool length, work offset, path control, distance modes, G28/G30/G92,
    motion, M0/M1/M60/M2/M30

Two consequences surprise. F is read in the units in force *before* a G20 or G21 on its line. M3 and M8 act before the line's move
and M0 after it. G53 holds for its line only; a motion code alone on a line moves nothing.

Rows that are plain straight moves run in `plain`; this file is for the others. A fault is recorded and reading goes on with the
next line, so that `info` can show them all; `reader` refuses a program that has any.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.base.units import SECONDS_PER_MINUTE
from planner.machine import Machine
from planner.nc import codes, moves
from planner.nc.block import Block, read_block
from planner.nc.faults import FaultList
from planner.nc.lexer import Words
from planner.nc.moves import WordFault, integer
from planner.nc.plain import run_plain
from planner.nc.program import MOVES, Frame, Kind, PathControl, Program
from planner.nc.splines import SPLINE_CODES, SplineReader, is_spline_line
from planner.nc.state import NO_MOTION, REFUSED_MOTION, Setup, set_units
from planner.nc.store import Store

_PATH_CONTROLS = {610: PathControl.EXACT_PATH, 611: PathControl.EXACT_STOP, 640: PathControl.BLEND}
_ROWS_AT_ONCE = 2  # blocks that one line can give beyond one per line (G28 through an intermediate point, a dwell, M6, M0)


_WHY_NO_MOTION = {
    NO_MOTION: "an axis word while no motion code is in force; write G0, G1, G2 or G3 before it",
    REFUSED_MOTION: "an axis word under a motion code that is not supported",
}


class Interpreter:
    """Runs the words of one program, all at once or in chunks: `execute` for each; then `program()`, `faults()`, `notes`.

    Between two chunks `state`, `setup` and `store` say where the program stands: what parameters of a program ask for.

    ended : M2, M30 or a second % was executed; later chunks are not
    """

    def __init__(self, machine: Machine | None, source: str):
        self.source = source
        self.setup = Setup.of(machine)
        self.state = self.setup.start()
        self.store = Store()
        self.ended = False
        self._splines = SplineReader()
        self._begun = False
        self._read = 0  # rows of the last chunk
        self._units_at: int | None = None  # number of blocks before the first G20 or G21
        self._reports: list[tuple[int, str]] = []
        self._found: list[tuple[Words, int, str]] = []
        self._said: set[tuple[int, str]] = set()
        self._notes: dict[str, list[int]] = {}  # in their order: first line, times

    def program(self, frames: Sequence[Frame] = ()) -> Program:
        """The program that was read, if there are no faults; `frames` are the calls of an expanded one."""
        self._note_units()
        return self.store.finish(self.source, self.notes, frames)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, each once, with its first line and how often."""
        found = sorted(self._notes.items(), key=lambda note: note[1][0])
        return tuple(
            f"line {line}: {text}{f' ({times} times)' if times > 1 else ''}" for text, (line, times) in found
        )

    def execute(self, words: Words) -> None:
        """Execute all rows: ordinary ones by the compiled loop (plain.py), all others word by word. Faults are kept, none is raised."""
        row, rows = 0, len(words.line)
        self.store.begin(len(words.letter))
        while row < rows and not self.ended:
            self.store.make_room(rows - row + 3 * _ROWS_AT_ONCE)
            after = row if self._splines.open else run_plain(words, row, self.state, self.store)
            self._begun |= after > row
            if after < rows:
                self.store.frame = int(words.frame[after])
                block = read_block(words, after, self.report)
                if block is not None and block.ended:
                    self.ended = self._begun  # the first % starts the program
                elif block is not None:
                    self.ended = self._execute_or_report(block)
                self._begun = True
                after += 1
            row = after
        self._read = row
        self._splines.keep(words)
        self._keep_faults(words)

    def note_what_follows(self, words: Words) -> None:
        """Say it if the last chunk, `words`, goes on after the end of the program."""
        row = self._read
        if not (words.letter[words.first[row] :] == ord("%")).all():
            end, after = int(words.line[row - 1]), int(words.line[row])
            self.note(f"the program ends; what follows from line {after} on is not read", end)

    def report(self, word: int, message: str) -> None:
        """Keep a fault of a word of the chunk, by its index."""
        self._reports.append((word, message))

    def faults(self) -> FaultList:
        """All faults in the order of the program; a line that is executed many times is named once."""
        return FaultList(self._found + self._splines.faults())

    def _keep_faults(self, words: Words) -> None:
        """Keep the chunk's faults in the order of its words."""
        refused = self.store.refused_word[: self.store.refusals]
        letters = words.letter[refused]
        found = [(int(w), str(codes.LETTERS_REFUSED[chr(c)])) for w, c in zip(refused, letters, strict=True)]
        for word, message in sorted(found + self._reports):
            key = (int(words.at[word]), message)
            if key not in self._said:
                self._said.add(key)
                self._found.append((words, word, message))
        self._reports.clear()

    def note(self, text: str, line: int) -> None:
        """Keep what was assumed on a line."""
        self._notes.setdefault(text, [line, 0])[1] += 1

    def _note_units(self) -> None:
        """Say it if the first move comes before any G20 or G21."""
        moves = np.flatnonzero(np.isin(self.store.block.kind[: self.store.blocks], MOVES))
        if len(moves) and (self._units_at is None or moves[0] < self._units_at):
            self.note("no G20 or G21 before the first move: mm", int(self.store.block.line[moves[0]]))

    def _execute_or_report(self, block: Block) -> bool:
        try:
            return self._execute(block)
        except WordFault as fault:
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
            raise WordFault(
                block.at["F"],
                "a feed must be positive; write the feed of the moves that follow, such as F1000",
            )
        self.state.feed = feed * self.state.unit / SECONDS_PER_MINUTE
        code = block.g.get("units")
        if code is not None and (code == 200) != (self.state.unit != 1.0):
            unit = "mm" if self.state.unit == 1.0 else "inch"
            self.note(
                f"F{feed:g} is {unit} per minute: F acts before G{codes.number(code)} on the same line",
                block.line,
            )

    def _events(self, block: Block) -> None:
        state, store, line = self.state, self.store, block.line
        if "S" in block.value:
            if block.value["S"] < 0:
                raise WordFault(
                    block.at["S"], "a spindle speed must not be negative; write M4 to turn the other way"
                )
            store.add_event("S", block.value["S"], line)
        if "T" in block.value:
            state.tool_selected = integer(block, "T", 0)
            store.add_event("T", state.tool_selected, line)
        if "tool change" in block.m:
            state.tool_loaded = state.tool_selected
            store.add(Kind.STOP, line, state)
            self.note("a tool change is a full stop that takes no time", line)
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
            raise WordFault(
                word, "a dwell needs its seconds as a P word that is not negative, such as G4 P0.5"
            )
        self.store.add_dwell(seconds, block.line, self.state)

    def _modes(self, block: Block) -> None:
        state, g = self.state, block.g
        if "plane" in g:
            state.normal = {170: 2, 180: 1, 190: 0}[g["plane"]]
        if "units" in g:
            set_units(state, g["units"])
            if self._units_at is None:
                self._units_at = self.store.blocks
        if "tool length" in g:
            state.tool_length = self._tool_length(block) if g["tool length"] == 430 else 0.0
        if "work offset" in g:
            state.system = g["work offset"]
            if state.system not in self.setup.systems and state.system != 540:
                self.note(f"G{codes.number(state.system)} has no offset in the machine file: 0", block.line)
        if "path control" in g:
            self._path_control(block)
        if "distance mode" in g:
            state.absolute = g["distance mode"] == 900
        if "arc centre mode" in g:
            state.absolute_centre = g["arc centre mode"] == 901
        self.setup.apply_offsets(state)

    def _tool_length(self, block: Block) -> float:
        tool = integer(block, "H", 0) if "H" in block.value else self.state.tool_loaded
        if tool not in self.setup.tools and tool != 0:
            self.note(f"tool {tool} has no length in the machine file: 0", block.line)
        return self.setup.tools.get(tool, 0.0)

    def _path_control(self, block: Block) -> None:
        state = self.state
        state.path_control, state.tolerance = _PATH_CONTROLS[block.g["path control"]], np.nan
        if "P" in block.value and block.g["path control"] == 640:
            tolerance = block.value["P"]
            if tolerance < 0:
                raise WordFault(block.at["P"], "a tolerance must not be negative; write G64 P0.05")
            if tolerance > 0:
                state.tolerance = tolerance * state.unit
            else:
                self.note("G64 P0 gives no tolerance; the machine's holds", block.line)
        if "Q" in block.value:
            self.note("G64 Q is not used: the tolerance of P bounds every deviation", block.line)

    # --- what moves ---------------------------------------------------------------------------------------------------------

    def _one_shot(self, block: Block) -> None:
        code = block.g.get("one-shot")
        if code is None or code in (40, 530):
            return
        covets_axes = code in (280, 300, 920)
        motion = block.g.get("motion")
        if covets_axes and motion is not None:
            raise WordFault(
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
            self.note(f"{name} has no position in the machine file: machine zero", block.line)
        home = self.setup.positions.get(code, np.zeros(3))
        if block.has("XYZ"):
            state.position[:] = moves.target(self.state, block)
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
                raise WordFault(
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
        state, one_shot = self.state, block.g.get("one-shot")
        if "motion" in block.g:
            code = block.g["motion"]
            state.motion = code if code in SPLINE_CODES else code // 10
        elif "cycle end" in block.g:
            state.motion = NO_MOTION
        if one_shot in (280, 300, 920):
            return
        if one_shot == 530:
            moves.check_machine_coordinates(state, block)
        if state.motion in SPLINE_CODES or (self._splines.open and "motion" in block.g):
            self._spline(block)
            return
        if state.motion not in (2, 3):
            moves.check_no_arc_words(state, block)
        if not moves.is_move(state, block):
            return
        if state.motion < 0:
            raise WordFault(block.first_of("XYZ"), _WHY_NO_MOTION[state.motion])
        if state.motion > 0 and not state.feed > 0:
            found = f"G{state.motion} moves without a feed; write an F word on this line or before it"
            raise WordFault(block.motion_word(), found)
        target = moves.target(state, block)
        if state.motion < 2:
            state.position[:] = target
            self.store.add(Kind.LINE if state.motion == 1 else Kind.RAPID, block.line, state)
            return
        try:
            arc = moves.arc(state, block, target)
        finally:
            state.position[:] = target
        self.store.add_arc(arc, block.line, state)

    def _spline(self, block: Block) -> None:
        """A line of a spline."""
        state = self.state
        if not is_spline_line(block):
            return
        found = self._splines.read(state, block, self.store.blocks)
        if found is None:
            return
        if not state.feed > 0:
            raise WordFault(
                block.motion_word(), "a spline without a feed; write an F word on its first line or before it"
            )
        (points, weights), line = found
        state.position[:] = points[-1, -1]
        self.store.add_spline(points, weights, line, state)
