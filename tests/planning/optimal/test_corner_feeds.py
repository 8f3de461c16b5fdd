"""Feeds that corners allow behind filters: they settle, so that changed jobs take the same time."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.campaign.laws import mirrored, reversed_program, split
from benchmarks.jobs import problems
from planner.machine import Axis, Fir, Machine
from planner.nc.reader import parse_program
from planner.planning.job.trace import Trace
from planner.planning.methods.registry import plan
from planner.planning.optimal.behind_filters import ROUNDS, CornerFeeds

MACHINE = problems.machine(fir=Fir(time_constants=(0.02, 0.013)))
JOB = parse_program("G21 F6000\nG1 X6\nX9 Y4\nX3 Y5\nY9\n", source="corners of 53, 137 and 100 degrees")
SLACK = 1e-3  # of the time, for what is left when the rounds end [-]


def time_of(program) -> float:
    made = plan(program, MACHINE, corner="bezier")
    assert made.verdict.passed, made.verdict.faults
    return made.cycle_time


@pytest.fixture(scope="module")
def time() -> float:
    return time_of(JOB)


@pytest.mark.parametrize("change", [mirrored, reversed_program])
def test_mirrored_and_reversed_jobs_take_the_same_time(time, change):
    assert time_of(change(JOB)) == pytest.approx(time, rel=SLACK, abs=MACHINE.dt)


def test_a_line_in_two_blocks_takes_no_longer(time):
    assert time_of(split(JOB, np.random.default_rng(1))) <= time * (1.0 + SLACK) + MACHINE.dt


def test_the_rounds_settle():
    """The last one keeps the tolerance, and comes before there are no more."""
    trace = Trace()
    plan(JOB, MACHINE, corner="bezier", log=trace)
    of_first = trace.steps[: [step.name for step in trace.steps].index("plan")]
    rounds = [step for step in of_first if step.name == "filters"]
    assert 2 < len(rounds) < ROUNDS
    assert rounds[-1].facts["places"] == 0


@pytest.mark.parametrize(("length", "tried"), [(1e-2, 0), (0.03, 2)])
def test_smaller_shares_of_the_tolerance_are_tried_behind_long_filters(length, tried):
    trace = Trace()
    machine = problems.machine(fir=Fir(time_constants=(length,)))
    made = plan(JOB, machine, effort="quick", log=trace)
    assert made.verdict.passed
    assert sum(step.name == "share of tolerance" for step in trace.steps) == tried


def test_what_long_filters_hold_in_curves_is_said_to_be_theirs():
    """The curve is planned by the closed form of their error, as a normal acceleration, which this machine does not limit."""
    machine = problems.machine(fir=Fir(time_constants=(0.15,)))
    program = parse_program(
        "G21 G64 P0.05 F60000\nG1 X60\nG3 X60 Y80 I0 J40\nG1 X0\n", source="a half circle"
    )
    made = plan(program, machine, effort="quick")
    assert made.verdict.passed
    held = dict(made.grid.ranked())
    assert held["filter_error"] > 0.1
    assert "normal_acceleration" not in held


@pytest.mark.usual_sizes
def test_a_small_tolerance_somewhere_does_not_slow_curves_elsewhere():
    """By the closed form of the smallest tolerance the two half circles took 2.868 s."""
    machine = problems.machine(fir=Fir(time_constants=(0.06, 0.03)))
    program = parse_program(
        "G21 G64 P0.3 F60000\nG1 X30\nG3 X30 Y40 I0 J20\nG1 X0\nG3 X0 Y80 I0 J20\nG1 X20\nG64 P0.005\nG1 X40\nX44 Y84\nX60\n",
        source="half circles, and corners",
    )
    made = plan(program, machine, effort="quick")
    assert made.verdict.passed
    assert made.cycle_time < 2.75


@pytest.mark.parametrize("change", [lambda program: program, reversed_program])
def test_corners_that_were_too_slow_get_faster_again(change):
    """Corners were so slow after the first round that the time fell from 0.116 s to 0.082 s until the last;
    forward the job took 0.0787 s, backward 0.0714 s. Behind chords of 2 ms it takes 0.0734 s and 0.0728 s."""
    limits = {"x": (4000.0, 1e5, 3e7), "y": (4000.0, 1e5, 3e7), "z": (4000.0, 1e5, 3e7)}
    axes = {letter: Axis(velocity=v, acceleration=a, jerk=j) for letter, (v, a, j) in limits.items()}
    machine = Machine(
        name="tight", dt=0.002, tolerance=0.0013, feed_default=10.0, axes=axes, fir=Fir(time_constants=(0.0082,))
    )  # fmt: skip
    program = parse_program(
        "G21 F50000\nG1 X-1.4138 Y1.5726 Z0.0463\nX-1.786 Y-0.4493 Z-0.0938\nX-0.7854 Y-1.4477 Z0.1341\nX0.6984 Y0.8594 Z-0.1672\n",
        source="four lines",
    )
    made = plan(change(program), machine, geometry="spline", effort="quick")
    assert made.verdict.passed, made.verdict.faults
    assert made.cycle_time < 0.0745


@pytest.mark.parametrize("power", [0.3, 1.0, 3.0, 6.0])
def test_a_corner_finds_the_root_of_its_error(power):
    corner = object.__new__(CornerFeeds)
    corner.fast, corner.slow = np.full(1, np.inf), np.zeros(1)
    corner.power, corner.before = np.ones(1), np.full((2, 1), np.nan)
    feed_sq = np.array([300.0])
    for _ in range(ROUNDS - 2):
        feed_sq = corner.secant(feed_sq, (feed_sq / 7.0) ** power)
    assert feed_sq[0] == pytest.approx(7.0, rel=0.02)
