"""Windows that are searched side by side (interior_point.py), one in each lane: their steps one after the other,
numbers of all lanes behind each other in the last dimension, filled up to the longest window with steps that have
no rows. There may be more windows than lanes: they wait in a queue, from which a lane takes the next one where its own has
ended.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.views import size
from planner.geometry.curves import ordinates
from planner.joint.laws import LawRows
from planner.joint.legs import LegFormulas
from planner.joint.problem import StepWindow
from planner.joint.row_kinds import NORMAL_NODE, NORMAL_ROWS, SETS, SWITCH, TUBE_NODE

# Numbers of axes that there are kernels for; windows of other numbers have axes beside that do not move, and those of more
# a kernel of their own: it takes a minute to compile one.
AXES = 3, 5


class Sizes(NamedTuple):
    """Tuples of the lengths that are numbers in the machine code (views.py); A axes."""

    axes: tuple[int, ...]
    state: tuple[int, ...]  # S = 3 A
    control: tuple[int, ...]  # C = A + 1
    step: tuple[int, ...]  # S + C
    width: tuple[int, ...]  # W lanes
    steps: int  # N
    rows: int  # R
    bends: int  # 1 where there are legs that are no lines, or are passed, else 0
    any_own: bool  # whether there are rows with derivatives of their own
    any_normal: bool  # whether there are rows of the normal acceleration
    any_laws: bool  # whether there are laws
    any_switch: bool  # whether there are rows of changes of feed


class Group(NamedTuple):
    """The steps of up to W windows, in the units of each; room, room_node, feed_node and normal_node are 1/limit^2."""

    real: FloatArray  # (N, W) 1 for a step that the window has, else 0
    last: FloatArray  # (N, W) 1 for its last one
    on: FloatArray  # (N, R, W) 1 for a row that there is
    base: FloatArray  # (N, A, W) of the step's leg, as the next four
    drift: FloatArray  # (N, A, W)
    start: FloatArray  # (N, A, W) the point where it begins
    per_drift: FloatArray  # (N, W) 1/|drift|^2
    length: FloatArray  # (N, W)
    line: FloatArray  # (N, W) 1 where it is a line that is not passed
    bent: FloatArray  # (N, W) 1 where it is an arc or a curve that is not passed
    passed: FloatArray  # (N, W) 1 where it is passed
    target: FloatArray  # (N or 0, 3, A, W) as of `StepLimits`
    way: FloatArray  # (N or 0, 3, A, W) the vectors of the leg's formula (bends.py)
    rate: FloatArray  # (N or 0, W) of an arc
    shape: FloatArray  # (N or 0, 6, W) of a curve both weights and the ordinates of u; 0 where it is none
    begins: FloatArray  # (N, W) 1 where the window's first step on a leg is
    ends: FloatArray  # (N, W) 1 for the last one
    at_vertex: FloatArray  # (N, W) 1 where the node is where the leg begins
    per_box: FloatArray  # (4, A, W) 1/limit of jerk, acceleration, velocity, velocity
    room: FloatArray  # (N, W)
    room_node: FloatArray  # (N, W)
    sag: FloatArray  # (2, W)
    rest: FloatArray  # (N, 2, A, W)
    feed: FloatArray  # (N, W) the square of the limit
    feed_node: FloatArray  # (N, W)
    normal: FloatArray  # (N, W) the limit
    normal_node: FloatArray  # (N, W)
    bound: FloatArray  # (N, W) 1 where there are rows of the normal acceleration between nodes
    turns: FloatArray  # (N, W) 1 where the step turns far
    pace: FloatArray  # (N, W)
    per_h: FloatArray  # (N, W) 1/h of the guess
    h: FloatArray  # (N, W)
    h_max: FloatArray  # (N, W)
    h_min: FloatArray  # (N, W)
    switch: FloatArray  # (N, W) over tolerance and pace
    switch_at: FloatArray  # (N, A, W) the vertex
    side: FloatArray  # (N, A, W) over tolerance
    smooth: FloatArray  # (N, W) twice the weight of jerk^2, in time
    centre: FloatArray  # (N, W) in time, 0 where the row is not
    per_step: FloatArray  # (N, W) 1/step_max
    aside: FloatArray  # (1, W)


class Motion(NamedTuple):
    """Of the windows in lanes, how they are searched and what is found in them so far."""

    x: FloatArray  # (N+1, S, W) the nodes
    u: FloatArray  # (N, C, W) the controls
    place: FloatArray  # (N, 6, W)
    tuning: FloatArray  # (7, W)


class Queue(NamedTuple):
    """The numbers of a group and its motion one after the other, in one array."""

    lanes: FloatArray  # (n, W) what `Group` and `Motion` are views of
    windows: FloatArray  # (Q, n) of each window


class Held(NamedTuple):
    """Of a window that is searched by itself, what windows in lanes have not: their kernel is compiled without it."""

    laws: LawRows
    at: Array  # (4 A + 1,) where the numbers of its step are among those of the kernel's


# What steps have that a window has not, where that is not 0: it must not be divided by.
_FILL = {
    **dict.fromkeys(
        ["per_drift", "length", "per_box", "room", "room_node", "feed", "feed_node", "normal", "normal_node"],
        1.0,
    ),
    **dict.fromkeys(["pace", "per_h", "h", "per_step"], 1.0),
    **{"h_max": 2.0, "h_min": 0.5},
}


def group_of(
    windows: Sequence[StepWindow], tuning: Sequence[Sequence[float]], width: int
) -> tuple[Sizes, Group, Motion, Queue, Held | None]:
    """Windows of one kind (window_solver.py), each with its tuning (7,), for a group of `width` lanes, the first ones in them."""
    of = windows[0].u.shape[1] - 1
    axes = next((many for many in AXES if many >= of), of)
    N = max(len(one.u) for one in windows)
    R = 8 * (axes - of) + max(one.limits.on.shape[1] for one in windows)
    bends = int(any(one.legs.radius.any() for one in windows))
    vectors = (N * bends, 3, axes)
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(Group._fields, (N,)),
        **dict.fromkeys(("base", "drift", "start", "switch_at", "side"), (N, axes)),
        **{"on": (N, R), "target": vectors, "way": vectors, "rate": (N * bends,), "shape": (N * bends, 6)},
        **{"per_box": (4, axes), "sag": (SETS,), "rest": (N, 2, axes), "aside": (1,)},
        **{"x": (N + 1, 3 * axes), "u": (N, axes + 1), "place": (N, 3 * SETS), "tuning": (len(tuning[0]),)},
    }
    fill = np.zeros(sum(map(math.prod, shapes.values())))
    group, motion = _views(fill[:, None], shapes)
    for name, value in _FILL.items():
        getattr(group, name)[:] = value
    motion.u[:, axes], motion.tuning[:] = 1.0, 1.0
    queue = Queue(np.repeat(fill[:, None], width, axis=1), np.repeat(fill[None], len(windows), axis=0))
    bound, normal, switch = False, False, False
    for one, tuned, numbers in zip(windows, tuning, queue.windows, strict=True):
        group, motion = _views(numbers[:, None], shapes)
        legs, limits = one.legs, one.limits
        of_legs = legs.length, legs.base, legs.drift, legs.e1, legs.radius
        of_steps = tuple(getattr(limits, name) for name in _OF_STEPS.split())
        put_window(group, 0, of_legs, _formulas_of(legs, bends), of_steps, limits.box, limits.sag)
        put_motion((motion.x, motion.u, motion.place), 0, (one.x, one.u, one.place))
        group.aside[0, 0], motion.tuning[:, 0] = limits.aside, tuned
        bound = bound or bool(group.bound.any())
        normal = normal or bool(group.on[:, 8 * axes + NORMAL_NODE].any())
        switch = switch or bool(group.on[:, 8 * axes + SWITCH].any())
    queue.lanes[:, : len(windows)] = queue.windows[:width].T
    group, motion = _views(queue.lanes, shapes)
    laws = windows[0].limits.laws
    held = Held(laws, place_of(of, axes)) if width == 1 else None
    which = (bends, bound or len(laws.kind) > 0, bound or normal, len(laws.kind) > 0, switch)
    sizes = Sizes(size(axes), size(3 * axes), size(axes + 1), size(4 * axes + 1), size(width), N, R, *which)
    return sizes, group, motion, queue, held


def _views(numbers: FloatArray, shapes: dict[str, tuple[int, ...]]) -> tuple[Group, Motion]:
    """What numbers (n, W) are, as arrays of the `shapes` (.., W)."""
    sizes = [math.prod(shape) for shape in shapes.values()]
    parts, width = np.split(numbers, np.cumsum(sizes)[:-1]), numbers.shape[1]
    found = [part.reshape(*shape, width) for part, shape in zip(parts, shapes.values(), strict=True)]
    return Group(*found[: len(Group._fields)]), Motion(*found[len(Group._fields) :])


_OF_STEPS = (
    "leg passed at_vertex on turns target rest switch_at side room room_node "
    "feed feed_node normal normal_node step_max pace h h_max h_min switch smooth centre"
)


@njit(cache=True, error_model="numpy")
def put_window(group, lane, legs, formulas, steps, box, sag):
    """The numbers of a window into its lane of a group.

    legs     : length (R,), base (R, A), drift (R, A), e1 (R, A), radius (R,)
    formulas : way (R, 3, A), rate (R,), shape (R, 6); without rows where no window has bends
    steps    : `_OF_STEPS` of its limits
    box      : (4, A) of its limits
    sag      : (2,) of its limits
    """
    leg, passed, at_vertex, on, turns, target, rest, switch_at, side, room, room_node = steps[:11]
    feed, feed_node, normal, normal_node, step_max, pace, h, h_max, h_min, switch, smooth, centre = steps[11:]
    length, base, drift, e1, radius = legs
    way, rate, shape = formulas
    N, of, axes = len(leg), base.shape[1], group.base.shape[1]
    first, kernel_first = 8 * of, 8 * axes
    for k in range(of):
        for m in range(4):
            group.per_box[m, k, lane] = 1.0 / box[m, k]
    for m in range(len(sag)):
        group.sag[m, lane] = sag[m]
    for i in range(N):
        r, square = leg[i], 0.0
        begins, ends = i == 0 or leg[i - 1] != r, i == N - 1 or leg[i + 1] != r
        group.real[i, lane], group.last[i, lane] = 1.0, i == N - 1
        for row in range(on.shape[1]):
            at = row // of * axes + row % of if row < first else row - first + kernel_first
            group.on[i, at, lane] = on[i, row]
        for k in range(of):
            square += drift[r, k] * drift[r, k]
            group.base[i, k, lane], group.drift[i, k, lane] = base[r, k], drift[r, k]
            group.start[i, k, lane] = base[r, k] + radius[r] * e1[r, k]
            group.rest[i, 0, k, lane], group.rest[i, 1, k, lane] = rest[i, 0, k], rest[i, 1, k]
            group.switch_at[i, k, lane], group.side[i, k, lane] = switch_at[i, k], side[i, k] / room_node[i]
        group.per_drift[i, lane] = 1.0 / (square if square > 0.0 else 1.0)
        group.length[i, lane] = length[r]
        group.line[i, lane] = radius[r] == 0.0 and not passed[i]
        group.bent[i, lane], group.passed[i, lane] = radius[r] > 0.0 and not passed[i], passed[i]
        if len(way):
            group.rate[i, lane] = rate[r]
            for m in range(6):
                group.shape[i, m, lane] = shape[r, m]
            for m in range(3):
                for k in range(of):
                    group.target[i, m, k, lane], group.way[i, m, k, lane] = target[i, m, k], way[r, m, k]
        group.begins[i, lane], group.ends[i, lane], group.at_vertex[i, lane] = begins, ends, at_vertex[i]
        group.room[i, lane], group.room_node[i, lane] = (
            1.0 / (room[i] * room[i]),
            1.0 / (room_node[i] * room_node[i]),
        )
        group.feed[i, lane], group.feed_node[i, lane] = feed[i] * feed[i], 1.0 / (feed_node[i] * feed_node[i])
        group.normal[i, lane], group.normal_node[i, lane] = normal[i], 1.0 / (normal_node[i] * normal_node[i])
        group.bound[i, lane], group.turns[i, lane] = on[i, first + NORMAL_ROWS], turns[i]
        group.pace[i, lane], group.h[i, lane], group.per_h[i, lane] = pace[i], h[i], 1.0 / h[i]
        group.h_max[i, lane], group.h_min[i, lane] = h_max[i], h_min[i]
        group.switch[i, lane] = switch[i] / (room_node[i] * pace[i])
        group.smooth[i, lane] = 2.0 * smooth[i] * h[i]
        group.centre[i, lane] = centre[i] * h[i] * on[i, first + TUBE_NODE]
        group.per_step[i, lane] = 1.0 / step_max[i]


@njit(cache=True, error_model="numpy")
def put_motion(motion, lane, window):
    """The x (N+1, S), u (N, C) and place (N, 6) of a window into its lane; behind its end it stands where that is."""
    (x, u, place), (own_x, own_u, own_place) = motion, window
    N, of, axes = len(own_u), own_u.shape[1] - 1, u.shape[1] - 1
    for i in range(len(x)):
        for k in range(of):
            for m in range(3 if i <= N else 1):
                x[i, m * axes + k, lane] = own_x[min(i, N), m * of + k]
    for i in range(N):
        u[i, axes, lane] = own_u[i, of]
        for k in range(of):
            u[i, k, lane] = own_u[i, k]
        for k in range(place.shape[1]):
            place[i, k, lane] = own_place[i, k]


def _formulas_of(legs: LegFormulas, bends: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`way`, `rate` and `shape` of legs (R, ..); without rows where there are no `bends`."""
    if not bends:
        return np.zeros((0, 3, legs.base.shape[1])), np.zeros(0), np.zeros((0, 6))
    arms = legs.radius[:, None] * legs.e1, legs.radius[:, None] * legs.e2
    way, rate, shape = np.stack([legs.drift, *arms], axis=1), legs.rate.copy(), np.zeros((len(legs.rate), 6))
    curved = np.flatnonzero(legs.curve >= 0)
    points, weight = legs.points[legs.curve[curved]], legs.weight[legs.curve[curved]]
    way[curved], rate[curved] = points[:, 1:] - points[:, :1], 0.0
    shape[curved] = np.column_stack([weight, ordinates(points, weight, legs.length[curved])])
    return way, rate, shape


def place_of(of: int, axes: int) -> Array:
    """(4 A + 1,) where the numbers of a step over A = `of` axes are in one over `axes`."""
    return np.array([block * axes + k for block in range(4) for k in range(of)] + [4 * axes])


def rows_of(of: int, axes: int, rows: int) -> Array:
    """(R,) where the `rows` rows of a step over `of` axes are in one over `axes`."""
    row = np.arange(rows)
    return np.where(row < 8 * of, row // of * axes + row % of, row + 8 * (axes - of))
