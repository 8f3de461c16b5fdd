"""Pieces of the search kernel by themselves, on single numbers instead of lanes: a group of one window."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planner.base.kernels import CONTRACT, njit
from planner.base.views import size, vector, wide1, wide2, wide3
from planner.joint.curvature import put_model
from planner.joint.forces import put_slopes
from planner.joint.group import Group, Held, Sizes, group_of, rows_of
from planner.joint.interior_point import put_present
from planner.joint.memory import Work, lanes_of, room_of, rows_in, scratch_of, work_of
from planner.joint.normal_rows import add_normal_curvature, put_normal_rows
from planner.joint.recursion import Factor, backward, factor_steps, forward, gaps
from planner.joint.rows import put_rows

_THREE, _PLACES = size(3), size(6)


class Alone(NamedTuple):
    """A window as a group of one, and the kernel's memory for it."""

    sizes: Sizes
    group: Group
    held: Held | None
    x: Any
    u: Any
    place: Any
    work: Work

    @classmethod
    def of(cls, window: Any) -> Alone:
        sizes, group, motion, _, held = group_of([window], [[1.0] * 7], 1)
        return cls(sizes, group, held, motion.x, motion.u, motion.place, work_of(sizes, group))


LOOK, SLOPES, MODELS, NEWTON, GAPS = range(5)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _piece(what, sizes, numbers, held, x, u, place, work, change, out, settings, end):
    """One of these, into `work` or `out`."""
    group, w, N = lanes_of(sizes, numbers), sizes.width, sizes.steps
    at, control = wide2(x, w, sizes.state), wide2(u, w, sizes.control)
    rows, room = rows_in(sizes, work, wide2(place, w, _PLACES)), room_of(sizes, work, at)
    gap, scratch = wide2(work.gap, w, sizes.state), scratch_of(sizes, held)
    if what == LOOK:
        looking = room.y, wide2(work.nearest, w, _THREE), wide1(work.top, w)
        put_present(sizes, group, rows, 1.0)
        put_rows(sizes, group, held, at, control, rows, 0.0, 0.0, settings[2], looking, scratch)
    elif what == GAPS:
        gaps(sizes, group, at, control, gap)
    elif what == NEWTON:
        factor = Factor(
            wide3(work.K, w, sizes.control, sizes.state),
            wide3(work.L, w, sizes.control, sizes.control),
            wide2(work.push, w, sizes.state),
            wide2(work.dx, w, sizes.state),
            wide2(work.du, w, sizes.control),
        )
        step, (pull, rho, aim) = vector(at, sizes.state), settings
        last = wide1(end, w)
        bad = factor_steps(
            sizes, group, held, at, control, gap, rows, pull, 0.0, rho, last, factor, room, scratch
        )
        backward(sizes, group, at, control, rows, pull, aim, 0.0, last, factor, room)
        forward(sizes, group, at, control, gap, rows, False, aim, 0.0, factor, room, step)
        for s in range(len(sizes.state)):
            factor.dx[N, s] = step[s]
        return bad
    else:
        by, slope = wide2(change, w, sizes.step), wide2(out, w, sizes.rows)
        W = wide3(out, w, sizes.step, sizes.step)
        for i in range(N):
            if what == SLOPES:
                put_slopes(sizes, group, rows, i, at[i], control[i], by[i], slope[i])
            else:
                put_model(sizes, group, rows, i, at[i], control[i], room.W, room.row)
                for s in range(len(sizes.step)):
                    for t in range(s + 1):
                        W[i, s, t] = room.W[s, t]
    return 0.0


_NOTHING, _NO_END = np.zeros((0, 0, 1)), np.zeros((0, 1))


def look(alone: Alone, least: float = 0.0) -> None:
    """Put the rows into its `work`, with slacks of 1 and multipliers of `least`."""
    _piece(LOOK, *alone, _NOTHING, _NOTHING.ravel(), (0.0, 0.0, least), _NO_END)


def slopes(alone: Alone, change: Any) -> Any:
    """(N, R, 1) what the rows change by where steps change by `change` (N, 4 A + 1, 1)."""
    out = np.zeros_like(alone.work.g)
    _piece(SLOPES, *alone, change, out.ravel(), (0.0, 0.0, 0.0), _NO_END)
    return out


def models(alone: Alone) -> Any:
    """(N, 4 A + 1, 4 A + 1) the models of the rows, lower triangles."""
    size = len(alone.sizes.step)
    out = np.zeros((alone.sizes.steps, size, size))
    _piece(MODELS, *alone, _NOTHING, out.ravel(), (0.0, 0.0, 0.0), _NO_END)
    return out


def newton(alone: Alone, pull: float, rho: float, aim: float, end: Any) -> float:
    """A Newton step towards s z = aim into its `work`, with the gaps that are there; end (S, 1) the multipliers of the last
    node. Returns whether it broke down."""
    return _piece(NEWTON, *alone, _NOTHING, _NOTHING.ravel(), (pull, rho, aim), end)


def gaps_of(alone: Alone, u: Any) -> Any:
    """(N, 3 A) the gaps of the kinematics with other controls, which are then in its `work`."""
    _piece(GAPS, *alone._replace(u=u), _NOTHING, _NOTHING.ravel(), (0.0, 0.0, 0.0), _NO_END)
    return alone.work.gap[..., 0].copy()


def sizes_of(axes: int) -> Sizes:
    """Of one step without rows."""
    return Sizes(
        size(axes), size(3 * axes), size(axes + 1), size(4 * axes + 1), size(1), 1, 0, 0, *[False] * 4
    )


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
    look(alone)
    return rows_out(window, alone.work.g)


def rows_out(window: Any, numbers: Any) -> Any:
    """(N, R) of the rows of a window, of numbers (N, .., 1) of the rows of the kernel."""
    of, axes = (
        window.u.shape[1] - 1,
        (numbers.shape[1] - window.limits.on.shape[1]) // 8 + window.u.shape[1] - 1,
    )
    return numbers[:, rows_of(of, axes, window.limits.on.shape[1]), 0]
