"""Radius compensation, APPR, DEP, corners and frames of conversational programs, by geometry."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np
import pytest
from moved import machine_with, read_twice, sampled

from planner.base.errors import InputError
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

RADIUS = 4.0
MILL = machine_with(2 * RADIUS)
HEIDENHAIN = Reading(dialect="heidenhain")


def read(body: str) -> Program:
    return read_twice(f"0 BEGIN PGM T MM\nTOOL CALL 1 Z S1000\n{body}\nEND PGM T MM\n", MILL, HEIDENHAIN)


def places(program: Program) -> list[complex]:
    return [complex(x, y) for x, y, _ in program.end]


def near(found: complex, expected: complex) -> None:
    assert found.real == pytest.approx(expected.real, abs=1e-9)
    assert found.imag == pytest.approx(expected.imag, abs=1e-9)


def distance_from_polygon(point: complex, corners: Sequence[complex]) -> float:
    found = math.inf
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        part = min(max(((point - a) * (b - a).conjugate()).real / abs(b - a) ** 2, 0.0), 1.0)
        found = min(found, abs(point - a - part * (b - a)))
    return found


@pytest.mark.parametrize("seed", range(8))
def test_the_tool_stays_its_radius_from_an_outer_contour(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 8))
    turns = np.sort(rng.uniform(0, 1, count)) + np.arange(count) * 0.3
    corners = [30 * cmath.rect(1, -2 * math.pi * t / (turns[-1] + 0.4)) for t in turns]  # clockwise
    contour = "\n".join(f"L X{p.real:+.9f} Y{p.imag:+.9f}" for p in [*corners[1:], corners[0]])
    first = corners[0]
    program = read(
        f"L X-80 Y-90 FMAX\nL X{first.real:+.9f} Y{first.imag:+.9f} RL F500\n{contour}\nL X-80 Y-90 R0 FMAX"
    )
    points, block = sampled(program, 0.5)
    cutting = (program.kind[block] != Kind.RAPID) & (block > 2)
    far = [distance_from_polygon(complex(x, y), corners) for x, y, _ in points[cutting]]
    assert min(far) >= RADIUS - 1e-6
    assert max(far) <= RADIUS + 1e-6
    # the first and the last compensated place are normal to the first and the last side
    side = (corners[1] - first) / abs(corners[1] - first)
    near(places(program)[2], first + RADIUS * 1j * side)
    last = (first - corners[-1]) / abs(first - corners[-1])
    near(places(program)[-2], first + RADIUS * 1j * last)
    near(places(program)[-1], -80 - 90j)


def test_an_inner_corner_is_cut_at_the_intersection() -> None:
    program = read("L X-20 Y+0 FMAX\nL X+0 Y+0 RL F500\nL X+30\nL Y+40\nL X+0\nL X-20 R0 FMAX\nL Z+5 FMAX")
    assert program.end[2:, :2].tolist() == [[0, 4], [26, 4], [26, 36], [0, 36], [-20, 40], [-20, 40]]


def test_what_the_tool_cannot_follow_is_refused_with_its_line() -> None:
    with pytest.raises(InputError, match=r"<text>:7:1: .*gouge"):
        read("L X-20 Y+0 FMAX\nL X+0 Y+0 RL F500\nL X+5\nL Y+5\nL X+0\nL Y+20\nL Y+40 R0")
    for body, said in (
        ("L X+5 Y+5 RL F500\nL X+9 RR", "the side of compensation changes"),
        ("L X+5 RL F500\nL X+9 R0", "no contour follows"),
        ("L X+5 RL F500\nL X+9\nCYCL DEF 7.0\nCYCL DEF 7.1 X+3", "the frame changes while"),
        ("L X+5 RL F500\nL X+9\nTOOL CALL 1 Z S1", "a tool change while"),
        ("CC X+5 Y+0\nC X+10 Y+0 DR+ RL F500\nL X+20", "begins with a straight move"),
        ("DEP LT LEN5", "DEP without a contour"),
        ("APPR CT X+1 Y+1 R5 RL", "APPR CT needs its angle"),
        ("APPR PLT X+1 PA+1 LEN5 RL", "polar coordinates stand instead"),
        ("L X+4 Y+20 FMAX\nAPPR LCT X+4 Y+5 R50 RL F100\nL X+9", "inside the arc"),
        ("APPR LT X+1 Y+1 LEN5 RL F100", "APPR is followed by no contour"),
    ):
        with pytest.raises(InputError, match=said):
            read(f"L X+0 Y+0 FMAX\n{body}")


def test_what_has_no_end_at_the_end_of_a_text_is_said_at_its_last_statement():
    text = "BEGIN PGM 1 MM\nTOOL CALL 1 Z S1000 F100\nL X+0 Y+0 Z+5 R0 FMAX\nAPPR CT X+1 Y+2 Z-3 CCA90 R+4 RR F100\n"
    with pytest.raises(InputError, match=r"^a\.h:4:1: APPR: APPR is followed by no contour"):
        parse_program(text, None, source="a.h")


@pytest.mark.parametrize("side", ["RL", "RR"])
@pytest.mark.parametrize("angle", [0.0, 70.0, 200.0, -30.0])
@pytest.mark.parametrize(
    "how",
    ["LT LEN7", "LN LEN7", "CT CCA120 R+6", "CT CCA90 R-6", "LCT R6"],
    ids=lambda how: how.replace(" ", "_"),
)
def test_approach_and_departure_meet_the_contour_as_they_say(side: str, angle: float, how: str) -> None:
    t = cmath.rect(1.0, math.radians(angle))
    first, last = 10 + 20j, 10 + 20j + 50 * t
    kind, *rest = how.split()
    extra, beside = " ".join(rest), 1j * t if side == "RL" else -1j * t
    out = first - 60 * t + 30 * beside
    gone = last + 60 * t + 30 * beside
    target = f"X{gone.real:+.9f} Y{gone.imag:+.9f}" if kind == "LCT" else ""
    program = read(
        f"L X{out.real:+.9f} Y{out.imag:+.9f} Z+9 FMAX\nAPPR {kind} X{first.real:+.9f} Y{first.imag:+.9f} Z-3 {extra} {side} F300\n"
        f"L X{last.real:+.9f} Y{last.imag:+.9f}\nDEP {kind} {target} {extra} F900"
    )
    found = places(program)
    contour = [k for k in range(len(found)) if program.line[k] == 5]
    start, end = first + RADIUS * beside, last + RADIUS * beside
    near(found[contour[-1]], end)
    near(found[contour[0] - 1], start)
    assert program.end[contour[0] - 1 : contour[-1] + 1, 2].tolist() == [-3, -3]
    if kind in ("LT", "LN"):
        way = -t if kind == "LT" else beside
        near(found[contour[0] - 2], start + 7 * way)
        near(found[-1], end + 7 * (t if kind == "LT" else beside))
        return
    # the arcs are tangent to the contour, with their radius, on the side that R says
    to_centre = beside * (-6 if "R-6" in how else 6)
    for k, (centre, sweep) in enumerate(zip(program.arc_center, program.arc_sweep, strict=True)):
        near(complex(*centre[:2]), (start if k == 0 else end) + to_centre)
        spoke = (start if k == 0 else end) - complex(*centre[:2])
        near(spoke / abs(spoke) * (1j if sweep > 0 else -1j), t)
        if kind == "CT":
            assert abs(sweep) == pytest.approx(math.radians(90 if "CCA90" in how else 120))
    if kind == "LCT":  # and to the straight move
        begin, centre, sweep = (
            found[contour[0] - 2],
            complex(*program.arc_center[0, :2]),
            program.arc_sweep[0],
        )
        spoke = begin - centre
        near((begin - out) / abs(begin - out), spoke / abs(spoke) * (1j if sweep > 0 else -1j))
        near(found[-1], gone)


def test_approach_changes_its_depth_at_the_auxiliary_point() -> None:
    program = read("L X-50 Y+0 Z+9 FMAX\nAPPR LT X+0 Y+0 Z-3 LEN10 RR F300\nL X+20\nDEP LT LEN5\nL Z+9 FMAX")
    assert program.end[2:].tolist() == [
        [-10, -4, 9], [-10, -4, -3], [0, -4, -3], [20, -4, -3], [25, -4, -3], [25, -4, 9]
    ]  # fmt: skip
    assert program.kind[2] == Kind.RAPID


def test_without_a_tool_in_the_machine_file_nothing_is_compensated_and_it_is_said() -> None:
    program = read_twice(
        "0 BEGIN PGM T MM\nL X+0 Y+0 FMAX\nL X+5 RL F500\nL X+9\nL Y+9 R0\nEND PGM T MM\n", MILL, HEIDENHAIN
    )
    assert program.end[-1].tolist() == [9, 9, 0]
    assert any("has no diameter" in note for note in program.notes)


@pytest.mark.parametrize("compensated", [False, True])
def test_roundings_beside_arcs_are_tangent_to_both(compensated: bool) -> None:
    side = "RL" if compensated else "R0"
    program = read(
        f"L X-30 Y+0 FMAX\nL X+0 Y+0 {side} F500\nL Y+20\nRND R6\nCC X+20 Y+25\n"
        "C X+20 Y+45.615528128 DR-\nRND R7\nL X+60 Y+10\nL X+90 R0"
    )
    points, block = sampled(program, 0.01)
    way = np.diff(points[block > 1, :2], axis=0)
    way = way[np.linalg.norm(way, axis=1) > 1e-6]
    turn = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(way[:, 1], way[:, 0])))))
    assert (turn > 0.05).sum() == 2  # the corners that are not rounded: the first, and the last
    if not compensated:
        assert {6.0, 7.0} <= {
            round(float(np.hypot(*(program.end[b] - c)[:2])), 9)
            for b, c in zip(program.arc_block, program.arc_center, strict=True)
        }


def test_frames_act_as_they_are_combined() -> None:
    body = "L X+1 Y+2 FMAX\nL IX+3 F100\nCC X+0 Y+0\nCP IPA+90 DR+"
    plain = read(body)
    moved = read(f"TRANS DATUM AXIS X+10 Y+20\nCYCL DEF 10.0\nCYCL DEF 10.1 ROT+90\n{body}")
    np.testing.assert_allclose(
        moved.end[1:, :2], np.stack([10 - plain.end[1:, 1], 20 + plain.end[1:, 0]], axis=1), atol=1e-9
    )
    assert moved.arc_sweep[0] > 0
    mirrored = read(f"CYCL DEF 8.0\nCYCL DEF 8.1 X\nCYCL DEF 11.0\nCYCL DEF 11.1 SCL 2\n{body}")
    np.testing.assert_allclose(mirrored.end[1:, :2], plain.end[1:, :2] * [-2, 2], atol=1e-9)
    assert mirrored.arc_sweep[0] < 0
    uneven = read(
        "CYCL DEF 26.0\nCYCL DEF 26.1 X2 Y1 CCX+10\nL X+10 Y+5 FMAX\nL X+15 FMAX\nCYCL DEF 26.0\nCYCL DEF 26.1 X1\nL X+1 FMAX"
    )
    assert uneven.end[1:, 0].tolist() == [10, 20, 1]
    turned = read("CYCL DEF 10.0\nCYCL DEF 10.1 ROT+30\nCYCL DEF 10.1 IROT+60\nL X+5 Y+0 FMAX\nL IY+1 FMAX")
    np.testing.assert_allclose(turned.end[1:, :2], [[0, 5], [-1, 5]], atol=1e-9)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("CYCL DEF 8.1 X\nCYCL DEF 10.1 ROT+30", "which acts first is not documented"),
        ("CYCL DEF 10.1 ROT+30\nCYCL DEF 7.1 X+3", "in whose axes it counts is not documented"),
        ("CYCL DEF 11.1 SCL 0", "a scaling factor is above 0"),
        ("CYCL DEF 8.1 A", "takes the axes X, Y and Z"),
        ("CYCL DEF 10.1 SCL 3", "ROT or IROT"),
        ("TRANS DATUM TABLE 3", "followed by AXIS"),
        ("CYCL DEF 26.1 X2\nL X+0 Y+0 F100\nCC X+5 Y+0\nC X+10 Y+0 DR+", "<text>:6:1: .*scales unevenly"),
    ],
)
def test_frames_that_are_not_known_are_refused(body: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(body)


@pytest.mark.parametrize("side", ["RL", "RR"])
@pytest.mark.parametrize("mirror", ["", "CYCL DEF 8.0\nCYCL DEF 8.1 X\n"])
def test_a_tangent_arc_is_compensated_as_the_arc_about_its_centre(side: str, mirror: str) -> None:
    """CT from a line, over a plunge, and from the arc of the CT before it; the centres are known."""
    begin = f"{mirror}L X-30 Y+0 Z+5 FMAX\nL X-12 {side} F500\nL X+14\nL Z-1\n"
    end = "L Y+70\nL X-40 Y+70 R0 FMAX"
    given = read(f"{begin}CT X+27 Y+13\nCT X+14 Y+26\n{end}")
    known = read(f"{begin}CC X+14 Y+13\nC X+27 Y+13 DR+\nC X+14 Y+26 DR+\n{end}")
    np.testing.assert_allclose(given.end, known.end, atol=1e-9)
    np.testing.assert_allclose(given.arc_sweep, known.arc_sweep, atol=1e-9)


def test_a_tangent_arc_needs_a_move_of_the_contour_before_it() -> None:
    with pytest.raises(InputError, match="none in the plane"):
        read("L X+0 Y+0 FMAX\nL X+9 F100\nAPPR LT X+20 Y+5 LEN6 RL F100\nCT X+30 Y+15\nL X+50\nDEP LT LEN9")
