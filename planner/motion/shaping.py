"""Input shaping: setpoints that leave no vibration behind.

A mode of frequency w and damping ratio z that is shaken by p(t) rings on after the end with an amplitude that
is proportional to
|integral of p''(t) exp(-P t) dt|, P = -z w + i w sqrt(1 - z^2). Instead of p a machine can be given a mean of delayed copies,

    D(t) = sum_i A_i p(t - t_i),      A_i > 0,  sum A_i = 1,

whose ringing is that of p times |sum_i A_i exp(-P t_i)|. Two copies suffice for one mode (the zero-vibration
shaper, Singer and Seering 1990, doi 10.1115/1.2894142): half a damped period apart,

    t = 0, pi / (w sqrt(1 - z^2)),      A = 1/(1+K), K/(1+K),      K = exp(-z pi / sqrt(1 - z^2)),

they cancel each other exactly. Shapers in series, one per mode, are the products of their copies. The moving
average of paper 000, eq. 10, T = 2 pi/w, is this shaper and a moving average of T/2 in series: it has the
same zero, twice the delay and 4/3 of the variance, to which the error on curves is proportional.

D keeps every limit that p keeps, since it is a mean of such motions, and it may keep limits that p exceeds:
of two copies half a period apart only one may be accelerating. It leaves the path of p by up to (1/2)
max|p''| sum_i A_i (t_i - t_mean)^2, which is for the planner to keep within the tolerance.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.machine import Mode
from planner.motion.filters import damped_period
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory


@dataclass(frozen=True, eq=False, kw_only=True)
class Shaper:
    """n delayed copies of a motion (module text)."""

    delay: FloatArray  # (n,) t_i [s], ascending from 0
    weight: FloatArray  # (n,) A_i [-], positive, of sum 1

    def __post_init__(self) -> None:
        copies = len(self.delay)
        freeze(self, "delay weight", np.float64, (copies,))

    @property
    def length(self) -> float:
        """How much longer the shaped motion lasts [s]."""
        return float(self.delay[-1])

    @property
    def middle(self) -> float:
        """Mean delay [s]."""
        return float(self.weight @ self.delay)

    @property
    def variance(self) -> float:
        """Of the delays [s2]: half of it times an acceleration is about how far off the path D is [mm]."""
        return float(self.weight @ (self.delay - self.middle) ** 2)


def shaper_of(modes: tuple[Mode, ...]) -> Shaper:
    """The zero-vibration shaper of n modes (Singer and Seering 1990): 2^n copies; one without any."""
    delay, weight = np.zeros(1), np.ones(1)
    for mode in modes:
        half = 0.5 * damped_period(mode.frequency, mode.damping)
        K = math.exp(-mode.damping * math.pi / math.sqrt(1.0 - mode.damping**2))
        delay = np.concatenate([delay, delay + half])
        weight = np.concatenate([weight, K * weight]) / (1.0 + K)
    order = np.argsort(delay, kind="stable")
    return Shaper(delay=delay[order], weight=weight[order])


@dataclass(frozen=True, eq=False)
class ShapedMotion:
    """A motion given to a shaper, and the motion delivered from it; before and after, it rests."""

    motion: MotionInTime
    shaper: Shaper

    @cached_property
    def t(self) -> FloatArray:
        """(L,) start of each smooth piece [s]: those of all copies."""
        edges = np.append(self.motion.t, self.motion.end)
        return np.unique(np.add.outer(self.shaper.delay, edges))[:-1]

    @property
    def end(self) -> float:
        """End of the last copy [s]."""
        return self.motion.end + self.shaper.length

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The mean of the copies at times (T,) [s]; block and line at the mean delay, s and feed means."""
        place = times - np.append(self.shaper.delay, self.shaper.middle)[:, None]
        at_rest = (place <= 0.0) | (place >= self.motion.end)
        # two times next to each other may be one after a delay was subtracted
        single, which = np.unique(np.clip(place, 0.0, self.motion.end), return_inverse=True)
        there = self.motion.at(single, dt)
        which = which.reshape(place.shape)  # NumPy 2.0.0 gave it so, all others flat
        copies, weight = which[:-1], self.shaper.weight
        columns: dict[str, Any] = {name: getattr(there, name)[which[-1]] for name in ("block", "line")}
        for name in ("position", "s", "velocity", "acceleration", "jerk", "feed"):
            of_copies = getattr(there, name)[copies]
            if name not in ("position", "s"):
                of_copies[at_rest[:-1]] = 0.0
            columns[name] = np.tensordot(weight, of_copies, axes=1)
        return dataclasses.replace(there, t=times, **columns)

    def waiting(self, at: FloatArray, by: FloatArray) -> ShapedMotion:
        """The motion standing longer by `by` (n,) [s] at the times `at` (n,) [s], where all copies rest."""
        return ShapedMotion(self.motion.waiting(at - self.shaper.length, by), self.shaper)
