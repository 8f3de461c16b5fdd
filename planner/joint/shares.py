"""How much of each limit, and of the tolerance, the steps of a run use: what they are at.

Limits are looked at in the middle of a step: what is at its limit there is so for most of the step, where a
mere switch from one limit to another is at both for an instant. Of the tolerance it is the nearest control
point of the cubic, at a vertex the vertex.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint.motion import Steps
from planner.joint.own_laws import Where, motion_at
from planner.joint.run import TubeRun

NEAREST_STEPS = 3  # Gauss-Newton steps to the nearest place on an arc, from the node's


def shares(run: TubeRun, steps: Steps, leg: Array, place: FloatArray) -> FloatArray:
    """(N, 3 A + 3 + ..) shares of the limits [-]: jerk, acceleration and velocity of each axis, feed, normal
    acceleration, tolerance, the laws with a name of their own.

    leg   : (N,) of each step
    place : (N+1,) of the nodes along the run [mm]
    """
    h, p, v, a, j = steps.h[:, None], steps.position, steps.velocity, steps.acceleration, steps.jerk
    speed, push = v + h * (a / 2 + h * j / 8), a + h * j / 2
    square = (speed**2).sum(axis=1)
    across = push - ((speed * push).sum(axis=1) / np.maximum(square, 1e-30))[:, None] * speed
    local = place[:-1] - run.offset[leg]
    controls = np.concatenate([p, p + h * v / 3, p + h * (2 * v / 3 + h * a / 6)])
    far = _distance(run, np.tile(leg, 3), controls, np.tile(local, 3)).reshape(3, -1)
    used = far.max(axis=0) / run.room[leg]
    begins = np.flatnonzero(np.diff(leg, prepend=leg[0]) > 0)
    vertex = leg[begins]
    at = np.linalg.norm(p[begins] - run.vertex[vertex], axis=1) / run.vertex_budget[vertex]
    used[begins] = np.maximum(used[begins], at)
    state = np.stack([p, v, a], axis=1)
    laws = run.laws.shares(Where(leg, (place[:-1] + place[1:]) / 2.0), motion_at(state, j, steps.h / 2.0))
    return np.column_stack(
        [
            np.abs(j) / run.jerk,
            np.abs(push) / run.acceleration,
            np.abs(speed) / run.velocity,
            np.maximum(np.sqrt(square) / run.feed[leg], run.word_share(leg, speed)),
            np.linalg.norm(across, axis=1) / run.across_max[leg],
            used,
            laws[:, run.laws.named],
        ]
    )


def _distance(run: TubeRun, leg: Array, point: FloatArray, x: FloatArray) -> FloatArray:
    """(N,) distances of points (N, A) from their legs, from places x (N,) near the nearest ones [mm]."""
    for _ in range(NEAREST_STEPS if run.radius.any() else 1):
        along = run.tangents(leg, x)
        x = x + ((point - run.points(leg, x)) * along).sum(axis=1) / (along**2).sum(axis=1)
        x = np.clip(x, 0.0, run.length[leg])
    return np.asarray(np.linalg.norm(point - run.points(leg, x), axis=1))
