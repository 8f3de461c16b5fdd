"""The limit of the chord error: between two setpoints the machine cuts off the curve by the chord.

It does where it runs "linear" from setpoint to setpoint and where it jumps ("hold"), all axes at once. A
"cubic" of both ends is off by a quarter of that at most, where the normal acceleration steps from nothing to
kappa x, as at the end of an arc:

    kappa x dt^2/8 <= eps_ch, cubic dt^2/32      eq. (19), approximate form: rigorous, because the interpolator advances the arc
                                                 length feed*dt per period (docs/papers.md D)

eps_ch is the chord's part of the error budget (on_grid.py).
"""

from __future__ import annotations

from collections.abc import Iterator

from planner.base.arrays import FloatArray
from planner.corners.budget import chord_rate
from planner.feedrate.constraints.limit import Cap, Limit, over
from planner.feedrate.constraints.on_grid import Side
from planner.machine import Machine


def feed_sq_max(kappa: FloatArray, tol: FloatArray, rate: float) -> FloatArray:
    """(P,) kappa x rate <= tol of curvatures (P,) [1/mm], `tol` (P,) [mm], `rate` [s2]; inf on straights."""
    return over(tol, kappa * rate)


class ChordError(Limit):
    """kappa x dt^2/8 <= eps_ch."""

    name, unit, order = "chord_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        yield Cap(self.name, feed_sq_max(side.kappa, side.tol_chord, chord_rate(machine)))
