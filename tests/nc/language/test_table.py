"""The table of the language (docs/language.md): every row has a program here, which is read, or refused as the row says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from planner.base.errors import InputError
from planner.machine.files import machine_from_dict
from planner.nc.reader import parse_program, read_program

PAGE = Path(__file__).resolve().parents[3] / "docs" / "language.md"
AXIS = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5}
MILL = {
    "name": "table",
    "dt": 1e-3,
    "tolerance": 0.02,
    "feed_default": 10.0,
    "axes": dict.fromkeys("xyz", AXIS),
}
TOOLED = {**MILL, "tools": {"1": {"length": 20.0, "diameter": 2.0}}}
FIVE = {
    **MILL,
    "axes": dict.fromkeys("xyzac", AXIS),
    "kinematics": {"type": "xyzac-trt", "tool_length": 20.0},
}
LATHE = {**MILL, "dialect": {"lathe": True}}
FIRST = "G21 G90 G17 G94 G0 X0 Y0 Z0\n"
TURN = "G21 S500 M3 G99 G0 X50. Z2. F0.2\n"
CYCLES = [
    (73, "Q.5"),
    (81, ""),
    (82, "P.1"),
    (83, "Q.5"),
    (84, ""),
    (85, ""),
    (86, "P.1"),
    (88, "P.1"),
    (89, "P.1"),
    (74, "M4"),
]
PROFILE = "N10 G0 X20.\nG1 Z-10. F0.2\nX40. Z-20.\nN20 X50.\n"

# By what the row begins with: programs with their number of moved places at least, and pieces of messages with programs refused.
READ: dict[str, list[tuple[str, dict]]] = {
    "parameters `#1`": [(FIRST + "#1=5\n#2=1\nG1 X#1 Y##2 Z#[1+0] F600", MILL)],
    "named parameters": [(FIRST + "#<a>=5\n#<_mine>=2\nG1 X#<a> Y#<_mine> F600", MILL)],
    "predefined names": [(FIRST + "G1 X5 F600\nG1 Y[#<_x>+1]\nX[#<_feed>/100]", MILL)],
    "expressions, functions": [(FIRST + "#1=[2*SIN[30]+SQRT[16]-ABS[-1]]\nG1 X#1 F600", MILL)],
    "assignments after": [(FIRST + "#1=3 #2=4\nG1 X#1 Y#2 F600", MILL)],
    "value without assignment": [(FIRST + "G1 X[#9+2] F600", MILL)],
    "`o1 sub`": [(FIRST + "o1 sub\nG1 X#1 F600\no1 return\no1 endsub\no1 call [5]\nM2", MILL)],
    "a value behind `return`": [
        (FIRST + "o1 sub\no1 endsub [#1+1]\no1 call [5]\nG1 X#<_value> F600\nM2", MILL)
    ],
    "`o1 if`": [
        (
            FIRST
            + "F600\n#1=0\no1 while [#1 LT 3]\n#1=[#1+1]\nG1 X#1\no1 endwhile\no2 repeat [2]\nG91 G1 Y1\no2 endrepeat\nM2",
            MILL,
        )
    ],
    "macros of Klipper": [
        ("M83\nGO_THERE X=5\nGO_THERE X=6\n", {**MILL, "gcode_macros": {"GO_THERE": "G1 X{params.X} F600"}})
    ],
    "`elseif`": [
        (FIRST + "#1=2\no1 if [#1 EQ 1]\nG1 X1 F9\no1 elseif [#1 EQ 2]\nG1 X5 F600\no1 endif\nM2", MILL)
    ],
    "M98 P L": [
        ("O1\n" + FIRST + "G1 F600\nM98 P1000 L2\nM98 P31000\nM30\nO1000\nG91 G1 X1\nG90\nM99\n", MILL),
    ],
    "G65 with letter": [("O1\n" + FIRST + "G65 P9000 A5. F600.\nM30\nO9000\nG1 X#1 F#9\nM99\n", MILL)],
    "IF GOTO": [
        (
            FIRST
            + "#1=0\nN5 #1=#1+1\nG1 X#1 F600\nIF [#1 LT 3] GOTO 5\nWHILE [#1 GT 1] DO 1\n#1=#1-1\nY#1\nEND 1\nM30\n",
            MILL,
        )
    ],
    "state of the control": [(FIRST + "G1 X5 F600\nG1 Y#5420", MILL)],
    "M70 to M73": [(FIRST + "F600\nM70\nG91 G1 X1\nM72\nG1 X5", MILL)],
    "DEBUG, PRINT": [(FIRST + "#1=2\n(DEBUG, #1)\n(PRINT, #1)\n(MSG, ready)\nG1 X5 F600", MILL)],
    "numbers without a point": [(FIRST + "G1 X5000 F600", {**MILL, "dialect": {"least_increment": 0.001}})],
    "`/` and `/2`": [(FIRST + "/ G1 X900 F600\n/2 G1 X900\nG1 X5 F600", MILL)],
    "G0 G1 G2": [
        (
            FIRST + "G20 G91 F20 G1 X.1\nG2 X.1 Y.1 J.1\nG3 X-.1 Y.1 R.1\nG4 P.1\nG21 G90 G18\nG19\n"
            "G17 G53 G0 X0\nG54 G92 X5\nG1 X6\nG92.1\nG28\nG30",
            MILL,
        )
    ],
    "arcs with P turns": [(FIRST + "F600 G2 X0 I5 P3\nG90.1\nG2 X10 I5 J0", MILL)],
    "G59.1-G59.3": [(FIRST + "G10 L2 P7 X5\nG59.1 G1 X1 F600\nG52 X2\nX1\nG52 X0\nG59.3", MILL)],
    "G54.1 P1": [
        ("O1\n" + FIRST + "G54.1 P3 G1 X5. F600", {**MILL, "work_offsets": {"g54.1p3": {"x": 2.0}}})
    ],
    "G10 L2, L20": [(FIRST + "G10 L2 P1 X5\nG1 X1 F600\nG10 L20 P1 X0\nG1 X2", MILL)],
    "G61, G61.1": [(FIRST + "G61 G1 X5 F600\nG61.1 Y5\nG64 P.1 Q.05 X0", MILL)],
    "G43, G43.1": [(FIRST + "T1 M6\nG43 H1 G1 Z5 F600\nG43.1 Z3\nG1 Z6\nG43.2 H1\nG49 G1 Z9", TOOLED)],
    "G41, G42": [(FIRST + "T1 M6\nG41 D1 G1 X5 F600\nY9\nX9\nG40 X20", TOOLED)],
    "G73, G74": [
        (FIRST + "F600 S600 M3\n" + "".join(f"G{n} X{n} Z-2 R1 {more}\nG80\n" for n, more in CYCLES), MILL)
    ],
    "G33, G33.1": [("G21 G18 G0 X0 Y0 Z9\nS300 M3\nG33 Z-5 K1\nG0 Z9\nG76 P1 Z-5 I-.1 J.1 K.5 Q29", MILL)],
    "G93, G95": [(FIRST + "G93 G1 X5 F30\nS300 M3 G95 X9 F.1\nG94 G96 D1500 S200\nG97 S300\nX0 F600", MILL)],
    "G5, G5.1": [
        (
            FIRST
            + "F600 G5 I1 J1 P-1 Q1 X5 Y0\nG5.1 I2 J2 X9 Y0\nG5.2 P1 X10 Y1 L3\nX11 Y2 P1\nX12 Y0 P1\nG5.3",
            MILL,
        )
    ],
    "G43.4, M428": [
        (FIRST + f"{on}\nG1 X5 A3 F600\nX0 C9\nG0 A0 C0\n{off}\nG1 X9", FIVE)
        for on, off in (("G43.4 H1", "G49"), ("M428", "M429"), ("M128", "M129"))
    ],
    "G6.2 NURBS": [
        (FIRST + "G1 X0 F600\nG6.2 P4 K0 X0 Y0\nK0 X5 Y9\nK0 X9 Y9\nK0 X15 Y0\nK1\nK1\nK1\nK1", MILL)
    ],
    "`@`, `^`": [(FIRST + "G1 X4 F600\n@5 ^30\nG91 ^20", MILL)],
    "lathe: G7 G8": [("G21 G18 G7 G0 X9 Y0 Z0\nG1 X5 F600\nG8 X9", MILL)],
    "lathe: drilling": [(TURN + "G83 Z-20. Q3000 F0.1\nG80", LATHE)],
    "G68 G69": [
        (
            "O1\n"
            + FIRST
            + "G68 X1. Y2. R30.\nG1 X5. F600\nG69\nG51 X0 P2000\nX9.\nG50\nG51.1 X0\nX8.\nG50.1\nG16 X9. Y30.\nG15",
            MILL,
        )
    ],
    "G12 G13": [("O1\n" + FIRST + "G13 I5. Z-1. F600\nG81 X0 Z-2. R1. L0\nG70 I9. L4", MILL)],
    "`,R`, `,C`": [("O1\n" + FIRST + "G1 X9. F600 ,R2.\nY9. ,C1.\nX0\nY5. ,A30.", MILL)],
    "lathe: U W": [
        (
            TURN + "G1 X40.\nU2. W-3.\nG98 F200 X30.\nG50 S3000\nG96 S150\nT0203\nG97 S300\nG32 Z-20. F1.5",
            LATHE,
        )
    ],
    "lathe: G70 G71": [
        (TURN + "G71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.2\n" + PROFILE + "G70 P10 Q20\nM30\n", LATHE)
    ],
    "lathe: G90 G92": [
        (
            TURN
            + "G90 X40. Z-20.\nX38.\nG0 X50.\nG94 X30. Z-1.\nG0 X50. Z2.\nG92 X39. Z-20. F1.5\nG0 Z2.\nG74 R.5\nG74 Z-9. Q3000 F.1",
            LATHE,
        )
    ],
    "M62 to M68": [(FIRST + "M62 P1\nM63 P1\nM64 P0\nM65 P0\nM67 E0 Q5\nM68 E0 Q5\nG1 X5 F600", MILL)],
}
REFUSED: dict[str, list[tuple[str, dict]]] = {
    "predefined names": [
        (FIRST + "G1 X#<_hal[motion.x]> F600", MILL),
        (FIRST + "G1 X#<_ini[A]B> F600", MILL),
    ],
    "state of the control": [(FIRST + "#5420=1\nG1 X5 F600", MILL)],
    "lathe: G12.1, G87": [(TURN + "G12.1\nG1 X20. C5.", LATHE), (TURN + "G87 Z-20. Q3000 F0.1", LATHE)],
    "G43.4, M428": [(FIRST + "G43.4 H1\nG1 X5 A3 F600\nG49", MILL)],
    "G38.2 to G38.5": [(FIRST + "G38.2 Z-5 F60", MILL), (FIRST + "M66 P0 L3 Q5\nG1 X5 F600", MILL)],
}
OTHER_FILE = "a call to another file"


def rows() -> list[str]:
    """The first columns of the table."""
    text = (
        PAGE.read_text(encoding="utf-8")
        .partition("## What is read")[2]
        .partition("\n## ")[0]
        .partition("\n### ")[0]
    )
    table = [line for line in text.splitlines() if line.startswith("|")]
    return [re.split(r"(?<!\\) \| ", line[2:])[0] for line in table[2:]]


def read(text: str, settings: dict, tmp_path: Path):
    return parse_program(text, machine_from_dict(settings), source=str(tmp_path / "row.ngc"))


def test_every_row_has_a_program():
    named = [*READ, *REFUSED, OTHER_FILE]
    without = [row for row in rows() if not any(row.startswith(name) for name in named)]
    unused = [name for name in named if not any(row.startswith(name) for row in rows())]
    assert (without, unused) == ([], [])


@pytest.mark.parametrize("name", READ)
def test_what_a_row_says_is_read(name, tmp_path):
    for text, settings in READ[name]:
        program = read(text, settings, tmp_path)
        assert len(program.end) > 1
        assert abs(program.end).max() > 0.5


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_row_says_is_refused(name, tmp_path):
    for text, settings in REFUSED[name]:
        with pytest.raises(InputError, match=r"row.ngc:\d+:\d+: "):
            read(text, settings, tmp_path)


def test_a_call_to_another_file_of_the_folder(tmp_path):
    machine, program = machine_from_dict(MILL), tmp_path / "jobs" / "row.ngc"
    (tmp_path / "jobs" / "below").mkdir(parents=True)
    other = tmp_path / "jobs" / "below" / "other.ngc"
    other.write_text("o<other> sub\nG1 X[#1] F600\no<other> endsub\n")
    program.write_text(FIRST + "o<other> call [7]\nM2\n")
    assert read_program(program, machine).end[-1, 0] == 7.0
    other.rename(tmp_path / "other.ngc")
    with pytest.raises(InputError, match=r"row.ngc:\d+:\d+: "):
        read_program(program, machine)
