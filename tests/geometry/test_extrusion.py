"""What the extruder does along a path: its ratio, its limit as a feed, and how long it takes alone."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.point_to_point import rest_to_rest_times
from planner.geometry.build import toolpath_from_program
from planner.geometry.extrusion import APART
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import load_machine, machine_from_dict
from planner.nc.reader import parse_program

V, A, J = 2.0, 50.0, 1e3


def laid_out(text: str, tolerance: float = 0.02) -> Toolpath:
    about = load_machine("router").model_dump(exclude_none=True)
    about["axes"]["e"] = {"velocity": V, "acceleration": A, "jerk": J}
    machine = machine_from_dict(about)
    return toolpath_from_program(parse_program("G21\nM83\n" + text, machine), machine, tolerance)


def test_with_a_constant_ratio_the_limit_is_a_feed() -> None:
    path = laid_out("G1 X100 F6000 E5\n")  # 0.05 mm/mm: 2 mm/s are 40 mm/s
    assert path.extrusion is not None
    assert path.extrusion.ratio == pytest.approx([0.05], rel=1e-12)
    assert path.feed == pytest.approx([V / 0.05], rel=1e-12)
    assert laid_out("G1 X100 F600 E5\n").feed == pytest.approx([10.0])  # the programmed one is lower


def test_rapids_and_travel_have_no_limit_where_nothing_is_fed() -> None:
    path = laid_out("G0 X10 F6000\nG28\nG0 X10 E1\n")
    assert path.feed == pytest.approx([100.0, np.inf, V / 0.1])


@pytest.mark.shows("extruder", "exact: closed forms from rest to rest")
def test_alone_it_takes_the_shortest_time_from_rest_to_rest() -> None:
    path = laid_out("G1 X10 F60 E1\nG1 E-3 F90\nG4 P250\nG1 E3 F6000\nG1 X20 E1\n")
    slow, fast = (rest_to_rest_times(*(np.array([x]) for x in (3.0, v, A, J)))[0] for v in (1.5, V))
    assert path.joint[1] == Joint.STOP
    assert path.dwell[1] == pytest.approx(slow + 0.25 + fast, rel=1e-12)
    fed = path.extrusion
    assert fed is not None
    assert fed.delay == pytest.approx([0.0, slow + 0.25], rel=1e-12)
    assert fed.arrive == pytest.approx([0.0, 1.0, 2.0])
    assert fed.leave == pytest.approx([0.0, 1.0, 2.0])


def test_blocks_that_move_nothing_but_the_extruder_are_moves_alone() -> None:
    path = laid_out("G1 X10 F60 E1\nG1 X10 E-2\nG1 X20 E1\nG4 P100\nG1 E3\nG1 X30 E1\n")
    fed = path.extrusion
    assert fed is not None
    assert fed.amount == pytest.approx([-2.0, 3.0])
    assert fed.arrive == pytest.approx([0.0, 1.0, 0.0, 4.0])
    assert fed.leave == pytest.approx([0.0, -1.0, 3.0, 4.0])
    assert fed.delay == pytest.approx([0.0, 0.1])  # each from the arrival at its own joint
    assert path.joint[1] == Joint.STOP


def test_joints_nearer_than_so_many_tolerances_share_one_ratio() -> None:
    steps = np.random.default_rng(3).uniform(0.03, 0.05, 200)
    text = "".join(
        f"G1 X{x:.6f} E{e:.6f} F600\n" for x, e in zip(np.cumsum(steps), 0.05 * steps, strict=True)
    )
    path = laid_out(text)
    fed = path.extrusion
    assert fed is not None
    way = np.append(0.0, np.cumsum(path.length))[fed.joint]
    assert (np.diff(way)[:-1] >= APART * 0.02).all()
    assert (np.diff(way)[:-1] < APART * 0.02 + 0.05).all()
    assert fed.leave[-1] == pytest.approx(path.extrusion.arrive[-1])
    assert fed.leave[-1] == pytest.approx(0.05 * steps.sum(), abs=1e-4)
    assert path.part(np.ones(len(path), bool)).extrusion is not None
