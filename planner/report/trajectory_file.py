"""Trajectory files: three formats out; trajectory_reader.py reads them, and `read_trajectory` can be had from
here too.

A trajectory file is a table, one row per sample:

    t [s], then per axis  x [mm] vx [mm/s] ax [mm/s2] jx [mm/s3]  (rotary axes in degrees), s [mm], feed [mm/s],
    of an extruder  e [mm of filament] ve ae je,
    line (of the NC program), block (its index; several blocks can come from one line)

Of a program with the tool centre point on, the axes are the joints, s and feed are those of the tip, and its
place follows as tip_x, tip_y, tip_z [mm]. The feed is what F means (word_feed.py); s is the length in all
axes, an angle counting at a radius.

as Parquet (`.parquet`), CSV (`.csv`: one header line, shortest digits that read back to the same float64) or
NumPy (`.npz`: one array per column). Metadata (machine, tolerance, units, versions, `run_id`) is in the
Parquet schema under the key `planner`, in the NPZ array `metadata`, and for CSV, which has no place for it,
in `trajectory.meta.json` beside it; always as JSON.

Pulse files: one row per pulse, all axes in the order of time.

    t [s], axis (its letter), direction (+1, -1), count (of that axis after the pulse, 0 at the start), line
    (of the NC program)

as Parquet (`.parquet`; the schema's key `planner` holds pulses per mm and the trajectory's `run_id` as JSON)
or CSV (`.csv`). The file appears as a whole: it is written beside its place, forced to disk and renamed.
"""

import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from planner.base.arrays import Array
from planner.base.errors import InputError
from planner.base.sizes import SIZES
from planner.machine import EXTRUDER, LINEAR_AXES, ROTARY_AXES
from planner.motion.pulses import AxisPulses
from planner.motion.trajectory import Trajectory, require_rest
from planner.planning.job.at_tip import joints_of
from planner.planning.job.plan import Plan
from planner.report.replace import PULSES, replacing_file
from planner.report.trajectory_reader import CSV_METADATA, FORMATS, PREFIXES, Format, read_trajectory
from planner.report.word_feed import WordFeed

__all__ = ["FORMATS", "Format", "PlanColumns", "read_trajectory", "write_trajectory"]

PER = ("", "/s", "/s2", "/s3")  # of the units of columns with these prefixes
TIP = "tip_"  # before the names of the columns of the tool's tip
ROW_GROUP = SIZES.row_group
# Byte stream split puts the exponents of neighbouring samples side by side, and zstd at its fastest level then
# leaves 55 % of the bytes, as fast as writing them raw. Higher levels take longer and save nothing;
# dictionaries make it larger.
PACKED: Any = {"compression": "zstd", "compression_level": 1}


def columns_of(trajectory: Trajectory) -> dict[str, Array]:
    """The columns (T,) of samples by their names, those of an extruder too; the feed along the path in all axes."""
    columns: dict[str, Array] = {"t": trajectory.t}
    levels = (trajectory.position, trajectory.velocity, trajectory.acceleration, trajectory.jerk)
    for k, axis in enumerate(trajectory.axes):
        unit = trajectory.in_degrees[k] if axis in ROTARY_AXES else 1.0
        columns |= {prefix + axis: of[:, k] * unit for prefix, of in zip(PREFIXES, levels, strict=True)}
    if len(trajectory.extruder):
        columns |= {prefix + EXTRUDER: trajectory.extruder[:, k] for k, prefix in enumerate(PREFIXES)}
    return columns | {name: getattr(trajectory, name) for name in ("s", "feed", "line", "block")}


Columns = Callable[[Trajectory], dict[str, Array]]


class PlanColumns:
    """The columns of any samples of a plan's trajectory: the feed as F words mean it, and with the tool centre point on
    those of the joints, with the tip beside them; `units` has the unit of each by its name."""

    def __init__(self, plan: Plan):
        self._word, self._joints = WordFeed(plan.toolpath), joints_of(plan)
        said = {"t": "s"}
        for axis in (*plan.toolpath.axes, *[EXTRUDER] * (plan.toolpath.extrusion is not None)):
            length = "deg" if axis in ROTARY_AXES else "mm"
            said |= {prefix + axis: length + per for prefix, per in zip(PREFIXES, PER, strict=True)}
        said |= {"s": "mm", "feed": self._word.units, "line": "1", "block": "1"}
        self.units = said | ({TIP + axis: "mm" for axis in LINEAR_AXES} if self._joints else {})

    def __call__(self, samples: Trajectory) -> dict[str, Array]:
        samples = dataclasses.replace(samples, feed=self._word.of(samples))
        if self._joints is None:
            return columns_of(samples)
        tip = {TIP + axis: samples.position[:, samples.axes.index(axis)] for axis in LINEAR_AXES}
        return columns_of(self._joints(samples)) | tip


def write_trajectory(
    path: str | Path,
    trajectory: Trajectory,
    about: dict[str, Any] | None = None,
    columns: Columns = columns_of,
) -> None:
    """Write a trajectory in the format that the suffix names (.parquet, .csv, .npz), with `about` as its
    metadata and the `columns` of any of its samples. Raises ValueError for another suffix."""
    path = Path(path)
    text = json.dumps(about or {}, allow_nan=False)
    match path.suffix:
        case ".parquet":
            with path.open("wb") as file:  # pyarrow takes no name that is not UTF-8, but an open file
                _write_parquet(file, _groups(trajectory, columns), text)
        case ".csv":
            _write_csv(path, _groups(trajectory, columns))
            path.with_suffix(CSV_METADATA).write_text(text + "\n", encoding="utf-8")
        case ".npz":
            np.savez(path, metadata=np.array(text), allow_pickle=False, **columns(trajectory))
        case _:
            raise ValueError(f"{path}: unknown format; there are {', '.join(FORMATS)}")


def _groups(trajectory: Trajectory, columns_of_samples: Columns) -> Iterator[dict[str, Array]]:
    """The columns of `ROW_GROUP` samples at a time."""
    parts: list[dict[str, Array]] = []
    count = 0
    for chunk in trajectory.chunks():
        columns, done = columns_of_samples(chunk), 0
        while done < len(chunk):
            new = min(ROW_GROUP - count, len(chunk) - done)
            parts.append({name: column[done : done + new] for name, column in columns.items()})
            done, count = done + new, count + new
            if count == ROW_GROUP:
                yield _end_to_end(parts)
                parts, count = [], 0
    if parts:
        yield _end_to_end(parts)


def _end_to_end(parts: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _table(columns: dict[str, Array]) -> Any:
    """The columns as pyarrow's table. `pa.table(columns)` is the same, but looks for pandas first, which
    takes 0.4 s."""
    import pyarrow as pa

    def array(column: Array) -> Any:
        buffers = [None, pa.py_buffer(np.ascontiguousarray(column))]
        return pa.Array.from_buffers(pa.from_numpy_dtype(column.dtype), len(column), buffers)

    return pa.table({name: array(column) for name, column in columns.items()})


def _write_parquet(file: BinaryIO, groups: Iterator[dict[str, Array]], text: str) -> None:
    from pyarrow import parquet

    writer = None
    for columns in groups:
        table = _table(columns).replace_schema_metadata({"planner": text})
        if writer is None:
            writer = parquet.ParquetWriter(
                file,
                table.schema,
                **PACKED,
                use_dictionary=["line", "block"],
                use_byte_stream_split=[name for name in columns if name not in ("line", "block")],
            )
        writer.write_table(table)
    assert writer is not None
    writer.close()


def _write_csv(path: Path, groups: Iterator[dict[str, Array]]) -> None:
    from pyarrow import csv

    with path.open("wb") as file:
        for n, columns in enumerate(groups):
            if n == 0:
                file.write((",".join(columns) + "\n").encode())  # pyarrow would put the names in quotes
            csv.write_csv(_table(columns), file, csv.WriteOptions(include_header=False, batch_size=65536))


SUFFIXES = (".parquet", ".csv")


def write_pulses(path: str | Path, trains: tuple[AxisPulses, ...], about: dict[str, Any]) -> None:
    """Write pulses with `about` as their metadata.

    Raises InputError for a suffix other than .parquet and .csv, a place that cannot be written, and a motion that is not
    from rest to rest.
    """
    require_rest(all(train.rests for train in trains))
    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(SUFFIXES)}", source=str(path))
    with replacing_file(path) as new, new.open("wb") as file:
        _write(file, path.suffix, trains, about)


def _write(file: BinaryIO, suffix: str, trains: tuple[AxisPulses, ...], about: dict[str, Any]) -> None:
    import pyarrow as pa
    from pyarrow import csv, parquet

    time = np.concatenate([train.time for train in trains])
    order = np.argsort(time, kind="stable")
    which = np.concatenate([np.full(len(train), k, np.int8) for k, train in enumerate(trains)])[order]
    axis = pa.DictionaryArray.from_arrays(which, [train.axis for train in trains]).cast(pa.string())
    columns: dict[str, Any] = {"t": time[order], "axis": axis}
    for name in PULSES[len(columns) :]:
        columns[name] = np.concatenate([getattr(train, name) for train in trains])[order]
    table = pa.table(columns)
    if suffix == ".csv":
        file.write((",".join(table.column_names) + "\n").encode())
        csv.write_csv(table, file, csv.WriteOptions(include_header=False, quoting_style="none"))
        return
    text = json.dumps(about | {"steps": {train.axis: train.steps for train in trains}}, allow_nan=False)
    table = table.replace_schema_metadata({"planner": text})
    packed: Any = PACKED | {"use_byte_stream_split": ["t"]}
    parquet.write_table(table, file, use_dictionary=["axis", "direction", "line"], **packed)
