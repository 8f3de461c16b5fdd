"""Motion in step with the spindle: G33, G33.1 (along the thread and back) and the threading cycle G76.

The tool advances K (pitch of G33) or P (of G76) along its path in each turn, so that S gives the feed. With
full stops at both ends of the cut the feed is reached behind the run-in and held up to the run-out
(geometry/run_in.py). G76 cuts from the drive line (x0, z0) to the depth K below the thread's peak at x0 + I,
in passes of the depths

    d_n = J n^(1/R)  while below K,   then K once and for each of the H spring passes

In the direction s = sign(I) of x and t of z, pass d is the last pass moved back by K - d, at the compound
angle Q along z:

    from  z0 + t d tan Q  to  z1 - t (K - d) tan Q,   cut at x0 + s (|I| + d),   cleared at x0 - s (K - d)

Tapers of length E at its entry (L1), its end (L2) or both (L3) lead between the peak line of the pass and its
depth; on them the pitch along z stays P.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc import codes, moves
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings
from planner.nc.moves import Block, integer
from planner.nc.program import Kind
from planner.nc.state import State
from planner.nc.turning import Leg

PASSES_MAX = 10_000  # of a thread: more are a mistake in J or H
ANGLE_MAX = 80.0  # of the compound slide [degrees], as LinuxCNC's manual has it
_ENTRY, _END = 1, 2  # bits of L
_NEEDED = {
    "P": "the pitch",
    "I": "from the drive line to the thread's peak, below 0 for an outer thread",
    "J": "the depth of the first pass",
    "K": "the full depth of the thread",
}
_AND_BACK = 331  # G33.1


@dataclass(frozen=True)
class Thread:
    """A thread in programmed coordinates and units, x and depths as radii."""

    start: tuple[float, float]  # (x, z) of the drive line
    end: float  # z of its end
    peak: float  # I, from the drive line to the thread's peak
    depth: float  # K
    first: float  # J
    pitch: float  # P
    degression: float = 1.0  # R
    angle: float = 0.0  # Q [degrees]
    taper: float = 0.0  # E
    tapered: int = 0  # L
    springs: int = 0  # H


def depths(thread: Thread) -> Iterator[float]:
    """Depths of the passes, spring passes included."""
    depth, number, peak = thread.first, 1, abs(thread.peak)
    while peak + depth < peak + thread.depth:  # rounded as LinuxCNC rounds, which counts from the drive line
        yield depth
        number += 1
        depth = thread.first * number ** (1.0 / thread.degression)
    for _ in range(1 + thread.springs):
        yield thread.depth


def passes(thread: Thread) -> Iterator[Leg]:
    """The moves of the thread, all passes; points are z + i x."""
    inwards = math.copysign(1.0, thread.peak)
    ahead = 1.0 if thread.end > thread.start[1] else -1.0
    slope = math.tan(math.radians(thread.angle))
    tapered = thread.tapered if thread.taper > 0 else 0
    aslant = thread.pitch * math.hypot(thread.depth, thread.taper) / thread.taper if tapered else 0.0
    for depth in depths(thread):
        left = thread.depth - depth
        clear = thread.start[0] - inwards * left
        peak, cut = clear + thread.peak, thread.start[0] + thread.peak + inwards * depth
        first, last = thread.start[1] + ahead * depth * slope, thread.end - ahead * left * slope
        yield Leg(complex(first, clear), fast=True)
        if tapered & _ENTRY:
            yield Leg(complex(first, peak), pitch=aslant)
            yield Leg(complex(first + ahead * thread.taper, cut), pitch=aslant)
        else:
            yield Leg(complex(first, cut), fast=True)
        if tapered & _END:
            yield Leg(complex(last - ahead * thread.taper, cut), pitch=thread.pitch)
            yield Leg(complex(last, peak), pitch=aslant)
        else:
            yield Leg(complex(last, cut), pitch=thread.pitch)
        yield Leg(complex(last, clear), fast=True)


def read_thread(state: State, block: Block, end: float) -> Thread:
    """The thread of a G76 from the present place to z = `end` [mm]. Raises WordFault for its words."""
    value = block.value
    for letter, what in _NEEDED.items():
        block.require(letter in value, f"G76 needs {letter}: {what}")
    for letter in "PI":
        block.require(value[letter] != 0, f"{letter} of G76 must not be 0: {_NEEDED[letter]}", letter)
    text = "J of G76, the depth of the first pass, must be above 0 and below K, the full depth"
    block.require(0 < value["J"] < value["K"], text, "J")
    text = f"Q of G76, the compound angle, must be from 0 to {ANGLE_MAX:g} degrees"
    block.require(0 <= value.get("Q", 0.0) <= ANGLE_MAX, text, "Q")
    here = state.programmed() / state.unit
    part = 0.5 if state.diameters else 1.0
    thread = Thread(
        start=(float(here[0]), float(here[2])),
        end=end / state.unit,
        peak=part * value["I"],
        depth=part * value["K"],
        first=part * value["J"],
        pitch=abs(value["P"]),
        degression=max(value.get("R", 1.0), 1.0),
        angle=value.get("Q", 0.0),
        taper=value.get("E", 0.0),
        tapered=integer(block, "L", 0) if "L" in value else 0,
        springs=integer(block, "H", 0) if "H" in value else 0,
    )
    text = "L of G76 must be 0 (no taper), 1 (entry), 2 (end) or 3 (both)"
    block.require(thread.tapered <= _ENTRY + _END, text, "L")
    count = (thread.depth / thread.first) ** thread.degression + thread.springs
    block.require(count <= PASSES_MAX, f"G76 makes more than {PASSES_MAX} passes; correct J, R or H")
    return thread


def thread(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """G33, or G33.1 with its way back. Raises WordFault for words that are missing or impossible."""
    name = f"G{codes.number(state.motion)}"
    block.require(block.value.get("K", 0.0) != 0.0, f"{name} needs its pitch as a K word, on each line")
    faster = block.value.get("I", 1.0)
    block.require(faster > 0, "I of G33.1, how much faster the way back is, must be above 0", "I")
    feed = _feed(state, block, abs(block.value["K"]))
    target, start = moves.target(state, block), state.position.copy()
    _cut(state, table, block.line, target, feed)
    if state.motion == _AND_BACK:
        stop(state, table, block.line)
        state.in_thread = True
        _cut(state, table, block.line, start, feed * faster)
    _say(state, block, findings)


def cut_thread(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """G76. Raises WordFault for words that are missing or impossible."""
    target, here = moves.target(state, block), state.programmed()
    state.position[:], there = target, state.position.copy()
    end = float(state.programmed()[2])
    state.position[:] = there
    read = read_thread(state, block, end)
    feed = _feed(state, block, 1.0)
    for cut in passes(read):
        here[[0, 2]] = cut.end.imag * state.unit, cut.end.real * state.unit
        place = np.append(state.machine(here)[:3], state.position[3:])
        if cut.pitch:
            _cut(state, table, block.line, place, cut.pitch * feed)
        else:
            _rapid(state, table, block.line, place)
    _rapid(state, table, block.line, target)
    _say(state, block, findings)


def stop(state: State, table: BlockTable, line: int) -> None:
    """A full stop before or after a cut."""
    table.add(Kind.STOP, line, state)
    state.in_thread = False


def _cut(state: State, table: BlockTable, line: int, target: FloatArray, feed: float) -> None:
    if not state.in_thread:
        stop(state, table, line)
    programmed, state.feed = state.feed, feed
    state.position[:], state.actual = target, None
    table.synchronised.append(table.blocks)
    table.add(Kind.LINE, line, state)
    state.feed, state.in_thread = programmed, True


def _rapid(state: State, table: BlockTable, line: int, place: FloatArray) -> None:
    if state.in_thread:
        stop(state, table, line)
    if (place != state.place).any():
        state.position[:], state.actual = place, None
        table.add(Kind.RAPID, line, state)


def _say(state: State, block: Block, findings: Findings) -> None:
    text = "its feed is pitch times S, between a run-in and a run-out that begin and end with full stops"
    findings.note(f"G{codes.number(state.motion)} is in step with the spindle: {text}", block.line)


def _feed(state: State, block: Block, pitch: float) -> float:
    """Feed [mm/s] of programmed units in a turn. Raises WordFault if the spindle's speed is not known."""
    name, spindle = f"G{codes.number(state.motion)}", state.spindle
    text = f"{name} under a constant surface speed (G96) has no feed that is known; write G97 and S"
    block.require(not spindle.surface_speed, text)
    turns = bool(spindle.turning) and spindle.speed > 0
    block.require(turns, f"{name} needs the spindle turning; write S and M3 or M4 before it")
    return pitch * state.unit * spindle.speed / SECONDS_PER_MINUTE
