"""How far the motion and the path are apart, in numbers that are true or None.

The matching (`matching`) decides at the tolerance. A motion that fits is measured by it. Of one that does not
it knows less: where it went on by a vertex passed too late, a sample may be nearer to the next piece than to
those it could be on, and where it was lost nothing is known. Such a motion is read again with 4, 16 and 64
times the tolerance, until it fits: among all pieces that can be reached in order within that, the nearest to
every sample is found, and the checks compare with the tolerance as it is. A motion that does not fit then has
no distance from the path: None. To fit into a widened tolerance means to use half of it: a detour of all of
it would leave only its tip to pass the vertex at. What fits there by less than the tolerance as it is came
near to two vertices in the wrong order, which is a fault (findings.out_of_order).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.verifier.excess import Excess, Fault, Kind, first_of, of_place, placed
from planner.verifier.findings import line_of
from planner.verifier.matching import JUMPS, LAST, LOST_AFTER, NEAR_MISS, NOT_LOST, WORST_AT
from planner.verifier.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING, ProgramPieces, widened
from planner.verifier.stream import Observed
from planner.verifier.verdict import LimitCheck

WIDER = (4.0, 16.0, 64.0)  # times the budget
VISITS_MAX = 3e8  # samples times pieces within reach that are looked at for a number of a motion that failed: half a minute


@dataclass(frozen=True)
class Apart:
    """The readings that measure the distance of motion and path."""

    readings: list[Observed]  # the readings
    pieces: ProgramPieces  # the path with its own budgets
    widened: float = 1.0  # their budgets were so many times those of `pieces`

    @property
    def fits(self) -> bool:
        """The motion stays within these budgets, or half of those that were widened, as far as it goes."""
        share = self.widened if self.widened == 1.0 else 0.5 * self.widened
        return all(
            match.tally[LOST_AFTER] == NOT_LOST
            and not match.tally[JUMPS]
            and match.worst[0] <= share / self.widened * (1.0 + 2.0 * RATIO_ROUNDING)
            and not (match.passed["near"] > share * self._allowed)[: match.tally[LAST] + 1].any()
            for match in (reading.match for reading in self.readings)
        )

    @property
    def _allowed(self) -> FloatArray:
        allowed: FloatArray = self.pieces.joint["budget"] * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING
        return allowed

    # ---- the motion from the path

    def contour_error(self) -> float | None:
        """Largest distance of the motion from the path [mm]."""
        return None if not self.fits else max(float(reading.match.worst[5]) for reading in self.readings)

    def contour_check(self, toolpath: Toolpath) -> LimitCheck:
        """The motion's worst distance from the path, as far as it was followed, against the budget there."""
        reading = max(self.readings, key=lambda each: each.match.worst[0])
        ratio, distance, budget, time, piece, _ = reading.match.worst
        ratio, budget = ratio * self.widened, budget / self.widened
        if distance <= budget * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING:
            ratio = min(ratio, 1.0)  # within the rounding of the matching, which is absolute too
        limit = budget if budget > 0 else self.pieces.piece["budget"].min()
        place, line = reading.match.place[WORST_AT], line_of(toolpath, self.pieces, int(piece))
        return _check("contour", (ratio, distance, limit, time), place, line, reading.note)

    # ---- the vertices from the motion

    def near(self, reading: Observed) -> FloatArray:
        """(N+1,) distance of each vertex from the motion [mm]; NaN where it is not known."""
        near: FloatArray = reading.match.passed["near"].copy()
        # those of a motion that does not fit are known as far as the matching stays in place
        near[np.isinf(near) if self.fits else near > NEAR_MISS * self._allowed] = np.nan
        return near

    def vertex_error(self) -> float | None:
        """Largest distance of a programmed vertex from the motion [mm]."""
        near = np.concatenate([self.near(reading)[self.pieces.joint["real"]] for reading in self.readings])
        return None if np.isnan(near).any() else float(near.max())

    def vertex_check(self, toolpath: Toolpath) -> LimitCheck:
        """The vertex that the motion misses by most of its budget, of those whose distance is known."""
        budgets = self.pieces.joint["budget"]
        known = [np.nan_to_num(self.near(each) / budgets, nan=-1.0) for each in self.readings]
        reading = self.readings[int(np.argmax([ratio.max() for ratio in known]))]
        near = self.near(reading)
        i = int(np.nan_to_num(near / budgets, nan=-1.0).argmax())  # if none is known the first, with NaN
        ratio = near[i] / budgets[i]
        if near[i] <= self._allowed[i]:
            ratio = min(ratio, 1.0)
        found = ratio, near[i], budgets[i], reading.match.passed["near_time"][i]
        return _check(
            "vertex", found, self.pieces.vertex[i], line_of(toolpath, self.pieces, i - 1), reading.note
        )

    def vertex_faults(self, toolpath: Toolpath) -> list[Fault]:
        """Vertices that the motion misses by more than their budget, and arcs cut short."""
        said: list[Fault] = []
        for reading in self.readings:
            seen = reading.match.passed["near"]
            missed = np.flatnonzero((seen > self._allowed) & np.isfinite(seen))
            said += first_of(missed, partial(self._vertex_fault, toolpath, reading), "vertices missed")
        return said

    def _vertex_fault(self, toolpath: Toolpath, reading: Observed, i: int) -> Fault:
        pieces, near, passed = self.pieces, self.near(reading)[i], reading.match.passed[i]
        budget = pieces.joint["budget"][i]
        what = "end of the block" if pieces.joint["real"][i] else "a point of the arc"
        by = f"missed by {near:.7g} mm, {near / budget:.6g} of the budget {budget:.6g} mm"
        if np.isnan(near):
            by = f"missed by more than {NEAR_MISS:g} times the budget {budget:.6g} mm"
        line, time = line_of(toolpath, pieces, i - 1), float(passed["near_time"])
        where = placed(toolpath.axes, pieces.vertex[i])
        found = f"{what} of line {line} at {where}: {reading.noted(by)}, t = {time:.6g} s"
        ratio = float(passed["near"] / budget)
        return Fault(Kind.VERTEX, "vertex", found, ratio=ratio, time=time, line=line)

    def excesses(self) -> list[Excess]:
        """Where the motion leaves the tolerance: the worst place of each reading, and all vertices whose
        distance is known. A slower motion has less of what the chords between samples add to the path's own error."""
        found = []
        for k, reading in enumerate(self.readings):
            ratio, distance, budget, time, _, _ = reading.match.worst.tolist()
            still = 1.0 if k else 0.0
            if distance > budget * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING:
                found.append(of_place(Kind.CONTOUR, time, ratio * self.widened, 2, still))
            near, times = self.near(reading), reading.match.passed["near_time"]
            for i in np.flatnonzero(np.nan_to_num(near) > self._allowed):
                by = float(near[i] / self.pieces.joint["budget"][i])
                own = float(self.near(self.readings[-1])[i] / self.pieces.joint["budget"][i])
                still = own if len(self.readings) > 1 and np.isfinite(own) else 0.0
                found.append(of_place(Kind.VERTEX, float(times[i]), by, 2, still))
        return found


def _check(name: str, found: tuple[float, ...], place: FloatArray, line: int, note: str) -> LimitCheck:
    ratio, value, limit, time = map(float, found)
    where: dict[str, Any] = {"time": time, "position": place, "line": line, "note": note}
    return LimitCheck(name=name, unit="mm", ratio=ratio, value=value, limit=limit, **where)


def apart(
    readings: list[Observed], pieces: ProgramPieces, read: Callable[[ProgramPieces], list[Observed]]
) -> Apart:
    """The readings that measure the motion: `readings` if it fits, or those by `read` with wider budgets."""
    found = Apart(readings, pieces)
    if found.fits:
        return found
    samples = sum(reading.samples for reading in readings)
    length = float(np.linalg.norm(np.diff(pieces.vertex, axis=0), axis=1).mean())
    for factor in WIDER:
        within = 1.0 + 2.0 * factor * float(pieces.piece["budget"].mean()) / length
        if samples * within > VISITS_MAX:
            break
        wide = Apart(read(widened(pieces, factor)), pieces, factor)
        if wide.fits:
            return wide
    return found


def lost_after(
    readings: list[Observed], toolpath: Toolpath, pieces: ProgramPieces, complete: bool
) -> int | None:
    """NC line of the block behind which the motion was lost, or ended too early; None if it ran them all."""
    tallies = [reading.match.tally for reading in readings]
    at = [tally[LOST_AFTER] for tally in tallies if tally[LOST_AFTER] != NOT_LOST]
    if not at and not complete:
        at = [tally[LAST] for tally in tallies]
    return line_of(toolpath, pieces, int(min(at))) if at else None
