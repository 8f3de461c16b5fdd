"""A Newton step of the motion in time, by a recursion along its steps (Riccati), linear in their number.

Nodes x = (p, v, a), controls u = (j, h), and the gaps r = f(x, u) - x_next of the kinematics

    p + h v + h2 a/2 + h3 j/6,    v + h a + h2 j/2,    a + h j

with their derivatives A (the same triangle for every axis) and B. With the model 1/2 d'W d + w'd of step i in
d = (dx, du), and V(dx) = 1/2 dx'P dx + p'dx of all that follows, back from the last node,

    K = -(W_uu + B'PB)^-1 (W_ux + B'PA),      P_i = W_xx + A'PA + K'(W_ux + B'PA),      lambda = P dx + p.

The first node stays. The last one does too: its gap e costs rho/2 e'e + lambda'e, and lambda takes over what
is missing with every step (a method of multipliers). Where active rows are as stiff as rho, as on hundreds of
blocks far shorter than the tolerance, that takes hundreds of steps: there rho grows (interior_point.py).

W holds the curvature of the rows, sum of z d2g + (z/s) grad g grad g', and is positive.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.joint.curvature import model_of_rows
from planner.joint.law_curvature import add_law_curvature
from planner.joint.normal_rows import BETWEEN, add_normal_curvature, stay_of
from planner.joint.rows import NORMAL_NODE, NORMAL_ROWS, VECTOR_OF_NODE, VECTORS, second_of, vector_of

END = 1e9  # rho [-], at first; with 1e6 the last node's gap stays at 1e-5 where prox has grown


class NewtonStep(NamedTuple):
    """Of N steps."""

    dx: FloatArray  # (N+1, S)
    du: FloatArray  # (N, C)
    after: FloatArray  # (N, S) lambda behind every step


class Factor(NamedTuple):
    """The recursion of N steps; S = 3 A, C = A + 1."""

    K: FloatArray  # (N, C, S)
    L: FloatArray  # (N, C, C) Cholesky factor of W_uu + B'PB
    P: FloatArray  # (N+1, S, S)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def step_of_h(x, u, axes, out):
    """out (3 A,) the derivative of the next node by h."""
    h = u[axes]
    for k in range(axes):
        v, a, j = x[axes + k], x[2 * axes + k], u[k]
        out[k] = v + h * (a + 0.5 * h * j)
        out[axes + k] = a + h * j
        out[2 * axes + k] = j


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _times_transposed(M, h, axes, out):
    """out = A'M for M (3 A, ..)."""
    for k in range(axes):
        for c in range(M.shape[1]):
            p, v, a = M[k, c], M[axes + k, c], M[2 * axes + k, c]
            out[k, c], out[axes + k, c], out[2 * axes + k, c] = p, h * p + v, h * (0.5 * h * p + v) + a


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def factor_steps(x, u, legs, limits, lin, barrier, pull, last, factor):
    """The recursion into `factor`, with a barrier (curvature.py), the weight of (dh/limits.h)^2, and rho of the last
    node. False where it breaks down."""
    N, axes = len(u), u.shape[1] - 1
    S, C = 3 * axes, axes + 1
    size, R = S + C, lin.g.shape[1]
    W, G = np.empty((size, size)), np.empty((VECTORS, axes, axes))
    of = np.array([vector_of(r, axes) for r in range(R)])
    PA, APA, PB, by_h = np.empty((S, S)), np.empty((S, S)), np.empty((S, C)), np.empty(S)
    Hux, Huu, per = np.empty((C, S)), np.empty((C, C)), np.empty(C)
    P = factor.P
    P[N] = 0.0
    for k in range(S):
        P[N, k, k] = last
    for i in range(N - 1, -1, -1):
        h, own = u[i, axes], P[i + 1]
        model_of_rows(W, G, legs, limits, lin, i, barrier, of)
        of_own = barrier.z[i, 8 * axes + NORMAL_ROWS :]
        add_normal_curvature(
            W, limits.normal[i], limits.pace[i], limits.turns[i], x[i], u[i], of_own[:BETWEEN]
        )
        add_law_curvature(W, limits, i, x[i], u[i], of_own[BETWEEN:])
        W[size - 1, size - 1] += 2.0 * pull / limits.h[i] ** 2
        if limits.on[i, 8 * axes + NORMAL_ROWS]:
            priced = 0.0
            for m in range(3):
                row = 8 * axes + (NORMAL_NODE, NORMAL_ROWS, NORMAL_ROWS + 1)[m]
                priced += barrier.z[i, row] + (barrier.z[i - 1, row] if i else 0.0)
            stay = stay_of(limits.normal[i], x[i], u[i], priced)
            for k in range(axes):
                W[axes + k, axes + k] += stay
        for k in range(axes):
            W[S + k, S + k] += 2.0 * limits.smooth[i] * limits.h[i] / limits.box[0, k] ** 2
        step_of_h(x[i], u[i], axes, by_h)
        # P is symmetric: (P A)' = A'P
        _times_transposed(own, h, axes, PA)  # A'P, (S, S)
        for c in range(S):
            total = 0.0
            for m in range(S):
                total += own[c, m] * by_h[m]
            PB[c, axes] = total
            for k in range(axes):
                PB[c, k] = h * (own[c, 2 * axes + k] + h * (0.5 * own[c, axes + k] + h * own[c, k] / 6.0))
        # A'PA from A'P: its columns
        for row in range(S):
            for k in range(axes):
                p, v, a = PA[row, k], PA[row, axes + k], PA[row, 2 * axes + k]
                APA[row, k], APA[row, axes + k], APA[row, 2 * axes + k] = (
                    p,
                    h * p + v,
                    h * (0.5 * h * p + v) + a,
                )
        # B'PA = (A'PB)', W_ux from the lower triangle
        for c in range(C):
            for k in range(axes):
                p, v, a = PB[k, c], PB[axes + k, c], PB[2 * axes + k, c]
                Hux[c, k] = p + W[S + c, k]
                Hux[c, axes + k] = h * p + v + W[S + c, axes + k]
                Hux[c, 2 * axes + k] = h * (0.5 * h * p + v) + a + W[S + c, 2 * axes + k]
        for c in range(C):
            for d in range(c + 1):
                if d < axes:
                    total = h * (PB[2 * axes + d, c] + h * (0.5 * PB[axes + d, c] + h * PB[d, c] / 6.0))
                else:
                    total = 0.0
                    for m in range(S):
                        total += by_h[m] * PB[m, c]
                Huu[c, d] = total + W[S + c, S + d]
        # Cholesky
        L = factor.L[i]
        L[:] = 0.0
        for c in range(C):
            for d in range(c + 1):
                total = Huu[c, d]
                for m in range(d):
                    total -= L[c, m] * L[d, m]
                if c != d:
                    L[c, d] = total * per[d]
                else:
                    if not total > 0.0:
                        return False
                    L[c, c] = np.sqrt(total)
                    per[c] = 1.0 / L[c, c]
        K = factor.K[i]
        for s in range(S):
            for c in range(C):
                total = -Hux[c, s]
                for m in range(c):
                    total -= L[c, m] * K[m, s]
                K[c, s] = total * per[c]
        # P = W_xx + A'PA - Y'Y with Y = L^-1 Hux (K holds -Y)
        for s in range(S):
            for t in range(s + 1):
                total = APA[s, t] + W[s, t]
                for c in range(C):
                    total -= K[c, s] * K[c, t]
                P[i, s, t] = total
                P[i, t, s] = total
        for s in range(S):
            for c in range(C - 1, -1, -1):
                total = K[c, s]
                for m in range(c + 1, C):
                    total -= L[m, c] * K[m, s]
                K[c, s] = total * per[c]
    return True


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def forces(limits, lin, q, pull, u, w):
    """w (N, 4 A + 1) = the gradient of time, pull and smoothness, and the sum of q (N, R) grad g."""
    N, axes = len(w), lin.n.shape[2]
    R, more = lin.g.shape[1], 8 * axes
    of = np.array([vector_of(r, axes) for r in range(R)])
    F = np.empty((VECTORS, axes))
    for i in range(N):
        F[:] = 0.0
        w[i] = 0.0
        own = 1.0 + 2.0 * pull * (u[i, axes] - limits.h[i]) / limits.h[i] ** 2
        for k in range(axes):
            w[i, 3 * axes + k] = 2.0 * limits.smooth[i] * limits.h[i] * u[i, k] / limits.box[0, k] ** 2
        for r in range(R):
            if not limits.on[i, r]:
                continue
            m = of[r]
            if m == -2:
                row = lin.own[i, r - more - NORMAL_ROWS]
                for k in range(4 * axes):
                    w[i, k] += q[i, r] * row[k]
                own += q[i, r] * row[4 * axes]
                continue
            if m < 0:
                own += q[i, r] / limits.h[i] * (1.0 if r == more else -1.0)
                continue
            for k in range(axes):
                F[m, k] += q[i, r] * lin.n[i, r, k]
            c = second_of(r - more)
            if c >= 0:
                for k in range(axes):
                    F[VECTOR_OF_NODE[c], k] += q[i, r] * lin.node[i, c, k]
        for m in range(VECTORS):
            for k in range(axes):
                own += F[m, k] * lin.e[i, m, k]
                for a in range(4):
                    w[i, a * axes + k] += lin.alpha[i, m, a] * F[m, k]
        w[i, 4 * axes] = own


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def newton_step(x, u, gap, w, end, factor, step):
    """The step for the gradient w (N, 4 A + 1) and the gaps (N, 3 A); end (3 A,) is lambda of the last
    node."""
    dx, du, after = step
    N, axes = len(u), u.shape[1] - 1
    S, C = 3 * axes, axes + 1
    p, rest, by_h, force = end.copy(), np.empty(S), np.empty(S), np.empty(C)
    K, L, P = factor
    for i in range(N - 1, -1, -1):
        h = u[i, axes]
        after[i] = p
        for s in range(S):
            total = p[s]
            for t in range(S):
                total += P[i + 1, s, t] * gap[i, t]
            rest[s] = total
        step_of_h(x[i], u[i], axes, by_h)
        total = w[i, S + axes]
        for s in range(S):
            total += by_h[s] * rest[s]
        force[axes] = total
        for k in range(axes):
            p0, v0, a0 = rest[k], rest[axes + k], rest[2 * axes + k]
            force[k] = w[i, S + k] + h * (a0 + h * (0.5 * v0 + h * p0 / 6.0))
            p[k], p[axes + k] = w[i, k] + p0, w[i, axes + k] + h * p0 + v0
            p[2 * axes + k] = w[i, 2 * axes + k] + h * (0.5 * h * p0 + v0) + a0
        for s in range(S):
            for c in range(C):
                p[s] += K[i, c, s] * force[c]
        for c in range(C):
            total = -force[c]
            for m in range(c):
                total -= L[i, c, m] * du[i, m]
            du[i, c] = total / L[i, c, c]
        for c in range(C - 1, -1, -1):
            total = du[i, c]
            for m in range(c + 1, C):
                total -= L[i, m, c] * du[i, m]
            du[i, c] = total / L[i, c, c]
    dx[0] = 0.0
    for i in range(N):
        h = u[i, axes]
        for c in range(C):
            total = du[i, c]
            for s in range(S):
                total += K[i, c, s] * dx[i, s]
            du[i, c] = total
        step_of_h(x[i], u[i], axes, by_h)
        dh = du[i, axes]
        for k in range(axes):
            dp, dv, da, dj = dx[i, k], dx[i, axes + k], dx[i, 2 * axes + k], du[i, k]
            dx[i + 1, k] = dp + h * (dv + h * (0.5 * da + h * dj / 6.0)) + by_h[k] * dh + gap[i, k]
            dx[i + 1, axes + k] = dv + h * (da + 0.5 * h * dj) + by_h[axes + k] * dh + gap[i, axes + k]
            dx[i + 1, 2 * axes + k] = da + h * dj + by_h[2 * axes + k] * dh + gap[i, 2 * axes + k]
        for s in range(S):
            total = after[i, s]
            for t in range(S):
                total += P[i + 1, s, t] * dx[i + 1, t]
            after[i, s] = total


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def gaps(x, u, out):
    """out (N, 3 A) = f(x, u) - the next node."""
    N, axes = len(u), u.shape[1] - 1
    for i in range(N):
        h = u[i, axes]
        for k in range(axes):
            p, v, a, j = x[i, k], x[i, axes + k], x[i, 2 * axes + k], u[i, k]
            out[i, k] = p + h * (v + h * (0.5 * a + h * j / 6.0)) - x[i + 1, k]
            out[i, axes + k] = v + h * (a + 0.5 * h * j) - x[i + 1, axes + k]
            out[i, 2 * axes + k] = a + h * j - x[i + 1, 2 * axes + k]
