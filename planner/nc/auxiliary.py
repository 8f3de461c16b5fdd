"""Words that act before a block moves: spindle, tool, coolant, signals (M62 to M68) and other codes that a
control passes on; dwells; path control; the feed of a move.

G94 gives F, G95 F times S, G93 length times F; a change of the mode forgets the feed. With G96 S is a surface
speed v: the turns depend on the radius r that is being cut, n = v / (2 pi r), up to D of G96. Straight moves
are divided so that n changes by at most `SURFACE_STEP` in a part, and a part has the feed of its larger
radius; an arc has that of its largest.
"""

import math
from collections.abc import Callable

import numpy as np

from planner.base.units import MILLISECOND, MM_PER_INCH, SECONDS_PER_MINUTE
from planner.machine.parts import TOLERANCE_MIN
from planner.nc import codes
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings, IgnoredWords
from planner.nc.moves import Block, WordFault, integer
from planner.nc.program import Kind, PathControl
from planner.nc.settings import PRINTER_FEED
from planner.nc.state import FeedMode, State

_MODES: dict[int, FeedMode] = {930: "inverse time", 940: "per minute", 950: "per turn"}
SURFACE_STEP = 0.05  # change of the spindle's speed in a part of a move: as much as overrides are set to
_LEAST_RADIUS = 1e-3  # below which the speed is that at it [mm]: no turned part is thinner
_MM_PER_METRE, _MM_PER_FOOT = 1000.0, 304.8  # S of G96 is in metres or feet per minute
# Below this feed [programmed units/min] LinuxCNC takes this one under G93 (inverse_time_rate_straight).
LINUXCNC_SLOWEST = 0.1
_DWELL = 40  # G4, whose S is a time where it has no other
# Ten times M codes: the one that reads an input, and the words that each needs.
_READ_INPUT = 660
_NEEDED = {620: "P", 630: "P", 640: "P", 650: "P", _READ_INPUT: "", 670: "EQ", 680: "EQ"}
_EXACT_PATH = 610  # by ten times the G code, as the others
_PATH_CONTROLS = {_EXACT_PATH: PathControl.EXACT_PATH, 611: PathControl.EXACT_STOP, 640: PathControl.BLEND}
_LONG = 60.0  # a dwell of a minute is no usual one [s]
TURNING = {30: 1, 40: -1, 50: 0}  # of the spindle, by ten times M3, M4 and M5


def set_feed(
    state: State, block: Block, findings: Findings, column: Callable[[int], int], *, printer: bool
) -> None:
    """The feed mode and F of a block; F0, at the column of its word, is no feed for what follows, and on printers keeps
    the feed before it. Raises WordFault for a negative F."""
    mode = _MODES[block.g["feed mode"]] if "feed mode" in block.g else state.feed_mode
    state.fed |= state.feed > 0
    if mode != state.feed_mode:
        state.feed_mode, state.feed, state.feed_per_turn, state.feed_zero = mode, 0.0, 0.0, ""
    if "F" not in block.value:
        return
    feed = block.value["F"]
    text = "a feed must be positive; write the feed of the moves that follow, such as F1000"
    block.require(feed >= 0 and not (mode == "inverse time" and not feed), text, "F")
    if mode == "inverse time":
        return
    if printer and not feed and state.feed > 0:
        findings.assume("F0 keeps the feed before it, as Marlin has it", block.line)
        return
    state.feed_zero = "" if feed else f" (F0 in line {block.line}, column {column(block.at['F'])}, is none)"
    code, before = block.g.get("units"), state.unit
    state.feed_unit = before if code is None or not state.own_feed else unit_of(code)
    if mode == "per minute":
        state.feed = feed * state.feed_unit / SECONDS_PER_MINUTE * state.feed_factor
    else:
        state.feed_per_turn = feed * state.feed_unit
        state.feed = state.feed if feed else 0.0
    if code is not None and state.feed_unit != unit_of(code):
        unit, per = "mm" if before == 1.0 else "inch", mode.removeprefix("per ")
        text = f"F{feed:g} is {unit} per {per}: F acts before G{codes.number(code)} on the same line"
        if state.seconds_meant or state.strict:
            findings.note(text, block.line)
        else:
            findings.assume(f"{text}, as in LinuxCNC; Fanuc and grbl read it behind (--dialect)", block.line)


def unit_of(code: int) -> float:
    """mm per programmed unit of length behind G20 or G21, by ten times the code."""
    return MM_PER_INCH if code == 200 else 1.0


def take_default(
    state: State, default: float | None, block: Block, findings: Findings, *, printer: bool
) -> None:
    """The machine's feed [mm/s], if it has one, or a printer's, for a feed move before the first F word."""
    whose = "the machine's feed_default" if default else "what Marlin and Klipper begin with"
    default = default or (PRINTER_FEED if printer else None)
    given = state.feed > 0 or state.fed or state.feed_mode != "per minute"
    if not default or state.strict or state.motion == 0 or given:
        return
    state.feed, state.feed_unit = default * state.feed_factor, state.unit
    feed = default * SECONDS_PER_MINUTE / state.unit
    findings.assume(f"no feed before the first feed move{state.feed_zero}: {whose}, F{feed:g}", block.line)


def check_feed(state: State, block: Block) -> None:
    """See that the block has a feed, in `state.feed` under G94 and G95. Raises WordFault if it has none."""
    name = f"G{codes.number(10 * state.motion if state.motion <= 3 else state.motion)}"
    if state.feed_mode == "inverse time":
        text = f"{name} under G93 (inverse time) has no feed; write G94 before it"
        block.require(state.motion <= 3, text)
        text = f"{name} under G93 (inverse time) needs an F word on its line: one over its minutes"
        block.require("F" in block.value, text)
        return
    if state.feed_mode == "per turn" and state.feed_per_turn > 0:
        text = f"{name} with a feed per turn (G95) needs a spindle speed; write an S word before it"
        block.require(state.spindle.speed > 0, text)
        if state.spindle.surface_speed:
            return  # its feed depends on the diameter: `surface_feed`
        state.feed = state.feed_per_turn * state.spindle.speed / SECONDS_PER_MINUTE * state.feed_factor
    remedy = "write an F word on this line or before it" + ", or feed_default into the machine file" * (
        not state.fed
    )
    block.require(state.feed > 0, f"{name} moves without a feed{state.feed_zero}; {remedy}")


def on_surface(state: State) -> bool:
    """True if the feed depends on the diameter: G95 under a constant surface speed (G96)."""
    return state.spindle.surface_speed and state.feed_mode == "per turn" and state.feed_per_turn > 0


def _surface_speed(state: State) -> float:
    """[mm/min]"""
    return state.spindle.speed * (_MM_PER_FOOT if state.unit != 1.0 else _MM_PER_METRE)


def _surface_turns(state: State, radius: float) -> float:
    """Speed of the spindle [1/min] at a radius [mm]; inf on the axis, if it has no bound."""
    turns = _surface_speed(state) / (2.0 * math.pi * abs(radius)) if radius else math.inf
    return min(turns, state.spindle.speed_max or math.inf)


def surface_feed(state: State, radius: float, word: int) -> float:
    """Feed [mm/s] at a radius [mm]. Raises WordFault on the axis, if the speed has no bound."""
    turns = _surface_turns(state, radius)
    if math.isinf(turns):
        move = "a move to the spindle's axis under a constant surface speed (G96) without a largest speed"
        raise WordFault(word, f"{move} has no feed; write G50 S, or D beside G96")
    return state.feed_per_turn * turns / SECONDS_PER_MINUTE * state.feed_factor


def surface_parts(state: State, start: float, end: float) -> list[float]:
    """Parts, up to 1, of a straight move between radii [mm]: the speed changes by `SURFACE_STEP` in each."""
    largest = max(abs(start), abs(end))
    speed_max = state.spindle.speed_max
    least = _surface_speed(state) / (2.0 * math.pi * speed_max) if speed_max else 0.0
    least = max(least, _LEAST_RADIUS)
    parts = {1.0}
    if start != end and largest > least:
        count = math.ceil(math.log(largest / least) / math.log1p(SURFACE_STEP))
        for n in range(1, count + 1):
            radius = max(largest / (1.0 + SURFACE_STEP) ** n, least)
            parts |= {(sign * radius - start) / (end - start) for sign in (1.0, -1.0)}
    return sorted(part for part in parts if 0.0 < part <= 1.0)


def feed_of_time(state: State, block: Block, length: float, findings: Findings) -> None:
    """Under G93 the feed of a block of this length [mm], of an arc of Fanuc's of this radius; that of one that goes
    nowhere is any."""
    if state.feed_mode != "inverse time":
        return
    state.feed_unit = state.unit
    state.feed = (length or state.unit) * block.value["F"] / SECONDS_PER_MINUTE * state.feed_factor
    per_minute = length * block.value["F"] / state.unit
    if 0.0 < per_minute < LINUXCNC_SLOWEST:
        text = f"G93 asks for less than {LINUXCNC_SLOWEST:g} units/min, and keeps its time; LinuxCNC takes {LINUXCNC_SLOWEST:g}"
        findings.assume(text, block.line, block.at["F"])


def events(state: State, table: BlockTable, block: Block, findings: Findings, *, printer: bool) -> None:
    """Keep S, T and the codes that a control passes on, and what they set. Raises WordFault."""
    line = block.line
    timed = block.g.get("one-shot") == _DWELL and (printer or not block.has("PXU"))
    if "S" in block.value and not timed:
        text = "a spindle speed must not be negative; write M4 to turn the other way"
        block.require(block.value["S"] >= 0, text, "S")
        table.add_event("S", block.value["S"], line)
        state.spindle.speed = block.value["S"]
    if "T" in block.value:
        state.tool_selected = integer(block, "T", 0)
        table.add_event("T", state.tool_selected, line)
    if "signals" in block.m:
        code = block.m["signals"]
        text = f"M{code // 10} needs the words {' and '.join(_NEEDED[code])}"
        block.require(block.value.keys() >= set(_NEEDED[code]), text, "signals")
        text = "M66 waits for an input of the control, which only the machine knows; plan the parts before and after it"
        block.require(code != _READ_INPUT or block.value.get("L", 0.0) == 0.0, text, "signals")
        table.add_event("M", code / 10, line)
    if "tool number" in block.m:
        block.require("Q" in block.value, "M61 needs the tool's number as a Q word", "tool number")
        state.tool_loaded = integer(block, "Q", 0)
    if "tool change" in block.m:
        state.tool_loaded = state.tool_selected
        table.add_event("M", 6.0, line)
        table.add(Kind.STOP, line, state)
        text = "tool change: a full stop, moves nothing"
        if state.change_timed:
            findings.note(text, line)
        else:
            why = "its time is not included, [times] tool_change of the machine file gives it"
            findings.assume(f"{text}; {why}", line, block.at["tool change"])
    for letter, value in block.events:
        table.add_event(letter, value, line)
    for group in ("spindle", "spindle orientation", "coolant", "override"):
        if group in block.m:
            table.add_event("M", block.m[group] / 10, line)
    state.spindle.turning = TURNING.get(block.m.get("spindle", -1), state.spindle.turning)
    if "spindle mode" in block.g:
        surface = block.g["spindle mode"] == 960
        text = "G96 needs the surface speed as an S word"
        block.require(not surface or "S" in block.value, text, "spindle mode")
        if not surface and state.spindle.surface_speed and "S" not in block.value:
            _keep_speed(state, block, findings)
        state.spindle.surface_speed = surface
        state.spindle.speed_max = abs(block.value.get("D", 0.0))
    for code in block.g.values():
        if code in codes.G_EVENTS:
            table.add_event("G", code / 10, line)


def _keep_speed(state: State, block: Block, findings: Findings) -> None:
    """G97 without S behind G96: the spindle keeps the speed that it has. Raises WordFault where that has no bound."""
    turns = _surface_turns(state, float(state.programmed()[0]))
    text = "G97 on the spindle's axis needs its speed as an S word"
    block.require(math.isfinite(turns), text, "spindle mode")
    state.spindle.speed = turns
    findings.assume(f"G97 without S: the spindle keeps its speed of {turns:.0f} 1/min", block.line)


def dwell(state: State, table: BlockTable, block: Block, ignored: IgnoredWords, findings: Findings) -> None:
    """G4: a dwell of P seconds, of S on printers. Raises WordFault without a time, or for a negative one."""
    if "P" not in block.value and not state.strict:  # Fanuc's
        for letter in block.value.keys() & set("XU"):
            block.value["P"], block.at["P"] = block.value.pop(letter), block.at[letter]
            ignored.used[letter] += 1
    seconds = block.value.get("P")
    if "S" in block.value and ignored.printer and ignored.klipper:
        seconds = (seconds or 0.0) * MILLISECOND
        findings.assume("S of G4 does nothing in Klipper, which reads P alone", block.line)
    elif seconds is not None and "S" in block.value and ignored.printer:
        seconds = block.value["S"]
        findings.assume("of S and P of G4 S counts, as Marlin has it", block.line)
    elif seconds is not None and ignored.printer:
        seconds *= MILLISECOND
        findings.note("G4 P is in milliseconds, as 3-D printers have it", block.line)
    elif seconds is None and not ignored.strict and (ignored.printer or "S" in block.value):
        seconds = block.value.get("S", 0.0)
        findings.note("G4 S is in seconds, G4 alone a full stop, as 3-D printers have it", block.line)
    text = "a dwell needs its seconds as a P word that is not negative, such as G4 P0.5"
    if seconds is None or seconds < 0:
        raise block.fault(text, "one-shot" if seconds is None else "P")
    assume_seconds(state, block, seconds if "P" in block.value and not ignored.printer else 0.0, findings)
    table.add_dwell(seconds, block.line, state)


def assume_seconds(state: State, block: Block, seconds: float, findings: Findings) -> None:
    """Say it if a dwell is so long that it is most likely in another unit."""
    if seconds >= _LONG and not state.seconds_meant:
        text = f"a dwell of {seconds:g} s: read in seconds, as LinuxCNC and grbl have it; in ms: --dialect fanuc, or marlin"
        findings.assume(text, block.line, block.at.get("P", block.motion_word()))


def path_control(state: State, block: Block, ignored: IgnoredWords, findings: Findings) -> None:
    """G61, G61.1 and G64 with its tolerance. Raises WordFault, for Marlin's G61 too."""
    word, code = block.at["path control"], block.g["path control"]
    text = "G61 of 3-D printers goes back to a position that the control has saved; write G1 to it"
    block.require(code != _EXACT_PATH or not ignored.printer, text, "path control")
    if code == _EXACT_PATH and "S" in block.value and not block.m and "motion" not in block.g:
        text = "G61 with S is exact path and the spindle's speed; in Marlin it goes back to a saved position"
        findings.assume(text, block.line, word)
    state.path_control, state.tolerance = _PATH_CONTROLS[code], np.nan
    if "P" in block.value and code == 640:
        tolerance = block.value["P"]
        block.require(tolerance >= 0, "a tolerance must not be negative; write G64 P0.05", "P")
        least = f"a tolerance must not be below {TOLERANCE_MIN:g} mm"
        enough = tolerance == 0 or tolerance * state.unit >= TOLERANCE_MIN
        block.require(enough, f"{least}; write G64 P0.05, or G61 for the path itself", "P")
        if tolerance > 0:
            state.tolerance = tolerance * state.unit
        else:
            findings.note("G64 P0 gives no tolerance; the machine's holds", block.line)
    if "Q" in block.value:
        findings.note("G64 Q is not used: the tolerance of P bounds every deviation", block.line)
