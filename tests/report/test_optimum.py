"""What the tables and `summary.json` say of limits and prices: with plans made by hand, and of one real plan."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hand_made import DEAR, PRICES, make_plan
from test_tables import text

import planner
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.report.rows import price_rows
from planner.report.summary import summary
from planner.report.tables import plan_table


def test_what_holds_the_motion() -> None:
    """The largest first, in whole per cent; what holds less than one is not told."""
    grid = make_plan().grid
    assert [*grid.percents()] == [("acceleration.y", 70), ("feed", 25), ("nothing", 3), ("dwells", 2)]
    many = dataclasses.replace(grid, share=np.array([0.008, 0.007, 0.985, 0.0, 0.0]))
    assert [*many.percents()] == [("acceleration.y", 99), ("feed", 1), ("velocity.x", 1)]


def test_what_more_saves() -> None:
    """0.8 s: what saves 10 us of them is not told."""
    assert price_rows(PRICES, 0.8) == [
        ("10 % more saves", "feed 0.05 s, acceleration.y 0.0381 s"),
        ("10 µm more tolerance", "saves 0.0131 s"),
        ("most sensitive corners", "ms saved by 10 µm more tolerance: line 7: 4.4, line 4: 2.2"),
    ]


def test_corners_that_a_loop_passes_again_are_added_up() -> None:
    again = dataclasses.replace(PRICES, corners=dataclasses.replace(DEAR, line=np.full(len(DEAR), 7)))
    assert price_rows(again, 0.8)[-1] == (
        "most sensitive corners",
        "ms saved by 10 µm more tolerance: line 7: 6.6 at 2 corners",
    )


def test_a_hint_is_told_as_its_range() -> None:
    hints = dataclasses.replace(PRICES, hints=("feed", "tolerance"))
    assert price_rows(hints, 0.8)[:2] == [
        ("10 % more saves", "feed 0.049 to 0.051 s, acceleration.y 0.0381 s; ranges are hints only"),
        ("10 µm more tolerance", "saves 0.01 to 0.016 s, a hint only"),
    ]
    below = dataclasses.replace(hints, ranges=PRICES.ranges | {"feed": (-0.002, 0.051)})
    assert price_rows(below, 0.8)[0][1].startswith("feed 0 to 0.051 s")
    elsewhere = dataclasses.replace(PRICES, hints=("jerk.y",))  # which stands in no table
    assert price_rows(elsewhere, 0.8) == price_rows(PRICES, 0.8)


def test_where_more_saves_nothing() -> None:
    saved = dict.fromkeys(PRICES.saved, 0.0)
    no_corners = dataclasses.replace(
        DEAR, **{name: getattr(DEAR, name)[:0] for name in ("line", "position", "theta", "price", "saved")}
    )
    assert price_rows(dataclasses.replace(PRICES, saved=saved, corners=no_corners), 0.8) == [
        ("10 % more saves", "nothing"),
        ("10 µm more tolerance", "saves nothing to speak of"),
    ]


@pytest.mark.parametrize(
    ("saved", "told"),
    [
        (0.0131, "saves 0.0131 s"),
        (0.0003, "saves nothing to speak of"),
        (-0.0003, "saves nothing to speak of"),
        (-0.0131, "costs 0.0131 s: corners that share a short leg take room from each other"),
    ],
)
def test_more_tolerance_may_cost_time(saved: float, told: str) -> None:
    changed = dataclasses.replace(PRICES, saved=PRICES.saved | {"tolerance": saved})
    assert price_rows(changed, 0.8)[1] == ("10 µm more tolerance", told)


def test_where_the_price_of_the_tolerance_is_not_known() -> None:
    limits = {name: value for name, value in PRICES.saved.items() if name != "tolerance"}
    unknown = dataclasses.replace(PRICES, tolerance=None, saved=limits, corners=None)
    assert price_rows(unknown, 0.8)[1:] == [("10 µm more tolerance", "not known on this path")]
    said = json.loads(json.dumps(summary(make_plan(prices=unknown)), allow_nan=False))["prices"]
    assert said["tolerance"] is None
    assert said["corners"] is None


def test_the_plan_s_table() -> None:
    said = text(plan_table(make_plan(prices=PRICES)))
    assert "held by" in said
    assert "feed 0.05 s" in said
    assert "line 7: 4.4, line 4: 2.2" in said
    without = text(plan_table(make_plan()))
    assert "held by" in without
    assert "more saves" not in without
    assert "held by" not in text(plan_table(make_plan(solved=False)))


def test_the_summary() -> None:
    said = json.loads(json.dumps(summary(make_plan(prices=PRICES)), allow_nan=False))
    assert said["held_by"]["acceleration.y"] == 0.7
    assert said["held_by"] == {
        "acceleration.y": 0.7,
        "feed": 0.25,
        "velocity.x": 0.002,
        "none": 0.03,
        "rest": 0.018,
    }
    prices = said["prices"]
    assert prices["limits"] == PRICES.limits
    assert prices["saved_s"] == PRICES.saved
    assert prices["saved_range_s"]["feed"] == [0.049, 0.051]
    assert prices["hints"] == []
    assert (prices["more_limit"], prices["more_tolerance_mm"]) == (0.1, 0.01)
    assert [corner["line"] for corner in prices["corners"]] == [7, 4]
    assert prices["corners"][0]["position_mm"] == [1.0, 2.0, 3.0]
    assert prices["corners"][0]["theta_deg"] == pytest.approx(90.0)
    assert prices["corners"][1]["saved_s"] == 0.00216
    nothing = summary(make_plan(solved=False))
    assert nothing["held_by"] is None
    assert nothing["prices"] is None


@pytest.mark.slow
def test_a_real_plan() -> None:
    machine = load_machine("mill")
    program = parse_program("G21 G90\nG1 X20 F6000\nY10\nX0\nY0\n", machine)
    plan = planner.plan(program, machine, method="optimal")
    said = json.loads(json.dumps(summary(plan), allow_nan=False))
    assert sum(said["held_by"].values()) > 1.0, (
        "in the corners two jerks are active together, and count in full"
    )
    assert max(said["held_by"].values()) <= 1.0
    assert {corner["line"] for corner in said["prices"]["corners"]} == {2, 3, 4}
    worth = max(
        (name for name in said["prices"]["saved_s"] if name != "tolerance"), key=said["prices"]["saved_s"].get
    )
    assert set(said["prices"]["saved_range_s"]) == set(said["prices"]["saved_s"])
    assert f"10 % more saves {worth}" in " ".join(text(plan_table(plan)).split())
    assert "more saves" not in text(plan_table(planner.plan(program, machine, method="kinematic")))
