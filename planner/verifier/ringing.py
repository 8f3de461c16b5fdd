"""How much the machine's vibration modes ring: during the motion, and when it is over.

Each axis carries an oscillator shaken by the setpoints p(t). Its deflection y, its place less p, obeys

    y'' + 2 z w y' + w^2 y = -p''(t),        w = 2 pi frequency,  z = damping ratio, 0 <= z < 1.

Between two samples p is the cubic of their positions and velocities: p'' is straight there, and has exactly
the samples' change of the velocity and of the position. With p'' = a0 + b x at the time x after the left
sample

    y = -(a0 + b x)/w^2 + 2 z b/w^3 + Re(C exp(P x)),        P = -z w + i w sqrt(1 - z^2),

is exact from sample to sample; peaks between them are seen by steps of no more than `STEP` of the mode's
phase. Of a mode that turns so fast that a period has more than `MOST_STEPS` of them, |y| <= max |a0 + b x - 2
z b/w| / w^2 + |C|, at either end, takes the place of its peaks: it turns more than thirty times there, and
comes close to the bound but for its decay. After the end nothing shakes it any more, and y = Re(C exp(P x)):
|C| is what it still rings with.

The deflection during the motion holds its static part too, a/w^2 under a constant acceleration a.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.machine import Machine, Mode
from planner.motion.trajectory import Trajectory
from planner.verifier.pieces import kernel

STEP = 0.2  # [rad] of the mode's phase between two looks: a peak is missed by less than 1 - cos(0.1) = 0.5 %
MOST_STEPS = 1000  # in a period; 10 us of computing for an axis
DEFLECTION, SLOPE, MOST = range(3)  # of an axis in a mode: place, speed, the largest deflection so far
STATE = 3  # numbers of a state


@dataclass(frozen=True, eq=False, kw_only=True)
class Ringing:
    """The ringing of one mode on every axis."""

    # frequency and damping: the mode's [Hz], [-]
    frequency: float
    damping: float
    axes: tuple[str, ...]  # their letters
    during: FloatArray  # (A,) largest deflection while the setpoints move [mm], rotary axes [rad]
    # (A,) amplitude with which it still rings at the end of the setpoints [mm], rotary axes [rad]
    after: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "during after", np.float64, (len(self.axes),))

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
    if not machine.modes:
        return ()
    axes = len(trajectory.axes)
    state = np.zeros((len(machine.modes), axes, STATE))
    carried = [np.empty(0), np.empty((0, axes)), np.empty((0, axes))]
    for chunk in trajectory.chunks():
        columns = (chunk.t, chunk.position, chunk.velocity)
        carried = [np.concatenate([old, new]) for old, new in zip(carried, columns, strict=True)]
        for mode, of_mode in zip(machine.modes, state, strict=True):
            _shake(carried[0], carried[1], carried[2], 2.0 * math.pi * mode.frequency, mode.damping, of_mode)
        carried = [column[-1:].copy() for column in carried]
    return tuple(
        _ringing(mode, of_mode, trajectory.axes) for mode, of_mode in zip(machine.modes, state, strict=True)
    )


def _ringing(mode: Mode, state: FloatArray, axes: tuple[str, ...]) -> Ringing:
    w = 2.0 * math.pi * mode.frequency
    turn, decay = w * math.sqrt(1.0 - mode.damping**2), -mode.damping * w
    y, slope = state[:, DEFLECTION], state[:, SLOPE]
    most, after = state[:, MOST], np.hypot(y, (slope - decay * y) / turn)
    return Ringing(frequency=mode.frequency, damping=mode.damping, axes=axes, during=most, after=after)


@kernel()
def _shake(t, position, velocity, w, damping, state):
    """Go on from the first sample, where each axis is in its `state` (A, `STATE`), to the last."""
    turn = w * math.sqrt(1.0 - damping * damping)
    decay = -damping * w
    for axis in range(position.shape[1]):
        y, slope, most = state[axis, DEFLECTION], state[axis, SLOPE], state[axis, MOST]
        for k in range(1, len(t)):
            h = t[k] - t[k - 1]
            v0, v1 = velocity[k - 1, axis], velocity[k, axis]
            mean = (position[k, axis] - position[k - 1, axis]) / h
            a0 = (6.0 * mean - 4.0 * v0 - 2.0 * v1) / h
            b = 6.0 * (v0 + v1 - 2.0 * mean) / (h * h)
            bounded = w * h > STEP * MOST_STEPS
            steps = 1 if bounded else max(1, math.ceil(w * h / STEP))
            dx = h / steps
            shrink = math.exp(decay * dx)
            c, s = shrink * math.cos(turn * dx), shrink * math.sin(turn * dx)
            drift = -b / (w * w)
            for n in range(steps):
                rest = -(a0 + b * n * dx) / (w * w) + 2.0 * damping * b / (w * w * w)
                free, free_slope = y - rest, slope - drift
                quarter = (free_slope - decay * free) / turn  # free = Re(C exp(P x)), C = free - i quarter
                if bounded:
                    most = max(most, max(abs(rest), abs(rest + drift * dx)) + math.hypot(free, quarter))
                free, quarter = c * free + s * quarter, c * quarter - s * free
                y = rest + drift * dx + free
                slope = drift + decay * free + turn * quarter
                most = max(most, abs(y))
        state[axis, DEFLECTION], state[axis, SLOPE], state[axis, MOST] = y, slope, most
