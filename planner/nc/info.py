"""Description of a program: counts, extents, lengths, feeds, corners, and every construct that is not
supported.

Inspecting never stops at the first fault: what can be read is read, so for a program with faults the figures
describe only that. A corner is the turn between the end of one feed move and the start of the next, at the
tangents; moves of length zero are passed over, and a rapid, dwell or stop between two moves separates them.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine
from planner.nc.bezier import at, homogeneous
from planner.nc.capped import capped
from planner.nc.extents import (
    block_boxes,
    block_lengths,
    plane_axes,
    rise,
    spokes,
    starts,
    travel_faults,
    work_box,
)
from planner.nc.faults import Fault
from planner.nc.program import FEED_MOVES, MOVES, EventTable, Expansion, Kind, Program, ToolPoint, plain
from planner.nc.reader import interpret, load, source_name
from planner.nc.reading import AS_USUAL, Reading

# What `planner info` counts: corners that turn by more than each of these [deg], and quantiles of the moves'
# lengths [-].
CORNER_DEGREES = (1.0, 20.0, 60.0, 90.0, 175.0)
LENGTH_QUANTILES = (0.0, 0.1, 0.5, 0.9, 1.0)
PLACES_SHOWN = 100  # of what is not supported, in tables and summaries; the others are counted
_NOWHERE = 1e-9  # a move shorter than this turns no corner [mm]: the rounding of coordinates around 1e3 mm


@dataclass(frozen=True, eq=False, kw_only=True)
class ProgramInfo:
    """Lengths [mm], times [s], feeds [mm/s]; NaN where there is nothing to measure."""

    source: str  # file name
    assumptions: tuple[str, ...]  # what was assumed and may change geometry or time
    lines: int  # source lines
    blocks: dict[str, int]  # by `Kind` name, in lower case; "spline" only where there are some
    full_circles: int  # arcs of a full turn and more
    helices: int  # arcs that rise along their axis
    events: dict[str, int]  # by letter or code ("S", "T", "M3" ...)
    extent_min: FloatArray  # (A,) least of the start and all motion, in machine coordinates [mm, rad]
    extent_max: FloatArray  # (A,) and the greatest
    # (3,) ends of that box, without the start, as the program has them; None for the same
    work_extent: tuple[FloatArray, FloatArray] | None
    # path length by kind "rapid", "line", "arc", and "spline" where there are some [mm]
    length: dict[str, float]
    feed: tuple[float, float]  # least and largest programmed feed [mm/s]; inf where a plotter file gives none
    feed_changes: int  # feed moves whose feed differs from the one before
    segment_length: tuple[float, ...]  # quantiles LENGTH_QUANTILES of the feed moves' lengths [mm]
    corners: dict[float, int]  # how many turn by more than each of CORNER_DEGREES
    zero_moves: int  # moves that end where they start
    dwell: float  # sum of all dwells [s]
    tools: tuple[int, ...]  # tool numbers in the order of their T words
    notes: tuple[str, ...]  # what the reader says of it, `assumptions` first
    # what was expanded: calls, turns of loops, lines executed; None where nothing was
    expansion: Expansion | None
    tool_point: ToolPoint | None  # where the tool centre point is on; None where x, y and z are of the joints
    unsupported: Sequence[Fault]  # every construct that is not supported or not valid


def inspect_program(
    path: str | Path, machine: Machine | None = None, reading: Reading = AS_USUAL
) -> ProgramInfo:
    """Read a program as far as it can be read and describe it. Raises InputError only if the file cannot be
    read, is empty or is not a text."""
    data = load(path)
    program, faults = interpret(data, machine, reading, source=source_name(path))
    program = program if len(faults) else capped(program, reading.caps, data)
    beyond, notes = travel_faults(program, machine, data)
    if not reading.ignore_travel:
        faults = [*faults, *beyond]
    program = dataclasses.replace(program, notes=(*program.notes, *notes))
    return describe(program, lines=len(data.splitlines()), unsupported=faults)


def describe(program: Program, *, lines: int, unsupported: Sequence[Fault] = ()) -> ProgramInfo:
    """The figures of a program that has been read."""
    start, (low, high) = starts(program), block_boxes(program)
    length = block_lengths(program)
    is_feed = np.isin(program.kind, FEED_MOVES)
    feed = program.feed[is_feed]
    kinds = [kind for kind in Kind if kind != Kind.SPLINE or len(program.splines)]
    quantiles = np.quantile(length[is_feed], LENGTH_QUANTILES).tolist() if len(feed) else [np.nan] * 5
    return ProgramInfo(
        source=program.source,
        assumptions=program.assumptions,
        lines=lines,
        blocks={kind.name.lower(): int((program.kind == kind).sum()) for kind in kinds},
        full_circles=int((np.abs(program.arc_sweep) >= 2 * np.pi - 1e-9).sum()),
        helices=int((np.abs(rise(program)) > _NOWHERE).sum()),
        events=_count_events(program),
        extent_min=np.vstack([program.start, low]).min(axis=0),
        extent_max=np.vstack([program.start, high]).max(axis=0),
        work_extent=work_box(program, low, high),
        length={k.name.lower(): float(length[program.kind == k].sum()) for k in MOVES if k in kinds},
        feed=(float(feed.min()), float(feed.max())) if len(feed) else (np.nan, np.nan),
        feed_changes=int((feed[1:] != feed[:-1]).sum()),
        segment_length=tuple(quantiles),
        corners=_corners(program, start, length, is_feed),
        zero_moves=int(((length <= _NOWHERE) & np.isin(program.kind, MOVES)).sum()),
        dwell=float(program.dwell.sum()),
        tools=tuple(int(event.text[1:]) for event in program.events if event.text[0] == "T"),
        notes=program.notes,
        expansion=program.expansion,
        tool_point=program.tool_point,
        unsupported=unsupported,
    )


def _corners(program: Program, start: FloatArray, length: FloatArray, is_feed: Array) -> dict[float, int]:
    with np.errstate(invalid="ignore", divide="ignore"):
        leaving = (program.end - start) / length[:, None]
    arriving = leaving.copy()
    k, n, axes = program.arc_block, program.arc_normal, plane_axes(program)
    for spoke, tangent in zip(spokes(program), (leaving, arriving), strict=True):
        size = np.maximum(length[k], _NOWHERE)
        tangent[k, axes[0]] = -spoke[1] * program.arc_sweep / size
        tangent[k, axes[1]] = spoke[0] * program.arc_sweep / size
        tangent[k, n] = rise(program) / size
    splines = program.splines
    blocks, first = np.unique(splines.block, return_index=True)
    last = np.append(first[1:], len(splines)) - 1
    _, rate, _ = at(homogeneous(splines.points, splines.weights), np.array([0.0, 1.0]))
    for tangent, row, end in ((leaving, first, 0), (arriving, last, 1)) if len(splines) else ():
        size = np.linalg.norm(rate[row, end], axis=1, keepdims=True)
        tangent[blocks] = rate[row, end] / np.maximum(size, _NOWHERE)
    parts = (length > _NOWHERE) | ~np.isin(program.kind, MOVES)  # what joins or separates
    leaving, arriving, is_feed = leaving[parts], arriving[parts], is_feed[parts]
    joint = is_feed[:-1] & is_feed[1:]
    before, after = arriving[:-1][joint], leaving[1:][joint]
    # atan2 of the half angle's sine and cosine: exact at 0 and at 180 degrees, and lengths cancel
    theta = 2.0 * np.arctan2(np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1))
    return {limit: int((np.rad2deg(theta) > limit).sum()) for limit in CORNER_DEGREES}


def _count_events(program: Program) -> dict[str, int]:
    """Events by letter (S, T) or code (M3, G97), without making an object of each."""
    table = program.events
    if not isinstance(table, EventTable):  # of a program of points, which has none
        return {}
    pairs = np.column_stack([table.letter, table.value])
    counts: dict[str, int] = {}
    for (letter, value), count in zip(*np.unique(pairs, axis=0, return_counts=True), strict=True):
        name = chr(int(letter))
        name += plain(float(value)) if name in "GM" else ""
        counts[name] = counts.get(name, 0) + int(count)
    return counts
