"""The interior-point step behind `JerkLimited` (jerk.py), in numba: weigh, factorise, step. All in scaled units.

Each row of jerk_rows.py has slacks s and multipliers lam. Eliminating their Newton steps adds lam/s times the row's square to the
Hessian; what remains is the linear-quadratic problem of jerk_riccati.py. The Hessian is that of the Lagrangian; where it is not
convex, the curvature of rows and dynamics counts less, or not at all. Steps are predictor-corrector (Mehrotra 1992): the step
without a barrier says how far the barrier may fall, and its second-order terms are made up for.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planner.feedrate.jerk_riccati import offsets, riccati, slope
from planner.feedrate.jerk_rows import empty_model, kinematics, linearise

HESSIAN_MIN = 1e-12  # keeps the reduced Hessian positive where no row is near; far below any row's weight [-]
SLACK_MIN = 1e-2  # of the first slacks [-]
START_GAP = 0.1  # complementarity of the start, share of the time per row
RESIDUAL = 1e-6  # of the rows at the end, share of the limits [-]
DEFECT = 1e-9  # of the kinematics at the end, share of the largest feed [-]
GAP_FLOOR = 0.1  # the barrier stays above this share of the gap asked for [-]
STEP_TO_BOUNDARY = 0.995  # share of the way to the nearest bound that a step may take [-]
DOMAIN_EDGE = 0.98  # share of the kinematics' domain that a step may reach; the rows ask for less [-]
STEP_MIN = 1e-3  # shorter steps are not shortened any further [-]
PREDICTED_MIN = 0.1  # a shorter predictor step says nothing about second-order terms [-]
SIGMA_MAX = 0.9  # the barrier falls by at least this factor ... [-]
CHANGE_MAX = 0.4  # while some x changes by more than this share, the barrier stays; far from the solution it must not fall first [-]
SHARE_MIN = 0.05  # a smaller share of the curvature is none [-]
FEED_SQ_SHRINK = 0.9  # largest share of x that one step may take away [-]


@njit(cache=True, error_model="numpy")
def weigh(model, slack, lam, mu, one_sided):
    """Add the rows' barriers to the model's convex Hessian and gradient; returns the largest residual of the rows."""
    gradient, rows, values, hessian = model.gradient, model.rows, model.values, model.convex
    n, count = values.shape
    worst = 0.0
    for i in range(n):
        hxx, hxu, hxp, huu, hup, hpp = 0.0, 0.0, 0.0, HESSIAN_MIN, 0.0, HESSIAN_MIN
        for r in range(count):
            g = values[i, r]
            residual = g + slack[i, r, 0] - 1.0
            w = lam[i, r, 0] / slack[i, r, 0]
            push = mu / slack[i, r, 0] + w * residual
            worst = max(worst, abs(residual))
            if r < one_sided:
                residual = slack[i, r, 1] - g - 1.0
                w1 = lam[i, r, 1] / slack[i, r, 1]
                push -= mu / slack[i, r, 1] + w1 * residual
                worst = max(worst, abs(residual))
                w += w1
            a, b, c = rows[i, r, 0], rows[i, r, 1], rows[i, r, 2]
            hxx += w * a * a
            hxu += w * a * b
            hxp += w * a * c
            huu += w * b * b
            hup += w * b * c
            hpp += w * c * c
            gradient[i, 0] += push * a
            gradient[i, 1] += push * b
            gradient[i, 2] += push * c
        hessian[i, 0] += hxx
        hessian[i, 1] += hxu
        hessian[i, 2] += hxp
        hessian[i, 3] += huu
        hessian[i, 4] += hup
        hessian[i, 5] += hpp
    return worst


@njit(cache=True, error_model="numpy")
def correct(model, slack, lam, mu, bending, one_sided, dslack, dlam):
    """Second half of a predictor-corrector step: with the predicted steps of slacks and multipliers (overwritten by their
    products, the targets' second-order terms) add the barrier mu to the gradient."""
    gradient, rows = model.gradient, model.rows
    n, count, _ = slack.shape
    for i in range(n):
        for r in range(count):
            push = 0.0
            for side in range(2 if r < one_sided else 1):
                bent = bending * dslack[i, r, side] * dlam[i, r, side]
                dlam[i, r, side] = bent
                push += (1.0 - 2.0 * side) * (mu - bent) / slack[i, r, side]
            gradient[i, 0] += push * rows[i, r, 0]
            gradient[i, 1] += push * rows[i, r, 1]
            gradient[i, 2] += push * rows[i, r, 2]


@njit(cache=True, error_model="numpy")
def complementarity(slack, lam, dslack, dlam, primal, dual, one_sided):
    """Sum of slack times multiplier after a step."""
    n, count, _ = slack.shape
    gap = 0.0
    for i in range(n):
        for r in range(count):
            for side in range(2 if r < one_sided else 1):
                gap += (slack[i, r, side] + primal * dslack[i, r, side]) * (
                    lam[i, r, side] + dual * dlam[i, r, side]
                )
    return gap


@njit(cache=True, error_model="numpy")
def direction(model, share, gains, x, slack, lam, pi, mu, one_sided, dz, dslack, dlam, dpi):
    """Newton step (dx, du, dp) in dz (N+1, 3), of slacks, multipliers and costates; returns the two step lengths."""
    dynamics, rows, values, costate = model.dynamics, model.rows, model.values, model.costate
    n, count = values.shape
    primal, dual = 1.0, 1.0
    dz[0, 0] = dz[0, 1] = 0.0
    for i in range(n):
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
            along = rows[i, r, 0] * dx + rows[i, r, 1] * du + rows[i, r, 2] * dp
            for side in range(2 if r < one_sided else 1):
                sign = 1.0 - 2.0 * side
                s, y = slack[i, r, side], lam[i, r, side]
                move = 1.0 - sign * (values[i, r] + along) - s
                push = (mu - dlam[i, r, side] - y * move) / s - y
                dslack[i, r, side], dlam[i, r, side] = move, push
                if move < -STEP_TO_BOUNDARY * s:
                    primal = min(primal, -STEP_TO_BOUNDARY * s / move)
                if push < -STEP_TO_BOUNDARY * y:
                    dual = min(dual, -STEP_TO_BOUNDARY * y / push)
    last_x, last_u, last_p = slope(model, share, dz, n - 1)
    _, _, before_p = slope(model, share, dz, n - 2)
    b2 = dynamics[n - 2, 2]
    pivot = dynamics[n - 1, 0] * b2 + dynamics[n - 1, 1] - dynamics[n - 1, 2]
    ahead = -(before_p + last_x * b2 + last_u - last_p) / pivot
    dpi[n - 1] = ahead - pi[n - 1]
    ahead = last_x + ahead * dynamics[n - 1, 0]
    dpi[n - 2] = costate[n - 2, 0] * (ahead + costate[n - 2, 1]) - pi[n - 2]
    return primal, dual


@njit(cache=True, error_model="numpy")
def within_domain(ds, x, p, dz, primal):
    """The step length, reduced until the kinematics of every interval have a solution: p ds < 3 vm^2."""
    n = len(p)
    for i in range(n):
        while True:
            vm = 0.5 * (np.sqrt(x[i] + primal * dz[i, 0]) + np.sqrt(x[i + 1] + primal * dz[i + 1, 0]))
            if (p[i] + primal * dz[i, 2]) * ds[i] <= 3.0 * DOMAIN_EDGE * vm * vm or primal < STEP_MIN:
                break
            primal *= 0.7
    return primal


@njit(cache=True, error_model="numpy")
def advance(x, u, p, slack, lam, pi, dz, dslack, dlam, dpi, primal, dual, one_sided):
    """Take the step; returns the complementarity sum(slack * lam) and the largest relative change of x."""
    n, count, _ = slack.shape
    gap, change = 0.0, 0.0
    for i in range(n):
        if i > 0:
            change = max(change, primal * abs(dz[i, 0]) / x[i])
        x[i] += primal * dz[i, 0]
        u[i] += primal * dz[i, 1]
        p[i] += primal * dz[i, 2]
        pi[i] += dual * dpi[i]
        for r in range(count):
            for side in range(2 if r < one_sided else 1):
                slack[i, r, side] += primal * dslack[i, r, side]
                lam[i, r, side] += dual * dlam[i, r, side]
                gap += slack[i, r, side] * lam[i, r, side]
    return gap, change


@njit(cache=True, error_model="numpy")
def track(grid, jerk, asked, x, u, p, rounds, change_max):
    """Move a motion x, u (N+1,), p (N,) towards the feed^2 asked for: Gauss-Newton on the time integral of (dx/x)^2 J + j^2/J,
    with the jerk j of the result and a jerk J of the machine's size. Both ends stay. Returns the defect that is left."""
    n = len(p)
    ds, lam, pi = grid.ds, np.zeros((n, 0, 2)), np.zeros(n)
    model, gains, dz, dpi = empty_model(n, 0), np.empty((n, 8)), np.zeros((n + 1, 3)), np.zeros(n)
    worst, change = np.inf, 1e300  # a first round always
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
            model.gradient[i, 0], model.gradient[i, 2] = weight * (x[i] - asked[i]), p[i] / span
        if (worst <= DEFECT and change <= change_max) or not riccati(model, 0.0, gains):
            break
        offsets(model, 0.0, gains)
        primal, _ = direction(model, 0.0, gains, x, lam, lam, pi, 0.0, 0, dz, lam, lam, dpi)
        primal = within_domain(ds, x, p, dz, primal)
        change = 0.0
        for i in range(n):
            if i > 0:
                change = max(change, abs(dz[i, 0]) / x[i])
            x[i] += primal * dz[i, 0]
            u[i] += primal * dz[i, 1]
            p[i] += primal * dz[i, 2]
    return worst


@njit(cache=True, error_model="numpy")
def minimise(grid, jerk_max, x, u, p, jumps, tol, iterations):
    """Solve one window in place, from the profile x, u (N+1,), p (N,) to the optimal one; x_0, u_0, x_N = u_N = 0 are given.

    Returns iterations used, relative gap, residual of rows and of dynamics, durations (N,), multipliers (N, R, 2).
    """
    n, axes = len(x) - 1, len(jerk_max)
    one_sided = axes * (3 + jumps)
    count = one_sided + 2
    h, pi, dpi = np.empty(n), np.zeros(n), np.zeros(n)
    model = empty_model(n, count)
    gains, dz = np.empty((n, 8)), np.zeros((n + 1, 3))
    slack, lam = np.ones((n, count, 2)), np.zeros((n, count, 2))
    dslack, dlam = np.zeros((n, count, 2)), np.zeros((n, count, 2))
    total, _ = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
    pairs = n * (one_sided + count)
    mu = START_GAP * total / n
    for i in range(n):
        for r in range(count):
            for side in range(2):
                slack[i, r, side] = max(1.0 - (1.0 - 2.0 * side) * model.values[i, r], SLACK_MIN)
                lam[i, r, side] = mu / slack[i, r, side]
    share = 1.0
    gap, hold, residual, defect, done = mu * pairs, 0.0, np.inf, np.inf, iterations
    for it in range(iterations):
        total, defect = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
        residual = weigh(model, slack, lam, 0.0, one_sided)
        if gap <= tol * total and residual <= RESIDUAL and defect <= DEFECT:
            done = it
            break
        share = min(4.0 * share, 1.0)
        while not riccati(model, share, gains):
            if share == 0.0:
                return it, gap / total, np.inf, np.inf, h, lam
            share = 0.25 * share if share > SHARE_MIN else 0.0
        offsets(model, share, gains)
        dlam[:] = 0.0
        primal, dual = direction(
            model, share, gains, x, slack, lam, pi, 0.0, one_sided, dz, dslack, dlam, dpi
        )
        left = complementarity(slack, lam, dslack, dlam, primal, dual, one_sided) / gap
        mu = (
            max(
                hold * gap if hold > 0.0 else min(left * left * left, SIGMA_MAX) * gap,
                GAP_FLOOR * tol * total,
            )
            / pairs
        )
        bending = 1.0 if min(primal, dual) > PREDICTED_MIN else 0.0
        correct(model, slack, lam, mu, bending, one_sided, dslack, dlam)
        offsets(model, share, gains)
        primal, dual = direction(model, share, gains, x, slack, lam, pi, mu, one_sided, dz, dslack, dlam, dpi)
        primal = within_domain(grid.ds, x, p, dz, primal)
        gap, change = advance(x, u, p, slack, lam, pi, dz, dslack, dlam, dpi, primal, dual, one_sided)
        hold = 1.0 if change > CHANGE_MAX else 0.0
    if done == iterations:  # the last step has not been looked at yet
        total, defect = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
    return done, gap / total, residual, defect, h, lam
