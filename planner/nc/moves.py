"""Where a block's words lead: end points, centres, arcs, and what G53 and the arc words ask of the state.

A coordinate is absolute (G90: plus the offsets), relative to the last position (G91) or a machine coordinate (G53). I J K are
relative to the start (G91.1), or absolute like the coordinates of G90 (G90.1), whatever G90 and G91 say.
"""

from __future__ import annotations

from planner.base.arrays import FloatArray
from planner.nc import codes
from planner.nc.arcs import AXES, IN_PLANE, Arc, ArcError, arc_from_centre, arc_from_radius, closes
from planner.nc.block import Block
from planner.nc.state import REFUSED_MOTION, State

_ROUNDING = {"T": 1e-4, "H": 1e-4, "P": 1e-3}  # what RS274NGC rounds away from a whole number


class WordFault(Exception):
    """The line cannot be executed further; carries the index of the word and the message."""

    def __init__(self, word: int, message: str):
        super().__init__(message)
        self.word, self.message = word, message


def is_move(state: State, block: Block) -> bool:
    """Whether the block moves. A motion code alone does not, except for an arc, which then lacks its words."""
    arc = state.motion in (2, 3) and ("motion" in block.g or block.has("IJKR"))
    return arc or block.has("XYZ")


def target(state: State, block: Block) -> FloatArray:
    """Where the block's axis words lead, (3,) in machine coordinates [mm]."""
    end = state.position.copy()
    for axis, letter in enumerate("XYZ"):
        if letter in block.value:
            length = block.value[letter] * state.unit
            if block.g.get("one-shot") == 530:
                end[axis] = length
            else:
                end[axis] = length + (state.offset[axis] if state.absolute else end[axis])
    return end


def arc(state: State, block: Block, end: FloatArray) -> Arc:
    """The arc of a block to `end` (3,) [mm]. Raises WordFault if its words are missing or contradict each other."""
    try:
        return _arc(state, block, end)
    except ArcError as fault:
        raise WordFault(block.motion_word(), str(fault)) from fault


def _arc(state: State, block: Block, end: FloatArray) -> Arc:
    start, normal, unit, clockwise = state.position, state.normal, state.unit, state.motion == 2
    a, b = IN_PLANE[normal]
    plane = f"{AXES[a]} {AXES[b]}"
    turns = integer(block, "P", 1) if "P" in block.value and block.g.get("one-shot") != 40 else 1
    if "IJK"[normal] in block.value:
        raise ArcError(
            f"{'IJK'[normal]} in the {plane} plane; write G17, G18 or G19 for the centre's plane before it"
        )
    if "R" in block.value:
        if block.has("IJK"):
            raise ArcError("R and I J K on one line both define the centre; write one of them")
        if not block.has("XYZ"[a] + "XYZ"[b]):
            raise ArcError(f"an arc with R needs an end point in the {plane} plane")
        radius = block.value["R"] * unit
        return arc_from_radius(start, end, radius, normal=normal, clockwise=clockwise, turns=turns, unit=unit)
    if not block.has("IJK"):
        raise ArcError(f"an arc needs a centre or a radius; write {'IJK'[a]} and {'IJK'[b]}, or R")
    centre = _centre(state, block, absolute=state.absolute_centre)
    try:
        return arc_from_centre(start, end, centre, normal=normal, clockwise=clockwise, turns=turns, unit=unit)
    except ArcError as fault:
        raise ArcError(f"{fault}; {_remedy(state, block, end)}") from fault


def _centre(state: State, block: Block, *, absolute: bool) -> FloatArray:
    centre = state.position.copy()
    for axis in IN_PLANE[state.normal]:
        letter = "IJK"[axis]
        if letter in block.value:
            length = block.value[letter] * state.unit
            centre[axis] = length + (state.offset[axis] if absolute else centre[axis])
        elif absolute:
            raise ArcError(f"{letter} is missing; with absolute centres (G90.1) both are needed")
    return centre


def _remedy(state: State, block: Block, end: FloatArray) -> str:
    """Whether I J K are meant the other way: many programs have absolute centres and do not say so."""
    try:
        other = _centre(state, block, absolute=not state.absolute_centre)
    except ArcError:
        return "correct the centre or the end point"
    if not closes(state.position, end, other, normal=state.normal, unit=state.unit):
        return "correct the centre or the end point"
    way = "incremental: write G91.1" if state.absolute_centre else "absolute: write G90.1"
    return f"the arc would close if its centre were {way} before it"


def check_machine_coordinates(state: State, block: Block) -> None:
    """G53 goes with G0 and G1, and with absolute coordinates. Raises WordFault."""
    if state.motion not in (0, 1) or not ("motion" in block.g or block.has("XYZ")):
        raise WordFault(block.at["one-shot"], "G53 goes with G0 or G1 only; write G53 G0 or G53 G1")
    if not state.absolute:
        raise WordFault(block.at["one-shot"], "G53 goes with absolute coordinates only; write G90 before it")


def check_no_arc_words(state: State, block: Block) -> None:
    """I J K R, and a P that no G4 or G64 uses, need an arc. Raises WordFault."""
    taken = block.g.get("one-shot") == 40 or block.g.get("path control") == 640
    for letter in "IJKRL" if taken else "IJKRLPQ":
        if letter in block.value and state.motion != REFUSED_MOTION and not block.partial:
            raise WordFault(
                block.at[letter], str(codes.LETTERS_REFUSED["L"]) if letter == "L" else unused(letter)
            )


def unused(letter: str) -> str:
    """What is said of a word that no code of its block uses."""
    return f"{letter} word without {codes.LETTER_NEEDS[letter]}, which would use it; remove it"


def integer(block: Block, letter: str, least: int) -> int:
    """A word's whole number. Raises WordFault if it is none or less than `least`."""
    value = block.value[letter]
    whole = round(value)
    if abs(value - whole) > _ROUNDING[letter] or whole < least:
        raise WordFault(block.at[letter], f"{letter} must be a whole number, {least} or more")
    return whole
