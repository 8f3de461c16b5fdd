"""Search in ascending values; the kernels have their own, as numba compiles its searchsorted slowly."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit


def nearest(values: FloatArray, wanted: FloatArray) -> Array:
    """(n,) indices of the ascending values (m,), m > 0, nearest to `wanted` (n,); the first of equals."""
    above = np.clip(np.searchsorted(values, wanted), 1, max(len(values) - 1, 1))
    below = np.minimum(above - 1, len(values) - 1)
    above = np.minimum(above, len(values) - 1)
    closer: Array = np.where(wanted - values[below] <= values[above] - wanted, below, above)
    return np.asarray(np.searchsorted(values, values[closer]))


@njit(cache=True, error_model="numpy")
def last_not_after(values, limit, first, last):
    """Largest index in [first, last] whose ascending value is <= limit; `first` if there is none."""
    while first < last:
        middle = (first + last + 1) // 2
        if values[middle] <= limit:
            first = middle
        else:
            last = middle - 1
    return first


@njit(cache=True, error_model="numpy")
def first_not_before(values, limit):
    """Index of the first of the ascending values (m,) that is >= limit; m if there is none."""
    first, last = 0, len(values)
    while first < last:
        middle = (first + last) // 2
        if values[middle] < limit:
            first = middle + 1
        else:
            last = middle
    return first
