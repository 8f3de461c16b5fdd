"""What moves nothing is counted and said once; what may move is not assumed away; `Reading` says otherwise."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from same_program import NO_EXTRUDER, STRICT, machine, same_motion

from planner.base.errors import InputError
from planner.nc.info import PLACES_SHOWN, inspect_program
from planner.nc.lexer import LINE_MAX
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import retimed
from planner.report.summary import info_summary
from planner.report.tables import info_table

# A line that moves nothing between two moves, and the note about it: the motion is that of the two moves.
HARMLESS = [
    ("O1000", "1 program number: kept, without effect; first O1000 line 2"),
    ("O1000 (BRACKET)", "1 program number: kept"),
    (":1000", "1 program number: kept, without effect; first :1000 line 2"),
    ("M428", "1 M code that this reader does not know: assumed not to move anything; first M428 line 2"),
    ("M10\nM11\nm10", "3 M codes that this reader does not know: assumed not to move anything; first M10 line 2"),
    ("M123 P5 Q2", "1 M code that this reader does not know"),
    ("M104 S210\nM140 S60", "2 codes of a 3-D printer that move nothing"),
    ("M73 P10 R70", "1 code of a 3-D printer that moves nothing"),
    ("M84 X Y E", "1 code of a 3-D printer that moves nothing"),
    ("M117 X5: layer 3 of 40 (50%)", "1 code of a 3-D printer that moves nothing"),
    ("G50 S1600", "1 largest spindle speed: they change nothing in the path; first G50 line 2"),
    ("G92 S1600", "1 largest spindle speed"),
    ("G15\nG69", "2 G codes that set the control or cancel what this reader does not have"),
    ("G5.1 Q1", "1 G code that sets the control"),
    ("G10\nG11", "2 retractions of an extruder (G10, G11): they take no time in this plan; first G10 line 2"),
    ("M21", "1 M code that this reader does not know"),
    ("G187 P3", "1 G code that sets the control"),
    ("G8 P1", "1 G code that sets the control"),
    ("$X", "1 line to the control or its operator: assumed not to move anything; first $X line 2"),
    ("$$\n$G", "2 lines to the control or its operator"),
    ("$100=250.5", "1 setting of the control: assumed not to change the motion; first $100=250.5 line 2"),
    ("M3 $1 S100", None),
    ("G96 S200 D1500 M3", None),
    ("M19", None),
    ("M50", None),
    ("D5", "1 number of an offset (D, H) without a code that uses it: left out; first D5 line 2"),
    ("T1 H1 D1", "2 numbers of offsets (D, H) without a code that uses them"),
    ("A0.", "1 A word: axis A is assumed to stand still at 0; first A0. line 2"),
    ("G90 G90 G94", None),
    ("G94\nG94 G94", None),
    ("(" + "long " * LINE_MAX + ")", None),
    ("; " + "long " * LINE_MAX, None),
]  # fmt: skip


@pytest.mark.parametrize(("line", "note"), HARMLESS, ids=lambda text: str(text)[:25])
def test_what_moves_nothing_is_counted(line: str, note: str | None) -> None:
    program = parse_program(f"G21 G1 X1 F600\n{line}\nG1 X2 Y3 F600")
    plain = parse_program("G21 G1 X1 F600\n" + "\n" * (line.count("\n") + 1) + "G1 X2 Y3 F600")
    assert same_motion(program, plain)
    found = [said for said in program.notes if note is not None and note in said]
    assert len(found) == (note is not None), program.notes
    assert note is not None or not program.notes


@pytest.mark.parametrize("line", [line for line, note in HARMLESS if note and "axis A" not in note])
def test_strict_refuses_what_is_assumed(line: str) -> None:
    with pytest.raises(InputError, match=r"^<text>:2:"):
        parse_program(f"G21 G0 X1\n{line}\nG1 X2 Y3 F600", reading=STRICT)


def test_events_of_what_is_not_known_are_kept() -> None:
    program = parse_program("O7\nG21 G0 X1\nM428\nG50 S1600 M3\nG1 X2 F60 M123")
    assert [(e.block, e.text) for e in program.events] == [
        (0, "O7"), (1, "M428"), (1, "G50"), (1, "M3"), (1, "M123"),
    ]  # fmt: skip
    assert len(parse_program("M428 " * 500 + "\nO1\n" * 3).events) == 503
    assert "S1600" not in {e.text for e in program.events}  # it is a limit, not a speed


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("M777 X5", "2:1: M777"),  # a setting or a move: nobody knows
        ("M96 P100", "2:1: M96"),
        ("M198 P5", "2:1: M198"),
        ("G10 X5", "2:1: G10"),
        ("M290 Z0.1", "2:1: M290"),
        ("G29", "2:1: G29"),
        ("G50 X5 Z3", "2:1: G50"),
        ("G51 X2", "2:1: G51"),
        ("$J=G91 X10 F100", "2:1: $"),
        ("$TPW", "2:1: $"),
        ("G1 X2 E5 F60", "2:7: E5"),
        ("G1 X2 R5 F60", "2:7: R5"),
        ("G1 X2 F60 ,Q5", "2:11: ,: corner roundings"),
        ("G28 X1 Y", "2:8: Y"),
    ],
)
def test_what_may_move_is_refused_with_its_line(line: str, place: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"<text>:{place}")):
        parse_program(f"G21 G0 X1\n{line}\nG1 X2 Y3 F600")


def test_axis_words_beside_codes_of_the_machine_are_moves() -> None:
    """M100 to M199 take P and Q in RS274NGC: the coordinates are a move."""
    program = parse_program("G21 G0 X1\nX2 M123 P1\nM155 X3")
    assert program.end[:, 0].tolist() == [1, 2, 3]


def test_homing_and_changes_are_said() -> None:
    program = parse_program("G21 G0 X5 Y5\n$H\nG0 X1 Y1\nG28 X\nM60\nM600\nT1 M6")
    assert program.end.tolist() == [[5, 5, 0], [0, 0, 0], [1, 1, 0], *[[0, 1, 0]] * 4]
    assert (program.kind == Kind.STOP).sum() == 3
    said = "\n".join(program.notes)
    for part in (
        "homing is planned as a rapid to the machine's g28",
        "(2 times)",
        "M60",
        "filament",
        "moves nothing",
    ):
        assert part in said
    there = parse_program("G0 X5\n$HX", machine(positions={"g28": {"x": 7.0}}))
    assert there.end[-1].tolist() == [7, 0, 0]


def test_a_rapid_beside_g28_is_the_way_of_g28() -> None:
    where = machine(positions={"g28": {"x": 9.0, "z": 90.0}})
    program = parse_program("G21 G1 X1 Z2 F600\nG0 G91 G28 Z0\nG90 X3", where)
    assert same_motion(program, parse_program("G21 G1 X1 Z2 F600\nG91 G28 Z0\nG90 G0 X3", where))
    assert "line 2: the words beside G0 G28 are those of G28" in program.notes
    with pytest.raises(InputError, match="two lines"):
        parse_program("G0 G28 X0", reading=STRICT)
    with pytest.raises(InputError, match="two lines"):
        parse_program("G1 F60 G28 X0")


# --- axes that stand still ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", "ABCUVW")
@pytest.mark.parametrize("value", ["0.", "-90.5"])
def test_an_axis_may_be_named_while_it_stands(letter: str, value: str) -> None:
    text = "G21 G17\nG0 X1 Y2 {}\nG1 Z-1 {} F600\nX5\nG2 X7 I1 {}\n{} G1 X8\n{}\nG28 X0 {}"
    plain = parse_program(text.format(*[""] * 6))
    program = parse_program(text.format(*[letter + value] * 6))
    assert same_motion(program, plain)
    where = value.rstrip(".")
    assert (
        f"6 {letter} words: axis {letter} is assumed to stand still at {where}; first {letter}{value} line 2"
        in program.notes
    )
    moving = text.format(*[letter + value] * 4, letter + "3", letter + value)
    with pytest.raises(InputError, match=rf"<text>:7:1: {letter}3: .*that moves is not supported"):
        parse_program(moving)
    with pytest.raises(InputError, match=f"<text>:2:10: {letter}"):
        parse_program(text.format(*[letter + value] * 6), reading=STRICT)


def test_an_incremental_word_that_is_not_zero_moves() -> None:
    assert len(parse_program("G21 G0 A90 X1\nG91 A0 X1\nG90 A90 X1")) == 3
    for by_the_interpreter in ("G2 X3 I1 F60 A91", "M8 G0 A91", "G90 X2 A0", "G28 A91"):
        with pytest.raises(InputError, match="that moves"):
            parse_program(f"G21 G0 A90 X1\n{by_the_interpreter}")
    for moving in ("G91 A90 X1", "G91\nG0 A90 X1", "G91 A1"):
        with pytest.raises(InputError, match="that moves"):
            parse_program(f"G21 G0 A90 X1\n{moving}")


def test_a_moving_axis_is_left_out_if_the_user_says_so() -> None:
    text = "G21 G0 X1 A1\nG1 X2 A2 F60\nA3\n"
    program = parse_program(text, reading=Reading(ignore=("a",)))
    assert program.end[:, 0].tolist() == [1, 2]
    assert any("3 A words: left out, as --ignore says" in note for note in program.notes)


# --- numbers, texts, other files ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text", ["1e-05", "-8.775e-05", "3.E+02", "1.5e+2", "12e-3", "-.5E-01", "0e-999", "5e-9"]
)
def test_exponents(text: str) -> None:
    program = parse_program(f"G21 G0 X{text}Y1{text[1:] if text[0] != '-' else text[2:]} Z2")
    assert program.end[0, 0] == float(text)
    assert program.end[0, 2] == 2.0


@pytest.mark.parametrize("text", ["G1 X1E-2 F60", "G1 X1 e-05 F60", "G1X10e5F60", "G1 X10E-2.5 F60"])
def test_words_of_an_extruder_are_no_exponents(text: str) -> None:
    program = parse_program(text, reading=NO_EXTRUDER)
    assert program.end[0, 0] in (1.0, 10.0)
    with pytest.raises(InputError, match="extruder"):
        parse_program(text)


def test_an_exponent_in_a_feed_is_replaced_as_a_whole() -> None:
    source = b"G21 G1 X1 F6e+02 Y1\nX2F3.e+2\n"
    program = parse_program(source)
    assert program.feed.tolist() == [10.0, 5.0]
    assert retimed(source, program, np.array([1.0, 1.0])) == b"G21 G1 X1 F60 Y1\nX2F60\n"


def test_text_before_the_first_percent_sign_is_skipped() -> None:
    program = parse_program("text\nmore (text\n" + "%\nG21 G1 X1 F600\n%\nX9")
    assert program.line.tolist() == [4]
    assert "line 1: the text before the first % is not read ('text more (text')" in program.notes
    # not where it may be a program
    with pytest.raises(InputError, match="<text>:1:"):
        parse_program("text\nG0 X5\n%\nG21 G1 X1 F600\n%\n")
    source = b"PART F1\nX\n%\nG21 G1 X1 F600\nX2\n%\n"
    program = parse_program(source)
    assert retimed(source, program, np.array([1.0, 1.0])) == b"PART F1\nX\n%\nG21 G1 X1 F60\nX2\n%\n"


def test_drawings_and_models_are_named() -> None:
    triangle = bytes(80) + struct.pack("<I", 2) + bytes(100)
    for data, name in (
        (b"  0\nSECTION\n  2\nHEADER\n", "a drawing (DXF)"),
        (b"999\nmade by hand\n0\r\nSECTION\r\n2\r\nENTITIES\r\n", "a drawing (DXF)"),
        (b"AutoCAD Binary DXF\r\n\x1a\0", "a drawing (DXF)"),
        (b"solid part\n  facet normal 0 0 1\n outer loop\n", "a model (STL)"),
        (triangle, "a model (STL)"),
        (b"solid \0" + triangle[7:], "a model (STL)"),
        (b"ISO-10303-21;\nHEADER;", "a model (STEP)"),
        (b'<?xml version="1.0"?>\n<svg width="5">', "a drawing (SVG)"),
        (b"%PDF-1.7\n", "a document (PDF)"),
        (b"PK\x03\x04\0\0", "an archive (ZIP, 3MF)"),
    ):
        with pytest.raises(InputError, match=re.escape(f"this is {name}, not a program; ")) as caught:
            parse_program(data, source="part")
        assert re.search("CAM system|unpack", str(caught.value))


# --- laws: what is left out makes no difference, in the compiled loop and outside -----------------------------------------


def random_program(rng: np.random.Generator, rows: int) -> list[str]:
    """Rows of plain moves, some of them for the interpreter."""
    made = ["G21 G90", "F600"]
    for _ in range(rows):
        words = [f"{letter}{rng.uniform(-99, 99):.3f}" for letter in "XYZ" if rng.random() < 0.6]
        start = rng.choice(["", "G0", "G1", "G01", "N7", "G91 G1", "G90 G0", "M8 G1"])
        made.append(" ".join([start, *words, *(["F900"] if rng.random() < 0.1 else [])]))
    return ["G0 X0", *made]


@pytest.mark.parametrize("seed", range(20))
def test_words_that_are_left_out_make_no_difference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = random_program(rng, 60)
    plain = parse_program("\n".join(rows))
    dressed = []
    for row in rows:
        extra = [word for word in ("A0.000", "E1.5", "B0", "M428", "W-0.", "(text)") if rng.random() < 0.4]
        at = int(rng.integers(0, 2))
        dressed.append(" ".join([row, *extra] if at or not row or row[0] in "NXYZ" else [row, *extra[::-1]]))
    program = parse_program("\n".join(dressed), reading=NO_EXTRUDER)
    assert same_motion(program, plain)
    count = "\n".join(dressed).count("A0.000")
    assert any(
        note.startswith(f"{count} A words: axis A is assumed to stand still at 0") for note in program.notes
    )


# --- what is said ---------------------------------------------------------------------------------------------------------


def test_a_hundred_places_are_listed_and_the_others_counted(tmp_path: Path) -> None:
    job = tmp_path / "job.ngc"
    job.write_text("G21 G0 A0 X1\n" + "".join(f"A{k} X{k}\n" for k in range(1, 251)))
    found = inspect_program(job)
    summary = info_summary(found)
    assert len(summary["unsupported"]) == PLACES_SHOWN
    assert summary["unsupported_places"] == len(found.unsupported) == 250
    assert not any("stand still" in note for note in found.notes)
    printed = [str(part) for part in info_table(found).renderables]
    assert any("250 places, the first 100" in part for part in printed)
    assert any("and 150 more" in part for part in printed)
    (places,) = [part for part in printed if "2:1 A1" in part]
    assert places.count(":") == PLACES_SHOWN
