"""The free optimum inside the tolerance near a motion, by a primal-dual interior-point method with slacks
(Mehrotra 1992).

    minimise    sum of h + pull sum ((h - guess)/guess)^2 + sum h (smooth (jerk/limit)^2 + centre (d/room)^2/2)
    subject to  the kinematics (recursion.py) and g <= 0 for every row (rows.py), with slacks s and multipliers z

from a motion that need keep neither: gaps and what is missing of g + s = 0 shrink with every step. The h of
the last sum is as it was guessed, and d the distance of the node from its leg (step_limits.py). Kinematics and
rows are linearised anew in every iteration. The curvature of the rows counts, that of the kinematics does
not: h times velocity, acceleration and jerk is indefinite, and with it a step would not go down. Instead a
change of h costs `prox` in every iteration, so that steps stay where the linear model holds, and no step goes
farther than that holds for the kinematics, but for `BENT`: along a phase of constant acceleration nodes slide for
nothing else. A change of the velocity costs too where the normal acceleration is limited (normal_rows.py).

A window is searched on single numbers, or several side by side, one in each lane (base/lanes.py): what is found in one does
not depend on the others, and a window that has ended waits for the last one.

Where a phase of constant jerk is cut into steps does not matter, and the search would go on among equal
optima for ever. When the complementarity s.z has reached what is asked for and the time has settled, prox
grows by `FREEZE` in every iteration, until rows and kinematics hold.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, magnitude, pick, put, root, smaller, where
from planner.base.views import vector, wide1, wide2, wide3
from planner.joint.memory import PLACES, THREE, lanes_of, room_of, rows_in, scratch_of
from planner.joint.recursion import END, Factor, backward, factor_steps, forward, gaps
from planner.joint.row_kinds import SETS, TUBE_NODE
from planner.joint.rows import put_rows

# Growth of prox per iteration once it grows, and its largest value [-]: slower growth takes more iterations. At
# the largest the durations stay, so that the kinematics are linear and a step closes them: at 1e4 they creep on,
# and windows go on to the last iteration for the gaps that this leaves.
FREEZE, FROZEN = 2.5, 1e8
# The time has settled when it changes by no more than this share of the complementarity asked for in so many
# iterations in a row, and at last after so many at that complementarity: frozen as soon as that is reached,
# motions end slower.
STILL, STILL_FOR, CLOSE_FOR = 0.3, 2, 40
MELT = 0.8  # by which prox falls in each of these iterations, as far as `Tuning.least` lets it [-]
# Second-order terms of Mehrotra's corrector count where the predictor goes this share of its way [-]: behind
# a short step they lead astray.
PREDICTED = 0.3
# Largest gap of the kinematics at the end, in mean steps [-]: `closed_at_nodes` adds those of fifty steps up.
# The last gap stays at 1e-9 once durations hardly change.
OFF = 2e-9
# Where the last node's gap does not get less by this share in each of so many iterations in a row, once prox grows, its
# rho (recursion.py) grows by so many times, up to a value at which the recursion still has five digits [-].
SLOWLY, SLOW_FOR, STIFFER, STIFFEST = 0.5, 3, 10.0, 1e11
# By how much the largest gap of the kinematics may grow over what a step's linear model says, in mean steps, and as a
# share of what it was [-]: a step that bends them by more is shortened. Where the complementarity is reached it is less, or nodes slide
# on among equal optima (tests/joint/test_shortened_steps.py).
BENT, BENT_OF, BENT_CLOSE = 0.05, 0.3, 0.005
# By how much prox grows with every step that is shortened once the complementarity is reached, and how far [-]: where steps
# are too long for ever, windows run round and round.
WARY, WARIEST = 2.0, 10.0
# What rows may be off their slacks at the end, each times its multiplier, as a share of the complementarity [-].
OWED = 0.1
LOST = 1e3  # complementarity from which no search has come back, share of the time [-]
ITERATIONS = 140  # 20 to 90 are the rule


class Tuning(NamedTuple):
    """Of the search."""

    pull: float  # weight of ((h - guess)/guess)^2, against a mean step's time
    prox: float  # the same of the change in one iteration
    gap: float  # complementarity at the end, share of the time
    # By how much a row may be broken at the end: limits are narrowed by more than that (problem.py).
    missed: float
    least: float  # to which prox falls while the time settles
    first_gap: float  # complementarity of the start, share of the time
    first_slack: float  # of the start, at least


class Found(NamedTuple):
    """Of all lanes, set as each of them ends."""

    x: FloatArray
    u: FloatArray
    place: FloatArray
    z: FloatArray
    done: Array  # (W,)
    iterations: Array  # (W,)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_present(sizes, group, rows):
    """Set which rows there are, with slacks of 1. Returns how many."""
    count = 0.0 * group.real[0]
    for i in range(sizes.steps):
        for r in range(sizes.rows):
            rows.s[i, r], rows.per_s[i, r] = 1.0, group.on[i, r]
            count += group.on[i, r]
    return count


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _start(sizes, rows, count, time, tuning):
    """Slacks and multipliers of a start. Returns the sum of s z, and the largest row."""
    products, broken = 0.0 * time, 0.0 * time
    for i in range(sizes.steps):
        for r in range(sizes.rows):
            there, g = rows.per_s[i, r] > 0.0, rows.g[i, r]
            s = where(there, larger(-g, tuning.first_slack), 1.0)
            z = where(there, tuning.first_gap * time / (count * s), 0.0)
            per = where(there, 1.0 / s, 0.0)
            rows.s[i, r], rows.z[i, r], rows.per_s[i, r], rows.q[i, r] = s, z, per, z * (g + s) * per
            products, broken = products + s * z, larger(g, broken)
    return products, broken


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _durations(sizes, group, u, zero):
    """The time of each window."""
    N, last = sizes.steps, len(sizes.axes)
    time = zero
    for i in range(N):
        time += group.real[i] * u[i, last]
    return time


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _end(sizes, lane, done, iteration, group, rows, x, u, found):
    """Set what one lane has come to. What holds a node off its leg against the pull does so for the time, like the row
    itself."""
    found.done[lane], found.iterations[lane] = done, iteration
    N, R = sizes.steps, sizes.rows
    tube = 8 * len(sizes.axes) + TUBE_NODE
    for i in range(N + 1):
        for s in range(len(sizes.state)):
            found.x[i, s] = put(found.x[i, s], lane, pick(x[i, s], lane))
    for i in range(N):
        for c in range(len(sizes.control)):
            found.u[i, c] = put(found.u[i, c], lane, pick(u[i, c], lane))
        for c in range(3 * SETS):
            found.place[i, c] = put(found.place[i, c], lane, pick(rows.place[i, c], lane))
        for r in range(R):
            z = pick(rows.z[i, r], lane)
            if r == tube:
                z += pick(group.centre[i], lane) * (1.0 + 2.0 * pick(rows.g[i, r], lane))
            found.z[i, r] = put(found.z[i, r], lane, z)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _go(sizes, x, u, factor, along):
    """A share of the step of nodes and controls."""
    for i in range(sizes.steps):
        for k in range(len(sizes.state)):
            x[i, k] += along * factor.dx[i, k]
        for k in range(len(sizes.control)):
            u[i, k] += along * factor.du[i, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, nogil=True)
def solve_group(sizes, numbers, held, motion, tuning, work, found):
    """Search the windows of a group (group.py) from their motion x (N+1, 3 A, W), u (N, A+1, W) and place (N, 6, W),
    which is overwritten; tuning (7, W). What each comes to is set in `found`."""
    width, group = sizes.width, lanes_of(sizes, numbers)
    R, S = sizes.rows, len(sizes.state)
    x, u = wide2(motion[0], width, sizes.state), wide2(motion[1], width, sizes.control)
    rows = rows_in(sizes, work, wide2(motion[2], width, PLACES))
    tuned = wide1(tuning, width)
    tune = Tuning(tuned[0], tuned[1], tuned[2], tuned[3], tuned[4], tuned[5], tuned[6])
    ends = Found(
        wide2(found.x, width, sizes.state),
        wide2(found.u, width, sizes.control),
        wide2(found.place, width, PLACES),
        wide2(found.z, width, R),
        found.done,
        found.iterations,
    )
    factor = Factor(
        wide3(work.K, width, sizes.control, sizes.state),
        wide3(work.L, width, sizes.control, sizes.control),
        wide2(work.push, width, sizes.state),
        wide2(work.dx, width, sizes.state),
        wide2(work.du, width, sizes.control),
    )
    gap = wide2(work.gap, width, sizes.state)
    room, scratch = room_of(sizes, work, x), scratch_of(sizes, held)
    zero = 0.0 * tune.pull
    lambda_end, change = vector(x, sizes.state), vector(x, sizes.state)
    for k in range(S):
        lambda_end[k] = zero
    looking = room.y, wide2(work.nearest, width, THREE), wide1(work.top, width)
    count = put_present(sizes, group, rows)
    put_rows(sizes, group, held, x, u, rows, zero, zero, looking, scratch)
    gap_most, off = gaps(sizes, group, x, u, gap)
    time = _durations(sizes, group, u, zero)
    products, broken = _start(sizes, rows, count, time, tune)
    owed = zero + np.inf  # nothing has ended before the first step
    prox, before, close, still, settled = tune.prox, time, zero, zero, zero
    rho, off_before, slow = zero + END, zero + np.inf, zero
    active = group.real[0]
    for iteration in range(ITERATIONS + 1):
        now = _durations(sizes, group, u, zero)
        close = where(products <= 2.0 * tune.gap * time, close + 1.0, zero)
        rests = where(magnitude(now - before) <= STILL * tune.gap * time, still + 1.0, zero)
        still = where(close > 0.0, rests, zero)
        settled = where(close > CLOSE_FOR, 1.0 + zero, where(still == STILL_FOR, 1.0 + zero, settled))
        before = now
        melted = smaller(prox, larger(prox * MELT, tune.least))
        prox = where(close > 0.0, where(settled > 0.0, prox, melted), prox)
        prox = where(settled > 0.0, smaller(prox * FREEZE, FROZEN + zero), prox)
        slow = where(
            settled > 0.0, where(larger(SLOWLY * off_before, OFF + zero) < off, slow + 1.0, zero), slow
        )
        rho = where(slow == SLOW_FOR, smaller(STIFFER * rho, STIFFEST + zero), rho)
        slow = where(slow == SLOW_FOR, zero, slow)
        off_before = where(settled > 0.0, off, off_before)
        holds = where(broken <= tune.missed, where(owed <= OWED * tune.gap * time, settled, zero), zero)
        reached = where(gap_most <= OFF, holds, zero)
        lost = where(products <= LOST * time, zero, 1.0 + zero)
        if iteration == ITERATIONS:
            lost = 1.0 + zero
        if anywhere(active * (reached + lost) > 0.0):
            for lane in range(len(sizes.width)):
                if pick(active, lane) > 0.0 and pick(reached + lost, lane) > 0.0:
                    _end(sizes, lane, pick(reached, lane) > 0.0, iteration, group, rows, x, u, ends)
                    active = put(active, lane, 0.0)
        if not anywhere(active > 0.0):
            break
        bad = factor_steps(
            sizes, group, held, x, u, gap, rows, tune.pull, prox, rho, lambda_end, factor, room, scratch
        )
        stiff = where(bad > 0.0, where(rho > END, active, zero), zero)
        if anywhere(stiff > 0.0):  # more digits than there are
            rho = where(stiff > 0.0, END + zero, rho)
            bad = factor_steps(
                sizes, group, held, x, u, gap, rows, tune.pull, prox, rho, lambda_end, factor, room, scratch
            )
        if anywhere(active * bad > 0.0):
            for lane in range(len(sizes.width)):
                if pick(active, lane) > 0.0 and pick(bad, lane) > 0.0:
                    _end(sizes, lane, False, iteration, group, rows, x, u, ends)
                    active = put(active, lane, 0.0)
        along, dual, s_dz, z_ds, ds_dz = forward(
            sizes, group, x, u, gap, rows, True, zero, zero, factor, room, change
        )
        left = products + dual * s_dz + along * z_ds + along * dual * ds_dz
        share = left / products
        aim = larger(share * share * left, tune.gap * time) / count
        second = where(along > PREDICTED, 1.0 + zero, zero)
        backward(sizes, group, x, u, rows, tune.pull, aim, second, lambda_end, factor, room)
        along, dual, _, _, _ = forward(
            sizes, group, x, u, gap, rows, False, aim, second, factor, room, change
        )
        along, dual = where(active > 0.0, along, zero), where(active > 0.0, dual, zero)
        linear, allowed = (1.0 - along) * gap_most, where(close > 0.0, BENT_CLOSE + zero, BENT + zero)
        allowed = larger(allowed, BENT_OF * gap_most)
        _go(sizes, x, u, factor, along)
        gap_most, off = gaps(sizes, group, x, u, gap)
        bent = larger(gap_most - linear, allowed)
        if anywhere(active * bent > active * allowed):
            back = along * (1.0 - root(allowed / bent))
            _go(sizes, x, u, factor, -back)
            along = along - back
            prox = where(back * close > 0.0, larger(prox, smaller(prox * WARY, WARIEST + zero)), prox)
            gap_most, off = gaps(sizes, group, x, u, gap)
        for k in range(S):
            lambda_end[k] += along * rho * change[k]
        products, broken, owed = put_rows(sizes, group, held, x, u, rows, along, dual, looking, scratch)
