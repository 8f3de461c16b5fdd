"""From rest to rest along a line: the fastest move with limits v, a, j on speed, acceleration and jerk.

It is symmetric. Over a length L

    peak speed p = min(v, p_L),   p_L from   p^2/a + p a/j = L   (a is reached),   or   (j L^2 / 4)^(1/3)   (it is not: p_L < a^2/j)
    T = L/p + p/a + a/j   for p >= a^2/j,      L/p + 2 sqrt(p/j)   below:

jerk j for A/j, none for p/A - A/j and -j for A/j with the largest acceleration A = min(a, sqrt(p j)), the
cruise, and the same backwards. The tests compare it with ruckig.
"""

import numpy as np

from planner.base.arrays import FloatArray

PHASES = 7  # a jerk-limited move from rest to rest


def rest_to_rest_times(length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
    """(n,) shortest times from rest to rest [s] (module text).

    length  : (n,) [mm]
    v, a, j : (n,) limits of speed, acceleration and jerk along the block [mm/s], [mm/s2], [mm/s3]
    """
    peak = _peak(length, v, a, j)
    return length / peak + np.where(peak < a**2 / j, 2 * np.sqrt(peak / j), peak / a + a / j)


def rest_to_rest_phases(
    length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Durations [s] and jerks along the block [mm/s3], each (n, 7), of the moves of `rest_to_rest_times`.

    length  : (n,) [mm]
    v, a, j : (n,) limits as there
    """
    peak = _peak(length, v, a, j)
    largest = np.minimum(a, np.sqrt(peak * j))
    rise = largest / j
    held = np.maximum(peak / largest - rise, 0.0)
    cruise = np.where(peak < v, 0.0, np.maximum(length / peak - 2 * rise - held, 0.0))
    duration = np.stack([rise, held, rise, cruise, rise, held, rise], axis=1)
    return duration, j[:, None] * np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


def _peak(length: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
    """Largest speed (n,) [mm/s] of the moves."""
    threshold = a**2 / j  # the speed at which a trapezoid of acceleration becomes a triangle
    without = np.cbrt(j * length**2 / 4)
    with_plateau = (np.sqrt(threshold**2 + 4 * a * length) - threshold) / 2
    return np.minimum(v, np.where(without < threshold, without, with_plateau))
