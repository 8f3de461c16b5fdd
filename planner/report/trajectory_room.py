"""How large a trajectory file will be in memory, before it is read: what its headers say, held against its
own size.

An archive of 2 MB may say that it unpacks to gigabytes of zeros. What is judged are times that increase, and
positions: those of plans take half of their bytes in a Parquet file, a standstill of an hour a hundredth.

To how many digits a column of numbers was written, and times that lie on a grid.

A column in float32, or printed with p digits, is not what was computed: its numbers are off by up to half a
unit of the last digit. Third differences at 1 ms multiply that by 8e9, so that whoever judges accelerations
and jerks by positions has to know it.

Times are nearly always k dt. Where every time but the last is within its rounding of k dt, with one dt of few
digits, they are taken as that. The last period may be shorter.
"""

import math
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError

# Samples that are judged at most: as many as are planned, a day at 1 ms.
SAMPLES_MAX = 100_000_000
# What the columns may take in memory: so many times the size of the file, and so many bytes of any file.
PACKED, SMALL = 200, 256 << 20
METADATA_MAX = 16 << 20  # bytes; those of a plan have some thousands
_MEMBERS_MAX = 1_000  # arrays in an archive
_NUMBER = 8  # bytes
# Of the line with the names of the columns: what is looked at [bytes], and what is shown of it.
LINE_MAX, LINE_SHOWN = 1 << 16, 100


def npz_shapes(stream: BinaryIO) -> dict[str, tuple[int, ...]]:
    """The shape of each array of a .npz file by its header. Raises ValueError for another file, and for a
    header that the archive has not the bytes of."""
    if not zipfile.is_zipfile(stream):
        raise ValueError("a single array (.npy), or no archive of arrays")
    shapes: dict[str, tuple[int, ...]] = {}
    with zipfile.ZipFile(stream) as archive:
        members = archive.infolist()
        if len(members) > _MEMBERS_MAX:
            raise ValueError(f"{len(members)} arrays; there may be {_MEMBERS_MAX}")
        for member in members:
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as array:
                if np.lib.format.read_magic(array) == (1, 0):
                    shape, _, dtype = np.lib.format.read_array_header_1_0(array)
                else:
                    shape, _, dtype = np.lib.format.read_array_header_2_0(array)
            size = math.prod(shape) * dtype.itemsize
            if size > member.file_size and not dtype.hasobject:  # objects are refused by name
                raise ValueError(
                    f"array '{name}' has {size:,} bytes by its header, {member.file_size:,} in the archive"
                )
            if name == "metadata" and member.file_size > METADATA_MAX:
                raise ValueError(
                    f"its metadata have {member.file_size:,} bytes; there may be {METADATA_MAX:,}"
                )
            shapes[name] = shape
    return shapes


def require_room(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise InputError where columns of these shapes are no trajectory, or one that is too long to be judged,
    or that would take far more memory than its file."""
    lengths = {name: shape[0] for name, shape in shapes.items() if shape}
    if len(set(lengths.values())) > 1:
        raise InputError(f"the columns differ in length: {lengths}", source=str(path))
    rows = max(lengths.values(), default=0)
    if rows > SAMPLES_MAX:
        raise InputError(
            f"{rows:,} samples; at most {SAMPLES_MAX:,} are judged: verify a part of the motion at a time",
            source=str(path),
        )
    size, most = sum(map(math.prod, shapes.values())) * _NUMBER, max(SMALL, PACKED * os.path.getsize(path))
    if size > most:
        raise InputError(
            f"{rows:,} samples take {size:,} bytes, more than {PACKED} times those of the file, as no motion does; if it is one, write "
            "it without compression, as CSV or with numpy.savez",
            source=str(path),
        )


DIGITS_MAX = 11  # a column that needs more is taken as exact: at 100 mm the twelfth digit is 1e-9 mm
DISTINCT_MIN = 16  # numbers; fewer may be round by chance
PROBE = 64  # numbers tried before all of them
# A last time with up to so many decimals may be round by chance, and is taken as exact.
DECIMALS_BY_CHANCE = 4
DECIMALS_MAX = 16  # of a period [s]
NEGLIGIBLE = 1e-12  # [s] rounding of times that moves nothing: at 1 m/s it is 1e-9 mm
SMALLEST, LARGEST = 1e-12, 1e12  # [mm, s] numbers that are looked at
FLOAT64 = 4e-16  # relative rounding of a product, twice


def is_number(text: object) -> bool:
    """Whether a cell of a file holds a number."""
    try:
        float(str(text))
    except ValueError:
        return False
    return True


def require_names(path: Path, stream: BinaryIO) -> None:
    """Raise InputError if the first line of a CSV file does not name its columns, each once; `stream` is at its begin before
    and after."""
    line = stream.readline(LINE_MAX)
    stream.seek(0)
    names = line.decode("utf-8-sig", "replace").strip().split(",")
    if line.strip() and (len(names) > len(set(names)) or all(map(is_number, names))):
        said = f"the first line is {', '.join(names)[:LINE_SHOWN]!r}; it has to name each column once, such as t,x,y,z"
        raise InputError(said, source=str(path), line=1, column=1)


def rounding(column: Array) -> float:
    """Largest rounding error of the numbers of a column (T,), from the digits they are written with, in its
    unit; 0 if they show none."""
    if column.dtype.kind == "f" and column.dtype.itemsize < 8:
        return float(np.spacing(np.abs(column).max(initial=0))) / 2.0
    numbers = np.unique(np.abs(column.astype(np.float64)))
    numbers = numbers[numbers > SMALLEST]
    if len(numbers) < DISTINCT_MIN or numbers[-1] > LARGEST:
        return 0.0
    decade = np.floor(np.log10(numbers))
    probe = slice(None, None, max(len(numbers) // PROBE, 1))
    for digits in range(1, DIGITS_MAX + 1):
        if _has(numbers[probe], decade[probe], digits) and _has(numbers, decade, digits):
            return 0.5 * 10.0 ** (float(decade[-1]) + 1 - digits)
    return 0.0


def _has(numbers: FloatArray, decade: FloatArray, digits: int) -> bool:
    """Whether all numbers have no more than so many significant digits."""
    scaled = numbers * 10.0 ** (digits - 1 - decade)
    return bool((np.abs(scaled - np.rint(scaled)) <= FLOAT64 * scaled).all())


def on_grid(t: Array) -> tuple[FloatArray, float, float, float]:
    """Times t (T,) [s] from 0, replaced by k dt if they agree with it within their rounding.

    Returns the times [s], the rounding they were written with [s], and what remains of it for all times and
    for the last alone [s].
    """
    times = t.astype(np.float64)
    written = max(rounding(t), float(np.spacing(np.abs(times).max())) / 2.0)
    times = times - times[0]
    error = written if t[0] == 0 else 2.0 * written
    steps = len(t) - 1
    if error < NEGLIGIBLE or steps < 2:
        return times, error, 0.0, 0.0
    dt = _roundest(times[1:-1], error * (1 + 1e-6))
    if dt is None:
        return times, error, error, error
    grid: FloatArray = np.arange(len(t), dtype=np.float64) * dt
    if abs(times[-1] - grid[-1]) <= min(error * (1 + 1e-6), 0.5 * dt):
        return grid, error, 0.0, 0.0
    grid[-1] = times[-1]
    shown = t.dtype.itemsize < 8 or t[0] != 0
    return grid, error, 0.0, error if shown else _of_last(float(times[-1]))


def _roundest(times: FloatArray, error: float) -> float | None:
    """The dt of fewest decimals for which times (n,) are 1 dt, 2 dt, ... up to `error`; None if there is none
    [s]."""
    k = np.arange(1, len(times) + 1)
    low, high = float(((times - error) / k).max()), float(((times + error) / k).min())
    for decimals in range(DECIMALS_MAX):
        dt = np.ceil(low * 10.0**decimals) / 10.0**decimals
        if 0.0 < dt <= high:
            return float(dt)
    return None


def _of_last(time: float) -> float:
    """Rounding of a single time by its decimals [s]."""
    for decimals in range(DECIMALS_BY_CHANCE, DIGITS_MAX + 1):
        scaled = time * 10.0**decimals
        if abs(scaled - round(scaled)) <= FLOAT64 * scaled:
            return 0.5 * 10.0**-decimals if decimals > DECIMALS_BY_CHANCE else 0.0
    return 0.0
