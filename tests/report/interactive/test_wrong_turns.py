"""Wrong turns from Python, and what they are answered with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
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


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"jerk": -5.0}, "axes.x.jerk: must be above 0, found -5.0"),
        ({"jerk": "fast"}, "axes.x.jerk: must be a number, found 'fast'"),
        ({"jrk": 5.0}, r"axes.x.jrk: unknown key \(did you mean 'jerk'\?\)"),
        ({"velocity": np.inf}, "axes.x.velocity: must be a finite number"),
    ],
)
def test_a_machine_changed_by_model_copy_is_checked(changed: dict[str, object], said: str) -> None:
    """pydantic's model_copy takes anything: a misspelt jerk was left out without a word."""
    mill = planner.load_machine("mill")
    axes = {**mill.axes, "x": mill.axes["x"].model_copy(update=changed)}
    machine = mill.model_copy(update={"axes": axes})
    with pytest.raises(planner.InputError, match=said):
        planner.plan(corner(), machine, method="stop")
    with pytest.raises(planner.InputError, match=said):
        planner.verify([0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]], corner(), machine)
    with pytest.raises(planner.InputError, match="dt: must be above 0"):
        planner.plan(corner(), mill.model_copy(update={"dt": 0.0}), method="stop")
    with pytest.raises(planner.InputError, match=said):
        planner.compare(corner(), machine, ["stop"])


def test_one_name_is_a_method_and_no_sequence_of_letters() -> None:
    assert [row.method for row in planner.compare(corner(), "mill", "stop")] == ["stop"]


def test_one_limit_of_ones_own_is_a_limit_for_compare_as_for_plan() -> None:
    (row,) = planner.compare(corner(), "mill", "stop", limits=Slow())
    assert row.cycle_time == planner.plan(corner(), "mill", method="stop", limits=Slow()).cycle_time
    assert row.worst["velocity"][1] == "velocity.slow"
