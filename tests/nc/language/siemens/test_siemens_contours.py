"""Frames, compensation, corners and arcs of Sinumerik programs, by known points; labels and repeated lines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from moved import machine_with, read_twice

from planner.base.errors import InputError
from planner.nc.program import Program
from planner.nc.reading import Reading

MILL = machine_with(8.0)
SIEMENS = Reading(dialect="siemens")


def read(text: str) -> Program:
    return read_twice(f"DEF REAL A\nG71 T1 M6\n{text}\nM30\n", MILL, SIEMENS)


def ends(program: Program) -> list[list[float]]:
    """x and y behind the tool change."""
    return np.round(program.end[1:, :2], 9).tolist()  # type: ignore[no-any-return]


BODY = "G0 X1 Y2\nG91 G1 X3 F100\nG90 G2 X4 Y-2 I=AC(4) J=AC(0)\nG3 X8 Y2 CR=4\nG1 Y=IC(5)"
PLAIN = np.array([[1, 2], [4, 2], [4, -2], [8, 2], [8, 7]])


@pytest.mark.parametrize(
    ("frame", "matrix", "shift", "turned"),
    [
        ("TRANS X5 Y7", [[1, 0], [0, 1]], [5, 7], False),
        ("ROT RPL=90", [[0, -1], [1, 0]], [0, 0], False),
        ("ROT Z=30", [[math.cos(math.pi / 6), -0.5], [0.5, math.cos(math.pi / 6)]], [0, 0], False),
        ("TRANS X5\nAROT RPL=90", [[0, -1], [1, 0]], [5, 0], False),
        ("ROT RPL=90\nATRANS X5", [[0, -1], [1, 0]], [0, 5], False),
        ("TRANS X5\nROT RPL=90", [[0, -1], [1, 0]], [0, 0], False),
        ("MIRROR X0", [[-1, 0], [0, 1]], [0, 0], True),
        ("MIRROR X0 Y0", [[-1, 0], [0, -1]], [0, 0], False),
        ("SCALE X3 Y3\nAMIRROR Y0", [[3, 0], [0, -3]], [0, 0], True),
        ("ROT RPL=90\nASCALE X2 Y2\nATRANS X1", [[0, -2], [2, 0]], [0, 2], False),
        ("MIRROR X0\nTRANS", [[1, 0], [0, 1]], [0, 0], False),
    ],
)
def test_frames_are_affine_maps(
    frame: str, matrix: list[list[float]], shift: list[float], turned: bool
) -> None:
    found = read(f"{frame}\n{BODY}")
    np.testing.assert_allclose(ends(found), PLAIN @ np.array(matrix).T + shift, atol=1e-8)
    np.testing.assert_allclose(
        found.arc_sweep, np.array([-1, 0.5]) * math.pi * (-1 if turned else 1), atol=1e-9
    )
    back = read(f"{frame}\n{BODY}\nTRANS\nG1 X1 Y1\nG2 X3 I1\nX5 I1\nROT RPL=0\nG91 G1 X1")
    assert ends(back)[-4:] == [[1, 1], [3, 1], [5, 1], [6, 1]]


def test_the_turned_direction_of_arcs_ends_with_the_mirror_image() -> None:
    found = read("MIRROR X0\nG1 X0 Y0 F100\nG2 X2 I1\nMIRROR\nX4 I=AC(1)")
    assert ends(found)[-1] == [4, 0]
    assert np.sign(found.arc_sweep).tolist() == [1, -1]


def test_compensation_begins_and_ends_normal_to_the_contour() -> None:
    text = "G0 X-20 Y-20\n{} G1 X0 Y0 F500\nY30\nX40\nY0\nX0\nG40 G0 X-20 Y-20"
    left = read(text.format("G41"))
    assert ends(left) == [
        [-20, -20], [-4, 0], [-4, 30], [0, 34], [40, 34], [44, 30], [44, 0], [40, -4], [0, -4], [-20, -20]
    ]  # fmt: skip
    right = read(text.format("G17 G42"))
    assert ends(right) == [[-20, -20], [4, 0], [4, 26], [36, 26], [36, 4], [0, 4], [-20, -20]]
    mirrored = read("MIRROR X0\n" + text.format("G42"))
    np.testing.assert_allclose(ends(mirrored), np.array(ends(right)) * [-1, 1])


def test_positions_are_those_of_the_program_while_compensation_is_on() -> None:
    found = read(
        "G0 X-20 Y0\nG41 G1 X0 Y0 F500\nX=IC(10)\nR1=$AA_IW[X]+$AA_IW[Y]\nX=R1+20\nG40 X=IC(5) Y20\nX=R1"
    )
    assert ends(found) == [[-20, 0], [0, 4], [10, 4], [30, 4], [35, 20], [10, 20]]


def test_corners_and_arcs() -> None:
    found = read("G0 X0 Y0\nG1 X10 F100 RND=2\nY10 CHF=2\nX30 CHR=1\nY30 RND=2\nG3 X20 Y40 CR=10\nG1 X0")
    half = math.sqrt(2)
    np.testing.assert_allclose(
        ends(found)[1:],
        [[8, 0], [10, 2], [10, 10 - half], [10 + half, 10], [29, 10], [30, 11], [30, 30], [20, 40], [0, 40]],
    )
    arcs = read(
        "G0 X0 Y0\nG1 X10 F100\nCT X20 Y10\nCIP X30 Y20 I1=IC(2) J1=AC(17) F50\nG91 CIP X0 Y20 I1=10 J1=10"
    )
    np.testing.assert_allclose(arcs.arc_center[0, :2], [10, 10])
    for point in ([20, 10], [22, 17], [30, 20]):
        assert np.hypot(*(arcs.arc_center[1, :2] - point)) == pytest.approx(np.hypot(8.7, 1.3))
    np.testing.assert_allclose(arcs.arc_center[2, :2], [30, 30], atol=1e-9)
    assert arcs.end[-1, :2].tolist() == [30, 40]
    assert arcs.arc_sweep[2] == pytest.approx(math.pi)


def test_a_tangent_arc_is_compensated() -> None:
    """The contour of CT is that of the arc with the radius that its chord has: |v|^2 / (2 v n)."""
    text = "T1 M6\nG0 X-20 Y0\nG1 G41 X-8 F300 CFTCP\nG1 X9\n{}\nG1 Y60\nG40 G0 X-50"
    given, known = (read(text.format(arc)) for arc in ("CT X19 Y10", "G3 X19 Y10 CR=10"))
    np.testing.assert_allclose(ends(given), ends(known), atol=1e-9)


def test_a_line_is_repeated_by_its_label() -> None:
    found = read(
        "G91 G1 X0 F100\nSTEP: X2\nY1\nREPEATB STEP P=2\nN70 Y3\nR1=R1+1\nIF R1<3 GOTOB N70\nN90 X-1\nREPEATB N90"
    )
    assert ends(found) == [[0, 0], [2, 0], [2, 1], [4, 1], [6, 1], [6, 4], [6, 7], [6, 10], [5, 10], [4, 10]]
    with pytest.raises(InputError, match="no label NOWHERE above"):
        read("REPEATB NOWHERE")
