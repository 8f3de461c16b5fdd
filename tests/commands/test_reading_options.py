"""The settings of the reader on the command line, in the files of a plan, and when those are judged again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import run

import planner
from planner.base.errors import InputError
from planner.nc.reading import AS_USUAL, Reading

PRINTED = "M82\nM104 S200\nG21 G92 E0\nG1 X2 E0.1 F600\nX2 Y2 E0.2\nM428\n"
SETTINGS = ["--extruder", "ignore", "--ignore", "m428", "--arc-centres", "incremental"]


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.gcode"
    path.write_text(PRINTED)
    return path


def test_the_settings_go_from_the_plan_to_its_files_and_back(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["--method", "stop", "--format", "npz", "-q"]
    planned = run("plan", part, *SETTINGS, *arguments, "-o", out)
    assert planned.exit_code == 0, planned.output
    assert "3 E words: left out" in planned.stdout
    assert "2 codes of a 3-D printer" in planned.stdout
    summary = json.loads((out / "summary.json").read_text())
    reading = Reading(extruder="ignore", ignore=("M428",), arc_centres="incremental")
    assert Reading.saved(summary["reading"]) == reading
    assert any("M428 line 6" in note and "--ignore" in note for note in summary["notes"])
    assert b"E0.1" in (out / "planned.ngc").read_bytes()
    # judged as it was planned; with settings of one's own by those
    judged = run("verify", out / "trajectory.npz", part, "-q")
    assert judged.exit_code == 0, judged.output
    assert (
        "program read with ignore ['M428'], arc_centres incremental, extruder ignore (taken)" in judged.stderr
    )
    refused = run("verify", out / "trajectory.npz", part, "-q", "--extruder", "refuse")
    assert refused.exit_code == 2
    assert "E words" in refused.stderr or "extruder" in refused.stderr


def test_without_settings_and_with_strict(part: Path) -> None:
    for command in ("plan", "info", "compare"):
        refused = run(command, part, "--extruder", "refuse")
        assert refused.exit_code == 2
        assert "--extruder ignore" in " ".join(refused.output.split())
    assert run("info", part, *SETTINGS).exit_code == 0
    strict = run("info", part, "--extruder", "ignore", "--strict")
    assert strict.exit_code == 2
    for word in ("M82", "M104", "M428"):
        assert word in strict.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--arc-centres", "maybe"], "auto, absolute, incremental"),
        (["--extruder", "no"], "auto, refuse, ignore"),
        (["--ignore", "G1"], "G1 cannot be left out"),
        (["--ignore", "hello!"], "nothing that can be ignored"),
    ],
)
def test_wrong_settings_are_named(part: Path, arguments: list[str], said: str) -> None:
    result = run("info", part, *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_a_program_that_was_read_takes_no_settings(part: Path) -> None:
    reading = Reading(extruder="ignore")
    program = planner.read_program(part, reading=reading)
    assert program.reading == reading
    for call in (planner.plan, planner.compare):
        with pytest.raises(InputError, match="read already"):
            call(program, reading=reading)


def test_saved_settings_of_any_kind_are_taken_or_left_out() -> None:
    for reading in (
        AS_USUAL,
        Reading(strict=True, block_delete=False),
        Reading(ignore=("A", "M6"), extruder="ignore"),
    ):
        assert Reading.saved(json.loads(json.dumps(reading.changed()))) == reading
    for wrong in (None, [], 5, {"ignore": [5]}, {"strict": "yes"}, {"extruder": "keep"}, {"unknown": 1}):
        assert Reading.saved(wrong) == AS_USUAL
