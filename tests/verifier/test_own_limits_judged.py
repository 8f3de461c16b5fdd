"""Limits of the user, where only some columns were delivered: the judge takes what it has, and makes up nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from motions import Moves, along, helix, machine, sample

from planner import JointLimit, PathLimit
from planner.verifier import verify
from planner.verifier.given import Given

RADIUS, SPEED = 10.0, 60.0
SWEEP = 2.0 * np.pi


class Square(JointLimit):
    """The square of the distance from the centre, which stays the same along the circle."""

    name, unit = "square", "mm2"
    acceleration = 0.5 * SPEED**2  # a quarter of what the velocity alone would make of it

    def joint(self, at):
        return at.x * at.x + at.y * at.y


class Along(PathLimit):
    """Twice the speed of the motion."""

    name = "along"

    def velocity(self, at):
        return 2.0 * SPEED


def checks(limit, columns, faster=1.0):
    """Of a steady motion round the circle, the velocities of which are told as `faster` ones."""
    own = machine().with_own([limit])
    length, curve = helix((RADIUS, 0.0, 0.0), (0.0, 0.0), SWEEP)
    motion = sample(
        along(length, curve, (length / SPEED, lambda t: (SPEED * t, SPEED + 0 * t, 0 * t, 0 * t))),
        own.dt,
    )
    by = {name: float(name in columns) for name in ("velocity", "acceleration", "jerk")}  # as files are read
    by["velocity"] *= faster
    told = dataclasses.replace(motion, **{name: share * getattr(motion, name) for name, share in by.items()})
    toolpath = Moves((RADIUS, 0.0, 0.0)).arc((0.0, 0.0), SWEEP, feed=1e3).toolpath(own)
    return verify(told, toolpath, own, given=Given(columns=columns)).limits


@pytest.mark.parametrize("columns", [("velocity", "acceleration", "jerk"), ("velocity",), ()], ids=len)
def test_a_joint_that_rests_has_no_acceleration_whatever_was_delivered(columns) -> None:
    """q'' = 2 v^2 + 2 x a, and 0 here: without a it would be four times the limit."""
    assert checks(Square(), columns)["acceleration.square"].ratio < 1e-3


@pytest.mark.parametrize("columns", [("velocity", "acceleration", "jerk"), ("velocity",)], ids=len)
def test_a_velocity_that_was_delivered_is_judged_by_itself(columns) -> None:
    """It is told 1.5 times as large as it is, and then nothing but the column shows it."""
    assert checks(Along(), columns, 1.5)["velocity.along"].ratio == pytest.approx(0.75, rel=1e-6)
    assert checks(Along(), (), 1.5)["velocity.along"].ratio == pytest.approx(0.5, rel=1e-3)
