"""Which programs without U and W are those of a Fanuc or Haas lathe, and what is said where that cannot be known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from language_programs import same

from planner.base.errors import InputError
from planner.machine import DialectData, load_machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

MILL = load_machine("mill")
LATHE = MILL.model_copy(update={"dialect": DialectData(lathe=True)})
CUT = "G0 X44. Z3.\nG1 X38. F0.3\nZ-25.\nG2 X42. Z-27. R2.\nG0 X90. Z80.\nM30"

SIGNS = {
    "a tool with its offset": f"G21\nT0303\nG97 S900 M3\n{CUT}",
    "the largest speed": f"G21\nG50 S1800\nG97 S900 M3\n{CUT}",
    "surface speed": f"G21\nG50 S1800\nG96 S120 M3\n{CUT}",
    "feed per turn": f"G21\nG99 G40 G97 S900 M3\n{CUT}",
    "all of them, in inches": f"%\nO0007 (RING)\nG20 G40 G99\nT0101\nG50 S1800\nG96 S400 M4\n{CUT}",
    "with its plane": f"G18 G21\nT0303\nG97 S900 M3\n{CUT}",
    "with a cycle of system A": f"G21\nT0303\nG97 S900 M3\nG0 X46 Z3\nG90 X40. Z-25. F0.3\n{CUT}",
}


def lathe_note(program: Program) -> bool:
    return any("lathe: X and U are diameters" in note for note in program.notes)


@pytest.mark.parametrize("name", SIGNS)
def test_a_lathe_s_program_is_read_as_the_machine_file_would_say(name: str) -> None:
    program = parse_program(SIGNS[name], MILL)
    same(program, parse_program(SIGNS[name], LATHE), apart=0.0)
    assert lathe_note(program)
    assert program.end[-1, 0] == pytest.approx(
        45.0 * (25.4 if "inches" in name else 1.0)
    )  # X90 is a diameter


def test_feeds_per_turn_and_arcs_in_z_x() -> None:
    """F0.3 at 900 turns a minute is 270 mm/min, and the arc of R2 is a quarter of a circle about y."""
    program = parse_program(SIGNS["a tool with its offset"], MILL)
    cuts = np.isin(program.kind, (Kind.LINE, Kind.ARC))
    np.testing.assert_allclose(program.feed[cuts] * 60, 270.0)
    assert program.arc_normal.tolist() == [1]
    assert abs(program.arc_sweep[0]) == pytest.approx(math.pi / 2)


OTHERS = {
    "y": f"T0303\nG97 S900 M3\nG0 Y1\n{CUT}",
    "a mill's tool change": f"G17 T0303 M6\nS900 M3\n{CUT}",
    "tool change": f"T0303 M6\nS900 M3\n{CUT}",
    "a retract": "G99 G81 X5 Z-3 R2 F100\nX10\nG80\nM30",
    "surface speed of LinuxCNC": f"G7 G18 G95 G96 D1800 S120 M3\n{CUT}",
    "its limit": f"G96 D1800 S120 M3\n{CUT}",
    "absolute": f"G90\nT0303\n{CUT}",
    "nothing": f"S900 M3\n{CUT}",
    "a short tool": f"T3\nS900 M3\n{CUT}",
}


@pytest.mark.parametrize("name", OTHERS)
def test_programs_of_others_stay_theirs(name: str) -> None:
    assert not lathe_note(parse_program("G21\n" + OTHERS[name], MILL))


def test_the_machine_file_and_strict_reading_decide() -> None:
    text = SIGNS["a tool with its offset"].replace("T0303\n", "").replace("G2 X42. Z-27. R2.", "G99")
    assert lathe_note(parse_program(text, MILL))
    no_lathe = MILL.model_copy(update={"dialect": DialectData(lathe=False)})
    assert not lathe_note(parse_program(text, no_lathe))
    assert not lathe_note(parse_program(text, MILL, Reading(strict=True)))


@pytest.mark.parametrize(
    ("feed", "said"), [("F0.3", True), ("F1", False), ("G95 F0.3", False), ("G93 F0.3", False)]
)
def test_a_feed_that_looks_like_one_per_turn_is_said(feed: str, said: bool) -> None:
    program = parse_program(f"G21 G17\nS900 M3\nG0 X4 Y2\n{feed} G1 X0.5\nM30", MILL)
    notes = [note for note in program.notes if "looks like a feed per turn" in note]
    assert bool(notes) == said
    assert not said or notes[0].startswith("line 4: F looks like a feed per turn of the spindle (G95)")
    inch = parse_program("G20 G17\nG0 X4 Y2\nG1 X0.5 F0.012\nM30", MILL)
    assert any("looks like a feed per turn" in note for note in inch.notes)


@pytest.mark.parametrize("arc", ["G2 X30 Z-5 K-5", "G18 G2 X30 Z-5 I5", "G2 X30 Z-5 R4"])
def test_faults_of_arcs_name_the_key_where_nothing_moves_y(arc: str) -> None:
    text = f"G21\nG0 X20 Z2\nG1 Z0 F100\n{arc}\nM30"
    with pytest.raises(
        InputError, match=r"if this is a lathe's program, write lathe = true under \[dialect\]"
    ):
        parse_program(text, MILL)
    with pytest.raises(InputError) as found:
        parse_program(text.replace("G0", "G0 Y1"), MILL)
    assert "lathe" not in str(found.value)


def test_a_helix_where_nothing_moves_y_is_said() -> None:
    program = parse_program("G21\nG0 X20 Z2\nG1 Z0 F100\nG2 X30 Z-5 R5\nM30", MILL)
    assert any(note.startswith("line 4: an arc with Z in the plane X/Y is a helix") for note in program.notes)
    program = parse_program("G21\nG0 X20 Z2\nG1 Z0 F100\nG18 G2 X30 Z-10 R10\nM30", MILL)
    assert not any("helix" in note for note in program.notes)
