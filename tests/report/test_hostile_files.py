"""Trajectory files whose headers promise more than a motion has are not unpacked, and names that are not UTF-8 work."""

from __future__ import annotations

import io
import os
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hand_made import make_plan

import planner
from planner.base.errors import InputError
from planner.base.files import readable
from planner.report.trajectory_file import read_trajectory, write_trajectory
from planner.report.trajectory_room import PACKED, SAMPLES_MAX, SMALL

ROWS = 40_000_000  # 320 MB a column


def header(shape: tuple[int, ...], kind: str = "<f8") -> bytes:
    """The start of an array in a .npz file."""
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": kind, "fortran_order": False, "shape": shape})
    return out.getvalue()


def zeros(file: Path, **rows: int) -> Path:
    """An archive of arrays of zeros."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, count in rows.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as array:
                array.write(header((count,)))
                for first in range(0, count, 1 << 20):
                    array.write(bytes(8 * min(1 << 20, count - first)))
    return file


def peak(file: Path, message: str) -> int:
    """The memory that refusing a file takes [bytes]."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=message):
            read_trajectory(file)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_an_archive_that_unpacks_to_gigabytes_is_not_unpacked(tmp_path: Path) -> None:
    differ = zeros(tmp_path / "differ.npz", t=ROWS, x=16)
    assert peak(differ, "columns differ in length: {'t': 40000000, 'x': 16}") < 20e6
    packed = zeros(tmp_path / "packed.npz", t=ROWS, x=ROWS)
    assert packed.stat().st_size * PACKED < 16 * ROWS
    assert 16 * ROWS > SMALL
    assert peak(packed, "more than 200 times those of the file") < 20e6


@pytest.mark.parametrize("shape", [(1 << 40,), (1 << 30, 1 << 30), (10**9,)])
def test_a_header_that_lies_is_a_fault_of_the_file(tmp_path: Path, shape: tuple[int, ...]) -> None:
    """For Python, too: not a MemoryError."""
    file = tmp_path / "lies.npz"
    with zipfile.ZipFile(file, "w") as archive:
        for name in ("t", "x"):
            archive.writestr(f"{name}.npy", header(shape) + bytes(64))
    assert peak(file, "by its header") < 5e6


def test_what_is_no_column_of_a_motion_is_not_read(tmp_path: Path) -> None:
    trajectory = make_plan().trajectory
    file = tmp_path / "more.npz"
    np.savez(
        file,
        t=trajectory.t,
        XYZ=trajectory.position,
        load=np.array(["low", "high"]),
        power=np.zeros((3, 4, 5)),
    )
    read = read_trajectory(file)
    np.testing.assert_array_equal(read.trajectory.position, trajectory.position)


@pytest.mark.slow
def test_a_parquet_file_of_more_rows_than_a_day_is_refused_by_its_footer(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    file = tmp_path / "long.parquet"
    schema = pa.schema([("t", pa.float64()), ("x", pa.float64())])
    group = pa.table({name: pa.array(np.zeros(1 << 22)) for name in schema.names})
    with parquet.ParquetWriter(file, schema) as writer:
        for _ in range(SAMPLES_MAX // (1 << 22) + 1):
            writer.write_table(group)
    assert peak(file, "verify a part of the motion") < 20e6


def test_of_very_many_columns_the_first_are_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "wide.npz", t=np.arange(4.0), **{f"load{n}": np.zeros(4) for n in range(900)})
    with pytest.raises(InputError, match="no column of an axis; found are t, load0, load1, ") as fault:
        read_trajectory(tmp_path / "wide.npz")
    assert "needed are t [s] and the positions" in str(fault.value)
    assert len(str(fault.value)) < 1_000


def test_too_little_memory_is_told_by_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "trajectory.npz"
    write_trajectory(file, make_plan().trajectory)

    def full(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr(np, "load", full)
    with pytest.raises(InputError, match="verify a part of the motion") as fault:
        read_trajectory(file)
    assert fault.value.source == str(file)


LATIN = os.fsdecode(b"lat\xfc")


def test_what_python_could_not_decode_is_written_as_utf_8() -> None:
    assert readable("plain, µ and ü") == "plain, µ and ü"
    assert readable(LATIN) == r"lat\xfc"
    assert readable("\udcc3\udcbc") == "ü"  # in the C locale a name is ASCII
    for text in (LATIN, "half of a pair \ud83d", "\udcff\ud83dé"):
        readable(text).encode()


@pytest.mark.parametrize("suffix", ["parquet", "csv", "npz"])
def test_files_of_such_names(tmp_path: Path, suffix: str) -> None:
    trajectory = make_plan().trajectory
    file = tmp_path / f"{LATIN}.{suffix}"
    write_trajectory(file, trajectory, {"source": LATIN})
    read = read_trajectory(file)
    assert read.metadata == {"source": LATIN}
    np.testing.assert_array_equal(read.trajectory.position, trajectory.position)


def test_a_plan_of_such_a_name_writes_all_its_files(tmp_path: Path) -> None:
    program = tmp_path / f"{LATIN}.ngc"
    program.write_text("G21 G90 F900\nG1 X3\nY2\nM2\n", encoding="utf-8")
    made = planner.plan(program, method="stop")
    folder = tmp_path / LATIN
    page = made.report().save(tmp_path / f"{LATIN}.html")
    assert r"lat\xfc.ngc" in page.read_text(encoding="utf-8")
    made.save(folder)
    assert (folder / "summary.json").exists()
    found = read_trajectory(folder / "trajectory.parquet").trajectory
    assert planner.verify(found.t, found.position, program).passed
