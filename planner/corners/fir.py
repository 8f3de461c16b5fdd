"""The FIR overlap corner of paper 000, as geometry.

Two velocity pulses of feed V through two moving averages of lengths T1 >= T2, the second pulse started Tk
before the first has died out: X = V R(Tk - tau), Y = V R(tau), tau in [0, Tk], with the ramp response R of
docs/papers.md 0. With s = sin(theta/2), delay Td = T1 + T2 (eq. (14), (15), the branch chosen on eps):

    eps = 2 V s R(Tk/2)
    Tk  = (24 T1 T2 eps / (V s))^(1/3)                    eps <= V s T2^2 / (3 T1)
          T2 + sqrt(4 T1 eps / (V s) - T2^2 / 3)          eps <= V s (3 T1^2 + T2^2) / (12 T1)
          Td                                              beyond: the largest error there is

The tangent length is d = V R(Tk); for Tk <= T2 the corner *is* the polynomial Bezier pair with this d,
parameter included (docs/papers.md B1). Corners of neighbouring joints stay apart iff d_i + d_{i+1} <= L,
which implies paper 000's condition Tk_i + Tk_{i+1} <= Tv + Td because R(Tk) >= Tk - Td/2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.blend import Shape
from planner.machine import Machine


@dataclass(frozen=True, kw_only=True)
class FirCorner:
    """Paper 000's corner for filters T1 >= T2 [s]; V is the joint's programmed feed, at most `feed_max`
    [mm/s].

    Raises InputError unless all are positive and finite and T2 <= T1.
    """

    T1: float
    T2: float
    feed_max: float

    name = "fir"
    shape = Shape.FIR

    def __post_init__(self) -> None:
        for name in ("T1", "T2", "feed_max"):
            value = getattr(self, name)
            if not 0 < value < np.inf:
                raise InputError(f"FIR corner: {name} = {value}; it must be positive and finite")
        if self.T2 > self.T1:
            raise InputError(
                f"FIR corner: T2 = {self.T2} s is longer than T1 = {self.T1} s; give the longer one as T1"
            )

    @classmethod
    def from_machine(cls, machine: Machine, axes: tuple[str, ...]) -> FirCorner:
        """T1 = V/a, T2 = a/j of the slowest axis (paper 001 par. 19), swapped where V < a^2/j."""
        v, a, j = (machine.limits(q, axes).min() for q in ("velocity", "acceleration", "jerk"))
        feed = float(v if machine.feed_max is None else min(v, machine.feed_max))
        times = sorted((feed / a, a / j))
        return cls(T1=times[1], T2=times[0], feed_max=feed)

    def at(self, change: FloatArray) -> FirCorner:
        """The same filters at all n corners, whatever the `change` (n, A) of direction there."""
        return self

    def middle(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) middle values m = V R(Tk/2) [mm] for d = V R(Tk) = `reach` (n,) [mm] at `feed` (n,) [mm/s]."""
        V = np.minimum(feed, self.feed_max)
        return V * self.ramp(self.overlap_from_ramp(reach / V) / 2)

    def reach(self, middle: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) tangent lengths d [mm] for middle values m (n,) [mm] at programmed feeds `feed` (n,) [mm/s].

        At most V Td/2, where the overlap is complete.
        """
        V = np.minimum(feed, self.feed_max)
        return V * self.ramp(np.minimum(2.0 * self.overlap_from_ramp(middle / V), self.T1 + self.T2))

    def params(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n, 4) parameters V [mm/s], T1, T2, Tk [s] for d = `reach` (n,) [mm] at `feed` (n,) [mm/s]."""
        V = np.minimum(feed, self.feed_max)
        rows = np.empty((len(reach), 4))
        rows[:, 0], rows[:, 1], rows[:, 2] = V, self.T1, self.T2
        rows[:, 3] = self.overlap_from_ramp(reach / V)
        return rows

    def breaks(self, params: FloatArray) -> tuple[float, ...]:
        """`fir_breaks` of a corner with these `params` (4,)."""
        return fir_breaks(params)

    def ramp(self, t: FloatArray) -> FloatArray:
        """Ramp response R [s] at times t (n,) in [0, Td] [s]."""
        T1, T2 = self.T1, self.T2
        early = t**3 / (6 * T1 * T2)
        middle = (3 * t**2 - 3 * T2 * t + T2**2) / (6 * T1)
        late = t - (T1 + T2) / 2 + (T1 + T2 - t) ** 3 / (6 * T1 * T2)
        return np.where(t <= T2, early, np.where(t <= T1, middle, late))

    def overlap_from_ramp(self, value: FloatArray) -> FloatArray:
        """(n,) times t in [0, Td] with R(t) = `value` (n,) [s]; Td for values above R(Td) = Td/2."""
        T1, T2 = self.T1, self.T2
        early = np.cbrt(6 * T1 * T2 * value)
        middle = T2 / 2 + np.sqrt(np.maximum(2 * T1 * value - T2**2 / 12, 0.0))
        t = np.where(value <= T2**2 / (6 * T1), early, middle)
        late = t > T1
        if late.any():
            t = np.where(late, self._late_overlap(np.broadcast_to(value, t.shape)), t)
        return t

    def _late_overlap(self, value: FloatArray) -> FloatArray:
        """The last branch, by Newton on the convex R from the right: t - Td/2 + (Td-t)^3/(6 T1 T2)."""
        T1, T2 = self.T1, self.T2
        delay = T1 + T2
        t = np.full(value.shape, delay)
        for _ in range(60):  # monotone and quadratic; a handful of steps in practice
            rest = delay - t
            step = (t - delay / 2 + rest**3 / (6 * T1 * T2) - value) / (1.0 - rest**2 / (2 * T1 * T2))
            t = np.clip(t - step, T1, delay)
            if np.abs(step).max(initial=0.0) <= 1e-15 * delay:
                break
        return np.where(value >= delay / 2, delay, t)


def fir_breaks(params: FloatArray) -> tuple[float, ...]:
    """Parameters w where two polynomials of a corner meet: T2, T1, Tk - T2, Tk - T1 over Tk, and the middle.

    params : (4,) V [mm/s], T1, T2, Tk [s]
    """
    _, T1, T2, Tk = params
    return tuple(sorted({0.5} | {float(t / Tk) for t in (T2, T1, Tk - T2, Tk - T1) if 0 < t < Tk}))


def overlap_time(
    eps: FloatArray, V: FloatArray, sin_half: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """(n,) overlap time Tk [s] of paper 000 eq. (15) for a corner error: branch chosen on eps, clamped to Td.

    eps      : (n,) [mm]
    V        : (n,) speed of the pulses [mm/s]
    sin_half : (n,) sine of half the turning angle [-]
    T1, T2   : (n,) filters [s]
    """
    with np.errstate(divide="ignore"):
        over = np.asarray(eps) / (V * np.asarray(sin_half))  # infinite without a turn
    cubic = np.cbrt(24 * T1 * T2 * over)
    square = T2 + np.sqrt(np.maximum(4 * T1 * over - T2**2 / 3, 0.0))
    most = (3 * T1**2 + T2**2) / (12 * T1)
    return np.where(over >= most, T1 + T2, np.where(over <= T2**2 / (3 * T1), cubic, square))
