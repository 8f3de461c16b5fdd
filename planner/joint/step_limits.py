"""The limits of the steps of a window, and which rows they have, in one kernel: short runs have a window of some fifty steps
each, for which a hundred calls of numpy take longer than its search."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint import row_kinds as rows
from planner.joint.normal_rows import turns_far

# The tolerance is narrowed by this fraction [-], so that rounding stays inside it.
ROUNDING = 1e-4
# Chords that pass a place at another share u than the middle are off p + 4 u (1 - u) (dt^2/8) a by |jerk| dt^3/48 at most (Peano's
# kernel of that, at the middle). The tolerance is narrowed by that too, but by no more than this fraction [-]: what is left
# of it at long periods is found when the motion is looked at.
CHORDS = 1e-2
# Weights of what the motion does for no time, against the time [-]: of the squares of all jerks, as shares of
# their limits, on steps that run at the programmed feed and on all others; and of half the square of how far
# nodes are from their leg, as a share of the tolerance. So jerk is small, and positions are near the path,
# where time does not depend on them. Where all of the tolerance saves the share g of the time, the last leaves
# g - g^2/CENTRE of that unused, CENTRE/4 at most; the others cost less than 1e-4, on the mean.
SMOOTH_AT_FEED, SMOOTH, CENTRE = 1e-2, 3e-4, 3e-4
# A step whose ends are as fast as this share of the feed runs at it [-].
AT_FEED = 0.995
# Of the largest length of a step on an arc [-]: h (v + a h/2) stands for it, which leaves out h3 j/6.
STEP_SHARE = 0.95
# What chords leave of the room of a node at a vertex at least [-].
LEAST_ROOM = 0.2


class OfRun(NamedTuple):
    """What a run of R legs over A axes says of steps (run.py)."""

    room: FloatArray  # (R,) [mm]
    vertex_budget: FloatArray  # (R+1,) [mm]
    vertex: FloatArray  # (R+1, A) [mm]
    offset: FloatArray  # (R+1,) [mm]
    feed: FloatArray  # (R,) [mm/s]
    across_max: FloatArray  # (R,) [mm/s2]
    curvature: FloatArray  # (R,) [1/mm]
    step_max: FloatArray  # (R,) [mm]
    switch: FloatArray  # (R,)
    passed: Array  # (R,)
    by_jerk: float  # what chords are off by jerk [mm]
    fastest: float  # all axes together [mm/s]
    strongest: float  # [mm/s2]
    slowest: float  # the slowest axis [mm/s]
    jerky: bool  # whether the jerk is limited


@njit(cache=True, error_model="numpy")
def speeds(velocity):
    """(n,) of velocities (n, A)."""
    found = np.zeros(len(velocity))
    for i in range(len(velocity)):
        for k in range(velocity.shape[1]):
            found[i] += velocity[i, k] * velocity[i, k]
        found[i] = np.sqrt(found[i])
    return found


def weights(least: float) -> tuple[float, float, float, float]:
    """These, and what the weight of the jerk is at least [-], for kernels: a constant would be compiled into them."""
    return SMOOTH_AT_FEED, SMOOTH, CENTRE, float(least)


@njit(cache=True, error_model="numpy")
def jerk_weights(feed, velocity, weights):
    """(N,) weights of the jerks of steps [-]. Where the feed holds the motion less jerk costs no time, on
    ramps it does.

    feed     : (N,) of the steps' legs [mm/s]
    velocity : (N+1, A) of the nodes [mm/s]
    weights  : as the function returns them
    """
    at_feed, otherwise, _, least = weights
    speed = speeds(velocity)
    held = np.minimum(speed[:-1], speed[1:]) >= AT_FEED * feed
    return np.maximum(np.where(held, at_feed, otherwise), least)


@njit(cache=True, error_model="numpy")
def narrowed(room, by_jerk):
    """Distances `room` (n,) [mm], or one, narrowed by `ROUNDING` and for chords, which are off by `by_jerk` by jerk [mm]."""
    return room * (1.0 - ROUNDING) - np.minimum(by_jerk, CHORDS * room)


@njit(cache=True, error_model="numpy")
def pace(velocity):
    """(N,) speed of each step [mm/s], at most a thousand times below the fastest: near rest the rows of the
    normal acceleration have to be as small as the speed.

    velocity : (N+1, A) at the nodes [mm/s]
    """
    at_nodes = speeds(velocity)
    return np.maximum(np.maximum(at_nodes[:-1], at_nodes[1:]), 1e-3 * at_nodes.max())


@njit(cache=True, error_model="numpy")
def step_limits(run, units, origin, cut, before, rest_at, beside, tight, rest, numbers):
    """The columns of `StepLimits` (row_kinds.py) that do not depend on laws, places on legs that are passed, or limits of
    axes: in this order at_vertex, on, passed, room, room_node, rest, turns, step_max, switch, switch_at, side; feed, feed_node,
    normal, normal_node, pace; h, h_max, h_min, smooth, centre.

    run     : `OfRun`
    units   : of time [s], length [mm], speed and acceleration
    origin  : (A,) where positions are counted from [mm]
    cut     : leg (N,), h (N,), state (N+1, 3, A) of the steps
    before  : leg of the step before them, -1 where there is none
    rest_at : whether they begin and whether they end where the run is at rest
    beside  : `Beside` (switches.py)
    tight   : (N,) by what the room is divided [-]
    rest    : (N+1, A+1) of `Window`, 0 rows where nothing is known
    numbers : what limits are multiplied by [-]; `weights`; by what durations may change [-]
    """
    leg, h, state = cut
    inside, weights, longer = numbers
    second, length, speed, acceleration = units
    N, axes = len(leg), state.shape[2]
    first = 8 * axes
    at_vertex, on = np.zeros(N, np.bool_), np.ones((N, first + rows.MORE_ROWS), np.bool_)
    passed, room, room_node = np.zeros(N, np.bool_), np.empty(N), np.empty(N)
    rests, feed, feed_node = np.zeros((N, 2, axes)), np.empty(N), np.empty(N)
    normal, normal_node, step_max = np.empty(N), np.empty(N), np.empty(N)
    switch, switch_at, side = np.zeros(N), np.empty((N, axes)), np.zeros((N, axes))
    lasting, centre = np.empty(N), np.full(N, weights[2])
    velocity = state[:, 1]
    own_pace, smooth = pace(velocity), jerk_weights(run.feed[leg], velocity, weights)
    turns, fed, over = turns_far(velocity), False, False
    for i in range(N):
        fed |= run.feed[leg[i]] < run.fastest
        over |= run.feed[leg[i]] > run.slowest
    for i in range(N):
        r = leg[i]
        at_vertex[i] = r > (leg[i - 1] if i else before)
        passed[i] = run.passed[r]
        feed[i], normal[i] = min(run.feed[r], run.fastest), min(run.across_max[r], run.strongest)
        room[i] = room_node[i] = narrowed(run.room[r], run.by_jerk)
        if at_vertex[i] and r > 0:
            both = min(run.room[r - 1], run.room[r])
            room_node[i] = narrowed(min(run.vertex_budget[r], both), run.by_jerk)
        room[i], room_node[i] = room[i] / tight[i] / length, room_node[i] / tight[i] / length
        arc = min(run.step_max[r], run.offset[-1]) if run.curvature[r] > 0.0 else 1.0
        step_max[i] = STEP_SHARE * arc / length
        lasting[i] = h[i] / second
        if len(rest):
            room_node[i] = max(room_node[i] - rest[i, axes] / length, LEAST_ROOM * room_node[i])
            for k in range(axes):
                rests[i, 0, k], rests[i, 1, k] = rest[i, k] / length, rest[i + 1, k] / length
        turns[i] &= np.isfinite(run.across_max[r])
        own = run.switch[r] if at_vertex[i] else 0.0
        of = r if own != 0.0 else -1
        for k in range(axes):
            switch_at[i, k] = run.vertex[r, k]
        if beside.leg[i] >= 0:
            of = beside.leg[i]
            for k in range(axes):
                switch_at[i, k] = beside.at[i, k]
        switch[i] = run.switch[of] if of >= 0 else 0.0
        again = run.switch[of] if beside.again[i] else 0.0
        for k in range(axes):
            side[i, k] = again * state[i, 1, k] / own_pace[i]
            switch_at[i, k] = (switch_at[i, k] - origin[k]) / length
        on[i, : 2 * axes] = run.jerky
        # a feed that is no less than the axes can be together leaves the axes' own limits, which are all there is
        on[i, 4 * axes : first] = not fed or over
        more, bent = on[i, first:], run.curvature[r] != 0.0
        more[rows.FEED_NODE : rows.TUBE_NODE] = fed
        more[rows.ORDER_NODE] = bent and not at_vertex[i]
        more[rows.ORDER_MID] = bent
        limited = np.isfinite(run.across_max[r])
        more[rows.NORMAL_NODE] = limited
        more[rows.NORMAL_ROWS : rows.LAW_ROWS] = limited
        more[rows.ARC] = bent
        more[rows.SWITCH] = of >= 0
        more[rows.SIDE] = of >= 0 and beside.again[i]
    _at_the_ends(on, first, axes, rest_at)
    for i in range(N):
        if passed[i]:
            more = on[i, first:]
            more[rows.ORDER_NODE] = more[rows.ORDER_MID] = more[rows.ARC] = False
    _where_it_turns(state, turns, on[:, first:], normal)
    for i in range(N):
        feed_node[i] = min(feed[i], feed[i - 1] if i else feed[0]) * inside / speed
        normal_node[i] = min(normal[i], normal[i - 1] if i else normal[0]) * inside / acceleration
    for i in range(N):
        feed[i], normal[i] = feed[i] * inside / speed, normal[i] * inside / acceleration
    of_room = at_vertex, on, passed, room, room_node, rests, turns, step_max, switch, switch_at, side
    of_pace = feed, feed_node, normal, normal_node, own_pace / speed
    return of_room, of_pace, (lasting, lasting * longer, lasting / longer, smooth, centre)


@njit(cache=True, error_model="numpy")
def _at_the_ends(on, first, axes, rest_at):
    """The first node stays: its rows are not asked for. Where a run is at rest, the middle ordinates of the velocity and of
    a x v are 0 for every motion."""
    on[0, 2 * axes : 4 * axes] = False
    on[0, 6 * axes : first] = False
    begins = on[0, first:]
    begins[rows.FEED_NODE] = begins[rows.TUBE_NODE] = begins[rows.TUBE_NODE + 3] = False
    begins[rows.ORDER_NODE] = begins[rows.NORMAL_NODE] = begins[rows.SWITCH] = begins[rows.SIDE] = False
    for end in range(2):
        if rest_at[end]:
            more = on[-end, first:]
            more[rows.ORDER_MID] = False
            more[rows.NORMAL_ROWS : rows.LAW_ROWS] = False


@njit(cache=True, error_model="numpy")
def _where_it_turns(state, turns, more, normal):
    """On steps that turn far (normal_rows.py) the rows between the nodes are asked for, and the limit is that of both
    nodes; not where the motion at a node that stays exceeds it."""
    N, least = len(turns), normal.copy()
    for i in range(N):
        least[i] = min(min(normal[i], normal[max(i - 1, 0)]), normal[min(i + 1, N - 1)])
    for i in range(N):
        if turns[i]:
            normal[i] = least[i]
    strength = speeds(state[:, 2])
    turns[0] &= strength[0] <= normal[0]
    turns[-1] &= strength[-1] <= normal[-1]
    for i in range(N):
        if turns[i]:
            more[i, rows.NORMAL_ROWS : rows.LAW_ROWS] = True
            more[i, rows.NORMAL_NODE] = False
            if i + 1 < N:
                more[i + 1, rows.NORMAL_NODE] = False
    more[0, rows.NORMAL_ROWS] &= not turns[0]
    more[-1, rows.NORMAL_ROWS + 1] &= not turns[-1]
