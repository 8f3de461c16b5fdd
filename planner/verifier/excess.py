"""The faults of a motion (`Fault`), and where and when it exceeds something (`Excess`): data."""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.pieces import RATIO_ROUNDING


class Kind(StrEnum):
    """The subject of a fault."""

    SAMPLES = "samples"  # periods, columns, rest at both ends
    DIGITS = "digits"  # too few to judge a quantity
    LIMIT = "limit"  # of an axis, the feed, the normal acceleration, one's own, the extruder
    CONTOUR = "contour"
    VERTEX = "vertex"
    ORDER = "order"  # blocks left out, in another order, or the ends elsewhere
    STOP = "stop"  # full stops and dwells
    EXACT = "exact path"
    THREAD = "thread"
    EXTRUDER = "extruder"
    TRAVEL = "travel"  # of an axis
    FILTERS = "after the filters"
    CORNER_SPEED = "eq. 19"
    CORNER_BUDGET = "eq. 18"


FAULTS_OF_A_KIND = 5  # spelled out; the rest are counted


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a motion; as text its sentence.

    kind  : what it is about
    name  : the quantity or the rule: "jerk.x", "feed", "vertex", "stop", "eq. 19", ...
    found : what was found there, what is allowed, and where, in words
    ratio : value over what is allowed [-]; None where it is no matter of size
    time  : of its place in the motion [s]; None where it has none
    line  : NC line of its place; None where it has none
    """

    kind: Kind
    name: str
    found: str
    _: KW_ONLY
    ratio: float | None = None
    time: float | None = None
    line: int | None = None

    @property
    def sentence(self) -> str:
        """Name and finding: "jerk.x: 1200 mm/s3, 1.2 of the limit 1000 mm/s3 at t = 0.1 s, X1, line 3"."""
        return f"{self.name}: {self.found}"

    def __str__(self) -> str:
        return self.sentence


def first_of(places: Sequence[Any] | Array, fault: Callable[[Any], Fault], of: str) -> list[Fault]:
    """The faults at the first few of some places (n,), and one that tells how many there are in all, if these
    are not all of them; `of` says of what."""
    said = [fault(place) for place in places[:FAULTS_OF_A_KIND]]
    if len(said) < len(places):
        said.append(Fault(said[0].kind, said[0].name, f"{len(places)} {of} in all"))
    return said


def placed(axes: tuple[str, ...], position: FloatArray) -> str:
    """A `position` (A,) in words: "x1 y2.5"."""
    return " ".join(f"{letter}{value:.6g}" for letter, value in zip(axes, position, strict=True))


# What an error of the chords between samples alone can break.
OF_CHORDS = frozenset({Kind.CONTOUR, Kind.VERTEX, Kind.CORNER_BUDGET})

# The quantities of limits.py by `Spans.column`, and by which power of a slower pace each gets less.
NAMES = ("velocity", "acceleration", "jerk", "feed", "normal_acceleration", "power")
POWERS = (1, 2, 3, 1, 2, 3)
APART = 3  # samples: those that are not further apart are of one span
SPANS_MAX = 20_000  # of a reading; a motion with more is broken everywhere


@dataclass(frozen=True, kw_only=True)
class Excess:
    """A span of time in which a motion exceeds a limit or the tolerance."""

    kind: Kind  # what the fault is about
    # the quantity: "jerk", "feed", "contour", "eq. 18", ...; of limits of one's own "velocity.NAME"
    name: str
    begin: float  # when it is first seen [s]
    end: float  # when it is last seen [s]
    ratio: float  # the largest value over what is allowed [-], > 1
    power: int  # a motion that is f times slower there has 1/f^power of it
    still: float = 0.0  # share of what is allowed that does not get less: the path's own error [-]

    @property
    def slower(self) -> float:
        """By how much slower the motion would have to be there [-]; inf where that does not help."""
        if self.still >= 1.0:
            return float("inf")
        return float(((self.ratio - self.still) / (1.0 - self.still)) ** (1.0 / self.power))


@dataclass
class Spans:
    """Spans of consecutive samples above a limit, as they are read."""

    column: list[int] = field(default_factory=list)  # which quantity each is of (`NAMES`)
    begin: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    ratio: list[float] = field(default_factory=list)

    def add(self, column: int, t: FloatArray, over: FloatArray) -> None:
        """The spans of a quantity in samples at t (n,) [s] with ratios `over` (n,) [-], 0 where nothing is exceeded."""
        at = np.flatnonzero(over)
        first = np.flatnonzero(np.diff(at, prepend=-APART - 1) > APART)
        last = np.append(first[1:], len(at)) - 1
        room = max(SPANS_MAX - len(self.begin), 0)
        self.column += [column] * min(len(first), room)
        self.begin += t[at[first]][:room].tolist()
        self.end += t[at[last]][:room].tolist()
        self.ratio += np.maximum.reduceat(over[at], first)[:room].tolist()

    def excesses(self, not_limited: tuple[str, ...]) -> list[Excess]:
        """All of them but those of quantities that are reported only."""
        return [
            Excess(kind=Kind.LIMIT, name=NAMES[c], begin=begin, end=end, ratio=ratio, power=POWERS[c])
            for c, begin, end, ratio in zip(self.column, self.begin, self.end, self.ratio, strict=True)
            if NAMES[c] not in not_limited
        ]


def above(ratio: FloatArray) -> FloatArray:
    """(n,) of a `ratio` (n,) [-] what is above 1 by more than rounding, 0 elsewhere."""
    return np.where(ratio > 1.0 + RATIO_ROUNDING, ratio, 0.0)


def of_place(kind: Kind, time: float, ratio: float, power: int, still: float = 0.0) -> Excess:
    """Of an error at one time [s]; the rest as of `Excess`."""
    return Excess(kind=kind, name=kind.value, begin=time, end=time, ratio=ratio, power=power, still=still)


def of_check(name: str, span: tuple[float, float], ratio: float) -> Excess:
    """Of a quantity, "jerk.e" for example, of which its largest ratio in the `span` [s] is known."""
    power = POWERS[NAMES.index(name.partition(".")[0])]
    return Excess(kind=Kind.LIMIT, name=name, begin=span[0], end=span[1], ratio=ratio, power=power)
