"""Nothing in a plotter file is left out silently: faults, ignored and refused instructions, and which language a file is in."""

from __future__ import annotations

import json
import math

import pytest
from drawings import FINE, Move, assert_same_path, path_of

from planner.base.errors import InputError
from planner.nc.hpgl.instructions import FORMS, IGNORED, REFUSED
from planner.nc.info import inspect_program
from planner.nc.language.detect import is_plotter_file
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

FAULTS = [
    ("IN;LBHello\x03;PD1,1", 1, 4, ["LB", "text", "outlines"]),
    ("PU1,2,3;", 1, 1, ["PU1,2,3", "3 numbers found", "PU x,y,..."]),
    ("PU1,2;AA1,2;", 1, 7, ["2 numbers found", "AA x,y,sweep"]),
    ("PU1,,2;", 1, 5, ["a number is missing before this comma"]),
    ("PU,1,2;", 1, 3, ["a number is missing"]),
    ("PU1.2.3,4", 1, 6, ["this is no number"]),
    ("PU1,--4", 1, 5, ["this is no number"]),
    ("PU1,2e9;", 1, 6, ["a letter by itself"]),
    ("PU1,2000000000;", 1, 5, ["too large", "1e+09"]),
    ("PU1,1-2000000000;", 1, 6, ["too large"]),
    ("PU1,1;#PD2,2", 1, 7, ["this character starts no instruction"]),
    ("PU1,1;12;PD2,2", 1, 7, ["a number without an instruction"]),
    ("PU1,1;AA1,1,90", 1, 7, ["no radius"]),
    ("PU1,1;AA0,0,0", 1, 7, ["a sweep of 0 degrees", "-360 to 360"]),
    ("PU1,1;AR0,1,361", 1, 7, ["a sweep of 361 degrees"]),
    ("CI0", 1, 1, ["radius 0"]),
    ("VS0;PD1,1", 1, 1, ["speed must be positive"]),
    ("SP1.5", 1, 1, ["whole number"]),
    ("SP-1", 1, 1, ["whole number"]),
    ("SC0,1,0,1;PD1,1", 1, 1, ["without IP", "paper"]),
    ("IP0,0;SC0,1,0,1;", 1, 7, ["without IP"]),
    ("SC0,1,0,1,2;", 1, 1, ["without IP"]),
    ("IP0,0,1,1;SC0,0,0,1", 1, 11, ["range of user units is empty"]),
    ("IP0,0,0,1;SC0,1,0,1", 1, 11, ["a scale of 0"]),
    ("IP0,0,1,1;SC0,1,0,1,3", 1, 11, ["type 3", "0, 1 and 2"]),
    ("IP0,0,20,10;SC0,1,0,1;CI1", 1, 23, ["ellipse", "x by 20 and y by 10"]),
    ("PD1,1;PG;PD2,2;PD3,3", 1, 7, ["PG", "one file for each page"]),
    ("RO90;PD1,1", 1, 1, ["turning"]),
    ("SM*;PD1,1", 1, 1, ["symbols"]),
    ("PE<=>;PD1,1", 1, 1, ["encoded"]),
    ("", 1, 1, ["no instruction in it"]),
    (";\n;", 1, 1, ["no instruction in it"]),
    ("PD1,1\0;PU", 1, 6, ["NUL"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "column", "parts"), FAULTS, ids=lambda v: str(v)[:30])
def test_faults(text, line, column, parts):
    with pytest.raises(InputError) as caught:
        parse_program(text, source="job.plt")
    assert (caught.value.source, caught.value.line, caught.value.column) == ("job.plt", line, column)
    for part in parts:
        assert part in caught.value.message


def test_all_faults_are_found_in_their_order(tmp_path):
    path = tmp_path / "job.plt"
    path.write_text("IN;PD1,1;\nXX;PD2,2;RO90;\n!PG;PD3,3;VS0;")
    found = inspect_program(path, reading=Reading(strict=True))
    assert [(fault.line, fault.column, fault.word) for fault in found.unsupported] == [
        (2, 1, "XX"), (2, 10, "RO90"), (3, 1, "!"), (3, 2, "PG"), (3, 11, "VS0"),
    ]  # fmt: skip
    assert found.blocks["line"] == 3


def test_instructions_that_nobody_knows_are_left_out_and_counted():
    text = "IN;PD40,0;ZZ1;\nRT90;XX1,2;PD80,0;"
    program = parse_program(text, source="x.plt")
    plain = parse_program("IN;PD40,0;\nPD80,0;", source="x.plt")
    assert_same_path(path_of(program), path_of(plain), FINE)
    (said,) = [note for note in program.notes if "does not know" in note]
    assert said == (
        "3 instructions that this reader does not know: left out, as plotters do; first ZZ line 1"
    )
    with pytest.raises(
        InputError, match="x.plt:1:11: ZZ1: there is no such instruction; allowed are " + " ".join(FORMS)
    ):
        parse_program(text, reading=Reading(strict=True), source="x.plt")


@pytest.mark.parametrize("name", sorted(IGNORED))
def test_ignored_instructions_are_noted(name):
    end = "text;\x03" if name in ("WD", "BL", "MG") else ";"
    program = parse_program(f"IN;PD40,0;{name}{end}\nPD80,0;{name}{end}PD80,40", source="x.plt")
    assert (program.kind == Kind.LINE).sum() == 3
    assert any(note.startswith(f"{name} ignored") and IGNORED[name] in note for note in program.notes)


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_refused_instructions_say_what_to_do(name):
    with pytest.raises(InputError) as caught:
        parse_program(f"IN;{name}1;", source="x.plt")
    assert REFUSED[name] in caught.value.message


def test_what_is_left_out_is_noted():
    text = "\x1b.(;\x1b.I81;;17:\x1b%-12345X@PJL ENTER LANGUAGE=HPGL2\n\x1b%0BIN;SP1;PD40,40;SM;\x1b%0A$\x1a"
    program = parse_program(text)
    assert_same_path(path_of(program), [Move(True, (1.0, 1.0), math.inf)], FINE)
    assert "device control (ESC sequences, @PJL lines) is left out" in program.notes
    assert "the file ends with '$\\x1a', which is no instruction; left out" in program.notes
    assert any(note.startswith("SM ignored") for note in program.notes)
    assert "1 plotter unit = 0.025 mm" in program.notes[1]
    assert program.assumptions == (
        "line 2: no speed (VS) before it; the pen runs as fast as the machine allows",
    )


# --- which language -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text", "hpgl"),
    [
        ("a.plt", "IN;PD1,1;", True),
        ("a.ngc", "IN;SP1;PD1,1;", True),  # by content
        ("a", "\x1b.(;INSP1", True),
        ("a.PLT", ";PU1,1;PD2,2", True),  # by name
        ("a.ngc", ";PU1,1;PD2,2", False),  # a comment
        ("a.plt", "%\n(made by hand)\nG21 G1 X1 F100", False),
        ("a.hpgl", "N10 G0 X1", False),
        ("a.plt", "", True),
        ("a.MPF", "PROC MAIN\nG0 X1", False),
        ("a.nc", "G21\nG1 X1", False),
        ("a.nc", "S1000 M3", False),
    ],
)
def test_the_language_of_a_file(name, text, hpgl):
    assert is_plotter_file(text.encode(), name) is hpgl


def test_info_of_a_plotter_file(tmp_path):
    from typer.testing import CliRunner

    from planner.cli import app

    path = tmp_path / "job.plt"
    path.write_text("IN;SP1;PU0,0;PD400,0;CI200;")
    result = CliRunner().invoke(app, ["info", str(path), "-m", "plotter"])
    assert result.exit_code == 0, result.output
    assert "as fast as the machine allows" in result.stdout
    assert "every construct is supported" not in result.stdout
    path.with_name("slow.plt").write_text("IN;VS10;SP1;PU0,0;PD400,0;CI200;")
    slow = CliRunner().invoke(app, ["info", str(path.with_name("slow.plt")), "-m", "plotter"])
    assert "every construct is supported" in slow.stdout
    said = json.loads(CliRunner().invoke(app, ["info", str(path), "--json"]).stdout)
    assert said["blocks"] == {"rapid": 3, "line": 1, "arc": 1, "dwell": 0, "stop": 6}
    assert said["feed"] == [None, None]
