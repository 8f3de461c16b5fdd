"""A motion that was found, searched once more in shorter steps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from starts import begun, begun_on

from benchmarks.jobs import problems
from planner.joint.groups import searched
from planner.joint.guess import Cut
from planner.joint.motion import CLOSED_EVERY, closed_at_nodes, integrated
from planner.joint.outcome import TubeSolution
from planner.joint.own import TubeOwn
from planner.joint.refine import divided, searched_again
from planner.joint.run import TubeRun
from planner.machine.parts import Fir
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.optimal.effort import EFFORTS


def found_in_long_steps(name: str) -> tuple[TubeRun, np.ndarray, TubeSolution]:
    run, guess = begun(name, Cut(per_unit=1.0, of_leg=1.0))
    found = TubeOwn(gap=1e-3, stays=False).solve(run, guess)
    assert found.steps is not None
    return run, guess.leg, found


@pytest.mark.parametrize("name", ["corner", "arcs"])
def test_a_divided_motion_is_the_same_motion(name: str):
    run, leg, found = found_in_long_steps(name)
    finer, steps = divided(run, leg, found, Cut(per_unit=4.0, of_leg=1.0)), found.steps
    assert finer.parts.sum() == len(finer.guess) > 1.5 * len(leg)
    np.testing.assert_allclose(np.add.reduceat(finer.guess.h, np.cumsum(finer.parts) - finer.parts), steps.h)
    state = finer.guess.state
    jerk = np.repeat(steps.jerk, finer.parts, axis=0)
    np.testing.assert_allclose(integrated(state[0], finer.guess.h, jerk)[:, 0], state[:, 0], atol=1e-9)
    assert (finer.guess.leg == np.repeat(leg, finer.parts)).all()


@pytest.mark.parametrize("name", ["corner", "arcs", "pentagon"])
def test_shorter_steps_are_faster_and_as_fast_as_without_the_long_ones(name: str):
    run, leg, found = found_in_long_steps(name)
    finer = divided(run, leg, found, Cut())
    (again,) = searched([searched_again(run, found, finer, TubeOwn())], len(finer.guess))
    at_once = TubeOwn().solve(*begun(name))
    assert again is not None
    assert again.kept is None
    assert again.price.any(axis=1).all()
    assert again.steps.h.sum() < found.steps.h.sum() * (1.0 - 1e-5)
    assert again.steps.h.sum() == pytest.approx(at_once.steps.h.sum(), rel=5e-4)
    # a price is what a limit saves: of steps in which it is the same, whatever their number
    assert again.price.sum() == pytest.approx(found.price.sum(), rel=0.05)


def test_what_the_second_search_leaves_is_what_the_first_has_found(monkeypatch):
    run, leg, found = found_in_long_steps("pentagon")
    finer = divided(run, leg, found, Cut())
    nothing = dataclasses.replace(found, steps=None, kept=None, price=None)
    monkeypatch.setattr(TubeOwn, "search", lambda *of: (yield from ()) or nothing)
    assert searched([searched_again(run, found, finer, TubeOwn())], len(finer.guess)) == [None]


def test_nodes_are_met_between_which_gaps_add_up():
    rng = np.random.default_rng(5)
    h, jerk = rng.uniform(0.5, 1.5, 3 * CLOSED_EVERY + 7), rng.normal(size=(3 * CLOSED_EVERY + 7, 2))
    state = integrated(rng.normal(size=(3, 2)), h, jerk)
    off = state + 1e-9 * rng.normal(size=state.shape)
    nodes, closed = closed_at_nodes(off, h, jerk)
    ends = np.linspace(0, len(h), 4).astype(int)
    np.testing.assert_array_equal(nodes[ends], off[ends])
    for k in range(len(h)):  # no step jumps
        np.testing.assert_allclose(
            integrated(nodes[k], h[k : k + 1], closed[k : k + 1])[-1], nodes[k + 1], atol=1e-9
        )
    assert np.abs(closed - jerk).max() < 1e-7


@pytest.mark.parametrize("far", [1e2, 1e5])
def test_where_the_job_is_does_not_matter(far: float):
    """Positions count from the first node of a window: far from the machine's origin they would have no digits left for gaps."""
    here, there = (problems.polyline(np.array([[0, 0], [4, 0], [4, 4], [9, 3]]) + by) for by in (0.0, far))
    times = [
        OptimalMethod().plan(job, problems.machine()).require().trajectory.cycle_time for job in (here, there)
    ]
    assert times[1] == pytest.approx(times[0], rel=2e-5)


def test_the_search_of_every_effort_has_its_steps():
    assert [len(EFFORTS[name].search.finer) for name in ("quick", "normal", "best")] == [0, 1, 2]
    job, machine = problems.pentagon(6.0), problems.machine()
    times = [
        OptimalMethod(effort=name).plan(job, machine).require().trajectory.cycle_time for name in EFFORTS
    ]
    assert times[1] < times[0] * (1.0 - 1e-5)
    assert times[2] < times[1] * (1.0 + 1e-5)


@pytest.mark.parametrize(("effort", "most"), [("quick", 1.55), ("normal", 1.06)])
def test_on_a_circle_at_a_long_period_chords_get_all_of_the_tolerance_on_both_sides(effort: str, most: float):
    """As fast as chords allow, v^2 dt^2/8 = 2 eps R with the setpoints as far outside of the circle as the chords are
    inside, but for the way to that speed and from it. Long steps alone, each longer than a period, keep chords by less
    speed. The verdict looks at the chords themselves."""
    radius, tolerance, period = 12.0, 0.008, 0.012
    machine = problems.machine(dt=period, tolerance=tolerance)
    lines = "G21 G90 G17 F30000\nG0 X0 Y0\nG2 X0 Y0 I12 J0\nG2 X0 Y0 I12 J0\nM2\n"
    made = OptimalMethod(effort=effort).plan(parse_program(lines, machine), machine).require()
    assert made.verdict.passed
    fastest = np.sqrt(16.0 * tolerance * radius) / period
    around = 4.0 * np.pi * radius / fastest
    assert around < made.trajectory.cycle_time < most * around


@pytest.mark.parametrize("lengths", [(), (0.012, 0.006)])
def test_chords_and_filters_keep_the_tolerance_at_every_phase(lengths: tuple[float, ...]):
    """What is found is looked at by other means: chords from any phase of the periods, of what filters, by numpy's means over
    their lengths, make of the motion. They pass the corner within the tolerance, and use it."""
    machine = problems.machine(dt=0.004)
    machine = machine.model_copy(update={"fir": Fir(time_constants=lengths) if lengths else None})
    corner, fine = np.array([8.0, 0.0]), 1e-4
    run, guess = begun_on(problems.polyline(np.array([[0.0, 0.0], corner, [8.0, 9.0]])), machine=machine)
    steps = TubeOwn().solve(run, guess).steps
    assert steps is not None
    end = np.cumsum(steps.h)
    t = np.arange(-0.1, end[-1] + 0.1, fine)
    of = np.clip(np.searchsorted(end, t, side="right"), 0, len(end) - 1)
    since = (np.clip(t, 0.0, end[-1]) - (end - steps.h)[of])[:, None]
    p, v, a, j = (one[of] for one in (steps.position, steps.velocity, steps.acceleration, steps.jerk))
    seen = p + since * (v + since * (a / 2 + since * j / 6))
    for length in lengths:
        window = np.ones(round(length / fine)) * fine / length
        seen = np.stack([np.convolve(column, window, mode="same") for column in seen.T], axis=1)
    seen, period = seen[300:-300], round(machine.dt / fine)
    misses = []
    for phase in range(0, period, 2):
        nodes = seen[phase::period]
        along, off = np.diff(nodes, axis=0), corner - nodes[:-1]
        share = np.clip((off * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18), 0.0, 1.0)
        misses.append(np.linalg.norm(off - share[:, None] * along, axis=1).min())
    assert 0.96 * machine.tolerance < max(misses) <= machine.tolerance * (1.0 + 2e-3)
