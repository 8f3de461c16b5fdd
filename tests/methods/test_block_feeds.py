"""The times and feeds of blocks, against the closed form of moves from rest to rest and the cycle time of whole plans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner import plan
from planner.feedrate.rest_to_rest import block_limits, rest_to_rest_times
from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.methods.block_feeds import block_feeds, block_times
from planner.methods.plan import Plan
from planner.methods.stop import StopMethod
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.writer import retimed
from planner.trajectory import Trajectory

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


def long_blocks(made: Plan) -> np.ndarray:
    """(M,) segments with room for a control's ramps up to their highest feed, which is found segment by segment."""
    got, path = made.trajectory, made.toolpath
    _, acceleration, _ = block_limits(path, made.machine)
    joint = np.cumsum(np.append(path.dwell[0], block_times(got, path) + path.dwell[1:]))
    passed = np.interp(joint, got.t, got.feed)
    highest = [
        max(*passed[k : k + 2], got.feed[got.block == block].max(initial=0.0))
        for k, block in enumerate(path.block)
    ]
    return np.square(highest) <= acceleration * path.length


def planned_sum(made: Plan, feed: np.ndarray) -> float:
    """Cycle time if every dense block ran at the feeds of a program, sum(length / F), and all else as planned [s]."""
    path = made.toolpath
    dense = ~path.rapid & ~long_blocks(made)
    others = block_times(made.trajectory, path)[~dense].sum() + path.dwell.sum()
    return float((path.length[dense] / feed[path.block[dense]]).sum() + others)


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
    feeds = block_feeds(made.trajectory, path, MACHINE, len(program))
    still = np.isin(np.arange(len(program)), path.zero_length)
    cuts = np.isin(program.kind, (Kind.LINE, Kind.ARC))
    np.testing.assert_array_equal(np.isfinite(feeds), cuts & ~still)
    slowest = 0.05  # [mm/s]: nothing in this program creeps
    assert (feeds[cuts & ~still] > slowest).all()


def test_long_blocks_have_their_highest_feed_and_dense_ones_their_mean() -> None:
    """A line of 20 mm from rest to rest in one block, and in hundred: the same motion, which a control makes of one F word by itself,
    and of hundred only if they say how fast."""
    line, chords = "G1 X20 F18000\n", "G1 F18000\n" + "".join(f"X{k / 5:.1f}\n" for k in range(1, 101))
    one, many = (plan(parse_program(text, MACHINE), MACHINE) for text in (line, chords))
    assert one.trajectory.cycle_time == pytest.approx(many.trajectory.cycle_time, rel=2e-3)
    whole = block_feeds(one.trajectory, one.toolpath, MACHINE, 1)
    assert whole[0] == one.trajectory.feed.max()
    parts = block_feeds(many.trajectory, many.toolpath, MACHINE, len(many.program))
    moving = slice(5, -5)  # beside the stops short blocks are long too
    parts, times = parts[np.isfinite(parts)][moving], block_times(many.trajectory, many.toolpath)[moving]
    np.testing.assert_allclose(0.2 / parts, times, rtol=1e-12)
    assert parts.min() < 0.95 * whole[0]


def test_a_long_block_that_reaches_the_programmed_feed_keeps_it() -> None:
    """Solvers end a little below it; an F word for that would say nothing."""
    program = parse_program("G1 X50 F3000\nX0 F2000\n", MACHINE)
    made = plan(program, MACHINE)
    assert made.trajectory.feed.max() < program.feed.max()
    np.testing.assert_array_equal(block_feeds(made.trajectory, made.toolpath, MACHINE, 2), program.feed)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_where_a_block_begins_to_be_long(share: float) -> None:
    """v^2/a = length, for a line along x at the programmed feed."""
    acceleration = MACHINE.axes["x"].acceleration
    length = 0.9 * MACHINE.axes["x"].velocity ** 2 / acceleration  # [mm]
    feed = np.sqrt(acceleration * length / share)
    program = parse_program(f"G64 P0.001\nG1 X{length} F{feed * 60}\n", MACHINE)
    path = toolpath_from_program(program, MACHINE)
    t = np.arange(0.0, 0.5, MACHINE.dt)  # a motion made by hand: as fast as programmed, then slow
    s = np.minimum(feed * t, length * (0.5 + 0.5 * t / t[-1]))
    along = s / s[-1] * length
    rate = np.gradient(along, t)
    rate[rate.argmax()] = feed
    zero = np.zeros((len(t), len(path.axes)))
    position = zero.copy()
    position[:, path.axes.index("x")] = along
    made = Trajectory(
        axes=path.axes, dt=MACHINE.dt, t=t, position=position, velocity=zero, acceleration=zero, jerk=zero,
        s=along, feed=np.minimum(rate, feed), block=np.full(len(t), path.block[0]), line=np.full(len(t), 2),
    )  # fmt: skip
    got = block_feeds(made, path, MACHINE, len(program))[path.block[0]]
    assert got == pytest.approx(feed if share > 1 else length / t[-1], rel=1e-9)


def test_blocks_shorter_than_a_period() -> None:
    """A line in pieces of 10 um, ten of which pass in a period: the pieces' feeds are the line's own."""
    steps = "\n".join(f"X{k / 100:.2f}" for k in range(1, 1001))
    program = parse_program(f"G64 P0.01 F6000\nG1 {steps}\n", MACHINE)
    made = plan(program, MACHINE)
    feeds = block_feeds(made.trajectory, made.toolpath, MACHINE, len(program))
    got = made.trajectory
    middle = np.interp((np.arange(1000) + 0.5) / 100, got.s, got.feed)
    cruise = slice(100, -100)  # beside the ends a straight line between samples is no measure
    np.testing.assert_allclose(feeds[cruise], middle[cruise], rtol=0.01)
    assert planned_sum(made, feeds) == pytest.approx(got.cycle_time, rel=1e-9)


def assert_total(made: Plan, source: bytes) -> None:
    feeds = block_feeds(made.trajectory, made.toolpath, made.machine, len(made.program))
    result = parse_program(retimed(source, made.program, feeds), made.machine)
    # 0.1 % of rounding down; a block whose programmed feed caps it may add to that, which no program here shows
    assert 1.0 - 1e-9 <= planned_sum(made, result.feed) / made.trajectory.cycle_time <= 1.001


def test_the_feeds_of_dense_blocks_add_up_to_the_cycle_time() -> None:
    assert_total(plan(EXAMPLE, MACHINE), EXAMPLE.read_bytes())
    assert_total(plan(parse_program(PROGRAM, MACHINE), MACHINE), PROGRAM.encode())


def test_the_feeds_of_the_peers_programs_add_up(shared_dir: Path) -> None:
    for path in sorted((shared_dir / "peers" / "programs").glob("*.ngc")):
        assert_total(plan(path, MACHINE, method="toppra", corner="bezier"), path.read_bytes())
