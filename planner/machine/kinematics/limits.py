"""The limits of the joints on a path of the tip.

On such a path the machine's limits of x, y and z are limits of functions of the position: joints q(p,
angles), which enter every solver as rows with q', q'', q''' (machine/user_limit.py) and are held between grid
points as those are. The coordinates of the tip have no limits of their own. Grids, corners and splines want
some, so they get the joints' ones times a factor, `WIDE`: above the root of 3, by which three joints together
are stronger than one, so that where the angles stand still it is the joints that hold the motion. A tip that
a fast table carries far from its axis may be held by it; the verdict then has velocity.x, acceleration.x or
jerk.x at 1.
"""

from typing import Any

import numpy as np

from planner.base.errors import InputError
from planner.machine import Axis, Machine
from planner.machine.kinematics.chain import LINEAR, Kinematics, in_rad, kinematics_of
from planner.machine.user_limit import QUANTITIES, JointLimit, Place

# Limits of the tip's coordinates: so many times the largest of the linear joints [-]. Splines are shaped by
# them, not by those of the joints: with 10 a path of three axes is planned 3 % slower than by a machine
# without kinematics, with 2 1 %, with 1 as fast.
WIDE = 2.0


class LinearJoint(JointLimit):
    """The limits of one linear joint of a machine through its kinematics."""

    def __init__(self, letter: str, axis: Axis, kinematics: Kinematics, radius: float):
        self.name, self.letter, self.kinematics, self.radius = f"joint {letter}", letter, kinematics, radius
        self.velocity, self.acceleration, self.jerk = axis.velocity, axis.acceleration, axis.jerk

    def joint(self, at: Place) -> Any:
        """The joint where the tip and the rotary axes are at the place [mm]. All three joints are kept with the place, as the
        others ask for theirs there, too."""
        kept = vars(at)
        if kept.get("_joints_of") is not self.kinematics:
            place = {letter: getattr(at, letter) for letter in at.axes}
            kept["_joints"] = self.kinematics.joints(in_rad(place, self.radius))
            kept["_joints_of"] = self.kinematics
        return kept["_joints"][self.letter]


def at_tip(machine: Machine, kinematics: Kinematics | None = None, *, wide: float | None = WIDE) -> Machine:
    """The machine as it is planned for on paths of the tool's tip: limits of the linear joints through the
    kinematics, those of the rotary ones as they are.

    kinematics : None for those of the machine file
    wide       : limits of the tip's coordinates, of the largest ones of the linear joints (module text) [-];
                 None for those of the machine, for methods that do not know limits of joints: where the
                 rotary axes stand at 0 they are the same

    Raises InputError if it has none, if it lacks one of their axes, and for a factor below 1.
    """
    found = kinematics_of(machine) if kinematics is None else kinematics
    if wide is not None and not 1.0 <= wide < np.inf:
        raise InputError(f"wide = {wide:g}; it must be 1 or more")
    for letter in found.axes:
        machine.limits("velocity", (letter,))
    radius = machine.radius
    # travel is that of the joints
    own = {"travel_min": None, "travel_max": None}
    axes = {a: axis.model_copy(update=own) if a in LINEAR else axis for a, axis in machine.axes.items()}
    if wide is not None:
        linear = [machine.axes[letter] for letter in LINEAR]
        free = Axis(**{name: wide * max(getattr(axis, name) for axis in linear) for name in QUANTITIES})
        axes |= dict.fromkeys(LINEAR, free)
    joints = [LinearJoint(letter, machine.axes[letter], found, radius) for letter in LINEAR]
    # joints that run on cubics do not lead the tip along one: between setpoints it is taken to run along its
    # chord
    way = "linear" if machine.interpolation == "cubic" else machine.interpolation
    return machine.model_copy(update={"axes": axes, "interpolation": way}).with_own([*machine.own, *joints])
