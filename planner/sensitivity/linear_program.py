"""Lower bounds of a linear programme with banded rows, by a primal-dual interior-point method.

    minimise c.x    subject to    low_r <= g_r.x <= high_r

For any multipliers z, z' >= 0 of the upper and lower bounds, with the residual r = c + sum g (z - z'), and |x_i| <= reach_i,

    c.x >= sum (z' low - z high) - sum |r_i| reach_i,

whatever rounding did to them and however near to the optimum they are. Of a programme of parts that share no variable, each
part is bounded by its own terms.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.smoothing.interior_point import factorise, solve

TO_BOUNDARY = 0.95  # of the way to the nearest bound that a step goes [-]
FLAT = 1e-13  # of a pivot, added to it [-]: variables that hardly any row holds


class Programme(NamedTuple):
    """n variables in an order in which rows reach no further than `width` - 1; m rows of ascending columns."""

    cost: FloatArray  # (n,)
    first: Array  # (m+1,) of each row in `column` and `value`
    column: Array
    value: FloatArray
    low: FloatArray  # (m,) bounds; -inf where there is none
    high: FloatArray  # (m,)
    start: FloatArray  # (n,) strictly within all of them
    reach: FloatArray  # (n,)
    width: int


class Work(NamedTuple):
    """Memory: slacks, multipliers and their steps (2, m) of upper and lower bounds, and of rows (m,)."""

    slack: FloatArray
    z: FloatArray
    dz: FloatArray
    dz_1: FloatArray
    move: FloatArray
    weight: FloatArray


@njit(cache=True, error_model="numpy")
def _rows_of(program, x, out):
    """out (m,) = g x."""
    for r in range(len(out)):
        total = 0.0
        for e in range(program.first[r], program.first[r + 1]):
            total += program.value[e] * x[program.column[e]]
        out[r] = total


@njit(cache=True, error_model="numpy")
def _add_rows(program, weight, out):
    """out (n,) += sum of weight g."""
    for r in range(len(weight)):
        for e in range(program.first[r], program.first[r + 1]):
            out[program.column[e]] += weight[r] * program.value[e]


@njit(cache=True, error_model="numpy")
def _assemble(program, weight, band):
    """band (n, width): the upper triangle of sum weight g g'."""
    band[:] = 0.0
    for r in range(len(weight)):
        for e in range(program.first[r], program.first[r + 1]):
            by, i = weight[r] * program.value[e], program.column[e]
            for f in range(e, program.first[r + 1]):
                band[i, program.column[f] - i] += by * program.value[f]
    for i in range(len(band)):
        band[i, 0] = band[i, 0] * (1.0 + FLAT) if band[i, 0] > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def _step(program, work, band, mu, corrected, step):
    """step (n,) and the multipliers' by the factor `band`, with products `mu` behind it, corrected by the products of the
    step before; how far each may go, 1 / `TO_BOUNDARY` at most: primal, dual."""
    slack, z, dz, dz_1, move, weight = work
    two = program.low > -np.inf
    for r in range(len(move)):
        weight[r] = (mu + corrected * dz_1[0, r] * move[r]) / slack[0, r]
        if two[r]:
            weight[r] -= (mu - corrected * dz_1[1, r] * move[r]) / slack[1, r]
    step[:] = program.cost
    _add_rows(program, weight, step)
    step *= -1.0
    left = step.copy()
    solve(band, step)
    _rows_of(program, step, weight)
    if corrected > 0.0:  # once more for what rounding left of it, as the bound loses that times `reach`
        for r in range(len(move)):
            total = z[0, r] / slack[0, r] + z[1, r] / slack[1, r]
            weight[r] *= -total
        _add_rows(program, weight, left)
        solve(band, left)
        step += left
        _rows_of(program, step, weight)
    primal, dual = 1.0 / TO_BOUNDARY, 1.0 / TO_BOUNDARY
    for r in range(len(move)):
        for side in range(2 if two[r] else 1):
            sign = 1.0 - 2.0 * side
            aim = mu + corrected * sign * dz_1[side, r] * move[r]
            dz[side, r] = (aim + sign * z[side, r] * weight[r]) / slack[side, r] - z[side, r]
            if sign * weight[r] > 0.0:
                primal = min(primal, slack[side, r] / (sign * weight[r]))
            if dz[side, r] < 0.0:
                dual = min(dual, -z[side, r] / dz[side, r])
        move[r] = weight[r]
    return primal, dual


@njit(cache=True, error_model="numpy")
def _after(work, two, primal, dual):
    """The sum of products behind such a step."""
    slack, z, dz, _, move, _ = work
    total = 0.0
    for r in range(len(move)):
        total += (z[0, r] + dual * dz[0, r]) * (slack[0, r] - primal * move[r])
        if two[r]:
            total += (z[1, r] + dual * dz[1, r]) * (slack[1, r] + primal * move[r])
    return total


@njit(cache=True, error_model="numpy")
def multipliers(program, value, enough, iterations):
    """(2, m) the multipliers z and z' of upper and lower bounds that bound the optimum best, among so many iterations, or up to
    where they do to `enough`; `value` is about the optimum's size."""
    n, m = len(program.cost), len(program.high)
    x, two = program.start.copy(), program.low > -np.inf
    at, step, residual = np.empty(m), np.empty(n), np.empty(n)
    band = np.empty((n, program.width))
    work = Work(
        np.ones((2, m)), np.zeros((2, m)), np.zeros((2, m)), np.zeros((2, m)), np.zeros(m), np.zeros(m)
    )
    slack, z = work.slack, work.z
    best, least = z.copy(), np.inf
    bounded = m + np.sum(two)
    _rows_of(program, x, at)
    for iteration in range(iterations):
        gap = 0.0
        for r in range(m):
            for side in range(2 if two[r] else 1):
                slack[side, r] = program.high[r] - at[r] if side == 0 else at[r] - program.low[r]
                if iteration == 0:
                    z[side, r] = value / bounded / slack[side, r]
                gap += z[side, r] * slack[side, r]
        residual[:] = program.cost
        _add_rows(program, z[0] - z[1], residual)
        # c.x less the bound, but for what c.x is above the optimum
        loss = gap + np.sum(residual * x) + np.sum(np.abs(residual) * program.reach)
        by_cost = loss - np.sum(program.cost * x)
        if by_cost < least:
            least = by_cost
            best[:] = z
        if loss <= enough:
            break
        for r in range(m):
            work.weight[r] = z[0, r] / slack[0, r] + z[1, r] / slack[1, r]
        _assemble(program, work.weight, band)
        if not factorise(band):
            break
        primal, dual = _step(program, work, band, 0.0, 0.0, step)
        after = _after(work, two, min(primal, 1.0), min(dual, 1.0))
        work.dz_1[:] = work.dz
        # the cube of what is left without centring (Mehrotra 1992)
        primal, dual = _step(program, work, band, (after / gap) ** 3 * gap / bounded, 1.0, step)
        x += TO_BOUNDARY * primal * step
        for side in range(2):
            z[side] += TO_BOUNDARY * dual * work.dz[side]
        _rows_of(program, x, at)
    return best


def multipliers_by_part(
    program: Programme, part: Array, size: Array, enough: float, iterations: int
) -> FloatArray:
    """(2, m) `multipliers` of parts that share no variable, part by part: one that takes many iterations does not hold up the
    others, and the numbers of one stay in the processor's cache.

    part   : (n,) of each variable, ascending, and of rows, by the first one of each
    size   : (P,) of their optima, about; those whose cost is 0 have no multipliers
    enough : up to where each is bounded, share of its size [-]
    """
    z = np.zeros((2, len(program.high)))
    number = np.arange(len(size) + 1)
    row = np.searchsorted(part[program.column[program.first[:-1]]], number).tolist()
    at = np.searchsorted(part, number).tolist()
    for k in np.unique(part[program.cost != 0.0]).tolist():
        inside, rows = slice(at[k], at[k + 1]), slice(row[k], row[k + 1])
        first = program.first[row[k] : row[k + 1] + 1]
        entries = slice(first[0], first[-1])
        own = Programme(
            program.cost[inside],
            first - first[0],
            program.column[entries] - at[k],
            program.value[entries],
            program.low[rows],
            program.high[rows],
            program.start[inside],
            program.reach[inside],
            program.width,
        )
        z[:, rows] = multipliers(own, float(size[k]), enough * float(size[k]), iterations)
    return z


def bounds_by_part(program: Programme, z: FloatArray, part: Array) -> FloatArray:
    """(P,) what the optimum of each part is at least, by multipliers z (2, m).

    part : (n,) of each variable
    """
    count = int(part[-1]) + 1
    row = np.repeat(np.arange(len(program.high)), np.diff(program.first))
    residual = program.cost + np.bincount(program.column, (z[0] - z[1])[row] * program.value, len(part))
    low = np.where(np.isfinite(program.low), program.low, 0.0)
    terms = z[1] * low - z[0] * program.high
    of_rows = np.bincount(part[program.column[program.first[:-1]]], terms, count)
    return np.asarray(of_rows - np.bincount(part, np.abs(residual) * program.reach, count), dtype=np.float64)
