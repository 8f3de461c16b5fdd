"""The interior-point method behind `JerkLimited`: model, weigh, factorise, step. All in scaled units.

It is a primal-dual method for optimal control whose every step is a linear-quadratic problem, solved by a
Riccati recursion over the grid (Rao, Wright & Rawlings 1998, J. Optim. Theory Appl. 99:723; as a library
HPIPM, Frison & Diehl 2020, IFAC-PapersOnLine 53:6563), here with two states and one control written out, and
with the end fixed too (riccati.py).

Each row of rows.py has slacks s and multipliers lam. Eliminating their Newton steps adds lam/s times the
row's square to the Hessian; what remains is the linear-quadratic problem. The Hessian is that of the
Lagrangian; where it is not convex, only a fraction of the curvature of rows and dynamics counts, or none.
Steps are predictor-corrector (Mehrotra 1992, SIAM J. Optim. 2:575): the step without a barrier says how far
the barrier may fall, and its second-order terms are made up for.

The barrier counts by time: an interval's rows share mu times its duration h, as if the barrier were
integrated along the motion. So a ramp of a nanometre beside millimetres at constant speed has no more than
its part in it, and finer grids do not change the problem.

What every number is set to, and why: settings.py.
"""

from typing import NamedTuple

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.layout import (
    DS,
    LANE_MATH,
    LANES,
    PI,
    STEP,
    STEP_END,
    STEP_PI,
    X_END,
    P,
    U,
    X,
    rows_of,
)
from planner.feedrate.jerk.passes import correct, direction, first_slacks, modelled, predicted
from planner.feedrate.jerk.riccati import costates, offsets, riccati
from planner.feedrate.jerk.rows import PASSING

# How `minimise_time` ended.
SOLVED, OUT_OF_ITERATIONS, NOT_CONVEX, STALLED = range(4)


class Minimum(NamedTuple):
    """How `minimise_time` ended on a window, and how good what it left in `Blocks` is."""

    status: int  # `SOLVED`, `OUT_OF_ITERATIONS`: what was reached by then; `NOT_CONVEX`, `STALLED`: no use
    iterations: int  # used
    gap: float  # complementarity, as a fraction of the time
    residual: float  # largest of the rows, as a fraction of the limits
    defect: float  # largest of the dynamics, as a fraction of the largest feed


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _beyond(g, w, primal, edge, beyond, m):
    """By how much p ds exceeds a share of the domain 3 vm^2 after a step: into `beyond` (LANES,); negative
    inside."""
    for i in range(m):
        vm = 0.5 * (
            np.sqrt(w[X + i] + primal * w[STEP + i]) + np.sqrt(w[X_END + i] + primal * w[STEP_END + i])
        )
        beyond[i] = (w[P + i] + primal * w[STEP + 2 * LANES + i]) * g[DS + i] - 3.0 * edge * vm * vm


@njit(cache=True, error_model="numpy")
def within_domain(blocks, primal, settings):
    """The step length, reduced until the kinematics of every interval have a solution: p ds < 3 vm^2."""
    beyond = np.empty(LANES)
    for b in range(len(blocks.work)):
        g, w, m = blocks.grid[b], blocks.work[b], min(LANES, blocks.n - b * LANES)
        while primal >= settings.shortest:
            _beyond(g, w, primal, settings.domain_edge, beyond, m)
            if not beyond[:m].max() > 0.0:
                break
            primal *= settings.shortening
    return primal


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def advance(blocks, primal, dual):
    """Take the step of the profile and of the dynamics' multipliers; returns the largest relative change of
    x."""
    change = np.zeros(LANES)
    for b in range(len(blocks.work)):
        w, m = blocks.work[b], min(LANES, blocks.n - b * LANES)
        for i in range(m):
            change[i] = max(change[i], abs(w[STEP_END + i]) / w[X_END + i] if w[X_END + i] > 0.0 else 0.0)
            w[X + i] += primal * w[STEP + i]
            w[X_END + i] += primal * w[STEP_END + i]
            w[U + i] += primal * w[STEP + LANES + i]
            w[P + i] += primal * w[STEP + 2 * LANES + i]
            w[PI + i] += dual * w[STEP_PI + i]
    return primal * change.max()


@njit(cache=True, error_model="numpy", nogil=True)
def minimise_time(blocks, tol, iterations, settings):
    """The fastest profile over a window from the one that `blocks` holds, in its place; x_0, u_0, x_N = u_N =
    0 are given.

    tol        : relative gap that is asked for [-]
    iterations : at most

    Returns a `Minimum`.
    """
    passing = np.empty(PASSING)
    first_slacks(blocks, passing, settings)
    sides = 2 * rows_of(blocks.axes, blocks.jumps)
    primal, dual = 0.0, 0.0
    stalled, far = 0, False
    status = OUT_OF_ITERATIONS
    done = 0
    while True:
        # Model the Lagrangian at the iterate; its gradient and Hessian with the slacks eliminated.
        gap, total, residual, defect = modelled(blocks, passing, primal, dual)
        if gap <= tol * total and residual <= settings.residual and defect <= settings.defect:
            status = SOLVED
            break
        if stalled == settings.stall_rounds or not gap < np.inf:
            status = STALLED
            break
        if done == iterations:
            break

        # Factorise, with as much of the curvature of rows and dynamics as leaves the model convex.
        fraction = 1.0
        convex = riccati(blocks, fraction)
        while not convex and fraction > 0.0:
            fraction = settings.fraction_less * fraction if fraction > settings.fraction_min else 0.0
            convex = riccati(blocks, fraction)
        if not convex:
            status = NOT_CONVEX
            break

        # Predictor: Newton's step without a barrier.
        offsets(blocks, fraction)
        primal, dual, affine_gap = predicted(blocks, settings)

        # How far the barrier falls: as the predictor's gap says, not at all while x still changes much.
        sigma = 1.0 if far else min((affine_gap / gap) ** 3, settings.sigma_max)
        mu = max(sigma * gap / total, settings.gap_floor * tol) / sides

        # Corrector: the step to that barrier with the predictor's second-order terms; the factors stay.
        second_order = 1.0 if min(primal, dual) > settings.predicted_min else 0.0
        barrier = mu, second_order
        correct(blocks, barrier)
        offsets(blocks, fraction)
        primal, dual = direction(blocks, barrier, settings)
        costates(blocks, fraction)

        # Go as far as slacks, multipliers and kinematics stay in their domains.
        primal = within_domain(blocks, primal, settings)
        change = advance(blocks, primal, dual)
        done += 1

        # Give up where steps lead nowhere.
        far = change > settings.change_max
        stalled = 0 if primal >= settings.stall_step else stalled + 1
    return Minimum(status, done, gap / total, residual, defect)
