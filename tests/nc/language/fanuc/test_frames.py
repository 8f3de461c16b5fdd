"""Frames, patterns, roundings and cycles of Fanuc's and Haas' mills against the same moves written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from language_programs import same
from test_agreement import MACHINE

from planner.base.errors import InputError
from planner.machine import Machine, ToolData
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

HEAD = "O1000\nG17 G21 G90 G94 G98\nF600 G0 X0 Y0 Z10.\n"
TOOLED = MACHINE.model_copy(update={"tools": {"1": ToolData(length=0.0, diameter=4.0)}})
COSINE, SINE = math.cos(math.radians(30)), math.sin(math.radians(30))
CASES = {
    "rotation": (
        "G68 X10. Y10. R90.\nG1 X20. Y10.\nX20. Y20.\nG3 X10. Y30. R10.\nG69\nG0 X0 Y0",
        "G1 X10 Y20\nX0 Y20\nG3 X-10 Y10 R10\nG0 X0 Y0",
    ),
    "rotation about the tool": (
        "G0 X5. Y5.\nG68 R180.\nG1 X7. Y5.\nG91 X1. Y2.\nG69\nX1.",
        "G0 X5 Y5\nG1 X3 Y5\nX2 Y3\nX3",
    ),
    "a rotation more": (
        "G68 X0 Y0 R45.\nG91 G68 X0 Y0 R45.\nG90 G1 X5. Y0\nG69\nX5. Y0",
        "G1 X0 Y5\nX5 Y0",
    ),
    "scale": ("G51 X0 Y0 Z10. P2000\nG1 X5. Y6.\nG2 X9. Y6. I2.\nG50\nG1 X0", "G1 X10 Y12\nG2 X18 Y12 I4\nG1 X0"),
    "a scale of each axis": ("G51 X1. Y0 Z0 I2. J.5 K1.\nG1 X5. Y6.\nG50\nX0", "G1 X9 Y3\nX0"),
    "mirror": (
        "G51.1 X10.\nG1 X5. Y5.\nG2 X9. Y5. I2.\nG50.1 X0\nG1 X0 Y0",
        "G1 X15 Y5\nG3 X11 Y5 I-2\nG1 X0 Y0",
    ),
    "mirror of Haas": ("G101 X0 Y0\nG1 X5. Y6.\nG100 X0 Y0\nX1.", "G1 X-5 Y-6\nX1"),
    "scale, then rotation": ("G51 X0 Y0 Z0 I2. J2. K1.\nG68 X5. Y0 R90.\nG1 X6. Y0\nG69\nG50\nX0 Y0", "G1 X10 Y2\nX0 Y0"),
    "polar": (
        "G16\nG1 X10. Y30.\nY120.\nG91 Y60.\nG90 G15\nX1. Y1.",
        f"G1 X[{10 * COSINE:.15f}] Y5\nX-5 Y[{10 * COSINE:.15f}]\nX-10 Y0\nX1 Y1",
    ),
    "polar about the tool": ("G0 X3. Y4.\nG91 G16\nG1 X5. Y90.\nG90 G15\nX0 Y0", "G0 X3 Y4\nG1 X3 Y9\nX0 Y0"),
    "a polar radius in steps": (
        "G16\nG1 X10. Y90.\nG91 X3. Y-90.\nX2. Y90.\nX1.\nG90 X5. Y0\nG91 Y90.\nG90 G15\nX1. Y1.",
        "G1 X0 Y10\nX3 Y10\nX3 Y12\nX3 Y13\nX5 Y0\nX0 Y5\nX1 Y1",
    ),
    "a bolt circle": (
        "G16 G81 X10. Y0 Z-5. R2.\nG91 Y90. K3\nG90 G80 G15\nG0 X0",
        "G81 X10 Y0 Z-5 R2\nX0 Y10\nX-10 Y0\nX0 Y-10\nG80\nG0 X0",
    ),
    "holes in a frame": (
        "G68 X0 Y0 R90.\nG99 G83 X5. Y0 Z-5. R2. Q3.\nX10.\nG80\nG69\nG0 X0 Y0",
        "G99 G83 X0 Y5 Z-5 R2 Q3\nX0 Y10\nG80\nG0 X0 Y0",
    ),
    "holes in steps": (
        "G99 G81 X1. Y1. Z-5. R2.\nG91 X10. K3\nG90 G80\nG0 X0\nG91 G81 Z-3. R-4. X1. L2\nG90 G80\nX0",
        "G99 G81 X1 Y1 Z-5 R2\nX11\nX21\nX31\nG80\nG0 X0\nG81 X1 Z-5 R-2\nX2\nG80\nG0 X0",
    ),
    "bolt holes of Haas": (
        "G0 X5. Y5.\nG81 Z-5. R2. L0\nG70 I10. J0 L4\nG80\nG0 X0 Y0",
        "G0 X5 Y5\nG81 X15 Y5 Z-5 R2\nX5 Y15\nX-5 Y5\nX5 Y-5\nG80\nG0 X0 Y0",
    ),
    "compensation in a mirror": (
        "T1 M6\nG51.1 X0\nG41 D1 G1 X10. Y0\nX10. Y20.\nX20.\nG40 X30. Y30.\nG50.1 X0",
        "T1 M6\nG42 D1 G1 X-10 Y0\nX-10 Y20\nX-20\nG40 X-30 Y30",
    ),
    "home in a frame": ("G68 X0 Y0 R90.\nG1 X5. Y0\nG91 G28 Z0\nG90 G69\nG0 X0 Y0", "G1 X0 Y5\nG91 G28 Z0\nG90 G0 X0 Y0"),
    "rounding and chamfer": (
        "G1 X10. ,R2.\nY10. ,C1.\nX0",
        "G1 X8\nG3 X10 Y2 J2\nG1 Y9\nX9 Y10\nX0",
    ),
    "a move at an angle": ("G1 X10. ,A45.\nY20. ,A135.", "G1 X10 Y10\nX0 Y20"),
    "a call in a frame": (
        "G68 X0 Y0 R180.\nM98 P20\nG69\nM98 P20\nM30\nO20\nG1 X5. Y5.\nX0 Y0\nM99",
        "G1 X-5 Y-5\nX0 Y0\nX5 Y5\nX0 Y0",
    ),
    "a round pocket": (
        "G0 X5. Y5.\nG13 I6. Z-1. D1\nG0 Z5.",
        "G0 X5 Y5\nG1 Z-1\nG3 X9 Y5 I2\nG3 X9 Y5 I-4\nG3 X5 Y5 I-2\nG0 Z5",
    ),
    "a round pocket at its place": (
        "G0 X1. Y1.\nG13 I6. X5. Y5. Z-1. D1\nG0 Z5.",
        "G0 X1 Y1\nX5 Y5\nG1 Z-1\nG3 X9 Y5 I2\nG3 X9 Y5 I-4\nG3 X5 Y5 I-2\nG0 Z5",
    ),
    "a round pocket by and by": (
        "G12 I4. K7. Q2. Z-1. D1 F300.\nG0 Z5.",
        "G1 Z-1 F300\nG2 X2 Y0 I1\nG2 X2 Y0 I-2\nG1 X4\nG2 X4 Y0 I-4\nG1 X5\nG2 X5 Y0 I-5\nG2 X0 Y0 I-2.5\nG0 Z5",
    ),
    "dwells": ("G4 X1.5\nG4 U2.\nG4 P500\nG4 X1", "G4 P1.5\nG4 P2\nG4 P.5\nG4 P1"),
    "a tolerance of Haas": ("G187 P2 E0.03\nG1 X5. Y5.", "G64 P0.03\nG1 X5 Y5"),
    "work systems of Haas": (
        "G10 L20 P3 X7. Y0 Z0\nG154 P3\nG0 X1.\nG54 X2.\nG112 X3.",
        "G10 L2 P2 X7 Y0 Z0\nG55\nG0 X1\nG54 X2\nG55 X3",
    ),
    "the spindle starts": ("G84 X5. Z-5. R2.\nG80", "M3\nG99 G84 X5 Z-5 R2 P0\nG80\nG0 Z10"),
    "fine boring": ("M3\nG76 X5. Z-5. R2. Q.2 P100\nX9.\nG80", "M3\nG86 X5 Z-5 R2 P.1\nX9\nG80"),
    "tools": ("G10 L12 P1 R3.\nG10 L10 P1 R5.\nG43 H1 Z20.\nG41 D1 G1 X20. Y0\nX20. Y20.\nG40 X0 Y20.",
              "G10 L1 P1 Z5 R3\nG43 H1 G0 Z20\nG41 D1 G1 X20 Y0\nX20 Y20\nG40 X0 Y20"),
    "P of cycles": (
        "G81 X5. Z-5. R2. P500\nG82 X9.\nG83 X12. Q4. P0\nG80",
        "G0 X5\nZ2\nG1 Z-5\nG4 P.5\nG0 Z10\nX9\nZ2\nG1 Z-5\nG4 P.5\nG0 Z10\nX12\nZ2\nG1 Z-2\nG0 Z2\nZ-1.746\nG1 Z-5\nG0 Z10",
    ),
    "pecks that grow less": (
        "G83 X0 Z-6. R0 I3. J1. K1.\nG80",
        "G0 Z0\nG1 Z-3\nG0 Z0\nZ-2.746\nG1 Z-5\nG0 Z0\nZ-4.746\nG1 Z-6\nG0 Z10",
    ),
}  # fmt: skip

METRIC = (
    "P of cycles",
    "pecks that grow less",
    "a round pocket",
    "a round pocket at its place",
    "a round pocket by and by",
    "compensation in a mirror",
)


@pytest.mark.shows("read-fanuc, read-haas", "exact: the same moves written out")
@pytest.mark.parametrize("unit", ["G21", "G20"])
@pytest.mark.parametrize("name", CASES)
def test_as_written_out(name: str, unit: str) -> None:
    if unit == "G20" and name in METRIC:
        pytest.skip(
            "its numbers are those of a metric tool, or of pecks that end a hundredth of an inch apart"
        )
    text, written = CASES[name]
    head = HEAD.replace("G21", unit)
    found = parse_program(head + text + ("" if "M30" in text else "\nM30"), TOOLED)
    expected = parse_program(head.replace("O1000\n", "") + written + "\nM30", TOOLED)
    assert not [note for note in found.assumptions if "G9" in note]
    same(found, expected, apart=1e-9)
    np.testing.assert_array_equal(found.tolerance, expected.tolerance)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G51 X0 P0\nG1 X5.", "a scale of 0"),
        ("G68 X0 R30.\nG18 G2 X5. Z5. R9.", "is no arc"),
        ("G51 X0 Y0 Z0 I2. J1. K1.\nG2 X5. Y5. R9.", "is no arc"),
        ("G51 X0 Y0 Z0 P3.\nG81 X5. Z-5. R2.", "scales, mirrors, shifts"),
        ("G41 D1 G1 X9.\nG68 X0 Y0 R30.", "write G40 before"),
        ("G13 Z-1. D1", "a radius as I|not supported|RS274NGC does not know"),
        ("G13 I1. Z-1. D1", "I is more than the tool's radius"),
        ("G13 I9. Z-1. D7", "diameter of tool 7"),
        ("G68 X0 Y0 I1. J0 K0 R30.", "tilts the plane"),
        ("G1 X5. ,R9.\nY5.", "takes more of a move"),
        ("G1 X5. Y5. ,A30.", "one of X and Y"),
        ("G70 I5. L4", "a drilling cycle in force"),
        ("G16\nG1 X5. Y90.\nG91 X1. Y10.\nY20.", "no known centre"),
    ],
)
def test_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        parse_program(HEAD + text + "\nX1. Y1.\nM30", TOOLED)
    assert (caught.value.line or 0) >= 4


def test_strict_reading_knows_no_frame() -> None:
    with pytest.raises(InputError):
        parse_program("G21\nG51 P2\nG1 X5 F100", MACHINE, Reading(strict=True))


def test_a_random_frame_is_its_matrix() -> None:
    """A second reading: points of G51.1, G51 and G68 by complex numbers."""
    random = np.random.default_rng(3)
    machine: Machine = MACHINE
    for _ in range(50):
        centre, about = random.uniform(-9, 9, 2).round(2), random.uniform(-9, 9, 2).round(2)
        factor, angle, mirror = (random.uniform([0.2, 0.0, -9.0], [3.0, 360.0, 9.0])).round(1)
        points = random.uniform(-50, 50, (5, 2)).round(3)
        lines = "".join(f"G1 X{x:.3f} Y{y:.3f}\n" for x, y in points)
        text = (
            f"G51.1 X{mirror:.2f}\nG51 X{centre[0]:.2f} Y{centre[1]:.2f} Z0 I{factor:.2f} J{factor:.2f} K1.\n"
        )
        text += f"G68 X{about[0]:.2f} Y{about[1]:.2f} R{angle:.1f}\n{lines}M30"
        found = parse_program(HEAD + text, machine)
        start = parse_program(HEAD + "M30", machine).end[-1, :2]

        mirrored = np.array([[2 * mirror - x, y] for x, y in [about, *points]])
        pole, *scaled = (centre + factor * (mirrored - centre)) @ [1, 1j]
        turn = complex(math.cos(math.radians(angle)), math.sin(math.radians(angle)))
        expected = [pole + turn * (point - pole) for point in scaled]
        ends = (found.end[-5:, 0] - start[0]) + 1j * (found.end[-5:, 1] - start[1])
        assert np.abs(ends - expected).max() < 1e-9


def test_the_unit_may_be_said_once_more_while_a_frame_is_in_force_and_not_another() -> None:
    text = HEAD + "G68 X0 Y0 R90.\nG1 X5. Y0\n{}\nX9. Y0\nG69\nM30"
    found = parse_program(text.format("G21"), MACHINE)
    np.testing.assert_allclose(found.end[-1, :2] - found.end[-2, :2], [0, 4], atol=1e-9)
    with pytest.raises(InputError, match="the unit changes"):
        parse_program(text.format("G20"), MACHINE)
