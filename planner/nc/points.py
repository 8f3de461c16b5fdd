"""Programs of points, and the file that keeps one: straight moves from one point to the next, for paths that
are no NC program.

The file is JSON: `format` "points", `axes`, `points` (n+1 rows) [mm], `feed` (n) [mm/s] with null for rapid
moves, and `tolerance` [mm] or null. Numbers are written so that they read back exactly.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.nc.program import Kind, PathControl, Program

AXES = ("x", "y", "z")
SOURCE = "<points>"
_FORMAT = "points"


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
    """The file of a program that `program_of_points` made."""
    tolerance = float(program.tolerance[0])
    entries = {
        "format": _FORMAT,
        "axes": "".join(program.axes),
        "tolerance": None if np.isnan(tolerance) else tolerance,
        "feed": [value if np.isfinite(value) else None for value in program.feed.tolist()],
        "points": [program.start.tolist(), *program.end.tolist()],
    }
    return (json.dumps(entries) + "\n").encode("ascii")


def are_points(data: bytes) -> bool:
    """True if a file holds points: no NC program begins with a brace."""
    return data[:64].lstrip().startswith(b"{")


def own_text(program: Program) -> bytes | None:
    """The NC text of a program, or a plotter's, if it was given as a text, or read from a file that is still
    there; None for points."""
    data = program.text
    if data is None:
        try:
            data = Path(program.source).read_bytes()
        except (OSError, ValueError):
            return None
    return None if are_points(data) else data


def read_points(data: bytes, source: str) -> Program:
    """The program of a file of points. Raises InputError for anything else."""
    try:
        entries: Any = json.loads(data)
        position = np.asarray(entries["points"], dtype=np.float64)
        feed = np.array([np.inf if value is None else value for value in entries["feed"]], dtype=np.float64)
        tolerance = None if entries["tolerance"] is None else float(entries["tolerance"])
        known = entries["format"] == _FORMAT and entries["axes"] == "".join(AXES)
    except (ValueError, KeyError, TypeError, RecursionError) as fault:
        raise InputError(f"begins like a file of points, and is none: {fault!r}", source=source) from None
    good = known and position.ndim == 2 and position.shape[1] == len(AXES) and len(position) > 1
    good = good and feed.shape == (len(position) - 1,) and bool(np.isfinite(position).all())
    if not good or not (feed > 0).all() or (tolerance is not None and not 0 < tolerance < np.inf):
        text = "begins like a file of points, and is none: format points, axes xyz, points (n+1, 3), n feeds above 0 or null"
        raise InputError(text, source=source)
    return program_of_points(position, feed, tolerance, source)
