"""Wrong turns from Python, and what they are answered with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import planner

CORNER = [[0, 0], [20, 0], [20, 20]]


def corner() -> planner.Program:
    return planner.path(CORNER, feed=50.0)


class Slow(planner.PathLimit):
    name = "slow"

    def velocity(self, at: Any) -> Any:
        return 5.0


class Two(Slow):
    def velocity(self, at: Any) -> Any:
        return [5.0, 3.0]


@pytest.mark.parametrize(
    ("wrong", "error", "said"),
    [
        (lambda: planner.plan(CORNER, "mill"), planner.InputError, r"planner\.path\(points\).*found a list"),
        (lambda: planner.plan("G1 X10 F100"), planner.InputError, r"its text goes into planner\.read_program"),
        (lambda: planner.plan("nowhere.nc"), planner.InputError, r"nowhere.nc: program file not found$"),
        (lambda: planner.plan(corner(), tol=0.1), TypeError, r"'tol'; .*did you mean 'tolerance'"),
        (lambda: planner.plan(corner(), tolerance="20um"), planner.InputError, r"'20um'; give a number, in mm"),
        (lambda: planner.compare(corner(), "mill", ["stopp"]), planner.InputError, r"did you mean 'stop'"),
        (lambda: planner.plan(corner(), "mil"), planner.InputError, r"did you mean 'mill'"),
        (lambda: planner.plan(corner(), {"x": 1}), planner.InputError, r"a machine is a file.*found a dict"),
        (lambda: planner.plan(corner(), limits=[Slow]), planner.InputError, r"Slow is a class; give .* Slow\(\)"),
        (lambda: planner.plan(corner(), limits=Two()), planner.InputError, r"velocity has the shape \(2,\); .*one for each"),
        (lambda: planner.plan(corner(), method="optimum"), planner.InputError, r"did you mean 'optimal'"),
    ],
)  # fmt: skip
def test_a_wrong_turn_is_answered_with_the_right_one(
    wrong: Callable[[], Any], error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        wrong()


def test_one_limit_of_ones_own_needs_no_list() -> None:
    made = planner.plan(corner(), "mill", method="second-order", limits=Slow())
    assert "velocity.slow" in made.require().verdict.limits  # type: ignore[union-attr]
