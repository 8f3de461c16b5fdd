"""The search inside the tolerance: where it begins, and that it ends at the closed form where there is one."""

from __future__ import annotations

import numpy as np
import pytest
from rest_motion import along_x
from whole_plans import dense_motion

import planner
from benchmarks.controls import planned_ngc
from benchmarks.jobs import problems, random_lines
from planner.feedrate.solution import Status
from planner.geometry.build import toolpath_from_program
from planner.joint import stages
from planner.joint.guess import guesses_from
from planner.joint.nlp import TubeNLP
from planner.joint.own import TubeOwn
from planner.joint.runs import tube_runs_of
from planner.motion.trajectory import joined
from planner.nc.reader import parse_program
from planner.planning.job.trace import Trace

LENGTH, JERK = 0.3, 2e5  # [mm], [mm/s3]: so short that neither 100 mm/s nor 2000 mm/s2 is reached
LEAST = 4.0 * np.cbrt(LENGTH / (2.0 * JERK))
MACHINE = problems.machine(jerk=JERK)


def line():
    (run,) = tube_runs_of(toolpath_from_program(problems.polyline([[0, 0], [LENGTH, 0]]), MACHINE), MACHINE)
    return run


def begun(slower: float):
    """The run of one line, and a guess from a motion that takes `slower` times the least time."""
    motion = along_x(LENGTH, JERK, slower=slower)
    seen = joined(list(dense_motion(motion, 1e-5)))
    return line(), guesses_from([line()], seen, [np.array([0.0, motion.end])])[0]


@pytest.mark.shows("tube", "exact: a line from rest to rest")
@pytest.mark.parametrize(
    "solver", [TubeOwn(), TubeNLP(), TubeNLP(solver="fatrop")], ids=["own", "ipopt", "fatrop"]
)
@pytest.mark.parametrize("slower", [1.1, 1.5])
def test_a_line_from_rest_to_rest_takes_its_closed_form(slower, solver):
    """T = 4 (L/2j)^(1/3), from motions that take a tenth and half as long again."""
    run, guess = begun(slower)
    solution = solver.solve(run, guess)
    assert solution.status in (Status.OPTIMAL, Status.ACCEPTABLE), solution.sentence
    steps = solution.steps
    assert steps.h.sum() == pytest.approx(LEAST, rel=3e-4)
    assert np.abs(steps.jerk).max() <= JERK * (1 + 1e-9)
    assert steps.h.sum() >= LEAST * (1 - 1e-9)


def test_ipopt_that_takes_too_long_says_so(monkeypatch):
    monkeypatch.setattr(stages, "SECONDS", 1e-3)
    solution = TubeNLP().solve(*begun(1.5))
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.steps is None
    assert "computing time" in solution.sentence


def test_a_guess_is_the_motion_that_it_was_cut_from():
    run, guess = begun(1.5)
    assert guess.h.sum() == pytest.approx(1.5 * LEAST, rel=1e-9)
    p, v, a = guess.state[:, 0], guess.state[:, 1], guess.state[:, 2]
    h = guess.h[:, None]
    np.testing.assert_allclose(p[0], [0.0], atol=1e-12)
    np.testing.assert_allclose(p[-1], [LENGTH], atol=1e-12)
    np.testing.assert_allclose(
        np.diff(v, axis=0), h * (a[:-1] + a[1:]) / 2, atol=5e-2 * v.max()
    )  # a step holds the peak
    assert (np.diff(guess.place.ravel()) >= 0).all()
    at_places = run.points(np.repeat(guess.leg, 4), guess.place.ravel())
    assert np.abs(at_places[::4, 0] - p[:-1, 0]).max() <= run.budget[0]


def test_a_slower_guess_goes_the_same_way():
    _, guess = begun(1.0)
    slow = guess.slower(2.0)
    np.testing.assert_allclose(slow.h, 2.0 * guess.h)
    for power in range(3):
        np.testing.assert_allclose(slow.state[:, power], guess.state[:, power] / 2.0**power)
    np.testing.assert_array_equal(slow.place, guess.place)


@pytest.mark.slow
@pytest.mark.usual_sizes
def test_windows_of_blocks_far_shorter_than_the_tolerance_end() -> None:
    """4,000 blocks of 1 um in 50 um: a last node held no more firmly than rows that are as stiff keeps a gap of 1e-6 to the last
    iteration."""
    told = Trace()
    machine = problems.machine(tolerance=0.05)
    program = parse_program(planned_ngc.micro_blocks(planned_ngc.loops, 1e-3, 4_000), machine)
    plan = planner.plan(program, machine, effort="quick", log=told)
    assert plan.verdict is not None
    assert plan.verdict.passed
    assert [step.kept for step in told.steps if step.name == "search"] == [True]
    assert plan.cycle_time < 0.1718


def test_windows_whose_nodes_slide_along_a_phase_end() -> None:
    """A random job that turns back at full acceleration within the tolerance: nodes slide along that for nothing, and a step that
    goes as far as its slacks let it leaves the kinematics by half a mean step."""
    told = Trace()
    plan = planner.plan(*random_lines.job(96), log=told)
    assert [step.kept for step in told.steps if step.name == "search"] == [True]
    assert plan.cycle_time < 3.7454
