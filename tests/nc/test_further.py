"""Axes beside x, y and z in programs: against LinuxCNC's interpreter, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import Canon, recorded
from random_nc import number, pick

from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine
from planner.nc.program import MOVES, Kind, Program
from planner.nc.reader import parse_program

FURTHER = "abcuvw"
ALL = "xyz" + FURTHER


def machine_of(letters: str = ALL, **axis_of: dict) -> Machine:
    """A machine with these axes; `axis_of` adds to the table of some."""
    plain = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 20000.0}
    return Machine(
        name="all",
        dt=0.001,
        tolerance=0.01,
        axes={letter: plain | axis_of.get(letter, {}) for letter in letters},
    )


def random_text(rng: np.random.Generator) -> str:
    """A program of valid lines with words of all nine axes."""
    lines = ["G21 G0 X1 Y2 Z3 A4", "F120"]
    inverse = False

    def words(scale: float = 20.0, most: int = 4) -> str:
        chosen = rng.permutation(list(ALL.upper()))[: rng.integers(1, most + 1)]
        return " ".join(f"{letter}{number(rng, -scale, scale)}" for letter in chosen)

    for _ in range(rng.integers(5, 25)):
        choice = rng.integers(12)
        if choice < 6:
            code = pick(rng, "G0", "G1", "G1")
            lines.append(
                f"{code} {words()}" + (" F" + number(rng, 0.5, 9) if inverse and code == "G1" else "")
            )
        elif choice == 6 and not inverse:
            lines.append(f"G91.1 G91 {pick(rng, 'G2', 'G3')} X4 Y0 I2 J0 {words(90.0, 2).translate(NO_XYZ)}")
            lines.append("G90")
        elif choice == 7:
            lines.append(pick(rng, "G90", "G91"))
        elif choice == 8:
            lines.append(pick(rng, "G92 ", "G10 L2 P1 ", "G10 L20 P2 ") + words())
        elif choice == 9:
            lines.append(pick(rng, "G54", "G55", "G92.1", "G92.2", "G92.3", "G28.1"))
        elif choice == 10:
            lines.append(pick(rng, "G28", "G28 " + words(), "G90 G53 G0 " + words()))
        else:
            inverse = not inverse
            lines.append("G93" if inverse else "G94 F" + number(rng, 50, 900))
    return "\n".join([*lines, "M2"]) + "\n"


NO_XYZ = str.maketrans({"X": "A", "Y": "B", "Z": "C"})


def in_nine(program: Program) -> np.ndarray:
    """(B, 9) ends of the blocks in mm and degrees."""
    ends = np.zeros((len(program), len(ALL)))
    for k, letter in enumerate(program.axes):
        ends[:, ALL.index(letter)] = program.end[:, k] / (RAD_PER_DEG if letter in "abc" else 1.0)
    return ends


def assert_same(program: Program, canon: Canon) -> None:
    ends = in_nine(program)
    mine = [k for k in range(len(program)) if program.kind[k] in MOVES and moved(ends, k)]
    there = np.hstack([canon.move[:, 2:5], canon.further])
    theirs = [k for k in range(len(there)) if moved(there, k)]
    np.testing.assert_array_equal(program.line[mine], canon.move[theirs, 1])
    np.testing.assert_allclose(ends[mine], there[theirs], rtol=1e-12, atol=1e-9)
    for k, move in zip(mine, canon.move[theirs], strict=True):
        if program.kind[k] == Kind.RAPID:
            assert move[0] == Kind.RAPID
            continue
        change = np.abs(ends[k] - (ends[k - 1] if k else 0.0))
        turns = change[[0, 1, 2, 6, 7, 8]].max() == 0.0
        feed = program.feed[k] * 60.0 / RAD_PER_DEG if turns else program.feed[k] * 60.0
        assert feed == pytest.approx(move[5], rel=1e-9), program.line[k]


def moved(ends: np.ndarray, k: int) -> bool:
    return bool(np.abs(ends[k] - (ends[k - 1] if k else 0.0)).max() > 1e-9)


@pytest.mark.shows("rotary", "compared: LinuxCNC's rs274 in nine axes, recorded answers")
def test_programs_in_nine_axes_agree_with_the_recorded_answers() -> None:
    machine, read = machine_of(), 0
    for text, canon in recorded()["nine axes"]:
        try:
            program = parse_program(text, machine)
        except InputError as fault:
            refused = str(fault)
        else:
            refused = ""
        assert bool(canon.error) == bool(refused), f"{text}\nthe reader: {refused}; LinuxCNC: {canon.error}"
        if canon.error:
            continue
        try:
            assert_same(program, canon)
        except AssertionError as fault:
            raise AssertionError(f"{text}\n{fault}") from fault
        read += 1
    assert read > len(recorded()["nine axes"]) / 2


def test_f_is_the_speed_of_what_moves() -> None:
    program = parse_program("G21 F600\nG1 X10 A90\nU5 B3\nC7\nG93 C17 F3\n", machine_of())
    degrees = program.feed / RAD_PER_DEG
    np.testing.assert_allclose(program.feed[:2], 10.0)
    np.testing.assert_allclose(degrees[2:], [10.0, 10.0 * 3.0 / 60.0])


def test_a_wrapped_axis_goes_in_the_direction_of_its_sign() -> None:
    machine = machine_of("xyza", a={"wrapped": True})
    program = parse_program("G21 G0 A90\nA10\nA-350\nA0\n", machine)
    np.testing.assert_allclose(program.end[:, 3] / RAD_PER_DEG, [90.0, 370.0, 350.0, 360.0])
    stays = parse_program("G21 G0 A30\nA-30\nA30\nG91 A30\nG90 A-30\n", machine)
    np.testing.assert_allclose(stays.end[:, 3] / RAD_PER_DEG, [30.0, 30.0, 30.0, 60.0, 30.0])
    with pytest.raises(InputError, match=r":1:.*A is wrapped"):
        parse_program("G21 G0 A360\n", machine)


def test_a_wrapped_axis_with_offsets_goes_where_linuxcnc_s_interpreter_goes() -> None:
    """Answers of `rs274 -g -i` with WRAPPED_ROTARY, plus its offsets: after G53 the magnitude of the number less the offsets counts."""
    machine = machine_of("xyzc", c={"wrapped": True})
    moves = "G0 C350\nC10\nG53 C20\nG53 C-20\nC-0\nG1 C-350 F1000\nG91 C-30\n"
    program = parse_program(f"G21 G10 L2 P1 C30\n{moves}G90 G92 C5\nG53 G0 C100\nC100\nC-100\n", machine)
    answers = [-10, 10, 10, -310, -360, -370, -400, 475 - 405, 820 - 405, 820 - 405]
    np.testing.assert_allclose(program.end[:, 3] / RAD_PER_DEG, np.add(answers, 30.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G21 F100\nG41.1 D4 G1 X9 A3\n", "A under cutter radius compensation"),
        ("G21 F100\nG81 X1 Z-3 R2 B9\n", "B in a cycle"),
        ("G21 F100\nG5 X9 Y9 I1 J1 P-1 Q-1 U4\n", "U on a spline"),
        ("G21\nG43.1 Z3 W2\n", "W of a tool offset"),
    ],
)
def test_places_that_do_not_know_further_axes_refuse_them(text: str, said: str) -> None:
    with pytest.raises(InputError, match=f":2:.*{said}"):
        parse_program(text, machine_of())


def test_axes_that_the_machine_lacks_and_that_stand_still_leave_the_program_as_it_is() -> None:
    with pytest.raises(InputError, match=r":2:.*A5"):
        parse_program("G21 F100 G1 X1 A0\nX2 A5\n", machine_of("xyz"))
    assert parse_program("G21 F100\nG1 X2 A0\n", machine_of()).axes == ("x", "y", "z")


def test_a_switch_to_the_tool_centre_point_is_not_passed_over() -> None:
    text = "G21 G90 F500\nM428\nG1 X1 A10\nM429\nM2\n"
    said = [note for note in parse_program(text, machine_of("xyza")).notes if "tool centre point" in note]
    assert len(said) == 1
    assert said[0].startswith("1 switch")
    assert "first M428 line 2" in said[0]
    assert not any(
        "tool centre point" in note
        for note in parse_program(text.replace(" A10", ""), machine_of("xyz")).notes
    )


def test_a_wrapped_axis_that_is_there_stays() -> None:
    """LinuxCNC turns back by a turn only from a place beyond it (interp_find.cc, unwrap_rotary): A-30 at A30 moves nothing."""
    machine = machine_of("xyza", a={"wrapped": True})
    program = parse_program("G21 G0 A30\nA-30 X1\nA30 X2\nA-29 X3\nA-30 X4\nA30 X5\n", machine)
    np.testing.assert_allclose(program.end[:, 3] / RAD_PER_DEG, [30.0, 30.0, 30.0, 29.0, -330.0, -330.0])


@pytest.mark.parametrize(
    ("words", "length"), [("U10", 10.0), ("V3 W-4", 5.0), ("U10 A90", 10.0), ("X3 Y4 U100", 5.0)]
)
def test_inverse_time_of_further_linear_axes(words: str, length: float) -> None:
    """F2 is half a minute for the length that F goes by: x, y, z, else u, v, w."""
    program = parse_program(f"G21 G93\nG1 {words} F2\n", machine_of())
    assert program.feed[0] == pytest.approx(length / 30.0)
    inch = parse_program(f"G20 G93\nG1 {words} F2\n", machine_of())
    assert inch.feed[0] == pytest.approx(25.4 * length / 30.0)
