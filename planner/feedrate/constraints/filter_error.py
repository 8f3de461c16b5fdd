"""The limit of the filters' error: moving averages of lengths T_i behind the setpoints cut curves off.

    kappa x sum_i T_i^2/24 <= eps_fir            papers 000/001 (par. 21)

eps_fir is their part of the error budget where the closed form is used (on_grid.py); elsewhere the error is
measured (planning/optimal/behind_filters.py), and what is found makes a cap of the same name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limit import Cap, Limit, over
from planner.feedrate.constraints.on_grid import Side
from planner.machine import Machine


def feed_sq_max(
    kappa: FloatArray, tol: FloatArray, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) kappa x sum T^2/24 <= tol [mm], averages of lengths T = time_constants [s]; else inf."""
    return over(tol, kappa * sum(T * T for T in time_constants) / 24.0)


class FilterError(Limit):
    """kappa x sum T^2/24 <= eps_fir, on machines with filters."""

    name, unit, order = "filter_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None:
            yield Cap(self.name, feed_sq_max(side.kappa, side.tol_filter, machine.fir.time_constants))
