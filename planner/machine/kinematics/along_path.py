"""The joints along a path of the tip, and the tip along one of the joints, with their first three
derivatives.

A path gives position and derivatives of all its axes, p(s) and the angles; q(s) = f(p(s)) then has the
derivatives that the chain rule gives to third order (base/series.py), exact but for rounding.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.series import Series
from planner.machine import ROTARY_AXES
from planner.machine.kinematics.chain import LINEAR, Chain, Kinematics


def joints_along(
    kinematics: Kinematics, axes: tuple[str, ...], motion: FloatArray, radius: float = 1.0
) -> FloatArray:
    """(4, n, A) the joints of the axes, rotary ones as they are, and their first three derivatives with
    respect to what those of `motion` (4, n, A) are with respect to: path length or time.

    radius : at which the angles of rotary axes are lengths [mm]; at 1 mm they are in rad
    """
    return _along(kinematics.joints, axes, motion, radius)


def points_along(chain: Chain, axes: tuple[str, ...], motion: FloatArray, radius: float = 1.0) -> FloatArray:
    """(4, n, A) the controlled point for a `motion` (4, n, A) of the joints; else as `joints_along`."""
    return _along(chain.point, axes, motion, radius)


def _along(
    function: Callable[[dict[str, Any]], dict[str, Any]],
    axes: tuple[str, ...],
    motion: FloatArray,
    radius: float,
) -> FloatArray:
    table = np.asarray(motion, dtype=np.float64)
    columns = {letter: Series(table[:, :, k]) for k, letter in enumerate(axes)}
    found = function(in_rad(columns, radius))
    out = table.copy()
    for k, letter in enumerate(axes):
        if letter in LINEAR:
            out[:, :, k] = found[letter].derivatives
    return out


def in_rad(columns: dict[str, Any], radius: float) -> dict[str, Any]:
    """Columns by the letters of axes with rotary ones in rad instead of lengths at a radius [mm]."""
    if radius == 1.0:
        return columns
    return {letter: c * (1.0 / radius) if letter in ROTARY_AXES else c for letter, c in columns.items()}
