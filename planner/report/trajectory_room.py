"""How large a trajectory file will be in memory, before it is read: what its headers say, held against its own size.

An archive of 2 MB may say that it unpacks to gigabytes of zeros. What is judged are times that increase, and positions: those of plans
take half of their bytes in a Parquet file, a standstill of an hour a hundredth.
"""

from __future__ import annotations

import math
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from planner.base.errors import InputError

# Samples that are judged at most: as many as are planned, a day at 1 ms.
SAMPLES_MAX = 100_000_000
# What the columns may take in memory: so many times the size of the file, and so many bytes of any file.
PACKED, SMALL = 200, 256 << 20
METADATA_MAX = 16 << 20  # bytes; those of a plan have some thousands
_MEMBERS_MAX = 1_000  # arrays in an archive
_NUMBER = 8  # bytes


def npz_shapes(stream: BinaryIO) -> dict[str, tuple[int, ...]]:
    """The shape of each array of a .npz file by its header. Raises ValueError for another file, and for a header that the archive
    has not the bytes of."""
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
    """Raise InputError where columns of these shapes are no trajectory, or one that is too long to be judged, or that would take far
    more memory than its file."""
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
