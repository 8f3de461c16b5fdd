"""The jerk-limited problem on one window, linearised, with its curvature: for an interior-point step.

Unknowns of a window with N intervals: z_i = (x_i, u_i), feed^2 and acceleration along the path at the N+1
points (both ends given), and p_i = u_{i+1} - u_i on the intervals. The jerk is constant on an interval, so
the kinematics are exact cubics: with vm = (v_i + v_{i+1})/2, v = sqrt(x),

    ds = vm h - p h^2/12                    =>  h = 2 ds / (vm + sqrt(vm^2 - p ds/3))           duration
    x_{i+1} = x_i + (2u + p) ds + p (2u + p) h^2/12,   u_{i+1} = u_i + p                           dynamics
    jerk j = p/h

In (x, u, p) this is linear but for the last term, which is why these coordinates are used: the second-order
limits are linear, the time is convex, and only the jerk rows and that term are curved. Inequalities are
scaled to -1 <= g <= 1:

    r'_k u + r''_k x                                      / a_k        acceleration at point i (also left of it, where r'' jumps)
    r'_k j + v (3 r''_k u + r'''_k x)                     / j_k        jerk at both ends of the interval
    x_i / x_max,  ((v_i + v_{i+1})/2 - p h/8)^2 / x_max               feed at the point and mid-interval (g <= 1 only)

With multipliers lam of the rows, sum lam g = lam_j p/h + (terms of single points) + ..., so that the second
derivatives of the Lagrangian need one sum over the axes, lam_j = sum lam r'_k/j_k, and those of h(vm, p).

All is written for a block of up to `LANES` intervals (layout.py). The rows of an axis are, in this order,
acceleration at the start, jerk at the start, jerk at the end, and where r'' jumps acceleration at the end;
after those of all axes come the two of the feed.
"""

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.layout import (
    A_U,
    A_X,
    AXIS,
    B_J,
    B_U,
    B_X,
    BY_P,
    BY_U,
    BY_X,
    C_J,
    C_U,
    C_X,
    CONVEX,
    COSTATE,
    CURVED,
    D_U,
    D_X,
    DS,
    DYN,
    EDGE,
    FIXED,
    GRADIENT,
    INNER_END,
    LAM_LOW,
    LAM_UP,
    LANE_MATH,
    LANES,
    PER_MIDDLE,
    PER_X,
    PI,
    REST,
    ROW,
    VALUE,
    X_END,
    H,
    P,
    U,
    X,
)

DOMAIN = 0.95  # share of the kinematics' domain p ds <= 3 vm^2 that an interval may use [-]; a start with constant jerk uses 8/9
SLOPE_MIN = 1e-3  # of the mean feed: floor of vm - p h/6, which is 0 at the domain's edge [-]

# What the steps of `linearise` hand on, in the array `passing`: the mean of the end speeds; d mean/dx_i and d
# mean/dx_{i+1}; dh/dmean, dh/dp, and with the dynamics put in dh/dx, dh/du, dh/dp and its defect; vm - p h/6;
# the end speed where it is free, else 0
MEAN, M0, M1, H_V, H_P, HX, HU, HP, H0, SLOPE, FREE = range(0, 11 * LANES, LANES)
# ... both end speeds, one over h;
V0, V1, PER_H = range(11 * LANES, 14 * LANES, LANES)
# ... the multipliers' sums: of j; of v u and v x at the start and at the end; of x before a jump at the end
LAM_J, BEND0, TWIST0, BEND1, TWIST1, JUMP = range(14 * LANES, 20 * LANES, LANES)
PASSING = 20 * LANES


@njit(cache=True, error_model="numpy")
def duration(v0, v1, p, ds):
    """Time on an interval of length ds with end speeds v0, v1 and a change p of the acceleration."""
    vm = 0.5 * (v0 + v1)
    return 2.0 * ds / (vm + np.sqrt(max(vm * vm - p * ds / 3.0, 0.0)))


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def kinematics(g, w, t, worst, m):
    """The first m intervals of a block to first order: durations and dynamics into `w`, what else its
    derivatives are made of into `t`. `worst` (LANES,) grows to the defect of the dynamics, as a speed."""
    for i in range(m):
        x0, x1, u, p, ds = w[X + i], w[X_END + i], w[U + i], w[P + i], g[DS + i]
        v0, v1 = np.sqrt(x0), np.sqrt(x1)
        mean = 0.5 * (v0 + v1)
        h = 2.0 * ds / (mean + np.sqrt(max(mean * mean - p * ds / 3.0, 0.0)))
        slope = max(mean - p * h / 6.0, SLOPE_MIN * mean)
        h_v, h_p = -h / slope, h * h / (12.0 * slope)
        m0 = 0.25 / v0 if v0 > 0.0 else 0.0
        m1 = 0.25 * g[INNER_END + i] / v1 if v1 > 0.0 else 0.0
        bend = p * (2.0 * u + p) * h / 6.0
        f = 1.0 / (1.0 - bend * h_v * m1)  # of the implicit dependence on x_{i+1}
        e3 = x0 + (2.0 * u + p) * ds + 0.5 * bend * h - x1
        worst[i] = max(worst[i], 0.5 * abs(e3) / mean)
        e0, e1 = (1.0 + bend * h_v * m0) * f, (2.0 * ds + p * h * h / 6.0) * f
        e2, e3 = (ds + (u + p) * h * h / 6.0 + bend * h_p) * f, e3 * f
        w[H + i], w[COSTATE + i] = h, f
        w[DYN + i], w[DYN + LANES + i], w[DYN + 2 * LANES + i], w[DYN + 3 * LANES + i] = e0, e1, e2, e3
        t[MEAN + i], t[M0 + i], t[M1 + i] = mean, m0, m1
        t[V0 + i], t[V1 + i], t[PER_H + i] = v0, v1, 1.0 / h
        t[H_V + i], t[H_P + i], t[SLOPE + i], t[FREE + i] = h_v, h_p, slope, v1 * g[INNER_END + i]
        left, right = h_v * m0, h_v * m1  # dh/dx_i, dh/dx_{i+1}
        t[HX + i], t[HU + i] = left + right * e0, right * e1
        t[HP + i], t[H0 + i] = h_p + right * e2, right * e3


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _axis_rows(g, w, t, rows, m):
    """The rows of an axis without that before a jump, and what their multipliers add to the sums. `g` and
    `rows` begin with the axis."""
    for i in range(m):
        x0, x1, u, p, per_h = w[X + i], w[X_END + i], w[U + i], w[P + i], t[PER_H + i]
        e0, e1, e2, e3 = w[DYN + i], w[DYN + LANES + i], w[DYN + 2 * LANES + i], w[DYN + 3 * LANES + i]
        hx, hu, hp, h0 = t[HX + i], t[HU + i], t[HP + i], t[H0 + i]
        m0, m1, v0, v1 = t[M0 + i], t[M1 + i], t[V0 + i], t[V1 + i]
        u1, j = u + p, p * per_h
        j_h = -j * per_h

        rows[VALUE + i] = g[A_U + i] * u + g[A_X + i] * x0
        rows[BY_X + i], rows[BY_U + i], rows[BY_P + i] = g[A_X + i], g[A_U + i], 0.0

        b_j, b_u, b_x = g[B_J + i], g[B_U + i], g[B_X + i]
        turn, by_h = b_u * u + b_x * x0, b_j * j_h
        rows[ROW + VALUE + i] = b_j * j + v0 * turn + by_h * h0
        rows[ROW + BY_X + i] = v0 * b_x + 2.0 * m0 * turn + by_h * hx
        rows[ROW + BY_U + i] = v0 * b_u + by_h * hu
        rows[ROW + BY_P + i] = b_j * per_h + by_h * hp

        c_j, c_u, c_x = g[C_J + i], g[C_U + i], g[C_X + i]
        turn, by_h = c_u * u1 + c_x * x1, c_j * j_h
        cx, cu = t[FREE + i] * c_x + 2.0 * m1 * turn, v1 * c_u
        rows[2 * ROW + VALUE + i] = c_j * j + v1 * turn + by_h * h0 + cx * e3
        rows[2 * ROW + BY_X + i] = cx * e0 + by_h * hx
        rows[2 * ROW + BY_U + i] = cx * e1 + cu + by_h * hu
        rows[2 * ROW + BY_P + i] = c_j * per_h + by_h * hp + cx * e2 + cu

        start = rows[ROW + LAM_UP + i] - rows[ROW + LAM_LOW + i]
        end = rows[2 * ROW + LAM_UP + i] - rows[2 * ROW + LAM_LOW + i]
        t[LAM_J + i] += start * b_j + end * c_j
        t[BEND0 + i] += start * b_u
        t[TWIST0 + i] += start * b_x
        t[BEND1 + i] += end * c_u
        t[TWIST1 + i] += end * c_x


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _jump_row(g, w, t, rows, m):
    """The row of an axis before a jump, as `_axis_rows`."""
    for i in range(m):
        cx, cu, u1 = g[D_X + i], g[D_U + i], w[U + i] + w[P + i]
        rows[VALUE + i] = cu * u1 + cx * (w[X_END + i] + w[DYN + 3 * LANES + i])
        rows[BY_X + i] = cx * w[DYN + i]
        rows[BY_U + i] = cx * w[DYN + LANES + i] + cu
        rows[BY_P + i] = cx * w[DYN + 2 * LANES + i] + cu
        t[JUMP + i] += (rows[LAM_UP + i] - rows[LAM_LOW + i]) * cx


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _curvature(g, w, t, rows, m):
    """The rows of the feed, with which `rows` begin, and the cost: gradient, Hessian, and what its derivative
    by x_{i+1} is.

    The Lagrangian of the interval is h + lam_j p/h + pi q h^2/12 + the last row's, as a function L(mean, p,
    u, h), q = p (2u + p).
    """
    for i in range(m):
        x0, u, p, w_pi, h = w[X + i], w[U + i], w[P + i], w[PI + i], w[H + i]
        e0, e1, e2, e3 = w[DYN + i], w[DYN + LANES + i], w[DYN + 2 * LANES + i], w[DYN + 3 * LANES + i]
        mean, m0, m1, slope = t[MEAN + i], t[M0 + i], t[M1 + i], t[SLOPE + i]
        h_v, h_p, hx, hu, hp, h0 = t[H_V + i], t[H_P + i], t[HX + i], t[HU + i], t[HP + i], t[H0 + i]
        lam_j, bend0, twist0 = t[LAM_J + i], t[BEND0 + i], t[TWIST0 + i]
        bend1, twist1, free = t[BEND1 + i], t[TWIST1 + i], t[FREE + i]
        per_h, per_mean, per_slope = t[PER_H + i], 1.0 / mean, 1.0 / slope
        u1, q = u + p, p * (2.0 * u + p)

        slope_v, slope_p = 1.0 - p * h_v / 6.0, -(h + p * h_p) / 6.0  # second derivatives of h(mean, p)
        h_vv = (h * slope_v * per_slope - h_v) * per_slope
        h_vp = (h * slope_p * per_slope - h_p) * per_slope
        h_pp = h * (2.0 * h_p - h * slope_p * per_slope) * per_slope / 12.0

        rows[VALUE + i] = g[PER_X + i] * x0
        rows[BY_X + i], rows[BY_U + i], rows[BY_P + i] = g[PER_X + i], 0.0, 0.0
        # In the middle of the interval. At rest: stay where the kinematics have a solution.
        edge = g[EDGE + i] > 0.0
        c = g[DS + i] * per_mean * per_mean / (3.0 * DOMAIN)
        v = -2.0 * c * p * per_mean
        middle, by_h, scale = mean - 0.125 * p * h, -0.125 * p, g[PER_MIDDLE + i]
        s = scale * middle
        cx = v * (m0 + m1 * e0) if edge else s * (m0 + m1 * e0 + by_h * hx)
        cu = v * m1 * e1 if edge else s * (m1 * e1 + by_h * hu)
        cp = c + v * m1 * e2 if edge else s * (m1 * e2 + by_h * hp - 0.125 * h)
        value = c * p + v * m1 * e3 if edge else s * (0.5 * middle + m1 * e3 + by_h * h0)
        rows[ROW + VALUE + i] = value
        rows[ROW + BY_X + i], rows[ROW + BY_U + i], rows[ROW + BY_P + i] = cx, cu, cp
        lam = rows[ROW + LAM_UP + i] - rows[ROW + LAM_LOW + i]
        scaled = lam * scale
        l_v = lam * v if edge else scaled * middle
        l_vv = -3.0 * lam * v * per_mean if edge else scaled
        l_vp = -2.0 * lam * c * per_mean if edge else -0.125 * scaled * h
        l_vh = 0.0 if edge else scaled * by_h
        l_pp = 0.0 if edge else scaled * h * h / 64.0
        l_h = 0.0 if edge else scaled * middle * by_h
        l_hh = 0.0 if edge else scaled * by_h * by_h
        l_hp = 0.0 if edge else -0.125 * scaled * (middle + by_h * h)

        l_h += 1.0 - lam_j * p * per_h * per_h
        l_hh += 2.0 * lam_j * p * per_h * per_h * per_h
        l_hp -= lam_j * per_h * per_h
        # Stationarity by x_{i+1}, without the dynamics' own term.
        at_end = m1 * (l_h * h_v + l_v) + t[JUMP + i]
        w[REST + i] = at_end + 2.0 * m1 * bend1 * u1 + 1.5 * twist1 * free
        l_h += w_pi * q * h / 6.0
        l_hh += w_pi * q / 6.0
        l_hp += w_pi * u1 * h / 3.0
        l_hu, l_pu = w_pi * p * h / 3.0, w_pi * h * h / 6.0
        l_pp += l_pu
        # Hessian of all, less the time's own second derivatives, which are kept apart.
        s_v = l_h * h_v + l_v - h_v
        s_vv = l_hh * h_v * h_v + (l_h - 1.0) * h_vv + 2.0 * l_vh * h_v + l_vv
        s_vp = l_hh * h_v * h_p + (l_h - 1.0) * h_vp + l_hp * h_v + l_vh * h_p + l_vp
        s_pp = l_hh * h_p * h_p + (l_h - 1.0) * h_pp + 2.0 * l_hp * h_p + l_pp
        s_vu, s_pu = l_hu * h_v, l_hu * h_p + l_pu
        sq0, sq1 = m0 * m0, m1 * m1
        q00 = s_vv * sq0 - 8.0 * m0 * sq0 * s_v + 4.0 * m0 * (0.75 * twist0 - 4.0 * sq0 * bend0 * u)
        q01 = s_vu * m0 + 2.0 * m0 * bend0
        q02, q03 = s_vp * m0, s_vv * m0 * m1
        q13, q23 = s_vu * m1 + 2.0 * m1 * bend1, s_vp * m1 + 2.0 * m1 * bend1
        q33 = s_vv * sq1 - 8.0 * m1 * sq1 * s_v + 4.0 * m1 * (0.75 * twist1 - 4.0 * sq1 * bend1 * u1)
        # d2/du1 dx1 with u1 = u + p is in q13 and q23
        w[CURVED + i] = q00 + e0 * (2.0 * q03 + q33 * e0)
        w[CURVED + LANES + i] = q01 + q03 * e1 + q13 * e0 + q33 * e0 * e1
        w[CURVED + 2 * LANES + i] = q02 + q03 * e2 + q23 * e0 + q33 * e0 * e2
        w[CURVED + 3 * LANES + i] = e1 * (2.0 * q13 + q33 * e1)
        w[CURVED + 4 * LANES + i] = s_pu + q13 * e2 + q23 * e1 + q33 * e1 * e2
        w[CURVED + 5 * LANES + i] = s_pp + e2 * (2.0 * q23 + q33 * e2)
        o00, o33 = h_vv * sq0 - 8.0 * m0 * sq0 * h_v, h_vv * sq1 - 8.0 * m1 * sq1 * h_v
        o03, o02, o23 = h_vv * m0 * m1, h_vp * m0, h_vp * m1
        w[CONVEX + i] = o00 + e0 * (2.0 * o03 + o33 * e0)
        w[CONVEX + LANES + i] = e1 * (o03 + o33 * e0)
        w[CONVEX + 2 * LANES + i] = o02 + o03 * e2 + o23 * e0 + o33 * e0 * e2
        w[CONVEX + 3 * LANES + i] = o33 * e1 * e1
        w[CONVEX + 4 * LANES + i] = e1 * (o23 + o33 * e2)
        w[CONVEX + 5 * LANES + i] = h_pp + e2 * (2.0 * o23 + o33 * e2)
        # the cross terms with the defect move the gradient
        q33 += o33
        w[GRADIENT + i] = hx + e3 * (q03 + o03 + q33 * e0)
        w[GRADIENT + LANES + i] = hu + e3 * (q13 + q33 * e1)
        w[GRADIENT + 2 * LANES + i] = hp + e3 * (q23 + o23 + q33 * e2)


@njit(cache=True, error_model="numpy")
def linearise(model, b, t, worst):
    """Fill block b of the model at its profile and multipliers; `t` is room for `PASSING`, `worst` (LANES,)
    grows to the defect of the dynamics, as a speed."""
    g, w, rows = model.grid[b], model.work[b], model.rows[b]
    m, axes, of_axis = min(LANES, model.n - b * LANES), model.axes, 3 + model.jumps
    kinematics(g, w, t, worst, m)
    t[LAM_J:PASSING] = 0.0
    for k in range(axes):
        of_grid, r = g[FIXED + k * AXIS :], k * of_axis
        _axis_rows(of_grid, w, t, rows[r * ROW :], m)
        if model.jumps:
            r += 3
            _jump_row(of_grid, w, t, rows[r * ROW :], m)
    r = axes * of_axis
    _curvature(g, w, t, rows[r * ROW :], m)
