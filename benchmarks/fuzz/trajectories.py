"""Fuzzing of trajectory files."""

from __future__ import annotations

import contextlib
import json
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz.mutate import bytes_of, text_of, value_of
from benchmarks.fuzz.run import Place
from benchmarks.fuzz.settings import JOB

ENDINGS = ("csv", "npz", "parquet")
ODD_COLUMN = (0.0, -1.0, 1e300, -1e300, 1e-300, np.nan, np.inf, 1e9)


def plan_once(place: Place) -> Path:
    """A plan of the job in CSV, with its page; the same folder for all inputs."""
    out, job = place.folder / "base", place.folder / "job.ngc"
    if not out.exists():
        job.write_text(JOB)
        place.command("plan", job, "-m", "mill", "--method", "stop", "--format", "csv", "-o", out, "-q")
    return out


# ------------------------------------------------------------------------------------------ trajectory files


@cache
def columns_of(file: Path) -> dict[str, np.ndarray[Any, Any]]:
    """The columns of a CSV file."""
    from pyarrow import csv

    table = csv.read_csv(file)
    return {name: table[name].to_numpy() for name in table.column_names}


def other_columns(rng: np.random.Generator, columns: dict[str, Any]) -> dict[str, Any]:
    """Columns with values, types, shapes and names changed."""
    columns = dict(columns)
    if rng.random() < 0.4:  # another program writes times and positions
        columns = {name: columns[name] for name in ("t", "x", "y", "z") if name in columns}
    for _ in range(int(rng.integers(0, 4))):
        if not columns:
            break
        name = str(rng.choice([*columns]))
        column = columns[name]
        change = int(rng.integers(0, 11))
        if change == 0:
            del columns[name]
        elif change == 1:
            columns[
                str(rng.choice(["a", "b", "c", "u", "e", "ve", "T", " x", "xyz", "line", "", "t ", "jx"]))
            ] = column
        elif change == 2:
            columns[name] = column[: int(rng.integers(0, 4))]
        elif change == 3:
            columns = {
                key: each[: int(rng.integers(0, 4))] if change else each for key, each in columns.items()
            }
        elif change == 4 and column.dtype.kind in "fiub":
            some = rng.integers(0, max(len(column), 1), 3)
            columns[name] = np.array(column, dtype=float)
            if len(column):
                columns[name][some] = rng.choice(ODD_COLUMN, 3)
        elif change == 5:
            kinds = ["f2", "f4", "i1", "i4", "u8", "c8", "S3", "U5", "?", "M8[s]", "f8"]
            kind = str(rng.choice(kinds))
            if kind == "M8[s]" and column.dtype.kind in "SU":
                continue  # numpy 2.4.6 dies of texts that are no dates: it raises without Python's lock
            with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
                try:
                    columns[name] = column.astype(kind)
                except (ValueError, TypeError):
                    continue
        elif change == 6 and column.dtype.kind in "fiu":
            with np.errstate(all="ignore"):
                columns[name] = column * rng.choice([0.0, -1.0, 1e-300, 1e300, 1e6, 1e-6])
        elif change == 7:
            columns[name] = (
                np.round(np.asarray(column, dtype=float), int(rng.integers(0, 4)))
                if column.dtype.kind == "f"
                else column
            )
        elif change == 8:
            columns[name] = column[::-1]
        elif change == 9 and column.dtype.kind == "f":
            columns[name] = column + rng.normal(size=len(column)) * 10 ** rng.uniform(-9, 3)
        else:
            order = rng.integers(0, max(len(column), 1), len(column))
            columns = {key: each[order] if len(each) == len(order) else each for key, each in columns.items()}
    return columns


def write_columns(file: Path, columns: dict[str, Any], text: str, rng: np.random.Generator) -> bool:
    """Write a trajectory file; False if its format cannot hold these columns."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    try:
        if file.suffix == ".npz":
            if {"x", "y"} <= {*columns} and len(columns["x"]) == len(columns["y"]) and rng.random() < 0.3:
                columns = {name: each for name, each in columns.items() if name not in "xy"} | {
                    "xy": np.column_stack([columns["x"], columns["y"]])
                }
            np.savez(
                file,
                metadata=np.array(text),
                allow_pickle=False,
                **{key or "none": each for key, each in columns.items()},
            )
            return True
        table = pa.table({key: np.asarray(each) for key, each in columns.items()})
    except (pa.ArrowException, ValueError, TypeError):
        return False
    if file.suffix == ".parquet":
        parquet.write_table(
            table.replace_schema_metadata({"planner": text.encode("utf-8", "surrogatepass")}), file
        )
        return True
    try:
        csv.write_csv(table, file)
    except pa.ArrowException:
        return False
    file.with_suffix(".meta.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    return True


def make_trajectory(rng: np.random.Generator, start: bytes | None, place: Place) -> bytes:
    """A file that is damaged, or that other programs might have written: its ending, the metadata beside it, and itself.

    Nothing after the ending if its format cannot hold the columns.
    """
    if start is not None:
        ending, about, data = _parts(start)
        if about and rng.random() < 0.5:
            return _together(ending, _other_metadata(rng, about), data)
        return _together(ending, about, _damaged(rng, ending, data))
    base = plan_once(place)
    file = place.folder / f"new.{rng.choice(ENDINGS)}"
    said: Any = json.loads((base / "trajectory.meta.json").read_text())
    if rng.random() < 0.4:
        said = value_of(rng, said)
    columns = columns_of(base / "trajectory.csv")
    damaged = rng.random() < 0.35
    if not write_columns(file, columns if damaged else other_columns(rng, columns), json.dumps(said), rng):
        return file.suffix.encode()
    about = file.with_suffix(".meta.json").read_bytes() if file.suffix == ".csv" else b""
    data = file.read_bytes()
    return _together(file.suffix, about, _damaged(rng, file.suffix, data) if damaged else data)


def _together(ending: str, about: bytes, data: bytes) -> bytes:
    return b"%s %d\n" % (ending.encode(), len(about)) + about + data


def _parts(whole: bytes) -> tuple[str, bytes, bytes]:
    first, _, rest = whole.partition(b"\n")
    ending, _, length = first.decode().partition(" ")
    return ending, rest[: int(length or 0)], rest[int(length or 0) :]


def _other_metadata(rng: np.random.Generator, about: bytes) -> bytes:
    """The metadata with a value changed where it is JSON, else with its text changed."""
    with contextlib.suppress(ValueError):
        return json.dumps(value_of(rng, json.loads(about))).encode()
    return text_of(rng, [about])


def _damaged(rng: np.random.Generator, ending: str, data: bytes) -> bytes:
    return text_of(rng, [data]) if ending == ".csv" else bytes_of(rng, data)


def try_trajectory(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """Judge a trajectory file."""
    plan_once(place)
    ending, about, rows = _parts(data)
    if not rows and not about:
        return "cannot be written"
    for old in place.folder.glob("motion.*"):
        old.unlink()
    file = place.folder / f"motion{ending}"
    file.write_bytes(rows)
    if about:
        file.with_suffix(".meta.json").write_bytes(about)
    options = ["-m", "mill"] if rng.random() < 0.5 else []
    words = [] if not options and rng.random() < 0.3 else [place.folder / "job.ngc"]
    code = place.command("verify", file, *words, *options, "-q", *(["--json"] if rng.random() < 0.3 else []))
    return {0: "passed", 1: "verdict failed", 2: "refused", 3: "not solved"}[code]
