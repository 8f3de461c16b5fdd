"""By how much a profile has to be slower to keep its limits at the grid points.

Slower by a factor is speeds over it, accelerations over its square, jerks over its cube.
"""

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.rows import duration


@njit(cache=True, error_model="numpy", nogil=True)
def slower_by(columns, begin, x, u, jerk, room):
    """The smallest factor >= 1 by which a profile over points from `begin` on has to be slower to keep every
    limit times `room` at the points, the feed, and both ends of the intervals, acceleration and jerk.

    x, u : (N+1,)
    jerk : (N,)
    """
    n, axes = len(x) - 1, columns.d1.shape[1]
    second, third = room, room
    for i in range(n + 1):
        a, v = begin + i, np.sqrt(x[i])
        second = max(second, x[i] / columns.x_max[a])
        for k in range(axes):
            d1, per_a, per_j = columns.d1[a, k], 1.0 / columns.acceleration[a, k], 1.0 / columns.jerk[a, k]
            if i > 0:
                d2, d3 = columns.d2_left[a, k], columns.d3_left[a, k]
                second = max(second, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i - 1] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
            if i < n:
                d2, d3 = columns.d2_right[a, k], columns.d3_right[a, k]
                second = max(second, abs(d1 * u[i] + d2 * x[i]) * per_a)
                third = max(third, abs(d1 * jerk[i] + v * (3.0 * d2 * u[i] + d3 * x[i])) * per_j)
    return max(np.sqrt(second / room), np.cbrt(third / room))


@njit(cache=True, error_model="numpy", nogil=True)
def jerk_of(s, x, u):
    """(N,) jerk of a profile x, u (N+1,) over the points s."""
    n = len(x) - 1
    jerk = np.empty(n)
    for i in range(n):
        p = u[i + 1] - u[i]
        jerk[i] = p / duration(np.sqrt(x[i]), np.sqrt(x[i + 1]), p, s[i + 1] - s[i])
    return jerk
