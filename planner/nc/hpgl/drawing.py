"""The blocks and events of a drawing while it is read; `finish` makes the record.

The pen is an event with a full stop, because it takes its time to rise and to fall: M3 down, M5 up, T a pen from the carousel. The
numbers are those of NC programs, so that the same drives, files and reports know them.

The circle through three points, for AT and RT.

With a = through - start and b = end - start the centre is start + c,

    c = ( (b_y |a|^2 - a_y |b|^2),  (a_x |b|^2 - b_x |a|^2) ) / (2 (a_x b_y - a_y b_x)),

and the arc turns left where a x b > 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import LINEAR_AXES
from planner.nc.events import EventTable
from planner.nc.faults import Notes
from planner.nc.program import Kind, PathControl, Program

# Three points are on a line where the area of their parallelogram is below this share of |a| |b| [-]: a radius of 1e9 times the chord.
ON_A_LINE = 1e-9


def circle_through(start: Point, through: Point, end: Point) -> tuple[Point, float] | None:
    """Centre [mm] and sweep [rad], counter-clockwise positive, of the arc from `start` through `through` to `end`.

    A full circle over the diameter start - through where the end is the start; None where the points are on a line.
    """
    ax, ay = through[0] - start[0], through[1] - start[1]
    bx, by = end[0] - start[0], end[1] - start[1]
    a, b = math.hypot(ax, ay), math.hypot(bx, by)
    if b == 0.0 and a > 0.0:
        return (start[0] + ax / 2.0, start[1] + ay / 2.0), 2.0 * math.pi
    cross = ax * by - ay * bx
    if abs(cross) <= ON_A_LINE * a * b:
        return None
    cx = (by * a * a - ay * b * b) / (2.0 * cross)
    cy = (ax * b * b - bx * a * a) / (2.0 * cross)
    angle = math.atan2(by - cy, bx - cx) - math.atan2(-cy, -cx)
    sweep = angle % (2.0 * math.pi)
    return (start[0] + cx, start[1] + cy), sweep if cross > 0 else sweep - 2.0 * math.pi


Point = tuple[float, float]

PEN_DOWN, PEN_UP, PEN_CHANGE = 3.0, 5.0, 6.0  # M3, M5 and M6


class Drawing:
    """Blocks so far: kinds, ends [mm], feeds [mm/s], dwells [s], and where in the source they stand [bytes]."""

    def __init__(self) -> None:
        self.kind: list[Kind] = []
        self.end: list[Point] = []
        self.feed: list[float] = []
        self.dwell: list[float] = []
        self.at: list[int] = []
        self.arcs: list[tuple[int, Point, float]] = []
        self.events: list[tuple[int, int, str, float]] = []

    def add(self, kind: Kind, end: Point, at: int, *, feed: float = math.inf, dwell: float = 0.0) -> None:
        """Append a block that ends at `end` [mm]; feed [mm/s], dwell [s], `at` its place in the source [bytes]."""
        self.kind.append(kind)
        self.end.append(end)
        self.feed.append(feed)
        self.dwell.append(dwell)
        self.at.append(at)

    def add_arc(self, centre: Point, sweep: float, end: Point, at: int, *, feed: float) -> None:
        """An arc about `centre` [mm]; sweep [rad], counter-clockwise positive."""
        self.arcs.append((len(self.kind), centre, sweep))
        self.add(Kind.ARC, end, at, feed=feed)

    def add_stop(self, where: Point, seconds: float, at: int) -> None:
        """A full stop, with a dwell if `seconds` is positive."""
        self.add(Kind.DWELL if seconds > 0 else Kind.STOP, where, at, dwell=seconds)

    def add_event(self, letter: str, value: float, at: int) -> None:
        """An event before the next block."""
        self.events.append((len(self.kind), at, letter, value))

    def finish(self, data: bytes, source: str, path_control: PathControl, notes: Notes) -> Program:
        """The program; `data` is the text it was read from."""
        blocks, arcs = len(self.kind), len(self.arcs)
        newline = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
        event_at = np.array([event[1] for event in self.events], dtype=np.int64)
        return Program(
            source=source,
            axes=LINEAR_AXES,
            start=np.zeros(3),
            kind=np.array(self.kind, dtype=np.uint8),
            end=_in_space(self.end),
            feed=np.array(self.feed, dtype=np.float64),
            dwell=np.array(self.dwell, dtype=np.float64),
            line=1 + np.searchsorted(newline, np.array(self.at, dtype=np.int64)),
            path_control=np.full(blocks, path_control),
            tolerance=np.full(blocks, np.nan),
            arc_block=np.array([arc[0] for arc in self.arcs], dtype=np.int64),
            arc_center=_in_space([arc[1] for arc in self.arcs]),
            arc_normal=np.full(arcs, 2),
            arc_sweep=np.array([arc[2] for arc in self.arcs]),
            events=EventTable(
                block=np.array([event[0] for event in self.events], dtype=np.int64),
                line=1 + np.searchsorted(newline, event_at),
                letter=np.array([ord(event[2]) for event in self.events], dtype=np.uint8),
                value=np.array([event[3] for event in self.events], dtype=np.float64),
            ),
            notes=notes.assumptions + notes.others,
            assumptions=notes.assumptions,
            pen=True,
        )


def _in_space(points: Sequence[Point]) -> FloatArray:
    """(n, 3) points in the x y plane."""
    space = np.zeros((len(points), 3))
    space[:, :2] = np.array(points, dtype=np.float64).reshape(-1, 2)
    return space
