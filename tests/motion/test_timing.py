"""From a profile to samples: analytic trapezoids, the last period, dwells, and derivatives that belong together."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import needs_ruckig
from whole_plans import CORNERS, Solved, dense_motion, smooth_path, solve

from benchmarks.jobs import problems
from planner.base.errors import NotSolvedError
from planner.base.point_to_point import PHASES, rest_to_rest_phases, rest_to_rest_times
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import add_switching_points
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.motion.timing import Motion, law_of_moves, law_of_solution, sample_motion
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.job.job import Job
from planner.planning.job.trace import Stages
from planner.planning.methods.optimal import OptimalMethod

MACHINE = problems.machine()
JOBS = problems.all_jobs()


@cache
def solved_job(job: str, kind: str = "bezier") -> Solved:
    return solve(JOBS[job], MACHINE, kind)


def test_an_interval_from_stop_to_stop_is_refused_with_its_line() -> None:
    """No grid point of it moves: its duration is infinite, and splitting it is the remedy."""
    toolpath = toolpath_from_program(parse_program("F6000\nG1 X10\nG4 P0.1\nX20\n", MACHINE), MACHINE)
    samples = sample_path(round_corners(toolpath, MACHINE, BezierCorner()), MACHINE)
    problem = feedrate_problem(samples, MACHINE)
    solution = Reachability().solve(problem)
    with pytest.raises(NotSolvedError, match="line 2: one interval"):
        law_of_solution(samples, solution)
    split = add_switching_points(samples, problem, solution, MACHINE)
    law = law_of_solution(split, Reachability().solve(feedrate_problem(split, MACHINE)))
    assert np.isfinite(law.end)


def sampled(solved: Solved, dt: float = 1e-3) -> Trajectory:
    return sample_motion(solved.motion, dt)


# --- one line against the closed form -------------------------------------------------------------------------------------


@given(length=st.floats(0.01, 500.0), feed=st.floats(5.0, 100.0))
@settings(max_examples=40)
def test_a_line_is_the_analytic_trapezoid(length, feed):
    solved = solve(problems.polyline([[0, 0], [length, 0]], feed=feed), MACHINE)
    a = 2000.0
    peak = min(feed, np.sqrt(a * length))
    ramp = peak / a
    T = ramp + length / peak
    assert solved.time == pytest.approx(T, rel=1e-9)
    got = sampled(solved, 1e-3 if T < 2 else T / 1000)
    t = got.t
    back = T - t
    s = np.where(
        t < ramp, a * t**2 / 2, np.where(back < ramp, length - a * back**2 / 2, peak * (t - ramp / 2))
    )
    v = np.minimum(np.minimum(a * t, peak), a * back)
    np.testing.assert_allclose(got.position[:, 0], s, atol=1e-9 * length)
    np.testing.assert_allclose(got.velocity[:, 0], v, atol=1e-7 * peak)
    np.testing.assert_allclose(got.s, s, atol=1e-9 * length)
    inside = (np.abs(t - ramp) > 1e-9) & (np.abs(back - ramp) > 1e-9) & (back > 1e-9)
    expected = np.where(t < ramp, a, np.where(back < ramp, -a, 0.0))
    np.testing.assert_allclose(got.acceleration[inside, 0], expected[inside], atol=1e-6 * a)


@pytest.mark.parametrize(
    ("end", "dt", "count"),
    [(0.01, 1e-3, 11), (0.0105, 1e-3, 12), (0.0100000000001, 1e-3, 11), (0.0005, 1e-3, 2)],
)
def test_the_last_partial_period_is_included(end, dt, count):
    """A trapezoid that lasts `end`: samples at k dt, then one at the end, and never two within rounding."""
    length = 2000.0 * (end / 2) ** 2
    got = sampled(solve(problems.polyline([[0, 0], [length, 0]]), MACHINE), dt)
    assert len(got) == count
    assert got.cycle_time == pytest.approx(end, rel=1e-9)
    np.testing.assert_allclose(np.diff(got.t)[:-1], dt, rtol=1e-6)
    assert np.diff(got.t)[-1] <= dt * (1 + 1e-5)


@pytest.mark.parametrize("job", list(JOBS))
@pytest.mark.parametrize("kind", CORNERS)
def test_it_starts_and_ends_at_rest_on_the_programmed_points(job, kind):
    solved = solved_job(job, kind)
    got = sampled(solved)
    assert got.t[0] == 0.0
    assert got.t[-1] == solved.time
    np.testing.assert_allclose(got.position[0], JOBS[job].start, atol=1e-12)
    np.testing.assert_allclose(got.position[-1], JOBS[job].end[-1], atol=1e-11)
    for edge in (0, -1):
        assert not got.velocity[edge].any()
        assert got.feed[edge] == 0.0
    assert (np.diff(got.s) >= 0).all()
    assert (np.diff(got.block) >= 0).all()
    assert got.block[-1] == len(JOBS[job]) - 1
    assert set(got.line) <= set(JOBS[job].line)


# --- derivatives belong together ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("job", ["pentagon", "arcs", "spiral", "five points"])
@pytest.mark.parametrize("kind", CORNERS)
def test_columns_are_derivatives_of_each_other(job, kind):
    """On samples dt apart: the position changes by the mean velocity to dt^2 jerk/12, the velocity by the mean acceleration
    where the acceleration does not step in between."""
    solved = solved_job(job, kind)
    got = sampled(solved, 5e-5)
    dt = np.diff(got.t)[:, None]
    by_position = np.diff(got.position, axis=0) / dt
    mean = 0.5 * (got.velocity[1:] + got.velocity[:-1])
    assert (
        np.abs(by_position - mean).max() <= 4000.0 * 5e-5 / 4 + 1e-6
    )  # an acceleration step of 2a inside the period
    by_velocity = np.diff(got.velocity, axis=0) / dt
    assert np.abs(by_velocity).max() <= 2000.0 * (1 + 1e-6)  # a mean of what is within the limit
    steady = np.abs(by_velocity - 0.5 * (got.acceleration[1:] + got.acceleration[:-1])).max(axis=1)
    assert np.median(steady) < 5.0


@pytest.mark.parametrize("job", ["pentagon", "spiral", "arcs"])
def test_the_speed_is_that_of_the_positions(job):
    """Chords over one period are never longer than the arc length that is claimed, and shorter by the sagitta only."""
    got = sampled(solved_job(job))
    chord, claimed = np.linalg.norm(np.diff(got.position, axis=0), axis=1), np.diff(got.s)
    assert (chord <= claimed + 1e-8).all()
    assert (np.linalg.norm(got.velocity, axis=1) == pytest.approx(got.feed, abs=1e-9)) is True


def test_dense_motion_is_the_same_motion():
    solved = solved_job("pentagon")
    fine = list(dense_motion(solved.motion, MACHINE.dt))
    t = np.concatenate([c.t for c in fine])
    assert t[0] == 0.0
    assert t[-1] == solved.time
    assert (np.diff(solved.law.t) >= 0).all()
    got = sampled(solved)
    for axis in range(3):
        position = np.concatenate([c.position for c in fine])[:, axis]
        gap = np.diff(t).max()
        near = np.interp(got.t, np.unique(t), position[np.unique(t, return_index=True)[1]])
        assert np.abs(near - got.position[:, axis]).max() <= 2000 * gap**2 / 8 + 1e-9


@pytest.mark.parametrize("job", ["pentagon", "arcs"])
def test_a_motion_at_one_time_is_what_it_is_among_others(job):
    """To the last bit, also on straight legs, whose derivatives are not computed again for each time."""
    motion = solved_job(job).motion
    times = np.sort(np.random.default_rng(5).uniform(0.0, motion.end, 300))
    together = motion.at(times, MACHINE.dt)
    for k in range(0, 300, 7):
        alone = motion.at(times[k : k + 1], MACHINE.dt)
        for name in ("position", "velocity", "acceleration", "jerk", "s", "feed"):
            np.testing.assert_array_equal(getattr(alone, name)[0], getattr(together, name)[k])


# --- dwells ---------------------------------------------------------------------------------------------------------------

DWELLS = "G21 G90 G94 F6000\nG4 P0.5\nG1 X10\nG4 P0.25\nG4 P0.125\nX20\nG4 P0.1\nM2\n"


def test_dwells_hold_the_position_at_start_middle_and_end():
    solved = solve(parse_program(DWELLS), MACHINE)
    move = 10 / 100 + 100 / 2000
    assert solved.time == pytest.approx(2 * move + 0.5 + 0.375 + 0.1, rel=1e-12)
    got = sampled(solved)
    for begin, end, x in (
        (0, 0.5, 0.0),
        (0.5 + move, 0.875 + move, 10.0),
        (0.875 + 2 * move, 0.975 + 2 * move, 20.0),
    ):
        still = (got.t > begin + 1e-9) & (got.t < end - 1e-9)
        assert still.sum() >= round((end - begin) / 1e-3) - 2
        assert (got.position[still] == [x, 0, 0]).all()
        assert not got.velocity[still].any()
        if begin > 0:
            assert not got.acceleration[still].any()


def test_a_dwell_at_the_start_has_no_acceleration():
    got = sampled(solve(parse_program(DWELLS), MACHINE))
    still = got.t < 0.499
    assert not got.acceleration[still].any()
    assert not got.jerk[still].any()


# --- from rest to rest ----------------------------------------------------------------------------------------------------

decades = st.floats(-2.0, 2.0).map(lambda e: 10.0**e)


def ruckigs(length: float, v: float, a: float, j: float) -> Any:
    """The same move by ruckig, in units in which length and jerk are 1: its own epsilons are absolute."""
    import ruckig

    unit = (length / j) ** (1 / 3)
    move, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    move.target_position, move.max_jerk = [1.0], [1.0]
    move.max_velocity, move.max_acceleration = [v * unit / length], [a * unit**2 / length]
    assert ruckig.Ruckig(1).calculate(move, found) == ruckig.Result.Working
    return found


@pytest.mark.shows("stop", "compared: ruckig's own motion from rest to rest")
@needs_ruckig
@given(length=st.floats(-4.0, 3.0).map(lambda e: 10.0**e), v=decades, a=decades, j=decades)
@settings(max_examples=60)
def test_closed_forms_are_ruckigs(length, v, a, j):
    v, a, j = 10 * v, 1e3 * a, 1e5 * j
    limits = tuple(np.array([x]) for x in (length, v, a, j))
    duration, jerk = rest_to_rest_phases(*limits)
    assert duration.shape == jerk.shape == (1, PHASES)
    assert rest_to_rest_times(*limits)[0] == pytest.approx(duration.sum(), rel=1e-9)
    expected, unit = ruckigs(length, v, a, j), (length / j) ** (1 / 3)
    np.testing.assert_allclose(duration.sum() / unit, expected.duration, rtol=1e-7)
    for share in (0.1, 0.3, 0.5, 0.8):
        t = np.clip(share * duration.sum() - np.append(0.0, np.cumsum(duration)[:-1]), 0.0, duration[0])
        state = np.zeros(3)
        for h, jj in zip(t, jerk[0], strict=True):
            x, speed, acceleration = state
            state = np.array(
                [
                    x + h * (speed + h * (acceleration / 2 + h * jj / 6)),
                    speed + h * (acceleration + h * jj / 2),
                    acceleration + h * jj,
                ]
            )
        theirs = expected.at_time(share * expected.duration)[0][0]
        assert state[0] / length == pytest.approx(theirs, abs=1e-6)


def test_known_times():
    one = [np.array([x]) for x in (1.0, 1e9, 1e9, 1.0)]
    assert rest_to_rest_times(*one)[0] == pytest.approx(4 * 0.5 ** (1 / 3), rel=1e-12)  # 3.174802
    trapezoid = [np.array([x]) for x in (1.0, 0.5, 2.0, 1e12)]
    assert rest_to_rest_times(*trapezoid)[0] == pytest.approx(2.25, rel=1e-9)
    pentagon = [np.full(5, x) for x in (15.782, 100.0, 2000.0, 2e5)]
    assert rest_to_rest_times(*pentagon).sum() == pytest.approx(
        1.089, abs=5e-4
    )  # along an axis; see methods/test_methods


@pytest.mark.shows("stop", "compared: ruckig's own motion from rest to rest")
@needs_ruckig
@pytest.mark.parametrize("length", [1e-3, 0.2, 5.0, 80.0])
def test_the_stop_law_is_ruckigs_own_motion(length):
    """Position, velocity and acceleration at every sample against ruckig's at_time."""
    import ruckig

    program = problems.polyline([[0, 0], [length, 0]])
    samples = sample_path(smooth_path(program, MACHINE), MACHINE)
    limits = [np.array([x]) for x in (length, 100.0, 2000.0, 2e5)]
    law = law_of_moves(samples, np.zeros(1), np.zeros(1), np.zeros(1), *rest_to_rest_phases(*limits))
    got = sample_motion(Motion(samples=samples, law=law), 1e-3)
    move, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    move.target_position = [length]
    move.max_velocity, move.max_acceleration, move.max_jerk = [100.0], [2000.0], [2e5]
    assert ruckig.Ruckig(1).calculate(move, answer) == ruckig.Result.Working
    assert law.end == pytest.approx(answer.duration, rel=1e-7)
    inner = slice(0, -1)
    theirs = np.array([answer.at_time(t) for t in got.t[inner]])[:, :, 0]
    np.testing.assert_allclose(got.position[inner, 0], theirs[:, 0], atol=1e-7 * length)
    np.testing.assert_allclose(got.velocity[inner, 0], theirs[:, 1], atol=1e-5)
    np.testing.assert_allclose(got.acceleration[inner, 0], theirs[:, 2], atol=1e-2)
    assert got.position[-1, 0] == length


def test_places_follow_one_another_at_a_crawl():
    """At 0.1 mm/s intervals are whole spans of a spline; on short and long blocks in turns their parameter is far from the arc length.
    Between any two times the motion covers what its feed says, and never more than the programmed feed allows."""
    turns = np.deg2rad(np.tile([4.0, -7.0, 5.0, -2.0], 6))
    steps = np.tile([0.3, 0.012, 0.2, 0.03], 6)[:, None] * np.stack(
        [np.cos(turns.cumsum()), np.sin(turns.cumsum())], axis=1
    )
    program = problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), feed=0.1)
    machine = problems.machine()
    job = Job(
        program=program,
        machine=machine,
        toolpath=toolpath_from_program(program, machine),
        stages=Stages(None),
    )
    made = OptimalMethod(corner="spline").plan_job(job)
    motion = made.making.motion
    times = np.sort(np.random.default_rng(3).uniform(0.0, motion.end, 20_000))
    seen = motion.at(times, machine.dt)
    moved = np.linalg.norm(np.diff(seen.position, axis=0), axis=1)
    assert (moved <= 0.1 * np.diff(times) * (1 + 1e-6) + 1e-12).all()
    assert made.verdict.passed
