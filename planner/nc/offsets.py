"""Codes that set offsets: G10, G43 to G49, G52, G92 to G92.3, G28.1 and G30.1; none of them moves anything.
And the coordinates of axes beside x, y and z.

With q the position in a work system before G92 is taken off (state.py), a coordinate x is

    x = q - G92 offset,      q = R^-1 (position - origin - tool offset)

and "the place where the machine stands gets the coordinate x" is solved for the offset in question: G92 for
the G92 offset, G10 L20 for the system's origin, G10 L10 for the tool's. G52 gives the G92 offset itself. G10
takes coordinates as absolute, whatever G90 and G91 say. Fanuc's and Haas' G10 L20 P gives the origin of G54.1
P; what would add after G91 is refused: the flat program (language/flat.py) could not say it.

Axes beside x, y and z, rotary A B C in degrees and linear U V W in mm, are joints without rotation of the
work system and tool offsets. F is the speed of x, y and z together if one of them moves, else of u, v and w,
else of the rotary axes. A wrapped rotary axis (LinuxCNC's WRAPPED_ROTARY) goes to the absolute place within a
turn, forwards unless the number has a minus (rs274ngc/interp_find.cc, find_ends and unwrap_rotary).
"""

import math
from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import codes
from planner.nc.faults import Findings
from planner.nc.moves import Block, WordFault, coordinate, integer
from planner.nc.state import (
    FURTHER_MAX,
    FURTHER_SYSTEMS,
    LETTERS,
    ROTARY,
    SYSTEMS,
    State,
    System,
    Tool,
    system_name,
)

_TURN = 360.0  # degrees
_FIXTURE = 593  # the system of G10 L11


def _zeros() -> FloatArray:
    return np.zeros(len(LETTERS))


def refuse(state: State, block: Block, where: str) -> None:
    """Raise WordFault for a further axis in a place that does not know them."""
    if block.has(state.further.letters):
        word = block.first_of(state.further.letters)
        letter = next(c for c in state.further.letters if block.at.get(c) == word)
        text = f"{letter} {where} is not supported; x, y and z are: write {letter} on a line of its own"
        raise WordFault(word, text)


def move(state: State, block: Block) -> None:
    """Move the further axes to the block's places. Raises WordFault for a wrapped axis beyond a turn."""
    further = state.further
    in_machine = block.g.get("one-shot") == 530
    offset = _zeros() if in_machine else further.offset(state.system)
    for column in further.columns:
        letter = LETTERS[column]
        if letter not in block.value:
            continue
        value, here = block.value[letter] * scale(state, column), float(further.position[column])
        if not state.absolute and not in_machine:
            further.position[column] = here + value
        elif letter in further.wrapped:
            if abs(value) >= _TURN:
                text = f"axis {letter} is wrapped: its places are above -360 and below 360 degrees"
                raise WordFault(block.at[letter], text)
            zero = further.offset(state.system)[column]
            place = abs(value - zero if in_machine else value)
            further.position[column] = _unwrapped(math.copysign(place, value), here - zero) + zero
        else:
            further.position[column] = value + offset[column]


def _unwrapped(value: float, here: float) -> float:
    """The place `value` [degrees] within a turn, ahead of `here` in the direction of its sign."""
    place = abs(value) + math.floor(here / _TURN) * _TURN
    forwards = math.copysign(1.0, value) > 0
    if forwards and place < here:
        return place + _TURN
    return place - _TURN if not forwards and place > here else place


def scale(state: State, column: int) -> float:
    """Degrees or mm of a programmed unit."""
    return 1.0 if column < ROTARY else state.unit


def shift_extra_axes(state: State, block: Block, code: int) -> None:
    """G52 and G92 with words of further axes, and G92.1 to G92.3 for all of them."""
    further = state.further
    if code not in (520, 920):
        further.g92 = further.g92_saved.copy() if code == 923 else _zeros()
        if code == 921:
            further.g92_saved = _zeros()
        return
    origin = further.origins.get(state.system, _zeros())
    for column in further.columns:
        letter = LETTERS[column]
        if letter in block.value:
            value = block.value[letter] * scale(state, column)
            further.g92[column] = value if code == 520 else further.position[column] - origin[column] - value
    further.g92_saved = further.g92.copy()


def set_system(state: State, block: Block, code: int, *, from_place: bool) -> None:
    """G10 L2 (`from_place` False) and L20: the origin of a work system."""
    further = state.further
    origin = further.origins.get(code, _zeros()).copy()
    for column in further.columns:
        letter = LETTERS[column]
        if letter in block.value:
            value = block.value[letter] * scale(state, column)
            origin[column] = further.position[column] - further.g92[column] - value if from_place else value
    further.origins[code] = origin


def go_home(state: State, block: Block, code: int, *, everything: bool) -> None:
    """The further axes of the block, or all, go to the position of G28 or G30."""
    further = state.further
    home = further.homes.get(code, _zeros())
    for column in further.columns:
        if everything or LETTERS[column] in block.value:
            further.position[column] = home[column]


def length_moved(state: State, start: FloatArray, xyz: float) -> float:
    """The length that F and inverse time go by [mm; where only rotary axes move, degrees times the programmed
    unit].

    start : (6,) of the further axes before the move;  xyz : length of the path of x, y and z [mm]
    """
    if xyz > 0.0 or not state.further.letters:
        return xyz
    moved = state.further.position - start
    parallel = float(np.linalg.norm(moved[ROTARY:]))
    return parallel if parallel > 0.0 else float(np.linalg.norm(moved[:ROTARY])) * state.unit


def set_tool_offset(state: State, block: Block, findings: Findings) -> None:
    """G43, G43.1, G43.2, G43.4, G49. Raises WordFault for words that contradict each other."""
    code = block.g["tool length"]
    if code in (431, 432) and "motion" not in block.g:
        refuse(state, block, "of a tool offset")
    if code == 490:
        state.tool_offset = np.zeros(3)
    elif code == 431:
        state.tool_offset = _given(state, block, state.tool_offset)
    elif code in (430, 434):
        tool = integer(block, "H", 0) if "H" in block.value else state.tool_loaded
        state.tool_offset = _offset_of(state, tool, block, findings)
    elif "H" in block.value:
        if block.has("XYZ"):
            raise block.fault("G43.2 adds a tool (H) or lengths (X Y Z), not both; write two lines", "H")
        state.tool_offset = state.tool_offset + _offset_of(state, integer(block, "H", 0), block, findings)
    elif block.has("XYZ"):
        state.tool_offset = state.tool_offset + _given(state, block, np.zeros(3))
    else:
        raise block.fault("G43.2 needs a tool as an H word, or lengths as X, Y and Z", "tool length")


def take_system(state: State, block: Block, findings: Findings) -> None:
    """G54 to G59.3 and G54.1: the work system from here on. Raises WordFault for G54.1 without a valid P."""
    code = block.g["work offset"]
    if code == 541:
        number = integer(block, "P", 1) if "P" in block.value else 0
        if not 1 <= number <= FURTHER_MAX:
            at = "P" if "P" in block.at else "work offset"
            raise block.fault(f"G54.1 needs its work system as P1 to P{FURTHER_MAX}", at)
        code = FURTHER_SYSTEMS + number
    state.system = code
    if state.system not in state.systems and state.system != 540:
        text = f"{system_name(state.system)} has no offset in the machine file: 0"
        findings.assume(text, block.line, block.at["work offset"])


def assume_origin(state: State, what: str, block: Block, findings: Findings) -> None:
    """Say that `what` goes by machine coordinates where those of G54 are not known."""
    if state.system == 540 and 540 not in state.systems:
        text = f"{what} is in machine coordinates, and G54 has no offset in the machine file: 0"
        findings.assume(text, block.line, block.at["one-shot"])


def shift_origin(state: State, block: Block) -> None:
    """G92 gives the place the coordinates, G52 gives the offset; G92.1 and G92.2 take it back, G92.3 brings
    it again. Raises WordFault for a G52 or G92 without X, Y and Z."""
    code = block.g["one-shot"]
    if code in (520, 920):
        if not block.has(state.letters):
            what = "the coordinates to give to this place" if code == 920 else "the offsets to set"
            raise block.fault(f"G{codes.number(code)} needs at least one of X, Y and Z: {what}", "one-shot")
        here = state.in_system()
        for axis in _axes(block):
            length = coordinate(state, block, axis)
            state.g92[axis] = length if code == 520 else here[axis] - length
        state.g92_saved = state.g92.copy()
    else:
        state.g92 = state.g92_saved.copy() if code == 923 else np.zeros(3)
        if code == 921:
            state.g92_saved = np.zeros(3)
    shift_extra_axes(state, block, code)
    state.apply_offsets()


def set_data(state: State, block: Block, findings: Findings) -> None:
    """G10. Raises WordFault for words that are missing or not used."""
    kind = integer(block, "L", 0) if "L" in block.value else -1
    if kind in (2, 20):
        _set_system(state, block, kind)
        state.apply_offsets()
    elif kind in (1, 10, 11):
        _set_tool(state, block, kind, findings)
    else:
        needed = (
            "G10 needs L1, L10 or L11 to set a tool, or L2 or L20 to set a work system; write one of them"
        )
        raise block.fault(needed, "L" if kind >= 0 else "one-shot")


def _refuse_words(block: Block, kind: int, letters: str) -> None:
    for letter in letters:
        if letter in block.value:
            raise block.fault(f"G10 L{kind} does not use {letter}; remove it", letter)


def _set_system(state: State, block: Block, kind: int) -> None:
    if state.fanuc:
        _set_fanuc_system(state, block, kind)
        return
    number = integer(block, "P", 0) if "P" in block.value else -1
    if not 0 <= number <= len(SYSTEMS):
        needed = f"G10 L{kind} needs its work system as P0 (the one in force) or P1 to P9"
        raise block.fault(needed, "P" if number >= 0 else "one-shot")
    code = SYSTEMS[number - 1] if number else state.system
    system = state.work_system(code)
    _refuse_words(block, kind, "IJQ" if kind == 2 else "IJQR")
    if kind == 2:
        system = System(_given(state, block, system.origin), block.value.get("R", system.rotation))
    else:
        wanted = _given(state, block, state.in_system(code) - state.g92) + state.g92
        system = replace(system, origin=state.position - state.tool_offset - system.turn(wanted))
    state.systems[code] = system
    set_system(state, block, code, from_place=kind == 20)


def _set_fanuc_system(state: State, block: Block, kind: int) -> None:
    """G10 L2 P1 to P6, and G10 L20 P1 to P300 for G54.1."""
    number, most = integer(block, "P", 0) if "P" in block.value else -1, FURTHER_MAX if kind == 20 else 6
    if not 1 <= number <= most:
        external = "; P0, the external offset, is not read" if number == 0 else ""
        needed = f"G10 L{kind} of Fanuc needs its work system as P1 to P{most}{external}"
        raise block.fault(needed, "P" if number >= 0 else "one-shot")
    _refuse_words(block, kind, "IJQR")
    if not state.absolute:
        raise block.fault(f"G10 L{kind} of Fanuc adds after G91; write G90 before it", "one-shot")
    code = FURTHER_SYSTEMS + number if kind == 20 else SYSTEMS[number - 1]
    system = state.work_system(code)
    state.systems[code] = replace(system, origin=_given(state, block, system.origin))
    set_system(state, block, code, from_place=False)


def _set_tool(state: State, block: Block, kind: int, findings: Findings) -> None:
    refuse(state, block, "of a tool offset")
    if "P" not in block.value:
        raise block.fault(f"G10 L{kind} needs its tool as a P word", "one-shot")
    number = integer(block, "P", 1)
    tool = state.tools.get(number) or Tool(np.zeros(3))
    for letter in "IJQ":
        if letter in block.value:
            text = f"{letter} of G10 L{kind} is not used: nothing asks for a tool's angles and edge"
            findings.note(text, block.line)
    offset = _given(state, block, tool.offset) if kind == 1 else _offset_from_place(state, block, tool, kind)
    diameter = 2.0 * block.value["R"] * state.unit if "R" in block.value else tool.diameter
    state.tools[number] = Tool(offset, diameter)


def _offset_from_place(state: State, block: Block, tool: Tool, kind: int) -> FloatArray:
    """(3,) tool offset [mm] for the block's coordinates, in force (L10) or in G59.3 without G92 (L11)."""
    system = state.work_system(_FIXTURE if kind == 11 else 0)
    place = system.turn(state.position - system.origin, -1.0)
    if kind == 10:
        place = place - state.g92
    offset = np.array(system.turn(tool.offset, -1.0))
    for axis in _axes(block):
        offset[axis] = place[axis] - coordinate(state, block, axis)
    return system.turn(offset)


def _offset_of(state: State, number: int, block: Block, findings: Findings) -> FloatArray:
    if number not in state.tools and number != 0:
        text = f"tool {number} has no length in the machine file: 0"
        findings.assume(text, block.line, block.at["tool length"])
    return state.tools[number].offset.copy() if number in state.tools else np.zeros(3)


def _axes(block: Block) -> list[int]:
    return [axis for axis, letter in enumerate("XYZ") if letter in block.value]


def _given(state: State, block: Block, others: FloatArray) -> FloatArray:
    """(3,) the block's lengths [mm], and `others` where it has none."""
    lengths = others.copy()
    for axis in _axes(block):
        lengths[axis] = coordinate(state, block, axis)
    return lengths
