"""Search in ascending values, for kernels: numba compiles its own searchsorted slowly."""

from __future__ import annotations

from planner.kernels import njit


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
