"""What an exported program keeps: machine coordinates, offsets, first moves, switches, each in words that the control knows.

Wrong here is a crash into the part: G53 Z0 as a move in work coordinates, a first move without the words that the plan began with.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import planner
from benchmarks.controls import export_judge as judge
from benchmarks.controls.export_judge import OFFSETS, STARTS, alike, path, readable, unknown_words
from planner.base.errors import InputError
from planner.controls.export.controls import CONTROLS
from planner.controls.export.program import FIRST_RUN, Candidates, write_program
from planner.machine import Machine
from planner.nc.reading import Reading
from planner.planning.job.plan import Plan

AXIS = {"velocity": 200.0, "acceleration": 2000.0, "jerk": 50000.0}
ROOM = {"name": "m", "dt": 0.002, "tolerance": 0.03, "feed_default": 10.0}
MACHINE = Machine(**ROOM, axes={"x": AXIS, "y": AXIS, "z": AXIS})
TOLERANCE = 0.05


def planned(text: str, machine: Machine = MACHINE, **reading: object) -> Plan:
    program = planner.read_program(text=text, machine=machine, reading=Reading(**reading))  # type: ignore[arg-type]
    return planner.plan(program, machine, method="stop")


def exported(
    text: str, control: str, kind: str = "chords", machine: Machine = MACHINE, **reading: object
) -> list[str]:
    """The lines of the planned path as chords, or of the program's "own" path, without comments and blanks."""
    job = Candidates(planned(text, machine, **reading), CONTROLS[control], TOLERANCE)
    (one,) = job.chords(1e-3) if kind == "chords" else job.own(1e-3)
    lines = job.written(one)[0].decode().splitlines()
    return [line for line in lines if line and line[0] not in "(;"]


def refused(text: str, control: str, machine: Machine = MACHINE, **reading: object) -> str:
    with pytest.raises(InputError) as fault:
        exported(text, control, "own", machine, **reading)
    assert fault.value.line is not None
    return f"{fault.value.line}: {fault.value.message}"


MACHINE_MOVES = (
    "G21 G90 G17 G54\nG53 G0 Z-2\nG0 X12 Y7\nZ4\nG1 Z-1 F300\nX25 F1200\nX31 Y9\nG0 Z4\nG53 G0 Z-2\nG91 G30 X0\nG90\nG0 X3 Y3\n"
    "Z1\nM2\n"
)


def test_machine_coordinates_stay_word_for_word() -> None:
    lines = exported(MACHINE_MOVES, "grbl")
    assert lines.count("G53 G0 Z-2") == 2
    assert "G91 G30 X0" in lines
    first = lines.index("G53 G0 Z-2")
    assert lines[first + 1 : first + 3] == ["G0 X12 Y7", "Z4"], (
        "nothing tells where Z is: the first moves stay"
    )
    after = lines.index("G91 G30 X0")
    assert lines[after + 1 :][0] == "G90 G0 X3 Y3"
    assert len(lines) > 20, "the rest is chords"
    assert refused(MACHINE_MOVES, "klipper").startswith("2: G53: klipper does not know it")
    assert refused(MACHINE_MOVES, "marlin").startswith("2: G53")


@pytest.mark.parametrize("control", ["grbl", "linuxcnc"])
def test_coordinates_are_the_programs_with_work_offsets_of_the_machine_file(control: str) -> None:
    offset = Machine(**ROOM, axes=MACHINE.axes, work_offsets={"g54": {"x": 90.0, "z": -150.0}})
    lines = exported(MACHINE_MOVES, control, machine=offset)
    coordinates = [float(number) for number in re.findall(r"[XYZ](-?[\d.]+)", "\n".join(lines))]
    assert max(map(abs, coordinates)) <= 31.0, "the control adds its G54 itself"
    out = "\n".join(lines)
    assert alike(
        path(MACHINE_MOVES, offset, STARTS[1], OFFSETS[1]),
        path(out, offset, STARTS[1], OFFSETS[1]),
        TOLERANCE,
    )


def test_the_first_moves_keep_all_their_words() -> None:
    """The plan starts at 0 0 0; the head may stand anywhere."""
    text = "G21 G90\nG0 X0 Y0 Z0\nG1 Z-1 F300\nX20 F1200\nY20\nX0\nM2\n"
    for control in CONTROLS:
        lines = [re.sub(r" F\d+$", "", line) for line in exported(text, control)]
        assert "G0 X0 Y0 Z0" in lines
    apart = exported("G21 G90\nG0 Z5\nG0 X0\nG0 Y0\nG1 X9 F900\nY8\nX2\nM2\n", "grbl")
    assert apart[:4] == ["G17 G90 G94", "G21", "G0 Z5", "X0"]
    assert apart[4] == "Y0"


def test_axes_that_the_program_does_not_place_get_no_words() -> None:
    flat = exported("G21 G90\nG0 X0 Y0\nG1 X10 F900\nY8\nX2 Y1\nM2\n", "klipper")
    assert not [line for line in flat if "Z" in line]
    steps = "G21\nG91\nG0 X5\nG1 X4 F900\nY3\nX-4\nG90\nG1 X2 Y2\nX9\nM2\n"
    lines = exported(steps, "grbl")
    assert lines[:6] == ["G17 G90 G94", "G21", "G91 G0 X5", "G1 X4 F900", "Y3", "X-4"]
    assert lines[6].startswith("G90 X2 Y2")


def test_steps_between_chords_begin_where_the_program_has_them_begin() -> None:
    """A rounded corner before a relative move would shift all that follows."""
    text = "G21 G90\nG0 X0 Y0\nG1 X10 F2000\nY10\nG91\nG1 Z-1\nG90\nX20\nX20 Y0\nG92 X0\nG1 X5\nY4\nM2\n"
    plan = planner.plan(planner.read_program(text=text, machine=MACHINE), MACHINE, method="kinematic")
    job = Candidates(plan, CONTROLS["grbl"], TOLERANCE)
    (one,) = job.chords(2e-3)
    lines = job.written(one)[0].decode().splitlines()
    step = next(k for k, line in enumerate(lines) if line.startswith("G91"))
    assert re.search(r"Y10( F[\d.]+)?$", lines[step - 1]), "the corner of the program"
    assert any(line.startswith("G92 X0") for line in lines)


@pytest.mark.parametrize("control", list(CONTROLS))
def test_the_program_as_it_is_is_byte_for_byte(control: str, tmp_path: Path) -> None:
    text = {
        "grbl": "G21 G90 G54 (a)\r\nN20 M3 S900\r\nG53 G0 Z-1 ; top\r\nG0 X0Y0\r\nG2 X8 I4 F600\r\n\r\nM5\r\nM30\r\n",
        "klipper": "; a\nG21\nG90\nG28\nM83\nG1 Z5 F600\nG1 X10 Y10 F6000\nG1 X20 S1 Y10\nG4 P20\nM84\n".replace(
            " S1", ""
        ),
        "marlin": "G21\nG90\nG1 X0 Y0 Z1 F900\nM3 S40\nG2 X8 Y0 I4 J0\nM5\nM0\nM84\n",
        "linuxcnc": "%\n(a)\nG64 P0.02\nG21 G90 G54\nT1 M6\nG0 X0 Y0 Z5\nG81 Z-1 R2 F200\nG80\nM2\n%\n",
    }[control]
    job = Candidates(planned(text), CONTROLS[control], TOLERANCE)
    assert job.why_not == ""
    (one,) = job.own(1e-3)
    assert job.written(one)[0] == text.encode()
    made = write_program(tmp_path, planned(text), control, TOLERANCE)
    assert FIRST_RUN in made.assumptions


@pytest.mark.parametrize(
    ("control", "line"),
    [
        ("grbl", "O100"), ("grbl", "%"), ("grbl", "T1 M6"), ("grbl", "G64"), ("grbl", "G90.1"), ("grbl", "/G0 X3"),
        ("klipper", "G90 G21"), ("klipper", "(a)"), ("klipper", "X3"), ("klipper", "G21 F600"), ("klipper", "M0"), ("klipper", "G54"),
        ("klipper", "G20"), ("klipper", "G4 P0.5"), ("klipper", "M2"), ("klipper", "G28 X0"),
        ("marlin", "N10 G0 X3"), ("marlin", "G17"), ("marlin", "S900 M3"), ("marlin", "G53 G0 Z0"), ("marlin", "M30"),
        ("linuxcnc", "O100"), ("linuxcnc", "M73 P3"), ("linuxcnc", "G2 X6 I2 K0 F60"), ("linuxcnc", "G28 G0 X0"),
        ("linuxcnc", "G94"),
    ],
)  # fmt: skip
def test_lines_that_a_control_does_not_read_so_are_no_program_as_it_is(control: str, line: str) -> None:
    plan = planned(f"G21\nG90\nG0 X0 Y0\nG1 X2 F600\n{line}\nG1 X4 Y4\nG1 X5\n")
    assert Candidates(plan, CONTROLS[control], TOLERANCE).why_not


SWITCHES = "G21 G90 G17\nO77\nN10 T2 M6\nM3 S9000\nM8\nG0 X0 Y0 Z5\nG1 Z-1 F300\nX20 F1200\nM1\nG4 P0.5\nY20\nM9\nM5\nM30\n"


def test_tool_change_spindle_pause_and_dwell_for_grbl() -> None:
    assert exported(SWITCHES, "grbl", "own") == [
        "G90 G94", "G21 G17", "T2", "M0", "M3 S9000", "M8", "G0 X0 Y0 Z5", "G1 Z-1 F300", "X20 F1200", "M1", "G4 P0.5", "G1 Y20",
        "M9", "M5", "M30",
    ]  # fmt: skip


def test_klipper_pauses_for_a_tool_and_has_macros_from_the_machine_file() -> None:
    assert refused(SWITCHES, "klipper").startswith("4: M3")
    quiet = "G21 G90\nT2 M6\nG0 X0 Y0\nM0\nG1 X9 F900\nM30\n"
    assert exported(quiet, "klipper", "own") == [
        "G90", "G21", "PAUSE", "G0 X0 Y0 F12000", "PAUSE", "G1 X9 F900", "M400",
    ]  # fmt: skip
    macros = {"M3": "M3", "M5": "SPINDLE_OFF", "M6": "TOOL_CHANGE", "M8": "COOL", "M9": "DRY"}
    with_macros = Machine(**ROOM, axes=MACHINE.axes, macros=macros)
    lines = exported(SWITCHES, "klipper", "own", with_macros)
    assert [line for line in lines if not line.startswith("G")] == [
        "TOOL_CHANGE T=2", "M3 S9000", "COOL", "PAUSE", "DRY", "SPINDLE_OFF", "M400",
    ]  # fmt: skip
    assert "G4 P500" in lines


@pytest.mark.parametrize("macros", [{"M6": "two words"}, {"G1": "X"}, {"M6": ""}, {"m6": "A"}])
def test_macros_that_are_none_are_refused(macros: dict[str, str]) -> None:
    with pytest.raises(InputError, match="macros"):
        Machine(**ROOM, axes=MACHINE.axes, macros=macros)


def test_marlin_gets_one_command_a_line() -> None:
    lines = exported(SWITCHES, "marlin", "own")
    assert "M3 S9000" in lines
    assert lines[-2:] == ["M5", "M400"]
    assert not unknown_words("\n".join(lines), "marlin")
    turning = exported("G21 G90\nM4 S80\nG0 X0 Y0\nG1 X9 F900 S20\nM2\n", "marlin", "own")
    assert turning[-4:] == ["M4 S20", "G1 X9 F900", "M5", "M400"], "the laser does not outlive the program"


LASER = "G21 G90 M4\nG0 X0 Y0\nG1 X6 S100 F1800\nX12 S250\nY9\nX3 S0\nS40\nX0 Y2\nM5\nM2\n"


def test_laser_power_stands_on_the_line_of_the_move() -> None:
    """grbl empties its buffer at an S on a line of its own: a stop and a burn mark at every change."""
    lines = exported(LASER, "grbl")
    powers = [line for line in lines if "S" in line]
    assert [re.findall(r"S\d+", line)[0] for line in powers] == ["S100", "S250", "S0", "S40"]
    assert all(re.search("[XY]", line) for line in powers)
    assert "M4" in lines
    own = exported(
        LASER, "klipper", "own", Machine(**ROOM, axes=MACHINE.axes, macros={"M4": "M4", "M5": "M5"})
    )
    assert [line for line in own if re.match(r"M4\b", line)] == [
        "M4",
        "M4 S100",
        "M4 S250",
        "M4 S0",
        "M4 S40",
    ]


def test_offsets_and_tool_lengths_are_kept_or_refused() -> None:
    text = "G21 G90\nG55\nT1 M6\nG43 H1\nG0 X1 Y2 Z9\nG1 X5 F900\nY6\nG92 X0 Y0\nG1 X4\nG10 L2 P2 X3\nG0 X0 Y0 Z1\nG49\nM2\n"
    lines = exported(text, "linuxcnc")
    assert [line for line in lines if re.match(r"G(55|43|92|10|49)", line)] == [
        "G55",
        "G43 H1",
        "G92 X0 Y0",
        "G10 L2 P2 X3",
        "G49",
    ]
    after = lines[lines.index("G10 L2 P2 X3") + 1]
    assert after == "G0 X0 Y0 Z1"
    assert refused(text, "grbl").startswith("4: G43")
    assert refused(text, "klipper").startswith("2: G55")
    assert refused("G21\nG52 X3\nG0 X1\n", "linuxcnc").startswith("2: G52")


def test_inches_stay_inches_or_become_mm() -> None:
    text = "G20 G90\nG0 X0 Y0 Z0.2\nG1 Z-0.04 F12\nX1.5 F40\nG2 X2 Y0.5 I0 J0.5\nM2\n"
    inch, mm = exported(text, "grbl"), exported(text, "marlin")
    assert "G20" in inch
    assert max(float(x) for x in re.findall(r"X([\d.]+)", "\n".join(inch))) == pytest.approx(2.0)
    assert mm[0] == "G21" or mm[1] == "G21"
    assert "G0 X0 Y0 Z5.08 F12000" in mm
    assert max(float(x) for x in re.findall(r"X([\d.]+)", "\n".join(mm))) == pytest.approx(50.8)


def test_what_no_straight_move_can_say_is_refused_with_its_line() -> None:
    turn = Machine(**ROOM, axes={**MACHINE.axes, "a": AXIS})
    assert refused("G21 G90\nG0 X0 Y0\nG1 A30 F600\nM2\n", "grbl", turn).startswith("3: A30")
    assert "A0 is left out" not in "".join(exported("G21 G90\nG0 X0 Y0 A0\nG1 X3 F60\nX5\nM2\n", "grbl"))
    assert refused("G21 G90\nG0 Z1\nG2 I4 J0 F600\nM2\n", "klipper").startswith(
        "3: G2 (it cannot be written as straight moves"
    )
    assert refused("G21 G90\nG93\nG0 X0 Y0\nG1 X4 F30\nM2\n", "marlin").startswith("2: G93")
    assert refused("G21 G90\nG0 X0 Y0\nM66 P1 L0\nG1 X4 F30\nM2\n", "grbl").startswith("3: M66")
    assert refused("G21 G90\nG0 X0 Y0\nM140 S60\nG1 X4 F30\nM2\n", "grbl").startswith("3: M140")


def test_a_radius_that_nobody_knows_is_refused() -> None:
    """The control has no G41: the tool's centre would go along the contour."""
    text = "G21 G90\nT4 M6\nG0 X0 Y0 Z1\nG41 D4 G1 X5 Y-3 F300\nX20\nG40 X30 Y9\nM2\n"
    assert refused(text, "grbl").startswith("4: G41 of a tool whose diameter the machine file does not say")
    assert refused("G21 G90\nG10 L1 P3 Z4\nG0 X1 Y1\nG1 X3 F60\nM2\n", "grbl").startswith("2: G10")
    assert refused("G21 G90\nG43.1 X1 Z4\nG0 X1 Y1\nG1 X3 F60\nM2\n", "grbl").startswith("2: G10 or G43.1")


@pytest.mark.parametrize("control", ["grbl", "klipper", "marlin"])
def test_cycles_and_compensation_become_straight_moves(control: str) -> None:
    text = (
        "G21 G90 G17\nG0 X0 Y0 Z9\nG98 G82 X4 Y4 Z-2 R1 P0.3 F200\nX9\nG80\nG0 Z9\nX0 Y0\nG1 Z-1 F300\n"
        "G41 D1 X5 Y-3\nG1 X20 Y-3\nY12\nG40 X30 Y20\nG0 Z9\nM2\n"
    )
    tool = Machine(**ROOM, axes=MACHINE.axes, tools={"1": {"length": 0.0, "diameter": 2.0}})
    lines = exported(text, control, "own", tool)
    assert not unknown_words("\n".join(lines), control)
    out = readable("\n".join(lines), control)
    for start, offset in zip(STARTS, (*OFFSETS, OFFSETS[0]), strict=True):
        assert alike(path(text, tool, start, offset), path(out, tool, start, offset), TOLERANCE)


def test_printers_words_and_extruders_stay() -> None:
    text = "G21\nG90\nM82\nM104 S200\nG28\nG1 X0 Y0 Z1 F900\nG1 X9 E1\nG1 X9 Y9 E2\nG92 E0\nM107\nG1 X0 E1 ; end\n"
    assert exported(text + "G17\n", "klipper", "own", extruder="ignore") == [
        "G90", *(line.split(" ;")[0] for line in text.splitlines()), "M400",
    ]  # fmt: skip


def test_planned_feeds_do_not_count_by_a_speed_factor_once_more() -> None:
    text = "G21\nG90\nM82\nG1 X0 Y0 F900\nG1 X9\nM220 S300\nG1 X2\nG1 Y4\nM220 S100\nG1 X8\nG1 X1 Y1\n"
    lines = exported(text, "klipper")
    first, last = lines.index("M220 S300"), lines.index("M220 S100")
    assert [re.sub(" F900", "", line) for line in lines[first + 1 : last]] == ["G1 X2", "G1 Y4"]


def test_the_head_says_from_what_for_which_control_and_with_which_assumptions(tmp_path: Path) -> None:
    text = "G20 G56\nG0 X0 Y0\nG1 X1 F30\nY1\nM2\n"
    made = write_program(tmp_path, planned("T1 M6\n" + text), "grbl", TOLERANCE)
    head = [line for line in (tmp_path / made.file).read_text().splitlines() if line.startswith("(")]
    said = " ".join(head)
    for part in ("<text>", "grbl", "machine m", "within 0.05 mm", "in G56", "X0 Y0 Z0", FIRST_RUN):
        assert part in said
    assert all(line.isascii() and len(line) < 120 for line in head)
    assert any("M0 for the tool change" in note for note in made.notes)


def test_a_path_of_points_begins_with_a_move_to_its_start() -> None:
    points = planner.path(np.array([[0.0, 0, 0], [10, 0, 0], [10, 8, 1]]), [30.0, 30.0])
    job = Candidates(planner.plan(points, MACHINE, method="stop"), CONTROLS["klipper"], TOLERANCE)
    (one,) = job.chords(1e-3)
    lines = job.written(one)[0].decode().splitlines()
    assert "G0 X0 Y0 Z0 F12000" in lines
    assert "it is no NC program" in job.why_not


@pytest.mark.parametrize("control", list(CONTROLS))
def test_a_drawing_of_a_plotter_is_exported(control: str) -> None:
    machine = (
        Machine(**ROOM, axes=MACHINE.axes, macros={"M3": "M3", "M5": "M5"})
        if control == "klipper"
        else MACHINE
    )
    program = planner.read_program(text="IN;SP1;PU400,400;PD1200,400,1200,900;PU0,0;", machine=machine)
    job = Candidates(planner.plan(program, machine, method="stop"), CONTROLS[control], TOLERANCE)
    (one,) = job.own(1e-3)
    lines = job.written(one)[0].decode().splitlines()
    moves = [line for line in lines if re.search(r"\bX10\b", line)]
    assert moves
    assert "Y10" in moves[0]


def test_expanded_programs_are_written_line_by_line() -> None:
    text = "#1=4\nG21 G90\nG53 G0 Z-1\nG0 X0 Y0\no1 repeat [2]\nG91 G1 X#1 Y1 F900\no1 endrepeat\nG90 G1 X0 Y0\nM2\n"
    lines = exported(text, "grbl", "own")
    assert "G53 G0 Z-1" in lines
    assert alike(
        path(text, MACHINE, STARTS[1], OFFSETS[1]),
        path("\n".join(lines), MACHINE, STARTS[1], OFFSETS[1]),
        TOLERANCE,
    )


def test_interpreted_by_linuxcnc() -> None:
    """LinuxCNC's own interpreter passes the same places, from another start and with other offsets."""
    if shutil.which("rs274") is None:
        pytest.skip("rs274 (Debian package linuxcnc-uspace) is not installed")
    out = "\n".join(exported(MACHINE_MOVES, "linuxcnc"))
    one, other = (judge.interpreted(text, STARTS[1], OFFSETS[1]) for text in (MACHINE_MOVES, out))
    assert not isinstance(one, str)
    assert not isinstance(other, str), other
    assert alike(one, other, TOLERANCE)
    lost = judge.interpreted(out.replace("G53 ", ""), STARTS[1], OFFSETS[1])
    assert not isinstance(lost, str)
    assert not alike(one, lost, TOLERANCE)
