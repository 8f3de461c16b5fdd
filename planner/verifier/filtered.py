"""What the machine's own filters make of the delivered setpoints: `[fir]`, moving averages in the drive or the control behind them.

Between the setpoints the machine moves as its file says (between.py). A moving average of length T makes of that signal x(t) the mean
of the last T seconds,

    y(t) = (I(t) - I(t - T)) / T,     I' = x,          y'(t) = (x(t) - x(t - T)) / T,

and several are applied one after the other. Before its start and after its end the motion rests, so the result goes on for the
delay Td = sum T_i after the end, and arrives exactly where the motion does.

The longest filter comes first: of it the integral is exact, at any time. For the others y is known at times h apart with its
derivative, and taken as a cubic between them; those y are the next filter's x. A cubic misses a jump a of the second derivative by
at most h^2 a / 32, and a jump v of the first by h v / 8; a moving average leaves h / T of either, and h <= T/8 (T/32 with "hold").
A chord that turns by the speed v makes a = v/T1, a setpoint that jumps by d makes a jump d/T1 of the first derivative, and T1 is
the longest filter: some nanometres, and with "hold" on the way of the motion (measured in tests/verifier/test_filtered.py). The
integrals begin anew in every chunk: no digit is lost in long motions.

The filtered motion is matched with the path like any other (matching.py): contour, vertices, order. Limits are judged on the setpoints:
a mean never exceeds what it is the mean of. A full stop is a vertex like any other: the filtered motion need not rest there.

Nothing but the setpoints is looked at, whether or not the motion that they were taken from can be asked: the verdict of a plan and that
on its file have the same numbers here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.sizes import SIZES
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.verifier import contour, findings
from planner.verifier.between import Signal
from planner.verifier.excess import Kind
from planner.verifier.findings import Look
from planner.verifier.follow import follow
from planner.verifier.pieces import ProgramPieces
from planner.verifier.verdict import AfterFilters

NOTE = "after the filters"
STEPS_PER_PERIOD, STEPS_PER_FILTER = 4, 8  # of the times at which filters are evaluated (module text)
# In the shortest filter, where setpoints jump: the mean has a kink for each then, which chords between times cut off.
STEPS_OF_HELD = 32
CHUNK = SIZES.filtered_at_once


def filtered(
    trajectory: Trajectory, interpolation: str, filters: tuple[float, ...], dt: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times (T,) and positions (T, A) of setpoints behind moving averages, chunk by chunk, from their start until they are empty.

    interpolation : between the setpoints, as in the machine file
    filters       : their lengths [s], one or more
    dt            : interpolation period [s]
    """
    first_of_all, *others = sorted(filters, reverse=True)
    steps = STEPS_OF_HELD if interpolation == "hold" else STEPS_PER_FILTER
    h = min(dt / STEPS_PER_PERIOD, min(filters) / steps)
    before = sum(int(np.ceil(T / h)) for T in others)
    count = int(np.ceil((trajectory.cycle_time + sum(filters)) / h)) + 1
    signal = Signal(trajectory, interpolation)
    for first in range(0, count, CHUNK):
        t = h * np.arange(first - before, min(first + CHUNK, count), dtype=np.float64)
        signal.take(float(t[0]) - first_of_all, float(t[-1]))
        late, early = signal.at(t), signal.at(t - first_of_all)
        origin = late.origin
        x, v = (late.area - early.area) / first_of_all, (late.place - early.place) / first_of_all
        for T in others:
            x, v = _mean(x, v, h, T)
        yield t[before:], x + origin


def _mean(x: FloatArray, v: FloatArray, h: float, T: float) -> tuple[FloatArray, FloatArray]:
    """Mean over the last T of a motion at times h apart, and its derivative; from the first time on for which that is known."""
    behind = int(np.ceil(T / h))
    origin = x[0].copy()
    x = x - origin
    area = h * (x[:-1] + x[1:]) / 2.0 + h * h * (v[:-1] - v[1:]) / 12.0
    integral = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(area, axis=0)])
    # T ago lies in the interval that begins `behind` steps ago, at the share w of it.
    w = behind - T / h
    p, q = x[:-behind], x[1 : len(x) - behind + 1]
    dp, dq = h * v[:-behind], h * v[1 : len(x) - behind + 1]
    part = (
        p * (w - w**3 + w**4 / 2)
        + q * (w**3 - w**4 / 2)
        + dp * (w**2 / 2 - 2 * w**3 / 3 + w**4 / 4)
        + dq * (w**4 / 4 - w**3 / 3)
    )
    value = (
        p * (1 - 3 * w**2 + 2 * w**3)
        + q * (3 * w**2 - 2 * w**3)
        + dp * (w - 2 * w**2 + w**3)
        + dq * (w**3 - w**2)
    )
    mean = (integral[behind:] - integral[:-behind] - h * part) / T
    return mean + origin, (x[behind:] - value) / T


def after_filters(
    trajectory: Trajectory, toolpath: Toolpath, machine: Machine, pieces: ProgramPieces
) -> AfterFilters | None:
    """What the machine's filters leave of the tolerance; None for a machine without."""
    if machine.fir is None:
        return None
    lengths = machine.fir.time_constants

    def read(pieces: ProgramPieces) -> list[Look]:
        return [follow(filtered(trajectory, machine.interpolation, lengths, machine.dt), pieces, NOTE)]

    looks = read(pieces)
    apart = contour.apart(looks, pieces, read)
    check = apart.contour_check(toolpath)
    faults = [check.fault(Kind.FILTERS, toolpath.axes)] if check.broken else []
    faults += apart.vertex_faults(toolpath)
    faults += findings.order(looks, toolpath, pieces)[2]
    faults = faults or findings.out_of_order(looks, toolpath, pieces)
    return AfterFilters(
        contour=check,
        vertex=apart.vertex_check(toolpath),
        contour_error_mm=apart.contour_error(),
        vertex_error_mm=apart.vertex_error(),
        faults=tuple(replace(fault, kind=Kind.FILTERS) for fault in faults),
        excesses=tuple(
            # of what the filters took in until then
            replace(each, kind=Kind.FILTERS, begin=each.begin - sum(lengths), still=0.0)
            for each in apart.excesses()
        ),
    )
