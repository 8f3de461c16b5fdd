"""Words that act before a block moves: spindle, tool, coolant, signals (M62 to M68) and other codes that a control passes on; dwells;
path control. Outputs are events; an input that is waited for is refused.
"""

from __future__ import annotations

import numpy as np

from planner.base.units import MILLISECOND
from planner.machine.parts import TOLERANCE_MIN
from planner.nc import codes
from planner.nc.block import Block, WordFault
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings
from planner.nc.ignored_words import IgnoredWords
from planner.nc.moves import integer
from planner.nc.program import Kind, PathControl
from planner.nc.state import State

# Ten times M codes: the one that reads an input, and the words that each needs.
_READ_INPUT = 660
_NEEDED = {620: "P", 630: "P", 640: "P", 650: "P", _READ_INPUT: "", 670: "EQ", 680: "EQ"}


def signal(table: BlockTable, block: Block) -> None:
    """Execute the block's code. Raises WordFault if a word is missing, or for an input that is waited for."""
    code = block.m["signals"]
    for letter in _NEEDED[code]:
        if letter not in block.value:
            raise block.fault(f"M{code // 10} needs the words {' and '.join(_NEEDED[code])}", "signals")
    if code == _READ_INPUT and block.value.get("L", 0.0) != 0.0:
        raise block.fault(
            "M66 waits for an input of the control, which only the machine knows; "
            "plan the parts before and after it",
            "signals",
        )
    table.add_event("M", code / 10, block.line)


# By ten times the G code.
_EXACT_PATH = 610
_PATH_CONTROLS = {_EXACT_PATH: PathControl.EXACT_PATH, 611: PathControl.EXACT_STOP, 640: PathControl.BLEND}
# Blocks that one line can give beyond one per line: stops beside threads, G28 through an intermediate point, a dwell, M6, M0. Cycles
# make room for themselves.
ROWS_AT_ONCE = 4
_LONG = 60.0  # a dwell of a minute is no usual one [s]
_SPINDLE = {30: 1, 40: -1, 50: 0}  # how it turns after M3, M4, M5


def events(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """Keep S, T and the codes that a control passes on, and what they set. Raises WordFault."""
    line = block.line
    if "S" in block.value:
        if block.value["S"] < 0:
            raise block.fault("a spindle speed must not be negative; write M4 to turn the other way", "S")
        table.add_event("S", block.value["S"], line)
        state.spindle.speed = block.value["S"]
    if "T" in block.value:
        state.tool_selected = integer(block, "T", 0)
        table.add_event("T", state.tool_selected, line)
    if "signals" in block.m:
        signal(table, block)
    if "tool number" in block.m:
        if "Q" not in block.value:
            raise block.fault("M61 needs the tool's number as a Q word", "tool number")
        state.tool_loaded = integer(block, "Q", 0)
    if "tool change" in block.m:
        state.tool_loaded = state.tool_selected
        table.add_event("M", 6.0, line)
        table.add(Kind.STOP, line, state)
        text = "a tool change is a full stop of the motion that moves nothing"
        if state.change_timed:
            findings.note(text, line)
        else:
            why = "it has no time, which [times] tool_change of the machine file gives"
            findings.assume(f"{text}; {why}", line, block.at["tool change"])
    table.make_room(len(block.events) + 3 * ROWS_AT_ONCE)  # a line may hold any number of them
    for letter, value in block.events:
        table.add_event(letter, value, line)
    for group in ("spindle", "spindle orientation", "coolant", "override"):
        if group in block.m:
            table.add_event("M", block.m[group] / 10, line)
    state.spindle.turning = _SPINDLE.get(block.m.get("spindle", -1), state.spindle.turning)
    if "spindle mode" in block.g:
        state.spindle.surface_speed = block.g["spindle mode"] == 960
        if state.spindle.surface_speed and "S" not in block.value:
            raise block.fault("G96 needs the surface speed as an S word", "spindle mode")
        state.spindle.speed_max = abs(block.value.get("D", 0.0))
    for code in block.g.values():
        if code in codes.G_EVENTS:
            table.add_event("G", code / 10, line)


def dwell(state: State, table: BlockTable, block: Block, ignored: IgnoredWords, findings: Findings) -> None:
    """G4. Raises WordFault."""
    seconds = block.value.get("P")
    if seconds is not None and ignored.printer:
        seconds *= MILLISECOND
        findings.note("G4 P is in milliseconds, as 3-D printers have it (M82, M83)", block.line)
    elif seconds is None and not ignored.strict and (ignored.printer or "S" in block.value):
        seconds = block.value.get("S", 0.0)
        findings.note("G4 S is in seconds, G4 alone a full stop, as 3-D printers have it", block.line)
    if seconds is None or seconds < 0:
        word = block.at["one-shot"] if seconds is None else block.at["P"]
        raise WordFault(word, "a dwell needs its seconds as a P word that is not negative, such as G4 P0.5")
    assume_seconds(state, block, seconds if "P" in block.value and not ignored.printer else 0.0, findings)
    table.add_dwell(seconds, block.line, state)


def assume_seconds(state: State, block: Block, seconds: float, findings: Findings) -> None:
    """Say it if a dwell is so long that its P is most likely in another unit."""
    if seconds >= _LONG and not state.seconds_meant:
        text = f"a dwell of {seconds:g} s: P is read in seconds, as LinuxCNC and grbl have it; Fanuc's is in ms: --dialect fanuc"
        findings.assume(text, block.line, block.at.get("P", block.motion_word()))


def assume_rapids(table: BlockTable, ignored: IgnoredWords, findings: Findings) -> None:
    """Say it if G0 of a printer, which runs it at F, is planned as a rapid."""
    rapid = table.block.kind[: table.blocks] == Kind.RAPID
    if ignored.printer and rapid.any():
        text = "G0 is planned at the limits of the axes; 3-D printers run it at F"
        findings.assume(text, int(table.block.line[rapid.argmax()]))


def path_control(state: State, block: Block, ignored: IgnoredWords, findings: Findings) -> None:
    """G61, G61.1 and G64 with its tolerance. Raises WordFault, for Marlin's G61 too."""
    word = block.at["path control"]
    if block.g["path control"] == _EXACT_PATH and ignored.printer:
        raise WordFault(
            word, "G61 of 3-D printers goes back to a position that the control has saved; write G1 to it"
        )
    if (
        block.g["path control"] == _EXACT_PATH
        and "S" in block.value
        and not block.m
        and "motion" not in block.g
    ):
        text = "G61 with S is exact path and the spindle's speed; in Marlin it goes back to a saved position"
        findings.assume(text, block.line, word)
    state.path_control, state.tolerance = _PATH_CONTROLS[block.g["path control"]], np.nan
    if "P" in block.value and block.g["path control"] == 640:
        tolerance = block.value["P"]
        if tolerance < 0:
            raise block.fault("a tolerance must not be negative; write G64 P0.05", "P")
        if tolerance > 0 and tolerance * state.unit < TOLERANCE_MIN:
            raise block.fault(
                f"a tolerance must not be below {TOLERANCE_MIN:g} mm; write G64 P0.05, or G61 for the path itself",
                "P",
            )
        if tolerance > 0:
            state.tolerance = tolerance * state.unit
        else:
            findings.note("G64 P0 gives no tolerance; the machine's holds", block.line)
    if "Q" in block.value:
        findings.note("G64 Q is not used: the tolerance of P bounds every deviation", block.line)
