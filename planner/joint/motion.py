"""From steps to a motion: integrated exactly, ending exactly, and slowed down by what is left of rounding.

A solver's rows have residuals of some 1e-8. The steps' jerks are integrated from the first node, and the
smallest change of the jerks that makes the last node meet its end is added (least squares, per axis). Slowing
down by lam divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and leaves the path as it is.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.guess import Guess
from planner.joint.own_laws import Where, motion_at
from planner.joint.run import TubeRun

# Steps between two nodes that a motion is made to meet: gaps of the kinematics add up over them, with their
# square from acceleration to position. (Over the 1,500 of a window gaps of 1e-10 mean steps became 1e-4.)
CLOSED_EVERY = 50
# Places in every step at which the normal acceleration is measured [fraction of the step]; between them it is
# above by less than 1e-6.
MEASURED_AT = np.linspace(0.0, 1.0, 257)


@dataclass(frozen=True, eq=False, kw_only=True)
class Steps:
    """N steps of constant jerk over A axes, along a run.

    h                                    : (N,) duration [s]
    position, velocity, acceleration     : (N, A) at the start of each
    jerk                                 : (N, A) on the step
    """

    h: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def steps_of(run: TubeRun, guess: Guess, h: FloatArray, jerk: FloatArray) -> Steps:
    """The motion with the jerk (N, A) [mm/s3] over steps of h (N,) [s], from vertex to vertex and within all
    limits (module text).

    guess : what the search began with
    """
    begin, end = np.stack([run.vertex[[0, -1]], run.ends, 0.0 * run.ends], axis=1)
    jerk = closed(begin, end, h, jerk)
    p, v, a = np.moveaxis(integrated(begin, h, jerk)[:-1], 1, 0)
    steps = Steps(h=h, position=p, velocity=v, acceleration=a, jerk=jerk)
    by = max(_excess(run, guess, steps), 1.0)
    return Steps(h=h * by, position=p, velocity=v / by, acceleration=a / by**2, jerk=jerk / by**3)


def integrated(begin: FloatArray, h: FloatArray, jerk: FloatArray) -> FloatArray:
    """(N+1, 3, A) position, velocity and acceleration at the nodes, from those at the first one, begin (3, A)
    [mm, s]. Of several motions at once with further dimensions before these.

    h    : (N,) durations [s]
    jerk : (N, A) constant on each step [mm/s3]
    """
    h, p, v, a = h[..., None], *np.moveaxis(begin[..., None, :, :], -2, 0)
    a = _summed(a, h * jerk)
    v = _summed(v, h * (a[..., :-1, :] + h * jerk / 2))
    p = _summed(p, h * (v[..., :-1, :] + h * (a[..., :-1, :] / 2 + h * jerk / 6)))
    return np.stack([p, v, a], axis=-2)


def _summed(begin: FloatArray, change: FloatArray) -> FloatArray:
    """(.., N+1, A) begin (.., 1, A) and the sums of the changes (.., N, A) after it."""
    return np.concatenate([begin, begin + np.cumsum(change, axis=-2)], axis=-2)


def closed(begin: FloatArray, end: FloatArray, h: FloatArray, jerk: FloatArray) -> FloatArray:
    """(N, A) jerks that lead from `begin` (3, A) to `end` (3, A), position, velocity and acceleration: those
    given, changed least. Of several motions at once with further dimensions before these.

    h    : (N,) durations [s], of which some may be 0
    jerk : (N, A) [mm/s3]
    """
    lasts = h.sum(axis=-1)[..., None]
    rest = (lasts - np.cumsum(h, axis=-1)) / lasts  # after each step, in units of the whole time
    own = h / lasts
    to_end = np.stack(
        [own * (own**2 / 6 + rest * (own / 2 + rest / 2)), own * (own / 2 + rest), own], axis=-2
    )  # of p, v, a, in those units
    missed = (integrated(begin, h, jerk)[..., -1, :, :] - end) / lasts[..., None] ** [[3.0], [2.0], [1.0]]
    return jerk - np.linalg.pinv(to_end) @ missed


def closed_at_nodes(state: FloatArray, h: FloatArray, jerk: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The motion that meets every `CLOSED_EVERY`th of the nodes, state (N+1, 3, A), and the last one: its
    nodes, and the jerks (N, A), those given changed least between two of them.

    h    : (N,) durations [s]
    jerk : (N, A) [mm/s3]
    """
    ends = np.linspace(0, len(h), max(len(h) // CLOSED_EVERY, 1) + 1).astype(int)
    begin, steps = ends[:-1], np.diff(ends)
    number = np.arange(steps.max())
    there = number < steps[:, None]
    of = np.minimum(begin[:, None] + number, len(h) - 1)
    lasting = np.where(there, h[of], 0.0)  # a step of no duration stands for one that is not there
    jerks = closed(state[begin], state[ends[1:]], lasting, jerk[of])
    nodes = integrated(state[begin], lasting, jerks)[:, :-1]
    return np.concatenate([nodes[there], state[-1:]]), jerks[there]


def _largest_square(v: FloatArray, middle: FloatArray, after: FloatArray, counts: FloatArray) -> FloatArray:
    """(N,) the largest Bernstein coefficient of the squared speed in the axes that count (A,) on each step
    (rows.py)."""
    v, middle, after = v * counts, middle * counts, after * counts
    square = [(v * v).sum(axis=1), (v * middle).sum(axis=1), (middle * after).sum(axis=1)]
    square.append((2.0 * (middle * middle).sum(axis=1) + (v * after).sum(axis=1)) / 3.0)
    return np.asarray(np.maximum(np.max(square, axis=0), 0.0))


def _excess(run: TubeRun, guess: Guess, steps: Steps) -> float:
    """By what factor the motion has to be slowed down to keep all limits; <= 1 if it keeps them."""
    h, v, a, j = steps.h[:, None], steps.velocity, steps.acceleration, steps.jerk
    middle, after = v + h * a / 2, v + h * (a + h * j / 2)
    ordinates = np.concatenate(
        [v, middle]
    )  # both bound the parabola; every step ends where the next one begins
    leg = guess.leg
    feed = [_largest_square(v, middle, after, np.ones(len(run.axis))) / run.feed[leg] ** 2]
    feed += [_largest_square(v, middle, after, run.counts) / one[leg] ** 2 for one in run.word.T]
    ratios = [
        (np.abs(ordinates) / run.velocity).max(),
        np.sqrt(np.max(feed)),
        np.sqrt((np.abs(a) / run.acceleration).max()),
        np.cbrt((np.abs(j) / run.jerk).max()),
    ]
    watched = np.isfinite(run.across_max).any() or len(run.laws)
    state, begin, end = np.stack([steps.position, v, a], axis=1), guess.place[:, 0], guess.place[:, 3]
    for fraction in MEASURED_AT if watched else ():
        tau = fraction * h
        along, push = v + tau * (a + tau * j / 2), a + tau * j
        speed_sq = (along**2).sum(axis=1)
        across_sq = (push**2).sum(axis=1) * speed_sq - (along * push).sum(axis=1) ** 2
        normal_sq = np.divide(across_sq, speed_sq, out=np.zeros(len(h)), where=speed_sq > 0)
        ratios.append(np.sqrt(np.sqrt(np.maximum(normal_sq, 0.0)) / run.across_max[leg]).max())
        where = Where(leg, begin + fraction * (end - begin))
        used = run.laws.shares(where, motion_at(state, j, fraction * steps.h)) ** (1.0 / run.laws.orders)
        ratios.append(used.max(initial=0.0))
    return float(max(ratios))
