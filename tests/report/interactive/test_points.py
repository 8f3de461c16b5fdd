"""Programs of points are those that NC text would give; any motion can be judged from arrays."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.nc.program import Kind
from planner.planning.job.plan import Plan

SQUARE = [[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]]


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planner.plan(planner.path(SQUARE, feed=50.0), "mill", method="kinematic")


@pytest.mark.shows("python", "exact: points are the program that the same text gives")
def test_points_are_the_program_that_the_same_text_gives(plan: Plan) -> None:
    text = "G21 G90 F3000\nG1 X20 Y0\nX20 Y20\nX0 Y20\nX0 Y0\n"
    read = planner.read_program(text=text)
    made = planner.path(SQUARE, feed=50.0)
    for name in ("start", "kind", "end", "feed", "dwell", "path_control", "tolerance"):
        np.testing.assert_array_equal(getattr(made, name), getattr(read, name))
    assert planner.plan(read, "mill", method="kinematic").cycle_time == plan.cycle_time


def test_points_without_a_feed_are_rapid_moves_and_faster(plan: Plan) -> None:
    rapid = planner.path(SQUARE)
    assert (rapid.kind == Kind.RAPID).all()
    faster = planner.plan(rapid, "mill", method="kinematic")
    assert faster.verdict is not None
    assert faster.verdict.passed
    assert faster.cycle_time < plan.cycle_time


def test_points_in_space_their_feeds_and_tolerance() -> None:
    made = planner.path(np.eye(3), feed=[1.0, 2.0], tolerance=0.3)
    assert made.end[-1].tolist() == [0.0, 0.0, 1.0]
    assert made.feed.tolist() == [1.0, 2.0]
    assert made.tolerance.tolist() == [0.3, 0.3]
    assert made.line.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("points", "settings", "said"),
    [
        ([[0, 0]], {}, r"shape \(1, 2\)"),
        ([[0, 0, 0, 0]] * 2, {}, r"\(n, 2\) or \(n, 3\)"),
        ([[0, 0], [1]], {}, "not an array of numbers"),
        (["here", "there"], {}, "not an array of numbers"),
        ([[0, 0], [1, np.nan]], {}, "row 2: .*finite"),
        ([[0, 0], [1, 1]], {"feed": 0.0}, "move 1: 0.0; every feed"),
        ([[0, 0], [1, 1]], {"feed": [1.0, 2.0]}, "one for each of the 1 moves"),
        ([[0, 0], [1, 1]], {"feed": "fast"}, "feed: not a number"),
        ([[0, 0], [1, 1]], {"tolerance": -1.0}, "tolerance -1.0 mm"),
        ([[0, 0], [1, 1]], {"tolerance": 1e-300}, "tolerance 1e-300 mm; it must be 1e-05 or more"),
    ],
)
def test_other_points_are_refused(points: object, settings: dict, said: str) -> None:
    with pytest.raises(planner.InputError, match=said):
        planner.path(points, **settings)  # type: ignore[arg-type]


def test_the_judge_finds_a_motion_from_arrays_as_good_as_it_is(plan: Plan) -> None:
    motion = plan.trajectory
    assert motion is not None
    assert planner.verify(motion.t, motion.position, plan.program, "mill").passed
    flat = planner.verify(motion.t, motion.position[:, :2], plan.program, "mill")
    assert flat.passed, "an axis that the program does not move may be missing"
    faster = planner.verify(0.5 * motion.t, motion.position, plan.program, "mill")
    assert faster.limits["feed"].ratio == pytest.approx(2.0 * plan.verdict.limits["feed"].ratio, rel=1e-3)  # type: ignore[union-attr]
    assert not faster.passed
    aside = motion.position + np.array([0.0, 0.05, 0.0])
    assert planner.verify(motion.t, aside, plan.program, "mill").contour.broken
    assert not planner.verify(motion.t, aside, plan.program, "mill", tolerance=0.2).contour.broken
    swapped = planner.verify(motion.t, motion.position[:, [1, 0]], plan.program, "mill", axes="yx")
    assert swapped.passed


@pytest.mark.parametrize(
    ("t", "q", "settings", "said"),
    [
        (np.arange(3.0), np.zeros((4, 2)), {}, r"\(3,\) and q \(4, 2\)"),
        (np.arange(3.0), np.zeros(3), {}, r"q \(3,\)"),
        (np.arange(3.0), np.zeros((3, 2)), {"axes": "xq"}, "no column|axis|axes|missing"),
        (np.zeros(3), np.zeros((3, 2)), {}, "times must increase"),
        (np.arange(3.0), np.zeros((3, 2)), {"not_limited": ("snap",)}, "no such limit 'snap'"),
    ],
)
def test_arrays_that_are_no_motion_are_refused(t: object, q: object, settings: dict, said: str) -> None:
    with pytest.raises(planner.InputError, match=said):
        planner.verify(t, q, planner.path(SQUARE, feed=50.0), "mill", **settings)  # type: ignore[arg-type]


def test_a_text_is_a_program_with_its_planned_feeds() -> None:
    made = planner.plan(planner.read_program(text="G21 F30000\nG1 X10\nY5\n"), "mill", method="stop")
    assert made.program.text == b"G21 F30000\nG1 X10\nY5\n"
    with pytest.raises(planner.InputError, match="give a program file, or its text"):
        planner.read_program()
    with pytest.raises(planner.InputError, match="<text>:1:"):
        planner.read_program(text="G1 X1O")
