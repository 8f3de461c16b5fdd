"""Pulse files: one row per pulse, all axes in the order of time.

    t [s], axis (its letter), direction (+1, -1), count (of that axis after the pulse, 0 at the start), line (of the NC program)

as Parquet (`.parquet`; the schema's key `planner` holds pulses per mm and the trajectory's `run_id` as JSON) or CSV (`.csv`). The file
appears as a whole: it is written beside its place, forced to disk and renamed.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from planner.base.errors import InputError
from planner.motion.pulses import AxisPulses
from planner.report.replace import check_file, replacing_file, starts_with

SUFFIXES = (".parquet", ".csv")
COLUMNS = ("t", "axis", "direction", "count", "line")


def check_pulse_place(path: Path, inputs: Iterable[Path] = (), *, force: bool = False) -> None:
    """Raise InputError if pulses cannot be written to a file.

    That is so for a suffix other than .parquet and .csv, for one of the `inputs`, and for a file that holds no pulses of this package,
    unless `force` is set.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(SUFFIXES)}", source=str(path))
    check_file(path, inputs, _is_pulse_file, force=force)


def _is_pulse_file(path: Path) -> bool:
    from pyarrow import parquet

    if path.suffix == ".csv":
        return starts_with(path, ",".join(COLUMNS))
    try:
        with path.open("rb") as file:
            return tuple(parquet.read_schema(file).names) == COLUMNS
    except (OSError, ValueError):
        return False


def write_pulses(path: str | Path, trains: tuple[AxisPulses, ...], about: dict[str, Any]) -> None:
    """Write pulses with `about` as their metadata.

    Raises InputError for a suffix other than .parquet and .csv, and for a place that cannot be written.
    """
    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(SUFFIXES)}", source=str(path))
    with replacing_file(path) as new:
        _write(new, path.suffix, trains, about)


def _write(path: Path, suffix: str, trains: tuple[AxisPulses, ...], about: dict[str, Any]) -> None:
    import pyarrow as pa
    from pyarrow import csv, parquet

    time = np.concatenate([train.time for train in trains])
    order = np.argsort(time, kind="stable")
    which = np.concatenate([np.full(len(train), k, np.int8) for k, train in enumerate(trains)])[order]
    table = pa.table(
        {
            "t": time[order],
            "axis": pa.DictionaryArray.from_arrays(which, [train.axis for train in trains]).cast(pa.string()),
            "direction": np.concatenate([train.direction for train in trains])[order],
            "count": np.concatenate([train.count for train in trains])[order],
            "line": np.concatenate([train.line for train in trains])[order],
        }
    )
    if suffix == ".csv":
        with path.open("wb") as file:
            file.write((",".join(table.column_names) + "\n").encode())
            csv.write_csv(table, file, csv.WriteOptions(include_header=False, quoting_style="none"))
        return
    text = json.dumps(about | {"steps": {train.axis: train.steps for train in trains}}, allow_nan=False)
    with path.open("wb") as file:
        parquet.write_table(
            table.replace_schema_metadata({"planner": text}),
            file,
            compression="zstd",
            compression_level=1,
            use_dictionary=["axis", "direction", "line"],
            use_byte_stream_split=["t"],
        )
