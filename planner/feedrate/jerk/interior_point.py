"""The interior-point step behind `JerkLimited` (solver.py), in numba: weigh, factorise, step. All in scaled units.

Each row of rows.py has slacks s and multipliers lam. Eliminating their Newton steps adds lam/s times the row's square to the
Hessian; what remains is the linear-quadratic problem of riccati.py. The Hessian is that of the Lagrangian; where it is not
convex, the curvature of rows and dynamics counts less, or not at all. Steps are predictor-corrector (Mehrotra 1992): the step
without a barrier says how far the barrier may fall, and its second-order terms are made up for.

The barrier counts by time: an interval's rows share mu times its duration h, as if the barrier were integrated along the motion. So a
ramp of a nanometre beside millimetres at constant speed has no more than its part in it, and finer grids do not change the problem.
"""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.riccati import offsets, riccati, slope
from planner.feedrate.jerk.rows import empty_model, kinematics, linearise

HESSIAN_MIN = 1e-12  # keeps the reduced Hessian positive where no row is near; far below any row's weight [-]
SLACK_MIN = 0.3  # of the first slacks [-]; smaller ones block the way of a start that violates other rows
START_GAP = 0.3  # the first barrier: complementarity of every row per time [-]
RESIDUAL = 1e-6  # of the rows at the end, share of the limits [-]
DEFECT = 1e-9  # of the kinematics at the end, share of the largest feed [-]
GAP_FLOOR = 0.1  # the barrier stays above this share of the gap asked for [-]
STEP_TO_BOUNDARY = 0.995  # share of the way to the nearest bound that a step may take [-]
DOMAIN_EDGE = 0.98  # share of the kinematics' domain that a step may reach; the rows ask for less [-]
STEP_MIN = 1e-3  # shorter steps are not shortened any further [-]
PREDICTED_MIN = 0.1  # a shorter predictor step says nothing about second-order terms [-]
SIGMA_MAX = 0.9  # the barrier falls by at least this factor ... [-]
STALL_STEP = 0.01  # steps shorter than this ...
STALL_ROUNDS = 10  # ... so often in a row lead nowhere
CHANGE_MAX = 0.4  # while some x changes by more than this share, the barrier stays; far from the solution it must not fall first [-]
SHARE_MIN = 0.05  # a smaller share of the curvature is none [-]
FEED_SQ_SHRINK = 0.9  # largest share of x that one step may take away [-]


@njit(cache=True, error_model="numpy", fastmath=True)
def weigh(model, slack, lam):
    """Add the rows' weights to the model's convex Hessian and gradient, without a barrier; returns their largest residual."""
    gradient, rows, values, hessian = model.gradient, model.rows, model.values, model.convex
    n, count = values.shape
    lower = slack.shape[1] - count
    weights, pushes = np.empty(count), np.empty(count)
    worst = 0.0
    for i in range(n):
        for r in range(count):
            residual = values[i, r] + slack[i, r] - 1.0
            weights[r] = lam[i, r] / slack[i, r]
            pushes[r] = weights[r] * residual
            worst = max(worst, abs(residual))
        for r in range(lower):
            residual = slack[i, count + r] - values[i, r] - 1.0
            w = lam[i, count + r] / slack[i, count + r]
            weights[r] += w
            pushes[r] -= w * residual
            worst = max(worst, abs(residual))
        hxx, hxu, hxp, huu, hup, hpp = 0.0, 0.0, 0.0, HESSIAN_MIN, 0.0, HESSIAN_MIN
        gx, gu, gp = 0.0, 0.0, 0.0
        for r in range(count):
            a, b, c, w = rows[i, 0, r], rows[i, 1, r], rows[i, 2, r], weights[r]
            hxx += w * a * a
            hxu += w * a * b
            hxp += w * a * c
            huu += w * b * b
            hup += w * b * c
            hpp += w * c * c
            gx += pushes[r] * a
            gu += pushes[r] * b
            gp += pushes[r] * c
        hessian[i, 0] += hxx
        hessian[i, 1] += hxu
        hessian[i, 2] += hxp
        hessian[i, 3] += huu
        hessian[i, 4] += hup
        hessian[i, 5] += hpp
        gradient[i, 0] += gx
        gradient[i, 1] += gu
        gradient[i, 2] += gp
    return worst


@njit(cache=True, error_model="numpy", fastmath=True)
def correct(model, h, slack, mu, bending, dslack, dlam):
    """Second half of a predictor-corrector step: add the barrier mu h to the gradient, less the predicted steps' second-order terms
    dslack dlam, which replace dlam."""
    gradient, rows = model.gradient, model.rows
    n, _, count = rows.shape
    lower = slack.shape[1] - count
    pushes = np.empty(count)
    for i in range(n):
        asked = mu * h[i]
        for r in range(count):
            bent = bending * dslack[i, r] * dlam[i, r]
            dlam[i, r] = bent
            pushes[r] = (asked - bent) / slack[i, r]
        for r in range(lower):
            bent = bending * dslack[i, count + r] * dlam[i, count + r]
            dlam[i, count + r] = bent
            pushes[r] -= (asked - bent) / slack[i, count + r]
        gx, gu, gp = 0.0, 0.0, 0.0
        for r in range(count):
            gx += pushes[r] * rows[i, 0, r]
            gu += pushes[r] * rows[i, 1, r]
            gp += pushes[r] * rows[i, 2, r]
        gradient[i, 0] += gx
        gradient[i, 1] += gu
        gradient[i, 2] += gp


@njit(cache=True, error_model="numpy", fastmath=True)
def direction(model, h, share, gains, x, slack, lam, pi, mu, dz, dslack, dlam, dpi):
    """Newton step (dx, du, dp) in dz (N+1, 3), of slacks, multipliers and costates.

    dlam : (N, M) in, the second-order terms to make up for; out, the step

    Returns the two step lengths and the complementarity sum(slack * lam) after them.
    """
    dynamics, rows, values, costate = model.dynamics, model.rows, model.values, model.costate
    n, count = values.shape
    lower = slack.shape[1] - count
    after = np.empty(count)
    primal, nearest, nearest_dual = 1.0, 0.0, 0.0
    mixed, mixed_dual, product, now = 0.0, 0.0, 0.0, 0.0
    dz[0, 0] = dz[0, 1] = 0.0
    for i in range(n):
        asked = mu * h[i]
        dx, du = dz[i, 0], dz[i, 1]
        dp = gains[i, 0] * dx + gains[i, 1] * du + gains[i, 2]
        dz[i, 2] = dp
        if i < n - 1:  # the multipliers of the last two intervals come last
            step = dynamics[i, 0] * dx + dynamics[i, 1] * du + dynamics[i, 2] * dp + dynamics[i, 3]
            dz[i + 1, 0], dz[i + 1, 1] = step, du + dp
            ahead = gains[i + 1, 3] * step + gains[i + 1, 4] * (du + dp) + gains[i + 1, 7]
            dpi[i] = costate[i, 0] * (ahead + costate[i, 1]) - pi[i]
            if step < -FEED_SQ_SHRINK * x[i + 1]:
                primal = min(primal, -FEED_SQ_SHRINK * x[i + 1] / step)
        for r in range(count):
            after[r] = values[i, r] + rows[i, 0, r] * dx + rows[i, 1, r] * du + rows[i, 2, r] * dp
        for r in range(count):
            s, y = slack[i, r], lam[i, r]
            move = 1.0 - after[r] - s
            share_s = move / s
            push = (asked - dlam[i, r]) / s - y * (1.0 + share_s)
            dslack[i, r], dlam[i, r] = move, push
            nearest, nearest_dual = min(nearest, share_s), min(nearest_dual, push / y)
            mixed, mixed_dual, product, now = (
                mixed + move * y,
                mixed_dual + s * push,
                product + move * push,
                now + s * y,
            )
        for r in range(lower):
            s, y = slack[i, count + r], lam[i, count + r]
            move = 1.0 + after[r] - s
            share_s = move / s
            push = (asked - dlam[i, count + r]) / s - y * (1.0 + share_s)
            dslack[i, count + r], dlam[i, count + r] = move, push
            nearest, nearest_dual = min(nearest, share_s), min(nearest_dual, push / y)
            mixed, mixed_dual, product, now = (
                mixed + move * y,
                mixed_dual + s * push,
                product + move * push,
                now + s * y,
            )
    if -nearest > STEP_TO_BOUNDARY:
        primal = min(primal, -STEP_TO_BOUNDARY / nearest)
    dual = -STEP_TO_BOUNDARY / nearest_dual if -nearest_dual > STEP_TO_BOUNDARY else 1.0
    last_x, last_u, last_p = slope(model, share, dz, n - 1)
    _, _, before_p = slope(model, share, dz, n - 2)
    b2 = dynamics[n - 2, 2]
    pivot = dynamics[n - 1, 0] * b2 + dynamics[n - 1, 1] - dynamics[n - 1, 2]
    ahead = -(before_p + last_x * b2 + last_u - last_p) / pivot
    dpi[n - 1] = ahead - pi[n - 1]
    ahead = last_x + ahead * dynamics[n - 1, 0]
    dpi[n - 2] = costate[n - 2, 0] * (ahead + costate[n - 2, 1]) - pi[n - 2]
    return primal, dual, now + primal * mixed + dual * mixed_dual + primal * dual * product


@njit(cache=True, error_model="numpy")
def within_domain(ds, x, p, dz, primal):
    """The step length, reduced until the kinematics of every interval have a solution: p ds < 3 vm^2."""
    n = len(p)
    for i in range(n):
        while primal >= STEP_MIN:
            vm = 0.5 * (np.sqrt(x[i] + primal * dz[i, 0]) + np.sqrt(x[i + 1] + primal * dz[i + 1, 0]))
            if (p[i] + primal * dz[i, 2]) * ds[i] <= 3.0 * DOMAIN_EDGE * vm * vm:
                break
            primal *= 0.7
    return primal


@njit(cache=True, error_model="numpy", fastmath=True)
def advance(x, u, p, slack, lam, pi, dz, dslack, dlam, dpi, primal, dual):
    """Take the step; returns the complementarity sum(slack * lam) and the largest relative change of x."""
    n, sides = slack.shape
    gap, change = 0.0, 0.0
    for i in range(n):
        if i > 0:
            change = max(change, primal * abs(dz[i, 0]) / x[i])
        x[i] += primal * dz[i, 0]
        u[i] += primal * dz[i, 1]
        p[i] += primal * dz[i, 2]
        pi[i] += dual * dpi[i]
        for r in range(sides):
            slack[i, r] += primal * dslack[i, r]
            lam[i, r] += dual * dlam[i, r]
            gap += slack[i, r] * lam[i, r]
    return gap, change


@njit(cache=True, error_model="numpy")
def track(grid, jerk, x, u, p, smoothing, rounds, defect_max):
    """Bring a motion x, u (N+1,), p (N,) onto exact kinematics and not far from its x: Gauss-Newton on the time integral of
    (dx/x)^2 J + j^2/J, with the jerk j of the result and a jerk J of the machine's size; without smoothing, j is the change of the
    jerk. Both ends stay. Returns the defect that is left."""
    n, asked = len(p), x.copy()
    ds, lam, pi = grid.ds, np.zeros((n, 0)), np.zeros(n)
    model, gains, dz, dpi = empty_model(n, 0), np.empty((n, 8)), np.zeros((n + 1, 3)), np.zeros(n)
    worst = np.inf
    for _ in range(rounds):
        worst = 0.0
        for i in range(n):
            found = kinematics(x[i], x[i + 1], u[i], p[i], ds[i], i == n - 1)
            worst = max(worst, found[11])
            for k in range(4):
                model.dynamics[i, k] = found[k]
            span = found[4] * jerk
            weight = span / (asked[i] * asked[i]) if i > 0 else 0.0
            model.convex[i, 0], model.convex[i, 5] = weight, 1.0 / span
            model.gradient[i, 0], model.gradient[i, 2] = weight * (x[i] - asked[i]), smoothing * p[i] / span
        if worst <= defect_max or not riccati(model, 0.0, gains):
            break
        offsets(model, 0.0, gains)
        primal, _, _ = direction(model, ds, 0.0, gains, x, lam, lam, pi, 0.0, dz, lam, lam, dpi)
        primal = within_domain(ds, x, p, dz, primal)
        for i in range(n):
            x[i] += primal * dz[i, 0]
            u[i] += primal * dz[i, 1]
            p[i] += primal * dz[i, 2]
    return worst


@njit(cache=True, error_model="numpy")
def minimise(grid, x, u, p, jumps, tol, iterations):
    """Solve one window in place, from the profile x, u (N+1,), p (N,) to the optimal one; x_0, u_0, x_N = u_N = 0 are given.

    Returns iterations used, relative gap, residual of rows and of dynamics, multipliers (N, M) of the
    rows' upper sides, then their lower sides, and (N,) of the dynamics of x.
    """
    n = len(x) - 1
    lower = grid.d1.shape[1] * (3 + jumps)
    count = lower + 2
    h, pi, dpi = np.empty(n), np.zeros(n), np.zeros(n)
    model = empty_model(n, count)
    gains, dz = np.empty((n, 8)), np.zeros((n + 1, 3))
    slack, lam = np.zeros((n, count + lower)), np.zeros((n, count + lower))
    dslack, dlam = np.zeros((n, count + lower)), np.zeros((n, count + lower))
    total, _ = linearise(grid, x, u, p, h, lam, pi, model, jumps)
    mu = START_GAP
    for i in range(n):
        for r in range(count):
            slack[i, r] = max(1.0 - model.values[i, r], SLACK_MIN)
        for r in range(lower):
            slack[i, count + r] = max(1.0 + model.values[i, r], SLACK_MIN)
        for r in range(count + lower):
            lam[i, r] = mu * h[i] / slack[i, r]
    share, stalled = 1.0, 0
    gap, hold, residual, defect, done = mu * total * (count + lower), 0.0, np.inf, np.inf, iterations
    for it in range(iterations):
        total, defect = linearise(grid, x, u, p, h, lam, pi, model, jumps)
        residual = weigh(model, slack, lam)
        if gap <= tol * total and residual <= RESIDUAL and defect <= DEFECT:
            done = it
            break
        share = min(4.0 * share, 1.0)
        while not riccati(model, share, gains):
            if share == 0.0:
                return it, gap / total, np.inf, np.inf, lam, pi
            share = 0.25 * share if share > SHARE_MIN else 0.0
        offsets(model, share, gains)
        dlam[:] = 0.0
        primal, dual, left = direction(model, h, share, gains, x, slack, lam, pi, 0.0, dz, dslack, dlam, dpi)
        sigma = hold if hold > 0.0 else min((left / gap) ** 3, SIGMA_MAX)
        mu = max(sigma * gap / total, GAP_FLOOR * tol) / (count + lower)
        bending = 1.0 if min(primal, dual) > PREDICTED_MIN else 0.0
        correct(model, h, slack, mu, bending, dslack, dlam)
        offsets(model, share, gains)
        primal, dual, _ = direction(model, h, share, gains, x, slack, lam, pi, mu, dz, dslack, dlam, dpi)
        primal = within_domain(grid.ds, x, p, dz, primal)
        gap, change = advance(x, u, p, slack, lam, pi, dz, dslack, dlam, dpi, primal, dual)
        hold = 1.0 if change > CHANGE_MAX else 0.0
        stalled = 0 if primal >= STALL_STEP else stalled + 1
        if stalled == STALL_ROUNDS or not gap < np.inf:
            return it, gap / total, np.inf, np.inf, lam, pi
    if done == iterations:  # the last step has not been looked at yet
        total, defect = linearise(grid, x, u, p, h, lam, pi, model, jumps)
    return done, gap / total, residual, defect, lam, pi
