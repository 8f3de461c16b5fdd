"""Motions one after the other: each is a part of another motion, from rest to rest, so that nothing jumps where they meet."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.base.arrays import FloatArray
from planner.motion.axis_motion import AxisMotion
from planner.motion.timing import MotionInTime
from planner.motion.trajectory import Trajectory, joined

# Times closer than this are the same [s]: rounding of sums of durations.
SAME_TIME = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class Part:
    """What a motion does from `begin` to `end` [s], at rest at both times, and a standstill of `hold` [s] behind it."""

    motion: MotionInTime
    begin: float
    end: float
    hold: float = 0.0

    @property
    def lasting(self) -> float:
        """[s]"""
        return self.end - self.begin + self.hold


@dataclass(frozen=True, eq=False, kw_only=True)
class Spliced:
    """Parts of motions, one after the other."""

    parts: tuple[Part, ...]

    @cached_property
    def begin(self) -> FloatArray:
        """(n+1,) when the parts begin, and when the last one ends [s]."""
        return np.append(0.0, np.cumsum([part.lasting for part in self.parts]))

    @property
    def end(self) -> float:
        """End of the last part [s]."""
        return float(self.begin[-1])

    @cached_property
    def t(self) -> FloatArray:
        """(L,) start of each piece [s]."""
        edges = []
        for part, begin in zip(self.parts, self.begin, strict=False):
            inner = part.motion.t[(part.motion.t > part.begin) & (part.motion.t < part.end)]
            stands = [begin + part.end - part.begin] if part.hold > 0 else []
            edges.append(np.concatenate([[begin], begin + inner - part.begin, stands]))
        return np.maximum.accumulate(np.concatenate(edges))

    @cached_property
    def way(self) -> FloatArray:
        """(n+1,) arc length at the start of each part, and at the end [mm]."""
        ends = (part.motion.at(np.array([part.begin, part.end]), 1.0).s for part in self.parts)
        return np.append(0.0, np.cumsum([s[-1] - s[0] for s in ends]))

    def at(self, times: FloatArray, dt: float) -> Trajectory:
        """The motion at ascending times (T,) within [0, end]; `dt` [s] is the trajectory's interpolation period."""
        of = np.clip(np.searchsorted(self.begin, times, side="right") - 1, 0, len(self.parts) - 1)
        chunks = []
        for k in np.unique(of):
            part, asked = self.parts[k], times[of == k]
            local = part.begin + (asked - self.begin[k])
            single, which = np.unique(np.minimum(local, part.end), return_inverse=True)
            seen = part.motion.at(single, dt)
            columns = {name: getattr(seen, name)[which] for name in ("position", "block", "line")}
            columns["s"] = self.way[k] + seen.s[which] - part.motion.at(np.array([part.begin]), dt).s[0]
            over = local >= part.end  # there another motion may begin
            for name in ("velocity", "acceleration", "jerk", "feed"):
                columns[name] = getattr(seen, name)[which]
                columns[name][over] = 0.0
            chunks.append(dataclasses.replace(seen, t=asked, **columns))
        return joined(chunks)

    def whole(self) -> AxisMotion:
        """As one motion; every part has to be all of a motion that is given axis by axis."""
        motions = [part.motion for part in self.parts if isinstance(part.motion, AxisMotion)]
        assert len(motions) == len(self.parts)
        names = ("position", "velocity", "acceleration", "jerk", "block", "line")
        return AxisMotion(
            axes=motions[0].axes,
            t=np.concatenate([begin + m.t for m, begin in zip(motions, self.begin, strict=False)]),
            end=self.end,
            **{name: np.concatenate([getattr(m, name) for m in motions]) for name in names},
        )

    def waiting(self, at: FloatArray, by: FloatArray) -> Spliced:
        """The motion standing longer by `by` (n,) [s] where it comes to rest, at the times `at` (n,) [s]."""
        parts = []
        for k, part in enumerate(self.parts):
            stand = self.begin[k] + part.end - part.begin
            behind = np.abs(at - stand) <= SAME_TIME
            inside = (at > self.begin[k] + SAME_TIME) & (at < stand - SAME_TIME)
            motion, more = part.motion, float(by[inside].sum())
            if more > 0:
                motion = motion.waiting(at[inside] - self.begin[k] + part.begin, by[inside])
            hold = part.hold + float(by[behind].sum())
            parts.append(Part(motion=motion, begin=part.begin, end=part.end + more, hold=hold))
        return Spliced(parts=tuple(parts))
