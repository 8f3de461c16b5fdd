"""The times and feeds of blocks, against the closed form of moves from rest to rest and the cycle time of whole plans."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from planner import plan
from planner.base.point_to_point import rest_to_rest_times
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.machine import load_machine
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.writer import retimed
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.stop import StopMethod
from planner.report.word_feed import RUN_PERIODS, SPREAD, feeds_of, planned_blocks, runs_of_feed

MACHINE = load_machine("mill")
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


@pytest.mark.shows("block-times", "exact: the closed form from rest to rest")
def test_blocks_from_rest_to_rest_take_the_closed_form_s_time() -> None:
    """Within one period at each of the two joints; dwells belong to no block."""
    made = StopMethod().plan(parse_program(PROGRAM, MACHINE), MACHINE)
    expected = rest_to_rest_times(made.toolpath.length, *block_limits(made.toolpath, MACHINE))
    got = planned_blocks(made.trajectory, made.toolpath).duration
    np.testing.assert_allclose(got, expected, rtol=0, atol=2 * MACHINE.dt)
    assert got.sum() + made.toolpath.dwell.sum() == pytest.approx(made.trajectory.cycle_time, rel=1e-12)


@pytest.mark.parametrize("method", ["second-order", "stop"])
def test_which_blocks_have_a_feed(method: str) -> None:
    made = plan(parse_program(PROGRAM, MACHINE), MACHINE, method=method)
    program, path = made.program, made.toolpath
    feeds = feeds_of(planned_blocks(made.trajectory, path), path, MACHINE, len(program))
    still = np.isin(np.arange(len(program)), path.block, invert=True)
    cuts = np.isin(program.kind, (Kind.LINE, Kind.ARC))
    np.testing.assert_array_equal(np.isfinite(feeds), cuts & ~still)
    slowest = 0.05  # [mm/s]: nothing in this program creeps
    assert (feeds[cuts & ~still] > slowest).all()


def feeds_planned(made: Plan) -> np.ndarray:
    return feeds_of(
        planned_blocks(made.trajectory, made.toolpath), made.toolpath, made.machine, len(made.program)
    )


def test_no_block_is_held_below_its_planned_feed() -> None:
    made = plan(parse_program(PROGRAM, MACHINE), MACHINE, method="second-order")
    feeds, got = feeds_planned(made), made.trajectory
    cut = np.isfinite(feeds[got.block])
    assert (feeds[got.block][cut] >= got.feed[cut] * (1.0 - 1e-9)).all()
    assert (feeds[np.isfinite(feeds)] <= made.program.feed[np.isfinite(feeds)]).all()


def test_blocks_of_a_run_share_their_feed() -> None:
    """From rest to rest over hundreds of blocks of 20 um: a few F words, each the highest feed of its run."""
    steps = "\n".join(f"X{k / 50:.2f}" for k in range(1, 401))
    made = plan(parse_program(f"G21 G64 P0.01 F18000\nG1 {steps}\n", MACHINE), MACHINE)
    feeds, got = feeds_planned(made), made.trajectory
    first = np.flatnonzero(np.diff(feeds, prepend=0.0))
    assert 2 <= len(first) <= 12
    lasting = np.add.reduceat(planned_blocks(got, made.toolpath).duration, first)
    assert (lasting[:-1] >= RUN_PERIODS * MACHINE.dt * (1.0 - 1e-9)).all()
    for begin, end in pairwise([*first, len(feeds)]):
        highest = got.feed[(got.block >= begin) & (got.block < end)].max()
        a_period_more = MACHINE.axes["x"].acceleration * MACHINE.dt  # at its ends, which are no samples
        assert highest <= feeds[begin] <= highest * (1.0 + 2e-3) + a_period_more


@pytest.mark.parametrize(
    ("least", "runs"),
    [
        (0.0, [0, 0, 0, 1, 1, 1, 2, 2]),
        (3.0, [0, 0, 0, 1, 1, 1, 2, 2]),
        (5.0, [0, 0, 0, 0, 0, 1, 1, 1]),
        (9.0, [0] * 8),
    ],
)
def test_where_runs_end(least: float, runs: list[int]) -> None:
    near = 1.0 + 0.9 * SPREAD
    highest = np.array([1.0, near, 1.0, 9.0, 9.0, 9.0 * near, 1.0, 1.0])
    assert runs_of_feed(highest, np.ones(8), least).tolist() == runs


def test_a_block_without_a_sample_is_not_held_up() -> None:
    """Blocks of 1 um between full stops last less than a period: no sample says how fast they are."""
    text = "G21 G61.1 F3000\n" + "".join(f"G1 X{k / 1000:.3f}\n" for k in range(1, 6))
    made = StopMethod().plan(parse_program(text, MACHINE), MACHINE.model_copy(update={"dt": 0.02}))
    mean = made.toolpath.length / planned_blocks(made.trajectory, made.toolpath).duration
    assert (feeds_planned(made) >= 2.0 * mean.min()).all()


def test_a_block_that_reaches_the_programmed_feed_keeps_it() -> None:
    """Solvers end a little below it; an F word for that would say nothing."""
    program = parse_program("G1 X50 F3000\nX0 F2000\n", MACHINE)
    made = OptimalMethod(corner="bezier").plan(program, MACHINE)
    assert made.trajectory.feed.max() < program.feed.max()
    np.testing.assert_array_equal(feeds_planned(made), program.feed)


def pentagon() -> str:
    """Sides of 15 mm in three blocks each."""
    turn = np.repeat(np.radians(72.0 * np.arange(5)), 3)
    x, y = 5.0 * np.cumsum(np.cos(turn)), 5.0 * np.cumsum(np.sin(turn))
    return "".join(f"G1 X{a:.5f} Y{b:.5f}\n" for a, b in zip(x, y, strict=True))


def circle(radius: float, chords: int) -> str:
    angle = np.radians(360.0) * np.arange(1, chords + 1) / chords
    return "".join(f"G1 X{radius * np.cos(a) - radius:.5f} Y{radius * np.sin(a):.5f}\n" for a in angle)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [(pentagon(), 6), (circle(5.0, 90), 20), (circle(0.2, 600), 8)],
    ids=["pentagon", "chords", "2 um"],
)
def test_planned_again_the_program_takes_the_planned_time(text: str, words: int) -> None:
    machine = MACHINE.model_copy(update={"tolerance": 0.02})
    source = f"G21 G90 G17 F6000\n{text}M2\n".encode()
    method = OptimalMethod(corner="spline")
    made = method.plan(parse_program(source, machine), machine)
    result = retimed(source, made.program, feeds_planned(made))
    assert result.count(b"F") <= words
    again = method.plan(parse_program(result, machine), machine)
    assert again.trajectory.cycle_time == pytest.approx(made.trajectory.cycle_time, rel=0.01)
