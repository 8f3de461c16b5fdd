"""Where a motion keeps the largest feed all along: its solution is known there, and only what lies between
has to be solved.

With u = j = 0 and x = X the rows of rows.py are |r''_k| X <= a_k and |r'''_k| X^(3/2) <= j_k. Where X is the
bound of the feed at every point, and these rows leave at least `FREE` of accelerations and jerks,

    x = X (1 - LESS),    u = 0,    j = 0

keeps all limits, and no motion takes less time by more than LESS/2 of it. What comes before and after reaches
in by about the way to brake. So a range is held from `BRAKING_WAYS` such ways (chain.py) behind its beginning
up to as many before its end, if `POINTS` lie between. What lies between held ranges are problems of their
own: from X or rest to X or rest.

Multipliers: a change of x_i changes the intervals on both of its sides, of h = 2 ds/(v_i + v_{i+1}), for
which the bound alone answers,

    lam_i = X (ds_{i-1} + ds_i) / (4 X^(3/2)),

so that dT/d(ln X) = -T/2. Rows and kinematics have none.
"""

from typing import NamedTuple

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.chain import reach_of_end
from planner.feedrate.jerk.columns import ProblemColumns
from planner.feedrate.jerk.profile import Profile

FREE = 0.5  # of accelerations and jerks [-]: what changes the speed needs them (feedrate/sampling/calm.py)
LESS = 1e-6  # of feed^2 [-]: the interior-point method needs room at the ends of what lies between
POINTS = 100  # of a held range at least: with what lies between, two ways to brake are solved more for each
EDGE = (
    8  # points at least from the ends of what could be held: on coarse grids few points lie on a way to brake
)
EQUAL = 1e-9  # bounds of the feed that differ by less are the same [-]


class Held(NamedTuple):
    """A range from point `first` to point `last` on which feed^2 is x [mm2/s2]."""

    first: int
    last: int
    x: float


def held_ranges(columns: ProblemColumns, first: int, last: int) -> list[Held]:
    """The held ranges between two full stops, at the points first and last."""
    if last - first < POINTS:
        return []
    own = slice(first, last + 1)
    a, j, s = columns.acceleration[own].min(), columns.jerk[own].min(), columns.s
    free = _could_be_held(columns, first, last)
    edges = np.flatnonzero(free[1:] != free[:-1]).reshape(
        -1, 2
    )  # the last point before, the last point of each
    found = []
    for before, end in (edges[edges[:, 1] - edges[:, 0] >= POINTS] + first).tolist():
        x = float(columns.x_max[before + 1 : end + 1].min())
        reach = reach_of_end(x, a, j)
        begin = max(int(np.searchsorted(s[own], s[before] + reach)) + first, before + EDGE)
        beyond = min(
            int(np.searchsorted(s[own], s[end + 1] - reach, side="right")) - 1 + first, end + 1 - EDGE
        )
        if beyond - begin >= POINTS:
            found.append(Held(begin, beyond, x * (1.0 - LESS)))
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _could_be_held(columns, first, last):
    """(n+1,) True for points of first..last, but the two ends, at which the bound of the feed is that of both
    neighbours, and can be kept with `FREE` of accelerations and jerks to spare."""
    x_max = columns.x_max
    found = np.zeros(last - first + 1, np.bool_)
    for i in range(first + 1, last):
        x = x_max[i]
        if abs(x_max[i - 1] - x) > EQUAL * x or abs(x_max[i + 1] - x) > EQUAL * x:
            continue
        free = True
        for k in range(columns.d1.shape[1]):
            bend = max(abs(columns.d2_left[i, k]), abs(columns.d2_right[i, k]))
            twist = max(abs(columns.d3_left[i, k]), abs(columns.d3_right[i, k]))
            free = free and bend * x <= (1.0 - FREE) * columns.acceleration[i, k]
            free = free and twist * x * np.sqrt(x) <= (1.0 - FREE) * columns.jerk[i, k]
        found[i - first] = free
    return found


def hold(profile: Profile, columns: ProblemColumns, held: Held) -> None:
    """Write a held range and its multipliers into a profile; those of the states at its ends belong to it
    too."""
    points, inside = slice(held.first, held.last + 1), slice(held.first, held.last)
    v = np.sqrt(held.x)
    ds = np.diff(columns.s[held.first - 1 : held.last + 2])
    for values in (profile.jerk, profile.rows, profile.dynamics, profile.feed):
        values[inside] = 0.0
    profile.x[points], profile.u[points] = held.x, 0.0
    profile.duration[inside] = ds[1:-1] / v
    profile.feed[points, 0] = (ds[:-1] + ds[1:]) / (4.0 * v)
