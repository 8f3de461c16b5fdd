"""The published cases: paths as printed, limits as printed, and a row for each."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import published
from benchmarks.record import RESULTS
from benchmarks.runner.rows import PASSED, read
from benchmarks.runner.suites import SUITES
from planner.geometry.build import toolpath_from_program
from planner.machine.kinematics.chain import kinematics_of

CASES = {case.name: case for case in published.CASES}
ROWS = read(RESULTS / "published.jsonl").rows


@pytest.mark.parametrize("name", [name for name in CASES if name != "five-axis pocket"])
def test_the_path_is_as_long_as_printed(name: str) -> None:
    case = CASES[name]
    toolpath = toolpath_from_program(case.program(), case.machine())
    assert toolpath.length.sum() == pytest.approx(case.length, abs=6e-4)


def test_the_pocket_and_its_machine_are_as_printed() -> None:
    """Length of the tip's curve; the joints by Ma et al.'s eq. 2, with A and C by their eq. 1 up to half turns of C."""
    bottom, top = published.pocket()
    tips = bottom.at(np.linspace(0.0, 1.0, 20_001))
    length = np.linalg.norm(np.diff(tips, axis=0), axis=1).sum()
    assert length == pytest.approx(CASES["five-axis pocket"].length, abs=6e-4)
    program = published.pocket_program()
    at = np.linspace(0.0, 1.0, published.POCKET_POINTS)[1:]
    direction = top.at(at) - bottom.at(at)
    i, j, k = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).T
    x, y, z = program.end[:, :3].T
    a, c = (program.end[:, program.axes.index(letter)] for letter in "ac")
    A, C = np.arctan2(np.hypot(i, j), k), np.arctan2(i, j)
    assert np.abs(a) == pytest.approx(A, abs=1e-9)
    across = np.sin(C) * x + np.cos(C) * y
    joints = kinematics_of(published.ma()).joints({"x": x, "y": y, "z": z, "a": a, "c": c})
    printed = {
        "x": np.cos(C) * x - np.sin(C) * y,
        "y": np.cos(A) * across - np.sin(A) * z,
        "z": np.sin(A) * across + np.cos(A) * z,
    }
    for letter, value in printed.items():
        np.testing.assert_allclose(np.abs(joints[letter]), np.abs(value), atol=1e-9)
    np.testing.assert_allclose(program.end[:, :3], bottom.at(at), atol=1e-12)


def test_a_segment_of_the_figure_8_is_as_long_as_its_paper_prints() -> None:
    """Its table has 243.73 mm from u = 0.036 to 0.400, both rounded to a thousandth."""
    u = np.linspace(0.036, 0.400, 20_001)
    length = np.linalg.norm(np.diff(published.figure_8().at(u), axis=0), axis=1).sum()
    assert length == pytest.approx(243.73, rel=2e-3)


def test_the_sinusoid_is_its_formula() -> None:
    curve = published.sinusoid()
    at = curve.at(np.linspace(*curve.knots[[0, -1]], 10_007))
    assert np.abs(at[:, 1] - 50.0 * (1.0 - np.cos(0.02 * np.pi * at[:, 0]))).max() < 1e-6


def test_the_tube_problem_has_20_segments_and_three_half_arcs() -> None:
    program = published.tube()
    cutting = program.kind[np.isfinite(program.feed)]
    assert len(cutting) == 20
    assert np.abs(program.arc_sweep) == pytest.approx([np.pi] * 3)


def test_jerks_along_and_normal_to_the_path_enclose_those_of_the_axes() -> None:
    """A jerk of j in both directions is a square of half side j, whatever its turn: axes of j/sqrt(2) stay inside it, of j sqrt(2)
    enclose it."""
    turn = np.linspace(0.0, np.pi / 2, 91)
    corner = np.abs(np.cos(turn)) + np.abs(
        np.sin(turn)
    )  # of a unit square along the axes, seen in a turned frame
    inner, outer = (published.nie(inside).axes["x"].jerk for inside in (True, False))
    assert (inner * corner <= 1e5 * (1 + 1e-12)).all()
    assert (1e5 * corner <= outer * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", CASES)
def test_there_is_a_row_for_the_way_that_is_like_for_like(name: str) -> None:
    case = CASES[name]
    row = ROWS["published", name, case.way]
    assert case.way in SUITES["published"].ways
    assert row.verdict == PASSED
    assert row.bound_s is None or row.bound_s <= row.cycle_s * (1 + 1e-9)


def test_the_report_has_every_case_and_what_is_left_out() -> None:
    text = (RESULTS / "suite-published.md").read_text(encoding="utf-8")
    for told in (*CASES, *published.LEFT_OUT):
        assert told in text
