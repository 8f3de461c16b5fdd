"""A window that is searched once more, as what was found exceeds laws (own_laws.py) or the tolerance."""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint.guess import CutMotion, Guess
from planner.joint.own_laws import Where
from planner.joint.run import TubeRun
from planner.machine.user_limit import QUANTITIES

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
