"""Words that a control is not given: curves that cannot be written as lines, and codes that it does not have."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import planner
from benchmarks.controls.export_judge import OFFSETS, STARTS, alike, path, readable
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.controls.export.controls import CONTROLS, is_setting
from planner.controls.export.program import Candidates

CURVE = "G21 G90\nG0 Z1\nG5.2 P1 X4 Y2 L3 F600\nP1 X6 Y3\nP1 X8 Y1\nG5.3\nM2\n"


def passed(text: str) -> FloatArray:
    """(n, 3) the places of a program [mm]."""
    return path(text, planner.load_machine("mill"), STARTS[0], OFFSETS[0])


def test_a_curve_that_no_straight_moves_can_say_is_refused_with_its_line() -> None:
    """The program does not place X and Y before it."""
    made = planner.plan(planner.read_program(text=CURVE, machine="mill"), "mill", method="stop")
    job = Candidates(made, CONTROLS["grbl"], 0.05)
    (one,) = job.own(1e-3)
    with pytest.raises(InputError, match=r"G5\.2 \(it cannot be written as straight moves") as fault:
        job.written(one)
    assert fault.value.line == 3


@pytest.mark.parametrize("control", ["grbl", "klipper"])
def test_a_curve_whose_first_line_has_no_coordinates_is_written(control: str) -> None:
    """The control points stand in the lines behind it: the whole curve was left out."""
    text = "G21 G90\nG0 X0 Y0 Z1\nG1 X3 Y2 F600\nG5.2 P1 L3\nX4 Y5\nX8 Y1\nG5.3\nG1 X12\nM2\n"
    made = planner.plan(planner.read_program(text=text, machine="mill"), "mill", method="stop")
    job = Candidates(made, CONTROLS[control], 0.05)
    for one in (*job.own(1e-3), *job.chords(1e-3)):
        out = readable(job.written(one)[0].decode())
        assert alike(passed(text), passed(out), 0.05)
    unplaced = text.replace("G0 X0 Y0 Z1\n", "G0 Z1\n").replace("G1 X3 Y2", "G1 X3")
    made = planner.plan(planner.read_program(text=unplaced, machine="mill"), "mill", method="stop")
    job = Candidates(made, CONTROLS[control], 0.05)
    (one,) = job.own(1e-3)
    with pytest.raises(InputError, match=r"G5\.2 \(it cannot be written as straight moves"):
        job.written(one)


@pytest.mark.parametrize("control", ["klipper", "marlin", "grbl", "linuxcnc"])
def test_g0_of_a_printer_keeps_its_f(control: str) -> None:
    """It was written at the limits of the axes, F30000 for F1200; on a mill's control it would be a rapid."""
    text = "G21\nG90\nG0 X10 Y10 Z2 F1200\nG1 X30 F600\nG0 F900\nX40 Y12\nG1 Y40\n"
    made = planner.plan(planner.read_program(text=text, machine="ender3"), "ender3", method="stop")
    job = Candidates(made, CONTROLS[control], 0.06)
    why = {"grbl": "line 3: G0, which printers run at F", "linuxcnc": "LinuxCNC reads it otherwise"}
    assert why.get(control, "line 6") in job.why_not
    for one in (*job.own(1e-3), *job.chords(1e-3)):
        lines = job.written(one)[0].decode().splitlines()
        assert not any("G0" in line.split() for line in lines)
        feeds = [float(found) for line in lines for found in re.findall(r" F([\d.]+)", line)]
        assert max(feeds) == 1200.0


@pytest.mark.parametrize(("code", "known"), [(1090, True), (1091, False), (990, False), (991, False)])
def test_a_setting_is_a_whole_code_that_the_control_has(code: int, known: bool) -> None:
    """M109 is one of a printer, M109.1 and M99 are not; codes are in tenths."""
    words = [SimpleNamespace(letter="M", code=code), SimpleNamespace(letter="S", code=0)]
    assert is_setting(words, CONTROLS["klipper"]) == known


def test_grbl_has_the_codes_of_its_page() -> None:
    """Those that grbl 1.1 lists as supported, but for probing (doc/markdown/commands.md and README of gnea/grbl)."""
    page = "0 1 2 3 4 10 17 18 19 20 21 28 28.1 30 30.1 40 43.1 49 53 54 55 56 57 58 59 61 80 90 91 91.1 92 92.1 93 94"
    assert CONTROLS["grbl"].g == {round(10 * float(code)) for code in page.split()}


def test_a_sinumerik_program_is_exported_whatever_its_file_is_called(tmp_path: Path) -> None:
    """The text that it is written out as was read by the ending of the file, as a Sinumerik's, and refused."""
    job = tmp_path / "JOB.MPF"
    job.write_text(
        "N10 G71 G90 G17\nN20 R1=10\nN30 G0 X0 Y0 Z5\nN40 G1 X=R1 F500\nN50 G2 X20 Y0 CR=6\nN60 M30\n"
    )
    made = planner.plan(planner.read_program(job, machine="mill"), "mill", method="stop")
    written = Candidates(made, CONTROLS["grbl"], 0.05)
    (one,) = written.own(1e-3)
    lines = written.written(one)[0].decode().splitlines()
    start = lines.index("G0 X0 Y0 Z5")
    assert [line.split()[0] for line in lines[start:]] == ["G0", "G1", "G2", "M30"]
