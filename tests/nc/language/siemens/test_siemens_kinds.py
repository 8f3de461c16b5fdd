"""Small Sinumerik programs of all kinds, each with its right positions, worked out by hand or by geometry."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine.files import machine_from_dict
from planner.nc.language.detect import programs_of
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program, read_program

AXIS = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5}
MILL = {
    "name": "mill",
    "dt": 1e-3,
    "tolerance": 0.02,
    "feed_default": 10.0,
    "axes": dict.fromkeys("xyz", AXIS),
}
TOOLED = {**MILL, "tools": {"1": {"length": 20.0, "diameter": 4.0}}}
FIVE = {
    **MILL,
    "axes": dict.fromkeys("xyzac", AXIS),
    "kinematics": {"type": "xyzac-trt", "tool_length": 20.0},
}


def read(text: str, machine: dict = MILL) -> Program:
    """Recognised by its words alone: no dialect is given."""
    return parse_program(text, machine_from_dict(machine))


HALF = math.sqrt(0.5)
# Programs and the places that they come to, one mark of a Sinumerik in each.
PLACES: dict[str, tuple[str, list[tuple[float, float, float]]]] = {
    "CR=": ("G0 X0 Y0\nG1 Z-1 F500\nG2 X10 Y0 CR=5", [(0, 0, 0), (0, 0, -1), (10, 0, -1)]),
    "T=": ('N5 G90 G17\nN10 T="D8" M6\nN20 G0 X5', [(5, 0, 0)]),
    "ADIS=": ("G1 X10 F1000 G641 ADIS=0.5\nY10", [(10, 0, 0), (10, 10, 0)]),
    "CIP": ("G0 X0\nCIP X10 Y0 I1=5 J1=5 F500", [(0, 0, 0), (10, 0, 0)]),
    "SUPA": ("G90 G0 Z-5 SUPA\nG0 X10", [(0, 0, -5), (10, 0, -5)]),
    "a header": ("%_N_TEST_MPF\nG90 G0 X1", [(1, 0, 0)]),
    "arrays": (
        "DEF REAL P[3]\nDEF INT I\nP[0]=1 P[1]=2.5\nP[2]=4\nFOR I=0 TO 2\nG1 X=P[I] F500\nENDFOR",
        [(1, 0, 0), (2.5, 0, 0), (4, 0, 0)],
    ),
    "values of an array in brackets": ("DEF REAL P[3]=(1, 2.5, -R1)\nG1 X=P[1] Y=P[0] F500", [(2.5, 1, 0)]),
    "an archive": (
        "%_N_L1_SPF\nG91 G1 X1\nG90\nM17\n%_N_MAIN_MPF\nG0 X0 F500\nL1 P2\nAB(3)\nM30\n"
        "%_N_AB_SPF\nPROC AB(REAL A)\nG1 Y=A\nRET",
        [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 3, 0)],
    ),
    "SET of two dimensions": ("DEF REAL P[2,3]=SET(1,2,3,4,5,6)\nG1 X=P[1,2] Y=P[0,1] F500", [(6, 2, 0)]),
    "REP": ("DEF INT A[4]=REP(7)\nG1 X=A[3] F500", [(7, 0, 0)]),
    "polar": (
        "G17 G90 G0 X0 Y0\nG111 X20 Y20\nG1 AP=90 RP=10 F500\nAP=IC(90)\nG3 AP=270 RP=10\nG110 X0 Y0\nG1 AP=0 RP=5\n"
        "G112 X5 Y5\nG1 AP=0 RP=5",
        [(0, 0, 0), (20, 30, 0), (10, 20, 0), (20, 10, 0), (25, 10, 0), (30, 15, 0)],
    ),
    "TURN=": ("G0 X10\nG3 X10 Y0 Z-9 I-10 J0 TURN=2 F500", [(10, 0, 0), (10, 0, -9)]),
    "RNDM=": (
        "G0 X0 Y0\nG1 X10 F500 RNDM=2\nY10\nG1 Z5\nX20\nRNDM=0\nY20",
        [(0, 0, 0), (8, 0, 0), (10, 2, 0), (10, 10, 0), (10, 10, 5), (18, 10, 5), (20, 12, 5), (20, 20, 5)],
    ),
    "CHF= and CHR=": (
        "G0 X0\nG1 X10 F500 CHF=2\nY10 CHR=1\nX20",
        [(0, 0, 0), (10 - HALF * 2, 0, 0), (10, HALF * 2, 0), (10, 9, 0), (11, 10, 0), (20, 10, 0)],
    ),
    "TRANS and AROT": ("G17 TRANS X10 Y5\nAROT RPL=90\nG1 X10 Y0 F500\nROT\nG1 X1 Y1", [(10, 15, 0), (1, 1, 0)]),
    "SCALE and MIRROR": ("G17 SCALE X2 Y2\nG1 X10 Y5 F500\nMIRROR X0\nG1 X10 Y5", [(20, 10, 0), (-10, 5, 0)]),
    "ROT in space": ("ROT X90\nG1 X10 Y0 Z5 F500", [(10, -5, 0)]),
    "ROT about Z, new Y, new X": ("ROT X90 Z90\nG1 X1 Y2 Z3 F500", [(3, 1, 2)]),
    "a plane G18": ("G18 TRANS X5 Z3\nAROT RPL=90\nG1 X10 Z0 F100", [(5, 0, -7)]),
    "CASE": (
        "R1=2\nCASE R1 OF 1 GOTOF A_1 2 GOTOF A_2 DEFAULT GOTOF A_3\nA_1: G1 X1 F500\nA_2: G1 X2 F500\nGOTOF FIN\n"
        "A_3: G1 X3 F500\nFIN:",
        [(2, 0, 0)],
    ),
    "a label as a text": ('R1=1\nIF R1==1 GOTOF "ZIEL"\nG1 X1 F500\nZIEL: N20 G1 X2 F500', [(2, 0, 0)]),
    "loops": (
        "R1=0\nWHILE R1<2\nR1=R1+1\nG1 X=R1 F500\nENDWHILE\nREPEAT\nR1=R1-1\nY=R1\nUNTIL R1<=0",
        [(1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 0, 0)],
    ),
    "sections": (
        "AA1: G91 G1 X1 F100\nBB1: Y1\nREPEAT AA1 BB1 P=2\nREPEATB BB1 P=1",
        [(1, 0, 0), (1, 1, 0), (2, 1, 0), (2, 2, 0), (3, 2, 0), (3, 3, 0), (3, 4, 0)],
    ),
    "numbers and functions": (
        "R1=MINVAL(1,2)+MAXVAL(1,2)+BOUND(0,5,3)\nR2=7 DIV 2 R3='HFF' R4='B101'\nR5=5 B_AND 4\nG1 X=R1 Y=R2 Z=R3+R4+R5 F9",
        [(6, 3, 264)],
    ),
    "settable frames": ("$P_UIFR[1,X,TR]=10\n$P_UIFR[2]=CTRANS(X,1,Y,2)\nG54 G0 X1\nG55 G0 X0 Y0", [(11, 0, 0), (1, 2, 0)]),
    "DIAMON": ("DIAMON\nG18 G0 X20 Z2\nDIAMOF\nG0 X20", [(10, 0, 2), (20, 0, 2)]),
    "OVR=": ("OVR=50\nG1 X10 F100", [(10, 0, 0)]),
    "G74": ("G0 X5 Y5\nG74 X1=0 Y1=0", [(5, 5, 0), (5, 5, 0), (0, 0, 0)]),
    "G25": ("WALIMON\nG25 X-10\nG1 X1 F100", [(1, 0, 0)]),
    "two spindles": ("S1=3000 M1=3\nS2=100 M2=4\nSPOS[1]=45\nG1 X1 F100", [(1, 0, 0)]),
    "rigid tapping": ("SPOS=0\nG331 Z-10 K1.25 S300\nG332 Z5 K1.25", [(0, 0, -10), (0, 0, 5)]),
}  # fmt: skip


@pytest.mark.shows("read-siemens", "exact: positions worked out by hand or by geometry")
@pytest.mark.parametrize("kind", PLACES)
def test_programs_of_each_kind_come_to_their_places(kind: str) -> None:
    text, places = PLACES[kind]
    program = read(f"{text}\nM30\n")
    ends = program.end[~np.isin(program.kind, [Kind.DWELL, Kind.STOP])]
    np.testing.assert_allclose(ends[:, :3], np.array(places, dtype=float), atol=1e-9)


def test_feeds_of_overrides_taps_and_dwells_in_turns() -> None:
    assert read("OVR=50\nG1 X10 F100\nM30").feed[0] == pytest.approx(50 / 60)
    tap = read("G331 Z-10 K1.25 S300\nM30")
    assert tap.feed[tap.kind == Kind.LINE].tolist() == pytest.approx([1.25 * 300 / 60])
    assert read("S1000 M3\nG4 S100\nMSG()\nM30").dwell.max() == pytest.approx(6.0)


HOLES = {
    "CYCLE801(10,20,0,20,15,2,2,0)": [(10, 20), (10, 35), (30, 20), (30, 35)],
    "CYCLE801(0,0,90,1,2,3,3,1)": [(0, 0), (-2, 0), (-4, 0), (0, 1), (-4, 1), (0, 2), (-2, 2), (-4, 2)],
    "CYCLE802(111111111,111111111,10,1,20,2,30,3)": [(10, 1), (20, 2), (30, 3)],
}


@pytest.mark.parametrize("pattern", HOLES)
def test_patterns(pattern: str) -> None:
    program = read(f"G17 F100\nMCALL CYCLE81(5,0,2,-3,,0.6,0,1,12)\n{pattern}\nMCALL\nM30")
    holes = program.end[program.kind == Kind.LINE]
    np.testing.assert_allclose(holes[:, :2], HOLES[pattern], atol=1e-9)


@pytest.mark.parametrize(
    ("call", "far"),
    [
        ("SLOT1(10,0,2,-5,,4,30,8,50,50,20,0,90,100,200,5,2,0,0)", 50.0),
        ("SLOT2(10,0,2,-5,,2,60,8,50,50,20,0,180,100,200,5,2,0,0)", 24.0),
        ("LONGHOLE(10,0,2,-5,,4,30,50,50,20,0,90,100,200,5)", 50.0),
    ],
)
def test_slots_lie_between_their_radii(call: str, far: float) -> None:
    """The tool of radius 2 stays within the slot, and comes to its far end."""
    program = read(f"T1 M6\nS1000 M3\nG0 X50 Y50 Z50\n{call}\nM30", TOOLED)
    cut = program.end[program.end[:, 2] < -1e-6]
    away = np.hypot(cut[:, 0] - 50, cut[:, 1] - 50)
    assert away.max() == pytest.approx(far - 2.0)
    assert away.min() >= (18.0 if "SLOT2" in call else 22.0) - 1e-9


def test_values_of_subprograms_by_name(tmp_path: Path) -> None:
    (tmp_path / "ADD.SPF").write_text("PROC ADD(REAL A, VAR REAL SUM)\nSUM=SUM+A\nA=99\nRET\n")
    (tmp_path / "m.mpf").write_text("DEF REAL S=1, B=5\nADD(B,S)\nADD(B,S)\nG1 X=S Y=B F100\nM30\n")
    program = read_program(tmp_path / "m.mpf", machine_from_dict(MILL))
    assert program.end[-1].tolist() == [11.0, 5.0, 0.0]


def test_subprograms_of_the_builder_that_the_machine_file_names_move_nothing() -> None:
    known = {**MILL, "dialect": {"subprograms": ["TC"]}}
    assert read('TC("D8",1)\nG0 X1\nMSG()\nM30', known).end[-1].tolist() == [1, 0, 0]
    with pytest.raises(InputError, match=r"subprograms = \[\"TC\"\]"):
        read('TC("D8",1)\nG0 X1\nMSG()\nM30')


TILT = 'CYCLE800(0,"TABLE",100000,57,1,2,3,30,0,0,0,0,0,-1,100,1)\n'


def test_a_tilted_plane_turns_the_axes_and_its_points_are_the_tips() -> None:
    """A = 30 degrees about X: the table turns by -30 or 30, and (x, y, z) is at (1, 2, 3) + Rx(30) (x, y, z)."""
    program = read(TILT + "G0 X5 Y6 Z7\nG1 Z0 F500\nG2 X15 Y6 I5 J0\nCYCLE800()\nM30", FIVE)
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)

    def place(x: float, y: float, z: float) -> list[float]:
        return [1 + x, 2 + c * y - s * z, 3 + s * y + c * z]

    feed = np.flatnonzero(np.isin(program.kind, [Kind.LINE, Kind.SPLINE]))
    np.testing.assert_allclose(program.end[feed[0] - 1][:3], place(5, 6, 7), atol=1e-9)
    np.testing.assert_allclose(program.end[feed[0]][:3], place(5, 6, 0), atol=1e-9)
    np.testing.assert_allclose(program.end[feed[-1]][:3], place(15, 6, 0), atol=1e-9)
    assert abs(program.end[feed[0]][3]) == pytest.approx(math.pi / 6)
    assert program.kind[feed[-1]] == Kind.SPLINE
    # the tool's axis: the middle of the arc lies in the plane
    assert program.tool_point is not None
    assert program.tool_point.length == 20.0


def test_places_in_an_archive_are_those_of_the_file() -> None:
    text = "%_N_MAIN_MPF\nG0 X1\nAB\nM30\n%_N_AB_SPF\nG1 Y1 F100\nZ=MISSING\nRET\n"
    with pytest.raises(InputError, match="MISSING is not declared") as caught:
        read(text)
    assert (caught.value.line, caught.value.column) == (7, 3)


def test_the_remedy_of_an_arc_is_no_code_of_another_control() -> None:
    with pytest.raises(InputError, match="correct the centre or the end point"):
        read("G71 G0 X0 Y0\nG2 X10 Y0 I5 J=AC(0) F100\nG2 X30 Y0 I20 J0")


def test_a_missing_subprogram_says_where_its_file_belongs() -> None:
    with pytest.raises(InputError, match=r"put its file \(HOLE.SPF or HOLE.MPF\) beside the program"):
        read('G71 G0 X=1\nEXTCALL("HOLE")')


def test_a_lathe_that_the_machine_file_names_has_its_own_language() -> None:
    text = "G18 G90 G95 DIAMON\nS500 M4\nG0 X50 Z2\nG1 Z-20 F0.2\nG2 X60 Z-25 CR=5\nM30"
    program = read(text, {**MILL, "dialect": {"lathe": True}})
    np.testing.assert_allclose(program.end, [[25, 0, 2], [25, 0, -20], [30, 0, -25]], atol=1e-9)
    assert program.expansion is not None
    assert program.expansion.dialect == "siemens"


def test_programs_of_an_archive_keep_their_lines_and_share_its_bytes() -> None:
    data = b"".join(b"%%_N_P%d_SPF\r\nG1 X%d F100\r\nM17\r\n" % (k, k) for k in range(300))
    found = programs_of(data)
    assert len(found) == 300
    assert sum(len(one.body) for one in found.values()) <= len(data)  # it was the square of it
    lines = data.splitlines()
    for k, one in enumerate(found.values()):
        own = one.text().splitlines()
        assert own[3 * k + 1 : 3 * k + 3] == lines[3 * k + 1 : 3 * k + 3]
        assert not b"".join(own[: 3 * k + 1]).strip()


def test_set_and_rep_give_values_to_an_array_from_a_place_on() -> None:
    frame = "DEF REAL A[4]=SET(1,2,3,4), B[2]=SET(8,9)\n{}\nG71 G0 X=A[0] Y=A[1]\nX=A[2] Y=A[3]\nX=B[0] Y=B[1]\nM30"
    for line, values in (
        ("A[1]=SET(7,5)", [1, 7, 5, 4]),
        ("A[2]=REP(6)", [1, 2, 6, 6]),
        ("A[0]=REP(0) B[0]=3 A[3]=SET(2)", [0, 0, 0, 2]),
    ):
        found = parse_program(frame.format(line)).end[:2, :2].ravel()
        assert found.tolist() == values
    for line, said in (("A[3]=SET(1,2)", "A has 1 from there on"), ("A[R1]=SET(1)", "is a number here")):
        with pytest.raises(InputError, match=said):
            parse_program(frame.format(line))
