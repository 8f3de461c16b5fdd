"""Offsets: no code that sets one moves anything; what they do is written out by hand, and rotated systems rotate."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Machine, machine_from_dict
from planner.nc.program import Program
from planner.nc.reader import parse_program

HEAD = "G21 G90 F100\nG0 X1 Y2 Z3\n"
MACHINE = Machine(
    name="m", dt=1e-3, tolerance=0.01, tools={"1": 25.0, "2": {"length": 10.0, "x": 4.0}},
    axes={a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"},
    work_offsets={"g55": {"x": 10.0, "y": -5.0}},
)  # type: ignore[arg-type] # fmt: skip


def last(text: str) -> list[float]:
    """Where the program ends."""
    return [round(float(v), 9) + 0.0 for v in parse_program(HEAD + text, MACHINE).end[-1]]


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("G10 L2 P1 X10 Y20\nG0 X0 Y0", [10, 20, 3]),
        ("G10 L2 P0 X10\nG10 L2 P0 Y20\nG0 X0 Y0", [10, 20, 3]),
        ("G91 G10 L2 P1 X10\nG10 L2 P1 X10\nG90 G0 X0", [10, 2, 3]),
        ("G10 L20 P1 X0 Z0\nG0 X5 Z1", [6, 2, 4]),
        ("G10 L20 P3 X0\nG0 X50\nG56 G0 X0", [1, 2, 3]),
        ("G10 L2 P2 X7\nG55 G0 X0 Y0", [7, -5, 3]),
        ("G52 X3\nG0 X0", [3, 2, 3]),
        ("G92 Z9\nG10 L10 P3 Z7\nG43 H3\nG0 Z7", [1, 2, 3]),  # the place gets the coordinate, G92 counted in
        ("G92 X0\nG52 X3\nG92.2\nG0 X0\nG92.3 G0 X0", [3, 2, 3]),
        ("G43 H1\nG0 Z0", [1, 2, 25]),
        ("G43 H2\nG43.2 H1\nG0 X0 Z0", [4, 2, 35]),
        ("G43 H2\nG43.2 H0\nG0 X0 Z0", [4, 2, 10]),  # no tool has no length
        ("G43.1 Z5\nG0 Z0\nG49\nG0 Z1", [1, 2, 1]),
        ("G43.1 X5 Z1\nG43.1 Z2\nG43.2 Y1\nG0 X0 Y0 Z0", [5, 1, 2]),
        ("G10 L1 P1 Z7\nG43 H1\nG10 L1 P1 Z9\nG0 Z0", [1, 2, 7]),
        ("G10 L10 P1 Z1\nG43 H1\nG0 Z1", [1, 2, 3]),
        ("G10 L2 P9 Z2\nG10 L11 P1 Z1\nG43 H1 G0 Z1", [1, 2, 1]),
        ("G10 L2 P9 R90\nG10 L11 P1 X5\nG43 H1 G0 X0 Y0", [0, -3, 3]),
        ("G28.1\nG0 X50 Y50\nG28", [1, 2, 3]),
        ("G30.1\nG0 X50 Y50\nG30 Y60", [50, 2, 3]),
        ("G10 L2 P1 R90\nG0 X10 Y1", [-1, 10, 3]),
        ("G10 L2 P1 X5 R90\nG91 G0 X10", [1, 12, 3]),
        ("G10 L2 P1 R90\nG92 X0 Y0\nG0 X10", [1, 12, 3]),
        ("G10 L2 P1 R90\nG10 L20 P1 X0 Y0\nG0 X10", [1, 12, 3]),
        ("G10 L2 P1 R90\nG53 G0 X10", [10, 2, 3]),
        ("G10 L2 P1 R90\nG28 X5", [1, 0, 3]),
        ("M61 Q1\nG43\nG0 Z0", [1, 2, 25]),
    ],
)  # fmt: skip
def test_written_out(text: str, end: list[float]) -> None:
    assert last(text) == end


@pytest.mark.parametrize(
    "code",
    [
        "G10 L2 P1 X5 R30",
        "G10 L20 P1 X5",
        "G52 X4",
        "G92 X4 Y4",
        "G92.1",
        "G43 H1",
        "G43.1 Z4",
        "G28.1",
        "G10 L1 P1 Z3",
    ],
)
def test_setting_an_offset_moves_nothing(code: str) -> None:
    program = parse_program(HEAD + f"{code}\nG91 G0 Z1", MACHINE)
    np.testing.assert_allclose(program.end[-1], [1, 2, 4], atol=1e-12)


PATH = "G1 X20 Y3\nG2 X30 Y13 I10 J0\nG3 X40 Y3 R10\nG91 G1 X5 Y5 Z1\nG90 G90.1 G2 X55 Y8 I50 J8\nG91.1 G81 X3 Y4 Z1 R2\n"


def rotated(program: Program, angle: float) -> np.ndarray:
    flat = (program.end[:, 0] + 1j * program.end[:, 1]) * np.exp(1j * np.deg2rad(angle))
    return np.column_stack([flat.real, flat.imag, program.end[:, 2]])


@pytest.mark.parametrize("angle", [90.0, 180.0, -90.0, 37.5])
def test_rotated_systems_rotate_lines_arcs_and_cycles(angle: float) -> None:
    head = "G21 G90 F100\nG0 X0 Y0 Z3\n"
    plain, turned = parse_program(head + PATH), parse_program(head + f"G10 L2 P1 R{angle}\n" + PATH)
    np.testing.assert_allclose(turned.end, rotated(plain, angle), atol=1e-9)
    np.testing.assert_allclose(turned.arc_sweep, plain.arc_sweep, atol=1e-9)


@pytest.mark.parametrize(("angle", "normal", "sign"), [(90, 0, -1), (180, 1, -1), (-90, 0, 1), (360, 1, 1)])
def test_quarter_turns_turn_the_planes_of_arcs(angle: int, normal: int, sign: int) -> None:
    """G18 in a system that is turned by a quarter is an arc about x."""
    text = "G18 G2 X10 Z13 I10 K0\n"
    plain = parse_program("G21 F100\nG0 Z3\n" + text)
    turned = parse_program(f"G21 F100\nG10 L2 P1 R{angle}\nG0 Z3\n" + text)
    np.testing.assert_allclose(turned.end, rotated(plain, angle), atol=1e-12)
    assert turned.arc_normal.tolist() == [normal]
    assert turned.arc_sweep[0] == pytest.approx(sign * plain.arc_sweep[0])


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("G10 P1 X1", "needs L1, L10 or L11"),
        ("G10 L3 P1 X1", "needs L1, L10 or L11"),
        ("G10 L2 X1", "P0 (the one in force) or P1 to P9"),
        ("G10 L2 P10 X1", "P0 (the one in force) or P1 to P9"),
        ("G10 L2 P1 I1", "does not use I"),
        ("G10 L20 P1 R1", "does not use R"),
        ("G10 L1 Z1", "needs its tool as a P word"),
        ("G10 L2 P1 X1 G1", "both use the axis words"),
        ("G52", "at least one of X, Y and Z: the offsets"),
        ("G43.2", "needs a tool as an H word"),
        ("G43.2 H1 Z1", "not both"),
        ("G10 L2 P1 R30\nG18 G2 X5 Z5 R9", "only quarter turns"),
        ("M61", "as a Q word"),
    ],
)  # fmt: skip
def test_refused(text: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_program(HEAD + text, MACHINE)
    assert part in caught.value.message


def test_angles_and_edges_of_tools_are_said_not_to_be_used() -> None:
    """Only those that the line has, each with its line."""
    program = parse_program(HEAD + "G10 L1 P3 Z7\nG10 L1 P4 Z7 J30 Q2\nG0 X5\n", MACHINE)
    said = [note.partition(" is not used")[0] for note in program.notes if "is not used" in note]
    assert said == ["line 4: J of G10 L1", "line 4: Q of G10 L1"]


def test_tools_of_a_machine_are_numbers_or_tables() -> None:
    tools = MACHINE.tools
    assert (tools["1"].length, tools["1"].diameter, tools["2"].x) == (25.0, 0.0, 4.0)
    with pytest.raises(ValueError, match=r"tools\.1\.diameter"):
        Machine(**{**MACHINE.model_dump(), "tools": {"1": {"diameter": -1.0}}})


def test_further_work_systems_of_fanuc() -> None:
    given = MACHINE.model_copy(update={"work_offsets": {"g54.1p3": {"x": 5.0, "z": -2.0}}})
    program = parse_program("G21 G0 X1\nG54.1 P3 G0 X1 Z1\nG54.1 P4 X1\nG54 X1\nM30", given)
    assert program.end[:, 0].tolist() == [1.0, 6.0, 1.0, 1.0]
    assert program.end[1, 2] == -1.0
    assert [note for note in program.notes if "G54.1 P4 has no offset" in note]
    for wrong in ("G54.1 X1", "G54.1 P0 X1", "G54.1 P301", "G54.1 P1.5"):
        with pytest.raises(InputError, match="P"):
            parse_program(f"G21 G0 X1\n{wrong}\nM30")
    with pytest.raises(InputError, match=r"g54\.1p301"):
        machine_from_dict({**MACHINE.model_dump(), "work_offsets": {"g54.1p301": {"x": 1.0}}})


def test_g10_of_fanuc_gives_the_offset_itself() -> None:
    """G10 L20 P3 is the origin of G54.1 P3 there, and where LinuxCNC is spoken the offset with which the place has the coordinates."""
    for kind, use in (("L20 P3", "G54.1 P3"), ("L2 P4", "G54.1 P1\nG57")):
        assert last(f"G10 {kind} X10 Z-1\n{use} G0 X1 Z1") == [11, 2, 0]
    assert last("G10 L20 P3 X0\nG56 G0 X0") == [1, 2, 3]
    assert last("#1=3\nG10 L20 P#1 X9\nG54.1 P#1 G0 X0\nGOTO 5\nN5 M30") == [9, 2, 3]
    for wrong, said in (
        ("L2 P0", "external"),
        ("L2 P7", "P1 to P6"),
        ("L20 P301", "P1 to P300"),
        ("L20 P1 R9", "R"),
        ("L2 P1 G91", "adds after G91"),
    ):
        with pytest.raises(InputError, match=said):
            last(f"G10 {wrong} X1\nG54.1 P1 G0 X1")
