"""The linear-quadratic problem of an iteration, states (dx, du), control dp, by a Riccati recursion.

    minimise   sum_i  g_i z_i + z_i H_i z_i / 2,     z_i = (dx, du, dp)_i
    subject to dx_{i+1} = D0 dx_i + D1 du_i + D2 dp_i + D3,     du_{i+1} = du_i + dp_i

with dx_0 = du_0 = 0 and dx_N = du_N = 0: the last two controls are fixed by the two conditions at the end.
The recursion is linear in N, and its factors serve the predictor and the corrector alike (Rao, Wright &
Rawlings 1998; interior_point.py).

What belongs to interval i (layout.py): the feedback GAIN, dp_i = K0 dx_i + K1 du_i + K2, and of the cost to
go from its *end* the second derivatives TO_GO (xx, xu, uu) and the slope TO_GO_X.
"""

from planner.base.kernels import njit
from planner.feedrate.jerk.layout import (
    ALONG_P,
    CONVEX,
    COSTATE,
    CURVED,
    DYN,
    GAIN,
    GRADIENT,
    LANES,
    PI,
    REST,
    STEP,
    STEP_END,
    STEP_PI,
    TO_GO,
    TO_GO_X,
    X_END,
)

# Of the positive parts: smallest reduced Hessian taken for convex [-]. Far above the rounding of the parts'
# difference, so that a model that is taken has a minimum, and far below what a model with any row near its
# limit has.
PIVOT_MIN = 1e-6


@njit(cache=True, error_model="numpy")
def _three(w, first):
    """A quantity of three numbers."""
    return w[first], w[first + LANES], w[first + 2 * LANES]


@njit(cache=True, error_model="numpy")
def _set_three(w, first, a, b, c):
    w[first], w[first + LANES], w[first + 2 * LANES] = a, b, c


@njit(cache=True, error_model="numpy")
def _hessian(w, i, fraction):
    """The Hessian (xx, xu, xp, uu, up, pp) of the interval in lane i, with a fraction of the curvature of
    rows and dynamics."""
    xx, xu, xp = _three(w, CONVEX + i)
    uu, up, pp = _three(w, CONVEX + 3 * LANES + i)
    cxx, cxu, cxp = _three(w, CURVED + i)
    cuu, cup, cpp = _three(w, CURVED + 3 * LANES + i)
    return (
        xx + fraction * cxx,
        xu + fraction * cxu,
        xp + fraction * cxp,
        uu + fraction * cuu,
        up + fraction * cup,
        pp + fraction * cpp,
    )


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def riccati(blocks, fraction):
    """The factors: GAIN without its last part, TO_GO and ALONG_P.

    fraction : of the curvature of rows and dynamics that counts [-]

    Returns False if there is no minimum.
    """
    n, work = blocks.n, blocks.work
    # End: du_{N-1} + dp_{N-1} = 0, and the x-dynamics of the last interval with dx_N = 0 fix dp_{N-2}.
    w, i = work[(n - 1) // LANES], (n - 1) % LANES
    a0, a1, a2 = _three(w, DYN + i)
    hxx, hxu, hxp, huu, hup, hpp = _hessian(w, i, fraction)
    pxx, pxu, puu = hxx, hxu - hxp, huu - 2.0 * hup + hpp
    w[GAIN + i], w[GAIN + LANES + i] = 0.0, -1.0
    last, at = w, i
    w, i = work[(n - 2) // LANES], (n - 2) % LANES
    b0, b1, b2 = _three(w, DYN + i)
    pivot = a0 * b2 + a1 - a2
    last[ALONG_P + at] = pivot
    k0, k1 = -a0 * b0 / pivot, -(a0 * b1 + a1 - a2) / pivot
    hxx, hxu, hxp, huu, hup, hpp = _hessian(w, i, fraction)
    x0, x1, u0, u1 = b0 + b2 * k0, b1 + b2 * k1, k0, 1.0 + k1  # dx_{N-1}, du_{N-1} of (dx, du)_{N-2}
    _set_three(w, TO_GO + i, pxx, pxu, puu)
    w[GAIN + i], w[GAIN + LANES + i] = k0, k1
    nxx = pxx * x0 * x0 + 2.0 * pxu * x0 * u0 + puu * u0 * u0 + hxx + 2.0 * hxp * k0 + hpp * k0 * k0
    nxu = pxx * x0 * x1 + pxu * (x0 * u1 + x1 * u0) + puu * u0 * u1
    nxu += hxu + hxp * k1 + hup * k0 + hpp * k0 * k1
    nuu = pxx * x1 * x1 + 2.0 * pxu * x1 * u1 + puu * u1 * u1 + huu + 2.0 * hup * k1 + hpp * k1 * k1
    pxx, pxu, puu = nxx, nxu, nuu
    for b in range(len(work) - 1, -1, -1):
        w = work[b]
        for i in range(min(LANES, n - 2 - b * LANES) - 1, -1, -1):
            b0, b1, b2 = _three(w, DYN + i)
            hxx, hxu, hxp, huu, hup, hpp = _hessian(w, i, fraction)
            _set_three(w, TO_GO + i, pxx, pxu, puu)
            px, pu = pxx * b2 + pxu, pxu * b2 + puu  # P B, B = (b2, 1)
            forward = b2 * px + pu
            curve = hpp + forward
            if not curve > PIVOT_MIN * (w[CONVEX + 5 * LANES + i] + abs(forward)):
                return False
            cx, cu = hxp + b0 * px, hup + b1 * px + pu
            per_curve = 1.0 / curve
            kx, ku = -cx * per_curve, -cu * per_curve
            nxx = hxx + b0 * b0 * pxx + cx * kx
            nxu = hxu + b0 * (pxx * b1 + pxu) + cx * ku
            puu = huu + b1 * (pxx * b1 + 2.0 * pxu) + puu + cu * ku
            pxx, pxu = nxx, nxu
            w[GAIN + i], w[GAIN + LANES + i], w[ALONG_P + i] = kx, ku, per_curve
    return True


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def offsets(blocks, fraction):
    """The part of the recursion that depends on the gradient, after `riccati`: the last part of GAIN, and
    TO_GO_X."""
    n, work = blocks.n, blocks.work
    last, at = work[(n - 1) // LANES], (n - 1) % LANES
    w, i = work[(n - 2) // LANES], (n - 2) % LANES
    g0, g1, g2 = _three(last, GRADIENT + at)
    gx, gu = g0, g1 - g2
    last[GAIN + 2 * LANES + at] = 0.0
    b0, b1, b2 = _three(w, DYN + i)
    b3 = w[DYN + 3 * LANES + i]
    k0, k1 = w[GAIN + i], w[GAIN + LANES + i]
    k2 = -(last[DYN + at] * b3 + last[DYN + 3 * LANES + at]) / last[ALONG_P + at]
    w[GAIN + 2 * LANES + i], w[TO_GO_X + i] = k2, gx
    pxx, pxu, puu = _three(w, TO_GO + i)
    sx = pxx * (b3 + b2 * k2) + pxu * k2 + gx
    su = pxu * (b3 + b2 * k2) + puu * k2 + gu
    _, _, hxp, _, hup, hpp = _hessian(w, i, fraction)
    g0, g1, g2 = _three(w, GRADIENT + i)
    push = g2 + hpp * k2
    gx = (b0 + b2 * k0) * sx + k0 * su + g0 + push * k0 + hxp * k2
    gu = (b1 + b2 * k1) * sx + (1.0 + k1) * su + g1 + push * k1 + hup * k2
    for b in range(len(work) - 1, -1, -1):
        w = work[b]
        for i in range(min(LANES, n - 2 - b * LANES) - 1, -1, -1):
            b0, b1, b2 = _three(w, DYN + i)
            b3 = w[DYN + 3 * LANES + i]
            g0, g1, g2 = _three(w, GRADIENT + i)
            w[TO_GO_X + i] = gx
            sx, su = w[TO_GO + i] * b3 + gx, w[TO_GO + LANES + i] * b3 + gu
            push = g2 + b2 * sx + su
            w[GAIN + 2 * LANES + i] = -push * w[ALONG_P + i]
            gx = g0 + b0 * sx + w[GAIN + i] * push
            gu = g1 + b1 * sx + su + w[GAIN + LANES + i] * push


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def forward(blocks, shrink):
    """The steps dx, du, dp of all intervals. Returns what part of them takes no more than a share `shrink` of
    any x away."""
    n, work = blocks.n, blocks.work
    dx, du, length = 0.0, 0.0, 1.0
    for b in range(len(work)):
        w = work[b]
        m = min(LANES, n - b * LANES)
        for i in range(m):
            k0, k1, k2 = _three(w, GAIN + i)
            b0, b1, b2 = _three(w, DYN + i)
            dp = k0 * dx + k1 * du + k2
            _set_three(w, STEP + i, dx, du, dp)
            dx = b0 * dx + b1 * du + b2 * dp + w[DYN + 3 * LANES + i]
            du += dp
            w[STEP_END + i] = dx
        if b == len(work) - 1:
            w[STEP_END + m - 1] = 0.0  # given
        for i in range(m):
            if w[STEP_END + i] * length < -shrink * w[X_END + i]:
                length = -shrink * w[X_END + i] / w[STEP_END + i]
    return length


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _slope(w, i, fraction):
    """Gradient of the quadratic model of the interval in lane i after its step."""
    dx, du, dp = _three(w, STEP + i)
    g0, g1, g2 = _three(w, GRADIENT + i)
    hxx, hxu, hxp, huu, hup, hpp = _hessian(w, i, fraction)
    x = g0 + hxx * dx + hxu * du + hxp * dp
    u = g1 + hxu * dx + huu * du + hup * dp
    p = g2 + hxp * dx + hup * du + hpp * dp
    return x, u, p


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def costates(blocks, fraction):
    """The steps of the multipliers of the dynamics, after `forward`."""
    n, work = blocks.n, blocks.work
    for b in range(len(work)):
        w = work[b]
        for i in range(min(LANES, n - b * LANES)):
            du_end = w[STEP + LANES + i] + w[STEP + 2 * LANES + i]
            ahead = w[TO_GO + i] * w[STEP_END + i] + w[TO_GO + LANES + i] * du_end + w[TO_GO_X + i]
            w[STEP_PI + i] = w[COSTATE + i] * (ahead + w[REST + i]) - w[PI + i]
    last, at = work[(n - 1) // LANES], (n - 1) % LANES
    w, i = work[(n - 2) // LANES], (n - 2) % LANES
    last_x, last_u, last_p = _slope(last, at, fraction)
    _, _, before_p = _slope(w, i, fraction)
    pi = -(before_p + last_x * w[DYN + 2 * LANES + i] + last_u - last_p) / last[ALONG_P + at]
    last[STEP_PI + at] = pi - last[PI + at]
    ahead = last_x + pi * last[DYN + at]
    w[STEP_PI + i] = w[COSTATE + i] * (ahead + w[REST + i]) - w[PI + i]
