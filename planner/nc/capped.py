"""A program under feed caps: the lower of F and cap is the feed of every block, and a block that a cap holds for a
part of is divided there.

Lengths count along x, y and z, from the start of the program, rapid moves included. A point divides a line by
its length and an arc by its angle. Splines and blocks on which rotary axes move are not divided: the lowest cap on
them holds for all of the block. Rapid moves have no F, and threads none but that of the spindle.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, RAD_PER_DEG, SECONDS_PER_MINUTE
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.nc.extents import block_lengths, plane_axes, starts
from planner.nc.feed_caps import FEED, FILE, FROM, LINE, TO, FeedCaps
from planner.nc.points import in_inches
from planner.nc.program import FEED_MOVES, Kind, PathControl, Program, divided

SHORT = 1e-3  # no part of a block is shorter [mm]: a cap that ends within a micrometre of its end ends there


def capped(program: Program, caps: FeedCaps | None, text: bytes = b"") -> Program:
    """The program with its feeds lowered to the caps, and `Program.uncapped`.

    text : that it was read from

    Raises InputError for a line that the program has not, a file that it does not call, a length beyond its
    path, and a thread.
    """
    if caps is None:
        return program
    cuts = np.isin(program.kind, FEED_MOVES)
    unit = (MM_PER_INCH if in_inches(program, text) else 1.0) / SECONDS_PER_MINUTE
    if FROM in caps.columns:
        cap, block, share = _of_lengths(program, caps, cuts)
    else:
        cap, block, share = _of_lines(program, caps, text), np.arange(len(program)), np.ones(len(program))
    turns = np.array([axis in ROTARY_AXES for axis in program.axes])
    moved = program.end != starts(program)
    alone = moved[:, turns].any(axis=1) & ~moved[:, ~turns].any(axis=1) & (program.kind == Kind.LINE)
    feed = cap * np.where(alone[block], RAD_PER_DEG / SECONDS_PER_MINUTE, unit)  # as `Program.feed` has them
    feed = np.where(cuts[block], feed, np.inf)
    lower = feed < program.feed[block]
    if (bad := np.flatnonzero(lower & np.isin(block, program.synchronised))).size:
        what = f"{caps.source} lowers F on a thread; the spindle sets its feed, and nothing else can"
        raise InputError(what, source=program.source, line=int(program.line[block[bad[0]]]))
    feed = np.minimum(feed, program.feed[block])
    # parts of one block with one feed are one again
    joined = np.append((block[1:] == block[:-1]) & (feed[1:] == feed[:-1]), False)
    parts = _divided(program, block[~joined], share[~joined])
    held, lowest = len(np.unique(block[lower])), float(feed[lower].min(initial=np.inf)) / unit
    down = f", down to F{lowest:.6g}" if held else ""
    notes = (*program.notes, f"feed caps of {caps.source} hold on {held:,} blocks{down}")
    uncapped = program.feed[block[~joined]]
    return dataclasses.replace(parts, feed=feed[~joined], uncapped=uncapped, notes=notes)


def _of_lines(program: Program, caps: FeedCaps, text: bytes) -> FloatArray:
    """(B,) the lowest cap on the line of each block, inf where there is none."""
    line, feed = caps.columns[LINE].astype(np.int64), caps.columns[FEED]
    main = Path(program.source).name
    frames = np.array([Path(frame.source).name for frame in program.frames] or [main])
    of_block = frames[program.frame] if len(program.frame) else np.full(len(program), main)
    names = (main if name == caps.main else Path(name).name for name in caps.files or [caps.main] * len(line))
    asked = np.array(list(names))
    known, last = {main, *frames.tolist()}, text.count(b"\n") + (not text.endswith(b"\n"))
    for k in np.flatnonzero(~np.isin(asked, list(known)))[:1].tolist():
        what = f"'{caps.files[k]}' is no file of the program; it has {', '.join(sorted(known))}"
        raise caps.fault(k, what, FILE)
    for k in np.flatnonzero((asked == main) & (line > last))[:1].tolist():
        raise caps.fault(k, f"line {line[k]} of {main}; it has lines 1 to {last}", LINE)
    found = np.full(len(program), np.inf)
    for name in sorted(known):
        here, mine = of_block == name, asked == name
        table = np.full(max(line[mine].max(initial=0), program.line[here].max(initial=0)) + 1, np.inf)
        np.minimum.at(table, line[mine], feed[mine])
        found[here] = table[program.line[here]]
    return found


def _of_lengths(program: Program, caps: FeedCaps, cuts: Array) -> tuple[FloatArray, Array, FloatArray]:
    """Caps (n,) of parts of blocks, the block (n,) of each, and where each ends (n,), as a share of its block."""
    begin, end, feed = (caps.columns[name] for name in (FROM, TO, FEED))
    length = block_lengths(program, slice(len(LINEAR_AXES)))
    along = np.append(0.0, np.cumsum(length))
    for k in np.flatnonzero(begin >= along[-1])[:1].tolist():
        raise caps.fault(k, f"from_mm {begin[k]:g}; the path is {along[-1]:.6g} mm long", FROM)
    # between two neighbouring `at` one cap holds: the lowest of the rows over them
    at = np.unique(np.concatenate([[0.0], begin, end, along[-1:]]))
    held = np.full(len(at), np.inf)
    for a, b, cap in zip(np.searchsorted(at, begin), np.searchsorted(at, end), feed, strict=True):
        held[a:b] = np.minimum(held[a:b], cap)
    turns = [k for k, axis in enumerate(program.axes) if axis in ROTARY_AXES]
    turned = (program.end != starts(program))[:, turns].any(axis=1)
    whole = ~cuts | (program.kind == Kind.SPLINE) | turned
    first = np.searchsorted(at, along[:-1] + SHORT, side="right")
    count = np.maximum(np.searchsorted(at, along[1:] - SHORT) - first, 0)
    inner = np.where(whole, 0, count)
    block = np.repeat(np.arange(len(program)), inner + 1)
    part = np.cumsum(inner + 1) - inner - 1  # the first of each block
    which = np.arange(len(block)) - part[block]
    ends = np.minimum(first[block] + which, len(at) - 1)
    share = np.where(which < inner[block], (at[ends] - along[block]) / np.maximum(length[block], SHORT), 1.0)
    cap = held[ends - 1]
    for k in np.flatnonzero(whole & cuts & (count > 0)).tolist():
        cap[part[k]] = held[first[k] - 1 : first[k] + count[k]].min()
    return cap, block, share


def _divided(program: Program, block: Array, share: FloatArray) -> Program:
    """The program with its blocks in parts: the block (n,) of each, and where it ends (n,), as a share of it."""
    if len(block) == len(program):
        return program
    begin, last = starts(program), share == 1.0
    ends = begin[block] + share[:, None] * (program.end - begin)[block]
    before = np.where(np.append(True, block[1:] != block[:-1]), 0.0, np.append(0.0, share[:-1]))
    row = np.full(len(program), -1)
    row[program.arc_block] = np.arange(len(program.arc_block))
    on = np.flatnonzero(row[block] >= 0)
    arc, axes = row[block[on]], plane_axes(program)
    a, b = axes[0, arc], axes[1, arc]
    pick, angle = np.arange(len(on)), share[on] * program.arc_sweep[arc]
    centre = program.arc_center[arc].copy()
    start, end = begin[block[on]], program.end[block[on]]

    def turned(by: FloatArray) -> FloatArray:
        """(2, n) the first spoke, turned."""
        u, v = start[pick, a] - centre[pick, a], start[pick, b] - centre[pick, b]
        return np.array([u * np.cos(by) - v * np.sin(by), u * np.sin(by) + v * np.cos(by)])

    # the end may be off the circle through the start: the gap is spread over the arc, and moves the centre along
    spoke, reach = turned(angle), turned(program.arc_sweep[arc])
    for k, axis in enumerate((a, b)):
        gap = end[pick, axis] - centre[pick, axis] - reach[k]
        ends[on, axis] = centre[pick, axis] + spoke[k] + share[on] * gap
        centre[pick, axis] += before[on] * gap
    normal = program.arc_normal[arc]
    centre[pick, normal] = (begin[block] + before[:, None] * (program.end - begin)[block])[on, normal]
    ends[last] = program.end[block[last]]
    control = program.path_control[block]
    parts = divided(
        program,
        block,
        end=ends,
        path_control=np.where(last | (control == PathControl.BLEND), control, PathControl.EXACT_PATH),
        **({"extruded": program.extruded[block] * (share - before)} if len(program.extruded) else {}),
    )
    sweep = program.arc_sweep[arc] * (share - before)[on]
    return dataclasses.replace(parts, arc_block=on, arc_center=centre, arc_normal=normal, arc_sweep=sweep)
