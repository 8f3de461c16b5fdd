"""Closed forms of five-axis machines: linear joints q from the controlled point p and the rotary angles, and
back.

p is what a program says with the tool centre point switched on, in coordinates that turn with the workpiece:
the tool's tip, with the tool's length L added to z as G43 does. q are the linear joints. Where both rotary
angles are 0, q = p. Rz, Rx, Ry turn right-handed; T is Rx(a) or Ry(b). R is the point of rotation.

    xyzac-trt, xyzbc-trt   q = R + d + T (Rz(c) (p - R) - d)            d = (x_offset, y_offset, z_offset + L)
    head-table             q = R + Rz(c) (p - R) + l - T l              l = (x_offset, y_offset, -(pivot_length + L))
    head-head              q = p + l - Rz(c) T l

       xyzac-trt           head-table           head-head
         | tool              |                    | c turns
       __v__               (b) tilts             (b) tilts
      [table] c turns        \\ tool               \\ tool
      (a) tilts            [table] c turns       [table] still

The first two are LinuxCNC's (src/emc/kinematics/trtfuncs.c), held against its compiled component in
tests/machine/kinematics; its 5axiskins is head-head with tilt "b" reversed. Where an axis turns the workpiece
LinuxCNC's positive direction turns it right-handed, so the tool's direction, seen from the workpiece, is

    tables  u = Rz(-c) T^-1 e_z        head-table  u = Rz(-c) T e_z        head-head  u = Rz(c) T e_z

always with u_z = cos(tilt): the pole, where c has no influence on the direction, is u = +-e_z. `reversed`
axes turn the other way.

A path gives position and derivatives of all its axes, p(s) and the angles; q(s) = f(p(s)) then has the
derivatives that the chain rule gives to third order (base/series.py), exact but for rounding.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.series import Series
from planner.machine import ROTARY_AXES, Machine
from planner.machine.parts import HEAD_HEAD, HEAD_TABLE, KinematicsData

LINEAR = ("x", "y", "z")
Vector = tuple[Any, Any, Any]


class Kinematics(Protocol):
    """Kinematics as planning needs them.

    axes : letters, x, y, z and the rotary ones; of a path of the tip and of the joints alike
    """

    @property
    def axes(self) -> tuple[str, ...]:
        """Letters of the rotary and linear axes."""
        ...

    def joints(self, place: dict[str, Any]) -> dict[str, Any]:
        """The linear joints by their letters: numbers, arrays (n,), or series of derivatives [mm, rad]."""
        ...


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Kinematics by the closed forms of the module text. `length` is the tool's length L [mm]."""

    data: KinematicsData
    length: float

    @property
    def axes(self) -> tuple[str, ...]:
        """x, y, z, the tilting axis, c."""
        return (*LINEAR, *self.data.rotary)

    def with_tool(self, length: float) -> Chain:
        """The same machine with a tool of another length [mm]."""
        return dataclasses.replace(self, length=length)

    def joints(self, place: dict[str, Any]) -> dict[str, Any]:
        """q from p and the angles: numbers, arrays (n,), series or casadi expressions [mm, rad]."""
        p = (place["x"], place["y"], place["z"])
        tilt, turn = self._angles(place)
        if self.data.type == HEAD_HEAD:
            q = _sum(_less(p, _turned(turn, self._tilted(tilt, self._tool))), self._tool)
        elif self.data.type == HEAD_TABLE:
            on_table = _sum(_turned(turn, _less(p, self._point)), self._point)
            q = _sum(_less(on_table, self._tilted(tilt, self._tool)), self._tool)
        else:
            d = self._offset
            on_table = _less(_turned(turn, _less(p, self._point)), d)
            q = _sum(_sum(self._tilted(tilt, on_table), d), self._point)
        return dict(zip(LINEAR, q, strict=True))

    def point(self, place: dict[str, Any]) -> dict[str, Any]:
        """p from the joints, x, y, z and the rotary ones: numbers, arrays (n,) or series [mm, rad]."""
        q = (place["x"], place["y"], place["z"])
        tilt, turn = self._angles(place)
        if self.data.type == HEAD_HEAD:
            p = _less(_sum(q, _turned(turn, self._tilted(tilt, self._tool))), self._tool)
        elif self.data.type == HEAD_TABLE:
            on_table = _less(_sum(q, self._tilted(tilt, self._tool)), self._tool)
            p = _sum(_turned(-turn, _less(on_table, self._point)), self._point)
        else:
            d = self._offset
            on_table = self._tilted(-tilt, _less(_less(q, d), self._point))
            p = _sum(_turned(-turn, _sum(on_table, d)), self._point)
        return dict(zip(LINEAR, p, strict=True))

    def direction(self, place: dict[str, Any]) -> Vector:
        """Unit vector along the tool, from its tip to the spindle, seen from the workpiece."""
        tilt, turn = self._angles(place)
        up = (0.0, 0.0, 1.0)
        if self.data.type == HEAD_HEAD:
            return _turned(turn, self._tilted(tilt, up))
        return _turned(-turn, self._tilted(tilt if self.data.type == HEAD_TABLE else -tilt, up))

    def angles(self, direction: FloatArray) -> FloatArray:
        """(n, 2, 2) both pairs (tilt, c) of angles for unit vectors `direction` (n, 3) along the tool [rad];
        c is 0 at the pole. c lies within -pi to pi, the tilt of the first pair within 0 to pi, that of the
        second is its negative."""
        tilt = np.arctan2(np.hypot(direction[:, 0], direction[:, 1]), direction[:, 2])
        pairs = []
        for angle in (tilt, -tilt):
            # with c = 0 the direction's x and y, for a tilt that is no pole
            place = {self.data.rotary[0]: angle, "c": 0.0}
            x0, y0, _ = (np.broadcast_to(v, tilt.shape) for v in self.direction(place))
            turned = np.arctan2(direction[:, 1], direction[:, 0]) - np.arctan2(y0, x0)
            sense = 1.0 if self.data.type == HEAD_HEAD else -1.0
            c = np.where(tilt % np.pi == 0.0, 0.0, sense * self._sign("c") * turned)
            pairs.append(np.stack([angle, c - 2.0 * np.pi * np.round(c / (2.0 * np.pi))], axis=1))
        return np.stack(pairs, axis=1)

    @property
    def _point(self) -> Vector:
        return self.data.x_rot_point, self.data.y_rot_point, self.data.z_rot_point

    @property
    def _offset(self) -> Vector:
        return self.data.x_offset, self.data.y_offset, self.data.z_offset + self.length

    @property
    def _tool(self) -> Vector:
        return self.data.x_offset, self.data.y_offset, -(self.data.pivot_length + self.length)

    def _sign(self, letter: str) -> float:
        return -1.0 if letter in self.data.reversed else 1.0

    def _angles(self, place: dict[str, Any]) -> tuple[Any, Any]:
        """Right-handed angles of the tilting axis and of c."""
        tilt, turn = self.data.rotary
        return self._sign(tilt) * place[tilt], self._sign(turn) * place[turn]

    def _tilted(self, angle: Any, v: Vector) -> Vector:
        s, c = np.sin(angle), np.cos(angle)
        if self.data.rotary[0] == "a":
            return v[0], c * v[1] - s * v[2], s * v[1] + c * v[2]
        return c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]


def kinematics_of(machine: Machine, tool_length: float | None = None) -> Chain:
    """The kinematics of a machine file, with a tool of that length [mm], or that of the table [kinematics].
    Raises InputError if the machine has none."""
    if machine.kinematics is None:
        said = "the tool centre point needs a table [kinematics] with type and offsets"
        raise InputError(f"machine '{machine.name}' has no kinematics: {said}")
    length = machine.kinematics.tool_length if tool_length is None else tool_length
    return Chain(data=machine.kinematics, length=length)


def _turned(angle: Any, v: Vector) -> Vector:
    s, c = np.sin(angle), np.cos(angle)
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


def _sum(v: Vector, w: Vector) -> Vector:
    return v[0] + w[0], v[1] + w[1], v[2] + w[2]


def _less(v: Vector, w: Vector) -> Vector:
    return v[0] - w[0], v[1] - w[1], v[2] - w[2]


def along(
    carried: Callable[[dict[str, Any]], dict[str, Any]],
    axes: tuple[str, ...],
    motion: FloatArray,
    radius: float = 1.0,
) -> FloatArray:
    """(4, n, A) what is `carried`, `Kinematics.joints` or `Chain.point`, rotary axes as they are, and its first three
    derivatives with respect to what those of `motion` (4, n, A) are with respect to: path length or time.

    radius : at which the angles of rotary axes are lengths [mm]; at 1 mm they are in rad
    """
    table = np.asarray(motion, dtype=np.float64)
    columns = {letter: Series(table[:, :, k]) for k, letter in enumerate(axes)}
    found = carried(in_rad(columns, radius))
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
