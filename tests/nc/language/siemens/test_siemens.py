"""Sinumerik programs against the same moves written out in RS274NGC."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import load_machine
from planner.nc.program import Kind, PathControl, Program
from planner.nc.reader import parse_program, read_program
from planner.nc.reading import Reading

MILL = load_machine("mill")
REAL = (
    Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[5] / "shared"))
    / "nc"
    / "121philip__SINUMERIK-840D-sl-CAS-Package__CAM_TEST.MPF"
)
SIEMENS = Reading(dialect="siemens")


def read(text: str) -> Program:
    return parse_program(text, MILL, SIEMENS)


def assert_reads_as(found: Program, text: str) -> None:
    """The same motion as that of a program in RS274NGC."""
    same(found, parse_program(text, MILL), apart=1e-9)


def test_words_with_values_and_coordinates_of_both_kinds() -> None:
    found = read(
        """N10 DEF REAL _HOME=5, W
N20 G17 G710 G90 G94 FNORM FFWON SOFT ; comment
N25 T="MILL 8" M6 MSG("cut; now")
N30 G0 X10.5 Y=_HOME Z=2*(_HOME+1) S3000 M3 D1
N40 G1 X=IC(4) Y=AC(7) F=R1+600
N50 G3 X20 Y=IC(10) CR=8
N60 G2 X=AC(30) I=AC(25) J0 G64
N70 G91 G1 X=AC(0) Y5
N80 G90 G4 F1.5
N90 G0 SUPA Z=-3
M30"""
    )
    assert_reads_as(
        found,
        """G21 G90 G94
T0 M6
G0 X10.5 Y5 Z12
G1 X14.5 Y7 F600
G3 X20 Y17 R8
G2 X30 I5 J0
G1 X0 Y22
G4 P1.5
G53 G0 Z-3
M30""",
    )
    assert found.line.tolist()[1:4] == [4, 5, 6]


def test_loops_branches_and_jumps() -> None:
    found = read(
        """DEF INT K
DEF REAL A
R5=10 R[6]=POT(3)
G0 X0 Y0
FOR K=1 TO 3
  G1 X=K*R5 F600
ENDFOR
WHILE A<2
  A=A+1
  IF A==1
    Y=R6
  ELSE
    Y=-A
  ENDIF
ENDWHILE
REPEAT
  A=A-1
  Z=A
UNTIL A<=0
LOOP
  R1=R1+1
  IF R1>2 GOTOF DONE
  X=IC(-1)
ENDLOOP
DONE: X=SQRT(16)*SIN(30)+TRUNC(7.9)+5 MOD 3
AGAIN:
Y=IC(1)
REPEAT AGAIN P=2
IF NOT (R1==4) AND TRUE GOTOF N900
X999
N900 Z=7 DIV 2"""
    )
    assert_reads_as(
        found,
        "G21 G0 X0 Y0\nG1 X10 F600\nX20\nX30\nY9\nY-2\nZ1\nZ0\nX29\nX28\nX11\nY-1\nY0\nY1\nZ3",
    )


def test_drilling_cycles_shifts_and_tolerance() -> None:
    found = read(
        """G90 G0 X0 Y0 Z30 F300
TRANS X10
ATRANS X5 Z1
CYCLE832(0.03,_NO)
X0
CYCLE82(20,0,2,-10,,0.5)
MCALL CYCLE81(10,0,3,,8)
X20
G0 X30 Y5
MCALL
X40
TRANS
X1""".replace("_NO", "1")
    )
    assert_reads_as(
        found,
        """G21 G90 G0 X0 Y0 Z30 F300
G52 X15 Z1
X0
Z2
G1 Z-10
G4 P0.5
G0 Z20
X20
Z3
G1 Z-8
G0 Z10
G0 X30 Y5
Z3
G1 Z-8
G0 Z10
X40
G52 X0 Z0
X1""",
    )
    assert found.path_control[2] == PathControl.BLEND
    assert found.tolerance[2] == 0.03


@pytest.mark.parametrize("out", [0, 1])
def test_deep_holes_are_drilled_by_infeeds(out: int) -> None:
    found = read(f"G90 G0 X0 Y0 Z30 F300\nCYCLE83(20,0,2,-20,,-8,,3,0,0,1,{out})")
    back = [-7, 2][out]
    feeds = found.end[found.kind == Kind.LINE, 2].tolist()
    assert feeds == pytest.approx([-8, -13, -16, -18, -20])
    assert found.end[3, 2] == back
    assert found.end[-1, 2] == 20
    assert read("G0 Z30 F300\nCYCLE83(20,0,2,-20,,-30,,0,0,0,1,1)").end[2, 2] == -20


def test_exact_stops_and_units() -> None:
    found = read("G700 G60 G1 X1 F60\nG64\nG9 X2\nX3")
    assert found.path_control[0] == PathControl.EXACT_STOP
    assert found.end[-1, 0] == pytest.approx(76.2)
    assert Kind.STOP in found.kind.tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G0 X0\nCYCLE800(0,,0,57,0,0,0,30,0,0)", r"<text>:2:1: .*no table \[kinematics\]"),
        ("G0 X0\nROTS X30", "<text>:2:1: .*ROTS is not read"),
        ("G0 X0\nSCALE X0", "a scale of 0"),
        ("SCALE X2\nG1 X1 F100\nG2 X3 I1", "<text>:3:1: .*scales unevenly"),
        ("G1 X1 F100 RND=2\nM30", "<text>:2:1: .*rounding or chamfer of line 1 needs"),
        (
            "G1 X9 F100 RND=2\nX5",
            "<text>:2:1: .*takes more of a move than there is",
        ),  # benchmarks/fuzz: a bug
        ("G1 X1 F100 RND=2\nY1", "<text>:2:1: .*takes more of a move than there is"),
        ("CIP X1 Y1 I1=2 J1=2", "points of CIP lie on a line"),
        ("G1 X1 F100\nCT X3", "lies straight ahead"),
        ("G1 X1 F100\nCT X3 Y1\nX7 Y2", "<text>:3:1: .*read in each of their lines"),
        ("G41 KONT X1", "KONT is not read: compensation approaches"),
        ("G41 G451 X1", "G451 is not read: outer corners"),
        ("TRANSMIT", "TRANSMIT is not read: a face"),
        ("TRAORI", "TRAORI is not read"),
        (
            "G0 X0\nG1 X1 A3=0 B3=0 C3=1 F100",
            "<text>:2:7: .*A3 is not read: a direction of the tool, .*angles of the rotary axes",
        ),
        ("X=FOO", "<text>:1:3: .*FOO is not declared"),
        ("CYCLE800(0,,0,192,0,0,0,30,0,0)", "MODE 192 of CYCLE800"),
        ("POCKET3(1,2)", "POCKET3 needs SDIS"),
        ("MCALL POCKET3(1)", "MCALL POCKET3 is not read"),
        ("IF R1==1", "this IF has no end"),
        ("ENDWHILE", "no WHILE open"),
        ("G1 X=1/0 F100", "<text>:1:1: .*division by zero"),
        ("GOTOF NOWHERE", "to go to"),
        ("REPEAT NOWHERE", "no label NOWHERE"),
        ("G187 X1", "G187: no G code of a Sinumerik"),
        ("DEF REAL A[2]\nX=A[2]", "index 2 of an array of 2 values"),
        ("CYCLE81(1,2)", "CYCLE81 needs SDIS"),
        ("X=(1", r"\) is expected"),
        ("X=R1000", "R0 to R999"),
        ("G4 S3", "needs the spindle's speed S"),
        ("LOOP\nENDLOOP", "stopped after 10,000 turns of loops"),
    ],
)
def test_what_is_not_read_is_refused_with_its_place(
    text: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.nc.language.run.TURNS_MAX", 10_000)
    with pytest.raises(InputError, match=said):
        read(text)


@pytest.mark.skipif(not REAL.exists(), reason="../shared/nc is not here")
def test_a_real_program_is_recognised_and_read() -> None:
    found = parse_program(REAL.read_bytes(), MILL)
    assert len(found) == 980
    assert found.expansion is not None
    assert found.expansion.dialect == "siemens"


def test_mutated_programs_end_in_a_program_or_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.nc.language.run.TURNS_MAX", 2_000)
    rng = np.random.default_rng(3)
    base = (
        "DEF REAL A=2, B\nG17 G90 G0 X10 Y=A*(3+B) Z=IC(5) F600\nFOR R1=1 TO 3\nG1 X=R1 Y=AC(4)\nENDFOR\nIF A>1 GOTOF E1\nX9\n"
        'E1: CYCLE82(20,0,2,-10,,0.5)\nMSG("x")\nMCALL CYCLE81(10,0,3,,8)\nX5\nMCALL\nG2 X=IC(4) I=AC(7) J0\nTRANS X3\nM30\n'
    )
    pieces = base.split()
    refused = 0
    for _ in range(200):
        text = base
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(0, len(text)))
            cut = int(rng.integers(0, 9))
            text = text[:at] + " " + str(rng.choice(pieces)) + " " + text[at + cut :]
        try:
            read(text)
        except InputError:
            refused += 1
    assert 0 < refused < 200


SUBPROGRAMS = {
    "HOLE.SPF": "PROC HOLE(REAL DEPTH, INT TWICE)\nDEF REAL A=5\nG1 Z=-DEPTH\nIF TWICE==1\nG1 Z=-2*DEPTH\nENDIF\nG0 Z=A\nRET\nG0 X99\n",
    "ROW.SPF": ";no first line\nG91 X2\nG90\nM17\n",
    "L10.SPF": "R1=R1+1\nG1 Y=R1\nM30\n",
    "10_deep.spf": "N10 TRANS X100\nG1 X1\nHOLE(1)\nM17\n",
}


def test_subprograms_in_files_of_their_own(tmp_path: Path) -> None:
    for name, text in SUBPROGRAMS.items():
        (tmp_path / name).write_text(text)
    main = 'DEF REAL A=7\nEXTERN HOLE(REAL, INT)\nG0 X0 Y0 Z5 F100\nG1 X1\nHOLE(3, 1)\nROW P3\nL10\nL10\nCALL "10_DEEP"\nG1 X=A\nM30\n'
    (tmp_path / "main.mpf").write_text(main)
    program = read_program(tmp_path / "main.mpf", reading=Reading(dialect="siemens"))
    written = "G21 G90 G0 X0 Y0 Z5 F100\nG1 X1\nG1 Z-3\nZ-6\nG0 Z5\nX3\nX5\nX7\nG1 Y1\nY2\nG1 X101\nZ-1\nG0 Z5\nG1 X107\nM30\n"
    same(program, parse_program(written))
    assert program.expansion is not None
    assert dict(program.expansion.calls) == {"hole": 2, "row": 3, "l10": 2, "10_deep": 1}
    place = program.place(len(program) - 2)
    assert "HOLE.SPF" in place
    assert "called from line 3" in place


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("NOFILE", "no such subprogram"),
        ("HOLE(1", "missing"),
        ("CALL 5", "followed by the name"),
        ("SLOT1(1,2)", "SLOT1 needs NUM"),
        ("HOLE(1) X5", "not expected"),
    ],
)
def test_calls_that_lead_nowhere_are_refused(call: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "HOLE.SPF").write_text(SUBPROGRAMS["HOLE.SPF"])
    (tmp_path / "main.mpf").write_text(f"G0 X1\n{call}\nM30\n")
    with pytest.raises(InputError, match=said) as found:
        read_program(tmp_path / "main.mpf", reading=Reading(dialect="siemens"))
    assert found.value.line == 2


def test_patterns_of_holes() -> None:
    head = "G0 X0 Y0 Z10 F100\nMCALL CYCLE81(5,0,2,-3)\n"
    row = read(head + "HOLES1(10,20,30,5,4,3)\nMCALL\nG0 X0 Y0\nM30")
    holes = row.end[row.kind == Kind.LINE]
    along = 5 + 4 * np.arange(3)
    np.testing.assert_allclose(holes[:, 0], 10 + along * np.cos(np.pi / 6), atol=1e-12)
    np.testing.assert_allclose(holes[:, 1], 20 + along * np.sin(np.pi / 6), atol=1e-12)
    assert (holes[:, 2] == -3).all()
    assert row.end[-1].tolist() == [0, 0, 5]
    for step, apart in ((0, 72.0), (20, 20.0)):
        circle = read(head + f"HOLES2(1,2,15,10,{step},5)\nMCALL\nM30")
        holes = circle.end[circle.kind == Kind.LINE]
        angle = np.radians(10 + apart * np.arange(5))
        np.testing.assert_allclose(
            holes[:, :2], np.stack([1 + 15 * np.cos(angle), 2 + 15 * np.sin(angle)], axis=1), atol=1e-12
        )
    for text, said in (
        ("HOLES1(1,2,3,4,5,6)", "stands behind MCALL"),
        ("MCALL CYCLE81(5,0,2,-3)\nHOLES2(1,2,,0)", "needs RAD"),
        ("R1=1EX308*10\nCYCLE81(5,0,2,-R1)", ":2:1: R1=.*the result is too large"),
        ("R1=1EX308\nCYCLE81(5,0,2,-3-R1*10)", ":3:1: .*the result is too large"),
        (
            "MCALL CYCLE81(5,0,2,-3)\nR1=1EX308\nHOLES1(R1,R1,0,R1,R1,3)",
            ":4:1: HOLES1: the result is too large",
        ),
    ):
        with pytest.raises(InputError, match=said):
            read(f"G0 X0\n{text}\nM30")
