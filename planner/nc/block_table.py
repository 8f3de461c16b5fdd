"""Growing arrays of the blocks and events of a program while it is read; `finish` makes the record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import RAD_PER_DEG
from planner.nc.arcs import Arc
from planner.nc.faults import Notes
from planner.nc.program import FEED_MOVES, EventTable, Frame, Kind, Origins, Program, SplineTable
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.state import DEGREES, State, straight_feed

_COPIED = ("kind", "feed", "line", "path_control", "tolerance")  # columns that are fields of `Program`


class BlockColumns(NamedTuple):
    """The blocks of a program, fields of `Program`, with room to spare."""

    kind: Array  # uint8
    end: FloatArray  # (., A) of the axes that are read, in mm and degrees
    feed: FloatArray
    line: Array  # int32
    path_control: Array  # uint8
    tolerance: FloatArray
    frame: Array  # int32


class EventColumns(NamedTuple):
    """The events of a program, fields of `EventTable`, with room to spare."""

    block: Array  # int64
    line: Array  # int32
    letter: Array  # uint8
    value: FloatArray


class BlockTable:
    """Blocks and events so far. The columns have room to spare; `blocks` and `events` say how much is used.
    New blocks stand in the call `frame`. The compiled loop over plain rows writes into the columns directly
    and sets the counts."""

    def __init__(self, axes: int = 3) -> None:
        self.blocks = 0
        self.events = 0
        self.refusals = 0
        self.frame = 0
        uint8, int32, int64 = (np.empty(0, dtype=dtype) for dtype in (np.uint8, np.int32, np.int64))
        real = np.empty(0)
        self.block = BlockColumns(uint8, np.empty((0, axes)), real, int32, uint8, real, int32)
        self.event = EventColumns(int64, int32, uint8, real)
        self.refused_word = int64  # found by the compiled loop
        self.dwells: list[tuple[int, float]] = []
        self.splines: list[tuple[int, FloatArray, FloatArray]] = []
        self.arcs: list[tuple[int, FloatArray, int, float]] = []
        self.synchronised: list[int] = []
        self.origins: list[tuple[int, FloatArray, bool]] = []

    def begin(self, words: int) -> None:
        """Be ready for a chunk of so many words."""
        self.refusals = 0
        self.refused_word = np.empty(words, dtype=np.int64)

    def make_room(self, rows: int) -> None:
        """Make sure that `rows` more blocks and `rows` more events fit."""
        if self.blocks + rows > len(self.block.kind):
            self.block = BlockColumns(*(_grown(column, self.blocks + rows) for column in self.block))
        if self.events + rows > len(self.event.block):
            self.event = EventColumns(*(_grown(column, self.events + rows) for column in self.event))

    def add(self, kind: Kind, line: int, state: State) -> None:
        """Append a block that ends where the tool is."""
        self.make_room(1)
        block, k = self.block, self.blocks
        block.kind[k] = kind
        block.end[k] = state.place
        block.feed[k] = state.feed if kind in FEED_MOVES else np.inf
        if state.others and kind == Kind.LINE:
            step = block.end[k] - (block.end[k - 1] if k else 0.0)
            block.feed[k] = straight_feed(state.feed, step, state.turns, state.feed_unit, state.feeds_all)
        block.line[k] = line
        block.path_control[k] = state.path_control
        block.tolerance[k] = state.tolerance
        block.frame[k] = self.frame
        self.blocks += 1

    def add_arc(self, arc: Arc, normal: int, line: int, state: State) -> None:
        """Append an arc about a normal axis that ends where the tool is."""
        self.arcs.append((self.blocks, arc.centre, normal, arc.sweep))
        self.add(Kind.ARC, line, state)

    def add_spline(self, points: FloatArray, weights: FloatArray, line: int, state: State) -> None:
        """Append a spline to the state's position: points (K, 4, 3) [mm] and weights (K, 4) of its pieces."""
        self.splines += [(self.blocks, p, w) for p, w in zip(points, weights, strict=True)]
        self.add(Kind.SPLINE, line, state)

    def add_dwell(self, seconds: float, line: int, state: State) -> None:
        """A dwell; one of no duration is a full stop."""
        if seconds > 0:
            self.dwells.append((self.blocks, seconds))
        self.add(Kind.DWELL if seconds > 0 else Kind.STOP, line, state)

    def add_event(self, letter: str, value: float, line: int) -> None:
        """Append an event before the next block."""
        self.make_room(1)
        event, k = self.event, self.events
        event.block[k] = self.blocks
        event.line[k] = line
        event.letter[k] = ord(letter)
        event.value[k] = value
        self.events += 1

    def keep_origin(self, state: State) -> None:
        """Keep where programmed zero is from here on, if that has changed."""
        last = self.origins[-1] if self.origins else (0, np.zeros(3), False)
        if state.rotated != last[2] or not np.array_equal(state.offset[:3], last[1]):
            self.origins.append((self.blocks, state.offset[:3].copy(), state.rotated))

    def finish(
        self,
        source: str,
        notes: Notes,
        frames: Sequence[Frame] = (),
        reading: Reading = AS_USUAL,
        letters: str = "XYZ",
    ) -> Program:
        """The program read so far; the arrays are cut to size, so that the spare room is given back.

        frames  : the calls that the blocks stand in, for an expanded program
        letters : of the axes that are read; x, y, z and those that move become axes of the program, rotary
                  ones in rad
        """
        used, seen = slice(0, self.blocks), slice(0, self.events)
        dwell = np.zeros(self.blocks)
        for block, seconds in self.dwells:
            dwell[block] = seconds
        columns = [k for k in range(len(letters)) if k < 3 or self.block.end[used, k].any()]
        end = self.block.end[used][:, columns]
        end[:, [letters[k] in DEGREES for k in columns]] *= RAD_PER_DEG
        others = len(columns) - 3
        centres = np.array([arc[1][:3] for arc in self.arcs]).reshape(-1, 3)
        of_spline = np.array([block for block, _, _ in self.splines], dtype=np.int64)
        points = np.array([points for _, points, _ in self.splines]).reshape(-1, 4, 3)
        still = np.repeat(end[of_spline, None, 3:], 4, axis=1)  # the other axes stand along a spline
        points = np.concatenate([points, still], axis=2)
        weights = np.array([weights for _, _, weights in self.splines]).reshape(-1, 4)
        of_origin, offset, turned = ([origin[k] for origin in self.origins] for k in range(3))
        return Program(
            source=source,
            axes=tuple(letters[k].lower() for k in columns),
            start=np.zeros(len(columns)),
            end=end,
            dwell=dwell,
            **{name: getattr(self.block, name)[used].copy() for name in _COPIED},
            synchronised=np.array(self.synchronised, dtype=np.int64),
            arc_block=np.array([arc[0] for arc in self.arcs], dtype=np.int64),
            arc_center=np.pad(centres, ((0, 0), (0, others))),
            arc_normal=np.array([arc[2] for arc in self.arcs], dtype=np.int64),
            arc_sweep=np.array([arc[3] for arc in self.arcs]),
            splines=SplineTable(block=of_spline, points=points, weights=weights),
            events=EventTable(**{name: column[seen].copy() for name, column in self.event._asdict().items()}),
            origins=Origins(
                block=np.array(of_origin), offset=np.array(offset).reshape(-1, 3), turned=np.array(turned)
            ),
            notes=notes.assumptions + notes.others,
            assumptions=notes.assumptions,
            reading=reading,
            frame=self.block.frame[used].copy() if frames else np.zeros(0, dtype=np.int32),
            frames=tuple(frames),
        )


def _grown(array: Array, needed: int) -> Array:
    wider = np.empty((max(needed, 2 * len(array)), *array.shape[1:]), dtype=array.dtype)
    wider[: len(array)] = array
    return wider
