"""Step and direction pulses of a trajectory (paper 003's synchronisation of axes, corrected).

Every axis counts its own pulses. Between two samples its position is the cubic with the samples' positions
and velocities, which is the motion itself wherever the jerk is constant over the period. With the resolution
K [pulses per mm] and the counter c, both relative to the start, a pulse is sent at the moment at which

    K x(t) = c + 1/2 + H   (up)        K x(t) = c - 1/2 - H   (down),

so that |K x(t) - c| <= 1/2 + H < 1 at every instant, on all axes, however long the job is: what a period
leaves over stays in the position and is never added up. The numbers of pulses per period are n_k = c_k -
c_{k-1}. H keeps an axis that stands on the edge between two counts from sending pulses up and down.

The paper floors the long axis' pulses, n'_x = floor(T V_x), and carries the short axis' remainder as a time
(eq. (10)-(12)): the first loses up to a pulse per period, the second drifts when the speed changes
(benchmarks/solvers/pulse_variants.py).
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.errors import InputError
from planner.base.kernels import njit
from planner.base.units import RAD_PER_DEG
from planner.machine import ROTARY_AXES
from planner.motion.trajectory import Trajectory

HYSTERESIS = 0.05  # H [pulses]; the rounding of coordinates is 1e-10 of a pulse
PULSES_MAX = 2e8  # more pulses than this are refused: in memory and in a file they fill gigabytes
GAP_MIN = 1e-12  # [s] the rounding of times; two pulses are never closer
SOLVE_STEPS = 60  # Newton on a monotone cubic, safeguarded by bisection
TIME_ROUNDING, RATE_ROUNDING = 1e-13, 1e-6  # of a period: where a pulse is on it; of a rate of pulses [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisPulses:
    """The n pulses of one axis over a trajectory of T samples."""

    axis: str  # its letter
    steps: float  # pulses per mm (rotary axes: per degree)
    time: FloatArray  # (n,) when each pulse is sent [s], non-decreasing
    direction: Array  # (n,) +1 or -1
    line: Array  # (n,) source line of the NC program
    per_period: Array  # (T-1,) pulses between two samples, up minus down
    rests: bool = True  # whether the motion goes from rest to rest

    def __post_init__(self) -> None:
        pulses = len(self.time)
        freeze(self, "time", np.float64, (pulses,))
        freeze(self, "direction", np.int8, (pulses,))
        freeze(self, "line", np.int32, (pulses,))
        freeze(self, "per_period", np.int64, (None,))

    def __len__(self) -> int:
        return len(self.time)

    @property
    def count(self) -> Array:
        """(n,) counter after each pulse, 0 at the start."""
        return np.cumsum(self.direction, dtype=np.int64)

    @property
    def changes(self) -> int:
        """How often the direction changes."""
        return int((self.direction[1:] != self.direction[:-1]).sum())

    @property
    def frequency_max(self) -> float | None:
        """The reciprocal of the shortest time between two pulses [Hz]; None with fewer than two."""
        gap = np.diff(self.time)
        return float(1.0 / max(gap.min(), GAP_MIN)) if len(gap) else None


@dataclass(frozen=True, kw_only=True)
class Drive:
    """The limits of the drives' inputs.

    Raises InputError unless they are positive and finite.
    """

    frequency_max: float | None = None  # pulses per second [Hz]; None for no limit
    # shortest time that the step signal has to be high, and low, for each pulse [s]; None for no limit
    width: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("frequency_max", "Hz"), ("width", "s")):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise InputError(f"drive: {name} = {value} {unit}; it must be positive and finite")

    @property
    def gap(self) -> float:
        """Shortest time from one pulse to the next [s]."""
        return max(1.0 / self.frequency_max if self.frequency_max else 0.0, 2.0 * (self.width or 0.0))


def pulses_of(trajectory: Trajectory, steps: dict[str, float]) -> tuple[AxisPulses, ...]:
    """The pulses of every axis in `steps` [per mm, rotary axes per degree], in the trajectory's order.

    Raises InputError for a resolution that is not positive, an axis that the trajectory lacks, an axis that
    moves without having a resolution, and for more than `PULSES_MAX` pulses.
    """
    _check(trajectory, steps)
    here = [(k, steps[axis]) for k, axis in enumerate(trajectory.axes) if axis in steps]
    return tuple(_axis_pulses(trajectory, *each) for each in here)


def overrun(trains: tuple[AxisPulses, ...], drive: Drive) -> list[str]:
    """One sentence per axis whose pulses follow faster than its drive takes them; empty if none does."""
    said = []
    for train in trains:
        gap = np.diff(train.time)
        if not len(gap) or gap.min() >= drive.gap * (1.0 - RATE_ROUNDING):
            continue
        k = int(gap.argmin())
        rate = 1.0 / max(gap[k], GAP_MIN)
        text = f"axis {train.axis}, line {train.line[k]}, t = {train.time[k]:.6g} s: two pulses within {1e6 * gap[k]:.4g} us"
        if drive.frequency_max and rate > drive.frequency_max * (1.0 + RATE_ROUNDING):
            text += f", {rate:.6g} per second; the drive takes {drive.frequency_max:.6g}"
        if drive.width and gap[k] < 2.0 * drive.width * (1.0 - RATE_ROUNDING):
            text += f"; high and low for {1e6 * drive.width:.4g} us each, a pulse needs {2e6 * drive.width:.4g} us"
        said.append(text + ": fewer steps per mm, or a lower velocity of this axis in the machine file")
    return said


def _check(trajectory: Trajectory, steps: dict[str, float]) -> None:
    """Raise InputError as `pulses_of` says."""
    for axis, value in steps.items():
        if axis not in trajectory.axes:
            raise InputError(
                f"steps: the trajectory has no axis '{axis}'; it has {', '.join(trajectory.axes)}"
            )
        if not 0 < value < np.inf:
            raise InputError(f"steps: {axis} = {value}; pulses per mm must be positive and finite")
    total = 0.0
    for k, axis in enumerate(trajectory.axes):
        moved = float(np.abs(np.diff(trajectory.position[:, k])).sum())
        if axis in steps:
            total += moved * _resolution(axis, steps[axis], trajectory.radius)
        elif moved > 0:
            unit = "degrees" if axis in ROTARY_AXES else "mm"
            moved *= trajectory.in_degrees[k]
            raise InputError(f"steps: axis {axis} moves by {moved:.6g} {unit} in all; give its steps too")
    if total > PULSES_MAX:
        raise InputError(f"steps: {total:.3g} pulses; at most {PULSES_MAX:.0e} are made: split the program")


def _resolution(axis: str, steps: float, radius: float) -> float:
    """Pulses per mm, of rotary axes at a radius [mm]."""
    return steps / (radius * RAD_PER_DEG) if axis in ROTARY_AXES else steps


def _axis_pulses(trajectory: Trajectory, k: int, steps: float) -> AxisPulses:
    """The pulses of axis k."""
    K = _resolution(trajectory.axes[k], steps, trajectory.radius)
    place = K * (trajectory.position[:, k] - trajectory.position[0, k])
    rate = K * trajectory.velocity[:, k]
    per_period, number = np.zeros((2, len(trajectory) - 1), np.int64)
    total = 0
    for _ in range(2):  # to count, and to write
        time, direction = np.empty(total), np.empty(total, np.int8)
        total = _count(trajectory.t, place, rate, per_period, number, time, direction)
    return AxisPulses(
        axis=trajectory.axes[k],
        steps=steps,
        time=time,
        direction=direction,
        line=np.repeat(trajectory.line[:-1], number),
        per_period=per_period,
        rests=trajectory.from_rest_to_rest,
    )


@njit(cache=True, error_model="numpy")
def _count(t, place, rate, per_period, number, time, direction):
    """Count the pulses of an axis at `place` with `rate` (T,) [pulses, pulses/s], and write them as far as
    there is room."""
    n, counter = 0, 0
    ends = np.empty(4)
    for k in range(len(t) - 1):
        h, before, first = t[k + 1] - t[k], counter, n
        a, b, c = _cubic(place[k + 1] - place[k], rate[k] * h, rate[k + 1] * h)
        branches = _monotone(a, b, c, ends)
        for m in range(branches):
            low, high = ends[m], ends[m + 1]
            sign = 1 if _value(a, b, c, high) >= _value(a, b, c, low) else -1
            goal = place[k + 1] if m == branches - 1 else place[k] + _value(a, b, c, high)
            while sign * (goal - counter) >= 0.5 + HYSTERESIS:
                edge = counter + sign * (0.5 + HYSTERESIS) - place[k]
                low = _crossing(a, b, c, low, high, edge, sign)
                if n < len(time):
                    time[n], direction[n] = t[k] + low * h, sign
                counter += sign
                n += 1
        per_period[k], number[k] = counter - before, n - first
    return n


@njit(cache=True, error_model="numpy")
def _cubic(moved, v0, v1):
    """Coefficients a, b, c of a q^3 + b q^2 + c q on [0, 1] with the value `moved` at 1 and the slopes v0, v1
    at the ends."""
    return v0 + v1 - 2.0 * moved, 3.0 * moved - 2.0 * v0 - v1, v0


@njit(cache=True, error_model="numpy")
def _value(a, b, c, q):
    """a q^3 + b q^2 + c q."""
    return q * (c + q * (b + q * a))


@njit(cache=True, error_model="numpy")
def _monotone(a, b, c, ends):
    """Cut [0, 1] where the slope 3a q^2 + 2b q + c changes its sign; writes the ends (4,), returns how many
    branches there are."""
    ends[0], branches = 0.0, 0
    square = b * b - 3.0 * a * c
    if square > 0.0:
        root = -(b + np.copysign(np.sqrt(square), b))
        one, two = root / (3.0 * a), c / root  # inf or NaN where there is no second one
        for q in (min(one, two), max(one, two)):
            if ends[branches] < q < 1.0:
                branches += 1
                ends[branches] = q
    ends[branches + 1] = 1.0
    return branches + 1


@njit(cache=True, error_model="numpy")
def _crossing(a, b, c, low, high, edge, sign):
    """Where the cubic, monotone on [low, high] in the direction `sign`, passes `edge`."""
    q = 0.5 * (low + high)
    for _ in range(SOLVE_STEPS):
        miss = _value(a, b, c, q) - edge
        low, high = (low, q) if sign * miss >= 0.0 else (q, high)
        step = miss / (c + q * (2.0 * b + q * 3.0 * a))
        if abs(step) <= TIME_ROUNDING:
            break
        q -= step
        if not low < q < high:
            q = 0.5 * (low + high)
            if high - low <= TIME_ROUNDING:
                break
    return min(max(q, low), high)
