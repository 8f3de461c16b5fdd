"""What page, pictures and notebooks have in common: colours of limits, rapids, units, the end of the feed's axis, parts."""

from __future__ import annotations

import itertools
import json
import re

import numpy as np
import pytest
from hand_made import make_plan

import planner
from planner.machine import Machine, load_machine
from planner.planning.job.plan import Plan
from planner.report.figure import (
    CLIPPED,
    COLOURS,
    GREY,
    LIGHT,
    ROOM,
    MotionColumns,
    feed_panel,
    flat_view,
    highest_feed,
    limit_colours,
    shown_part,
    travel_box,
)
from planner.report.html.data import samples_of
from planner.report.html.page import report_page
from planner.report.plotly_figure import colourings
from planner.report.units import UNITS, axis_titles, units_of
from tests.report.html.columns import column

MM, INCH = UNITS["mm"], UNITS["inch"]
TWO_TOOLS = "G20\nF20 T1 M6\nG0 X1\n(rough)\nG1 X1.4\n(finish)\nT2 M6\nG1 Y0.3\nG0 X0 Y0\nM2\n"


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planner.plan(planner.read_program(text=TWO_TOOLS), method="stop")


def test_a_limit_has_one_colour_on_every_job() -> None:
    few, many = ("jerk.x", "feed", "none"), ("acceleration.y", "rest", "feed", "velocity.z", "jerk.x", "none")
    of_few, of_many = (dict(zip(names, limit_colours(names), strict=True)) for names in (few, many))
    assert all(of_few[name] == of_many[name] for name in few)
    assert of_many["none"] == GREY
    assert of_many["rest"] == LIGHT


def test_other_limits_take_colours_that_the_usual_ones_leave() -> None:
    names = ("feed", "jerk.a", "jerk.x", "spindle power", "tolerance", "velocity.c")
    found = limit_colours(names)
    assert len(set(found)) == len(names)
    assert set(found) <= set(COLOURS)


def test_rapids_are_grey_below_the_scale_of_the_feed(plan: Plan) -> None:
    how = colourings(samples_of(plan), MM)["feed"]
    assert how["rapid"] == how["light"]["cmin"] < 0.0
    share = -how["rapid"] / (how["light"]["cmax"] - how["rapid"])
    (low, first), (zero, second), (start, third) = how["light"]["colorscale"][:3]
    assert (low, first, second) == (0.0, LIGHT, LIGHT)
    assert zero == start == pytest.approx(share)
    assert third != LIGHT


def test_the_axis_of_the_feed_ends_above_the_feed_moves(plan: Plan) -> None:
    assert plan.trajectory is not None
    motion = MotionColumns(plan, plan.trajectory)
    most = highest_feed(motion["feed"], motion["programmed"])
    panel = feed_panel(motion, MM)
    assert motion["feed"].max() > CLIPPED * most
    assert panel.top == pytest.approx(60.0 * ROOM * most)
    assert f"{60.0 * motion['feed'].max():,.0f} mm/min" in panel.said
    slow = make_plan()
    assert np.isnan(feed_panel(MotionColumns(slow, slow.trajectory), MM).top)


def test_feeds_are_in_the_units_of_the_program_and_columns_in_mm(plan: Plan) -> None:
    page = report_page(plan)
    about = json.loads(re.search(r'id="about">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    assert about["units"] == {
        "length": "in",
        "feed": "in/min",
        "mm": 25.4,
        "per_feed": pytest.approx(60 / 25.4),
    }
    assert about["colourings"]["feed"]["light"]["cmax"] == pytest.approx(20.0, rel=0.02), "F20"
    assert column(page, "x", "<f4").max() == pytest.approx(1.4 * 25.4, rel=1e-3)
    assert about["view"][0]["xaxis"]["range"][1] < 2.0
    assert '"feed": "mm/min"' in report_page(plan, units="mm")


def test_tools_and_operations_of_samples_are_those_of_their_lines(plan: Plan) -> None:
    samples = samples_of(plan)
    assert samples.parts.keys() == {"tool", "operation"}
    for kind, lines in {
        "tool": {3: "T1", 5: "T1", 8: "T2", 9: "T2"},
        "operation": {5: "rough", 8: "finish"},
    }.items():
        names, index = samples.parts[kind]
        for line, name in lines.items():
            assert {names[k] for k in index[samples.shown.line == line]} == {name}
        colouring = colourings(samples, INCH)[kind]
        assert colouring["light"]["colorbar"]["ticktext"] == names


def test_layers_of_printers() -> None:
    job = "M83\n" + "".join(f";LAYER:{n}\nG1 Z{n + 1} F600\nX{9 - 9 * (n % 2)}\n" for n in range(3))
    made = planner.plan(planner.read_program(text=job), method="stop")
    names, index = samples_of(made).parts["layer"]
    assert names == ["layer 0", "layer 1", "layer 2"]
    assert (np.diff(index) >= 0).all()


@pytest.mark.parametrize(
    ("job", "title"),
    [
        ("G21 G18 G7 F99\nG1 X8 Z-3", "x radius [mm]"),
        ("G20 G18 F9\nG1 X8", "x [in]"),
        ("G21 G17 F9\nG1 X8", "x [mm]"),
    ],
)
def test_radius_is_said_where_the_program_has_diameters(job: str, title: str) -> None:
    read = planner.read_program(text=job, machine=load_machine("mill"))
    assert axis_titles(read, units_of(read))["x"] == title


def test_turned_parts_lie() -> None:
    assert flat_view(np.array([20.0, 0.0, 50.0])) == [2, 0]
    assert flat_view(np.array([50.0, 0.0, 20.0])) == [0, 2]
    assert flat_view(np.array([50.0, 40.0, 1.0])) == [0, 1]
    assert flat_view(np.array([50.0, 40.0, 30.0])) is None


@pytest.mark.parametrize(
    ("job", "low", "high"),
    [
        (
            "G0 X100 Y100\nG1 X120 F900\nY115\nG0 X0",
            [98.4, 98.4, 0.0],
            [120.0, 115.0, 0.0],
        ),  # around the part
        ("G0 X9\nG1 X20 F900\nG0 X0", [0.0, 0.0, 0.0], [20.0, 0.0, 0.0]),  # rapids are no longer than that
        ("G0 X100\nG0 Y9", [0.0, 0.0, 0.0], [100.0, 9.0, 0.0]),  # no feed move
        ("M83\nG1 X100 F900\nX120 E1\nX0", [98.4, 0.0, 0.0], [120.0, 0.0, 0.0]),  # travel of a printer
    ],
)
def test_pictures_end_around_the_part_where_rapids_go_far(
    job: str, low: list[float], high: list[float]
) -> None:
    machine = load_machine("ender3" if "E1" in job else "mill")  # a printer's G0 is a move at F
    program = planner.read_program(text=job + "\n", machine=machine)
    share = np.linspace(0.001, 1.0, 1000)[:, None]
    places = [a + share * (b - a) for a, b in itertools.pairwise([np.zeros(3), *program.end])]
    found = shown_part(program, np.repeat(np.arange(len(program)), len(share)), np.vstack(places))
    assert np.allclose(found, [low, high], atol=0.2)


def test_lines_of_a_pen_as_fast_as_the_machine_are_no_rapids() -> None:
    """Without VS nothing has a speed, pen down or up."""
    program = planner.read_program(
        text="IN;SP1;PU200,0;PD1400,0;PD1400,900;PU;", machine=load_machine("plotter")
    )
    samples = samples_of(planner.plan(program, "plotter", method="stop"))
    assert not np.isfinite(samples.programmed).any()
    assert 0 < samples.rapid.sum() < len(samples.rapid)


def test_the_box_of_the_travel_has_twelve_edges_between_its_ends() -> None:
    limits = load_machine("mill").model_dump(exclude_none=True)
    ends = {"x": (-5.0, 300.0), "y": (-10.0, 200.0), "z": (-120.0, 0.0)}
    for axis, (low, high) in ends.items():
        limits["axes"][axis] |= {"travel_min": low, "travel_max": high}
    known = Machine(**limits | {"work_offsets": {"g54": {"x": 20.0, "y": 20.0, "z": -60.0}}})
    plan = planner.plan(planner.read_program(text="G21 F900\nG1 X9\n", machine=known), known, method="stop")
    box = travel_box(plan)
    assert box is not None
    np.testing.assert_array_equal([box.min(axis=0), box.max(axis=0)], np.array([*ends.values()]).T)
    edges = {frozenset(map(tuple, pair)) for pair in zip(box[:-1].tolist(), box[1:].tolist(), strict=True)}
    assert len(edges) == 12
    assert all(np.count_nonzero(np.subtract(*map(np.array, edge))) == 1 for edge in edges)
    assert travel_box(planner.plan("planner/examples/bracket.ngc", "mill", method="stop")) is None
