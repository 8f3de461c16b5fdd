"""How much of each limit, and of the tolerance, the steps of a run use: what they are at.

Limits are looked at in the middle of a step: what is at its limit there is so for most of the step, where a
mere switch from one limit to another is at both for an instant. Of the tolerance it is the nearest control
point of the cubic, at a vertex the vertex.

Where what was found in a window exceeds laws (own_laws.py) or the tolerance, it is searched once more (own.py),
with the laws tightened by what they were exceeded by.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint.guess import CutMotion, Guess
from planner.joint.motion import Steps
from planner.joint.own_laws import Where, motion_at
from planner.joint.run import TubeRun
from planner.machine.user_limit import QUANTITIES

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


# So often at most. A share above 1 by more than this comes of places that the motion slid to [-].
TOLD, SLID = 6, 0.01
PULL_AGAIN = 0.1  # so that what is searched once more hardly slides along itself [-]
# Power of a share by which a law is lowered, by this at least [-] (what slides on is above it by some 1e-6
# every time), and on so many steps beside; everywhere from a try on, as it slides from step to step, by as much as
# is asked for anywhere, at most by `ALL_BY`.
TIGHTER_BESIDE, LOWERED, BESIDE, EVERYWHERE, ALL_BY = 1.5, 1e-5, 3, 2, 3e-4
LOWERED_MOST = 0.2  # as what is far above its limit comes of a place where the motion hardly moves [-]
JERK = QUANTITIES.index("jerk")


def tightened(over: FloatArray, number: int) -> FloatArray:
    """(N, M) by what laws are divided where their shares `over` (N, M) are above 1: by half as much again, and
    beside there too, where it goes next, and at last everywhere by a little; number: of the try, from 0."""
    above = np.where(over > 1.0, np.clip(over, 1.0 + LOWERED, 1.0 + LOWERED_MOST), 1.0)
    more = above**TIGHTER_BESIDE
    for back in range(1, BESIDE + 1):
        more[back:] = np.maximum(more[back:], above[:-back])
        more[:-back] = np.maximum(more[:-back], above[back:])
    return np.maximum(more, np.minimum(above.max(axis=0), 1.0 + ALL_BY)) if number >= EVERYWHERE else more


def law_shares(run: TubeRun, cut: CutMotion | Guess, node: Array) -> FloatArray:
    """(n, M) shares that a cut motion uses at nodes `node` (n,) of the laws that do not depend on its jerk, which is free
    there; 0 of the others."""
    if not len(run.laws):
        return np.zeros((len(node), 0))
    state = cut.state[node]
    motion = np.concatenate([state, np.zeros_like(state[:, :1])], axis=1)
    free = [law.quantity == JERK for law in run.laws.laws]
    return np.where(free, 0.0, run.laws.shares(Where(cut.leg[node], cut.place[node, 0]), motion))


def strain(run: TubeRun, guess: Guess) -> FloatArray:
    """(N,) the largest share of a limit or of the tolerance that a motion uses at the beginning of each
    step."""
    leg: Array = guess.leg
    p, v, a = (guess.state[:-1, k] for k in range(3))
    far = np.linalg.norm(p - run.points(leg, guess.place[:, 0] - run.offset[leg]), axis=1) / run.room[leg]
    shares = (
        far,
        (np.abs(v) / run.velocity).max(axis=1),
        np.linalg.norm(v, axis=1) / run.feed[leg],
        run.word_share(leg, v),
        (np.abs(a) / run.acceleration).max(axis=1),
        *law_shares(run, guess, np.arange(len(leg))).T,
    )
    return np.max(shares, axis=0)
