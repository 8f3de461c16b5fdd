"""The meaning of F, and the feed of a move: in length per minute (G94), per turn of the spindle (G95) or as one over minutes (G93).

    G94    feed = F
    G95    feed = F S                 S in revolutions per minute
    G93    feed = length F            F on every line that moves at a feed

A change of the mode forgets the feed. With G96 S is a surface speed v, in metres or feet per minute: the turns,
and with them the feed of G95, depend on the radius r that is being cut, n = v / (2 pi r), up to D of G96. Straight moves are divided so
that n changes by at most `SURFACE_STEP` in a part, and a part has the feed of its larger radius; an arc has that of its largest.
"""

from __future__ import annotations

import math

from planner.base.units import SECONDS_PER_MINUTE
from planner.nc import codes
from planner.nc.block import Block, WordFault
from planner.nc.faults import Findings
from planner.nc.state import FeedMode, State

_MODES: dict[int, FeedMode] = {930: "inverse time", 940: "per minute", 950: "per turn"}
SURFACE_STEP = (
    0.05  # by which the spindle's speed changes in a part of a move: as much as overrides are set to
)
_LEAST_RADIUS = 1e-3  # below which the speed is that at it [mm]: no turned part is thinner
_MM_PER_METRE, _MM_PER_FOOT = 1000.0, 304.8  # S of G96 is in metres or feet per minute
# Below this feed [programmed units per minute] LinuxCNC takes this one under G93 (inverse_time_rate_straight).
LINUXCNC_SLOWEST = 0.1


def set_feed(state: State, block: Block, findings: Findings) -> None:
    """The feed mode and F of a block. Raises WordFault for an F that is not positive."""
    mode = _MODES[block.g["feed mode"]] if "feed mode" in block.g else state.feed_mode
    if mode != state.feed_mode:
        state.feed_mode, state.feed, state.feed_per_turn = mode, 0.0, 0.0
    if "F" not in block.value:
        return
    feed = block.value["F"]
    if not feed > 0:
        raise block.fault(
            "a feed must be positive; write the feed of the moves that follow, such as F1000", "F"
        )
    if mode == "inverse time":
        return
    state.feed_unit = state.unit
    if mode == "per minute":
        state.feed = feed * state.unit / SECONDS_PER_MINUTE * state.feed_factor
    else:
        state.feed_per_turn = feed * state.unit
    code = block.g.get("units")
    if code is not None and (code == 200) != (state.unit != 1.0):
        unit, per = "mm" if state.unit == 1.0 else "inch", mode.removeprefix("per ")
        findings.note(
            f"F{feed:g} is {unit} per {per}: F acts before G{codes.number(code)} on the same line", block.line
        )


def take_default(state: State, default: float | None, block: Block, findings: Findings) -> None:
    """The machine's feed [mm/s], if it has one, for a feed move before the first F word."""
    if not default or state.feed > 0 or state.motion == 0 or state.feed_mode != "per minute":
        return
    state.feed, state.feed_unit = default * state.feed_factor, state.unit
    feed = default * SECONDS_PER_MINUTE / state.unit
    findings.assume(f"no feed before the first feed move: the machine's feed_default, F{feed:g}", block.line)


def check_feed(state: State, block: Block) -> None:
    """See that the block has a feed: under G94 and G95 it is `state.feed` then. Raises WordFault if it has none."""
    word = block.motion_word()
    name = f"G{codes.number(10 * state.motion if state.motion <= 3 else state.motion)}"
    if state.feed_mode == "inverse time":
        if state.motion > 3:
            raise WordFault(word, f"{name} under G93 (inverse time) has no feed; write G94 before it")
        if "F" not in block.value:
            raise WordFault(
                word, f"{name} under G93 (inverse time) needs an F word on its line: one over its minutes"
            )
        return
    if state.feed_mode == "per turn" and state.feed_per_turn > 0:
        if not state.spindle.speed > 0:
            raise WordFault(
                word, f"{name} with a feed per turn (G95) needs a spindle speed; write an S word before it"
            )
        if state.spindle.surface_speed:
            return  # its feed depends on the diameter: `surface_feed`
        state.feed = state.feed_per_turn * state.spindle.speed / SECONDS_PER_MINUTE
    if not state.feed > 0:
        raise WordFault(
            word,
            f"{name} moves without a feed; write an F word on this line or before it, or feed_default into the machine file",
        )


def on_surface(state: State) -> bool:
    """True if the feed depends on the diameter: a feed per turn (G95) under a constant surface speed (G96)."""
    return state.spindle.surface_speed and state.feed_mode == "per turn" and state.feed_per_turn > 0


def surface_feed(state: State, radius: float, word: int) -> float:
    """The feed [mm/s] at a radius from the spindle's axis [mm]. Raises WordFault on the axis, if the speed has no bound."""
    spindle = state.spindle
    per_minute = spindle.speed * (_MM_PER_FOOT if state.unit != 1.0 else _MM_PER_METRE)
    turns = per_minute / (2.0 * math.pi * abs(radius)) if radius else math.inf
    turns = min(turns, spindle.speed_max or math.inf)
    if math.isinf(turns):
        raise WordFault(
            word,
            "a move to the spindle's axis under a constant surface speed (G96) without a largest speed has no feed; "
            "write G50 S, or D beside G96",
        )
    return state.feed_per_turn * turns / SECONDS_PER_MINUTE


def surface_parts(state: State, start: float, end: float) -> list[float]:
    """Where a straight move between two radii [mm] is divided, as parts of it, 1 included, so that the speed of the spindle changes by
    at most `SURFACE_STEP` in each."""
    largest = max(abs(start), abs(end))
    spindle = state.spindle
    per_minute = spindle.speed * (_MM_PER_FOOT if state.unit != 1.0 else _MM_PER_METRE)
    least = max(per_minute / (2.0 * math.pi * spindle.speed_max) if spindle.speed_max else 0.0, _LEAST_RADIUS)
    parts = {1.0}
    if start != end and largest > least:
        count = math.ceil(math.log(largest / least) / math.log1p(SURFACE_STEP))
        for n in range(1, count + 1):
            radius = max(largest / (1.0 + SURFACE_STEP) ** n, least)
            parts |= {(sign * radius - start) / (end - start) for sign in (1.0, -1.0)}
    return sorted(part for part in parts if 0.0 < part <= 1.0)


def feed_of_time(state: State, block: Block, length: float, findings: Findings) -> None:
    """Under G93 the feed of a block of this length [mm]; that of one that goes nowhere is any."""
    if state.feed_mode != "inverse time":
        return
    state.feed_unit = state.unit
    state.feed = (length or state.unit) * block.value["F"] / SECONDS_PER_MINUTE
    per_minute = length * block.value["F"] / state.unit
    if 0.0 < per_minute < LINUXCNC_SLOWEST:
        text = f"G93 asks for less than {LINUXCNC_SLOWEST:g} units/min, and keeps its time; LinuxCNC takes {LINUXCNC_SLOWEST:g}"
        findings.assume(text, block.line, block.at["F"])
