"""The distance of two paths, both ways and in order: closed forms, and the same distance of points close to each other."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from motions import Moves, machine

from planner.base.arrays import FloatArray
from planner.verifier import SamePath, same_path
from planner.verifier.rewritten import FINE, FLAT

M = machine()


def through(points: FloatArray) -> Moves:
    moves = Moves(start=(*points[0], 0.0))
    for point in points[1:]:
        moves.line(*point)
    return moves


def compared(one: Moves, other: Moves, allowed: float) -> SamePath:
    return same_path(one.toolpath(M), other.toolpath(M), allowed)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("back", [0.5, 3.0])
def test_a_way_back_along_a_line_is_half_of_it_off(back: float, turned: bool) -> None:
    """Nearness alone would see nothing: whoever runs the line straight waits in the middle of what the other runs back."""
    straight, there = (
        through(np.array([[0.0, 0], [10, 0]])),
        through(np.array([[0.0, 0], [8, 0], [8 - back, 0], [10, 0]])),
    )
    one, other = (there, straight) if turned else (straight, there)
    assert compared(one, other, 0.49 * back).fault == "the paths are further apart"
    found = compared(one, other, 0.55 * back)
    assert found.fault == ""
    assert 0.0 <= found.within - 0.5 * back <= (FINE + 2.0 * FLAT) * 0.55 * back


def test_an_arc_is_off_its_chords_by_their_height() -> None:
    """Of a quarter with the radius R, R (1 - cos(turn/2))."""
    radius, allowed = 20.0, 0.02
    arc = Moves(start=(radius, 0.0, 0.0)).arc((0.0, 0.0), math.pi / 2)
    for pieces in (30, 1000):
        turn = np.linspace(0.0, math.pi / 2, pieces + 1)
        chords = through(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        height = radius * (1.0 - math.cos(turn[1] / 2.0))
        found = compared(arc, chords, allowed)
        assert found.fault == ""
        assert height <= found.within <= height + (FINE + 3.0 * FLAT) * allowed


def distance_in_order(a: FloatArray, b: FloatArray) -> float:
    """Of two rows of points the least length of a leash between two that go on from point to point, never back."""
    apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    best = np.maximum.accumulate(apart[0])
    for row in apart[1:]:
        over = np.minimum(best, np.append(np.inf, best[:-1]))
        best[0] = max(best[0], row[0])
        for j in range(1, len(row)):
            best[j] = max(row[j], min(over[j], best[j - 1]))
    return float(best[-1])


def finely(points: FloatArray, step: float) -> FloatArray:
    """Points of a polyline, its vertices too, no further apart than `step`."""
    parts = [np.linspace(a, b, 1 + math.ceil(np.linalg.norm(b - a) / step)) for a, b in pairwise(points)]
    return np.vstack(parts)


@pytest.mark.parametrize("seed", range(8))
def test_of_any_two_polylines_it_is_that_of_points_close_to_each_other(seed: int) -> None:
    """Whose own is no less, and greater by one step at most."""
    random, step = np.random.default_rng(seed), 0.03
    ends = np.array([[0.0, 0.0], [3.0, 0.0]])
    one, other = (np.vstack([ends[0], ends[0] + random.uniform(0, 3, (n, 2)), ends[1]]) for n in (5, 4))
    close = distance_in_order(finely(one, step), finely(other, step))
    allowed = 1.5 * close
    found = compared(through(one), through(other), allowed)
    assert close - step <= found.within <= close + (FINE + 2.0 * FLAT) * allowed
    assert (
        compared(through(one), through(other), 0.98 * (close - step)).fault == "the paths are further apart"
    )
