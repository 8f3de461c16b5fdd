"""Feeds and speeds over what [tools] allows are said with the line."""

from __future__ import annotations

import pytest

import planner
from planner.base.errors import InputError
from planner.machine import Machine, load_machine
from planner.planning.job.notes import cutting_notes

MILL = load_machine("mill")


def machine(**tool: float) -> Machine:
    return MILL.model_copy(
        update={"tools": Machine(**MILL.model_dump(exclude_none=True) | {"tools": {"3": tool}}).tools}
    )


def notes(text: str, **tool: float) -> list[str]:
    mill = machine(**tool)
    return cutting_notes(planner.read_program(text=text, machine=mill), mill)


PROGRAM = "G21 G90 G94\nT3 M6\nS10000 M3\nG0 X1\nG1 X10 F2000\nX20 F2400\nT4\nX30\nM6\nG1 X40 F9000\n"


@pytest.mark.shows("cutting", "exact: worked out by hand")
def test_feed_per_tooth_is_f_over_s_and_flutes() -> None:
    assert notes(PROGRAM, flutes=2, feed_per_tooth_max=0.12) == []
    (said,) = notes(PROGRAM, flutes=2, feed_per_tooth_max=0.11)
    assert (
        said
        == "line 6: T3 has 0.12 mm per tooth, above its feed_per_tooth_max of 0.11 (2 blocks, at most 0.12)"
    )
    assert notes(PROGRAM, flutes=4, feed_per_tooth_max=0.06) == []


def test_surface_speed_and_spindle() -> None:
    (said,) = notes(PROGRAM, diameter=10.0, surface_speed_max=314.0)
    assert said.startswith("line 5: T3 has 314.2 m/min at its diameter")
    assert notes(PROGRAM, diameter=10.0, surface_speed_max=314.2) == []
    (said,) = notes(PROGRAM, spindle_max=9999)
    assert said.startswith("line 5: T3 has S10000, above its spindle_max of 9999 (3 blocks")


@pytest.mark.parametrize(
    "text",
    [
        "G1 X10 F5000\n",
        "T3 M6\nG1 X10 F5000\n",
        "T3 M6\nS100 M3\nG0 X10\n",
        "T3\nS100 M3\nM6 T4\nG1 X10 F5000\n",
        "M6 T3\nM2\n",
        "T3\nM2\n",
    ],
)
def test_nothing_is_said_where_s_or_the_tool_is_not_known(text: str) -> None:
    assert notes("G21 G90\n" + text, flutes=1, feed_per_tooth_max=1e-3) == []


def test_a_plan_says_it() -> None:
    mill = machine(flutes=2, feed_per_tooth_max=0.11)
    plan = planner.plan(planner.read_program(text=PROGRAM, machine=mill), mill, method="stop")
    assert any("0.12 mm per tooth" in note for note in plan.notes)


@pytest.mark.parametrize(
    ("tool", "said"),
    [
        ({"feed_per_tooth_max": 0.1}, "feed_per_tooth_max needs flutes"),
        ({"surface_speed_max": 100}, "surface_speed_max needs diameter"),
        ({"flutes": 0}, "flutes: must be above 0"),
        ({"flutes": 2.5}, "flutes: "),
        ({"spindle_max": -1}, "spindle_max: must be above 0"),
        ({"flute": 2}, r"unknown key \(did you mean 'flutes'"),
    ],
)
def test_wrong_tools(tool: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        machine(**tool)
