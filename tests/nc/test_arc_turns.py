"""How far an arc turns, and what one odd arc of a program decides.

A full circle ends where it starts: by a length, as in LinuxCNC's motion, since an arc of a huge radius turns by next to nothing. An arc
with R is never one: its end points do not say where the centre of a circle would be.
"""

from __future__ import annotations

import numpy as np
import pytest
from same_program import machine

from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

PLANES = {17: "XYIJ", 18: "ZXKI", 19: "YZJK"}


def length(program: Program) -> float:
    """Of the last segment, as it is planned [mm]."""
    return float(toolpath_from_program(program, machine()).length[-1])


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize("radius", [2e-1, 3e2, 4e6, 9e8])
@pytest.mark.parametrize("unit", [20, 21])
def test_a_short_arc_of_any_radius_is_as_long_as_its_chord(
    plane: int, clockwise: bool, radius: float, unit: int
) -> None:
    """A chord of 0.06 units, with the centre at right angles to it: the arc is longer by (chord / radius)^2 / 24 of it."""
    a, b, i, j = PLANES[plane]
    half, side = 0.03, -1.0 if clockwise else 1.0
    centre = side * np.sqrt(radius**2 - half**2)
    words = f"{a}{2 * half} {b}0 {i}{half} {j}{centre:.17g}"
    text = f"G{unit} G{plane} F500\nG{2 if clockwise else 3} {words}\n"
    exact = 2.0 * radius * np.arcsin(half / radius) * (25.4 if unit == 20 else 1.0)
    assert length(parse_program(text)) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("radius", [7.0, 6e3, 5e6])
@pytest.mark.parametrize("plane", PLANES)
def test_an_arc_with_r_is_never_a_full_circle(radius: float, plane: int) -> None:
    a, b, _, _ = PLANES[plane]
    for code in (2, 3):
        for far in (3e-6, 0.002, 1.5):
            for way in (far, -far):
                short = parse_program(f"G21 G{plane} F90 G{code} {a}{way} {b}0 R{radius:.17g}")
                assert length(short) == pytest.approx(2.0 * radius * np.arcsin(far / 2.0 / radius), rel=1e-6)
                long = parse_program(f"G21 G{plane} F90 G{code} {a}{way} {b}0 R-{radius:.17g}")
                assert length(short) + length(long) == pytest.approx(2.0 * np.pi * radius, rel=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "G21 G90 F60\nG1 X30 Y4\nG2 X30 Y4 I11 J0",
        "G21 G91 F60\nG2 X0 Y0 I0 J11",
        "G21 F60\nG3 J-11",
        "G21 G91 F60\n" + "G1 X0.1\n" * 7 + "G90 G3 X0.7 Y0 I11",  # the sum of tenths is not 0.7
        "G21 G10 L2 P1 R33 X1000\nG0 X3 Y7\nF60 G2 X3 Y7 I11",
    ],
)
def test_a_full_circle_ends_where_it_starts_to_the_programmed_digits(text: str) -> None:
    program = parse_program(text)
    assert abs(program.arc_sweep[-1]) == pytest.approx(2.0 * np.pi, abs=1e-12)
    assert length(program) == pytest.approx(2.0 * np.pi * 11.0)


def test_an_end_a_digit_back_is_the_long_way_round() -> None:
    program = parse_program("G21 F60\nG2 X0.0001 Y0 I0 J5")
    assert -program.arc_sweep[0] == pytest.approx(2.0 * np.pi - 0.0001 / 5.0, abs=1e-9)


def test_where_controls_differ_it_is_said_first() -> None:
    program = parse_program("G21 F60\nG3 X0.001 Y0 I0 J9000")
    assert length(program) == pytest.approx(0.001, rel=1e-6)
    (said,) = program.assumptions
    assert said.startswith("line 2: an arc of 0.001 mm")
    assert "full circle" in said
    assert not parse_program("G21 F60\nG3 X0.001 Y0 I0 J900").assumptions


# --- one odd arc ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("code", [2, 3])
@pytest.mark.parametrize("plane", PLANES)
def test_a_centre_at_the_start_is_an_error(code: int, plane: int) -> None:
    """As in LinuxCNC ("Zero-radius arc") and grbl; about the origin of the program it would close, which decides nothing."""
    a, b, i, j = PLANES[plane]
    with pytest.raises(InputError, match="radius 0 mm at its start"):
        parse_program(f"G21 F70 G{plane}\nG0 {a}40 {b}0\nG{code} {a}40.0002 {b}0.0001 {i}0 {j}0\nG1 {a}50")


GOOD = "G2 X{x} Y0 I3 J0\n"  # half a turn of radius 3


@pytest.mark.parametrize("good", [0, 1, 5])
def test_one_odd_arc_does_not_turn_the_centres_of_a_program(good: int) -> None:
    """The last arc closes about an absolute centre only; it stands once, or in a loop on one line."""
    text = "G21 G90 F300\nG1 X20 Y0\n" + "".join(GOOD.format(x=20 + 6 * (k + 1)) for k in range(good))
    at = 20 + 6 * good
    odd = f"G3 X{at + 5} Y5 I{at} J5\n"
    with pytest.raises(InputError, match=r"would close if its centre were absolute: write G90\.1"):
        parse_program(text + odd)
    two = f"{odd}G3 X{at + 12} Y12 I{at + 5} J12\n"
    if good:  # what closes with incremental centres only stays a fault
        with pytest.raises(InputError, match="would close"):
            parse_program(text + two)
    else:
        assert parse_program(text + two).reading == Reading(arc_centres="absolute")


def test_an_arc_about_the_origin_is_no_evidence_and_no_obstacle() -> None:
    """Programs with absolute centres have I0 J0 too."""
    circle = "G2 X-20 Y0 I0 J0\n"
    with pytest.raises(InputError):
        parse_program("G21 F300\nG1 X20 Y0\n" + circle + "G1 X20\n" + circle)
    others = "G3 X-15 Y5 I-20 J5\nG3 X-8 Y12 I-15 J12\n"
    assert len(parse_program("G21 F300\nG1 X20 Y0\n" + circle + others).arc_sweep) == 3
