"""Programs of points, and the file that keeps one: straight moves from one point to the next, for paths that
are no NC program.

The file is JSON: `format` "points", `axes`, `points` (n+1 rows) [mm, rad], `feed` (n) [mm/s] with null for rapid
moves, `tolerance` [mm] or null, `curves`, the columns of a `SplineTable`, where moves are none that go
straight, and `speeds` [mm/s], where they are not 0. Numbers are written so that they read back exactly.
"""

import dataclasses
import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.machine.whole import ALL_AXES
from planner.nc.program import Kind, PathControl, Program, SplineTable

AXES = ("x", "y", "z")
SOURCE, CURVE = "<points>", "NURBS"  # what messages call programs of points and of curves
UNIT_WORD = re.compile(rb"^[^(;\n]*?[Gg](20|21)\b", re.MULTILINE)  # the first of each line of an NC text
_G_CODE = re.compile(rb'^[ \t]*(?:N\d+[ \t]*)?[GM]\d|^\{"?gc"?:', re.MULTILINE | re.IGNORECASE)
_FORMAT = "points"
_CURVES = tuple(field.name for field in dataclasses.fields(SplineTable))


def program_of_points(
    position: FloatArray,
    feed: FloatArray,
    tolerance: float | None,
    source: str = SOURCE,
    axes: tuple[str, ...] = AXES,
) -> Program:
    """A program that goes straight from each point to the next.

    position  : (n+1, A) places of the axes, x, y and z where no others are named [mm, rad]
    feed      : (n,) [mm/s]; inf for rapid moves
    tolerance : contour error budget [mm]; None for that of the machine
    source    : what messages call it

    `Program.line` counts the moves from 1.
    """
    moves = len(position) - 1
    return Program(
        source=source,
        axes=axes,
        start=position[0],
        kind=np.where(np.isinf(feed), Kind.RAPID, Kind.LINE),
        end=position[1:],
        feed=feed,
        dwell=np.zeros(moves),
        line=np.arange(1, moves + 1),
        path_control=np.full(moves, PathControl.BLEND),
        tolerance=np.full(moves, np.nan if tolerance is None else tolerance),
        arc_center=np.zeros((0, len(axes))),
    )


def points_file(program: Program) -> bytes:
    """The file of a program that `program_of_points` made, with curves or without."""
    splines = program.splines
    tolerance = float(program.tolerance[0])
    entries: dict[str, Any] = {
        "format": _FORMAT,
        "axes": "".join(program.axes),
        "tolerance": None if np.isnan(tolerance) else tolerance,
        "feed": [value if np.isfinite(value) else None for value in program.feed.tolist()],
        "points": [program.start.tolist(), *program.end.tolist()],
    }
    if any(program.speeds):
        entries["speeds"] = program.speeds
    if len(splines):
        entries["curves"] = {name: getattr(splines, name).tolist() for name in _CURVES}
    return (json.dumps(entries) + "\n").encode("ascii")


def is_points(program: Program) -> bool:
    """Whether `points_file` keeps a program: it is one of points or curves, of the axes themselves."""
    return program.source in (SOURCE, CURVE) and _are_axes(program.axes)


def are_points(data: bytes) -> bool:
    """True if a file holds points; one of TinyG's lines may begin with a brace, too."""
    return data[:64].lstrip().startswith(b"{") and (b'"points"' in data or not _G_CODE.search(data))


def own_text(program: Program) -> bytes | None:
    """The NC text of a program, or a plotter's; None for points."""
    return None if program.text is None or are_points(program.text) else program.text


def in_inches(program: Program, text: bytes) -> bool:
    """Whether the first G20 or G21 of a program that was read from that text is G20."""
    found = None if program.pen else UNIT_WORD.search(text)
    return found is not None and found[1] == b"20"


def read_points(data: bytes, source: str) -> Program:
    """The program of a file of points. Raises InputError for anything else."""
    none = "begins like a file of points, and is none"
    try:
        entries: Any = json.loads(data)
        position = np.asarray(entries["points"], dtype=np.float64)
        feed = np.array([np.inf if value is None else value for value in entries["feed"]], dtype=np.float64)
        tolerance = None if entries["tolerance"] is None else float(entries["tolerance"])
        axes = tuple(entries["axes"])
        begin, end = map(float, entries.get("speeds", (0.0, 0.0)))
        known = entries["format"] == _FORMAT and _are_axes(axes)
        curves = SplineTable(**entries["curves"]) if "curves" in entries else None
    except (ValueError, KeyError, TypeError, RecursionError) as fault:
        raise InputError(f"{none}: {fault!r}", source=source) from None
    good = known and position.ndim == 2 and position.shape[1] == len(axes) and len(position) > 1
    good = good and feed.shape == (len(position) - 1,) and bool(np.isfinite(position).all())
    good = good and (feed > 0).all() and min(begin, end) >= 0.0 and max(begin, end) < np.inf
    if not good or (tolerance is not None and not 0 < tolerance < np.inf):
        text = f"{none}: format points, axes xyz..., points (n+1, A), n feeds above 0 or null"
        raise InputError(text, source=source)
    program = program_of_points(position, feed, tolerance, source, axes)
    kind = program.kind.copy()
    if curves is not None:
        if not _join(curves, position):
            raise InputError(f"{none}: its curves do not begin and end at its points", source=source)
        kind[curves.block] = Kind.SPLINE
    return dataclasses.replace(program, speeds=(begin, end), kind=kind, splines=curves or program.splines)


def _join(curves: SplineTable, position: FloatArray) -> bool:
    """Whether the pieces of curves go from one to the next of the points (n+1, A), or of their own."""
    block, ends = curves.block, curves.points[:, [0, -1]]
    if not len(block) or ends.shape[2] != position.shape[1] or not np.isfinite(curves.weights).all():
        return False
    if (np.diff(block) < 0).any() or block[0] < 0 or block[-1] >= len(position) - 1:
        return False
    inner = np.diff(block) == 0
    first, last = np.append(True, ~inner), np.append(~inner, True)
    return (
        np.array_equal(ends[1:, 0][inner], ends[:-1, 1][inner])
        and np.array_equal(ends[first, 0], position[block[first]])
        and np.array_equal(ends[last, 1], position[block[last] + 1])
    )


def _are_axes(axes: tuple[str, ...]) -> bool:
    return (axes == AXES[:2] or axes[:3] == AXES) and known_axes(axes)


def known_axes(axes: Sequence[str]) -> bool:
    """Whether each is the letter of an axis that plans have, and none comes twice."""
    return len(set(axes)) == len(axes) and set(axes) <= {*ALL_AXES}
