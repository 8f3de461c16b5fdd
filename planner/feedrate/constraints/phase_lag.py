"""The limit of the phase lag: on a circle the filtered point runs behind by feed kappa times the delay.

    feed kappa (sum_i T_i)/2 <= phi              paper 001 (par. 26)

The machine file names phi, or none (`Fir.phase_lag_max`). The judge does not look at it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.base.arrays import FloatArray
from planner.base.units import RAD_PER_DEG
from planner.feedrate.constraints.limit import Cap, Limit, over
from planner.feedrate.constraints.on_grid import Side
from planner.machine import Machine


def feed_sq_max(kappa: FloatArray, angle: float, time_constants: Sequence[FloatArray | float]) -> FloatArray:
    """(P,) feed kappa sum T/2 <= angle [rad], a bound of feed^2; T = time_constants [s]; else inf."""
    return over(angle, kappa * sum(time_constants) / 2.0) ** 2


class PhaseLag(Limit):
    """feed kappa sum T/2 <= phi, on machines with filters that name phi."""

    name, unit, order = "phase_lag", "rad", 1

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None and machine.fir.phase_lag_max is not None:
            angle = machine.fir.phase_lag_max * RAD_PER_DEG
            yield Cap(self.name, feed_sq_max(side.kappa, angle, machine.fir.time_constants))
