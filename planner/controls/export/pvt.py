"""Positions, velocities and times (PVT): rows between which a drive moves each axis on a cubic.

With p0, v0 at the start of an interval of length h and p1, v1 at its end, u = (t - t0) / h,

    p(u) = (1 + 2u)(1 - u)^2 p0 + u (1 - u)^2 h v0 + u^2 (3 - 2u) p1 - u^2 (1 - u) h v1

which is the motion itself where its jerk is constant in the interval. So a few rows are enough: `longest_interval` finds the longest
interval, a whole number of interpolation periods, with which the cubics stay within a given distance of every setpoint on every axis.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.controls.export.stream import scale_of
from planner.machine import ROTARY_AXES
from planner.motion.trajectory import Trajectory

WITHIN = 1e-3  # [mm]: a thousandth of a millimetre, below what contour tolerances are
PERIODS_MAX = 64  # interpolation periods between two rows at most: feedback and feed override need some rows
FILES = ("pvt.csv",)


def write_pvt(
    directory: Path, trajectory: Trajectory, unit: str = "mm", within: float = WITHIN
) -> tuple[int, float]:
    """Write pvt.csv into an existing directory: t [s], then position and velocity of each axis, rotary axes in degrees.

    within : largest distance of the cubics between rows from the setpoints [mm]; on rotary axes the same number in degrees

    Returns the interpolation periods between two rows, and the largest distance found [mm].

    Raises InputError for another unit than mm or inch, and for a distance that is not above 0.
    """
    scale = scale_of(trajectory, unit)
    if not within > 0:
        raise InputError(f"--within must be above 0 mm, found {within:g}")
    rotary = np.array([axis in ROTARY_AXES for axis in trajectory.axes])
    periods, miss = longest_interval(
        trajectory, np.where(rotary, within * RAD_PER_DEG * trajectory.radius, within)
    )
    rows = _rows(len(trajectory), periods)
    names = [f"{kind}{axis}" for axis in trajectory.axes for kind in ("", "v")]
    table = np.empty((len(rows), 1 + len(names)))
    table[:, 0] = trajectory.t[rows]
    table[:, 1::2] = trajectory.position[rows] * scale
    table[:, 2::2] = trajectory.velocity[rows] * scale
    with (directory / "pvt.csv").open("w", encoding="ascii", newline="") as file:
        np.savetxt(file, table, fmt="%.9f", delimiter=",", header=",".join(["t", *names]), comments="")
    return periods, miss


def longest_interval(trajectory: Trajectory, within: FloatArray) -> tuple[int, float]:
    """Interpolation periods between two rows, and by how much the cubics then miss the setpoints at most.

    within : (A,) allowed miss of each axis [mm, rad]

    Returns the number, at most `PERIODS_MAX`, and the largest miss [mm, rad].
    """
    found, miss = 1, 0.0
    periods = 2
    while periods <= min(PERIODS_MAX, max(len(trajectory) - 1, 1)):
        off = _miss(trajectory, _rows(len(trajectory), periods))
        if (off > within).any():
            break
        found, miss = periods, float(off.max())
        periods *= 2
    return found, miss


def _rows(samples: int, periods: int) -> Array:
    """Indices of every so many samples, and of the last one."""
    rows = np.arange(0, samples, periods)
    return rows if samples == 0 or rows[-1] == samples - 1 else np.append(rows, samples - 1)


def _miss(trajectory: Trajectory, rows: Array) -> FloatArray:
    """(A,) largest distance of the cubics between the rows from the setpoints."""
    t, p, v = trajectory.t, trajectory.position, trajectory.velocity
    k = np.clip(np.searchsorted(rows, np.arange(len(t)), side="right") - 1, 0, len(rows) - 2)
    a, b = rows[k], rows[k + 1]
    h = (t[b] - t[a])[:, None]
    u = (t - t[a])[:, None] / h
    cubic = (1 + 2 * u) * (1 - u) ** 2 * p[a] + u * (1 - u) ** 2 * h * v[a]
    cubic += u**2 * (3 - 2 * u) * p[b] - u**2 * (1 - u) * h * v[b]
    off: FloatArray = np.abs(cubic - p).max(axis=0)
    return off
