"""What is too much at one place of a long job costs that place, and nothing else."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from planner.delivery import mending
from planner.delivery.pacing import runs_of, slower_runs
from planner.delivery.periods import Standing
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import load_machine
from planner.motion.slowed import Slowed, reach
from planner.nc.reader import parse_program
from planner.planning.job.job import Job
from planner.planning.job.trace import Stages, Trace
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.registry import plan
from planner.verifier.excess import Excess, Fault, Kind

MACHINE = load_machine("mill").model_copy(update={"dt": 2e-3, "normal_acceleration": 500.0})
NO_STANDS = Standing(np.empty(0), np.empty(0))
WORTH = 1e-4  # share of the cycle time
# Runs from rest to rest, and what holds each: the feed, a rapid's axis, jerk and acceleration of a short stroke, the curve, a corner.
STROKES = {
    "feed": "G1 X8 F1200",
    "velocity": "G0 X120",
    "jerk": "G1 Y0.4 F9000",
    "normal": "G2 X4 I2 F9000",
    "corner": "G64 P0.03\nG1 X1.5 F9000\nX2.5 Y1.5\nG61.1",
}
OTHERS = {"wide": "G64 P0.02\nG1 X6 F9000\nX10 Y5\nG61.1"}  # a corner that uses all of the tolerance
POWER = {"feed": 1, "velocity": 1, "jerk": 3, "normal": 2, "corner": 2}


def job_of(strokes: list[str]) -> Job:
    """There and back on each stroke, all from rest to rest."""
    text = "\n".join(f"{(STROKES | OTHERS)[name]}\nG0 X0 Y0" for name in strokes)
    program = parse_program(f"G21 G90 G61.1\n{text}\nM2\n")
    return Job(
        program=program, machine=MACHINE, toolpath=toolpath_from_program(program, MACHINE), stages=Stages()
    )


def fast(motion, job, runs: dict[int, float]):
    """The motion with runs sped up, by their number among those of the strokes, two each."""
    factor = np.ones(len(runs_of(motion)))
    for run, by in runs.items():
        factor[run] = 1.0 / by
    return slower_runs(motion, runs_of(motion), factor)


def of_kinds(*kinds: Kind) -> tuple[Fault, ...]:
    """Faults of which no more is known."""
    return tuple(Fault(kind=kind, name=kind.value, found="") for kind in kinds)


def planned(job: Job):
    made = KinematicMethod().plan_job(job)
    assert made.verdict.passed, made.verdict.faults
    return made, made.making.motion


@pytest.mark.slow
def test_a_limit_exceeded_at_one_of_hundreds_of_runs_costs_that_run():
    """One place for every limit, all of them together in one job: the cycle time stays."""
    share = 0.2
    job = job_of(list(STROKES) * 40)
    made, motion = planned(job)
    assert len(runs_of(motion)) == 400
    at = {2 * (20 + k) * 5 + 2 * k: (1.0 + share) ** (1.0 / POWER[name]) for k, name in enumerate(STROKES)}
    broken = fast(motion, job, at)
    plain = job.deliver(broken, as_it_is=True)[1]
    for name in ("feed", "velocity.x", "jerk.y", "normal_acceleration"):
        assert plain.limits[name].ratio >= 1.0 + 0.9 * share
    trajectory, verdict, again = job.deliver(broken)[:3]
    assert verdict.passed, verdict.faults
    assert abs(trajectory.cycle_time / made.cycle_time - 1.0) < WORTH
    # all else is as it was
    assert isinstance(again, Slowed)
    runs = runs_of(broken)
    same = np.setdiff1d(np.arange(len(runs)), list(at))
    lasting = again.run_at(runs.end) - again.run_at(runs.begin)
    np.testing.assert_allclose(lasting[same], (runs.end - runs.begin)[same], atol=1e-9)


@pytest.mark.parametrize("share", [0.005, 0.2])
@pytest.mark.parametrize("name", list(STROKES))
def test_each_limit_alone(name, share):
    job = job_of([name] * 8)
    made, motion = planned(job)
    broken = fast(motion, job, {6: (1.0 + share) ** (1.0 / POWER[name])})
    assert not job.deliver(broken, as_it_is=True)[1].passed
    trajectory, verdict, *_ = job.deliver(broken)
    assert verdict.passed, verdict.faults
    assert trajectory.cycle_time - made.cycle_time < 1e-3 * made.cycle_time


def test_one_place_of_a_long_run_costs_less_than_the_run():
    """A run of ten seconds of which one corner is too fast."""
    program = parse_program("G21 G90 G64 P0.02 F1800\nG1 X60\nX120 Y20\nX180\nM2\n")
    job = Job(
        program=program, machine=MACHINE, toolpath=toolpath_from_program(program, MACHINE), stages=Stages()
    )
    made, motion = planned(job)
    worst = made.verdict.corners
    assert len(worst) == 2
    k = int(np.nanargmax(worst.speed_ratio))
    assert len(runs_of(motion)) == 1
    excess = Excess(
        kind=Kind.CORNER_SPEED, name="eq. 19", begin=worst.time[k], end=worst.time[k], ratio=1.05, power=1
    )
    verdict = dataclasses.replace(made.verdict, faults=of_kinds(Kind.CORNER_SPEED), excesses=(excess,))
    slower = mending.mended(motion, NO_STANDS, verdict, MACHINE.dt, 0)
    assert motion.end < slower.end < motion.end * (1.0 + 0.05 * 0.1)
    at = slower.at(slower.run_at(np.array([worst.time[k]])), MACHINE.dt)
    assert at.feed[0] == pytest.approx(worst.feed_planned[k] / 1.05, rel=1e-4)
    assert job.deliver(slower)[1].passed


@pytest.mark.parametrize("ratio", [1.0002, 1.05])
def test_what_is_a_little_too_much_everywhere_makes_all_slower_at_last(ratio, monkeypatch):
    """A judge that looks at two times, others in each round: place by place it would go on for ever. What is more than a little is
    not made slower everywhere."""
    job = job_of(["jerk"] * 60)
    made, motion = planned(job)
    rng, looked = np.random.default_rng(5), []

    def faked(_setpoints, _toolpath, _machine, *, motion, **_how):
        times, step = np.sort(rng.uniform(0.1, 0.9, 2)) * motion.end, 1e-6
        pace = np.ones(2)
        if isinstance(motion, Slowed):
            pace = step / (motion.was_at(times + step) - motion.was_at(times))
        looked.append(times)
        excesses = tuple(
            Excess(kind=Kind.LIMIT, name="jerk", begin=t, end=t, ratio=ratio / p**3, power=3)
            for t, p in zip(times.tolist(), pace.tolist(), strict=True)
            if p**3 < ratio
        )
        faults = of_kinds(Kind.LIMIT) if excesses else ()
        return dataclasses.replace(made.verdict, passed=not faults, faults=faults, excesses=excesses)

    monkeypatch.setattr("planner.planning.job.job.verify", faked)
    verdict, slower = job.deliver(motion)[1:3]
    assert verdict.passed == (ratio < 1.0 + mending.LITTLE)
    assert slower.end / motion.end - 1.0 < 2.0 * mending.LITTLE
    assert mending.EVERYWHERE < len(looked) <= 1 + mending.ROUNDS


def test_what_is_no_excess_is_not_mended():
    job = job_of(["feed", "jerk"])
    made, motion = planned(job)
    verdict, none = made.verdict, NO_STANDS
    assert mending.mended(motion, none, verdict, MACHINE.dt, 0) is None
    beyond = Excess(kind=Kind.LIMIT, name="jerk", begin=0.1, end=0.1, ratio=9.0, power=3)
    jerk = dataclasses.replace(verdict, faults=of_kinds(Kind.LIMIT), excesses=(beyond,))
    assert (
        mending.mended(motion, none, jerk, MACHINE.dt, 0) is None
    )  # more than twice as slow: a mistake to be seen
    small = dataclasses.replace(beyond, ratio=1.1)
    order = dataclasses.replace(verdict, faults=of_kinds(Kind.LIMIT, Kind.ORDER), excesses=(small,))
    assert mending.mended(motion, none, order, MACHINE.dt, 0) is None
    path = dataclasses.replace(small, kind=Kind.CONTOUR, name="contour", power=2, still=1.0)
    contour = dataclasses.replace(verdict, faults=of_kinds(Kind.CONTOUR), excesses=(path,))
    assert (
        mending.mended(motion, none, contour, MACHINE.dt, 0) is None
    )  # the path itself leaves the tolerance


def test_how_much_slower_an_excess_has_to_be():
    jerk = Excess(kind=Kind.LIMIT, name="jerk", begin=0.0, end=0.0, ratio=1.331, power=3)
    assert jerk.slower == pytest.approx(1.1)
    corner = dataclasses.replace(jerk, kind=Kind.CORNER_BUDGET, ratio=1.1, power=2, still=0.9)
    assert corner.slower == pytest.approx(math.sqrt(2.0))
    assert math.isinf(dataclasses.replace(corner, still=1.0).slower)


def test_methods_that_exceed_limits_on_purpose_are_delivered_as_they_are():
    text = "G21 G90 G64 P0.02 F6000\nG1 X2\nX4 Y1\nX6\nM2\n"
    assert not plan(parse_program(text), "mill", method="fir-plain").verdict.passed


@dataclasses.dataclass(frozen=True, kw_only=True)
class Careless(KinematicMethod):
    """Takes more than the tolerance at one corner of a job of many runs."""

    share: float = 0.0

    def plan_job(self, job):
        tolerance = job.toolpath.tolerance.copy()
        corner = np.flatnonzero(job.toolpath.joint == Joint.CORNER)
        if len(corner) > 1:
            tolerance[corner[len(corner) // 2]] *= 1.0 + self.share
        loose = dataclasses.replace(job.toolpath, tolerance=tolerance)
        return super().plan_job(dataclasses.replace(job, toolpath=loose, judged=job.real))


@pytest.mark.slow
def test_a_corner_beyond_the_tolerance_costs_its_run():
    """The path itself leaves the tolerance there, which no slower motion mends: its run is planned by itself."""
    share = 0.2
    job = job_of(["wide", "jerk"] * 100)
    program, machine = job.program, MACHINE.model_copy(update={"normal_acceleration": None})
    plain = KinematicMethod().plan(program, machine)
    assert plain.verdict.passed
    careless = Careless(share=(1.0 + share) / plain.verdict.corners.worst_budget_ratio - 1.0)
    broken = careless.plan_job(dataclasses.replace(job, machine=machine)).verdict
    assert broken.corners.worst_budget_ratio >= 1.0 + 0.9 * share
    told = Trace()
    made = careless.plan(program, machine, log=told)
    assert made.verdict.passed, made.verdict.faults
    assert [step.facts["runs"] for step in told.steps if step.name == "runs alone"] == [1]
    assert abs(made.cycle_time / plain.cycle_time - 1.0) < WORTH


@pytest.mark.parametrize(("again", "before"), [(0, 1.0), (mending.BOTH_SIDES, 1.1 ** (1.0 / 3.0))])
def test_an_excess_at_a_rest_is_of_the_run_behind_it_and_then_of_both(again, before):
    job = job_of(["feed", "jerk"])
    made, motion = planned(job)
    at = float(runs_of(motion).end[1])
    excess = Excess(kind=Kind.LIMIT, name="jerk", begin=at, end=at, ratio=1.1, power=3)
    verdict = dataclasses.replace(made.verdict, faults=of_kinds(Kind.LIMIT), excesses=(excess,))
    slower = mending.mended(motion, NO_STANDS, verdict, MACHINE.dt, again)
    lasting = np.diff(slower.run_at(np.array([at - 0.004, at, at + 0.004]))) / 0.004
    np.testing.assert_allclose(lasting, [before, 1.1 ** (1.0 / 3.0)], rtol=1e-3)


def test_a_limit_along_the_path_reaches_as_far_as_what_all_axes_do_asks_for():
    """Speed and acceleration along the path are no more than those of all axes together; the path has no limits of them here."""
    machine = MACHINE.model_copy(update={"normal_acceleration": None, "tangential_jerk": 2e4})
    text = "G21 G90 G64 P0.03 F5400\nG1 X14\nX22 Y9\nG2 X30 Y17 I8 J0\nG1 X9 Y26\nX0 Y4\nM2\n"
    made = plan(parse_program(text, machine), machine, method="bezier")
    verdict = made.verdict
    assert verdict.limits["jerk.tangential"].limited
    assert "acceleration.tangential" not in verdict.limits
    t = made.trajectory
    v, a = np.linalg.norm(t.velocity, axis=1).max(), np.abs(np.diff(t.feed) / np.diff(t.t)).max()
    least = reach(v, a, 2e4)
    assert least <= mending.reach_of(verdict) < 10.0 * least
