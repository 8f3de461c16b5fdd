"""The interior-point step behind `JerkLimited` (jerk.py), in numba: weigh, factorise, step. All in scaled units.

Each row of jerk_rows.py has slacks s and multipliers lam. Eliminating their Newton steps adds lam/s times the row's square to the
Hessian; what remains is a linear-quadratic control problem with two states and one control, solved by a Riccati recursion. The
last two controls are fixed by the two conditions at the end. The Hessian is that of the Lagrangian; where it is not convex along
the recursion, the interval's rows and dynamics count as linear.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planner.feedrate.jerk_rows import empty_model, kinematics, linearise

HESSIAN_MIN = 1e-12  # keeps the reduced Hessian positive where no row is near; far below any row's weight [-]
STEP_TO_BOUNDARY = 0.995  # share of the way to the nearest bound that a step may take [-]
DOMAIN_EDGE = 0.98  # share of the kinematics' domain that a step may reach; the rows ask for less [-]
STEP_MIN = 1e-3  # shorter steps are not shortened any further [-]
CHANGE_MAX = 0.4  # while some x changes by more than this share, the barrier stays [-]
SHARE_MIN = 0.05  # a smaller share of the curvature is none [-]
PIVOT_MIN = 1e-6  # of the positive parts: smallest reduced Hessian taken for convex [-]
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
def riccati(model, share, gains):
    """Feedback dp_i = K0 dx_i + K1 du_i + K2 of the linear-quadratic problem with dx_N = du_N = 0.

    share : of the curvature of rows and dynamics that counts [-]
    gains : (N, 6) out, K0 K1 K2 and the cost to go from point i: P_xx, P_xu and its gradient g_x

    Returns False if there is no minimum.
    """
    dynamics, gradient, convex, curved = model.dynamics, model.gradient, model.convex, model.curved
    n = len(dynamics)
    # End: du_{N-1} + dp_{N-1} = 0, and the x-dynamics of the last interval with dx_N = 0 fix dp_{N-2}.
    a0, a1, a2, a3 = dynamics[n - 1, 0], dynamics[n - 1, 1], dynamics[n - 1, 2], dynamics[n - 1, 3]
    b0, b1, b2, b3 = dynamics[n - 2, 0], dynamics[n - 2, 1], dynamics[n - 2, 2], dynamics[n - 2, 3]
    pivot = a0 * b2 + a1 - a2
    k0, k1, k2 = -a0 * b0 / pivot, -(a0 * b1 + a1 - a2) / pivot, -(a0 * b3 + a3) / pivot
    gains[n - 2, 0], gains[n - 2, 1], gains[n - 2, 2] = k0, k1, k2
    gains[n - 1, 0], gains[n - 1, 1], gains[n - 1, 2] = 0.0, -1.0, 0.0
    hs, gs = convex[n - 1] + share * curved[n - 1], gradient[n - 1]
    pxx, pxu, puu = hs[0], hs[1] - hs[2], hs[3] - 2.0 * hs[4] + hs[5]
    gx, gu = gs[0], gs[1] - gs[2]
    gains[n - 1, 3], gains[n - 1, 4], gains[n - 1, 5] = pxx, pxu, gx
    hs, gs = convex[n - 2] + share * curved[n - 2], gradient[n - 2]
    x0, x1, x2 = b0 + b2 * k0, b1 + b2 * k1, b3 + b2 * k2  # dx_{N-1} of (dx, du, 1)
    u0, u1, u2 = k0, 1.0 + k1, k2
    sx, su = pxx * x2 + pxu * u2 + gx, pxu * x2 + puu * u2 + gu
    nxx = pxx * x0 * x0 + 2.0 * pxu * x0 * u0 + puu * u0 * u0 + hs[0] + 2.0 * hs[2] * k0 + hs[5] * k0 * k0
    nxu = pxx * x0 * x1 + pxu * (x0 * u1 + x1 * u0) + puu * u0 * u1
    nxu += hs[1] + hs[2] * k1 + hs[4] * k0 + hs[5] * k0 * k1
    nuu = pxx * x1 * x1 + 2.0 * pxu * x1 * u1 + puu * u1 * u1 + hs[3] + 2.0 * hs[4] * k1 + hs[5] * k1 * k1
    gx = x0 * sx + u0 * su + gs[0] + gs[2] * k0 + hs[2] * k2 + hs[5] * k0 * k2
    gu = x1 * sx + u1 * su + gs[1] + gs[2] * k1 + hs[4] * k2 + hs[5] * k1 * k2
    pxx, pxu, puu = nxx, nxu, nuu
    gains[n - 2, 3], gains[n - 2, 4], gains[n - 2, 5] = pxx, pxu, gx
    for i in range(n - 3, -1, -1):
        b0, b1, b2, b3 = dynamics[i, 0], dynamics[i, 1], dynamics[i, 2], dynamics[i, 3]
        px, pu = pxx * b2 + pxu, pxu * b2 + puu  # P B, B = (b2, 1)
        h0, h1, h2 = (
            convex[i, 0] + share * curved[i, 0],
            convex[i, 1] + share * curved[i, 1],
            convex[i, 2] + share * curved[i, 2],
        )
        h3, h4, h5 = (
            convex[i, 3] + share * curved[i, 3],
            convex[i, 4] + share * curved[i, 4],
            convex[i, 5] + share * curved[i, 5],
        )
        forward = b2 * px + pu
        curve = h5 + forward
        if not curve > PIVOT_MIN * (convex[i, 5] + abs(forward)):
            return False
        gs = gradient[i]
        cx, cu = h2 + b0 * px, h4 + b1 * px + pu
        sx, su = pxx * b3 + gx, pxu * b3 + gu
        push = gs[2] + b2 * sx + su
        gains[i, 0], gains[i, 1], gains[i, 2] = -cx / curve, -cu / curve, -push / curve
        nxx = h0 + b0 * b0 * pxx - cx * cx / curve
        nxu = h1 + b0 * (pxx * b1 + pxu) - cx * cu / curve
        nuu = h3 + b1 * (pxx * b1 + pxu) + pxu * b1 + puu - cu * cu / curve
        gx, gu = gs[0] + b0 * sx - cx * push / curve, gs[1] + b1 * sx + su - cu * push / curve
        pxx, pxu, puu = nxx, nxu, nuu
        gains[i, 3], gains[i, 4], gains[i, 5] = pxx, pxu, gx
    return True


@njit(cache=True, error_model="numpy")
def _slope(model, share, dz, i):
    """Gradient of interval i's part of the quadratic model after the step."""
    h, dx, du, dp = model.convex[i] + share * model.curved[i], dz[i, 0], dz[i, 1], dz[i, 2]
    x = model.gradient[i, 0] + h[0] * dx + h[1] * du + h[2] * dp
    u = model.gradient[i, 1] + h[1] * dx + h[3] * du + h[4] * dp
    p = model.gradient[i, 2] + h[2] * dx + h[4] * du + h[5] * dp
    return x, u, p


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
            ahead = gains[i + 1, 3] * step + gains[i + 1, 4] * (du + dp) + gains[i + 1, 5]
            dpi[i] = costate[i, 0] * (ahead + costate[i, 1]) - pi[i]
            if step < -FEED_SQ_SHRINK * x[i + 1]:
                primal = min(primal, -FEED_SQ_SHRINK * x[i + 1] / step)
        for r in range(count):
            along = rows[i, r, 0] * dx + rows[i, r, 1] * du + rows[i, r, 2] * dp
            for side in range(2 if r < one_sided else 1):
                sign = 1.0 - 2.0 * side
                s, y = slack[i, r, side], lam[i, r, side]
                move = 1.0 - sign * (values[i, r] + along) - s
                push = (mu - y * move) / s - y
                dslack[i, r, side], dlam[i, r, side] = move, push
                if move < -STEP_TO_BOUNDARY * s:
                    primal = min(primal, -STEP_TO_BOUNDARY * s / move)
                if push < -STEP_TO_BOUNDARY * y:
                    dual = min(dual, -STEP_TO_BOUNDARY * y / push)
    last_x, last_u, last_p = _slope(model, share, dz, n - 1)
    _, _, before_p = _slope(model, share, dz, n - 2)
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
def track(grid, jerk, asked, x, u, p, rounds, change_max, defect_max):
    """Move a motion x, u (N+1,), p (N,) towards the feed^2 asked for: Gauss-Newton on the time integral of (dx/x)^2 J + j^2/J,
    with the jerk j of the result and a jerk J of the machine's size. Both ends stay. Returns the defect that is left."""
    n = len(p)
    ds, lam, pi = grid.ds, np.zeros((n, 0, 2)), np.zeros(n)
    model, gains, dz, dpi = empty_model(n, 0), np.empty((n, 6)), np.zeros((n + 1, 3)), np.zeros(n)
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
        if (worst <= defect_max and change <= change_max) or not riccati(model, 0.0, gains):
            break
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
def minimise(
    grid, jerk_max, x, u, p, jumps, tol, iterations, slack_min, start_gap, residual_max, defect_max, gap_floor
):
    """Solve one window in place, from the profile x, u (N+1,), p (N,) to the optimal one; x_0, u_0, x_N = u_N = 0 are given.

    Returns iterations used, relative gap, residual of rows and of dynamics, durations (N,), multipliers (N, R, 2).
    """
    n, axes = len(x) - 1, len(jerk_max)
    one_sided = axes * (3 + jumps)
    count = one_sided + 2
    h, pi, dpi = np.empty(n), np.zeros(n), np.zeros(n)
    model = empty_model(n, count)
    gains, dz = np.empty((n, 6)), np.zeros((n + 1, 3))
    slack, lam = np.ones((n, count, 2)), np.zeros((n, count, 2))
    dslack, dlam = np.zeros((n, count, 2)), np.zeros((n, count, 2))
    total, _ = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
    pairs = n * (one_sided + count)
    mu = start_gap * total / n
    for i in range(n):
        for r in range(count):
            for side in range(2):
                slack[i, r, side] = max(1.0 - (1.0 - 2.0 * side) * model.values[i, r], slack_min)
                lam[i, r, side] = mu / slack[i, r, side]
    share = 1.0
    gap, centering, residual, defect, done = mu * pairs, 0.2, np.inf, np.inf, iterations
    for it in range(iterations):
        total, defect = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
        mu = max(centering * gap, gap_floor * tol * total) / pairs
        residual = weigh(model, slack, lam, mu, one_sided)
        if gap <= tol * total and residual <= residual_max and defect <= defect_max:
            done = it
            break
        share = min(4.0 * share, 1.0)
        while not riccati(model, share, gains):
            if share == 0.0:
                break
            share = 0.25 * share if share > SHARE_MIN else 0.0
        primal, dual = direction(model, share, gains, x, slack, lam, pi, mu, one_sided, dz, dslack, dlam, dpi)
        primal = within_domain(grid.ds, x, p, dz, primal)
        gap, change = advance(x, u, p, slack, lam, pi, dz, dslack, dlam, dpi, primal, dual, one_sided)
        shortest = min(primal, dual)
        centering = 0.1 if shortest > 0.9 else (0.3 if shortest > 0.5 else 0.6)
        if change > CHANGE_MAX:
            centering = 1.0
    if done == iterations:  # the last step has not been looked at yet
        total, defect = linearise(grid, jerk_max, x, u, p, h, lam, pi, model, jumps)
    return done, gap / total, residual, defect, h, lam
