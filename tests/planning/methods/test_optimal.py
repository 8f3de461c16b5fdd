"""Method `optimal` end to end: every job verified with its jerk limited, and placed between the bound and the full stops."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from quick import slow_but
from whole_plans import apexes

import planner
from benchmarks.jobs import problems
from planner.base.names import NORMAL, QUICK
from planner.corners.smooth import CLOSE
from planner.feedrate.constraints.assemble import CURVATURE_MARGIN
from planner.geometry.build import toolpath_from_program
from planner.joint.own import WINDOW
from planner.machine import Fir
from planner.nc.reader import parse_program
from planner.planning.job.job import Job
from planner.planning.job.trace import Stages, Trace
from planner.planning.methods.optimal import SIGMA2, OptimalMethod
from planner.planning.optimal.effort import EFFORTS, Search

JOBS = problems.all_jobs()
MACHINE = problems.machine()
# Cycle time on single corners, over the bound without jerk limits [-]: where corners follow closely, jerk is what holds them.
OVER_BOUND = {
    "pentagon": 1.016, "zigzag": 1.049, "circle": 2.65, "spiral": 2.06, "five points": 1.22, "arcs": 1.010,
}  # fmt: skip


@pytest.mark.shows(
    "optimal", "sampled: between the bound and a stop at every block, verified, on the shared jobs"
)
@pytest.mark.parametrize("corner", ["bezier", "fir"])
@pytest.mark.parametrize("name", slow_but(("pentagon", "five points"), JOBS))
def test_jobs_are_verified_with_their_jerk_limited(name, corner):
    plan = OptimalMethod(corner=corner).plan(JOBS[name], MACHINE)
    assert plan.verdict.passed, plan.verdict.faults
    assert all(check.limited for check in plan.verdict.limits.values())
    bound = planner.plan(JOBS[name], MACHINE, method="second-order", corner=corner)
    over = plan.trajectory.cycle_time / bound.trajectory.cycle_time
    assert 1 - 2e-3 <= over <= OVER_BOUND[name] * (1 + 5e-3)
    assert plan.trajectory.cycle_time <= plan.stop_time
    assert plan.corners.held == len(plan.corners) > 0


@pytest.mark.slow
@pytest.mark.parametrize(("corner", "expected"), [("bezier", 0.989), ("spline", 0.9714)])
def test_the_pentagon_is_faster_than_stopping_at_its_corners(corner, expected):
    plan = OptimalMethod(corner=corner).plan(problems.pentagon(), MACHINE)
    assert plan.trajectory.cycle_time == pytest.approx(expected, rel=2e-3)
    assert plan.stop_time == pytest.approx(1.0651, rel=1e-4)


TURNS = np.deg2rad([30.0, -60.0, 90.0, -120.0])
ISOLATED = 20.0  # legs [mm]: far more than what a corner takes of them and needs to brake for


def at_apexes(plan):
    """The corners of a plan on its way at their apexes, and the names of the limits that are active beside each of these."""
    found = apexes(plan.making.motion.samples, plan.grid.feed)
    beside = plan.grid.reached[found.index - 1] | plan.grid.reached[found.index]
    return found, [[plan.grid.active_names[k] for k in np.flatnonzero(row)] for row in beside]


def isolated_corners(jerk, dt, tolerance, normal):
    """A plan through corners with nothing but their own speed to hold them: legs long, feed and velocities high. Planned once, with all
    of the tolerance, whatever chords between samples may take of it where the period is long (delivery/periods.py)."""
    direction = np.concatenate([[0.0], np.cumsum(TURNS)])
    steps = ISOLATED * np.stack([np.cos(direction), np.sin(direction)], axis=1)
    program = problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), feed=1e4)
    machine = problems.machine(
        velocity=1e3, jerk=jerk, dt=dt, tolerance=tolerance, normal_acceleration=normal
    )
    toolpath = toolpath_from_program(program, machine)
    return OptimalMethod(corner="bezier").plan_job(
        Job(program=program, machine=machine, toolpath=toolpath, stages=Stages(None))
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dt", "tolerance", "normal", "holds"),
    [(0.001, 0.05, 300.0, "normal_acceleration"), (0.008, 0.01, None, "chord_error")],
    ids=["A below eps/2c", "eps/2c below A"],
)
def test_isolated_corners_are_passed_at_the_closed_form_s_speed(dt, tolerance, normal, holds):
    """Paper 002, (17), (19), (20), written out here: c = dt^2/8, X = min(A, eps/2c), eps_ap = eps - c X, v = sqrt(X/kappa). With loose
    jerk the apex speed is v, less the grid's margin; with tight jerk it stays below, and jerk is what holds it."""
    rate = dt**2 / 8.0
    share = min(normal or np.inf, tolerance / (2.0 * rate))
    theta = np.abs(TURNS)
    smaller = 2.5 * CLOSE  # corners use a little less than (20) lets them, so that they can close legs

    corners, limited_by = at_apexes(isolated_corners(1e7, dt, tolerance, normal))
    np.testing.assert_allclose(corners.tol_ap, tolerance - rate * share, rtol=smaller)
    kappa = SIGMA2 * 8.0 * np.sin(theta / 2) / (3.0 * corners.d_in * np.cos(theta / 2) ** 2)
    speed = np.sqrt(share / kappa)
    np.testing.assert_allclose(corners.closed_form, speed, rtol=smaller)
    np.testing.assert_allclose(corners.planned, speed * np.sqrt(1.0 - CURVATURE_MARGIN), rtol=smaller)
    assert all(holds in names for names in limited_by)

    tight, limited_by = at_apexes(isolated_corners(500.0, dt, tolerance, normal))
    np.testing.assert_allclose(tight.closed_form, speed, rtol=smaller)
    assert (tight.planned < 0.97 * speed).all()
    assert all(any(name.startswith("jerk.") for name in names) for names in limited_by)


@pytest.mark.usual_sizes
def test_a_search_of_several_windows_held_by_the_feed_ends_at_the_first_attempt():
    """Windows join where the first motion, kept on a coarse grid only, is a little faster than the feed."""
    turned = np.arange(800) * 0.7 / 20.0
    points = np.column_stack([20.0 * np.cos(turned), 20.0 * np.sin(turned), -0.001 * np.arange(800)]).round(3)
    moves = "".join("G1 X{:.3f} Y{:.3f} Z{:.3f}\n".format(*point) for point in points)
    trace = Trace()
    plan = planner.plan(
        planner.read_program(text=f"G21 G90 G94 F1500\n{moves}M2\n"), "router", effort="quick", log=trace
    )
    searches = [step for step in trace.steps if step.name == "search"]
    assert plan.verdict.passed
    assert [step.kept for step in searches] == [True]
    assert searches[0].facts["steps"] > WINDOW


def test_a_dwell_at_the_end_is_stood_through():
    corner = "G21 G90 F6000\nG1 X4\nY4\n"
    with_dwell, without = (
        planner.plan(planner.read_program(text=corner + end), MACHINE) for end in ("G4 P0.25\n", "")
    )
    for made in (with_dwell, without):
        assert made.verdict.passed, made.verdict.faults
        assert "together" in made.sentence  # what the search found, not what it began with
    assert with_dwell.cycle_time == pytest.approx(without.cycle_time + 0.25, abs=MACHINE.dt)
    still = with_dwell.trajectory.t > without.cycle_time
    np.testing.assert_allclose(
        with_dwell.trajectory.position[still], [[4.0, 4.0, 0.0]] * still.sum(), atol=1e-9
    )


@pytest.mark.usual_sizes
def test_large_motions_are_searched_in_long_steps_also_where_these_are_finer_than_what_is_delivered(
    monkeypatch,
):
    """A zig-zag counts as large. Chords of some um take 1.3 % less time for it (the carving of benchmarks/cost/long_jobs.py)."""
    job = problems.zigzag(4)
    fine = planner.plan(job, MACHINE)
    monkeypatch.setitem(
        EFFORTS, NORMAL, dataclasses.replace(EFFORTS[NORMAL], search=Search(steps_max=1e6, small=4))
    )
    long, quick = (planner.plan(job, MACHINE, effort=effort) for effort in (NORMAL, QUICK))
    assert "together" in long.sentence
    assert fine.cycle_time < long.cycle_time < quick.cycle_time
    assert long.grid_points < 1.5 * quick.grid_points < fine.grid_points
    coarse = planner.plan(job, MACHINE.model_copy(update={"dt": 0.008}))
    assert coarse.cycle_time < 0.008 * coarse.grid_points
    assert "together" in coarse.sentence


def test_behind_filters_the_order_of_the_path_tells_a_corner_from_the_end_of_a_circle():
    """Found by the campaign of random jobs: behind filters a corner beside a circle smaller than the widened tolerance was taken for
    the place where the circle ends, and the motion failed its verdict."""
    machine = problems.machine(
        velocity=4000.0,
        acceleration=1e5,
        jerk=3e7,
        tolerance=0.01,
        dt=0.002,
        fir=Fir(time_constants=(0.0018818757349053188, 0.015573425350580655)),
    )
    text = (
        "G21 G17 G90 G94 F179205\nG0 X-3.61 Y1.1 Z0\nG1 X-3.8231 Y1.561\nG1 X-9.9989 Y14.9909\n"
        "G2 X-9.9989 Y14.9909 Z0 I-2.78034 J-0.14113 P2\nG1 X-14.131 Y26.472 Z-14.739 F11580524\nM2\n"
    )
    made = planner.plan(parse_program(text, machine), machine, tolerance=0.6648793288644925, effort="quick")
    assert made.verdict.passed, made.verdict.faults
