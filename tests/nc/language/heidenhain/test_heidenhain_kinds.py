"""Small conversational programs of all kinds, each with its right positions, worked out by hand or by geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine.files import machine_from_dict
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program

AXIS = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5}
MILL = {
    "name": "mill",
    "dt": 1e-3,
    "tolerance": 0.02,
    "feed_default": 10.0,
    "axes": dict.fromkeys("xyz", AXIS),
}
FIVE = {
    **MILL,
    "axes": dict.fromkeys("xyzac", AXIS),
    "kinematics": {"type": "xyzac-trt", "tool_length": 20.0},
}


def read(body: str, machine: dict = MILL) -> Program:
    return parse_program(f"0 BEGIN PGM A MM\n{body}\n9 END PGM A MM\n", machine_from_dict(machine))


def ends(program: Program) -> np.ndarray:
    return program.end[~np.isin(program.kind, [Kind.DWELL, Kind.STOP])]


PLACES: dict[str, tuple[str, list[tuple[float, float, float]]]] = {
    "M140": (
        "L Z-10 R0 FMAX\nL M140 MB MAX\nL X+5 FMAX M3\nL M140 MB+50 F750\nL X+1 FMAX M140 MB 20",
        [(0, 0, -10), (0, 0, 0), (5, 0, 0), (5, 0, 50), (5, 0, 70), (1, 0, 70)],
    ),
    "codes of rotary axes that are not there": ("M126\nM94 C\nM116\nM127\nL X+1 R0 FMAX M94", [(1, 0, 0)]),
    "M97, M109 without compensation": ("L X+1 F100 M97\nL X+2 M98\nL X+3 M109\nL X+4 M110", [(k, 0, 0) for k in range(1, 5)]),
    "cycle 247": ("CYCL DEF 247 DATUM SETTING ~\n  Q339=+1 ;DATUM NUMBER\nL X+1 FMAX", [(1, 0, 0)]),
    "tools by parameters": ("Q1=5\nQ2=2000\nTOOL CALL Q1 Z SQ2 F100 DL+0 DR2:+0\nL X+1 F AUTO", [(1, 0, 0)]),
    "Q, QL and QR beside each other": (
        "FN 0: Q990 = +1\nFN 0: Q1000 = +1\nFN 0: Q1999 = +1\nQR0 = 2\nQR8 = 2\nQL0 = 3\n"
        "L X+Q990 Y+Q1000 Z+Q1999 F500\nL X+QR0 Y+QR8 Z+QL0",
        [(1, 1, 1), (2, 2, 3)],
    ),
    "QL, QR, QS": ('QL1=5\nQR1 = QL1 + 2\nQS1 = "abc"\nFN 0: QL5 = +3\nL X+QL1 Y+QR1 Z+QL5 F500', [(5, 7, 3)]),
    "SGN, %, SQ": ("Q1 = SGN -5\nQ2 = 7 % 4\nL X+Q1 Y+Q2 Z+0 F100", [(-1, 3, 0)]),
    "functions that move nothing": (
        "FN 15: PRINT Q1\nFN 16: F-PRINT TNC:\\A.A\nFN 19: PLC=+10/+Q3\nFN 20: WAIT FOR M4095==1\nFN 26: TABOPEN TNC:\\T.TAB\n"
        'FN 27: TABWRITE 5/"R" = Q5\nL X+1 F100',
        [(1, 0, 0)],
    ),
    "FN 9 to a name": ('FN 9: IF+Q1 EQU+0 GOTO LBL "UP"\nL X+99 F500\nLBL "UP"\nL X+1 F100', [(1, 0, 0)]),
    "FN 14 that is passed over": ("FN 9: IF +0 EQU +0 GOTO LBL 1\nFN 14: ERROR = 1000\nLBL 1\nL X+1 F100", [(1, 0, 0)]),
    "REP 2/2": ("LBL 1\nL IX+1 F100\nCALL LBL 1 REP 2/2", [(1, 0, 0), (2, 0, 0), (3, 0, 0)]),
    "RND with F": ("L X+0 F100\nL X+10\nRND R2 F50\nL Y+10", [(0, 0, 0), (8, 0, 0), (10, 2, 0), (10, 10, 0)]),
    "TRANS": (
        "TRANS DATUM AXIS X+10 Y+5\nL X+1 Y+0 FMAX\nTRANS DATUM RESET\nTRANS ROTATION ROT+90\nL X+10 Y+0 FMAX\nTRANS ROTATION RESET\n"
        "TRANS MIRROR AXIS X\nL X+3 Y+0 FMAX\nTRANS MIRROR RESET\nTRANS SCALE SCL0.5\nL X+4 Y+0 FMAX\nTRANS SCALE RESET\nL X+4 FMAX",
        [(11, 5, 0), (0, 10, 0), (-3, 0, 0), (2, 0, 0), (4, 0, 0)],
    ),
    "FUNCTION": ("FUNCTION MODE MILL\nFUNCTION RESET TCPM\nPLANE RESET STAY\nL X+1 FMAX", [(1, 0, 0)]),
    "a plane that only turns": ("PLANE SPATIAL SPA+0 SPB+0 SPC+90 STAY\nL X+3 Y+0 FMAX", [(0, 3, 0)]),
}  # fmt: skip


@pytest.mark.shows("read-heidenhain", "exact: positions worked out by hand or by geometry")
@pytest.mark.parametrize("kind", PLACES)
def test_programs_of_each_kind_come_to_their_places(kind: str) -> None:
    body, places = PLACES[kind]
    np.testing.assert_allclose(ends(read(body))[:, :3], np.array(places, dtype=float), atol=1e-9)


HOLE = "TOOL CALL 1 Z S1000 F300\nCYCL DEF 201 REAMING Q200=2 Q201=-5 Q206=FAUTO Q211=0 Q208=MAX Q203=+0 Q204=20\n"
PATTERNS = {
    "POS1 (X+1 Y+2 Z+0) POS2(X+3 Y+4 Z+0)": [(1, 2), (3, 4)],
    "ROW1 (X+1 Y+2 D+5 NUM3 ROT+90 Z+0)": [(1, 2), (1, 7), (1, 12)],
    "PAT1 (X+0 Y+0 DX+2 DY+3 NUMX2 NUMY2 ROT+0 ROTX+0 ROTY+0 Z+0)": [(0, 0), (2, 0), (2, 3), (0, 3)],
    "FRAME1 (X+0 Y+0 DX+2 DY+3 NUMX3 NUMY3 ROT+0 ROTX+0 ROTY+0 Z+0)": [
        (0, 0), (2, 0), (4, 0), (4, 3), (0, 3), (0, 6), (2, 6), (4, 6),
    ],
    "CIRC1 (X+1 Y+2 D10 START+0 NUM4 Z+0)": [(6, 2), (1, 7), (-4, 2), (1, -3)],
    "PITCHCIRC1 (X+0 Y+0 D10 START+90 STEP90 NUM2 Z+0)": [(0, 5), (-5, 0)],
}  # fmt: skip


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_cycle_is_called_at_each_place_of_a_pattern(pattern: str) -> None:
    program = read(f"{HOLE}PATTERN DEF {pattern}\nCYCL CALL PAT FMAX M3")
    holes = program.end[(program.kind == Kind.LINE) & (program.end[:, 2] < 15.0)]
    low = program.end[program.end[:, 2] == program.end[:, 2].min()]
    np.testing.assert_allclose(low[:, :2], PATTERNS[pattern], atol=1e-9)
    assert len(holes)
    assert program.feed[program.kind == Kind.LINE].tolist() == [5.0] * len(low)


@pytest.mark.parametrize("codes", [(0, 1, 5, 6, 9), (3, 4, 8, 13, 14)])
def test_a_switch_acts_before_or_behind_the_move_of_its_block(codes: tuple[int, ...]) -> None:
    """M0, M1, M5, M6 and M9 at the end of their block, M3, M4, M8, M13 and M14 at its beginning (manuals from TNC 155 on)."""
    for code in codes:
        program = read(f"L X+1 F100\nL X+5 M{code}\nL X+9")
        stands = {float(program.end[event.block - 1, 0]) for event in program.events}
        assert stands == {5.0 if 5 in codes else 1.0}


NOTHING = "90 102 105 106 107 108 111 113 117 120 127 129 141 142 145 148 149 150"


@pytest.mark.parametrize("code", NOTHING.split())
def test_codes_that_move_nothing_are_known_and_left_out(code: str) -> None:
    """What they would end is refused where it begins, or they are of monitoring and messages (TNC 640, overview of M functions)."""
    program = read(f"L X+1 F100 M{code}\nM{code}\nL X+9")
    assert program.end[:, 0].tolist() == [1.0, 9.0]
    assert not len(program.events)
    assert not program.assumptions


def test_m89_calls_the_cycle_at_every_place_up_to_m99() -> None:
    program = read(f"{HOLE}L X+1 Y+1 R0 FMAX M89\nL X+2 FMAX\nL X+3 FMAX M99\nL X+4 FMAX")
    low = program.end[program.end[:, 2] == program.end[:, 2].min()]
    assert low[:, 0].tolist() == [1, 2, 3]


def test_polar_approach_is_that_of_its_rectangular_coordinates() -> None:
    head, tail = (
        "TOOL DEF 1 L+0 R+2\nTOOL CALL 1 Z S1 F500\nL X+40 Y+10 R0 FMAX M3\nCC X+0 Y+0\n",
        "\nL X+50 Y+50\n",
    )
    corner = 30 * math.sqrt(0.5)
    polar = read(head + "APPR PLT PR+30 PA+45 Z-10 LEN15 RR F100" + tail + "DEP PLCT PR+60 PA+30 R+5")
    x, y = 60 * math.cos(math.pi / 6), 60 * math.sin(math.pi / 6)
    plain = read(
        head
        + f"APPR LT X{corner:+.12f} Y{corner:+.12f} Z-10 LEN15 RR F100"
        + tail
        + f"DEP LCT X{x:+.12f} Y{y:+.12f} R+5"
    )
    np.testing.assert_allclose(polar.end, plain.end, atol=1e-9)


@pytest.mark.parametrize(
    "plane",
    [
        "PLANE SPATIAL SPA+30 SPB+0 SPC+90 TURN FMAX SEQ+ TABLE ROT",
        "PLANE EULER EULPR+90 EULNU+30 EULROT+0 TURN FMAX SEQ+",
        "CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+30 B+0 C+90\nL A+Q120 C+Q122 R0 FMAX",
    ],
)
def test_tilted_planes_have_the_places_of_their_rotation(plane: str) -> None:
    """Points are at Rz(90) Rx(30) p; the tool stands along the plane's normal; PLANE RESET ends it."""
    program = read(
        f"{plane}\nL X+5 Y+6 Z+7 R0 FMAX\nL Z+0 F500\nPLANE RESET TURN FMAX\nL X+1 Y+1 Z+50 FMAX", FIVE
    )
    s, c = 0.5, math.sqrt(0.75)

    def place(x: float, y: float, z: float) -> np.ndarray:
        return np.array([-(c * y - s * z), x, s * y + c * z])

    at = int(np.flatnonzero(program.kind == Kind.LINE)[0])
    np.testing.assert_allclose(program.end[at - 1][:3], place(5, 6, 7), atol=1e-9)
    np.testing.assert_allclose(program.end[at][:3], place(5, 6, 0), atol=1e-9)
    from planner.machine.kinematics.chain import kinematics_of

    angles = dict(zip("ac", program.end[at][3:], strict=True))
    up = np.array(kinematics_of(machine_from_dict(FIVE)).direction(angles))
    np.testing.assert_allclose(up, place(0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(program.end[-1], [1, 1, 50, 0, 0], atol=1e-9)


def test_rotary_axes_go_the_shortest_way_under_m126() -> None:
    program = read("M126\nL C+350 R0 FMAX\nL C+10 R0 FMAX\nM127\nL C+350 FMAX\nL IC+10 FMAX", FIVE)
    assert np.degrees(program.end[:, -1]).tolist() == pytest.approx([-10, 10, 350, 360])


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("FN 18: SYSREAD Q25 = ID210 NR4 IDX3", "FN 18 is not read: the value is known by the control only"),
        ("L X+1 F9\nFN 14: ERROR = 1000", "raises its error"),
        ("CYCL DEF 256 RECTANGULAR STUD ~\nQ218=60", "cycle 256 is not read: it mills by paths"),
        ("CYCL DEF 14.0 CONTOUR GEOMETRY", "contour of subprograms"),
        ("CYCL DEF 408 SLOT CENTER REF PT", "it measures"),
        ("PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX", r"no table \[kinematics\]"),
        ("FL X+5 F100", "free contours"),
        ("M128", r"needs a table \[kinematics\]"),
        ("L X+1 F9 M92", "write M91"),
        ("CYCL CALL PAT", "no PATTERN DEF"),
        ("IF Q1 == 1 THEN", "IF is followed by a value, EQU"),
        ("FN 18: SYSREAD Q1 = ID210 NR1", "known by the control only.*ID270"),
        ("FN 28: TABREAD Q1 = 2", "TABREAD reads a table"),
    ],
)
def test_what_is_refused_says_what_it_would_do(body: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(body)


def test_if_without_fn_jumps_as_fn_9_to_12_do_and_sysread_knows_the_place() -> None:
    for number, word in ((9, "EQU"), (10, "NE"), (11, "GT"), (12, "LT")):
        text = "Q1 = 3\nQ2 = 4\n{}IF +Q1 " + word + " +Q2 GOTO LBL 5\nL X+7 F100\nLBL 5\nL Y+8 F100"
        assert ends(read(text.format(""))).tolist() == ends(read(text.format(f"FN {number}: "))).tolist()
    text = "L X+7 Y+2 F100\nFN 18: SYSREAD Q5 = ID270 NR1 IDX1\nL Y+Q5"
    assert ends(read(text))[-1, :2].tolist() == [7.0, 7.0]


def test_a_tool_with_a_name_is_called_so() -> None:
    said = read('1 TOOL CALL "MILL" Z S100\n2 L X+0 Y+0 FMAX\n3 L X+9 RL F100\n4 L Y+9').assumptions
    assert any("a tool with a name (write its number) has no diameter" in one for one in said)
    assert not any("tool 100000" in one for one in said)


def test_z_of_a_called_place_shifts_the_surface() -> None:
    """CYCL CALL POS: Z is added to Q203; from below the surface the tool goes up first."""
    hole = "Q200=2 Q201=-10 Q206=150 Q202=10 Q203=1 Q204=20 Q211=0 Q210=0"
    program = read(
        f"1 L Z+50 FMAX\n2 CYCL DEF 200 {hole}\n3 CYCL CALL POS X+30 Y+10 Z+5 FMAX M3\n"
        "4 CYCL CALL POS X+50 Y+10 Z+0 F3000\n5 L Z-5 F100\n6 CYCL CALL POS X+70 Y+10 Z-3 FMAX"
    )
    deepest = {x: program.end[program.end[:, 0] == x, 2].min() for x in (30.0, 70.0)}
    assert deepest == {30.0: 1.0 + 5.0 - 10.0, 70.0: 1.0 - 3.0 - 10.0}
    to_second = np.flatnonzero(program.line == 5)[0]
    assert program.end[to_second].tolist() == [50.0, 10.0, 1.0 + 5.0 + 20.0]
    assert program.feed[to_second] == pytest.approx(50.0)
    last = program.end[program.line == 7].tolist()
    assert last[:2] == [[50.0, 10.0, 1.0 - 3.0 + 20.0], [70.0, 10.0, 1.0 - 3.0 + 20.0]]


@pytest.mark.parametrize("q", ["Q343=+1 Q344=-8", "Q395=1"])
def test_depths_by_the_tip_of_the_tool_are_refused(q: str) -> None:
    cycle = f"1 CYCL DEF {240 if '344' in q else 200} Q200=2 Q201=-5 Q206=100 Q202=5 Q203=0 Q204=9"
    call = "\n2 L X+1 FMAX M99"
    with pytest.raises(InputError, match=r"the angle of the tip, .* write 0, and the depth") as caught:
        read(f"{cycle} {q}{call}")
    assert (caught.value.line, caught.value.column) == (2, len(cycle) + 2)
    assert read(f"{cycle} {q.replace('=+1', '=0').replace('=1', '=0')}{call}").end[:, 2].min() == -5.0
