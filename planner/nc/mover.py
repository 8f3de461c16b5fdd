"""Motion of blocks: G0 to G3, splines, drilling cycles and threads, G28 and G30, homing by switches, and the
words that switch cutter radius compensation (cutter.py) with what is refused while it is on."""

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import auxiliary, codes, drilling, moves, offsets, threads
from planner.nc.arcs import FULL_TURN, PLANES
from planner.nc.block_table import BlockTable
from planner.nc.cutter import Cutter
from planner.nc.faults import Findings, IgnoredWords
from planner.nc.moves import OFFSET_NUMBER, Block, WordFault, integer
from planner.nc.program import Kind
from planner.nc.splines import SplineReader, is_spline_line
from planner.nc.state import NO_MOTION, REFUSED_MOTION, SYSTEMS, State, tool_name

# Ten times G codes: which switch compensation off, to the left of the path, by a diameter on the line; and
# which are refused.
_OFF, _LEFT, _DYNAMIC = 400, (410, 411), (411, 421)
_REFUSED_GROUPS = ("plane", "work offset", "tool length", "path control", "retract mode")
_REFUSED_ONE_SHOTS = (280, 281, 300, 301, 520, 530, 920, 921, 922, 923)  # while it is on
# G10, G28, G30, G52 and G92, ten times: they use the axis words of their line, so that no motion code may
# stand beside them.
COVET_AXES = (100, 280, 300, 520, 920)
_WHY_NO_MOTION = {
    NO_MOTION: "an axis word while no motion code is in force; write G0, G1, G2 or G3 before it",
    REFUSED_MOTION: "an axis word under a motion code that is not supported",
}


def _refusal(name: str) -> str:
    return f"{name} while cutter radius compensation is on; write G40 before it"


class Mover:
    """Executes the motion of blocks: moves the state, and appends to the table of blocks."""

    state: State  # the modal state, and where the axes are
    table: BlockTable  # the blocks and events that have been made so far
    ignored: IgnoredWords
    findings: Findings
    feed_default: float | None  # of moves before the first F word [mm/s], or None
    splines: SplineReader
    cutter: Cutter | None = None
    before_cycles = NO_MOTION  # straight motion code that G80 leaves in force on Fanuc's controls

    def check_unchanged(self, block: Block) -> None:
        """Raise WordFault for words that must not stand in a block while compensation is on."""
        state = self.state
        for group in _REFUSED_GROUPS:
            code = block.g.get(group, -1)
            same = code == -1 or (group == "plane" and PLANES[code // 10] == state.normal)
            block.require(same, _refusal(f"G{codes.number(code)}"), group)
        one_shot = block.g.get("one-shot", -1)
        sets_system = one_shot == 100 and block.value.get("L") in (2.0, 20.0)
        number, in_force = round(block.value.get("P", 0.0)), state.system
        of_force = number == 0 or (in_force in SYSTEMS and SYSTEMS.index(in_force) + 1 == number)
        refused = one_shot in _REFUSED_ONE_SHOTS or (sets_system and of_force)
        block.require(not refused, _refusal(f"G{codes.number(one_shot)}"), "one-shot")
        if block.homing:
            raise WordFault(min(block.at.values(), default=0), _refusal("homing"))
        block.require("tool change" not in block.m, _refusal("M6"), "tool change")

    def check_offsets(self, block: Block) -> None:
        """Raise WordFault for a D or H alone that would bring another offset in on Fanuc's controls."""
        state, compensated = self.state, self.cutter is not None
        if not state.fanuc or {"cutter compensation", "tool length"} & block.g.keys():
            return
        for letter, code, on in (("H", "G43", state.tool_offset.any()), ("D", "G41 or G42", compensated)):
            number = block.idle.get(letter, block.value.get(letter))
            before = state.numbers.get(letter, number)
            if on and letter not in block.uses and number is not None and number != before:
                text = f"{letter}{number:g} while {letter}{before:g} is in force: the control takes its offset from here on"
                raise block.fault(f"{text}; write {code} beside it", letter)

    def switch(self, block: Block) -> None:
        """G40 to G42.1. Raises WordFault."""
        state, code, on = self.state, block.g["cutter compensation"], self.cutter
        if code == _OFF:
            if on is not None:
                on.fix()
                if not on.started:
                    state.actual = None
            self.cutter = None
            return
        name = f"G{codes.number(code)}"
        block.require(on is None, _refusal(name), "cutter compensation")
        text = f"{name} in the y z plane is not supported; write G17 or G18 before it"
        block.require(state.normal != 0, text, "cutter compensation")
        text = f"{name} in G18 while the work system is rotated is not supported"
        block.require(state.normal != 1 or not state.rotated, text, "cutter compensation")
        text = f"the edge orientation L of {name} is not supported; remove it and write the tool's path"
        block.require("L" not in block.value, text, "L")
        diameter = 0.0 if state.uncompensated else self._diameter(block, code)
        if diameter != 0.0:
            left, radius = (code in _LEFT) == (diameter > 0), abs(diameter) / 2.0
            self.cutter = Cutter(state, self.table, radius=radius, left=left, normal=state.normal)

    def _diameter(self, block: Block, code: int) -> float:
        """[mm]"""
        name = f"G{codes.number(code)}"
        if code in _DYNAMIC:
            text = f"{name} needs the tool's diameter as a D word"
            block.require("D" in block.value, text, "cutter compensation")
            return block.value["D"] * self.state.unit
        number = integer(block, "D", 0) if "D" in block.value else self.state.tool_loaded
        tool = self.state.tools.get(number)
        if tool is None or tool.diameter == 0.0:
            text = f"{tool_name(number)} has no diameter in the machine file: {name} does not move the path"
            self.findings.assume(text, block.line, block.at["cutter compensation"], grave=True)
        return 0.0 if tool is None else tool.diameter

    def go_home(self, block: Block) -> None:
        """All axes, or the block's (in its rotated system), go to the position of G28 or G30."""
        state, code = self.state, block.g["one-shot"]
        name = f"G{codes.number(code)}"
        if code not in state.homes:
            text = f"{name} has no position in the machine file: machine zero"
            self.findings.assume(text, block.line, block.at["one-shot"])
        else:
            offsets.assume_origin(state, name, block, self.findings)
        if state.actual is not None:  # cutter radius compensation ends here
            state.actual = None
            self.table.add(Kind.RAPID, block.line, state)
        home = state.homes.get(code, state.zeros())
        if not block.has(state.letters):
            state.position[:] = home
        else:
            state.position[:] = moves.target(state, block)
            self.table.add(Kind.RAPID, block.line, state)
            state.position[:] = _some_axes(state, block, home)
        self.table.add(Kind.RAPID, block.line, state)

    def go_to_switches(self, block: Block) -> None:
        """Homing ($H, bare G28 of 3-D printers): `block.homing` goes to the position of G28, or machine zero."""
        axes = ["XYZ".index(letter) for letter in block.homing]
        self.state.position[axes] = self.state.homes.get(280, np.zeros(3))[axes]
        self.table.add(Kind.RAPID, block.line, self.state)
        text = "homing is planned as a rapid to the machine's g28 position, or machine zero; the search for the switches is not"
        self.findings.assume(text, block.line)

    def execute_motion(self, block: Block) -> None:
        """Execute the motion of a block, if it has one. Raises WordFault, and CutterFault."""
        state, code = self.state, block.g.get("motion")
        if code is not None:  # stays in force, until another one or G80
            self.before_cycles = state.motion if state.motion in (0, 1) else self.before_cycles
            state.motion = code // 10 if code <= 30 else code
        elif "cycle end" in block.g:
            kept = state.motion if state.motion in (0, 1) else self.before_cycles
            state.motion, state.series = kept if state.fanuc else NO_MOTION, None
        if block.g.get("one-shot") in COVET_AXES:
            return
        if block.g.get("tool length") in (431, 432) and "motion" not in block.g:
            return  # the axis words are those of G43.1 or G43.2
        if block.g.get("one-shot") == 530:
            goes = state.motion in (0, 1) and (code is not None or block.has(state.letters))
            block.require(goes, "G53 goes with G0 or G1 only; write G53 G0 or G53 G1", "one-shot")
            text = "G53 goes with absolute coordinates only; write G90 before it"
            block.require(state.absolute, text, "one-shot")
            offsets.assume_origin(state, "G53", block, self.findings)
            if state.fanuc and state.motion == 1 and code is None:
                text = "G53 while G1 is in force is a rapid move, as Fanuc has it (Haas moves at F); write G0 or G1 beside it"
                self.findings.assume(text, block.line, block.at["one-shot"])
        if "H" in block.value and not state.strict and not {"H"} & (block.uses | moves.used_in_force(state)):
            self.ignored.count(OFFSET_NUMBER, f"H{block.value.pop('H'):g}", block.line)
        moves.check_words(state, block)
        if state.motion in codes.SPLINES or (self.splines.open and "motion" in block.g):
            self._spline(block)
        elif moves.is_move(state, block):
            self._move(block)
        else:
            text = f"G{codes.number(max(state.motion, 0))} needs an axis word: where it leads"
            block.require("motion" not in block.g or state.motion <= 3, text, "motion")

    def _move(self, block: Block) -> None:
        state = self.state
        block.require(state.motion >= 0, _WHY_NO_MOTION.get(state.motion, ""), state.letters)
        auxiliary.take_default(state, self.feed_default, block, self.findings, printer=self.ignored.printer)
        drills = state.motion in codes.CYCLES or (state.fanuc and state.motion == codes.THREADING)
        if not drills:
            state.series = None
        if state.in_thread and state.motion not in codes.THREADS:
            threads.stop(state, self.table, block.line)
        if self.cutter is not None:
            offsets.refuse(state, block, "under cutter radius compensation")
            # cycles and threads are not compensated
            block.require(state.motion <= 3, _refusal(f"G{codes.number(state.motion)}"))
        if state.motion > 3:
            offsets.refuse(state, block, "in a cycle or a thread")
        if state.motion in codes.THREADS:
            threads.thread(state, self.table, block, self.findings)
        elif state.motion == codes.THREADING and not drills:
            threads.cut_thread(state, self.table, block, self.findings)
        elif drills:
            auxiliary.check_feed(state, block)
            if auxiliary.on_surface(state):
                radius = float(moves.target(state, block)[0] - state.position[0]) + state.programmed()[0]
                state.feed = auxiliary.surface_feed(state, radius, block.motion_word())
            drilling.drill(state, self.table, block, self.findings)
        elif state.motion in (2, 3):
            self._arc(block)
        else:
            self._straight(block)

    def _straight(self, block: Block) -> None:
        state, cutter = self.state, self.cutter
        target = moves.target(state, block)
        fast = state.motion == 0 or (
            state.fanuc and block.g.get("one-shot") == 530 and "motion" not in block.g
        )
        kind = Kind.RAPID if fast else Kind.LINE
        surface = kind == Kind.LINE and auxiliary.on_surface(state)
        if kind == Kind.LINE:
            auxiliary.check_feed(state, block)
            if state.feed_mode == "inverse time":
                auxiliary.feed_of_time(state, block, offsets.length_moved(state, target), self.findings)
        if surface:
            offsets.refuse(state, block, "under a constant surface speed")
            radii = state.programmed()[0], float((target - state.position)[0]) + state.programmed()[0]
            state.feed = auxiliary.surface_feed(state, max(map(abs, radii)), block.motion_word())
        if cutter is not None:
            cutter.line(target, kind, block.line)
        elif surface:
            self._on_surface(block, target, *radii)
        else:
            state.position[:], state.actual = target, None
            self.table.add(kind, block.line, state)

    def _on_surface(self, block: Block, target: FloatArray, begin: float, end: float) -> None:
        """A straight move in parts, each with the feed of its larger radius."""
        state, start, at = self.state, self.state.place.copy(), begin
        parts = auxiliary.surface_parts(state, begin, end)
        for part in parts:
            there = begin + part * (end - begin)
            state.feed = auxiliary.surface_feed(state, max(abs(at), abs(there)), block.motion_word())
            state.position[:] = target if part == 1.0 else start + part * (target - start)
            state.actual, at = None, there
            self.table.add(Kind.LINE, block.line, state)

    def _arc(self, block: Block) -> None:
        state = self.state
        target = moves.target(state, block)
        auxiliary.check_feed(state, block)
        text = "the move after G40 must be straight; write G0 or G1 to where this arc begins"
        block.require(self.cutter is not None or state.actual is None, text)
        try:
            if not state.plane_known:
                state.plane_known = True
                text = "no G17, G18 or G19 before the first arc: G17; a Fanuc control starts with what is set in it"
                self.findings.assume(text, block.line, block.motion_word())
            text = "P of an arc is how often it turns here, more circles in Marlin, and nothing in Klipper; write them out"
            block.require(not self.ignored.printer or block.value.get("P", 1.0) <= 1.0, text, "P")
            arc, normal = moves.arc(state, block, target)
            length = moves.arc_length(state.position, target, arc, normal)
            if abs(arc.sweep) <= FULL_TURN:
                text = f"an arc of {length:.4g} mm hardly turns; some controls make a full circle of it"
                self.findings.assume(text, block.line, block.motion_word())
            if auxiliary.on_surface(state):
                centre = float((arc.centre - state.position)[0]) + state.programmed()[0]
                size = moves.arc_radius(state.position, arc, normal) if normal != 0 else 0.0
                state.feed = auxiliary.surface_feed(state, abs(centre) + size, block.motion_word())
            timed = moves.arc_radius(state.position, arc, normal) if state.fanuc else length
            auxiliary.feed_of_time(state, block, timed, self.findings)
            if self.cutter is not None:
                self.cutter.arc(target, arc, block.line)
        finally:
            state.position[:] = target
        if self.cutter is None:
            self.table.add_arc(arc, normal, block.line, state)

    def _spline(self, block: Block) -> None:
        """A line of a spline; the curve is a block of its first line."""
        state = self.state
        if not is_spline_line(block):
            return
        offsets.refuse(state, block, "on a spline")
        text = "a spline under cutter radius compensation; write G40 before it"
        block.require(self.cutter is None, text)
        text = "the move after G40 must be straight; write G0 or G1 to where this spline begins"
        block.require(state.actual is None, text)
        state.series = None
        if state.in_thread:
            threads.stop(state, self.table, block.line)
        found = self.splines.read(state, block, self.table.blocks)
        if found is None:
            return
        auxiliary.take_default(state, self.feed_default, block, self.findings, printer=self.ignored.printer)
        auxiliary.check_feed(state, block)
        (points, weights), line = found
        state.position[:3] = points[-1, -1]
        self.table.add_spline(points, weights, line, state)


def _some_axes(state: State, block: Block, home: FloatArray) -> FloatArray:
    """(A,) the position with the block's axes at home [mm]."""
    system, there = state.work_system(), state.position.copy()
    point, at_home = system.turn(there - system.origin, -1.0), system.turn(home - system.origin, -1.0)
    for axis, letter in enumerate(state.letters):
        if letter in block.value:
            there[axis], point[axis] = home[axis], at_home[axis]
    if state.rotated and block.has("XY"):
        there[:2] = (system.origin + system.turn(point))[:2]
    return there
