"""Prices of the search: closed forms of one line, Euler's identity, and searches again with other limits."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.geometry.build import toolpath_from_program
from planner.joint import price
from planner.joint.guess import Guess, guesses_from
from planner.joint.own import TubeOwn
from planner.joint.run import TubeRun
from planner.joint.runs import tube_runs_of
from planner.joint.shares import shares
from planner.motion.vertex_times import passing_times
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import OptimalMethod

MACHINE = problems.machine()
PROGRAMS = {
    "line": problems.polyline([[0, 0], [4, 0]], feed=1e4),
    "long line": problems.polyline([[0, 0], [20, 0]], feed=1e4),
    "corner": problems.polyline([[0, 0], [4, 0], [4, 4]]),
    "arcs": parse_program("G21 G17 G90 F4800\nG1 X4\nG3 X8 Y4 I0 J4\nG2 X12 Y8 Z1 I4 J0\nM2\n"),
}
VELOCITY, ACCELERATION, JERK = 100.0, 2000.0, 2e5  # of problems.machine [mm, s]


class Searched(NamedTuple):
    run: TubeRun
    guess: Guess
    time: float
    step: np.ndarray

    def of(self, column: int) -> float:
        return float(self.step[:, 3 * len(self.run.axis) + column].sum())

    def of_axes(self) -> np.ndarray:
        """(3, A) of jerk, acceleration and velocity."""
        axes = len(self.run.axis)
        return self.step[:, : 3 * axes].sum(axis=0).reshape(3, axes)


def found(run: TubeRun, guess: Guess) -> Searched:
    solution = TubeOwn(gap=1e-6).solve(run, guess)
    steps = solution.steps
    state = np.stack([steps.position, steps.velocity, steps.acceleration], axis=1)
    best = dataclasses.replace(guess, h=steps.h, state=np.concatenate([state, guess.state[-1:]]))
    return Searched(run, best, float(steps.h.sum()), solution.price)


@cache
def searched(name: str) -> Searched:
    toolpath = toolpath_from_program(PROGRAMS[name], MACHINE)
    (run,) = tube_runs_of(toolpath, MACHINE)
    seen = OptimalMethod(corner="bezier").plan(PROGRAMS[name], MACHINE).trajectory
    times = np.maximum.accumulate(passing_times(seen, toolpath))
    times[-1] = seen.t[-1]
    first = found(run, guesses_from([run], seen, [times[run.first]])[0].slower(1.02))
    return found(run, first.guess.slower(1.03))  # from where the searches with other limits begin, too


@pytest.mark.shows("prices", "exact: closed forms of one line in the search")
@pytest.mark.parametrize("name", ["line", "long line"])
def test_lines_have_the_prices_of_their_closed_forms(name):
    """From rest to rest: T = a/j + sqrt((a/j)^2 + 4 L/a) where velocity does not limit, T = L/v + v/a + a/j where it does."""
    v, a, j = VELOCITY, ACCELERATION, JERK
    root = np.sqrt((a / j) ** 2 + 4 * 4.0 / a)
    time, by_jerk, by_acceleration, by_velocity = {
        "line": (
            a / j + root,
            -(a / j) - (a / j) ** 2 / root,
            a / j + ((a / j) ** 2 - 2 * 4.0 / a) / root,
            0.0,
        ),
        "long line": (20.0 / v + v / a + a / j, -a / j, a / j - v / a, v / a - 20.0 / v),
    }[name]
    one = searched(name)
    assert one.time == pytest.approx(time, rel=2e-4)
    told = one.of_axes()[:, 0]
    np.testing.assert_allclose(told, [by_jerk, by_acceleration, by_velocity], rtol=5e-3, atol=1e-4 * time)
    assert abs(one.of(price.ROOM)) < 1e-5 * time


@pytest.mark.parametrize("name", PROGRAMS)
def test_all_limits_together_fix_the_time(name):
    """Euler's identity (joint/price.py), and nothing but limits costs."""
    one = searched(name)
    jerk, acceleration, velocity = one.of_axes().sum(axis=1)
    together = velocity + one.of(price.FEED) + 2 * (acceleration + one.of(price.NORMAL)) + 3 * jerk
    assert together == pytest.approx(-one.time, rel=2e-3)
    assert (one.step <= 0.0).all()
    assert abs(one.of(price.OTHER)) < 1e-3 * one.time


CHANGES = {
    "jerk of x": ({"jerk": [0]}, lambda one: one.of_axes()[0, 0]),
    "jerk of y": ({"jerk": [1]}, lambda one: one.of_axes()[0, 1]),
    "acceleration": ({"acceleration": slice(None)}, lambda one: one.of_axes()[1].sum()),
    "feed": ({"feed": slice(None)}, lambda one: one.of(price.FEED)),
    "tolerance": (
        {"budget": slice(None), "vertex_budget": slice(None)},
        lambda one: one.of(price.ROOM) + one.of(price.VERTEX),
    ),
}


@pytest.mark.parametrize("name", ["corner", "arcs"])
@pytest.mark.parametrize("what", CHANGES)
@pytest.mark.usual_sizes
def test_a_search_with_another_limit_confirms_the_price(name, what):
    """By 2 % more and 2 % less, whose difference is the slope, from the same start; they end to within 4e-6 of the time."""
    columns, price_of = CHANGES[what]
    one, times = searched(name), []
    for ratio in (1.02, 0.98):
        changed = {}
        for column, which in columns.items():
            changed[column] = getattr(one.run, column).copy()
            changed[column][which] *= ratio
        times.append(found(dataclasses.replace(one.run, **changed), one.guess.slower(1.03)).time)
    slope = (times[0] - times[1]) / np.log(1.02 / 0.98)
    assert slope == pytest.approx(price_of(one), rel=0.03, abs=4e-6 / 0.02 * one.time)


def test_steps_that_pay_for_a_limit_are_at_it():
    """What costs more than a tenth of a step's time is used to within 1 % by the step or one beside it (shares are of its middle)."""
    one = searched("corner")
    guess, axes = one.guess, len(one.run.axis)
    steps = TubeOwn().solve(one.run, guess.slower(1.03)).steps
    used = shares(one.run, steps, guess.leg, np.append(guess.place[:, 0], one.run.offset[-1]))
    assert used.max() <= 1.0 + 1e-9
    paid = -one.step / guess.h[:, None]
    near = np.maximum(used, np.maximum(np.roll(used, 1, axis=0), np.roll(used, -1, axis=0)))
    columns = [*range(3 * axes), 3 * axes + price.FEED]
    at = near[:, [*range(3 * axes), 3 * axes]]
    assert (at[paid[:, columns] > 0.1] > 0.99).all()
    assert (paid > 0.1).any(axis=1).mean() > 0.6
