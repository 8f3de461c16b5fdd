"""A line of a program, as codes by modal group and words by letter, and where its words lead.

A wrapped rotary axis (LinuxCNC's WRAPPED_ROTARY) goes to the absolute place within a turn, forwards unless the
number has a minus (rs274ngc/interp_find.cc, find_ends and unwrap_rotary). I, K and R stay radii in diameter mode
(G7). An arc in G18 or G19 lies in a plane of two axes only if the rotation of the work system is a quarter turn;
other angles are refused there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import arcs, codes
from planner.nc.settings import Setting
from planner.nc.state import DEGREES, REFUSED_MOTION, State

# The largest number of a word: lengths beyond 1e9 mm have lost the micrometre in double precision and are
# certainly a mistake.
NUMBER_MAX = 1e9
_NUMBER = "number{|s} of {an offset|offsets} (D, H) without a code that uses {it|them}"
OFFSET_NUMBER = codes.Assumption(_NUMBER, "left out")
Report = Callable[[int, str], None]
_CLOSES_IF = "the arc would close if its centre were"
_TURN = 360.0  # degrees
_ROUNDING = {**dict.fromkeys("THDKLQ", 1e-4), "P": 1e-3}  # what RS274NGC rounds away from a whole number


class WordFault(Exception):
    """The line cannot be executed further; carries the index of the word and the message."""

    def __init__(self, word: int, message: str):
        super().__init__(message)
        self.word, self.message = word, message


@dataclass(slots=True)
class Block:
    """One line of a program."""

    line: int  # 1-based source line
    g: dict[str, int] = field(default_factory=dict)  # codes in tenths by modal group
    m: dict[str, int] = field(default_factory=dict)
    value: dict[str, float] = field(default_factory=dict)  # numbers by letter, other than G, M and N
    at: dict[str, int] = field(default_factory=dict)  # index of the word by letter or modal group
    ended: bool = False  # the line is a "%"
    foreign: bool = False  # a code that is not supported uses the line's words; no move is read from it
    refused_motion: bool = False  # such a code is a motion code and stays in force
    partial: bool = False  # some words were reported and left out; others may have belonged to them
    events: list[tuple[str, float]] = field(default_factory=list)  # words that move nothing and are kept
    homing: str = ""  # axes that go to their home position
    stops: bool = False  # one of `events` is a full stop
    settings: list[Setting] = field(default_factory=list)  # commands that set a factor or a limit
    idle: dict[str, float] = field(default_factory=dict)  # words that no code of the line uses, by letter
    uses: frozenset[str] = frozenset()  # letters of the words that codes of the line use
    tool_point: int | None = None  # number of the M code that switches the tool centre point, or None

    def has(self, letters: str) -> bool:
        """True if the block has a word with one of the letters."""
        return any(letter in self.value for letter in letters)

    def first_of(self, letters: str) -> int:
        """Index of the first word with one of the letters."""
        return min(self.at[letter] for letter in letters if letter in self.at)

    def motion_word(self) -> int:
        """Index of the word that makes the block move: motion code, first coordinate, or first word."""
        first = self.first_of("XYZIJKR") if self.has("XYZIJKR") else min(self.at.values())
        return self.at.get("motion", first)

    def fault(self, message: str, at: str = "") -> WordFault:
        """A fault of a letter's or group's word, the first of some letters, or the one that makes it move."""
        word = self.motion_word() if not at else self.at[at] if at in self.at else self.first_of(at)
        return WordFault(word, message)

    def require(self, good: bool, message: str, at: str = "") -> None:
        """Raise such a fault unless all is good."""
        if not good:
            raise self.fault(message, at)


def unused(letter: str) -> str:
    """The message for a word that no code of its block uses."""
    if letter in codes.LETTERS_REFUSED:
        return str(codes.LETTERS_REFUSED[letter])
    return f"{letter} word without {codes.LETTER_NEEDS[letter]}, which would use it; write its moves out"


class ArcFault(WordFault):
    """The words of an arc contradict each other."""

    @property
    def otherwise(self) -> bool:
        """Whether the other of G90.1 and G91.1 would close it."""
        return _CLOSES_IF in self.message


def take_polar(state: State, block: Block) -> None:
    """X and Y in place of @ and ^, LinuxCNC's distance from the programmed zero and angle about it [degrees];
    under G91 both are steps. What is not given stays. Raises WordFault where they mean nothing."""
    if not block.has("@^"):
        return
    word, (x, y), steps = block.first_of("@^"), state.programmed()[:2] / state.unit, not state.absolute
    other = block.has("XY") or block.g.get("one-shot") not in (None, 40) or state.normal != 2
    text = "polar coordinates (@ ^) stand in moves in G17, without X and Y, and not beside G10, G28, G30, G52, G53, G92"
    block.require(not other, text, "@^")
    text = "at the programmed zero the angle of @ and ^ is not known; write G90 and both of them"
    block.require(bool(x or y) or not (steps or "^" not in block.value), text, "@^")
    text = "polar steps (G91, @ ^) with L are not supported; write the holes out"
    block.require(not steps or block.value.get("L", 1.0) == 1.0, text, "L")
    radius, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if steps:
        radius, angle = block.value.pop("@", 0.0) + radius, block.value.pop("^", 0.0) + angle
    else:
        radius, angle = block.value.pop("@", radius), block.value.pop("^", angle)
    to = radius * np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    to = (to - (x, y) if steps else to) * (2.0 if state.diameters else 1.0, 1.0)
    for letter, length in zip("XY", to.tolist(), strict=True):
        block.value[letter], block.at[letter] = length, word


def is_move(state: State, block: Block) -> bool:
    """True if the block moves: by more than a motion code, except for an arc, which lacks its words."""
    arc = state.motion in (2, 3) and ("motion" in block.g or block.has("IJKR"))
    return arc or block.has(state.letters)


def coordinate(state: State, block: Block, axis: int) -> float:
    """The length that the word of an axis gives [mm; degrees]; of a diameter its half."""
    letter = state.letters[axis]
    length = block.value[letter] * (1.0 if letter in DEGREES else state.unit)
    return length / 2.0 if axis == 0 and state.diameters else length


def target(state: State, block: Block) -> FloatArray:
    """Where the block's axis words lead, (A,) in machine coordinates [mm]. Raises WordFault for a wrapped axis
    beyond a turn."""
    in_machine = block.g.get("one-shot") == 530
    end = state.position.copy()
    point = state.programmed() if state.rotated and not in_machine else None
    for axis, letter in enumerate(state.letters):
        if letter not in block.value:
            continue
        length = coordinate(state, block, axis)
        if point is not None and axis < 3:
            point[axis] = length + (0.0 if state.absolute else point[axis])
        elif letter in state.wrapped and (state.absolute or in_machine):
            end[axis] = _unwrapped(state, block, axis)
        elif in_machine:
            end[axis] = length
        else:
            end[axis] = length + (state.offset[axis] if state.absolute else end[axis])
    if point is not None:
        end[:3] = state.machine(point)[:3]
        if not block.has("XY"):
            end[:2] = state.position[:2]
    return end


def _unwrapped(state: State, block: Block, axis: int) -> float:
    """Where the word of a wrapped axis leads [degrees], within a turn ahead in the direction of its sign. Raises
    WordFault for a place beyond a turn."""
    letter = state.letters[axis]
    value, zero = block.value[letter], float(state.offset[axis])
    text = f"axis {letter} is wrapped: its places are above -360 and below 360 degrees"
    block.require(abs(value) < _TURN, text, letter)
    here = float(state.position[axis]) - zero
    place = abs(value - zero if block.g.get("one-shot") == 530 else value) + math.floor(here / _TURN) * _TURN
    if math.copysign(1.0, value) > 0:
        return (place + _TURN if place < here else place) + zero
    return (place - _TURN if place > here else place) + zero


def arc(state: State, block: Block, end: FloatArray) -> tuple[arcs.Arc, int]:
    """The arc of a block to `end` (3,) [mm], and the index of its normal axis. Raises WordFault."""
    try:
        return _arc(state, block, end)
    except arcs.ArcError as fault:
        raise ArcFault(block.motion_word(), str(fault)) from fault


def _plane(state: State) -> tuple[int, bool]:
    """The normal axis of the plane in the machine's axes, and whether it points against that axis. Raises
    ArcError if the plane is turned to where no axis is normal to it."""
    if not state.rotated or state.normal == 2:
        return state.normal, False
    normal = state.work_system().turn(np.eye(3)[state.normal])
    axis = int(np.abs(normal).argmax())
    if abs(normal[axis]) != 1.0:
        turned = f"while the work system is rotated by {state.work_system().rotation:g} degrees"
        what = f"an arc in G{17 + 2 - state.normal} {turned} is not supported"
        raise arcs.ArcError(f"{what}; only quarter turns are")
    return axis, bool(normal[axis] < 0)


def _arc(state: State, block: Block, end: FloatArray) -> tuple[arcs.Arc, int]:
    turned, opposite = _plane(state)
    start, normal, unit = state.position, state.normal, state.unit
    a, b = arcs.IN_PLANE[normal]
    plane = f"{arcs.AXES[a]} {arcs.AXES[b]}"
    turns = integer(block, "P", 1) if "P" in block.value else 1
    way = arcs.ArcWay(turned, (state.motion == 2) != opposite, turns, unit)
    axial = block.value.get("IJK"[normal])  # many programs write K0 in G17
    remedy = ""
    if axial is not None and (axial != 0.0 or state.strict):
        remedy = f"{'IJK'[normal]} in the {plane} plane; write G17, G18 or G19 for the centre's plane"
        remedy += " before it"
    elif "R" in block.value and block.has("IJK"):
        remedy = "R and I J K on one line both define the centre; write one of them"
    elif "R" in block.value and not block.has("XYZ"[a] + "XYZ"[b]):
        remedy = f"an arc with R needs an end point in the {plane} plane"
    elif not block.has("IJKR"):
        remedy = f"an arc needs a centre or a radius; write {'IJK'[a]} and {'IJK'[b]}, or R"
    if remedy:
        raise arcs.ArcError(remedy)
    if "R" in block.value:
        return arcs.arc_from_radius(start, end, block.value["R"] * unit, way), turned
    centre = _centre(state, block, absolute=state.absolute_centre)
    try:
        return arcs.arc_from_centre(start, end, centre, way), turned
    except arcs.ArcError as fault:
        raise arcs.ArcError(f"{fault}; {_remedy(state, block, end, turned)}") from fault


def arc_length(start: FloatArray, end: FloatArray, arc: arcs.Arc, normal: int) -> float:
    """Length of an arc from start to end (3,), the rise along its axis included [mm]."""
    return math.hypot(arc_radius(start, arc, normal) * arc.sweep, end[normal] - start[normal])


def arc_radius(start: FloatArray, arc: arcs.Arc, normal: int) -> float:
    """Radius of an arc from start (3,) [mm]."""
    a, b = arcs.IN_PLANE[normal]
    return math.hypot(start[a] - arc.centre[a], start[b] - arc.centre[b])


def _centre(state: State, block: Block, *, absolute: bool) -> FloatArray:
    centre = state.programmed() if state.rotated else state.position.copy()
    origin = np.zeros(3) if state.rotated else state.offset
    for axis in arcs.IN_PLANE[state.normal]:
        letter = "IJK"[axis]
        if letter in block.value:
            length = block.value[letter] * state.unit
            centre[axis] = length + (origin[axis] if absolute else centre[axis])
        elif absolute:
            raise arcs.ArcError(f"{letter} is missing; with absolute centres (G90.1) both are needed")
    return state.machine(centre) if state.rotated else centre


def _remedy(state: State, block: Block, end: FloatArray, normal: int) -> str:
    """What to do about an arc that does not close: many programs have absolute centres and do not say so."""
    try:
        other = _centre(state, block, absolute=not state.absolute_centre)
        if state.centres_known or arcs.not_closed(state.position, end, other, normal, state.unit):
            raise arcs.ArcError
    except arcs.ArcError:
        return "correct the centre or the end point"
    way = "incremental: write G91.1" if state.absolute_centre else "absolute: write G90.1"
    return f"{_CLOSES_IF} {way} before it"


def used_in_force(state: State) -> set[str]:
    """Letters that the motion code in force uses beside the axes."""
    code = 10 * state.motion if state.motion <= 3 else state.motion
    return set(codes.WORDS.get(("G", code), ""))


def check_words(state: State, block: Block) -> None:
    """Raises WordFault for the first word that no code of the line or in force uses."""
    if state.motion == REFUSED_MOTION or block.partial:
        return
    used = block.uses | used_in_force(state)
    for letter in codes.MOTION_WORDS:
        if letter in block.value and letter not in used:
            raise block.fault(unused(letter), letter)


def integer(block: Block, letter: str, least: int) -> int:
    """A word's whole number. Raises WordFault if it is none or less than `least`."""
    value = block.value[letter]
    whole = round(value)
    good = abs(value - whole) <= _ROUNDING[letter] and whole >= least
    block.require(good, f"{letter} must be a whole number, {least} or more", letter)
    return whole
