"""Limits of one's own in the feedrate problem: each is an axis more (own.py says what they are,
feedrate/sampling/user_rows.py makes their rows).

The axes are scaled by 1/max |q'|, so that none of them moves faster than the path; whatever unit a limit is
in, solvers see numbers like those of the machine's axes. Rows are shares of limits, so that scaling changes
nothing else.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import NotSolvedError
from planner.feedrate.constraints.limits import VELOCITY, Limits
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.user_rows import user_rows

DERIVATIVES = ("d1", "d2_left", "d2_right", "d3_left", "d3_right")


def with_user_limits(problem: FeedrateProblem, samples: PathSamples, limits: Limits) -> FeedrateProblem:
    """The problem with the limits `along` as further axes; the margin says what is found between the points.

    Raises NotSolvedError where a limit changes faster than the grid follows, InputError for a bound that is
    not positive and for a joint without derivatives.
    """
    rows, own = user_rows(samples, limits), tuple(limit.name for limit in limits.along)
    if rows.margin.max() >= 1.0:
        line = int(samples.path.toolpath.line[samples.segment[int(rows.margin.argmax())]])
        raise NotSolvedError(
            f"one of the limits {', '.join(own)} changes faster at line {line} than a grid of the finest step follows"
        )
    fastest = np.abs(rows.d1).max(axis=0)
    unit = np.divide(1.0, fastest, out=np.ones(len(fastest)), where=fastest > 0.0)
    caps, names = problem.feed_sq_max.copy(), list(problem.bound_names)
    which = problem.feed_sq_bound.copy()
    for k, name in enumerate(own):
        tighter = rows.feed_sq_max[:, k] < caps
        caps[tighter], which[tighter] = rows.feed_sq_max[tighter, k], len(names)
        names.append(VELOCITY.called(name))
    least = [getattr(rows, q).min(axis=0) for q in ("acceleration", "jerk")]

    return replace(
        problem,
        axes=problem.axes + own,
        **{name: np.hstack([getattr(problem, name), unit * getattr(rows, name)]) for name in DERIVATIVES},
        velocity=np.append(problem.velocity, np.minimum(unit * rows.least[0], np.finfo(float).max)),
        acceleration=np.append(problem.acceleration, unit * least[0]),
        jerk=np.append(problem.jerk, unit * least[1]),
        feed_sq_max=caps,
        feed_sq_bound=which,
        bound_names=tuple(names),
        margin=np.maximum(problem.margin, rows.margin),
        own=len(own),
        own_here=np.stack([rows.acceleration / least[0], rows.jerk / least[1]]),
        own_least=rows.least,
    )


def user_inside(samples: PathSamples, limits: Limits) -> FloatArray:
    """(P,) what the limits `along` allow of feed^2 inside the interval to the right of each point; inf where
    nothing limits, and where a piece ends [mm2/s2]."""
    at = samples.intervals
    own = user_rows(samples, limits).feed_sq_max.min(axis=1)
    inside = np.full(len(samples), np.inf)
    inside[at] = np.maximum(own[at], own[at + 1])
    return inside
