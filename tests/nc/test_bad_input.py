"""Every refusal: line, column, the word found and what to do. Lines before the faulty one are valid."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import pytest

from planner.base.errors import InputError
from planner.machine import load_machine
from planner.nc import codes
from planner.nc.faults import require_none
from planner.nc.info import inspect_program
from planner.nc.lexer import LINE_MAX
from planner.nc.reader import interpret, parse_program, read_program
from planner.nc.reading import Reading
from planner.nc.settings import setting

# program, line, column, parts of the message
REFUSED = [
    # what cannot be split into words
    ("G0 X#", 1, 6, ["a number, parameter", "the end of the line"]),
    ("G0 X#0", 1, 1, ["G0", "#0 is not one of #1 to #5601"]),
    ("G0 X[1+]", 1, 8, ["]", "a number, parameter"]),
    ("G0 X1 [2]", 1, 7, ["[2]", "starts neither a word nor an assignment"]),
    ("G0 X1\nG0 =5", 2, 4, ["=", "Siemens"]),
    ("G0 X1 @2", 1, 7, ["@", "polar"]),
    ("G0 X1 ^2", 1, 7, ["^", "polar"]),
    ("G0 X1 <a>", 1, 7, ["<", "named parameters"]),
    ('T"A"', 1, 1, ["T", "texts"]),
    ("G0 /X1", 1, 4, ["/", "start of a line"]),
    ("G0 X1 )", 1, 7, [")", "not opened"]),
    ("G0 X1 ?", 1, 7, ["?", "starts no word"]),
    ("G0 X1 \x07", 1, 7, ["character 7", "binary"]),
    ("é\nG0 X1", 1, 1, ["é", "starts no word"]),
    ("(é) é", 1, 5, ["é"]),
    ("10 L X5", 1, 1, ["1", "without a letter"]),
    ("G0 X1.2.3", 1, 8, [".", "without a letter"]),
    ("G0 X--1", 1, 4, ["X", "without a number"]),
    ("G0 X.", 1, 4, ["X", "without a number"]),
    ("G0 X1 (a", 1, 7, ["(", "not closed"]),
    ("G0 (a(b))", 1, 6, ["(", "inside a comment"]),
    ("G0 X1\n" + "X" + "1" * LINE_MAX, 2, 1, [str(LINE_MAX), "longer"]),
    ("X1" * 500_000, 1, 1, [str(LINE_MAX)]),
    # words
    ("G0 X1e3", 1, 6, ["e3", "extruder axis", "--extruder ignore"]),
    ("G0 X1 L2", 1, 7, ["L2", "without", "canned cycle"]),
    ("o100 call", 1, 1, ["subprogram"]),
    ("G0 X1 X2", 1, 7, ["X2", "second X"]),
    ("G0 N5 X1", 1, 4, ["N5", "comes first"]),
    ("G0 X" + "9" * 301, 1, 4, ["too large", "1e+09"]),
    ("G0 X1000000001", 1, 4, ["X1000000001", "too large"]),
    ("G0 X1 P2", 1, 7, ["P2", "without G4, G10, G64, G2, G3"]),
    ("G0\nX1 P2", 2, 4, ["P2", "without G4"]),
    ("G0\nX1 I2", 2, 4, ["I2", "without G2, G3"]),
    ("G0 X1 Q2", 1, 7, ["Q2", "without", "G64"]),
    ("T1.5", 1, 1, ["T1.5", "whole number, 0 or more"]),
    ("T-1", 1, 1, ["T-1", "whole number"]),
    ("G43 H1.5", 1, 5, ["H1.5", "whole number"]),
    ("S-5", 1, 1, ["S-5", "negative"]),
    ("G1 F0 X1", 1, 1, ["G1", "without a feed"]),
    ("G93 G1 F0 X1", 1, 8, ["F0", "positive"]),
    ("F-3", 1, 1, ["F-3", "positive"]),
    # codes
    ("G0 G1 X1", 1, 4, ["G1", "G0 and G1", "motion"]),
    ("G90 G91", 1, 5, ["G91", "same group"]),
    ("M3 M5", 1, 4, ["M5", "M3 and M5", "spindle"]),
    ("G1.55 X1", 1, 1, ["G1.55", "does not know"]),
    ("G1.1 X1", 1, 1, ["G1.1", "does not know"]),
    ("G" + "9" * 400, 1, 1, ["does not know"]),
    ("M-3", 1, 1, ["M-3", "does not know"]),
    *[
        (
            f"G21\nG{codes.number(code)}" + " R1" * (code in (700, 710)),  # alone they are units
            2,
            1,
            [f"G{codes.number(code)}", refusal.what, refusal.remedy],
        )
        for code, refusal in codes.G_REFUSED.items()
        if setting("G", code, "", "") is None
    ],
    *[
        (f"G21\nM{codes.number(code)}", 2, 1, [f"M{codes.number(code)}", refusal.what, refusal.remedy])
        for code, refusal in codes.M_REFUSED.items()
        if code not in (700, 710, 720, 730, 980, 990)  # calls and saved modes: tests/nc/language
    ],
    # what the state does not allow
    ("X1", 1, 1, ["X1", "no motion code"]),
    ("G0 X1\nG80\nX2", 3, 1, ["X2", "no motion code"]),
    ("G1 X1", 1, 1, ["G1", "without a feed"]),
    ("G1\nX1", 2, 1, ["X1", "without a feed"]),
    ("G0 X1\nG2 X2 I0.5", 2, 1, ["G2", "without a feed"]),
    ("G28 G1 F1 X1", 1, 1, ["G28", "G28 and G1", "two lines"]),
    ("G92 G1 F1 X1", 1, 1, ["G92", "two lines"]),
    ("G92", 1, 1, ["G92", "at least one of X, Y and Z"]),
    ("G53 G2 X1 Y1 R1 F10", 1, 1, ["G53", "G0 or G1 only"]),
    ("G0\nG53", 2, 1, ["G53", "G0 or G1 only"]),
    ("G91 G0 X1\nG53 X1", 2, 1, ["G53", "absolute"]),
    ("G4", 1, 1, ["G4", "P word"]),
    ("G4 P-1", 1, 4, ["P-1", "P word"]),
    ("G64 P-1", 1, 5, ["P-1", "negative"]),
    ("G64 P1e-300", 1, 5, ["P1e-300", "below 1e-05 mm"]),
    ("G20\nG64 P3e-14", 2, 5, ["P3e-14", "below 1e-05 mm"]),
    # arcs
    ("F1\nG2 X1", 2, 1, ["G2", "needs a centre or a radius", "I and J"]),
    ("F1 G18\nG2 X1", 2, 1, ["K and I"]),
    ("F1\nG2 R1", 2, 1, ["end point", "x y plane"]),
    ("F1\nG2 X1 I1 R1", 2, 1, ["R and I J K"]),
    ("F1\nG2 X1 Y1 K1", 2, 1, ["K in the x y plane", "G18"]),
    ("F1\nG2 X2 R0.9", 2, 1, ["radius 0.9 mm", "2 mm away", "at least 1 mm"]),
    ("F1\nG2 X0 Y0 R1", 2, 1, ["must not end where it starts"]),
    ("F1\nG2 X1 R0", 2, 1, ["radius 0 mm"]),
    ("F1\nG2 X1 Y1 I0 J0", 2, 1, ["radius 0 mm at its start"]),
    ("F1\nG2 X1 I1 P0", 2, 10, ["P0", "whole number, 1 or more"]),
    ("F1 G90.1\nG2 X2 I1", 2, 1, ["J is missing", "G90.1"]),
    ("F1\nG2 X20.5 I10", 2, 1, ["10 mm", "10.5 mm", "0.5 mm apart", "allowed are 0.0282843 mm", "correct"]),
    ("F1\nG90.1\nG0 X30\nG2 X50 I10 J0", 4, 1, ["if its centre were incremental: write G91.1"]),
    # other files
    ("", 1, 1, ["empty"]),
    ("(nothing)\n\n; here", 1, 1, ["empty"]),
    ("G0 X1\nG\0 X2", 2, 2, ["NUL", "binary"]),
    ("G0 X1".encode("utf-16"), 1, 4, ["NUL", "UTF-16"]),
    ("F1\nG0 X30\nG2 X50 I40 J0", 3, 1, ["if its centre were absolute: write G90.1"]),
]


# what moves nothing, and is refused by --strict only (tests/nc/test_lenient.py has what is said of it otherwise)
STRICTLY = [
    ("G21\n$X", 2, 1, ["$", "command to the control"]),
    ("%1234\nG0 X1", 1, 1, ["%", "alone on its line"]),
    ("G0 X1 A30.5", 1, 7, ["A30.5", "rotary axis", "three-axis"]),
    ("G0 X1 W2", 1, 7, ["W2", "linear axis"]),
    ("G0 X1 H2", 1, 7, ["H2", "without G43"]),
    ("G0 X1 D2", 1, 7, ["D2", "without G41"]),
    ("G0 X1 X1", 1, 7, ["X1", "second X"]),
    ("G90 G90", 1, 5, ["G90", "same group"]),
    ("O1000", 1, 1, ["O1000", "program number"]),
    ("M428", 1, 1, ["M428", "does not know"]),
    ("M106 S3", 1, 1, ["M106", "each machine"]),
    ("F1\nG2 X2 I1 K0", 2, 1, ["K in the x y plane"]),
    ("G4 S1", 1, 1, ["G4", "P word"]),
    ("TEXT\n%\nG0 X1", 1, 1, ["T", "a letter and a number"]),
    ("G15", 1, 1, ["G15", "does not know"]),
    ("G50 S1600", 1, 1, ["G50"]),
    ("G28 G0 X1", 1, 1, ["G28", "G28 and G0", "two lines"]),
]


@pytest.mark.parametrize(("text", "line", "column", "parts"), REFUSED + STRICTLY, ids=lambda v: str(v)[:30])
@pytest.mark.parametrize("strict", [False, True])
def test_refused(text: str | bytes, line: int, column: int, parts: list[str], strict: bool) -> None:
    if not strict and (text, line, column, parts) in STRICTLY:
        parse_program(text)
        return
    with pytest.raises(InputError) as caught:
        _read(text, strict)
    fault = caught.value
    assert (fault.source, fault.line, fault.column) == ("job.ngc", line, column)
    for part in parts:
        assert part in fault.message
    assert str(fault).startswith(f"job.ngc:{line}:{column}: ")


def _read(text: str | bytes, strict: bool) -> None:
    """Read a text; of strict reading without what it refuses of the missing G21 alone."""
    _, faults = interpret(text, None, Reading(strict=strict), source="job.ngc")
    require_none([it for it in faults if "assumed without --strict" not in it.message], "job.ngc")


@pytest.mark.parametrize(("letter", "needs"), codes.LETTER_NEEDS.items())
def test_words_that_nothing_uses_are_refused(letter: str, needs: str) -> None:
    if letter == "E":
        return  # refused as an extruder's
    text = f"G21 {letter}1\nG0 X1" if letter in "QH" else f"G21 G0 X1 {letter}1"
    with pytest.raises(InputError, match=f"{letter} word without {needs}"):
        parse_program(text, reading=Reading(strict=letter in "DH"))


def test_first_fault_is_named_and_the_others_counted() -> None:
    with pytest.raises(
        InputError, match=r"^<text>:2:7: \?: this character starts no word.* \(1 more in this program"
    ):
        parse_program("G0 X1\nG0 X1 ?\nG38.2 X1 Z2")


def test_faults_after_the_end_are_not_read() -> None:
    program = parse_program("G21 G0 X1\nM30\nG81 X1 A2 #3")
    assert len(program) == 1
    assert program.notes == ("line 2: the program ends; what follows from line 3 on is not read",)


@pytest.mark.parametrize("read", [read_program, inspect_program])
def test_files_that_cannot_be_read(read, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not found") as caught:
        read(tmp_path / "absent.ngc")
    assert caught.value.source == str(tmp_path / "absent.ngc")
    with pytest.raises(InputError, match="directory"):
        read(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        read("\0")
    binary = tmp_path / "program.bin"
    binary.write_bytes(b"G0 X1\n\x00\x01")
    with pytest.raises(InputError, match="binary"):
        read(binary)


# Found by benchmarks/fuzz, the first one in a file of 408 bytes: each took 5 to 50 s, and twice as long for one more.
@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b";PD1,1\r\n" * 27 + b"?", id="comments of a file of no language"),
        pytest.param(b"@PJL\r\n" * 23 + b"?", id="headers of a printer"),
        pytest.param(b"<!---->" * 26 + b"?", id="comments of XML"),
        pytest.param(b"999\n\n" * 37 + b"?", id="comments of DXF"),
        pytest.param(b"G28 " + b"X  " * 16 + b"?", id="bare axis letters"),
    ],
)
def test_a_text_that_fits_nowhere_is_tried_in_one_way(data: bytes) -> None:
    began = time.process_time()
    with contextlib.suppress(InputError):
        parse_program(data, source="drawing.plt" if data[:1] == b";" else "program.nc")
    assert time.process_time() - began < 2.0


@pytest.mark.parametrize(
    "text",
    [
        "G21\nG60 S1",
        "G21\nG16 X9 Y30",
        "G21\nG51.1",
        "G21\nG68.2 X0 Y0 Z0 I9 J30 K0",
        "G21\nM428 X5",
        "$J=X9",
        "G21\nG34 Z9 K1",
    ],
)
@pytest.mark.parametrize("strict", [False, True])
def test_what_may_move_is_never_left_out_by_a_proposal(text: str, strict: bool) -> None:
    with pytest.raises(InputError) as caught:
        parse_program(text, reading=Reading(strict=strict))
    assert "--ignore" not in str(caught.value)


@pytest.mark.parametrize("head", ["M83", "M82", "M104 S200", "M106 S255"])
@pytest.mark.parametrize("back", ["G61 S0", "G61", "G61 X Y", "G61 S1 F900"])
def test_going_back_to_a_saved_position_is_refused(head: str, back: str) -> None:
    """Marlin's G61; in RS274NGC it is exact path."""
    text = f"G21\n{head}\nG1 X10 F600\nX20 Y5\n{back}\nX30\n"
    with pytest.raises(InputError, match=r":5:\d: "):
        parse_program(text, reading=Reading(extruder="ignore"))


def test_s_beside_g61_is_said_first() -> None:
    (said,) = parse_program("G21 F600\nG1 X10\nG61 S0\nX30").assumptions
    assert said.startswith("line 3: G61 with S")
    for plain in ("G61", "G61 S600 M3", "G61 G1 X4 S9", "S9\nG61"):
        assert not parse_program(f"G21 F600\nG1 X10\n{plain}\nX30").assumptions


def test_a_machine_is_given_by_name_file_or_itself() -> None:
    text = "G20 G0 X1\n"
    mill = load_machine("mill")
    assert read_program(text=text, machine="mill").end == pytest.approx(
        read_program(text=text, machine=mill).end
    )
    with pytest.raises(InputError, match="nil"):
        read_program(text=text, machine="nil")
