"""The passes over all rows of an interior-point iteration: their weights, the predicted step, the step, and how far it may go.

Each row -1 <= g <= 1 has a slack s and a multiplier lam on either side, g + s = 1 and s - g = 1. With the residuals r of these two,
eliminating their Newton steps

    ds = -r -+ dg,      dlam = (mu h - second-order terms)/s - lam (1 + ds/s)

adds lam/s times the row's square to the Hessian. One pass is a loop over the blocks, over groups of rows and over the block's
intervals, of which the innermost is done several at a time (layout.py). Rows go in threes, and the last two or four in twos, so that
the sums over rows of an interval stay in registers within a group.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.layout import (
    BY_BARRIER,
    BY_BENT,
    BY_P,
    BY_U,
    BY_X,
    CONVEX,
    GRADIENT,
    LAM_LOW,
    LAM_UP,
    LANE_MATH,
    LANES,
    MOVE_LOW,
    MOVE_UP,
    PER_GAP_LOW,
    PER_GAP_UP,
    PI,
    ROW,
    SLACK_LOW,
    SLACK_UP,
    STEP,
    VALUE,
    H,
    rows_of,
)
from planner.feedrate.jerk.riccati import forward
from planner.feedrate.jerk.rows import linearise


def _weigher(group: int) -> Callable[..., None]:
    """`_weigh` for so many rows, with which `rows` begin."""

    @njit(error_model="numpy", fastmath=LANE_MATH)
    def weigh(w, rows, worst, m):
        for i in range(m):
            xx, xu, xp = w[CONVEX + i], w[CONVEX + LANES + i], w[CONVEX + 2 * LANES + i]
            uu, up, pp = w[CONVEX + 3 * LANES + i], w[CONVEX + 4 * LANES + i], w[CONVEX + 5 * LANES + i]
            x, u, p = w[GRADIENT + i], w[GRADIENT + LANES + i], w[GRADIENT + 2 * LANES + i]
            most = worst[i]
            for r in range(group):
                k = r * ROW + i
                s, y, s_low, y_low = (
                    rows[SLACK_UP + k],
                    rows[LAM_UP + k],
                    rows[SLACK_LOW + k],
                    rows[LAM_LOW + k],
                )
                gap, gap_low = s * y, s_low * y_low
                per_both = 1.0 / (gap * gap_low)
                per_gap, per_gap_low = per_both * gap_low, per_both * gap
                rows[PER_GAP_UP + k], rows[PER_GAP_LOW + k] = per_gap, per_gap_low
                residual, residual_low = rows[VALUE + k] + s - 1.0, s_low - rows[VALUE + k] - 1.0
                most = max(most, max(abs(residual), abs(residual_low)))
                weight, weight_low = y * y * per_gap, y_low * y_low * per_gap_low
                push = weight * residual - weight_low * residual_low
                weight += weight_low
                a, b, c = rows[BY_X + k], rows[BY_U + k], rows[BY_P + k]
                wa, wb = weight * a, weight * b
                xx, xu, xp = xx + wa * a, xu + wa * b, xp + wa * c
                uu, up, pp = uu + wb * b, up + wb * c, pp + weight * c * c
                x, u, p = x + push * a, u + push * b, p + push * c
            worst[i] = most
            w[CONVEX + i], w[CONVEX + LANES + i], w[CONVEX + 2 * LANES + i] = xx, xu, xp
            w[CONVEX + 3 * LANES + i], w[CONVEX + 4 * LANES + i], w[CONVEX + 5 * LANES + i] = uu, up, pp
            w[GRADIENT + i], w[GRADIENT + LANES + i], w[GRADIENT + 2 * LANES + i] = x, u, p

    return weigh


_weigh_three, _weigh_two = _weigher(3), _weigher(2)


@njit(error_model="numpy")
def threes(count):
    """How many of so many rows, at least two, go in threes; the others go in twos."""
    return count - 2 * (-count % 3)


@njit(error_model="numpy")
def _weigh(w, rows, count, worst, m):
    """Add the rows' weights to the convex Hessian and the gradient of a block, without a barrier, and keep what later passes need of
    slacks and multipliers; `worst` (LANES,) grows to the rows' residuals."""
    first = threes(count)
    for r in range(0, first, 3):
        _weigh_three(w, rows[r * ROW :], worst, m)
    for r in range(first, count, 2):
        _weigh_two(w, rows[r * ROW :], worst, m)


# What `predicted` finds of all rows of an interval: smallest and largest share, and the sums of s lam, of it times the share, and times
# the share squared.
LEAST, MOST, PLAIN, ONCE, TWICE = range(0, 5 * LANES, LANES)


def _predictor(group: int) -> Callable[..., None]:
    """`_predict` for so many rows, with which `rows` begin."""

    @njit(error_model="numpy", fastmath=LANE_MATH)
    def predict(w, rows, seen, m):
        for i in range(m):
            dx, du, dp, h = w[STEP + i], w[STEP + LANES + i], w[STEP + 2 * LANES + i], w[H + i]
            least, most = seen[LEAST + i], seen[MOST + i]
            plain, once, twice = seen[PLAIN + i], seen[ONCE + i], seen[TWICE + i]
            push_x, push_u = w[BY_BARRIER + i], w[BY_BARRIER + LANES + i]
            push_p = w[BY_BARRIER + 2 * LANES + i]
            bent_x, bent_u, bent_p = w[BY_BENT + i], w[BY_BENT + LANES + i], w[BY_BENT + 2 * LANES + i]
            for r in range(group):
                k = r * ROW + i
                s, y, s_low, y_low = (
                    rows[SLACK_UP + k],
                    rows[LAM_UP + k],
                    rows[SLACK_LOW + k],
                    rows[LAM_LOW + k],
                )
                a, b, c = rows[BY_X + k], rows[BY_U + k], rows[BY_P + k]
                after = rows[VALUE + k] + a * dx + b * du + c * dp
                per_s, per_s_low = y * rows[PER_GAP_UP + k], y_low * rows[PER_GAP_LOW + k]
                share, share_low = (1.0 - after - s) * per_s, (1.0 + after - s_low) * per_s_low
                rows[MOVE_UP + k], rows[MOVE_LOW + k] = share, share_low
                least, most = min(least, min(share, share_low)), max(most, max(share, share_low))
                gap, gap_low = s * y, s_low * y_low
                moved, moved_low = gap * share, gap_low * share_low
                plain += gap + gap_low
                once += moved + moved_low
                twice += moved * share + moved_low * share_low
                push = h * (per_s - per_s_low)
                bent = y * share * (1.0 + share) - y_low * share_low * (1.0 + share_low)
                push_x, push_u, push_p = push_x + push * a, push_u + push * b, push_p + push * c
                bent_x, bent_u, bent_p = bent_x + bent * a, bent_u + bent * b, bent_p + bent * c
            seen[LEAST + i], seen[MOST + i] = least, most
            seen[PLAIN + i], seen[ONCE + i], seen[TWICE + i] = plain, once, twice
            w[BY_BARRIER + i], w[BY_BARRIER + LANES + i] = push_x, push_u
            w[BY_BARRIER + 2 * LANES + i] = push_p
            w[BY_BENT + i], w[BY_BENT + LANES + i], w[BY_BENT + 2 * LANES + i] = bent_x, bent_u, bent_p

    return predict


_predict_three, _predict_two = _predictor(3), _predictor(2)


@njit(error_model="numpy")
def _predict(w, rows, count, seen, m):
    """Newton's steps of the slacks of a block without a barrier, as shares of them, into MOVE; those of the multipliers are -(1 +
    share) of them. Also what a barrier and the steps' second-order terms dslack dlam add to the gradient."""
    w[BY_BARRIER : BY_BARRIER + 6 * LANES] = 0.0
    first = threes(count)
    for r in range(0, first, 3):
        _predict_three(w, rows[r * ROW :], seen, m)
    for r in range(first, count, 2):
        _predict_two(w, rows[r * ROW :], seen, m)


@njit(cache=True, error_model="numpy")
def predicted(blocks, settings):
    """How far profile and slacks, and multipliers can go along Newton's step without a barrier, and sum(slack * lam) after it."""
    to_boundary, count = settings.to_boundary, rows_of(blocks.axes, blocks.jumps)
    seen = np.zeros(5 * LANES)
    seen[MOST : MOST + LANES] = -1.0
    primal = forward(blocks, settings.feed_sq_shrink)
    for b in range(len(blocks.work)):
        _predict(blocks.work[b], blocks.rows[b], count, seen, min(LANES, blocks.n - b * LANES))
    least, most = seen[LEAST : LEAST + LANES].min(), seen[MOST : MOST + LANES].max()
    plain, once = seen[PLAIN : PLAIN + LANES].sum(), seen[ONCE : ONCE + LANES].sum()
    twice = seen[TWICE : TWICE + LANES].sum()
    if -least > to_boundary:
        primal = min(primal, -to_boundary / least)
    dual = to_boundary / (1.0 + most) if 1.0 + most > to_boundary else 1.0
    return primal, dual, plain * (1.0 - dual) + once * (primal * (1.0 - dual) - dual) - twice * primal * dual


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def correct(blocks, barrier):
    """Second half of a predictor-corrector step: add the barrier mu h to the gradient, less the predicted steps' second-order terms
    if they count. `barrier` is mu and 1 if they do, else 0."""
    mu, second_order = barrier
    for b in range(len(blocks.work)):
        w = blocks.work[b]
        for i in range(3 * LANES):
            w[GRADIENT + i] += mu * w[BY_BARRIER + i] + second_order * w[BY_BENT + i]


def _director(group: int) -> Callable[..., None]:
    """`_direct` for so many rows, with which `rows` begin."""

    @njit(error_model="numpy", fastmath=LANE_MATH)
    def direct(w, rows, mu, second_order, nearest, m):
        for i in range(m):
            dx, du, dp = w[STEP + i], w[STEP + LANES + i], w[STEP + 2 * LANES + i]
            asked, slack, lam = mu * w[H + i], nearest[i], nearest[LANES + i]
            for r in range(group):
                k = r * ROW + i
                after = rows[VALUE + k] + rows[BY_X + k] * dx + rows[BY_U + k] * du + rows[BY_P + k] * dp
                s, y, per_gap, share = (
                    rows[SLACK_UP + k],
                    rows[LAM_UP + k],
                    rows[PER_GAP_UP + k],
                    rows[MOVE_UP + k],
                )
                move = 1.0 - after - s
                part = move * y * per_gap
                dual = (asked + second_order * s * y * share * (1.0 + share)) * per_gap - 1.0 - part
                rows[MOVE_UP + k], rows[PER_GAP_UP + k] = move, y * dual
                s, y, per_gap, share = (
                    rows[SLACK_LOW + k],
                    rows[LAM_LOW + k],
                    rows[PER_GAP_LOW + k],
                    rows[MOVE_LOW + k],
                )
                move = 1.0 + after - s
                part_low = move * y * per_gap
                dual_low = (asked + second_order * s * y * share * (1.0 + share)) * per_gap - 1.0 - part_low
                rows[MOVE_LOW + k], rows[PER_GAP_LOW + k] = move, y * dual_low
                slack, lam = min(slack, min(part, part_low)), min(lam, min(dual, dual_low))
            nearest[i], nearest[LANES + i] = slack, lam

    return direct


_direct_three, _direct_two = _director(3), _director(2)


@njit(error_model="numpy")
def _direct(w, rows, count, barrier, nearest, m):
    """Newton's steps of the slacks of a block, into MOVE, and of the multipliers, into PER_GAP; `nearest` (2 LANES,) falls to their
    shares of slack and multiplier."""
    mu, second_order = barrier
    first = threes(count)
    for r in range(0, first, 3):
        _direct_three(w, rows[r * ROW :], mu, second_order, nearest, m)
    for r in range(first, count, 2):
        _direct_two(w, rows[r * ROW :], mu, second_order, nearest, m)


@njit(cache=True, error_model="numpy")
def direction(blocks, barrier, settings):
    """The Newton step to the barrier mu h, after `correct`. Returns the lengths that profile and slacks, and that multipliers can
    go."""
    to_boundary, count = settings.to_boundary, rows_of(blocks.axes, blocks.jumps)
    nearest = np.zeros(2 * LANES)
    primal, dual = forward(blocks, settings.feed_sq_shrink), 1.0
    for b in range(len(blocks.work)):
        _direct(blocks.work[b], blocks.rows[b], count, barrier, nearest, min(LANES, blocks.n - b * LANES))
    slack, lam = nearest[:LANES].min(), nearest[LANES:].min()
    if -slack > to_boundary:
        primal = min(primal, -to_boundary / slack)
    if -lam > to_boundary:
        dual = -to_boundary / lam
    return primal, dual


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _advance_rows(rows, count, primal, dual, gap, m):
    """Take the step of slacks and multipliers of a block; `gap` (LANES,) grows by slack * lam."""
    for r in range(count):
        row = rows[r * ROW :]
        for i in range(m):
            s, y = row[SLACK_UP + i] + primal * row[MOVE_UP + i], row[LAM_UP + i] + dual * row[PER_GAP_UP + i]
            s_low, y_low = (
                row[SLACK_LOW + i] + primal * row[MOVE_LOW + i],
                row[LAM_LOW + i] + dual * row[PER_GAP_LOW + i],
            )
            row[SLACK_UP + i], row[LAM_UP + i], row[SLACK_LOW + i], row[LAM_LOW + i] = s, y, s_low, y_low
            gap[i] += s * y + s_low * y_low


@njit(cache=True, error_model="numpy")
def modelled(blocks, passing, primal, dual):
    """Take the step of slacks and multipliers and make the model of all blocks. Returns sum(slack * lam), the total time, and the
    largest residual of the rows and defect of the dynamics."""
    gap, residual, defect, total = np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), 0.0
    count = rows_of(blocks.axes, blocks.jumps)
    for b in range(len(blocks.work)):
        w, rows, m = blocks.work[b], blocks.rows[b], min(LANES, blocks.n - b * LANES)
        _advance_rows(rows, count, primal, dual, gap, m)
        linearise(blocks, b, passing, defect)
        _weigh(w, rows, count, residual, m)
        total += w[H : H + m].sum()
    return gap.sum(), total, residual.max(), defect.max()


@njit(cache=True, error_model="numpy")
def first_slacks(blocks, passing, settings):
    """Slacks of at least `slack_min`, multipliers that have the first barrier as complementarity, and no step."""
    blocks.rows[:] = 0.0
    defect = np.zeros(LANES)
    for b in range(len(blocks.work)):
        w, rows = blocks.work[b], blocks.rows[b]
        w[PI : PI + LANES] = 0.0
        linearise(blocks, b, passing, defect)
        for r in range(rows_of(blocks.axes, blocks.jumps)):
            row = rows[r * ROW :]
            for i in range(min(LANES, blocks.n - b * LANES)):
                up, low = (
                    max(1.0 - row[VALUE + i], settings.slack_min),
                    max(1.0 + row[VALUE + i], settings.slack_min),
                )
                row[SLACK_UP + i], row[LAM_UP + i] = up, settings.start_gap * w[H + i] / up
                row[SLACK_LOW + i], row[LAM_LOW + i] = low, settings.start_gap * w[H + i] / low
