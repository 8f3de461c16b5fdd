"""The kinematic corner of paper 003: geometry and timing at once, within the limits of every axis.

Directions u1, u2 at the vertex P, du = u2 - u1, s = sin(theta/2) = |du|/2, ramp R (docs/papers.md 0).

**Zero entry acceleration** (eq. (1)-(8)). All axes run jerk +j, 0, -j for Tj, Ta, Tj; with T1 = Tj + Ta >= T2
= Tj

    p(t) = P - l u1 + Vc u1 t + Vc du R(t),     t in [0, T1 + T2],     l = Vc (T1 + T2) / 2,     j = Vc du / (T1 T2).

The vertex is missed by eps = 2 s m with the middle value m = Vc R((T1+T2)/2) = Vc (3 T1^2 + T2^2) / (24 T1).
With the axes' limits A_k, J_k, alpha = min_k A_k/|du_k| and eta = min_k J_k/|du_k| (two axes, in general) the
shortest times at a speed Vc are

    T1 = max(Vc/alpha, sqrt(Vc/eta)),     T2 = Vc / (eta T1),

the first where acceleration is reached, Vc >= alpha^2/eta. Solved for Vc, with m* = alpha^3 / (6 eta^2), l* =
alpha^3/eta^2:

    Vc = sqrt(8 alpha m - alpha^4/(3 eta^2))                       m >= m*    (V_gw1)
         (36 eta m^2)^(1/3)                                        m <= m*    (V_gw2)
    Vc = [sqrt(alpha^4/eta^2 + 8 alpha l) - alpha^2/eta] / 2       l >= l*
         (eta l^2)^(1/3)                                           l <= l*

The branch is chosen on the error. The paper's rule min(V_gw1, V_gw2) is wrong: V_gw1 <= V_gw2 always (3x^2 +
1 >= 4x^(3/2)), and V_gw1 is imaginary below m*/4. The curve is the FIR corner with complete overlap and
filters T1, T2 (docs/papers.md F1).

**Entry deceleration** ("the same Vc and Ac"): the corner is entered with the deceleration Ac along u1, left
with the acceleration Ac along u2, and has one phase of jerk Ac (u1 + u2)/Tc. It is the cubic of
docs/papers.md B1 with d = Ac Tc^2 / 6, Vc = Ac Tc / 2 and eps = d s / 4. With a = min_k A_k / max(|u1_k|,
|u2_k|) and J = min_k J_k / |u1_k + u2_k|:

    Ac = min(a, (24 J^2 eps/s)^(1/3)),  Vc = sqrt(6 eps Ac/s)                           for a given error,
    Ac = min(a, sqrt(2 J Vc)),          Vc = min(sqrt(1.5 a d), (4.5 J d^2)^(1/3))      for a given length d.

In both families every limit holds at any lower speed too, and error and length grow with the speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.corners.blend import Shape
from planner.corners.fir import fir_breaks
from planner.machine import Machine

# A smaller change of direction is taken to be this [-]: below rounding, and all ratios stay finite.
CHANGE_MIN = 1e-12


def ratio_min(limits: FloatArray, change: FloatArray) -> FloatArray:
    """(n,) min_k limits_k / |change_k| over the axes, finite where nothing changes.

    limits : (A,) of the axes [mm/s2] or [mm/s3]
    change : (n, A) of direction [-]
    """
    return (limits / np.maximum(np.abs(change), CHANGE_MIN)).min(axis=-1)


# ---- zero entry acceleration


def phase_times(V: FloatArray, alpha: FloatArray, eta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """T1 = Tj + Ta and T2 = Tj (n,) [s] of the fastest corners at the speeds V (n,) > 0 [mm/s].

    alpha, eta : (n,) largest accelerations [mm/s2] and jerks [mm/s3] per unit of direction change
    """
    T1 = np.maximum(V / alpha, np.sqrt(V / eta))
    return T1, np.minimum(V / (eta * T1), T1)  # the same where only jerk limits, but for rounding


def approach(V: FloatArray, alpha: FloatArray, eta: FloatArray) -> FloatArray:
    """(n,) approach length l [mm], from the corner's start to the vertex; V, alpha, eta (n,) as of `phase_times`."""
    T1, T2 = phase_times(V, alpha, eta)
    return V * (T1 + T2) / 2


def middle(V: FloatArray, alpha: FloatArray, eta: FloatArray) -> FloatArray:
    """(n,) middle value m [mm]: the corner misses the vertex by eps = 2 sin(theta/2) m (eq. (3), (6)); V, alpha,
    eta (n,) as of `phase_times`."""
    T1, T2 = phase_times(V, alpha, eta)
    return V * (3 * T1**2 + T2**2) / (24 * T1)


def speed_from_middle(m: FloatArray, alpha: FloatArray, eta: FloatArray) -> FloatArray:
    """(n,) largest speed Vc [mm/s] with the middle value m = eps / (2 sin(theta/2)) (n,) [mm] (eq. (7), (8),
    the branch chosen on m).

    alpha, eta : (n,) as of `phase_times`
    """
    reached = m >= alpha**3 / (6 * eta**2)
    accelerating = np.sqrt(np.maximum(8 * alpha * m - alpha**4 / (3 * eta**2), 0.0))
    return np.where(reached, accelerating, np.cbrt(36 * eta * m**2))


def speed_from_approach(length: FloatArray, alpha: FloatArray, eta: FloatArray) -> FloatArray:
    """(n,) largest speed Vc [mm/s] with the approach length l (n,) [mm]; alpha, eta (n,) as of
    `phase_times`."""
    threshold = alpha**2 / eta
    # [sqrt(x^2 + y) - x]/2 without cancellation
    accelerating = 4 * alpha * length / (threshold + np.sqrt(threshold**2 + 8 * alpha * length))
    return np.where(length >= alpha * threshold / eta, accelerating, np.cbrt(length**2 * eta))


# ---- entry deceleration


def entry_limits(
    u1: FloatArray, u2: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest entry deceleration a (n,) [mm/s2], and largest jerk J per unit of |u1 + u2| (n,) [mm/s3].

    u1, u2             : (n, A) unit directions before and behind each corner
    acceleration, jerk : (A,) limits of the axes [mm/s2], [mm/s3]
    """
    return ratio_min(acceleration, np.maximum(np.abs(u1), np.abs(u2))), ratio_min(jerk, u1 + u2)


def entry_acceleration(V: FloatArray, a: FloatArray, J: FloatArray) -> FloatArray:
    """(n,) entry deceleration Ac [mm/s2] of the shortest corner at the speeds V (n,) [mm/s]; a, J (n,) from
    `entry_limits`."""
    return np.minimum(a, np.sqrt(2 * J * V))


def entry_speed_from_middle(m: FloatArray, a: FloatArray, J: FloatArray) -> FloatArray:
    """(n,) largest speed Vc [mm/s] with the middle value m = d/8 = eps / (2 sin(theta/2)) (n,) [mm]; a, J
    (n,) from `entry_limits`."""
    return entry_speed_from_length(8 * m, a, J)


def entry_speed_from_length(d: FloatArray, a: FloatArray, J: FloatArray) -> FloatArray:
    """(n,) largest speed Vc [mm/s] with the tangent length d (n,) [mm]; a, J (n,) from `entry_limits`."""
    return np.minimum(np.sqrt(1.5 * a * d), np.cbrt(4.5 * J * d**2))


# ---- as geometry alone


@dataclass(frozen=True, eq=False, kw_only=True)
class KinematicFamily:
    """The corners with zero entry acceleration at n given joints.

    alpha, eta : (n,) as of `phase_times`
    """

    alpha: FloatArray
    eta: FloatArray

    def middle(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) middle values m [mm] for approach lengths l = `reach` (n,) [mm], at any feed (n,)."""
        return middle(speed_from_approach(reach, self.alpha, self.eta), self.alpha, self.eta)

    def reach(self, middle: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) approach lengths l [mm] for middle values m (n,) [mm], at any feed (n,)."""
        return approach(speed_from_middle(middle, self.alpha, self.eta), self.alpha, self.eta)

    def params(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n, 4) parameters of the FIR shape with complete overlap, V [mm/s], T1, T2, T1 + T2 [s], for
        approach lengths `reach` (n,) [mm], at any feed (n,)."""
        V = speed_from_approach(reach, self.alpha, self.eta)
        T1, T2 = phase_times(V, self.alpha, self.eta)
        return np.stack([V, T1, T2, T1 + T2], axis=1)


@dataclass(frozen=True, eq=False, kw_only=True)
class KinematicCorner:
    """Paper 003's corner (zero entry acceleration) as a shape for methods that choose the speed themselves.

    acceleration, jerk : (A,) limits of the axes [mm/s2], [mm/s3]; they decide the ratio T2/T1 of every corner
    """

    acceleration: FloatArray
    jerk: FloatArray

    name = "kinematic"
    shape = Shape.FIR

    @classmethod
    def from_machine(cls, machine: Machine, axes: tuple[str, ...]) -> KinematicCorner:
        """The shape for the machine's limits of `axes`. Raises InputError for an axis that it lacks."""
        return cls(acceleration=machine.limits("acceleration", axes), jerk=machine.limits("jerk", axes))

    def at(self, change: FloatArray) -> KinematicFamily:
        """The corners at n joints where the directions of the axes change by `change` (n, A) [-]."""
        return KinematicFamily(alpha=ratio_min(self.acceleration, change), eta=ratio_min(self.jerk, change))

    def breaks(self, params: FloatArray) -> tuple[float, ...]:
        """`fir_breaks` of a corner with these `params` (4,)."""
        return fir_breaks(params)
