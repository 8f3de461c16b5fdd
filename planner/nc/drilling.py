"""Canned cycles for holes, G73, G74 and G81 to G89: from the words of a hole to its moves, as LinuxCNC has
them.

A cycle works along the normal of the plane (z in G17). The words are, with coordinates as those of G90 or, in
G91, from the level before the series of cycles (R), from R (the depth) and from the depth (K):

    X Y Z   the hole and its depth           R   where the feed begins        L   how many holes, one increment apart in G91
    Q       depth of a peck (G73, G83)       P   dwell [s]                    I J K   offset and counterbore of G87

They stay in force while the same code does. The tool goes to the hole at the height where it is if that is
above R, else at the one it will retract to (on Fanuc's controls always where it is); then fast to R, makes the
hole, and retracts to R (G99) or to the level before the series (G98), if that is higher. Between pecks it goes
up by `CLEARANCE` (G73), or to R and back to `CLEARANCE` above the last depth. Fanuc taps by infeeds of Q.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.base.units import MM_PER_INCH
from planner.nc import auxiliary, codes
from planner.nc.arcs import AXES, IN_PLANE
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings
from planner.nc.moves import Block, integer, unused
from planner.nc.program import Kind
from planner.nc.state import CycleSeries, State

CLEARANCE = 0.01 * MM_PER_INCH  # between pecks [mm]: a hundredth of an inch, as LinuxCNC has it
DWELLING = frozenset((820, 860, 880, 890))  # cycles that need P
PECKING = frozenset((730, 830))  # cycles that need Q
FANUC_DWELLS = PECKING | {810, 850}  # cycles that dwell where P says so, on Fanuc's controls alone
TAPPING = {740: -1, 840: 1}  # how the spindle must turn
IN_STEPS = PECKING | TAPPING.keys()  # cycles that Q divides
STOPPING = frozenset((860, 870, 880))  # cycles that stop the spindle, which must turn
# The steps of each cycle from above the hole at R on: moves at the feed (down to the depth, back to R, out to
# where the cycle ends) and fast (up to where it ends; beside, deep, in and away, of the back bore, whose feed
# leads to the counterbore), the dwell, the spindle (stop, other way, again as before), and a full stop.
_STEPS = {
    **dict.fromkeys(PECKING, "pecks down dwell up"),
    **dict.fromkeys(TAPPING, "down stop other dwell out stop again"),
    codes.THREADING: "down dwell stop up again",  # Fanuc's G76, fine boring
    810: "down dwell up",
    820: "down dwell up",
    850: "down dwell back up",
    860: "down dwell stop up again",
    870: "beside stop deep in again counterbore down stop deep away up again",
    880: "down dwell stop halt up again",
    890: "down dwell out",
}
STEPS_MAX = 1_000_000  # of a line: more are a mistake in L or Q, and would fill the memory
_DEEP, _BACK_BORE, _BY_HAND = 830, 870, 880  # G83, G87, G88
_GROUP, _INFEED = "K of G73", "Q of taps"  # among the words in force
_SAID = {  # by code
    _BY_HAND: "the operator retracts the tool after the full stop; the plan has a rapid for it",
    codes.THREADING: "the spindle stops in its place at the bottom, and the way off the wall by Q is left out",
}
_MEANING = {"R": "R, where its feed begins", "P": "P, its dwell in seconds", "Q": "Q, the depth of a peck"}
_OFFSETS = "the offsets I J K, for Fanuc's Q goes where a parameter of the control says"
_PECK_ODD = 10.0  # times the depth of a hole: a longer peck is most likely in other units
_PER_HOLE = 16  # steps of a hole without pecks, at most
_PER_PECK = 3  # down, out and back in
_ROUNDING = 1e-9  # of a position that is turned back into a coordinate [programmed units]


@dataclass(frozen=True)
class Hole:
    """A hole in programmed coordinates and units, in the plane (a, b) and along its normal c."""

    code: int  # tenths of the G code
    place: tuple[float, float]  # (a, b)
    bottom: float  # c of its depth
    clear: float  # c of R
    retract: float  # c after it
    peck: float = 0.0  # Q, or I of G83, of which each is J (`less`) less, down to K (`least`)
    less: float = 0.0
    least: float = 0.0
    group: float = 0.0  # K of Haas' G73: pecks of this depth together end at R
    dwell: float = 0.0  # P [s]
    beside: tuple[float, float] = (0.0, 0.0)  # (a, b) offset of G87
    counterbore: float = 0.0  # c of K of G87
    turning: int = 1  # of the spindle, 1 or -1
    fast: bool = False  # out of the hole it feeds to R only, as on Fanuc's controls
    unit: float = 1.0  # of length [mm]


@dataclass(frozen=True)
class CycleStep:
    """A move to (a, b, c), a dwell of so many seconds, a stop, or a spindle code (3, 4, 5)."""

    kind: Kind | None
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seconds: float = 0.0
    spindle: int = 0


def steps(hole: Hole) -> Iterator[CycleStep]:
    """The steps of a hole, from above it at R on."""
    a, b = hole.place
    beside, bottom = (a + hole.beside[0], b + hole.beside[1]), hole.bottom
    again, other = (3, 4) if hole.turning > 0 else (4, 3)
    step = {
        "down": CycleStep(Kind.LINE, (a, b, bottom)),
        "back": CycleStep(Kind.LINE, (a, b, hole.clear)),
        "out": CycleStep(Kind.LINE, (a, b, hole.clear if hole.fast else hole.retract)),
        "counterbore": CycleStep(Kind.LINE, (a, b, hole.counterbore)),
        "up": CycleStep(Kind.RAPID, (a, b, hole.retract)),
        "beside": CycleStep(Kind.RAPID, (*beside, hole.clear)),
        "deep": CycleStep(Kind.RAPID, (*beside, bottom)),
        "in": CycleStep(Kind.RAPID, (a, b, bottom)),
        "away": CycleStep(Kind.RAPID, (*beside, hole.retract)),
        "dwell": CycleStep(Kind.DWELL, seconds=hole.dwell),
        "halt": CycleStep(Kind.STOP),
        "stop": CycleStep(None, spindle=5),
        "again": CycleStep(None, spindle=again),
        "other": CycleStep(None, spindle=other),
    }
    names = _STEPS[hole.code].split()
    if hole.code in TAPPING and hole.peck > 0.0:
        for k in range(1, math.ceil((hole.clear - bottom) / hole.peck - _ROUNDING)):
            infeed = step | {"down": CycleStep(Kind.LINE, (a, b, hole.clear - k * hole.peck))}
            yield from (infeed[name] for name in (*names, "halt"))
    for name in names:
        if name != "dwell" or hole.dwell or hole.code not in FANUC_DWELLS:
            yield from _pecks(hole) if name == "pecks" else (step[name],)
        if name == "out" and hole.fast:
            yield step["up"]


def _pecks(hole: Hole) -> Iterator[CycleStep]:
    a, b = hole.place
    step, depth, since = hole.peck, hole.clear - hole.peck, 0.0
    while depth > hole.bottom:
        yield CycleStep(Kind.LINE, (a, b, depth))
        since += step
        if hole.code == _DEEP or 0.0 < hole.group <= since + _ROUNDING:
            yield CycleStep(Kind.RAPID, (a, b, hole.clear))
            since = 0.0
        yield CycleStep(Kind.RAPID, (a, b, depth + CLEARANCE / hole.unit))
        step = max(step - hole.less, hole.least)
        depth -= step


def drill(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """Execute the line. Raises WordFault for words that are missing or contradict each other."""
    a, b = IN_PLANE[state.normal]
    c = state.normal
    here = state.programmed() / state.unit
    if state.series is None or state.series.code != state.motion:
        level = float(here[c]) if state.series is None else state.series.level
        # the words in force are those of a code; on Fanuc's controls those of all cycles until G80
        words = state.series.words if state.fanuc and state.series is not None else {}
        words.pop(_INFEED, None)
        state.series = CycleSeries(state.motion, words, level)
    series = state.series
    words = _words(state, block, series)
    _check_words(state, block, words, findings)
    hole = _hole(state, block, series, words)
    repeats = _repeats(state, block, hole)

    def go(kind: Kind, place: tuple[float, float, float]) -> None:
        _to(state, table, block.line, CycleStep(kind, place))

    if repeats and series.level < hole.clear - _ROUNDING and not state.fanuc:
        go(Kind.RAPID, (here[a], here[b], hole.clear))
        here[c] = hole.clear
    for _ in range(repeats):
        for axis in (a, b):
            if "XYZ"[axis] in block.value:
                length = _length(state, block.value, axis)
                here[axis] = length + (0.0 if state.absolute else here[axis])
        hole = replace(hole, place=(float(here[a]), float(here[b])))
        height = float(here[c]) if state.fanuc or here[c] > hole.clear + _ROUNDING else hole.retract
        go(Kind.RAPID, (*hole.place, height))
        go(Kind.RAPID, (*hole.place, hole.clear))
        for step in steps(hole):
            _to(state, table, block.line, step)
        here[c] = hole.retract
    _say(state, block, findings)
    if state.fanuc and "Q" in block.value and hole.peck > _PECK_ODD * (hole.clear - hole.bottom):
        text = f"Q{hole.peck:g} is one peck to the bottom; on controls where it is in least increments set [dialect] least_increment"
        findings.assume(text, block.line, block.at["Q"])


def _check_words(state: State, block: Block, words: dict[str, float], findings: Findings) -> None:
    """Raises WordFault for an impossible peck or dwell, and a spindle that does not turn as it must."""
    code, name = state.motion, f"G{codes.number(state.motion)}"
    least = min(_infeeds(words, state)[c] for c in ("peck", "least"))
    text = f"{name} needs the depth of a peck as a Q word above 0"
    block.require(
        least > 0 or (least == 0 and code in TAPPING) or code not in IN_STEPS,
        text,
        "Q" * ("Q" in block.at),
    )
    text = "a dwell must not be negative; write its seconds, such as P0.5"
    block.require(code not in DWELLING or words["P"] >= 0, text, "P")
    if state.fanuc and code in TAPPING.keys() | STOPPING and (code in TAPPING or not state.spindle.turning):
        state.spindle.turning = TAPPING.get(code, 1)  # the cycle starts it
    turning, needed = state.spindle.turning, TAPPING.get(code, 0)
    text = f"{name} needs the spindle turning {'M3' if needed > 0 else 'M4'} before it"
    block.require(needed in (0, turning), text)
    text = f"{name} stops the spindle, which does not turn; write M3 or M4 before it"
    block.require(code not in STOPPING or bool(turning), text)
    if "P" in block.value and code in DWELLING | TAPPING.keys():
        auxiliary.assume_seconds(state, block, words["P"], findings)
    state.cycle_dwell = block.value.get("P", state.cycle_dwell)


def _hole(state: State, block: Block, series: CycleSeries, words: dict[str, float]) -> Hole:
    """The hole of the words in force, at no place yet. Raises WordFault if it would begin below its depth."""
    a, b = IN_PLANE[state.normal]
    axis, to_level = state.normal, state.to_level or (state.fanuc and not state.retract_given)
    absolute = state.absolute or state.fanuc
    clear = words["R"] + (0.0 if absolute else series.level)
    bottom = words["XYZ"[axis]] + (0.0 if absolute else clear)
    what = f"G{codes.number(state.motion)} would begin at R = {clear:g}, below its depth"
    block.require(bottom <= clear, f"{what} {AXES[axis].upper()} = {bottom:g}; write R above it")
    return Hole(
        state.motion,
        (0.0, 0.0),
        bottom,
        clear,
        retract=series.level if to_level and series.level > clear else clear,
        **_infeeds(words, state),
        group=series.words.get(_GROUP, 0.0),
        dwell=words.get("P", 0.0 if state.motion in FANUC_DWELLS else state.cycle_dwell),
        beside=(words.get("IJK"[a], 0.0), words.get("IJK"[b], 0.0)),
        counterbore=words.get("IJK"[axis], 0.0) + (0.0 if state.absolute else bottom),
        turning=state.spindle.turning,
        fast=state.fanuc,
        unit=state.unit,
    )


def _infeeds(words: dict[str, float], state: State) -> dict[str, float]:
    if state.motion == _DEEP and state.fanuc and "I" in words:
        return {"peck": words["I"], "less": words.get("J", 0.0), "least": words.get("K", 0.0) or words["I"]}
    peck = words.get(_INFEED if state.motion in TAPPING else "Q", 0.0)
    return {"peck": peck, "least": peck}


def _repeats(state: State, block: Block, hole: Hole) -> int:
    """L. Raises WordFault for more moves than a line may make."""
    count = next((c for c in "LK" if c in block.value and (c == "L" or _counts(state, block))), "")
    repeats = integer(block, count, 0 if state.fanuc else 1) if count else 1
    pecks = (hole.clear - hole.bottom) / hole.least if hole.code in IN_STEPS and hole.least else 0.0
    text = f"G{codes.number(hole.code)} makes more than {STEPS_MAX} moves; correct {'Q' if pecks else 'L'}"
    block.require(repeats * (_PER_HOLE + _PER_PECK * pecks) <= STEPS_MAX, text)
    return repeats


def _counts(state: State, block: Block) -> bool:
    """True if K is how many holes, as Fanuc has it."""
    others = "I" in block.value or "J" in block.value or _groups(state, block)
    return state.fanuc and state.motion != _BACK_BORE and not others


def _groups(state: State, block: Block) -> bool:
    """True if K is a depth of Haas' G73: in G90, where Fanuc would drill the same hole again, and above Q."""
    together = state.fanuc and state.absolute and state.motion == min(PECKING) and block.has("Q")
    return together and block.value.get("K", 0.0) > block.value["Q"] > 0.0


def _say(state: State, block: Block, findings: Findings) -> None:
    name, word, code = f"G{codes.number(state.motion)}", block.motion_word(), state.motion
    if not state.retract_given:
        at = "R (G99), as LinuxCNC has it"
        at = "the level before them (G98), as Fanuc and Haas have it" if state.fanuc else at
        text = f"holes end at {at}; some controls start with G9{9 if state.fanuc else 8}"
        findings.assume(f"{name} before any G98 or G99: {text}", block.line, word)
    if _groups(state, block):
        text = f"K{block.value['K']:g} beside Q is the depth after which it retracts to R, as Haas has it"
        findings.assume(f"{name}: {text}; Fanuc would drill the hole again", block.line, block.at["K"])
    if code in _SAID:
        findings.assume(f"{name}: {_SAID[code]}", block.line, word)
    if code in TAPPING and block.value.get("Q"):
        findings.assume(
            f"{name}: each infeed of Q leads out to R; a parameter of the control says whether less",
            block.line,
        )
    if code in TAPPING:
        text = "planned with F as its upper limit and full stops at both ends, not at constant feed"
        findings.assume(f"{name} is synchronised with the spindle: {text}", block.line)


def _words(state: State, block: Block, series: CycleSeries) -> dict[str, float]:
    """The words in force. Raises WordFault for one that is missing."""
    code, axis = series.code, "XYZ"[state.normal]
    for letter in f"R{axis}PQIJK":
        if letter not in block.value:
            continue
        if not state.fanuc and letter in codes.FANUC_WORDS.get(code, ""):
            raise block.fault(unused(letter), letter)
        series.words[letter] = block.value[letter]
        if letter == "Q" and code in TAPPING:
            series.words[_INFEED] = block.value["Q"]
        if letter == "K":
            series.words[_GROUP] = block.value["K"] if _groups(state, block) else 0.0
        if state.fanuc and not state.absolute:  # levels stay where they were when they were given
            series.words[letter] += {"R": series.level, axis: series.words.get("R", 0.0)}.get(letter, 0.0)
    if state.fanuc:
        series.words = {"P": 0.0} | series.words
    needed = f"{axis}R" + {870: "IJK"}.get(code, "")
    own = state.fanuc and code == _DEEP and "I" in series.words  # infeeds of its own
    needed += "Q" * (code in PECKING and not own) + "P" * (code in DWELLING)
    for letter in needed:
        what = f"its depth as {letter}" if letter in "XYZ" else f"{letter}: {_OFFSETS}"
        what = _MEANING.get(letter, what)
        block.require(letter in series.words, f"G{codes.number(code)} needs {what}")
    words = dict(series.words)
    words[axis] = _length(state, words, state.normal)
    return words


def _to(state: State, table: BlockTable, line: int, step: CycleStep) -> None:
    if step.kind is None:
        table.add_event("M", step.spindle, line)
        state.spindle.turning = auxiliary.TURNING[10 * step.spindle]
    elif step.kind == Kind.DWELL:
        table.add_dwell(step.seconds, line, state)
    elif step.kind == Kind.STOP:
        table.add(Kind.STOP, line, state)
    else:
        a, b = IN_PLANE[state.normal]
        point = state.programmed()
        point[[a, b, state.normal]] = np.array(step.place) * state.unit
        end = state.position.copy()
        end[:3] = state.machine(point)[:3]
        if step.kind == Kind.LINE or (end != state.place).any():
            state.position[:], state.actual = end, None
            table.add(step.kind, line, state)


def _length(state: State, words: dict[str, float], axis: int) -> float:
    value = words["XYZ"[axis]]
    return value / 2.0 if axis == 0 and state.diameters else value
