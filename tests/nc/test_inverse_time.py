"""Under G93 a block takes one over F minutes, however short it is; LinuxCNC, which knows no feed below 0.1 units/min, is told of."""

from __future__ import annotations

import numpy as np
import pytest
from same_program import STRICT, machine

from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine
from planner.nc.reader import parse_program

AXES = {a: {"velocity": 100, "acceleration": 1000, "jerk": 1e4} for a in "xyza"}
FOUR = Machine(name="four", dt=1e-3, tolerance=0.05, axes=AXES)


@pytest.mark.parametrize("unit", ["G20", "G21"])
@pytest.mark.parametrize(
    "words",
    [
        "G1 X{0:.7f}",
        "G1 X{0:.7f} Y{0:.7f}",
        "G1 Z-{0:.7f} A77",
        "G1 A{0:.7f}",
        "G3 X0 Y0 I{1:.7f}",
        "G18 G2 X0 Z0 I{1:.7f} A4",
    ],
)
@pytest.mark.parametrize("size", [2.5, 1e-2, 3e-5])
def test_a_block_takes_the_programmed_time(unit: str, words: str, size: float) -> None:
    """Length over feed, both of what F goes by, is 60 / F."""
    text = words.format(size, 1e3 * size)  # radii below a micrometre are refused
    for f in (0.3, 7.0, 400.0):
        program = parse_program(f"{unit} G93\n{text} F{f}", FOUR)
        toolpath = toolpath_from_program(program, FOUR)
        assert (toolpath.length / toolpath.feed).sum() == pytest.approx(60.0 / f, rel=1e-6)


def test_what_linuxcnc_does_faster_is_said_first() -> None:
    text = "G21 G93\nG1 X0.001 F50\nX7 F50\nX7.0001 F900\n"
    (said,) = parse_program(text, machine()).assumptions
    assert said.startswith("line 2: G93 asks for less than 0.1 units/min")
    assert said.endswith("(2 times)")
    with pytest.raises(InputError, match=r":2:11: F50: G93 asks for less"):
        parse_program(text, machine(), STRICT)
    assert not parse_program("G21 G93\nG1 X0.002 F50\nX0.002 F1", machine()).assumptions


def test_a_block_that_goes_nowhere_has_a_feed() -> None:
    program = parse_program("G21 G93\nG1 X0 F0.001\nX4 F30", machine())
    assert (program.feed > 0).all()
    assert program.feed[1] == pytest.approx(4 * 30 / 60)


@pytest.mark.parametrize("f", [1e-3, 2e-6])
def test_other_feed_modes_have_no_floor(f: float) -> None:
    per_minute = parse_program(f"G21 G94 F{f:.9f} G1 X2", machine()).feed[0]
    per_turn = parse_program(f"G21 G95 S30 M3 F{f:.9f} G1 X2", machine()).feed[0]
    np.testing.assert_allclose([per_minute, per_turn], [f / 60.0, f * 30.0 / 60.0])
