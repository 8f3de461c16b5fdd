"""The shortest rest at a stop with which a mean of the last Td of a motion still comes near enough to it.

The mean is what moving averages or delayed copies make of the motion p. Two runs that are Td apart do not
know of each other: the stop between them is reached. Paper 000's dwell is Td - Tk, the shortest rest with
which the mean comes near enough: here it is found for the motion as it is. With what runs into the stop, a(t)
= p(arrival - t), and what runs out of it, b(t) = p(departure + t), both seen from the stop, the mean is, at
the time t after the arrival,

    A(t) + B(t - rest),     A(t) = E a(delay - t),     B(t) = E b(t - delay),

E the mean over the delays, a and b being 0 at negative times. A and B are taken at equal steps of Td, with
straight lines between them.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.motion.filters import Filters
from planner.motion.shaping import Shaper

# Steps of Td: with one vibration mode each is less than 3 degrees of it, and straight lines between them miss
# 4e-4 of the amplitude. Rests are found to 2^-HALVINGS of Td: 40 us of 40 ms.
STEPS, HALVINGS = 128, 10


@dataclass(frozen=True, eq=False, kw_only=True)
class Mean:
    """Of the last `length` of a motion [s].

    inside : (C,) times from a stop, before and after it, at which the motion is asked [s]
    into   : (STEPS + 1, C) weights of its places before the stop, at steps after the arrival: A
    out    : (STEPS + 1, C) of where it is after the stop, at each step after the departure; they make B
    """

    length: float
    inside: FloatArray
    into: FloatArray
    out: FloatArray

    def shortest_rests(self, before: FloatArray, after: FloatArray, budget: FloatArray) -> FloatArray:
        """(g,) the shortest rests [s] at stops with which the mean comes near enough to them.

        before, after : (g, C, A) where the motion is `inside` before and after each stop, seen from it [mm]
        budget        : (g,) how near it has to come [mm]
        """
        return np.asarray(_shortest(self.into @ before, self.out @ after, budget) * (self.length / STEPS))


def mean_of_filters(filters: Filters) -> Mean:
    """The mean of moving averages: in each of `STEPS` parts the motion counts as it is in the middle."""
    weight = np.diff(filters.step(filters.delay * np.arange(STEPS + 1) / STEPS))
    middle = np.arange(STEPS) + 0.5
    edge = np.arange(STEPS + 1)[:, None]
    into, out = (edge + middle).astype(np.int64), (edge - middle).astype(np.int64)
    return Mean(
        length=filters.delay,
        inside=middle * filters.delay / STEPS,
        into=np.where(into < STEPS, weight[into.clip(max=STEPS - 1)], 0.0),
        out=np.where(edge > middle, weight[out], 0.0),
    )


def mean_of_copies(shaper: Shaper) -> Mean:
    """The mean of delayed copies."""
    step = np.arange(STEPS + 1.0)
    since = step - shaper.delay[:, None] * STEPS / shaper.length

    def between(place: FloatArray) -> FloatArray:
        """(STEPS + 1, C) weights of the steps beside places (n, STEPS + 1); none at the stop or before."""
        share = np.clip(1.0 - np.abs(place[:, :, None] - step), 0.0, 1.0)
        return np.einsum("i,ijc->jc", shaper.weight, np.where(place[:, :, None] > 0.0, share, 0.0))

    return Mean(
        length=shaper.length, inside=step * shaper.length / STEPS, into=between(-since), out=between(since)
    )


@njit(cache=True)
def _shortest(before, after, budget):
    """(g,) rests in steps, from A and B (g, STEPS + 1, A) of each stop [mm]; at most all steps."""
    rest = np.zeros(len(budget))
    for k in range(len(budget)):
        if _nearest(before[k], after[k], 0.0) <= budget[k]:
            continue
        low, high = 0.0, before.shape[1] - 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (
                (low, middle) if _nearest(before[k], after[k], middle) <= budget[k] else (middle, high)
            )
        rest[k] = high
    return rest


@njit(cache=True)
def _nearest(before, after, rest):
    """How near the mean comes to a stop [mm], with a rest of so many steps."""
    least = np.inf
    for j in range(len(before)):
        x = max(j - rest, 0.0)
        i = min(int(x), len(after) - 2)
        square = 0.0
        for axis in range(before.shape[1]):
            place = before[j, axis] + after[i, axis] + (x - i) * (after[i + 1, axis] - after[i, axis])
            square += place * place
        least = min(least, square)
    return np.sqrt(least)
