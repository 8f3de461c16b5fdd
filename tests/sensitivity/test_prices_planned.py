"""What plans foretell of more feed, limits and tolerance, against plans made again: all through `planner.plan`."""

from __future__ import annotations

import pytest

import planner
from benchmarks.jobs import problems
from benchmarks.solvers.prices import compared, with_more
from planner.nc.reader import parse_program
from planner.sensitivity.path_prices import UNREST
from planner.sensitivity.prices import HINT_LEAST, MORE_LIMIT

MACHINE = problems.machine()
MOST = 1.0 - 1.0 / (1.0 + MORE_LIMIT)  # share of the time that a tenth more of one limit can save
LINES = "G21 G90 G17\nF4800\nG1 X3\nX4 Y2.5\nX9 Y3\nX9.2 Y6\nX6 Y9\nX0 Y9.5\n"
JOBS = {"pentagon": problems.pentagon, "zig-zag": problems.zigzag, "arcs": problems.arcs}


@pytest.fixture(scope="module", params=JOBS)
def on_corners(request):
    return compared(request.param, JOBS[request.param](), MACHINE, "bezier")


@pytest.fixture(scope="module")
def on_splines():
    among = ("feed", "acceleration.x")
    return compared("pentagon", problems.pentagon(), MACHINE, "spline", among)


@pytest.mark.slow
def test_on_rounded_corners_what_is_found_lies_in_the_range(on_corners):
    rows = {row["limit"]: row for row in on_corners["rows"]}
    for row in rows.values():
        assert row["right"], row
    assert len(rows) >= 4


@pytest.mark.shows("prices", "sampled: plans made again with that limit changed")
@pytest.mark.slow
def test_on_splines_a_saving_is_right_or_a_range_with_what_was_found_inside(on_splines):
    cycle_time = on_splines["cycle_time_s"]
    for row in on_splines["rows"]:
        assert row["right"], row
        assert row["least_s"] <= row["foretold_s"] <= row["most_s"]
        assert row["most_s"] - row["least_s"] <= 2.0 * UNREST * cycle_time + 0.5 * row["found_s"], row
    rows = {row["limit"]: row for row in on_splines["rows"]}
    assert rows["feed"]["least_s"] > 0.0
    assert rows["feed"]["found_s"] > 0.01 * cycle_time


@pytest.mark.slow
def test_where_the_period_may_take_its_share_of_more_everything_is_a_hint_and_right():
    """Chords between samples 4 ms apart use 40 % of the tolerance: a faster motion has to leave them more."""
    among = ("feed",)
    machine = problems.five_points_machine()
    result = compared("five points", problems.five_points(), machine, "bezier", among)
    assert [row["limit"] for row in result["rows"]] == ["feed"]
    for row in result["rows"]:
        assert row["hint"], row
        assert row["least_s"] <= 0.0 < row["found_s"] <= row["most_s"], row
    fine = machine.model_copy(update={"dt": 1e-4})
    plan = planner.plan(problems.five_points(), fine, method="optimal", corner="bezier")
    assert plan.prices.ranges["feed"][0] > 0.0


@pytest.mark.slow
def test_a_tenth_more_of_anything_saves_no_more_than_everything_a_tenth_faster(on_corners, on_splines):
    for result in (on_corners, on_splines):
        for row in result["rows"]:
            if row["limit"] != "tolerance":
                assert row["most_s"] <= MOST * result["cycle_time_s"]
                assert row["found_s"] <= (MOST + HINT_LEAST) * result["cycle_time_s"]


@pytest.mark.usual_sizes  # plans are made more finely
@pytest.mark.parametrize("corner", ["bezier", "auto"])
def test_at_a_crawl_the_feed_saves_all_that_can_be_saved_and_nothing_else_saves_anything(corner):
    program = parse_program(LINES.replace("F4800", "F240"), MACHINE)
    plan = planner.plan(program, MACHINE, method="optimal", corner=corner)
    cycle_time = plan.trajectory.cycle_time
    saved = plan.prices.saved
    assert saved["feed"] == pytest.approx(MOST * cycle_time, rel=1.5e-2)
    assert saved["feed"] <= MOST * cycle_time
    assert "feed" not in plan.prices.hints
    others = [value for name, value in saved.items() if name not in ("feed", "tolerance")]
    assert max(others) < 1e-3 * cycle_time


def test_the_prices_of_a_plan_sum_up_to_its_time():
    """Time k times as fast is velocities times k, accelerations k^2, jerks k^3, feeds k, periods 1/k (path_prices.py's own law),
    here with the problem that the plan ended with, limit_scale and all."""
    machine = problems.machine(dt=1e-5)
    plan = planner.plan(parse_program(LINES, machine), machine, method="optimal", corner="bezier")
    order = {"velocity": 1, "acceleration": 2, "jerk": 3}
    total = plan.prices.feed
    for name, price in plan.prices.limits.items():
        quantity, _, axis = name.partition(".")
        total += order[quantity] * price * getattr(machine.axes[axis], quantity)
    assert total == pytest.approx(-plan.trajectory.cycle_time, rel=5e-3)


def test_where_feed_and_an_axis_are_equally_fast_neither_alone_is_worth_anything():
    program = problems.polyline([[0, 0], [80, 0]], feed=100.0)
    plan = planner.plan(program, problems.machine(velocity=100.0), method="optimal", corner="bezier")
    assert plan.prices.saved["feed"] == pytest.approx(0.0, abs=1e-9)
    assert plan.prices.saved["velocity.x"] == pytest.approx(0.0, abs=1e-9)
    again, machine = with_more(program, problems.machine(velocity=100.0), "velocity.x")
    slower = planner.plan(again, machine, method="optimal", corner="bezier")
    assert slower.trajectory.cycle_time == pytest.approx(plan.trajectory.cycle_time, rel=1e-6)
