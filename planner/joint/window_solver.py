"""Windows of steps (problem.py), solved together where they are alike."""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.lanes import WIDTH as LANES
from planner.joint.group import group_of, place_of, rows_of
from planner.joint.interior_point import Found, Tuning, solve_group
from planner.joint.memory import work_of
from planner.joint.problem import StepWindow

# Windows that are solved together. Four alike take 0.3 to 0.8 of the time in full `LANES`, but one alone there 1.3 to 3 times
# that on single numbers (`python -m benchmarks.solvers.search_kernel`), and windows of a group wait for its longest.
WIDTH = 1


class Asked(NamedTuple):
    """A window to be solved."""

    window: StepWindow
    tuning: Tuning


class Solved(NamedTuple):
    """How that ended; the x, u and place of the window are what was found."""

    done: bool
    iterations: int
    z: FloatArray  # (N, R) multipliers of its rows, in units of time


def kind_of(asked: Asked) -> Hashable:
    """Windows of one kind may be solved together."""
    return asked.window.u.shape[1]


def alike(asked: Asked) -> Hashable:
    """The kind of a window, and what its iterations and their cost depend on most."""
    window = asked.window
    bent = bool(window.limits.passed.any() or window.legs.radius.any())
    return kind_of(asked), asked.tuning.gap, bent, len(window.which)


def solve_windows(asked: Sequence[Asked], width: int | None = None) -> list[Solved]:
    """Solve `width` windows of one kind at most side by side, None for one on single numbers and more in `LANES`; what is found
    in one of them does not depend on the others."""
    if width is None:
        width = 1 if len(asked) == 1 else LANES
    sizes, group, bends, *motion = group_of([one.window for one in asked], width)
    tuning = np.ones((len(Tuning._fields), width))
    tuning[:, : len(asked)] = np.array([one.tuning for one in asked]).T
    x, u, place = motion
    found = Found(
        np.zeros_like(x),
        np.zeros_like(u),
        np.zeros_like(place),
        np.zeros(group.on.shape),
        np.zeros(width, np.bool_),
        np.zeros(width, np.int64),
    )
    solve_group(sizes, group, bends, tuple(motion), tuning, work_of(sizes, bends), found)
    return [_solved(one.window, lane, found) for lane, one in enumerate(asked)]


def _solved(window: StepWindow, lane: int, found: Found) -> Solved:
    """What was found in a lane; x, u and place go into the window."""
    N, R = window.limits.on.shape
    of, axes = window.u.shape[1] - 1, found.u.shape[1] - 1
    at = place_of(of, axes)
    window.x[:] = found.x[: N + 1, at[: 3 * of], lane]
    window.u[:] = found.u[:N, at[3 * of :] - 3 * axes, lane]
    window.place[:] = found.place[:N, :, lane]
    z = found.z[:N, rows_of(of, axes, R), lane]
    return Solved(bool(found.done[lane]), int(found.iterations[lane]), z)
