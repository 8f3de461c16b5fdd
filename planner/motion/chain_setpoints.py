"""A motion of the tip as a motion of the joints, the setpoints that the axis controllers get, and back."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from planner.machine.kinematics.chain import Chain, Kinematics, along
from planner.motion.trajectory import Trajectory


def joint_setpoints(motion: Trajectory, kinematics: Kinematics) -> Trajectory:
    """The motion with the joints in place of the tip: positions, velocities, accelerations and jerks; times,
    path length and feed stay those of the tip. Of a motion that is evaluated on demand they are, too."""
    return _changed(motion, kinematics.joints)


def tip_of_setpoints(setpoints: Trajectory, chain: Chain) -> Trajectory:
    """The motion of the tip that setpoints of the joints carry: `joint_setpoints` the other way."""
    return _changed(setpoints, chain.point)


def _changed(motion: Trajectory, carried: Callable[[dict[str, Any]], dict[str, Any]]) -> Trajectory:
    def of(samples: Trajectory) -> Trajectory:
        columns = np.stack([samples.position, samples.velocity, samples.acceleration, samples.jerk])
        position, velocity, acceleration, jerk = along(carried, samples.axes, columns, samples.radius)
        return dataclasses.replace(
            samples, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk
        )

    return motion.through(of)
