"""The interior-point step behind `JerkLimited` (jerk.py), in numba: linearise, factorise, step. All in scaled units.

Unknowns of a window with N intervals: z_i = (x_i, u_i), feed^2 and acceleration along the path at the N+1 points (both ends
given), and p_i = u_{i+1} - u_i on the intervals. The jerk is constant on an interval, so the kinematics are exact cubics: with
vm = (v_i + v_{i+1})/2, v = sqrt(x),

    ds = vm h - p h^2/12                    =>  h = 2 ds / (vm + sqrt(vm^2 - p ds/3))           duration
    x_{i+1} = x_i + (2u + p) ds + p (2u + p) h^2/12,   u_{i+1} = u_i + p                           dynamics
    jerk j = p/h

In (x, u, p) this is linear but for the last term, which is why these coordinates are used: the second-order limits are linear,
the time is convex, and only the jerk rows and that term are curved. Inequalities are scaled to -1 <= g <= 1:

    r'_k u + r''_k x                                      / a_k        acceleration at point i (also left of it, where r'' jumps)
    r'_k j + v (3 r''_k u + r'''_k x)                     / j_k        jerk at both ends of the interval
    x_i / x_max,  ((v_i + v_{i+1})/2 - p h/8)^2 / x_max               feed at the point and mid-interval (g <= 1 only)

Each row has a slack s and a multiplier lam. Eliminating their Newton steps adds lam/s times the row's square to the Hessian; what
remains is a linear-quadratic control problem with two states and one control, solved by a Riccati recursion. The last two
controls are fixed by the two conditions at the end. The Hessian of the objective is the convex (3/4) ds x^(-5/2) of the integral
of x^(-1/2); curvature of rows and dynamics is left out: the optimum is bang-bang, so that the active rows determine it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planner.arrays import FloatArray

HESSIAN_MIN = 1e-12  # keeps the reduced Hessian positive where no row is near; far below any row's weight [-]
STEP_TO_BOUNDARY = 0.995  # share of the way to the nearest bound that a step may take [-]
DOMAIN = 0.95  # share of the kinematics' domain that the first and last interval may use [-]
FEED_SQ_SHRINK = 0.9  # largest share of x that one step may take away [-]


class Grid(NamedTuple):
    """A window's grid in scaled units: N intervals, N+1 points, A axes."""

    ds: FloatArray  # (N,)
    x_max: FloatArray  # (N+1,)
    d1: FloatArray  # (N+1, A), like the next five
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    acceleration: FloatArray


@njit(cache=True, error_model="numpy")
def duration(v0, v1, p, ds):
    """Time on an interval of length ds with end speeds v0, v1 and a change p of the acceleration."""
    vm = 0.5 * (v0 + v1)
    return 2.0 * ds / (vm + np.sqrt(max(vm * vm - p * ds / 3.0, 0.0)))


@njit(cache=True, error_model="numpy")
def _put(rows, values, i, r, cx, cu, cp, value, scale):
    rows[i, r, 0], rows[i, r, 1], rows[i, r, 2] = cx * scale, cu * scale, cp * scale
    values[i, r] = value * scale


@njit(cache=True, error_model="numpy")
def linearise(grid, jerk_max, x, u, p, h, dynamics, gradient, rows, values, jumps):
    """Linearise everything at (x, u, p).

    grid     : a `Grid`
    h        : (N,) out, durations
    dynamics : (N, 4) out: dx_{i+1} = D0 dx + D1 du + D2 dp + D3
    gradient : (N, 3) out, of the total time with respect to (x, u, p)_i
    rows, values : (N, R, 3), (N, R) out, gradients and values of the rows, the dynamics' defect included

    Returns the total time and the largest defect of the dynamics, as a speed.
    """
    ds, x_max, d1, d2_left, d2_right, d3_left, d3_right, acceleration = grid
    n, axes = len(h), len(jerk_max)
    total, worst = 0.0, 0.0
    for i in range(n):
        step, last = ds[i], i == n - 1
        v0, v1 = np.sqrt(x[i]), np.sqrt(x[i + 1])
        t = duration(v0, v1, p[i], step)
        h[i] = t
        total += t
        # dh = h_v (dv0 + dv1)/2 + h_p dp, from vm h - p h^2/12 = ds
        slope = max(0.5 * (v0 + v1) - p[i] * t / 6.0, 1e-3 * (v0 + v1))
        h_v, h_p = -t / slope, t * t / (12.0 * slope)
        q = p[i] * (2.0 * u[i] + p[i])
        bend = q * t / 6.0
        left = h_v / (4.0 * v0) if v0 > 0.0 else 0.0  # dh/dx_i
        right = h_v / (4.0 * v1) if v1 > 0.0 and not last else 0.0
        e0, e1 = 1.0 + bend * left, 2.0 * step + p[i] * t * t / 6.0
        e2 = step + (u[i] + p[i]) * t * t / 6.0 + bend * h_p
        e3 = x[i] + (2.0 * u[i] + p[i]) * step + q * t * t / 12.0 - x[i + 1]
        worst = max(worst, abs(e3) / (v0 + v1))
        if not last:
            f = 1.0 / (1.0 - bend * right)
            e0, e1, e2, e3 = e0 * f, e1 * f, e2 * f, e3 * f
        dynamics[i, 0], dynamics[i, 1], dynamics[i, 2], dynamics[i, 3] = e0, e1, e2, e3
        hx, hu, hp, h0 = left + right * e0, right * e1, h_p + right * e2, right * e3
        gradient[i, 0], gradient[i, 1], gradient[i, 2] = hx, hu, hp

        j, u1 = p[i] / t, u[i] + p[i]
        inner = 1.0 if i > 0 else 0.0  # the first point is given: its own rows have no step to limit
        end = 0.0 if last else 1.0
        r = 0
        for k in range(axes):
            a = 1.0 / acceleration[i, k]
            value = (d1[i, k] * u[i] + d2_right[i, k] * x[i]) * inner
            _put(rows, values, i, r, d2_right[i, k] * inner, d1[i, k] * inner, 0.0, value, a)
            b = 1.0 / jerk_max[k]
            turn = 3.0 * d2_right[i, k] * u[i] + d3_right[i, k] * x[i]
            by_h = -d1[i, k] * j / t
            cx = v0 * d3_right[i, k] + (0.5 * turn / v0 if v0 > 0.0 else 0.0)
            value = d1[i, k] * j + v0 * turn + by_h * h0
            cu = 3.0 * v0 * d2_right[i, k] + by_h * hu
            _put(rows, values, i, r + 1, cx + by_h * hx, cu, d1[i, k] / t + by_h * hp, value, b)
            turn = 3.0 * d2_left[i + 1, k] * u1 + d3_left[i + 1, k] * x[i + 1]
            by_h = -d1[i + 1, k] * j / t
            cx = (v1 * d3_left[i + 1, k] + (0.5 * turn / v1 if v1 > 0.0 else 0.0)) * end
            cu = 3.0 * v1 * d2_left[i + 1, k]
            value = d1[i + 1, k] * j + v1 * turn + by_h * h0 + cx * e3 * end
            cp = d1[i + 1, k] / t + by_h * hp + cx * e2 + cu
            _put(rows, values, i, r + 2, cx * e0 + by_h * hx, cx * e1 + cu + by_h * hu, cp, value, b)
            r += 3
            if jumps:
                a = 1.0 / acceleration[i + 1, k]
                cx, cu = d2_left[i + 1, k] * end, d1[i + 1, k] * end
                value = cu * u1 + cx * (x[i + 1] + e3)
                _put(rows, values, i, r, cx * e0, cx * e1 + cu, cx * e2 + cu, value, a)
                r += 1
        _put(rows, values, i, r, inner, 0.0, 0.0, inner * x[i], 1.0 / x_max[i])
        mean = 0.5 * (v0 + v1)
        m0 = 0.25 / v0 if v0 > 0.0 else 0.0
        m1 = 0.25 / v1 if v1 > 0.0 and not last else 0.0
        if (
            i == 0 or last
        ):  # at rest: stay where the kinematics have a solution, p ds < 3 vm^2; a constant jerk has 8/9 of it
            g = p[i] * step / (3.0 * DOMAIN * mean * mean)
            c = -2.0 * g / mean
            cp = step / (3.0 * DOMAIN * mean * mean)
            _put(
                rows,
                values,
                i,
                r + 1,
                c * (m0 + m1 * e0),
                c * m1 * e1,
                cp + c * m1 * e2,
                g + c * m1 * e3,
                1.0,
            )
            continue
        middle = mean - 0.125 * p[i] * t
        m = 2.0 * middle / (0.5 * (x_max[i] + x_max[i + 1]))
        c = -0.125 * p[i]
        cx, cu, cp = m0 + m1 * e0 + c * hx, m1 * e1 + c * hu, m1 * e2 + c * hp - 0.125 * t
        _put(rows, values, i, r + 1, cx, cu, cp, 0.5 * middle + m1 * e3 + c * h0, m)
    return total, worst


@njit(cache=True, error_model="numpy")
def weigh(ds, x, slack, lam, mu, gradient, rows, values, one_sided, hessian):
    """Hessian (N, 6) = (xx, xu, xp, uu, up, pp) and gradient (N, 3) with the rows' barriers; returns the largest residual."""
    n, count = values.shape
    worst = 0.0
    for i in range(n):
        curve = 0.0
        if x[i] > 0.0:
            about = ds[i] + (ds[i - 1] if i > 0 else 0.0)
            curve = 0.375 * about / (x[i] * x[i] * np.sqrt(x[i]))
        hxx, hxu, hxp, huu, hup, hpp = curve, 0.0, 0.0, HESSIAN_MIN, 0.0, HESSIAN_MIN
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
        hessian[i, 0], hessian[i, 1], hessian[i, 2] = hxx, hxu, hxp
        hessian[i, 3], hessian[i, 4], hessian[i, 5] = huu, hup, hpp
    return worst


@njit(cache=True, error_model="numpy")
def riccati(dynamics, hessian, gradient, end_u, gains):
    """Feedback dp_i = K0 dx_i + K1 du_i + K2 (N, 3) of the linear-quadratic problem with dx_N = 0 and du_N = end_u.

    Cost to go P (xx, xu, uu) and its gradient g, backward. Returns False if the problem is not convex along the way.
    """
    n = len(dynamics)
    # End: du_{N-1} + dp_{N-1} = end_u, and the x-dynamics of the last interval with dx_N = 0 fix dp_{N-2}.
    a0, a1, a2, a3 = dynamics[n - 1, 0], dynamics[n - 1, 1], dynamics[n - 1, 2], dynamics[n - 1, 3]
    b0, b1, b2, b3 = dynamics[n - 2, 0], dynamics[n - 2, 1], dynamics[n - 2, 2], dynamics[n - 2, 3]
    pivot = a0 * b2 + a1 - a2
    k0, k1, k2 = -a0 * b0 / pivot, -(a0 * b1 + a1 - a2) / pivot, -(a0 * b3 + a2 * end_u + a3) / pivot
    gains[n - 2, 0], gains[n - 2, 1], gains[n - 2, 2] = k0, k1, k2
    gains[n - 1, 0], gains[n - 1, 1], gains[n - 1, 2] = 0.0, -1.0, end_u
    hs, gs = hessian[n - 1], gradient[n - 1]
    pxx, pxu, puu = hs[0], hs[1] - hs[2], hs[3] - 2.0 * hs[4] + hs[5]
    gx, gu = gs[0] + hs[2] * end_u, gs[1] - gs[2] + (hs[4] - hs[5]) * end_u
    hs, gs = hessian[n - 2], gradient[n - 2]
    x0, x1, x2 = b0 + b2 * k0, b1 + b2 * k1, b3 + b2 * k2  # dx_{N-1} of (dx, du, 1)
    u0, u1, u2 = k0, 1.0 + k1, k2
    sx, su = pxx * x2 + pxu * u2 + gx, pxu * x2 + puu * u2 + gu
    nxx = pxx * x0 * x0 + 2.0 * pxu * x0 * u0 + puu * u0 * u0 + hs[0] + 2.0 * hs[2] * k0 + hs[5] * k0 * k0
    nxu = (
        pxx * x0 * x1
        + pxu * (x0 * u1 + x1 * u0)
        + puu * u0 * u1
        + hs[1]
        + hs[2] * k1
        + hs[4] * k0
        + hs[5] * k0 * k1
    )
    nuu = pxx * x1 * x1 + 2.0 * pxu * x1 * u1 + puu * u1 * u1 + hs[3] + 2.0 * hs[4] * k1 + hs[5] * k1 * k1
    gx = x0 * sx + u0 * su + gs[0] + gs[2] * k0 + hs[2] * k2 + hs[5] * k0 * k2
    gu = x1 * sx + u1 * su + gs[1] + gs[2] * k1 + hs[4] * k2 + hs[5] * k1 * k2
    pxx, pxu, puu = nxx, nxu, nuu
    for i in range(n - 3, -1, -1):
        b0, b1, b2, b3 = dynamics[i, 0], dynamics[i, 1], dynamics[i, 2], dynamics[i, 3]
        hs, gs = hessian[i], gradient[i]
        px, pu = pxx * b2 + pxu, pxu * b2 + puu  # P B, B = (b2, 1)
        curve = hs[5] + b2 * px + pu
        if not curve > 0.0:
            return False
        cx, cu = hs[2] + b0 * px, hs[4] + b1 * px + pu
        sx, su = pxx * b3 + gx, pxu * b3 + gu
        push = gs[2] + b2 * sx + su
        gains[i, 0], gains[i, 1], gains[i, 2] = -cx / curve, -cu / curve, -push / curve
        nxx = hs[0] + b0 * b0 * pxx - cx * cx / curve
        nxu = hs[1] + b0 * (pxx * b1 + pxu) - cx * cu / curve
        nuu = hs[3] + b1 * (pxx * b1 + pxu) + pxu * b1 + puu - cu * cu / curve
        gx, gu = gs[0] + b0 * sx - cx * push / curve, gs[1] + b1 * sx + su - cu * push / curve
        pxx, pxu, puu = nxx, nxu, nuu
    return True


@njit(cache=True, error_model="numpy")
def direction(dynamics, gains, x, rows, values, slack, lam, mu, one_sided, dz, dslack, dlam):
    """Newton step (dx, du, dp) in dz (N+1, 3) and the steps of slacks and multipliers; returns the two step lengths."""
    n, count = values.shape
    primal, dual = 1.0, 1.0
    dz[0, 0] = dz[0, 1] = 0.0
    for i in range(n):
        dx, du = dz[i, 0], dz[i, 1]
        dp = gains[i, 0] * dx + gains[i, 1] * du + gains[i, 2]
        dz[i, 2] = dp
        if i < n - 1:
            step = dynamics[i, 0] * dx + dynamics[i, 1] * du + dynamics[i, 2] * dp + dynamics[i, 3]
            dz[i + 1, 0], dz[i + 1, 1] = step, du + dp
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
    return primal, dual


@njit(cache=True, error_model="numpy")
def advance(x, u, p, slack, lam, dz, dslack, dlam, primal, dual, one_sided):
    """Take the step; returns the complementarity sum(slack * lam)."""
    n, count, _ = slack.shape
    gap = 0.0
    for i in range(n):
        x[i] += primal * dz[i, 0]
        u[i] += primal * dz[i, 1]
        p[i] += primal * dz[i, 2]
        for r in range(count):
            for side in range(2 if r < one_sided else 1):
                slack[i, r, side] += primal * dslack[i, r, side]
                lam[i, r, side] += dual * dlam[i, r, side]
                gap += slack[i, r, side] * lam[i, r, side]
    return gap


@njit(cache=True, error_model="numpy")
def minimise(
    grid,
    jerk_max,
    x,
    u,
    end_u,
    jumps,
    tol,
    iterations,
    slack_min,
    start_gap,
    residual_max,
    defect_max,
    gap_floor,
):
    """Solve one window in place, from the profile x, u (N+1,) to the optimal one; x_0, u_0, x_N, u_N = end_u are given.

    Returns iterations used, relative gap, residual of rows and of dynamics, p (N,), durations (N,), multipliers (N, R, 2).
    """
    n, axes = len(x) - 1, len(jerk_max)
    count = axes * (4 if jumps else 3) + 2
    one_sided = count - 2
    p, h = np.empty(n), np.empty(n)
    for i in range(n):
        p[i] = u[i + 1] - u[i]
    dynamics, gradient, hessian, gains = (
        np.empty((n, 4)),
        np.empty((n, 3)),
        np.empty((n, 6)),
        np.empty((n, 3)),
    )
    rows, values = np.empty((n, count, 3)), np.empty((n, count))
    slack, lam = np.ones((n, count, 2)), np.ones((n, count, 2))
    dslack, dlam, dz = np.zeros((n, count, 2)), np.zeros((n, count, 2)), np.zeros((n + 1, 3))
    total, _ = linearise(grid, jerk_max, x, u, p, h, dynamics, gradient, rows, values, jumps)
    pairs = n * (2 * one_sided + 2)
    mu = start_gap * total / n
    for i in range(n):
        for r in range(count):
            for side in range(2):
                slack[i, r, side] = max(1.0 - (1.0 - 2.0 * side) * values[i, r], slack_min)
                lam[i, r, side] = mu / slack[i, r, side]
    gap, centering, residual, defect, done = mu * pairs, 0.2, np.inf, np.inf, iterations
    for it in range(iterations):
        total, defect = linearise(grid, jerk_max, x, u, p, h, dynamics, gradient, rows, values, jumps)
        mu = max(centering * gap, gap_floor * tol * total) / pairs
        residual = weigh(grid.ds, x, slack, lam, mu, gradient, rows, values, one_sided, hessian)
        if gap <= tol * total and residual <= residual_max and defect <= defect_max:
            done = it
            break
        if not riccati(dynamics, hessian, gradient, 0.0, gains):
            residual = np.inf
            break
        primal, dual = direction(
            dynamics, gains, x, rows, values, slack, lam, mu, one_sided, dz, dslack, dlam
        )
        gap = advance(x, u, p, slack, lam, dz, dslack, dlam, primal, dual, one_sided)
        shortest = min(primal, dual)
        centering = 0.1 if shortest > 0.9 else (0.3 if shortest > 0.5 else 0.6)
    if done == iterations:  # the last step has not been looked at yet
        total, defect = linearise(grid, jerk_max, x, u, p, h, dynamics, gradient, rows, values, jumps)
    return done, gap / total, residual, defect, p, h, lam
