"""The solution along a run as parts of a motion: steps of constant jerk, and between them the start's motion
where it stays."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.solution import Status
from planner.geometry.toolpath import Toolpath
from planner.joint.motion import Steps
from planner.joint.run import TubeRun
from planner.joint.splice import SplicedRun
from planner.motion.axis_motion import AxisMotion


@dataclass(frozen=True, eq=False)
class FoundRun:
    """How the search along a run ended."""

    run: TubeRun
    status: Status
    sentence: str
    steps: Steps | None = None  # None where the start stays
    place: FloatArray | None = None  # (N+1,) of the nodes along the run [mm]
    times: FloatArray | None = None  # (N+1,) of the nodes in the motion of the start [s]
    kept: Array | None = None  # (N,) steps that stand for the motion of the start; None for none
    # (N, 3 A + 5) what the limits of each step cost (price.py) [s]; None where the solver does not tell
    price: FloatArray | None = None
    coarser: "FoundRun | None" = None  # what the search in longer steps had found, which this began with

    @property
    def whole(self) -> bool:
        """Whether nothing of the start's motion is left."""
        return self.steps is not None and (self.kept is None or not self.kept.any())

    def priced_time(self) -> float:
        """How long the steps that have prices last [s]."""
        if self.steps is None or self.price is None:
            return 0.0
        return float(self.steps.h[self.price.any(axis=1)].sum())

    def ranges(self) -> list[tuple[int, int, bool]]:
        """First step, the one behind the last, and whether the start stays, of what goes out in one part."""
        assert self.steps is not None
        kept = np.zeros(len(self.steps.h), dtype=bool) if self.kept is None else self.kept
        edges = np.concatenate([[0], np.flatnonzero(np.diff(kept)) + 1, [len(kept)]])
        return [(lo, hi, bool(kept[lo])) for lo, hi in pairwise(edges.tolist())]


def parts_of(toolpath: Toolpath, found: FoundRun, start: SplicedRun) -> list[SplicedRun]:
    """The parts of the motion along a run, with the dwell before it, and the one at the end of the job.

    start : the motion of the start along the run
    """
    assert found.steps is not None
    assert found.times is not None
    steps = len(found.steps.h)
    parts = []
    for lo, hi, stays in found.ranges():
        goes_on = hi < steps or bool(found.run.ends[1].any())
        if stays:
            begin = start.begin if lo == 0 else float(found.times[lo])
            end = start.end if hi == steps else float(found.times[hi])
            parts.append(SplicedRun(motion=start.motion, begin=begin, end=end, moving=goes_on))
        else:
            motion = _motion(toolpath, found, lo, hi)
            parts.append(SplicedRun(motion=motion, begin=0.0, end=motion.end, moving=goes_on))
    return parts


def _motion(toolpath: Toolpath, found: FoundRun, lo: int, hi: int) -> AxisMotion:
    """The steps lo .. hi - 1; before the first one of the run its dwell, and after the last one that at the
    end of the job."""
    run, steps, place = found.run, found.steps, found.place
    assert steps is not None
    assert place is not None
    first, last = run.first[0], run.first[-1]
    before = toolpath.dwell[first] if lo == 0 else 0.0
    behind = toolpath.dwell[last] if last == len(toolpath) and hi == len(steps.h) else 0.0
    standing, still = int(before > 0), int(behind > 0)  # steps without motion before and after the others
    along = np.append(0.0, np.cumsum(toolpath.length[first:last]))
    inside = np.searchsorted(along[1:-1], (place[lo:hi] + place[lo + 1 : hi + 1]) / 2, side="right")
    segment: Array = np.concatenate([[first] * standing, first + inside, [last - 1] * still]).astype(np.int64)
    columns = {}
    for name in ("position", "velocity", "acceleration", "jerk"):
        whole = np.zeros((standing + hi - lo + still, len(toolpath.axes)))
        if name == "position":
            whole += toolpath.start[first]
            whole[len(whole) - still :] = toolpath.end[last - 1]
        whole[standing : len(whole) - still, run.axis] = getattr(steps, name)[lo:hi]
        columns[name] = whole
    t = np.append(0.0, np.cumsum(np.concatenate([[before] * standing, steps.h[lo:hi], [behind] * still])))
    return AxisMotion(
        axes=toolpath.axes,
        radius=toolpath.radius,
        t=t[:-1],
        block=toolpath.block[segment],
        line=toolpath.line[segment],
        end=float(t[-1]),
        **columns,
    )
