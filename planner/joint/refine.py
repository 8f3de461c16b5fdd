"""A motion that was found in long steps, searched once more in shorter ones.

Most of a search is finding which limit holds where. Long steps tell that in fewer of them, and what they end
at is an optimum of the shorter ones but for the freedom these have more: each step is divided into equal
parts of the same jerk, which is the same motion.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint.groups import Search
from planner.joint.guess import Cut, Guess, least_of_legs, unit_of
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.run import TubeRun


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
    state[-1, :2] = run.vertex[-1], run.ends[1]
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
