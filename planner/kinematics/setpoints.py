"""A motion of the tip as a motion of the joints: the setpoints that the axis controllers get."""

from __future__ import annotations

import dataclasses

import numpy as np

from planner.kinematics.along_path import joints_along
from planner.kinematics.chain import Kinematics
from planner.motion.trajectory import Trajectory


def joint_setpoints(motion: Trajectory, kinematics: Kinematics) -> Trajectory:
    """The motion with the joints in place of the tip: positions, velocities, accelerations and jerks; times, path length and feed stay
    those of the tip."""
    columns = np.stack([motion.position, motion.velocity, motion.acceleration, motion.jerk])
    position, velocity, acceleration, jerk = joints_along(kinematics, motion.axes, columns, motion.radius)
    return dataclasses.replace(
        motion, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk
    )
