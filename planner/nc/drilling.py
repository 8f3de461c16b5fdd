"""A line with a canned cycle: its words, and those still in force, become holes, and the steps of the holes (cycles.py) blocks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.nc import codes, cycles
from planner.nc.arcs import AXES, IN_PLANE
from planner.nc.block import Block
from planner.nc.cycles import Hole, Step
from planner.nc.moves import WordFault, integer
from planner.nc.program import Kind
from planner.nc.state import Series, State
from planner.nc.store import Store

Note = Callable[[str, int], None]

STEPS_MAX = 1_000_000  # of a line: more are a mistake in L or Q, and would fill the memory
_PER_HOLE = 16  # steps of a hole without pecks, at most
_PER_PECK = 3
_ROUNDING = 1e-9  # of a position that is turned back into a coordinate [programmed units]
_SPINDLE = {3: 1, 4: -1, 5: 0}


def drill(state: State, store: Store, block: Block, note: Note) -> None:
    """Execute the line. Raises WordFault for words that are missing or contradict each other."""
    code = state.motion
    name = f"G{codes.number(code)}"
    word = block.motion_word()
    normal = state.normal
    a, b = IN_PLANE[normal]
    here = _per_unit(state)
    series = _series(state, code, float(here[normal]))
    repeats = integer(block, "L", 1) if "L" in block.value else 1
    words = _words(state, block, series)
    if code in cycles.PECKING and not words["Q"] > 0:
        raise WordFault(block.at.get("Q", word), f"{name} needs the depth of a peck as a Q word above 0")
    if code in cycles.DWELLING and words["P"] < 0:
        raise WordFault(block.at["P"], "a dwell must not be negative; write its seconds, such as P0.5")
    _check_spindle(state, code, word)
    state.cycle_dwell = block.value.get("P", state.cycle_dwell)
    if not state.retract_given:
        note(
            f"{name} before any G98 or G99: holes end at R (G99), as LinuxCNC has it; some controls start with G98",
            block.line,
        )
    clear = words["R"] + (0.0 if state.absolute else series.level)
    bottom = words["XYZ"[normal]] + (0.0 if state.absolute else clear)
    if bottom > clear:
        raise WordFault(
            word,
            f"{name} would begin at R = {clear:g}, below its depth {AXES[normal].upper()} = {bottom:g}; write R above it",
        )
    retract = series.level if state.to_level and series.level > clear else clear
    pecks = (clear - bottom) / words["Q"] if code in cycles.PECKING else 0.0
    if repeats * (_PER_HOLE + _PER_PECK * pecks) > STEPS_MAX:
        raise WordFault(word, f"{name} makes more than {STEPS_MAX} moves; correct {'Q' if pecks else 'L'}")
    if series.level < clear - _ROUNDING:
        _to(state, store, block.line, Step(Kind.RAPID, (here[a], here[b], clear)))
        here[normal] = clear
    for _ in range(repeats):
        for axis in (a, b):
            if "XYZ"[axis] in block.value:
                length = _length(state, block.value, axis)
                here[axis] = length + (0.0 if state.absolute else here[axis])
        place = (float(here[a]), float(here[b]))
        height = float(here[normal]) if here[normal] > clear + _ROUNDING else retract
        _to(state, store, block.line, Step(Kind.RAPID, (*place, height)))
        _to(state, store, block.line, Step(Kind.RAPID, (*place, clear)))
        hole = Hole(
            code,
            place,
            bottom,
            clear,
            retract,
            peck=words.get("Q", 0.0),
            dwell=words.get("P", state.cycle_dwell),
            beside=(words.get("IJK"[a], 0.0), words.get("IJK"[b], 0.0)),
            counterbore=words.get("IJK"[normal], 0.0) + (0.0 if state.absolute else bottom),
            turning=state.spindle.turning,
            unit=state.unit,
        )
        for step in cycles.steps(hole):
            _to(state, store, block.line, step)
        here[normal] = retract
    if code == 880:
        note(
            "G88: the operator retracts the tool after the full stop; the plan has a rapid for it", block.line
        )
    if code in cycles.TAPPING:
        note(
            f"{name} is synchronised with the spindle: planned with F as its upper limit and full stops at both ends, "
            "not at constant feed",
            block.line,
        )


def _series(state: State, code: int, level: float) -> Series:
    """The series the line belongs to; the words in force are those of its code only."""
    series = state.series
    if series is None:
        series = Series(code, {}, level)
    elif series.code != code:
        series = Series(code, {}, series.level)
    state.series = series
    return series


def _words(state: State, block: Block, series: Series) -> dict[str, float]:
    """The words in force. Raises WordFault for one that is missing."""
    code, axis = series.code, "XYZ"[state.normal]
    for letter in f"{axis}RPQIJK":
        if letter in block.value:
            series.words[letter] = block.value[letter]
    needed = f"{axis}R" + {870: "IJK"}.get(code, "")
    needed += "Q" * (code in cycles.PECKING) + "P" * (code in cycles.DWELLING)
    for letter in needed:
        if letter not in series.words:
            raise WordFault(block.motion_word(), f"G{codes.number(code)} needs {_meaning(letter)}")
    words = dict(series.words)
    words[axis] = _length(state, words, state.normal)
    return words


def _meaning(letter: str) -> str:
    what = {
        "R": "R, where its feed begins",
        "P": "P, its dwell in seconds",
        "Q": "Q, the depth of a peck",
    }
    return what.get(letter, f"its depth as {letter}" if letter in "XYZ" else f"{letter}: the offsets I J K")


def _check_spindle(state: State, code: int, word: int) -> None:
    turning, needed = state.spindle.turning, cycles.TAPPING.get(code)
    name = f"G{codes.number(code)}"
    if needed is not None and turning != needed:
        raise WordFault(word, f"{name} needs the spindle turning {'M3' if needed > 0 else 'M4'} before it")
    if code in cycles.STOPPING and not turning:
        raise WordFault(word, f"{name} stops the spindle, which does not turn; write M3 or M4 before it")


def _to(state: State, store: Store, line: int, step: Step) -> None:
    """Execute a step."""
    store.make_room(1)
    if step.kind is None:
        store.add_event("M", step.spindle, line)
        state.spindle.turning = _SPINDLE[step.spindle]
    elif step.kind == Kind.DWELL:
        store.add_dwell(step.seconds, line, state)
    elif step.kind == Kind.STOP:
        store.add(Kind.STOP, line, state)
    else:
        point = np.empty(3)
        a, b = IN_PLANE[state.normal]
        point[[a, b, state.normal]] = step.place
        end = state.machine(point * state.unit)
        if step.kind == Kind.LINE or (end != state.place).any():
            state.position[:], state.actual = end, None
            store.add(step.kind, line, state)


def _per_unit(state: State) -> np.ndarray:
    return state.programmed() / state.unit


def _length(state: State, words: dict[str, float], axis: int) -> float:
    """A coordinate in programmed units; of a diameter its half."""
    value = words["XYZ"[axis]]
    return value / 2.0 if axis == 0 and state.diameters else value
