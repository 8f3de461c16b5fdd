"""The tip and the direction of the tool from delivered joints, for the verdict.

Written as a chain of frames, from the tool's tip through the head to the machine and through the table to the workpiece, and so by
other formulas than the planner's: with M1, M2 the matrices of the axes that carry the workpiece (outer, inner) about the points c1, c2,
a point P of the machine is that of the workpiece

    p = c2 + M2^T (c1 + M1^T (P - c1) - c2)

and the tool's tip in the machine is the joints plus the vector from the spindle at rest, turned by the head. Program coordinates have
the tool's length in z (G43), which turns with neither.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import KinematicsData


def _about(letter: str, angle: FloatArray) -> FloatArray:
    """(n, 3, 3) right-handed rotations about x, y or z by angle (n,)."""
    i, j = {"a": (1, 2), "b": (2, 0), "c": (0, 1)}[letter]
    matrix = np.zeros((len(angle), 3, 3))
    matrix[:] = np.eye(3)
    matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
    matrix[:, j, i] = np.sin(angle)
    matrix[:, i, j] = -matrix[:, j, i]
    return matrix


def tip_and_direction(
    data: KinematicsData, length: float, axes: tuple[str, ...], joints: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n, 3) controlled point in program coordinates [mm] and (n, 3) unit vector of the tool, seen from the workpiece, for joints
    (n, A) of the axes [mm, rad] and a tool of that length [mm]."""
    column = dict(zip(axes, np.asarray(joints, dtype=np.float64).T, strict=True))
    turned = {
        letter: _about(letter, -column[letter] if letter in data.reversed else column[letter])
        for letter in data.rotary
    }
    tilt, c = turned[data.rotary[0]], turned["c"]
    q = np.stack([column["x"], column["y"], column["z"]], axis=1)
    rest = np.broadcast_to(np.eye(3), tilt.shape)
    point = np.array([data.x_rot_point, data.y_rot_point, data.z_rot_point])
    offset = np.array([data.x_offset, data.y_offset, data.z_offset])
    tool = np.array([0.0, 0.0, -length])
    if data.type in ("xyzac-trt", "xyzbc-trt"):
        outer, inner, head, arm, centre = tilt, c, rest, np.zeros(3), point + offset
    else:
        arm = np.array([data.x_offset, data.y_offset, -data.pivot_length])
        outer, centre = rest, point
        inner, head = (rest, c @ tilt) if data.type == "head-head" else (c, tilt)
    tip = q - arm + np.einsum("nij,j->ni", head, arm + tool)
    on_first = centre + np.einsum("nji,nj->ni", outer, tip - centre)
    on_work = point + np.einsum("nji,nj->ni", inner, on_first - point)
    direction = np.einsum("nji,nj->ni", inner, np.einsum("nji,nj->ni", outer, head[:, :, 2]))
    return on_work - tool, direction
