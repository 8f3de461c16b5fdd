"""The passes over all rows of an iteration: weights, predicted step, step, and how far it may go.

Each row -1 <= g <= 1 has a slack s and a multiplier lam on either side, g + s = 1 and s - g = 1. With the
residuals r of these two, eliminating their Newton steps

    ds = -r -+ dg,      dlam = (mu h - second-order terms)/s - lam (1 + ds/s)

adds lam/s times the row's square to the Hessian. One pass is a loop over the blocks, over the rows and over
the block's intervals, of which the innermost is done several at a time (layout.py).
"""

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


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _weigh(w, rows, count, worst, m):
    """Add the rows' weights to the convex Hessian and the gradient of a block, without a barrier, and keep
    what later passes need of slacks and multipliers; `worst` (LANES,) grows to the rows' residuals."""
    for r in range(count):
        row = rows[r * ROW :]
        for i in range(m):
            s, y, s_low, y_low = row[SLACK_UP + i], row[LAM_UP + i], row[SLACK_LOW + i], row[LAM_LOW + i]
            per_gap, per_gap_low = 1.0 / (s * y), 1.0 / (s_low * y_low)
            row[PER_GAP_UP + i], row[PER_GAP_LOW + i] = per_gap, per_gap_low
            residual, residual_low = row[VALUE + i] + s - 1.0, s_low - row[VALUE + i] - 1.0
            worst[i] = max(worst[i], max(abs(residual), abs(residual_low)))
            weight, weight_low = y * y * per_gap, y_low * y_low * per_gap_low
            push = weight * residual - weight_low * residual_low
            weight += weight_low
            a, b, c = row[BY_X + i], row[BY_U + i], row[BY_P + i]
            wa, wb = weight * a, weight * b
            w[CONVEX + i] += wa * a
            w[CONVEX + LANES + i] += wa * b
            w[CONVEX + 2 * LANES + i] += wa * c
            w[CONVEX + 3 * LANES + i] += wb * b
            w[CONVEX + 4 * LANES + i] += wb * c
            w[CONVEX + 5 * LANES + i] += weight * c * c
            w[GRADIENT + i] += push * a
            w[GRADIENT + LANES + i] += push * b
            w[GRADIENT + 2 * LANES + i] += push * c


# What `predicted` finds of all rows of an interval: smallest and largest share, and the sums of s lam, of it
# times the share, and times the share squared.
LEAST, MOST, PLAIN, ONCE, TWICE = range(0, 5 * LANES, LANES)


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _predict(w, rows, count, seen, m):
    """Newton's steps of the slacks of a block without a barrier, as shares of them, into MOVE; those of the
    multipliers are -(1 + share) of them. Also what a barrier and the steps' second-order terms dslack dlam
    add to the gradient."""
    w[BY_BARRIER : BY_BARRIER + 6 * LANES] = 0.0
    for r in range(count):
        row = rows[r * ROW :]
        for i in range(m):
            s, y, s_low, y_low = row[SLACK_UP + i], row[LAM_UP + i], row[SLACK_LOW + i], row[LAM_LOW + i]
            a, b, c = row[BY_X + i], row[BY_U + i], row[BY_P + i]
            after = row[VALUE + i] + a * w[STEP + i] + b * w[STEP + LANES + i] + c * w[STEP + 2 * LANES + i]
            per_s, per_s_low = y * row[PER_GAP_UP + i], y_low * row[PER_GAP_LOW + i]
            share, share_low = (1.0 - after - s) * per_s, (1.0 + after - s_low) * per_s_low
            row[MOVE_UP + i], row[MOVE_LOW + i] = share, share_low
            seen[LEAST + i] = min(seen[LEAST + i], min(share, share_low))
            seen[MOST + i] = max(seen[MOST + i], max(share, share_low))
            gap, gap_low = s * y, s_low * y_low
            seen[PLAIN + i] += gap + gap_low
            seen[ONCE + i] += gap * share + gap_low * share_low
            seen[TWICE + i] += gap * share * share + gap_low * share_low * share_low
            push, bent = (
                w[H + i] * (per_s - per_s_low),
                y * share * (1.0 + share) - y_low * share_low * (1.0 + share_low),
            )
            w[BY_BARRIER + i] += push * a
            w[BY_BARRIER + LANES + i] += push * b
            w[BY_BARRIER + 2 * LANES + i] += push * c
            w[BY_BENT + i] += bent * a
            w[BY_BENT + LANES + i] += bent * b
            w[BY_BENT + 2 * LANES + i] += bent * c


@njit(cache=True, error_model="numpy")
def predicted(blocks, settings):
    """How far profile and slacks, and multipliers can go along Newton's step without a barrier, and sum(slack
    * lam) after it."""
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
    """Second half of a predictor-corrector step: add the barrier mu h to the gradient, less the predicted
    steps' second-order terms if they count. `barrier` is mu and 1 if they do, else 0."""
    mu, second_order = barrier
    for b in range(len(blocks.work)):
        w = blocks.work[b]
        for i in range(3 * LANES):
            w[GRADIENT + i] += mu * w[BY_BARRIER + i] + second_order * w[BY_BENT + i]


@njit(cache=True, error_model="numpy", fastmath=LANE_MATH)
def _direct(w, rows, count, barrier, nearest, m):
    """Newton's steps of the slacks of a block, into MOVE, and of the multipliers, into PER_GAP; `nearest` (2
    LANES,) falls to their shares of slack and multiplier."""
    mu, second_order = barrier
    for r in range(count):
        row = rows[r * ROW :]
        for i in range(m):
            s, y, per_gap, share = row[SLACK_UP + i], row[LAM_UP + i], row[PER_GAP_UP + i], row[MOVE_UP + i]
            after = row[VALUE + i] + row[BY_X + i] * w[STEP + i]
            after += row[BY_U + i] * w[STEP + LANES + i] + row[BY_P + i] * w[STEP + 2 * LANES + i]
            asked = mu * w[H + i]
            move = 1.0 - after - s
            relative = move * y * per_gap
            dual = (asked + second_order * s * y * share * (1.0 + share)) * per_gap - 1.0 - relative
            row[MOVE_UP + i], row[PER_GAP_UP + i] = move, y * dual
            s, y, per_gap, share = (
                row[SLACK_LOW + i],
                row[LAM_LOW + i],
                row[PER_GAP_LOW + i],
                row[MOVE_LOW + i],
            )
            move = 1.0 + after - s
            relative_low = move * y * per_gap
            dual_low = (asked + second_order * s * y * share * (1.0 + share)) * per_gap - 1.0 - relative_low
            row[MOVE_LOW + i], row[PER_GAP_LOW + i] = move, y * dual_low
            nearest[i] = min(nearest[i], min(relative, relative_low))
            nearest[LANES + i] = min(nearest[LANES + i], min(dual, dual_low))


@njit(cache=True, error_model="numpy")
def direction(blocks, barrier, settings):
    """The Newton step to the barrier mu h, after `correct`. Returns the lengths that profile and slacks, and
    that multipliers can go."""
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
    """Take the step of slacks and multipliers and make the model of all blocks. Returns sum(slack * lam), the
    total time, and the largest residual of the rows and defect of the dynamics."""
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
    """Slacks of at least `slack_min`, multipliers that have the first barrier as complementarity, and no
    step."""
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
