"""What the tables say."""

from __future__ import annotations

import numpy as np
import pytest
from hand_made import make_corners, make_plan
from rich.console import Console, RenderableType

from planner.machine import builtin_machines, load_machine
from planner.nc.faults import Fault
from planner.nc.info import describe
from planner.report.tables import corners_table, info_table, machines_table, plan_table
from planner.verifier import CornerCheck


def text(table: RenderableType | None) -> str:
    assert table is not None
    console = Console(width=140, color_system=None)
    with console.capture() as captured:
        console.print(table)
    return captured.get()


def test_plan() -> None:
    said = text(plan_table(make_plan()))
    assert "0.8000 s" in said
    assert "0.45 s, 36 %, against a stop at every block: 1.2500 s of motion" in said
    assert "x 0.5, y 1.000001" in said
    assert "x 3.5  (not limited by this method)" in said
    assert "12.300 µm" in said
    checked = "eq. 18 holds at 3 of 3 corners, at most {:.4f} of the budget; compared: speed at most"
    checked = checked.format(make_plan().corners.worst_budget_ratio)
    assert checked in " ".join(said.split())
    assert "of eq. 19, 1.35 of eq. 20 (median of the 2 where it is below the feed)" in " ".join(said.split())
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
    said = text(corners_table(make_corners()))
    assert [line.split()[:3] for line in said.splitlines()[-3:]] == [
        ["3", "90.00", "840"],
        ["4", "90.00", "780"],
        ["5", "90.00", "0"],
    ]
    assert "1.400" in said  # over eq. 20
    assert corners_table(make_corners(turns=False)) is None
    assert "no corner without a full stop" in text(plan_table(make_plan(turns=False)))


def test_a_corner_that_was_not_looked_at_is_listed() -> None:
    columns = {name: np.array(column) for name, column in vars(make_corners()).items() if name != "judged"}
    for name in (
        "time",
        "feed_planned",
        "feed_closed_form",
        "speed_ratio",
        "miss",
        "chord_error",
        "budget_ratio",
        "delivered_speed",
        "delivered_budget",
    ):
        columns[name][1] = np.nan
    corners = CornerCheck(**columns)
    assert "not looked at" in text(corners_table(corners))
    assert corners.sentence().endswith("1 could not be checked")
    assert (corners.count, corners.not_looked_at, corners.held) == (2, 1, 2)


def test_of_many_corners_those_closest_to_the_law_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.report.tables.CORNERS_SHOWN", 2)
    said = text(corners_table(make_corners()))
    assert "the 2 closest to eq. 18-19 of 3 corners" in said
    assert [line.split()[0] for line in said.splitlines()[-2:]] == ["3", "4"]


def test_machines() -> None:
    said = text(machines_table([load_machine(name) for name in builtin_machines()]))
    assert all(name in said for name in builtin_machines())


def test_unsupported_places_are_listed_by_message_and_the_rest_is_counted() -> None:
    faults = tuple(Fault(line, 3, "G41", "cutter compensation is not supported") for line in range(5, 500))
    said = text(info_table(describe(make_plan().program, lines=7, unsupported=faults)))
    assert "495 places" in said
    assert said.count("cutter compensation") == 1
    assert "5:3 G41" in said
    assert "104:3 G41" in said
    assert "105:3 G41" not in said
    assert "and 395 more" in said
