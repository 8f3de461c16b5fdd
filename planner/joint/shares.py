"""How much of each limit, and of the tolerance, the steps of a run use: what they are at.

Limits are looked at in the middle of a step: what is at its limit there is so for most of the step, where a
mere switch from one limit to another is at both for an instant. Of the tolerance it is the nearest control
point of the cubic, at a vertex the vertex.

Where what was found in a window exceeds laws (own_laws.py) or the tolerance, it is searched once more (own.py),
with the laws tightened by what they were exceeded by.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.joint.guess import CutMotion, Guess
from planner.joint.legs import nearest_point
from planner.joint.motion import Steps
from planner.joint.own_laws import Where, motion_at
from planner.joint.run import TubeRun
from planner.machine.user_limit import QUANTITIES


def shares(run: TubeRun, steps: Steps, leg: Array, place: FloatArray) -> FloatArray:
    """(N, 3 A + 3 + ..) shares of the limits [-]: jerk, acceleration and velocity of each axis, feed, normal
    acceleration, tolerance, the laws with a name of their own.

    leg   : (N,) of each step
    place : (N+1,) of the nodes along the run [mm]
    """
    motion, axes = (steps.position, steps.velocity, steps.acceleration, steps.jerk), len(run.axis)
    used = _shares(run.keeps, run.room, run.vertex, leg, steps.h, motion, place[:-1] - run.offset[leg])
    if not len(run.laws):
        return np.asarray(used)
    h, (p, v, a, j) = steps.h[:, None], motion
    used[:, 3 * axes] = np.maximum(used[:, 3 * axes], run.word_share(leg, v + h * (a / 2 + h * j / 8)))
    state = np.stack([p, v, a], axis=1)
    laws = run.laws.shares(Where(leg, (place[:-1] + place[1:]) / 2.0), motion_at(state, j, steps.h / 2.0))
    return np.column_stack([used, laws[:, run.laws.named]])


@njit(cache=True, error_model="numpy")
def _shares(keeps, room, vertex, leg, h, motion, x):
    """`shares` (N, 3 A + 3) but for laws; room (R,), vertex (R+1, A) of the run, x (N,) places of the nodes on their legs."""
    p, v, a, j = motion
    N, axes = p.shape
    found = np.zeros((N, 3 * axes + 3))
    control, point, tangent, speed, push = np.empty((5, axes))
    for i in range(N):
        r, used = leg[i], found[i]
        square, along, across, off = 0.0, 0.0, 0.0, 0.0
        for k in range(axes):
            speed[k] = v[i, k] + h[i] * (a[i, k] / 2.0 + h[i] * j[i, k] / 8.0)
            push[k] = a[i, k] + h[i] * j[i, k] / 2.0
            square, along = square + speed[k] * speed[k], along + speed[k] * push[k]
            used[k] = abs(j[i, k]) / keeps.jerk[k]
            used[axes + k] = abs(push[k]) / keeps.acceleration[k]
            used[2 * axes + k] = abs(speed[k]) / keeps.velocity[k]
            off += (p[i, k] - vertex[r, k]) ** 2
        for k in range(axes):
            across += (push[k] - along / max(square, 1e-30) * speed[k]) ** 2
        used[3 * axes] = np.sqrt(square) / keeps.feed[r]
        used[3 * axes + 1] = np.sqrt(across) / keeps.normal[r]
        for m in range(3):
            apart = 0.0
            for k in range(axes):
                control[k] = p[i, k]
                if m == 1:
                    control[k] += h[i] * v[i, k] / 3.0
                elif m == 2:
                    control[k] += h[i] * (2.0 * v[i, k] / 3.0 + h[i] * a[i, k] / 6.0)
            nearest_point(keeps.legs, r, control, x[i], point, tangent)
            for k in range(axes):
                apart += (control[k] - point[k]) ** 2
            used[3 * axes + 2] = max(used[3 * axes + 2], np.sqrt(apart) / room[r])
        if i > 0 and r > leg[i - 1]:
            used[3 * axes + 2] = max(used[3 * axes + 2], np.sqrt(off) / keeps.vertex_budget[r])
    return found


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
