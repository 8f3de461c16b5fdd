"""What those who begin get wrong, and what they are told."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import planner
from planner.base.errors import InputError
from planner.cli import app

GOOD = "G21 G90 F600\nG1 X10\nG1 Y5\nM2\n"


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (GOOD, ["-m", "haas"], "make one with: planner machine init FILE, or from a control's settings"),
        (
            "G21 G90 F600\nG1 X10\nG1 X1000000000\n",
            [],
            "job.nc:3: X = 1e+09 mm; coordinates up to 1e+07 mm are allowed",
        ),
        (
            GOOD,
            ["--dialect", "heidenhain"],
            "job.nc:1:1: G21: G21 of the conversational language is not read",
        ),
        (GOOD, ["--dialect", "heidenhain"], "a program in G codes is read without --dialect heidenhain"),
        (
            "G21 G90 F600\nG1 A90\n",
            [],
            "the program has no move (1 A word: axis A is assumed to stand still at 90",
        ),
        (GOOD, ["--limit", "x"], "no option --limit\n"),
    ],
)
def test_what_helps_is_said(tmp_path: Path, text: str, options: list[str], said: str) -> None:
    job = tmp_path / "job.nc"
    job.write_text(text)
    done = CliRunner().invoke(app, ["plan", str(job), *options])
    assert done.exit_code == 2
    assert said in done.output


def test_files_and_folders(tmp_path: Path) -> None:
    machine, job = tmp_path / "m.toml", tmp_path / "job.nc"
    machine.write_text('name = "m"\ndt = 0,001\n')
    job.write_text(GOOD)
    done = CliRunner().invoke(app, ["plan", str(job), "-m", str(machine)])
    assert "decimals have a point: 0.001" in done.output
    done = CliRunner().invoke(
        app, ["export", str(tmp_path / "out"), "--for", "klipper", "-o", str(tmp_path / "e")]
    )
    assert "out: no such directory; give the directory that 'plan -o' wrote" in done.output
    done = CliRunner().invoke(app, ["plan", str(job), "--method", "stop", "--tolerance", "0.01inch"])
    assert "of 0.254 mm" in done.output
    (tmp_path / "motion.parquet").write_bytes(b"PAR1\0\0")
    done = CliRunner().invoke(app, ["machine", "fit", str(tmp_path / "motion.parquet")])
    assert "motion.parquet: a binary file; a trace is CSV" in done.output


def test_six_columns_need_the_names_of_their_axes() -> None:
    with pytest.raises(InputError, match="axes='xyzabc' for more columns"):
        planner.path([[0.0] * 6, [1.0] * 6])
