"""FIR filters: moving averages in series, what they make of pulses, how long they should be (paper 000).

A moving average of length T has unit area; n of them in series have the kernel h = m_1 * ... * m_n on [0,
Td], Td = sum T_i. With S = integral of h and R = integral of S (step and ramp response), a pulse of length L
and speed V, Tv = L/V, that starts at t = 0 leaves the filters as the velocity

    V [S(t) - S(t - Tv)]                                                            for every Tv > 0     (eq. 5 holds for Tv >= Td)

All three are piecewise polynomials; with sums T_s of the lengths' subsets s, m = 1, 2, 3 for h, S, R,

    (1 / (T_1 ... T_n)) sum_s (-1)^|s| (t - T_s)_+^(n + m - 2) / (n + m - 2)!

used up to the middle, where little cancels, and mirrored beyond: h(t) = h(Td - t), S(t) + S(Td - t) = 1,
R(t) = t - Td/2 + R(Td - t). Delay of the mean Td/2, variance sum T_i^2 / 12.

In the frequency domain |M(w)| = prod |sin(w T_i / 2) / (w T_i / 2)| (eq. 8, 9: with absolute values, or the
product would be negative where an odd number of factors is). The acceleration of a full move of speed V is V
[delta(t) - delta(t - Tv)] before the filters, a Dirac impulse at each end (eq. 6), of spectrum V |1 - exp(-i
w Tv)| |M(w)| after them.

M is zero at w_r for T = k 2 pi / w_r (eq. 10). A mode with damping ratio z rings at w_d = w_r sqrt(1 - z^2);
what then remains of it is |M| at its pole -z w_r + i w_d, about z for small z.
"""

from dataclasses import dataclass
from itertools import combinations
from math import factorial

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError

# Lengths in periods of a mode are rounded up unless they exceed a multiple by less than this fraction [-].
PERIOD_ROUNDING = 1e-9


@dataclass(frozen=True)
class Filters:
    """Moving averages in series. Raises InputError unless there is one at least, all positive and finite."""

    times: tuple[float, ...]  # their lengths [s]

    def __post_init__(self) -> None:
        if not self.times or not all(0 < T < np.inf for T in self.times):
            raise InputError(
                f"filters of {', '.join(f'{T:g}' for T in self.times) or 'no'} s; give one or more, positive and finite"
            )

    @property
    def delay(self) -> float:
        """Td: how long the output goes on after the input [s]; its mean is delayed by half of it."""
        return sum(self.times)

    @property
    def variance(self) -> float:
        """Variance of the kernel [s2]."""
        return sum(T * T for T in self.times) / 12.0

    def kernel(self, t: FloatArray) -> FloatArray:
        """h(t) (n,) [1/s] at times t (n,) [s]."""
        return self._response(t, 0)

    def step(self, t: FloatArray) -> FloatArray:
        """S(t) (n,), the answer to a unit step [-], at times t (n,) [s]."""
        return self._response(t, 1)

    def ramp(self, t: FloatArray) -> FloatArray:
        """R(t) (n,), the integral of S [s], at times t (n,) [s]."""
        return self._response(t, 2)

    def pulse(self, t: FloatArray, speed: float, duration: float) -> FloatArray:
        """(n,) velocity [mm/s] at times t (n,) [s] of a pulse of that `speed` V [mm/s] that begins at 0 and lasts for
        any `duration` Tv [s] (eq. 5, for Tv < Td too)."""
        t = np.asarray(t, float)
        return speed * (self.step(t) - self.step(t - duration))

    def magnitude(self, w: FloatArray) -> FloatArray:
        """|M| (W,) [-] at frequencies w (W,) [rad/s]: prod |sinc| (eq. 8, 9)."""
        return np.prod([np.abs(np.sinc(np.asarray(w) * T / (2.0 * np.pi))) for T in self.times], axis=0)

    def residue(self, frequency: float, damping: float) -> float:
        """Fraction of its vibration that a mode of `frequency` [Hz] and `damping` keeps [-]."""
        w = 2.0 * np.pi * frequency
        pole = w * (-damping + 1j * np.sqrt(1.0 - damping**2))
        return float(np.prod([np.abs((1.0 - np.exp(-pole * T)) / (pole * T)) for T in self.times]))

    def _response(self, t: FloatArray, integrals: int) -> FloatArray:
        """The kernel, integrated 0, 1 or 2 times, at times t (n,) [s] (module text)."""
        t = np.asarray(t, float)
        early = np.clip(np.minimum(t, self.delay - t), 0.0, None)
        power = len(self.times) + integrals - 1
        total = np.zeros_like(early)
        for size in range(len(self.times) + 1):
            for chosen in combinations(self.times, size):
                reach = early - sum(chosen)
                total += (-1) ** size * np.where(reach >= 0, reach, 0.0) ** power * (reach >= 0)
        total /= factorial(power) * np.prod(self.times)
        inside = (t >= 0) & (t <= self.delay)
        late = t > self.delay / 2
        if integrals == 0:
            return np.where(inside, total, 0.0)
        if integrals == 1:
            return np.where(late, 1.0 - total, total)
        return np.where(late, t - self.delay / 2 + total, total)


def lengths_from_limits(V: FloatArray, A: FloatArray, J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """T1 = V/A and T2 = A/J (S,) [s] (paper 001 par. 19), or both sqrt(V/J) where V is too small to reach A.

    V, A, J : (S,) speed, acceleration and jerk along a line [mm/s, mm/s2, mm/s3]
    """
    T1, T2 = np.asarray(V / A), np.asarray(A / J)
    equal = np.sqrt(T1 * T2)
    return np.where(T1 >= T2, T1, equal), np.where(T1 >= T2, T2, equal)


def suppressing(T1: FloatArray, T2: FloatArray, periods: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """T1 >= T2 (S,) [s] lengthened to multiples of the periods [s] of one or two modes (eq. 10); of one mode one filter.
    Raises ValueError for other numbers of periods."""
    if len(periods) not in (1, 2):
        raise ValueError(f"{len(periods)} periods; two filters suppress one or two modes")
    one, other = periods[0], periods[1] if len(periods) == 2 else None
    a1, a2, b1, b2 = _multiple(T1, one), _multiple(T2, other), _multiple(T1, other), _multiple(T2, one)
    first = a1 + a2 <= b1 + b2
    x, y = np.where(first, a1, b1), np.where(first, a2, b2)
    return np.maximum(x, y), np.minimum(x, y)


def damped_period(frequency: float, damping: float) -> float:
    """Period 2 pi / w_d [s] of a mode's free vibration; `frequency` [Hz] without damping."""
    return 1.0 / (frequency * float(np.sqrt(1.0 - damping**2)))


def _multiple(T: FloatArray, period: float | None) -> FloatArray:
    """T (S,) [s] rounded up to whole periods, one at least; as it is without a period."""
    return (
        T if period is None else np.maximum(np.ceil(np.asarray(T) / period - PERIOD_ROUNDING), 1.0) * period
    )
