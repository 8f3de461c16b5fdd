"""The motion behind the filters of a machine that is given the setpoints of a motion, for planning.

Between setpoints dt apart the machine moves as its file says. In periods, with one setpoint at 0 that is 1
and all others 0, it makes of that the shape (k and m are places and powers of truncated powers x^m/m! for x >
0, c their factors)

    linear      (k, m, c) = (-1, 1, 1), (0, 1, -2), (1, 1, 1)                                     a hat
    hold        (0, 0, 1), (1, 0, -1)                                                             a box behind the setpoint
    cubic       (-1, 2, 6), (-1, 3, -12), (0, 3, 24), (1, 3, -12), (1, 2, -6)                     of the position
                (-1, 2, -2), (-1, 3, 6), (0, 2, -8), (1, 2, -2), (1, 3, -6)                       of the velocity times dt

and moving averages T_i in series make of x^m/m! the sum over all subsets s of them, T_s their sum,

    sum_s (-1)^|s| (x - T_s)_+^(m + n) / (m + n)!  /  (T_1 ... T_n),

so that the motion behind them is a convolution of the setpoints with a shape that ends: exact at any time,
without an error that grows along the motion. A shape is even or odd about its middle, and its later half is
taken from its earlier one, where little cancels.

The last period of a motion may be shorter than dt; here it is not. A motion comes to rest there with limited
jerk or acceleration: what changes is when it is at its end, not where it passes.
"""

from collections.abc import Iterator
from itertools import combinations
from math import factorial

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.sizes import SIZES
from planner.motion.timing import MotionInTime, sample_motion

# Places of the filtered motion in a period, and in the shortest filter: where setpoints make kinks.
PER_PERIOD, PER_FILTER, PER_FILTER_HELD = 4, 8, 32
AT_ONCE = SIZES.convolved_at_once
Terms = tuple[tuple[int, int, float], ...]
# Of each kind the shape of position and, if it counts, velocity times dt; the middle of both [periods].
SHAPES: dict[str, tuple[float, Terms, Terms]] = {
    "linear": (0.0, ((-1, 1, 1.0), (0, 1, -2.0), (1, 1, 1.0)), ()),
    "hold": (0.5, ((0, 0, 1.0), (1, 0, -1.0)), ()),
    "cubic": (
        0.0,
        ((-1, 2, 6.0), (-1, 3, -12.0), (0, 3, 24.0), (1, 3, -12.0), (1, 2, -6.0)),
        ((-1, 2, -2.0), (-1, 3, 6.0), (0, 2, -8.0), (1, 2, -2.0), (1, 3, -6.0)),
    ),
}


class FilteredSetpoints:
    """Setpoints of motions behind the filters of one machine.

    interpolation : of the machine file
    filters       : lengths of the moving averages [s], one or more
    dt            : interpolation period [s]
    """

    def __init__(self, interpolation: str, filters: tuple[float, ...], dt: float):
        self.dt, lengths = dt, tuple(T / dt for T in filters)
        places = PER_FILTER_HELD if interpolation == "hold" else PER_FILTER
        self.phases = max(PER_PERIOD, int(np.ceil(places / min(lengths))))
        middle, place, slope = SHAPES[interpolation]
        self.middle = middle + sum(lengths) / 2.0
        # setpoints before a time that count, but the one behind it
        self.reach = int(np.ceil(sum(lengths))) + 1
        # (phases, reach + 2) weights of the setpoint behind a time and of those before it
        age = np.arange(self.phases)[:, None] / self.phases + np.arange(-1, self.reach + 1)
        self.place = self._half(place, lengths, age, even=True)
        self.place /= self.place.sum(axis=1, keepdims=True)  # 1 but for rounding
        self.slope = self._half(slope, lengths, age, even=False) * dt if slope else None

    def _half(self, terms: Terms, lengths: tuple[float, ...], age: FloatArray, *, even: bool) -> FloatArray:
        """The shape of `terms` behind the filters at ages [periods] after its setpoint."""
        early = self.middle - np.abs(age - self.middle)
        n, total = len(lengths), np.zeros_like(early)
        for k, m, c in terms:
            for size in range(n + 1):
                for some in combinations(lengths, size):
                    x = np.maximum(early - k - sum(some), 0.0)
                    power = x ** (m + n) if m + n else (x > 0.0)
                    total += (-1) ** size * c * power / factorial(m + n)
        total /= np.prod(lengths)
        return total if even else np.where(age > self.middle, -total, total)

    def of(self, motion: MotionInTime) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Times (T,) [s], positions (T, A) [mm] behind the filters, part by part, until these are empty."""
        first, kept = 0, None
        for places in self._setpoints(motion):
            seen = places if kept is None else np.concatenate([kept, places])
            count = max(len(seen) - self.reach - 1, 0)  # 0 while there are fewer than count for one time
            if count:
                place = np.arange(first * self.phases, (first + count) * self.phases, dtype=np.float64)
                yield place * (self.dt / self.phases), self._convolved(seen)
            first, kept = first + count, seen[count:]

    def _setpoints(self, motion: MotionInTime) -> Iterator[FloatArray]:
        """(n, 2, A) positions and velocities of the setpoints, some at a time, at rest before and behind."""
        still: FloatArray | None = None
        for chunk in sample_motion(motion, self.dt).chunks():
            both = np.stack([chunk.position, chunk.velocity], axis=1)
            if still is None:
                still = np.stack([both[:1, 0], np.zeros_like(both[:1, 0])], axis=1)
                both = np.concatenate([np.repeat(still, self.reach, axis=0), both])
            for low in range(0, len(both), AT_ONCE):
                yield both[low : low + AT_ONCE]
            still[0, 0] = both[-1, 0]
        if still is not None:
            yield np.repeat(still, self.reach + 1, axis=0)

    def _convolved(self, setpoints: FloatArray) -> FloatArray:
        """(P (n - reach - 1), A) positions behind the filters, of setpoints (n, 2, A), n > reach + 1."""
        count, axes = len(setpoints) - self.reach - 1, setpoints.shape[2]
        out = np.empty((count, self.phases, axes))
        for axis in range(axes):
            origin = setpoints[0, 0, axis]
            for phase in range(self.phases):
                out[:, phase, axis] = origin + np.convolve(
                    setpoints[:, 0, axis] - origin, self.place[phase], mode="valid"
                )
                if self.slope is not None:
                    out[:, phase, axis] += np.convolve(setpoints[:, 1, axis], self.slope[phase], mode="valid")
        return out.reshape(-1, axes)
