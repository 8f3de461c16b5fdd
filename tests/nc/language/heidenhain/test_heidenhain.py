"""Conversational programs against the same moves written out in RS274NGC, and against geometry."""

from __future__ import annotations

import numpy as np
import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import Machine, load_machine
from planner.nc.program import Kind, PathControl, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MILL = load_machine("mill")


def read(body: str, unit: str = "MM") -> Program:
    return parse_program(f"0 BEGIN PGM TEST {unit}\n{body}\nEND PGM TEST {unit}\n", MILL)


def test_a_program_with_moves_arcs_and_tool() -> None:
    found = read(
        """1 BLK FORM 0.1 Z X+0 Y+0 Z-20
2 BLK FORM 0.2 X+100 Y+100 Z+0
3 TOOL CALL 5 Z S3000 F500 ; mill
4 L Z+50 R0 FMAX M3
5 L X+10 Y+5 R0 FMAX
6 L Z-5 R0 F AUTO
* - contour
7 ;(a number before a comment)
7 L X+30 IY+10 R0 F800
8 CC X+30 Y+25
9 C X+40 Y+25 DR+
10 CR X+50 Y+35 R+10 DR-
11 L IX-5
12 STOP M5
13 L Z+50 FMAX M9"""
    )
    expected = parse_program(
        """G21 G90
T5 M6
G43 H5
G0 Z50
X10 Y5
G1 Z-5 F500
X30 Y15 F800
G3 X40 Y25 I0 J10
G2 X50 Y35 R10
G1 X45
M0
M5
G0 Z50
M30""",
        MILL,
    )
    same(found, expected, apart=1e-9)
    assert found.line.tolist()[-1] == 16


def test_polar_moves_and_helices() -> None:
    found = read(
        "L X+0 Y+0 FMAX\nCC X+20 Y+0\nLP PR+10 PA+90 F600\nLP IPA-90\nCP PA+180 DR+\nCP IPA+720 IZ-4 DR+"
    )
    np.testing.assert_allclose(found.end[1:], [[20, 10, 0], [30, 0, 0], [10, 0, 0], [10, 0, -4]], atol=1e-9)
    np.testing.assert_allclose(found.arc_sweep, [np.pi, 4 * np.pi], atol=1e-9)
    np.testing.assert_allclose(found.arc_center[:, :2], [[20, 0], [20, 0]], atol=1e-9)


def test_tangent_arcs_go_on_in_the_direction_before() -> None:
    found = read("L X+0 Y+0 FMAX\nL X+10 F500\nCT X+20 Y+10\nCT X+30 Y+20\nL Y+30")
    np.testing.assert_allclose(found.arc_center[:, :2], [[10, 10], [30, 10]], atol=1e-9)
    np.testing.assert_allclose(found.arc_sweep, [np.pi / 2, -np.pi / 2], atol=1e-9)
    found = read("CC X+3 Y+0\nL X+13 Y-10 FMAX\nL Y+0 F500\nCTP PR+10 PA+90")
    np.testing.assert_allclose(found.end[-1, :2], [3, 10], atol=1e-9)
    np.testing.assert_allclose(found.arc_center[0, :2], [3, 0], atol=1e-9)
    found = read("L X+0 Y+0 FMAX\nCR X+10 Y+10 R+10 DR+ F500\nCT X+0 Y+20\nCT X-10 Y+10")
    np.testing.assert_allclose(found.arc_center[:, :2], [[0, 10]] * 3, atol=1e-9)
    np.testing.assert_allclose(found.arc_sweep, np.pi / 2, atol=1e-9)


@pytest.mark.parametrize("turn", [30.0, 90.0, 150.0, -60.0])
def test_roundings_are_tangent_and_chamfers_cut(turn: float) -> None:
    angle = np.radians(turn)
    end = np.array([50.0 + 40.0 * np.cos(angle), 40.0 * np.sin(angle)])
    moves = f"L X+0 Y+0 FMAX\nL X+50 F500\n{{}}\nL X{end[0]:+.12f} Y{end[1]:+.12f}"
    found = read(moves.format("RND R3"))
    cut = 3.0 * np.tan(abs(angle) / 2)
    way = np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(found.end[1, :2], [50 - cut, 0], atol=1e-9)
    np.testing.assert_allclose(found.end[2, :2], np.array([50, 0]) + cut * way, atol=1e-9)
    np.testing.assert_allclose(found.end[3, :2], end, atol=1e-9)
    assert found.arc_sweep[0] == pytest.approx(angle, abs=1e-6)
    chamfer = read(moves.format("CHF 4"))
    np.testing.assert_allclose(chamfer.end[1, :2], [46, 0], atol=1e-9)
    np.testing.assert_allclose(chamfer.end[2, :2], np.array([50, 0]) + 4 * way, atol=1e-9)


def test_a_rounded_rectangle_of_one_coordinate_each() -> None:
    found = read("L X+0 Y+0 FMAX\nL X+40 F500\nRND R5\nL Y+30\nRND R5\nL IX-40\nRND R5\nL Y+0")
    np.testing.assert_allclose(
        found.end[1:, :2], [[35, 0], [40, 5], [40, 25], [35, 30], [5, 30], [0, 25], [0, 0]], atol=1e-9
    )
    np.testing.assert_allclose(found.arc_sweep, np.pi / 2, atol=1e-9)


def test_a_feed_of_a_corner_is_that_of_the_corner_alone() -> None:
    text = "L X+0 Y+0 FMAX\nL X+40 F500{0}\nRND R5 F50\nL Y+30\nCHF 2 FQ1\nL X+9 F700\nRND R2\nL Y+9\nRND R1 F AUTO\nL X+30"
    feeds = [500, 50, 500, 60, 700, 700, 700, 300, 700]
    found = read("Q1 = 60\nTOOL CALL 1 Z S500 F300\n" + text.format(""))
    assert (found.feed[found.kind != Kind.RAPID][1:] * 60).tolist() == pytest.approx(feeds)
    assert not [note for note in found.assumptions if "RND" in note]


def test_rotary_axes_of_a_machine_without_kinematics() -> None:
    axes = {a: {"velocity": 100, "acceleration": 1000, "jerk": 1e4} for a in "xyza"}
    four = Machine(name="four", dt=1e-3, tolerance=0.05, axes=axes)
    head = "BEGIN PGM A MM\nL X+0 A+0 FMAX\n"
    found = parse_program(f"{head}L A+350 F360\nL X+9 IA+20 F500\nL A+10 M126 FMAX\nEND PGM A MM\n", four)
    np.testing.assert_allclose(np.degrees(found.end[:, 3]), [0, 350, 370, 370], atol=1e-9)
    np.testing.assert_allclose(found.feed[1:3] * 60, [np.radians(360), 500])
    assert [note for note in found.assumptions if "beside rotary axes" in note]
    for line, said in (
        ("L B+9", "axis B is not planned here; X, Y, Z, A are"),
        ("L A+9 F5 M116", "M116 is not read"),
    ):
        with pytest.raises(InputError, match=said):
            parse_program(f"{head}{line}\nEND PGM A MM\n", four)


def test_labels_repeats_and_parameters() -> None:
    found = read(
        """FN 0: Q1 = +5
Q2 = 2 * ( Q1 + 1 ) - SQ 2
L X+0 Y+0 FMAX
LBL 1
L IX+Q1 F600
L IY-Q2
CALL LBL 1 REP 2
CALL LBL "out"
FN 2: Q1 = +Q1 - +4
FN 9: IF +Q1 EQU +1 GOTO LBL 9
L X+999
LBL 9
L Z+Q1
CALL LBL "out"
M30
LBL "out"
L IX+100
LBL 0"""
    )
    xs = [0, 5, 5, 10, 10, 15, 15, 115, 115, 215]
    assert found.end[:, 0].tolist() == pytest.approx(xs)
    assert found.end[-1].tolist() == pytest.approx([215, -24, 1])
    assert found.expansion is not None
    assert dict(found.expansion.calls) == {"LBL 100000": 2}
    assert "called from line" in found.place(len(found) - 1)


DRILL = """CYCL DEF 200 DRILLING ~
    Q200=+2 ;SET-UP CLEARANCE ~
    Q201=-15 ;DEPTH ~
    Q206=+150 ;FEED ~
    Q202=+6 ;INFEED ~
    Q210=+0 ;DWELL ABOVE ~
    Q203=+1 ;SURFACE ~
    Q204=+{second} ;SECOND CLEARANCE ~
    Q211=+0.3 ;DWELL BELOW
L Z+50 FMAX
L X+10 Y+20 FMAX M99
CYCL CALL POS X+30 Y+20 FMAX
L X+50 FMAX
CYCL CALL M3"""


def test_drilling_reaches_depth_by_infeeds() -> None:
    found = read(DRILL.format(second=50))
    one = [3, -5, 3, -4.8, -11, 3, -10.8, -14, -14, 3, 51]
    assert found.end[2:13, 2].tolist() == pytest.approx(one)
    assert found.dwell.sum() == pytest.approx(0.9)
    assert set(found.feed[found.kind == Kind.LINE].tolist()) == {2.5}
    assert len(found) == 1 + 3 * (1 + len(one))
    assert read(DRILL.format(second=2)).end[:, 2].max() == pytest.approx(50)


def test_pecking_of_older_controls_begins_where_the_tool_stands() -> None:
    found = read(
        "L Z+25 FMAX\nCYCLE DEF 1.0 PECKING\nCYCL DEF 1.1 DIST20\nCYCL DEF 1.2 DEPTH-9\nCYCL DEF 1.3 PLNGNG5\n"
        "CYCL DEF 1.4 DWELL0.2\nCYCL DEF 1.5 F120\nL X+3 FMAX M99"
    )
    assert found.end[1:, 2].tolist() == pytest.approx([25, 0, 25, 0.2, -4, -4, 25])
    assert found.dwell.sum() == pytest.approx(0.2)
    assert set(found.feed[found.kind == Kind.LINE].tolist()) == {2.0}


def test_incremental_moves_after_what_changes_the_coordinates() -> None:
    found = read(
        "L X+10 Y+0 FMAX\nCYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+4\nCYCL DEF 7.2 Y+1\nL IX+1 IY+1 F600\nL X+0 Y+0"
    )
    assert found.end[1:, :2].tolist() == [[11, 1], [4, 1]]
    found = read("CYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+4\nL X+0 FMAX\nL X+20 FMAX M91\nL IX+1 F600\nL X+1")
    assert found.end[:, 0].tolist() == [4, 20, 21, 5]


def test_tolerance_datum_shift_and_inches() -> None:
    found = read(
        "CYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T0.03\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nL X+1 Y+1 F600"
    )
    assert found.path_control[-1] == PathControl.BLEND
    assert found.tolerance[-1] == 0.03
    assert found.end[-1].tolist() == [11, 1, 0]
    inch = read("L X+1 Y+2 F600", "INCH")
    assert inch.end[-1].tolist() == pytest.approx([25.4, 50.8, 0])
    assert inch.feed[-1] == pytest.approx(60 * 25.4 / 60)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("L X+1 A+3 F100", "<text>:2:7: .*axis A is not planned"),
        ("L X+1 F100 M128", "<text>:2:12: .*M128 is not read"),
        ("CYCL DEF 256 STUD", "<text>:2:.*cycle 256 is not read"),
        ("APPR LT X+1", "<text>:2:1: .*APPR LT needs its length"),
        (
            "LN X+1 NX+0 NY+0 NZ+1 F100",
            "<text>:2:1: .*LN of the conversational language is not read .*normal",
        ),
        ("FL X+1 AN+30", "FL of the conversational .*free contours"),
        ("L X+1 F100 M103 F20", "M103 is not read"),
        ("C X+1 Y+1", "direction: DR"),
        ("RND R3", "stand behind a move"),
        ("L X+1 F100\nRND R3\nCC X+1 Y+1", "rounding or chamfer of line 3 needs"),
        ("Q1 = 3 *", "the formula ends too early"),
        ("Q1 = SIN (3", r"\) is missing"),
        ("L X+Q2000 F100", "Q0 to Q1999"),
        ("CALL LBL 7", "there is no LBL 7"),
        ("Q1 = 1 / 0\nL X+Q1 F100", "<text>:2:1: .*division by zero"),
        ("L X+1 FAUTO", "the tool call before has no F"),
        ("CYCL CALL", "no drilling or milling cycle"),
        ("TOOL CALL 1 X", "tool axis X"),
        ("LBL 1\nFN 9: IF +1 EQU +1 GOTO LBL 1", "does this loop end"),
    ],
)
def test_what_is_not_read_is_refused_with_its_place(
    body: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.nc.language.run.TURNS_MAX", 10_000)
    with pytest.raises(InputError, match=said):
        read(body)


def test_dialect_can_be_given() -> None:
    text = "L X+10 Y+5 F500\nL X+20"
    assert len(parse_program(text, MILL, Reading(dialect="heidenhain"))) == 2
    with pytest.raises(InputError):
        parse_program(text, MILL)


def test_mutated_programs_end_in_a_program_or_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.nc.language.run.TURNS_MAX", 2_000)
    rng = np.random.default_rng(7)
    base = (
        "0 BEGIN PGM T MM\n"
        + DRILL.format(second=50)
        + "\nLBL 1\nL IX+5 F600\nRND R1\nL IY+5\nCALL LBL 1 REP 2\nEND PGM T MM\n"
    )
    pieces = base.split()
    refused = 0
    for _ in range(150):
        text = base
        for _ in range(rng.integers(1, 5)):
            at = int(rng.integers(0, len(text)))
            cut = int(rng.integers(0, 9))
            text = text[:at] + " " + str(rng.choice(pieces)) + " " + text[at + cut :]
        try:
            parse_program(text, MILL, Reading(dialect="heidenhain"))
        except InputError:
            refused += 1
    assert 0 < refused < 150
