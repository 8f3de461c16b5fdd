"""Auxiliary time: tool changes, the spindle, M codes. Times of the machine file, counted in the program.

A plan is the motion of the axes; its cycle time holds the dwells of the program (G4) and nothing that the
axes do not do. How long a tool change or a spindle takes only the machine file can say (`[times]`). With its
times

    total = cycle time + sum over what is counted of (how often x how long),

and what is counted and has no time is named, not guessed. The spindle is followed through the program: it
starts at an M3 or M4 that finds it standing or turning the other way, which is a stop as well, and stops at
an M5 that finds it turning. A tool change (M6) stops it within its own time, so that an M3 after it is a
start. M62, M63 and M67 happen with the motion and take no time. What waits for a person or a temperature has
no time unless `m_codes` names it. Of plotter files the pen takes its times in the motion (`[plotter]`).

Not counted at all: the spindle turning faster or slower (S words), T words without M6, M2 and M30, and what
the control itself takes.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine, Times
from planner.nc.program import EventTable, Program

TOOL_CHANGE = 6  # M code
_TURNS = {3: 1, 4: -1, 5: 0, TOOL_CHANGE: 0}  # M codes, and how the spindle turns after them
_WITH_THE_MOTION = (62, 63, 67)  # signals that the control sets at the next move
NO_TIME = "no time in the machine file"
_WAITS = {0: "a person", 1: "a person", 60: "a person", 109: "a temperature", 116: "a temperature",
          190: "a temperature", 191: "a temperature"}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Beside:
    """One kind of things that happen while the axes stand still."""

    what: str  # its name, in the singular: "tool change", "spindle start", "M8"
    count: int  # how often
    each: float | None  # how long it takes [s]; None where that is not known
    because: str = ""  # why it is not known

    @property
    def seconds(self) -> float:
        """How long all of them take [s]; 0 where it is not known."""
        return 0.0 if self.each is None else self.count * self.each


def beside_motion(program: Program, machine: Machine) -> tuple[Beside, ...]:
    """The events beside the motion of a program, and how long they take on a machine."""
    times = machine.times or Times()
    _, code = codes_of(program, "M")
    starts, stops = (0, 0) if program.pen else _of_spindle(code)
    counted = [
        ("tool change", int((code == TOOL_CHANGE).sum()), times.tool_change),
        ("spindle start", starts, times.spindle_start),
        ("spindle stop", stops, times.spindle_stop),
    ]
    found = [
        Beside(what=what, count=count, each=each, because=NO_TIME) for what, count, each in counted if count
    ]
    others, counts = np.unique(code[~np.isin(code, [*_TURNS, *_WITH_THE_MOTION])], return_counts=True)
    for number, count in zip(others.tolist(), counts.tolist(), strict=True):
        name = f"M{number:g}"
        each = times.m_codes.get(name, None if number in _WAITS else times.m_code)
        why = f"waits for {_WAITS[number]}" if number in _WAITS else NO_TIME
        found.append(Beside(what=name, count=count, each=each, because=why))
    return tuple(found)


def codes_of(program: Program, letter: str) -> tuple[Array, FloatArray]:
    """Block (K,) and number (K,) of the events of a letter, "M" or "T", in their order."""
    events = program.events
    if isinstance(events, EventTable):
        which = events.letter == ord(letter)
        return events.block[which], events.value[which]
    found = [(event.block, float(event.text[1:])) for event in events if event.text[0] == letter]
    block, value = np.array(found, dtype=np.float64).reshape(-1, 2).T
    return block.astype(np.int64), value


def _of_spindle(code: Array) -> tuple[int, int]:
    """How often the spindle starts, and how often it stops by itself, by the M codes of a program (E,)."""
    seen = code[np.isin(code, list(_TURNS))]
    after = np.array([_TURNS[int(number)] for number in seen])
    before = np.append(0, after)[: len(after)]
    changed = after != before
    by_itself = changed & (before != 0) & (seen != TOOL_CHANGE)
    return int((changed & (after != 0)).sum()), int(by_itself.sum())
