"""The free optimum inside the tolerance near a motion, by a primal-dual interior-point method with slacks.

    minimise    sum of h + pull sum ((h - guess)/guess)^2
    subject to  the kinematics (recursion.py) and g <= 0 for every row (rows.py), with slacks s

from a motion that need keep neither: gaps and what is missing of g + s = 0 shrink with every step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.tube.recursion import Factor, direction, factorise, forces, gaps
from planner.tube.rows import VECTORS, Legs, Linear, StepLimits, linearise, slopes

LEAST_SLACK = 0.05  # of a start [-]
FIRST_GAP = 0.3  # complementarity of the start, share of the time [-]
TO_BOUNDARY = 0.995  # of the way to the nearest bound that a step may go [-]
MISSED = 1e-6  # by how much a row may be missed at the end [-]: limits are narrowed by more (problem.py)
LOST = 1e3  # complementarity beyond which a search does not come back, share of the time [-]
OFF = 1e-8  # largest gap of the kinematics at the end, in mean steps [-]
ITERATIONS = 100


class Tuning(NamedTuple):
    """Of the search."""

    pull: float  # weight of ((h - guess)/guess)^2 against a mean step's time
    prox: float  # the same of the change in one iteration
    freeze: float  # by which that grows in every iteration when the gap has been reached
    exact: float  # share of the curvature of the kinematics that counts
    iterations: int
    gap: float  # complementarity at the end, share of the time


@njit(cache=True, error_model="numpy")
def _reach(on, s, ds):
    """Share of a step ds (N, R) that keeps s positive, at most 1."""
    most = 0.0
    for i in range(s.shape[0]):
        for r in range(s.shape[1]):
            if on[i, r]:
                most = max(most, -ds[i, r] / s[i, r])
    return min(1.0, TO_BOUNDARY / most) if most > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def solve(legs, limits, x, u, place, tuning):
    """Overwrites x (N+1, 3 A) and u (N, A+1) with the optimum near them. Returns whether it has been reached, iterations, and the log
    (iterations, 8)."""
    N, axes = len(u), u.shape[1] - 1
    R, S, C = limits.on.shape[1], 3 * axes, axes + 1
    on, pull = limits.on, tuning.pull
    lin = Linear(
        np.zeros((N, R)),
        np.zeros((N, R, axes)),
        np.zeros((N, VECTORS, 4)),
        np.zeros((N, VECTORS, axes)),
        np.zeros((N, 3, axes)),
        place,
        np.zeros((N, 3)),
    )
    factor = Factor(np.zeros((N, C, S)), np.zeros((N, C, C)), np.zeros((N + 1, S, S)))
    s, z, missing, second = np.ones((N, R)), np.zeros((N, R)), np.zeros((N, R)), np.zeros((N, R))
    ds, dz, slope, q, ratio = np.zeros((N, R)), np.zeros((N, R)), np.zeros((N, R)), np.zeros((N, R)), np.zeros((N, R))
    gap, w, after, lam = np.zeros((N, S)), np.zeros((N, S + C)), np.zeros((N, S)), np.zeros((N, S))
    dx, du, end = np.zeros((N + 1, S)), np.zeros((N, C)), np.zeros(S)
    log = np.zeros((tuning.iterations, 8))
    linearise(legs, limits, x, u, lin)
    gaps(x, u, gap)
    m = 0
    for i in range(N):
        for r in range(R):
            m += 1 if on[i, r] else 0
    time = u[:, axes].sum()
    first = FIRST_GAP * time / m
    for i in range(N):
        for r in range(R):
            if on[i, r]:
                s[i, r] = max(-lin.g[i, r], LEAST_SLACK)
                z[i, r] = first / s[i, r]
                missing[i, r] = lin.g[i, r] + s[i, r]
    settled, prox = False, tuning.prox
    for iteration in range(tuning.iterations):
        products, missed, off = 0.0, 0.0, 0.0
        for i in range(N):
            for r in range(R):
                if on[i, r]:
                    products += s[i, r] * z[i, r]
                    missed = max(missed, missing[i, r])
                    ratio[i, r] = z[i, r] / s[i, r]
        off = np.abs(gap).max()
        log[iteration, 0], log[iteration, 1], log[iteration, 2] = u[:, axes].sum(), products / time, missed
        log[iteration, 3] = off
        settled = settled or products <= 2.0 * tuning.gap * time
        if settled:
            prox = min(prox * tuning.freeze, 100.0)
        if settled and missed <= MISSED and off <= OFF:
            return True, iteration, log
        if not products <= LOST * time:
            return False, iteration, log
        turned = factorise(x, u, limits, lin, z, ratio, lam, pull + prox, tuning.exact, factor)
        log[iteration, 4] = turned
        if turned < 0:
            return False, iteration, log
        aim, along, dual = 0.0, 1.0, 1.0
        for phase in range(2):
            if phase == 1:
                left = 0.0
                for i in range(N):
                    for r in range(R):
                        if on[i, r]:
                            left += (s[i, r] + along * ds[i, r]) * (z[i, r] + dual * dz[i, r])
                            second[i, r] = ds[i, r] * dz[i, r]
                aim = max((left / products) ** 3 * products, tuning.gap * time) / m
            else:
                second[:] = 0.0
            for i in range(N):
                for r in range(R):
                    if on[i, r]:
                        q[i, r] = (aim - second[i, r] + z[i, r] * missing[i, r]) / s[i, r]
            forces(limits, lin, q, pull, u[:, axes], w)
            direction(x, u, gap, w, end, factor, dx, du, after)
            slopes(limits, lin, dx, du, slope)
            for i in range(N):
                for r in range(R):
                    if on[i, r]:
                        ds[i, r] = -missing[i, r] - slope[i, r]
                        dz[i, r] = (aim - second[i, r] - z[i, r] * ds[i, r]) / s[i, r] - z[i, r]
            along, dual = _reach(on, s, ds), _reach(on, z, dz)
        log[iteration, 5], log[iteration, 6], log[iteration, 7] = along, dual, np.abs(du[:, axes]).max()
        for i in range(N):
            for k in range(S):
                lam[i, k] += along * (after[i, k] - lam[i, k])
                if i > 0:
                    x[i, k] += along * dx[i, k]
            for c in range(C):
                u[i, c] += along * du[i, c]
        end[:] = lam[N - 1]
        linearise(legs, limits, x, u, lin)
        gaps(x, u, gap)
        for i in range(N):
            for r in range(R):
                if on[i, r]:
                    s[i, r] += along * ds[i, r]
                    z[i, r] += dual * dz[i, r]
                    missing[i, r] = lin.g[i, r] + s[i, r]
    return False, tuning.iterations, log
