"""The axes that F goes by: x, y and z, where they stand u, v and w, where these stand too the rotary axes."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.build import feed_groups, path_per_length
from planner.geometry.toolpath import Toolpath

ROTARY = 2  # of the groups in `feed_groups`


def goes_by(toolpath: Toolpath) -> Array:
    """(M,) the group of axes that F goes by on each segment; arcs and curves move x, y or z."""
    groups, moves = feed_groups(toolpath.axes), np.abs(toolpath.end - toolpath.start) > 0
    linear = moves[:, groups == 0].any(axis=1) | (toolpath.arc >= 0) | (toolpath.curve >= 0)
    found: Array = np.where(linear, 0, np.where(moves[:, groups == 1].any(axis=1), 1, ROTARY))
    return found


def allowed_along(toolpath: Toolpath, segment: Array, tangent: FloatArray) -> FloatArray:
    """(n,) feed along the path in all axes [mm/s] at which what F goes by moves at F.

    segment : (n,) of the toolpath
    tangent : (n, A) dr/ds of a path beside it, with other parts in linear and rotary axes
    """
    groups = feed_groups(toolpath.axes)
    by = goes_by(toolpath)
    word = toolpath.feed / path_per_length(toolpath.axes, toolpath.radius, toolpath)
    word = np.where(by == ROTARY, toolpath.radius, 1.0) * word
    counts = groups == by[segment][:, None]
    part = np.sqrt((tangent**2 * counts).sum(axis=1))
    return np.divide(word[segment], part, out=np.full(len(segment), np.inf), where=part > 0)
