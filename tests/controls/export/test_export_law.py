"""The law of exports: wherever the machine stands and whatever its work offsets are, an exported program passes the places that its
program passes, in order, within the tolerance; `python -m benchmarks.controls.exports` tries thousands of programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import planner
from benchmarks.controls.export_judge import OFFSETS, STARTS, alike, path, readable, unknown_words
from benchmarks.controls.export_programs import AXIS, TOLERANCE, machine, random_print, random_program
from benchmarks.controls.export_rows import judged, of_file
from benchmarks.controls.filament_judge import filament
from planner.base.errors import InputError
from planner.controls.export.controls import CONTROLS, OPTIONS
from planner.controls.export.program import Candidates
from planner.machine import Axis, load_machine
from planner.nc.reading import Reading
from planner.planning.job.plan import Plan

QUICK, MANY = 16, 5


def law(seeds: range, starts: int) -> set[tuple[str, str]]:
    """The outcomes that programs had for each control; the law holds for all of them."""
    rows = [row for seed in seeds for row in judged(seed, starts=starts)]
    broken = [row for row in rows if row.broken]
    assert not broken, "\n".join(map(str, broken))
    return {(row.control, row.outcome) for row in rows}


def _planned(text: str) -> Plan:
    mill = machine()
    return planner.plan(planner.read_program(text=text, machine=mill), mill, method="kinematic")


@pytest.mark.shows(
    "export-grbl, export-klipper, export-marlin, export-linuxcnc",
    "sampled: random programs read back from three starts with two sets of offsets",
)
def test_law() -> None:
    outcomes = law(range(QUICK), 2)
    for control in CONTROLS:  # few programs, but every kind of export is among them
        assert {(control, outcome) for outcome in ("chords", "own path", "refused")} <= outcomes
    assert {("grbl", "as it is"), ("linuxcnc", "as it is")} <= outcomes


@pytest.mark.shows(
    "export-grbl, export-klipper, export-marlin, export-linuxcnc",
    "sampled: random programs read back from three starts with two sets of offsets",
)
@pytest.mark.slow
def test_law_from_all_starts() -> None:
    assert law(range(10_000, 10_000 + MANY), 3)


@pytest.mark.parametrize(
    "told",
    ["G43.1 Z2", "G98 G81 X4 Y3 Z-2 R1 F300\nG80", "G91 G98 G81 X4 Y3 Z-2 R1 F300\nG80 G90"],
)
def test_words_that_do_not_tell_where_an_axis_is(told: str) -> None:
    """After G53 nothing tells where Z is in the program's coordinates: a tool's length and a cycle's depth, from which it comes back,
    do not. A chord down from there began where the plan did."""
    text = f"G21 G90\nG53 G0 Z20\nG0 X0 Y0\n{told}\nG1 Y14.5 F1500\nZ-2\nX8\nX1 Y3\nM2\n"
    mill = machine()
    job = Candidates(_planned(text), CONTROLS["linuxcnc"], TOLERANCE)
    for one in job.chords(1e-3):
        out = readable(job.written(one)[0].decode())
        for start in STARTS:
            there, back = (path(each, mill, start, (0.0, 0.0, 60.0)) for each in (text, out))
            assert alike(there, back, TOLERANCE)


@pytest.mark.parametrize("code", ["G0", "G1"])
def test_the_way_there_and_back_is_not_left_out(code: str) -> None:
    """It lies on a straight line, and the motion turns between two setpoints: no setpoint is off a chord that leaves it out."""
    mill = machine()
    for there, back in ((13.7, 9.31), (14.2, 10.07), (12.9, 3.3)):
        text = f"G21 G90\nG0 X0 Y0\nG1 X6.1 F3000\n{code} X{there}\nX{back}\nX{there + 2.0}\nG1 Y5\nX1\n"
        job = Candidates(_planned(text), CONTROLS["grbl"], TOLERANCE)
        (one,) = job.chords(1e-3)
        place = (STARTS[1], OFFSETS[1])
        out = job.written(one)[0].decode()
        assert alike(path(text, mill, *place), path(out, mill, *place), TOLERANCE)


def test_after_a_tool_change_the_first_moves_are_the_programs_own() -> None:
    text = "G21 G90\nG0 X0 Y0 Z5\nG1 X9 F900\nT2 M6\nG1 Y4\nG0 X2 Y2\nZ1\nG1 X8 Y3\n"
    job = Candidates(_planned(text), CONTROLS["grbl"], TOLERANCE)
    assert [row.line for row in job.source.rows if row.plain] == [3, 8]


@pytest.mark.parametrize("extruder", ["refuse", "ignore"])
@pytest.mark.parametrize("control", ["klipper", "marlin"])
def test_what_an_extruder_does_is_kept(control: str, extruder: str) -> None:
    """The same filament at the same places, at the same F, by the control's own rules; whether the plan knows the extruder or not."""
    axis = Axis(velocity=60.0, acceleration=3000.0, jerk=100000.0)
    mill = machine()
    printer = mill.model_copy(update={"axes": mill.axes | {"e": axis}}) if extruder == "refuse" else mill
    chords = 0
    for seed in range(8):
        text = random_print(seed)
        program = planner.read_program(text=text, machine=printer, reading=Reading(extruder=extruder))
        plan = planner.plan(program, printer, method="kinematic")
        job = Candidates(plan, CONTROLS[control], TOLERANCE)
        found = [*job.own(0.01), *job.chords(0.01)]
        chords += len(found) > 1
        for one in found:
            out = job.written(one)[0].decode()
            assert not unknown_words(out, control)
            assert filament(out, control) == pytest.approx(filament(text, control), abs=1e-4), seed
    assert chords > 2


@pytest.mark.parametrize(
    ("control", "noted"), [("klipper", "[firmware_retraction]"), ("marlin", "FWRETRACT")]
)
def test_retractions_by_the_control_are_kept(control: str, noted: str) -> None:
    """G10 and G11 alone are the extruder's there; with L they set offsets, which these controls do not have."""
    text = "G21\nG90\nG0 X0 Y0\nG1 X9 E1 F600\nG10\nG0 X20 Y5\nG11\nG1 X30 E2\n"
    program = planner.read_program(text=text, machine=machine(), reading=Reading(extruder="ignore"))
    job = Candidates(planner.plan(program, machine(), method="stop"), CONTROLS[control], TOLERANCE)
    assert not job.why_not
    (chords,) = job.chords(0.01)
    data, notes = job.written(chords)
    lines = [line.split(" F")[0] for line in data.decode().splitlines() if line[0] != ";"]
    assert lines[-5:-1] == ["G10", "G0 X20 Y5", "G11", "G1 X30 E2"]
    assert [note for note in notes if noted in note] == [f"line 5: {OPTIONS[control, 'G10']}"]
    program = planner.read_program(text="G21 G90\nG0 X0 Y0\nG10 L2 P1 X3\nG1 X9 F60\n", machine=machine())
    job = Candidates(planner.plan(program, machine(), method="stop"), CONTROLS[control], TOLERANCE)
    with pytest.raises(InputError, match="G10"):
        job.written(job.own(0.01)[0])


def test_filament_is_counted_as_printers_do() -> None:
    text = "G90\nM83\nG1 X1 E1 F60\nG90\nG1 E1\nG92 E0\nG91\nG1 X2 E0.5\n"
    assert filament(text, "klipper")[:, [0, 3]].tolist() == [[1, 1], [1, 2], [3, 2.5]]
    assert filament(text, "marlin")[:, [0, 3]].tolist() == [[1, 1], [1, 1], [3, 1.5]]


ARCS = """G21
G90
{mode}
G92 E0
G1 X6 Y0 Z0.3 E0.2 F1500 ; told
G3 X0 Y6 I-6 J0 {first}
G1 X-4 {line}
G2 X-4 Y6 I3.5 J0 Z0.8 {round}
G1 X1 Y1 {way}
G3 X4 Y4 I0 J3 {last}
(kept from going as it is)
M400
"""
PLACES = {"mode": "M82", "first": "E1.4", "line": "E1.6", "round": "E2.9 F900", "way": "E2.9", "last": "E2.1"}
STEPS = {"mode": "M83", "first": "E1.2", "line": "E0.2", "round": "E1.3 F900", "way": "E0", "last": "E-0.8"}

BOTH = STEPS | {"way": "E0\nM82", "last": "E2.1"}  # places go on where steps end


def _print(text: str, control: str, *, extruder: bool) -> Candidates:
    axis = Axis(velocity=60.0, acceleration=3000.0, jerk=100000.0)
    mill = machine()
    printer = mill.model_copy(update={"axes": mill.axes | {"e": axis}}) if extruder else mill
    reading = Reading(extruder="refuse" if extruder else "ignore")
    program = planner.read_program(text=text, machine=printer, reading=reading)
    return Candidates(planner.plan(program, printer, method="kinematic"), CONTROLS[control], TOLERANCE)


@pytest.mark.parametrize("words", [PLACES, STEPS, BOTH])
@pytest.mark.parametrize("extruder", [True, False])
@pytest.mark.parametrize("control", ["klipper", "marlin"])
def test_arcs_share_their_filament_along_the_way(control: str, extruder: bool, words: dict[str, str]) -> None:
    """Filament against the way, by the control's own rules; ten times the filament, so that the tolerance is a tenth of it there."""
    text = ARCS.format(**words)
    job = _print(text, control, extruder=extruder)
    for one in [*job.own(0.01), *job.chords(0.01)]:
        out = job.written(one)[0].decode()
        assert not unknown_words(out, control)
        assert "G2" not in {line.split(" ")[0] for line in out.splitlines()}
        there, back = (filament(each, control)[:, :4] * (1, 1, 1, 10) for each in (text, out))
        assert alike(there, back, TOLERANCE)
        assert filament(out, control)[-1, :4] == pytest.approx(filament(text, control)[-1, :4], abs=1e-9)


@pytest.mark.parametrize("size", [0.2, 0.5, 3.0])
@pytest.mark.parametrize("mode", ["M82\nG92 E0", "M83"])
def test_a_small_arc_has_its_filament_too(size: float, mode: str) -> None:
    """However short it is: half a circle, at its top with half of the filament."""
    text = f"G21 G90\n{mode}\nG0 X0 Y0\nG2 X{2 * size} Y0 I{size} J0 E0.8 F600\nM400\n"
    job = _print(text, "klipper", extruder=False)
    rows = filament(job.written(job.own(1e-3)[0])[0].decode(), "klipper")
    assert rows[-1, :4] == pytest.approx([2 * size, 0, 0, 0.8], abs=1e-9)
    angle = np.arctan2(rows[:, 1], size - rows[:, 0])
    assert rows[:, 3] == pytest.approx(0.8 * angle / np.pi, abs=0.02)
    assert len(rows) > 4


def test_an_arc_whose_filament_is_not_known_is_refused() -> None:
    """A place of E feeds what the one before leaves, which nothing tells at the start; G91 makes it a step."""
    for text, said in (
        ("G21 G90\nG0 X0 Y0\nG2 X4 Y0 I2 J0 E1 F600\n", r":3: E1 .*nothing says where E is"),
        ("G21 G90\nG92 E0\nG0 X0 Y0\nG91\nG2 X4 Y0 I2 J0 E1 F600\n", r":5: G2 .*write it under G90"),
    ):
        job = _print(text, "klipper", extruder=False)
        with pytest.raises(InputError, match=said):
            job.written(job.own(0.01)[0])


@pytest.mark.parametrize("setting", ["M84 X Y E", "M18 S30", "M84 Z0", "M17 X", "M84XE"])
def test_motors_of_single_axes(setting: str) -> None:
    """Marlin lets go of those named, and S only sets a time; Klipper's M18 and M84 let go of all at once, whatever stands beside
    them, and Z may drop."""
    text = f"G21\nG90\nG1 X9 E1 F600\n{setting}\nM117 done\n"
    job = _print(text, "marlin", extruder=False)
    assert not job.why_not
    assert setting in job.written(job.own(0.01)[0])[0].decode().splitlines()
    job = _print(text, "klipper", extruder=False)
    data, notes = job.written(job.own(0.01)[0])
    assert not unknown_words(data.decode(), "klipper")
    assert b"M84" not in data
    assert [note for note in notes if note.startswith("line 4: M") and "is left out" in note]
    assert not _print("G21\nG1 X9 F600\nM84\n", "klipper", extruder=False).why_not


def test_what_klipper_would_take_for_no_temperature_is_refused() -> None:
    """It looks at S alone: M109 R180 would switch the heater off."""
    text = "G21\nM109 {}180\nG1 X9 E1 F600\n"
    assert not _print(text.format("S"), "klipper", extruder=False).why_not
    assert not _print(text.format("R"), "marlin", extruder=False).why_not
    job = _print(text.format("R"), "klipper", extruder=False)
    with pytest.raises(InputError, match=":2: M109 R180"):
        job.written(job.own(0.01)[0])


@pytest.mark.parametrize("control", ["grbl", "linuxcnc"])
def test_controls_without_an_extruder_say_what_they_leave_out(control: str) -> None:
    text = "G21 G90\nG0 X0 Y0\nG1 X9 E1 F600\nG1 E-1\nY9\nM2\n"
    plan = planner.plan(
        planner.read_program(text=text, machine=machine(), reading=Reading(extruder="ignore")),
        machine(),
        method="stop",
    )
    job = Candidates(plan, CONTROLS[control], TOLERANCE)
    assert job.why_not.startswith("line 3: E1")
    data, notes = job.written(job.own(0.01)[0])
    assert b"E" not in data.split(b"hold.")[1]
    assert any(note.startswith("line 3: E1 is left out") for note in notes)
    fed = machine().model_copy(update={"axes": machine().axes | {"e": Axis(**AXIS)}})
    plan = planner.plan(planner.read_program(text=text, machine=fed), fed, method="stop")
    job = Candidates(plan, CONTROLS[control], TOLERANCE)
    with pytest.raises(InputError, match="E1: an extruder"):
        job.written(job.own(0.01)[0])


def test_the_judge_sees_what_is_lost() -> None:
    """Each of these was written once: machine coordinates as work ones, a first move without its zeros, an offset lost or added."""
    text = "G21 G90 G54\nG53 G0 Z-1\nG0 X0 Y0\nG0 Z5\nG1 X9 F600\nG55\nG0 X1 Y1 Z1\nG91 G28 Z0\nG90\nM2\n"
    mill = machine()
    for lost, instead in (
        ("G53 ", ""),
        ("X0 Y0", "X0"),
        ("G55\n", ""),
        ("G91 G28 Z0", "G28 Z0"),
        ("X9", "X9.2"),
        ("G0 Z5\n", ""),
    ):
        other = text.replace(lost, instead)
        assert other != text
        same = [
            alike(path(text, mill, start, offset), path(other, mill, start, offset), TOLERANCE)
            for start in STARTS
            for offset in OFFSETS
        ]
        assert not all(same), lost
        assert alike(path(text, mill, STARTS[1], OFFSETS[1]), path(text, mill, STARTS[1], OFFSETS[1]), 0.0)


def test_a_walk_keeps_the_order() -> None:
    there = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [0.0, 0.0]])
    assert alike(there, there + 0.03, 0.05)
    assert not alike(there, there[::-1], 0.05)
    assert not alike(there, there[:3], 0.05)
    assert not alike(there, np.vstack([there, there[1:]]), 0.05)


@pytest.mark.parametrize(
    ("control", "line"),
    [
        ("grbl", "M6"),
        ("grbl", "G43 H1"),
        ("grbl", "A3"),
        ("klipper", "M0"),
        ("klipper", "X3"),
        ("klipper", "S9"),
        ("marlin", "T1"),
    ],
)
def test_the_judge_knows_what_a_control_does_not(control: str, line: str) -> None:
    assert unknown_words(f"G21\nG1 X3 F60\n{line}\n", control) == line
    assert not unknown_words("G21\nG1 X3 F60\n", control)


def test_milliseconds_are_seconds_to_the_reader() -> None:
    assert readable("G4 P250\nPAUSE\n", "marlin") == "G4 P0.25\nM0\n"
    assert readable("G4 P250\n", "grbl") == "G4 P250\n"


def test_random_programs_hold_what_exports_may_lose() -> None:
    text = "\n".join(random_program(seed)[0] for seed in range(200))
    for word in (
        "G53",
        "G28",
        "G30",
        "G55",
        "G92",
        "G43",
        "M6",
        "M4",
        " A",
        "G20",
        "G91",
        "S0",
        "G18",
        "G81",
        "%",
        "O1234",
    ):
        assert word in text


@pytest.mark.slow
def test_real_programs(shared_dir: Path) -> None:
    """Small ones; `benchmarks.controls.exports --programs` has all. What is written reads back on the same places; what is
    not is refused by its line."""
    mill = load_machine("mill")
    files = [
        file
        for file in sorted((shared_dir / "nc").iterdir())
        if file.suffix != ".csv" and 1_700 < file.stat().st_size < 1_800
    ]
    rows = [row for file in files for row in of_file(file, mill)]
    assert len(rows) == 4
    assert not [row for row in rows if row.broken]
    assert all(row.why.startswith("line ") for row in rows if row.outcome == "refused")
