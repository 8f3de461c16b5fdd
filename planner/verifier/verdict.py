"""The records of a judgement."""

from dataclasses import dataclass
from typing import Any

from planner.base.arrays import FloatArray, freeze
from planner.verifier.claims import Claims
from planner.verifier.corners import CornerCheck
from planner.verifier.excess import Excess, Fault, Kind, placed
from planner.verifier.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING
from planner.verifier.ringing import Ringing


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitCheck:
    """The place where one quantity comes closest to its limit, or exceeds it most.

    ratio    : value / limit there [-]; the limit holds up to 1 + RATIO_ROUNDING
    value    : the quantity there, in `unit`
    limit    : what is allowed there, in `unit`; inf where nothing limits it
    time     : [s]
    position : (A,) [mm]
    line     : NC line of the block there
    limited  : False if the quantity is reported only ("not limited by this method")
    note     : "column", "differences of position", with "between the samples" for the dense motion
    """

    name: str
    unit: str
    ratio: float
    value: float
    limit: float
    time: float
    position: FloatArray
    line: int
    limited: bool = True
    note: str = ""

    def __post_init__(self) -> None:
        freeze(self, "position", float, (None,))

    @property
    def broken(self) -> bool:
        """True if the quantity is limited and exceeds its limit."""
        return self.limited and self.ratio > 1.0 + RATIO_ROUNDING

    def fault(self, kind: Kind, axes: tuple[str, ...]) -> Fault:
        """The fault where the limit does not hold."""
        where = placed(axes, self.position)
        found = f"{self.value:.7g} {self.unit}, {self.ratio:.6g} of the limit {self.limit:.6g} {self.unit}"
        found = f"{found} at t = {self.time:.6g} s, {where}, line {self.line}"
        found += f" ({self.note})" if self.note else ""
        return Fault(kind, self.name, found, ratio=self.ratio, time=self.time, line=self.line)


@dataclass(frozen=True, kw_only=True)
class ThreadCheck:
    """How far one move in step with the spindle is from where the spindle wants it (spindle_sync.py)."""

    line: int  # NC line
    feed: float  # at which the move is to be cut [mm/s]
    # the largest distance from there, between run-in and run-out [mm]; 0 without samples there
    error_mm: float
    allowed_mm: float  # the contour tolerance [mm]

    @property
    def ratio(self) -> float:
        """The distance over what is allowed [-]."""
        return self.error_mm / self.allowed_mm

    @property
    def broken(self) -> bool:
        """True if the move is out of step."""
        return self.error_mm > self.allowed_mm * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING

    def fault(self) -> Fault:
        """Distance, what is allowed, feed and line."""
        found = (
            f"{self.error_mm:.6g} mm out of step with the spindle, {self.allowed_mm:.6g} mm allowed, at the feed "
            f"{self.feed:.6g} mm/s, line {self.line}"
        )
        return Fault(Kind.THREAD, "thread", found, ratio=self.ratio, line=self.line)


@dataclass(frozen=True, eq=False, kw_only=True)
class AfterFilters:
    """Errors behind the filters of the machine (filtered.py); fields as in `Verdict`."""

    contour: LimitCheck
    vertex: LimitCheck
    contour_error_mm: float | None
    vertex_error_mm: float | None
    faults: tuple[Fault, ...]
    excesses: tuple[Excess, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Verdict:
    """The findings of `verify`.

    passed           : True if every check holds, apart from quantities that are "not limited"
    limits           : checks by name: velocity.x, acceleration.x, jerk.x ..., feed, normal acceleration
    claims           : how each figure is known (claims.py)
    contour          : the largest distance of the motion from the path, against the tolerance there
    vertex           : the largest known distance of a vertex from the motion, against the tolerance there
    corners          : eq. 18-20 at the programmed corners
    contour_error_mm : largest distance of the motion (samples, their chords, places between) from the path
                       [mm]; None if the motion could not be followed
    linear_error_mm  : of programs that move rotary axes: the linear part of the contour error, at the samples
                       [mm]; with the tool centre point on it is that of the tip. None for other programs, and
                       as for contour_error_mm
    angle_error_deg  : its rotary part [deg]; the tool's direction is off by no more
    vertex_error_mm  : largest distance of a programmed vertex from the motion [mm]; None if one is not known
    lost_after       : NC line of the last block along which the motion could be followed; None if all
    end_error_mm     : distance of the first or the last sample from the program's ends, the larger [mm]
    threads          : moves in step with the spindle, in order, each with how far it is out of step
    faults           : each failure: what, by how much, when, where, NC line; `str` of one is its sentence
    excesses         : spans of time in which limits or the tolerance are exceeded, as far as known
    after_filters    : errors of the motion behind the machine's filters; None without filters
    ringing          : what each vibration mode of the machine does; reported, not judged
    notes            : what could not be judged exactly, and why
    """

    passed: bool
    limits: dict[str, LimitCheck]
    claims: Claims
    contour: LimitCheck
    vertex: LimitCheck
    corners: CornerCheck
    contour_error_mm: float | None
    vertex_error_mm: float | None
    end_error_mm: float
    faults: tuple[Fault, ...]
    excesses: tuple[Excess, ...] = ()
    linear_error_mm: float | None = None
    angle_error_deg: float | None = None
    after_filters: AfterFilters | None = None
    ringing: tuple[Ringing, ...] = ()
    lost_after: int | None = None
    threads: tuple[ThreadCheck, ...] = ()
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Whether it passed, and the first fault."""
        more = f", and {len(self.faults) - 1} more" if len(self.faults) > 1 else ""
        return "<Verdict: passed>" if self.passed else f"<Verdict: failed, {self.faults[0]}{more}>"

    @property
    def kinds(self) -> frozenset[Kind]:
        """The subjects of the faults."""
        return frozenset(fault.kind for fault in self.faults)

    @property
    def not_limited(self) -> tuple[str, ...]:
        """Quantities that are reported only: "jerk" for jerk.x, jerk.y ..."""
        free = {name.partition(".")[0] for name, check in self.limits.items() if not check.limited}
        return tuple(sorted(free))

    @property
    def sentences(self) -> list[str]:
        """The faults in words."""
        return [fault.sentence for fault in self.faults]

    def summary(self) -> dict[str, Any]:
        """The part `verdict` of `summary.json`."""
        more: dict[str, float | None] = {}
        if (after := self.after_filters) is not None:
            more["contour_error_after_filters_mm"] = after.contour_error_mm
            more["vertex_error_after_filters_mm"] = after.vertex_error_mm
        if self.linear_error_mm is not None:
            more |= {"linear_error_mm": self.linear_error_mm, "angle_error_deg": self.angle_error_deg}
        if self.threads:
            more["thread_error_mm"] = max(self.threads, key=lambda thread: thread.ratio).error_mm
        return more | {
            "passed": self.passed,
            "limits": {name: check.ratio for name, check in self.limits.items()},
            "known": self.claims.summary(),
            "contour_error_mm": self.contour_error_mm,
            "vertex_error_mm": self.vertex_error_mm,
            "end_error_mm": self.end_error_mm,
            "ringing": [mode.summary() for mode in self.ringing],
            "lost_after_line": self.lost_after,
            "not_limited": self.not_limited,
            "faults": self.sentences,
        }
