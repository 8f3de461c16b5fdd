"""What methods `fir` and `fir-spline` share: the filters that make their profile, and the axes of a motion made of filtered pieces."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.baselines.fir.superpose import Filtered
from planner.geometry.toolpath import Toolpath
from planner.motion.axis_motion import AxisMotion


def check_profile_filters(times: tuple[float, float] | None) -> None:
    """Raise InputError for profile filters that are not two positive lengths."""
    if times is not None and (len(times) != 2 or not all(0 < T < np.inf for T in times)):
        raise InputError(
            f"profile_filters = {', '.join(f'{T:g}' for T in times) or 'none'}; give two lengths [s], positive and finite, or None: "
            "then the method chooses them"
        )


def reached(motion: Filtered) -> FloatArray:
    """(P,) how far the middle of each piece has come along the guide, which is the last column of the pieces [mm]."""
    middle = (motion.ends + motion.t) / 2 - motion.t
    s, v, a, j = motion.state[:, :, -1]
    along: FloatArray = s + middle * (v + middle * (a / 2 + middle * j / 6))
    return along


def axes_of(
    motion: Filtered, segment: Array, first: int, toolpath: Toolpath, start: FloatArray
) -> AxisMotion:
    """The axes of a filtered motion of P pieces, a standstill before the first move included.

    segment : (P,) of the toolpath, that each piece belongs to
    first   : the segment that a standstill before the first move belongs to
    start   : (A,) where that is [mm]
    """
    t, state = motion.t, motion.state[:, :, :-1]
    if t[0] > 0:
        t, segment = np.insert(t, 0, 0.0), np.insert(segment, 0, first)
        still = np.zeros((4, 1, len(start)))
        still[0, 0] = start
        state = np.concatenate([still, state], axis=1)
    position, velocity, acceleration, jerk = state
    return AxisMotion(
        axes=toolpath.axes,
        radius=toolpath.radius,
        t=t,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        jerk=jerk,
        block=toolpath.block[segment],
        line=toolpath.line[segment],
        end=float(motion.end[-1]),
    )
