"""Small programs of every kind with the positions where each of their moves ends.

A construct stands on one line of a frame, and what it means is written as absolute positions in mm [x, y, z] beside it; the laws of
units, increments, numbers of lines, letter case, blanks and offsets make further programs of each, which lead to the same places.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from same_program import machine

from planner.base.units import MM_PER_INCH
from planner.nc.program import MOVES, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MACHINE = machine(
    tools={"1": {"length": 20.0, "diameter": 4.0}, "2": {"length": 5.0}},
    work_offsets={"g54": {"x": 0.0}, "g55": {"x": 10.0, "y": -5.0}, "g54.1p2": {"z": 4.0}},
    positions={"g28": {"x": 1.0, "y": 2.0, "z": 3.0}, "g30": {"x": -1.0}},
)


def ends(program: Program) -> list[list[float]]:
    """(moves, 3) where the moves end [mm], rounded to a micrometre."""
    return np.round(program.end[np.isin(program.kind, MOVES)][:, :3] + 0.0, 3).tolist()


def lead(text: str, reading: Reading | None = None) -> list[list[float]]:
    return ends(parse_program(text, MACHINE, reading or Reading()))


# --- RS274NGC: lines behind "G21 G90 F600, G0 X1 Y2 Z3", and where they lead ------------------------------------------------

Places = list[tuple[float, float, float]]
PLAIN: dict[str, Places] = {
    "G1 X4": [(4, 2, 3)],
    "G1 X4 Y5 Z6": [(4, 5, 6)],
    "G1 X4\nY5\nZ6": [(4, 2, 3), (4, 5, 3), (4, 5, 6)],
    "G0 X4\nG1 Y-5": [(4, 2, 3), (4, -5, 3)],
    "G91 G1 X4\nX4\nG90 X0": [(5, 2, 3), (9, 2, 3), (0, 2, 3)],
    "G2 X3 I1": [(3, 2, 3)],
    "G3 X1 Y6 J2 Z1": [(1, 6, 1)],
    "G3 X3 Y4 R2": [(3, 4, 3)],
    "G18 G2 X3 I1": [(3, 2, 3)],
    "G19 G3 Y4 J1": [(1, 4, 3)],
    "G2 I4": [(1, 2, 3)],
    "G92 X0 Y0\nG1 X4\nG92.1\nX4": [(5, 2, 3), (4, 2, 3)],
    "G52 X5\nG1 X4\nG52 X0\nX4": [(9, 2, 3), (4, 2, 3)],
    "G10 L2 P1 X3\nG1 X4": [(7, 2, 3)],
    "G10 L20 P1 X0\nG1 X4": [(5, 2, 3)],
    "G43 H1\nG1 Z5\nG49\nZ5": [(1, 2, 25), (1, 2, 5)],
    "G43.1 Z7\nG1 Z5": [(1, 2, 12)],
    "G1 @5 ^90": [(0, 5, 3)],
    "G1 X3 Y4\n@10": [(3, 4, 3), (6, 8, 3)],
    "G81 X5 Y5 Z-2 R1\nX6\nG80": [(5, 5, 3), (5, 5, 1), (5, 5, -2), (5, 5, 1), (6, 5, 1), (6, 5, -2), (6, 5, 1)],
    "G98 G82 X5 Z-2 R1 P1\nG80": [(5, 2, 3), (5, 2, 1), (5, 2, -2), (5, 2, 3)],
    "G83 X5 Z-2 R1 Q2\nG80": [(5, 2, 3), (5, 2, 1), (5, 2, -1), (5, 2, 1), (5, 2, -0.746), (5, 2, -2), (5, 2, 1)],
    "G5.1 X5 Y2 I2 J3": [(5, 2, 3)],
    "G5 X5 Y2 I1 J1 P-1 Q1": [(5, 2, 3)],
    "#1=4\nG1 X#1 Y[#1+1]": [(4, 5, 3)],
    "#<a>=4\nG1 X#<a>\nY[ABS[-5]] Z[6 MOD 4]": [(4, 2, 3), (4, 5, 2)],
    "o1 repeat [2]\nG91 G1 X1\no1 endrepeat\nG90": [(2, 2, 3), (3, 2, 3)],
    "#1=0\no1 while [#1 LT 2]\n#1=[#1+1]\nG1 X#1\no1 endwhile": [(1, 2, 3), (2, 2, 3)],
    "o1 if [1 GT 2]\nG1 X9\no1 else\nG1 X8\no1 endif": [(8, 2, 3)],
    "o<a> sub\nG1 X#1\no<a> endsub\no<a> call [7]": [(7, 2, 3)],
    "G1 X4 (out) Y5 ; in": [(4, 5, 3)],
    "/ G1 X900\nG1 X4": [(4, 2, 3)],
    "M3 S100\nG4 P1\nM5\nG1 X4": [(4, 2, 3)],
    "T1 M6\nG1 X4": [(4, 2, 3)],
    "G64 P0.1\nG61\nG1 X4": [(4, 2, 3)],
}  # fmt: skip
HEAD = "G21 G90 F600\nG0 X1 Y2 Z3\n"
_NUMBER = re.compile(r"(?<=[XYZIJKRQ@])(-?\d+\.?\d*)")


def in_inches(text: str) -> str:
    """The same lengths written in inch."""
    return _NUMBER.sub(lambda found: f"{float(found[1]) / MM_PER_INCH:.9f}", text).replace("G21", "G20")


def numbered(text: str) -> str:
    """With numbers before its lines."""
    lines = text.splitlines()
    return "\n".join(line if line[:1] in "/o#" else f"N{10 * k} {line}" for k, line in enumerate(lines, 1))


# What says the same in another way.
SAME: dict[str, Callable[[str], str]] = {
    "as it is": str,
    "small letters, no blanks": lambda text: (
        text.lower().replace(" ", "").replace("o1", "o1 ").replace(";in", "; in")
    ),
    "numbers of lines": numbered,
    "comments and blanks": lambda text: text.replace("\n", " (so)\t\r\n ; then\n"),
    "% and a name": lambda text: f"%part\n{text}\n%\nG1 X77\n",
}


@pytest.mark.parametrize("way", SAME)
@pytest.mark.parametrize("line", PLAIN)
def test_lines_lead_where_they_say(line: str, way: str) -> None:
    expected = [[1.0, 2.0, 3.0], *(list(map(float, place)) for place in PLAIN[line])]
    assert lead(SAME[way](HEAD + line + "\n")) == expected


METRIC = (
    "G43 H1",
    "G83",
    "#",
    "o1 repeat",
    "o<a>",
    "T1",
    "G64",
)  # the table's lengths, computed numbers, backing off


@pytest.mark.parametrize("line", [line for line in PLAIN if not line.startswith(METRIC)])
def test_inches_lead_to_the_same_places(line: str) -> None:
    assert lead(in_inches(HEAD + line)) == lead(HEAD + line)


@pytest.mark.parametrize(
    "line", [line for line in PLAIN if not re.search(r"G(10|92|52|[45]\d\.?1?|5\.1|5) |@", line)]
)
@pytest.mark.parametrize(("system", "moved"), [("G55", (10, -5, 0)), ("G54.1 P2", (0, 0, 4))])
def test_a_work_system_moves_every_place(line: str, system: str, moved: tuple[float, ...]) -> None:
    there = np.array(lead(HEAD + line)) + moved
    assert lead(f"{system}\n{HEAD}{line}") == pytest.approx(there, abs=2e-3)


# --- programs of the other kinds -------------------------------------------------------------------------------------------

FANUC = "O1000\nG21 G90 G17 G98 F600.\nG0 X1. Y2. Z3.\n"
LATHE = "O1\nG21 G99\nT0909\nG97 S500 M3\nG0 X20. Z5.\n"
PRINTER = "M83\nG21 G90\nG1 X1 Y2 Z3 F600\n"
HEIDENHAIN = "BEGIN PGM A MM\nTOOL CALL 0 Z S100\nL X+1 Y+2 Z+3 R0 FMAX\n"
SIEMENS = "G17 G90 G71 G94 F600\nG0 X1 Y2 Z3\nSTOPRE\n"
HPGL = "IN;SP1;VS10;PU0,0;"
# The kind's head, lines, the end, and where its moves lead behind that of the head.
KINDS: dict[str, tuple[str, str, list[tuple[str, Places]]]] = {
    "fanuc": (FANUC, "M30\n", [
        ("G1 X4.", [(4, 2, 3)]),
        ("#1=4.\nG1 X#1", [(4, 2, 3)]),
        ("#1=1\nWHILE [#1 LE 2] DO1\nG1 X[#1*5.]\n#1=#1+1\nEND1", [(5, 2, 3), (10, 2, 3)]),
        ("IF [1 EQ 2] GOTO 9\nG1 X4.\nN9 Y5.", [(4, 2, 3), (4, 5, 3)]),
        ("G68 X0 Y0 R90.\nG1 X5. Y0\nG69\nX1. Y2.", [(0, 5, 3), (1, 2, 3)]),
        ("G51.1 X0\nG1 X5.\nG50.1\nX5.", [(-5, 2, 3), (5, 2, 3)]),
        ("G51 X0 Y0 P2000\nG1 X5. Y2.\nG50", [(10, 4, 3)]),
        ("G16 G1 X5. Y90.\nG15", [(0, 5, 3)]),
        ("G81 X5. Y5. Z-2. R1.\nG80", [(5, 5, 3), (5, 5, 1), (5, 5, -2), (5, 5, 3)]),
        ("M98 P2000 L2\nG1 X0\nM30\nO2000\nG91 G1 X1.\nG90\nM99", [(2, 2, 3), (3, 2, 3), (0, 2, 3)]),
        ("G65 P2000 A4.\nM30\nO2000\nG1 X#1\nM99", [(4, 2, 3)]),
        ("G1 X4. ,C1.\nY5.", [(3, 2, 3), (4, 3, 3), (4, 5, 3)]),
        ("G28 X0", [(0, 2, 3), (1, 2, 3)]),
        ("G91 G28 Z0\nG90", [(1, 2, 3), (1, 2, 3)]),
        ("G43 H1 Z5.", [(1, 2, 25)]),
        ("G54.1 P2 G1 Z1.", [(1, 2, 5)]),
        ("G4 X1.\nG1 X4.", [(4, 2, 3)]),
    ]),
    "lathe": (LATHE, "M30\n", [
        ("G1 X10. Z0 F.2", [(5, 0, 0)]),
        ("G1 U-4. W-2. F.2", [(8, 0, 3)]),
        ("G90 X16. Z-10. F.2\nG0 X20.", [(8, 0, 5), (8, 0, -10), (10, 0, -10), (10, 0, 5), (10, 0, 5)]),
        ("G28 U0 W0", [(10, 0, 5), (1, 0, 3)]),
        ("G2 X24. Z3. R2. F.2", [(12, 0, 3)]),
        ("G50 S2000\nG96 S100\nG1 X10. F.2\nG97 S500", []),
    ]),
    "printer": (PRINTER, "", [
        ("G1 X4 E.5", [(4, 2, 3)]),
        ("M104 S200\nM106 S255\nG1 X4", [(4, 2, 3)]),
        ("T0\nM117 X9 now\nG1 X4", [(4, 2, 3)]),
        ("G92 E0\nG2 X3 I1 E.2", [(3, 2, 3)]),
        ("SET_GCODE_OFFSET Z=0.5\nG1 X4 Z3", [(4, 2, 3.5)]),
        ("G28\nG1 X4", [(1, 2, 3), (4, 2, 3)]),
        ("SAVE_GCODE_STATE NAME=a\nG91\nG1 X1\nRESTORE_GCODE_STATE NAME=a\nG1 X4", [(2, 2, 3), (4, 2, 3)]),
        ("N1 G1 X4*12\nN2 G1 Y5*77", [(4, 2, 3), (4, 5, 3)]),
    ]),
    "heidenhain": (HEIDENHAIN, "END PGM A MM\n", [
        ("L X+4 F600", [(4, 2, 3)]),
        ("L IX+4 F600\nL IY-1", [(5, 2, 3), (5, 1, 3)]),
        ("CC X+2 Y+2\nC X+3 Y+2 DR- F600", [(3, 2, 3)]),
        ("CR X+3 Y+4 R+2 DR+ F600", [(3, 4, 3)]),
        ("CC X+0 Y+0\nLP PR+5 PA+90 F600", [(0, 5, 3)]),
        ("CC X+1 Y+0\nCP IPA+180 DR+ F600", [(1, -2, 3)]),
        ("Q1 = 2 * 2\nL X+Q1 F600", [(4, 2, 3)]),
        ("FN 0: Q1 = +4\nFN 1: Q2 = +Q1 + +1\nL X+Q1 Y+Q2 F600", [(4, 5, 3)]),
        ("LBL 1\nL IX+1 F600\nLBL 0\nCALL LBL 1 REP 2", [(2, 2, 3), (3, 2, 3), (4, 2, 3)]),
        ("CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nL X+4 F600", [(14, 2, 3)]),
        ("CYCL DEF 8.0 MIRROR IMAGE\nCYCL DEF 8.1 X\nL X+4 F600", [(-4, 2, 3)]),
        ("CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nL X+5 Y+0 F600", [(0, 5, 3)]),
        ("CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL 2\nL X+5 Y+2 Z+3 F600", [(10, 4, 6)]),
        ("L X+4 F600 ; to the right", [(4, 2, 3)]),
    ]),
    "siemens": (SIEMENS, "M30\n", [
        ("G1 X4", [(4, 2, 3)]),
        ("G1 X=4 Y=2+3", [(4, 5, 3)]),
        ("G1 X=IC(4)\nY=AC(5)", [(5, 2, 3), (5, 5, 3)]),
        ("G3 X3 Y4 CR=2", [(3, 4, 3)]),
        ("R1=4\nG1 X=R1", [(4, 2, 3)]),
        ("DEF REAL A=4\nG1 X=A", [(4, 2, 3)]),
        ("TRANS X10\nG1 X4\nTRANS\nX4", [(14, 2, 3), (4, 2, 3)]),
        ("ROT RPL=90\nG1 X5 Y0\nROT", [(0, 5, 3)]),
        ("MIRROR X0\nG1 X4\nMIRROR", [(-4, 2, 3)]),
        ("SCALE X2\nG1 X4\nSCALE", [(8, 2, 3)]),
        ("FOR R1=1 TO 2\nG1 X=R1*5\nENDFOR", [(5, 2, 3), (10, 2, 3)]),
        ("IF 1>2\nG1 X9\nELSE\nG1 X8\nENDIF", [(8, 2, 3)]),
        ("GOTOF ENDE\nG1 X9\nENDE: G1 X8", [(8, 2, 3)]),
        ("G111 X0 Y0\nG1 AP=90 RP=5", [(0, 5, 3)]),
        ("SUPA G0 X4", [(4, 2, 3)]),
    ]),
    "hpgl": (HPGL, "", [
        ("PD400,0;", [(10, 0, 0)]),
        ("PD400,0,400,800;", [(10, 0, 0), (10, 20, 0)]),
        ("PR;PD400,0,400,0;", [(10, 0, 0), (20, 0, 0)]),
        ("PU400,0;PD400,400;", [(10, 0, 0), (10, 10, 0)]),
        ("PD;PA400,400;", [(10, 10, 0)]),
    ]),
}  # fmt: skip
CASES = [(kind, k) for kind, (_, _, lines) in KINDS.items() for k in range(len(lines))]


@pytest.mark.shows("read-linuxcnc", "exact: positions worked out by hand, cutter compensation by geometry")
@pytest.mark.parametrize(("kind", "k"), CASES)
def test_programs_of_a_kind_lead_where_they_say(kind: str, k: int) -> None:
    head, tail, lines = KINDS[kind]
    line, places = lines[k]
    before = lead(head + tail)
    after = lead(head + line + "\n" + tail)
    assert after[: len(before)] == before
    if places:
        assert after[len(before) :] == [list(map(float, place)) for place in places]


def test_there_are_two_hundred_of_them() -> None:
    assert len(PLAIN) * len(SAME) + len(CASES) >= 200
