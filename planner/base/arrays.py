"""Arrays inside records: right shape, finite, and read-only, or an error that names the field."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
FloatArray = NDArray[np.float64]
# Axes that a vector in a record of a kernel has room for: a kernel is compiled for each kind of record.
ROOMS = (3, 9)


def room(axes: int) -> int:
    """How many numbers a vector over `axes` axes takes in a record; those beyond are 0."""
    return next((room for room in ROOMS if axes <= room), axes)


def read_only(array: Array) -> Array:
    """The array (n, ..), not to be written: a kernel is compiled once more for one that can be."""
    view = array.view()
    view.flags.writeable = False
    return view


def freeze(
    record: object, names: str, dtype: type, shape: tuple[int | None, ...], *, finite: bool = True
) -> None:
    """Convert fields of a frozen dataclass to contiguous read-only arrays of a shape like (3, None).

    An array that has the type already is not copied (trajectories fill gigabytes): the record then shares
    memory with the caller's array, which the caller must not change any more.

    names  : of the fields, with spaces between them
    shape  : expected shape; None where any length will do
    finite : refuse NaN and infinity (floating point fields only)

    Raises ValueError naming record, field, found and expected.
    """
    for name in names.split():
        given = getattr(record, name)
        array: Array = np.ascontiguousarray(given, dtype=dtype)
        if array is given and array.flags.writeable:
            array = array.view()  # the caller keeps a writable array of its own; ours is not
        if array.shape != shape and not _fits(array.shape, shape):
            raise ValueError(f"{type(record).__name__}.{name}: shape {array.shape}, expected {shape}")
        if finite and array.dtype.kind == "f" and not np.logical_and.reduce(np.isfinite(array), axis=None):
            bad = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
            where = f"{type(record).__name__}.{name}"
            raise ValueError(f"{where}: {array[bad]} at index {bad}; every value must be finite")
        array.flags.writeable = False
        object.__setattr__(record, name, array)


def _fits(found: tuple[int, ...], shape: tuple[int | None, ...]) -> bool:
    # a plan of ten lines freezes 10,000 arrays; any() over a generator takes 1 us longer than this loop
    if len(found) != len(shape):
        return False
    for got, want in zip(found, shape, strict=True):  # noqa: SIM110
        if want is not None and got != want:
            return False
    return True
