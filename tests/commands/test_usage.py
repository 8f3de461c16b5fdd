"""Wrong turns on the command line, and what they are answered with."""

from __future__ import annotations

from pathlib import Path

import pytest

import planner
from tests.commands.command_line import run

JOB = "G21 F3000\nG1 X10\nY5\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["part.nc"], "'part.nc' is no command. To plan a program:"),
        (["pln"], "No such command 'pln'. Did you mean 'plan'?"),
        (["machine", "sho"], "No such command 'sho'. Did you mean 'show'?"),
        (["plan", "part.nc", "--tolerence", "0.02"], "no option --tolerence; did you mean --tolerance?"),
        (["sweep", "part.nc", "--set", "y.jerk=4"], "no option --set; did you mean --vary NAME=RANGE?"),
        (["plan", "part.nc", "--threads", "x"], "Invalid value for '--threads': give a whole number"),
        (["plan", "part.nc", "--threads", "0"], "Invalid value for '--threads': must be 1 or more"),
        (["export", "out", "--for", "fanuc", "-o", "x"], "'fanuc' is not one of"),
        (["verify", "part.nc", "t.csv"], "the trajectory comes first: planner verify t.csv part.nc"),
        (["verify", "nowhere", "part.nc"], "nowhere: trajectory file not found"),
        (["export", "nowhere", "--for", "pvt", "-o", "x"], "nowhere: trajectory file not found"),
        (["pulses", "nowhere"], "Missing option '--steps'. "),
        (["sweep", "part.nc", "-o", "x"], "Missing option '--vary'. "),
        (
            ["machine", "import", "x.ini", "-o", "x", "--ramp-time", "20 min"],
            "'20 min' is no time above 0; write one in s, or",
        ),
        (["plan", "part.nc", "--tolerance", "0,05"], "decimals have a point"),
        (["plan", "part.nc", "--control", "grbl"], "no option --control"),
        (["report", "nowhere"], "nowhere: no such directory; give the directory that 'plan -o' wrote"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_wrong_turn_is_answered_with_the_right_one(words: list[str], said: str) -> None:
    done = run(*words)
    assert done.exit_code == 2
    assert said in done.output
    assert "Value error" not in done.output
    assert "Input should" not in done.output


@pytest.mark.parametrize("given", ["0", "-1", "nan", "inf", "20xm", "1e", "mm", ""])
def test_a_tolerance_that_is_none_is_refused_before_any_work(given: str) -> None:
    done = run("plan", "nowhere.nc", "--tolerance", given)
    assert done.exit_code == 2
    assert (
        f"'{given}' is no length above 0; write one in mm, or with a unit: mm, um, µm, in, inch"
        in done.output
    )


@pytest.mark.parametrize("given", ["0.04", "40um", "40 µm", "4e-2mm", "0.0015748031496062992in"])
def test_a_tolerance_may_have_a_unit(given: str, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(JOB)
    done = run("plan", tmp_path / "part.nc", "--tolerance", given, "--method", "stop", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    read = planner.report.trajectory_file.read_trajectory(tmp_path / "out" / "trajectory.parquet")
    assert read.metadata["tolerance_mm"] == pytest.approx(0.04)


def test_commands_of_trajectories_take_the_directory_of_a_plan(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(JOB)
    out = tmp_path / "out"
    assert run("plan", tmp_path / "part.nc", "--method", "stop", "-o", out).exit_code == 0
    assert "passed" in run("verify", out, tmp_path / "part.nc").output
    assert run("pulses", out, "--steps", "x=100,y=100").exit_code == 0
    alone = run("verify", out)
    assert alone.exit_code == 0, alone.output
    (tmp_path / "part.nc").unlink()
    assert run("verify", out).exit_code == 0, "the directory has its program"
    (out / "program.nc").unlink()
    lost = run("verify", out)
    assert lost.exit_code == 2
    assert "which is not there: planner verify" in lost.output
    (tmp_path / "empty").mkdir()
    done = run("verify", tmp_path / "empty", out / "planned.ngc")
    assert done.exit_code == 2
    assert "no trajectory in this directory" in done.output


def test_every_command_has_a_line_that_fits() -> None:
    lines = run("--help").output.partition("Commands:")[2].strip().splitlines()
    assert len(lines) == 13
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)


def test_files_that_are_not_what_the_option_asks_for_are_recognised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Settings of a control and machine files as programs, settings as a machine, a machine file with a misspelt name."""
    monkeypatch.chdir(tmp_path)
    Path("part.nc").write_text(JOB)
    Path("grbl.txt").write_text("Grbl 1.1\n$110=5000\n$120=500\n")
    Path("lathe.toml").write_text('name = "lathe"\n[axes.x]\nvelocity = 1.0\n')
    for words, said in (
        (
            ["lathe.toml"],
            "this is a machine file, not a program; give the program, and the machine file as -m FILE",
        ),
        (
            ["grbl.txt"],
            "this is a file of a control's settings, not a program; make a machine file of it (planner machine import)",
        ),
        (
            ["part.nc", "-m", "grbl.txt"],
            "give them in mm and s: planner machine import, --set y.velocity=500",
        ),
        (["part.nc", "-m", "lathe.tml"], "did you mean 'lathe.toml'?"),
    ):
        done = run("plan", *words)
        assert done.exit_code == 2
        assert said in done.output.replace("\n", " ")


def test_a_program_in_the_place_of_another_file_is_named(tmp_path: Path) -> None:
    job = tmp_path / "part.nc"
    job.write_text(JOB)
    for words, said in (
        (("time", job, "-m", job), "an NC program, where a machine file is needed"),
        (("verify", job), "unknown format '.nc' of a trajectory; there are parquet"),
        (("machine", "fit", job), "give a trace, or of a program its seconds: x.nc=61.2"),
    ):
        done = run(*words)
        assert done.exit_code == 2
        assert said in done.output


def test_a_tolerance_larger_than_the_part_is_told_by_studies_too(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(JOB)
    said = "the part's largest extent"
    asked = ("what-if", tmp_path / "part.nc", "--method", "stop", "--set", "tolerance=300")
    assert "note: tolerance=300" in run(*asked).output
    assert said in run(*asked).output
    done = run("compare", tmp_path / "part.nc", "--method", "stop", "--tolerance", "300")
    assert said in done.output
