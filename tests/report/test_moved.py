"""A directory that `plan -o` wrote, moved away from everything else: it is shown, judged and exported from anywhere."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import planner
from benchmarks.jobs.nurbs_chords import chord_program
from planner.geometry.nurbs import Nurbs
from planner.nc.points import points_file, read_points
from tests.commands.command_line import run

MILLED = "G21 F3000\nG1 X20 Y0\nG3 X20 Y10 J5\nG1 X0\n"
FANUC = "%\nO1000\nG21 G90 F1000\nG0 X0 Y0\nM98 P2000 L3\nG0 X0\nM30\n%\n"
CALLED = "%\nO2000\nG91 G1 X10 Y3\nG90\nM99\n%\n"
DRAWN = "IN;SP1;PU0,0;PD1000,0,1000,800;PU;"
CURVE = Nurbs(
    degree=3,
    points=np.array([[1, 2], [10, 10], [20, -5], [30, 3], [40, 0]], float),
    knots=np.array([0, 0, 0, 0, 0.5, 1, 1, 1, 1]),
    weights=np.array([1, 1, 0.7, 1, 1]),
)


def _written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def _called(folder: Path) -> Path:
    _written(folder, "O2000.nc", CALLED)
    return _written(folder, "main.nc", FANUC)


# Programs by what they are: how they are made, and what their plans carry.
PROGRAMS: dict[str, tuple[Callable[[Path], object], set[str]]] = {
    "file": (lambda folder: _written(folder, "part.TAP", MILLED), {"program.tap"}),
    "calls": (_called, {"program.nc", "O2000.nc"}),
    "drawn": (lambda folder: _written(folder, "a.plt", DRAWN), {"program.plt"}),
    "text": (lambda folder: planner.read_program(text=MILLED), {"program.ngc"}),
    "points": (lambda folder: planner.path([[0, 0], [20, 3], [25, 9]], feed=30.0), {"program.json"}),
    "curve": (lambda folder: CURVE.exact_program(40.0), {"program.json"}),
    "chords": (lambda folder: chord_program(CURVE, 0.01, 40.0), {"program.json"}),
}


@pytest.fixture
def moved(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[planner.Plan, Path]:
    """A plan, and its directory at another place; nothing else of it is left."""
    made, carried = PROGRAMS[request.param]
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir(home)
    plan = planner.plan(made(home), "router", method="kinematic")  # type: ignore[arg-type]
    names = {file.name for file in plan.save("out")}
    assert carried <= names
    away = tmp_path / "away" / "renamed"
    away.parent.mkdir()
    shutil.move(home / "out", away)
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(home)
    return plan, away


@pytest.mark.parametrize("moved", PROGRAMS, indirect=True)
def test_it_is_shown_judged_and_exported(moved: tuple[planner.Plan, Path], tmp_path: Path) -> None:
    plan, away = moved
    for words in (
        ["report", away],
        ["verify", away],
        ["verify", away / "trajectory.parquet"],
        ["export", away, "--for", "linuxcnc-stream", "-o", tmp_path / "stream"],
        ["export", away, "--for", "linuxcnc", "-o", tmp_path / "linuxcnc", "--tolerance", "0.1"],
        ["export", away, "--for", "grbl", "-o", tmp_path / "grbl", "--tolerance", "0.1"],
    ):
        done = run(*words)
        assert done.exit_code == 0, (words, done.output)
    assert Path(plan.program.source).name.strip("<>") in (away / "report.html").read_text(), (
        "it is called what it was"
    )
    for control in ("linuxcnc.ngc", "grbl.gcode"):
        file = next((tmp_path / control.partition(".")[0]).glob(control))
        again = planner.read_program(file)
        assert again.end[-1][:2] == pytest.approx(plan.program.end[-1][:2], abs=1e-3)


def test_an_exported_curve_is_no_line_to_its_end(tmp_path: Path) -> None:
    """No control is given the curve itself: chords of it stand there."""
    planner.plan(CURVE.exact_program(40.0), "mill", method="kinematic").save(tmp_path / "out")
    for control, file in (("grbl", "grbl.gcode"), ("linuxcnc", "linuxcnc.ngc"), ("marlin", "marlin.gcode")):
        done = run(
            "export", tmp_path / "out", "--for", control, "-o", tmp_path / control, "--tolerance", "0.05"
        )
        assert done.exit_code == 0, done.output
        ends = planner.read_program(tmp_path / control / file).end[:, :2]
        on = CURVE.at(np.linspace(0.0, 1.0, 5001))
        off = np.linalg.norm(ends[:, None] - on[None], axis=2)
        assert off.min(axis=1).max() < 0.06
        assert off.min(axis=0).max() < 3.0, "and they go all along it"


@pytest.mark.parametrize("moved", ["file"], indirect=True)
def test_what_is_wrong_is_said(moved: tuple[planner.Plan, Path]) -> None:
    _, away = moved
    kept = away / "program.tap"
    kept.write_text(MILLED + "G1 Y50\n")
    done = run("report", away)
    assert done.exit_code == 2
    assert "the program has 4 blocks now, and had 3" in done.output
    kept.unlink()
    for words in (["report", away], ["verify", away], ["export", away, "--for", "grbl", "-o", away / "new"]):
        done = run(*words)
        assert done.exit_code == 2
        assert "names the program program.tap, which is not there" in done.output
        assert "Traceback" not in done.output


def test_a_file_of_the_user_stays(tmp_path: Path) -> None:
    part, own = _written(tmp_path, "part.nc", MILLED), _written(tmp_path, "program.nc", "G1 X1 F100\n")
    done = run("plan", part, "-o", tmp_path, "--method", "stop")
    assert done.exit_code == 2
    assert "was not written by planner" in done.output
    assert own.read_text() == "G1 X1 F100\n"
    assert not (tmp_path / "summary.json").exists()


def test_what_an_earlier_run_carried_goes(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("plan", _called(tmp_path), "-o", out, "--method", "stop").exit_code == 0
    assert run("plan", _written(tmp_path, "b.tap", MILLED), "-o", out, "--method", "stop").exit_code == 0
    assert {file.name for file in out.iterdir()} - {"O2000.nc"} == {
        "planned.ngc",
        "program.tap",
        "summary.json",
        "trajectory.parquet",
    }


def test_a_job_is_planned_again_and_again_into_one_folder(tmp_path: Path) -> None:
    """What the run before has carried there is written anew, and vouched for again."""
    (tmp_path / "source").mkdir()
    main, out = _called(tmp_path / "source"), tmp_path / "out"
    for _ in range(3):
        assert run("plan", main, "-o", out, "--method", "stop").exit_code == 0
        said = json.loads((out / "summary.json").read_text())
        assert {"program.nc", "O2000.nc"} <= set(said["files"])


def test_called_files_beside_the_plan_stay(tmp_path: Path) -> None:
    """Into the program's own folder: what it calls is there already, and neither written nor removed."""
    main = _called(tmp_path)
    for _ in range(2):
        assert run("plan", main, "-o", tmp_path, "--method", "stop").exit_code == 0
    assert (tmp_path / "O2000.nc").read_text() == CALLED
    said = json.loads((tmp_path / "summary.json").read_text())
    assert "O2000.nc" not in said["files"]


def test_curves_read_back_exactly_and_others_are_refused() -> None:
    program = CURVE.exact_program(40.0)
    again = read_points(points_file(program), "p.json")
    np.testing.assert_array_equal(again.splines.points, program.splines.points)
    np.testing.assert_array_equal(again.splines.weights, program.splines.weights)
    np.testing.assert_array_equal(again.kind, program.kind)
    assert again.axes == program.axes == ("x", "y")
    said = json.loads(points_file(program))
    curves = said["curves"]
    off = np.array(curves["points"])
    off[0, 0, 0] += 1e-9
    gap = np.array(curves["points"])
    gap[1, 0, 1] += 1e-9
    for wrong in (
        {**curves, "block": [0, 1]},
        {**curves, "block": [-1, 0]},
        {**curves, "weights": [[1, 1, 1, 0], [1, 1, 1, 1]]},
        {**curves, "points": off.tolist()},
        {**curves, "points": gap.tolist()},
        {"block": [0]},
        [],
    ):
        with pytest.raises(planner.InputError, match="begins like a file of points, and is none"):
            planner.read_program(text=json.dumps({**said, "curves": wrong}))
