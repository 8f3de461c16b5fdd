"""The digits of a column are found where it has few, and not where it has all of them."""

import numpy as np
import pytest

from planner.report.trajectory_room import on_grid, rounding

RNG = np.random.default_rng(5)
EXACT = np.cumsum(RNG.uniform(-0.1, 0.1, 500))


@pytest.mark.parametrize("decimals", [2, 3, 6, 8])
@pytest.mark.parametrize("size", [0.3, 7.0, 900.0])
def test_printed_decimals_are_found(decimals, size):
    exact = size * EXACT / np.abs(EXACT).max()
    printed = np.array([float(f"{value:.{decimals}f}") for value in exact])
    assert rounding(printed) == pytest.approx(0.5 * 10.0**-decimals)
    assert np.abs(printed - exact).max() <= rounding(printed)


@pytest.mark.parametrize("digits", [4, 7, 9])
def test_printed_digits_are_found(digits):
    printed = np.array([float(f"{value:.{digits}g}") for value in EXACT])
    assert np.abs(printed - EXACT).max() <= rounding(printed) <= 0.5 * 10.0 ** (2 - digits)


def test_float32_is_found_and_float64_is_exact():
    single = EXACT.astype(np.float32)
    assert np.abs(single - EXACT).max() <= rounding(single) <= 2e-7 * np.abs(EXACT).max()
    assert rounding(EXACT) == 0.0
    assert rounding(np.zeros(100)) == 0.0
    assert rounding(np.repeat([0.0, 10.0, 20.0], 50)) == 0.0  # a few round numbers are no proof


@pytest.mark.parametrize("offset", [0.0, -0.003, 250.0])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_times_on_a_grid_are_taken_as_that(offset, kind):
    exact = np.append(np.arange(4000) * 0.001, 3.99937161)
    times, error, everywhere, last = on_grid((exact + offset).astype(kind))
    assert (times[:-1] == np.arange(4000) * 0.001).all() or kind is np.float64
    assert np.abs(times[:-1] - exact[:-1]).max() < 1e-12
    assert everywhere == 0.0
    assert np.abs(times[-1] - exact[-1]) <= max(last, 1e-15)
    assert last <= error + 1e-12


def test_printed_times_of_a_third_of_a_millisecond_are_on_their_grid():
    exact = np.arange(300) / 3000.0
    printed = np.array([float(f"{value:.7f}") for value in exact])
    times, error, everywhere, last = on_grid(printed)
    assert error == pytest.approx(5e-8)
    assert everywhere == last == 0.0
    assert np.abs(times - exact).max() <= 300 * 1e-9


def test_times_on_no_grid_keep_their_rounding():
    exact = np.cumsum(RNG.uniform(0.001, 0.002, 100))
    times, error, everywhere, last = on_grid((exact - exact[0]).astype(np.float32))
    assert everywhere == last == error > 0.0
    assert np.abs(times - (exact - exact[0])).max() <= error
