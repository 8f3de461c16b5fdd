"""The extruder of a 3-D printer, from its delivered places E(t): its limits, and whether it is where the program wants it.

velocity      |dE|/h over each period, which no motion within the limit exceeds.

acceleration, jerk      while the axes move, those along the path times the ratio of the extruder: at a sample the smaller one of
              r = |dE|/ds over the periods before and after it. Where they differ the program changes it there, its speed steps, and
              neither is the ratio alone. ds is the chord of the period, or from the columns h (v0 + v1)/2 - h^2 (u1 - u0)/12 with
              speed v and acceleration u along the path, whichever is longer. While the axes rest, divided differences of E.

place         when a joint is passed E is what the program says, but for what the ratio makes of `NEAR` tolerances and of one period at
              the speed there; in the end it is that to rounding.

Rounding is taken off: `ROUNDING_ULPS` units in the last place of E, and the digits that a file was written with.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.toolpath import Toolpath
from planner.motion.trajectory import Trajectory
from planner.verifier.excess import Fault, Kind, and_more
from planner.verifier.findings import FAULTS_OF_A_KIND, Look, joint_times
from planner.verifier.given import Given
from planner.verifier.limits import FEED_AT_REST, ROUNDING_ULPS
from planner.verifier.pieces import RATIO_ROUNDING, ProgramPieces
from planner.verifier.verdict import LimitCheck

NEAR = 8.0  # within so many tolerances of way E is the programmed one where a joint is passed [-]
REST = 1e-9  # axes that move less than this between samples rest [mm]
PLACE_ROUNDING = 1e-6  # of E [mm of filament]: the digits that programs carry
QUANTITIES = ("velocity", "acceleration", "jerk")
UNITS = ("mm/s", "mm/s2", "mm/s3")
COLUMNS = ("t", "position", "velocity", "acceleration", "jerk", "extruder")
CARRIED = 4  # samples that a chunk shares with the one before


@dataclass(eq=False)
class ExtruderSeen:
    """What the extruder did: of each quantity the worst (value, time, place of the axes, line), and faults of its place."""

    worst: list[tuple[float, float, FloatArray, int]] = field(default_factory=list)
    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()

    def checks(self, limits: FloatArray, not_limited: tuple[str, ...]) -> dict[str, LimitCheck]:
        """Its limits (3,), by name."""
        return {
            f"{name}.e": LimitCheck(
                name=f"{name}.e",
                unit=unit,
                ratio=value / float(limit),
                value=value,
                limit=float(limit),
                time=time,
                position=at,
                line=line,
                limited=name not in not_limited,
                note="places of the extruder",
            )
            for name, unit, limit, (value, time, at, line) in zip(
                QUANTITIES, UNITS, limits, self.worst, strict=False
            )
        }


def extruder_seen(
    trajectory: Trajectory, looks: list[Look], toolpath: Toolpath, pieces: ProgramPieces, given: Given
) -> ExtruderSeen:
    """What the extruder of a delivered motion did; nothing where the program has none."""
    if toolpath.extrusion is None:
        return ExtruderSeen()
    passed = joint_times(looks[0], pieces)
    watch = _Watch(toolpath, passed, given)
    for chunk in trajectory.chunks():
        if not len(chunk.extruder):
            return ExtruderSeen(notes=("there is no column e: what the extruder does is not judged",))
        watch.take(chunk)
    return ExtruderSeen(watch.worst, tuple(watch.place_faults()))


class _Watch:
    """The samples so far, chunk by chunk."""

    def __init__(self, toolpath: Toolpath, passed: FloatArray, given: Given):
        fed = toolpath.extrusion
        assert fed is not None
        self.toolpath, self.fed, self.passed, self.given = toolpath, fed, passed, given
        none = (0.0, 0.0, np.zeros(len(toolpath.axes)), int(toolpath.line[0]))
        self.worst = [none, none, none]
        self.seen = np.full(len(fed.joint), np.nan)  # E where each joint is passed
        self.speed = np.zeros(len(fed.joint))  # and the speed there
        self.end, self.period = 0.0, 0.0
        self._carried: list[FloatArray] = []  # of the chunk before

    def take(self, chunk: Trajectory) -> None:
        """The next samples."""
        before = self._carried
        fresh = int(np.searchsorted(chunk.t, before[0][-1], side="right")) if before else 0
        columns = [getattr(chunk, name)[fresh:] for name in COLUMNS]
        if before:
            columns = [np.concatenate(pair) for pair in zip(before, columns, strict=True)]
        self._look(*columns)
        self._carried = [column[-CARRIED:].copy() for column in columns]

    def _look(
        self,
        t: FloatArray,
        position: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray,
        jerk: FloatArray,
        columns: FloatArray,
    ) -> None:
        e = columns[:, 0]
        off = ROUNDING_ULPS * np.spacing(np.abs(e).max(initial=1.0)) + self.given.extruder_rounding
        self.end = float(e[-1])
        if len(t) < 2:
            return
        h, chord = np.diff(t), np.linalg.norm(np.diff(position, axis=0), axis=1)
        self.period = max(self.period, float(h.max()))
        moved = np.maximum(np.abs(np.diff(e)) - 2.0 * off, 0.0)
        self._keep(0, np.append(0.0, moved / h), t, position)
        speed = np.linalg.norm(velocity, axis=1)
        going = speed > FEED_AT_REST
        along = velocity / np.where(going, speed, 1.0)[:, None]
        u = np.einsum("nk,nk->n", acceleration, along)
        across = ((acceleration - u[:, None] * along) ** 2).sum(axis=1)
        j = np.einsum("nk,nk->n", jerk, along) + np.divide(
            across, speed, out=np.zeros_like(speed), where=going
        )
        way = np.maximum(h * (speed[1:] + speed[:-1]) / 2.0 - h**2 * np.diff(u) / 12.0, chord)
        ratio = np.divide(moved, way, out=np.zeros_like(way), where=chord > REST)
        least = np.minimum(np.append(0.0, ratio), np.append(ratio, 0.0)) * going
        self._keep(1, least * np.abs(u), t, position)
        self._keep(2, least * np.abs(j), t, position)
        self._differences(t, e, chord <= REST, off, position)
        self._places(t, e, speed)

    def _differences(
        self, t: FloatArray, e: FloatArray, rests: FloatArray, off: float, position: FloatArray
    ) -> None:
        """Acceleration and jerk of the extruder while the axes rest."""
        d, error = np.diff(e) / np.diff(t), 2.0 * off / np.diff(t)
        still = rests.astype(bool)
        for order in (2, 3):
            if len(d) < 2:
                return
            over = order / (t[order:] - t[:-order])
            d, error = over * np.diff(d), over * (error[1:] + error[:-1])
            still = still[1:] & still[:-1]
            value = np.zeros(len(t))
            value[order:] = np.where(still, np.maximum(np.abs(d) - error, 0.0), 0.0)
            self._keep(order - 1, value, t, position)

    def _places(self, t: FloatArray, e: FloatArray, speed: FloatArray) -> None:
        """E where the joints are passed, as far as the samples go."""
        when = self.passed[self.fed.joint]
        here = np.flatnonzero((when >= t[0]) & (when <= t[-1]))
        self.seen[here] = np.interp(when[here], t, e)
        self.speed[here] = np.interp(when[here], t, speed)

    def _keep(self, which: int, value: FloatArray, t: FloatArray, position: FloatArray) -> None:
        k = int(value.argmax())
        if value[k] > self.worst[which][0]:
            segment = int(np.clip(np.searchsorted(self.passed, t[k]) - 1, 0, len(self.toolpath) - 1))
            self.worst[which] = float(value[k]), float(t[k]), position[k], int(self.toolpath.line[segment])

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
        said = []
        for k in bad[:FAULTS_OF_A_KIND]:
            line, ratio = int(toolpath.line[max(fed.joint[k] - 1, 0)]), float(off[k] / allowed[k])
            text = f"{off[k]:.6g} mm of filament off where line {line} ends, {allowed[k]:.6g} mm allowed"
            said.append(Fault(kind=Kind.EXTRUDER, name="extruder", found=text, ratio=ratio, line=line))
        said = and_more(said, len(bad), "such places")
        missed = abs(self.end - float(fed.leave[-1]))
        if missed > PLACE_ROUNDING + 2.0 * self.given.extruder_rounding:
            text = f"ends at {self.end:.6g} mm of filament, the program at {fed.leave[-1]:.6g} mm"
            said.append(Fault(kind=Kind.EXTRUDER, name="extruder", found=text))
        return said
