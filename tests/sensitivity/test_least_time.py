"""The time that no motion falls short of: below every motion that passes its verdict, exact where the optimum is known,
and the same for the same job written otherwise."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import lil_matrix

import planner
from benchmarks.campaign import laws
from benchmarks.jobs import problems, random_lines
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Fir, Machine, load_machine
from planner.nc.program import Program
from planner.planning.job.plan import Plan
from planner.sensitivity.bends import extremes, spans
from planner.sensitivity.least_time import least_time
from planner.sensitivity.straight_time import Bounds, End, straight_time
from planner.sensitivity.waypoints import Way, confined, legs_between, way_of

MILL = load_machine("mill")
WAYS = (
    ("kinematic", {}),
    ("fir", {}),
    ("stop", {}),
    ("optimal", {"effort": "quick"}),
    ("second-order", {"effort": "quick"}),
)


def bound(program: Program, machine: Machine, not_limited: tuple[str, ...] = ()) -> float:
    found = least_time(toolpath_from_program(program, machine), machine, not_limited)
    assert found is not None
    return found


def broken(seed: int) -> list[tuple[str, float, float]]:
    """Methods whose motion is faster than the bound, on a random job."""
    program, machine = random_lines.job(seed)
    found = []
    for method, settings in WAYS:
        try:
            plan = planner.plan(program, machine, method=method, **settings)
        except InputError:
            continue
        if plan.verdict is not None and plan.verdict.passed and plan.least_time > plan.cycle_time:
            found.append((method, plan.least_time, plan.cycle_time))
    return found


@pytest.mark.shows("bound", "certified: below every motion that passes, by every method")
@pytest.mark.parametrize("seed", [3, 12, 22, 36])
def test_no_motion_that_passes_is_faster(seed: int) -> None:
    assert not broken(seed)


@pytest.mark.parametrize("seed", range(4))
def test_no_motion_through_blocks_shorter_than_the_tolerance_is_faster(seed: int) -> None:
    steps = np.random.default_rng([11, seed]).normal(size=(30, 2)) * 0.01 + (0.01, 0.0)
    points = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    plan = planner.plan(problems.polyline(points, feed=0.5), MILL)
    assert plan.verdict.passed
    assert plan.least_time <= plan.cycle_time


@pytest.mark.shows("bound", "certified: below every motion that passes, by every method")
@pytest.mark.slow
def test_no_motion_of_more_jobs_is_faster() -> None:
    assert not [found for seed in range(100, 105) for found in broken(seed)]


# Bounds and motions of jobs: how far apart they are at most [-]. On the zig-zag of the mill lines are short: samples leave
# a tenth of their time out.
@pytest.mark.parametrize(
    ("make", "machine", "apart"),
    [
        (problems.chord_circle, problems.machine(), 0.010),
        (problems.zigzag, problems.machine(), 0.006),
        (problems.pentagon, problems.machine(), 0.004),
        (problems.pentagon, MILL, 0.006),
        (problems.zigzag, MILL, 0.06),
    ],
)
def test_motions_are_near_to_it(make, machine: Machine, apart: float) -> None:
    plan = planner.plan(make(), machine)
    assert plan.least_time < plan.cycle_time < (1.0 + apart) * plan.least_time


@pytest.mark.shows("bound", "exact: where the optimum is known")
@pytest.mark.parametrize("to", ["X0.01", "X3", "X200", "X50 F300"])
def test_a_straight_line_takes_just_that(to: str) -> None:
    plan = planner.plan(planner.read_program(text=f"G21 F6000\nG1 {to}\nM2\n"), MILL, method="stop")
    assert plan.least_time == pytest.approx(plan.cycle_time, abs=1.01 * MILL.dt, rel=1e-5)
    assert plan.least_time <= plan.cycle_time


STEPS = 60  # of constant jerk


def furthest(
    time: float, begin: tuple[float, bool], end: tuple[float, bool], most: tuple[float, float, float]
) -> float:
    """By linear programming, the longest way in a time from one end to the other, of motions with so many steps of constant
    jerk: the state at the nodes is x, v, a, in units of a step."""
    steps, h = STEPS, time / STEPS
    speed, push, jerk = most[0] * h, most[1] * h**2, most[2] * h**3
    size = 4 * steps + 3  # x, v, a of the nodes, then the jerks
    equal = lil_matrix((3 * steps, size))
    for k in range(steps):
        now, then, j = 3 * k, 3 * k + 3, 3 * steps + 3 + k
        for order in range(3):
            row = 3 * k + order
            equal[row, then + order] = -1.0
            for m in range(order, 3):
                equal[row, now + m] = 1.0 / (1, 1, 2)[m - order]
            equal[row, j] = 1.0 / (1, 1, 2, 6)[3 - order]
    bounds = [(0, None), (-speed, speed), (-push, push)] * (steps + 1) + [(-jerk, jerk)] * steps
    for node, (at, rests) in ((0, begin), (steps, end)):
        bounds[3 * node + 1] = (0.0, 0.0) if rests else (-speed, at * h)
        bounds[3 * node + 2] = (0.0, 0.0) if rests else (-push, push)
    bounds[0] = (0.0, 0.0)
    cost = np.zeros(size)
    cost[3 * steps] = -1.0
    found = linprog(cost, A_eq=equal.tocsr(), b_eq=np.zeros(3 * steps), bounds=bounds)
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize("begin", [(0.0, True), (0.0, False), (20.0, False), (90.0, False)])
@pytest.mark.parametrize("end", [(0.0, True), (20.0, False), (100.0, False)])
def test_a_straight_way_is_as_linear_programming_finds_it(begin, end) -> None:
    limits = (100.0, 2000.0, 5e4)
    for time in (0.03, 0.09, 0.2):
        way = furthest(time, begin, end, limits)
        ends = (End(np.array([speed]), np.array([rests])) for speed, rests in (begin, end))
        least = straight_time(np.array([way]), *ends, Bounds(*(np.array([limit]) for limit in limits)))[0]
        between = limits[2] * (time / STEPS) ** 2 / 8.0  # by which the speed is exceeded between nodes
        assert least <= time * (1.0 + between / limits[0])
        # too short to get from one end's speed to the other's: less is known
        assert least >= time * (0.995 if time > 0.1 or begin == end else 0.3)


def test_a_coordinate_that_isconfined_may_be_so_fast() -> None:
    # Chebyshev's polynomial of third order has the largest velocity at its end
    eps, jerk = 0.02, 5e4
    lasting = 2.0 * np.cbrt(24.0 * eps / jerk)
    program = planner.read_program(text="G21 G64 P0.02 F6000\nG1 X20\nG1 Y20\nM2\n")
    axis = Axis(velocity=1e4, acceleration=1e7, jerk=jerk)
    machine = Machine(name="soft", dt=1e-3, tolerance=eps, axes=dict.fromkeys("xyz", axis))
    way = way_of(toolpath_from_program(program, machine), machine, ())
    fast = confined(way, np.array([[0.0, 3.0, 0.0]]), np.array([eps]), np.array([lasting * 1.001]))[0]
    t = np.linspace(-1.0, 1.0, 2001)
    place = eps * np.polynomial.chebyshev.chebval(t, [0, 0, 0, 1])
    slope = np.polynomial.chebyshev.Chebyshev([0, 0, 0, 1]).deriv()(1.0) * eps * 2.0 / lasting
    assert np.abs(place).max() <= eps * (1 + 1e-12)
    assert fast == pytest.approx(slope, rel=1e-9)
    assert (
        confined(way, np.array([[0.0, 3.0, 0.0]]), np.array([eps]), np.array([lasting * 0.5]))[0]
        > 10.0 * fast
    )


def test_where_the_way_turns_right_back_the_larger_tolerance_says_how_fast() -> None:
    """What is within w of a point and brakes at a has at most v^2 = 2 a 2 w there."""
    tolerance, push = np.array([0.01, 0.01, 0.09]), 2000.0
    way = Way(
        point=np.array([[0.0, 0.0], [20.0, 0.0], [0.0, 0.0]]), tolerance=tolerance, stop=np.array([True, False, True]),
        vertex=np.ones(3, dtype=bool), tangent=np.array([[1.0, 0.0], [-1.0, 0.0]]), length=np.full(2, 20.0), feed=np.full(2, 500.0),
        line=np.ones(2, dtype=bool), limit=np.repeat([[500.0], [push], [1e9]], 2, axis=1),
    )  # fmt: skip
    legs = legs_between(way, way.along(way.tangent, way.feed)[0], way.length, np.ones(2, dtype=bool))
    fastest = np.sqrt(4.0 * push * tolerance.max())
    assert (legs.end.speed[0], legs.begin.speed[1]) == (pytest.approx(fastest), pytest.approx(fastest))


def test_a_coordinate_is_as_fast_as_any_velocity_makes_it() -> None:
    axes = {
        letter: Axis(velocity=v, acceleration=1e3, jerk=1e5)
        for letter, v in (("x", 20.0), ("y", 150.0), ("z", 60.0))
    }
    machine, rng = Machine(name="uneven", dt=1e-3, tolerance=0.02, axes=axes), np.random.default_rng(5)
    way = way_of(toolpath_from_program(problems.pentagon(), machine), machine, ())
    direction = rng.normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    bounds, y = way.along(direction, np.full(200, 90.0))
    velocity = rng.uniform(-1.0, 1.0, (20_000, 3)) * (20.0, 150.0, 60.0)
    velocity *= np.minimum(90.0 / np.linalg.norm(velocity, axis=1), 1.0)[:, None]
    assert (velocity @ direction.T <= bounds.speed * (1.0 + 1e-12)).all()
    assert (velocity @ y.T <= 1.0 + 1e-12).all()


def planned(seed: int) -> tuple[Program, Machine]:
    program, machine = random_lines.job(seed)
    return program, machine


@pytest.mark.parametrize("seed", range(40, 52))
def test_the_same_job_written_otherwise_has_the_same_bound(seed: int) -> None:
    program, machine = planned(seed)
    first = bound(program, machine)
    assert bound(laws.mirrored(program), machine) == pytest.approx(first, rel=1e-6)
    assert bound(laws.scaled(program, 3.0), laws.scaled_machine(machine, 3.0)) == pytest.approx(
        first, rel=1e-6
    )
    other = laws.split(program, np.random.default_rng(seed))
    if other is not None:
        assert bound(other, machine) == pytest.approx(first, rel=1e-6)


@pytest.mark.parametrize("what", ["velocity", "acceleration", "jerk", "tolerance", "feed"])
@pytest.mark.parametrize("seed", [40, 41, 42])
def test_more_of_a_limit_never_raises_it(seed: int, what: str) -> None:
    program, machine = planned(seed)
    more = laws.looser(program, machine, None, what, 1.3)
    # the times of samples depend on limits, so that the bound of looser ones may lose less
    assert bound(more.program, more.machine) <= bound(program, machine) * (1.0 + 1e-3)


def test_without_jerk_limits_it_is_lower() -> None:
    program, machine = planned(3)
    assert bound(program, machine, ("jerk",)) < 0.999 * bound(program, machine)


@pytest.mark.parametrize("seed", range(5))
def test_extremes_stand_out(seed: int) -> None:
    place = np.cumsum(np.random.default_rng(seed).normal(size=300))
    at = extremes(place, 2.0)
    change = np.diff(place[at])
    assert (at[0], at[-1]) == (0, 299)
    assert (np.abs(change[1:-1]) > 2.0).all()
    assert (change[1:-2] * change[2:-1] < 0).all()
    for begin, end in itertools.pairwise(at[1:-1]):  # nothing between them is beyond them
        inside = place[begin : end + 1]
        assert {float(inside.min()), float(inside.max())} == {float(place[begin]), float(place[end])}


@pytest.mark.parametrize("seed", range(3))
def test_parts_that_turn_back_end_where_extremes_stand_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, within = np.cumsum(rng.normal(size=(2, 200)), axis=1), rng.uniform(0.5, 1.0, 200)
    feed, width = rng.uniform(1.0, 9.0, 199), 2.0 * within.max()
    rows, least, most = spans(place, within, feed)
    for d, along in enumerate(place):
        at, mine = extremes(along, width), rows[:, 0] == d
        ends = list(zip(*rows[mine, 1:].T.tolist(), strict=True))
        assert len(ends) == len(at) > 2
        assert (ends[0][1], ends[-1][1]) == (0, 0)
        for n in range(1, len(at) - 1):
            apart = np.flatnonzero(np.abs(along - along[at[n]]) > width)
            before, behind = apart[(apart >= at[n - 1]) & (apart < at[n])], apart[apart > at[n]]
            assert ends[n] == (before.max() if len(before) else at[n - 1], len(before) > 0, behind.min())
        for n, (one, other) in enumerate(itertools.pairwise(ends)):
            begin, end = at[n : n + 2]
            apart = abs(along[end] - along[begin]) - within[begin] - within[end]
            assert least[mine][n] == pytest.approx(max(apart, 0.0))
            assert most[mine][n] == feed[one[0] if one[1] else 0 : other[2]].max()


def test_where_it_is_not_known() -> None:
    program = problems.pentagon()
    behind = MILL.model_copy(update={"fir": Fir(time_constants=(0.002,))})
    assert least_time(toolpath_from_program(program, behind), behind) is None
    plan = planner.plan(program, behind, method="kinematic")
    assert plan.least_time is None
    assert dataclasses.replace(plan, verdict=None).least_time is None


def test_it_is_said() -> None:
    plan: Plan = planner.plan(problems.pentagon(), MILL, method="kinematic")
    from planner.report.rows import WEAK, plan_rows
    from planner.report.summary import summary

    above = 100.0 * (plan.cycle_time / plan.least_time - 1.0)
    assert (
        dict(plan_rows(plan))["fastest possible"]
        == f"{plan.least_time:.4f} s or more, certified; this motion is {above:.2g} % above that{WEAK}"
    )
    assert summary(plan)["least_time_s"] == plan.least_time
    assert WEAK not in dict(plan_rows(planner.plan(problems.pentagon(), MILL)))["fastest possible"]
