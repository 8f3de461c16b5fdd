"""U and W: increments of a lathe, or axes of the machine."""

from __future__ import annotations

import numpy as np

import planner
from planner.machine import Axis, Machine

TEXT = "G21 G91 F600\nG1 X-6.4\nG1 X26 Z12 W20\nM2\n"


def machine(letters: str) -> Machine:
    axes = {letter: Axis(velocity=100.0, acceleration=1000.0, jerk=1e5) for letter in letters}
    return Machine(name="test", dt=1e-3, tolerance=0.01, axes=axes)


def test_a_w_of_the_machine_moves_it():
    program = planner.read_program(text=TEXT, machine=machine("xyzw"))
    np.testing.assert_allclose(program.end[-1][program.axes.index("w")], 20.0)


def test_a_w_that_the_machine_has_not_is_a_lathe_s():
    turned = planner.read_program(text="G21 G98 F600 S100 M3\nG1 X26 Z12\nX20 W2\nM2\n", machine=machine("xyz"))
    assert any("lathe" in note for note in turned.notes)
