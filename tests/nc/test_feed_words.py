"""What F counts and in which unit, where controls differ: Fanuc's manual (rotary axes, 40 degrees and 20 mm at F300 take 0.14907
min), grbl (gc_execute_line: the units of the block), LinuxCNC (x, y, z alone; F before G20)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from same_program import STRICT, machine

from planner.machine import Machine, machine_from_dict
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import retimed

AXES = {a: {"velocity": 100, "acceleration": 1000, "jerk": 1e4} for a in "xyzacu"}
SIX = Machine(name="six", dt=1e-3, tolerance=0.05, axes=AXES)
LINUXCNC, GRBL, FANUC, HAAS = (Reading(dialect=name) for name in ("linuxcnc", "grbl", "fanuc", "haas"))
ITS_OWN, BEHIND = "is their own speed", "Fanuc and grbl read it behind"


def minutes(program: Program) -> list[float]:
    """Of each feed move, by what F goes by."""
    steps = np.diff(program.end, axis=0, prepend=0.0)
    turns = np.array([axis in "abc" for axis in program.axes])
    groups = [np.arange(len(turns)) < 3, ~turns & (np.arange(len(turns)) >= 3), turns]
    lengths = [next(np.linalg.norm(step[g]) for g in groups if step[g].any()) for step in steps]
    return (np.array(lengths) / program.feed / 60)[program.kind == Kind.LINE].tolist()


@pytest.mark.parametrize("extra", ["", " M8"])  # by the compiled loop, and word by word
@pytest.mark.parametrize("unit", [1.0, 25.4])
def test_fanuc_and_grbl_count_degrees_as_lengths(unit: float, extra: str) -> None:
    lines = ("G1 X20. A40.", "U3. C4. X20.", "A90.", "X25.", "U9. A80.")
    text = f"G9{{}} G{20 if unit > 1 else 21}\nF300\n" + "\n".join(line + extra for line in lines)
    absolute = [math.hypot(20, 40), 5.0, 50.0, 5.0, math.hypot(6, 10)]
    for reading in (GRBL, FANUC, HAAS):
        program = parse_program(text.format(0), SIX, reading)
        assert minutes(program) == pytest.approx([length / 300 for length in absolute], rel=1e-12)
    steps = [math.hypot(20, 40), math.sqrt(3**2 + 4**2 + 20**2), 90.0, 25.0, math.hypot(9, 80)]
    assert minutes(parse_program(text.format(1), SIX, FANUC)) == pytest.approx(
        [length / 300 for length in steps], rel=1e-12
    )
    linear = [20, 3, 50, 5, 6]
    linuxcnc = parse_program(text.format(0), SIX, LINUXCNC)
    assert minutes(linuxcnc) == pytest.approx([length / 300 for length in linear], rel=1e-12)


def test_what_f_counts_is_said_where_the_dialect_is_not_known() -> None:
    text = "G21 G90\nF300\nG1 X20 A40\n"
    assert [ITS_OWN in note for note in parse_program(text, SIX).assumptions] == [True]
    for other in ("G1 X20\nA40", "G93 G1 X20 A40 F1", "G0 X20 A40"):
        assert not parse_program(f"G21 G90\nF300\n{other}\n", SIX).assumptions
    for reading in (LINUXCNC, GRBL, FANUC, STRICT):
        assert not parse_program(text, SIX, reading).assumptions


def test_under_g93_and_at_the_tip_f_is_what_it_is_elsewhere() -> None:
    text = "G21 G90\nF300\nG93 G1 X20. A40. F2\n"
    assert minutes(parse_program(text, SIX, FANUC)) == pytest.approx([0.5])
    five = SIX.model_dump(exclude_none=True) | {"kinematics": {"type": "xyzac-trt"}}
    five["axes"].pop("u")
    text = "G21 G90\nF300\nG43.4 H1\nG1 X20. A40.\nG49\n"
    program = parse_program(text, machine_from_dict(five), FANUC)
    assert program.feed[program.kind == Kind.LINE] * 60 == pytest.approx([300])


def test_fanuc_counts_the_radius_of_an_arc_under_g93() -> None:
    """FRN is the feed over the length of a line and over the radius of an arc (Fanuc, inverse time feed)."""
    text = "G21 G90 G17\nG93 G1 X10. F2\nG2 X30. I10. F2\nG3 X30. Z9. I5. F2\n"
    program = parse_program(text, machine(), FANUC)
    assert program.feed * 60 == pytest.approx([20, 20, 10])
    program = parse_program(text, machine(), LINUXCNC)
    assert program.feed * 60 == pytest.approx([20, 20 * math.pi, 2 * math.hypot(10 * math.pi, 9)])


@pytest.mark.parametrize("mode", ["G94", "G95 S2"])
def test_f_beside_a_change_of_the_unit(mode: str) -> None:
    text, times = f"{mode} G20 G1 X1 F10\nG21 F100 X50\n", 1 if mode == "G94" else 2
    before, behind = [10 * times, 2540 * times], [254 * times, 100 * times]
    for reading, feeds in (
        (LINUXCNC, before),
        (STRICT, before),
        (Reading(), before),
        (GRBL, behind),
        (FANUC, behind),
    ):
        program = parse_program(text, machine(), reading)
        assert program.feed * 60 == pytest.approx(feeds)
        assert sum(BEHIND in note for note in program.assumptions) == 2 * (reading == Reading())


def test_new_feeds_are_written_in_the_unit_that_f_has() -> None:
    text = b"G20 G1 X1 F10\nG21 F100 X50\nX60\n"
    for reading in (LINUXCNC, GRBL):
        program = parse_program(text, machine(), reading)
        again = parse_program(retimed(text, program, program.feed / 2), machine(), reading)
        assert again.feed == pytest.approx(program.feed / 2, rel=2e-3)


def test_coordinates_without_a_point_beside_others_are_said_on_fanuc_s_controls() -> None:
    said = "X10000 without a point beside coordinates with one is in whole units"
    text = "G21 G90 G0 X0 Y0\nX10000 Z5.\n"
    assert said in " ".join(parse_program(text, machine(), FANUC).assumptions)
    thousandths = machine(dialect={"least_increment": 0.001})
    for other, reading, on in (
        (text, LINUXCNC, machine()),
        (text, FANUC, thousandths),
        ("G21 G90 G0 X10 Y5\n", FANUC, machine()),
        ("G21 G90 G0 X10. Y5. Z0\n", FANUC, machine()),
    ):
        assert not parse_program(other, on, reading).assumptions
