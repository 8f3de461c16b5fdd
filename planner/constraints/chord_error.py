"""The limit of the chord error: between two setpoints the machine runs along the chord, which cuts off the curve.

    kappa x dt^2/8 <= eps_ch                     eq. (19), approximate form: rigorous, because the interpolator advances the arc
                                                 length feed*dt per period (docs/papers.md D)

eps_ch is the chord's part of the error budget (on_grid.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from planner.base.arrays import FloatArray
from planner.constraints.limit import Cap, Limit, over
from planner.machine import Machine

if TYPE_CHECKING:
    from planner.constraints.on_grid import Side


def rate(machine: Machine) -> float:
    """dt^2/8 [s2]: chord error per unit of normal acceleration."""
    return machine.dt**2 / 8.0


def feed_sq_max(kappa: FloatArray, tol: FloatArray, dt: float) -> FloatArray:
    """(P,) kappa x dt^2/8 <= tol for curvatures (P,) [1/mm], tolerances (P,) [mm] and the period dt [s]; inf on straights [mm2/s2]."""
    return over(tol, kappa * dt**2 / 8.0)


class ChordError(Limit):
    """kappa x dt^2/8 <= eps_ch."""

    name, unit, order = "chord_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        yield Cap(self.name, feed_sq_max(side.kappa, side.tol_chord, machine.dt))
