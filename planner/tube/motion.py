"""From steps to a motion: integrated exactly, ending exactly, and slowed down by what is left of rounding.

The solver's rows have residuals of some 1e-8. The steps' jerks are integrated from rest, and the smallest change of the jerks that
makes the last node meet the end at rest is added (least squares, per axis). Slowing down by lam divides speeds by lam, accelerations
by lam^2 and jerks by lam^3 and leaves the path as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.tube.guess import Guess
from planner.tube.outcome import TubeSolution
from planner.tube.run import TubeRun

# Places in every step at which the normal acceleration is measured [fraction of the step]; between them it is above by less than 1e-6.
MEASURED_AT = np.linspace(0.0, 1.0, 257)


@dataclass(frozen=True, eq=False, kw_only=True)
class Steps:
    """N steps of constant jerk over A axes, from rest to rest.

    h                                    : (N,) duration [s]
    position, velocity, acceleration     : (N, A) at the start of each
    jerk                                 : (N, A) on the step
    """

    h: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def steps_of(run: TubeRun, guess: Guess, solution: TubeSolution) -> Steps:
    """The motion of a solution, from vertex to vertex and within all limits (module text).

    solution : one that found steps; `guess` is what it began with
    """
    assert solution.h is not None
    assert solution.jerk is not None
    h, jerk = solution.h, solution.jerk
    steps = integrated(run, h, jerk - closing_jerks(run, h, jerk))
    by = max(_excess(run, guess, steps), 1.0)
    return Steps(
        h=h * by,
        position=steps.position,
        velocity=steps.velocity / by,
        acceleration=steps.acceleration / by**2,
        jerk=steps.jerk / by**3,
    )


def integrated(run: TubeRun, h: FloatArray, jerk: FloatArray) -> Steps:
    """The motion from rest at the first vertex with the jerk (N, A) [mm/s3], constant over steps of h (N,) [s]."""
    h = h[:, None]
    acceleration = _before(h * jerk)
    velocity = _before(h * (acceleration + h * jerk / 2))
    position = run.vertex[0] + _before(h * (velocity + h * (acceleration / 2 + h * jerk / 6)))
    return Steps(h=h[:, 0], position=position, velocity=velocity, acceleration=acceleration, jerk=jerk)


def _before(change: FloatArray) -> FloatArray:
    """(N, A) sums of the changes before each step."""
    return np.vstack([np.zeros((1, change.shape[1])), np.cumsum(change, axis=0)[:-1]])


def closing_jerks(run: TubeRun, h: FloatArray, jerk: FloatArray) -> FloatArray:
    """(N, A) the smallest change of jerk [mm/s3] without which the motion would not end at rest at the last vertex.

    h    : (N,) durations [s]
    jerk : (N, A) [mm/s3]
    """
    rest = (h.sum() - np.cumsum(h)) / h.sum()  # after each step, in units of the whole time
    own = h / h.sum()
    to_end = np.stack(
        [own, own * (own / 2 + rest), own * (own**2 / 6 + rest * (own / 2 + rest / 2))]
    )  # of a, v, p, in those units
    apart = (run.vertex[-1] - run.vertex[0]) / h.sum() ** 3
    missed = to_end @ jerk - np.stack([np.zeros_like(apart), np.zeros_like(apart), apart])
    closing: FloatArray = np.linalg.lstsq(to_end, missed, rcond=None)[0]
    return closing


def _excess(run: TubeRun, guess: Guess, steps: Steps) -> float:
    """By what factor the motion has to be slowed down to keep all limits; <= 1 if it keeps them."""
    h, v, a, j = steps.h[:, None], steps.velocity, steps.acceleration, steps.jerk
    ordinates = np.concatenate(
        [v, v + h * a / 2]
    )  # both bound the parabola; every step ends where the next one begins
    leg = guess.leg
    ratios = [
        (np.abs(ordinates) / run.velocity).max(),
        (np.linalg.norm(ordinates, axis=1) / np.tile(run.feed[leg], 2)).max(),
        np.sqrt((np.abs(a) / run.acceleration).max()),
        np.cbrt((np.abs(j) / run.jerk).max()),
    ]
    for fraction in MEASURED_AT if np.isfinite(run.across_max).any() else ():
        tau = fraction * h
        along, push = v + tau * (a + tau * j / 2), a + tau * j
        speed_sq = (along**2).sum(axis=1)
        across_sq = (push**2).sum(axis=1) * speed_sq - (along * push).sum(axis=1) ** 2
        normal_sq = np.divide(across_sq, speed_sq, out=np.zeros(len(h)), where=speed_sq > 0)
        ratios.append(np.sqrt(np.sqrt(np.maximum(normal_sq, 0.0)) / run.across_max[leg]).max())
    return float(max(ratios))
