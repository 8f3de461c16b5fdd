"""The demands on the samples themselves: at the machine's period (of a motion known by samples alone: not far
above it), dense enough, with enough digits, in seconds, from rest to rest.

Density. Where the motion cannot be asked, nothing is known of it between two samples h apart but that it
keeps the machine's limits, if it does: per axis it is within a h^2 / 8 of the chord. At h <= dt that is the
machine's own interpolation, and the chord is what it makes of the samples. At h > dt the contour is known up
to

    bow = (h^2 / 8) |a|,    |a| the norm of the axes' limits,

and is judged only if what was seen and the bow together are within the tolerance.

Digits. Positions good to r and times good to d (at the speed v) make n-th differences good to

    2^n (r + v d) / h^n,

which `limits` takes off before it judges. Where that is as much as the limit, a motion at twice the limit
would pass: the quantity cannot be judged by the positions.

Rest. A motion that rests at its first and last sample has run, over the period h next to it, per axis at most
a h^2 / 2, and j h^3 / 6 where jerk is limited; its velocity is zero there, and with limited jerk its
acceleration too. Where a program asks for a speed at an end, the same holds of what the motion runs beside that.
A file whose last samples are missing shows that here.

Seconds. No program takes 200 times as long as at its feed, but for times in milliseconds or less.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, Kind
from planner.verifier.findings import measured
from planner.verifier.given import DERIVATIVES, Given
from planner.verifier.limits import ACCELERATION, JERK
from planner.verifier.matching import STILL
from planner.verifier.pieces import PERIOD_ROUNDING, RATIO_ROUNDING
from planner.verifier.stream import Observed
from planner.verifier.worst import ROUNDING_ULPS, Limits

# A time column in another unit [-]: so many times as long as at the programmed feed, samples so many periods
# apart. Acceleration makes a motion 1 to 50 times as long, milliseconds at least 1000 times.
TOO_SLOW, TOO_SPARSE = 200.0, 10.0
TIME_UNITS = ((1e5, 1e6, "microseconds"), (TOO_SLOW, 1e3, "milliseconds"))
# Periods of a jittering clock are up to so many times the longest right one [-]; a missing sample makes 2.
JITTER = 1.5
# A speed asked for at an end is had to so much of itself [-], a thousandth of a millimetre per second at 100 mm/s.
SPEED_ROUNDING = 1e-5
# The rounding of differences is mentioned if it is more than this share of a limit [-].
WORTH_A_WORD = 1e-3


def check_unit_of_time(trajectory: Trajectory, toolpath: Toolpath, machine: Machine) -> None:
    """Raise InputError if the times can only be milliseconds or microseconds."""
    periods = np.diff(trajectory.t)
    moving = (np.abs(np.diff(trajectory.position, axis=0)) > STILL).any(axis=1)
    if not moving.any() or np.median(periods) < TOO_SPARSE * machine.dt:
        return
    fastest = float(np.linalg.norm(machine.limits("velocity", toolpath.axes)))
    least = float((toolpath.length / np.minimum(toolpath.feed, fastest)).sum())
    ratio = float(periods[moving].sum()) / least
    for beyond, factor, unit in TIME_UNITS:
        if ratio > beyond:
            raise InputError(
                f"the times look like {unit}: samples are {np.median(periods):.6g} s apart, and the motion takes {ratio:.3g} times as "
                f"long as the program at its feed ({least:.4g} s); t must be in seconds: divide it by {factor:.0f}"
            )


class Delivered:
    """A summary of the delivered samples: periods that are not dt, both ends, and the way run [mm].

    longest : periods up to `JITTER` times it are right [s], of a motion that is known by its samples alone
              and judged at their own times; None where every period has to be dt
    ends : t, position, velocity and acceleration of the first and last two samples, of fewer than four all
    """

    def __init__(self, dt: float, given: Given, longest: float | None = None):
        self.dt, self.given, self.longest = dt, given, longest
        self.ends: dict[str, FloatArray] = {}
        self.run = 0.0
        self._wrong, self._first = 0, (0.0, 0.0)  # how many periods, and the first: when, how long
        self._last = np.empty(0), np.empty(0)  # the last period, which may be shorter: when, how long

    def take(self, chunk: Trajectory) -> None:
        """The next samples."""
        columns = {name: getattr(chunk, name) for name in ("t", "position", "velocity", "acceleration")}
        before = self.ends or {name: column[:0] for name, column in columns.items()}
        t, position = (np.concatenate([before[name][-1:], columns[name]]) for name in ("t", "position"))
        self.run += float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())
        when, periods = np.append(self._last[0], t[:-1]), np.append(self._last[1], np.diff(t))
        self._last = when[-1:], periods[-1:]
        off = periods - self.dt if self.longest is None else np.maximum(periods - JITTER * self.longest, 0.0)
        self._judge(when[:-1], off[:-1], periods[:-1])
        for name, column in columns.items():
            seen = np.concatenate([before[name], column])
            self.ends[name] = seen if len(seen) <= 4 else np.concatenate([seen[:2], seen[-2:]])

    def _judge(self, when: FloatArray, off: FloatArray, periods: FloatArray, more: float = 0.0) -> None:
        wrong = np.flatnonzero(np.abs(off) > PERIOD_ROUNDING + 2.0 * self.given.time_rounding + more)
        if len(wrong) and not self._wrong:
            self._first = float(when[wrong[0]]), float(periods[wrong[0]])
        self._wrong += len(wrong)

    def period_faults(self) -> list[Fault]:
        """Periods that are not dt."""
        when, periods = self._last
        self._last = when[:0], periods[:0]
        most = self.dt if self.longest is None else JITTER * self.longest
        self._judge(when, np.maximum(periods - most, 0.0), periods, self.given.end_rounding)
        if not self._wrong:
            return []
        time, period = self._first
        found = f"{period:.9g} s between the samples at t = {time:.6g} s and the next, dt is {self.dt:.9g} s "
        found += f"({self._wrong} such periods)"
        return [Fault(Kind.SAMPLES, "period", found, ratio=period / self.dt, time=time)]


def density(
    trajectory: Trajectory, machine: Machine, limits: Limits, budget: float, seen: float | None
) -> tuple[list[Fault], list[str]]:
    """Faults and notes about samples that are further apart than the machine's period.

    budget : smallest tolerance of the program [mm]
    seen   : largest distance of samples, chords and vertices from each other [mm]; None if it is not known
    """
    h = float(np.diff(trajectory.t).max(initial=0.0))
    if h <= machine.dt * (1.0 + RATIO_ROUNDING) + PERIOD_ROUNDING:
        return [], []
    most = float(np.linalg.norm(limits.per_axis[1]))
    bow = most * h * h / 8.0
    apart = (
        f"samples {h:.6g} s apart, the machine's period is {machine.dt:g} s: between two of them a motion within "
        f"the limits can leave their chord by {bow:.4g} mm"
    )
    if (seen or 0.0) + bow > budget:
        dense = np.sqrt(8.0 * max(budget - (seen or 0.0), 0.0) / most)
        remedy = f"sample every {dense:.3g} s" if dense > 0 else "sample every period"
        with_seen = f", beside the {seen:.4g} mm seen" if seen else ""
        found = f"too coarse to judge: {apart}{with_seen}; the tolerance is {budget:g} mm; {remedy}"
        return [Fault(Kind.SAMPLES, "samples", found)], []
    return [], [f"{apart}; velocity, acceleration and jerk are known as means over such periods only"]


def digits(
    trajectory: Trajectory, limits: Limits, given: Given, not_limited: tuple[str, ...]
) -> tuple[list[Fault], list[str]]:
    """Faults and notes about what the positions and times are too coarsely written to tell."""
    if not (limits.rounding.any() or given.time_rounding):
        return [], []
    h, axes = trajectory.dt, trajectory.axes
    speeds = np.abs(np.diff(trajectory.position, axis=0) / np.diff(trajectory.t)[:, None])
    error = limits.rounding + speeds.max(axis=0, initial=0.0) * given.time_rounding
    faults, shares = [], []
    for order, quantity in enumerate(DERIVATIVES, start=1):
        share = 2.0**order * error / h**order / limits.per_axis[order - 1]
        k = int(share.argmax())
        if share[k] >= WORTH_A_WORD:
            shares.append(f"{quantity}.{axes[k]} to {100 * share[k]:.2g} % of its limit")
        if share[k] >= 1.0 and quantity not in given.columns and quantity not in not_limited:
            found = (
                f"too few digits to judge {quantity}.{axes[k]}: positions good to {error[k]:.2g} mm every {h:g} s leave it "
                f"unknown to {share[k]:.3g} times its limit; write more digits, or report it unjudged: --not-limited {quantity}"
            )
            faults.append(Fault(Kind.DIGITS, "samples", found))
    if not shares:
        return faults, []
    said = f"positions are written to {error.max():.2g} mm"
    return faults, [f"{said}: their differences know {', '.join(shares)}"]


def rest_faults(
    delivered: Delivered, readings: list[Observed], limits: Limits, velocities: FloatArray
) -> list[Fault]:
    """A first or last sample that is not at rest, or not at the `velocities` (2, A) that the program asks for there [mm/s]."""
    t, x, given, axes = delivered.ends["t"], delivered.ends["position"], delivered.given, limits.axes
    if len(t) < 2:
        return []
    acceleration = limits.per_axis[1] * np.maximum(1.0, measured(readings, ACCELERATION))
    jerk = limits.per_axis[2] * np.maximum(1.0, measured(readings, JERK))
    said = []
    for name, at, beside, advice in (("start", 0, 1, ""), ("end", -1, -2, ": are the last samples missing?")):
        asked = velocities[at]
        wrong = "not at the speed asked for" if asked.any() else "not at rest"
        h = abs(float(t[at] - t[beside])) + given.end_rounding + 2.0 * given.time_rounding
        furthest = acceleration * h * h / 2.0
        if limits.jerk_limited:
            furthest = np.minimum(furthest, jerk * h**3 / 6.0)
        rounding = ROUNDING_ULPS * 2.0**-52 * (np.abs(x[at]) + delivered.run + limits.per_axis[0] * t[at])
        rounding += np.abs(asked) * (given.end_rounding + given.time_rounding + SPEED_ROUNDING * h)
        moved = np.abs(x[at] - x[beside] - asked * (t[at] - t[beside]))
        over = moved - furthest * (1.0 + RATIO_ROUNDING) - 2.0 * (rounding + limits.rounding)
        k = int(over.argmax())
        if over[k] > 0:
            more = "more or less " if asked.any() else ""
            found = (
                f"{wrong}: {axes[k]} moves by {moved[k]:.4g} mm {more}in the period of {h:.4g} s next to it, "
            )
            found += f"{furthest[k]:.4g} mm are possible{advice}"
            said.append(Fault(Kind.SAMPLES, name, found, time=float(t[at])))
        columns = (
            [("velocity", asked), ("acceleration", 0.0 * asked)]
            if limits.jerk_limited
            else [("velocity", asked)]
        )
        for (quantity, wanted), limit in zip(columns, limits.per_axis, strict=False):
            seen = delivered.ends[quantity][at]
            value, allowed = np.abs(seen - wanted), RATIO_ROUNDING * limit + SPEED_ROUNDING * np.abs(wanted)
            k = int((value / allowed).argmax())
            if quantity in given.columns and value[k] > allowed[k]:
                found = f"{wrong}: {quantity}.{axes[k]} is {seen[k]:.4g} at t = {t[at]:.6g} s{advice}"
                said.append(Fault(Kind.SAMPLES, name, found, time=float(t[at])))
    return said
