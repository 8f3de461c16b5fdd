"""Motions that stay within the tolerance behind the machine's own filters (`[fir]`).

A filter of kernel h on [0, Td] makes of the motion p the mean of its last Td. About p(t - Td/2) that is off
by at most max|p''| (sum T^2/12) / 2, in whatever direction the acceleration acts (docs/papers.md D), and a
time Td after a motion comes to rest the filtered one has come to rest at the same point. So there are two
ways to leave less of an error, and both always end:

  slower   a run between full stops slowed down by f has 1/f^2 of the error; what a path that rounds its corners within less than the
           tolerance leaves, it leaves again
  rest     two runs that are Td apart do not know of each other: the stop between them is reached. The shortest rest with which the
           filtered motion comes near enough is found for the motion as it is (rests.py)

Measured is what the machine makes of the setpoints of the motion (filtered_setpoints.py): at long periods
chords filtered are not the motion filtered. The errors are put down to runs and stops, and those are slowed
down and lengthened until nothing is left. With every change the setpoints fall elsewhere, and so the last
motion measured is the one that is delivered, with the standstills that its samples need (periods.py). Behind
the last run nothing is added: the filtered motion ends Td after the setpoints do.
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.delivery.filtered_setpoints import PER_PERIOD, FilteredSetpoints
from planner.delivery.pacing import MotionRuns, Timed, TimedT, runs_of, slower_runs, standing_longer
from planner.delivery.path_errors import SPARE, Errors, PathErrors
from planner.delivery.periods import standing, with_standstills
from planner.delivery.rests import mean_of_filters
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.filters import Filters
from planner.motion.timing import MotionInTime, in_chunks

STOPS_AT_ONCE = SIZES.stops_at_once
# At most so many rounds of slowing down; the n-th at least by the n-th power of the first of these factors,
# at most by the second [-]: together by up to 240, which leaves 1/57,600 of any filter's error.
ROUNDS, FACTOR_LEAST, FACTOR_MOST = 60, 1.003, 1.5
FLOOR_STEP = 1.0 / 32.0  # of Td: by so much a rest grows that was too short, twice as much each time again
# What the path leaves for filters counts as this fraction at least [-], or steps would be too large.
ROOM_LEAST = 0.1


@dataclass(frozen=True, eq=False, kw_only=True)
class Violations:
    """Where the filtered motion leaves the tolerance."""

    time: FloatArray  # (n,) time behind the filters [s]
    ratio: FloatArray  # (n,) error over tolerance [-]
    path: FloatArray  # (n,) what the ratio is without filters, by the path alone [-]
    vertex: Array  # (n,) index of the vertex that is missed, -1 for places off the contour
    near: FloatArray  # (N+1,) error over tolerance at every vertex [-]
    near_time: FloatArray  # (N+1,) when the filtered motion is nearest to the vertex [s]
    worst: FloatArray  # (N,) largest error over tolerance of the contour on every piece [-]

    @property
    def less(self) -> FloatArray:
        """(n,) factor by which accelerations have to become smaller there [-], < 1."""
        room = 1.0 - SPARE - np.minimum(self.path, 1.0 - SPARE - ROOM_LEAST)
        return room / (self.ratio - (1.0 - SPARE) + room)


class Behind:
    """Measures motions along one path of N pieces behind the filters of one machine."""

    def __init__(self, toolpath: Toolpath, machine: Machine):
        self.toolpath, self.machine = toolpath, machine
        self.tolerance = float(toolpath.tolerance.min())
        self.path = PathErrors(toolpath)
        self._setpoints: FilteredSetpoints | None = None
        if machine.fir is None:
            return  # `errors` of the motion itself can be asked for
        lengths = machine.fir.time_constants
        self.filters = Filters(lengths)
        self._mean = mean_of_filters(self.filters)
        self._setpoints = FilteredSetpoints(machine.interpolation, lengths, machine.dt)

    def errors(self, motion: MotionInTime) -> Errors:
        """Errors of what the machine makes of a motion's setpoints; without filters of the motion itself."""
        if self._setpoints is None:
            return self.path_errors(motion)
        return self.path.of(self._setpoints.of(motion))

    def path_errors(self, motion: MotionInTime) -> Errors:
        """Errors of the motion itself."""
        dt = self.machine.dt
        times = np.append(np.arange(0.0, motion.end, dt / PER_PERIOD), motion.end)
        return self.path.of((seen.t, seen.position) for seen in in_chunks(motion, dt, times))

    def places(self, motion: Timed, of_path: Errors) -> Violations:
        """Where a motion leaves the tolerance behind the filters.

        of_path : `path_errors` of any motion along the same path
        """
        found = self.errors(motion)
        missed = np.flatnonzero(found.near > 1.0 - SPARE)
        return Violations(
            time=np.concatenate([found.time, found.near_time[missed]]),
            ratio=np.concatenate([found.ratio, found.near[missed]]),
            path=np.concatenate([of_path.worst[found.piece], of_path.near[missed]]),
            vertex=np.concatenate([np.full(len(found.time), -1), missed]),
            near=found.near,
            near_time=found.near_time,
            worst=found.worst,
        )

    def beside_stop(self, motion: Timed, time: FloatArray) -> Array:
        """(n,) True where filters hold something of two runs at `time` (n,): a longer rest is enough."""
        runs = runs_of(motion)
        return np.less(*runs_within(runs.begin, runs.end, time, self.filters.delay))

    def rests(self, motion: Timed, runs: MotionRuns) -> FloatArray:
        """(G,) the shortest rest behind each run that keeps the filtered tolerance [s]; 0 behind the last."""
        found = np.zeros(len(runs))
        for low in range(0, len(runs) - 1, STOPS_AT_ONCE):
            stop = np.arange(low, min(low + STOPS_AT_ONCE, len(runs) - 1))
            found[stop] = self._rests(motion, runs.end[stop], runs.begin[stop + 1])
        return found

    def _rests(self, motion: Timed, end: FloatArray, begin: FloatArray) -> FloatArray:
        """The shortest rests (g,) [s] between runs that end and begin at the times (g,) [s]."""
        inside = self._mean.inside
        times = np.stack([end[:, None] - inside, begin[:, None] + inside], axis=1)
        place, of = np.unique(np.clip(times, 0.0, motion.end), return_inverse=True)
        seen = motion.at(place, self.machine.dt)
        stop = motion.at(np.unique(end), self.machine.dt)
        off = seen.position[of].reshape(*times.shape, -1) - stop.position[:, None, None]
        budget = self._budget(stop.block, stop.position) * (1.0 - SPARE)
        return self._mean.shortest_rests(off[:, 0], off[:, 1], budget)

    def _budget(self, block: Array, position: FloatArray) -> FloatArray:
        """Budget of the joints (g,) that are nearest to positions on blocks [mm]."""
        path = self.toolpath
        segment = path.segment_at(block)
        first = np.searchsorted(path.block, block)
        ends = np.stack([path.start[first], path.end[segment]])
        nearer = np.linalg.norm(ends - position, axis=2).argmin(axis=0)
        return np.where(nearer == 0, path.tolerance[first], path.tolerance[segment + 1])


def runs_within(begin: FloatArray, end: FloatArray, time: FloatArray, delay: float) -> tuple[Array, Array]:
    """First and last (n,) of runs from `begin` to `end` (G,) that what is at `time` (n,) is made of."""
    early = np.searchsorted(end, time - delay, side="right")
    late = np.maximum(np.searchsorted(begin, time) - 1, 0)
    return np.minimum(early, late), late


def stops_between(early: Array, late: Array, count: int) -> Array:
    """(count,) True for runs behind which there is a stop between the runs `early` and `late` (n,)."""
    short = np.zeros(count, bool)
    for a, b in set(zip(early.tolist(), late.tolist(), strict=True)):
        short[a:b] = True
    return short


def rested(behind: Behind, motion: TimedT) -> TimedT:
    """The motion with the shortest rests at its full stops that keep the tolerance behind filters, and with the
    standstills that its samples need."""
    runs = runs_of(motion)
    gap = np.append(runs.begin[1:] - runs.end[:-1], 0.0)
    longer = standing_longer(motion, runs, np.maximum(behind.rests(motion, runs) - gap, 0.0))
    return with_standstills(longer, standing(longer, behind.toolpath, behind.machine))


def kept(motion: TimedT, toolpath: Toolpath, machine: Machine) -> TimedT:
    """The motion with runs slowed down and rests lengthened until the filtered motion keeps the tolerance,
    and with the standstills that its samples need; as it is for a machine without filters."""
    if machine.fir is None:
        return motion
    behind, runs = Behind(toolpath, machine), runs_of(motion)
    if not len(runs):
        return motion
    of_path = behind.path_errors(motion)
    delay, least = behind.filters.delay, np.zeros(len(runs))
    factor, again = np.ones(len(runs)), np.zeros(len(runs))
    gap = np.append(runs.begin[1:] - runs.end[:-1], 0.0)
    made = motion
    for n in range(ROUNDS):
        slower = slower_runs(motion, runs, factor)
        timed = runs.of(slower)
        rest = np.maximum(behind.rests(slower, timed), least)
        longer = np.maximum(rest - gap, 0.0)
        made = standing_longer(slower, runs, longer)
        stands = standing(made, toolpath, machine)
        made = with_standstills(made, stands)
        places = behind.places(made, of_path)
        if not len(places.time):
            break
        begin, end = timed.behind(longer)
        stood = np.append(0.0, np.cumsum(stands.by))  # what the samples need
        begin = begin + stood[np.searchsorted(stands.at, begin, side="right")]
        end = end + stood[np.searchsorted(stands.at, end)]
        early, late = runs_within(begin, end, places.time, delay)
        own = early == late
        least_more = min(FACTOR_LEAST ** (n + 1), FACTOR_MOST)
        worst = np.ones(len(runs))
        np.maximum.at(worst, late[own], np.clip(1.0 / np.sqrt(places.less[own]), least_more, FACTOR_MOST))
        factor = factor * worst
        short = stops_between(early, late, len(runs))
        grown = np.maximum(rest, gap)[short] + FLOOR_STEP * delay * 2.0 ** again[short]
        least[short] = np.minimum(grown, delay)
        again[short] += 1
    return made
