"""Pulse files: one row per pulse, all axes in the order of time.

    t [s], axis (its letter), direction (+1, -1), count (of that axis after the pulse, 0 at the start), line (of the NC program)

as Parquet (`.parquet`; the schema's key `planner` holds pulses per mm and the trajectory's `run_id` as JSON) or CSV (`.csv`). The file
appears as a whole: it is written beside its place, forced to disk and renamed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from planner.base.errors import InputError
from planner.motion.pulses import AxisPulses
from planner.report.replace import PULSES, replacing_file

SUFFIXES = (".parquet", ".csv")


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
    axis = pa.DictionaryArray.from_arrays(which, [train.axis for train in trains]).cast(pa.string())
    columns: dict[str, Any] = {"t": time[order], "axis": axis}
    for name in PULSES[len(columns) :]:
        columns[name] = np.concatenate([getattr(train, name) for train in trains])[order]
    table = pa.table(columns)
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
