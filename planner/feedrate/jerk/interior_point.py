"""The interior-point method behind `JerkLimited` (solver.py), in numba: model, weigh, factorise, step. All in scaled units.

It is a primal-dual method for optimal control whose every step is a linear-quadratic problem, solved by a Riccati recursion
over the grid (Rao, Wright & Rawlings 1998, J. Optim. Theory Appl. 99:723; as a library HPIPM, Frison & Diehl 2020, IFAC-PapersOnLine
53:6563), here with two states and one control written out, and with the end fixed too (riccati.py).

Each row of rows.py has slacks s and multipliers lam. Eliminating their Newton steps adds lam/s times the row's square to the
Hessian; what remains is the linear-quadratic problem. The Hessian is that of the Lagrangian; where it is not convex, only a fraction
of the curvature of rows and dynamics counts, or none. Steps are predictor-corrector (Mehrotra 1992, SIAM J. Optim. 2:575): the step
without a barrier says how far the barrier may fall, and its second-order terms are made up for.

The barrier counts by time: an interval's rows share mu times its duration h, as if the barrier were integrated along the motion. So a
ramp of a nanometre beside millimetres at constant speed has no more than its part in it, and finer grids do not change the problem.

What every number is set to, and why: settings.py.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.feedrate.jerk.riccati import offsets, riccati, slope
from planner.feedrate.jerk.rows import Profile, at_profile, empty_model, kinematics, linearise

# How `minimise_time` ended.
SOLVED, OUT_OF_ITERATIONS, NOT_CONVEX, STALLED = range(4)


class Minimum(NamedTuple):
    """What `minimise_time` found for a window of N intervals, and how good it is.

    profile    : the motion
    status     : `SOLVED`, `OUT_OF_ITERATIONS`: what was reached by then; `NOT_CONVEX`, `STALLED`: no use
    iterations : used
    gap        : complementarity, as a fraction of the time
    residual   : largest of the rows, as a fraction of the limits
    defect     : largest of the dynamics, as a fraction of the largest feed
    lam        : (N, M) multipliers of the rows' upper sides, then of their lower sides
    pi         : (N,) of the dynamics of x
    """

    profile: Profile
    status: int
    iterations: int
    gap: float
    residual: float
    defect: float
    lam: FloatArray
    pi: FloatArray


class NewtonStep(NamedTuple):
    """A Newton step of an `Iterate`.

    z     : (N+1, 3) of x, u and p
    slack : (N, M)
    lam   : (N, M)
    pi    : (N,)
    """

    z: FloatArray
    slack: FloatArray
    lam: FloatArray
    pi: FloatArray


@njit(cache=True, error_model="numpy", fastmath=True)
def weigh(model, at):
    """Add the rows' weights to the model's convex Hessian and gradient, without a barrier; returns their largest residual."""
    gradient, rows, values, hessian = model.gradient, model.rows, model.values, model.convex
    slack, lam = at.slack, at.lam
    n, count = values.shape
    lower = slack.shape[1] - count
    weights, pushes = np.empty(count), np.empty(count)
    worst = 0.0
    for i in range(n):
        for r in range(count):
            residual = values[i, r] + slack[i, r] - 1.0
            weights[r] = lam[i, r] / slack[i, r]
            pushes[r] = weights[r] * residual
            worst = max(worst, abs(residual))
        for r in range(lower):
            residual = slack[i, count + r] - values[i, r] - 1.0
            w = lam[i, count + r] / slack[i, count + r]
            weights[r] += w
            pushes[r] -= w * residual
            worst = max(worst, abs(residual))
        hxx, hxu, hxp, huu, hup, hpp = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        gx, gu, gp = 0.0, 0.0, 0.0
        for r in range(count):
            a, b, c, w = rows[i, 0, r], rows[i, 1, r], rows[i, 2, r], weights[r]
            hxx += w * a * a
            hxu += w * a * b
            hxp += w * a * c
            huu += w * b * b
            hup += w * b * c
            hpp += w * c * c
            gx += pushes[r] * a
            gu += pushes[r] * b
            gp += pushes[r] * c
        hessian[i, 0] += hxx
        hessian[i, 1] += hxu
        hessian[i, 2] += hxp
        hessian[i, 3] += huu
        hessian[i, 4] += hup
        hessian[i, 5] += hpp
        gradient[i, 0] += gx
        gradient[i, 1] += gu
        gradient[i, 2] += gp
    return worst


@njit(cache=True, error_model="numpy", fastmath=True)
def correct(model, at, mu, second_order, step):
    """Second half of a predictor-corrector step: add the barrier mu h to the gradient, less the predicted steps' second-order terms
    dslack dlam, which replace the step's lam (zeros if `second_order` is 0 instead of 1)."""
    gradient, rows, h = model.gradient, model.rows, model.duration
    slack, dslack, dlam = at.slack, step.slack, step.lam
    n, _, count = rows.shape
    lower = slack.shape[1] - count
    pushes = np.empty(count)
    for i in range(n):
        asked = mu * h[i]
        for r in range(count):
            bent = second_order * dslack[i, r] * dlam[i, r]
            dlam[i, r] = bent
            pushes[r] = (asked - bent) / slack[i, r]
        for r in range(lower):
            bent = second_order * dslack[i, count + r] * dlam[i, count + r]
            dlam[i, count + r] = bent
            pushes[r] -= (asked - bent) / slack[i, count + r]
        gx, gu, gp = 0.0, 0.0, 0.0
        for r in range(count):
            gx += pushes[r] * rows[i, 0, r]
            gu += pushes[r] * rows[i, 1, r]
            gp += pushes[r] * rows[i, 2, r]
        gradient[i, 0] += gx
        gradient[i, 1] += gu
        gradient[i, 2] += gp


@njit(cache=True, error_model="numpy", fastmath=True)
def direction(model, fraction, gains, at, mu, step, settings):
    """Fill the Newton step from an iterate, with the feedback `gains`; on entry step.lam holds the second-order terms to make up for.

    fraction : of the curvature of rows and dynamics that counts [-]

    Returns the lengths that profile and slacks, and that multipliers can go, and the complementarity sum(slack * lam) after them.
    """
    dynamics, rows, values, costate = model.dynamics, model.rows, model.values, model.costate
    h, x, slack, lam, pi = model.duration, at.x, at.slack, at.lam, at.pi
    dz, dslack, dlam, dpi = step.z, step.slack, step.lam, step.pi
    shrink, to_boundary = settings.feed_sq_shrink, settings.to_boundary
    n, count = values.shape
    lower = slack.shape[1] - count
    after = np.empty(count)
    primal, nearest, nearest_dual = 1.0, 0.0, 0.0
    now, mixed, mixed_dual, product = 0.0, 0.0, 0.0, 0.0  # sums of s lam, ds lam, s dlam, ds dlam
    dz[0, 0] = dz[0, 1] = 0.0
    for i in range(n):
        asked = mu * h[i]
        dx, du = dz[i, 0], dz[i, 1]
        dp = gains[i, 0] * dx + gains[i, 1] * du + gains[i, 2]
        dz[i, 2] = dp
        if i < n - 1:  # the multipliers of the last two intervals come last
            next_dx = dynamics[i, 0] * dx + dynamics[i, 1] * du + dynamics[i, 2] * dp + dynamics[i, 3]
            dz[i + 1, 0], dz[i + 1, 1] = next_dx, du + dp
            ahead = gains[i + 1, 3] * next_dx + gains[i + 1, 4] * (du + dp) + gains[i + 1, 7]
            dpi[i] = costate[i, 0] * (ahead + costate[i, 1]) - pi[i]
            if next_dx < -shrink * x[i + 1]:
                primal = min(primal, -shrink * x[i + 1] / next_dx)
        for r in range(count):
            after[r] = values[i, r] + rows[i, 0, r] * dx + rows[i, 1, r] * du + rows[i, 2, r] * dp
        for r in range(count):
            s, y = slack[i, r], lam[i, r]
            move = 1.0 - after[r] - s
            relative = move / s
            push = (asked - dlam[i, r]) / s - y * (1.0 + relative)
            dslack[i, r], dlam[i, r] = move, push
            nearest, nearest_dual = min(nearest, relative), min(nearest_dual, push / y)
            mixed += move * y
            mixed_dual += s * push
            product += move * push
            now += s * y
        for r in range(lower):
            s, y = slack[i, count + r], lam[i, count + r]
            move = 1.0 + after[r] - s
            relative = move / s
            push = (asked - dlam[i, count + r]) / s - y * (1.0 + relative)
            dslack[i, count + r], dlam[i, count + r] = move, push
            nearest, nearest_dual = min(nearest, relative), min(nearest_dual, push / y)
            mixed += move * y
            mixed_dual += s * push
            product += move * push
            now += s * y
    if -nearest > to_boundary:
        primal = min(primal, -to_boundary / nearest)
    dual = -to_boundary / nearest_dual if -nearest_dual > to_boundary else 1.0
    last_x, last_u, last_p = slope(model, fraction, dz, n - 1)
    _, _, before_p = slope(model, fraction, dz, n - 2)
    b2 = dynamics[n - 2, 2]
    pivot = dynamics[n - 1, 0] * b2 + dynamics[n - 1, 1] - dynamics[n - 1, 2]
    ahead = -(before_p + last_x * b2 + last_u - last_p) / pivot
    dpi[n - 1] = ahead - pi[n - 1]
    ahead = last_x + ahead * dynamics[n - 1, 0]
    dpi[n - 2] = costate[n - 2, 0] * (ahead + costate[n - 2, 1]) - pi[n - 2]
    return primal, dual, now + primal * mixed + dual * mixed_dual + primal * dual * product


@njit(cache=True, error_model="numpy")
def within_domain(ds, at, step, primal, settings):
    """The step length, reduced until the kinematics of every interval have a solution: p ds < 3 vm^2."""
    x, p, dz = at.x, at.p, step.z
    n = len(p)
    for i in range(n):
        while primal >= settings.shortest:
            vm = 0.5 * (np.sqrt(x[i] + primal * dz[i, 0]) + np.sqrt(x[i + 1] + primal * dz[i + 1, 0]))
            if (p[i] + primal * dz[i, 2]) * ds[i] <= 3.0 * settings.domain_edge * vm * vm:
                break
            primal *= settings.shortening
    return primal


@njit(cache=True, error_model="numpy", fastmath=True)
def advance(at, step, primal, dual):
    """Take the step, in place; returns the complementarity sum(slack * lam) and the largest relative change of x."""
    x, u, p, slack, lam, pi = at
    dz, dslack, dlam, dpi = step
    n, sides = slack.shape
    gap, change = 0.0, 0.0
    for i in range(n):
        if i > 0:
            change = max(change, primal * abs(dz[i, 0]) / x[i])
        x[i] += primal * dz[i, 0]
        u[i] += primal * dz[i, 1]
        p[i] += primal * dz[i, 2]
        pi[i] += dual * dpi[i]
        for r in range(sides):
            slack[i, r] += primal * dslack[i, r]
            lam[i, r] += dual * dlam[i, r]
            gap += slack[i, r] * lam[i, r]
    return gap, change


@njit(cache=True, error_model="numpy")
def empty_step(at):
    """Room for a step of an iterate, all zero."""
    n, sides = at.slack.shape
    return NewtonStep(np.zeros((n + 1, 3)), np.zeros((n, sides)), np.zeros((n, sides)), np.zeros(n))


@njit(cache=True, error_model="numpy")
def track(grid, jerk, start, smoothing, rounds, defect_max, settings):
    """A motion on exact kinematics, not far from the x of a profile: Gauss-Newton on the time integral of (dx/x)^2 J + j^2/J, with the
    jerk j of the result and a jerk J of the machine's size; without smoothing, j is the change of the jerk. Both ends stay.

    rounds     : at most
    defect_max : that it ends with, if it gets there

    Returns the profile and the defect that is left.
    """
    at = at_profile(start, 0)
    x, u, p, asked, ds = at.x, at.u, at.p, start.x, grid.ds
    n = len(p)
    model, gains, step = empty_model(n, 0), np.empty((n, 8)), empty_step(at)
    worst = np.inf
    for _ in range(rounds):
        worst = 0.0
        for i in range(n):
            found = kinematics(x[i], x[i + 1], u[i], p[i], ds[i], i == n - 1)
            worst = max(worst, found[11])
            for k in range(4):
                model.dynamics[i, k] = found[k]
            span = found[4] * jerk
            weight = span / (asked[i] * asked[i]) if i > 0 else 0.0
            model.convex[i, 0], model.convex[i, 5] = weight, 1.0 / span
            model.gradient[i, 0], model.gradient[i, 2] = weight * (x[i] - asked[i]), smoothing * p[i] / span
        if worst <= defect_max or not riccati(model, 0.0, gains):
            break
        offsets(model, 0.0, gains)
        primal, _, _ = direction(model, 0.0, gains, at, 0.0, step, settings)
        primal = within_domain(ds, at, step, primal, settings)
        for i in range(n):
            x[i] += primal * step.z[i, 0]
            u[i] += primal * step.z[i, 1]
            p[i] += primal * step.z[i, 2]
    return Profile(x, u, p), worst


@njit(cache=True, error_model="numpy")
def first_iterate(grid, start, model, jumps, settings):
    """An iterate at the start, with slacks of at least `slack_min` and multipliers that have the first barrier as complementarity; also
    their sum(slack * lam)."""
    n, count = model.values.shape
    lower = count - 2
    at = at_profile(start, count + lower)
    total, _ = linearise(grid, at, model, jumps)
    for i in range(n):
        for r in range(count):
            at.slack[i, r] = max(1.0 - model.values[i, r], settings.slack_min)
        for r in range(lower):
            at.slack[i, count + r] = max(1.0 + model.values[i, r], settings.slack_min)
        for r in range(count + lower):
            at.lam[i, r] = settings.start_gap * model.duration[i] / at.slack[i, r]
    return at, settings.start_gap * total * (count + lower)


@njit(cache=True, error_model="numpy")
def minimise_time(grid, start, jumps, tol, iterations, settings):
    """The fastest profile over a window, a `Minimum`, from the profile `start`; x_0, u_0, x_N = u_N = 0 are given.

    jumps      : 1 if r'' jumps anywhere (rows.linearise)
    tol        : relative gap that is asked for [-]
    iterations : at most
    """
    n = len(start.p)
    count = grid.d1.shape[1] * (3 + jumps) + 2
    model, gains = empty_model(n, count), np.empty((n, 8))
    at, gap = first_iterate(grid, start, model, jumps, settings)
    sides = at.slack.shape[1]
    step = empty_step(at)
    total, residual, defect = 1.0, np.inf, np.inf
    stalled, far = 0, False
    status, done = OUT_OF_ITERATIONS, iterations
    for iteration in range(iterations):
        # Model the Lagrangian at the iterate; its gradient and Hessian with the slacks eliminated.
        total, defect = linearise(grid, at, model, jumps)
        residual = weigh(model, at)
        if gap <= tol * total and residual <= settings.residual and defect <= settings.defect:
            status, done = SOLVED, iteration
            break

        # Factorise, with as much of the curvature of rows and dynamics as leaves the model convex.
        fraction = 1.0
        convex = riccati(model, fraction, gains)
        while not convex and fraction > 0.0:
            fraction = settings.fraction_less * fraction if fraction > settings.fraction_min else 0.0
            convex = riccati(model, fraction, gains)
        if not convex:
            status, done = NOT_CONVEX, iteration
            break

        # Predictor: Newton's step without a barrier.
        offsets(model, fraction, gains)
        step.lam[:] = 0.0
        primal, dual, affine_gap = direction(model, fraction, gains, at, 0.0, step, settings)

        # How far the barrier falls: as the predictor's gap says, not at all while x still changes much.
        sigma = 1.0 if far else min((affine_gap / gap) ** 3, settings.sigma_max)
        mu = max(sigma * gap / total, settings.gap_floor * tol) / sides

        # Corrector: the step to that barrier, second-order terms of the predictor made up for; the factorisation stays.
        second_order = 1.0 if min(primal, dual) > settings.predicted_min else 0.0
        correct(model, at, mu, second_order, step)
        offsets(model, fraction, gains)
        primal, dual, _ = direction(model, fraction, gains, at, mu, step, settings)

        # Go as far as slacks, multipliers and kinematics stay in their domains.
        primal = within_domain(grid.ds, at, step, primal, settings)
        gap, change = advance(at, step, primal, dual)

        # Give up where steps lead nowhere.
        far = change > settings.change_max
        stalled = 0 if primal >= settings.stall_step else stalled + 1
        if stalled == settings.stall_rounds or not gap < np.inf:
            status, done = STALLED, iteration
            break
    if status == OUT_OF_ITERATIONS:  # the last step has not been looked at yet
        total, defect = linearise(grid, at, model, jumps)
    return Minimum(Profile(at.x, at.u, at.p), status, done, gap / total, residual, defect, at.lam, at.pi)
