"""The verifier finds what is wrong with an extruder's places, and nothing where all is right."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.base.arrays import FloatArray
from planner.machine import load_machine, machine_from_dict
from planner.planning.job.plan import Plan
from planner.report.trajectory_file import write_trajectory
from planner.report.trajectory_reader import read_trajectory
from planner.verifier import verify
from planner.verifier.extruder import NEAR

TEXT = "G21\nM83\nG1 X10 F3000 E0.5\nX20 Y5 E0.5\nG1 E-2 F1800\nG1 E2\nG1 X40 E1 F3000\n"
LIMITS = {"velocity": 40.0, "acceleration": 2000.0, "jerk": 1e5}


def planned(text: str, method: str) -> Plan:
    about = load_machine("router").model_dump(exclude_none=True)
    about["axes"]["e"] = LIMITS
    machine = machine_from_dict(about)
    made = planner.plan(planner.read_program(text=text, machine=machine), machine, method=method)
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults
    return made


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planned(TEXT, "second-order")


def judged(plan: Plan, extruder: FloatArray) -> list[str]:
    assert plan.trajectory is not None
    motion = dataclasses.replace(plan.trajectory, extruder=extruder)
    return list(verify(motion, plan.toolpath, plan.machine, not_limited=("jerk",)).sentences)


def test_what_was_planned_passes(plan: Plan) -> None:
    assert plan.trajectory is not None
    assert judged(plan, plan.trajectory.extruder) == []


@pytest.mark.shows("extruder", "sampled: faults put into its places are found")
def test_places_that_are_not_those_of_the_program_are_found(plan: Plan) -> None:
    assert plan.trajectory is not None
    right, t = plan.trajectory.extruder, plan.trajectory.t
    still = right.copy()
    still[:, 0] = 0.0
    assert any("off where line" in fault for fault in judged(plan, still))
    more = right.copy()
    more[:, 0] *= 1.001
    assert any("ends at" in fault for fault in judged(plan, more))
    early = right.copy()
    early[:, 0] = np.interp(t + 0.03, t, right[:, 0])
    assert any("off where line" in fault for fault in judged(plan, early))


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_each_limit_is_found_broken_when_it_is_lowered(plan: Plan, quantity: str) -> None:
    trajectory, fed = plan.trajectory, plan.toolpath.extrusion
    assert trajectory is not None
    assert fed is not None
    assert plan.verdict is not None
    ratio = plan.verdict.limits[f"{quantity}.e"].ratio
    assert ratio > 0.3
    which = list(LIMITS).index(quantity)
    lower = fed.limits.copy()
    lower[which] *= 0.99 * ratio
    path = dataclasses.replace(plan.toolpath, extrusion=dataclasses.replace(fed, limits=lower))
    faults = verify(trajectory, path, plan.machine).sentences
    assert any(fault.startswith(f"{quantity}.e:") for fault in faults)


def test_files_carry_it_and_say_where_it_is_missing(plan: Plan, tmp_path: Path) -> None:
    assert plan.trajectory is not None
    for suffix in ("csv", "npz", "parquet"):
        file = tmp_path / f"motion.{suffix}"
        write_trajectory(file, plan.trajectory)
        read = read_trajectory(file)
        assert np.array_equal(read.trajectory.extruder, plan.trajectory.extruder)
        assert verify(
            read.trajectory, plan.toolpath, plan.machine, given=read.given, not_limited=("jerk",)
        ).passed
    without = dataclasses.replace(plan.trajectory, extruder=np.zeros((0, 4)))
    verdict = verify(without, plan.toolpath, plan.machine, not_limited=("jerk",))
    assert verdict.passed
    assert any("no column e" in note for note in verdict.notes)


def test_a_move_alone_is_judged_at_all_of_its_acceleration_and_jerk() -> None:
    """At rest of the axes 2 mm of filament at 30 mm/s are seven phases of jerk j = 1e5: at most sqrt(v j), and j itself."""
    made = planned("G21\nM83\nG1 X10 F600 E0.01\nG1 E-2 F1800\nG1 E2\nG1 X20 E0.01 F600\n", "stop")
    assert made.verdict is not None
    seen = made.verdict.limits
    assert seen["acceleration.e"].value == pytest.approx(
        np.sqrt(30.0 * 1e5), rel=0.03
    )  # a mean of two periods
    assert seen["jerk.e"].value == pytest.approx(1e5, rel=1e-3)


def test_along_the_way_it_is_judged_at_its_ratio_times_what_the_axes_do() -> None:
    """A line of 40 mm from rest to rest, in all phases of jerk: acceleration and jerk of x are used up."""
    made = planned("G21\nM83\nG1 X40 F6000 E4\n", "stop")
    assert made.verdict is not None
    seen, axis = made.verdict.limits, made.machine.axes["x"]
    for name in ("acceleration", "jerk"):
        assert seen[f"{name}.e"].value == pytest.approx(0.1 * getattr(axis, name), rel=1e-6)


@pytest.mark.parametrize("feeds", ["first", "last"])
def test_where_the_ratio_changes_it_may_be_ahead_by_so_many_tolerances_of_way(feeds: str) -> None:
    """By half of that it passes, by twice it does not; the joint is that behind the first block, or before the last one."""
    text = ("X20 E2", "X40 Y1", "X40 Y20") if feeds == "first" else ("X20", "X40 Y1", "X40 Y20 E2")
    made = planned("G21\nM83\nG64 P0.1\nF3000\n" + "".join(f"G1 {words}\n" for words in text), "second-order")
    assert made.trajectory is not None
    s, e = made.trajectory.s, made.trajectory.extruder[:, 0]
    for share, passes in ((0.5, True), (2.0, False)):
        ahead = made.trajectory.extruder.copy()
        ahead[:, 0] = np.interp(s + share * NEAR * 0.1, s, e)
        found = [fault for fault in judged(made, ahead) if "off where line" in fault]
        assert (found == []) == passes
