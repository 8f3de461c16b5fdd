"""Trajectory files, read: those of this package (trajectory_file.py), and files made elsewhere.

Only `t` and the positions are required. Positions may also be one NumPy array (T, n) that is named by its
axes, `xyz`. Columns of other names are left alone.
"""

import dataclasses
import json
import math
import os
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any, Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.base.units import RAD_PER_DEG
from planner.machine import ALL_AXES, EXTRUDER, ROTARY_AXES
from planner.motion.trajectory import Trajectory
from planner.report.trajectory_room import (
    is_number,
    npz_shapes,
    on_grid,
    require_names,
    require_room,
    rounding,
)
from planner.verifier import DERIVATIVES, Given

Format = Literal["parquet", "csv", "npz"]
FORMATS: tuple[Format, ...] = ("parquet", "csv", "npz")
CSV_METADATA = ".meta.json"  # takes the place of the suffix .csv
PREFIXES = ("", "v", "a", "j")  # of the columns of an axis
KNOWN = {"t", "s", "feed", "line", "block"} | {
    prefix + axis for prefix in PREFIXES for axis in (*ALL_AXES, EXTRUDER)
}
# Smallest step between samples of a file made elsewhere [s]: below it finite differences of float64 positions
# are noise.
TIME_STEP_MIN = 1e-9
# Largest magnitude of a value, whatever its unit: third derivatives of larger positions, squared, are no
# numbers any more.
VALUE_MAX = 1e30
NUMBER_MAX = 2.0**31 - 1.0  # of a line or a block
NAMES_SHOWN = 300  # characters of the names of columns


@dataclass(frozen=True, eq=False, kw_only=True)
class TrajectoryFile:
    """A trajectory as it was read from a file."""

    trajectory: Trajectory  # the samples
    given: Given  # which columns the file had, and with how many digits
    metadata: dict[str, Any]  # what the file says about itself; empty for files made elsewhere
    notes: tuple[str, ...]  # columns that the file lacks and how they were filled, one sentence each


def trajectory_file(path: Path) -> Path:
    """The trajectory file that a path names: itself, or the one in a directory that `plan -o` wrote.

    Raises InputError for a directory without one.
    """
    if not os.path.isdir(path):  # which a name that is too long is not
        return path
    for suffix in FORMATS:
        if (file := path / f"trajectory.{suffix}").exists():
            return file
    raise InputError(
        "no trajectory in this directory; write one with: planner plan JOB -o DIR", source=str(path)
    )


def read_trajectory(path: str | Path) -> TrajectoryFile:
    """Read a trajectory file, written by this package or by another program.

    Required are `t` [s] and at least one column for an axis [mm]. Velocities, accelerations and jerks are those of every
    axis or of none; missing ones are divided differences of the other columns, at rest before the first sample and after the last; a
    missing `s` is the length of the polyline through the samples, a missing `feed` the speed on it, 0 at the
    ends of positions alone. Missing `line` and `block` are 0 and -1, "unknown".

    Raises InputError naming the file and the column.
    """
    path = Path(path)
    read = {".parquet": _read_parquet, ".csv": _read_csv, ".npz": _read_npz}.get(path.suffix.lower())
    if read is None and not os.path.exists(path):
        raise InputError("trajectory file not found", source=str(path))
    if read is None:
        text = f"unknown format '{path.suffix}' of a trajectory; there are {', '.join(FORMATS)}"
        raise InputError(f"{text}, and directories that 'plan -o' wrote", source=str(path))
    try:
        require_ending(path)
        given, text = read(path)
        about = json.loads(text) if text else {}
    except InputError:
        raise
    except FileNotFoundError as fault:
        raise InputError("trajectory file not found", source=str(path)) from fault
    except RecursionError:
        raise InputError("cannot be read: its metadata are nested too deep", source=str(path)) from None
    except MemoryError as fault:
        raise InputError(
            "does not fit into the memory: verify a part of the motion at a time", source=str(path)
        ) from fault
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"cannot be read: {fault}", source=str(path)) from fault
    found = trajectory_of_columns(given, str(path))
    return dataclasses.replace(found, metadata=about if isinstance(about, dict) else {})


def trajectory_of_columns(given: Mapping[str, Any], source: str) -> TrajectoryFile:
    """A trajectory of the columns of a file, or of arrays (T,) and (T, n), by their names; the rest as in
    `read_trajectory`.

    source : where they come from, for messages
    """
    columns: dict[str, Array] = {}
    for name, column in _one_by_one(given).items():
        word = name.strip().lower()
        if _known(name):
            columns[word] = _numbers(source, name, column)
    trajectory, digits, notes = _assemble(source, columns, tuple(given))
    return TrajectoryFile(trajectory=trajectory, given=digits, metadata={}, notes=notes)


def _one_by_one(given: Mapping[str, Any]) -> dict[str, Any]:
    """The columns, with an array (T, n) that is named by n axes taken apart."""
    columns: dict[str, Any] = {}
    for name, column in given.items():
        letters = name.strip().lower()
        if _of_axes(name) and np.ndim(column) == 2 and np.shape(column)[1] == len(letters):
            columns |= {letter: column[:, k] for k, letter in enumerate(letters)}
        else:
            columns[name] = column
    return columns


def _read_parquet(path: Path) -> tuple[dict[str, Any], str]:
    from pyarrow import parquet

    with open(path, "rb") as stream:  # pyarrow takes no name that is not UTF-8
        file = parquet.ParquetFile(stream)
        names = file.schema_arrow.names
        wanted = [name for name in names if _known(name)]
        require_room(path, dict.fromkeys(wanted, (file.metadata.num_rows,)))
        text = (file.schema_arrow.metadata or {}).get(b"planner", b"").decode()
        table = file.read(wanted)  # others are named, and not read
    return {name: table[name].to_numpy() if name in wanted else () for name in names}, text


def _read_csv(path: Path) -> tuple[dict[str, Any], str]:
    from pyarrow import csv

    with open(path, "rb") as stream:
        require_names(path, stream)
        table = csv.read_csv(stream)
    beside = path.with_suffix(CSV_METADATA)
    text = beside.read_text(encoding="utf-8") if beside.exists() else ""
    return {name: table[name].to_numpy() for name in table.column_names}, text


def _read_npz(path: Path) -> tuple[dict[str, Any], str]:
    with open(path, "rb") as stream:  # numpy leaves a file open that is damaged
        try:
            shapes = npz_shapes(stream)
            wanted = {name: shape for name, shape in shapes.items() if _known(name) or _of_axes(name)}
            require_room(path, wanted)
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as file:
                text = str(file["metadata"]) if "metadata" in file.files else ""
                return {
                    name: file[name] if name in wanted else () for name in file.files if name != "metadata"
                }, text
        # numpy reads a header as Python's words
        except (SyntaxError, RecursionError, tokenize.TokenError) as fault:
            raise ValueError("the header of an array is damaged") from fault
        # an archive that is damaged, encrypted, or packed in another way
        except (RuntimeError, zlib.error) as fault:
            raise ValueError(f"the archive: {fault}") from fault


def _of_axes(name: str) -> bool:
    """Whether an array may be named by its axes."""
    letters = name.strip().lower()
    return 1 < len(letters) == len(set(letters)) and set(letters) <= {*ALL_AXES}


def _known(name: str) -> bool:
    return name.strip().lower() in KNOWN


def _numbers(source: str, name: str, column: Any) -> Array:
    """A column as numbers. Raises InputError naming the column and the row of the first that is none."""
    column = np.asarray(column)
    if column.ndim == 1 and column.dtype.kind in "OSU":  # a CSV file with a word in it
        row, text = next(((k, text) for k, text in enumerate(column) if not is_number(text)), (0, "no row"))
        raise InputError(
            f"column '{name}', row {row + 1}: {str(text)[:20]!r}; a number is needed", source=source
        )
    if column.ndim != 1 or column.dtype.kind not in "fiub":
        raise InputError(
            f"column '{name}' holds {column.dtype} of shape {column.shape}; numbers are needed", source=source
        )
    most = NUMBER_MAX if name.strip().lower() in ("line", "block") else VALUE_MAX
    bad = np.flatnonzero(~(np.abs(column.astype(np.float64)) <= most))
    if len(bad):
        needed = f"between {-most:.10g} and {most:.10g}" if np.isfinite(column[bad[0]]) else "a finite number"
        raise InputError(
            f"column '{name}', row {bad[0] + 1}: {column[bad[0]]}; every value must be {needed}",
            source=source,
        )
    return column


def _assemble(
    source: str, columns: dict[str, Array], found: tuple[str, ...]
) -> tuple[Trajectory, Given, tuple[str, ...]]:
    """The trajectory of the known columns; `found` are the names of all that the file has."""
    axes = tuple(axis for axis in ALL_AXES if axis in columns)
    if "t" not in columns or not axes:
        missing = "column 't' is missing" if "t" not in columns else "there is no column of an axis"
        raise InputError(
            f"{missing}; found are {shorten(', '.join(found), NAMES_SHOWN, placeholder=' ...') or 'none'}; "
            "needed are t [s] and the positions x, y, ... [mm, rotary axes degrees]",
            source=source,
        )
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"the columns differ in length: {lengths}", source=source)
    t, time_rounding, end_rounding, notes = _times(source, columns["t"])
    inside = np.array([RAD_PER_DEG if axis in ROTARY_AXES else 1.0 for axis in axes])  # at a radius of 1 mm
    levels, there = _levels(source, columns, axes, t)
    levels = [level * inside for level in levels]
    for order, word in enumerate(DERIVATIVES, start=1):
        if order not in there:
            base = max(level for level in there if level < order)
            lacking = [PREFIXES[order] + axis for axis in axes if PREFIXES[order] + axis not in columns]
            notes.append(f"{word} derived from the {_LEVELS[base]} (no column {', '.join(lacking)})")
    position, velocity, *_ = levels
    linear = [k for k, axis in enumerate(axes) if axis not in ROTARY_AXES]

    def feed() -> FloatArray:
        speed = np.linalg.norm(velocity[:, linear], axis=1)
        if 1 not in there:  # a difference over the first period is no speed at its start
            speed[[0, -1]] = 0.0
        return speed

    fill: dict[str, Callable[[], Array]] = {
        "s": lambda: np.append(0.0, np.cumsum(np.linalg.norm(np.diff(position[:, linear], axis=0), axis=1))),
        "feed": feed,
        "line": lambda: np.zeros(len(t)),
        "block": lambda: np.full(len(t), -1),
    }
    said = {"s": "length of the polyline", "feed": "speed of the axes", "line": "unknown", "block": "unknown"}
    notes += [f"{name}: {said[name]} (no column {name})" for name in fill if name not in columns]
    rest: dict[str, Any] = {name: columns[name] if name in columns else make() for name, make in fill.items()}
    rest |= zip(("position", *DERIVATIVES), levels, strict=True)
    dt = float(np.median(np.diff(t)))
    trajectory = Trajectory(axes=axes, dt=dt, t=t, extruder=_extruder(source, columns, t), **rest)
    delivered = Given(
        columns=tuple(DERIVATIVES[order - 1] for order in there[1:]),
        position_rounding=tuple(rounding(columns[axis]) * inside[k] for k, axis in enumerate(axes)),
        time_rounding=time_rounding,
        end_rounding=end_rounding,
        extruder_rounding=rounding(columns[EXTRUDER]) if EXTRUDER in columns else 0.0,
    )
    return trajectory, delivered, tuple(notes)


def _extruder(source: str, columns: dict[str, Array], t: FloatArray) -> FloatArray:
    """(T, 4) the columns of the extruder, what is missing as differences of its place; (0, 4) without one."""
    if EXTRUDER not in columns:
        return np.zeros((0, 4))
    return np.concatenate(_levels(source, columns, (EXTRUDER,), t)[0], axis=1)


def _levels(
    source: str, columns: dict[str, Array], axes: tuple[str, ...], t: FloatArray
) -> tuple[list[FloatArray], list[int]]:
    """(T, A) positions and their three derivatives, what is missing as differences of the last level that is
    there; and the orders that are there. Raises InputError where only some of the axes have one: that column would not
    be judged."""
    levels: list[FloatArray] = []
    there: list[int] = []
    for order, prefix in enumerate(PREFIXES):
        lacking = [prefix + axis for axis in axes if prefix + axis not in columns]
        if 0 < len(lacking) < len(axes):
            given = ", ".join(prefix + axis for axis in axes if prefix + axis in columns)
            what = f"give the {DERIVATIVES[order - 1]} of every axis, or of none"
            raise InputError(
                f"there is a column {given}, and none {', '.join(lacking)}; {what}", source=source
            )
        if not lacking:
            there.append(order)
            levels.append(np.stack([columns[prefix + axis] for axis in axes], axis=1).astype(np.float64))
        else:
            levels.append(divided_difference(t, levels[there[-1]], order - there[-1]))
    return levels, there


def _times(source: str, given: Array) -> tuple[FloatArray, float, float, list[str]]:
    """Times from 0 [s], what of their rounding remains for all and for the last (trajectory_room.py), and
    notes on it."""
    if len(given) < 2:
        raise InputError(f"{len(given)} samples; at least 2 are needed", source=source)
    late = np.flatnonzero(np.diff(given.astype(np.float64)) < TIME_STEP_MIN)
    if len(late):
        raise InputError(
            f"column 't', row {late[0] + 2}: times must increase by at least {TIME_STEP_MIN:g} s",
            source=source,
        )
    t, written, time_rounding, end_rounding = on_grid(given)
    notes = []
    if time_rounding:
        notes.append(f"times are good to {time_rounding:.2g} s, and not those of one period")
    elif np.abs(t - (given.astype(np.float64) - float(given[0]))).max() > TIME_STEP_MIN:
        notes.append(f"times are good to {written:.2g} s, and taken as k x {t[1]:.9g} s")
    return t, time_rounding, end_rounding, notes


_LEVELS = ("positions", "velocity", "acceleration")


def divided_difference(t: FloatArray, values: FloatArray, order: int) -> FloatArray:
    """Derivative of samples by divided differences.

    t      : (T,) times [s]
    values : (T, A) samples
    order  : 1, 2 or 3

    At sample i: order 1 over i-1, i+1; order 2 over i-1, i, i+1; order 3 over i-1 .. i+2. Before the first
    sample and after the last the values are held, as a machine at rest holds them. Exact for polynomials of
    degree 1, 2 and 3 on equal steps.
    """
    after = 1 if order < 3 else 2
    steps = np.diff(t)
    t = np.concatenate([[t[0] - steps[0]], t, t[-1] + steps[-1] * np.arange(1, after + 1)])
    values = np.concatenate([values[:1], values, np.repeat(values[-1:], after, axis=0)])
    if order == 1:
        return (values[2:] - values[:-2]) / (t[2:] - t[:-2])[:, None]
    table = values
    for k in range(1, order + 1):
        table = (table[1:] - table[:-1]) / (t[k:] - t[:-k])[:, None]
    return table * math.factorial(order)
