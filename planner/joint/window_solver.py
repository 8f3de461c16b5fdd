"""Windows of steps (problem.py), solved by themselves or side by side."""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.group import AXES, group_of, place_of, rows_of
from planner.joint.interior_point import Found, Tuning, solve_group
from planner.joint.memory import work_of
from planner.joint.problem import StepWindow


class Asked(NamedTuple):
    """A window to be solved."""

    window: StepWindow
    tuning: Tuning


class Solved(NamedTuple):
    """How that ended; the x, u and place of the window are what was found."""

    done: bool
    iterations: int
    z: FloatArray  # (N, R) multipliers of its rows, in units of time


def kind_of(asked: Asked) -> Hashable | None:
    """What windows have in common that are solved side by side: their axes, whether there are arcs or curves, and the
    iterations they take about. None for one with rows of laws, which would be worked out lane by lane: the kernel with lanes
    has none of them. For more axes there is none."""
    window = asked.window
    axes, bends = window.u.shape[1] - 1, bool(window.legs.radius.any())
    return None if len(window.which) or axes > AXES[0] else (axes, bends, asked.tuning.gap)


def solve_windows(asked: Sequence[Asked], width: int) -> list[Solved]:
    """Solve windows of one kind, `width` at a time: in lanes, or one on single numbers, which rounds in another order. What is
    found in one of them does not depend on the others."""
    sizes, group, motion, queue, held = group_of(
        [one.window for one in asked], [one.tuning for one in asked], width
    )
    count, of_each = len(asked), (motion.x, motion.u, motion.place, group.on)
    x, u, place, z = (np.zeros((count, *one.shape[:-1])) for one in of_each)
    found = Found(x, u, place, z, np.zeros(count, np.bool_), np.zeros(count, np.int64))
    solve_group(sizes, group, motion, queue, held, work_of(sizes, group), found)
    return [_solved(one.window, k, found) for k, one in enumerate(asked)]


def _solved(window: StepWindow, k: int, found: Found) -> Solved:
    """What was found in window k of a group; x, u and place go into the window."""
    N, R = window.limits.on.shape
    of, axes = window.u.shape[1] - 1, found.u.shape[2] - 1
    at = place_of(of, axes)
    window.x[:] = found.x[k, : N + 1, at[: 3 * of]].T
    window.u[:] = found.u[k, :N, at[3 * of :] - 3 * axes].T
    window.place[:] = found.place[k, :N]
    z = np.ascontiguousarray(found.z[k, :N, rows_of(of, axes, R)].T)
    return Solved(bool(found.done[k]), int(found.iterations[k]), z)
