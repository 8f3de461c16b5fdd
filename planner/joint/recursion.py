"""A Newton step of the motion in time, by a recursion along its steps (Riccati), linear in their number.

Nodes x = (p, v, a), controls u = (j, h), and the gaps r = f(x, u) - x_next of the kinematics

    p + h v + h2 a/2 + h3 j/6,    v + h a + h2 j/2,    a + h j

with their derivatives A (the same triangle for every axis) and B. With the model 1/2 d'W d + w'd of step i in
d = (dx, du), and V(dx) = 1/2 dx'P dx + p'dx of all that follows, back from the last node,

    W_uu + B'PB = L D L',   Y = L^-1 (W_ux + B'PA),   K = -L'^-1 D^-1 Y,   P_i = W_xx + A'PA - Y'D^-1 Y.

The first node stays. The last one does too: its gap e costs rho/2 e'e + lambda'e, and lambda takes over what
is missing with every step (a method of multipliers). Where active rows are as stiff as rho, as on hundreds of
blocks far shorter than the tolerance, that takes hundreds of steps: there rho grows (interior_point.py).

W holds the curvature of the rows, sum of z d2g + (z/s) grad g grad g', and is positive.
"""

from typing import NamedTuple

from planner.base.arrays import FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, where
from planner.base.views import clear
from planner.joint.curvature import add_laws, add_normal, put_model
from planner.joint.forces import put_force, put_slopes
from planner.joint.row_kinds import SIXTH

END = 1e9  # rho [-], at first; with 1e6 the last node's gap stays at 1e-5 where prox has grown
TO_BOUNDARY = 0.995  # of the way to the nearest bound that a step may go [-]


class Factor(NamedTuple):
    """The recursion of N steps; S = 3 A, C = A + 1."""

    K: FloatArray  # (N, C, S)
    L: FloatArray  # (N, C, C) below its diagonal, on it 1/D
    push: FloatArray  # (N, S) P of what follows times the gap
    dx: FloatArray  # (N+1, S) the step
    du: FloatArray  # (N, C)


class Room(NamedTuple):
    """Memory for one step; D = S + C."""

    y: FloatArray  # (13, A)
    row: FloatArray  # (D,)
    W: FloatArray  # (D, D)
    P: FloatArray  # (S, S)
    PA: FloatArray  # (S, S)
    PB: FloatArray  # (S, C)
    Y: FloatArray  # (C, S)
    by_h: FloatArray  # (S,)
    rest: FloatArray  # (S,)
    lambda_of: FloatArray  # (S,) of a node
    force: FloatArray  # (C,)
    slope: FloatArray  # (R,)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def step_of_h(x, u, axes, out):
    """out (3 A,) the derivative of the next node by h."""
    h = u[axes]
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        out[k] = v + h * (a + 0.5 * h * j)
        out[axes + k] = a + h * j
        out[2 * axes + k] = j


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _factor_step(sizes, u, by_h, room, K, L, bad):
    """K and L of a step and P before it, by P behind it and W. Where a pivot is not positive 1 is added to `bad`."""
    axes, S, C = len(sizes.axes), len(sizes.state), len(sizes.control)
    h = u[axes]
    P, PA, PB, W, Y = room.P, room.PA, room.PB, room.W, room.Y
    for c in range(S):
        total = 0.0 * h
        for m in range(S):
            total += P[c, m] * by_h[m]
        PB[c, axes] = total
        for k in range(axes):
            p, v, a = P[c, k], P[c, axes + k], P[c, 2 * axes + k]
            PB[c, k] = h * (a + h * (0.5 * v + h * p * SIXTH))
            PA[c, k], PA[c, axes + k], PA[c, 2 * axes + k] = p, h * p + v, h * (0.5 * h * p + v) + a
    for c in range(C):  # W_ux + B'PA = W_ux + (A'PB)'
        for k in range(axes):
            p, v, a = PB[k, c], PB[axes + k, c], PB[2 * axes + k, c]
            Y[c, k] = p + W[S + c, k]
            Y[c, axes + k] = h * p + v + W[S + c, axes + k]
            Y[c, 2 * axes + k] = h * (0.5 * h * p + v) + a + W[S + c, 2 * axes + k]
    for c in range(C):
        for d in range(c + 1):
            if d < axes:
                p, v, a = PB[d, c], PB[axes + d, c], PB[2 * axes + d, c]
                total = h * (a + h * (0.5 * v + h * p * SIXTH))
            else:
                total = 0.0 * h
                for m in range(S):
                    total += by_h[m] * PB[m, c]
            total += W[S + c, S + d]
            for m in range(d):
                total -= L[c, m] * L[d, m] * room.force[m]
            if d < c:
                L[c, d] = total * L[d, d]
            else:
                good = total > 0.0
                bad = where(good, bad, 1.0)
                room.force[c] = where(good, total, 1.0)
                L[c, c] = 1.0 / room.force[c]
    for s in range(S):
        for c in range(C):
            for m in range(c):
                Y[c, s] -= L[c, m] * Y[m, s]
    for k in range(axes):  # A'PA, from PA, column by column
        for t in range(S):
            p, v, a = PA[k, t], PA[axes + k, t], PA[2 * axes + k, t]
            P[k, t], P[axes + k, t], P[2 * axes + k, t] = p, h * p + v, h * (0.5 * h * p + v) + a
    for s in range(S):
        for c in range(C):
            K[c, s] = Y[c, s] * L[c, c]
    for s in range(S):
        for t in range(s + 1):
            total = P[s, t] + W[s, t]
            for c in range(C):
                total -= K[c, s] * Y[c, t]
            P[s, t] = total
            P[t, s] = total
    for s in range(S):
        for c in range(C - 1, -1, -1):
            total = -K[c, s]
            for m in range(c + 1, C):
                total -= L[m, c] * K[m, s]
            K[c, s] = total
    return bad


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _backward_step(sizes, group, i, x, u, rows, pull, first, aim, second, end, factor, p, room):
    """The controls of step i where its node stays, into factor.du; p (S,), lambda behind it, becomes that before it."""
    axes, S, C = len(sizes.axes), len(sizes.state), len(sizes.control)
    w, rest, by_h, force = room.row, room.rest, room.by_h, room.force
    h, last = u[i, axes], group.last[i] > 0.0
    if anywhere(last):
        for s in range(S):
            p[s] = where(last, end[s], p[s])
    put_force(sizes, group, rows, i, x[i], u[i], first, aim, second, w)
    per = group.per_h[i]
    w[S + axes] += group.real[i] + 2.0 * pull * (h - group.h[i]) * per * per
    for k in range(axes):
        w[S + k] += group.smooth[i] * u[i, k] * group.per_box[0, k] * group.per_box[0, k]
    for s in range(S):
        rest[s] = p[s] + factor.push[i, s]
    step_of_h(x[i], u[i], axes, by_h)
    total = w[S + axes]
    for s in range(S):
        total += by_h[s] * rest[s]
    force[axes] = total
    for k in range(axes):
        p0, v0, a0 = rest[k], rest[axes + k], rest[2 * axes + k]
        force[k] = w[S + k] + h * (a0 + h * (0.5 * v0 + h * p0 * SIXTH))
        p[k], p[axes + k] = w[k] + p0, w[axes + k] + h * p0 + v0
        p[2 * axes + k] = w[2 * axes + k] + h * (0.5 * h * p0 + v0) + a0
    K, L = factor.K[i], factor.L[i]
    for s in range(S):
        for c in range(C):
            p[s] += K[c, s] * force[c]
    for c in range(C):
        total = -force[c]
        for m in range(c):
            total -= L[c, m] * factor.du[i, m]
        factor.du[i, c] = total
    for c in range(C - 1, -1, -1):
        total = factor.du[i, c] * L[c, c]
        for m in range(c + 1, C):
            total -= L[m, c] * factor.du[i, m]
        factor.du[i, c] = total


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def factor_steps(sizes, group, held, x, u, gap, rows, pull, prox, rho, end, factor, room, scratch):
    """The recursion into `factor`, and the controls of the first step, towards s z = 0, as `backward`: pull, the weight of
    (h - its guess)^2, prox, that of dh^2 beside, and rho of the last node. Where it breaks down what is returned is not
    0."""
    axes, S, N = len(sizes.axes), len(sizes.state), sizes.steps
    P, W = room.P, room.W
    clear(P)
    clear(room.lambda_of)
    bad = 0.0 * pull
    for i in range(N - 1, -1, -1):
        last = group.last[i] > 0.0
        if anywhere(last):
            for s in range(S):
                for t in range(S):
                    P[s, t] = where(last, rho if s == t else 0.0 * rho, P[s, t])
        for s in range(S):
            total = 0.0 * pull
            for t in range(S):
                total += P[s, t] * gap[i, t]
            factor.push[i, s] = total
        put_model(sizes, group, rows, i, x[i], u[i], W, room.row)
        if sizes.any_normal:
            add_normal(sizes, group, rows, i, x, u, W)
        if held is not None and sizes.any_laws:
            add_laws(sizes, group, held, rows, i, x, u, W, scratch)
        W[S + axes, S + axes] += 2.0 * (pull + prox) * group.per_h[i] * group.per_h[i]
        for k in range(axes):
            W[S + k, S + k] += group.smooth[i] * group.per_box[0, k] * group.per_box[0, k]
            W[S + k, S + k] += 1.0 - group.real[i]
        step_of_h(x[i], u[i], axes, room.by_h)
        bad = _factor_step(sizes, u[i], room.by_h, room, factor.K[i], factor.L[i], bad)
        _backward_step(sizes, group, i, x, u, rows, pull, True, pull, pull, end, factor, room.lambda_of, room)
    return bad


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def backward(sizes, group, x, u, rows, pull, aim, second, end, factor, room):
    """The controls of the Newton step towards s z = aim (forces.py, `push_of`) where nodes stay, into factor.du; end (3 A,)
    is lambda of the last node."""
    clear(room.lambda_of)
    for i in range(sizes.steps - 1, -1, -1):
        _backward_step(
            sizes, group, i, x, u, rows, pull, False, aim, second, end, factor, room.lambda_of, room
        )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def forward(sizes, group, x, u, gap, rows, first, aim, second, factor, room, end):
    """The step of nodes and controls into `factor`, and of slacks and multipliers into `rows`. Returns the shares of it that
    keep slacks and multipliers positive, and the sums of s dz, z ds and ds dz; end (S,) = the step of the last node."""
    axes, S, C, N, R = (
        len(sizes.axes),
        len(sizes.state),
        len(sizes.control),
        sizes.steps,
        sizes.rows,
    )
    dx, du, d, by_h, slope = factor.dx, factor.du, room.row, room.by_h, room.slope
    none = 0.0 * aim
    s_dz, z_ds, ds_dz = none, none, none
    # the largest -ds/s and -dz/z so far, as fractions: comparing them takes no division
    over_s, under_s, over_z, under_z = none, none + 1.0, none, none + 1.0
    for s in range(S):
        dx[0, s], end[s] = none, none
    for i in range(N):
        h, real = u[i, axes], group.real[i]
        for c in range(C):
            total = du[i, c]
            for s in range(S):
                total += factor.K[i, c, s] * dx[i, s]
            du[i, c] = total * real
            d[S + c] = du[i, c]
        for s in range(S):
            d[s] = dx[i, s]
        step_of_h(x[i], u[i], axes, by_h)
        dh = du[i, axes]
        for k in range(axes):
            dp, dv, da, dj = d[k], d[axes + k], d[2 * axes + k], d[S + k]
            dx[i + 1, k] = dp + h * (dv + h * (0.5 * da + h * dj * SIXTH)) + by_h[k] * dh + gap[i, k]
            dx[i + 1, axes + k] = dv + h * (da + 0.5 * h * dj) + by_h[axes + k] * dh + gap[i, axes + k]
            dx[i + 1, 2 * axes + k] = da + h * dj + by_h[2 * axes + k] * dh + gap[i, 2 * axes + k]
        last = group.last[i] > 0.0
        if anywhere(last):
            for s in range(S):
                end[s] = where(last, dx[i + 1, s], end[s])
                dx[i + 1, s] = where(last, 0.0, dx[i + 1, s])
        put_slopes(sizes, group, rows, i, x[i], u[i], d, slope)
        for r in range(R):
            s_r, z_r, per = rows.s[i, r], rows.z[i, r], rows.per_s[i, r]
            ds = where(per > 0.0, -(rows.g[i, r] + s_r) - slope[r], 0.0)
            left = none if first else aim - second * rows.ds[i, r]
            dz = (left - z_r * ds) * per - z_r
            if first:
                rows.ds[i, r] = ds * dz
            else:
                rows.ds[i, r], rows.dz[i, r] = ds, dz
            s_dz, z_ds, ds_dz = s_dz + s_r * dz, z_ds + z_r * ds, ds_dz + ds * dz
            farther = -ds * under_s > over_s * s_r
            over_s, under_s = where(farther, -ds, over_s), where(farther, s_r, under_s)
            farther = -dz * under_z > over_z * z_r
            over_z, under_z = where(farther, -dz, over_z), where(farther, z_r, under_z)
    along, dual = over_s / under_s, over_z / under_z
    along = where(along > TO_BOUNDARY, TO_BOUNDARY / larger(along, TO_BOUNDARY), none + 1.0)
    dual = where(dual > TO_BOUNDARY, TO_BOUNDARY / larger(dual, TO_BOUNDARY), none + 1.0)
    return along, dual, s_dz, z_ds, ds_dz


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def gaps(sizes, group, x, u, out):
    """out (N, 3 A) = f(x, u) - the next node. Returns the largest one, and that at the last node."""
    axes, N, S = len(sizes.axes), sizes.steps, len(sizes.state)
    most, at_end = 0.0 * u[0, axes], 0.0 * u[0, axes]
    for i in range(N):
        h = u[i, axes]
        for k in range(axes):
            p, v, a, j = x[i, k], x[i, axes + k], x[i, 2 * axes + k], u[i, k]
            out[i, k] = p + h * (v + h * (0.5 * a + h * j * SIXTH)) - x[i + 1, k]
            out[i, axes + k] = v + h * (a + 0.5 * h * j) - x[i + 1, axes + k]
            out[i, 2 * axes + k] = a + h * j - x[i + 1, 2 * axes + k]
        largest = 0.0 * h
        for s in range(S):
            out[i, s] = where(group.real[i] > 0.0, out[i, s], 0.0)
            largest = larger(magnitude(out[i, s]), largest)
        most = larger(largest, most)
        at_end = where(group.last[i] > 0.0, largest, at_end)
    return most, at_end
