"""Speed factors and limits that programs of printers and of grbl set: what follows has them, in the compiled loop and outside of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from same_program import STRICT, machine, same_motion

import planner
from planner.base.errors import InputError
from planner.machine import Machine
from planner.nc.program import SetLimit
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.set_limits import limited
from planner.report.export import write_plan

EVERY = "xyzabcuvw"
LIMITS = {"velocity": 200, "acceleration": 2000, "jerk": 1e6}
PRINTER = Machine(name="printer", dt=1e-3, tolerance=0.05, axes=dict.fromkeys("xyze", LIMITS))

WITH_ALL = PRINTER.model_copy(
    update={
        "axes": Machine(name="all", dt=1e-3, tolerance=0.05, axes=dict.fromkeys(EVERY, LIMITS)).axes
        | PRINTER.axes
    }
)


# --- speed factor ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slow", [False, True])  # G40 stops the compiled loop
def test_a_speed_factor_scales_the_feeds_that_follow(slow: bool) -> None:
    text = "G21 F600\nG1 X1\nM220 S50\nX2\nX3 F300\nM220 S150\nX4\nG2 X6 R1\nM220 S100\nG1 X7\n"
    text = text.replace("\nX", "\nG40 X") if slow else text
    assert (parse_program(text, machine()).feed * 60).tolist() == pytest.approx(
        [600, 300, 150, 450, 450, 300]
    )


def test_a_factor_holds_for_the_default_feed_inches_and_rotary_axes_too() -> None:
    four = Machine(name="four", dt=1e-3, tolerance=0.05, axes=dict.fromkeys("xyza", LIMITS), feed_default=8.0)
    assert parse_program("G21 M3\nM220 S25\nG1 X1", four).feed[0] == pytest.approx(2.0)
    assert parse_program("G20\nM220 S25\nF10 G1 X1", four).feed[0] == pytest.approx(25.4 * 2.5 / 60)
    assert parse_program("G21\nM220 S25\nF60 G1 A90", four).feed[0] == pytest.approx(np.deg2rad(0.25))
    assert parse_program("G21 F600\nM220 S0.5\nG1 X1", four).feed[0] == pytest.approx(0.05)


def test_marlin_keeps_a_factor_and_brings_it_back() -> None:
    text = "G21 F600\nM220 S80\nM220 B\nM220 S40\nG1 X1\nM220 R\nX2\nM220\nX3\n M220 S50 B ; keeps 80\nX4\nM220 R\nX5"
    assert (parse_program(text, machine()).feed * 60).tolist() == pytest.approx([240, 480, 480, 300, 480])


def test_the_extruder_alone_has_the_factor() -> None:
    text = "G21\nM83\nF600\nG1 E2\nM220 S50\nG1 E-2\nG1 X3 E1\nM220 S100\nG1 E2\n"
    program = parse_program(text, PRINTER)
    assert (program.feed[program.extruded != 0] * 60).tolist() == pytest.approx([600, 300, 300, 600])


@pytest.mark.parametrize("value", ["S0", "S-20"])
def test_a_factor_that_is_not_positive_is_refused(value: str) -> None:
    with pytest.raises(InputError, match=r":2:1: M220.* must be positive"):
        parse_program(f"G21 F60\nM220 {value}\nG1 X1")


def test_the_time_of_a_plan_with_a_factor(tmp_path: Path) -> None:
    """Rest to rest with a trapezoid, jerk aside: L/v + v/a each way, at half of F."""
    job = tmp_path / "there_and_back.gcode"
    job.write_text("G21\nG90\nM220 S50\nG1 X40 F4800\nG1 X0\n")
    plan = planner.plan(job, PRINTER, method="stop")
    assert plan.cycle_time == pytest.approx(2 * (40 / 40 + 40 / 2000), abs=2e-2)
    write_plan(plan, tmp_path / "out")
    notes = json.loads((tmp_path / "out" / "summary.json").read_text())["notes"]
    assert any("planned.ngc is left out: its F words count by a factor" in note for note in notes)


# --- limits ---------------------------------------------------------------------------------------------------------------

# Commands, and the limits (quantity, axis) that they set [mm/s, mm/s2].
SETS = [
    ("M201 X700 Y800 Z90 E4000", {"acceleration": {"x": 700, "y": 800, "z": 90, "e": 4000}}),
    ("M203 X70 Y80.5 Z9 E40", {"velocity": {"x": 70, "y": 80.5, "z": 9, "e": 40}}),
    ("M203 X4200 Y4800 Z180 E1500", {"velocity": {"x": 70, "y": 80, "z": 3, "e": 25}}),  # RepRapFirmware: per minute
    ("M202 X700 Z90", {"acceleration": {"x": 700, "z": 90}}),  # Repetier's travels
    ("M204 S600", {"acceleration": dict.fromkeys(EVERY, 600)}),
    ("M204 P800 T500 R900", {"acceleration": dict.fromkeys(EVERY, 500) | {"e": 900}}),
    ("SET_VELOCITY_LIMIT ACCEL=450", {"acceleration": dict.fromkeys(EVERY, 450)}),
    ("set_velocity_limit velocity=55 accel=450.5 ; slow", {
        "acceleration": dict.fromkeys(EVERY, 450.5), "velocity": dict.fromkeys(EVERY, 55), "feed": {"": 55},
    }),
    ("M201 A700 U80", {"acceleration": {"a": 700, "u": 80}}),  # degrees and mm
    ("M203 B7200 U7200", {"velocity": {"b": 120, "u": 120}}),
    ("$113=3000", {"velocity": {"a": 50}}),  # grblHAL
    ("$125=25.5", {"acceleration": {"c": 25.5}}),
    ("$110=3000", {"velocity": {"x": 50}}),
    ("$122 = 25.5", {"acceleration": {"z": 25.5}}),
]  # fmt: skip


@pytest.mark.parametrize(("command", "sets"), SETS)
def test_limits_that_a_program_sets_are_limits_of_what_follows(
    command: str, sets: dict[str, dict[str, float]]
) -> None:
    program = parse_program(f"G21\n{command}\nG1 X50 F9000\n", WITH_ALL)
    found = {(it.quantity, it.axis): it.value for it in program.limits}
    assert found == pytest.approx({(q, a): v for q, axes in sets.items() for a, v in axes.items()})
    used = limited(WITH_ALL, program.limits)
    for letter, axis in used.axes.items():
        for quantity in ("velocity", "acceleration", "jerk"):
            given = sets.get(quantity, {}).get(letter, np.inf)
            assert getattr(axis, quantity) == pytest.approx(min(LIMITS[quantity], given))
    assert used.feed_max == (55 if "feed" in sets else None)
    with pytest.raises(InputError):
        parse_program(f"G21\n{command}\nG1 X50 F9000\n", PRINTER, STRICT)


def test_a_plan_keeps_them_and_takes_its_time() -> None:
    text = "G21\nM204 S500\nM203 X90\nG1 X200 F60000\n"
    plan = planner.plan(parse_program(text, PRINTER), PRINTER, method="stop")
    assert plan.machine.axes["x"].acceleration == 500
    assert plan.cycle_time == pytest.approx(200 / 90 + 90 / 500, abs=2e-2)
    assert plan.verdict is not None
    assert plan.verdict.passed


def test_limits_that_change_on_the_way_hold_at_their_lowest_and_it_is_said_first() -> None:
    text = "G21\nM204 S900\nG1 X5 F600\nM204 S400\nX9\nM204 S100\nM204 S700\nX20\n"
    program = parse_program(text, PRINTER)
    assert {it.value for it in program.limits} == {400.0}  # 100 was never in force on a move
    assert any("the lowest of each holds throughout" in it for it in program.assumptions)
    late = parse_program("G21\nG1 X5 F600\nM204 S400\nX9\n", PRINTER)
    assert any("holds throughout" in it for it in late.assumptions)
    assert not parse_program("G21\nM201 X900\nM201 X400\nG1 X9 F600\nM201 X50", PRINTER).assumptions
    assert parse_program("G21\nG1 X9 F600\nM204 S50", PRINTER).limits == ()


@pytest.mark.parametrize("command", ["M204 P500", "SET_VELOCITY_LIMIT ACCEL=500"])
def test_what_a_limit_along_the_path_does_not_bound_is_said_first(command: str) -> None:
    """The plan has it on each axis, so that the path may have more along a diagonal: 2^(1/2) in x and y, 3^(1/2) in x, y and z."""
    text = f"G21\n{command}\nG1 X60 Y60 F60000\n"
    plan = planner.plan(parse_program(text, PRINTER), PRINTER, method="stop")
    assert plan.trajectory is not None
    along = np.linalg.norm(plan.trajectory.acceleration[:, :2], axis=1).max()
    assert along == pytest.approx(500 * 2**0.5, rel=1e-2)
    (said,) = plan.program.assumptions
    assert "up to 1.7 times as much" in said


def test_of_printing_and_travelling_accelerations_the_lower_holds_and_it_is_said() -> None:
    program = parse_program("G21\nM204 P800 T500\nG1 X9 F600", PRINTER)
    assert any("S, P and T of M204 the lowest" in it for it in program.assumptions)
    assert not any(
        "S, P and T" in it for it in parse_program("G21\nM204 P800 T800\nG1 X9 F600", PRINTER).assumptions
    )


def test_limits_above_the_machines_are_said_first() -> None:
    (said,) = parse_program("G21\nM204 S5000\nG1 X9 F600", PRINTER).assumptions
    assert "above those of the machine" in said
    assert limited(PRINTER, (SetLimit(quantity="acceleration", axis="x", value=5000.0),)) is PRINTER


@pytest.mark.parametrize(
    ("command", "part"),
    [
        ("M203 X70", "per second, as Marlin"),
        ("M203 X7000", "per minute, as RepRapFirmware"),
        ("M205 X8 Y8", "speed of corners"),
        ("M205 J0.013", "speed of corners"),
        ("M566 X300 Y300", "speed of corners"),
        ("SET_VELOCITY_LIMIT ACCEL=450 SQUARE_CORNER_VELOCITY=3", "SQUARE_CORNER_VELOCITY"),
        ("M92 X80", "shifts or scales"),
        ("M206 X2", "shifts or scales"),
        ("$100=250", "setting of the control"),
        ("M109 S200", "wait for a temperature"),
    ],
)
def test_what_cannot_be_followed_is_said_first(command: str, part: str) -> None:
    program = parse_program(f"G21\n{command}\nG1 X5 F600\n", PRINTER)
    assert any(part in it for it in program.assumptions)


@pytest.mark.parametrize("code", ["M400", "M109 S200", "M190 S60", "M116", "M191 S40"])
def test_what_waits_for_the_axes_is_a_full_stop(code: str) -> None:
    one = parse_program(f"G21 F600\nG1 X5\n{code}\nX9\n", machine())
    assert same_motion(one, parse_program("G21 F600\nG1 X5\nM0\nX9\n", machine()))


@pytest.mark.parametrize(
    "text",
    ["M204 X5 S", "SET_VELOCITY_LIMIT ACCEL=fast", "M201 X0", "G1 X5 M204 S7"],
)
def test_what_is_no_limit_is_refused(text: str) -> None:
    if text.startswith("M204"):  # what it sets has no value: nothing is set
        assert parse_program(f"G21 F60\n{text}\nG1 X1").limits == ()
        return
    with pytest.raises(InputError):
        parse_program(f"G21 F60\n{text}\nG1 X1")


@pytest.mark.parametrize("speed", [600, 3000])
def test_the_dialect_says_what_m203_is_in(speed: int) -> None:
    """Marlin has it in mm/s, RepRapFirmware in mm/min."""
    text = f"M203 X{speed}\nG1 X10 F6000\n"
    for dialect, per in (("marlin", 1), ("reprapfirmware", 60), ("printer", 1 if speed < 1000 else 60)):
        program = parse_program(text, reading=Reading(dialect=dialect))
        assert [limit.value for limit in program.limits] == pytest.approx([speed / per])
        assert any("M203" in note for note in program.assumptions) == (dialect == "printer")
