"""Profiles on exact kinematics, near one whose kinematics are not: starts, and results polished."""

import numpy as np

from planner.base.kernels import njit
from planner.feedrate.jerk.interior_point import within_domain
from planner.feedrate.jerk.layout import CONVEX, COSTATE, GRADIENT, LANES, STEP, STEP_END, X_END, H, P, U, X
from planner.feedrate.jerk.riccati import forward, offsets, riccati
from planner.feedrate.jerk.rows import PASSING, kinematics


@njit(cache=True, error_model="numpy", nogil=True)
def track(blocks, jerk, smoothing, rounds, defect_max, settings):
    """A motion on exact kinematics, not far from the x of the profile in `blocks`, in its place: Gauss-Newton
    on the time integral of (dx/x)^2 J + j^2/J, with the jerk j of the result and a jerk J of the machine's
    size; without smoothing, j is the change of the jerk. Both ends stay.

    rounds     : at most
    defect_max : that it ends with, if it gets there

    Returns the defect that is left.
    """
    n, work = blocks.n, blocks.work
    passing = np.empty(PASSING)
    asked = work[:, X : X + LANES].copy()
    work[:, CONVEX:COSTATE] = 0.0
    worst, defect = np.inf, np.empty(LANES)
    for _ in range(rounds):
        defect[:] = 0.0
        for b in range(len(work)):
            w, m = work[b], min(LANES, n - b * LANES)
            kinematics(blocks.grid[b], w, passing, defect, m)
            for i in range(m):
                span = w[H + i] * jerk
                weight = span / (asked[b, i] * asked[b, i]) if b + i > 0 else 0.0
                w[CONVEX + i], w[CONVEX + 5 * LANES + i] = weight, 1.0 / span
                w[GRADIENT + i], w[GRADIENT + LANES + i] = weight * (w[X + i] - asked[b, i]), 0.0
                w[GRADIENT + 2 * LANES + i] = smoothing * w[P + i] / span
        worst = defect.max()
        if worst <= defect_max or not riccati(blocks, 0.0):
            break
        offsets(blocks, 0.0)
        primal = within_domain(blocks, forward(blocks, settings.feed_sq_shrink), settings)
        for b in range(len(work)):
            w = work[b]
            for i in range(min(LANES, n - b * LANES)):
                w[X + i] += primal * w[STEP + i]
                w[X_END + i] += primal * w[STEP_END + i]
                w[U + i] += primal * w[STEP + LANES + i]
                w[P + i] += primal * w[STEP + 2 * LANES + i]
    return worst
