"""Lines by samples: a motion is a point of the programme, and what bounds the programme bounds it at any multipliers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, vstack

import planner
from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine, load_machine
from planner.sensitivity import sampled_lines
from planner.sensitivity.linear_program import Programme, bounds_by_part, multipliers
from planner.sensitivity.sampled_lines import (
    chain_times,
    chains_of,
    ends_at_corners,
    layout_of,
    lines_of,
    programme_of,
    sampled_legs,
)
from planner.sensitivity.sampled_rows import Layout, Lines, differences
from planner.sensitivity.waypoints import Way, way_of

MILL = load_machine("mill")
FINE_DT = 1e-4  # of motions that are read between their setpoints [s]


def uneven(seed: int, dt: float = 1e-3) -> tuple[FloatArray, Machine]:
    """Points of lines in all directions, and a machine of unlike axes."""
    rng = np.random.default_rng([5, seed])
    limits = zip("xyz", *(rng.uniform(*of, 3) for of in ((70, 200), (1e3, 5e3), (4e4, 2e5))), strict=True)
    axes = {letter: Axis(velocity=v, acceleration=a, jerk=j) for letter, v, a, j in limits}
    steps = rng.normal(size=(6, 3)) * rng.uniform(1.0, 6.0, (6, 1)) * (1.0, 1.0, seed % 2)
    points = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return points, Machine(name="uneven", dt=dt, tolerance=0.02, axes=axes)


def way_through(points: FloatArray, machine: Machine) -> Way:
    return way_of(toolpath_from_program(problems.polyline(points), machine), machine, ())


def matrix(program: Programme) -> csr_matrix:
    return csr_matrix(
        (program.value, program.column, program.first), shape=(len(program.high), len(program.cost))
    )


def at_samples(lines: Lines, at: Layout, t: FloatArray, place) -> FloatArray:
    """The variables of a motion place(t) that passes waypoints at times t."""
    axes = np.arange(lines.way.point.shape[1])
    x = np.zeros(len(at.part))
    point = lines.way.point
    for n, first in enumerate(at.waypoint):
        x[first + axes] = place(t[n]) - point[n]
    for n in range(len(lines.window)):
        for first, s in zip(at.front[n], lines.front[n], strict=True):
            x[first + axes] = place(t[n] + s) - point[n]
        for first, s in zip(at.back[n], lines.back[n], strict=True):
            x[first + axes] = place(t[n + 1] - s) - point[n + 1]
        x[at.gap[n]] = t[n + 1] - t[n] - lines.front[n, -1] - lines.back[n, -1]
    return x


@pytest.mark.parametrize("seed", range(4))
def test_a_motion_is_a_point_of_the_programme(seed: int) -> None:
    points, machine = uneven(seed, FINE_DT)
    plan = planner.plan(problems.polyline(points), machine)
    way, motion = way_through(points, machine), plan.trajectory
    found = np.array([[0, len(way.length)]])
    lines, at, _, program = programme_of(way, sampled_legs(way), found, 0.0 * way.tangent)
    near = [
        int(np.linalg.norm(motion.position - point, axis=1).argmin()) for point in way.point[1:-1]
    ]  # all waypoints are apart
    t = np.concatenate([[0.0], motion.t[near], [plan.cycle_time]])
    moved = slice(None) if seed % 2 else slice(0, 2)
    spline = make_interp_spline(motion.t, motion.position[:, moved], k=3)
    x = at_samples(lines, at, t, lambda when: spline(min(when, motion.t[-1])))
    assert (x[at.gap] > -1e-9).all()
    off = matrix(program) @ x
    # between setpoints the jerk is not known better; positions in tolerances are
    assert (off <= program.high + 0.02).all()
    assert (off >= program.low - 0.02).all()
    assert np.mean(np.abs(off) > 0.9) > 0.05  # and many limits are used
    assert t[1:] - t[:-1] == pytest.approx(np.maximum(np.diff(t), lines.front[:, -1] + lines.back[:, -1]))
    for along, speed in lines.speeds:  # no line is faster than its largest speed
        fastest = motion.velocity[:, moved] @ along.T
        for n in range(len(lines.window)):
            on_it = (motion.t > t[n]) & (motion.t < t[n + 1])
            assert fastest[on_it, n].max() <= speed[n] * (1.0 + 1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_no_motion_through_lines_is_faster(seed: int) -> None:
    points, machine = uneven(seed)
    for method, settings in (("optimal", {}), ("kinematic", {}), ("second-order", {"effort": "quick"})):
        plan = planner.plan(problems.polyline(points), machine, method=method, **settings)
        if plan.verdict.passed:
            assert plan.least_time <= plan.cycle_time
            assert method != "optimal" or plan.cycle_time < 1.045 * plan.least_time


def test_differences_are_derivatives_of_polynomials() -> None:
    time = np.array([[-0.3, -0.1, 0.0, 0.25, 0.3]])
    for order in (1, 2, 3):
        factor = differences(time, order)[0]
        values = np.lib.stride_tricks.sliding_window_view(time[0] ** order, order + 1)
        assert (factor * values).sum(axis=1) == pytest.approx((1.0, 2.0, 6.0)[order - 1])
        assert factor.sum(axis=1) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_multipliers_bound_the_programme(seed: int) -> None:
    points, machine = uneven(seed)
    way = way_through(points, machine)
    found = np.array([[0, len(way.length)]])
    _, at, _, program = programme_of(way, sampled_legs(way), found, 0.0 * way.tangent)
    rows, two = matrix(program), np.isfinite(program.low)
    sides = [rows, -rows[two]]
    best = linprog(
        program.cost,
        A_ub=vstack(sides),
        b_ub=np.concatenate([program.high, -program.low[two]]),
        bounds=(None, None),
    )
    assert best.status == 0
    assert (np.abs(best.x) < program.reach).all()
    for iterations in (1, 5, 60):
        z = multipliers(program, 0.5, 1e-7, iterations)
        assert bounds_by_part(program, z, at.part)[0] <= best.fun + 1e-9
    assert bounds_by_part(program, z, at.part)[0] == pytest.approx(best.fun, abs=3e-4)
    z = np.abs(np.random.default_rng(seed).normal(size=z.shape)) * np.array([np.ones(len(two)), two])
    assert bounds_by_part(program, z, at.part)[0] < best.fun


def test_samples_of_fewer_lines_bound_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    way = way_of(toolpath_from_program(problems.zigzag(21), MILL), MILL, ())
    y, sampled = way.tangent / way.feed[:, None], sampled_legs(way)

    def bound(lines: int) -> float:
        monkeypatch.setattr(sampled_lines, "MOST", lines)
        found = chains_of(way, sampled)
        assert np.diff(found).sum() == min(lines, len(y))
        inside = np.zeros(len(y), dtype=bool)
        for begin, end in found:
            inside[begin:end] = True
        # lines that are left out take what their feed makes of them
        left = (y * np.diff(way.point, axis=0)).sum(axis=1)[~inside].sum()
        return float(chain_times(way, sampled, found, y).sum() + left)

    assert bound(3) <= bound(7) <= bound(100) * (1.0 + 1e-4)


def test_speeds_at_a_corner_are_landaus() -> None:
    # beside one leg until the corner, and free behind it: a coordinate that is confined before, and the other one behind
    jerk, eps = 5e4, 0.02
    axis = Axis(velocity=1e4, acceleration=1e7, jerk=jerk)
    machine = Machine(name="soft", dt=1e-3, tolerance=eps, axes=dict.fromkeys("xyz", axis))
    way = way_through(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]]), machine)
    found = np.array([[0, 2]])
    sampled, moved = sampled_legs(way), np.array([True, True, False])
    lines = lines_of(way, sampled, found, moved)
    at, outer = layout_of(lines), np.zeros((2, 1, 2))
    begin, end = ends_at_corners(lines, at, sampled.legs, outer, (lines.way.tangent, sampled.bounds))
    most = np.cbrt(243.0 / 8.0 * eps**2 * jerk)
    for speed in (begin.speed[1], end.speed[0]):
        assert most <= speed < 1.04 * most


def test_chains_bound_alike_together_and_alone() -> None:
    # of lengths a hundredfold apart: with one step for both, the bounds fall 3e-3 behind in as many iterations; where a line's
    # neighbour is of another chain its tolerance is a square of other directions
    points, machine = uneven(1)
    way = way_through(np.vstack([points, points[-1] + 100.0 * (points[1:] + 1.0)]), machine)
    sampled, y = sampled_legs(way), way.tangent / way.feed[:, None]
    both = np.array([[0, 5], [7, 12]])
    alone = [float(chain_times(way, sampled, both[k : k + 1], y)[0]) for k in range(2)]
    assert chain_times(way, sampled, both, y) == pytest.approx(alone, rel=2e-4)
