"""What methods `fir` and `fir-spline` share: the filters that make their profile, and the axes of a motion made of filtered pieces."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.fir.superpose import Pieces
from planner.geometry.toolpath import Toolpath
from planner.motion.axis_motion import AxisMotion

COLUMNS = ("position", "velocity", "acceleration", "jerk")


def check_profile_filters(times: tuple[float, float] | None) -> None:
    """Raise InputError for profile filters that are not two positive lengths."""
    if times is not None and (len(times) != 2 or not all(0 < T < np.inf for T in times)):
        raise InputError(
            f"profile_filters = {', '.join(f'{T:g}' for T in times) or 'none'}; give two lengths [s], positive and finite, or None: "
            "then the method chooses them"
        )


def reached(pieces: Pieces) -> FloatArray:
    """(P,) how far the middle of each piece has come along the course, which is the last column of the pieces [mm]."""
    middle = (pieces.t + np.append(pieces.t[1:], pieces.end[-1])) / 2 - pieces.t
    s, v, a, j = (getattr(pieces, name)[:, -1] for name in COLUMNS)
    along: FloatArray = s + middle * (v + middle * (a / 2 + middle * j / 6))
    return along


def axes_of(pieces: Pieces, segment: Array, first: int, toolpath: Toolpath, start: FloatArray) -> AxisMotion:
    """The axes of the filtered motion.

    segment : (P,) of the toolpath, that each piece belongs to
    first   : the segment that a standstill before the first move belongs to
    start   : (A,) where that is [mm]
    """
    t, columns = pieces.t, {name: getattr(pieces, name)[:, :-1] for name in COLUMNS}
    if t[0] > 0:
        t, segment = np.insert(t, 0, 0.0), np.insert(segment, 0, first)
        still = {name: np.zeros((1, len(start))) for name in COLUMNS} | {"position": start[None]}
        columns = {name: np.vstack([still[name], column]) for name, column in columns.items()}
    return AxisMotion(
        axes=toolpath.axes,
        t=t,
        block=toolpath.block[segment],
        line=toolpath.line[segment],
        end=float(pieces.end[-1]),
        **columns,
    )
