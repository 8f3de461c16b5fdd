"""All solvers by one protocol: names, multipliers in the same units, motions that can be delivered, and what they refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from quick import slow_but
from random_problems import in_units
from whole_plans import smooth_path

from benchmarks.jobs import problems
from benchmarks.solvers.random_paths import random_path
from benchmarks.solvers.ratios import constraint_ratios
from benchmarks.solvers.sequential_convex import SequentialConvex
from planner import plan
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.names import METHODS
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.reference.nlp import JerkLimitedNLP
from planner.feedrate.sampling.samples import sample_path
from planner.feedrate.slopes import slopes_of
from planner.feedrate.solution import FeedrateSolution, Status
from planner.feedrate.solvers import (
    OWN,
    SECOND_ORDER,
    THIRD_ORDER,
    second_order_solver,
    third_order_solver,
)
from planner.planning.methods.optimal import OptimalMethod

FOREIGN = [name for name in THIRD_ORDER if name != OWN]
CORNER = "G21 G90 G64 P0.05 F6000\nG1 X6\nX8 Y5\nM2\n"


@pytest.fixture(scope="module")
def bend() -> FeedrateProblem:
    """Two legs and a rounded corner, faster than the axes allow on its own."""
    machine = problems.machine()
    path = smooth_path(problems.polyline([[0, 0], [12, 0], [14, 8]], feed=200.0), machine)
    return feedrate_problem(refine_for_jerk(sample_path(path, machine), machine), machine)


@pytest.fixture(scope="module")
def solved(bend: FeedrateProblem) -> dict[str, FeedrateSolution]:
    return {name: solver.solve(bend).require() for name, solver in THIRD_ORDER.items()}


def at_points(solution: FeedrateSolution) -> tuple[FloatArray, FloatArray]:
    """Multipliers of acceleration and jerk at the points (P, A): where r'' does not jump, which side has them is not determined."""
    rows = solution.multipliers.rows
    acceleration, jerk = rows[:, :, 0].copy(), rows[:, :, 1].copy()
    acceleration[1:] += rows[:-1, :, 3]
    jerk[1:] += rows[:-1, :, 2]
    return acceleration, jerk


def difference(one: FloatArray, other: FloatArray) -> float:
    return float(np.abs(one - other).sum() / np.abs(one).sum())


@pytest.mark.shows("solver-own", "compared: ipopt and fatrop, multipliers included")
@pytest.mark.parametrize("name", THIRD_ORDER)
def test_every_solver_keeps_the_limits_and_takes_about_the_same_time(name, bend, solved):
    assert constraint_ratios(bend, solved[name])[0].max() <= 1 + 1e-6
    assert solved[name].cycle_time == pytest.approx(solved[OWN].cycle_time, rel=2e-3)
    v, a, j, h = (getattr(solved[name], q) for q in ("feed_sq", "acc_s", "jerk_s", "duration"))
    v = np.sqrt(v)
    assert (v * h + a * h**2 / 2 + j * h**3 / 6)[:-1] == pytest.approx(np.diff(bend.s), rel=1e-6)


@pytest.mark.shows("solver-own", "compared: ipopt and fatrop, multipliers included")
@pytest.mark.parametrize("name", ["ipopt", "fatrop"])
def test_multipliers_of_casadi_are_those_of_the_own_kernel(name):
    """On a problem whose optima are the same: the rows of the feed between points, which differ, do not matter here."""
    problem = random_path(11, 200)
    own = JerkLimited(tol=1e-7).solve(problem).require()
    other = THIRD_ORDER[name].solve(problem).require()
    assert other.cycle_time == pytest.approx(own.cycle_time, rel=1e-6)
    for mine, theirs in zip(at_points(own), at_points(other), strict=True):
        assert difference(mine, theirs) < 1e-4
    assert difference(own.multipliers.dynamics, other.multipliers.dynamics) < 1e-4


@pytest.mark.usual_sizes  # windows of fewer points end elsewhere by up to 2e-4
@pytest.mark.parametrize(("name", "most"), [("ipopt", 0.02), ("fatrop", 0.02)])
def test_sums_and_slopes_are_near_where_formulations_differ(name, most, bend, solved):
    own, other = solved[OWN], solved[name]
    for mine, theirs in zip(at_points(own), at_points(other), strict=True):
        assert np.abs(theirs).sum() == pytest.approx(np.abs(mine).sum(), rel=most)
    mine, theirs = slopes_of(bend, own), slopes_of(bend, other)
    for quantity in ("acceleration", "jerk"):
        slope = getattr(mine, quantity)
        assert getattr(theirs, quantity) == pytest.approx(slope, rel=2 * most, abs=1e-6 * np.abs(slope).max())
    assert theirs.feed_sq_max.sum() == pytest.approx(mine.feed_sq_max.sum(), rel=2 * most)


@pytest.mark.parametrize("name", ["ipopt", "fatrop"])
def test_the_slope_of_the_jerk_is_what_more_of_it_saves(name, bend, solved):
    """dT/dln(jerk) by the envelope theorem, against the time of a problem with 1 % more jerk."""
    more = replace(bend, jerk=1.01 * bend.jerk)
    there = THIRD_ORDER[name].solve(more).require()
    foreseen = 0.01 * slopes_of(bend, solved[name]).jerk.sum()
    assert there.cycle_time - solved[name].cycle_time == pytest.approx(foreseen, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("name", THIRD_ORDER)
def test_solvers_do_not_depend_on_units(name, bend, solved):
    there = THIRD_ORDER[name].solve(in_units(bend, 1 / 25.4, 1.0)).require()
    assert there.cycle_time == pytest.approx(solved[name].cycle_time, rel=1e-5)


@pytest.mark.parametrize("name", THIRD_ORDER)
def test_progress_ends_at_the_whole(name):
    told: list[float] = []
    THIRD_ORDER[name].solve(random_path(3, 80), told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", slow_but("ipopt", FOREIGN))
def test_a_whole_job_with_every_solver(name, tmp_path):
    job = tmp_path / "corner.ngc"
    job.write_text(CORNER)
    own = plan(job, corner="bezier").require()
    made = plan(job, corner="bezier", solver=name).require()
    assert made.verdict.passed, made.verdict
    assert made.trajectory.cycle_time == pytest.approx(
        own.trajectory.cycle_time, rel=1e-2
    )  # exact kinematics cost something
    assert made.prices is not None
    assert "NLP" in made.solver or "Convex" in made.solver


@pytest.mark.parametrize(
    "solver", [JerkLimitedNLP(points_max=100), JerkLimitedNLP(solver="fatrop", points_max=100),
               SequentialConvex(points_max=100)],
)  # fmt: skip
def test_too_large_a_problem_is_refused_with_the_number(solver, bend):
    solution = solver.solve(bend)
    assert solution.status is Status.TOO_LARGE
    assert f"{len(bend)} grid points" in solution.sentence
    assert "at most" in solution.sentence
    assert "solver own" in solution.sentence
    assert np.isnan(solution.feed_sq).all()


def test_a_solver_of_ones_own_is_taken(tmp_path):
    job = tmp_path / "corner.ngc"
    job.write_text(CORNER)
    few = JerkLimitedNLP(max_iterations=2)
    made = plan(job, method=OptimalMethod(solver=few, corner="bezier"))
    assert made.status is Status.ITERATION_LIMIT
    assert "max_iterations" in made.sentence
    assert third_order_solver(few) is few


def test_names():
    assert tuple(THIRD_ORDER) == METHODS["optimal"].solvers
    assert tuple(SECOND_ORDER) == METHODS["second-order"].solvers
    assert third_order_solver("own") == JerkLimited()
    with pytest.raises(InputError, match=r"no solver 'snopt'.*own, ipopt, fatrop$"):
        third_order_solver("snopt")
    with pytest.raises(InputError, match=r"toppra: method optimal does not use it; there are own, ipopt"):
        third_order_solver("toppra")
    with pytest.raises(
        InputError, match=r"ipopt: method second-order does not use it; there are reachability"
    ):
        second_order_solver("ipopt")


@pytest.mark.parametrize(
    ("package", "settings"),
    [
        ("casadi", {"solver": "ipopt", "corner": "bezier"}),
        ("casadi", {"solver": "fatrop", "corner": "bezier"}),
        ("casadi", {"method": "tube", "solver": "ipopt"}),
        ("toppra", {"method": "toppra", "solver": "toppra", "corner": "bezier"}),
    ],
)
def test_a_missing_package_is_asked_for(package, settings, tmp_path, monkeypatch):
    job = tmp_path / "corner.ngc"
    job.write_text(CORNER)
    _hide(package, monkeypatch)
    with pytest.raises(InputError, match=rf"needs the package {package}.*: pip install {package}$"):
        plan(job, **settings)


def _hide(package, monkeypatch):
    import importlib

    real = importlib.import_module

    def missing(name, *rest):
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(f"No module named '{package}'", name=package)
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", missing)
