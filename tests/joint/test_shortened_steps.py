"""Steps of the search that are shortened, and what rows are told of chords by a share of the way."""

import numpy as np
import pytest

from benchmarks.jobs import random_lines
from planner.joint.guess import Guess
from planner.joint.law_window import Window
from planner.joint.own import TubeOwn
from planner.planning.methods.optimal import OptimalMethod


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101, 116])
def test_windows_end_where_there_are_equal_optima(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes of these jobs slide on among equal optima where steps may bend the kinematics as much at the end as at first: their
    windows go on to the last iteration and are divided."""
    found, search = [], TubeOwn.search

    def told(*asked):
        found.append((yield from search(*asked)))
        return found[-1]

    monkeypatch.setattr(TubeOwn, "search", told)
    program, machine = random_lines.job(seed)
    assert OptimalMethod().plan(program, machine).require().verdict.passed
    assert sum(one.windows for one in found) == sum(one.solved for one in found) > 0


@pytest.mark.parametrize("slope", [-2.5, -1.2, -0.9, 0.0, 0.6])
def test_what_windows_are_told_comes_to_rest(slope: float) -> None:
    """What is found goes with what is told by a factor: told all of it, one of -1 or beyond would overshoot for ever."""
    guess = Guess(leg=np.zeros(1, int), h=np.ones(1), state=np.zeros((2, 3, 2)), place=np.zeros((1, 4)))
    window, target = Window(guess, 0, 1), np.array([[1.0, -2.0, 0.5], [3.0, 0.1, 0.0]])
    for _ in range(20):
        told = np.zeros_like(target) if window.rest is None else window.rest
        window.tell(target + slope * told)
    assert window.rest == pytest.approx(target / (1.0 - slope), abs=1e-3)
    window.tell(target + slope * window.rest)  # nothing changes any more
    assert np.isfinite(window.rest).all()


def test_told_the_same_again_a_window_stays() -> None:
    guess = Guess(leg=np.zeros(1, int), h=np.ones(1), state=np.zeros((2, 3, 2)), place=np.zeros((1, 4)))
    window = Window(guess, 0, 1)
    for _ in range(4):
        window.tell(np.ones((2, 3)))
    assert (window.rest == 1.0).all()
