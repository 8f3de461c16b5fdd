"""Plans of programs that no file has: saved with their program, they are read, shown, exported and judged again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.nc.points import own_text, points_file, read_points
from planner.report.html.saved import saved_plan
from tests.commands.command_line import run

TEXT = "G21 F3000\nG1 X20 Y0\nG3 X20 Y10 J5\nG1 X0\n"


def points_plan(method: str = "kinematic") -> planner.Plan:
    angle = np.linspace(0.3, 5.0, 40)
    points = np.stack([20 * np.cos(angle), 10 * np.sin(2 * angle)], axis=1)
    return planner.plan(
        planner.path(points, feed=np.linspace(40, 60, 39), tolerance=0.03), "router", method=method
    )


def test_a_plan_of_a_text_is_saved_with_it(tmp_path: Path) -> None:
    plan = planner.plan(planner.read_program(text=TEXT), "mill", method="kinematic")
    names = sorted(file.name for file in plan.save(tmp_path / "out"))
    assert "program.ngc" in names
    assert (tmp_path / "out" / "program.ngc").read_text() == TEXT
    again, _ = saved_plan(tmp_path / "out")
    assert own_text(again.program) == TEXT.encode()
    np.testing.assert_array_equal(again.program.end, plan.program.end)


def test_a_plan_of_points_is_saved_with_them(tmp_path: Path) -> None:
    plan = points_plan()
    plan.save(tmp_path / "out")
    again, _ = saved_plan(tmp_path / "out")
    assert own_text(again.program) is None
    for name in ("start", "end", "feed", "tolerance", "kind"):
        np.testing.assert_array_equal(getattr(again.program, name), getattr(plan.program, name))
    assert again.verdict is not None
    assert plan.verdict is not None
    assert again.verdict.passed == plan.verdict.passed


@pytest.mark.parametrize("kind", ["text", "points"])
def test_commands_take_the_directory(kind: str, tmp_path: Path) -> None:
    plan = (
        points_plan()
        if kind == "points"
        else planner.plan(planner.read_program(text=TEXT), "mill", method="stop")
    )
    out = tmp_path / "out"
    plan.save(out)
    kept = out / ("program.json" if kind == "points" else "program.ngc")
    for words in (
        ["report", out],
        ["verify", out, kept],
        ["verify", out],
        ["info", kept],
        ["export", out, "--for", "klipper", "-o", tmp_path / "klipper", "--tolerance", "0.05"],
        ["export", out, "--for", "linuxcnc", "-o", tmp_path / "linuxcnc"],
        ["plan", kept, "-o", out, "--method", "stop"],
    ):
        done = run(*words)
        assert done.exit_code == 0, (words, done.output)
    assert kept.exists(), "the program that was planned stays, although this run read it from a file"
    again = planner.read_program(tmp_path / "linuxcnc" / "linuxcnc.ngc")
    assert again.end[-1] == pytest.approx(plan.program.end[-1], abs=1e-3)
    first = plan.program.start if kind == "points" else plan.program.end[0]
    assert again.end[0] == pytest.approx(first, abs=1e-3), (
        "points may begin anywhere: a rapid move leads there"
    )


def test_points_read_back_exactly_and_others_are_refused() -> None:
    program = points_plan("stop").program
    again = read_points(points_file(program), "p.json")
    np.testing.assert_array_equal(again.end, program.end)
    np.testing.assert_array_equal(again.feed, program.feed)
    rapid = planner.path([[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(read_points(points_file(rapid), "p.json").kind, rapid.kind)
    said = json.loads(points_file(program))
    for wrong in (
        {"points": said["points"][:1]},
        {"feed": [-1.0] * 39},
        {"feed": [1.0]},
        {"tolerance": 0},
        {"axes": "xy"},
        {"format": "other"},
        {"points": "none"},
    ):
        with pytest.raises(planner.InputError, match="begins like a file of points, and is none"):
            planner.read_program(text=json.dumps({**said, **wrong}))
    for text in ("{", "{}", "{[", '{"a": 1}'):
        with pytest.raises(planner.InputError, match="begins like a file of points"):
            planner.read_program(text=text)
