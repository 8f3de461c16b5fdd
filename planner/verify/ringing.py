"""How much the machine's vibration modes ring: during the motion, and when it is over.

Each axis carries an oscillator that is shaken by the setpoints p(t), at rest before. Its deflection y, its position less p, obeys

    y'' + 2 z w y' + w^2 y = -p''(t),        w = 2 pi frequency,  z = damping ratio, 0 <= z < 1.

Between two samples p is the cubic of their positions and velocities: p'' is straight there, and has exactly the samples' change of the
velocity and of the position. With p'' = a0 + b x at the time x after the left sample

    y = -(a0 + b x)/w^2 + 2 z b/w^3 + Re(C exp(P x)),        P = -z w + i w sqrt(1 - z^2),

is exact from sample to sample; peaks between them are seen by steps of no more than `STEP` of the mode's phase. After the end nothing
shakes it any more, and y = Re(C exp(P x)): |C| is what it still rings with.

The deflection during the motion holds its static part too, a/w^2 under a constant acceleration a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.machine import Machine, Mode
from planner.motion.trajectory import Trajectory
from planner.verify.pieces import kernel

STEP = 0.2  # [rad] of the mode's phase between two looks: a peak is missed by less than 1 - cos(0.1) = 0.5 %


@dataclass(frozen=True, eq=False, kw_only=True)
class Ringing:
    """What one mode does on every axis.

    frequency, damping : the mode's [Hz], [-]
    axes               : their letters
    during             : (A,) largest deflection while the setpoints move [mm], rotary axes [rad]
    after              : (A,) amplitude with which it still rings at the end of the setpoints [mm], rotary axes [rad]
    """

    frequency: float
    damping: float
    axes: tuple[str, ...]
    during: FloatArray
    after: FloatArray

    def __post_init__(self) -> None:
        for name in ("during", "after"):
            freeze(self, name, np.float64, (len(self.axes),))

    def summary(self) -> dict[str, Any]:
        """A row of `summary.json`'s `ringing`."""
        return {
            "frequency_hz": self.frequency,
            "damping": self.damping,
            "during": dict(zip(self.axes, self.during.tolist(), strict=True)),
            "after": dict(zip(self.axes, self.after.tolist(), strict=True)),
        }


def ringing_of(trajectory: Trajectory, machine: Machine) -> tuple[Ringing, ...]:
    """The ringing of every mode of the machine under a trajectory's positions and velocities."""
    return tuple(_ringing(trajectory, mode) for mode in machine.modes)


def _ringing(trajectory: Trajectory, mode: Mode) -> Ringing:
    axes = len(trajectory.axes)
    during, after = np.zeros(axes), np.zeros(axes)
    _shake(
        np.ascontiguousarray(trajectory.t),
        np.ascontiguousarray(trajectory.position),
        np.ascontiguousarray(trajectory.velocity),
        2.0 * math.pi * mode.frequency,
        mode.damping,
        during,
        after,
    )
    return Ringing(
        frequency=mode.frequency, damping=mode.damping, axes=trajectory.axes, during=during, after=after
    )


@kernel()
def _shake(
    t: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    w: float,
    damping: float,
    during: FloatArray,
    after: FloatArray,
) -> None:
    """Writes the largest deflection and the amplitude at the end per axis (A,)."""
    turn = w * math.sqrt(1.0 - damping * damping)
    decay = -damping * w
    for axis in range(position.shape[1]):
        y, slope, most = 0.0, 0.0, 0.0
        for k in range(1, len(t)):
            h = t[k] - t[k - 1]
            v0, v1 = velocity[k - 1, axis], velocity[k, axis]
            mean = (position[k, axis] - position[k - 1, axis]) / h
            a0 = (6.0 * mean - 4.0 * v0 - 2.0 * v1) / h
            b = 6.0 * (v0 + v1 - 2.0 * mean) / (h * h)
            steps = max(1, math.ceil(w * h / STEP))
            dx = h / steps
            shrink = math.exp(decay * dx)
            c, s = shrink * math.cos(turn * dx), shrink * math.sin(turn * dx)
            drift = -b / (w * w)
            for n in range(steps):
                rest = -(a0 + b * n * dx) / (w * w) + 2.0 * damping * b / (w * w * w)
                free, free_slope = y - rest, slope - drift
                quarter = (free_slope - decay * free) / turn  # free = Re(C exp(P x)), C = free - i quarter
                free, quarter = c * free + s * quarter, c * quarter - s * free
                y = rest + drift * dx + free
                slope = drift + decay * free + turn * quarter
                most = max(most, abs(y))
        during[axis] = most
        after[axis] = math.hypot(y, (slope - decay * y) / turn)
