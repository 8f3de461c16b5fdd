"""The record of an NC program: its blocks in arrays, all modal state resolved, in mm, s and rad.

There is one row for each *block that moves or dwells*. A source line can give several blocks (G28 through an
intermediate point) or none.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, TypeVar, overload

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.nc.reading import AS_USUAL, Reading

One = TypeVar("One")


class Kind(IntEnum):
    """Kinds of blocks."""

    RAPID = 0  # straight, at the axes' limits (G0)
    LINE = 1  # straight, at the programmed feed (G1)
    ARC = 2  # circular or helical (G2, G3)
    DWELL = 3  # stand still (G4)
    STOP = 4  # come to a full stop without a dwell: M0, M1, M2, M30, M6
    SPLINE = 5  # along a spline (G5, G5.1, G5.2, G6.2)


MOVES = (Kind.RAPID, Kind.LINE, Kind.ARC, Kind.SPLINE)  # kinds of blocks that move the machine
FEED_MOVES = MOVES[1:]  # without rapids


class PathControl(IntEnum):
    """How the joint at the end of a block is taken."""

    BLEND = 0  # G64: rounded within the tolerance
    EXACT_PATH = 1  # G61: on the path; a full stop unless tangent
    EXACT_STOP = 2  # G61.1: a full stop


def extruder_alone(program: Program) -> Array:
    """(B,) True for the blocks on which the extruder moves and nothing else."""
    if not len(program.extruded):
        return np.zeros(len(program), dtype=bool)
    alone: Array = (program.kind == Kind.STOP) & (program.extruded != 0.0)
    return alone


@dataclass(frozen=True, eq=False, kw_only=True)
class Event:
    """A word without influence on the motion (M3, S, T, M8 ...), with its place in the program."""

    block: int  # it happens before this block; equal to the number of blocks at the end of the program
    line: int  # 1-based source line
    text: str  # as normalised: "M3", "S12000", "T2"


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A call that was open while blocks were made; the main program is the first."""

    name: str  # what was called, as the program names it; empty for the main program
    source: str  # the file that the blocks' lines belong to
    line: int  # the line of the call, in the caller's file; 0 for the main program
    caller: int  # index of the calling frame; -1 for the main program


@dataclass(frozen=True, kw_only=True)
class Expansion:
    """Counts of the expansion of a program that computes."""

    dialect: str  # "linuxcnc", "fanuc", "heidenhain", "siemens"; "klipper" of macros, "apt"
    calls: tuple[tuple[str, int], ...]  # subprograms in the order of their first call, how often each
    turns: int  # turns of loops, jumps and calls
    rows: int  # lines executed, each as often as it was


@dataclass(frozen=True, kw_only=True)
class ToolPoint:
    """The tool centre point of a program that has it on (nc/tool_point.py): x, y and z are those of the tool's tip."""

    word: str  # what switched it on first: "G43.4", "M428", "M128"
    line: int  # where
    length: float  # of the tool, which z holds [mm]
    # rapid moves with it off and a rotary axis not at 0: chords of their paths of the tip
    rapids_off: int = 0


@dataclass(frozen=True, kw_only=True)
class SetLimit:
    """A limit that the program sets (nc/set_limits.py): "velocity" [mm/s, deg/s] or "acceleration" [mm/s2,
    deg/s2] of an axis, or "feed" [mm/s]."""

    quantity: str
    axis: str
    value: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Origins:
    """Where programmed zero is, from block to block: K rows, one for each change."""

    # (K,) the first block that it holds for, not decreasing; of several of one block the last holds
    block: Array
    offset: FloatArray  # (K, 3) its machine position: work offset, G92 and tool length together [mm]
    turned: Array  # (K,) whether the work system is rotated about z, so that adding `offset` is not enough

    def __post_init__(self) -> None:
        changes = len(self.block)
        freeze(self, "block", np.int64, (changes,))
        freeze(self, "offset", np.float64, (changes, 3))
        freeze(self, "turned", np.bool_, (changes,))

    def at(self, block: int) -> tuple[FloatArray, bool]:
        """Offset (3,) and rotation that hold for a block."""
        row = int(np.searchsorted(self.block, block, side="right")) - 1
        return (self.offset[row], bool(self.turned[row])) if row >= 0 else (np.zeros(3), False)


@dataclass(frozen=True, eq=False, kw_only=True)
class SplineTable:
    """K rational Bezier cubics (nc/bezier.py) over A axes, in the order of the program."""

    block: Array  # (K,) block of each, not decreasing: a block has one after the other
    points: FloatArray  # (K, 4, A) control points [mm], the first of a block where the block before ends
    weights: FloatArray  # (K, 4) > 0 [-]

    def __post_init__(self) -> None:
        pieces, _, axes = np.shape(self.points)
        freeze(self, "block", np.int64, (pieces,))
        freeze(self, "points", np.float64, (pieces, 4, axes))
        freeze(self, "weights", np.float64, (pieces, 4))
        if not (self.weights > 0).all():
            raise ValueError("Splines.weights: every weight must be positive")

    def __len__(self) -> int:
        return len(self.block)


def _nothing() -> FloatArray:
    return np.zeros(0)


def no_splines(axes: int) -> SplineTable:
    """The splines of a program that has none, over `axes` axes."""
    return SplineTable(block=np.zeros(0), points=np.zeros((0, 4, axes)), weights=np.zeros((0, 4)))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Program:
    """An NC program: B blocks over A axes."""

    source: str  # name of the file, for messages
    axes: tuple[str, ...]  # axis letters, x, y, z first; rotary ones (a, b, c) are in rad here and below
    start: FloatArray  # (A,) machine position before the first block [mm]
    kind: Array  # (B,) `Kind`
    end: FloatArray  # (B, A) machine position at the end of each block [mm]; unchanged for DWELL and STOP
    # (B,) programmed feed [mm/s]: the speed of x, y and z together, where they stand that of u, v and w, where those
    # stand too that of the rotary axes [rad/s]; inf for RAPID, DWELL, and STOP without an extruder
    feed: FloatArray
    dwell: FloatArray  # (B,) standstill [s], > 0 for DWELL only
    line: Array  # (B,) source line, from 1
    path_control: Array  # (B,) `PathControl` in force at the end of the block
    tolerance: FloatArray  # (B,) P of G64 [mm]; NaN where the program sets none
    arc_block: Array = field(default_factory=_nothing)  # (K,) block index of each arc, ascending
    # (K, A) centre in the plane; the axial coordinate is that of the start [mm]
    arc_center: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    arc_normal: Array = field(default_factory=_nothing)  # (K,) normal axis: 2 for G17, 1 for G18, 0 for G19
    # (K,) signed angle [rad], positive counter-clockwise about the normal axis, full turns included
    arc_sweep: FloatArray = field(default_factory=_nothing)
    # blocks in step with the spindle, at their feed only
    synchronised: Array = field(default_factory=_nothing)
    splines: SplineTable = field(default_factory=lambda: no_splines(0))  # of the blocks of kind SPLINE
    events: Sequence[Event] = field(default=())  # words without influence on the motion
    origins: Origins = field(  # where programmed zero is in machine coordinates
        default_factory=lambda: Origins(block=np.zeros(0), offset=np.zeros((0, 3)), turned=np.zeros(0))
    )
    notes: tuple[str, ...] = ()  # what a user should know of how it was read; `assumptions` come first
    # what was assumed and may change geometry or time: "line 9: tool 3 has no length in the machine file: 0 (2 times)"
    assumptions: tuple[str, ...] = ()
    frame: Array = field(default_factory=_nothing)  # (B,) the call of each, an index of `frames`; or (0,)
    frames: tuple[Frame, ...] = ()  # the calls of an expanded program; () where nothing was expanded
    expansion: Expansion | None = None  # what was expanded; None where nothing was
    # (B,) what the extruder feeds on each block [mm of filament], back where negative; where it moves alone, a block of
    # kind STOP with the speed asked for as its feed. (0,) where E is no axis (nc/extruder.py)
    extruded: FloatArray = field(default_factory=_nothing)
    limits: tuple[SetLimit, ...] = ()  # of the program, which hold throughout where lower than the machine's
    reading: Reading = AS_USUAL  # the settings it was read with
    tool_point: ToolPoint | None = None  # of a program of the tip; None where x, y and z are of the joints
    uncapped: FloatArray = field(default_factory=_nothing)  # (B,) `feed` without feed caps; (0,) without such
    # along the path where it begins and where it ends, as `feed` counts them [mm/s]; 0 for rest
    speeds: tuple[float, float] = (0.0, 0.0)
    pen: bool = False  # read from a plotter file: M3 and M5 among its events lower and raise the pen
    text: bytes | None = None  # what it was read from; None for points and curves of Python

    def __post_init__(self) -> None:
        axes, blocks, arcs = len(self.axes), len(self.kind), len(self.arc_block)
        freeze(self, "start", np.float64, (axes,))
        freeze(self, "kind path_control", np.uint8, (blocks,))
        freeze(self, "end", np.float64, (blocks, axes))
        freeze(self, "feed tolerance", np.float64, (blocks,), finite=False)
        freeze(self, "dwell", np.float64, (blocks,))
        freeze(self, "line", np.int32, (blocks,))
        freeze(self, "arc_block arc_normal", np.int64, (arcs,))
        freeze(self, "synchronised", np.int64, (None,))
        freeze(self, "arc_center", np.float64, (arcs, axes))
        freeze(self, "arc_sweep", np.float64, (arcs,))
        if not len(self.splines):
            object.__setattr__(self, "splines", no_splines(axes))
        if self.splines.points.shape[2] != axes:
            raise ValueError(f"Program.splines: {self.splines.points.shape[2]} axes, expected {axes}")
        freeze(self, "frame", np.int32, (blocks if self.frames else 0,))
        freeze(self, "extruded", np.float64, (blocks if len(self.extruded) else 0,))
        freeze(self, "uncapped", np.float64, (blocks if len(self.uncapped) else 0,), finite=False)
        if self.notes[: len(self.assumptions)] != self.assumptions:
            raise ValueError("Program.notes: the assumptions come first")
        if not (self.feed > 0).all():
            raise ValueError("Program.feed: every feed must be positive")

    def __len__(self) -> int:
        return len(self.kind)

    def __repr__(self) -> str:
        return f"<Program {self.source}: {len(self):,} blocks, axes {' '.join(self.axes)}>"

    def place(self, block: int) -> str:
        """Where a block comes from: its line, and the calls that led to it, innermost first."""
        return f"line {self.line[block]}" + self.called(int(self.frame[block]) if self.frames else 0)

    def called(self, frame: int) -> str:
        """The calls that led to a frame, innermost first; empty for the main program."""
        text = ""
        while frame > 0:
            at = self.frames[frame]
            elsewhere = f" in {at.source}" if at.source != self.source else ""
            text += f"{elsewhere} ({at.name}), called from line {at.line}"
            frame = at.caller
        return text


def renumbered(program: Program, number: Callable[[Array], Array], **columns: Any) -> Program:
    """The program with more blocks: what stands at blocks (n,) of before stands at `number` of them (n,);
    `columns` are its new fields by their names."""
    splines, origins, events = program.splines, program.origins, program.events
    if isinstance(events, EventTable):
        events = dataclasses.replace(events, block=number(events.block))
    fields: dict[str, Any] = {
        "arc_block": number(program.arc_block),
        "synchronised": number(program.synchronised),
        "splines": dataclasses.replace(splines, block=number(splines.block)),
        "origins": dataclasses.replace(origins, block=number(origins.block)),
        "events": events,
    }
    return dataclasses.replace(program, **(fields | columns))


def divided(program: Program, block: Array, **columns: Any) -> Program:
    """The program with its blocks in parts, `block` (n,) of each; what stands at a block stands at its first part.
    `columns` are its new fields by their names."""
    first = np.searchsorted(block, np.arange(len(program) + 1))
    of_block = ("kind", "feed", "dwell", "line", "tolerance", "path_control", "frame", "extruded")
    parts = {name: column[block] for name in of_block if len(column := getattr(program, name))}
    return renumbered(program, lambda blocks: first[blocks], **(parts | columns))


class MadeWhenAsked(Sequence[One]):
    """A sequence whose members are made when they are looked at."""

    def made(self, index: int) -> One:
        """The member of that number. Raises IndexError."""
        raise NotImplementedError

    @overload
    def __getitem__(self, index: int) -> One: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[One]: ...
    def __getitem__(self, index: int | slice) -> One | Sequence[One]:
        if isinstance(index, slice):
            return tuple(self.made(k) for k in range(*index.indices(len(self))))
        return self.made(index)


@dataclass(frozen=True, eq=False, kw_only=True)
class EventTable(MadeWhenAsked[Event]):
    """The E events of a program in arrays; an `Event` is made when it is looked at."""

    block: Array  # (E,) the block before which it happens
    line: Array  # (E,) 1-based source line
    letter: Array  # (E,) "S", "T", "M" or "G", as its code
    value: FloatArray  # (E,) the word's number

    def __post_init__(self) -> None:
        count = len(self.block)
        freeze(self, "block", np.int64, (count,))
        freeze(self, "line", np.int32, (count,))
        freeze(self, "letter", np.uint8, (count,))
        freeze(self, "value", np.float64, (count,))

    def __len__(self) -> int:
        return len(self.block)

    def made(self, index: int) -> Event:
        """The event of that number."""
        text = f"{chr(self.letter[index])}{plain(float(self.value[index]))}"
        return Event(block=int(self.block[index]), line=int(self.line[index]), text=text)


def plain(value: float) -> str:
    """A number without exponent and without needless zeros: 12000.0 -> "12000", 0.5 -> "0.5"."""
    return np.format_float_positional(value, trim="-")
