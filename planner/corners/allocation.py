"""Error allocation: how much of a corner's budget the path may use, and how fast that lets it be taken (paper 002, eq. 18-20).

The budget of one corner is shared by the rounding, the chord error of the interpolation period and, where FIR filters follow,
their error; with X = kappa feed^2 the normal acceleration at the apex (docs/papers.md D, three sources):

    eps_ap + c X <= eps,     c = dt^2/8 + sum_i T_i^2 / 24,     X <= A.

The corner speed sqrt(X eps_ap / K), K = eps_ap kappa_max, grows with X and with eps_ap, so the constraint is tight; X (eps - c X)
is a parabola with its top at eps/(2c), hence

    X* = min(A, eps / (2c)),   eps_ap = eps - c X*                                   (eq. (20); independent of the angle)

and where a short leg keeps the corner from using eps_ap, X = min(A, (eps - eps_ap)/c).

A is what machine and axes allow in the direction of the corner's bisector (corners/budget.py). With it the closed-form speed
is a true upper bound: no motion within the axis limits passes the apex faster, whatever it does along the path.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray


def allocate(tol: FloatArray, acceleration: FloatArray, rate: float) -> FloatArray:
    """How much of the tolerance the rounding may use, eq. (20).

    tol          : (n,) tolerance eps [mm]
    acceleration : (n,) largest normal acceleration A [mm/s2]
    rate         : c, from `error_rate` [s2]

    Returns eps_ap (n,) [mm].
    """
    return tol - rate * np.minimum(acceleration, tol / (2.0 * rate))
