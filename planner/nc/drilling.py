"""A line with a canned cycle: its words, and those still in force, become holes, and the steps of the holes (cycles.py) blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.nc import auxiliary, codes, cycles
from planner.nc.arcs import AXES, IN_PLANE
from planner.nc.block import Block
from planner.nc.cycles import CycleStep, Hole
from planner.nc.faults import Findings
from planner.nc.moves import WordFault, integer
from planner.nc.program import Kind
from planner.nc.state import CycleSeries, State
from planner.nc.store import Store

STEPS_MAX = 1_000_000  # of a line: more are a mistake in L or Q, and would fill the memory
_BY_HAND = 880  # G88
_PER_HOLE = 16  # steps of a hole without pecks, at most
_PER_PECK = 3  # down, out and back in
_ROUNDING = 1e-9  # of a position that is turned back into a coordinate [programmed units]
# How the spindle turns after M3, M4 and M5.
_SPINDLE = {3: 1, 4: -1, 5: 0}


def drill(state: State, store: Store, block: Block, found: Findings) -> None:
    """Execute the line. Raises WordFault for words that are missing or contradict each other."""
    a, b = IN_PLANE[state.normal]
    c = state.normal
    here = _per_unit(state)
    series = _series(state, state.motion, float(here[c]))
    words = _words(state, block, series)
    _check_words(state, block, words, found)
    hole = _hole(state, block, series, words)
    repeats = _repeats(block, hole)
    if series.level < hole.clear - _ROUNDING:
        _to(state, store, block.line, CycleStep(Kind.RAPID, (here[a], here[b], hole.clear)))
        here[c] = hole.clear
    for _ in range(repeats):
        for axis in (a, b):
            if "XYZ"[axis] in block.value:
                length = _length(state, block.value, axis)
                here[axis] = length + (0.0 if state.absolute else here[axis])
        hole = replace(hole, place=(float(here[a]), float(here[b])))
        height = float(here[c]) if here[c] > hole.clear + _ROUNDING else hole.retract
        _to(state, store, block.line, CycleStep(Kind.RAPID, (*hole.place, height)))
        _to(state, store, block.line, CycleStep(Kind.RAPID, (*hole.place, hole.clear)))
        for step in cycles.steps(hole):
            _to(state, store, block.line, step)
        here[c] = hole.retract
    _say(state, block, found)


def _check_words(state: State, block: Block, words: dict[str, float], found: Findings) -> None:
    """Raises WordFault for a peck or dwell that is impossible, and for a spindle that does not turn as it must."""
    code, word = state.motion, block.motion_word()
    name = f"G{codes.number(code)}"
    if code in cycles.PECKING and not words["Q"] > 0:
        raise WordFault(block.at.get("Q", word), f"{name} needs the depth of a peck as a Q word above 0")
    if code in cycles.DWELLING and words["P"] < 0:
        raise WordFault(block.at["P"], "a dwell must not be negative; write its seconds, such as P0.5")
    _check_spindle(state, code, word)
    if "P" in block.value and code in cycles.DWELLING | cycles.TAPPING.keys():
        auxiliary.assume_seconds(state, block, words["P"], found)
    state.cycle_dwell = block.value.get("P", state.cycle_dwell)


def _hole(state: State, block: Block, series: CycleSeries, words: dict[str, float]) -> Hole:
    """The hole of the words in force, at no place yet. Raises WordFault if it would begin below its depth."""
    a, b = IN_PLANE[state.normal]
    axis = state.normal
    clear = words["R"] + (0.0 if state.absolute else series.level)
    bottom = words["XYZ"[axis]] + (0.0 if state.absolute else clear)
    if bottom > clear:
        raise WordFault(
            block.motion_word(),
            f"G{codes.number(state.motion)} would begin at R = {clear:g}, below its depth {AXES[axis].upper()} = {bottom:g}; "
            "write R above it",
        )
    return Hole(
        state.motion,
        (0.0, 0.0),
        bottom,
        clear,
        retract=series.level if state.to_level and series.level > clear else clear,
        peck=words.get("Q", 0.0),
        dwell=words.get("P", state.cycle_dwell),
        beside=(words.get("IJK"[a], 0.0), words.get("IJK"[b], 0.0)),
        counterbore=words.get("IJK"[axis], 0.0) + (0.0 if state.absolute else bottom),
        turning=state.spindle.turning,
        unit=state.unit,
    )


def _repeats(block: Block, hole: Hole) -> int:
    """L. Raises WordFault for more moves than a line may make."""
    repeats = integer(block, "L", 1) if "L" in block.value else 1
    pecks = (hole.clear - hole.bottom) / hole.peck if hole.code in cycles.PECKING else 0.0
    if repeats * (_PER_HOLE + _PER_PECK * pecks) > STEPS_MAX:
        text = (
            f"G{codes.number(hole.code)} makes more than {STEPS_MAX} moves; correct {'Q' if pecks else 'L'}"
        )
        raise WordFault(block.motion_word(), text)
    return repeats


def _say(state: State, block: Block, found: Findings) -> None:
    """What was assumed of a cycle."""
    name, word = f"G{codes.number(state.motion)}", block.motion_word()
    if not state.retract_given:
        text = "holes end at R (G99), as LinuxCNC has it; some controls start with G98"
        found.assume(f"{name} before any G98 or G99: {text}", block.line, word)
    if state.motion == _BY_HAND:
        text = "the operator retracts the tool after the full stop; the plan has a rapid for it"
        found.assume(f"{name}: {text}", block.line, word)
    if state.motion in cycles.TAPPING:
        text = "planned with F as its upper limit and full stops at both ends, not at constant feed"
        found.assume(f"{name} is synchronised with the spindle: {text}", block.line)


def _series(state: State, code: int, level: float) -> CycleSeries:
    """The series the line belongs to; the words in force are those of its code only."""
    series = state.series
    if series is None:
        series = CycleSeries(code, {}, level)
    elif series.code != code:
        series = CycleSeries(code, {}, series.level)
    state.series = series
    return series


def _words(state: State, block: Block, series: CycleSeries) -> dict[str, float]:
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
    what = {"R": "R, where its feed begins", "P": "P, its dwell in seconds", "Q": "Q, the depth of a peck"}
    return what.get(letter, f"its depth as {letter}" if letter in "XYZ" else f"{letter}: the offsets I J K")


def _check_spindle(state: State, code: int, word: int) -> None:
    turning, needed = state.spindle.turning, cycles.TAPPING.get(code)
    name = f"G{codes.number(code)}"
    if needed is not None and turning != needed:
        raise WordFault(word, f"{name} needs the spindle turning {'M3' if needed > 0 else 'M4'} before it")
    if code in cycles.STOPPING and not turning:
        raise WordFault(word, f"{name} stops the spindle, which does not turn; write M3 or M4 before it")


def _to(state: State, store: Store, line: int, step: CycleStep) -> None:
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
