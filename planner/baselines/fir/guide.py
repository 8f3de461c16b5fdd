"""The guides that filters are led along: straight legs between joints, in runs between full stops.

Filters are empty at a full stop, so every run may have its own. Paper 000 runs along the program itself: arcs
become chords, collinear lines of one feed are one leg. Paper 001 runs along the fine chords of a smooth path
(chord_guide.py).

Records over a guide have columns, one row per run, leg or joint: checked, picked for some runs and put back.
"""

import dataclasses
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.errors import InputError
from planner.geometry.chords import chorded, parted_by_feed
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine

# Fraction of the tolerance that chords of arcs may use [-]: the filters' error grows with feed^2.
CHORD_FRACTION = 0.05
AXES = (-1,)  # width of a column for every axis


def per(rows: str, dtype: type = np.float64, *, width: tuple[int, ...] = (), finite: bool = True) -> Any:
    """A field with a row per "run", "leg" or "joint": (n, *width); with `finite=False` infinity is allowed."""
    return field(metadata={"rows": rows, "dtype": dtype, "width": width, "finite": finite})


def _columns(record: Any) -> list[tuple[str, Any]]:
    """Names and metadata of the columns of a record."""
    return [(one.name, one.metadata) for one in fields(record) if "rows" in one.metadata]


def freeze_columns(record: Any, sizes: dict[str, int], axes: int) -> None:
    """Check the columns of a record with `sizes` rows per "run", "leg" and "joint", and make them read-only.

    Raises ValueError for a column of another shape, or one that is not finite and should be.
    """
    for name, of in _columns(record):
        width = (axes,) if of["width"] == AXES else of["width"]
        freeze(record, name, of["dtype"], (sizes[of["rows"]], *width), finite=of["finite"])


def chosen_rows(first: Array, chosen: Array) -> dict[str, Array]:
    """Indices (n,) of the rows, per "run", "leg" and "joint", of the runs `chosen` (S,), one at least; `first` (S+1,)
    as of `Guide`."""
    run = np.flatnonzero(chosen)
    legs = np.flatnonzero(np.repeat(chosen, np.diff(first)))
    return {"run": run, "leg": legs, "joint": np.append(legs, first[run[-1] + 1])}


def picked(record: Any, rows: dict[str, Array]) -> dict[str, Any]:
    """The given rows (n,) of "run", "leg" and "joint" (`chosen_rows`) of all columns, by name."""
    return {name: getattr(record, name)[rows[of["rows"]]] for name, of in _columns(record)}


def put_back(record: Any, rows: dict[str, Array], chosen: Any) -> dict[str, Any]:
    """All columns of a record by name, with those `rows` (n,) (`chosen_rows`) that the record `chosen` has alone; the
    joint at a run's end is the next run's."""
    columns: dict[str, Any] = {}
    for name, of in _columns(record):
        last = -1 if of["rows"] == "joint" else None
        columns[name] = getattr(record, name).copy()
        columns[name][rows[of["rows"]][:last]] = getattr(chosen, name)[:last]
    return columns


class Line(NamedTuple):
    """The fields of a `Guide` that kernels measure along."""

    s: FloatArray
    point: FloatArray
    direction: FloatArray
    budget: FloatArray
    inner: Array


def check_profile_filters(times: tuple[float, float] | None) -> None:
    """Raise InputError for profile filters that are not two positive lengths."""
    if times is not None and (len(times) != 2 or not all(0 < T < np.inf for T in times)):
        raise InputError(
            f"profile_filters = {', '.join(f'{T:g}' for T in times) or 'none'}; give two lengths [s], positive and finite, "
            "or None: then the method chooses them"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Guide(ABC):
    """R straight legs over A axes, R+1 joints, S runs; run k: joints first[k] .. first[k+1], ends are full stops."""

    axes: tuple[str, ...]  # axis letters
    # lengths of the two filters that every run has [s]; None to choose them
    profile_filters: tuple[float, float] | None = None
    first: Array  # (S+1,) first joint of each run, and the last joint of all
    dwell: FloatArray  # (S+1,) standstill before the first run and after each [s]
    point: FloatArray = per("joint", width=AXES)  # (R+1, A) the joints [mm]
    s: FloatArray = per("joint")  # (R+1,) length from the start [mm]
    length: FloatArray = per("leg")  # (R,) [mm]
    direction: FloatArray = per("leg", width=AXES)  # (R, A) unit vectors
    # (R,) programmed feed, at most what the axes' velocities allow along the leg [mm/s]
    feed: FloatArray = per("leg")

    def __post_init__(self) -> None:
        freeze(self, "first", np.int64, (None,))
        freeze(self, "dwell", np.float64, (len(self.first),))
        legs = len(self.length)
        freeze_columns(self, {"leg": legs, "joint": legs + 1}, len(self.axes))

    def __len__(self) -> int:
        return len(self.length)

    @property
    @abstractmethod
    def budget(self) -> FloatArray:
        """(R, 2) what filters and interpolation may use of the tolerance on both halves of each leg [mm]."""

    @property
    def runs(self) -> int:
        """S, the number of runs."""
        return len(self.first) - 1

    @cached_property
    def run(self) -> Array:
        """(R,) run of each leg."""
        return np.repeat(np.arange(self.runs), np.diff(self.first))

    @cached_property
    def inner(self) -> Array:
        """(R+1,) True at joints that are no full stops."""
        inner = np.ones(len(self) + 1, bool)
        inner[self.first] = False
        return inner

    @cached_property
    def line(self) -> Line:
        """The same for the kernels."""
        return Line(self.s, self.point, self.direction, self.budget, self.inner)

    def largest(self, value: FloatArray) -> FloatArray:
        """(S,) the largest of a value per leg (R,) in each run."""
        return np.maximum.reduceat(value, self.first[:-1])

    def total(self, value: FloatArray) -> FloatArray:
        """(S,) the sum of a value per leg (R,) over each run."""
        return np.add.reduceat(value, self.first[:-1])

    def given_filters(self) -> tuple[FloatArray, FloatArray]:
        """T1 >= T2 (S,) [s]: the `profile_filters` for every run."""
        T2, T1 = sorted(self.profile_filters or (0.0, 0.0))
        return np.full(self.runs, T1), np.full(self.runs, T2)

    def pick(self, chosen: Array) -> Self:
        """The runs `chosen` (S,), each behind the one before, without dwells: good for planning only."""
        columns = picked(self, chosen_rows(self.first, chosen))
        along = np.cumsum(columns["length"][:, None] * columns["direction"], axis=0)
        columns["point"] = np.vstack([np.zeros((1, len(self.axes))), along])
        columns["s"] = np.concatenate([[0.0], np.cumsum(columns["length"])])
        first = np.concatenate([[0], np.cumsum(np.diff(self.first)[chosen])])
        return dataclasses.replace(self, first=first, dwell=np.zeros(len(first)), **columns)


@dataclass(frozen=True, eq=False, kw_only=True)
class LegGuide(Guide):
    """The legs of a program, with what paper 000's rules need of them."""

    lines: Toolpath  # the toolpath with its arcs as chords
    joint_at: Array = per("joint", np.int64)  # (R+1,) index of each joint among those of `lines`
    slower: Array = per("leg", np.bool_)  # (R,) True where another leg of the run is programmed faster
    a_max: FloatArray = per("leg")  # (R,) acceleration along the leg that the axes allow [mm/s2]
    j_max: FloatArray = per("leg")  # (R,) jerk along the leg that the axes allow [mm/s3]
    tol: FloatArray = per("joint")  # (R+1,) contour error budget at the joint [mm]
    sin_half: FloatArray = per("joint")  # (R+1,) sine of half the turning angle at the joint, 0 at full stops

    @property
    def budget(self) -> FloatArray:
        """(R, 2) the tolerance of the nearer joint [mm]."""
        return np.stack([self.tol[:-1], self.tol[1:]], axis=1)

    def stopping(self, joints: Array) -> Self:
        """The same guide with full stops, without dwells, at the joints (n,) too."""
        first = np.union1d(self.first, joints)
        dwell = np.zeros(len(first))
        dwell[np.searchsorted(first, self.first)] = self.dwell
        sin_half = self.sin_half.copy()
        sin_half[joints] = 0.0
        return dataclasses.replace(self, first=first, dwell=dwell, sin_half=sin_half)


def guide_of_legs(
    toolpath: Toolpath, machine: Machine, profile_filters: tuple[float, float] | None = None
) -> LegGuide:
    """The legs of a toolpath; `profile_filters` as of `Guide`."""
    lines = chorded(toolpath, CHORD_FRACTION, np.zeros(len(toolpath), bool))
    legs = legs_of(parted_by_feed(lines))
    at = legs.first
    point = np.vstack([lines.start[at[:-1]], lines.end[-1:]])
    length = np.linalg.norm(np.diff(point, axis=0), axis=1)
    direction = np.diff(point, axis=0) / length[:, None]
    first = np.flatnonzero(lines.joint[at] == Joint.STOP)
    sin_half = np.zeros(len(point))
    sin_half[1:-1] = np.linalg.norm(np.diff(direction, axis=0), axis=1) / 2
    sin_half[first] = 0.0
    programmed = lines.feed[at[:-1]]
    most = np.repeat(np.maximum.reduceat(programmed, first[:-1]), np.diff(first))
    with np.errstate(divide="ignore", over="ignore"):  # infinite for axes that stand still
        v, a, j = (
            (machine.limits(q, lines.axes) / np.abs(direction)).min(axis=1)
            for q in ("velocity", "acceleration", "jerk")
        )
    return LegGuide(
        axes=lines.axes,
        lines=lines,
        joint_at=at,
        length=length,
        direction=direction,
        point=point,
        s=np.concatenate([[0.0], np.cumsum(length)]),
        feed=np.minimum(programmed, v),
        slower=programmed < most,
        a_max=a,
        j_max=j,
        tol=lines.tolerance[at],
        sin_half=sin_half,
        first=first,
        dwell=lines.dwell[at[first]],
        profile_filters=profile_filters,
    )
