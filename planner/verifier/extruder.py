"""The extruder of a 3-D printer, from its delivered places E(t): its limits, and where it should be.

velocity      |dE|/h over each period, which no motion within the limit exceeds.

acceleration, jerk      while the axes move, those along the path times the ratio of the extruder: at a sample the smaller one of
              r = |dE|/ds over the periods before and after it. Where they differ the program changes it
              there, its speed steps, and neither is the ratio alone. ds is the chord of the period, or from
              the columns h (v0 + v1)/2 - h^2 (u1 - u0)/12 with speed v and acceleration u along the path,
              whichever is longer. While the axes rest, divided differences of E.

place         when a joint is passed E is what the program says, but for what the ratio makes of `NEAR` tolerances and of one period at
              the speed there; in the end it is that to rounding.

Rounding is taken off: `ROUNDING_ULPS` units in the last place of E, and the digits that a file was written with.
"""

from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, Kind, first_of
from planner.verifier.findings import check_of
from planner.verifier.given import DERIVATIVES, Given
from planner.verifier.limits import FEED_AT_REST, UNITS
from planner.verifier.other_limits import along_path
from planner.verifier.pieces import RATIO_ROUNDING
from planner.verifier.stream import overlapping
from planner.verifier.verdict import LimitCheck
from planner.verifier.worst import (
    COLUMN,
    ROUNDING_ULPS,
    SampleBlock,
    Worst,
    differences,
    less_error,
    state_of,
)

NEAR = 8.0  # within so many tolerances of way E is the programmed one where a joint is passed [-]
REST = 1e-9  # axes that move less than this between samples rest [mm]
PLACE_ROUNDING = 1e-6  # of E [mm of filament]: the digits that programs carry
CARRIED = 4  # samples that a chunk shares with the one before


def extruder_seen(
    trajectory: Trajectory, passed: FloatArray, toolpath: Toolpath, given: Given, not_limited: tuple[str, ...]
) -> tuple[dict[str, LimitCheck], list[Fault], list[str]]:
    """The checks of the extruder's limits by name, faults of its place, and notes; nothing where the program has none.

    passed : (M+1,) times at which the motion passes the joints of the path [s]
    """
    if toolpath.extrusion is None:
        return {}, [], []
    watch = _Watch(toolpath, passed, given)
    for chunk in overlapping(trajectory, CARRIED):
        if not len(chunk.extruder):
            return {}, [], ["there is no column e: what the extruder does is not judged"]
        watch.take(chunk)
    return watch.checks(not_limited), watch.place_faults(), []


class _Watch:
    """The samples so far, chunk by chunk."""

    def __init__(self, toolpath: Toolpath, passed: FloatArray, given: Given):
        fed = toolpath.extrusion
        assert fed is not None
        self.toolpath, self.fed, self.passed, self.given = toolpath, fed, passed, given
        names = [(f"{name}.e", "mm" + per) for name, per in zip(DERIVATIVES, UNITS, strict=True)]
        self.worst = Worst(names, len(toolpath.axes))
        self.worst.least[:] = fed.limits
        self.seen = np.full(len(fed.joint), np.nan)  # E where each joint is passed
        self.speed = np.zeros(len(fed.joint))  # and the speed there
        self.end, self.period = 0.0, 0.0

    def take(self, chunk: Trajectory) -> None:
        """The next samples, behind the last ones of the chunk before."""
        t, position, e = chunk.t, chunk.position, chunk.extruder[:, 0]
        off = ROUNDING_ULPS * np.spacing(np.abs(e).max(initial=1.0)) + self.given.extruder_rounding
        self.end = float(e[-1])
        if len(t) < 2:
            return
        block = SampleBlock(t=t, state=state_of(chunk)[1], piece=np.zeros(len(t), dtype=np.int64))
        h, chord = np.diff(t), np.linalg.norm(np.diff(position, axis=0), axis=1)
        self.period = max(self.period, float(h.max()))
        moved = np.maximum(np.abs(np.diff(e)) - 2.0 * off, 0.0)
        self._keep(0, np.append(0.0, moved / h), block)
        (speed, u, j), _ = along_path(block, delivered=True)
        going = speed > FEED_AT_REST
        way = np.maximum(h * (speed[1:] + speed[:-1]) / 2.0 - h**2 * np.diff(u) / 12.0, chord)
        ratio = np.divide(moved, way, out=np.zeros_like(way), where=chord > REST)
        least = np.minimum(np.append(0.0, ratio), np.append(ratio, 0.0)) * going
        self._keep(1, least * np.abs(u), block)
        self._keep(2, least * np.abs(j), block)
        still = np.append(True, chord <= REST)  # of the period before each sample
        for order, seen in enumerate(differences(t, e[:, None], np.full((len(t), 1), off))):
            if order:  # acceleration and jerk of the extruder while the axes rest
                still[1:] &= still[:-1]
                self._keep(order, np.where(still, less_error(seen)[:, 0], 0.0), block)
        when = self.passed[self.fed.joint]  # joints that are passed, as far as the samples go
        here = np.flatnonzero((when >= t[0]) & (when <= t[-1]))
        self.seen[here] = np.interp(when[here], t, e)
        self.speed[here] = np.interp(when[here], t, speed)

    def _keep(self, row: int, value: FloatArray, block: SampleBlock) -> None:
        self.worst.take(row, value[:, None], self.fed.limits[row], COLUMN, block)

    def checks(self, not_limited: tuple[str, ...]) -> dict[str, LimitCheck]:
        """The worst of its limits, by name."""
        found = {}
        for row, (name, _) in enumerate(self.worst.names):
            segment = int(np.searchsorted(self.passed, self.worst.time[row])) - 1
            line = int(self.toolpath.line[np.clip(segment, 0, len(self.toolpath) - 1)])
            check = check_of(self.worst, row, self.toolpath, line, not_limited)
            found[name] = replace(check, note="places of the extruder")
        return found

    def place_faults(self) -> list[Fault]:
        """Joints at which the extruder is not where the program wants it."""
        fed, toolpath = self.fed, self.toolpath
        last = len(toolpath) - 1
        ratio = np.maximum(fed.ratio[np.maximum(fed.joint - 1, 0)], fed.ratio[np.minimum(fed.joint, last)])
        near = NEAR * toolpath.tolerance[fed.joint] + self.speed * self.period
        allowed = ratio * near + PLACE_ROUNDING + 2.0 * self.given.extruder_rounding
        low, high = np.minimum(fed.arrive, fed.leave), np.maximum(fed.arrive, fed.leave)
        joint, done = np.searchsorted(fed.joint, fed.at), np.cumsum(fed.amount)
        first = np.searchsorted(fed.at, fed.at)
        place = fed.arrive[joint] + done - (done - fed.amount)[first]  # behind each move alone
        np.minimum.at(low, joint, place)
        np.maximum.at(high, joint, place)
        off = np.maximum(np.maximum(low - self.seen, self.seen - high), 0.0)
        bad = np.flatnonzero(np.where(np.isnan(off), 0.0, off) > allowed * (1.0 + RATIO_ROUNDING))

        def fault(k: int) -> Fault:
            line = int(toolpath.line[max(fed.joint[k] - 1, 0)])
            found = f"{off[k]:.6g} mm of filament off where line {line} ends, {allowed[k]:.6g} mm allowed"
            return Fault(Kind.EXTRUDER, "extruder", found, ratio=float(off[k] / allowed[k]), line=line)

        said = first_of(bad, fault, "such places")
        missed = abs(self.end - float(fed.leave[-1]))
        if missed > PLACE_ROUNDING + 2.0 * self.given.extruder_rounding:
            text = f"ends at {self.end:.6g} mm of filament, the program at {fed.leave[-1]:.6g} mm"
            said.append(Fault(Kind.EXTRUDER, "extruder", text))
        return said
