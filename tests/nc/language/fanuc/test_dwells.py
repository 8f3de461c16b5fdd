"""Every P of Fanuc's that is a dwell is in milliseconds: beside G4, in cycles, in force or computed, with and without macros."""

from __future__ import annotations

import numpy as np
import pytest
from same_program import STRICT, machine, same_motion

from planner.base.errors import InputError
from planner.machine import Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import flat_program

FANUC, LINUXCNC = Reading(dialect="fanuc"), Reading(dialect="linuxcnc")
HEAD = "G21 G90 F240 S700 M3 G99\n"
TELLS: Machine = machine(work_offsets={"g54": {"x": 1.0}, "g54.1p2": {"x": 5.0}})
# Lines with {} for a time, and the dwells that they make, as places of the times.
LINES = [
    ("G4 P{}", [0]),
    ("G82 X1 Z-2 R1 P{}\nX2\nX3 P{}\nY4", [0, 0, 1, 1]),
    ("G89 X1 Z-2 R1 P{}\nG80\nG4 P{}", [0, 1]),
    ("G86 X1 Z-2 R1 P{}\nG82 X4 Z-2 R1 P{}", [0, 1]),
    ("G84 X1 Z-2 R1 P{}\nG4 P{}\nX9", [0, 1, 0]),
    ("G82 X1 Z-2 R1 P{}\nG10 L2 P1 X3\nX2 P{}", [0, 1]),
    ("G82 X1 Z-2 R1 P{}\nG54.1 P2 G80\nG4 P{}", [0, 1]),
    ("M98 P30\nG82 X1 Z-2 R1 P{}\nM98 P30\nX6", [0, 0]),
    ("#1={}\nG82 X1 Z-2 R1 P#1\nX2 P[#1/2]\nG80 G4 P#1", [0, 0.5, 0]),
    ("M98 P40 L2\nG80\nM4\nG4 P{}", [0, 0, 0]),
]
SUBPROGRAMS = "M30\nO30\nM99\nO40\nG82 X1 Z-2 R1 P{}\nM99\n"


def dwells(program: Program) -> list[float]:
    return program.dwell[program.dwell > 0].tolist()


@pytest.mark.parametrize(("lines", "places"), LINES)
def test_dwells_are_in_milliseconds(lines: str, places: list[float]) -> None:
    times = [1300, 70]
    given = (HEAD + lines + "\n").format(*times) + SUBPROGRAMS.format(times[0])
    seconds = [times[0] * 0.0005 if place == 0.5 else times[int(place)] * 0.001 for place in places]
    program = parse_program(given, TELLS, FANUC)
    assert dwells(program) == pytest.approx(seconds)
    flat = flat_program(given.encode(), TELLS, FANUC, source="job.nc")
    if flat is not None:  # as expanded, it says the same to all controls
        for reading in (FANUC, LINUXCNC):
            assert dwells(parse_program(flat[0], TELLS, reading)) == pytest.approx(seconds)


def test_with_a_point_haas_takes_seconds() -> None:
    text = HEAD + "G4 P1.5\nG82 X1 Z-2 R1 P2.\nX2 P.25\nX5 P250\n"
    assert dwells(parse_program(text, machine(), FANUC)) == [1.5, 2.0, 0.25, 0.25]


@pytest.mark.parametrize("text", ["G4 P40", "G0 Z3\nG82 X1 Z-2 R1 P7\nX8 P0.5", "G82 Z-1 R1 P2\nG80 G4 P3"])
def test_other_dialects_take_seconds_and_nothing_else_changes(text: str) -> None:
    """The same program with its times times a thousand is Fanuc's."""
    fanuc = " ".join(
        f"P{float(word[1:]) * 1000:.0f}" if word[0] == "P" else word
        for word in (HEAD + text).replace("\n", " \n ").split(" ")
    )
    one, other = parse_program(HEAD + text, machine(), LINUXCNC), parse_program(fanuc, machine(), FANUC)
    assert same_motion(one, other)
    assert same_motion(one, parse_program(HEAD + text, machine()))


@pytest.mark.parametrize("text", ["G4 P500", "G82 X1 Z-2 R1 P500", "G4 P60", "G84 X1 Z-2 R1 P90"])
def test_a_long_dwell_in_seconds_is_said_first_unless_the_dialect_is_given(text: str) -> None:
    program = parse_program(HEAD + text, machine())
    (said,) = (it for it in program.assumptions if "a dwell of" in it)
    assert "seconds" in said
    assert "--dialect fanuc" in said
    with pytest.raises(InputError, match="a dwell of"):
        parse_program(HEAD + text, machine(), STRICT)
    for reading in (FANUC, LINUXCNC):
        assert not any(
            "a dwell of" in it for it in parse_program(HEAD + text, machine(), reading).assumptions
        )
    short = parse_program(HEAD + "G4 P59\n", machine())
    assert not short.assumptions
    assert np.isclose(short.dwell.sum(), 59.0)
    (of_x,) = parse_program(HEAD + "G4 X70.\n", machine()).assumptions
    assert "a dwell of 70 s: read in seconds" in of_x  # whatever its letter is


@pytest.mark.parametrize("letter", "XU")
@pytest.mark.parametrize("unit", ["G21", "G20"])
@pytest.mark.parametrize("number", [1, 99, 100, 2500])
def test_x_and_u_follow_the_rule_of_lengths(letter: str, unit: str, number: int) -> None:
    """Seconds, said first, where lengths without a point are whole units; least increments where the machine has them."""
    text = HEAD.replace("G21", unit) + "G1 X1. F9.\nG4 {}{}\nG1 X2.\n"
    increments = machine(dialect={"least_increment": 0.001})
    for tail in ("", "#1=5\n"):  # with macros, too
        whole = parse_program(text.format(letter, number) + tail, machine(), FANUC)
        assert dwells(whole) == [number]
        assert [said for said in whole.assumptions if "without a point is read in seconds" in said]
        fine = parse_program(text.format(letter, number) + tail, increments, FANUC)
        assert dwells(fine) == [pytest.approx(number * 0.001)]
        for of in (machine(), increments):
            pointed = parse_program(text.format(letter, f"{number}.") + tail, of, FANUC)
            assert dwells(pointed) == [number]
            assert not [said for said in (*pointed.notes, *fine.notes) if "without a point" in said]
