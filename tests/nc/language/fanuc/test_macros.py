"""Macros of Fanuc and Haas against programs written out, and numbers without a point."""

from __future__ import annotations

import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import DialectData, Machine, ToolData, load_machine
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import flat_program

FANUC = {
    "vacant": ("G1 X1 Y#5\n#1=#5\nIF [#1 EQ #0] GOTO 10\nX99\nN10 #1=0\nIF [#1 EQ #0] GOTO 20\nX[#5+2]\nN20 M30", "G1 X1\nX2"),
    "goto": ("#1=0\nN10 #1=#1+1\nG1 X#1\nIF [#1 LT 3] GOTO 10\nGOTO 30\nX99\nN30 Y1\nM30", "G1 X1\nX2\nX3\nY1"),
    "computed goto": ("#1=20\nGOTO #1\nN10 G1 X1\nN20 G1 X2\nM30", "G1 X2"),
    "then": ("IF [2 GT 1] THEN #1=5\nIF [2 LT 1] THEN #1=6\nG1 X#1\nM30", "G1 X5"),
    "loops": (
        "#1=1\nWHILE [#1 LE 2] DO 1\n#2=1\nWHILE [#2 LE 2] DO 2\nG1 X#1 Y#2\n#2=#2+1\nEND 2\n#1=#1+1\nEND 1\nM30",
        "G1 X1 Y1\nX1 Y2\nX2 Y1\nX2 Y2",
    ),
    "out of a loop": ("#1=0\nWHILE [1 EQ 1] DO 1\n#1=#1+1\nG1 X#1\nIF [#1 EQ 2] GOTO 9\nEND 1\nN9 Y5\nM30", "G1 X1\nX2\nY5"),
    "m98": ("G1 X1\nM98 P200 L2\nX0\nM30\nO200\nG91 X2\nG90\nM99", "G1 X1\nX3\nX5\nX0"),
    "m98 with its count": ("G1 X1\nM98 P30200\nM30\nO0200\nG91 X2\nG90\nM99", "G1 X1\nX3\nX5\nX7"),
    "m98 beside a move": ("G1 X1 M98 P200\nM30\nO200\nG1 Y1\nM99", "G1 X1\nY1"),
    "m99 to a block": ("G1 X1\nM98 P200\nX99\nN50 X2\nM30\nO200\nY1\nM99 P50", "G1 X1\nY1\nX2"),
    "m99 of the main program to a block": ("G1 X1\nM99 P50\nX99\nN50 X2\nM30", "G1 X1\nX2"),
    "m99 of the main program to one before": ("G1 X1\nN50 X2\nM99 P50\nX99\nM30", "G1 X1\nX2"),
    "m97": ("G1 X1\nM97 P100 L2\nX0\nM30\nN100 G91 Y1\nG90\nM99", "G1 X1\nY1\nY2\nX0"),
    "g65": ("#1=7\nG65 P300 A1.5 B2 I3 J4 K5 I6\nG1 X#1\nM30\nO300\nG1 X#1 Y#2 Z[#4+#5+#6+#7]\n#1=50\nM99", "G1 X1.5 Y2 Z18\nX7"),
    "g65 in g65": (
        "G65 P300 A1\nM30\nO300\nG65 P400 A[#1+1]\nG1 X#1\nM99\nO400\nG1 Y#1\n#100=#1*10\nG65 P500\nM99\nO500\nG1 Z#100 X#1\nM99",
        "G1 Y2\nZ20\nX1",
    ),
    "g66": ("G1 X1\n#1=3\nG66 P300 A[#1]\nX2\n#1=9\nX3\nG67\nX4\nM30\nO300\nG1 Z#1\nZ0\nM99", "G1 X1\nX2\nZ3\nZ0\nX3\nZ3\nZ0\nX4"),
    "and binds as *": ("#1=[1 OR 2 AND 2]\nG1 X#1 Y[7 AND 12] Z[5 XOR 1]\nM30\nGOTO1\nN1", "G1 X3 Y4 Z4"),
    "functions": (
        "#1=-2.5\nG1 X[FIX[#1]] Y[FUP[#1]] Z[ROUND[#1]]\nX[ATAN[-1]/[1]] Y[ABS[#1]+SQRT[9]] Z[BIN[37]-BCD[25]]\nM30\nGOTO1\nN1",
        "G1 X-2 Y-3 Z-3\nX315 Y5.5 Z-12",
    ),
    "system variables": (
        "G54\nG1 X3 Y4\n#5221=10\nG1 X[#5001+1] Y#5042 Z#4003\nM30\nGOTO1\nN1", "G1 X3 Y4\nX4 Y4 Z90",
    ),
    "dwell": ("G1 X1\nG4 P500\nG4 P1.5\nIF [1 EQ 1] GOTO 1\nN1 M30", "G1 X1\nG4 P0.5\nG4 P1.5"),
}  # fmt: skip


@pytest.mark.shows("read-fanuc", "exact: the same moves written out")
@pytest.mark.parametrize("name", FANUC)
def test_macros_move_as_their_written_form(name: str) -> None:
    macro, plain = FANUC[name]
    program = parse_program(f"%\nO1000\nG21 G90 F100\n{macro}\n%\n")
    assert program.expansion is not None
    assert program.expansion.dialect == "fanuc"
    same(program, parse_program(f"G21 F100\n{plain}\nM30\n"), apart=1e-12)


def test_numbers_without_a_point_are_least_increments() -> None:
    machine = Machine(
        name="fanuc",
        dt=1e-3,
        tolerance=0.05,
        axes={a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"},  # type: ignore[dict-item]
        dialect=DialectData(least_increment=0.001),
    )
    increments = "G21 F100\nG1 X1500 Y2. Z-250\nX#1 Y500\nX[1.5] Y2\nG3 X2500 Y2000 I500 J0\nM30\n"
    written_out = "G21 F100\nG1 X1.5 Y2 Z-0.25\nX#1 Y0.5\nX[1.5] Y0.002\nG3 X2.5 Y2 I0.5 J0\nM30\n"
    for tail in ("", "GOTO 1\nN1"):
        with pytest.raises(InputError, match="radius"):
            parse_program(increments + tail, machine)  # Y2 is 2 increments
        program = parse_program(increments.replace("Y2\n", "Y2.\n") + tail, machine)
        if tail:  # and back, with points
            found = flat_program(
                (increments.replace("Y2\n", "Y2.\n") + tail).encode(), machine, Reading(), source="x"
            )
            assert found is not None
            same(parse_program(found[0], machine), program, apart=1e-12)
        same(program, parse_program(written_out.replace("Y0.002", "Y2") + tail), apart=1e-12)
    inch = parse_program("G20 F10\nG1 X10000\nM30", machine)
    assert inch.end[0, 0] == pytest.approx(25.4)


def test_the_dialect_decides() -> None:
    text = "G21 F100\n#1=5\nG1 X[1 OR 2]\nM2\n"
    linuxcnc, fanuc = (parse_program(text, reading=Reading(dialect=name)) for name in ("linuxcnc", "fanuc"))
    assert linuxcnc.end[0, 0] == 1
    assert fanuc.end[0, 0] == 3


# Codes in force by their groups, and words (operator's manual of series 0i, system variables 4001 to 4130).
MODAL = {
    "G0 X1": {4001: 0}, "G1 X1": {4001: 1}, "G2 X2 I1": {4001: 2, 4002: 17}, "G3 X2 I1": {4001: 3}, "G18": {4002: 18},
    "G19": {4002: 19}, "G91": {4003: 91}, "X1": {4003: 90, 4006: 21, 4007: 40, 4008: 49, 4009: 80}, "G95 S50": {4005: 95},
    "G94": {4005: 94}, "G43 H2": {4008: 43, 4111: 2}, "G43 H2\nG49": {4008: 49}, "G0 X1\nG81 Z-1 R1": {4001: 0, 4009: 81},
    "G73 Z-1 R1 Q1": {4001: 1, 4009: 73}, "G81 Z-1 R1\nG80": {4001: 1, 4009: 80}, "G99": {4010: 99}, "G98": {4010: 98},
    "G55": {4014: 55}, "G61": {4015: 61}, "G64": {4015: 64}, "M8": {4113: 8}, "S500": {4119: 500}, "T3": {4120: 3},
}  # fmt: skip


@pytest.mark.parametrize("words", MODAL)
@pytest.mark.parametrize("block", [0, 200])
def test_a_program_may_ask_for_what_is_in_force(words: str, block: int) -> None:
    machine = load_machine("mill").model_copy(update={"tools": {"2": ToolData(length=5.0)}})
    for number, value in MODAL[words].items():
        program = parse_program(
            f"%\nO1\nG21 G90 G1 X0 F100\n{words}\n#1=#{number + block}\nG90 G1 X#1 F1\nM30\n%\n", machine
        )
        assert program.end[-1, 0] == value
