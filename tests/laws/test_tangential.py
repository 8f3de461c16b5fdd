"""Laws and closed forms of a machine's limits of the tangential acceleration and jerk, by all methods that keep them."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH
from planner.feedrate.constraints.limits import TANGENTIAL, TANGENTIAL_JERK, Limits
from planner.machine import Machine
from planner.planning.job.plan import Plan

AXIS = {"velocity": 150.0, "acceleration": 3000.0, "jerk": 80000.0}
PUSH = 700.0
KEPT_BY = ("stop", "bezier", "second-order", "optimal")


def turns(scale: float = 1.0, *, inch: bool = False, mirrored: bool = False) -> str:
    """Lines and an arc."""
    per, y = scale / (MM_PER_INCH if inch else 1.0), -1.0 if mirrored else 1.0
    x0, x1, x2, x3 = (f"{per * v:.12g}" for v in (14.0, 22.0, 30.0, 9.0))
    y1, y2, y3 = (f"{per * y * v:.12g}" for v in (9.0, 17.0, 26.0))
    return (
        f"{'G20' if inch else 'G21'}\nG64 P{0.03 * per:.12g} F{5400 * per:.12g}\nG1 X{x0}\nG1 X{x1} Y{y1}\n"
        f"{'G3' if mirrored else 'G2'} X{x2} Y{y2} I{8.0 * per:.12g} J0\nG1 X{x3} Y{y3}\nG1 X0 Y{4.0 * per * y:.12g}\n"
    )


TURNS = turns()


def machine_of(push: float | None = PUSH, scale: float = 1.0, **more) -> Machine:
    """A machine; `scale` is of all lengths."""
    axes = {letter: {name: scale * value for name, value in AXIS.items()} for letter in "xyz"}
    given = {"name": "pushed", "dt": 0.001, "tolerance": 0.03 * scale, "axes": axes}
    return Machine(**(given | {"tangential_acceleration": None if push is None else push * scale} | more))


def planned(text: str, machine: Machine, method: str = "optimal", **settings) -> Plan:
    program = planner.read_program(text=text, machine=machine)
    plan = planner.plan(program, machine, method=method, **settings).require()
    assert plan.verdict.passed, plan.verdict.faults
    return plan


def of_limit(plan: Plan) -> float:
    return plan.verdict.limits[TANGENTIAL.name].ratio


@pytest.mark.shows("tangential", "exact: a straight line")
@pytest.mark.parametrize("method", KEPT_BY)
def test_a_straight_line_takes_its_closed_form(method: str) -> None:
    """L/v + v/a + a/j from rest to rest at the feed v, with a the limit and not what the axes have; without a/j at second order,
    where accelerations still rise within steps."""
    length, feed, jerk = 60.0, 80.0, AXIS["jerk"]
    plan = planned(f"G21 F{60 * feed:g}\nG1 X{length:g}\n", machine_of(), method)
    least = length / feed + feed / PUSH + (0.0 if method == "second-order" else PUSH / jerk)
    assert plan.cycle_time == pytest.approx(least, rel=2e-4 if method == "second-order" else 1e-4)
    assert of_limit(plan) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("method", ["stop", "bezier", "optimal"])
def test_its_change_is_kept_and_used_and_never_makes_a_motion_faster(method: str) -> None:
    """On a line L/v + v/a + a/j from rest to rest, with both limits; what is never reached costs nothing."""
    settings = {"effort": "quick"} if method == "optimal" else {}
    line = planned("G21 F4800\nG1 X60\n", machine_of(tangential_jerk=2e4), method, **settings)
    assert line.cycle_time == pytest.approx(60.0 / 80.0 + 80.0 / PUSH + PUSH / 2e4, rel=1e-4)
    times = []
    for fastest in (None, 1e9, 2e4, 6e3):
        plan = planned(TURNS, machine_of(None, tangential_jerk=fastest), method, **settings)
        times.append(plan.cycle_time)
        if fastest is not None:
            ratio = plan.verdict.limits[TANGENTIAL_JERK.name].ratio
            assert ratio < 0.1 if fastest > 1e8 else 0.99 < ratio <= 1.0 + 1e-9
    assert times[1] == pytest.approx(times[0], rel=1e-4)
    assert (np.diff(times[1:]) > 0.0).all(), times
    assert plan.prices is None or plan.prices.saved[TANGENTIAL_JERK.name] > 0.0


@pytest.mark.parametrize("method", KEPT_BY)
def test_it_is_kept_and_used_and_never_makes_a_motion_faster(method: str) -> None:
    times = []
    for push in (None, 2000.0, PUSH, 300.0):
        plan = planned(TURNS, machine_of(push), method)
        times.append(plan.cycle_time)
        if push is not None:
            assert 0.99 < of_limit(plan) <= 1.0 + 1e-9
    assert (np.diff(times) > 0.0).all(), times


@pytest.mark.parametrize("method", KEPT_BY)
def test_what_the_axes_cannot_reach_changes_nothing(method: str) -> None:
    """Not one bit: a limit above the norm of the axes' accelerations is left out."""
    axes = AXIS["acceleration"] * np.sqrt(3.0)
    plain, other = (planned(TURNS, machine_of(push), method) for push in (None, 1.01 * axes))
    assert other.trajectory.position.tobytes() == plain.trajectory.position.tobytes()
    assert other.verdict.limits[TANGENTIAL.name].ratio < 1.0
    assert Limits.of(machine_of(1.01 * axes), ("x", "y", "z")).along == ()


@pytest.mark.parametrize("method", ["second-order", pytest.param("optimal", marks=pytest.mark.slow)])
def test_mirrored_scaled_and_in_inches_it_takes_the_same_time(method: str) -> None:
    plan = planned(TURNS, machine_of(), method)
    for text, scale in ((turns(mirrored=True), 1.0), (turns(inch=True), 1.0), (turns(3.0), 3.0)):
        same = planned(text, machine_of(scale=scale), method)
        assert same.cycle_time == pytest.approx(plan.cycle_time, rel=1e-5)


def test_f_goes_by_x_y_and_z_and_so_does_it() -> None:
    """A rotary axis that turns along needs no more time, and one that turns alone is not limited by it."""
    turning = {"velocity": 400.0, "acceleration": 40000.0, "jerk": 4e6}
    machine = machine_of(axes={**dict.fromkeys("xyz", AXIS), "a": turning}, rotary_radius=20.0)
    alone, along = (planned(f"G21 F3600\nG1 X50{a}\n", machine, "second-order") for a in ("", " A60"))
    assert along.cycle_time == pytest.approx(alone.cycle_time, rel=1e-4)
    assert of_limit(along) == pytest.approx(1.0, abs=1e-4)
    turned = planned("G21 F18000\nG1 A90\n", machine, "second-order")
    assert turned.cycle_time == pytest.approx(90.0 / 300.0 + 300.0 / turning["acceleration"], rel=1e-3)
    assert of_limit(turned) == 0.0


@pytest.mark.parametrize("method", ["kinematic", "fir", "fir-plain", "fir-spline"])
def test_methods_that_do_not_keep_it_say_so(method: str) -> None:
    with pytest.raises(
        InputError,
        match=r"acceleration to 700 mm/s2, which .* does not keep; plan with method optimal, second-order, tube, bezier",
    ):
        planned(TURNS, machine_of(), method)
    with pytest.raises(
        InputError,
        match=r"tangential jerk to 20000 mm/s3, which .* does not keep; plan with method optimal, tube, bezier",
    ):
        planned(TURNS, machine_of(None, tangential_jerk=2e4), method)
    planned(TURNS, machine_of(1e5), "stop")


@pytest.mark.slow
def test_it_holds_the_motion_has_a_price_and_more_of_it_saves_what_was_foretold() -> None:
    plan = planned(TURNS, machine_of())
    share = dict(zip(plan.grid.active_names, plan.grid.share, strict=True))
    assert share[TANGENTIAL.name] > 0.3
    more = planned(TURNS, machine_of(1.1 * PUSH))
    assert plan.prices.saved[TANGENTIAL.name] == pytest.approx(plan.cycle_time - more.cycle_time, rel=0.15)
    along_path = planner.plan(
        planner.read_program(text=TURNS, machine=machine_of()), machine_of(), corner="bezier"
    )
    assert along_path.prices.saved[TANGENTIAL.name] > 0.0


@pytest.mark.shows("tangential", "compared: ipopt along a path")
@pytest.mark.slow
@pytest.mark.parametrize("corners", [[[0, 0], [5, 0]], [[0, 0], [4, 0], [4, 4]]])
def test_along_a_path_ipopt_finds_the_same(corners: list[list[float]]) -> None:
    machine = machine_of(PUSH)
    program = problems.polyline(corners)
    times = [
        planner.plan(program, machine, corner="bezier", solver=solver).require().cycle_time
        for solver in ("own", "ipopt")
    ]
    assert times[1] == pytest.approx(times[0], rel=1e-4)
