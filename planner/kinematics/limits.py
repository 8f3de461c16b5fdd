"""The limits of the joints on a path of the tip.

On such a path the machine's limits of x, y and z are limits of functions of the position: joints q(p, angles), which enter every
solver as rows with q', q'', q''' (constraints/own.py) and are held between grid points as those are. The coordinates of the tip have no
limits of their own. Solvers and grids want some, so they get the joints' ones times `WIDE`, far above what the joints let happen on the
paths here.
"""

from __future__ import annotations

from typing import Any

from planner.constraints.own import JointLimit, Place
from planner.kinematics.along_path import in_rad
from planner.kinematics.chain import LINEAR, Kinematics, kinematics_of
from planner.machine import Axis, Machine

# Limits of the tip's coordinates, which do not hold a motion: so many times those of the machine's fastest linear joint [-].
WIDE = 10.0


class LinearJoint(JointLimit):
    """The limits of one linear joint of a machine through its kinematics."""

    def __init__(self, letter: str, axis: Axis, kinematics: Kinematics, radius: float):
        self.name, self.letter, self.kinematics, self.radius = f"joint {letter}", letter, kinematics, radius
        self.velocity, self.acceleration, self.jerk = axis.velocity, axis.acceleration, axis.jerk

    def joint(self, at: Place) -> Any:
        """The joint where the tip and the rotary axes are at the place [mm]."""
        place = {letter: getattr(at, letter) for letter in at.axes}
        return self.kinematics.joints(in_rad(place, self.radius))[self.letter]


def at_tip(machine: Machine, kinematics: Kinematics | None = None) -> Machine:
    """The machine as it is planned for on paths of the tool's tip: limits of the linear joints through the kinematics, those of the
    rotary ones as they are.

    kinematics : None for those of the machine file

    Raises InputError if it has none, and if it lacks one of their axes.
    """
    found = kinematics_of(machine) if kinematics is None else kinematics
    for letter in found.axes:
        machine.limits("velocity", (letter,))
    radius = getattr(machine, "radius", 1.0)
    linear = [machine.axes[letter] for letter in LINEAR]
    wide = Axis(
        velocity=WIDE * max(axis.velocity for axis in linear),
        acceleration=WIDE * max(axis.acceleration for axis in linear),
        jerk=WIDE * max(axis.jerk for axis in linear),
    )
    axes = {letter: wide if letter in LINEAR else axis for letter, axis in machine.axes.items()}
    joints = [LinearJoint(letter, machine.axes[letter], found, radius) for letter in LINEAR]
    return machine.model_copy(update={"axes": axes}).with_own([*machine.own, *joints])
