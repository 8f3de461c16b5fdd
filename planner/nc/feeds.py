"""What F means, and the feed of a move: in length per minute (G94), per turn of the spindle (G95) or as one over minutes (G93).

    G94    feed = F
    G95    feed = F S                 S in revolutions per minute
    G93    feed = length F            F on every line that moves at a feed

A change of the mode forgets the feed. With G96 S is a surface speed: the turns, and with them the feed of G95, depend on the diameter
that is being cut, and are refused.
"""

from __future__ import annotations

from collections.abc import Callable

from planner.base.units import SECONDS_PER_MINUTE
from planner.nc import codes
from planner.nc.block import Block
from planner.nc.moves import WordFault
from planner.nc.state import FeedMode, State

Note = Callable[[str, int], None]

_MODES: dict[int, FeedMode] = {930: "inverse time", 940: "per minute", 950: "per turn"}
_SLOWEST = (
    0.1  # feed of a block under G93, at least [programmed units per minute]: as LinuxCNC has it, and never 0
)


def set_feed(state: State, block: Block, note: Note) -> None:
    """The feed mode and F of a block. Raises WordFault for an F that is not positive."""
    mode = _MODES[block.g["feed mode"]] if "feed mode" in block.g else state.feed_mode
    if mode != state.feed_mode:
        state.feed_mode, state.feed, state.feed_per_turn = mode, 0.0, 0.0
    if "F" not in block.value:
        return
    feed = block.value["F"]
    if not feed > 0:
        raise WordFault(
            block.at["F"], "a feed must be positive; write the feed of the moves that follow, such as F1000"
        )
    if mode == "inverse time":
        return
    if mode == "per minute":
        state.feed = feed * state.unit / SECONDS_PER_MINUTE
    else:
        state.feed_per_turn = feed * state.unit
    code = block.g.get("units")
    if code is not None and (code == 200) != (state.unit != 1.0):
        unit, per = "mm" if state.unit == 1.0 else "inch", mode.removeprefix("per ")
        note(
            f"F{feed:g} is {unit} per {per}: F acts before G{codes.number(code)} on the same line",
            block.line,
        )


def take_default(state: State, default: float | None, block: Block, note: Note) -> None:
    """The machine's feed [mm/s], if it has one, for a feed move before the first F word."""
    if not default or state.feed > 0 or state.motion == 0 or state.feed_mode != "per minute":
        return
    state.feed = default
    feed = default * SECONDS_PER_MINUTE / state.unit
    note(f"no feed before the first feed move: the machine's feed_default, F{feed:g}", block.line)


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
        if state.spindle.surface_speed:
            raise WordFault(
                word,
                f"{name} with a feed per turn (G95) under a constant surface speed (G96) has no feed that is known; "
                "write G97 and S, or G94 and F",
            )
        if not state.spindle.speed > 0:
            raise WordFault(
                word, f"{name} with a feed per turn (G95) needs a spindle speed; write an S word before it"
            )
        state.feed = state.feed_per_turn * state.spindle.speed / SECONDS_PER_MINUTE
    if not state.feed > 0:
        raise WordFault(
            word,
            f"{name} moves without a feed; write an F word on this line or before it, or feed_default into the machine file",
        )


def feed_of_time(state: State, block: Block, length: float) -> None:
    """Under G93 the feed of a block of this length [mm]."""
    if state.feed_mode == "inverse time":
        state.feed = max(length * block.value["F"], _SLOWEST * state.unit) / SECONDS_PER_MINUTE
