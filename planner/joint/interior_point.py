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
not depend on the others. A lane whose window has ended takes the next one of the queue, or idles until the others have ended.

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
from planner.joint.bends import tangent_at
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
# A row's s z is this share of what a step aims at, at least [-]: rows whose z is less hold steps up as soon as s is small, and windows
# went on to the last iteration (as in ipopt, which resets z further off: Waechter and Biegler 2006, eq. 16).
CENTRED = 0.1
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
    """Of all Q windows, set as each of them ends."""

    x: FloatArray  # (Q, N+1, S)
    u: FloatArray  # (Q, N, C)
    place: FloatArray  # (Q, N, 6)
    z: FloatArray  # (Q, N, R)
    done: Array  # (Q,)
    iterations: Array  # (Q,)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_present(sizes, group, rows, new):
    """Of lanes where `new` is 1 set which rows there are, with slacks of 1, and of lines the tangents. Returns how many rows
    each lane has."""
    count, fresh = 0.0 * new, new > 0.0
    for i in range(sizes.steps):
        for r in range(sizes.rows):
            on = group.on[i, r]
            rows.s[i, r], rows.per_s[i, r] = (
                where(fresh, 1.0, rows.s[i, r]),
                where(fresh, on, rows.per_s[i, r]),
            )
            rows.ds[i, r], rows.dz[i, r] = where(fresh, 0.0, rows.ds[i, r]), where(fresh, 0.0, rows.dz[i, r])
            count += on
        if sizes.bends > 0:
            for c in range(3 * SETS):
                at = tangent_at(sizes, i, c)
                rows.by_node[i, c] = where(fresh, 0.0, rows.by_node[i, c])
                for k in range(len(sizes.axes)):
                    rows.tangent[at, k] = where(fresh, group.drift[i, k], rows.tangent[at, k])
    return count


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _start(sizes, group, rows, new, count, time, tuning):
    """Slacks and multipliers of a start where `new` is 1. Returns the sum of s z there, and the largest row."""
    products, broken, fresh = 0.0 * new, 0.0 * new, new > 0.0
    for i in range(sizes.steps):
        for r in range(sizes.rows):
            there, g = group.on[i, r] > 0.0, rows.g[i, r]
            s = where(there, larger(-g, tuning.first_slack), 1.0)
            z = where(there, tuning.first_gap * time / (count * s), 0.0)
            per = where(there, 1.0 / s, 0.0)
            products, broken = products + s * z, larger(g, broken)
            rows.s[i, r], rows.z[i, r] = where(fresh, s, rows.s[i, r]), where(fresh, z, rows.z[i, r])
            rows.per_s[i, r] = where(fresh, per, rows.per_s[i, r])
            rows.q[i, r] = where(fresh, z * (g + s) * per, rows.q[i, r])
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
def _end(sizes, lane, at, done, iterations, group, rows, x, u, found):
    """Set what window `at`, in one lane, has come to. What holds a node off its leg against the pull does so for the time, like
    the row itself."""
    found.done[at], found.iterations[at] = done, iterations
    N, R = sizes.steps, sizes.rows
    tube = 8 * len(sizes.axes) + TUBE_NODE
    for i in range(N + 1):
        for s in range(len(sizes.state)):
            found.x[at, i, s] = pick(x[i, s], lane)
    for i in range(N):
        for c in range(len(sizes.control)):
            found.u[at, i, c] = pick(u[i, c], lane)
        for c in range(3 * SETS):
            found.place[at, i, c] = pick(rows.place[i, c], lane)
        for r in range(R):
            z = pick(rows.z[i, r], lane)
            if r == tube:
                z += pick(group.centre[i], lane) * (1.0 + 2.0 * pick(rows.g[i, r], lane))
            found.z[at, i, r] = z


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _ended(sizes, at, reached, over, turns, active, group, rows, x, u, found):
    """Set what the windows `at` (W,) have come to in active lanes where `over` is not 0. Returns which lanes stay active."""
    if anywhere(active * over > 0.0):
        for lane in range(len(sizes.width)):
            if pick(active, lane) > 0.0 and pick(over, lane) > 0.0:
                done, iterations = pick(reached, lane) > 0.0, int(pick(turns, lane))
                _end(sizes, lane, at[lane], done, iterations, group, rows, x, u, found)
                active = put(active, lane, 0.0)
    return active


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _go(sizes, x, u, factor, along):
    """A share of the step of nodes and controls."""
    for i in range(sizes.steps):
        for k in range(len(sizes.state)):
            x[i, k] += along * factor.dx[i, k]
        for k in range(len(sizes.control)):
            u[i, k] += along * factor.du[i, k]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, nogil=True)
def solve_group(sizes, numbers, motion, queue, held, work, found):
    """Search the windows of a queue in the lanes of a group (group.py), whose numbers and motion are overwritten. What each
    comes to is set in `found`."""
    width, group = sizes.width, lanes_of(sizes, numbers)
    S, W, Q = len(sizes.state), len(sizes.width), len(queue.windows)
    x, u = wide2(motion.x, width, sizes.state), wide2(motion.u, width, sizes.control)
    rows = rows_in(sizes, work, wide2(motion.place, width, PLACES))
    tuned = wide1(motion.tuning, width)
    factor = Factor(
        wide3(work.K, width, sizes.control, sizes.state),
        wide3(work.L, width, sizes.control, sizes.control),
        wide2(work.push, width, sizes.state),
        wide2(work.dx, width, sizes.state),
        wide2(work.du, width, sizes.control),
    )
    gap = wide2(work.gap, width, sizes.state)
    room, scratch = room_of(sizes, work, x), scratch_of(sizes, held)
    zero = 0.0 * tuned[0]
    lambda_end, change = vector(x, sizes.state), vector(x, sizes.state)
    for k in range(S):
        lambda_end[k] = zero
    looking = room.y, wide2(work.nearest, width, THREE), wide1(work.top, width)
    at, taken = np.zeros(W, np.int64), 0  # the window in each lane, and how many have been taken
    active, along, dual, count, time, products, gap_most, off = zero, zero, zero, zero, zero, zero, zero, zero
    prox, before, close, still, settled, turns = zero, zero, zero, zero, zero, zero
    rho, off_before, slow, least = zero, zero, zero, zero
    while True:
        new = zero
        for lane in range(W):
            if taken < Q and not pick(active, lane) > 0.0:
                at[lane] = taken
                if taken >= W:  # the first ones are there
                    for n in range(len(queue.lanes)):
                        queue.lanes[n, lane] = queue.windows[taken, n]
                new, taken = put(new, lane, 1.0), taken + 1
        tune = Tuning(tuned[0], tuned[1], tuned[2], tuned[3], tuned[4], tuned[5], tuned[6])
        begins = anywhere(new > 0.0)
        if begins:
            fresh = new > 0.0
            present, lasting = put_present(sizes, group, rows, new), _durations(sizes, group, u, zero)
            count, time, before = (
                where(fresh, present, count),
                where(fresh, lasting, time),
                where(fresh, lasting, before),
            )
            close, still, settled = (
                where(fresh, zero, close),
                where(fresh, zero, still),
                where(fresh, zero, settled),
            )
            slow, turns = where(fresh, zero, slow), where(fresh, zero, turns)
            prox, rho = where(fresh, tune.prox, prox), where(fresh, zero + END, rho)
            off_before, active = where(fresh, zero + np.inf, off_before), where(fresh, zero + 1.0, active)
            along, dual, least = (
                where(fresh, zero, along),
                where(fresh, zero, dual),
                where(fresh, zero, least),
            )
            for k in range(S):
                lambda_end[k] = where(fresh, zero, lambda_end[k])
            gap_most, off = gaps(sizes, group, x, u, gap)
        products, broken, owed = put_rows(
            sizes, group, held, x, u, rows, along, dual, least, looking, scratch
        )
        if begins:
            fresh = new > 0.0
            first, most = _start(sizes, group, rows, new, count, time, tune)
            products, broken = where(fresh, first, products), where(fresh, most, broken)
            owed = where(fresh, zero + np.inf, owed)  # nothing has ended before the first step
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
        lost = where(products <= LOST * time, where(turns < ITERATIONS, zero, 1.0 + zero), 1.0 + zero)
        active = _ended(sizes, at, reached, reached + lost, turns, active, group, rows, x, u, found)
        if not anywhere(active > 0.0):
            if taken == Q:
                break
            continue
        bad = factor_steps(
            sizes, group, held, x, u, gap, rows, tune.pull, prox, rho, lambda_end, factor, room, scratch
        )
        stiff = where(bad > 0.0, where(rho > END, active, zero), zero)
        if anywhere(stiff > 0.0):  # more digits than there are
            rho = where(stiff > 0.0, END + zero, rho)
            bad = factor_steps(
                sizes, group, held, x, u, gap, rows, tune.pull, prox, rho, lambda_end, factor, room, scratch
            )
        active = _ended(sizes, at, zero, bad, turns, active, group, rows, x, u, found)
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
        turns, least = turns + 1.0, CENTRED * aim
