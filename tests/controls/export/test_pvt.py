"""Positions, velocities and times: cubics between the rows, judged by SciPy's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from planner.base.errors import InputError
from planner.controls.export.tables import PERIODS_MAX, Table, laser_power, longest_interval, write_table
from planner.machine import load_machine
from planner.motion.pulses import pulses_of
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.methods.stop import StopMethod
from planner.report.trajectory_file import write_pulses
from planner.report.trajectory_reader import read_trajectory


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    plan = StopMethod().plan(parse_program("G21 F3000\nG1 X40 Y3\nY40 Z2\nX0\nY0"), load_machine("mill"))
    assert plan.trajectory is not None
    return plan.trajectory


def table(directory: Path) -> dict[str, np.ndarray]:
    read = np.genfromtxt(directory / "pvt.csv", delimiter=",", names=True)
    return {name: read[name] for name in read.dtype.names}


def far(places: list[np.ndarray], motion: Trajectory) -> float:
    """How far places (T,) of each axis are from the setpoints at most, as the crow flies: of each axis alone it was told."""
    return float(np.linalg.norm(np.stack(places, axis=1) - motion.position, axis=1).max())


@pytest.mark.shows("export-pvt", "compared: SciPy's cubics between the rows")
@pytest.mark.parametrize("within", [1e-4, 1e-3, 1e-2])
def test_cubics_between_rows_stay_within_the_distance(
    tmp_path: Path, motion: Trajectory, within: float
) -> None:
    periods, miss = write_table(tmp_path, motion, Table(within=within))
    rows = table(tmp_path)
    assert miss <= within
    places = [CubicHermiteSpline(rows["t"], rows[axis], rows[f"v{axis}"])(motion.t) for axis in motion.axes]
    assert far(places, motion) == pytest.approx(miss, abs=2e-8)
    assert (rows["t"][0], rows["t"][-1]) == pytest.approx((motion.t[0], motion.t[-1]), abs=1e-9)
    assert 1 < periods <= PERIODS_MAX


def test_a_longer_distance_takes_fewer_rows(tmp_path: Path, motion: Trajectory) -> None:
    counts = [longest_interval(motion, np.full(3, within))[0] for within in (1e-6, 1e-4, 1e-2, 1.0)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1] <= PERIODS_MAX


def test_inches(tmp_path: Path, motion: Trajectory) -> None:
    for unit in ("mm", "inch"):
        (tmp_path / unit).mkdir()
        write_table(tmp_path / unit, motion, Table(unit=unit))
    mm, inch = table(tmp_path / "mm"), table(tmp_path / "inch")
    assert inch["vx"] * 25.4 == pytest.approx(mm["vx"], abs=1e-6)
    assert inch["t"] == pytest.approx(mm["t"])


@pytest.mark.shows("export-pt", "exact: straight moves between rows, within the distance")
def test_straight_rows_at_the_cycle_of_a_drive(tmp_path: Path, motion: Trajectory) -> None:
    periods, miss = write_table(tmp_path, motion, Table(kind="pt", cycle=0.004))
    read = np.genfromtxt(tmp_path / "pt.csv", delimiter=",", names=True)
    assert read.dtype.names == ("t", "x", "y", "z")
    assert periods == round(0.004 / motion.dt)
    assert np.diff(read["t"])[:-1] == pytest.approx(0.004, abs=1e-9)
    places = [np.interp(motion.t, read["t"], read[axis]) for axis in "xyz"]
    assert far(places, motion) == pytest.approx(miss, abs=2e-8)


@pytest.mark.parametrize("periods", [1, 2, 3, 4, 7])
def test_rows_begin_and_end_with_the_motion_and_none_comes_twice(
    tmp_path: Path, motion: Trajectory, periods: int
) -> None:
    """However many setpoints there are behind the last whole cycle: none, one, or more."""
    write_table(tmp_path, motion, Table(cycle=periods * motion.dt))
    t = table(tmp_path)["t"]
    assert (t[0], t[-1]) == pytest.approx((motion.t[0], motion.t[-1]), abs=1e-9)
    assert np.diff(t).min() > 0.0
    assert np.diff(t).max() <= periods * motion.dt + 1e-9


@pytest.mark.shows("export-twincat", "exact: columns of the file")
def test_tables_of_a_time_and_a_position(tmp_path: Path, motion: Trajectory) -> None:
    _, miss = write_table(tmp_path, motion, Table(kind="twincat", within=1e-2))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["x.txt", "y.txt", "z.txt"]
    places = []
    for axis in "xyz":
        t, place = np.loadtxt(tmp_path / f"{axis}.txt").T
        assert (np.diff(t) > 0).all()
        places.append(np.interp(motion.t, t, place))
    assert far(places, motion) == pytest.approx(miss, abs=2e-8)
    assert miss <= 1e-2


@pytest.mark.shows("export-ros", "exact: keys and units of the message")
def test_a_message_of_ros(tmp_path: Path, motion: Trajectory) -> None:
    _, miss = write_table(tmp_path, motion, Table(kind="joint-trajectory", joints=("one", "two", "three")))
    said = json.loads((tmp_path / "trajectory.json").read_text())
    assert said["joint_names"] == ["one", "two", "three"]
    when = [point["time_from_start"] for point in said["points"]]
    t = np.array([each["sec"] + 1e-9 * each["nanosec"] for each in when])
    assert all(0 <= each["nanosec"] < 10**9 for each in when)
    place = np.array([point["positions"] for point in said["points"]])
    speed = np.array([point["velocities"] for point in said["points"]])
    off = far(list(1e3 * CubicHermiteSpline(t, place, speed)(motion.t).T), motion)
    assert off == pytest.approx(miss, abs=1e-6)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (Table(cycle=0.0015), "whole number"),
        (Table(kind="pt", cycle=0.05, within=1e-6), "off the setpoints"),
        (Table(kind="joint-trajectory", joints=("one", "two")), "3 different names"),
        (Table(kind="joint-trajectory", joints=("one", "two", "one")), "3 different names"),
    ],
)
def test_tables_that_cannot_be(tmp_path: Path, motion: Trajectory, table: Table, said: str) -> None:
    with pytest.raises(InputError, match=said):
        write_table(tmp_path, motion, table)
    assert not list(tmp_path.iterdir())


def test_laser_power_follows_the_real_speed() -> None:
    text = "G21 F3000\nM4 S800\nG1 X10\nG0 X20\nM3\nG1 X30\nS200\nX40\nM5\nX50"
    plan = StopMethod().plan(parse_program(text, load_machine("mill")), load_machine("mill"))
    motion = plan.trajectory
    assert motion is not None
    power = laser_power(plan.program, motion)
    x, inside = motion.position[:, 0], lambda a, b: (x > a + 1e-6) & (x < b - 1e-6)
    speed = motion.velocity[:, 0]
    np.testing.assert_allclose(power[inside(0, 10)], 800.0 * speed[inside(0, 10)] / 50.0, rtol=1e-6)
    assert power[inside(0, 10)].max() == pytest.approx(800.0, rel=1e-3)
    for (a, b), want in (((10, 20), 0.0), ((20, 30), 800.0), ((30, 40), 200.0), ((40, 50), 0.0)):
        assert (power[inside(a, b)] == want).all()


@pytest.mark.parametrize("dt", [0.001, 0.016])
def test_positions_alone_are_taken_as_from_rest_to_rest(tmp_path: Path, dt: float) -> None:
    """Differences over the first period, up to 4 % of the fastest here, are no speed at its start."""
    machine = load_machine("mill").model_copy(update={"dt": dt})
    made = StopMethod().plan(parse_program("G21 F60\nG1 X1\nY1\n"), machine).trajectory
    assert made is not None
    columns = np.column_stack([made.t, made.position])
    file = tmp_path / "played.csv"
    np.savetxt(file, columns, "%.9f", ",", header=",".join(["t", *made.axes]), comments="")
    found = read_trajectory(file).trajectory
    assert found.from_rest_to_rest
    assert np.abs(found.velocity[0]).max() > 1e-6
    write_table(tmp_path, found, Table())
    write_pulses(tmp_path / "pulses.csv", pulses_of(found, {"x": 400.0, "y": 400.0}), {})


def test_what_cannot_be_is_refused(tmp_path: Path, motion: Trajectory) -> None:
    """Also of a caller from Python: no distance is larger than one that is no number."""
    for within in (0.0, float("nan")):
        with pytest.raises(InputError, match="must be above 0"):
            write_table(tmp_path, motion, Table(within=within))
    with pytest.raises(InputError, match="no unit 'cm'"):
        write_table(tmp_path, motion, Table(unit="cm"))
