"""The limits of what a curve bends by, caps of x = feed^2 by the effective curvature kappa of an interval:

    kappa x <= A                        normal acceleration (paper 002, eq. (19))
    kappa x dt^2/8 <= eps_ch            chord error, dt^2/32 with cubics (eq. (19), approximate form)
    kappa x sum_i T_i^2/24 <= eps_fir   error of moving averages of lengths T_i behind the setpoints (papers 000/001, par. 21)
    feed kappa (sum_i T_i)/2 <= phi     phase lag: on a circle the filtered point runs behind by that delay (paper 001, par. 26)

A is the machine's (inf if it names none), and never more than what its axes give in the direction of the
path's normal, and what the error budget leaves of it (corners/budget.py). Between two setpoints the machine
cuts off the curve by the chord, all axes at once, where it runs "linear" and where it jumps ("hold"); a
"cubic" of both ends is off by a quarter of that at most, where the normal acceleration steps from nothing to
kappa x, as at the end of an arc. The form is rigorous, because the interpolator advances the arc length
feed*dt per period (docs/papers.md D). eps_ch and eps_fir are parts of the error budget (on_grid.py); where
the filters' error is measured (planning/optimal/behind_filters.py), what is found makes a cap of the same
name. The machine file names phi, or none (`Fir.phase_lag_max`); the judge does not look at it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.base.arrays import FloatArray
from planner.base.units import RAD_PER_DEG
from planner.corners.budget import NORMAL, chord_rate
from planner.feedrate.constraints.limit import Cap, Limit, over
from planner.feedrate.constraints.on_grid import Side
from planner.machine import Machine


def feed_sq_within(kappa: FloatArray, allowed: FloatArray | float, rate: float = 1.0) -> FloatArray:
    """(P,) kappa x rate <= allowed [mm2/s2], for curvatures (P,) [1/mm], `allowed` (P,) or a number; else inf."""
    return over(allowed, kappa * rate)


def feed_sq_of_filters(
    kappa: FloatArray, tol: FloatArray, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) kappa x sum T^2/24 <= tol [mm], averages of lengths T = time_constants [s]; else inf."""
    return over(tol, kappa * sum(T * T for T in time_constants) / 24.0)


def feed_sq_of_lag(
    kappa: FloatArray, angle: float, time_constants: Sequence[FloatArray | float]
) -> FloatArray:
    """(P,) feed kappa sum T/2 <= angle [rad], a bound of feed^2; T = time_constants [s]; else inf."""
    return over(angle, kappa * sum(time_constants) / 2.0) ** 2


class NormalAcceleration(Limit):
    """kappa x <= A, on machines that name A."""

    name, unit, order = NORMAL, "mm/s2", 2
    key = NORMAL

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.normal_acceleration is not None:
            yield Cap(self.name, feed_sq_within(side.kappa, machine.normal_acceleration))


class ChordError(Limit):
    """kappa x dt^2/8 <= eps_ch."""

    name, unit, order = "chord_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        yield Cap(self.name, feed_sq_within(side.kappa, side.tol_chord, chord_rate(machine)))


class FilterError(Limit):
    """kappa x sum T^2/24 <= eps_fir, on machines with filters."""

    name, unit, order = "filter_error", "mm", 2

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None:
            yield Cap(self.name, feed_sq_of_filters(side.kappa, side.tol_filter, machine.fir.time_constants))


class PhaseLag(Limit):
    """feed kappa sum T/2 <= phi, on machines with filters that name phi."""

    name, unit, order = "phase_lag", "rad", 1

    def on_side(self, side: Side, machine: Machine) -> Iterator[Cap]:
        if machine.fir is not None and machine.fir.phase_lag_max is not None:
            angle = machine.fir.phase_lag_max * RAD_PER_DEG
            yield Cap(self.name, feed_sq_of_lag(side.kappa, angle, machine.fir.time_constants))
