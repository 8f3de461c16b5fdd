"""A motion that was found in long steps, searched once more in shorter ones.

Most of a search is finding which limit holds where. Long steps tell that in fewer of them, and what they end
at is an optimum of the shorter ones but for the freedom these have more: each step is divided into equal
parts of the same jerk, which is the same motion. It tells, too, how much of the tolerance chords and filters
take on each leg, so that the motion may use the rest (`reserve_for`).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import REVERSAL_ANGLE
from planner.joint.budgets import HALF
from planner.joint.checks import normal_shares
from planner.joint.groups import Search
from planner.joint.guess import Cut, Guess, least_of_legs, unit_of
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn, keeps_of
from planner.joint.price import LAWS, NORMAL, ROOM, VERTEX
from planner.joint.run import TubeRun

# Of the normal acceleration that a motion was found to have, what budgets leave room for [-]: with less the
# search has to hold it down in more places and takes longer, with more the path gets less of the tolerance.
# And at least, of the largest that the axes give [-].
HEADROOM, LEAST = 1.05, 0.05
MOST = 0.98  # of the tolerance that chords get where the path is worth nothing [-]
TINY = 1e-30  # keeps quotients finite


def reserve_for(run: TubeRun, leg: Array, found: TubeSolution, reach: float) -> tuple[FloatArray, FloatArray]:
    """(R,) normal acceleration that the budget of each leg has to leave room for [mm/s2]: `HEADROOM` times
    its own there and beside it, as far as chords and filters reach; where it turns back, the largest
    acceleration with which it may. And (R,) the share of the tolerance that this takes at most [-]: where the
    motion is held by what there was room for, as much as it is worth.

    leg   : (N,) of the steps that were found
    reach : of chords and filters, to both sides [s]
    """
    steps = found.steps
    assert steps is not None
    state = np.stack([steps.position, steps.velocity, steps.acceleration], axis=1)
    state = np.concatenate([state, state[-1:]])  # of the last node nothing is looked at
    of_one = keeps_of(run)._replace(normal=np.ones(len(run)))
    across = normal_shares(of_one, leg, steps.h, state, steps.jerk)
    end = np.cumsum(steps.h)
    begin = end - steps.h
    within = np.stack([np.searchsorted(end, begin - reach), np.searchsorted(begin, end + reach)], axis=1)
    wanted = np.maximum(HEADROOM * across, _turning_back(run, leg, state, within, reach))
    most = LEAST * np.minimum(run.reserved, run.across_max)
    np.maximum.at(most, leg, np.maximum.reduceat(np.append(wanted, 0.0), within.ravel())[::2])
    held = (most >= run.across_max) & ~_beside_reversal(run)
    return np.where(held, np.inf, most), np.where(held, _worth(run, leg, found), run.share)


def _worth(run: TubeRun, leg: Array, found: TubeSolution) -> FloatArray:
    """(R,) the share of the tolerance that chords and filters are worth on each leg [-], half of it or more: with p and
    q the prices of chords and path, dT/d(ln) as they are, p ln(share) + q ln(1 - share) is least at p/(p + q). On curves
    the path is worth next to nothing, at corners as much as chords."""
    if found.price is None:
        return run.share
    own = np.zeros((len(run), LAWS))
    np.subtract.at(own, leg, found.price[:, 3 * len(run.axis) :][:, :LAWS])
    path = own[:, ROOM] + own[:, VERTEX] + np.append(own[1:, VERTEX], 0.0)
    share = own[:, NORMAL] / np.maximum(own[:, NORMAL] + path, TINY)
    return np.clip(share, HALF, MOST)


def _turning_back(run: TubeRun, leg: Array, state: FloatArray, within: Array, reach: float) -> FloatArray:
    """(N,) the largest acceleration that a motion can turn back with where this one does [mm/s2], 0 where it
    does not.

    leg    : (N,) of the steps
    state  : (N+1, 3, A) at the nodes
    within : (N, 2) the first step, and the one behind the last, of those within `reach` [s] of each

    It turns back beside a vertex where the path does, where its velocity turns by more than a right angle and
    gets so small that it does within a period: chords miss the vertex there by what all of the acceleration
    makes of a period, that along the path too. Limited jerk takes a peak of sqrt(2 V j) from the speed V to as
    much the other way, of which long steps have shown less than half.
    """
    v, a = state[:, 1], state[:-1, 2]
    change, push = np.diff(v, axis=0), np.linalg.norm(a, axis=1)
    square = np.maximum((change**2).sum(axis=1), TINY)
    share = np.clip(-(v[:-1] * change).sum(axis=1) / square, 0.0, 1.0)
    slowest = np.linalg.norm(v[:-1] + share[:, None] * change, axis=1)
    turned = (v[within[:, 0]] * v[within[:, 1]]).sum(axis=1) < 0.0
    along = np.maximum(np.abs(a), TINY) / np.maximum(push, TINY)[:, None]
    fastest = np.minimum(run.feed[leg], np.linalg.norm(run.velocity))
    peak = np.minimum(
        (run.acceleration / along).min(axis=1), np.sqrt(2.0 * fastest * np.linalg.norm(run.jerk))
    )
    return np.where(turned & (slowest < push * reach) & _beside_reversal(run)[leg], peak, 0.0)


def _beside_reversal(run: TubeRun) -> Array:
    """(R,) whether the path turns back where a leg begins or ends."""
    legs = np.arange(len(run))
    ahead, behind = run.tangents(legs[1:], np.zeros(len(run) - 1)), run.tangents(legs[:-1], run.length[:-1])
    cosine = (ahead * behind).sum(axis=1)
    cosine /= np.maximum(np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1), TINY)
    back = cosine < np.cos(REVERSAL_ANGLE)
    return np.append(back, False) | np.append(False, back)


class Divided(NamedTuple):
    """A motion in shorter steps, and into how many equal parts each of its N steps was divided (N,)."""

    guess: Guess
    parts: Array


def divided(run: TubeRun, leg: Array, found: TubeSolution, cut: Cut) -> Divided:
    """The same motion in shorter steps: about as many as a start is cut into.

    leg   : (N,) of the steps that were found
    found : a motion, none of whose steps is kept
    """
    steps, place = found.steps, found.place
    assert steps is not None
    assert place is not None
    busy = (np.abs(steps.jerk) / run.jerk_scale).max(axis=1)
    lasting: FloatArray = np.bincount(leg, weights=steps.h, minlength=len(run)).astype(np.float64)
    even = (least_of_legs(run, lasting, cut) / lasting)[leg]
    wanted = steps.h * (busy * cut.per_unit / unit_of(run) + even)
    parts = np.maximum(np.rint(wanted), 1.0).astype(np.int64)
    of = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(of)) - (np.cumsum(parts) - parts)[of]
    h = (steps.h / parts)[of]
    t = (number * h)[:, None]
    p, v, a, j = (column[of] for column in (steps.position, steps.velocity, steps.acceleration, steps.jerk))
    state: FloatArray = np.zeros((len(of) + 1, 3, p.shape[1]))
    state[:-1, 0] = p + t * (v + t * (a / 2 + t * j / 6))
    state[:-1, 1] = v + t * (a + t * j / 2)
    state[:-1, 2] = a + t * j
    state[-1, 0] = run.vertex[-1]
    nodes = np.append(place[of] + (np.diff(place) / parts)[of] * number, place[-1])
    places = nodes[:-1, None] + np.diff(nodes)[:, None] * np.linspace(0.0, 1.0, 4)
    return Divided(Guess(leg=leg[of], h=h, state=state, place=places), parts)


def searched_again(
    run: TubeRun, found: TubeSolution, finer: Divided, solver: TubeOwn
) -> Search[TubeSolution | None]:
    """The best motion near one that was found, in shorter steps; None where none is faster.

    finer : that motion, divided
    """
    again = yield from replace(solver, stays=True).search(run, finer.guess)
    if again.steps is None:
        return None
    price = again.price
    if again.kept is not None and price is not None and found.price is not None:
        # what stays is an optimum of longer steps, with its prices
        before = np.repeat(found.price / finer.parts[:, None], finer.parts, axis=0)
        price = np.where(again.kept[:, None], before, price)
    return replace(
        again,
        status=found.status,
        sentence=found.sentence,
        iterations=found.iterations + again.iterations,
        solve_time=found.solve_time + again.solve_time,
        windows=found.windows + again.windows,
        solved=found.solved + again.solved,
        kept=None,
        price=price,
    )
