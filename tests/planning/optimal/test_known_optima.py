"""`optimal` beside optima that are known exactly (benchmarks/jobs/known.py): a few jobs of every sort, and the oracle itself."""

import numpy as np
import pytest

pytest.importorskip("clarabel")
pytest.importorskip("ruckig")

from benchmarks.jobs.known import SORTS, job, to_a_point, turning_back, turns
from benchmarks.judge.known_optima import above
from benchmarks.solvers.one_axis import AGREE, fastest

# What is asked of each, and what its optimum is known to, by the tolerance and the oracle [-].
WITHIN, KNOWN = 1e-4, 2e-5
SEEDS = (1, 2, 3)


@pytest.mark.shows("optimal", "exact: cycle times of jobs whose optimum is known, to 1e-4")
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("sort", [sort for sort, _ in SORTS], ids=lambda sort: sort.__name__)
def test_optimal_takes_the_time_that_is_known(sort, seed):
    assert -KNOWN < above(job(sort, seed)) < WITHIN


@pytest.mark.shows("reversals", "exact: jobs that turn back whose optimum is known")
@pytest.mark.parametrize("seed", [144, 539, 591])
def test_windows_that_ran_round_and_round_end(seed):
    """Steps that are shortened again and again for what they bend."""
    assert -KNOWN < above(job(turning_back, seed)) < WITHIN


def test_a_circle_whose_chords_take_the_whole_tolerance_takes_about_the_time_that_is_known():
    """Chords from the outer edge to the outer edge that touch the inner one; the search leaves 1.5 % of the tolerance."""
    assert -KNOWN < above(job(turns, 210)) < 1e-2


def test_one_part_from_rest_to_rest_takes_four_phases_of_jerk():
    length, jerk = 1.0, 50_000.0
    least = fastest(np.array([length]), np.array([1e3]), 1e5, jerk)
    assert least.time == pytest.approx(4.0 * (length / 2.0 / jerk) ** (1 / 3), rel=AGREE)


def test_one_part_with_all_limits_takes_the_closed_form():
    v, a, j = 50.0, 1000.0, 30_000.0
    least = fastest(np.array([20.0]), np.array([v]), a, j)
    assert least.time == pytest.approx(20.0 / v + v / a + a / j, rel=AGREE)


def test_a_line_cut_in_two_takes_as_long():
    whole = fastest(np.array([7.0]), np.array([40.0]), 2000.0, 60_000.0)
    parts = fastest(np.array([2.0, 5.0]), np.array([40.0, 40.0]), 2000.0, 60_000.0)
    assert parts.time == pytest.approx(whole.time, rel=AGREE)


def test_the_way_back_takes_as_long():
    length, cap = np.array([3.0, 0.5, 6.0]), np.array([60.0, 8.0, 25.0])
    there, back = (fastest(length[::k], cap[::k], 3000.0, 90_000.0) for k in (1, -1))
    assert back.time == pytest.approx(there.time, rel=AGREE)


def test_jobs_of_one_number_are_the_same():
    assert job(to_a_point, 5).least == job(to_a_point, 5).least != job(to_a_point, 6).least
