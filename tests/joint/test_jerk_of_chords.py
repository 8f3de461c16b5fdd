"""What jerk adds to chords that pass a place off their middle: a bound, that it is attained, and what comes of it."""

import numpy as np
import pytest
from starts import begun

import planner
from benchmarks.campaign import laws
from benchmarks.jobs import random_lines
from planner.base.arrays import read_only
from planner.joint.checks import chord_means
from planner.joint.motion import integrated
from planner.joint.problem import SEEN
from planner.joint.run import TubeRun
from planner.planning.job.trace import Trace
from planner.planning.methods.optimal import OptimalMethod

H = 0.002  # a period [s]
CELLS = 400


def off(jerk, share):
    """How far the chord of a motion of so much jerk (`CELLS`,) in a period is from p + 4 u (1 - u) (h^2/8) a at the share u."""
    t = np.linspace(0.0, H, CELLS + 1)
    h = np.diff(t)
    state = np.zeros((CELLS + 1, 3))
    for k, j in enumerate(jerk):
        p, v, a = state[k]
        state[k + 1] = (
            p + h[k] * (v + h[k] * (a / 2 + h[k] * j / 6)),
            v + h[k] * (a + h[k] * j / 2),
            a + h[k] * j,
        )
    at = round(share * CELLS)
    u = at / CELLS
    chord = (1 - u) * state[0, 0] + u * state[-1, 0]
    return abs(chord - state[at, 0] - u * (1 - u) * H**2 / 2 * state[at, 2])


@pytest.mark.parametrize("seed", range(20))
def test_jerk_moves_a_chord_by_no_more_than_its_bound(seed):
    rng = np.random.default_rng(seed)
    most = 5e4
    jerk = most * rng.choice([-1.0, 1.0], 4).repeat(CELLS // 4) * rng.uniform(0.5, 1.0)
    bound = most * H**3 / 48
    assert all(off(jerk, share) <= bound * (1 + 1e-9) for share in (0.1, 0.25, 0.5, 0.7, 0.95))


def test_jerk_that_turns_over_at_the_middle_attains_it():
    most = 5e4
    jerk = np.where(np.arange(CELLS) < CELLS // 2, -most, most)
    assert off(jerk, 0.5) == pytest.approx(most * H**3 / 48, rel=1e-6)


def test_at_four_milliseconds_what_is_found_passes_as_it_is(monkeypatch):
    """And is not run slower in places, which takes time."""
    program, machine = random_lines.job(88)
    assert machine.dt == 0.004
    times = []
    for known in (True, False):
        if not known:
            monkeypatch.setattr(TubeRun, "off_by_jerk", 0.0)
        trace = Trace()
        plan = OptimalMethod().plan(program, machine, log=trace)
        assert plan.verdict.passed
        slower = any(step.name == "slower in places" for step in trace.steps)
        assert slower == (not known)
        times.append(plan.cycle_time)
    assert times[0] < times[1]


def test_what_rows_are_told_of_chords_comes_to_rest():
    """Of any wave, its rows and its chords tell in one direction, rows the more: what is left of an error shrinks."""
    x = np.linspace(1e-3, 1.5 * np.pi - 1e-3, 2000)
    left = [1.0 - np.cos(x) / (1.0 - seen * x**2 / 2) for seen in (SEEN, 1.0)]
    assert np.abs(left[0]).max() < 1.0
    assert np.abs(left[1]).max() > 1.0


@pytest.mark.parametrize("seed", [7, 8, 9])
def test_means_of_chords_are_those_of_the_motion(seed):
    """With chords longer than steps; beside a vertex no chord is farther than it says, nor is what eq. (18) asks for there."""
    run, _ = begun("corner")
    rng, steps = np.random.default_rng(seed), 24
    h, jerk = rng.uniform(1e-3, 4e-3, steps), run.jerk * rng.uniform(-1.0, 1.0, (steps, 2))
    state = integrated(np.array([[39.9, 0.0], [50.0, 5.0], [0.0, 0.0]]), h, jerk)
    leg = np.repeat([0, 1], steps // 2)
    half = 4e-3
    keeps = run.keeps._replace(chord=half)
    means, wider = chord_means(keeps, read_only(leg), h, state, jerk)
    node = np.append(0.0, np.cumsum(h))

    def at(t):
        n = min(int(np.searchsorted(node, t, side="right")) - 1, steps - 1)
        p, v, a = state[n]
        t -= node[n]
        return p + t * (v + t * (a / 2 + t * jerk[n] / 6))

    vertex = int(np.flatnonzero(np.diff(leg))[0]) + 1
    inside = [i for i in range(steps) if half * 2 < node[i] < node[-1] - half * 2]
    assert vertex in inside
    for i in inside:
        both = [(at(node[i] - half) + at(node[i] + half)) / 2]
        if i == vertex:
            both.append(state[i, 0] + half**2 / 2 * state[i, 2])
            both.sort(key=lambda one: np.linalg.norm(one - run.vertex[1]))
        np.testing.assert_allclose(means[i], both[-1], rtol=1e-12)
    far = [
        np.linalg.norm(
            (1 - u) * at(node[vertex] - 2 * u * half)
            + u * at(node[vertex] + 2 * (1 - u) * half)
            - run.vertex[1]
        )
        for u in np.linspace(0.1, 0.9, 9)
    ]
    most = max(far[4], np.linalg.norm(state[vertex, 0] + half**2 / 2 * state[vertex, 2] - run.vertex[1]))
    assert max(max(far) - most, 0.0) == pytest.approx(wider[vertex], abs=1e-9)
    assert not wider[np.arange(steps + 1) != vertex].any()


def test_at_long_periods_the_search_passes_and_is_not_given_up():
    """Blocks far shorter than a period, whose chords are longer than steps."""
    program, machine = random_lines.job(119)
    assert machine.dt == 0.016
    plan = planner.plan(program, machine).require()
    assert plan.verdict.passed
    assert "optimised together" in plan.sentence


def test_more_jerk_costs_no_time_at_long_periods():
    """What is found keeps eq. (18) at vertices too, and is not run slower in places."""
    program, machine = random_lines.job(213)
    assert machine.dt == 0.016
    more = laws.looser(program, machine, None, "jerk", 1.1)
    before, after = (planner.plan(program, of).require().cycle_time for of in (machine, more.machine))
    assert after < (1.0 + laws.ALLOWED) * before
