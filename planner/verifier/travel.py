"""The travel of the axes: a delivered motion stays between `travel_min` and `travel_max` of every axis.

Both count in machine coordinates, which a motion is in where the machine file has G54, or the control knows no
work offsets. Else nothing is judged. The motion may leave a path that goes to the end of the travel by the
tolerance, and so it may leave the travel. Where a motion starts is not the program's: an axis that starts beyond
its travel may come back from there, and go no further.
"""

import math

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import ROTARY_AXES, Axis, Machine
from planner.motion.trajectory import Trajectory, in_degrees
from planner.verifier.excess import Fault, Kind

NAME = "travel"
WITHOUT_OFFSETS = ("klipper", "marlin", "reprapfirmware")  # controls that know no G54


def _ends(axis: Axis | None) -> tuple[float, float]:
    """The travel of an axis [mm, deg], infinite where there is none, and on one that turns on and on."""
    low, high = (None, None) if axis is None or axis.wrapped else (axis.travel_min, axis.travel_max)
    return -math.inf if low is None else low, math.inf if high is None else high


def travel_faults(
    trajectory: Trajectory, toolpath: Toolpath, machine: Machine, passed: FloatArray | None = None
) -> list[Fault]:
    """A fault for each axis whose samples lie beyond its travel: the furthest of them.

    passed : (M+1,) times of the joints of the path [s], for the line of a place; None for the samples' own lines
    """
    axes, control = trajectory.axes, machine.control
    ends = np.array([_ends(machine.axes.get(letter)) for letter in axes])
    known = "g54" in machine.work_offsets or (control is not None and control.name in WITHOUT_OFFSETS)
    if not known or not np.isfinite(ends).any():
        return []
    per = in_degrees(axes, trajectory.radius)
    room = float(toolpath.tolerance.max()) * per
    begin, entered = np.full(len(axes), math.nan), np.zeros(len(axes), dtype=bool)
    worst: list[tuple[float, float, float, int]] = [(0.0, 0.0, 0.0, 0)] * len(axes)
    for chunk in trajectory.chunks():
        x = chunk.position * per
        beyond = np.maximum(ends[:, 0] - x, x - ends[:, 1])
        begin = np.where(np.isnan(begin), np.maximum(beyond[0], 0.0), begin)
        inside = np.logical_or.accumulate(np.vstack([entered, beyond <= 0.0]))[1:]
        entered = inside[-1]
        over = beyond - np.where(inside, 0.0, begin) - room
        for axis, k in enumerate(over.argmax(axis=0).tolist()):
            if over[k, axis] > max(worst[axis][0], 0.0):
                worst[axis] = (over[k, axis], chunk.t[k], x[k, axis], int(chunk.line[k]))
    faults = []
    for axis, (over_by, time, place, line) in enumerate(worst):
        if over_by > 0.0:
            if passed is not None:
                segment = int(np.searchsorted(passed, time)) - 1
                line = int(toolpath.line[min(max(segment, 0), len(toolpath) - 1)])
            (low, high), unit = ends[axis], "deg" if axes[axis] in ROTARY_AXES else "mm"
            found = (
                f"{place:.7g} {unit}, {max(low - place, place - high):.4g} {unit} beyond its travel of {low:g} to {high:g} {unit} "
                f"in machine coordinates, at t = {time:.6g} s, line {line}"
            )
            faults.append(Fault(Kind.TRAVEL, f"{NAME}.{axes[axis]}", found, time=time, line=line))
    return faults
