"""The search along many short runs, side by side: the same motion on any number of threads."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import planner
from planner.base.threads import use_threads
from planner.job.trace import Trace
from planner.methods.all_runs import LONG

RUNS = 60
STROKE = "G1 X{0} Y{1}\nG1 X{2} Y{1}\nG1 X{2} Y{0}\nG1 X{0} Y{3}\nG1 X{3} Y{2}\nG1 X{1} Y{0}\nG4 P0.01\n"


@pytest.fixture
def threads() -> Iterator[None]:
    yield
    use_threads(None)


@pytest.mark.usefixtures("threads")
def test_many_short_runs_have_the_same_motion_on_any_number_of_threads() -> None:
    program = "G21 G90 G64 P0.05 F6000\n" + "".join(
        STROKE.format(*np.round(np.array([0.0, 3.0, 7.0, 11.0]) + 0.1 * k, 3)) for k in range(RUNS)
    )
    machine = planner.load_machine("mill")
    found = []
    for count in (1, 3):
        use_threads(count)
        told = Trace()
        found.append(
            planner.plan(
                planner.read_program(text=program, machine=machine), machine, effort="quick", log=told
            )
        )
        searched = [step for step in told.steps if step.name == "search"]
        assert searched[-1].facts["steps"] > LONG
        assert found[-1].verdict is not None
        assert found[-1].verdict.passed
    first, other = (plan.require().trajectory for plan in found)
    assert first is not None
    assert other is not None
    np.testing.assert_array_equal(first.position, other.position)
