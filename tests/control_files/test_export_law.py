"""The law of exports: wherever the machine stands and whatever its work offsets are, an exported program passes the places that its
program passes, in order, within the tolerance; `python -m benchmarks.exports` tries thousands of programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.export_judge import OFFSETS, STARTS, alike, path, readable, unknown_words
from benchmarks.export_programs import TOLERANCE, machine, random_program
from benchmarks.export_rows import judged, of_file
from planner.control_files.controls import CONTROLS
from planner.machine import load_machine

QUICK, MANY = 24, 300


def law(seeds: range, starts: int) -> None:
    rows = [row for seed in seeds for row in judged(seed, starts=starts)]
    broken = [row for row in rows if row.broken]
    assert not broken, "\n".join(map(str, broken))
    outcomes = {(row.control, row.outcome) for row in rows}
    assert {
        (control, outcome) for control in CONTROLS for outcome in ("chords", "own path", "refused")
    } <= outcomes
    assert {("grbl", "as it is"), ("linuxcnc", "as it is")} <= outcomes


def test_law() -> None:
    law(range(QUICK), 2)


@pytest.mark.slow
def test_law_on_many_programs() -> None:
    law(range(10_000, 10_000 + MANY), 3)


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
    """The smaller ones: what is written reads back on the same places; what is not is refused by its line."""
    mill = load_machine("mill")
    files = [
        file
        for file in sorted((shared_dir / "nc").iterdir())
        if file.suffix != ".csv" and file.stat().st_size < 40_000
    ]
    rows = [row for file in files for row in of_file(file, mill)]
    assert len(rows) > 4 * 10
    assert not [row for row in rows if row.broken]
    assert all(row.why.startswith("line ") for row in rows if row.outcome == "refused")
