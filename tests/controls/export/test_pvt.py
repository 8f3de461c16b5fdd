"""Positions, velocities and times: cubics between the rows, judged by SciPy's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from planner.base.errors import InputError
from planner.controls.export.stream import PERIODS_MAX, longest_interval, write_pvt
from planner.machine import load_machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.methods.stop import StopMethod


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    plan = StopMethod().plan(parse_program("G21 F3000\nG1 X40 Y3\nY40 Z2\nX0\nY0"), load_machine("mill"))
    assert plan.trajectory is not None
    return plan.trajectory


def table(directory: Path) -> dict[str, np.ndarray]:
    read = np.genfromtxt(directory / "pvt.csv", delimiter=",", names=True)
    return {name: read[name] for name in read.dtype.names}


@pytest.mark.parametrize("within", [1e-4, 1e-3, 1e-2])
def test_cubics_between_rows_stay_within_the_distance(
    tmp_path: Path, motion: Trajectory, within: float
) -> None:
    periods, miss = write_pvt(tmp_path, motion, within=within)
    rows = table(tmp_path)
    assert miss <= within
    off = [
        np.abs(
            CubicHermiteSpline(rows["t"], rows[axis], rows[f"v{axis}"])(motion.t) - motion.position[:, k]
        ).max()
        for k, axis in enumerate(motion.axes)
    ]
    assert max(off) == pytest.approx(miss, abs=2e-8)
    assert (rows["t"][0], rows["t"][-1]) == pytest.approx((motion.t[0], motion.t[-1]), abs=1e-9)
    assert 1 < periods <= PERIODS_MAX


def test_a_longer_distance_takes_fewer_rows(tmp_path: Path, motion: Trajectory) -> None:
    counts = [longest_interval(motion, np.full(3, within))[0] for within in (1e-6, 1e-4, 1e-2, 1.0)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1] <= PERIODS_MAX


def test_inches(tmp_path: Path, motion: Trajectory) -> None:
    for unit in ("mm", "inch"):
        (tmp_path / unit).mkdir()
        write_pvt(tmp_path / unit, motion, unit)
    mm, inch = table(tmp_path / "mm"), table(tmp_path / "inch")
    assert inch["vx"] * 25.4 == pytest.approx(mm["vx"], abs=1e-6)
    assert inch["t"] == pytest.approx(mm["t"])


def test_what_cannot_be_is_refused(tmp_path: Path, motion: Trajectory) -> None:
    with pytest.raises(InputError, match="must be above 0"):
        write_pvt(tmp_path, motion, within=0.0)
    with pytest.raises(InputError, match="no unit 'cm'"):
        write_pvt(tmp_path, motion, "cm")
