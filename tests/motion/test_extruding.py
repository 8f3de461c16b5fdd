"""The extruder beside planned motions: against closed forms, and against a limit of one's own that says the same."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.base.point_to_point import rest_to_rest_times
from planner.machine import Machine, load_machine, machine_from_dict
from planner.planning.job.plan import Plan

TEXT = (
    "G21\nM83\nG1 X10 F3000 E0.5\nX20 Y5 E0.5\nY15 E0.5\nG1 E-2 F1800\nG0 X30\nG1 E2 F1800\nG1 X40 E1 F3000\n"
)


def printer(velocity: float, acceleration: float, jerk: float) -> Machine:
    about = load_machine("router").model_dump(exclude_none=True)
    about["axes"]["e"] = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
    return machine_from_dict(about)


def planned(text: str, machine: Machine, **how: object) -> Plan:
    plan = planner.plan(planner.read_program(text=text, machine=machine), machine, **how)
    assert plan.verdict is not None
    assert plan.verdict.passed, plan.verdict.faults
    return plan


@pytest.mark.shows("extruder", "exact: closed forms from rest to rest")
def test_a_straight_block_takes_what_the_extruder_needs_from_rest_to_rest() -> None:
    length, fed, limits = 80.0, 20.0, (5.0, 12.0, 100.0)
    plan = planned(f"G21\nM83\nG1 X{length} E{fed} F6000\n", printer(*limits), effort="quick")
    need = rest_to_rest_times(*(np.array([x]) for x in (fed, *limits)))[0]
    assert plan.trajectory is not None
    assert plan.trajectory.cycle_time == pytest.approx(need, rel=3e-4)
    assert plan.trajectory.cycle_time >= need * (1.0 - 1e-9)


def test_a_limit_of_ones_own_along_the_path_says_the_same() -> None:
    class Fed(planner.PathLimit):
        name = "fed"

        def acceleration(self, at: object) -> float:
            return 10.0 / 0.05

        def jerk(self, at: object) -> float:
            return 200.0 / 0.05

    text = "G21\nM83\nG1 X20 E1 F3000\nG1 X40 Y20 E1.4142135623730951\nG1 X40 Y40 E1\n"
    own = planned(
        text.replace("E1.4142135623730951", "").replace("E1", ""),
        load_machine("router"),
        limits=[Fed()],
        geometry="spline",
    )
    fed = planned(text, printer(50.0, 10.0, 200.0), effort="quick")
    assert own.trajectory is not None
    assert fed.trajectory is not None
    # what the corners may save of the way counts as ratio
    assert own.trajectory.cycle_time <= fed.trajectory.cycle_time * (1.0 + 1e-4)
    assert fed.trajectory.cycle_time == pytest.approx(own.trajectory.cycle_time, rel=6e-3)


@pytest.mark.parametrize("method", ["optimal", "second-order", "kinematic", "stop"])
def test_what_is_programmed_is_fed_by_every_method(method: str) -> None:
    motion = planned(TEXT, printer(60.0, 5000.0, 2.5e5), method=method).trajectory
    assert motion is not None
    place, velocity, acceleration, _ = motion.extruder.T
    assert place[-1] == pytest.approx(2.5, abs=1e-12)
    assert place.max() == pytest.approx(2.5, abs=1e-12)
    assert np.abs(motion.extruder[[0, -1], 1:3]).max() == 0.0
    h = np.diff(motion.t)
    steps = np.abs(np.diff(place) / h - (velocity[1:] + velocity[:-1]) / 2)
    same = np.abs(np.diff(motion.block)) == 0  # its speed steps where its ratio changes
    assert np.median(steps[same]) < 1e-3
    assert np.abs(np.diff(place)).max() <= 60.0 * h.max() * (1 + 1e-9)
    resting = motion.feed[:-1] + motion.feed[1:] == 0.0
    assert np.ptp(place[:-1][resting]) == pytest.approx(2.0, abs=1e-4)  # retracts while the axes wait
    assert np.abs(acceleration).max() <= 5000.0 * (1 + 1e-9)


def test_the_limit_of_the_extruder_is_not_kept_where_it_cannot_matter() -> None:
    assert planned(TEXT, printer(60.0, 5e4, 2.5e7), effort="quick").machine.own == ()
    assert [limit.name for limit in planned(TEXT, printer(60.0, 30.0, 3e3), effort="quick").machine.own] == [
        "extruder"
    ]
