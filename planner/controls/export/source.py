"""The text of a plan's program whose lines an export goes by: its own, the expanded one, or one that is written for it."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np

from planner.base.errors import InputError
from planner.base.units import SECONDS_PER_MINUTE
from planner.controls.export.chords import DECIMALS
from planner.controls.export.rows import Source, rows_of
from planner.nc.points import are_points
from planner.nc.program import FEED_MOVES, Program, plain
from planner.nc.reader import parse_program
from planner.nc.reading import AUTO
from planner.nc.text import program_text
from planner.nc.writer import FEED_MIN, round_down
from planner.planning.job.plan import Plan

SAME_PLACE = 1e-6  # of an end point that was written with seven decimals and read back [mm]


def text_of(program: Program) -> bytes | None:
    """The program's own NC text; None for points and plotter files."""
    text = program.text
    if text is None and os.path.isfile(program.source):
        text = Path(program.source).read_bytes()
    return None if text is None or program.pen or are_points(text) else text


def source_of(plan: Plan) -> Source:
    """The rows that an export of the plan goes by; they read as its blocks, one by one.

    Raises InputError if the text has changed since it was planned, or cannot be written out.
    """
    program, text = plan.program, text_of(plan.program)
    if text is None and not program.pen:
        return rows_of(*_of_points(program), plan.machine)
    if text is None:
        feeds = np.where(np.isfinite(program.feed), program.feed, FEED_MIN)
        return _read(program_text(program, feeds, 1.0).encode(), plan, "as an NC program")
    if program.expansion is None:
        return rows_of(text, _same(text, plan, program.reading, ""), plan.machine)
    from planner.nc.language.flat import flat_program  # 10 ms, for programs that compute

    found = flat_program(text, plan.machine, program.reading, source=program.source)
    if found is None:
        raise InputError("the program has changed since it was planned", source=program.source)
    return _read(found[0].encode(), plan, "expanded")


def _read(text: bytes, plan: Plan, how: str) -> Source:
    reading = dataclasses.replace(plan.program.reading, dialect=AUTO)
    return rows_of(text, _same(text, plan, reading, f", {how},"), plan.machine)


def _same(text: bytes, plan: Plan, reading: object, how: str) -> Program:
    """What the text reads as. Raises InputError if that is not the plan's program."""
    program = plan.program
    try:
        read = parse_program(text, plan.machine, reading, source=program.source)  # type: ignore[arg-type]
    except InputError as fault:
        raise InputError(
            f"the program{how} does not read back: {fault.message}", source=program.source
        ) from None
    if not same_places(read, program):
        raise InputError(
            f"the program{how} does not read back as the one that was planned", source=program.source
        )
    return read


def same_places(one: Program, other: Program) -> bool:
    """Whether two programs have the same kinds of blocks with the same ends."""
    return (
        one.end.shape == other.end.shape
        and np.array_equal(one.kind, other.kind)
        and np.allclose(one.end, other.end, rtol=0.0, atol=SAME_PLACE)
    )


def _of_points(program: Program) -> tuple[bytes, Program]:
    """A path of points as text, and the program with the lines of it: a rapid to where it begins, which is no block, then its moves.

    Raises InputError for points of other axes than x, y and z.
    """
    if len(program.axes) > len("xyz"):
        raise InputError(
            "points of rotary or second axes have no program; export their setpoints", source=program.source
        )
    lines = ["G21 G90 G17 G94", "G0 " + _words(program.start)]
    for end, kind, feed in zip(program.end, program.kind.tolist(), program.feed.tolist(), strict=True):
        f_word = f" F{round_down(max(feed, FEED_MIN) * SECONDS_PER_MINUTE)}" if kind in FEED_MOVES else ""
        lines.append(f"{'G1' if f_word else 'G0'} {_words(end)}{f_word}")
    own = dataclasses.replace(program, line=np.arange(3, 3 + len(program)))
    return "\n".join([*lines, "M2", ""]).encode(), own


def _words(place: np.ndarray) -> str:
    return " ".join(
        f"{letter}{plain(round(float(value), DECIMALS + 3) + 0.0)}"
        for letter, value in zip("XYZ", place, strict=True)
    )
