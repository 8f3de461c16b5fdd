"""Making up for excesses between grid points: tightened limits, slower runs, and that both keep what they promise."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.solvers.random_paths import random_path
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import RESOLUTION, sample_path
from planner.feedrate.solution import ratios_by_limit
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine
from planner.machine.user_limit import JointLimit
from planner.motion.timing import Motion, law_of_solution
from planner.nc.reader import parse_program
from planner.planning.methods.registry import plan
from planner.planning.optimal import tighten
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import ThirdOrder
from planner.planning.optimal.tighten import (
    SEEN_BEFORE,
    SLOWING_MORE,
    excess,
    slowed,
    tightened,
    within_limits,
)

MACHINE = problems.machine()
COARSE = 4.0  # times the usual resolution: a grid on which motions exceed their limits visibly
SOLVE = JerkLimited().solve


def test_a_motion_slower_by_a_factor_uses_the_tightened_limits_as_the_motion_itself_uses_its_own():
    problem, by = random_path(3), 1.25
    fast = SOLVE(problem)
    slow = dataclasses.replace(
        fast,
        feed_sq=fast.feed_sq / by**2,
        acc_s=fast.acc_s / by**2,
        jerk_s=fast.jerk_s / by**3,
        duration=fast.duration * by,
    )
    tighter = tightened(problem, np.full(len(problem), by))
    own, scaled = list(ratios_by_limit(problem, fast)), list(ratios_by_limit(tighter, slow))
    for (limit, ratio), (limit_too, ratio_too) in zip(own, scaled, strict=True):
        assert limit == limit_too
        np.testing.assert_allclose(ratio_too, ratio, rtol=1e-9, atol=1e-12)


def test_only_the_ends_of_an_interval_with_an_excess_are_tightened():
    problem = random_path(3)
    factor = np.zeros(len(problem))
    factor[40] = 1.1
    tighter = tightened(problem, factor)
    changed = np.flatnonzero(tighter.limit_scale != 1.0)
    assert list(changed) == [40, 41]
    assert factor.max() == 1.1
    assert factor.sum() == 1.1


@pytest.fixture(scope="module")
def coarse():
    """A motion on too coarse a grid, its toolpath, and how much too fast it is anywhere."""
    toolpath = toolpath_from_program(problems.pentagon(), MACHINE, None)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    samples = sample_path(path, MACHINE, RESOLUTION * COARSE, third_order=True)
    problem = feedrate_problem(samples, MACHINE)
    planned = OnPath(path=path, samples=samples, problem=problem, solution=SOLVE(problem))
    motion = Motion(samples=samples, law=law_of_solution(samples, planned.solution))
    return planned, motion, toolpath, excess(motion, toolpath, MACHINE).max()


def test_the_slowed_motion_has_no_excess(coarse):
    _, motion, toolpath, before = coarse
    assert before > 1.0 + 1e-3  # else this test shows nothing
    kept = slowed(motion, toolpath, MACHINE)
    assert excess(kept, toolpath, MACHINE).max() <= 1.0 + SLOWING_MORE
    assert kept.end <= motion.end * before * (1.0 + 2.0 * SLOWING_MORE)


def test_tightening_costs_less_than_slowing_down(coarse):
    planned, motion, toolpath, _ = coarse
    best, kept = within_limits(planned, ThirdOrder(JerkLimited()), toolpath, MACHINE)
    assert excess(kept, toolpath, MACHINE).max() <= 1.0 + SLOWING_MORE
    plain = slowed(motion, toolpath, MACHINE)
    assert kept.end - motion.end < 0.5 * (plain.end - motion.end)
    assert best.problem is not planned.problem
    assert best.solution.solved


def test_peaks_between_the_places_looked_at_are_seen():
    toolpath = toolpath_from_program(problems.star_spiral(40), MACHINE, None)
    path = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    samples = sample_path(path, MACHINE, third_order=True)
    problem = feedrate_problem(samples, MACHINE)
    motion = Motion(samples=samples, law=law_of_solution(samples, SOLVE(problem)))
    edges = np.append(motion.t, motion.end)
    pieces = np.flatnonzero(np.diff(edges) > 1e-6)
    shares = np.linspace(0.05, 0.95, 41)
    times = edges[pieces, None] + np.diff(edges)[pieces, None] * shares
    jerk = np.abs(motion.at(times.ravel(), MACHINE.dt).jerk) / MACHINE.limits("jerk", toolpath.axes)
    jerk = jerk.reshape(*times.shape, -1).max(axis=2)
    unseen = jerk.max(axis=1) - jerk[:, [0, 20, 40]].max(axis=1)
    missed = jerk.max(axis=1) - excess(motion, toolpath, MACHINE)[pieces] ** 3
    near = jerk.max(axis=1) > 1.0 - 1e-4
    assert unseen[near].max() > 1e-4  # else this test shows nothing
    assert missed[near].max() < 0.1 * unseen[near].max()


class AlongX(JointLimit):
    """The axis x, as a joint."""

    name, unit = "x again", "mm"
    velocity, acceleration, jerk = (
        getattr(MACHINE.axes["x"], q) for q in ("velocity", "acceleration", "jerk")
    )

    def joint(self, at):
        return at.x


def test_a_joint_that_is_an_axis_has_its_excess(coarse):
    _, motion, toolpath, _ = coarse
    axes = {
        letter: axis.model_copy(
            update={q: 100.0 * getattr(axis, q) for q in ("velocity", "acceleration", "jerk")}
        )
        for letter, axis in MACHINE.axes.items()
    }
    without = MACHINE.model_copy(update={"axes": axes})
    of_axis = excess(motion, toolpath, without.model_copy(update={"axes": axes | {"x": MACHINE.axes["x"]}}))
    of_joint = excess(motion, toolpath, without.with_own((AlongX(),)))
    assert of_axis.max() > 1.0 + 1e-3  # else this test shows nothing
    np.testing.assert_allclose(of_joint, of_axis, rtol=1e-9)


def test_the_normal_acceleration_between_grid_points_is_an_excess(coarse):
    _, motion, toolpath, _ = coarse
    seen = motion.at(np.linspace(0.0, motion.end, 20_001), MACHINE.dt)
    speed = np.linalg.norm(seen.velocity, axis=1)
    moving = speed > 1.0  # mm/s
    across = np.linalg.norm(np.cross(seen.velocity, seen.acceleration)[moving], axis=1) / speed[moving]
    limit = 0.5 * across.max()
    of_axes = excess(motion, toolpath, MACHINE)
    narrow = excess(motion, toolpath, MACHINE.model_copy(update={"normal_acceleration": limit}))
    assert (narrow >= of_axes).all()
    assert narrow.max() == pytest.approx(2.0**0.5, rel=2e-3)


def test_a_path_of_two_small_arcs_keeps_its_normal_acceleration():
    """Found by the campaign of random jobs: between grid points it was 1.006 times the limit."""
    limits = {"x": (71.5, 1309.3, 79475.0), "y": (82.2, 710.4, 22477.0), "z": (39.7, 1334.0, 42479.0)}
    axes = {letter: Axis(velocity=v, acceleration=a, jerk=j) for letter, (v, a, j) in limits.items()}
    machine = Machine(
        name="arcs", dt=0.002, tolerance=0.0772, feed_default=10.0, axes=axes, normal_acceleration=143.83
    )
    text = "G21 G17 G90 G94 F8443.5\nG61.1\nG3 X0.005 Y-0.001 R0.014493\nG3 X0.4749 Y-0.0707 R0.634975\nM2\n"
    made = plan(parse_program(text, machine), machine, effort="quick", geometry="spline")
    assert made.verdict.passed, made.verdict.faults
    assert made.verdict.limits["normal_acceleration"].ratio > 0.99


def test_long_jobs_are_slowed_for_what_the_verifier_may_find(coarse, monkeypatch):
    planned, _, toolpath, _ = coarse
    _, short = within_limits(planned, ThirdOrder(JerkLimited()), toolpath, MACHINE)
    monkeypatch.setattr(tighten, "MANY_POINTS", 10)
    _, long = within_limits(planned, ThirdOrder(JerkLimited()), toolpath, MACHINE)
    assert long.end == pytest.approx(short.end * SEEN_BEFORE, rel=1e-9)
    assert excess(long, toolpath, MACHINE).max() <= 1.0 - 0.9 * (SEEN_BEFORE - 1.0)
