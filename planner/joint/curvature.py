"""The second-order model of a step's rows, sum of z d2g + (z/s) grad g grad g' (recursion.py)."""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.joint.rows import (
    FEED_NODE,
    FEED_ROWS,
    NORMAL_NODE,
    NORMAL_ROWS,
    SWITCH,
    TUBE_NODE,
    VECTOR_OF_NODE,
    VECTORS,
    second_of,
)


class Barrier(NamedTuple):
    """Of the rows of N steps."""

    z: FloatArray  # (N, R) multipliers
    ratio: FloatArray  # (N, R) z over the slacks


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def add_vector(W, axes, alpha, e, G):
    """W += J'GJ for one vector y with dy = J d."""
    h = 4 * axes
    for k in range(axes):
        along = 0.0
        for m in range(axes):
            along += G[k, m] * e[m]
        W[h, h] += e[k] * along
        for a in range(4):
            if alpha[a] == 0.0:
                continue
            W[h, a * axes + k] += alpha[a] * along
            for b in range(a + 1):
                both = alpha[a] * alpha[b]
                if both != 0.0:
                    for m in range(axes):
                        W[a * axes + k, b * axes + m] += both * G[k, m]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _add_row(W, axes, one, other, by):
    """W += by g g' for a row that depends on two vectors; of each alpha, e and the row's derivative (A,)."""
    size = 4 * axes + 1
    alpha, e, n = one
    other_alpha, other_e, other_n = other
    g = np.zeros(size)
    for k in range(axes):
        for a in range(4):
            g[a * axes + k] = alpha[a] * n[k] + other_alpha[a] * other_n[k]
        g[size - 1] += e[k] * n[k] + other_e[k] * other_n[k]
    for s in range(size):
        for t in range(s + 1):
            W[s, t] += by * g[s] * g[t]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def model_of_rows(W, G, legs, limits, lin, i, barrier, of):
    """W (4 A + 1, 4 A + 1), lower triangle, of the rows of step i, whose vectors are `of` (R,); G (13, A, A)
    is overwritten."""
    axes, z, ratio = lin.n.shape[2], barrier.z[i], barrier.ratio[i]
    more = 8 * axes
    W[:] = 0.0
    G[:] = 0.0
    for r in range(len(of)):
        if not limits.on[i, r]:
            continue
        m = of[r]
        if m == -2:
            row = lin.own[i, r - more - NORMAL_ROWS]
            for s in range(4 * axes + 1):
                for t in range(s + 1):
                    W[s, t] += ratio[r] * row[s] * row[t]
            continue
        if m < 0:
            W[4 * axes, 4 * axes] += ratio[r] / (limits.h[i] * limits.h[i])
            continue
        if r < more:
            k = r % axes
            G[m, k, k] += ratio[r] * lin.n[i, r, k] * lin.n[i, r, k]
            continue
        kind, flat = r - more, 0.0
        c, second = kind - TUBE_NODE, second_of(kind)
        if second >= 0 and (kind == SWITCH or legs.radius[limits.leg[i]] > 0.0):
            other = VECTOR_OF_NODE[second]
            own = lin.alpha[i, m], lin.e[i, m], lin.n[i, r]
            _add_row(W, axes, own, (lin.alpha[i, other], lin.e[i, other], lin.node[i, second]), ratio[r])
        else:
            for k in range(axes):
                for t in range(axes):
                    G[m, k, t] += ratio[r] * lin.n[i, r, k] * lin.n[i, r, t]
        if kind == FEED_NODE:
            flat = z[r] / limits.feed_node[i] ** 2
        elif FEED_ROWS <= kind < TUBE_NODE:
            flat = z[r] / lin.radius[i, kind - FEED_ROWS] ** 2
        elif 0 <= c <= 2:
            flat = z[r] / (limits.room_node[i] ** 2 if c == 0 else limits.room[i] ** 2)
            square = 0.0
            for k in range(axes):
                square += lin.tangent[i, c, k] ** 2
            if square > 0.0:
                for k in range(axes):
                    for t in range(axes):
                        G[m, k, t] -= flat * lin.tangent[i, c, k] * lin.tangent[i, c, t] / square
        elif kind == NORMAL_NODE:
            flat = z[r] / limits.normal_node[i] ** 2
        for k in range(axes):
            G[m, k, k] += flat
    for m in range(VECTORS):
        trace = 0.0
        for k in range(axes):
            trace += G[m, k, k]
        if trace != 0.0:  # or there is nothing of that vector
            add_vector(W, axes, lin.alpha[i, m], lin.e[i, m], G[m])
