"""The search along many short runs, side by side: the same motion on any number of threads."""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Iterator

import numpy as np
import pytest

import planner
from benchmarks.jobs import random_lines
from planner.base.threads import use_threads
from planner.delivery import mending
from planner.feedrate.solution import Status
from planner.joint.groups import QUIET
from planner.joint.parts import FoundRun
from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.planning import attempts, joint_search
from planner.planning.job.choice import beside
from planner.planning.job.trace import Stages, Trace
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.stop import StopMethod
from planner.planning.page import job_of

RUNS = 60
STROKE = "G1 X{0} Y{1}\nG1 X{2} Y{1}\nG1 X{2} Y{0}\nG1 X{0} Y{3}\nG1 X{3} Y{2}\nG1 X{1} Y{0}\nG4 P0.01\n"


@pytest.fixture
def threads() -> Iterator[None]:
    yield
    use_threads(None)


@pytest.mark.usefixtures("threads")
@pytest.mark.usual_sizes
def test_many_short_runs_have_the_same_motion_on_any_number_of_threads() -> None:
    program = "G21 G90 G64 P0.05 F6000\n" + "".join(
        STROKE.format(*np.round(np.array([0.0, 3.0, 7.0, 11.0]) + 0.1 * k, 3)) for k in range(RUNS)
    )
    machine = planner.load_machine("mill")
    found = []
    for count in (1, 3):
        use_threads(count)
        told = Trace()
        found.append(
            planner.plan(
                planner.read_program(text=program, machine=machine), machine, effort="quick", log=told
            )
        )
        searched = [step for step in told.steps if step.name == "search"]
        assert searched[-1].facts["steps"] > QUIET
        assert found[-1].verdict is not None
        assert found[-1].verdict.passed
    first, other = (plan.require().trajectory for plan in found)
    assert first is not None
    assert other is not None
    np.testing.assert_array_equal(first.position, other.position)


def short_job() -> str:
    """Twelve runs between full stops."""
    return "G21 G90 G64 P0.05 F6000\n" + "".join(
        STROKE.format(*np.round(np.array([0.0, 3.0, 7.0, 11.0]) + 0.1 * k, 3)) for k in range(12)
    )


def searched(told: Trace) -> dict[str, object]:
    """The last step of the search."""
    return [step for step in told.steps if step.name == "search"][-1].facts


def planned(effort: str = "quick") -> tuple[planner.Plan, Trace]:
    machine, told = planner.load_machine("mill"), Trace()
    program = planner.read_program(text=short_job(), machine=machine)
    return planner.plan(program, machine, effort=effort, log=told), told


@pytest.mark.parametrize("effort", ["quick", "normal"])
def test_a_run_that_the_search_does_not_find_is_planned_alone_and_the_others_are_kept(monkeypatch, effort):
    whole, told = planned(effort)
    assert searched(told)["alone"] == 0
    own = joint_search.search_run

    def one_fails(k, run, *more):
        found = yield from own(k, run, *more)
        return FoundRun(run, Status.ACCEPTABLE, "made up") if k == 5 else found

    monkeypatch.setattr(joint_search, "search_run", one_fails)
    made, told = planned(effort)
    assert searched(told)["alone"] == 1
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults
    assert "stays on 1 of 12 runs between full stops" in made.sentence
    assert abs(made.cycle_time / whole.cycle_time - 1.0) < 0.05 / 12
    assert made.grid is not None
    assert made.grid.t[-1] <= made.cycle_time
    assert 0.0 < max(made.grid.share) <= 1.0 + 1e-9


def test_a_run_that_breaks_its_verdict_is_planned_alone(monkeypatch):
    """Slower in places would mend it; without that the run is not taken, and the others are."""
    monkeypatch.setattr(mending, "ROUNDS", 0)
    own = joint_search.search_run

    def one_is_fast(k, run, *more):
        found = yield from own(k, run, *more)
        if k != 7:
            return found
        steps = found.steps
        f = 0.98
        rates = {
            name: getattr(steps, name) / f**power
            for power, name in enumerate(("velocity", "acceleration", "jerk"), start=1)
        }
        return dataclasses.replace(found, steps=dataclasses.replace(steps, h=f * steps.h, **rates))

    whole, _ = planned()
    monkeypatch.setattr(joint_search, "search_run", one_is_fast)
    made, told = planned()
    assert searched(told)["alone"] == 1
    assert made.verdict.passed, made.verdict.faults
    assert made.cycle_time < whole.cycle_time * (1.0 + 0.1 / 12)  # of one run of twelve


def test_a_run_that_is_not_found_nor_planned_alone_is_that_of_the_motion_on_the_path(monkeypatch):
    monkeypatch.setattr(joint_search, "ALONE_MOST", 0)
    own = joint_search.search_run

    def one_fails(k, run, *more):
        found = yield from own(k, run, *more)
        return FoundRun(run, Status.ACCEPTABLE, "made up") if k == 5 else found

    whole, _ = planned()
    monkeypatch.setattr(joint_search, "search_run", one_fails)
    made, told = planned()
    assert searched(told)["alone"] == 0
    assert made.verdict.passed, made.verdict.faults
    assert "stays on 1 of 12 runs between full stops" in made.sentence
    assert "made up" in made.sentence
    assert abs(made.cycle_time / whole.cycle_time - 1.0) < 0.05 / 12
    assert made.grid is not None


ZIGZAG = "".join(f"G1 X{3 * k} Y{4 * (k % 2)}\n" for k in range(7)) + "G4 P0.1\n"
EXACT = "G61\nG1 X20 Y6\nX0 Y8\nG1 X0 Y0\nG64 P0.05\nG4 P0.1\n"
THREAD = "S600 M3\nG33 Z-20 K1\nG4 P0.1\nG0 X0 Y0 Z0\nG4 P0.1\n"


@pytest.mark.parametrize(("between", "why"), [(EXACT, "exact path"), (THREAD, "in step with the spindle")])
def test_exact_runs_and_threads_are_on_the_path_and_the_runs_around_them_are_searched(between, why):
    """No run but theirs loses its search: the job takes as long as its parts do, each as a job."""
    machine, begin = planner.load_machine("mill"), "G21 G90 G64 P0.05 F6000\n"

    def time_of(text: str) -> tuple[float, str]:
        plan = planner.plan(planner.read_program(text=begin + text + "M2\n", machine=machine), machine)
        assert plan.verdict is not None
        assert plan.verdict.passed, plan.verdict.faults
        return plan.cycle_time, plan.sentence

    whole, sentence = time_of(ZIGZAG + "G1 X0 Y0\nG4 P0.1\n" + between + ZIGZAG)
    assert why in sentence
    parts = (ZIGZAG + "G1 X0 Y0\nG4 P0.1\n", between, ZIGZAG)
    assert whole == pytest.approx(sum(time_of(part)[0] for part in parts), rel=2e-4)


def test_a_run_that_gets_no_spline_is_searched_like_the_others():
    """A knot of some tolerances, on which no spline fits, and a zig-zag before it: the search begins there from full stops."""
    knot = (
        "G1 X5 Y0\nX4.856 Y-0.133\nX4.990 Y-0.048\nX4.951 Y-0.141\nX5.061 Y-0.054\n"
        "X5.111 Y-0.045\nX5.119 Y0.098\nX5.126 Y-0.027\nX4.998 Y0.002\nX12 Y3\n"
    )
    machine, told = planner.load_machine("mill"), Trace()
    text = "G21 G90 G64 P0.05 F6000\n" + ZIGZAG + "G1 X0 Y0\nG4 P0.1\n" + knot + "M2\n"
    plan = planner.plan(planner.read_program(text=text, machine=machine), machine, effort="quick", log=told)
    assert plan.verdict is not None
    assert plan.verdict.passed, plan.verdict.faults
    assert plan.sentence.startswith("path and feed optimised together")
    assert "stays" not in plan.sentence
    assert searched(told)["alone"] == 0


@pytest.fixture
def hairpin() -> tuple[Program, Machine]:
    """Half a millimetre back in periods of 16 ms: chords miss the vertex by more than the tolerance, whatever the path."""
    axis = Axis(velocity=500.0, acceleration=3000.0, jerk=300000.0)
    machine = Machine(name="slow cycle", dt=0.016, tolerance=0.1, axes=dict.fromkeys("xy", axis))
    return parse_program("G1 X5 F6000\nX4.5 Y0.3\nM2\n", machine), machine


def test_a_search_whose_chords_leave_the_tolerance_is_searched_again_with_less(
    hairpin: tuple[Program, Machine],
) -> None:
    """The motion on the path has to be slower in places, and takes 5 % longer then."""
    told = Trace()
    found = planner.plan(*hairpin, effort="quick", log=told)
    assert found.verdict is not None
    assert found.verdict.passed
    first = next(step for step in told.steps if step.name == "search")
    assert first.kept
    on_path = planner.plan(*hairpin, effort="quick", geometry="spline")
    assert found.cycle_time < 0.95 * on_path.cycle_time


def test_a_plan_that_may_pass_with_less_tolerance_keeps_the_other_beside_it(
    hairpin: tuple[Program, Machine],
) -> None:
    """Of a motion whose chords leave the tolerance it is not known yet what it takes: the slower one that passes waits."""
    job = job_of(*hairpin, None, Stages())
    slower = StopMethod().plan_job(job)
    best = OptimalMethod(corner="spline", effort="quick").plan_job(job)
    assert best.verdict is not None
    assert not best.verdict.passed
    mended = best.slower_in_places()
    assert best.cycle_time < mended.cycle_time < slower.cycle_time
    kept = beside(best, slower, job)
    assert kept.trajectory is best.trajectory
    assert kept.slower_in_places().cycle_time == mended.cycle_time
    assert beside(best, mended, job).slower_in_places().cycle_time == mended.cycle_time
    assert beside(slower, mended, job) is mended


def test_more_effort_takes_no_more_time_where_shorter_steps_are_refused() -> None:
    program, machine = random_lines.job(28)
    traces = {effort: Trace() for effort in ("quick", "normal")}
    plans = [planner.plan(program, machine, effort=effort, log=trace) for effort, trace in traces.items()]
    assert plans[1].verdict is not None
    assert plans[1].verdict.passed
    assert plans[1].cycle_time <= (1.0 + 1e-9) * plans[0].cycle_time
    assert [step.kept for step in traces["normal"].steps if step.name == "search"] == [True]


def test_a_search_lets_go_of_the_motion_that_it_began_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its samples are half of what a long job has in memory, and nothing of them is delivered."""
    begun, alive = list[weakref.ref[object]](), list[bool]()
    first, search = attempts.first_motion, joint_search.searched_runs

    def remembered(*given):  # type: ignore[no-untyped-def]
        found = first(*given)
        begun.append(weakref.ref(found.samples))
        return found

    def searched(*given, **named):  # type: ignore[no-untyped-def]
        alive.append(begun[-1]() is not None)
        return search(*given, **named)

    monkeypatch.setattr(attempts, "first_motion", remembered)
    monkeypatch.setattr(joint_search, "searched_runs", searched)
    machine = planner.load_machine("mill")
    program = planner.read_program(text="G21 G90 F3000\nG1 X20\nY10\nX0\n", machine=machine)
    assert planner.plan(program, machine, effort="quick").require().cycle_time > 0
    assert alive == [False]
