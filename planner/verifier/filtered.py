"""The delivered setpoints behind the machine's own filters, `[fir]`: moving averages in the drive.

Between the setpoints the machine moves as its file says (`Signal`). A moving average of length T makes of
that signal x(t) the mean of the last T seconds,

    y(t) = (I(t) - I(t - T)) / T,     I' = x,          y'(t) = (x(t) - x(t - T)) / T,

and several are applied one after the other. Before its start and after its end the motion rests, so the
result goes on for the delay Td = sum T_i after the end, and arrives exactly where the motion does.

The longest filter comes first: of it the integral is exact, at any time. For the others y is known at times h
apart with its derivative, and taken as a cubic between them; those y are the next filter's x. A cubic misses
a jump a of the second derivative by at most h^2 a / 32, and a jump v of the first by h v / 8; a moving
average leaves h / T of either, and h <= T/8 (T/32 with "hold"). A chord that turns by the speed v makes a =
v/T1, a setpoint that jumps by d makes a jump d/T1 of the first derivative, and T1 is the longest filter: some
nanometres, and with "hold" on the way of the motion (measured in tests/verifier/test_filtered.py). The
integrals begin anew in every chunk: no digit is lost in long motions.

The filtered motion is matched with the path like any other (matching.py); a full stop is a vertex, at which it need
not rest. Limits are judged on the setpoints: a mean never exceeds what it is the mean of. Nothing else is looked at, so
that the verdict of a plan and that on its file have the same numbers here.

With setpoints p0 and p1 at the ends of a period h, velocities v0 and v1, and its share w,

    linear   p0 + w (p1 - p0)
    cubic    p0 + w (b + w ((3 c - 2 b - d) + w (b + d - 2 c))),   b = h v0, d = h v1, c = p1 - p0:  the cubic of both ends
    hold     p0

before the first setpoint that one, and after the last one that. The periods need not be equal. Where a
velocity was not delivered, it is what whoever read the positions derived from them.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.verifier import contour, findings
from planner.verifier.excess import Kind
from planner.verifier.pieces import ProgramPieces
from planner.verifier.stream import Observed, follow
from planner.verifier.verdict import AfterFilters

NOTE = "after the filters"
STEPS_PER_PERIOD, STEPS_PER_FILTER = 4, 8  # of the times at which filters are evaluated (module text)
# In the shortest filter, where setpoints jump: the mean then has kinks, which chords cut off.
STEPS_OF_HELD = 32
CHUNK = SIZES.filtered_at_once


def filtered(
    trajectory: Trajectory, interpolation: str, filters: tuple[float, ...], dt: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times (T,), positions (T, A) of setpoints behind moving averages, in chunks, until they are empty.

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
        (late, late_area, origin), (early, early_area, _) = signal.at(t), signal.at(t - first_of_all)
        x, v = (late_area - early_area) / first_of_all, (late - early) / first_of_all
        for T in others:
            x, v = _mean(x, v, h, T)
        yield t[before:], x + origin


def _mean(x: FloatArray, v: FloatArray, h: float, T: float) -> tuple[FloatArray, FloatArray]:
    """Mean over the last T of a motion at times h apart, and its derivative; from where that is known on."""
    behind = int(np.ceil(T / h))
    origin = x[0].copy()
    x = x - origin
    area = h * (x[:-1] + x[1:]) / 2.0 + h * h * (v[:-1] - v[1:]) / 12.0
    integral = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(area, axis=0)])
    # T ago lies in the interval that begins `behind` steps ago, at the share w of it.
    w = behind - T / h
    p, q = x[:-behind], x[1 : len(x) - behind + 1]
    dp, dq = h * v[:-behind], h * v[1 : len(x) - behind + 1]
    part = p * (w - w**3 + w**4 / 2) + q * (w**3 - w**4 / 2)
    part = part + dp * (w**2 / 2 - 2 * w**3 / 3 + w**4 / 4) + dq * (w**4 / 4 - w**3 / 3)
    value = p * (1 - 3 * w**2 + 2 * w**3) + q * (3 * w**2 - 2 * w**3)
    value = value + dp * (w - 2 * w**2 + w**3) + dq * (w**3 - w**2)
    mean = (integral[behind:] - integral[:-behind] - h * part) / T
    return mean + origin, (x[behind:] - value) / T


def after_filters(
    trajectory: Trajectory, toolpath: Toolpath, machine: Machine, pieces: ProgramPieces
) -> AfterFilters | None:
    """The errors behind the machine's filters; None for a machine without."""
    if machine.fir is None:
        return None
    lengths = machine.fir.time_constants

    def read(pieces: ProgramPieces) -> list[Observed]:
        return [follow(filtered(trajectory, machine.interpolation, lengths, machine.dt), pieces, NOTE)]

    readings = read(pieces)
    apart = contour.apart(readings, pieces, read)
    check = apart.contour_check(toolpath)
    faults = [check.fault(Kind.FILTERS, toolpath.axes)] if check.broken else []
    faults += apart.vertex_faults(toolpath)
    faults += findings.unvisited(readings, toolpath, pieces)[1]
    faults = faults or findings.out_of_order(readings, toolpath, pieces)
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


# By how much the way between setpoints may leave a motion whose acceleration steps by a within a period h,
# over a h^2: chords, and cubics of both ends (less where the acceleration changes steadily).
CHORD_BOW, CUBIC_BOW = 1.0 / 8.0, 1.0 / 32.0


def bow_share(machine: Machine) -> float:
    """The bow between setpoints over a h^2 [-]."""
    return CUBIC_BOW if machine.interpolation == "cubic" else CHORD_BOW


class Signal:
    """The signal of setpoints, chunk by chunk; only what is asked for next is kept."""

    def __init__(self, trajectory: Trajectory, interpolation: str):
        self._chunks = trajectory.chunks()
        self._interpolation = interpolation
        self._begin = np.nan
        self._t, self._p, self._v = np.empty(0), np.empty((0, 0)), np.empty((0, 0))
        self._areas = np.empty((0, 0))

    def take(self, begin: float, end: float) -> None:
        """Keep what times from `begin`, which never goes back, to `end` [s] need, from the first setpoint."""
        kept = [(self._t, self._p, self._v)] if len(self._t) else []
        last = self._t[-1] if kept else -np.inf
        while last < end and (chunk := next(self._chunks, None)) is not None:
            if np.isnan(self._begin):
                self._begin = float(chunk.t[0])
            kept.append((chunk.t - self._begin, chunk.position, chunk.velocity))
            last = kept[-1][0][-1]
        self._t, self._p, self._v = (np.concatenate(columns) for columns in zip(*kept, strict=True))
        low = max(int(np.searchsorted(self._t, begin, side="right")) - 1, 0)
        self._t, self._p, self._v = self._t[low:], self._p[low:], self._v[low:]
        k = np.arange(len(self._t) - 1)
        _, areas = self._between(k, np.ones(len(k)))
        self._areas = np.concatenate([np.zeros((1, self._p.shape[1])), np.cumsum(areas, axis=0)])

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """At ascending times (T,) [s] of those that were taken the signal less an origin (T, A) [mm], its integral from
        the first setpoint kept (T, A) [mm s], and the origin (A,) [mm]."""
        t, origin = self._t, self._p[0]
        k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, max(len(t) - 2, 0))
        inside = np.clip(times, t[0], t[-1])
        beyond = (times - inside)[:, None]
        if len(t) < 2:
            return (*np.zeros((2, len(times), len(origin))), origin)
        place, part = self._between(k, (inside - t[k]) / (t[k + 1] - t[k]))
        ended = times >= t[-1]
        place[ended] = self._p[-1] - origin
        return place, self._areas[k] + part + beyond * place, origin

    def _between(self, k: Array, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places (n, A) at the shares w (n,) of the periods k (n,), less the origin, and their integrals."""
        h = (self._t[k + 1] - self._t[k])[:, None]
        p0, p1 = self._p[k] - self._p[0], self._p[k + 1] - self._p[0]
        w, c, b, d = w[:, None], p1 - p0, h * self._v[k], h * self._v[k + 1]
        if self._interpolation == "hold":
            return p0, h * (w * p0)
        if self._interpolation == "linear":
            return p0 + w * c, h * (w * (p0 + w * c / 2))
        square, cube = 3 * c - 2 * b - d, b + d - 2 * c
        place, area = b + w * (square + w * cube), p0 + w * (b / 2 + w * (square / 3 + w * cube / 4))
        return p0 + w * place, h * (w * area)
