"""The numbers of the free optimum's steps (nlp.py): their legs and limits, and how fast they are about."""

from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.joint.guess import Guess
from planner.joint.run import TubeRun
from planner.joint.step_limits import narrowed, pace


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
    room, feed = narrowed(run.room[leg], run.off_by_jerk), run.feed[leg]
    room_end, feed_end = room.copy(), feed.copy()
    beside = np.minimum(run.room[:-1], run.room[1:])
    room_end[last] = narrowed(np.minimum(run.vertex_budget[1:-1], beside), run.off_by_jerk)
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
