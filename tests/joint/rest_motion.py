"""One line from rest to rest in seven phases of constant jerk, written out by hand."""

from __future__ import annotations

import numpy as np

from planner.motion.axis_motion import AxisMotion


def along_x(length: float, jerk: float, start: float = 0.0, slower: float = 1.0) -> AxisMotion:
    """[mm], [mm/s3]: four phases, where neither velocity nor acceleration limits; in `slower` times the least time.

    Half of the way is j t^3 for phases of length t, so the whole takes T = 4 (L/2j)^(1/3).
    """
    t = np.cbrt(length / (2.0 * jerk)) * slower
    j = jerk / slower**3
    x = start + j * t**3 * np.array([0.0, 1 / 6, 1.0, 11 / 6])
    v = j * t**2 * np.array([0.0, 0.5, 1.0, 0.5])
    a = j * t * np.array([0.0, 1.0, 0.0, -1.0])
    jerks = j * np.array([1.0, -1.0, -1.0, 1.0])
    columns = {
        name: np.stack([values, np.zeros(4)], axis=1)
        for name, values in (("position", x), ("velocity", v), ("acceleration", a), ("jerk", jerks))
    }
    return AxisMotion(
        axes=("x", "y"),
        t=t * np.arange(4),
        end=4 * t,
        block=np.zeros(4, int),
        line=np.full(4, 2),
        **columns,
    )
