"""`planned.ngc` where rotary axes move: under G93, which every control reads the same way."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import planner
from benchmarks.reading import nc_programs
from planner.geometry.build import toolpath_from_program
from planner.nc.reader import parse_program
from planner.nc.writer import retimed
from planner.report.planned import planned_program
from planner.report.word_feed import planned_blocks

MACHINE = planner.load_machine(Path(nc_programs.__file__).parent.parent / "programs" / "mill-xyzabc.toml")
SOURCE = b"""G21 G17 G90 G94 F1200
G1 X10
X20 A10
A60 (only turns)
Y5 A65 F800
X25
g2 X30 Y10 I5 J0
G1 X31 Y11 B4
G0 X0 Y0
G1 X5
M2
"""


def planned(source: bytes = SOURCE):
    program = planner.read_program(text=source.decode(), machine=MACHINE)
    plan = planner.plan(program, MACHINE)
    return plan, planned_program(plan)[0]


def test_blocks_that_turn_are_under_g93_and_the_others_under_g94():
    _, text = planned()
    lines = text.decode().splitlines()
    assert lines[1] == "G1 X10"
    assert lines[2].startswith("X20 A10 G93 F")
    assert lines[3].startswith("A60 F")  # a comment stays behind its words
    assert lines[3].endswith("(only turns)")
    assert lines[4].startswith("Y5 A65 F")
    assert "G9" not in lines[4]
    assert lines[5].startswith("X25 G94 F")
    assert "f" in lines[6] or "F" not in lines[6]
    assert lines[8:] == ["G0 X0 Y0", lines[9], "M2"]
    assert lines[9].startswith("G1 X5 G94 F")


def test_a_block_takes_at_its_word_what_its_highest_planned_feed_takes():
    plan, text = planned()
    again = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    before, blocks = plan.toolpath, planned_blocks(plan.trajectory, plan.toolpath)
    np.testing.assert_array_equal(again.end, before.end)
    turning = ~before.rapid & ((before.end - before.start)[:, 3:] != 0.0).any(axis=1)
    assert turning.sum() == 4
    expected = np.minimum(blocks.highest * 1.001, before.feed)
    np.testing.assert_allclose(
        again.feed[turning], expected[turning], rtol=1.1e-3
    )  # four digits, rounded down
    assert (again.feed[turning] <= expected[turning] * (1.0 + 1e-9)).all()


def test_planned_again_it_takes_the_planned_time_and_written_again_it_stays():
    plan, text = planned()
    again = planner.plan(parse_program(text, MACHINE), MACHINE)
    assert again.verdict.passed
    assert again.cycle_time == pytest.approx(plan.cycle_time, rel=2e-3)
    program = parse_program(text, MACHINE)
    often = np.where(
        [*b"\0\1\1\1\0\0\1\0\0"], 3.0, np.nan
    )  # of the blocks that turn, which are under G93 by now
    assert retimed(text, program, np.full(len(program), np.nan), often) == text


def test_lines_with_a_feed_mode_of_their_own_keep_it():
    source = b"G21 G90 G94 F600\nG1 X5 A5\nG94 X9 A9 F500\nX12\nG93 X15 A20 F40\nG94 X20 F600\nX25 A30\nM2\n"
    _, text = planned(source)
    before, lines = source.decode().splitlines(), text.decode().splitlines()
    assert lines[1].startswith("G1 X5 A5 G93 F")
    assert lines[2].startswith("G94 X9 A9 F")
    assert lines[2].count("G9") == 1
    assert lines[4] == before[4]
    assert lines[5].startswith("G94 X20 F")
    assert lines[6].startswith("X25 A30 G93 F")


@pytest.mark.skipif(shutil.which("rs274") is None, reason="rs274 (Debian package linuxcnc-uspace) is missing")
def test_linuxcnc_reads_the_same_moves(tmp_path: Path):
    _, text = planned()
    (tmp_path / "planned.ngc").write_bytes(text)
    (tmp_path / "source.ngc").write_bytes(SOURCE)
    moves = []
    for name in ("planned", "source"):
        ran = subprocess.run(
            ["rs274", "-g", str(tmp_path / f"{name}.ngc")], capture_output=True, text=True, check=False
        )
        assert ran.returncode == 0, ran.stderr + ran.stdout
        canon = [line.split(None, 2)[-1] for line in ran.stdout.splitlines()]
        moves.append([line for line in canon if line.startswith(("STRAIGHT_", "ARC_FEED"))])
    assert moves[0] == moves[1]
    assert len(moves[0]) == 9
