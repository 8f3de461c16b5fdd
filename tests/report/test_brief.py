"""The eight lines of `planner plan`: what they say, in which units, and what comes first."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_made import make_plan
from test_tables import text

import planner
from planner.controls.timing.times import control_times
from planner.machine import ControlData, load_machine
from planner.machine.user_limit import JointLimit
from planner.nc.reader import parse_program
from planner.planning.job.beside import Beside
from planner.report import rows
from planner.report.brief import brief_rows, limit_text, tool_times
from planner.report.rows import NAMES, control_of, plan_rows
from planner.report.summary import summary
from planner.report.tables import brief_table
from planner.report.units import UNITS, units_of
from tests.commands.command_line import run


def test_eight_lines_without_a_symbol_of_papers() -> None:
    said = text(brief_table(make_plan(), UNITS["mm"]))
    assert len(said.splitlines()) <= 9, "with the title"
    for word in ("eq.", "jerk.", "acceleration.", "grid", "solver", "certified"):
        assert word not in said
    assert "acceleration of Y 70 %, the programmed feed 25 %" in said


def test_shares_of_limits_are_rounded_as_in_the_table_of_all_rows() -> None:
    """12.5 % is 13 % in both."""
    plan = make_plan()
    names, share = plan.grid.active_names, np.zeros(len(plan.grid.active_names))
    share[0], share[1] = 0.125, 0.875
    plan.grid = dataclasses.replace(plan.grid, share=share)
    assert dict(plan_rows(plan))["held by"] == f"{names[1]} 88 %, {names[0]} 13 %"
    assert dict(brief_rows(plan, UNITS["mm"]))["limited by"] == (
        f"{limit_text(names[1])} 88 %, {limit_text(names[0])} 13 % of the time, some together"
    )


def test_shares_that_are_all_below_a_hundredth_are_told_so() -> None:
    plan = make_plan()
    plan.grid = dataclasses.replace(plan.grid, share=np.full(len(plan.grid.active_names), 0.004))
    assert dict(brief_rows(plan, UNITS["mm"]))["limited by"] == "no limit for a hundredth of the time"


def test_what_is_saved_against_a_stop_and_never_less_than_nothing() -> None:
    plan = make_plan()
    assert dict(brief_rows(plan, UNITS["mm"]))["saved"].startswith(
        "0.45 s, 36 %, against a stop at every block"
    )
    plan.stop_time = plan.trajectory.cycle_time * (1.0 + 1e-15)  # rounding
    assert dict(brief_rows(plan, UNITS["mm"]))["saved"].startswith("nothing, against a stop at every block")
    plan.stop_time = 0.5
    assert dict(brief_rows(plan, UNITS["mm"]))["saved"].startswith("nothing, against a stop at every block")


def test_many_times_as_long_is_told_in_digits() -> None:
    plan = make_plan()
    plan.stop_time = 300.0 * plan.trajectory.cycle_time
    assert ", 100 %, against a stop" in dict(brief_rows(plan, UNITS["mm"]))["saved"]
    plan.least_time = 0.4 * plan.trajectory.cycle_time
    assert "this motion is 150 % above that" in dict(plan_rows(plan))["fastest possible"]


def test_nothing_is_saved_against_stops_that_break_limits() -> None:
    """A stop at every block knows neither limits of one's own nor those of joints."""
    job = planner.read_program(text="G1 X10 F3000\nY10\nX0\nY0\n")
    plan = planner.plan(job, load_machine("mill").with_own([Sum()]), effort="quick")
    assert plan.cycle_time > plan.stop_time
    assert "without the limits of sum" in dict(brief_rows(plan, UNITS["mm"]))["saved"]


class Sum(JointLimit):
    name, velocity = "sum", 5.0

    def joint(self, at: Any) -> Any:
        return at.x + at.y


def test_the_control_is_asked_once_for_terminal_and_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    real = rows.control_times
    monkeypatch.setattr(rows, "control_times", lambda *of: asked.append(of) or real(*of))
    (tmp_path / "part.nc").write_text("G21 G64 P0.05\nG1 X10 F600\nY10\nM2\n")
    for words in (
        [],
        ["-v"],
        ["--json"],
        ["-o", tmp_path / "out", "--report"],
        ["-o", tmp_path / "out", "--json"],
    ):
        asked.clear()
        done = run("plan", tmp_path / "part.nc", "-m", "boss", "--method", "kinematic", *words)
        assert done.exit_code == 0
        assert "LinuxCNC's own planner" in done.output.replace("\n", " ")
        assert len(asked) == 1
        assert "sha256" not in done.output


def test_what_is_saved_against_the_control_that_the_machine_names() -> None:
    plan = make_plan()
    plan.machine = plan.machine.model_copy(update={"control": ControlData(name="grbl")})
    takes = control_times(plan.program, plan.machine, "grbl").seconds
    found = control_of(plan)
    assert found is not None
    assert found.seconds == pytest.approx(takes)
    said = dict(brief_rows(plan, UNITS["mm"]))["saved"]
    assert "grbl" in said
    assert f"{takes:.4f} s" in said
    assert not any(f"-{digit}" in said for digit in "0123456789")


def test_the_total_and_what_is_not_in_it() -> None:
    plan = make_plan()
    change, start = (
        Beside(what=what, count=2, each=each) for what, each in (("tool change", 6.0), ("M8", None))
    )
    plan.beside = (change, dataclasses.replace(start, because="no time in the machine file"))
    assert dict(brief_rows(plan, UNITS["mm"]))["time"] == (
        "12.8000 s: motion 0.8000 s, 12 s: 2 tool changes of 6 s; without 2 M8 (no time in the machine file)"
    )


def test_tolerance_in_inch() -> None:
    rows = dict(brief_rows(make_plan(), UNITS["inch"]))
    assert rows["tolerance used"].endswith(f"of {0.02 / 25.4:.4g} in")


@pytest.mark.parametrize(
    ("program", "name"), [("G20 G1 X1 F10", "in"), ("(G20) G21\nG1 X1 F10", "mm"), ("G1 X1 F10", "mm")]
)
def test_units_are_those_of_the_program(program: str, name: str) -> None:
    read = parse_program(program, load_machine("mill"))
    assert units_of(dataclasses.replace(read, text=program.encode())).length == name
    assert units_of(read, "inch").feed == "in/min"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("jerk.x", "jerk of X"),
        ("velocity.a", "speed of A"),
        ("power.y", "drive power of Y"),
        ("feed", "the programmed feed"),
        ("spindle power", "spindle power"),
    ],
)
def test_limits_in_words(name: str, words: str) -> None:
    assert limit_text(name) == words


def test_the_times_of_tools_are_those_of_the_motion() -> None:
    machine = load_machine("mill")
    job = "G21 F1200 T1 M6\nG1 X10\nY10\nT2 M6\nG1 X0\nG4 P0.5\nY0\nM2\n"
    plan = planner.plan(planner.read_program(text=job, machine=machine), machine, method="stop")
    found = tool_times(plan)
    assert [*found] == ["T1", "T2"]
    assert sum(found.values()) == pytest.approx(plan.cycle_time, abs=machine.dt)
    assert found["T2"] - found["T1"] == pytest.approx(0.5, abs=machine.dt), "the dwell"
    assert np.isfinite([*found.values()]).all()
    assert summary(plan)["tools_s"] == pytest.approx(found)
    one = planner.plan(
        planner.read_program(text=job.replace("T2 M6", ""), machine=machine), machine, method="stop"
    )
    assert summary(one)["tools_s"] == {}
    still = planner.plan(
        planner.read_program(text="T1 M6\nG1 X10 F600\nT2 M6\n", machine=machine), machine, method="stop"
    )
    assert tool_times(still) == {}, "one that moves"


def test_page_and_terminal_compare_with_the_same() -> None:
    plan = make_plan()
    for name in (None, "grbl"):
        if name:
            plan.machine = plan.machine.model_copy(update={"control": ControlData(name=name)})
        saved = dict(brief_rows(plan, UNITS["mm"]))["saved"]
        assert dict(plan_rows(plan))["saved"] == dict(summary(plan)["told"])["saved"] == saved
        assert (NAMES.get(name or "", name or "stop")) in saved


@pytest.mark.parametrize(
    "job",
    ["M8\nT3 M6\nG1 X1 F100\nG41\nX9", "M8\nT3 M6\nG1 X1 F100\nG55\nX9", "T3 M6\nG1 X1 F100\nG64 P30\nX9"],
)
def test_what_may_be_another_part_is_told_first(job: str) -> None:
    """G41 without a diameter, an unknown work offset, and a tolerance that is larger than the part."""
    machine = load_machine("mill")
    plan = planner.plan(
        planner.read_program(text=f"G21 {job} Y9\nM2\n", machine=machine), machine, method="stop"
    )
    first = text(brief_table(plan, UNITS["mm"])).splitlines()[0]
    assert any(words in first for words in ("no diameter", "no offset", "the part's largest extent")), first


def test_a_bound_of_nothing_is_not_told() -> None:
    """Within a tolerance larger than the part nothing has to move."""
    made = planner.plan(
        planner.read_program(text="G1 X10 F600\nY10\nX0\nY0\n"), tolerance=20.0, method="stop"
    )
    assert made.least_time == 0.0
    assert "fastest possible" not in dict(plan_rows(made))


def test_joints_are_named_as_such() -> None:
    assert limit_text("acceleration.joint z") == "acceleration of joint Z"
    assert limit_text("jerk.x") == "jerk of X"
