"""Codes that set offsets: G10, G43 to G49, G52, G92 to G92.3, G28.1 and G30.1; none of them moves anything.
And the length that F counts of a move.

With q the position in a work system before G92 is taken off (state.py), a coordinate x is

    x = q - G92 offset,      q = R^-1 (position - origin - tool offset)

and "the place where the machine stands gets the coordinate x" is solved for the offset in question: G92 for
the G92 offset, G10 L20 for the system's origin, G10 L10 for the tool's. G52 gives the G92 offset itself. G10
takes coordinates as absolute, whatever G90 and G91 say. Fanuc's and Haas' G10 L20 P gives the origin of G54.1
P; what would add after G91 is refused: the flat program (writer.py) could not say it.

Axes beside x, y and z are joints without rotation of the work system and tool offsets.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import codes
from planner.nc.faults import Findings
from planner.nc.moves import Block, coordinate, integer
from planner.nc.state import (
    FURTHER_MAX,
    FURTHER_SYSTEMS,
    SYSTEMS,
    State,
    System,
    Tool,
    system_name,
    tool_name,
)

_OF_HAAS, _G154 = 1100, 1540  # G110, the first of G110 to G129, which are G154 P1 to P20; and G154
_DATA = (3, 50, 52)  # tool life, parameters of the control; to G11
NO_G54 = "G54 has no offset"
_FANUC_TOOLS = (10, 11, 12, 13)
_FANUC_SYSTEMS = 6  # G54 to G59
_FIXTURE = 593  # the system of G10 L11


def refuse(state: State, block: Block, where: str) -> None:
    """Raise WordFault for a further axis in a place that does not know them."""
    letter = next((c for c in block.at if c in state.others and c in block.value), "")
    text = f"{letter} {where} is not supported; x, y and z are: write {letter} on a line of its own"
    block.require(not letter, text, letter)


def length_moved(state: State, target: FloatArray) -> float:
    """The length of a straight move to `target` (A,) that F and inverse time go by [mm; where only rotary axes
    move, degrees times the programmed unit]."""
    moved, turns = target - state.position, state.turns
    for part in (moved[:3], moved[3:][~turns[3:]]):
        if part.any():
            return float(np.linalg.norm(part))
    return float(np.linalg.norm(moved[turns])) * state.unit


def set_tool_offset(state: State, block: Block, findings: Findings) -> None:
    """G43, G43.1, G43.2, G43.4, G49. Raises WordFault for words that contradict each other."""
    code, lengths = block.g["tool length"], block.has("XYZ")
    if code in (431, 432) and "motion" not in block.g:
        refuse(state, block, "of a tool offset")
    if code == 490:
        state.tool_offset = state.zeros()
    elif code == 431:
        state.tool_offset = _given(state, block, state.tool_offset, "XYZ")
    elif code in (430, 434) or "H" in block.value:
        text = "G43.2 adds a tool (H) or lengths (X Y Z), not both; write two lines"
        block.require(code != 432 or not lengths, text, "H")
        tool = integer(block, "H", 0) if "H" in block.value else state.tool_loaded
        offset = _offset_of(state, tool, block, findings)
        state.tool_offset = state.tool_offset + offset if code == 432 else offset
    else:
        block.require(lengths, "G43.2 needs a tool as an H word, or lengths as X, Y and Z", "tool length")
        state.tool_offset = state.tool_offset + _given(state, block, state.zeros(), "XYZ")


def take_system(state: State, block: Block, findings: Findings) -> None:
    """G54 to G59.3 and G54.1: the work system from here on. Raises WordFault for G54.1 without a valid P."""
    code = block.g["work offset"]
    unknown = str(codes.unknown("G", code, strict=True))
    block.require(code < _OF_HAAS or not state.strict, unknown, "work offset")
    if code in (541, _G154):
        number = integer(block, "P", 1) if "P" in block.value else 0
        text = f"G{codes.number(code)} needs its work system as P1 to P{FURTHER_MAX}"
        block.require(1 <= number <= FURTHER_MAX, text, "P" if "P" in block.at else "work offset")
        code = FURTHER_SYSTEMS + number
    elif code >= _OF_HAAS:
        code = FURTHER_SYSTEMS + (code - _OF_HAAS) // 10 + 1
    state.system = code
    if state.system not in state.systems and state.system != 540:
        text = f"{system_name(state.system)} has no offset in the machine file: 0"
        findings.assume(text, block.line, block.at["work offset"], grave=True)


def assume_origin(state: State, what: str, block: Block, findings: Findings) -> None:
    """Say that `what` goes by machine coordinates where those of G54 are not known."""
    if state.system == 540 and 540 not in state.systems:
        text = f"{what} is in machine coordinates, and {NO_G54} in the machine file: 0"
        findings.assume(text, block.line, block.at["one-shot"], grave=True)


def shift_origin(state: State, block: Block) -> None:
    """G92 gives the place the coordinates, G52 gives the offset; G92.1 and G92.2 take it back, G92.3 brings
    it again. Raises WordFault for a G52 or G92 without X, Y and Z."""
    code = block.g["one-shot"]
    if code in (520, 920):
        what = "the coordinates to give to this place" if code == 920 else "the offsets to set"
        text = f"G{codes.number(code)} needs at least one of X, Y and Z: {what}"
        block.require(block.has(state.letters), text, "one-shot")
        here = state.in_system()
        for axis in _axes(block, state.letters):
            length = coordinate(state, block, axis)
            state.g92[axis] = length if code == 520 else here[axis] - length
        state.g92_saved = state.g92.copy()
    else:
        state.g92 = state.g92_saved.copy() if code == 923 else state.zeros()
        if code == 921:
            state.g92_saved = state.zeros()
    state.apply_offsets()


def set_data(state: State, block: Block, findings: Findings) -> None:
    """G10. Raises WordFault for words that are missing or not used."""
    kind = integer(block, "L", 0) if "L" in block.value else -1
    if kind in (2, 20):
        _set_system(state, block, kind)
        state.apply_offsets()
    elif state.fanuc and kind in _FANUC_TOOLS:
        _set_fanuc_tool(state, block, kind, findings)
    elif kind in (1, 10, 11):
        _set_tool(state, block, kind, findings)
    elif state.fanuc and kind in _DATA:
        state.entering = True
        findings.assume(f"G10 L{kind} to G11 writes data of the control, which are not followed", block.line)
    else:
        needed = "G10 needs L1, L10 or L11 to set a tool, or L2 or L20 to set a work system; write one"
        raise block.fault(needed, "L" if kind >= 0 else "one-shot")


def _set_system(state: State, block: Block, kind: int) -> None:
    """G10 L2 and L20 P1 to P9, P0 for the system in force; of Fanuc L2 P1 to P6, and L20 P1 to P300 for G54.1."""
    number = integer(block, "P", 0) if "P" in block.value else -1
    last = len(SYSTEMS) if not state.fanuc else FURTHER_MAX if kind == 20 else _FANUC_SYSTEMS
    needed = f"G10 L{kind} needs its work system as P0 (the one in force) or P1 to P{last}"
    if state.fanuc:
        external = "; P0, the external offset, is not read" if number == 0 else ""
        needed = f"G10 L{kind} of Fanuc needs its work system as P1 to P{last}{external}"
    block.require((1 if state.fanuc else 0) <= number <= last, needed, "P" if number >= 0 else "one-shot")
    further = state.fanuc and kind == 20
    code = FURTHER_SYSTEMS + number if further else SYSTEMS[number - 1] if number else state.system
    system = state.work_system(code)
    for letter in "IJQ" if kind == 2 and not state.fanuc else "IJQR":
        block.require(letter not in block.value, f"G10 L{kind} does not use {letter}; remove it", letter)
    text = f"G10 L{kind} of Fanuc adds after G91; write G90 before it"
    block.require(state.absolute or not state.fanuc, text, "one-shot")
    if kind == 2 or state.fanuc:
        system = System(_given(state, block, system.origin), block.value.get("R", system.rotation))
    else:
        wanted = _given(state, block, state.in_system(code) - state.g92) + state.g92
        system = replace(system, origin=state.position - state.tool_offset - system.turn(wanted))
    state.systems[code] = system


def _set_tool(state: State, block: Block, kind: int, findings: Findings) -> None:
    refuse(state, block, "of a tool offset")
    block.require("P" in block.value, f"G10 L{kind} needs its tool as a P word", "one-shot")
    number = integer(block, "P", 1)
    tool = state.tools.get(number) or Tool(state.zeros())
    for letter in "IJQ":
        if letter in block.value:
            text = f"{letter} of G10 L{kind} is not used: nothing asks for a tool's angles and edge"
            findings.note(text, block.line)
    offset = _given(state, block, tool.offset) if kind == 1 else _offset_from_place(state, block, tool, kind)
    diameter = 2.0 * block.value["R"] * state.unit if "R" in block.value else tool.diameter
    state.tools[number] = Tool(offset, diameter)


def _set_fanuc_tool(state: State, block: Block, kind: int, findings: Findings) -> None:
    """G10 L10 to L13 P R of Fanuc and Haas: a length, its wear, a radius, its wear."""
    text = f"G10 L{kind} needs its tool as a P word, and a length or radius as R"
    block.require("P" in block.value and "R" in block.value, text, "one-shot")
    number, size = integer(block, "P", 1), block.value["R"] * state.unit
    tool = state.tools.get(number) or Tool(state.zeros())
    if kind in (10, 11):
        offset = tool.offset.copy()
        offset[2] = size + (offset[2] if kind == 11 else 0.0)
        state.tools[number] = Tool(offset, tool.diameter)
    else:
        text = f"R of G10 L{kind} is a radius, as Fanuc has it; Haas has a setting for diameters"
        findings.assume(text, block.line, block.at["R"])
        state.tools[number] = Tool(tool.offset, 2.0 * size + (tool.diameter if kind == 13 else 0.0))


def _offset_from_place(state: State, block: Block, tool: Tool, kind: int) -> FloatArray:
    """(A,) tool offset [mm] for the block's coordinates, in force (L10) or in G59.3 without G92 (L11)."""
    system = state.work_system(_FIXTURE if kind == 11 else 0)
    place = system.turn(state.position - system.origin, -1.0)
    if kind == 10:
        place = place - state.g92
    offset = np.array(system.turn(tool.offset, -1.0))
    for axis in _axes(block, "XYZ"):
        offset[axis] = place[axis] - coordinate(state, block, axis)
    return system.turn(offset)


def _offset_of(state: State, number: int, block: Block, findings: Findings) -> FloatArray:
    tool = state.tools.get(number)
    if tool is None and number != 0:
        text = f"{tool_name(number)} has no length in the machine file: 0"
        findings.assume(text, block.line, block.at["tool length"])
    return state.zeros() if tool is None else tool.offset.copy()


def _axes(block: Block, letters: str) -> list[int]:
    return [axis for axis, letter in enumerate(letters) if letter in block.value]


def _given(state: State, block: Block, others: FloatArray, letters: str = "") -> FloatArray:
    """(A,) the block's coordinates of axes with these letters, or all, and `others` where it has none [mm]."""
    lengths = others.copy()
    for axis in _axes(block, letters or state.letters):
        lengths[axis] = coordinate(state, block, axis)
    return lengths
