"""The record of a motion in time: samples at the interpolation period, as the axis controllers get them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import ROTARY_AXES

COLUMNS = ("t", "position", "velocity", "acceleration", "jerk", "s", "feed", "block", "line")

# A motion rests where it is slower than this share of its fastest [-]: digits of files, velocities from differences.
AT_REST = 1e-3


class Lengths(NamedTuple):
    """Arc lengths of samples, for when they are asked for.

    of      : gives them of columns (T,) each [mm]
    columns : of the samples
    """

    of: Callable[..., FloatArray]
    columns: tuple[Array, ...]

    def __call__(self) -> FloatArray:
        """(T,) [mm]."""
        return self.of(*self.columns)

    def rows(self, k: Array | slice) -> Lengths:
        """Of the samples with ascending indices k (n,)."""
        return Lengths(self.of, tuple(column[k] for column in self.columns))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Trajectory:
    """T samples over A axes, the last at the programmed end; the period before it may be shorter than dt.

    axes         : axis letters
    dt           : interpolation period [s]
    t            : (T,) time [s], strictly increasing, t[0] = 0
    position     : (T, A) [mm]; rotary axes here and below in angles times `radius`
    velocity     : (T, A) [mm/s]
    acceleration : (T, A) [mm/s2]; where it jumps, the value after the jump
    jerk         : (T, A) [mm/s3]; where it jumps, the value after the jump
    s            : (T,) arc length along the path of the motion [mm], non-decreasing; or what gives it when it is first asked for
    feed         : (T,) ds/dt [mm/s]
    block        : (T,) index of the block of the program
    line         : (T,) NC line of that block
    radius       : at which the angles of rotary axes are lengths [mm]; at 1 mm they are in rad
    extruder     : (T, 4) place, velocity, acceleration and jerk of the extruder [mm of filament]; or (0, 4)
    """

    axes: tuple[str, ...]
    dt: float
    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    s: FloatArray
    feed: FloatArray
    block: Array
    line: Array
    radius: float = 1.0
    extruder: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))

    def __post_init__(self) -> None:
        samples, axes = len(self.t), len(self.axes)
        if isinstance(self.s, Lengths):  # a quadrature, which takes many times as long as all other columns
            object.__setattr__(self, "_length", self.s)
            object.__delattr__(self, "s")
        else:
            freeze(self, "s", np.float64, (samples,))
        freeze(self, "t feed", np.float64, (samples,))
        freeze(self, "position velocity acceleration jerk", np.float64, (samples, axes))
        freeze(self, "block", np.int64, (samples,))
        freeze(self, "line", np.int32, (samples,))
        freeze(self, "extruder", np.float64, (samples if len(self.extruder) else 0, 4))
        if not self.dt > 0:
            raise ValueError(f"Trajectory.dt: {self.dt} s; must be positive")
        if samples and not (np.diff(self.t) > 0).all():
            raise ValueError("Trajectory.t: times must increase strictly")

    def __getattr__(self, name: str) -> Any:
        if name != "s" or "_length" not in vars(self):
            raise AttributeError(name)
        object.__setattr__(self, "s", self._length())  # which stays: several threads may ask
        freeze(self, "s", np.float64, (len(self.t),))
        return self.s

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        """Setpoints, axes, period and duration, in a line."""
        end = f", {self.cycle_time:.4f} s" if len(self) else ""
        return f"<Trajectory: {len(self):,} setpoints, axes {' '.join(self.axes)}, dt {self.dt:g} s{end}>"

    @property
    def cycle_time(self) -> float:
        """Duration of the motion [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def from_rest_to_rest(self) -> bool:
        """Whether it is slower at both ends than `AT_REST` of its fastest."""
        return bool((self.feed[[0, -1]] <= AT_REST * self.feed.max()).all())

    @property
    def in_degrees(self) -> FloatArray:
        """(A,) what turns positions and their derivatives into mm and degrees."""
        return in_degrees(self.axes, self.radius)

    @property
    def length(self) -> Lengths:
        """What gives `s`, which it is not asked for here."""
        known = vars(self)
        asked = "_length" in known and "s" not in known
        return known["_length"] if asked else Lengths(np.asarray, (self.s,))

    def chunks(self) -> Iterator[Trajectory]:
        """All samples in order, one part after the other. What goes through a long motion takes its parts, so
        that only one of them has to be in memory (motion/on_demand.py)."""
        yield self

    def through(self, change: Callable[[Trajectory], Trajectory]) -> Trajectory:
        """The motion with positions and derivatives that `change` gives of any samples, each by itself."""
        return change(self)

    def rows(self, k: Array) -> Trajectory:
        """The samples with the ascending indices k (n,)."""
        columns: dict[str, Any] = {name: getattr(self, name)[k] for name in self.columns if name != "s"}
        return dataclasses.replace(self, **columns | {"s": self.length.rows(k)})

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the fields with a row for each sample."""
        return (*COLUMNS, "extruder") if len(self.extruder) else COLUMNS

    def first_not_before(self, times: FloatArray) -> Array:
        """(n,) index of the first sample at or after each of the times (n,) [s]; T where there is none."""
        return np.asarray(np.searchsorted(self.t, times))


class AnyMotion(Protocol):
    """A motion that can be asked at any time, in pieces on which everything is smooth."""

    @property
    def t(self) -> FloatArray:
        """(L,) start of each piece [s], non-decreasing."""
        ...

    @property
    def end(self) -> float:
        """End of the last piece [s]; the motion begins at 0."""
        ...

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) [s]; `dt` [s] is the trajectory's interpolation period."""
        ...


def require_rest(rests: bool) -> None:
    """Raise InputError for a motion that is not `from_rest_to_rest`: what controls and drives run is."""
    if not rests:
        raise InputError(
            "the motion begins or ends in motion, and controls and drives run files from rest to rest: plan it without "
            "start_speed and end_speed"
        )


def in_degrees(axes: tuple[str, ...], radius: float) -> FloatArray:
    """(A,) what turns lengths, and angles times `radius` [mm], into mm and degrees."""
    return np.array([1.0 / (radius * RAD_PER_DEG) if axis in ROTARY_AXES else 1.0 for axis in axes])


def joined(chunks: list[Trajectory]) -> Trajectory:
    """One trajectory of consecutive chunks; a sample that a chunk shares with the one before counts once."""
    fresh = [int(k > 0 and len(c) and c.t[0] <= chunks[k - 1].t[-1]) for k, c in enumerate(chunks)]
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(c, name)[skip:] for c, skip in zip(chunks, fresh, strict=True)])
        for name in chunks[0].columns
        if name != "s"
    }
    lengths = [c.length.rows(slice(skip, None)) for c, skip in zip(chunks, fresh, strict=True)]
    columns["s"] = _lengths_of_all(lengths)
    return dataclasses.replace(chunks[0], **columns)


def _lengths_of_all(parts: list[Lengths]) -> Lengths:
    """Of one part after the other; of parts of several motions they are asked for at once."""
    if any(part.of != parts[0].of for part in parts):
        parts = [Lengths(np.asarray, (part(),)) for part in parts]
    together = zip(*(part.columns for part in parts), strict=True)
    return Lengths(parts[0].of, tuple(np.concatenate(columns) for columns in together))
