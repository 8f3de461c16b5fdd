"""The free optimum inside the tolerance near a motion, by a primal-dual interior-point method with slacks
(Mehrotra 1992).

    minimise    sum of h + pull sum ((h - guess)/guess)^2 + sum h (smooth (jerk/limit)^2 + centre (d/room)^2/2)
    subject to  the kinematics (recursion.py) and g <= 0 for every row (rows.py), with slacks s and multipliers z

from a motion that need keep neither: gaps and what is missing of g + s = 0 shrink with every step. The h of
the last sum is as it was guessed, and d the distance of the node from its leg (numbers.py). Kinematics and
rows are linearised anew in every iteration. The curvature of the rows counts, that of the kinematics does
not: h times velocity, acceleration and jerk is indefinite, and with it a step would not go down. Instead a
change of h costs `prox` in every iteration, so that steps stay where the linear model holds. So does a change
of the velocity where the normal acceleration is limited (normal_rows.py).

Where a phase of constant jerk is cut into steps does not matter, and the search would go on among equal
optima for ever. When the complementarity s.z has reached what is asked for and the time has settled, prox
grows by `FREEZE` in every iteration, until rows and kinematics hold.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import CONTRACT, njit
from planner.joint.curvature import Barrier
from planner.joint.normal_rows import BETWEEN
from planner.joint.recursion import END, Factor, NewtonStep, factor_steps, forces, gaps, newton_step
from planner.joint.rows import TUBE_NODE, VECTORS, Linear, put_rows, slopes

TO_BOUNDARY = 0.995  # of the way to the nearest bound that a step may go [-]
# Growth of prox per iteration once it grows, and its largest value [-]: slower growth takes more iterations. At
# the largest the durations stay, so that the kinematics are linear and a step closes them: at 1e4 they creep on,
# and windows go on to the last iteration for the gaps that this leaves.
FREEZE, FROZEN = 2.5, 1e8
# The time has settled when it changes by no more than this share of the complementarity asked for in so many
# iterations in a row, and at last after so many at that complementarity: frozen as soon as that is reached,
# motions end slower.
STILL, STILL_FOR, CLOSE_FOR = 0.1, 2, 40
MELT = 0.8  # by which prox falls in each of these iterations, as far as `Tuning.least` lets it [-]
# Second-order terms of Mehrotra's corrector count where the predictor goes this share of its way [-]: behind
# a short step they lead astray.
PREDICTED = 0.3
# Largest gap of the kinematics at the end, in mean steps [-]: `closed_at_nodes` adds those of fifty steps up.
# The last gap stays at 1e-9 once durations hardly change.
OFF = 2e-9
# Where the last node's gap does not get less by this share in each of so many iterations in a row, once prox grows, its
# rho (recursion.py) grows by so many times, up to a value at which the recursion still has four digits [-].
SLOWLY, SLOW_FOR, STIFFER, STIFFEST = 0.5, 3, 10.0, 1e12
LOST = 1e3  # complementarity from which no search has come back, share of the time [-]
ITERATIONS = 140  # 20 to 90 are the rule


class Tuning(NamedTuple):
    """Of the search."""

    pull: float  # weight of ((h - guess)/guess)^2, against a mean step's time
    prox: float  # the same of the change in one iteration
    gap: float  # complementarity at the end, share of the time
    # By how much a row may be broken at the end, and how far the slack of an active one (z > s) may be off:
    # limits are narrowed by more than that (problem.py). Slacks of the others follow no more closely than the
    # tangents that are kept.
    missed: float
    least: float  # to which prox falls while the time settles
    first_gap: float  # complementarity of the start, share of the time
    first_slack: float  # of the start, at least


class Slacks(NamedTuple):
    """Slacks and multipliers of the rows (N, R)."""

    s: FloatArray
    z: FloatArray
    missing: FloatArray  # g + s
    ds: FloatArray
    dz: FloatArray


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _reach(on, s, ds):
    """Share of a step ds (N, R) that keeps s positive, at most 1."""
    most = 0.0
    for i in range(s.shape[0]):
        for r in range(s.shape[1]):
            if on[i, r]:
                most = max(most, -ds[i, r] / s[i, r])
    return min(1.0, TO_BOUNDARY / most) if most > 0.0 else 1.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _start(on, g, time, tuning, slacks):
    """Slacks and multipliers of a start."""
    rows = 0
    for i in range(len(on)):
        for r in range(on.shape[1]):
            rows += 1 if on[i, r] else 0
    for i in range(len(on)):
        for r in range(on.shape[1]):
            slacks.s[i, r], slacks.z[i, r] = 1.0, 0.0
            if on[i, r]:
                slacks.s[i, r] = max(-g[i, r], tuning.first_slack)
                slacks.z[i, r] = tuning.first_gap * time / rows / slacks.s[i, r]
                slacks.missing[i, r] = g[i, r] + slacks.s[i, r]
    return rows


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _directions(on, slacks, slope, aim, second):
    """Steps of slacks and multipliers towards s z = aim - second, where the rows grow by `slope`."""
    s, z, missing, ds, dz = slacks
    for i in range(len(on)):
        for r in range(on.shape[1]):
            if on[i, r]:
                ds[i, r] = -missing[i, r] - slope[i, r]
                dz[i, r] = (aim - second[i, r] - z[i, r] * ds[i, r]) / s[i, r] - z[i, r]


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _predicted(on, slacks, along, dual, second):
    """Complementarity after a predictor that goes the shares `along` and `dual` of its way; second (N, R) its
    second-order terms."""
    s, z, _, ds, dz = slacks
    left = 0.0
    for i in range(len(on)):
        for r in range(on.shape[1]):
            if on[i, r]:
                left += (s[i, r] + along * ds[i, r]) * (z[i, r] + dual * dz[i, r])
                second[i, r] = ds[i, r] * dz[i, r] if along > PREDICTED else 0.0
    return left


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, nogil=True)
def solve_window(legs, limits, x, u, place, tuning, at):
    """Overwrites x (N+1, 3 A), u (N, A+1) and place (N, 3) (problem.py) with the optimum near them. Returns
    whether it has been reached, the iterations, and the multipliers (N, R) of the rows, in units of time.
    Meanwhile at[0] is the iteration."""
    N, axes = len(u), u.shape[1] - 1
    R, S, C, on = limits.on.shape[1], 3 * axes, axes + 1, limits.on
    many = (N, R)
    n, alpha, e, tangent = (
        np.zeros((N, R, axes)),
        np.zeros((N, VECTORS, 4)),
        np.zeros((N, VECTORS, axes)),
        np.zeros((N, 3, axes)),
    )
    node = np.zeros((N, 3, axes))
    own = np.zeros((N, BETWEEN + limits.laws.first[-1], S + C))
    lin = Linear(np.zeros(many), n, node, alpha, e, tangent, place, np.zeros((N, 3)), own)
    factor = Factor(np.zeros((N, C, S)), np.zeros((N, C, C)), np.zeros((N + 1, S, S)))
    slacks = Slacks(np.zeros(many), np.zeros(many), np.zeros(many), np.zeros(many), np.zeros(many))
    s, z, missing, ds, dz = slacks
    second, slope, q, ratio = np.zeros(many), np.zeros(many), np.zeros(many), np.zeros(many)
    gap, w, after, end = np.zeros((N, S)), np.zeros((N, S + C)), np.zeros((N, S)), np.zeros(S)
    dx, du = np.zeros((N + 1, S)), np.zeros((N, C))
    put_rows(legs, limits, x, u, lin)
    gaps(x, u, gap)
    time = u[:, axes].sum()
    rows = _start(on, lin.g, time, tuning, slacks)
    settled, prox, before, close, still = False, tuning.prox, time, 0, 0
    last, off_before, slow = END, np.inf, 0
    # what the node's distance from its leg costs acts on it as a multiplier of its row does
    centred, tube = np.zeros(many), 8 * axes + TUBE_NODE
    for i in range(N):
        if on[i, tube]:
            centred[i, tube] = limits.centre[i] * limits.h[i]
    for iteration in range(ITERATIONS):
        at[0] = iteration
        products, missed, broken = 0.0, 0.0, 0.0
        for i in range(N):
            for r in range(R):
                if on[i, r]:
                    products += s[i, r] * z[i, r]
                    broken = max(broken, lin.g[i, r])
                    if z[i, r] > s[i, r]:
                        missed = max(missed, missing[i, r])
                    ratio[i, r] = z[i, r] / s[i, r]
        now = u[:, axes].sum()
        close = close + 1 if products <= 2.0 * tuning.gap * time else 0
        still = still + 1 if close and abs(now - before) <= STILL * tuning.gap * time else 0
        settled, before = settled or still == STILL_FOR or close > CLOSE_FOR, now
        if close and not settled:
            prox = min(prox, max(prox * MELT, tuning.least))
        if settled:
            prox, off = min(prox * FREEZE, FROZEN), np.abs(gap[N - 1]).max()
            slow = slow + 1 if max(SLOWLY * off_before, OFF) < off else 0
            if slow == SLOW_FOR:
                last, slow = min(STIFFER * last, STIFFEST), 0
            off_before = off
            if max(broken, missed) <= tuning.missed and np.abs(gap).max() <= OFF:
                # what holds a node off its leg against the pull does so for the time, like the row itself
                return True, iteration, z + centred * (1.0 + 2.0 * lin.g)
        if not products <= LOST * time or not factor_steps(
            x, u, legs, limits, lin, Barrier(z + centred, ratio), tuning.pull + prox, last, factor
        ):
            return False, iteration, z
        second[:] = 0.0
        aim, along, dual = 0.0, 1.0, 1.0
        for phase in range(2):
            if phase == 1:
                left = _predicted(on, slacks, along, dual, second)
                aim = max((left / products) ** 3 * products, tuning.gap * time) / rows
            for i in range(N):
                for r in range(R):
                    if on[i, r]:
                        q[i, r] = centred[i, r] + (aim - second[i, r] + z[i, r] * missing[i, r]) / s[i, r]
            forces(limits, lin, q, tuning.pull, u, w)
            newton_step(x, u, gap, w, end, factor, NewtonStep(dx, du, after))
            slopes(limits, lin, dx, du, slope)
            _directions(on, slacks, slope, aim, second)
            along, dual = _reach(on, s, ds), _reach(on, z, dz)
        for k in range(S):
            end[k] += along * (after[N - 1, k] - end[k])
        x[1:N] += along * dx[1:N]
        u += along * du
        put_rows(legs, limits, x, u, lin)
        gaps(x, u, gap)
        for i in range(N):
            for r in range(R):
                if on[i, r]:
                    s[i, r] += along * ds[i, r]
                    z[i, r] += dual * dz[i, r]
                    missing[i, r] = lin.g[i, r] + s[i, r]
    return False, ITERATIONS, z
