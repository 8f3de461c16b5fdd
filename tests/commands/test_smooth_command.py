"""`planner smooth` on the command line."""

from __future__ import annotations

import json
from math import cos, sin
from pathlib import Path

import numpy as np
import pytest
from command_line import run

from planner.machine import load_machine
from planner.nc.program import Program
from planner.nc.reader import parse_program

HEAD = "G21 G90 G17 G94 G64\nG0 X0 Y0 Z5\nF1200\nG1 Z0\n"
ZIGZAG = HEAD + "".join(f"X{k}\n" for k in range(1, 9)) + "M2\n"


def read(text: str | bytes) -> Program:
    return parse_program(text, load_machine("mill"))


def test_command(tmp_path: Path) -> None:
    job, out = tmp_path / "job.nc", tmp_path / "out.nc"
    text = (
        HEAD
        + "".join(f"X{20 * sin(a):.4f} Y{20 - 20 * cos(a):.4f}\n" for a in np.linspace(0.0, 2.0, 400)[1:])
        + "M2\n"
    )
    job.write_text(text)
    said = json.loads(run("smooth", job, "-o", out, "--json", "--tolerance", "0.02").stdout)
    assert said["allowed_mm"] == pytest.approx(0.01)
    assert 0.0 < said["within_mm"] <= said["allowed_mm"]
    assert said["lines_after"] == sum(read(out.read_bytes()).kind > 0) < said["lines_before"] == 400
    assert said["arcs"] > 0
    assert run("smooth", job, "-o", out).exit_code == 2  # it exists
    assert (
        run("smooth", job, "-o", job, "--force").exit_code == 2
    )  # a program that is read is not overwritten
    assert run("expand", job, "-o", job, "--force").exit_code == 2
    assert job.read_text() == text
    done = run("smooth", job, "-o", out, "--force", "--lines", "--share", "1")
    assert done.exit_code == 0
    assert not len(read(out.read_bytes()).arc_block)
    assert "straight moves" in done.stdout


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#1=5\nG21 F100\nG1 X#1\nX6\nX7\nM2\n", "planner expand"),
        ("G21 F100 G90\nG0 X0 Y0 Z0\nG1 X10\nY10\nM2\n", "no line can go"),
        ("G21 F100 G91\nG1 X1\nX1\nX1\nX1\nM2\n", "G91"),
        ("IN;SP1;PU0,0;PD100,0,200,0,300,0;", "plotter"),
    ],
)
def test_refusals_name_the_reason(tmp_path: Path, text: str, said: str) -> None:
    job = tmp_path / ("job.plt" if "IN;" in text else "job.nc")
    job.write_text(text)
    done = run("smooth", job, "-o", tmp_path / "out.nc")
    assert done.exit_code == 2
    assert said in done.stderr
    assert not (tmp_path / "out.nc").exists()


@pytest.mark.parametrize("share", ["0", "-1", "1.5", "nan"])
def test_shares_beyond_the_tolerance_are_refused(tmp_path: Path, share: str) -> None:
    job = tmp_path / "job.nc"
    job.write_text(ZIGZAG)
    assert run("smooth", job, "-o", tmp_path / "out.nc", "--share", share).exit_code == 2


def test_what_a_control_takes_is_told_before_the_lines(tmp_path: Path) -> None:
    """By the same predictions as `planner time` makes of both files; without a control nothing is told."""
    job, out = tmp_path / "job.nc", tmp_path / "out.nc"
    text = "".join(f"X{0.5 * k:.3f} Y{0.05 * (k % 2):.3f}\n" for k in range(1, 200))
    job.write_text("G21 G90 G17 G94 G64\nG0 X0 Y0 Z0\nF3000\nG1 X0\n" + text + "M2\n")
    for control in ("grbl", "linuxcnc"):
        done = run("smooth", job, "-o", out, "--force", "--tolerance", "0.2", "--control", control)
        assert done.exit_code == 0
        told = [
            json.loads(run("time", file, "--control", control, "--tolerance", "0.2", "--json").stdout)[
                "seconds"
            ]
            for file in (job, out)
        ]
        longer = told[1] / told[0] - 1.0
        word = "LONGER" if longer > 0.001 else "shorter" if longer < -0.001 else "the same"
        first = done.stdout.splitlines()[0]
        assert first.startswith(f"{word} on {control}: {told[1]:.4f} s instead of {told[0]:.4f} s")
    assert "on grbl" not in run("smooth", job, "-o", out, "--force", "--tolerance", "0.2").stdout
    assert run("smooth", job, "-o", out, "--force", "--control", "mach3").exit_code == 2


@pytest.mark.parametrize("line", ["G1 X1 Y1 E{k}", "G5 I1 J1 P-1 Q1 X{k} Y2"])
def test_lines_with_an_extruder_and_splines_stay_and_are_named(tmp_path: Path, line: str) -> None:
    job, out = tmp_path / "job.nc", tmp_path / "out.nc"
    lines = [line.format(k=k) for k in range(1, 4)]
    job.write_text(ZIGZAG.replace("M2\n", "\n".join([*lines, "M2", ""])))
    done = run("smooth", job, "-o", out, "--extruder", "ignore")
    assert done.exit_code == 0
    assert all(each in out.read_text().splitlines() for each in lines)
    assert ("E of an extruder" if "E" in line else "arcs and curves") in done.stdout
