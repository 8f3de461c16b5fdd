"""The moves that replace a polyline, where closed forms say how far they go: teeth, ways back, loops, circles."""

from __future__ import annotations

import numpy as np
import pytest

from planner.controls.export.fit import STRAIGHT, SWEEP_MAX, Moves, fewest_moves

WITHIN, GRID = 0.01, 1e-4


def moves(points: list[tuple[float, float, float]] | np.ndarray, *, arcs: bool = False) -> Moves:
    return fewest_moves(np.asarray(points, dtype=float), WITHIN, GRID, arcs=arcs)


@pytest.mark.parametrize("length", [0.3, 20.0, 400.0])
@pytest.mark.parametrize(("height", "goes"), [(0.99 * WITHIN, True), (1.01 * WITHIN, False)])
def test_a_tooth_goes_up_to_the_distance_wherever_it_points(length: float, height: float, goes: bool) -> None:
    tooth = np.array([[0, 0, 0], [0.4 * length, height, 0], [length, 0, 0]])
    rng = np.random.default_rng(3)
    for _ in range(5):
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        assert moves(tooth @ turned + rng.normal(size=3)).end.tolist() == ([2] if goes else [1, 2])


@pytest.mark.parametrize(("back", "goes"), [(1.98 * WITHIN, True), (2.02 * WITHIN, False)])
def test_a_way_back_goes_up_to_twice_the_distance(back: float, goes: bool) -> None:
    """A straight move stands in its middle: the Frechet distance is half of it."""
    found = moves([(x, 0, 0) for x in (0, 1, 3, 3 - back, 9)])
    assert (found.end.tolist() == [4]) == goes


def test_there_and_back_stays() -> None:
    """Its ends are the same place, and no move at all would be there in its stead."""
    assert moves([(1, 2, 3), (5, 2, 3), (1, 2, 3)], arcs=True).end.tolist() == [1, 2]


@pytest.mark.parametrize("count", [1, 2, 7])
def test_where_none_can_go_all_stay(count: int) -> None:
    zigzag = [(k, k % 2, 0) for k in range(count + 1)]
    assert moves(zigzag).end.tolist() == list(range(1, count + 1))


@pytest.mark.parametrize("turn", [1.0, -3.0, 4.0, -4.6])
def test_points_on_a_circle_become_one_arc_that_turns_as_they_do(turn: float) -> None:
    """Also more than half a circle."""
    angle = np.linspace(0.0, turn, 120)
    found = moves(np.stack([8 * np.cos(angle), 8 * np.sin(angle), 0 * angle], axis=1), arcs=True)
    assert (found.end.tolist(), found.normal.tolist()) == ([119], [2])
    np.testing.assert_allclose(found.center, [[-8.0, 0.0]], atol=0.1 * WITHIN)
    np.testing.assert_allclose(found.sweep, turn, atol=1e-3)


def test_a_circle_is_more_than_one_move() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    found = moves(np.stack([0 * angle, 8 * np.cos(angle), 8 * np.sin(angle)], axis=1), arcs=True)
    assert len(found.end) == 2
    assert set(found.normal.tolist()) <= {0, STRAIGHT}
    assert np.abs(found.sweep).max() <= SWEEP_MAX
