"""The jerk-limited problem on one window, linearised, with its curvature: what the interior-point step of interior_point.py works on.

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

With multipliers lam of the rows, sum lam g = lam_j p/h + (terms of single points) + ..., so that the second derivatives of the
Lagrangian need one sum over the axes, lam_j = sum lam r'_k/j_k, and those of h(vm, p).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit

DOMAIN = 0.95  # share of the kinematics' domain p ds <= 3 vm^2 that an interval may use [-]; a start with constant jerk uses 8/9
SLOPE_MIN = 1e-3  # of the mean feed: floor of vm - p h/6, which is 0 at the domain's edge [-]


class Grid(NamedTuple):
    """A window's grid in scaled units: N intervals, N+1 points, A axes."""

    ds: FloatArray  # (N,)
    x_max: FloatArray  # (N+1,)
    d1: FloatArray  # (N+1, A), like the next five
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    per_acceleration: FloatArray  # one over the limits, like the next
    per_jerk: FloatArray


class Profile(NamedTuple):
    """A motion over a window, in scaled units: x, u (N+1,) and p (N,) of the module text."""

    x: FloatArray
    u: FloatArray
    p: FloatArray

    def slower(self, factor: float) -> Profile:
        """The motion slowed down as a whole."""
        return Profile(self.x / factor**2, self.u / factor**2, self.p / factor**2)


class Iterate(NamedTuple):
    """A profile with slacks and multipliers: M row sides, the R upper ones first, then the lower ones of all but the last two.

    x, u, p : of `Profile`
    slack   : (N, M), positive
    lam     : (N, M) multipliers of the rows, positive
    pi      : (N,) multipliers of the dynamics
    """

    x: FloatArray
    u: FloatArray
    p: FloatArray
    slack: FloatArray
    lam: FloatArray
    pi: FloatArray


class Model(NamedTuple):
    """The problem at a profile, to second order: N intervals, R rows, in terms of steps (dx, du, dp)_i.

    dynamics : (N, 4) dx_{i+1} = D0 dx + D1 du + D2 dp + D3
    gradient : (N, 3) of the total time
    rows     : (N, 3, R) gradients of the rows
    values   : (N, R) the rows, the effect of the dynamics' defect included
    convex   : (N, 6) Hessian of the time, as (xx, xu, xp, uu, up, pp)
    curved   : (N, 6) Hessian of rows and dynamics, weighed by their multipliers
    costate  : (N, 2) what turns the derivative of the cost to go into the multiplier of the dynamics: pi = C0 (dV/dx + C1)
    duration : (N,) of the intervals
    """

    dynamics: FloatArray
    gradient: FloatArray
    rows: FloatArray
    values: FloatArray
    convex: FloatArray
    curved: FloatArray
    costate: FloatArray
    duration: FloatArray


@njit(cache=True, error_model="numpy")
def empty_model(n, count):
    """Room for a model of n intervals and `count` rows, all zero."""
    return Model(
        np.zeros((n, 4)),
        np.zeros((n, 3)),
        np.zeros((n, 3, count)),
        np.zeros((n, count)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 2)),
        np.zeros(n),
    )


@njit(cache=True, error_model="numpy")
def at_profile(profile, sides):
    """An iterate at a copy of the profile, with slacks and multipliers of no rows or `sides` row sides, all zero."""
    n = len(profile.p)
    return Iterate(
        profile.x.copy(),
        profile.u.copy(),
        profile.p.copy(),
        np.zeros((n, sides)),
        np.zeros((n, sides)),
        np.zeros(n),
    )


@njit(cache=True, error_model="numpy")
def duration(v0, v1, p, ds):
    """Time on an interval of length ds with end speeds v0, v1 and a change p of the acceleration."""
    vm = 0.5 * (v0 + v1)
    return 2.0 * ds / (vm + np.sqrt(max(vm * vm - p * ds / 3.0, 0.0)))


@njit(cache=True, error_model="numpy")
def kinematics(x0, x1, u, p, ds, last):
    """One interval to first order: D0..D3 with dx_{i+1} = D0 dx + D1 du + D2 dp + D3, and what else its derivatives are made of.

    Returns D0, D1, D2, D3; the duration h; dh/dmean, dh/dp; the slope mean - p h/6; d mean/dx_i, d mean/dx_{i+1}; the factor f of
    the implicit dependence on x_{i+1}; and the defect of the dynamics as a speed.
    """
    v0, v1 = np.sqrt(x0), np.sqrt(x1)
    mean = 0.5 * (v0 + v1)
    t = duration(v0, v1, p, ds)
    slope = max(mean - p * t / 6.0, SLOPE_MIN * mean)
    h_v, h_p = -t / slope, t * t / (12.0 * slope)
    m0 = 0.25 / v0 if v0 > 0.0 else 0.0
    m1 = 0.25 / v1 if v1 > 0.0 and not last else 0.0
    q = p * (2.0 * u + p)
    bend = q * t / 6.0
    e0, e1 = 1.0 + bend * h_v * m0, 2.0 * ds + p * t * t / 6.0
    e2 = ds + (u + p) * t * t / 6.0 + bend * h_p
    e3 = x0 + (2.0 * u + p) * ds + q * t * t / 12.0 - x1
    defect = abs(e3) / (v0 + v1)
    f = 1.0 if last else 1.0 / (1.0 - bend * h_v * m1)
    return e0 * f, e1 * f, e2 * f, e3 * f, t, h_v, h_p, slope, m0, m1, f, defect


@njit(cache=True, error_model="numpy")
def _put(rows, values, i, r, slope, value, scale):
    """Enter row r of interval i with its derivatives in x, u, p and its value, all times `scale`."""
    cx, cu, cp = slope
    rows[i, 0, r], rows[i, 1, r], rows[i, 2, r] = cx * scale, cu * scale, cp * scale
    values[i, r] = value * scale


@njit(cache=True, error_model="numpy")
def _reduce(out, i, q, e0, e1, e2):
    """Hessian in (x_i, u_i, p_i) from that in (x_i, u_i, p_i, x_{i+1}), q = (00, 01, 02, 12, 22, 03, 13, 23, 33)."""
    q00, q01, q02, q12, q22, q03, q13, q23, q33 = q
    out[i, 0] = q00 + e0 * (2.0 * q03 + q33 * e0)
    out[i, 1] = q01 + q03 * e1 + q13 * e0 + q33 * e0 * e1
    out[i, 2] = q02 + q03 * e2 + q23 * e0 + q33 * e0 * e2
    out[i, 3] = e1 * (2.0 * q13 + q33 * e1)
    out[i, 4] = q12 + q13 * e2 + q23 * e1 + q33 * e1 * e2
    out[i, 5] = q22 + e2 * (2.0 * q23 + q33 * e2)


@njit(cache=True, error_model="numpy")
def linearise(grid, at, model, jumps):
    """Fill the model at an iterate's profile and multipliers.

    jumps    : 1 if r'' jumps anywhere: a row for the acceleration left of each point

    Returns the total time and the largest defect of the dynamics, as a speed.
    """
    ds, x_max, d1, d2_left, d2_right, d3_left, d3_right, per_acceleration, per_jerk = grid
    dynamics, gradient, rows, values, convex, curved, costate, h = model
    x, u, p, lam, pi = at.x, at.u, at.p, at.lam, at.pi
    n, axes, below = len(h), d1.shape[1], values.shape[1]
    total, worst = 0.0, 0.0
    for i in range(n):
        step, last = ds[i], i == n - 1
        v0, v1 = np.sqrt(x[i]), np.sqrt(x[i + 1])
        mean = 0.5 * (v0 + v1)
        e0, e1, e2, e3, t, h_v, h_p, slope, m0, m1, f, defect = kinematics(
            x[i], x[i + 1], u[i], p[i], step, last
        )
        h[i] = t
        total += t
        worst = max(worst, defect)
        slope_v, slope_p = 1.0 - p[i] * h_v / 6.0, -(t + p[i] * h_p) / 6.0  # second derivatives of h(mean, p)
        h_vv = (t * slope_v / slope - h_v) / slope
        h_vp = (t * slope_p / slope - h_p) / slope
        h_pp = t * (2.0 * h_p - t * slope_p / slope) / (12.0 * slope)
        q = p[i] * (2.0 * u[i] + p[i])
        left, right = h_v * m0, h_v * m1  # dh/dx_i, dh/dx_{i+1}
        dynamics[i, 0], dynamics[i, 1], dynamics[i, 2], dynamics[i, 3] = e0, e1, e2, e3
        hx, hu, hp, h0 = left + right * e0, right * e1, h_p + right * e2, right * e3
        gradient[i, 0], gradient[i, 1], gradient[i, 2] = hx, hu, hp

        per_t = 1.0 / t
        j, u1 = p[i] * per_t, u[i] + p[i]
        per_v0, per_v1 = 4.0 * m0, 4.0 * m1
        j_t = -j * per_t
        inner = 1.0 if i > 0 else 0.0  # the first point is given: its own rows have no step to limit
        end = 0.0 if last else 1.0
        r = 0
        lam_j = 0.0  # sum of lam r'/j_k over both ends, and per end those of 3 r'' and r'''
        bend0, twist0, bend1, twist1, jump = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(axes):
            a = per_acceleration[i, k]
            value = (d1[i, k] * u[i] + d2_right[i, k] * x[i]) * inner
            _put(rows, values, i, r, (d2_right[i, k] * inner, d1[i, k] * inner, 0.0), value, a)
            b, b1 = per_jerk[i, k], per_jerk[i + 1, k]
            turn = 3.0 * d2_right[i, k] * u[i] + d3_right[i, k] * x[i]
            by_h = d1[i, k] * j_t
            cx = v0 * d3_right[i, k] + 0.5 * turn * per_v0
            value = d1[i, k] * j + v0 * turn + by_h * h0
            cu = 3.0 * v0 * d2_right[i, k] + by_h * hu
            _put(rows, values, i, r + 1, (cx + by_h * hx, cu, d1[i, k] * per_t + by_h * hp), value, b)
            turn = 3.0 * d2_left[i + 1, k] * u1 + d3_left[i + 1, k] * x[i + 1]
            by_h = d1[i + 1, k] * j_t
            cx = (v1 * d3_left[i + 1, k] + 0.5 * turn * per_v1) * end
            cu = 3.0 * v1 * d2_left[i + 1, k]
            value = d1[i + 1, k] * j + v1 * turn + by_h * h0 + cx * e3 * end
            cp = d1[i + 1, k] * per_t + by_h * hp + cx * e2 + cu
            _put(rows, values, i, r + 2, (cx * e0 + by_h * hx, cx * e1 + cu + by_h * hu, cp), value, b1)
            lam0 = (lam[i, r + 1] - lam[i, below + r + 1]) * b
            lam1 = (lam[i, r + 2] - lam[i, below + r + 2]) * b1
            lam_j += lam0 * d1[i, k] + lam1 * d1[i + 1, k]
            bend0 += lam0 * 3.0 * d2_right[i, k]
            twist0 += lam0 * d3_right[i, k]
            bend1 += lam1 * 3.0 * d2_left[i + 1, k]
            twist1 += lam1 * d3_left[i + 1, k]
            r += 3
            if jumps:
                a = per_acceleration[i + 1, k]
                cx, cu = d2_left[i + 1, k] * end, d1[i + 1, k] * end
                value = cu * u1 + cx * (x[i + 1] + e3)
                _put(rows, values, i, r, (cx * e0, cx * e1 + cu, cx * e2 + cu), value, a)
                jump += (lam[i, r] - lam[i, below + r]) * a * cx
                r += 1
        _put(rows, values, i, r, (inner, 0.0, 0.0), inner * x[i], 1.0 / x_max[i])

        # Lagrangian of the interval: h + lam_j p/h + pi q h^2/12 + the last row's, as a function L(mean, p, u, h).
        w = pi[i]
        l_v, l_vv, l_vp, l_vh = 0.0, 0.0, 0.0, 0.0
        l_h, l_hh = 1.0 - lam_j * j / t, 2.0 * lam_j * j / (t * t)
        l_hp, l_pp = -lam_j / (t * t), 0.0
        if i == 0 or last:  # at rest: stay where the kinematics have a solution
            c = step / (3.0 * DOMAIN * mean * mean)
            by_v = -2.0 * c * p[i] / mean
            cx, cu, cp = by_v * (m0 + m1 * e0), by_v * m1 * e1, c + by_v * m1 * e2
            _put(rows, values, i, r + 1, (cx, cu, cp), c * p[i] + by_v * m1 * e3, 1.0)
            weight = lam[i, r + 1]
            l_v += weight * by_v
            l_vv += -3.0 * weight * by_v / mean
            l_vp += -2.0 * weight * c / mean
        else:
            middle = mean - 0.125 * p[i] * t
            scale = 2.0 / (0.5 * (x_max[i] + x_max[i + 1]))
            c = -0.125 * p[i]
            cx, cu, cp = m0 + m1 * e0 + c * hx, m1 * e1 + c * hu, m1 * e2 + c * hp - 0.125 * t
            value = 0.5 * middle + m1 * e3 + c * h0
            _put(rows, values, i, r + 1, (cx, cu, cp), value, scale * middle)
            weight = lam[i, r + 1] * scale
            l_v += weight * middle
            l_vv += weight
            l_vp -= 0.125 * weight * t
            l_vh += weight * c
            l_h += weight * middle * c
            l_hh += weight * c * c
            l_hp -= 0.125 * weight * (middle + c * t)
            l_pp += weight * t * t / 64.0
        # Multiplier of the dynamics: stationarity with respect to x_{i+1} (without the dynamics' own term).
        rest = m1 * (l_h * h_v + l_v) + jump
        if not last and v1 > 0.0:
            rest += 0.5 * bend1 * u1 / v1 + 1.5 * twist1 * v1
        costate[i, 0], costate[i, 1] = f, rest
        l_h += w * q * t / 6.0
        l_hh += w * q / 6.0
        l_hp += w * (u[i] + p[i]) * t / 3.0
        l_hu, l_pu = w * p[i] * t / 3.0, w * t * t / 6.0
        l_pp += l_pu
        # Less the time's own second derivatives, which are kept apart.
        s_v = l_h * h_v + l_v - h_v
        s_vv = l_hh * h_v * h_v + (l_h - 1.0) * h_vv + 2.0 * l_vh * h_v + l_vv
        s_vp = l_hh * h_v * h_p + (l_h - 1.0) * h_vp + l_hp * h_v + l_vh * h_p + l_vp
        s_pp = l_hh * h_p * h_p + (l_h - 1.0) * h_pp + 2.0 * l_hp * h_p + l_pp
        s_vu, s_pu = l_hu * h_v, l_hu * h_p + l_pu
        q00, q01 = s_vv * m0 * m0 - 8.0 * m0 * m0 * m0 * s_v, s_vu * m0
        q33, q13, q23 = s_vv * m1 * m1 - 8.0 * m1 * m1 * m1 * s_v, s_vu * m1, s_vp * m1
        if m0 > 0.0:
            q00 += (0.75 * twist0 - 0.25 * bend0 * u[i] / x[i]) / v0
            q01 += 0.5 * bend0 / v0
        if m1 > 0.0:
            q33 += (0.75 * twist1 - 0.25 * bend1 * u1 / x[i + 1]) / v1
            q13 += 0.5 * bend1 / v1
            q23 += 0.5 * bend1 / v1
        q03 = s_vv * m0 * m1
        _reduce(curved, i, (q00, q01, s_vp * m0, s_pu, s_pp, q03, q13, q23, q33), e0, e1, e2)
        # d2/du1 dx1 with u1 = u + p is in q13 and q23; the cross terms with the defect move the gradient
        o00, o33 = h_vv * m0 * m0 - 8.0 * m0 * m0 * m0 * h_v, h_vv * m1 * m1 - 8.0 * m1 * m1 * m1 * h_v
        o03, o02, o23 = h_vv * m0 * m1, h_vp * m0, h_vp * m1
        _reduce(convex, i, (o00, 0.0, o02, 0.0, h_pp, o03, 0.0, o23, o33), e0, e1, e2)
        q33 += o33
        gradient[i, 0] += e3 * (q03 + o03 + q33 * e0)
        gradient[i, 1] += e3 * (q13 + q33 * e1)
        gradient[i, 2] += e3 * (q23 + o23 + q33 * e2)
    return total, worst
