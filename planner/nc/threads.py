"""Motion in step with the spindle: G33, G33.1 and the threading cycle G76 (thread_cycle.py).

The tool advances K (pitch of G33) or P (of G76) along its path in each turn, so that S gives the feed. A plan starts and ends at rest:
with full stops at both ends of the cut the feed is reached behind the run-in and held up to the run-out, whose lengths the machine's
acceleration and jerk give (geometry/run_in.py, which refuses a cut without room for them; the verdict looks at the feed between).
LinuxCNC accelerates in the synchronised move, too. G33.1 taps: along the thread and back to its start.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc import codes, moves, thread_cycle
from planner.nc.block import Block
from planner.nc.faults import Findings
from planner.nc.moves import WordFault
from planner.nc.program import Kind
from planner.nc.state import State
from planner.nc.store import Store

_AND_BACK = 331  # G33.1


def thread(state: State, store: Store, block: Block, found: Findings) -> None:
    """G33, or G33.1 with its way back. Raises WordFault for words that are missing or impossible."""
    name = f"G{codes.number(state.motion)}"
    if block.value.get("K", 0.0) == 0.0:
        raise WordFault(block.motion_word(), f"{name} needs its pitch as a K word, on each line")
    faster = block.value.get("I", 1.0)
    if not faster > 0:
        raise WordFault(block.at["I"], "I of G33.1, how much faster the way back is, must be above 0")
    feed = _feed(state, block, abs(block.value["K"]))
    target, start = moves.target(state, block), state.position.copy()
    _cut(state, store, block.line, target, feed)
    if state.motion == _AND_BACK:
        stop(state, store, block.line)
        state.in_thread = True
        _cut(state, store, block.line, start, feed * faster)
    _say(state, block, found)


def cut_thread(state: State, store: Store, block: Block, found: Findings) -> None:
    """G76. Raises WordFault for words that are missing or impossible."""
    target, here = moves.target(state, block), state.programmed()
    state.position[:], there = target, state.position.copy()
    end = float(state.programmed()[2])
    state.position[:] = there
    passes = thread_cycle.passes(thread_cycle.read_thread(state, block, end))
    feed = _feed(state, block, 1.0)
    for cut in passes:
        place = state.machine(np.array([cut.x * state.unit, here[1], cut.z * state.unit]))
        if cut.pitch:
            _cut(state, store, block.line, place, cut.pitch * feed)
        else:
            _rapid(state, store, block.line, place)
    _rapid(state, store, block.line, target)
    _say(state, block, found)


def stop(state: State, store: Store, line: int) -> None:
    """A full stop before or after a cut."""
    store.make_room(1)
    store.add(Kind.STOP, line, state)
    state.in_thread = False


def _cut(state: State, store: Store, line: int, target: FloatArray, feed: float) -> None:
    """A straight move in step with the spindle."""
    if not state.in_thread:
        stop(state, store, line)
    programmed, state.feed = state.feed, feed
    state.position[:], state.actual = target, None
    store.make_room(1)
    store.synchronised.append(store.blocks)
    store.add(Kind.LINE, line, state)
    state.feed, state.in_thread = programmed, True


def _rapid(state: State, store: Store, line: int, place: FloatArray) -> None:
    if state.in_thread:
        stop(state, store, line)
    if (place != state.place).any():
        state.position[:], state.actual = place, None
        store.make_room(1)
        store.add(Kind.RAPID, line, state)


def _say(state: State, block: Block, found: Findings) -> None:
    found.note(
        f"G{codes.number(state.motion)} is in step with the spindle: its feed is pitch times S, between a run-in and a run-out "
        "that begin and end with full stops",
        block.line,
    )


def _feed(state: State, block: Block, pitch: float) -> float:
    """The feed [mm/s] of so many programmed units in a turn. Raises WordFault if the spindle has no speed that is known."""
    name, spindle = f"G{codes.number(state.motion)}", state.spindle
    if spindle.surface_speed:
        raise WordFault(
            block.motion_word(),
            f"{name} under a constant surface speed (G96) has no feed that is known; write G97 and S",
        )
    if not spindle.turning or not spindle.speed > 0:
        raise WordFault(
            block.motion_word(), f"{name} needs the spindle turning; write S and M3 or M4 before it"
        )
    return pitch * state.unit * spindle.speed / SECONDS_PER_MINUTE
