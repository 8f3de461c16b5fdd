"""Behind filters that take less than the tolerance the plan is searched as without them, and nothing else is planned beside it."""

from __future__ import annotations

import pytest

import planner
from planner.corners.budget import filters_count
from planner.machine import Machine, load_machine

SAW = (
    "G21 G90 G64 P0.02\nF9000\n"
    + "\n".join(f"G1 X{2.5 * k} Y{(k % 2) * 4.0}" for k in range(1, 9))
    + "\nM2\n"
)
STAR = "G21 G90 G64 P0.05\nF6000\nG1 X8 Y25\nX16 Y2\nX-5 Y16\nX21 Y16\nX0 Y0\nM2\n"


def machine(*lengths: float) -> Machine:
    mill = load_machine("mill")
    if not lengths:
        return mill
    return Machine.model_validate({**mill.model_dump(), "fir": {"time_constants": lengths}})


@pytest.mark.parametrize("text", [SAW, STAR])
def test_filters_of_a_tenth_of_a_millisecond_cost_no_time(text: str):
    program = planner.read_program(text=text)
    none, short = (planner.plan(program, machine(*lengths)).require() for lengths in ((), (1e-4, 1e-4)))
    assert short.verdict.passed
    assert short.verdict.after_filters is not None
    assert short.sentence.split(";")[0] == none.sentence.split(";")[0]
    assert short.cycle_time == pytest.approx(none.cycle_time, rel=1e-4)


def test_what_counts_as_a_long_filter():
    """6,403 mm/s2 in x, y and z times T^2/24 is 20 um at T = 8.7 ms."""
    path = planner.plan(planner.read_program(text=SAW), machine(), method="stop").toolpath
    assert not filters_count(machine(), path)
    assert not filters_count(machine(8.5e-3), path)
    assert filters_count(machine(9.5e-3), path)
