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
    """From rest to rest between the places (n, 2), a second each."""
    u = np.linspace(0.0, 1.0, 101)
    share = u[1:] ** 2 * (3 - 2 * u[1:])
    steps = np.diff(places, axis=0)
    position = np.zeros((1 + len(share) * len(steps), 3))
    position[1:, :2] = np.vstack([a + share[:, None] * d for a, d in zip(places[:-1], steps, strict=True)])
    feed = np.concatenate([[0.0], *(np.linalg.norm(d) * 6 * u[1:] * (1 - u[1:]) for d in steps)])
    run = np.linalg.norm(np.diff(position, axis=0), axis=1)
    zero = np.zeros_like(position)
    return Trajectory(
        axes=("x", "y", "z"), dt=0.01, t=np.arange(len(feed)) * 0.01, position=position, velocity=zero,
        acceleration=zero, jerk=zero, s=np.append(0.0, np.cumsum(run)), feed=feed,
        block=np.zeros(len(feed)), line=np.zeros(len(feed)),
    )  # fmt: skip


def test_a_joint_lies_between_the_full_stops_around_it_however_wide_the_tolerance() -> None:
    """The tolerance is larger than the whole path: nearness alone would find the joints anywhere."""
    text = "G21 G90 F600 G61.1\n" + "".join(f"G1 X{x}\n" for x in PLACES[1:]) + "M2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    motion = motion_through(np.stack([PLACES, 0 * PLACES], axis=1))
    times = passing_times(motion, toolpath)
    assert np.allclose(times, np.arange(len(PLACES)))
    arrival, departure = standstills(motion, toolpath, times)
    assert np.allclose(arrival, times)
    assert np.allclose(departure, times)


def test_a_joint_that_is_cut_is_not_looked_for_behind_the_next_full_stop() -> None:
    """The second run comes nearer to the first run's corner than the first one does."""
    places = np.array([[0.0, 0.0], [0.3, 0.0], [0.1, 0.06], [0.5, 0.3]])
    text = "G21 G90 F600 G64\nG1 X0.1 Y0.05\nG61.1\nG1 X0.3 Y0\nG1 X0.1 Y0.06\nG1 X0.5 Y0.3\nM2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    times = passing_times(motion_through(places), toolpath)
    assert 0 < times[1] < 1
    assert np.allclose(times[[0, 2, 3, 4]], np.arange(len(places)))


def test_a_joint_is_passed_so_early_that_those_after_it_are_passed_within_their_tolerances() -> None:
    """A motion up to (1.2, 0.5) and back: it is nearest to the first corner on its way back, when it has left the second one."""
    places = np.array([[0.0, 0.0], [1.0, 0.3], [1.2, 0.5], [1.0, 0.0], [0.2, 0.0]])
    text = "G21 G90 F600 G64 P0.35\nG1 X1\nG1 X1.2 Y0.7\nG1 X1.1 Y0.3\nG1 X0.2 Y0\nM2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    motion = motion_through(places)
    times = passing_times(motion, toolpath)
    vertex = np.vstack([toolpath.start, toolpath.end[-1:]])
    at = np.stack([np.interp(times, motion.t, column) for column in motion.position.T], axis=1)
    assert (np.diff(times) >= 0.0).all()
    assert (np.linalg.norm(at - vertex, axis=1) <= 0.36).all()
    assert times[1] < times[2] < 2.5


def test_a_joint_that_is_missed_the_second_time_is_not_taken_for_the_first_time() -> None:
    """Twice around a square: at its beginning the second round leaves out a corner by more than the tolerance."""
    square = np.array([[10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]])
    places = np.vstack([[[0.0, 0.0]], square, square])
    text = "G21 G90 F600 G64 P0.05\n" + "".join(f"G1 X{x:g} Y{y:g}\n" for x, y in places[1:]) + "M2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    places[5] = 9.8, 0.2
    np.testing.assert_allclose(passing_times(motion_through(places), toolpath), np.arange(9), atol=0.1)


def test_a_joint_between_two_samples_is_passed_between_their_times() -> None:
    """On a line the time is that of the chord at the place itself, not that of a sample."""
    text = "G21 G90 F600 G64 P0.01\nG1 X0.3\nG1 X0.55\nG1 X1\nM2\n"
    toolpath = toolpath_from_program(parse_program(text, MACHINE), MACHINE)
    motion = motion_through(np.array([[0.0, 0.0], [1.0, 0.0]]))
    places = np.array([0.0, 0.3, 0.55, 1.0])
    expected = np.interp(places, motion.position[:, 0], motion.t)
    assert np.abs(expected[1:3, None] - motion.t).min() > 1e-3  # [s]
    np.testing.assert_allclose(passing_times(motion, toolpath), expected, atol=1e-9)
