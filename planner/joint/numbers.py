"""The numbers of the free optimum's steps (nlp.py): their legs and limits, and how fast they are about."""

from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.joint.guess import Guess
from planner.joint.run import TubeRun

# The tolerance is narrowed by this fraction [-], so that rounding stays inside it.
ROUNDING = 1e-4
# Chords that pass a place at another share u than the middle are off p + 4 u (1 - u) (dt^2/8) a by |jerk| dt^3/48 at most (Peano's
# kernel of that, at the middle). The tolerance is narrowed by that too, but by no more than this fraction [-]: what is left
# of it at long periods is found when the motion is looked at.
CHORDS = 1e-2
# Weights of what the motion does for no time, against the time [-]: of the squares of all jerks, as shares of
# their limits, on steps that run at the programmed feed and on all others; and of half the square of how far
# nodes are from their leg, as a share of the tolerance. So jerk is small, and positions are near the path,
# where time does not depend on them. Where all of the tolerance saves the share g of the time, the last leaves
# g - g^2/CENTRE of that unused, CENTRE/4 at most; the others cost less than 1e-4, on the mean.
SMOOTH_AT_FEED, SMOOTH, CENTRE = 1e-2, 3e-4, 3e-4
# A step whose ends are as fast as this share of the feed runs at it [-].
AT_FEED = 0.995


def jerk_weights(run: TubeRun, leg: Array, velocity: FloatArray, least: float) -> FloatArray:
    """(N,) weights of the jerks of steps [-]. Where the feed holds the motion less jerk costs no time, on
    ramps it does.

    leg      : (N,) of the steps
    velocity : (N+1, A) of the nodes [mm/s]
    least    : weight of any step at least [-]
    """
    speed = np.linalg.norm(velocity, axis=1)
    held = np.minimum(speed[:-1], speed[1:]) >= AT_FEED * run.feed[leg]
    return np.maximum(np.where(held, SMOOTH_AT_FEED, SMOOTH), least)


def narrowed(run: TubeRun, room: FloatArray) -> FloatArray:
    """Distances `room` (n,) [mm], narrowed by `ROUNDING` and for chords."""
    jerk = (
        np.linalg.norm(run.jerk) if np.isfinite(run.jerk).all() else 0.0
    )  # without limits nothing is known of it
    by_jerk = float(jerk) * run.chord**3 / 6.0
    return room * (1.0 - ROUNDING) - np.minimum(by_jerk, CHORDS * room)


def step_numbers(
    run: TubeRun, guess: Guess, mean_step: FloatArray, length: float, speed: float, acc: float
) -> FloatArray:
    """(N, 5 A + 12) what each of N steps needs to know: its leg, how far it may be from it inside and at its
    end, its limits; the vertex at the leg's end, and what the feed does where the step ends there
    (`TubeRun.switch`, over tolerance and pace).

    mean_step          : (N,) mean length of a step on each step's leg [mm]
    length, speed, acc : units that the numbers are in [mm], [mm/s], [mm/s2]
    """
    leg, last = guess.leg, np.flatnonzero(np.diff(guess.leg))  # last: steps that end at a vertex
    room, feed = narrowed(run, run.room[leg]), run.feed[leg]
    room_end, feed_end = room.copy(), feed.copy()
    beside = np.minimum(run.room[:-1], run.room[1:])
    room_end[last] = narrowed(run, np.minimum(run.vertex_budget[1:-1], beside))
    feed_end[last] = np.minimum(feed[last], feed[last + 1])
    fastest = np.linalg.norm(run.velocity)  # instead of inf, where nothing else limits
    strongest = 2.0 * np.linalg.norm(run.acceleration)
    own_pace, switch = pace(guess.state[:, 1]), np.zeros(len(leg))
    switch[last] = run.switch[leg[last + 1]] * length * speed / (room_end[last] * own_pace[last + 1])
    return np.column_stack(
        [
            run.base[leg] / length,
            run.drift[leg],
            run.e1[leg],
            run.e2[leg],
            run.offset[leg] / length,
            run.radius[leg] / length,
            run.rate[leg] * length,
            room / length,
            room_end / length,
            np.minimum(run.step_max[leg], run.offset[-1]) / length,
            np.minimum(feed, fastest) / speed,
            np.minimum(feed_end, fastest) / speed,
            np.minimum(run.across_max[leg], strongest) / acc,
            mean_step / length,
            own_pace / speed,
            run.vertex[leg + 1] / length,
            switch,
        ]
    )


def pace(velocity: FloatArray) -> FloatArray:
    """(N,) speed of each step [mm/s], at most a thousand times below the fastest: near rest the rows of the
    normal acceleration have to be as small as the speed.

    velocity : (N+1, A) at the nodes [mm/s]
    """
    at_nodes = np.linalg.norm(velocity, axis=1)
    return np.maximum(np.maximum(at_nodes[:-1], at_nodes[1:]), 1e-3 * float(at_nodes.max()))


def acceleration_along(guess: Guess) -> FloatArray:
    """(N,) pace times u = v.a/|v|^2 in the middle of each step [mm/s2]."""
    own = pace(guess.state[:, 1])
    v, a = (guess.state[:-1, k] / 2 + guess.state[1:, k] / 2 for k in (1, 2))
    return own * (v * a).sum(axis=1) / np.maximum((v**2).sum(axis=1), (0.5 * own) ** 2)


def formula(ca: Any, w: Any, b: Any, counts: FloatArray, rest: Any) -> list[tuple[Any, Any]]:
    """Pairs (a.v, v.e) of all four ordinates of PUSH in symbols of casadi, given as `ca`.

    w, b   : ordinates of the velocity (3) and of the acceleration (2) of a step
    counts : (A,) 1 for the axes that count, else 0
    rest   : speed to which directions are smoothed
    """
    w, b = [counts * one for one in w], [counts * one for one in b]
    e0, e1 = (one / ca.sqrt(ca.sumsqr(one) + rest**2) for one in (w[0], w[2]))
    return [
        (ca.dot(b[0], w[0]), ca.dot(w[0], e0)),
        ((ca.dot(b[1], w[0]) + 2 * ca.dot(b[0], w[1])) / 3, (ca.dot(w[0], e1) + 2 * ca.dot(w[1], e0)) / 3),
        ((2 * ca.dot(b[1], w[1]) + ca.dot(b[0], w[2])) / 3, (2 * ca.dot(w[1], e1) + ca.dot(w[2], e0)) / 3),
        (ca.dot(b[1], w[2]), ca.dot(w[2], e1)),
    ]
