"""The tool centre point in programs: where it is on, what moves with it off are, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Machine
from planner.machine.kinematics import kinematics_of
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from tests.machine.kinematics.five_axis import table_machine

LENGTH = 60.0
BARE = table_machine(y_offset=-20.0, z_offset=35.0, tool_length=LENGTH)
MACHINE = Machine(**(BARE.model_dump(exclude_none=True) | {"tools": {"1": 45.0, "2": 50.0}}))
CUT = "G1 X5 A10 C5 F600\nX10 A20\n"


def read(text: str, machine: Machine = MACHINE) -> Program:
    return parse_program(text, machine)


def joints(program: Program, length: float = LENGTH) -> np.ndarray:
    """(B, A) ends of the blocks in the joints [mm, rad]."""
    chain = kinematics_of(MACHINE).with_tool(length)
    found = program.end.copy()
    q = chain.joints(dict(zip(program.axes, program.end.T, strict=True)))
    found[:, :3] = np.stack([q[letter] for letter in "xyz"], axis=1)
    return found


@pytest.mark.parametrize(
    ("on", "off", "word", "length"),
    [
        ("M428", "M429", "M428", LENGTH),
        ("M128", "M129", "M128", LENGTH),
        ("G43.4 H1", "G49", "G43.4", 45.0),
        ("G43 H2\nM428", "M429", "M428", 50.0),
    ],
)
def test_words(on: str, off: str, word: str, length: float) -> None:
    program = read(f"G21 G90\nG0 X1 Y2\n{on}\n{CUT}G0 A0 C0\n{off}\nG0 X0\n")
    assert program.tool_point is not None
    assert (program.tool_point.word, program.tool_point.length) == (word, length)
    assert program.tool_point.line == 3 + on.count("\n")
    assert program.tool_point.rapids_off == 0
    assert program.axes == ("x", "y", "z", "a", "c")
    assert len(program) == 5
    assert any(f"({word})" in note and f"{length:g} mm" in note for note in program.notes)


def test_without_moves_of_rotary_axes_tip_and_joints_are_one() -> None:
    assert read("G21\nM428\nG1 X5 F600\nM429\n").tool_point is None
    assert read(f"G21\nM428\nM429\n{CUT}").tool_point is None  # nothing moves while it is on


def test_moves_off_at_angle_0_are_the_same_on_and_off() -> None:
    program = read(f"G21\nG1 X3 Y1 F500\nM428\n{CUT}G0 A0 C0\nM429\nG1 X7 Z3\n")
    assert np.allclose(joints(program)[0], [3, 1, 0, 0, 0])
    assert np.allclose(joints(program)[-1], [7, 1, 3, 0, 0])
    assert np.allclose(program.end[-1], [7, 1, 3, 0, 0])


def test_the_switch_moves_no_joint() -> None:
    """An axis that the next block does not name stays where its joint is, not where the tip's coordinate was."""
    program = read("G21\nG0 X1 Y2 Z3 A30 C10\nM428\nG1 X4 F600\nM429\nG0 X9\n")
    q = joints(program)
    first = int(np.flatnonzero(program.kind == Kind.LINE)[0])
    assert np.allclose(q[first - 1], [1, 2, 3, np.deg2rad(30), np.deg2rad(10)])
    assert program.end[first, 0] == 4.0
    assert np.allclose(program.end[first, 1:], program.end[first - 1, 1:])  # of the tip only x moves
    assert np.allclose(q[-1, 1:], q[first, 1:])  # of the joints only x moves
    assert q[-1, 0] == pytest.approx(9.0)


def test_rapid_moves_off_are_straight_lines_of_the_joints() -> None:
    program = read(f"G21 G0 X50 Y20\nA30 C40\nM428\n{CUT}")
    assert program.tool_point is not None
    assert program.tool_point.rapids_off == 1
    piece = np.flatnonzero(program.line == 2)
    assert len(piece) > 8
    assert (program.kind[piece] == Kind.RAPID).all()
    q = joints(program)[np.append(piece[0] - 1, piece)]
    assert np.allclose(q[:, :3], [50.0, 20.0, 0.0])  # they stand still, while the table turns the tip away
    p = program.end[np.append(piece[0] - 1, piece)]
    assert np.linalg.norm(p[-1, :3] - p[0, :3]) > 10.0
    # half-way between two ends the tip is within a tenth of the tolerance of the chord
    chain = kinematics_of(MACHINE)
    half = 0.5 * (q[1:] + q[:-1])
    at = chain.point(dict(zip(program.axes, half.T, strict=True)))
    bow = np.stack([at[c] for c in "xyz"], axis=1) - 0.5 * (p[1:, :3] + p[:-1, :3])
    assert 0.0 < np.linalg.norm(bow, axis=1).max() <= 0.1 * MACHINE.tolerance


def test_an_origin_holds_from_its_block_on_behind_chords() -> None:
    """The rapid before G52 becomes many blocks: the shift belongs to the moves behind them."""
    program = read(f"G21\nG0 A40 C30\nG0 X30 Y10\nM428\nG52 X2\n{CUT}")
    shifted = np.flatnonzero(program.line >= 6)
    for block, x in ((int(shifted[0]) - 1, 0.0), (int(shifted[0]), 2.0)):
        assert program.origins.at(block)[0][0] == x


def test_a_rapid_move_that_only_shifts_is_one_move() -> None:
    program = read(f"G21\nM428\n{CUT}M429\nG0 X30 Z10\n")
    assert (program.line == 6).sum() == 1
    assert np.allclose(joints(program)[-1, [0, 2]], [30.0, 10.0])


def test_events_dwells_and_arcs_keep_their_blocks() -> None:
    program = read(f"G21\nG0 A30 C40\nM8\nG4 P1\nM428\n{CUT}M9\nG2 X20 I5 J0\nM429\nG0 A0 C0\nM5\n")
    at = {
        event.text: int(program.line[event.block]) for event in program.events if event.block < len(program)
    }
    assert at["M8"] == 4
    assert at["M9"] == 9
    assert [event.text for event in program.events][-1] == "M5"
    assert program.line[program.arc_block[0]] == 9
    assert program.kind[program.line == 4].tolist() == [Kind.DWELL]
    assert program.dwell.sum() == 1.0


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (f"G21\nM428\n{CUT}M429\nG1 Z5\n", 6, "feed move with the tool centre point off"),
        (f"G21\nM428\n{CUT}G53 G0 Z5\n", 5, "G53 goes to a place of the joints"),
        (f"G21\nM428\n{CUT}G28 Z5\n", 5, "G28 goes to a place of the joints"),
        (f"G21\nG43.4 H1\n{CUT}G0 A0 C0\nG49\nG43.4 H2\n{CUT}", 7, "plan the part of each tool"),
        (f"G21\nG43.1 X5\nM428\n{CUT}", 3, "a tool on the spindle's axis"),
    ],
)
def test_refused(text: str, line: int, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        read(text)
    assert caught.value.line == line


def test_without_kinematics() -> None:
    plain = MACHINE.model_copy(update={"kinematics": None})
    program = read(f"G21\nM428\n{CUT}M429\n", plain)
    assert program.tool_point is None
    assert any("not followed" in note for note in program.notes)
    with pytest.raises(InputError, match=r"needs a machine with a table \[kinematics\]"):
        read(f"G21\nG43.4 H1\n{CUT}", plain)


SIEMENS = "N10 G71 G90\nN20 G0 X=1 Y2\nN30 {on}\nN40 G1 X5 A=10 C5 F600\nX10 A20\nN60 G0 A0 C0\nN70 TRAFOOF\nG0 X0\nM30\n"
HEIDENHAIN = (
    "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S1000\n2 L X+1 Y+2 FMAX{on}\n4 L X+5 A+10 C+5 F600\n5 L IX+5 A+20\n"
    "6 L A+0 C+0 FMAX\n7 M129\n8 L X+0 FMAX\n9 END PGM P MM\n"
)


@pytest.mark.parametrize(
    ("text", "tool", "length"),
    [
        (SIEMENS.format(on="TRAORI"), "", LENGTH),
        (SIEMENS.format(on="TRAORI(1)"), "", LENGTH),
        (HEIDENHAIN.format(on="\n3 M128"), "G43 H1", 45.0),  # the tool call brings its length
        (HEIDENHAIN.format(on="\n3 M128 F5000"), "G43 H1", 45.0),
    ],
)
def test_other_languages(text: str, tool: str, length: float) -> None:
    expected = read(f"G21 G90 {tool}\nG0 X1 Y2\nM428\n{CUT}G0 A0 C0\nM429\nG0 X0\n")
    found = read(text)
    assert found.tool_point is not None
    assert found.tool_point.length == length
    moves = np.isin(found.kind, (Kind.RAPID, Kind.LINE))  # a tool change is a stop
    assert np.allclose(found.end[moves], expected.end)
    assert found.kind[moves].tolist() == expected.kind.tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SIEMENS.format(on="TRAORI"), "TRAORI is not read on a machine without a table"),
        (HEIDENHAIN.format(on=" M128"), "M128 is not read"),
    ],
)
def test_other_languages_without_kinematics(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(text, MACHINE.model_copy(update={"kinematics": None}))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "G21 G43.5 H1\nG1 X1 I0 J0 K1 F100\n",
            "<text>:1:5: .*direction as a vector .*angles of the rotary axes",
        ),
        (
            "N10 G71 G90\nTRAORI\nG1 X5 A3=0 B3=0 C3=1 F600\nM30\n",
            "<text>:3:7: .*A3 is not read: a direction .*angles of the rotary axes",
        ),
        (
            "0 BEGIN PGM P MM\n1 LN X+1 Y+1 Z+1 TX+0 TY+0 TZ+1 F100\n2 END PGM P MM\n",
            "<text>:2:3: .*direction of the tool .*angles A, B, C are read.*L, C and CC",
        ),
    ],
)
def test_directions_of_the_tool_are_refused_with_what_to_do(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read(text)


def test_a_new_tool_length_while_it_is_on_moves_no_joint() -> None:
    """The joints stand; the tip of the new tool is where they put it, in y and z that the next block does not name."""
    program = read("G21\nG0 X1 Y2 Z3 A30 C10\nG43.4 H1\nG43.4 H2\nG1 X4 F600\nG49\nG0 A0 C0\n")
    chain = kinematics_of(MACHINE).with_tool(50.0)
    there = chain.point({"x": 1.0, "y": 2.0, "z": 3.0, "a": np.deg2rad(30), "c": np.deg2rad(10)})
    first = int(np.flatnonzero(program.kind == Kind.LINE)[0])
    assert np.allclose(program.end[first, :3], [4.0, there["y"], there["z"]])
