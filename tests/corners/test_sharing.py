"""Two corners on one leg: feasible, fair, symmetric, and nothing left that a corner could still use."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from whole_plans import smooth_path

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.corners.bezier import BezierCorner
from planner.corners.sharing import share_legs
from planner.corners.smooth import SmoothPath


def chain(seed: int, corners: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """wanted, ease, length of a random chain of corners with an unblended end on both sides."""
    rng = np.random.default_rng(seed)
    theta = np.deg2rad(rng.uniform(0.5, 174.0, corners + 2))
    length = np.exp(rng.uniform(np.log(0.01), np.log(2.0), corners + 1))
    wanted = 4 * 0.03 / np.sin(theta / 2)
    wanted[[0, -1]] = 0.0
    wanted[1:-1] = np.minimum(wanted[1:-1], np.minimum(length[:-1], length[1:]))
    return wanted, np.cos(theta / 2) ** 2 / np.sin(theta / 2), length


def left_over(wanted: FloatArray, d: FloatArray, length: FloatArray) -> FloatArray:
    """How much more each corner could take without anyone giving way, as a share of what it wants."""
    free = length - d[:-1] - d[1:]
    room = np.minimum(np.append(np.inf, free), np.append(free, np.inf))
    more = np.minimum(room, wanted - d)
    return np.divide(more, wanted, out=np.zeros_like(d), where=wanted > 0)


@given(seed=st.integers(0, 10**6), corners=st.integers(1, 12))
@settings(max_examples=150)
def test_feasible_and_symmetric(seed, corners):
    wanted, ease, length = chain(seed, corners)
    d = share_legs(wanted, ease, length)
    assert (d >= 0).all()
    assert (d <= wanted * (1 + 1e-12)).all()
    assert (d[:-1] + d[1:] <= length * (1 + 1e-12)).all()
    assert (d[1:-1] > 0).all()
    assert d[0] == d[-1] == 0
    np.testing.assert_allclose(share_legs(wanted[::-1], ease[::-1], length[::-1])[::-1], d, rtol=1e-12)


@given(seed=st.integers(0, 10**6))
def test_two_corners_on_a_short_leg_are_equally_fast(seed):
    wanted, ease, length = chain(seed, 2)
    length[1] = 0.9 * wanted[1:3].min()
    wanted = np.minimum(wanted, length[1])
    length[[0, 2]] = 10.0
    d = share_legs(wanted, ease, length)
    assert d[1] + d[2] == pytest.approx(length[1], rel=1e-12)
    assert d[1] * ease[1] == pytest.approx(d[2] * ease[2], rel=1e-9)


def test_what_one_corner_does_not_want_goes_to_the_other():
    wanted, ease, length = np.array([0.0, 0.3, 0.2, 0.0]), np.ones(4), np.array([9.0, 0.45, 9.0])
    np.testing.assert_allclose(share_legs(wanted, ease, length), [0.0, 0.25, 0.2, 0.0], rtol=1e-3)


def test_long_legs_leave_every_corner_what_it_wants():
    wanted, ease, _ = chain(3, 8)
    np.testing.assert_array_equal(share_legs(wanted, ease, np.full(9, 100.0)), wanted)


def test_without_legs_nothing_happens():
    assert share_legs(np.zeros(1), np.ones(1), np.zeros(0)).tolist() == [0.0]


def test_nothing_is_left_unused():
    worst = 0.0
    for seed in range(300):
        wanted, ease, length = chain(seed, 1 + seed % 10)
        worst = max(worst, left_over(wanted, share_legs(wanted, ease, length), length).max())
    assert worst <= 1e-3


def test_paper_002s_corner_1_keeps_its_reach_on_a_short_leg():
    path = smooth_path(problems.five_points(), problems.five_points_machine(), BezierCorner(sigma2=1.0))
    assert path.legs.length[0] == pytest.approx(0.5)
    assert path.d[1] == pytest.approx(0.292, abs=5e-4)  # L/2 would be 0.25


def test_what_two_corners_leave_of_a_leg_is_taken_too_where_it_is_next_to_nothing():
    """Corners that turn by 60 and by 90 degrees, on legs that are longer than what both want by one part in 50,000."""
    heading = np.cumsum(np.deg2rad([0.0, 60.0, -90.0, 60.0, -90.0]))
    along = np.stack([np.cos(heading), np.sin(heading)], axis=1)

    def path_of(length: FloatArray) -> SmoothPath:
        points = np.vstack([[0.0, 0.0], np.cumsum(length[:, None] * along, axis=0)])
        return smooth_path(problems.polyline(points), problems.machine(), BezierCorner())

    wanted = path_of(np.full(5, 100.0)).d
    length = (wanted[:-1] + wanted[1:]) * (1.0 + 2e-5)
    length[[0, -1]] = 100.0
    path = path_of(length)
    assert (path.scale > 1.0).any(axis=0).all(), "behind corners, and before them"
    free = path.legs.length - path.d_out[:-1] - path.d_in[1:]
    np.testing.assert_allclose(free[1:-1], 0.0, atol=1e-12)
