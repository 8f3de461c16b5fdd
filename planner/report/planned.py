"""`planned.ngc`: the program of a plan with the planned feeds as F words, read back before it is written.

An NC program changes only in its F words. A plotter file is written as a new NC program, and a program with
parameters, loops or calls is expanded first: one line of it may be executed at many feeds.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.files import readable
from planner.base.units import SECONDS_PER_MINUTE
from planner.geometry.build import path_per_length
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.nc.feed_caps import FeedCaps
from planner.nc.language.detect import is_plotter_file
from planner.nc.points import own_text
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import AUTO
from planner.nc.writer import SAME_FEED, flat_program, program_text, retimed
from planner.report.word_feed import ABOVE, PlannedBlocks, feeds_of, planned_blocks

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan

_MOTION = (
    "kind", "end", "dwell", "line", "path_control", "tolerance",
    "arc_block", "arc_center", "arc_normal", "arc_sweep", "extruded",
)  # fmt: skip


# Where more than this share of the blocks last less than a period, a control is better off with the original
# [-].
MANY_SHORT = 0.5
_CAPPED = "planned.ngc: a line that a feed cap holds for a part of it has the cap for all of it"
# A path that was written with seven decimals and read back is off by less than this [mm].
SAME_PATH = 1e-6


class LeftOut(Exception):
    """There is no program with planned feeds; the message says why."""


def planned_program(plan: Plan, planned: PlannedBlocks | None = None) -> tuple[bytes, list[str]]:
    """The program file of a plan, with an F word where the planned feed changes, and notes on blocks for
    which a control gains nothing from it.

    planned : what the blocks are planned to take, if it is known already

    Raises LeftOut if a file that it calls has changed since, or if the result does not read back as the same
    motion, for example because a line would become too long.
    """
    assert plan.trajectory is not None
    source, data = plan.program.source, own_text(plan.program)
    if data is None:
        raise LeftOut("the program is points, which have no F words")
    if any(event.text == "M220" for event in plan.program.events if event.text[0] == "M"):
        raise LeftOut("its F words count by a factor that the program sets (M220)")
    if not _reads_as(data, plan):
        raise LeftOut(f"{source} does not read as the program that was planned; has what it calls changed?")
    planned = planned or planned_blocks(plan.trajectory, plan.toolpath)
    feeds = _as_programmed(feeds_of(planned, plan.toolpath, plan.machine, len(plan.program)), plan.toolpath)
    if is_plotter_file(data, plan.program.source):
        text = _written_anew(plan, feeds)
    else:
        whole = plan.program if plan.program.reading.caps is None else _read(data, plan, own=True)
        if plan.program.expansion is not None:
            text = _expanded(data, plan, whole, feeds, _per_minute(plan, planned))
        else:
            text = retimed(data, plan.program, feeds, _per_minute(plan, planned))
            if not _reads_as(text, plan, whole):
                raise LeftOut(f"{source} with F words does not read back as the same motion")
        if not _keeps_caps(text, plan):
            raise LeftOut("feed caps hold on moves whose F words stay as they are (G93, G95)")
    notes = _notes(plan, planned, text)
    if plan.program.expansion is not None:
        notes.insert(0, "planned.ngc is the expanded program: parameters, loops and calls are written out")
    return text, notes


def _per_minute(plan: Plan, planned: PlannedBlocks) -> FloatArray | None:
    """(B,) how often a block on which rotary axes move could be run in a minute at its highest planned feed,
    NaN for the others; None without rotary axes."""
    toolpath = plan.toolpath
    rotary = [axis in ROTARY_AXES for axis in toolpath.axes]
    if not any(rotary):
        return None
    turns = ((toolpath.end - toolpath.start)[:, rotary] != 0.0).any(axis=1) & ~toolpath.rapid
    block = toolpath.block[turns]
    length, highest = np.zeros(len(plan.program)), np.zeros(len(plan.program))
    np.add.at(length, block, toolpath.length[turns])
    feed = np.minimum(planned.highest[turns] * (1.0 + ABOVE), toolpath.feed[turns])
    np.maximum.at(highest, block, feed)
    often = np.full(len(plan.program), np.nan)
    often[block] = highest[block] / length[block] * SECONDS_PER_MINUTE
    return often


def _as_programmed(feeds: FloatArray, toolpath: Toolpath) -> FloatArray:
    """Feeds (B,) along the path in all axes as F words have them: of the linear part."""
    if set(toolpath.axes) <= set(LINEAR_AXES):
        return feeds
    found = feeds.copy()
    per = path_per_length(toolpath.axes, toolpath.radius, toolpath)
    found[toolpath.block] = feeds[toolpath.block] / per
    return found


def _notes(plan: Plan, planned: PlannedBlocks, text: bytes) -> list[str]:
    if own_text(plan.program) == text:
        return ["planned.ngc equals the program: no block is planned slower than its F word"]
    line, feed = plan.program.line, plan.program.feed  # inf on rapids
    parts = (line[1:] == line[:-1]) & (feed[1:] != feed[:-1])
    notes = [_CAPPED] if plan.program.reading.caps and parts.any() else []
    lasting = planned.duration[~plan.toolpath.rapid]
    short = int((lasting < plan.machine.dt).sum())
    if short <= MANY_SHORT * len(lasting):
        return notes
    return [
        *notes,
        f"planned.ngc: {short:,} of {len(lasting):,} blocks last less than a period of {plan.machine.dt * 1e3:g} ms; a control that "
        "joins or looks ahead over such blocks runs the original faster, because F words can only slow it down",
    ]


def _written_anew(plan: Plan, feeds: FloatArray) -> bytes:
    """The program as an NC program that reads back as the same path. Raises LeftOut if it does not."""
    planned = plan.program
    text = readable(
        program_text(planned, np.minimum(_finite(feeds), planned.feed), float(plan.toolpath.tolerance.min()))
    ).encode()
    _read_back(text, plan, planned, "as an NC program")
    return text


def _expanded(data: bytes, plan: Plan, whole: Program, feeds: FloatArray, often: FloatArray | None) -> bytes:
    """The expanded program with its feeds, which reads back as the same path. Raises LeftOut if it does
    not."""
    source = plan.program.source
    found = flat_program(data, plan.machine, plan.program.reading, source=source)
    assert found is not None
    flat = readable(found[0]).encode()
    caps = plan.program.reading.caps
    read = _read_back(flat, plan, plan.program, "expanded", caps and caps.by_length)
    text = retimed(flat, read, feeds, often)
    _read_back(text, plan, whole, "expanded and with F words")
    return text


def _read(text: bytes, plan: Plan, caps: FeedCaps | None = None, *, own: bool = False) -> Program:
    """The program that a text of the plan reads as, under other feed caps. Raises InputError.

    own : the text is in the program's own language, and not in that of what is written here
    """
    usual = plan.program.reading
    reading = dataclasses.replace(usual, dialect=usual.dialect if own else AUTO, feed_caps=caps)
    return parse_program(text, plan.machine, reading, source=plan.program.source)


def _keeps_caps(text: bytes, plan: Plan) -> bool:
    """Whether the F words of a text of the plan are nowhere above its feed caps."""
    caps = plan.program.reading.caps
    if caps is None:
        return True
    read = _read(text, plan, caps.by_length, own=plan.program.expansion is None)
    most = plan.program.feed
    feed = read.feed
    if caps.by_length is not None:
        feed, most = read.uncapped, read.feed
    return bool((feed <= most * (1.0 + SAME_FEED)).all())


def _read_back(text: bytes, plan: Plan, planned: Program, how: str, caps: FeedCaps | None = None) -> Program:
    """The program that a text reads as. Raises LeftOut if its path is not the one of the planned program."""
    try:
        read = _read(text, plan, caps)
    except InputError as fault:
        raise LeftOut(f"{planned.source} {how} does not read back: {fault.message}") from None
    same = _same(read, planned, ("kind", "path_control", "arc_block", "arc_normal"), within=SAME_PATH)
    if not same or not all(
        np.allclose(getattr(read, name), getattr(planned, name), rtol=0.0, atol=SAME_PATH)
        for name in ("end", "arc_center", "dwell")
    ):
        raise LeftOut(f"{planned.source} {how} does not read back as the same path")
    return read


def _finite(feeds: FloatArray) -> FloatArray:
    """Feeds that can be written: a block that takes no measurable time gets the feed of the one before, or
    after."""
    known = np.flatnonzero(np.isfinite(feeds))
    if not len(known):
        return np.zeros_like(feeds)
    return feeds[known[np.searchsorted(known, np.arange(len(feeds)), side="right").clip(1) - 1]]


def _reads_as(text: bytes, plan: Plan, whole: Program | None = None) -> bool:
    """Whether a program's motion is the one of the plan's program with its feeds, or that of `whole` without."""
    program = plan.program
    try:
        if whole is not None:
            return _same(_read(text, plan, own=True), whole, _MOTION)
        read = parse_program(text, plan.machine, program.reading, source=program.source)
    except InputError:
        return False
    return _same(read, program, (*_MOTION, "feed"))


def _same(one: Program, other: Program, names: tuple[str, ...], within: float = 0.0) -> bool:
    """Whether two programs have the same blocks and splines; the latter's points [mm] and weights may be
    `within` of each other."""
    splines = np.array_equal(one.splines.block, other.splines.block) and all(
        np.allclose(getattr(one.splines, n), getattr(other.splines, n), rtol=0.0, atol=within)
        for n in ("points", "weights")
    )
    pairs = {name: (getattr(one, name), getattr(other, name)) for name in names}
    same = all(np.array_equal(*pair, equal_nan=name == "tolerance") for name, pair in pairs.items())
    return splines and len(one) == len(other) and same
