"""Poles in the three planes, and tools whose data the program gives, against the same moves written out in RS274NGC."""

from __future__ import annotations

import numpy as np
import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import ToolData, load_machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import flat_program

MILL = load_machine("mill")
SMALL_TOOL = MILL.model_copy(
    update={"tools": {"0": ToolData(diameter=2.0)}}
)  # tool 0 is there before any TOOL CALL
PLANES = {17: "XYZ", 18: "ZXY", 19: "YZX"}  # G code: first and second axis, and the normal
HEIDENHAIN = Reading(dialect="heidenhain")


def text_of(body: str, unit: str = "MM") -> str:
    return f"0 BEGIN PGM T {unit}\n{body}\nEND PGM T {unit}\n"


def read(body: str, unit: str = "MM") -> Program:
    return parse_program(text_of(body, unit), MILL)


def written_out(rows: str) -> Program:
    return parse_program(f"G21 G90\n{rows}\nM30", MILL)


def named(text: str, plane: int) -> str:
    """A, B and N are the first and second axis of a plane and its normal; I and J the centre from the start along A and B."""
    axes = PLANES[plane]
    centres = {"i": "IJK"["XYZ".index(axes[0])], "j": "IJK"["XYZ".index(axes[1])]}
    for letter, axis in {"a": axes[0], "b": axes[1], "n": axes[2], **centres}.items():
        text = text.replace("{" + letter + "}", axis)
    return text


@pytest.mark.parametrize("unit", ["MM", "INCH"])
@pytest.mark.parametrize("plane", PLANES)
def test_arcs_lie_in_the_plane_of_the_pole_and_angles_begin_at_its_first_axis(plane: int, unit: str) -> None:
    """C, LP, CP and a helix about one pole; PA 0 lies along +X, +Y, +Z in X/Y, Y/Z, Z/X. C cannot have the normal's coordinate."""
    body = """L {a}+7 {b}+3 {n}+2 R0 FMAX
CC {a}+4 {b}+3
C {a}+4 {b}+6 DR+ F900
L {n}+1
LP PR+6 PA+0
CP PA+90 DR+
CP IPA-450 I{n}-5 DR-
L {a}+0"""
    rows = """G{g} G0 {a}7 {b}3 {n}2
G3 {a}4 {b}6 {i}-3 {j}0 F{f}
G1 {n}1
{a}10 {b}3
G3 {a}4 {b}9 {i}-6 {j}0
G2 {a}10 {b}3 {n}-4 {i}0 {j}-6 P2
G1 {a}0"""
    inch = unit == "INCH"
    expected = f"G{20 if inch else 21}\n" + named(rows, plane).replace("{g}", str(plane))
    expected = expected.replace("{f}", "90" if inch else "900")  # F is in tenths of an inch per minute
    same(read(named(body, plane), unit), written_out(expected), apart=1e-9)


def test_one_block_serves_poles_of_two_planes() -> None:
    """The plane is that of the last CC that was executed, not of the last one in the text; its expanded text says the same."""
    body = """L X+5 Y+0 Z+0 R0 FMAX
CC X+0 Y+0
CALL LBL 1
L X+0 Y+0 Z+5
CC X+0 Z+0
CALL LBL 1
M30
LBL 1
CP IPA+90 DR+ F600
LBL 0"""
    expected = "G0 X5\nG3 X0 Y5 I-5 F600\nG1 X0 Y0 Z5\nG18 G3 Z0 X5 K-5 I0"
    program = read(body)
    same(program, written_out(expected), apart=1e-9)
    flat = flat_program(text_of(body).encode(), MILL, HEIDENHAIN, source="text")
    assert flat is not None
    same(parse_program(flat[0], MILL), program, apart=1e-9)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("CC Z+3\nCP IPA+90 DR+ F100", "<text>:2:.*plane of a pole is that of its two coordinates"),
        ("CC X+1 Y+2 Z+3", "<text>:2:.*plane of a pole is that of its two coordinates"),
        ("CC X+1 Z+3\nC X+2 Y+0 DR+ F100", "<text>:3:.*out of the pole's plane"),
        ("CC X+1 Z+3\nLP PR+2 PA+0 X+4 F100", "<text>:3:.*out of the pole's plane"),
        ("CC X+1 Y+3\nLP PR+2 PA+0 Y+4 F100", "<text>:3:.*out of the pole's plane"),
        ("CC Y+1 Z+3\nCTP PR+2 PA+0 F100", "<text>:3:.*out of the pole's plane"),
        ("CC X+1 Y+0\nC Z+2 DR+ F100", "<text>:3:.*helix is written as CP"),
        ("CR X+1 Z+2 R+5 DR+ F100", "<text>:2:.*an arc with Z"),
        ("CT X+1 Z+2 F100", "<text>:2:.*an arc with Z"),
        ("LP PR+2 PA+0 F100", "<text>:2:.*there is no pole"),
        ("CP IPA+90 DR+ F100", "<text>:2:.*there is no pole"),
        ("C X+1 Y+0 DR- F100", "<text>:2:.*there is no pole"),
        ("CC X+1 Y+0\nCP IPA-90 DR+ F100", "<text>:3:.*the same sign"),
        ("CC X+1 Y+0\nCP IPA+90 DR+ FMAX", "<text>:3:.*arc at rapid"),
        ("CR X+1 Y+0 R+5 DR+ FMAX", "<text>:2:.*arc at rapid"),
        ("CC X+1 Y+0\nC X+0 Y+1 DR+ F100 M91", "<text>:3:.*M91, machine coordinates, is read in L"),
        ("L IX+1 F100 M91", "<text>:2:.*incremental coordinate with M91"),
        ("L X+9 F100\nRND R2\nCC X+9 Z+5\nCP IPA+30 DR+\nL X+0", "<text>:5.*rounding or chamfer of line 3"),
        ("L X-9 F100\nL X+0 RL F100\nL X+9\nCC X+9 Z+5\nCP IPA+30 DR+", "<text>:6.*the plane changes while cutter"),
    ],
)  # fmt: skip
def test_what_makes_no_arc_is_refused_with_its_line(body: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_program(text_of(body), SMALL_TOOL)


# --- tools ------------------------------------------------------------------------------------------------------------------

CONTOUR = "L X-10 Y-10 Z+2 R0 FMAX\nL X+0 Y+0 {side} F500\nL Y+50\nL X+40\nL X+60 Y+60 R0"


def beside(radius: float, length: float) -> list[list[float]]:
    """The contour above with the tool to its left: round its outer corner it goes on an arc."""
    plane = [[-10, -10], [-radius, 0], [-radius, 50], [0, 50 + radius], [40, 50 + radius], [60, 60]]
    return [[*place, 2.0 + length] for place in plane]


@pytest.mark.parametrize(
    ("setting", "radius", "length"),
    [
        ("TOOL DEF 4 L+30 R+5\nTOOL CALL 4 Z S1000", 5, 30),
        ("TOOL DEF 4 L30 R5\nTOOL DEF 4 R+2.5\nTOOL CALL 4 Z S1000", 2.5, 30),
        ("TOOL DEF 4 L+30 R+5\nTOOL DEF 5\nTOOL CALL 4 Z S1000 F300 DL-1.5 DR+0.25", 5.25, 28.5),
        ("TOOL DEF 4 L+30 R+5\nTOOL CALL 4 Z DR+1\nTOOL CALL 4 Z", 5, 30),
        ("Q1 = +6\nTOOL DEF 4 L+Q1 R+2\nTOOL CALL 4 Z S1000 DL+Q1", 2, 12),
        ('TOOL DEF "END MILL" L+3 R+2\nTOOL CALL "END MILL" Z S1000', 2, 3),
        ('TOOL DEF "A" L+3 R+2\nTOOL DEF "B" L+4 R+1\nTOOL CALL "A" Z\nTOOL CALL "B" Z', 1, 4),
    ],
)
def test_a_tool_is_as_the_program_defines_it(setting: str, radius: float, length: float) -> None:
    program = read(f"{setting}\n{CONTOUR.format(side='RL')}")
    moves = program.end[-6:]
    np.testing.assert_allclose(moves, beside(radius, length), atol=1e-9)
    assert not [note for note in program.notes if "diameter" in note or "length" in note]


def test_a_tool_without_data_is_said_with_its_line() -> None:
    """Compensation that moves nothing is said, for APPR too; line 5 is that of RL."""
    program = read("TOOL CALL 4 Z S1000\n" + CONTOUR.format(side="RL"))
    assert next(n for n in program.notes if "no diameter" in n).startswith("line 4: tool 4 has no diameter")
    program = read("TOOL CALL 4 Z\nL X-9 Y-9 FMAX\nAPPR LT X+0 Y+0 LEN5 RL F500\nL Y+50")
    assert next(n for n in program.notes if "no diameter" in n).startswith("line 4: tool 4 has no diameter")


def test_the_program_s_tool_is_that_of_its_inches() -> None:
    program = read("TOOL DEF 1 L+1 R+0.5\nTOOL CALL 1 Z\n" + CONTOUR.format(side="RL"), "INCH")
    np.testing.assert_allclose(program.end[-6:], np.array(beside(0.5, 1)) * 25.4, atol=1e-9)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("TOOL DEF L+3 R+2", "needs the number of the tool"),
        ("TOOL DEF 3 L+3 L+2", "a second L"),
        ("TOOL DEF 3 L+3 X+2", "takes the number of a tool"),
        ("TOOL CALL Z S1000 DR+1", "need the number of the tool"),
        ("TOOL CALL 3 Z DR2+1", "DR2, of a tool's corner radius"),
        ("TOOL DEF 3 R+1\nTOOL CALL 3 Z DR-2\nL X+0 RL F100\nL X+9", "radius and DR are together -1 mm"),
        ("TOOL CALL 3 Y", "tool axis Y; Z is planned"),
    ],
)
def test_tools_that_make_no_sense_are_refused(body: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(body)
