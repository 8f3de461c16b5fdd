"""When a motion passes the joints of a path that is smaller than the tolerance: its full stops divide it."""

from __future__ import annotations

import numpy as np

from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.motion.vertex_times import passing_times, standstills
from planner.nc.reader import parse_program

PLACES = np.array([0.0, 0.3, 0.2, 0.6, 0.65, 0.5])
MACHINE = Machine(
    name="m",
    dt=0.001,
    tolerance=0.75,
    axes=dict.fromkeys("xyz", Axis(velocity=20, acceleration=1e3, jerk=1e5)),
)


def motion_through(places: np.ndarray) -> Trajectory:
    """Along x from rest to rest between the places, a second each."""
    u = np.linspace(0.0, 1.0, 101)
    steps = np.diff(places)
    x = np.concatenate(
        [[places[0]], *(a + d * u[1:] ** 2 * (3 - 2 * u[1:]) for a, d in zip(places, steps, strict=False))]
    )
    v = np.concatenate([[0.0], *(d * 6 * u[1:] * (1 - u[1:]) for d in steps)])
    position, zero = np.zeros((len(x), 3)), np.zeros((len(x), 3))
    position[:, 0] = x
    return Trajectory(
        axes=("x", "y", "z"), dt=0.01, t=np.arange(len(x)) * 0.01, position=position, velocity=zero,
        acceleration=zero, jerk=zero, s=np.append(0.0, np.cumsum(np.abs(np.diff(x)))), feed=np.abs(v),
        block=np.zeros(len(x)), line=np.zeros(len(x)),
    )  # fmt: skip


def test_a_joint_lies_between_the_full_stops_around_it_however_wide_the_tolerance() -> None:
    """The tolerance is larger than the whole path: nearness alone would find the joints anywhere."""
    text = "G21 G90 F600 G61.1\n" + "".join(f"G1 X{x}\n" for x in PLACES[1:]) + "M2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    motion = motion_through(PLACES)
    times = passing_times(motion, toolpath)
    assert np.allclose(times, np.arange(len(PLACES)))
    arrival, departure = standstills(motion, toolpath, times)
    assert np.allclose(arrival, times)
    assert np.allclose(departure, times)


def test_joints_between_full_stops_are_passed_between_them() -> None:
    text = (
        "G21 G90 F600 G64\nG1 X0.1\nG1 X0.3\nG61.1\nG1 X0.2\nG1 X0.6\nG1 X0.65\nG64\nG1 X0.6\nG1 X0.5\nM2\n"
    )
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    times = passing_times(motion_through(PLACES), toolpath)
    assert np.allclose(times[[0, 2, 3, 4, 5, 7]], np.arange(len(PLACES)))
    assert 0 < times[1] < 1
    assert 4 < times[6] < 5
