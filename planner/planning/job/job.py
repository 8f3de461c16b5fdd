"""A job on its way to a plan: its stages, its notes, sampling and verification, and the plan at the end."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner.base.arrays import Array
from planner.base.names import OPTIMAL, SECOND_ORDER
from planner.baselines.lookahead.rest_to_rest import stop_time
from planner.corners.budget import filter_rate, with_less_normal
from planner.delivery import mending, periods
from planner.delivery.filters import kept
from planner.delivery.pacing import TimedT
from planner.feedrate.solution import Status
from planner.geometry.point_matching import SegmentsInOrder
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.extruding import Extruding
from planner.motion.on_demand import TrajectoryOnDemand
from planner.motion.shaping import ShapedMotion
from planner.motion.timing import MotionInTime, sample_motion
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.planning.job.notes import job_notes
from planner.planning.job.plan import NO_TABLES, Delivered, Making, Plan, Tables
from planner.planning.job.trace import Stages, Tell
from planner.verifier import OF_CHORDS, verify

NOT_ON_PATH = "the motion leaves the programmed path: the lines and blocks of the trajectory are those that the method planned"
# A motion mended where chords leave the tolerance is taken at once if that costs no more of its time [-].
CHEAP = 1e-4
# A motion that turns in less time than the filters are long is nearer to its path than the closed form says.
BOLDER = 2.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """A program on its way to a plan."""

    program: Program  # the blocks as they were read
    machine: Machine  # limits, interpolation period, filters
    # the exact programmed path with its tolerances, or with smaller ones (`with_share`, delivery/periods.py)
    toolpath: Toolpath
    stages: Stages  # the clock
    # machine and toolpath by which the motion is judged, if it is planned with others; else None
    judged: tuple[Machine, Toolpath] | None = None
    # what a plan takes that there is already [s]: motions that take longer need not be delivered
    most: float = np.inf

    @property
    def real(self) -> tuple[Machine, Toolpath]:
        """Machine and toolpath by which the motion is judged."""
        return self.judged or (self.machine, self.toolpath)

    def with_share(self, share: float, seen: float, *, curved: bool) -> Job:
        """The job with smaller tolerances, so that the rest is left to the filters behind the setpoints.

        share  : of the tolerances, 0 < share <= 1 [-]
        seen   : of the lengths of the filters, as far as closed forms use them [-]
        curved : whether the normal acceleration is limited to `BOLDER` times that of the filters' rest

        Only for machines with filters.
        """
        machine, toolpath = self.real
        assert machine.fir is not None
        by = seen * float(np.sqrt(share))  # T^2 over tolerance stays
        lag = machine.fir.phase_lag_max
        filters = {
            "time_constants": tuple(by * T for T in machine.fir.time_constants),
            "phase_lag_max": None if lag is None else by * lag,
        }
        planned = machine.model_copy(update={"fir": machine.fir.model_copy(update=filters)})
        if curved:
            # of the largest tolerance: where it is smaller, the filters' error is measured
            rest = (1.0 - share) * float(toolpath.tolerance.max())
            planned = with_less_normal(planned, BOLDER * rest / filter_rate(machine))
        return dataclasses.replace(
            self,
            machine=planned,
            toolpath=dataclasses.replace(toolpath, tolerance=share * self.toolpath.tolerance),
            judged=(machine, toolpath),
        )

    def faster_than(self, time: float) -> Job:
        """The job, of which only motions are asked for that take less time [s]."""
        return dataclasses.replace(self, most=min(self.most, time))

    def with_own_clock(self) -> Job:
        """The job for a plan inside the plan: its steps are told too, but not its progress."""
        stages = Stages()
        stages.tell = self.stages.tell
        return dataclasses.replace(self, stages=stages)

    def stage(self, name: str) -> AbstractContextManager[Callable[[float], None]]:
        """Run a stage under the clock. Yields a function to call with the fraction done (0 to 1)."""
        return self.stages.stage(name)

    @property
    def tell(self) -> Tell:
        """Tell of a step (planning/job/trace.py)."""
        return self.stages.tell

    @cached_property
    def stop_time(self) -> float:
        """Cycle time if every block ran from rest to rest [s], dwells included: the baseline of the plan."""
        machine, toolpath = self.real
        return stop_time(toolpath, machine)

    @cached_property
    def line_stop_time(self) -> float:
        """The same with no stops between lines that go straight on [s]."""
        machine, toolpath = self.real
        return stop_time(toolpath, machine, join_lines=True)

    def behind_filters(self, motion: TimedT) -> TimedT:
        """The motion, slower where it would leave the tolerance behind the filters (delivery/filters.py)."""
        with self.stage("filters"):
            machine, toolpath = self.real
            return kept(motion, toolpath, machine)

    def deliver_in_time(self, motion: TimedT, *, as_it_is: bool = False) -> Delivered | None:
        """The motion delivered, slower where filters ask for it; None if it takes longer than `most`."""
        slower = self.behind_filters(motion) if motion.end <= self.most else motion
        if slower.end > self.most:
            return None
        return self.deliver(slower, as_it_is=as_it_is)._replace(filtered=slower.end > motion.end)

    def deliver(
        self, motion: MotionInTime, not_limited: tuple[str, ...] = (), *, as_it_is: bool = False
    ) -> Delivered:
        """Sample a motion at the interpolation period and have it judged, between the samples too.

        not_limited : quantities that are reported and not judged, "jerk" for example
        as_it_is    : whatever the verdict finds; else the motion is run slower where that mends it
                      (delivery/mending.py). If only the chords between samples are in the way, and that costs
                      more than `CHEAP`, a motion planned with less tolerance may be faster: then the motion
                      is delivered as it is, with the slower one.

        Standstills are added where chords would cut off a full stop (delivery/periods.py).
        """
        made, stands = self._delivered(motion, not_limited, 0)
        if as_it_is or made.verdict.passed:
            return made
        slower, mended = motion, made
        for again in range(mending.ROUNDS):
            found = mending.mended(slower, stands, mended.verdict, self.real[0].dt, again)
            if found is None:
                return made
            places = len(mended.verdict.excesses)
            self.tell("slower in places", found=found.end, before=slower.end, places=places)
            slower = found
            mended, stands = self._delivered(slower, not_limited, again + 1)
            if mended.verdict.passed:
                break
        if not mended.verdict.passed:
            return made
        if made.verdict.kinds & OF_CHORDS and slower.end > (1.0 + CHEAP) * motion.end:
            return made._replace(slower=mended)
        return mended

    def _delivered(
        self, motion: MotionInTime, not_limited: tuple[str, ...], seed: int
    ) -> tuple[Delivered, periods.Standing]:
        """Trajectory and verdict, and where the motion was made to stand longer. `seed` is of the times at which the
        verifier looks; another one if a verdict was fed back into the motion."""
        machine, toolpath = self.real
        with self.stage("sample"):
            stands = periods.standing(motion, toolpath, machine, "jerk" not in not_limited)
            motion = periods.with_standstills(motion, stands)
            whole = motion if toolpath.extrusion is None else Extruding(motion, toolpath, machine.dt)
            trajectory = sample_motion(whole, machine.dt)
            places = SegmentsInOrder(toolpath)

            def take(chunk: Trajectory) -> None:
                places.take(chunk.position, chunk.feed)

            if isinstance(trajectory, TrajectoryOnDemand):
                judged: Trajectory = trajectory.heard_by(take)
            else:
                take(trajectory)
                judged = trajectory
        free = (*not_limited, *self.program.reading.unjudged)
        with self.stage("verify") as progress:
            verdict = verify(
                judged, toolpath, machine, motion=whole, seed=seed, not_limited=free, progress=progress
            )
        runs = places.runs()
        if runs is None:
            return Delivered(trajectory, verdict, motion, notes=(NOT_ON_PATH,)), stands
        return Delivered(_at_blocks(trajectory, toolpath, *runs), verdict, motion), stands

    def plan(
        self,
        made: Delivered | None,
        *,
        method: str,
        corner: str | None,
        solver: str,
        status: Status,
        sentence: str,
        grid_points: int,
        tables: Tables = NO_TABLES,
        notes: Iterable[str] = (),
    ) -> Plan:
        """The plan of the job.

        made  : None if the job could not be solved
        notes : what was given up, each with its first line and a count

        The other arguments are fields of `Plan`.
        """
        trajectory, verdict = (None, None) if made is None else (made.trajectory, made.verdict)
        given_up = tuple(dict.fromkeys((*(made.notes if made else ()), *notes, *self._ringing(made, method))))
        for note in given_up:
            self.tell("given up", what=note)
        longest = [] if tables.grid is None else tables.grid.percents()[:3]
        held: dict[str, Any] = (
            {} if tables.grid is None else {"held_by": ", ".join(f"{a} {b} %" for a, b in longest)}
        )
        self.tell(
            "plan",
            found=np.nan if trajectory is None else trajectory.cycle_time,
            method=method,
            corner=corner or "none",
            points=grid_points,
            passed=verdict is not None and verdict.passed,
            **held,
        )
        return Plan(
            method=method,
            corner=corner,
            solver=solver,
            program=self.program,
            machine=self.real[0],
            toolpath=self.real[1],
            status=status,
            sentence=sentence,
            trajectory=trajectory,
            verdict=verdict,
            grid=tables.grid,
            stop_time=self.stop_time,
            grid_points=grid_points,
            prices=tables.prices,
            making=None if made is None else Making(*made[2:5], tables.priced, given_up),
            notes=(*job_notes(self.program, *self.real), *given_up),
            timings=self.stages.timings,
        )

    def unsolved(self, method: str, status: Status, sentence: str) -> Plan:
        """The plan of a job for which there is no motion."""
        return self.plan(
            None, method=method, corner=None, solver="", status=status, sentence=sentence, grid_points=0
        )

    def _ringing(self, made: Delivered | None, method: str) -> Iterator[str]:
        """That vibration modes are excited, if they are; method fir makes filters that leave them at rest."""
        shaped = made is None or isinstance(made.motion, ShapedMotion)
        if self.machine.modes and not shaped and method != "fir":
            can = (
                "give --shaped"
                if method in (OPTIMAL, SECOND_ORDER)
                else f"{OPTIMAL} and {SECOND_ORDER} do with --shaped"
            )
            yield f"method {method} does not shape its setpoints for the machine's vibration modes; {can}"


def _at_blocks(trajectory: Trajectory, toolpath: Toolpath, first: Array, segment: Array) -> Trajectory:
    """The trajectory with each sample at its block: from the samples `first` (n,) on at `segment` (n,)."""
    if isinstance(trajectory, TrajectoryOnDemand):
        return trajectory.at_places(first, toolpath.block[segment], toolpath.line[segment])
    segment = np.repeat(segment, np.diff(np.append(first, len(trajectory))))
    return dataclasses.replace(trajectory, block=toolpath.block[segment], line=toolpath.line[segment])
