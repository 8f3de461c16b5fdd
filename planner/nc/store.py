"""Growing arrays of the blocks and events of a program while it is read; `finish` makes the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import LINEAR_AXES
from planner.nc.arcs import Arc
from planner.nc.events import EventTable
from planner.nc.program import Kind, Program
from planner.nc.state import State


class Store:
    """Blocks and events so far. The arrays have room to spare; `blocks` and `events` say how much is used.

    The compiled loop over plain rows writes into the arrays directly and sets the counts.
    """

    def __init__(self, rows: int, words: int):
        self.blocks = 0
        self.events = 0
        self.refusals = 0
        self.kind = np.empty(rows, dtype=np.uint8)
        self.end = np.empty((rows, 3))
        self.feed = np.empty(rows)
        self.line = np.empty(rows, dtype=np.int32)
        self.path_control = np.empty(rows, dtype=np.uint8)
        self.tolerance = np.empty(rows)
        self.event_block = np.empty(rows, dtype=np.int64)
        self.event_line = np.empty(rows, dtype=np.int32)
        self.event_letter = np.empty(rows, dtype=np.uint8)
        self.event_value = np.empty(rows)
        self.refused_word = np.empty(words, dtype=np.int64)  # found by the compiled loop
        self.dwells: list[tuple[int, float]] = []
        self.arcs: list[tuple[int, FloatArray, int, float]] = []

    def make_room(self, rows: int) -> None:
        """Make sure that `rows` more blocks and `rows` more events fit."""
        if self.blocks + rows > len(self.kind):
            for name in ("kind", "end", "feed", "line", "path_control", "tolerance"):
                setattr(self, name, _grown(getattr(self, name), self.blocks + rows))
        if self.events + rows > len(self.event_block):
            for name in ("event_block", "event_line", "event_letter", "event_value"):
                setattr(self, name, _grown(getattr(self, name), self.events + rows))

    def add(self, kind: Kind, line: int, state: State) -> None:
        """Append a block that ends at the state's position."""
        k = self.blocks
        self.kind[k] = kind
        self.end[k] = state.position
        self.feed[k] = state.feed if kind in (Kind.LINE, Kind.ARC) else np.inf
        self.line[k] = line
        self.path_control[k] = state.path_control
        self.tolerance[k] = state.tolerance
        self.blocks += 1

    def add_arc(self, arc: Arc, line: int, state: State) -> None:
        self.arcs.append((self.blocks, arc.centre, state.normal, arc.sweep))
        self.add(Kind.ARC, line, state)

    def add_dwell(self, seconds: float, line: int, state: State) -> None:
        """A dwell; one of no duration is a full stop."""
        if seconds > 0:
            self.dwells.append((self.blocks, seconds))
        self.add(Kind.DWELL if seconds > 0 else Kind.STOP, line, state)

    def add_event(self, letter: str, value: float, line: int) -> None:
        k = self.events
        self.event_block[k] = self.blocks
        self.event_line[k] = line
        self.event_letter[k] = ord(letter)
        self.event_value[k] = value
        self.events += 1

    def finish(self, source: str, notes: Sequence[str]) -> Program:
        """The program read so far; the arrays are cut to size, so that the spare room is given back."""
        used, seen = slice(0, self.blocks), slice(0, self.events)
        dwell = np.zeros(self.blocks)
        for block, seconds in self.dwells:
            dwell[block] = seconds
        return Program(
            source=source,
            axes=LINEAR_AXES,
            start=np.zeros(3),
            kind=self.kind[used].copy(),
            end=self.end[used].copy(),
            feed=self.feed[used].copy(),
            dwell=dwell,
            line=self.line[used].copy(),
            path_control=self.path_control[used].copy(),
            tolerance=self.tolerance[used].copy(),
            arc_block=np.array([arc[0] for arc in self.arcs], dtype=np.int64),
            arc_center=np.array([arc[1] for arc in self.arcs]).reshape(-1, 3),
            arc_normal=np.array([arc[2] for arc in self.arcs], dtype=np.int64),
            arc_sweep=np.array([arc[3] for arc in self.arcs]),
            events=EventTable(
                block=self.event_block[seen].copy(),
                line=self.event_line[seen].copy(),
                letter=self.event_letter[seen].copy(),
                value=self.event_value[seen].copy(),
            ),
            notes=tuple(notes),
        )


def _grown(array: Array, needed: int) -> Array:
    wider = np.empty((max(needed, 2 * len(array)), *array.shape[1:]), dtype=array.dtype)
    wider[: len(array)] = array
    return wider
