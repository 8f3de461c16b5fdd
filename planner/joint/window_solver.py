"""Windows of steps (problem.py), solved together where they are alike."""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.interior_point import Tuning, solve_window
from planner.joint.problem import StepWindow

WIDTH = 4  # windows that are solved together at most


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


def solve_windows(asked: Sequence[Asked]) -> list[Solved]:
    """Solve `WIDTH` windows of one kind at most; what is found in one of them does not depend on the others."""
    return [
        Solved(*solve_window(one.legs, one.limits, one.x, one.u, one.place, tuning, np.zeros(1)))
        for one, tuning in asked
    ]
