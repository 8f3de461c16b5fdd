"""Method `tube`: verified motions that are never slower than their start, the laws of an optimum, refusals and failures."""

from __future__ import annotations

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from quick import slow_but

import planner
from benchmarks.jobs import problems
from planner.base.errors import InputError, NotSolvedError
from planner.feedrate.solution import Status
from planner.joint.nlp import LEGS_MAX, TubeNLP
from planner.machine import Fir
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod

MACHINE = problems.machine()
LEG = 4.0  # [mm]: room for a corner, and few steps
# Local optima found from slightly different numbers, or on slightly different steps, are this close [-]: joint/nlp.py settles at 1e-5
# per iteration, and steps twice as short gain 1e-5 to 5e-5.
SAME = 5e-4


def corner(degrees: float, leg: float = LEG, first: float = 0.0, scale: float = 1.0):
    at = np.deg2rad([first, first + degrees])
    steps = scale * leg * np.stack([np.cos(at), np.sin(at)], axis=1)
    return problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), feed=scale * problems.FEED)


JOBS = {f"corner of {degrees} degrees": corner(degrees) for degrees in (30, 90, 150)}
JOBS["pentagon"] = problems.pentagon()
JOBS["line and arcs"] = parse_program("G21 G17 G90 F6000\nG1 X4\nG3 X8 Y4 I0 J4\nG2 X12 Y8 Z1 I4 J0\nM2\n")


@cache
def tube(name: str) -> Plan:
    return TubeMethod().plan(JOBS[name], MACHINE)


def verified(program, machine=MACHINE) -> Plan:
    made = TubeMethod().plan(program, machine).require()
    assert made.verdict.passed, made.verdict.faults
    assert all(check.limited for check in made.verdict.limits.values())
    return made


@pytest.mark.parametrize("name", slow_but("corner of 90 degrees", JOBS))
def test_jobs_are_verified_and_faster_than_what_they_start_from(name):
    made = tube(name).require()
    assert made.verdict.passed, made.verdict.faults
    assert made.status in (Status.OPTIMAL, Status.ACCEPTABLE)
    start = TubeMethod().start.plan(JOBS[name], MACHINE).trajectory.cycle_time
    assert made.trajectory.cycle_time < start or (
        made.trajectory.cycle_time == start and "stays on" in made.sentence
    )
    assert float(re.search(r"before that \(.*\) ([0-9.]+) s", made.sentence)[1]) == pytest.approx(
        start, rel=1e-5
    )
    np.testing.assert_allclose(made.trajectory.position[-1], made.toolpath.end[-1], atol=1e-9)
    assert not made.trajectory.velocity[-1].any()
    assert (np.diff(made.trajectory.block) >= 0).all()
    assert set(made.trajectory.block) == set(made.toolpath.block)


@pytest.mark.slow
def test_the_pentagon_takes_what_free_motion_is_known_to_take():
    """DESIGN 8: 0.957 s by another transcription."""
    assert tube("pentagon").trajectory.cycle_time == pytest.approx(0.9577, rel=SAME)


def test_something_is_at_its_limit_all_the_time():
    """Along a time-optimal motion some axis is at a limit or the tolerance is used up; without the latter nearly always too."""
    motion = tube("corner of 90 degrees").trajectory
    ratio = np.max(
        [
            np.abs(motion.velocity).max(axis=1) / 100.0,
            np.abs(motion.acceleration).max(axis=1) / 2000.0,
            np.abs(motion.jerk).max(axis=1) / 2e5,
            motion.feed / problems.FEED,
        ],
        axis=0,
    )
    assert np.mean(ratio > 0.98) > 0.9


@pytest.mark.shows("tube", "sampled: scaled, turned and backward jobs take the same time")
@pytest.mark.slow
def test_scaled_lengths_and_limits_take_the_same_time():
    k = 7.0
    large = problems.machine(velocity=100 * k, acceleration=2000 * k, jerk=2e5 * k, tolerance=0.05 * k)
    made = verified(corner(90, scale=k), large)
    assert made.trajectory.cycle_time == pytest.approx(
        tube("corner of 90 degrees").trajectory.cycle_time, rel=SAME
    )


@pytest.mark.shows("tube", "sampled: scaled, turned and backward jobs take the same time")
@pytest.mark.slow
def test_turned_by_a_right_angle_takes_the_same_time():
    made = verified(corner(90, first=90.0))
    assert made.trajectory.cycle_time == pytest.approx(
        tube("corner of 90 degrees").trajectory.cycle_time, rel=SAME
    )


@pytest.mark.slow
def test_more_tolerance_takes_less_time():
    wide = verified(corner(90), problems.machine(tolerance=0.2)).trajectory.cycle_time
    fine = verified(corner(90), problems.machine(tolerance=0.01)).trajectory.cycle_time
    assert wide < tube("corner of 90 degrees").trajectory.cycle_time * (1 - 5e-3) < fine * (1 - 5e-3)


@pytest.mark.slow
def test_stops_and_dwells_add_up():
    """Exact stops make runs of their own; a dwell stands between two of them."""
    job = parse_program("G21 G90 F6000\nG1 X4\nY4\nG4 P0.25\nG1 X0\nY0\nM2\n")
    made = verified(job)
    half = verified(corner(90)).trajectory.cycle_time
    assert made.trajectory.cycle_time == pytest.approx(2 * half + 0.25, rel=SAME)
    still = ~made.trajectory.velocity.any(axis=1)
    assert still.sum() >= 249
    np.testing.assert_allclose(
        made.trajectory.position[still][1:-1], [[4.0, 4.0, 0.0]] * (still.sum() - 2), atol=1e-9
    )


@pytest.mark.slow
def test_normal_acceleration_is_kept_and_used():
    limit = 1000.0
    check = verified(corner(60), problems.machine(normal_acceleration=limit)).verdict.limits[
        "normal_acceleration"
    ]
    assert 0.9 * limit < check.value <= limit * (1 + 1e-6)


@pytest.mark.slow
def test_what_filters_make_of_the_motion_uses_the_tolerance_and_keeps_it():
    plain = tube("corner of 90 degrees").trajectory.cycle_time
    made = verified(corner(90), problems.machine(fir=Fir(time_constants=(0.02,))))
    assert made.trajectory.cycle_time > plain * (1 + 1e-3)
    assert made.verdict.contour_error_mm <= 0.05
    assert 0.99 * 0.05 < made.verdict.after_filters.vertex_error_mm <= 0.05


@pytest.mark.slow
def test_a_lower_feed_holds_on_its_block():
    job = problems.polyline([[0, 0], [4, 0], [8, 0], [8, 4]], feed=np.array([100.0, 20.0, 100.0]))
    made = verified(job)
    assert made.trajectory.feed[made.trajectory.block == 1].max() <= 20.0 * (1 + 1e-6)
    assert made.trajectory.feed.max() > 30.0


@pytest.mark.slow
def test_the_solvers_agree_where_the_feed_changes():
    """Each has the row of a vertex between two feeds: without it what ipopt finds breaks the lower one, and the start stays."""
    job = problems.polyline([[0, 0], [2, 0], [3, 0], [3, 2]], feed=np.array([100.0, 20.0, 100.0]))
    start = OptimalMethod(corner="bezier", effort="quick")
    made = [TubeMethod(start=start, solver=name).plan(job, MACHINE) for name in ("own", "ipopt", "fatrop")]
    assert all(plan.verdict.passed for plan in made)
    assert all(plan.cycle_time < 0.99 * start.plan(job, MACHINE).cycle_time for plan in made)
    assert [plan.cycle_time for plan in made[1:]] == pytest.approx([made[0].cycle_time] * 2, rel=SAME)


# --- refusals and failures ---------------------------------------------------------------------------------------------------


SHORT = OptimalMethod(corner="bezier")


class NeverAsked(OptimalMethod):
    def plan_job(self, *given, **named):
        raise AssertionError("work was done before the refusal")


def test_a_job_that_is_too_long_is_refused_before_any_work():
    job = problems.star_spiral(LEGS_MAX // 4)
    points = np.vstack([[0.0, 0.0], *(np.asarray(job.end)[:, :2] for _ in range(5))])
    with pytest.raises(InputError, match=f"at most {LEGS_MAX}.*with the solver own"):
        TubeMethod(start=NeverAsked(), solver="ipopt").plan(problems.polyline(points), MACHINE)
    turns = parse_program(f"G21 G17 G90 F6000\nG2 X0 Y0 I50 P{LEGS_MAX}\nM2\n")
    with pytest.raises(InputError, match="steps on arcs"):
        TubeMethod(start=NeverAsked(), solver="ipopt").plan(turns, MACHINE)


HASTY = TubeNLP(max_iterations=2)


@pytest.mark.slow
def test_where_nothing_converges_the_start_stays_and_says_why():
    job = parse_program("G21 G90 F6000\nG1 X4\nY4\nM2\n")
    made = TubeMethod(start=SHORT, solver=HASTY).plan(job, MACHINE)
    assert made.verdict.passed
    assert made.status is Status.ACCEPTABLE
    assert made.trajectory.cycle_time == SHORT.plan(job, MACHINE).trajectory.cycle_time
    assert (
        "stays on 1 of 1 runs between full stops, the first on lines 2 to 3: not converged" in made.sentence
    )


class SecondFails(TubeNLP):
    """Finds nothing on runs of one leg."""

    def solve(self, run, guess):
        return TubeNLP(max_iterations=2 if len(run) == 1 else 300).solve(run, guess)


@pytest.mark.slow
def test_what_is_found_between_two_stops_is_kept_where_the_other_half_fails():
    job = parse_program("G21 G90 F6000\nG1 X4\nY4\nG4 P0.25\nG1 X0\nG4 P0.1\nM2\n")
    made = TubeMethod(start=SHORT, solver=SecondFails()).plan(job, MACHINE).require()
    assert made.verdict.passed, made.verdict.faults
    first = TubeMethod(start=SHORT, solver="ipopt").plan(
        parse_program("G21 G90 F6000\nG1 X4\nY4\nM2\n"), MACHINE
    )
    rest = SHORT.plan(parse_program("G21 G90 F6000\nG1 X4\nM2\n"), MACHINE)
    both = first.trajectory.cycle_time + rest.trajectory.cycle_time + 0.35
    assert made.trajectory.cycle_time == pytest.approx(both, rel=1e-6)
    assert "stays on 1 of 2 runs between full stops, the first on lines 5 to 5" in made.sentence


def test_a_start_without_a_motion_is_a_status():
    class Fails(OptimalMethod):
        def plan_job(self, job):
            return job.plan(
                None, method="optimal", corner=None, solver="none", status=Status.NUMERICAL_ERROR,
                sentence="broke down", grid_points=0,
            )  # fmt: skip

    made = TubeMethod(start=Fails()).plan(corner(90), MACHINE)
    assert made.status is Status.NUMERICAL_ERROR
    with pytest.raises(NotSolvedError, match="no motion to start from: broke down"):
        made.require()


@pytest.mark.slow
def test_it_has_a_name():
    made = planner.plan(dataclasses.replace(corner(90)), MACHINE, method="tube")
    assert made.method == "tube"
    assert made.trajectory.cycle_time == pytest.approx(
        tube("corner of 90 degrees").trajectory.cycle_time, rel=1e-9
    )
