"""The shortest rest at a stop: with it the mean of the motion comes near enough, with a shorter one it does not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.judge.setpoints import trajectory_of
from planner.base.arrays import FloatArray
from planner.delivery.rests import HALVINGS, STEPS, Mean, mean_of_copies, mean_of_filters
from planner.machine import Mode
from planner.motion.filters import Filters
from planner.motion.shaping import Shaper, shaper_of
from planner.verifier.filtered import filtered

ARRIVAL, FAR = 0.3, 0.5  # when the corner is reached [s], and how far away the motion starts and ends [mm]
FINE = 20_000
SHAPERS = [
    shaper_of((Mode(frequency=12.0, damping=0.05),)),
    shaper_of((Mode(frequency=12.0, damping=0.0), Mode(frequency=31.0, damping=0.1))),
]
FILTERS = [Filters((0.04,)), Filters((0.03, 0.02)), Filters((0.02, 0.02, 0.011))]


def _way(t: FloatArray) -> FloatArray:
    """(n,) how far a motion has come that leaves rest at 0 [mm]."""
    return FAR * (t.clip(0.0) / ARRIVAL) ** 3


def _corner(t: FloatArray, rest: float) -> FloatArray:
    """(n, 2) along x into a corner, a rest there, and out of it along y, faster."""
    return np.column_stack([-_way(ARRIVAL - t), _way(1.3 * (t - ARRIVAL - rest))])


def _copies(shaper: Shaper, rest: float) -> FloatArray:
    t = np.linspace(ARRIVAL, ARRIVAL + shaper.length, FINE)
    return sum(
        (w * _corner(t - d, rest) for d, w in zip(shaper.delay, shaper.weight, strict=True)),
        np.zeros((FINE, 2)),
    )


def _averaged(filters: Filters, rest: float) -> FloatArray:
    times = np.append(np.arange(0.0, 2 * ARRIVAL + rest, 1e-4), 2 * ARRIVAL + rest)
    place = _corner(times, rest)
    setpoints = trajectory_of(times, place, np.zeros_like(place))
    return np.concatenate([x for _, x in filtered(setpoints, "linear", filters.times, 4e-4)])


def _rest(mean: Mean, budget: float) -> float:
    before, after = _corner(ARRIVAL - mean.inside, 0.0), _corner(ARRIVAL + mean.inside, 0.0)
    return float(mean.shortest_rests(before[None], after[None], np.array([budget]))[0])


@pytest.mark.parametrize("budget", [1e-6, 4e-6, 1e-5])
@pytest.mark.parametrize("of", [*SHAPERS, *FILTERS], ids=["1 mode", "2 modes", "1 fir", "2 fir", "3 fir"])
def test_the_rest_is_the_shortest_with_which_the_mean_comes_near_enough(
    of: Shaper | Filters, budget: float
) -> None:
    mean = mean_of_copies(of) if isinstance(of, Shaper) else mean_of_filters(of)

    def miss(rest: float) -> float:
        made = _copies(of, rest) if isinstance(of, Shaper) else _averaged(of, rest)
        return float(np.linalg.norm(made, axis=1).min())

    rest = _rest(mean, budget)
    assert 0.0 < rest <= mean.length
    assert miss(rest) <= budget
    # between steps the mean may be nearer to the corner than at them: a little less may do
    assert miss(rest - 0.25 * mean.length / STEPS) > budget


@pytest.mark.parametrize("of", [*SHAPERS, *FILTERS])
def test_no_rest_where_none_is_needed_and_all_of_it_where_nothing_less_does(of: Shaper | Filters) -> None:
    mean = mean_of_copies(of) if isinstance(of, Shaper) else mean_of_filters(of)
    assert _rest(mean, FAR) == 0.0
    assert mean.length * (1.0 - 2.0**-HALVINGS) <= _rest(mean, 0.0) <= mean.length


@pytest.mark.parametrize("of", [*SHAPERS, *FILTERS])
def test_a_mean_of_a_motion_that_stands_is_where_it_stands(of: Shaper | Filters) -> None:
    mean = mean_of_copies(of) if isinstance(of, Shaper) else mean_of_filters(of)
    both = mean.into.sum(axis=1) + mean.out.sum(axis=1)
    np.testing.assert_allclose(both[1:-1], 1.0)
    assert not mean.out[0].any()
    assert not mean.into[-1].any()
