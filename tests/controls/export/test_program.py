"""Exported programs: read back they are within the tolerance, slower than no F word allows, and chosen by the predicted time."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import planner
from planner.commands import export
from planner.controls.export.chords import planned_polyline, programmed_polyline
from planner.controls.export.controls import CONTROLS
from planner.controls.export.program import OWN_PATH, Candidates, write_program
from planner.geometry.distance import distance_near
from planner.machine import Machine
from planner.nc.program import Kind
from planner.planning.job.plan import Plan
from tests.commands.command_line import run

AXIS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 200000.0}
MACHINE = Machine(name="m", dt=0.001, tolerance=0.05, axes={"x": AXIS, "y": AXIS, "z": AXIS})
ZIGZAG = "G21 F6000\n" + "".join(f"G1 X{1.7 * k:.3f} Y{k % 2}\n" for k in range(1, 13))
WORDS = "G21 F3000\nT2 M6\nS900 M3\nG0 X5 Y5 Z5\nG1 Z-1\nG3 X15 Y15 J10\nG4 P0.25\nG1 X0\nM5\nG0 Z5\nM2\n"
TOLERANCE = 0.05


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planner.plan(planner.read_program(text=ZIGZAG), MACHINE, tolerance=0.9 * TOLERANCE, effort="quick")


@pytest.fixture(scope="module")
def with_words() -> Plan:
    return planner.plan(planner.read_program(text=WORDS), MACHINE, tolerance=0.9 * TOLERANCE, effort="quick")


def distances(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(n,) distance of points (n, 3) from a polyline (m, 3)."""
    a, chord = line[:-1], np.diff(line, axis=0)
    u = ((points[:, None] - a) * chord).sum(axis=2) / (chord * chord).sum(axis=1)
    return np.linalg.norm(points[:, None] - a - np.clip(u, 0, 1)[..., None] * chord, axis=2).min(axis=1)


@pytest.mark.parametrize("control", list(CONTROLS))
def test_an_exported_program_is_within_the_tolerance(plan: Plan, control: str, tmp_path: Path) -> None:
    made = write_program(tmp_path, plan, control, TOLERANCE)
    text = (tmp_path / made.file).read_text()
    read = planner.read_program(text=text.replace("M400", "M2"))
    line = np.vstack([read.start, read.end[read.kind == Kind.LINE]])
    vertices = np.vstack([plan.program.start, plan.program.end])
    assert distances(vertices, line).max() <= TOLERANCE
    parts = np.vstack([line[:-1] + share * np.diff(line, axis=0) for share in (0.0, 0.3, 0.5, 0.7, 1.0)])
    assert distances(parts, vertices).max() <= TOLERANCE
    assert read.feed[read.kind == Kind.LINE].max() <= 100.0 * (1 + 1e-9)
    used = np.nanmax(read.tolerance) if control == "linuxcnc" else 0.0
    assert distances(parts, vertices).max() + used <= TOLERANCE + 1e-9, (
        "what LinuxCNC may round besides is kept free"
    )


def test_the_fastest_prediction_is_written(plan: Plan, tmp_path: Path) -> None:
    made = write_program(tmp_path, plan, "klipper", TOLERANCE)
    best = min(made.predicted, key=made.predicted.__getitem__)
    assert made.sentence.startswith(best)
    assert best.startswith("planned path"), "Klipper slows down at every corner of the zig-zag"
    assert made.predicted[best] < 0.9 * made.predicted[OWN_PATH]
    assert len(made.predicted) == 5


def test_chords_miss_no_setpoint_by_more(plan: Plan) -> None:
    assert plan.trajectory is not None
    wide, narrow = (planned_polyline(plan, within, np.zeros(0, dtype=int)) for within in (2e-3, 5e-4))
    for line, within in ((wide, 2e-3), (narrow, 5e-4)):
        off = distances(plan.trajectory.position[::7], line.points)
        assert off.max() <= line.miss <= within
        assert (line.feed <= plan.trajectory.feed.max()).all()
        assert line.points[[0, -1]] == pytest.approx(plan.trajectory.position[[0, -1]], abs=1e-4)
    assert len(narrow.feed) > 1.5 * len(wide.feed)


def test_the_program_as_it_is_has_its_vertices_and_chords_on_its_arcs(with_words: Plan) -> None:
    line = programmed_polyline(with_words, 1e-3)
    toolpath = with_words.toolpath
    for vertex in toolpath.end:
        assert np.linalg.norm(line.points - vertex, axis=1).min() <= 1e-4
    middles = 0.5 * (line.points[1:] + line.points[:-1])
    segment = np.searchsorted(toolpath.block, line.block)
    off = distance_near(toolpath, middles, segment)
    assert 0.5e-3 < off.max() <= 1e-3 + 1e-4
    assert np.isinf(line.feed[line.rapid]).all()


@pytest.mark.parametrize(
    ("control", "said"),
    [
        ("linuxcnc", ["T2 M6", "M3 S900", "G0", "G1", "G4 P0.25", "G1", "M5", "G0", "M2"]),
        ("grbl", ["T2", "M0", "M3 S900", "G0", "G1", "G4 P0.25", "G1", "M5", "G0", "M2"]),
        ("marlin", ["M0", "M3 S900", "G0", "G1", "G4 P250", "G1", "M5", "G0", "M400"]),
    ],
)
def test_other_words_stand_where_they_stood(with_words: Plan, control: str, said: list[str]) -> None:
    job = Candidates(with_words, CONTROLS[control], TOLERANCE)
    text = job.written(job.chords(2e-3)[0])[0].decode()
    found = [re.match(r"G4 P[\d.]+|T2 M6|M3 S900|[GMT]\d+", row) for row in text.splitlines()[1:]]
    words = [one.group() for one in found if one and one.group() not in ("G21", "G17", "G90")]
    kept = [word for k, word in enumerate(words) if k == 0 or word != words[k - 1]]
    assert kept == said
    rapid = re.search(r"G0 .*?F([\d.]+)", text)
    assert (rapid is not None) == (control == "marlin"), "only where G0 moves at the F in force"
    if rapid:
        assert float(rapid.group(1)) == pytest.approx(100 * 60, rel=1e-3), "the slowest of the axes that move"


def test_a_plan_that_leaves_no_room_gives_the_program_as_it_is_and_says_so(
    plan: Plan, tmp_path: Path
) -> None:
    assert plan.verdict is not None
    assert plan.verdict.contour_error_mm is not None
    made = write_program(tmp_path, plan, "grbl", 0.045)
    assert made.sentence == "program as it is, byte for byte"
    assert (
        "leaves no room for chords: plan with --tolerance 0.0405, and export with --tolerance 0.045"
        in made.notes[0]
    )
    (tmp_path / made.file).unlink()
    lost = dataclasses.replace(plan, verdict=dataclasses.replace(plan.verdict, contour_error_mm=None))
    with pytest.raises(planner.InputError, match="leaves the program"):
        write_program(tmp_path, lost, "grbl", TOLERANCE)
    assert not list(tmp_path.iterdir())


def test_a_planned_path_that_failed_its_verdict_is_said_first(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert plan.verdict is not None
    said = SimpleNamespace(sentence="jerk.x: too much")
    failed = dataclasses.replace(plan.verdict, passed=False, faults=(said,))
    monkeypatch.setattr(export, "plan_in", lambda _: dataclasses.replace(plan, verdict=failed))
    options = "--for", "klipper", "--tolerance", str(TOLERANCE), "-o", tmp_path / "out"
    done = run("export", tmp_path, *options)
    assert done.exit_code == 1
    assert done.stdout.startswith("verdict FAILED, and these files hold that motion: jerk.x: too much")
    monkeypatch.setattr(export, "plan_in", lambda _: plan)
    assert run("export", tmp_path, *options[:-1], tmp_path / "again").exit_code == 0


def test_command(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "job.ngc").write_text(ZIGZAG)
    planner.plan(tmp_path / "job.ngc", MACHINE, tolerance=0.045, method="kinematic").save(tmp_path / "plan")
    out = tmp_path / "out"
    done = run("export", tmp_path / "plan", "--for", "grbl", "--tolerance", "0.05", "-o", out)
    assert done.exit_code == 0, done.output
    assert "predicted by a model of grbl's planner" in done.output
    assert [file.name for file in out.iterdir()] == ["grbl.gcode"]
    assert run("export", tmp_path / "plan", "--for", "grbl", "-o", out).exit_code == 2
    for more in (["--unit", "inch"], ["--within", "0.01"], ["--tolerance", "0"], ["--tolerance", "nan"]):
        assert run("export", tmp_path / "plan", "--for", "grbl", "-o", tmp_path / "x", *more).exit_code == 2
    assert (
        run(
            "export", tmp_path / "plan" / "trajectory.parquet", "--for", "grbl", "-o", tmp_path / "x"
        ).exit_code
        == 2
    )
    assert (
        run("export", tmp_path / "plan", "--for", "pvt", "--tolerance", "0.1", "-o", tmp_path / "x").exit_code
        == 2
    )
    assert not (tmp_path / "x").exists()
