"""A feed word is a promise: no block is left sooner than its length at its F takes, by every method, whatever the tolerance.

The check here shares nothing with the verifier: on a straight line the way run between two places bounds the time from below, and a
program of one line has a closed-form bound, the sum of L/F.
"""

import numpy as np
import pytest

import planner

METHODS = ("stop", "kinematic", "bezier", "fir", "second-order", "optimal")


def line_program(random, blocks, tolerance):
    """A straight line of blocks whose F changes by up to 1000 from one to the next: text, ends [mm] and feeds [mm/s]."""
    ends = np.round(np.cumsum(10 ** random.uniform(-1.5, 0.5, blocks)), 4)
    feeds = np.round(10 ** random.uniform(1.0, 4.0, blocks), 2)
    rows = [f"G1 X{x:.4f} F{f:.2f}" for x, f in zip(ends, feeds, strict=True)]
    return "\n".join(["G21 G90 G94", f"G64 P{tolerance:g}", "G0 X0 Y0", *rows, "M2", ""]), ends, feeds / 60.0


def excess_along(x, t, ends, feeds):
    """The largest ratio of way run to way allowed over any period, F by the place x itself."""
    edges = np.concatenate([[-np.inf], ends[:-1], [np.inf]])
    worst = 0.0
    for a, b, lasts in zip(x[:-1], x[1:], np.diff(t), strict=True):
        low, high = min(a, b), max(a, b)
        part = np.clip(edges[1:], low, high) - np.clip(edges[:-1], low, high)
        worst = max(worst, float((part / feeds).sum() / lasts))
    return worst


def check(tmp_path, seed, method):
    random = np.random.default_rng(seed)
    text, ends, feeds = line_program(random, int(random.integers(3, 9)), 10 ** random.uniform(-2.3, 0.3))
    job = tmp_path / "line.ngc"
    job.write_text(text)
    plan = planner.plan(job, machine="mill", method=method)
    lengths = np.diff(np.append(0.0, ends))
    assert plan.cycle_time >= (lengths / feeds).sum() * (1 - 1e-9)
    chunks = list(plan.trajectory.chunks())
    t = np.concatenate([chunk.t for chunk in chunks])
    x = np.concatenate([chunk.position[:, 0] for chunk in chunks])
    assert excess_along(x, t, ends, feeds) <= 1 + 1e-4
    assert plan.verdict.passed, plan.verdict.faults


@pytest.mark.parametrize("method", METHODS[:-1])
def test_f_is_kept_along_a_line(tmp_path, method):
    for seed in range(4):
        check(tmp_path, seed, method)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 20))
def test_f_is_kept_along_lines_by_every_method(tmp_path, seed):
    for method in METHODS:
        check(tmp_path, seed, method)


@pytest.mark.slow
def test_a_slow_block_inside_the_tolerance_takes_its_time(tmp_path):
    # 1.190 s is the sum of L/F; 1.3136 s the optimum of the machine with jerk limits on the line itself
    job = tmp_path / "slow.ngc"
    job.write_text("G21 G90 G94\nG64 P0.4\nG0 X0 Y0\nG1 X10 F6000\nG1 X11 F60\nG1 X20 F6000\nM2\n")
    plan = planner.plan(job, machine="mill")
    assert plan.verdict.passed, plan.verdict.faults
    assert 1.19 <= plan.cycle_time <= 1.32
