"""From steps to a motion: integrated exactly, ending exactly, and slowed down by what is left of rounding.

A solver's rows have residuals of some 1e-8. The steps' jerks are integrated from the first node, and the
smallest change of the jerks that makes the last node meet its end is added (least squares, per axis). Slowing
down by lam divides speeds by lam, accelerations by lam^2 and jerks by lam^3 and leaves the path as it is.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.joint.guess import Guess
from planner.joint.own_laws import Where, motion_at
from planner.joint.run import TubeRun

# Steps between two nodes that a motion is made to meet: gaps of the kinematics add up over them, with their
# square from acceleration to position. (Over the 1,500 of a window gaps of 1e-10 mean steps became 1e-4.)
CLOSED_EVERY = 50
# Of what a jerk moves a motion by at the end, what is left beside what others do that counts as rounding [-].
DEPENDENT = 1e-14
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


@njit(cache=True, error_model="numpy")
def integrated(begin, h, jerk):
    """(N+1, 3, A) position, velocity and acceleration at the nodes, from those at the first one, begin (3, A)
    [mm, s].

    h    : (N,) durations [s]
    jerk : (N, A) constant on each step [mm/s3]
    """
    N, axes = jerk.shape
    found = np.empty((N + 1, 3, axes))
    for k in range(axes):
        p, v, a = 0.0, 0.0, 0.0  # sums, rounded by themselves
        for i in range(N + 1):
            found[i, 0, k], found[i, 1, k], found[i, 2, k] = begin[0, k] + p, begin[1, k] + v, begin[2, k] + a
            if i < N:
                p += h[i] * (found[i, 1, k] + h[i] * (found[i, 2, k] / 2.0 + h[i] * jerk[i, k] / 6.0))
                v += h[i] * (found[i, 2, k] + h[i] * jerk[i, k] / 2.0)
                a += h[i] * jerk[i, k]
    return found


@njit(cache=True, error_model="numpy")
def closed(begin, end, h, jerk):
    """(N, A) jerks that lead from `begin` (3, A) to `end` (3, A), position, velocity and acceleration: those
    given, changed least. Fewer than three steps meet the first of these.

    h    : (N,) durations [s]
    jerk : (N, A) [mm/s3]
    """
    N, axes, lasts, done = len(h), jerk.shape[1], h.sum(), 0.0
    # of p, v, a at the end by every jerk, in units of the whole time; then orthogonal to one another, `of` (3, 3) them
    to_end, of = np.empty((3, N)), np.zeros((3, 3))
    for i in range(N):
        done += h[i]
        own, rest = h[i] / lasts, (lasts - done) / lasts
        to_end[0, i] = own * (own * own / 6.0 + rest * (own / 2.0 + rest / 2.0))
        to_end[1, i], to_end[2, i] = own * (own / 2.0 + rest), own
    for m in range(3):
        whole = np.sqrt((to_end[m] * to_end[m]).sum())
        for _ in range(2):  # once leaves rounding of what is taken off
            for n in range(m):
                along = (to_end[n] * to_end[m]).sum()
                of[m, n] += along
                to_end[m] -= along * to_end[n]
        left = np.sqrt((to_end[m] * to_end[m]).sum())
        if left > DEPENDENT * whole:
            of[m, m] = left
            to_end[m] /= left
        else:
            to_end[m] = 0.0
    found, last = jerk.copy(), integrated(begin, h, jerk)[N]
    for k in range(axes):
        y = np.zeros(3)
        for m in range(3):
            missed = (last[m, k] - end[m, k]) / lasts ** (3 - m)
            for n in range(m):
                missed -= of[m, n] * y[n]
            y[m] = missed / of[m, m] if of[m, m] > 0.0 else 0.0
        for i in range(N):
            found[i, k] -= to_end[0, i] * y[0] + to_end[1, i] * y[1] + to_end[2, i] * y[2]
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def closed_at_nodes(state, h, jerk):
    """The motion that meets every `CLOSED_EVERY`th of the nodes, state (N+1, 3, A), and the last one: its
    nodes, and the jerks (N, A), those given changed least between two of them.

    h    : (N,) durations [s]
    jerk : (N, A) [mm/s3]
    """
    N, parts, lo = len(h), max(len(h) // CLOSED_EVERY, 1), 0
    nodes, jerks = state.copy(), np.empty_like(jerk)
    for part in range(1, parts + 1):
        hi = N if part == parts else int(part * (N / parts))
        jerks[lo:hi] = closed(state[lo], state[hi], h[lo:hi], jerk[lo:hi])
        nodes[lo:hi] = integrated(state[lo], h[lo:hi], jerks[lo:hi])[: hi - lo]
        lo = hi
    return nodes, jerks


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
