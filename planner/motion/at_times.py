"""The kernel behind motion/timing.py: a motion along a path at given times.

A time gives an arc length s by the time law; the polynomial of the grid interval there (sampling.py) the
parameter w, and that the place and its derivatives.
"""

import numpy as np

from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.corners.elements import to_arc_length
from planner.motion.sampling import interval_of, place_of, room_for


@njit(cache=True, error_model="numpy", nogil=True)
def sample(table, law, grid, inverse, times, axes):
    """Position and derivatives (T, A), s and feed (T,) at ascending times, and the toolpath segment (T,) that
    each lies at; an interval of a span may cover several.

    table, grid : `ElementTable` (corners/elements.py), `Grid` (sampling.py)
    law         : `TimeLaw.columns`
    inverse     : (P, `COEFFICIENTS`), from `inverses` (sampling.py)
    """
    legs, _, spans = table
    t, s_law, feed, acc_s, jerk_s, run, end = law
    piece, s, element, _, _, of_interval, passed = grid
    count = len(times)
    out_position, out_velocity = np.empty((count, axes)), np.empty((count, axes))
    out_acceleration, out_jerk = np.empty((count, axes)), np.empty((count, axes))
    out_s, out_feed, segment = np.empty(count), np.empty(count), np.empty(count, np.int64)
    room, here = room_for(axes), np.empty((4, axes))
    m = last_not_after(t, times[0], 0, len(t) - 1) if count else 0
    i, at, joint = -1, 0, 0
    on = interval_of(table, grid, at, room)
    for n in range(count):
        while m + 1 < len(t) and t[m + 1] <= times[n]:
            m += 1
        tau = max(times[n] - t[m], 0.0)
        u, j = acc_s[m] + jerk_s[m] * tau, jerk_s[m]
        v = max(feed[m] + tau * (acc_s[m] + 0.5 * jerk_s[m] * tau), 0.0)
        s_here = s_law[m] + tau * (feed[m] + tau * (acc_s[m] / 2.0 + jerk_s[m] * tau / 6.0))
        if m + 1 < len(t):
            s_here = min(s_here, s_law[m + 1])
        if times[n] >= end:
            s_here, v, u, j = s[-1], 0.0, 0.0, 0.0
        elif times[n] < t[m]:  # a dwell before the first move
            v, u, j = 0.0, 0.0, 0.0
        first, last = piece[run[m]], piece[run[m] + 1] - 2  # the intervals of this run
        if i < first:
            i = last_not_after(s, s_here, first, last)
        while i < last and s[i + 1] <= s_here:
            i += 1
        if i != at:
            on, at = interval_of(table, grid, i, room), i
        ds = min(max(s_here - s[i], 0.0), on.h)
        w = place_of(table, on, room, inverse[i], ds, here)
        to_arc_length(here)
        out_s[n], out_feed[n] = s[i] + ds, v
        segment[n] = of_interval[i]
        if element[i] >= len(legs):
            span = element[i] - len(legs)
            place = spans[span].begin + spans[span].width * w
            if joint + 1 >= len(passed) or passed[joint + 1] <= place or passed[joint] > place:
                joint = last_not_after(passed, place, 0, len(passed) - 2)
            segment[n] = joint
        for k in range(axes):
            tangent, bend, twist = here[1, k], here[2, k], here[3, k]
            out_position[n, k], out_velocity[n, k] = here[0, k], tangent * v
            out_acceleration[n, k] = tangent * u + bend * (v * v)
            out_jerk[n, k] = tangent * j + 3.0 * bend * (v * u) + twist * (v * v * v)
    return out_position, out_velocity, out_acceleration, out_jerk, out_s, out_feed, segment
