"""E words of a machine that has an axis e: amounts, moves of the extruder alone, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Machine, load_machine, machine_from_dict
from planner.nc.program import Kind, Program, extruder_alone
from planner.nc.reader import parse_program
from planner.nc.reading import IGNORE, Reading
from planner.nc.writer import retimed


def printer(**limits: float) -> Machine:
    """The machine `router` with an extruder."""
    about = load_machine("router").model_dump(exclude_none=True)
    about["axes"]["e"] = {"velocity": 25.0, "acceleration": 500.0, "jerk": 2e4} | limits
    return machine_from_dict(about)


PRINTER = printer()


def read(text: str) -> Program:
    return parse_program(text, PRINTER)


@pytest.mark.parametrize(
    "text",
    [
        "G21 F600\nM82\nG1 X10 E1\nX20 E3\nG1 E1.5\nG1 X30 E2.5\n",
        "G21 F600\nM83\nG1 X10 E1\nX20 E2\nG1 E-1.5\nG1 X30 E1\n",
        "G21 F600\nG91\nG1 X10 E1\nX10 E2\nG1 E-1.5\nG1 X10 E1\n",
        "G21 F600\nM82\nG1 X10 E1\nX20 E3\nSAVE_GCODE_STATE NAME=a\nM83\nG91\nG1 E-1.5\nRESTORE_GCODE_STATE NAME=a\nG1 X30 E4\n",
        "G21 F600\nM82\nG92 E7\nG1 X10 E8\nG92 E0\nX20 E2\nG1 E0.5\nG92 E0\nG1 X30 E1\n",
        "G20\nF23.62204724409449\nM82\nG1 X0.39370078740157483 E0.039370078740157483\nX0.78740157480314965 E0.11811023622047245\n"
        "G1 E0.059055118110236227\nG1 X1.1811023622047245 E0.098425196850393706\n",
    ],
)
def test_places_steps_zeros_and_inches_say_the_same(text: str) -> None:
    program = read(text)
    assert program.extruded == pytest.approx([1.0, 2.0, -1.5, 1.0], abs=1e-12)
    assert list(program.kind) == [Kind.LINE, Kind.LINE, Kind.STOP, Kind.LINE]
    assert program.end[:, 0] == pytest.approx([10.0, 20.0, 20.0, 30.0])
    assert program.feed == pytest.approx(np.full(4, 10.0))
    assert list(extruder_alone(program)) == [False, False, True, False]
    assert not any("E word" in note or "extruder" in note for note in program.notes)


def test_blocks_around_a_move_alone_keep_their_words() -> None:
    program = read("G21 F600\nM83\nG1 X10 E1\nM106\nG1 E-2 F1800\nM107\nG1 E2\nG2 X20 I5 E3\nG4 P1\nG1 X30\n")
    assert program.extruded == pytest.approx([1.0, -2.0, 2.0, 3.0, 0.0, 0.0])
    assert list(program.line) == [3, 5, 7, 8, 9, 10]
    assert program.feed[1:3] == pytest.approx([30.0, 30.0])
    assert list(program.arc_block) == [3]
    assert [(event.block, event.text) for event in program.events if event.line in (4, 6)] == [
        (1, "M106"),
        (2, "M107"),
    ]


def test_the_flow_and_volumes_scale_what_is_fed() -> None:
    text = "G21 F600\nM82\nG1 X10 E1\nM221 S50\nG1 X20 E3\nM221 X0 Y0\nM200 D2\nG1 X30 E4\nM200 S0\nM221 S100\nG1 X40 E5\n"
    assert read(text).extruded == pytest.approx([1.0, 1.0, 0.5 / np.pi, 1.0])
    kept = (
        "G21 F600\nM83\nSAVE_GCODE_STATE NAME=a\nM221 S50\nG1 X1 E1\nRESTORE_GCODE_STATE NAME=a\nG1 X2 E1\n"
    )
    assert read(kept).extruded == pytest.approx([0.5, 1.0])


@pytest.mark.parametrize(
    ("settings", "back", "forward", "speeds"),
    [
        ("M207 S1.5 F1800\nM208 S0.1 F1200", 1.5, 1.6, (30.0, 20.0)),
        ("M207 S2 R0.2 F600 T1200", 2.0, 2.2, (10.0, 20.0)),
        ("SET_RETRACTION RETRACT_LENGTH=0.6 RETRACT_SPEED=40", 0.6, 0.6, (40.0, 40.0)),
        ("M207 S1\nM207 S3 F300", 3.0, 3.0, (5.0, 5.0)),
    ],
)
def test_a_firmware_retraction_goes_back_and_forward_once(
    settings: str, back: float, forward: float, speeds: tuple[float, float]
) -> None:
    program = read(f"G21 F600\nM83\nG1 X1 E1\n{settings}\nG10\nG10\nG1 X9\nG11\nG11\nG1 X10 E1\n")
    assert program.extruded == pytest.approx([1.0, -back, 0.0, forward, 1.0])
    assert program.feed[[1, 3]] == pytest.approx(speeds)
    assert not any("retraction" in note for note in program.notes)


@pytest.mark.parametrize(
    "settings", ["", "M207 Sx F100\n", "M207 S-1\n", "SET_RETRACTION RETRACT_LENGTH=abc\n"]
)
def test_without_settings_a_retraction_feeds_nothing_and_is_said(settings: str) -> None:
    program = read(f"G21 F600\nM83\n{settings}G1 X1 E1\nG10\nG1 X9\nG11\n")
    assert np.count_nonzero(program.extruded) == 1
    assert any("retractions of an extruder" in text for text in program.assumptions)


def test_words_of_codes_are_not_the_extruders() -> None:
    program = read("G21 F600\nM203 X500 Y500 E25\nM92 E93\nM83\nG1 X10 E1\n")
    assert program.extruded == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("G21\nM83\nG1 E1\nG1 X1 F100\n", 3, "before the first F word"),
        ("G21 F600\nM83\nG4 P1 E1\nG1 X1\n", 3, "none of G0 to G3"),
        ("G21 F600\nM83\nG28 X1 E1\n", 3, "none of G0 to G3"),
        ("G21 F600\nM83\nM221 S-5\nG1 X10 E1\n", 3, "M221 S-5: the flow is a percentage above 0"),
        ("G21 F600\nM83\nM221 S0\nG1 X10 E1\n", 3, "M221 S0: the flow is a percentage above 0"),
        ("G21 F600\nM83\nM200 D-1\nG1 X10 E1\n", 3, "M200 D-1: the filament's diameter is above 0"),
    ],
)
def test_what_the_extruder_cannot_do_is_refused(text: str, line: int, what: str) -> None:
    with pytest.raises(InputError, match=what) as found:
        read(text)
    assert found.value.line == line


def test_without_the_axis_and_when_ignored_nothing_is_fed() -> None:
    text = "G21 F600\nM83\nG1 X10 E1\nG1 E-1\n"
    with pytest.raises(InputError, match="extruder"):
        parse_program(text, load_machine("router"), Reading(extruder="refuse"))
    ignored = parse_program(text, PRINTER, Reading(extruder=IGNORE))
    assert len(ignored.extruded) == 0
    assert len(ignored) == 1


def test_a_retraction_keeps_its_feed_between_slower_blocks() -> None:
    source = b"G21\nM83\nG1 X10 E1 F600\nG1 E-2\nG1 X20 E1\n"
    text = retimed(source, read(source.decode()), np.array([5.0, np.nan, 5.0]))
    again = read(text.decode())
    assert again.feed == pytest.approx([5.0, 10.0, 5.0])
    assert again.extruded == pytest.approx([1.0, -2.0, 1.0])
