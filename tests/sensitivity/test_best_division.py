"""Parts of a motion that bends: no motion is faster, some are as fast; and the best division of a run, by trying all."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.sensitivity.bends import SIZES, Chains, Events, bend_time, best_division

NONE = Events(*(np.zeros(0, dtype=np.int64) for _ in range(4)), np.zeros(0))


@pytest.mark.parametrize("seed", range(20))
def test_no_motion_is_faster_through_a_bend(seed: int) -> None:
    rng = np.random.default_rng([9, seed])
    axes = 2 + seed % 2
    push = rng.uniform(500.0, 3000.0, axes)
    t = np.linspace(0.0, 0.2, 401)
    acceleration = np.repeat(rng.uniform(-1.0, 1.0, (8, axes)), 50, axis=0) * push
    velocity = (
        rng.normal(size=axes) * 50.0 + np.vstack([np.zeros(axes), np.cumsum(acceleration, axis=0)]) * t[1]
    )
    place = np.vstack([np.zeros(axes), np.cumsum((velocity[1:] + velocity[:-1]) / 2.0 * t[1], axis=0)])
    at = np.sort(rng.choice(len(t), 12, replace=False))
    within = rng.uniform(0.0, 0.05, 12)
    off = rng.normal(size=(12, axes))
    point = place[at] + off / np.linalg.norm(off, axis=1)[:, None] * within[:, None]
    found = 0.0
    for i, k in itertools.combinations(range(12), 2):
        least = bend_time(point, within, push, i, k)
        assert least <= (t[at[k]] - t[at[i]]) * (1.0 + 1e-9)
        found = max(found, least)
    assert found > 0.0


def test_a_parabola_takes_just_that() -> None:
    push, time, eps = 2000.0, 0.06, 0.01
    t = np.array([-time / 2.0, 0.0, time / 2.0])
    motion = np.stack([80.0 * t, -push * t**2 / 2.0], axis=1)
    point = motion + np.array([[0.0, -eps], [0.0, eps], [0.0, -eps]])  # the motion uses the tolerance
    assert bend_time(point, np.full(3, eps), np.array([1e9, push]), 0, 2) == pytest.approx(time, rel=1e-12)
    assert (
        bend_time(motion, np.full(3, push), np.array([1e9, push]), 0, 2) == 0.0
    )  # nothing is known in so much room


def by_trying(
    leg: FloatArray, y: FloatArray, within: FloatArray, chains: Chains, parts: dict[tuple[int, int], float]
) -> float:
    """The best sum of legs, chains and parts: legs between parts lose what the tolerance lets their ends be off."""
    count = len(leg)
    length = np.linalg.norm(y, axis=1)
    jump = within[1:-1] * np.linalg.norm(np.diff(y, axis=0), axis=1)

    def legs(a: int, b: int) -> float:
        time = leg[a:b].sum() - jump[a : b - 1].sum() - within[a] * length[a]
        plain = time - within[b] * length[b - 1]
        most = plain
        for used in itertools.product((False, True), repeat=len(chains.begin)):
            some = [n for n, one in enumerate(used) if one]
            inside = all(
                (chains.begin[n] > a or a == 0) and chains.begin[n] >= a and chains.end[n] <= b for n in some
            )
            if not inside:
                continue
            gain = chains.gain[some].sum()
            ends = any(chains.end[n] == b for n in some) and b < count  # with the y of the leg behind it
            most = max(most, (time - jump[b - 1] - within[b] * length[b] if ends else plain) + gain)
        return float(most)

    best = np.full(count + 1, -np.inf)  # up to each waypoint, where a part or legs end
    best[0] = 0.0
    for k in range(1, count + 1):
        of_parts = [best[i] + time for (i, end), time in parts.items() if end == k]
        best[k] = max([*of_parts, *(best[a] + legs(a, k) for a in range(k))])
    return float(best[-1])


@pytest.mark.parametrize("seed", range(40))
def test_the_best_division_is_that_of_all(seed: int) -> None:
    rng = np.random.default_rng([10, seed])
    count = int(rng.integers(4, 9))
    point = np.vstack([np.zeros(2), np.cumsum(rng.normal(size=(count, 2)), axis=0)])
    within = np.concatenate([[0.0], rng.uniform(0.0, 0.2, count - 1), [0.0]])
    push, speed = np.full(2, 10 ** rng.uniform(-2.0, 1.0)), rng.uniform(1.0, 2.0, count)
    step = np.diff(point, axis=0)
    y = step / np.linalg.norm(step, axis=1)[:, None] / speed[:, None]
    leg = (y * step).sum(axis=1)
    chains = Chains(np.array([1]), np.array([3]), np.array([rng.uniform(0.0, 1.0)]))
    jump = np.concatenate([[0.0], within[1:-1] * np.linalg.norm(np.diff(y, axis=0), axis=1), [0.0]])
    total = np.append(0.0, np.cumsum(leg)) - np.cumsum(jump)
    size = np.linalg.norm(y, axis=1)
    none = np.full((4, count + 1), -np.inf)
    known = np.vstack(
        [[total, total + jump - within * np.append(0.0, size), within * np.append(size, 0.0)], none]
    )
    found = best_division(point, within, push, known, chains, NONE)
    bends = {
        (k - n, k): bend_time(point, within, push, k - n, k)
        for k in range(count + 1)
        for n in SIZES.tolist()
        if n <= k
    }
    parts = {ends: time for ends, time in bends.items() if time > 0.0}
    assert found == pytest.approx(by_trying(leg, y, within, chains, parts), rel=1e-12)


def test_dense_paths_are_bounded_by_what_bends_them() -> None:
    plan = planner.plan(problems.star_spiral(), problems.machine())
    assert plan.least_time < plan.cycle_time < 1.07 * plan.least_time  # 1.16 by their feed alone
