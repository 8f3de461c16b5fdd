"""Kinematics of one's own as a casadi expression:

    mine = expression("xyzbc", lambda x, y, z, b, c: (x + 80 * casadi.sin(b), y, z + 80 * (casadi.cos(b) -
    1))) planner.plan(path, at_tip(machine, mine))

Derivatives along a path are those of the Taylor polynomial p + p' t + p'' t^2/2 + p''' t^3/6 put into the
expression, by casadi's automatic differentiation.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError, import_needed
from planner.base.series import Series
from planner.machine import ROTARY_AXES
from planner.machine.kinematics.chain import LINEAR


class Expression:
    """Kinematics made by `expression`."""

    def __init__(self, axes: tuple[str, ...], value: Any, jets: Any):
        self._axes, self._value, self._jets = axes, value, jets

    @property
    def axes(self) -> tuple[str, ...]:
        """Letters of the axes that it is a function of."""
        return self._axes

    def joints(self, place: dict[str, Any]) -> dict[str, Any]:
        """The linear joints by their letters at a place: numbers, arrays (n,) or series [mm, rad]."""
        columns = [place[letter] for letter in self._axes]
        if not any(isinstance(column, Series) for column in columns):
            table = np.stack(np.broadcast_arrays(*columns))
            found = self._called(self._value, table.reshape(len(columns), -1))
            return {a: found[k].reshape(table.shape[1:]) for k, a in enumerate(LINEAR)}
        jets = np.zeros((len(columns), *next(c.derivatives.shape for c in columns if isinstance(c, Series))))
        for jet, column in zip(jets, columns, strict=True):
            if isinstance(column, Series):
                jet[:] = column.derivatives
            else:
                jet[0] = column
        found = self._called(self._jets, np.concatenate(jets))
        return {a: Series(found[4 * k : 4 * k + 4]) for k, a in enumerate(LINEAR)}

    def _called(self, function: Any, columns: FloatArray) -> FloatArray:
        found = np.asarray(function(columns), dtype=np.float64)
        if not np.isfinite(found).all():
            n = int((~np.isfinite(found)).any(axis=0).argmax())
            raise InputError(f"kinematics: the expression has no value or no derivatives at place {n}")
        return found


def expression(axes: str, joints: Callable[..., Sequence[Any]]) -> Expression:
    """Kinematics from a function that makes the joints x, y, z [mm] from casadi symbols of the axes, in mm
    and rad.

    axes : letters of the path of the tip in the order of the function's arguments, such as "xyzbc"

    Raises InputError for other letters, and unless the function returns three expressions of these symbols.
    """
    casadi = import_needed("casadi", "kinematics as an expression")
    letters = tuple(axes)
    if letters[:3] != LINEAR or len(set(letters)) < len(letters) or not set(letters[3:]) <= set(ROTARY_AXES):
        known = ", ".join(ROTARY_AXES)
        raise InputError(f"kinematics: axes '{axes}'; x, y and z come first, then letters of {known}")
    p, t = casadi.SX.sym("p", len(letters)), casadi.SX.sym("t")
    given = joints(*casadi.vertsplit(p))
    if len(given) != len(LINEAR):
        said = f"kinematics: the function returns {len(given)} joints"
        raise InputError(f"{said}; it must return three: x, y, z")
    q = casadi.vertcat(*given)
    try:
        value = casadi.Function("joints", [p], [q])
    except RuntimeError:
        raise InputError("kinematics: the joints may depend on the symbols of the axes only") from None
    taylor = casadi.SX.sym("c", 4, len(letters))
    powers = casadi.vertcat(1, t, t**2 / 2, t**3 / 6)
    along = casadi.substitute(q, p, casadi.mtimes(taylor.T, powers))
    rows = []
    for k in range(len(LINEAR)):
        row = along[k]
        for _ in range(4):
            rows.append(casadi.substitute(row, t, 0.0))
            row = casadi.jacobian(row, t)
    return Expression(letters, value, casadi.Function("jets", [casadi.vec(taylor)], [casadi.vertcat(*rows)]))
