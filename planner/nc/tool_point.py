"""The tool centre point of a program: G43.4 and G49, M428 and M429, M128 and M129 on a machine with
kinematics.

While it is on, x, y, z of the program are the controlled point p of machine/kinematics/chain.py: the tool's
tip as seen from the workpiece, with the tool's length in z (of the tool offset in force, else `tool_length`).
While it is off they are the joints q. The switch moves nothing. The program that is planned is one of p
throughout. A move with the switch off is the same move of p where both rotary axes stand at 0; a rapid move
elsewhere is a straight line of q, in chords that p leaves by `CHORD_SHARE` of the tolerance; a feed move
elsewhere is refused.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine
from planner.machine.kinematics.chain import LINEAR, Chain, kinematics_of
from planner.nc.block_table import BlockTable
from planner.nc.moves import Block
from planner.nc.program import FEED_MOVES, MOVES, Kind, PathControl, Program, ToolPoint, divided
from planner.nc.settings import TOOL_POINT_ON
from planner.nc.state import LETTERS, State

CHORD_SHARE = 0.1  # of the tolerance, that a rapid move of the joints leaves its chords by [-]
CHORDS = 2 ** np.arange(15)  # of one move: enough for a turn at 1e4 mm from the axis and a tolerance of 1 um
G43_4, CANCELLED = 434, (430, 431, 432, 490)  # tool length codes, ten times; the others switch G43.4 off
_JOINT_PLACES = {280: "G28", 300: "G30", 530: "G53"}  # one-shots whose coordinates are those of the joints


class Switch(NamedTuple):
    """From a block on: the word that switched it on, "" where it is off, and the tool's length [mm]."""

    block: int
    line: int
    word: str
    length: float


class ToolPointSwitch:
    """Follows the switch through a program; does nothing on machines without kinematics."""

    def __init__(self, machine: Machine | None) -> None:
        self.chain = kinematics_of(machine) if machine is not None and machine.kinematics else None
        self.switches: list[Switch] = []  # so far

    def take(self, state: State, table: BlockTable, block: Block) -> None:
        """Follow the words of a block. Raises WordFault without kinematics, and for a tool off its axis."""
        tool = block.g.get("tool length")
        if tool == G43_4 and self.chain is None:
            needs = "the tool centre point (G43.4) needs a machine with a table [kinematics]"
            raise block.fault(f"{needs}; add it to the machine file", "tool length")
        now = self.on
        if tool == G43_4:
            now = "G43.4"
        elif tool in CANCELLED and now == "G43.4":
            now = ""
        if block.tool_point is not None:
            now = f"M{block.tool_point}" if block.tool_point in TOOL_POINT_ON else ""
        if self.chain is None or (now == self.on and tool is None):
            return
        length = float(state.tool_offset[2]) or self.chain.data.tool_length
        if now and state.tool_offset[:2].any():
            text = "the tool centre point needs a tool on the spindle's axis; this has an offset in x or y"
            raise block.fault(text, "tool point" if block.tool_point is not None else "tool length")
        state.at_tip = bool(now)
        if now != self.on or (now and length != self.switches[-1].length):
            self._move(state, now, length)
            self.switches.append(Switch(table.blocks, block.line, now, length))

    def check(self, state: State, block: Block, before: FloatArray) -> None:
        """Raise WordFault for a move to a place of the joints while the switch is on, unless both rotary axes
        stand at 0, where they were `before` (A,), too."""
        code = block.g.get("one-shot", 0)
        turned = before[state.turns].any() or state.position[state.turns].any()
        if self.on and code in _JOINT_PLACES and turned:
            text = f"the tool centre point is on ({self.on}) and a rotary axis is not at 0, and {_JOINT_PLACES[code]}"
            remedy = "switch the tool centre point off before it (G49, M429, M129)"
            raise block.fault(f"{text} goes to a place of the joints; {remedy}", "one-shot")

    @property
    def on(self) -> str:
        """The word that has it on; empty where it is off."""
        return self.switches[-1].word if self.switches else ""

    def _move(self, state: State, now: str, length: float) -> None:
        """The coordinates of the place where the joints stand, on the other side of the switch."""
        assert self.chain is not None
        scale = np.where(state.turns, RAD_PER_DEG, 1.0)
        here = zip(state.letters.lower(), (state.position * scale).tolist(), strict=True)
        place = dict.fromkeys("abc", 0.0) | dict(here)
        if self.on:
            place |= self.chain.with_tool(self.switches[-1].length).joints(place)
        if now:
            place |= self.chain.with_tool(length).point(place)
        state.position[:3] = [place[letter] for letter in LINEAR]


def at_the_tip(program: Program, switch: ToolPointSwitch, machine: Machine | None) -> Program:
    """The program as one of the controlled point throughout, if the tool centre point is on somewhere while
    rotary axes are off 0; else the program itself. Raises InputError for feed moves while it is off and a
    rotary axis is off 0, and for tools of two lengths."""
    on = np.zeros(len(program), dtype=bool)  # the blocks that are run with the switch on
    for change in switch.switches:
        on[change.block :] = bool(change.word)
    tilted = _tilted(program, switch.chain)
    moves_on = (on & np.isin(program.kind, MOVES)).any()
    if switch.chain is None or machine is None or not moves_on or not tilted.any():
        return program
    first = _tool_of(program, switch.switches)
    whole = _with_axes(program, switch.chain.axes)
    made = _in_pieces(whole, ~on & tilted, switch.chain.with_tool(first.length), machine.tolerance)
    off = int((~on & tilted & (program.kind == Kind.RAPID)).sum())
    text = f"line {first.line}: the tool centre point is on ({first.word}), x, y, z are of the tip of a tool of {first.length:g} mm"
    if off:
        text += f"; {off:,} rapid moves with it off and a rotary axis off 0 are straight lines of the joints"
    point = ToolPoint(word=first.word, line=first.line, length=first.length, rapids_off=off)
    return dataclasses.replace(made, tool_point=point, notes=(*program.notes, text))


def _tilted(program: Program, chain: Chain | None) -> Array:
    """(B,) True for the blocks at whose start or end a rotary axis of the kinematics is off 0."""
    rotary = chain.data.rotary if chain is not None else ()
    columns = [k for k, letter in enumerate(program.axes) if letter in rotary]
    turned: Array = np.any(np.vstack([program.start, program.end])[:, columns], axis=1)
    return np.logical_or(turned[1:], turned[:-1])


def _tool_of(program: Program, switches: list[Switch]) -> Switch:
    """The switch that moves are made under. Raises InputError if there are two lengths of tools."""
    ends = [*(s.block for s in switches[1:]), len(program)]
    of_moves = np.isin(program.kind, MOVES)
    used = [s for s, end in zip(switches, ends, strict=True) if s.word and of_moves[s.block : end].any()]
    for switch in used:
        if switch.length != used[0].length:
            text = (
                f"the tool centre point is on with a tool of {switch.length:g} mm, and from line {used[0].line} on with one of "
                f"{used[0].length:g} mm; one length is planned at a time: plan the part of each tool as a program of its own"
            )
            raise InputError(text, source=program.source, line=switch.line)
    return used[0]


def _with_axes(program: Program, axes: tuple[str, ...]) -> Program:
    """The program with all axes of the kinematics, those at 0 that it does not move."""
    letters = LINEAR + tuple(c.lower() for c in LETTERS if c.lower() in (*program.axes, *axes))
    if letters == program.axes:
        return program

    def widened(values: FloatArray) -> FloatArray:
        wide = np.zeros((*values.shape[:-1], len(letters)))
        wide[..., [letters.index(letter) for letter in program.axes]] = values
        return wide

    return dataclasses.replace(
        program,
        axes=letters,
        start=widened(program.start),
        end=widened(program.end),
        arc_center=widened(program.arc_center),
        splines=dataclasses.replace(program.splines, points=widened(program.splines.points)),
    )


def _in_pieces(program: Program, off: Array, chain: Chain, tolerance: float) -> Program:
    """The program with ends in p, its rapid moves of the joints, among the blocks `off` (B,), in chords."""
    if not off.any():
        return program
    feed = np.flatnonzero(off & np.isin(program.kind, FEED_MOVES))
    if len(feed):
        text = (
            "a feed move with the tool centre point off while a rotary axis is off 0: there only rapid moves (G0) are planned with "
            f"it off ({len(feed):,} such moves); switch the tool centre point on before it (G43.4, M428, M128, TRAORI), or turn "
            "the rotary axes to 0"
        )
        raise InputError(text, source=program.source, line=int(program.line[feed[0]]))
    given = program.tolerance[np.isfinite(program.tolerance)]
    within = CHORD_SHARE * min(tolerance, float(given.min(initial=np.inf)))
    end = program.end.copy()
    end[off] = _of(chain.point, program.axes, program.end[off])
    ends = [end[k : k + 1] for k in range(len(program))]
    for k in np.flatnonzero(off & (program.kind == Kind.RAPID)).tolist():
        begin = _of(chain.joints, program.axes, (end[k - 1] if k else program.start)[None])
        for count in CHORDS.tolist():  # a straight line of the joints
            share = np.linspace(0.0, 1.0, 2 * count + 1)[:, None]
            places = _of(chain.point, program.axes, begin + share * (program.end[k] - begin))
            bow = places[1::2] - 0.5 * (places[:-1:2] + places[2::2])
            if float(np.linalg.norm(bow, axis=1).max()) <= within:
                break
        ends[k] = places[2::2]
    block = np.repeat(np.arange(len(program)), [len(pieces) for pieces in ends])
    inner = np.append(block[1:] == block[:-1], False)
    control = np.where(inner, PathControl.BLEND, program.path_control[block])
    return divided(program, block, end=np.concatenate(ends), path_control=control)


def _of(function: Callable[[dict[str, Any]], Any], axes: tuple[str, ...], places: FloatArray) -> FloatArray:
    """(n, A) places of the joints or of p from those (n, A) of the other."""
    found, new = places.copy(), function({letter: places[:, k] for k, letter in enumerate(axes)})
    for letter in LINEAR:
        found[:, axes.index(letter)] = new[letter]
    return found
