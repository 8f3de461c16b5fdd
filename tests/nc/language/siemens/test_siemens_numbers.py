"""Units, diameters, kinds of numbers and leads of Sinumerik programs."""

from __future__ import annotations

import numpy as np
import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import load_machine
from planner.machine.parts import DialectData
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MILL = load_machine("mill")
SIEMENS = Reading(dialect="siemens")


def read(text: str) -> Program:
    return parse_program(text, MILL, SIEMENS)


def test_f_has_the_unit_that_the_control_starts_with_under_g70_and_g71() -> None:
    """G70 and G71 are of lengths alone; G700 and G710 of F, too, also on their own line (G functions, group 13)."""
    text = "G70 G90 G0 X1\nG1 X2 F100\nG95 S100 X3 F2\nG93 X4 F2\nG94 X5 F=R1+50\nG71 X1\nG700 X2 F10\nX3 F20"
    feeds = [100, 200, 50.8, 50, 50, 254, 508, 508, 9, 8]
    found = read(f"{text}\nG70 X4\nX5 F9\nG710 X6 F8")
    assert (found.feed[1:] * 60).tolist() == pytest.approx(feeds)
    inch = MILL.model_copy(update={"dialect": DialectData(inch=True)})
    found = parse_program("G90 G1 X1 F1\nG71 X2 F2\nX3\nG70 X4 F3\nG710 X5 F4", inch, SIEMENS)
    assert (found.feed * 60).tolist() == pytest.approx([25.4, 50.8, 50.8, 76.2, 4])
    assert found.end[:, 0].tolist() == pytest.approx([25.4, 2, 3, 101.6, 5])


def test_diameters_are_those_of_steps_positions_poles_and_points_of_arcs_too() -> None:
    """DIAMON: G90, G91, AC, IC, $AA_IW and centres in absolute coordinates; I and RP are radii (NC programming, DIAMON)."""
    text = """G18 G90 {0} F100
G0 X{1} Z0
X=IC({2})
G91 X{2}
X=AC({2})
G90 R1=$AA_IW[X]
G1 X=R1+{2} Z-5
G2 X=IC({2}) Z-10 I=AC({3}) K=AC(-5)
CIP X=IC({2}) Z=IC(-5) I1=IC({4}) K1=IC(-1)
CT X=IC({2}) Z=IC(-1)
G111 X{2} Z-10
G1 AP=30 RP=10
AP=60 RP=10
G111 X0 Z0
G1 AP=0 RP=20
G3 AP=90 RP=20"""
    places = np.array([20.0, 10.0, 30.0, 3.0])
    diameters, radii = (
        read(text.format(word, *(k * places))) for word, k in (("DIAMON", 1.0), ("DIAMOF", 0.5))
    )
    assert diameters.end[1:4, 0].tolist() == [15, 20, 5]
    same(diameters, radii, apart=1e-9)


def test_variables_of_the_kind_int_keep_whole_numbers() -> None:
    """A value of the kind REAL is rounded where an INT is given it, from 0.5 on up (job planning, type conversion)."""
    text = """DEF INT A, B=7, C[3]=(0.6,1.4,2)
DEF REAL D=2.5
A=B/2
G0 X=A Y=B/2 Z=C[0]+C[1]
A=D C[2]=-1.6
X=A Y=D Z=C[2]
FOR A=0.6 TO 2.9
X=10*A
ENDFOR"""
    assert read(text).end.tolist() == [[4, 3.5, 2], [3, 2.5, -2], [10, 2.5, -2], [20, 2.5, -2]]
    called = "%_N_M_MPF\nUP(2.7,2.7)\nM30\n%_N_UP_SPF\nPROC UP(INT A, REAL B)\nG0 X=A Y=B\nRET\n"
    assert read(called).end.tolist() == [[3, 2.7, 0]]


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("R1==0.3", True), ("R1<>0.3", False), ("R1<=0.3", True), ("R2>=1", True), ("R1>0.3", True), ("R2<1", True),
        ("R1==0.3000001", False),
        ("R3==0", True), ("R3>=0", True), ("R1>=0.31", False), ("R2<=0.9", False),
    ],
)  # fmt: skip
def test_numbers_are_equal_to_twelve_digits(condition: str, holds: bool) -> None:
    """0.1 + 0.2 is 0.3; > and < are exact (job planning, "Precision correction on comparison errors")."""
    found = read(f"R1=0.1+0.2 R2=1-1EX-14 R3=0\nIF {condition}\nG0 X1\nELSE\nG0 X2\nENDIF")
    assert found.end[:, 0].tolist() == [1 if holds else 2]


def test_a_loop_ends_at_a_sum_of_tenths() -> None:
    found = read("R1=0\nWHILE R1<=0.3\nG0 X=R1\nR1=R1+0.1\nENDWHILE")
    assert found.end[:, 0].tolist() == pytest.approx([0, 0.1, 0.2, 0.3])


def test_the_lead_of_a_thread_is_along_the_axis_that_moves_most() -> None:
    """K of G33 is the lead along Z, I that along X of a thread that is wider (NC programming, G33)."""
    text = "G90 G18 DIAM{} G0 X0 Z0 S500 M3\nG33 Z-10 K2\nZ-20 X12 K2\nG91 Z-5 X24 I2\nG90 X0 I=R1+2\nG0 X20"
    for word, part in (("OF", 1.0), ("ON", 0.5)):
        found = read(text.format(word))
        lengths = [
            1.0,
            np.hypot(10, 12 * part) / max(10, 12 * part),
            np.hypot(5, 24 * part) / (24 * part),
            1.0,
        ]
        cut = found.kind == Kind.LINE
        np.testing.assert_allclose(found.feed[cut] * 60, 1000 * np.array(lengths), rtol=1e-12)
        assert found.end[cut][-1].tolist() == [0, 0, -25]
    with pytest.raises(InputError, match="needs its lead along the axis"):
        read("G18 S500 M3\nG33 Z-10 X5")
