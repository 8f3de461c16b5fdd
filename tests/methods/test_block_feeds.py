"""The times and feeds of blocks, against the closed form of moves from rest to rest and the cycle time of whole plans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner import plan
from planner.feedrate.rest_to_rest import block_limits, rest_to_rest_times
from planner.machine import load_machine
from planner.methods.block_feeds import block_feeds, block_times
from planner.methods.plan import Plan
from planner.methods.stop import StopMethod
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.writer import retimed

MACHINE = load_machine("mill")
EXAMPLE = Path(__file__).parents[2] / "planner" / "examples" / "bracket.ngc"
PROGRAM = """G21 G90 G17
G4 P0.0123
G0 Z2
G1 Z-1 F900
X10 F3000
X10.4
X10.4
X10.45 Y0.02
G2 X14.45 Y4.02 I0 J4
G4 P0.25
G3 X10 Y8 R5 F1200
M0
G0 Z5
X0 Y0
M2
"""


def planned_sum(made: Plan, feed: np.ndarray) -> float:
    """Cycle time if every block ran at the feeds of a program: sum(length / F), rapids and dwells as planned [s]."""
    path = made.toolpath
    cuts = ~path.rapid
    others = block_times(made.trajectory, path)[path.rapid].sum() + path.dwell.sum()
    return float((path.length[cuts] / feed[path.block[cuts]]).sum() + others)


def test_blocks_from_rest_to_rest_take_the_closed_form_s_time() -> None:
    """Within one period at each of the two joints; dwells belong to no block."""
    made = StopMethod().plan(parse_program(PROGRAM, MACHINE), MACHINE)
    expected = rest_to_rest_times(made.toolpath.length, *block_limits(made.toolpath, MACHINE))
    got = block_times(made.trajectory, made.toolpath)
    np.testing.assert_allclose(got, expected, rtol=0, atol=2 * MACHINE.dt)
    assert got.sum() + made.toolpath.dwell.sum() == pytest.approx(made.trajectory.cycle_time, rel=1e-12)


@pytest.mark.parametrize("method", ["toppra", "stop"])
def test_which_blocks_have_a_feed(method: str) -> None:
    made = plan(parse_program(PROGRAM, MACHINE), MACHINE, method=method)
    program, path = made.program, made.toolpath
    feeds = block_feeds(made.trajectory, path, len(program))
    still = np.isin(np.arange(len(program)), path.zero_length)
    cuts = np.isin(program.kind, (Kind.LINE, Kind.ARC))
    np.testing.assert_array_equal(np.isfinite(feeds), cuts & ~still)
    slowest = 0.05  # [mm/s]: nothing in this program creeps
    assert (feeds[cuts & ~still] > slowest).all()


def test_blocks_shorter_than_a_period() -> None:
    """A line in pieces of 10 um, ten of which pass in a period: the pieces' feeds are the line's own."""
    steps = "\n".join(f"X{k / 100:.2f}" for k in range(1, 1001))
    program = parse_program(f"G64 P0.01 F6000\nG1 {steps}\n", MACHINE)
    made = plan(program, MACHINE)
    feeds = block_feeds(made.trajectory, made.toolpath, len(program))
    got = made.trajectory
    middle = np.interp((np.arange(1000) + 0.5) / 100, got.s, got.feed)
    cruise = slice(100, -100)  # beside the ends a straight line between samples is no measure
    np.testing.assert_allclose(feeds[cruise], middle[cruise], rtol=0.01)
    assert (0.01 / feeds).sum() == pytest.approx(got.cycle_time, rel=1e-9)


def assert_total(made: Plan, source: bytes) -> None:
    feeds = block_feeds(made.trajectory, made.toolpath, len(made.program))
    result = parse_program(retimed(source, made.program, feeds), made.machine)
    # 0.1 % of rounding down; a block whose programmed feed caps it may add to that, which no program here shows
    assert 1.0 - 1e-9 <= planned_sum(made, result.feed) / made.trajectory.cycle_time <= 1.001


def test_the_feeds_add_up_to_the_cycle_time() -> None:
    assert_total(plan(EXAMPLE, MACHINE), EXAMPLE.read_bytes())
    assert_total(plan(parse_program(PROGRAM, MACHINE), MACHINE), PROGRAM.encode())


def test_the_feeds_of_the_peers_programs_add_up(shared_dir: Path) -> None:
    for path in sorted((shared_dir / "peers" / "programs").glob("*.ngc")):
        assert_total(plan(path, MACHINE), path.read_bytes())
