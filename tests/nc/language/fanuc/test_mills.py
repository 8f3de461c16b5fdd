"""Tilted planes, parameters of the control and settings of Fanuc's and Haas' mills."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import ToolData, load_machine, machine_from_dict
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

HEAD = "O1000\nG0 G17 G21 G90 G94 G98 F600\n"
MACHINE = load_machine("mill")
TOOLED = MACHINE.model_copy(update={"tools": {"3": ToolData(length=7.0, diameter=4.0)}})
_ABOUT = load_machine("mill").model_dump(exclude_none=True)
_ABOUT["axes"] |= {c: {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e4} for c in "ac"}
FIVE_AXES = machine_from_dict({**_ABOUT, "kinematics": {"type": "xyzac-trt"}})


def turn(degrees: float, a: int, b: int) -> np.ndarray:
    """Rotation in the plane of two axes."""
    matrix, angle = np.eye(3), np.radians(degrees)
    matrix[[a, b], [a, b]] = np.cos(angle)
    matrix[a, b], matrix[b, a] = -np.sin(angle), np.sin(angle)
    return matrix


@pytest.mark.parametrize("angles", [(0, 30, 0), (90, 25, 0), (40, 20, -15), (0, 0, 30)])
def test_a_tilted_plane_is_its_euler_angles(angles: tuple[int, int, int]) -> None:
    i, j, k = angles
    points = np.array([[5.0, 0.0, 0.0], [5.0, 8.0, 1.0], [-3.0, 2.0, -1.0]])
    moves = "\n".join(f"G1 X{x} Y{y} Z{z}" for x, y, z in points)
    text = f"{HEAD}G68.2 X10. Y2. Z1. I{i}. J{j}. K{k}.\nG53.1\n{moves}\nG69\nG0 A0 C0\nX1. Y2. Z3.\nM30"
    program = parse_program(text, FIVE_AXES)
    matrix = turn(i, 0, 1) @ turn(j, 1, 2) @ turn(k, 0, 1)
    cut = (program.line >= 5) & (program.line <= 7)
    np.testing.assert_allclose(program.end[cut, :3], points @ matrix.T + [10.0, 2.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(program.end[-1, :3], [1.0, 2.0, 3.0], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G68.2 X0 Y0 Z0 I0 J30. K0\nG53.1", "kinematics"),
        ("G68.2 P2 X0 Y0 Z0 I0 J30. K0", "angles I J K"),
        ("G150 P100 Z-5. R1. Q2. J5.", "whose single passes"),
        ("#1=#4115\nG1 X#1", "known by the control"),
        ("#1=#10001\nG1 X#1", "known by the control"),
        ("G31 X5.", "probing"),
        ("G254\nG1 X5.", "follows the rotary axes"),
    ],
)
def test_refused_by_name(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        parse_program(HEAD + text, MACHINE)
    assert caught.value.line == 3


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("G43 H3 Z50.", "#4111"),
        ("G41 D3 X5. Y5.", "#4107"),
        ("G41 D3 X5. Y5.", "[#4007-38.]"),
        ("G68 X0 Y0 R0\n#3=3", "[#4016-66.]"),
        ("G51 X0 Y0 Z0 I1. J1. K2.", "[#4011-48.]"),
        ("G99", "[#4010-96.]"),
        ("G54.1 P3", "#4130"),
        ("G54.1 P1\n#7041=3.", "#14041"),
        ("#5241=3.", "#5241"),
        ("G80 G20\n#5242=3.", "#5242"),
    ],
)
def test_parameters_of_the_control(text: str, value: str) -> None:
    ended = "G40\nG80 G69 G50 G54 G49 G0 X#1 Y0\nM30"
    program = parse_program(f"{HEAD}{text}\n#1={value}\n{ended}", TOOLED, Reading(dialect="fanuc"))
    inch = 25.4 if "G20" in text else 1.0
    assert program.end[-1, 0] == pytest.approx(3.0 * inch)


@pytest.mark.parametrize(
    "text",
    [
        "G10 L50\nN1220 P1 R100.\nN1320 P2 R-5.\nG11\nG1 X3.",
        "G10 L50\nN1 P1 R5.\nG2 X3. Y0 R9.",
        "G22 X100. Y100. Z100. I0 J0 K0\nG23\nG62\nG63\nG64\nG1 X3.",
        "SETVN 500[A,B]\n#500=3\nPOPEN\nDPRNT[X#1[53]]\nPCLOS\nG1 X#500",
        "M19 R90.\nM19 P45\nG1 X3.",
        "G98 G81 X5. Z-5. R1. F100.\nG80\nX3.",
        "G1 X9.\nG80\nX3.",
    ],
)
def test_what_sets_the_control_leads_where_it_should(text: str) -> None:
    assert parse_program(f"{HEAD}{text}\nM30", MACHINE).end[-1, 0] == 3.0


def test_air_and_questions_of_haas_are_no_printers() -> None:
    program = parse_program(HEAD + "M83\nG4 P500\nM84\nM109 P501 (SIZE?)\nG1 X3.\nM30", MACHINE)
    assert program.dwell.max() == 0.5
    assert not any("3-D printers run it" in text for text in program.assumptions)


@pytest.mark.parametrize(("peck", "said"), [("Q2000", True), ("Q2.", False), ("Q20.", False)])
def test_a_peck_far_beyond_the_hole_is_said(peck: str, said: bool) -> None:
    program = parse_program(f"{HEAD}G0 Z9.\nG83 X1. Z-5. R1. {peck} F100\nG80\nM30", MACHINE)
    assert any(f"line 4: {peck} is one peck to the bottom" in text for text in program.assumptions) == said


def levels(text: str) -> list[tuple[int, float, float]]:
    """Kind, x and z of the blocks behind a position at Z10."""
    program = parse_program(f"{HEAD}G0 X0 Y0 Z10.\n{text}\nG80\nM30", MACHINE)
    return [(int(kind), x, z) for kind, (x, _, z) in zip(program.kind, program.end.tolist(), strict=True)][1:]


def test_between_holes_the_tool_stays_at_its_height() -> None:
    """Fanuc's first operation of a cycle is the move in the plane, where the tool is; LinuxCNC rises on the way."""
    found = levels("G99 G81 X1. Z-5. R2.\nG98 X2.\nX3. R12.")
    r, f = int(Kind.RAPID), int(Kind.LINE)
    first = [(r, 1, 10), (r, 1, 2), (f, 1, -5), (r, 1, 2)]
    assert found == [
        *first,
        (r, 2, 2),
        (f, 2, -5),
        (r, 2, 10),
        (r, 3, 10),
        (r, 3, 12),
        (f, 3, -5),
        (r, 3, 12),
    ]


def test_g53_is_rapid_also_while_g1_is_in_force() -> None:
    head = f"{HEAD}G1 X5. Y0 Z1.\n"
    program = parse_program(f"{head}G53 Z0\nX7.\nG53 G1 Z2.\nM30", MACHINE)
    assert program.kind.tolist() == [Kind.LINE, Kind.RAPID, Kind.LINE, Kind.LINE]
    assert "rapid move, as Fanuc has it" in " ".join(program.assumptions)
    other = parse_program("G21 G90 F600\nG1 X5 Z1\nG53 Z0\n", MACHINE, Reading(dialect="linuxcnc"))
    assert other.kind.tolist() == [Kind.LINE, Kind.LINE]


def test_tapping_by_infeeds() -> None:
    program = parse_program(
        f"{HEAD}G0 Z10.\nM3 S500\nG98 G84 X1. Z-10. R2. Q5.\nX2.\nG84 X3. Z-10. Q0\nG80\nM30", MACHINE
    )
    cut = program.end[program.kind == Kind.LINE]
    assert cut[cut[:, 0] == 1, 2].tolist() == cut[cut[:, 0] == 2, 2].tolist() == [-3, 2, -8, 2, -10, 2]
    assert cut[cut[:, 0] == 3, 2].tolist() == [-10, 2]
    assert "each infeed of Q leads out to R" in " ".join(program.assumptions)
    # a full stop at every end but the last, which goes on to the level of G98
    of_first = program.line == 5
    assert (program.kind[of_first] == Kind.STOP).sum() == 5
    for q in ("-1.", "0.0000001"):
        with pytest.raises(InputError, match="Q"):
            parse_program(f"{HEAD}G0 Z10.\nM3 S500\nG98 G84 X1. Z-10. R2. Q{q}\nM30", MACHINE)
