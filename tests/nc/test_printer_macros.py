"""Macros of a printer ([gcode_macro] of Klipper): what they give, positions worked out by hand, and what
is left alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.controls.machine_import.convert import import_machine
from planner.machine import Machine, load_machine, machine_from_dict
from planner.nc import macros
from planner.nc.macros import written_out
from planner.nc.program import MOVES, Kind, Program
from planner.nc.reader import interpret, parse_program
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.writer import flat_program

# Of Voron's configuration, and one for the end that asks the printer.
CONFIG = """[printer]
kinematics: corexy
max_velocity: 300
max_accel: 3000
max_z_velocity: 15
[gcode_macro G32]
gcode:
    SAVE_GCODE_STATE NAME=STATE_G32
    G90
    G28
    QUAD_GANTRY_LEVEL
    ##  Uncomment for the center of your bed
    G0 X150 Y150 Z30 F3600
    RESTORE_GCODE_STATE NAME=STATE_G32
[gcode_macro PRINT_START]
variable_lift: 20
gcode:
    {% set bed = params.BED|default(60)|int %}
    M140 S{bed}
    G32                            ; home all axes
    G90
    {% if bed > 90 and params.SOAK is not defined %}
      M117 "hot" bed
      G4 P{ 2 * 1000 }
    {% else %}
      G4 P500
    {% endif %}
    G1 Z{lift} F3000               ; away from the bed
    PURGE Y=12
    M83
[gcode_macro PURGE]
gcode:
    G92 E0
    G1 X5 Y{params.Y|default(5)|float + 3} Z0.3 F6000
    G1 X{5 + 2 * 30.0} E15 F1500
    G1 E14 F1800
    G92 E0
[gcode_macro PRINT_END]
gcode:
    {% set th = printer.toolhead %}
    G0 X{th.position.x} F20000
[gcode_macro G29]
rename_existing: G29.1
gcode:
    G29.1
    G1 X9
"""
JOB = "M82\nPRINT_START BED={bed}\nG1 X100 Y100 E1 F3000\nG1 X120 E2\nPRINT_END\n"


@pytest.fixture
def voron(tmp_path: Path) -> Machine:
    """The machine of CONFIG, with an extruder."""
    (tmp_path / "printer.cfg").write_text(CONFIG)
    about = import_machine(tmp_path / "printer.cfg").machine.model_dump(exclude_none=True)
    about["axes"]["e"] = {"velocity": 120.0, "acceleration": 5000.0, "jerk": 1e5}
    return machine_from_dict(about)


def with_macros(**lines: str) -> Machine:
    return load_machine("voron").model_copy(update={"gcode_macros": lines})


def places(program: Program) -> list[tuple[float, ...]]:
    return [tuple(end[:3]) for end in program.end[np.isin(program.kind, MOVES)].round(9)]


@pytest.mark.shows("read-printers", "exact: macros of Klipper, positions worked out by hand")
@pytest.mark.parametrize(("bed", "dwell"), [(100, 2.0), (60, 0.5)])
def test_a_start_macro_homes_lifts_and_purges(voron: Machine, bed: int, dwell: float) -> None:
    program = parse_program(JOB.format(bed=bed), voron)
    begin = [(0, 0, 0), (150, 150, 30), (150, 150, 20), (5, 15, 0.3), (65, 15, 0.3)]
    assert places(program) == [*begin, (100, 100, 0.3), (120, 100, 0.3)]
    assert program.dwell.sum() == pytest.approx(dwell)
    # E 15 and back by 1 in absolute places, then M83 of the macro: steps of 1 and 2
    assert program.extruded[program.extruded != 0.0] == pytest.approx([15.0, -1.0, 1.0, 2.0])
    assert program.feed[program.kind == Kind.LINE] * 60 == pytest.approx([3600, 3000, 6000, 1500, 3000, 3000])
    assert list(program.line) == [2] * (len(program) - 3) + [3, 4, 5]
    assert program.expansion is not None
    assert dict(program.expansion.calls) == {"PRINT_START": 1, "G32": 1, "PURGE": 1}


def test_what_asks_the_printer_stays_and_is_said(voron: Machine) -> None:
    program = parse_program(JOB.format(bed=60), voron)
    assert any(note.startswith("2 macros of the printer: a full stop") for note in program.assumptions)
    assert (
        "the macro PRINT_END is not run: only the printer knows 'printer' of printer.toolhead"
        in program.notes
    )
    assert program.kind[-1] == Kind.STOP


def test_the_written_out_program_is_the_same_one(voron: Machine) -> None:
    text = JOB.format(bed=100).encode()
    found = flat_program(text, voron, AS_USUAL, source="job.gcode")
    assert found is not None
    flat, program = found
    assert "PRINT_START" not in flat
    assert "PRINT_END" in flat
    again = parse_program(flat, voron)
    for name in ("kind", "end", "feed", "dwell", "extruded"):
        assert np.array_equal(getattr(again, name), getattr(program, name)), name


def test_macros_that_replace_a_command_are_not_run(voron: Machine) -> None:
    assert "G29" not in voron.gcode_macros
    assert places(parse_program("M83\nG29\nG1 X1 F600\n", voron)) == [(1, 0, 0)]


@pytest.mark.parametrize(
    ("value", "given", "place"),
    [
        ("params.X|default(7)", "", 7),
        ("params.X|default(7)", " X=3.5", 3.5),
        ("params.X|float * 2 - 1", " x=3", 5),
        ("10 - params.X|default(4)|int", "", 6),
        ("7 if params.X == 'a' else 8", " X=a", 7),
        ("7 if params.X and not params.Y else 8", " X=1", 7),
        ("7 if params.X and not params.Y else 8", " X=1 Y=1", 8),
        ("(2 + 3) * 4 // 3 % 4", "", 2),
        ("-params['X']|int", " X=2", -2),
        ("(10 / 4)|round(0)", "", 2),
    ],
)
def test_expressions(value: str, given: str, place: float) -> None:
    program = parse_program(f"M83\nGO_THERE{given}\n", with_macros(GO_THERE=f"G1 X{{{value}}} F600"))
    assert places(program) == [(place, 0, 0)]


def test_branches_within_branches() -> None:
    lines = (
        "{% if params.A|int == 1 %}{% if params.B %}\nG1 X1\n{% else %}\nG1 X2\n{% endif %}\n"
        "{% elif params.A|int == 2 %}\nG1 X3\n{% else %}{% for a in (1, 2) %}\nG1 X4\n{% endfor %}{% endif %}"
    )
    machine = with_macros(GO_THERE=lines)
    for given, place in (("A=1 B=0", 1), ("A=1", 2), ("A=2", 3)):
        assert places(parse_program(f"M83\nG1 F600\nGO_THERE {given}\n", machine)) == [(place, 0, 0)]
    assert places(parse_program("M83\nGO_THERE A=3\n", machine)) == [], "a loop is not run"


@pytest.mark.parametrize(
    "value",
    [
        "2**9999999",
        "'a' * 999999999",
        "9e99 * 9",
        "params.X",
        "a.b",
        "open('x')",
        "().__class__",
        "[1][0]",
        "1 +",
    ],
)
def test_what_cannot_be_computed_is_left(value: str) -> None:
    program = parse_program("M83\nGO_THERE\nG1 X1 F600\n", with_macros(GO_THERE=f"G1 X{{{value}}}"))
    assert places(program) == [(1, 0, 0)]
    assert any(note.startswith("the macro GO_THERE is not run") for note in program.notes)


def test_a_fault_within_a_macro_names_the_call() -> None:
    _, faults = interpret(
        "M83\nG1 F600\n  OUTER A=1 ; go\n", with_macros(OUTER="G1 X1\nG2 X5"), source="a.gcode"
    )
    assert [(fault.line, fault.column, fault.source) for fault in faults] == [(3, 1, "")]
    assert faults[0].message.endswith("(in the macro OUTER A=1)")


def test_macros_that_call_themselves_or_too_often(monkeypatch: pytest.MonkeyPatch) -> None:
    assert places(parse_program("M83\nAGAIN\n", with_macros(AGAIN="G1 X1 F600\nAGAIN"))) == [(1, 0, 0)]
    monkeypatch.setattr(macros, "CALLS_MAX", 3)
    with pytest.raises(InputError, match="more than 3 calls"):
        parse_program("MANY_A\n", with_macros(MANY_A="MANY_B\n" * 3, MANY_B="G1 X1\nG1 X2"))


def test_what_the_user_or_the_program_says_comes_first() -> None:
    machine = with_macros(GO_THERE="G1 X{% set a = 1 %}{a} F600")
    asked = Reading(ignore=("GO_THERE",))
    assert places(parse_program("M83\nGO_THERE\nG1 X2 F600\n", machine, asked)) == [(2, 0, 0)]
    changing = "M83\nSET_GCODE_VARIABLE MACRO=GO_THERE VARIABLE=a VALUE=2\nGO_THERE\n"
    assert places(parse_program(changing, machine)) == []


def test_only_whole_names_at_the_start_of_a_line_are_calls() -> None:
    found = {"GO": "G1 X1", "M60": "G1 X2"}
    assert written_out(b"GOING\nM600\nM60.1\n; GO\nG1 X5 GO\n", found) is None
    called = written_out(b"a\nN10 go A=1\n\nM60 S1\r\nb", found)
    assert called is not None
    assert called.data == b"a\nG1 X1\n\nG1 X2\nb"
    assert list(called.line) == [1, 2, 3, 4, 5]


def test_names_of_a_machine_file() -> None:
    about = load_machine("voron").model_dump(exclude_none=True)
    assert machine_from_dict(about | {"gcode_macros": {"go": "G1"}}).gcode_macros == {"GO": "G1"}
    with pytest.raises(InputError, match="gcode_macros: 'G 1' is no command"):
        machine_from_dict(about | {"gcode_macros": {"G 1": "G1"}})


def test_the_machine_s_file_takes_any_text(tmp_path: Path) -> None:
    (tmp_path / "printer.cfg").write_text(CONFIG.replace('M117 "hot" bed', 'M117 \\"hot\\n \ttab """'))
    found = import_machine(tmp_path / "printer.cfg").machine
    assert "      M117" not in found.gcode_macros["PRINT_START"]
    assert '\nM117 \\"hot\\n    tab """\n' in found.gcode_macros["PRINT_START"]
