"""Notes on numbers that are allowed and hardly meant."""

from __future__ import annotations

import pytest

from planner.geometry.build import toolpath_from_program
from planner.machine import Machine, builtin_machines, load_machine
from planner.nc.reader import parse_program, read_program
from planner.planning.job.notes import inch_notes, short_block_notes, unit_notes

MILL = load_machine("mill")


def short(machine: Machine, text: str) -> list[str]:
    return short_block_notes(toolpath_from_program(parse_program(text, machine), machine, None))


def scaled(velocity: float = 1.0, acceleration: float = 1.0, jerk: float = 1.0) -> Machine:
    axes = {
        letter: axis.model_copy(
            update={
                "velocity": axis.velocity * velocity,
                "acceleration": axis.acceleration * acceleration,
                "jerk": axis.jerk * jerk,
            }
        )
        for letter, axis in MILL.axes.items()
    }
    return MILL.model_copy(update={"axes": axes})


@pytest.mark.parametrize("name", builtin_machines())
def test_built_in_machines_are_plausible(name: str) -> None:
    assert unit_notes(load_machine(name)) == []


def test_other_units_are_asked_about() -> None:
    in_metres = unit_notes(scaled(1e-3, 1e-3, 1e-3))
    assert len(in_metres) == 3
    assert all(said.endswith("mm/s: is the number in m/s?") for said in in_metres)
    assert "mm/min" in unit_notes(scaled(velocity=60.0))[0]
    assert "takes 40 s to build up" in unit_notes(scaled(jerk=1e-3))[0]
    assert "takes 4e-05 s to build up" in unit_notes(scaled(jerk=1e3))[0]
    assert "in ms?" in unit_notes(MILL.model_copy(update={"dt": 1.0}))[0]
    assert unit_notes(MILL.model_copy(update={"dt": 1e-6}))


def test_blocks_shorter_than_the_tolerance_are_noted() -> None:
    coarse = MILL.model_copy(update={"tolerance": 0.5})
    dense = "G21 F3000\n" + "\n".join(f"G1 X{0.1 * k:.1f} Y{k % 2}" for k in range(1, 9))
    fine = "G21 F3000\n" + "\n".join(f"G1 X{0.1 * k:.1f}" for k in range(1, 9)) + "\nG0 X90"
    assert short(coarse, dense) == []
    (said,) = short(coarse, fine)
    assert said.startswith("half of the blocks are not longer than 0.1 mm, and the tolerance is 0.5 mm")
    assert short(coarse, "G0 X0.1") == []


def test_feeds_in_inches_that_no_axis_can_run_are_asked_about() -> None:
    """F1200 in a program of mm is 508 mm/s once it says G20; mill's axes run 500."""
    (said,) = inch_notes(read_program(text="G20\nG1 X3 F1200", machine=MILL), MILL)
    assert (
        said
        == "line 2: F1200 in inches (G20) is more than any axis can, 1181.1 in/min: is the program in mm (G21)?"
    )
    for fits in ("G20\nG1 X3 F1100", "G21\nG1 X3 F60000", "G1 X3 F60000"):
        assert inch_notes(read_program(text=fits, machine=MILL), MILL) == []
