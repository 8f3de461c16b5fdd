"""What plans foretell of more feed, limits and tolerance, against plans made again: all through `planner.plan`."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import planner
from benchmarks import problems
from benchmarks.prices import compared, with_more
from planner.nc.reader import parse_program
from planner.sensitivity import savings
from planner.sensitivity.prices import HINT_LEAST, MORE_LIMIT, UNREST, WORTH, price_list

MACHINE = problems.machine()
MOST = 1.0 - 1.0 / (1.0 + MORE_LIMIT)  # share of the time that a tenth more of one limit can save
LINES = "G21 G90 G17\nF4800\nG1 X3\nX4 Y2.5\nX9 Y3\nX9.2 Y6\nX6 Y9\nX0 Y9.5\n"
JOBS = {"pentagon": problems.pentagon, "zig-zag": problems.zigzag, "arcs": problems.arcs}


@pytest.fixture(scope="module", params=JOBS)
def on_corners(request):
    return compared(request.param, JOBS[request.param](), MACHINE, "bezier")


@pytest.fixture(scope="module")
def on_splines():
    among = ("feed", "acceleration.x", "tolerance")
    return compared("pentagon", problems.pentagon(), MACHINE, "spline", among)


@pytest.mark.slow
def test_on_rounded_corners_all_that_stands_in_the_table_is_a_number_and_right(on_corners):
    for row in on_corners["rows"]:
        assert row["right"], row
        if row["foretold_s"] >= WORTH * on_corners["cycle_time_s"]:
            assert not row["hint"], row
    assert len(on_corners["rows"]) >= 5


@pytest.mark.slow
def test_on_splines_a_saving_is_right_or_a_range_with_what_was_found_inside(on_splines):
    cycle_time = on_splines["cycle_time_s"]
    for row in on_splines["rows"]:
        assert row["right"], row
        assert row["least_s"] <= row["foretold_s"] <= row["most_s"]
        assert row["most_s"] - row["least_s"] <= 2.0 * UNREST * cycle_time + 0.5 * row["found_s"], row
    rows = {row["limit"]: row for row in on_splines["rows"]}
    assert not rows["feed"]["hint"]
    assert rows["feed"]["found_s"] > 0.01 * cycle_time
    assert rows["tolerance"]["found_s"] > 1e-3 * cycle_time


@pytest.mark.slow
def test_where_the_period_may_take_its_share_of_more_everything_is_a_hint_and_right():
    """Chords between samples 4 ms apart use 40 % of the tolerance: a faster motion has to leave them more."""
    among = ("feed", "tolerance")
    machine = problems.five_points_machine()
    result = compared("five points", problems.five_points(), machine, "bezier", among)
    assert [row["limit"] for row in result["rows"]] == ["feed", "tolerance"]
    for row in result["rows"]:
        assert row["hint"], row
        assert row["least_s"] <= 0.0 < row["found_s"] <= row["most_s"], row
    fine = machine.model_copy(update={"dt": 1e-4})
    plan = planner.plan(problems.five_points(), fine, method="optimal", corner="bezier")
    assert not set(among) & set(plan.prices.hints)


@pytest.mark.slow
def test_a_tenth_more_of_anything_saves_no_more_than_everything_a_tenth_faster(on_corners, on_splines):
    for result in (on_corners, on_splines):
        for row in result["rows"]:
            if row["limit"] != "tolerance":
                assert row["most_s"] <= MOST * result["cycle_time_s"]
                assert row["found_s"] <= (MOST + HINT_LEAST) * result["cycle_time_s"]


@pytest.mark.usual_sizes  # grids are thinned less, and plans made more finely
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
    """Time k times as fast is velocities times k, accelerations k^2, jerks k^3, feeds k, periods 1/k (sensitivity/prices.py's own law),
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


@pytest.fixture(scope="module")
def solved():
    """What `price_list` gets of a plan."""
    got = {}
    from planner.optimal import result

    def kept(*given):
        got["given"] = given
        return price_list(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(result, "price_list", kept)
        planner.plan(problems.zigzag(), MACHINE, method="optimal", corner="bezier")
    return got["given"][:4]


def test_windows_of_a_grid_foretell_what_the_whole_grid_foretells(solved, monkeypatch):
    whole = price_list(*solved)
    monkeypatch.setattr(savings, "POINTS", 1)  # a quarter of the job's grid is left: windows
    monkeypatch.setattr(savings, "WINDOW", 250)
    part = savings.thinned(*solved, rows=3)
    assert part.sampled
    assert len(part.samples) < 1000
    sampled = price_list(*solved)
    for name in ("acceleration.y", "jerk.x", "tolerance"):
        least, most = sampled.ranges[name]
        assert least <= whole.saved[name] * 1.1
        assert most >= whole.saved[name] * 0.9
        assert sampled.saved[name] == pytest.approx(whole.saved[name], rel=0.15)


@pytest.mark.usual_sizes  # grids are thinned less, and plans made more finely
def test_a_thinned_grid_keeps_ends_slow_places_and_elements(solved):
    samples, problem, solution, machine = solved
    part = savings.thinned(samples, problem, solution, machine, rows=3)
    assert not part.sampled
    assert len(part.samples) < 0.5 * len(samples)
    assert part.solution.cycle_time == pytest.approx(solution.cycle_time, rel=0.01)
    assert part.samples.s[-1] == pytest.approx(samples.s[-1], rel=1e-9)
    assert set(np.unique(part.samples.element)) == set(np.unique(samples.element))


def test_legs_that_a_wider_tolerance_opens_count(solved):
    """A path whose corners are made smaller has free parts of legs that its grid does not know: they take their time."""
    samples, problem, solution, machine = solved
    part = savings.thinned(samples, problem, solution, machine, rows=3)
    path = samples.path
    free = path.legs.length - path.d_out[:-1] - path.d_in[1:]
    closed = np.flatnonzero(free < 1e-9)
    assert part.opened(path) == pytest.approx(0.0, abs=1e-9)
    smaller = dataclasses.replace(path, d=0.9 * path.d)
    opened = part.opened(smaller)
    if not len(closed):
        assert opened == 0.0
        return
    gaps = (smaller.legs.length - smaller.d_out[:-1] - smaller.d_in[1:])[closed]
    v = np.sqrt(solution.feed_sq[solution.feed_sq > 0.0])
    assert gaps.sum() / v.max() <= opened <= gaps.sum() / v.min()


def test_windows_hold_whole_pieces_however_short_and_parts_with_room_to_start_and_stop():
    """400 pieces of 10 points, then one of 5000: windows of the first hold whole pieces, none has a part that is too short."""
    piece = np.append(np.arange(0, 4001, 10), 9000)
    kept = np.arange(9000)
    edges, points, sampled = savings.windows_of_grid(piece, kept, 3_000)
    assert sampled
    assert 2_500 <= len(points) <= 3_000
    for a, b in pairwise(edges):
        part = points[a:b]
        assert (np.diff(part) == 1).all()
        inside = np.searchsorted(piece, part[0], side="right") - 1
        assert part[-1] < piece[inside + 1]
        whole = part[0] == piece[inside] and part[-1] + 1 == piece[inside + 1]
        assert whole or len(part) > savings.INTERVALS_MIN
    assert (points < 4000).any()
    assert savings.windows_of_grid(piece, kept, 9_000)[2] is False


@pytest.mark.usual_sizes  # grids are thinned less, and plans made more finely
def test_a_grid_that_fits_in_one_window_is_taken_whole():
    """Many limits leave each of their problems fewer points than a window has."""
    kept = np.arange(0, 1_800, 2)
    assert len(kept) < savings.WINDOW
    edges, points, sampled = savings.windows_of_grid(np.array([0, 800, 1_800]), kept, len(kept) - 100)
    np.testing.assert_array_equal(points, kept)
    assert (edges.tolist(), sampled) == ([0, 400, 900], False)
