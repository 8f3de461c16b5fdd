"""The linear-quadratic problem of one interior-point iteration: two states (dx, du), one control dp, solved by a Riccati recursion.

    minimise   sum_i  g_i z_i + z_i H_i z_i / 2,     z_i = (dx, du, dp)_i
    subject to dx_{i+1} = D0 dx_i + D1 du_i + D2 dp_i + D3,     du_{i+1} = du_i + dp_i

with dx_0 = du_0 = 0 and dx_N = du_N = 0: the last two controls are fixed by the two conditions at the end. The recursion is linear in
N, and its factors serve the predictor and the corrector alike (Rao, Wright & Rawlings 1998; interior_point.py).
"""

from __future__ import annotations

from planner.base.kernels import njit

# Of the positive parts: smallest reduced Hessian taken for convex [-]. Far above the rounding of the parts' difference, so that a model
# that is taken has a minimum, and far below what a model with any row near its limit has.
PIVOT_MIN = 1e-6


@njit(cache=True, error_model="numpy")
def riccati(model, fraction, gains):
    """Feedback dp_i = K0 dx_i + K1 du_i + K2 of the linear-quadratic problem with dx_N = du_N = 0, but for K2.

    fraction : of the curvature of rows and dynamics that counts [-]
    gains : (N, 8) out: K0, K1, (K2); the cost to go from point i, P_xx, P_xu, P_uu, (g_x); the curvature along p

    Returns False if there is no minimum.
    """
    dynamics, convex, curved = model.dynamics, model.convex, model.curved
    n = len(dynamics)
    # End: du_{N-1} + dp_{N-1} = 0, and the x-dynamics of the last interval with dx_N = 0 fix dp_{N-2}.
    a0, a1, a2 = dynamics[n - 1, 0], dynamics[n - 1, 1], dynamics[n - 1, 2]
    b0, b1, b2 = dynamics[n - 2, 0], dynamics[n - 2, 1], dynamics[n - 2, 2]
    pivot = a0 * b2 + a1 - a2
    k0, k1 = -a0 * b0 / pivot, -(a0 * b1 + a1 - a2) / pivot
    h = convex[n - 1] + fraction * curved[n - 1]
    pxx, pxu, puu = h[0], h[1] - h[2], h[3] - 2.0 * h[4] + h[5]
    gains[n - 1, 0], gains[n - 1, 1] = 0.0, -1.0
    gains[n - 1, 3], gains[n - 1, 4], gains[n - 1, 5], gains[n - 1, 6] = pxx, pxu, puu, pivot
    h = convex[n - 2] + fraction * curved[n - 2]
    x0, x1, u0, u1 = b0 + b2 * k0, b1 + b2 * k1, k0, 1.0 + k1  # dx_{N-1}, du_{N-1} of (dx, du)_{N-2}
    nxx = pxx * x0 * x0 + 2.0 * pxu * x0 * u0 + puu * u0 * u0 + h[0] + 2.0 * h[2] * k0 + h[5] * k0 * k0
    nxu = pxx * x0 * x1 + pxu * (x0 * u1 + x1 * u0) + puu * u0 * u1
    nxu += h[1] + h[2] * k1 + h[4] * k0 + h[5] * k0 * k1
    nuu = pxx * x1 * x1 + 2.0 * pxu * x1 * u1 + puu * u1 * u1 + h[3] + 2.0 * h[4] * k1 + h[5] * k1 * k1
    pxx, pxu, puu = nxx, nxu, nuu
    gains[n - 2, 0], gains[n - 2, 1] = k0, k1
    gains[n - 2, 3], gains[n - 2, 4], gains[n - 2, 5] = pxx, pxu, puu
    for i in range(n - 3, -1, -1):
        b0, b1, b2 = dynamics[i, 0], dynamics[i, 1], dynamics[i, 2]
        px, pu = pxx * b2 + pxu, pxu * b2 + puu  # P B, B = (b2, 1)
        forward = b2 * px + pu
        curve = convex[i, 5] + fraction * curved[i, 5] + forward
        if not curve > PIVOT_MIN * (convex[i, 5] + abs(forward)):
            return False
        cx = convex[i, 2] + fraction * curved[i, 2] + b0 * px
        cu = convex[i, 4] + fraction * curved[i, 4] + b1 * px + pu
        nxx = convex[i, 0] + fraction * curved[i, 0] + b0 * b0 * pxx - cx * cx / curve
        nxu = convex[i, 1] + fraction * curved[i, 1] + b0 * (pxx * b1 + pxu) - cx * cu / curve
        nuu = convex[i, 3] + fraction * curved[i, 3] + b1 * (pxx * b1 + 2.0 * pxu) + puu - cu * cu / curve
        pxx, pxu, puu = nxx, nxu, nuu
        gains[i, 0], gains[i, 1] = -cx / curve, -cu / curve
        gains[i, 3], gains[i, 4], gains[i, 5], gains[i, 6] = pxx, pxu, puu, curve
    return True


@njit(cache=True, error_model="numpy")
def offsets(model, fraction, gains):
    """The part of the recursion that depends on the gradient: K2 and g_x in `gains`, after `riccati`."""
    dynamics, gradient = model.dynamics, model.gradient
    n = len(dynamics)
    b2, b3 = dynamics[n - 2, 2], dynamics[n - 2, 3]
    k0, k1 = gains[n - 2, 0], gains[n - 2, 1]
    k2 = -(dynamics[n - 1, 0] * b3 + dynamics[n - 1, 3]) / gains[n - 1, 6]
    gx, gu = gradient[n - 1, 0], gradient[n - 1, 1] - gradient[n - 1, 2]
    gains[n - 1, 2], gains[n - 1, 7], gains[n - 2, 2] = 0.0, gx, k2
    sx = gains[n - 1, 3] * (b3 + b2 * k2) + gains[n - 1, 4] * k2 + gx
    su = gains[n - 1, 4] * (b3 + b2 * k2) + gains[n - 1, 5] * k2 + gu
    h = model.convex[n - 2] + fraction * model.curved[n - 2]
    push = gradient[n - 2, 2] + h[5] * k2
    gx = (dynamics[n - 2, 0] + b2 * k0) * sx + k0 * su + gradient[n - 2, 0] + push * k0 + h[2] * k2
    gu = (dynamics[n - 2, 1] + b2 * k1) * sx + (1.0 + k1) * su + gradient[n - 2, 1] + push * k1 + h[4] * k2
    gains[n - 2, 7] = gx
    for i in range(n - 3, -1, -1):
        b3 = dynamics[i, 3]
        sx, su = gains[i + 1, 3] * b3 + gx, gains[i + 1, 4] * b3 + gu
        push = gradient[i, 2] + dynamics[i, 2] * sx + su
        gains[i, 2] = -push / gains[i, 6]
        gx = gradient[i, 0] + dynamics[i, 0] * sx + gains[i, 0] * push
        gu = gradient[i, 1] + dynamics[i, 1] * sx + su + gains[i, 1] * push
        gains[i, 7] = gx


@njit(cache=True, error_model="numpy")
def slope(model, fraction, dz, i):
    """Gradient of interval i's part of the quadratic model after the step."""
    h, dx, du, dp = model.convex[i] + fraction * model.curved[i], dz[i, 0], dz[i, 1], dz[i, 2]
    x = model.gradient[i, 0] + h[0] * dx + h[1] * du + h[2] * dp
    u = model.gradient[i, 1] + h[1] * dx + h[3] * du + h[4] * dp
    p = model.gradient[i, 2] + h[2] * dx + h[4] * du + h[5] * dp
    return x, u, p
