"""Executing blocks in the order of RS274NGC, as LinuxCNC's interpreter has it:

    feed mode, F, S, T, M62-M68, M6, M61, M3-M9, M48/M49, G4, plane, units, G7/G8, G40-G42, tool length, work
    offset, path control, distance modes, G98/G99, G10/G28/G30/G52/G92, motion, M0/M1/M60/M2/M30

F is read in the units in force *before* a G20 or G21 on its line (behind it on Fanuc's controls and in grbl).
Rows that are plain straight moves run in `plain.py`; this file is for the others, and `mover.py` for what they
move. A fault is recorded and reading goes on with the next line, so that `info` can show them all.
"""

import copy
import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.base.units import SECONDS_PER_MINUTE
from planner.machine import EXTRUDER, Machine
from planner.nc import auxiliary, codes, moves, offsets
from planner.nc.arcs import PLANES
from planner.nc.block_reader import read_block
from planner.nc.block_table import BlockTable
from planner.nc.cutter import CutterFault
from planner.nc.faults import FaultList, Findings, IgnoredWords
from planner.nc.integers import DwellWords, integers_of
from planner.nc.language.detect import Archived
from planner.nc.lexer import Words
from planner.nc.mover import COVET_AXES, Mover
from planner.nc.moves import Block, WordFault
from planner.nc.plain import run_plain
from planner.nc.printer import OF_STATE
from planner.nc.program import FEED_MOVES, MOVES, Frame, Kind, Program
from planner.nc.reading import ABSOLUTE, AS_USUAL, AUTO, KLIPPER, Reading
from planner.nc.set_limits import LimitsInForce, SavedStates
from planner.nc.splines import SplineReader
from planner.nc.state import REFUSED_MOTION, State, begins_in_inches, state_of
from planner.nc.tool_point import ToolPointSwitch, at_the_tip

# Nobody cuts at less than 1 mm/min, and few at more than 1 mm per turn [mm/s].
_FEED_LEAST = 1.0 / SECONDS_PER_MINUTE
_END_OF_DATA = 11.0  # G code
# Letters of data lines behind G10 L50; what has others ends the data without G11.
_OF_DATA = list(b"NPRLTHDQS")
_IF_LATHE = "if this is a lathe's program, write lathe = true under [dialect] of the machine file"


class OpenArc(NamedTuple):
    """An arc that does not close."""

    line: int
    otherwise: bool  # with its centre read the other way it would
    centred: bool  # I J K are not all 0


class Interpreter(Mover):
    """Runs the words of one program, all at once or in chunks: `execute` for each; then `program()`,
    `faults()`. Between two chunks `state` and `table` say where the program stands.
    """

    def __init__(self, machine: Machine | None, source: str, reading: Reading = AS_USUAL):
        self.source, self.reading = source, reading
        self.machine = machine
        state = self.state = state_of(machine, reading.ignore)
        state.strict, state.absolute_centre = reading.strict, reading.arc_centres == ABSOLUTE
        self.tool_point = ToolPointSwitch(machine)
        extruder, at_tip = machine is not None and EXTRUDER in machine.axes, self.tool_point.chain is not None
        control = machine.control if machine is not None else None
        klipper = control is not None and control.name == KLIPPER
        self.ignored = IgnoredWords(reading, state.others, extruder=extruder, at_tip=at_tip, klipper=klipper)
        self.table = BlockTable(len(state.letters))
        self.table.keep_origin(state)
        self.findings = Findings(strict=reading.strict)
        self.feed_default = None if machine is None else machine.feed_default
        self.splines = SplineReader()
        self.open_arcs: list[OpenArc] = []  # every arc that does not close
        self._dwells = DwellWords()
        self.limits = LimitsInForce(reading.dialect)
        self.saved = SavedStates()
        self.ended = False  # M2, M30 or a second % was executed; later chunks are not
        self.archive: dict[str, Archived] = {}  # further programs of the file, by the names of their own
        self.two_axes = False  # the program has X and Z and no Y, and was not found to be one for a lathe
        self.by_word = 0  # rows that were executed word by word, not by the compiled loop
        self._timed = False  # a feed is in inverse time
        # before what is executed aside, and the place of the cycle that reads it; None while nothing is
        self.aside: tuple[State, BlockTable, tuple[int, int, int]] | None = None
        self._words: Words | None = None  # of the last chunk
        self._begun = False
        self.rows_read = 0  # of the last chunk, up to the end of the program
        self._units_known = False  # by a G20 or G21, or it was said that there was none before the first move

    def program(self, frames: Sequence[Frame] = ()) -> Program:
        """The program that was read, if there are no faults; `frames` are the calls of an expanded one."""
        self._assume_feeds()
        if self.cutter is not None and self._words is not None:
            try:
                self.cutter.fix()  # the last move, if the program just ends while compensation is on
            except CutterFault as fault:
                self.findings.faults.append((self._words, len(self._words.letter) - 1, str(fault)))
        limits = self.limits.throughout(self.table, self.machine, self.findings)
        notes = self.findings.notes(self.ignored.notes())
        read = self.table.finish(self.source, notes, frames, self.reading, self.state.letters)
        read = dataclasses.replace(read, limits=limits)
        return read if self.findings.faults else at_the_tip(read, self.tool_point, self.machine)

    def read_aside(self, place: tuple[int, int, int]) -> None:
        """What follows is executed aside: a profile that the cycle at a place reads. Raises ValueError in one."""
        if self.aside is not None:
            raise ValueError("a cycle stands in the profile of another one; write it behind that")
        self.aside = copy.deepcopy(self.state), self.table, place
        self.table = BlockTable(len(self.state.letters))
        # any feed does: moves whose feed depends on the diameter are divided
        self.state.feed_mode, self.state.feed, self.state.uncompensated = "per minute", 1.0, True

    def take_back(self) -> tuple[int, int, int] | None:
        """End what is executed aside, if anything is; the place of its cycle."""
        if self.aside is None:
            return None
        (self.state, self.table, place), self.aside = self.aside, None
        return place

    def in_seconds(self, words: Words) -> Words:
        """The next words of the program with the times of dwells in seconds, as `execute` takes them."""
        if not self.state.fanuc:
            return words
        known = integers_of(self.machine).increment is not None
        return self._dwells.in_seconds(words, None if known else self.findings.assume)

    def execute(self, words: Words) -> None:
        """Execute all rows, plain ones by the compiled loop (plain.py). Faults are kept, none is raised."""
        row, rows, self._words = 0, len(words.line), words
        self.table.begin(len(words.letter))
        while row < rows and not self.ended:
            self.table.make_room(rows - row)
            if not self.splines.open:
                after = run_plain(words, row, self.state, self.table, self.ignored)
                self._begun, row = self._begun or after > row, after
            if row == rows:
                break
            self.by_word += 1
            self.table.frame = int(words.frame[row])
            row += 1
            if self.state.entering:
                letters, values = words.of_rows(row - 1)
                ended = ((letters == ord("G")) & (values == _END_OF_DATA)).any()
                self.state.entering = not ended and bool(np.isin(letters, _OF_DATA).all())
                if ended or self.state.entering:
                    continue
            block = read_block(words, row - 1, self.findings.report, self.ignored)
            if block is not None and block.ended:
                self.ended = self._begun  # the first % starts the program
            elif block is not None:
                self.ended = self._execute_or_report(block)
            self._begun = True
        self.rows_read = row
        self._assume_units()
        self.splines.keep(words)
        refused = self.table.refused_word[: self.table.refusals]
        letters = words.letter[refused]
        self.ignored.moved |= {chr(letter) for letter in np.flatnonzero(np.bincount(letters))}
        found = [(int(w), str(codes.LETTERS_REFUSED[chr(c)])) for w, c in zip(refused, letters, strict=True)]
        self.findings.keep(words, found)
        self.ignored.count_letters(words, row)

    def note_what_follows(self, words: Words) -> None:
        """Say it if the last chunk, `words`, goes on after the end of the program."""
        row = self.rows_read
        if not (words.letter[words.first[row] :] == ord("%")).all():
            end, after = int(words.line[row - 1]), int(words.line[row])
            self.findings.note(f"the program ends; what follows from line {after} on is not read", end)

    @property
    def all_arcs_close_otherwise(self) -> bool:
        """True if there are arcs that do not close, and all of them would with their centres read the other way.
        One line decides nothing, and neither does I0 J0: one odd arc is a mistake."""
        lines = {arc.line for arc in self.open_arcs if arc.centred}
        return len(lines) > 1 and all(arc.otherwise for arc in self.open_arcs)

    def faults(self) -> FaultList:
        """All faults in the order of the program; a line that is executed many times is named once."""
        return FaultList(self.findings.faults + self.splines.faults())

    def _assume_units(self) -> None:
        moves = np.isin(self.table.block.kind[: self.table.blocks], MOVES)
        if self._units_known or self._words is None or not moves.any():
            return
        self._units_known = True
        line, text = int(self.table.block.line[moves.argmax()]), "no G20 or G21 before the first move"
        if begins_in_inches(self.machine):
            self.findings.note(f"{text}: inches, as the machine file says", line)
            return
        row = int((self._words.line == line).argmax())
        self.findings.assume(f"{text}: mm", line, int(self._words.first[row]))

    def _assume_feeds(self) -> None:
        """Say it if feed moves are so slow that F is most likely one per turn of the spindle."""
        block, used = self.table.block, slice(0, self.table.blocks)
        slow = np.flatnonzero(np.isin(block.kind[used], FEED_MOVES) & (block.feed[used] < _FEED_LEAST))
        if len(slow) and not self._timed:
            at = block.feed[slow[0]] * SECONDS_PER_MINUTE
            text = f"F looks like a feed per turn of the spindle (G95), and is read per minute: {at:.6g} mm/min; {_IF_LATHE}"
            self.findings.assume(text, int(block.line[slow[0]]))
        if self.reading.dialect == AUTO and not self.state.own_feed and not self._timed:
            self._assume_own_speed()

    def _assume_own_speed(self) -> None:
        """Say it if x, y and z move beside rotary axes at a feed, and not at the tool centre point."""
        state, block, used = self.state, self.table.block, slice(0, self.table.blocks)
        if not state.turns.any() or self.tool_point.switches or state.strict or state.centres_known:
            return
        moves = np.diff(block.end[used], axis=0, prepend=0.0) != 0.0
        mixed = moves[:, :3].any(axis=1) & moves[:, state.turns].any(axis=1) & (block.kind[used] == Kind.LINE)
        if mixed.any():
            text = "F of x, y and z that move beside rotary axes is their own speed, as LinuxCNC has it"
            text += "; Fanuc and grbl count degrees as mm (--dialect)"
            self.findings.assume(text, int(block.line[used][mixed.argmax()]))

    def _execute_or_report(self, block: Block) -> bool:
        try:
            return self._execute(block)
        except WordFault as fault:
            message = fault.message
            if isinstance(fault, moves.ArcFault):
                centred = any(block.value.get(letter) for letter in "IJK")
                self.open_arcs.append(OpenArc(block.line, fault.otherwise, centred))
                message += f"; {_IF_LATHE}" if self.two_axes else ""
            self.findings.report(fault.word, message)
        except CutterFault as fault:
            self.findings.report(min(block.at.values()), str(fault))
            self.cutter = self.state.actual = None  # what follows is read without compensation
        return block.m.get("stopping") in (20, 300)

    def _execute(self, block: Block) -> bool:
        """Execute one block; True if it ends the program."""
        if self.cutter is not None:
            self.check_unchanged(block)
        for setting in block.settings:
            if setting.name in OF_STATE:
                self.saved.take(setting, self.state, self.table, block.line)
            else:
                self.limits.take(setting, self.state, self.table, block.line, self.findings)
        self.check_offsets(block)
        self.state.numbers |= {c: block.value[c] for c in block.value.keys() & {"D", "H"}}
        assert self._words is not None
        printer = self.ignored.printer
        auxiliary.set_feed(self.state, block, self.findings, self._words.column, printer=printer)
        self._timed |= self.state.feed_mode == "inverse time"
        auxiliary.events(self.state, self.table, block, self.findings, printer=printer)
        if block.g.get("one-shot") == 40:
            auxiliary.dwell(self.state, self.table, block, self.ignored, self.findings)
        self._modes(block)
        before = self.state.position.copy()
        if not block.foreign:
            self._check_parked(block)
            if block.homing:
                self.go_to_switches(block)
            if block.homing and self.ignored.printer:  # ends their G92
                self.saved.homed(["XYZ".index(axis) for axis in block.homing], self.state)
            moves.take_polar(self.state, block)
            self._one_shot(block)
            self.table.keep_origin(self.state)
            self.execute_motion(block)
            if self.two_axes and self.state.motion in (2, 3) and self.state.normal == 2 and block.has("Z"):
                text = f"an arc with Z in the plane X/Y is a helix, though nothing moves Y; {_IF_LATHE}"
                self.findings.assume(text, block.line, block.motion_word())
            self.tool_point.check(self.state, block, before)
        stop = block.m.get("stopping")
        if stop is not None and self.cutter is not None:
            self.cutter.fix()
        if stop == 600:
            text = "a pallet change (M60) is a full stop; the axes are assumed to stand still"
            self.findings.assume(text, block.line, block.at["stopping"])
        if stop in (0, 10, 600):
            self.table.add_event("M", stop / 10, block.line)
        if stop in (0, 10, 600) or block.stops:
            self.table.add(Kind.STOP, block.line, self.state)
        if block.refused_motion:
            self.state.motion = REFUSED_MOTION
        return stop in (20, 300)

    def _modes(self, block: Block) -> None:
        state, g = self.state, block.g
        if "plane" in g:
            state.normal, state.plane_known = PLANES[g["plane"] // 10], True
        if "units" in g:
            state.unit = auxiliary.unit_of(g["units"])
            self._assume_units()
            self._units_known = True
        if "lathe diameter mode" in g:
            state.diameters = g["lathe diameter mode"] == 70
        if "cutter compensation" in g:
            self.switch(block)
        if "tool length" in g:
            offsets.set_tool_offset(state, block, self.findings)
        self.tool_point.take(state, self.table, block)
        if "work offset" in g:
            offsets.take_system(state, block, self.findings)
        if "path control" in g:
            auxiliary.path_control(state, block, self.ignored, self.findings)
        if "distance mode" in g:
            state.absolute = g["distance mode"] == 900
        if "arc centre mode" in g:
            state.absolute_centre = g["arc centre mode"] == 901
        if "retract mode" in g:
            state.to_level, state.retract_given = g["retract mode"] == 980, True
        state.apply_offsets()
        self.table.keep_origin(state)

    def _one_shot(self, block: Block) -> None:
        code = block.g.get("one-shot")
        if code is None or code in (40, 530):
            return
        motion, name = block.g.get("motion"), f"G{codes.number(code)}"
        if code in (280, 300) and motion == 0 and not self.state.strict:
            self.findings.note(f"the words beside G0 {name} are those of {name}", block.line)
        elif code in COVET_AXES and motion is not None:
            text = f"{name} and G{codes.number(motion)} both use the axis words of the line; write two lines"
            raise block.fault(text, "one-shot")
        if code in (280, 300):
            self.go_home(block)
        elif code in (281, 301):  # where the machine stands becomes the position of G28 or G30
            self.state.homes[code - 1] = self.state.position.copy()
        elif code == 100:
            offsets.set_data(self.state, block, self.findings)
        else:
            offsets.shift_origin(self.state, block)

    def _check_parked(self, block: Block) -> None:
        for letter in codes.PARKABLE:
            if letter in self.state.letters or letter not in block.value:
                continue
            if not self.ignored.may_stand(letter, block.value[letter], absolute=self.state.absolute):
                self.ignored.moved.add(letter)
                self.findings.report(block.at[letter], str(codes.LETTERS_REFUSED[letter]))
