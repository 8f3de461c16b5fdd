"""Pieces of the search kernel by themselves, on single numbers instead of lanes: a group of one window."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import matrix, size, vector, wide1, wide2, wide3
from planner.joint.curvature import put_model, put_slopes
from planner.joint.group import Bends, Group, Sizes, group_of, rows_of
from planner.joint.interior_point import Work, lanes_of, room_of, rows_in, scratch_of, work_of
from planner.joint.normal_rows import add_normal_curvature, put_normal_rows
from planner.joint.recursion import Factor, backward, factor_steps, forward, gaps
from planner.joint.rows import VECTORS, put_rows, put_shares, put_vectors

_VECTORS, _THREE = size(VECTORS), size(3)


class Alone(NamedTuple):
    """A window as a group of one, and the kernel's memory for it."""

    sizes: Sizes
    group: Group
    bends: Bends
    x: Any
    u: Any
    place: Any
    work: Work

    @classmethod
    def of(cls, window: Any) -> Alone:
        sizes, group, bends, x, u, place = group_of([window], 1)
        return cls(sizes, group, bends, x, u, place, work_of(sizes, bends))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def look(sizes, numbers, bends, x, u, place, work):
    """Put the rows into `work`."""
    group, w = lanes_of(sizes, numbers), sizes.width
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    y, e = matrix(at, _VECTORS, sizes.axes), matrix(at, _VECTORS, sizes.axes)
    room = y, e, wide2(work.nearest, w, _THREE), wide1(work.top, w)
    rows = rows_in(sizes, work, wide2(place, w, _THREE))
    put_rows(sizes, group, bends, at, control, rows, room, scratch_of(sizes, bends))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def slopes(sizes, numbers, bends, x, u, place, work, change, out):
    """out (N, R, 1) = what the rows change by where steps change by `change` (N, 4 A + 1, 1)."""
    group, w = lanes_of(sizes, numbers), sizes.width
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    rows, room = rows_in(sizes, work, wide2(place, w, _THREE)), room_of(sizes, work, at)
    by, slope = wide2(change, w, sizes.step), wide2(out, w, sizes.rows)
    for i in range(sizes.steps):
        turn = put_vectors(sizes, at[i], control[i], room.y, room.e)
        put_shares(control[i, len(sizes.axes)], turn, room.alpha)
        put_slopes(sizes, group, rows, i, (room.y, room.alpha, room.e), by[i], room.F, slope[i])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def models(sizes, numbers, bends, x, u, place, work, out):
    """out (N, 4 A + 1, 4 A + 1, 1) = the models of the rows, lower triangles."""
    group, w = lanes_of(sizes, numbers), sizes.width
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    rows, room = rows_in(sizes, work, wide2(place, w, _THREE)), room_of(sizes, work, at)
    W = wide3(out, w, sizes.step, sizes.step)
    for i in range(sizes.steps):
        turn = put_vectors(sizes, at[i], control[i], room.y, room.e)
        put_shares(control[i, len(sizes.axes)], turn, room.alpha)
        put_model(sizes, group, rows, i, (room.y, room.alpha, room.e), (room.G, room.row), room.W)
        for s in range(len(sizes.step)):
            for t in range(s + 1):
                W[i, s, t] = room.W[s, t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def newton(sizes, numbers, bends, x, u, place, work, pull, rho, aim, end):
    """A Newton step towards s z = aim into `work`, with the gaps that are there; end (S, 1) the multipliers of the last node.
    Returns whether it broke down."""
    group, w = lanes_of(sizes, numbers), sizes.width
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    rows, room = rows_in(sizes, work, wide2(place, w, _THREE)), room_of(sizes, work, at)
    factor = Factor(
        wide3(work.K, w, sizes.control, sizes.state),
        wide3(work.L, w, sizes.control, sizes.control),
        wide2(work.push, w, sizes.state),
        wide2(work.dx, w, sizes.state),
        wide2(work.du, w, sizes.control),
    )
    gap, change = wide2(work.gap, w, sizes.state), vector(at, sizes.state)
    scratch = scratch_of(sizes, bends)
    bad = factor_steps(sizes, group, bends, at, control, gap, rows, pull, rho, factor, room, scratch)
    backward(sizes, group, at, control, rows, pull, aim, 0.0, wide1(end, w), factor, room)
    forward(sizes, group, at, control, gap, rows, aim, 0.0, factor, room, change)
    for s in range(len(sizes.state)):
        factor.dx[sizes.steps, s] = change[s]
    return bad


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_gaps(sizes, numbers, x, u, out):
    """out (N, 3 A, 1) = the gaps of the kinematics."""
    w = sizes.width
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    return gaps(sizes, lanes_of(sizes, numbers), at, control, wide2(out, w, sizes.state))


def sizes_of(axes: int) -> Sizes:
    """Of one step without rows."""
    return Sizes(size(axes), size(3 * axes), size(axes + 1), size(4 * axes + 1), size(1), 1, 0, *[False] * 5)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _normal_rows(sizes, bound, pace, turns, x, u, g, out):
    w = sizes.width
    put_normal_rows(
        sizes, bound, pace, turns, wide1(x, w), wide1(u, w), wide1(g, w), wide2(out, w, sizes.step)
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _normal_curvature(sizes, bound, pace, turns, x, u, z, out):
    w = sizes.width
    W = wide2(out, w, sizes.step)
    add_normal_curvature(sizes, W, bound, pace, turns, wide1(x, w), wide1(u, w), z[0], z[1])


def normal_rows(bound: float, pace: float, turns: bool, x: Any, u: Any) -> Any:
    """(2,) the rows of the normal acceleration of a step x (3 A,), u (A+1,), and (2, 4 A + 1) their derivatives."""
    g, out = np.zeros((2, 1)), np.zeros((2, 4 * len(u) - 3, 1))
    _normal_rows(
        sizes_of(len(u) - 1), bound, pace, float(turns), x[:, None].copy(), u[:, None].copy(), g, out
    )
    return g[:, 0], out[..., 0]


def normal_curvature(bound: float, pace: float, turns: bool, x: Any, u: Any, z: Any) -> Any:
    """(4 A + 1, 4 A + 1) their model, the lower triangle."""
    W = np.zeros((4 * len(u) - 3, 4 * len(u) - 3, 1))
    _normal_curvature(
        sizes_of(len(u) - 1), bound, pace, float(turns), x[:, None].copy(), u[:, None].copy(), z, W
    )
    return W[..., 0]


def rows_at(window: Any, x: Any, u: Any) -> Any:
    """(N, R) the rows of a window of two or three axes at another motion."""
    alone = Alone.of(window._replace(x=x, u=u))
    look(*alone)
    return rows_out(window, alone.work.g)


def rows_out(window: Any, numbers: Any) -> Any:
    """(N, R) of a window's rows, of numbers (N, R', 1) of the kernel's."""
    of, axes = (
        window.u.shape[1] - 1,
        (numbers.shape[1] - window.limits.on.shape[1]) // 8 + window.u.shape[1] - 1,
    )
    return numbers[:, rows_of(of, axes)(window.limits.on.shape[1]), 0]
