"""Files: trajectories in three formats, and the summary of a plan.

A trajectory file is a table, one row per sample:

    t [s], then per axis  x [mm] vx [mm/s] ax [mm/s2] jx [mm/s3]  (rotary axes in rad), s [mm], feed [mm/s],
    line (of the NC program), block (its index; several blocks can come from one line)

as Parquet (`.parquet`), CSV (`.csv`: one header line, shortest digits that read back to the same float64) or NumPy (`.npz`:
one array per column). Metadata (machine, tolerance, units, versions, `run_id`) is in the Parquet schema under the key `planner`,
in the NPZ array `metadata`, and for CSV, which has no place for it, in `trajectory.meta.json` beside it; always as JSON.

`read_trajectory` reads them back, and files made elsewhere: only `t` and the positions are required.

The files of one run appear together or not at all: see `planner.report.replace`. All of them carry the same `run_id`.
"""

from __future__ import annotations

import datetime
import json
import math
import platform
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planner.arrays import Array, FloatArray
from planner.errors import InputError
from planner.machine import LINEAR_AXES, ROTARY_AXES
from planner.report.replace import LAST, replacing
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    from planner.plan import Plan

Format = Literal["parquet", "csv", "npz"]
FORMATS: tuple[Format, ...] = ("parquet", "csv", "npz")
SUMMARY = LAST
CSV_METADATA = "trajectory.meta.json"
PACKAGES = ("numpy", "scipy", "numba", "toppra", "ruckig", "pyarrow")
# Smallest step between samples of a file made elsewhere [s]: below it finite differences of float64 positions are noise.
TIME_STEP_MIN = 1e-9


# ---------------------------------------------------------------------------------------------- a plan's files


def write_plan(plan: Plan, directory: str | Path, *, file_format: Format = "parquet", plots: bool = False) -> list[str]:
    """Write the files of a solved plan into `directory`, all or nothing; return their names.

    Raises InputError if the directory cannot be written.
    """
    if plan.trajectory is None:
        raise ValueError("write_plan: the plan has no trajectory; see plan.sentence")
    directory = Path(directory)
    run_id = uuid.uuid4().hex
    try:
        with replacing(directory, _previous(directory)) as new:
            about = trajectory_metadata(plan, run_id)
            write_trajectory(new / f"trajectory.{file_format}", plan.trajectory, about)
            if plots:
                from planner.report.plots import write_figures

                write_figures(plan, new)
            names = sorted([SUMMARY, *(file.name for file in new.iterdir())])
            _write_json(new / SUMMARY, {**summary(plan), "run_id": run_id, "files": names})
    except OSError as fault:
        raise InputError(
            f"cannot be written: {fault.strerror or fault}; what was there stays", source=str(directory)
        ) from fault
    return names


def summary(plan: Plan) -> dict[str, Any]:
    """The plan in numbers, ready for JSON: what `planner plan --json` prints."""
    verdict, corners = plan.verdict, plan.corners
    return _plain(
        {
            "program": plan.program.source,
            "machine": plan.machine.name,
            "method": plan.method,
            "corner": plan.corner,
            "solver": plan.solver,
            "status": plan.status.name,
            "sentence": plan.sentence,
            "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
            "stop_time_s": plan.stop_time,
            "tolerance_mm": _uniform(plan.toolpath.tolerance),
            "verdict": verdict_summary(verdict) if verdict is not None else None,
            "corners": {
                "count": len(corners.theta) if corners is not None else 0,
                "worst_speed_ratio": corners.worst_ratio() if corners is not None and len(corners.theta) else None,
            },
            "blocks": len(plan.program),
            "grid_points": plan.grid_points,
            "timings_s": plan.timings,
            "versions": versions(),
        }
    )


def verdict_summary(verdict: Any) -> dict[str, Any]:
    """A verdict in numbers: worst ratio per limit, errors, faults."""
    return _plain(
        {
            "passed": verdict.passed,
            "limits": {name: check.ratio for name, check in verdict.limits.items()},
            "not_limited": [name for name, check in verdict.limits.items() if not check.limited],
            "contour_error_mm": verdict.contour_error_mm,
            "vertex_error_mm": verdict.vertex_error_mm,
            "end_error_mm": verdict.end_error_mm,
            "faults": list(verdict.faults),
        }
    )


def trajectory_metadata(plan: Plan, run_id: str) -> dict[str, Any]:
    """What a trajectory file says about itself; `planner verify` reads machine, tolerance and `not_limited` from it."""
    trajectory = plan.trajectory
    assert trajectory is not None
    unlimited = [] if plan.verdict is None else [k for k, check in plan.verdict.limits.items() if not check.limited]
    return _plain(
        {
            "format": 1,
            "run_id": run_id,
            "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "program": plan.program.source,
            "method": plan.method,
            "corner": plan.corner,
            "dt_s": trajectory.dt,
            "tolerance_mm": _uniform(plan.toolpath.tolerance),
            "not_limited": unlimited,
            "units": units(trajectory.axes),
            "machine": plan.machine.model_dump(mode="json", exclude_none=True),
            "versions": versions(),
        }
    )


def versions() -> dict[str, str]:
    """Version of this package, of Python, and of the packages that compute."""
    found = {"planner": metadata.version("feedrate-planner"), "python": platform.python_version()}
    return found | {name: metadata.version(name) for name in PACKAGES}


def units(axes: tuple[str, ...]) -> dict[str, str]:
    """Unit of every column."""
    said = {"t": "s"}
    for axis in axes:
        length = "rad" if axis in ROTARY_AXES else "mm"
        for prefix, per in zip(("", "v", "a", "j"), ("", "/s", "/s2", "/s3"), strict=True):
            said[prefix + axis] = length + per
    return said | {"s": "mm", "feed": "mm/s", "line": "1", "block": "1"}


def _uniform(tolerance: FloatArray) -> float | None:
    """The contour tolerance if it is the same at every joint; None where the program changes it (G64 P)."""
    return float(tolerance[0]) if len(tolerance) and (tolerance == tolerance[0]).all() else None


def _previous(directory: Path) -> list[str]:
    """Names of the files an earlier run wrote into `directory`, by its summary; none if there is none."""
    try:
        named = json.loads((directory / SUMMARY).read_text(encoding="utf-8"))["files"]
        return [name for name in named if isinstance(name, str) and Path(name).name == name]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _plain(value: Any) -> Any:
    """Numbers, strings, lists and dictionaries only; NaN and infinity, which JSON lacks, become None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=2, allow_nan=False) + "\n", encoding="utf-8")


# ---------------------------------------------------------------------------------------------- trajectories, out


def write_trajectory(path: str | Path, trajectory: Trajectory, about: dict[str, Any] | None = None) -> None:
    """Write a trajectory in the format that the suffix names, with `about` as its metadata."""
    path = Path(path)
    columns, text = _columns(trajectory), json.dumps(about or {}, allow_nan=False)
    match path.suffix:
        case ".parquet":
            _write_parquet(path, columns, text)
        case ".csv":
            _write_csv(path, columns)
            path.with_suffix(".meta.json").write_text(text + "\n", encoding="utf-8")
        case ".npz":
            np.savez(path, metadata=np.array(text), allow_pickle=False, **columns)
        case _:
            raise ValueError(f"{path}: unknown format; there are {', '.join(FORMATS)}")


def _columns(trajectory: Trajectory) -> dict[str, Array]:
    columns: dict[str, Array] = {"t": trajectory.t}
    for k, axis in enumerate(trajectory.axes):
        columns[axis] = trajectory.position[:, k]
        columns["v" + axis] = trajectory.velocity[:, k]
        columns["a" + axis] = trajectory.acceleration[:, k]
        columns["j" + axis] = trajectory.jerk[:, k]
    return columns | {
        "s": trajectory.s,
        "feed": trajectory.feed,
        "line": trajectory.line,
        "block": trajectory.block,
    }


def _write_parquet(path: Path, columns: dict[str, Array], text: str) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.table({name: np.ascontiguousarray(column) for name, column in columns.items()})
    # Byte stream split puts the exponents of neighbouring samples side by side, and zstd at its fastest level then leaves 55 %
    # of the bytes, as fast as writing them raw. Higher levels take longer and save nothing; dictionaries make it larger.
    parquet.write_table(
        table.replace_schema_metadata({"planner": text}),
        path,
        compression="zstd",
        compression_level=1,
        use_dictionary=["line", "block"],
        use_byte_stream_split=[name for name in columns if name not in ("line", "block")],
    )


def _write_csv(path: Path, columns: dict[str, Array]) -> None:
    import pyarrow as pa
    from pyarrow import csv

    table = pa.table({name: np.ascontiguousarray(column) for name, column in columns.items()})
    with path.open("wb") as file:
        file.write((",".join(columns) + "\n").encode())  # pyarrow would put the names in quotes
        csv.write_csv(table, file, csv.WriteOptions(include_header=False, batch_size=65536))


# ---------------------------------------------------------------------------------------------- trajectories, in


@dataclass(frozen=True, eq=False, kw_only=True)
class TrajectoryFile:
    """A trajectory as read from a file.

    trajectory : the samples
    metadata   : what the file says about itself; empty for files made elsewhere
    notes      : columns the file lacks and how they were filled, one sentence each
    """

    trajectory: Trajectory
    metadata: dict[str, Any]
    notes: tuple[str, ...]


def read_trajectory(path: str | Path) -> TrajectoryFile:
    """Read a trajectory file, ours or made elsewhere.

    Required are `t` [s] and one column per axis, at least x and y. Missing velocities, accelerations and jerks are divided
    differences of what is there, at rest before the first and after the last sample; `s` is the length of the polyline through
    the samples, `feed` the speed; `line` and `block` become 0 and -1, "unknown".

    Raises InputError naming the file and the column.
    """
    path = Path(path)
    read = {".parquet": _read_parquet, ".csv": _read_csv, ".npz": _read_npz}.get(path.suffix.lower())
    if read is None:
        raise InputError(f"unknown format '{path.suffix}'; there are {', '.join(FORMATS)}", source=str(path))
    try:
        given, text = read(path)
        about = json.loads(text) if text else {}
    except FileNotFoundError as fault:
        raise InputError("trajectory file not found", source=str(path)) from fault
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"cannot be read: {fault}", source=str(path)) from fault
    columns = {name: _numbers(path, name, column) for name, column in given.items()}
    trajectory, notes = _assemble(str(path), columns)
    return TrajectoryFile(trajectory=trajectory, metadata=about if isinstance(about, dict) else {}, notes=notes)


def _read_parquet(path: Path) -> tuple[dict[str, Any], str]:
    from pyarrow import parquet

    table = parquet.read_table(path)
    text = (table.schema.metadata or {}).get(b"planner", b"").decode()
    return {name: table[name].to_numpy() for name in table.column_names}, text


def _read_csv(path: Path) -> tuple[dict[str, Any], str]:
    from pyarrow import csv

    table = csv.read_csv(path)
    beside = path.with_suffix(".meta.json")
    text = beside.read_text(encoding="utf-8") if beside.exists() else ""
    return {name: table[name].to_numpy() for name in table.column_names}, text


def _read_npz(path: Path) -> tuple[dict[str, Any], str]:
    with np.load(path, allow_pickle=False) as file:
        if not isinstance(file, np.lib.npyio.NpzFile):
            raise ValueError("a single array, not a .npz file")
        return {name: file[name] for name in file.files if name != "metadata"}, (
            str(file["metadata"]) if "metadata" in file.files else ""
        )


def _numbers(path: Path, name: str, column: Any) -> Array:
    """A column as numbers. Raises InputError naming the column and the row of the first that is none."""
    column = np.asarray(column)
    if column.ndim != 1 or column.dtype.kind not in "fiub":
        raise InputError(f"column '{name}' holds {column.dtype} of shape {column.shape}; numbers are needed", source=str(path))
    bad = np.flatnonzero(~np.isfinite(column))
    if len(bad):
        raise InputError(
            f"column '{name}', row {bad[0] + 1}: {column[bad[0]]}; every value must be a finite number", source=str(path)
        )
    return column


def _assemble(source: str, given: dict[str, Array]) -> tuple[Trajectory, tuple[str, ...]]:
    columns = {name.strip().lower(): column for name, column in given.items()}
    axes = tuple(axis for axis in LINEAR_AXES + ROTARY_AXES if axis in columns)
    for name in ("t", "x", "y"):
        if name not in columns:
            raise InputError(
                f"column '{name}' is missing; found are {', '.join(given) or 'none'}; needed are t [s] and the positions x, y, "
                "... [mm, rotary axes rad]",
                source=source,
            )
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"the columns differ in length: {lengths}", source=source)
    t = columns["t"] - columns["t"][:1]
    if len(t) < 2:
        raise InputError(f"{len(t)} samples; at least 2 are needed", source=source)
    late = np.flatnonzero(np.diff(t) < TIME_STEP_MIN)
    if len(late):
        raise InputError(f"column 't', row {late[0] + 2}: times must increase by at least {TIME_STEP_MIN:g} s", source=source)

    notes = []
    levels = [np.stack([columns[axis] for axis in axes], axis=1).astype(np.float64)]
    order_of = [0]  # order of the last level that the file holds, to differentiate from
    for prefix, word in (("v", "velocity"), ("a", "acceleration"), ("j", "jerk")):
        lacking = [prefix + axis for axis in axes if prefix + axis not in columns]
        if lacking:
            base, order = levels[order_of[-1]], len(levels) - order_of[-1]
            levels.append(divided_difference(t, base, order))
            notes.append(f"{word} derived from the {_LEVELS[order_of[-1]]} (no column {', '.join(lacking)})")
        else:
            order_of.append(len(levels))
            levels.append(np.stack([columns[prefix + axis] for axis in axes], axis=1).astype(np.float64))
    position, velocity, acceleration, jerk = levels
    linear = [k for k, axis in enumerate(axes) if axis in LINEAR_AXES]
    filled = {
        "s": np.append(0.0, np.cumsum(np.linalg.norm(np.diff(position[:, linear], axis=0), axis=1))),
        "feed": np.linalg.norm(velocity[:, linear], axis=1),
        "line": np.zeros(len(t)),
        "block": np.full(len(t), -1.0),
    }
    said = {"s": "taken from the positions", "feed": "taken from the velocity", "line": "unknown", "block": "unknown"}
    notes += [f"{name} {said[name]} (no column {name})" for name in filled if name not in columns]
    rest = {name: columns.get(name, column) for name, column in filled.items()}
    trajectory = Trajectory(
        axes=axes,
        dt=float(np.median(np.diff(t))),
        t=t,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        jerk=jerk,
        **rest,
    )
    return trajectory, tuple(notes)


_LEVELS = ("positions", "velocity", "acceleration")


def divided_difference(t: FloatArray, values: FloatArray, order: int) -> FloatArray:
    """Derivative of `order` 1, 2 or 3 of samples at times t (T,), values (T, A), by divided differences.

    At sample i: order 1 over i-1, i+1; order 2 over i-1, i, i+1; order 3 over i-1 .. i+2. Before the first and after the last
    sample the values are held, as a machine at rest does. Exact for polynomials of degree 1, 2 and 3 on equal steps.
    """
    before, after = (1, 1) if order < 3 else (1, 2)
    steps = np.diff(t)
    t = np.concatenate([[t[0] - steps[0]], t, t[-1] + steps[-1] * np.arange(1, after + 1)])
    values = np.concatenate([values[:1], values, np.repeat(values[-1:], after, axis=0)])
    if order == 1:
        return (values[2:] - values[:-2]) / (t[2:] - t[:-2])[:, None]
    table = values
    for k in range(1, order + 1):
        table = (table[1:] - table[:-1]) / (t[k:] - t[:-k])[:, None]
    return table * math.factorial(order)
