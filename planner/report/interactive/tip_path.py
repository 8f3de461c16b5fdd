"""A program of points of the tool's tip, with directions of the tool or rotary angles: straight moves from one to the next."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.machine import Machine
from planner.machine.kinematics.chain import LINEAR, Chain, kinematics_of
from planner.machine.kinematics.directions import rotary_along
from planner.nc.points import program_of_points
from planner.nc.program import Program, no_splines


def tip_path(
    machine: Machine,
    tips: ArrayLike,
    *,
    directions: ArrayLike | None = None,
    angles: ArrayLike | None = None,
    feed: float | None = None,
    tolerance: float | None = None,
    tool_length: float | None = None,
) -> Program:
    """A program for a machine with a table [kinematics], planned on `at_tip(machine)`.

    tips        : (n, 3) x, y, z of the tip, n > 1 [mm]
    directions  : (n, 3) along the tool, from its tip to the spindle, seen from the workpiece; of any length above 0
    angles      : (n, 2) in their place: of the tilting axis and c [rad]
    feed        : of tip and angles in one norm, angles at the machine's radius [mm/s]; None for rapid moves
    tolerance   : of tip and angles in that norm [mm]; None for that of the machine
    tool_length : [mm], added to z as G43 does; None for that of the machine file

    Raises InputError for arrays of other shapes, a machine without kinematics, and as `rotary_along` does at the pole.
    """
    chain = kinematics_of(machine, tool_length)
    at = np.asarray(tips, dtype=np.float64)
    if at.ndim != 2 or at.shape[1] != len(LINEAR) or len(at) < 2 or not np.isfinite(at).all():
        raise InputError(f"tips: shape {at.shape}; (n, 3) finite numbers with n > 1 are needed")
    if (directions is None) == (angles is None):
        raise InputError("give either directions of the tool or angles")
    radius = machine.radius
    budget = machine.tolerance if tolerance is None else tolerance
    turns = (
        rotary_along(chain, np.asarray(directions, dtype=np.float64), budget / radius)
        if angles is None
        else np.asarray(angles, dtype=np.float64)
    )
    if turns.shape != (len(at), len(chain.data.rotary)) or not np.isfinite(turns).all():
        raise InputError(
            f"angles or directions: {turns.shape[0]} for {len(at)} tips; one finite row for each is needed"
        )
    return _program(chain, np.hstack([at + np.array([0.0, 0.0, chain.length]), turns]), feed, tolerance)


def _program(chain: Chain, points: FloatArray, feed: float | None, tolerance: float | None) -> Program:
    moves = len(points) - 1
    speed = np.full(moves, np.inf if feed is None else feed)
    plain = program_of_points(np.ascontiguousarray(points[:, : len(LINEAR)]), speed, tolerance)
    return dataclasses.replace(
        plain,
        axes=chain.axes,
        start=points[0],
        end=points[1:],
        arc_center=np.zeros((0, len(chain.axes))),
        splines=no_splines(len(chain.axes)),
    )
