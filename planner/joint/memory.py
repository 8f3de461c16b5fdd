"""The memory that a group of windows (group.py) is searched in, as kernels see it: lanes (base/lanes.py)."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.base.views import matrix, size, vector, wide1, wide2, wide3
from planner.joint.group import Group, Sizes
from planner.joint.recursion import Room
from planner.joint.row_kinds import NORMAL_ROWS, SETS, VECTORS, Rows, Scratch

_ALL, TWO, THREE, PLACES = size(VECTORS), size(2), size(3), size(3 * SETS)


class Work(NamedTuple):
    """Memory of a group: of its rows, of the recursion (recursion.py) and for places."""

    g: FloatArray
    s: FloatArray
    z: FloatArray
    per_s: FloatArray
    q: FloatArray
    ds: FloatArray
    dz: FloatArray
    moves: FloatArray
    per_radius: FloatArray
    n: FloatArray
    by_node: FloatArray
    tangent: FloatArray
    own: FloatArray
    between: FloatArray
    K: FloatArray
    L: FloatArray
    push: FloatArray
    dx: FloatArray
    du: FloatArray
    gap: FloatArray
    slope: FloatArray
    nearest: FloatArray
    top: FloatArray


def work_of(sizes: Sizes, group: Group) -> Work:
    """Memory of a group, all 0; of lines the tangents stay."""
    N, R, W = sizes.steps, sizes.rows, len(sizes.width)
    A, S, C = len(sizes.axes), len(sizes.state), len(sizes.control)
    bent, own = N * sizes.bends, N if sizes.any_own else 0
    P = 3 * SETS
    shapes = [(N, R)] * 7 + [(N, P), (N, 3), (N, P, A), (bent, P), (0,)]
    shapes += [(own, R - 8 * A - NORMAL_ROWS, S + C), (2,), (N, C, S), (N, C, C), (N, S), (N + 1, S), (N, C)]
    shapes += [(N, S), (R,), (N, 3), (N,)]
    work = Work(*(np.zeros((*shape, W)) for shape in shapes))
    return work._replace(tangent=np.repeat(group.drift, P, axis=0) if bent else group.drift)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def lanes_of(sizes, group):
    """The numbers of a group as lanes."""
    width = sizes.width
    return Group(
        wide1(group.real, width),
        wide1(group.last, width),
        wide2(group.on, width, sizes.rows),
        wide2(group.base, width, sizes.axes),
        wide2(group.drift, width, sizes.axes),
        wide2(group.start, width, sizes.axes),
        wide1(group.per_drift, width),
        wide1(group.length, width),
        wide1(group.line, width),
        wide1(group.bent, width),
        wide1(group.passed, width),
        wide3(group.target, width, THREE, sizes.axes),
        wide3(group.way, width, THREE, sizes.axes),
        wide1(group.rate, width),
        wide2(group.shape, width, PLACES),
        wide1(group.begins, width),
        wide1(group.ends, width),
        wide1(group.at_vertex, width),
        wide2(group.per_box, width, sizes.axes),
        wide1(group.room, width),
        wide1(group.room_node, width),
        wide1(group.sag, width),
        wide3(group.rest, width, TWO, sizes.axes),
        wide1(group.feed, width),
        wide1(group.feed_node, width),
        wide1(group.normal, width),
        wide1(group.normal_node, width),
        wide1(group.bound, width),
        wide1(group.turns, width),
        wide1(group.pace, width),
        wide1(group.per_h, width),
        wide1(group.h, width),
        wide1(group.h_max, width),
        wide1(group.h_min, width),
        wide1(group.switch, width),
        wide2(group.switch_at, width, sizes.axes),
        wide2(group.side, width, sizes.axes),
        wide1(group.smooth, width),
        wide1(group.centre, width),
        wide1(group.per_step, width),
        wide1(group.aside, width),
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def rows_in(sizes, work, place):
    """The rows in their memory."""
    w, axes, own = sizes.width, sizes.axes, sizes.rows - 8 * len(sizes.axes) - NORMAL_ROWS
    return Rows(
        wide2(work.g, w, sizes.rows),
        wide2(work.s, w, sizes.rows),
        wide2(work.z, w, sizes.rows),
        wide2(work.per_s, w, sizes.rows),
        wide2(work.q, w, sizes.rows),
        wide2(work.ds, w, sizes.rows),
        wide2(work.dz, w, sizes.rows),
        place,
        wide2(work.moves, w, PLACES),
        wide2(work.per_radius, w, THREE),
        wide3(work.n, w, PLACES, axes),
        wide2(work.by_node, w, PLACES),
        wide2(work.tangent, w, axes),
        wide3(work.own, w, own, sizes.step),
        wide1(work.between, w),
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def room_of(sizes, work, x):
    """Memory for one step, of what x is of, on the stack of who calls."""
    return Room(
        matrix(x, _ALL, sizes.axes),
        vector(x, sizes.step),
        matrix(x, sizes.step, sizes.step),
        matrix(x, sizes.state, sizes.state),
        matrix(x, sizes.state, sizes.state),
        matrix(x, sizes.state, sizes.control),
        matrix(x, sizes.control, sizes.state),
        vector(x, sizes.state),
        vector(x, sizes.state),
        vector(x, sizes.state),
        vector(x, sizes.control),
        wide1(work.slope, sizes.width),
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def scratch_of(sizes, held):
    """Memory for what is worked out on single numbers; None where there is nothing."""
    if held is None:
        return None
    L, of = sizes.rows - 8 * len(sizes.axes) - NORMAL_ROWS, len(held.at) // 4
    return Scratch(
        np.zeros(3 * of),
        np.zeros(of + 1),
        np.zeros(L),
        np.zeros((L, 4 * of + 1)),
        np.zeros((4 * of + 1, 4 * of + 1)),
    )
