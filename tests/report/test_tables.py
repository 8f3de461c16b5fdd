"""What the tables say."""

from __future__ import annotations

import numpy as np
from hand_made import make_plan
from rich.console import Console, RenderableType

from planner.machine import builtin_machines, load_machine
from planner.nc.faults import Fault
from planner.nc.info import describe
from planner.report.tables import corner_table, info_table, machines_table, plan_table


def text(table: RenderableType | None) -> str:
    assert table is not None
    console = Console(width=140, color_system=None)
    with console.capture() as captured:
        console.print(table)
    return captured.get()


def test_plan() -> None:
    said = text(plan_table(make_plan()))
    assert "0.8000 s" in said
    assert "1.2500 s, 1.56 times as long" in said
    assert "x 0.5, y 1.000001" in said
    assert "x 3.5  (not limited by this method)" in said
    assert "12.300 µm" in said
    assert "passed" in said


def test_failed_plan_names_its_faults() -> None:
    said = text(plan_table(make_plan(passed=False)))
    assert "FAILED" in said
    assert "velocity.y: 101 mm/s" in said


def test_unsolved_plan() -> None:
    said = text(plan_table(make_plan(solved=False)))
    assert "cycle time" not in said
    assert "verdict" not in said


def test_corners() -> None:
    said = text(corner_table(make_plan()))
    assert "90.00" in said
    assert "normal_acceleration" in said
    plan = make_plan()
    plan.corners.line = np.zeros(0)
    assert corner_table(plan) is None


def test_machines() -> None:
    said = text(machines_table([load_machine(name) for name in builtin_machines()]))
    assert all(name in said for name in builtin_machines())


def test_every_unsupported_place_is_listed() -> None:
    faults = tuple(Fault(line, 3, "G41", "cutter compensation is not supported") for line in range(5, 500))
    said = text(info_table(describe(make_plan().program, lines=7, unsupported=faults)))
    assert "495 places" in said
    assert said.count("cutter compensation") == 1
    assert "499:3 G41" in said
