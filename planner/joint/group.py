"""Windows that are searched side by side (interior_point.py), one in each lane: their steps one after the other,
numbers of all windows behind each other in the last dimension, filled up to the longest one with steps that have
no rows.
"""

from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
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


class Held(NamedTuple):
    """Of a window that is searched by itself, what windows in lanes have not: their kernel is compiled without it."""

    laws: LawRows
    at: Array  # (4 A + 1,) where the numbers of its step are among those of the kernel's


def group_of(
    windows: list[StepWindow], width: int
) -> tuple[Sizes, Group, Held | None, FloatArray, FloatArray, FloatArray]:
    """Up to `width` windows of one kind (window_solver.py), and x (N+1, S, W), u (N, C, W), place (N, 6, W) of them."""
    of = windows[0].u.shape[1] - 1
    axes = next((many for many in AXES if many >= of), of)
    counts = [len(one.u) for one in windows]
    N = max(counts)
    R = 8 * (axes - of) + max(one.limits.on.shape[1] for one in windows)

    def stack(each: list[Any], fill: float = 0.0, rows: int = N) -> FloatArray:
        """Numbers of all steps, those of lanes behind each other."""
        out: FloatArray = np.full((rows, *np.shape(each[0])[1:], width), fill)
        for lane, one in enumerate(each):
            out[: len(one), ..., lane] = one
        return out

    def points(each: list[FloatArray], fill: float = 0.0, rows: int = N) -> FloatArray:
        """`stack` (.., A), with the axes that the kernel has beside."""
        return np.insert(stack(each, fill, rows), [of] * (axes - of), fill, axis=1)

    def vectors(each: list[FloatArray]) -> FloatArray:
        """`stack` (.., 3, A), of windows with bends."""
        rows = stack(each) if bends else np.zeros((0, 3, of, width))
        return np.insert(rows, [of] * (axes - of), 0.0, axis=2)

    def limit(name: str, fill: float = 0.0) -> FloatArray:
        return stack([getattr(one.limits, name) for one in windows], fill)

    legs, leg = _legs_of(windows)
    way, rate, shape = _formulas_of(legs)
    square = (legs.drift**2).sum(axis=1)
    start = legs.base + legs.radius[:, None] * legs.e1
    passed = [one.limits.passed for one in windows]
    bent = [(legs.radius[at] > 0.0) & ~now for at, now in zip(leg, passed, strict=True)]
    bends = int(any(p.any() or b.any() for p, b in zip(passed, bent, strict=True)))
    steps = place_of(of, axes)
    on, own = np.zeros((N, R, width)), np.zeros((N, width))
    for lane, one in enumerate(windows):
        there = one.limits.on
        on[: len(there), rows_of(of, axes, there.shape[1]), lane] = there
        own[: len(there), lane] = there[:, 8 * of + NORMAL_ROWS]
    group = Group(
        real=stack([np.ones(count) for count in counts]),
        last=stack([np.arange(count) == count - 1 for count in counts]),
        on=on,
        base=points([legs.base[at] for at in leg]),
        drift=points([legs.drift[at] for at in leg]),
        start=points([start[at] for at in leg]),
        per_drift=stack([1.0 / np.where(square > 0.0, square, 1.0)[at] for at in leg], 1.0),
        length=stack([legs.length[at] for at in leg], 1.0),
        line=stack([(legs.radius[at] == 0.0) & ~now for at, now in zip(leg, passed, strict=True)]),
        bent=stack(bent),
        passed=stack(passed),
        target=vectors([one.limits.target for one in windows]),
        way=vectors([way[at] for at in leg]),
        rate=stack([rate[at] for at in leg]) if bends else np.zeros((0, width)),
        shape=stack([shape[at] for at in leg]) if bends else np.zeros((0, 6, width)),
        begins=stack([np.diff(at, prepend=-1) != 0 for at in leg]),
        ends=stack([np.diff(at, append=-1) != 0 for at in leg]),
        at_vertex=limit("at_vertex"),
        per_box=points([1.0 / one.limits.box for one in windows], 1.0, 4),
        room=1.0 / limit("room", 1.0) ** 2,
        room_node=1.0 / limit("room_node", 1.0) ** 2,
        sag=stack([one.limits.sag for one in windows], 0.0, SETS),
        rest=np.insert(limit("rest"), [of] * (axes - of), 0.0, axis=2),
        feed=limit("feed", 1.0) ** 2,
        feed_node=1.0 / limit("feed_node", 1.0) ** 2,
        normal=limit("normal", 1.0),
        normal_node=1.0 / limit("normal_node", 1.0) ** 2,
        bound=own,
        turns=limit("turns"),
        pace=limit("pace", 1.0),
        per_h=1.0 / limit("h", 1.0),
        h=limit("h", 1.0),
        h_max=limit("h_max", 2.0),
        h_min=limit("h_min", 0.5),
        switch=stack([one.limits.switch / (one.limits.room_node * one.limits.pace) for one in windows]),
        switch_at=points([one.limits.switch_at for one in windows]),
        side=points([one.limits.side / one.limits.room_node[:, None] for one in windows]),
        smooth=2.0 * limit("smooth") * limit("h"),
        centre=limit("centre") * limit("h") * on[:, 8 * axes + TUBE_NODE],
        per_step=1.0 / limit("step_max", 1.0),
        aside=stack([np.array([one.limits.aside]) for one in windows], 0.0, 1),
    )
    first, normal = windows[0].limits, bool(own.any())
    held = Held(first.laws, steps) if width == 1 else None
    laws = len(first.laws.kind) > 0
    which = (
        bends,
        normal or laws,
        normal or bool(on[:, 8 * axes + NORMAL_NODE].any()),
        laws,
        bool(on[:, 8 * axes + SWITCH].any()),
    )
    x, u = np.zeros((N + 1, 3 * axes, width)), np.zeros((N, axes + 1, width))
    u[:, axes] = 1.0
    for lane, (one, count) in enumerate(zip(windows, counts, strict=True)):
        x[: count + 1, steps[: 3 * of], lane] = one.x
        x[count + 1 :, :axes, lane] = x[count, :axes, lane]
        u[:count, steps[3 * of :] - 3 * axes, lane] = one.u
    sizes = Sizes(size(axes), size(3 * axes), size(axes + 1), size(4 * axes + 1), size(width), N, R, *which)
    return sizes, group, held, x, u, stack([one.place for one in windows])


def _legs_of(windows: list[StepWindow]) -> tuple[LegFormulas, list[Array]]:
    """The legs of all windows, and those of the steps of each window among them."""
    first = np.cumsum([0, *(len(one.legs.length) for one in windows)])
    curves = np.cumsum([0, *(len(one.legs.weight) for one in windows)])
    legs = LegFormulas(
        *(np.concatenate([getattr(one.legs, name) for one in windows]) for name in LegFormulas._fields)
    )
    offset = np.repeat(curves[:-1], np.diff(first))
    legs = legs._replace(curve=np.where(legs.curve >= 0, legs.curve + offset, -1))
    return legs, [one.limits.leg + begin for one, begin in zip(windows, first[:-1], strict=True)]


def _formulas_of(legs: LegFormulas) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`way`, `rate` and `shape` of legs (R, ..)."""
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
