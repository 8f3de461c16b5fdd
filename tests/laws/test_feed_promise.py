"""A feed word is a promise: no block is left sooner than its length at its F takes, by every method, whatever the tolerance.

The check shares nothing with the verifier (benchmarks/judge/passages.py); on a straight line the sum of L/F bounds the time from
below too.
"""

import re

import numpy as np
import pytest
from quick import slow_but

import planner
from benchmarks.judge.feed_promise import KEPT, METHODS, case, outcome, row
from benchmarks.judge.passages import Motion, saved
from planner.machine import Axis, load_machine


@pytest.mark.parametrize("method", METHODS[1:])
def test_f_is_kept_along_a_line(method):
    for seed in range(2):
        found = row(seed, method, kind="line")
        assert outcome(found) == "passed, kept", found
        job = case(seed, "line")
        ends = np.array([float(x) for x in re.findall(r"G1 X(\S+)", job.text)])
        way = np.diff(ends, prepend=0.0)
        # where the line turns back the motion may turn short of the vertex by the tolerance
        short = np.pad(np.where(way[1:] * way[:-1] < 0.0, job.within, 0.0), 1)
        least = np.maximum(np.abs(way) - short[:-1] - short[1:], 0.0) / job.feeds
        assert found["time"] >= least.sum() * (1 - 1e-9)


@pytest.mark.shows("feed", "sampled: by code of the tests, every method, F that changes at every block")
@pytest.mark.parametrize("seed", slow_but([2, 3], range(4)))
def test_f_is_kept_round_corners_and_on_arcs(seed):
    """Blocks that lie inside the tolerance, reversals, arcs."""
    for method in ("optimal", "kinematic"):
        found = row(seed, method)
        assert outcome(found) == "passed, kept", found


@pytest.mark.parametrize("seed", slow_but([148, 433], [148, 169, 219, 433]))
def test_blocks_that_are_passed_together_are_searched(seed):
    """Narrow arcs and short blocks with an F of their own within the tolerance: what the search finds keeps F, and is a good deal
    sooner than the closed form."""
    found, closed = row(seed, "optimal"), row(seed, "kinematic")
    assert outcome(found) == "passed, kept", found
    assert found["time"] < 0.95 * closed["time"]


@pytest.mark.shows("feed", "sampled: by code of the tests, every method, F that changes at every block")
@pytest.mark.slow
@pytest.mark.parametrize("seed", [6, 7, 39])  # a slope, a plane, arcs
def test_f_is_kept_by_every_method(seed):
    for method in METHODS:
        found = row(seed, method)
        assert outcome(found) == "passed, kept", found


@pytest.mark.shows("feed", "sampled: by code of the tests, every method, F that changes at every block")
@pytest.mark.slow
def test_a_slow_block_inside_the_tolerance_takes_its_time(tmp_path):
    # 1.190 s is the sum of L/F; 1.3136 s the optimum of the machine with jerk limits on the line itself
    job = tmp_path / "slow.ngc"
    job.write_text("G21 G90 G94\nG64 P0.4\nG0 X0 Y0\nG1 X10 F6000\nG1 X11 F60\nG1 X20 F6000\nM2\n")
    plan = planner.plan(job, machine="mill")
    assert plan.verdict.passed, plan.verdict.faults
    assert 1.19 <= plan.cycle_time <= 1.32


def run_at(speeds, corners, dt=0.001):
    """A motion along a polyline (B+1, 2) at a constant speed on each of its B lines."""
    corners = np.array(corners, float)
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    passed = np.append(0.0, np.cumsum(lengths / speeds))
    t = np.append(np.arange(0.0, passed[-1], dt), passed[-1])
    position = np.column_stack([np.interp(t, passed, corners[:, k]) for k in range(2)])
    on = np.clip(np.searchsorted(passed, t, side="right") - 1, 0, len(lengths) - 1)
    velocity = (np.diff(corners, axis=0) / (lengths / speeds)[:, None])[on]
    return Motion(t, position, velocity), corners[1:-1]


@pytest.mark.parametrize("corners", [[[0, 0], [3, 0], [3.5, 0], [7, 0]], [[0, 0], [3, 0], [3, 0.5], [6, 2]]])
def test_the_other_code_tells_what_is_too_fast(corners):
    """At F on every block it finds no time saved; half a millimetre run 2 % too fast saves that share of its time."""
    feeds, within = np.array([100.0, 3.0, 50.0]), np.full(2, 0.1)
    motion, points = run_at(feeds, corners)
    assert saved(motion, points, within, feeds) <= KEPT
    motion, points = run_at(feeds * [1.0, 1.02, 1.0], corners)
    assert saved(motion, points, within, feeds) == pytest.approx(0.5 / 3.0 * (1 - 1 / 1.02), rel=0.01)


def test_blocks_that_are_cut_off_take_no_time():
    """A spike of a tenth of a millimetre inside a tolerance of 0.2 mm is passed at its middle; run along, it takes its time."""
    feeds, within = np.array([100.0, 0.1, 0.1, 100.0]), np.full(3, 0.2)
    spike = np.array([[2.0, 0.0], [2.0, 0.1], [2.0, 0.0]])
    motion, _ = run_at(np.array([100.0]), [[0, 0], [4, 0]])
    assert saved(motion, spike, within, feeds) <= KEPT
    motion, points = run_at(np.full(4, 100.0), [[0, 0], *spike, [4, 0]])
    found = saved(motion, points, np.array([0.2, 1e-5, 0.2]), feeds)
    assert found == pytest.approx(0.2 / 0.1 - 0.2 / 100.0, abs=0.05)


@pytest.mark.parametrize("method", ["second-order", pytest.param("optimal", marks=pytest.mark.slow)])
def test_x_y_and_z_keep_f_where_a_rotary_axis_moves_too(tmp_path, method):
    """Round corners inside the tolerance they may not take what the rotary axis need not. 2e-4 is left for places between points."""
    mill = load_machine("mill")
    turning = {"a": Axis(velocity=120.0, acceleration=1000.0, jerk=20000.0)}
    job = tmp_path / "turning.ngc"
    moves = "G1 X3 A20 F600\nG1 X4 Y0.2 A26\nG1 X7 Y1 A26\nG1 X8 Y3 A60\nG1 X8.4 Y6 A62"
    job.write_text(f"G21 G90 G94\nG64 P0.3\nG0 X0 Y0 A0\n{moves}\nM2\n")
    plan = planner.plan(job, machine=mill.model_copy(update={"axes": mill.axes | turning}), method=method)
    assert plan.verdict.passed, plan.verdict.faults
    linear = [plan.trajectory.axes.index(axis) for axis in "xy"]
    assert np.linalg.norm(plan.trajectory.velocity[:, linear], axis=1).max() <= 600 / 60 * (1 + 2e-4)
