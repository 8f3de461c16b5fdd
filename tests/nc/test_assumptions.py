"""What is assumed and may change geometry or time is said first, never called supported, and refused by strict reading.

The law over a list of such assumptions: each alone, and the same program where the program or the machine file says what was assumed.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from same_program import STRICT, machine
from typer.testing import CliRunner

from planner.base.errors import InputError
from planner.cli import app
from planner.machine import Machine
from planner.nc.info import describe
from planner.nc.program import Kind
from planner.nc.reader import interpret, parse_program
from planner.nc.reading import Reading
from planner.report.summary import info_summary

BARE = machine()
TELLS = machine(
    work_offsets={"g54": {"x": 10.0}, "g55": {"x": 30.0}},
    positions={"g28": {"z": 50.0}, "g30": {"z": 70.0}},
    tools={"4": {"length": 80.0, "diameter": 6.0}},
    times={"tool_change": 5.0},
)
# A program, where its assumption stands (line, column), a part of its sentence, and the program where it says it itself; None where
# the machine file does.
ASSUMED = [
    ("G0 X7\nG21", 1, 1, "no G20 or G21", "G21\nG0 X7"),
    ("G21 G0\nG43 H4 Z5", 2, 1, "tool 4 has no length", None),
    ("G21\nN2 G53 G0 Z0", 2, 4, "G53 is in machine coordinates", None),
    ("G21\nG53 G0 Z0", 2, 1, "G53 is in machine coordinates", "G21\nG10 L2 P1 X3\nG53 G0 Z0"),
    ("G21 G28 Z4", 1, 5, "G28 has no position", None),
    ("G21\nG91 G30 Z4", 2, 5, "G30 has no position", None),
    ("G21 G0 X1\nG55\nX2", 2, 1, "G55 has no offset", None),
    ("G21 T4 M6\nG42 F100\nG1 X9\nX20", 2, 1, "tool 4 has no diameter", None),
    ("G21 F100\nG81 Z-1 R2", 2, 1, "before any G98 or G99", "G21 F100\nG99 G81 Z-1 R2"),
    ("G21\nT4 M6", 2, 4, "its time is not included", None),
    ("G21 G0 X1\nM60", 2, 1, "pallet change", "G21 G0 X1\nM0"),
]


@pytest.mark.parametrize(
    ("text", "line", "times"),
    [
        ("G21 G0 X1\n/ Y5\nX2\n/2 G1 Y7 F100\n", 2, " (2 times)"),
        ("G21 G0 X1\n  /X9\nX2\n", 2, ""),
        ("G21 G0 X1\n/(only a comment)\n/\nX2\n", 0, ""),
    ],
)
def test_lines_that_block_delete_leaves_out_are_said(text: str, line: int, times: str) -> None:
    """The switch is the operator's: with it off they are run."""
    program = parse_program(text, BARE)
    said = f"line {line}: begins with / and is left out, as with block delete on{times}"
    assert program.assumptions == ((said,) if line else ())
    if line:
        with pytest.raises(InputError, match="begins with /") as fault:
            parse_program(text, BARE, STRICT)
        assert (fault.value.line, fault.value.column) == (line, 1)


@pytest.mark.parametrize(("text", "line", "column", "part", "told"), ASSUMED)
def test_an_assumption_is_said_first_and_refused_by_strict_reading(
    text: str, line: int, column: int, part: str, told: str | None
) -> None:
    program = parse_program(text, BARE)
    (found,) = (said for said in program.assumptions if part in said)
    assert found.startswith(f"line {line}: ")
    assert program.notes[: len(program.assumptions)] == program.assumptions
    _, faults = interpret(text, BARE, STRICT, source="job.ngc")
    assert (line, column) in {(fault.line, fault.column) for fault in faults if part in fault.message}
    of: Machine = TELLS if told is None else BARE
    assert parse_program(told or text, of).assumptions == ()
    assert parse_program(told or text, of, STRICT).assumptions == ()


@pytest.mark.parametrize(
    "text", ["G21\nM428\nG0 X1", "G21 G0 X1 A5\nX2 A5", "G21 G0 X1\nG10\nG11", "G21 G0 X1\nM600"]
)
def test_a_counted_assumption_is_one_too(text: str) -> None:
    assert len(parse_program(text, BARE).assumptions) == 1
    with pytest.raises(InputError):
        parse_program(text, BARE, STRICT)


def test_what_changes_nothing_is_no_assumption() -> None:
    program = parse_program("O77\nG21 F50\nM104 S200\nM117 ready\nG1 X1 H2\nG64 P0\n", BARE)
    assert len(program.notes) == 4
    assert program.assumptions == ()


def test_the_first_lines_of_every_command(tmp_path: Path) -> None:
    job, out = tmp_path / "job.ngc", tmp_path / "out"
    job.write_text("F3000\nG1 X10\nY10\nG43 H2\n")
    first = [
        "assumed: line 2: no G20 or G21 before the first move: mm",
        "assumed: line 4: tool 2 has no length in the machine file: 0",
    ]
    how = ["--method", "stop", "-q"]
    for command in (
        ["info", job],
        ["plan", job, *how, "-o", out],
        ["verify", out, "-q"],
        ["compare", job, *how],
        ["what-if", job, *how, "--set", "x.jerk=+10%"],
        ["sweep", job, *how, "--vary", "tolerance=0.01,0.02", "-o", tmp_path / "sweep", "--threads", "1"],
        ["export", out, "--for", "pvt", "-o", tmp_path / "pvt"],
        ["export", out, "--for", "linuxcnc", "-o", tmp_path / "linuxcnc"],
    ):
        result = CliRunner().invoke(app, [str(word) for word in command])
        assert result.stdout.splitlines()[:2] == first, (command, result.output)
        assert "every construct is supported" not in result.output
    for command in (["info", job, "--json"], ["verify", out, "-q", "--json"]):
        said = json.loads(CliRunner().invoke(app, [str(word) for word in command]).stdout)
        assert [f"assumed: {text}" for text in said["assumptions"]] == first
    assert [
        f"assumed: {text}" for text in json.loads((out / "summary.json").read_text())["assumptions"]
    ] == first


def test_a_program_without_assumptions_is_called_supported(tmp_path: Path) -> None:
    job = tmp_path / "job.ngc"
    job.write_text("G21 F3000\nG1 X10\nM2\n")
    result = CliRunner().invoke(app, ["info", str(job), "--strict"])
    assert "every construct is supported" in result.stdout
    assert "assumed" not in result.stdout
    assert info_summary(describe(parse_program(job.read_bytes()), lines=3))["assumptions"] == []


def test_a_printer_runs_g0_at_f() -> None:
    """Marlin, Klipper and RepRapFirmware know no other rapid; slicers write G0 F9000 for a travel at 150 mm/s."""
    text = "G21\nM83\nG0 X5 F600\nG1 X6\nG0 X9 Y1\nX10\nG0 F1200\nX12\n"
    found = parse_program(text, BARE)
    assert found.kind.tolist() == [Kind.LINE] * 5
    assert found.feed.tolist() == [10.0] * 4 + [20.0]
    assert not found.assumptions
    assert parse_program(text.replace("M83\n", ""), BARE).kind.tolist() == [0, 1, 0, 0, 0]
    homed = parse_program("M83\nG28\nG0 X5 F600\n", BARE)
    assert homed.kind.tolist() == [Kind.RAPID, Kind.LINE]


def test_the_plane_of_a_fanuc_mill_is_said_by_the_program() -> None:
    fanuc = Reading(dialect="fanuc")
    arcs = "G2 X4 Y0 I2 J0\nG2 X8 Y0 I2 J0\n"
    (said,) = parse_program("G21 F600\n" + arcs, BARE, fanuc).assumptions
    assert said.startswith("line 2: no G17, G18 or G19 before the first arc")
    assert not parse_program("G21 F600 G17\n" + arcs, BARE, fanuc).assumptions
    assert not parse_program("G21 F600\n" + arcs, BARE).assumptions
