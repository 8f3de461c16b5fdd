"""A job as it is, and planned with other values of some settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.commands.study.settings import FEED, TOLERANCE, Setting, job_settings, with_feed, with_settings
from planner.machine import Machine
from planner.nc.program import Program

if TYPE_CHECKING:
    from planner.planning.job.plan import Plan
    from planner.planning.job.stages import Progress


@dataclass(frozen=True, eq=False, kw_only=True)
class StudiedJob:
    """A program that is planned many times.

    tolerance : contour tolerance that takes precedence over the program's and the machine's [mm], or None
    how       : method and settings of `planner.plan`: method, geometry, corner, solver, effort, rounds
    """

    program: Program
    machine: Machine
    tolerance: float | None = None
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def present_tolerance(self) -> float:
        """The contour tolerance [mm]; NaN if the program has several (G64 P)."""
        if self.tolerance is not None:
            return self.tolerance
        of_block = np.where(np.isnan(self.program.tolerance), self.machine.tolerance, self.program.tolerance)
        found = np.unique(of_block) if len(of_block) else np.array([self.machine.tolerance])
        return float(found[0]) if len(found) == 1 else float("nan")

    def changed(self, settings: Sequence[Setting]) -> StudiedJob:
        """The job with other values of some settings. Raises InputError where they do not go together."""
        of_job = job_settings(settings)
        return dataclasses.replace(
            self,
            program=with_feed(self.program, of_job.get(FEED, 1.0)),
            machine=with_settings(self.machine, settings),
            tolerance=of_job.get(TOLERANCE, self.tolerance),
        )

    def plan(self, progress: Progress | None = None) -> Plan:
        """Plan the job. Raises InputError as `planner.plan`."""
        from planner.planning.methods.registry import plan

        return plan(self.program, self.machine, tolerance=self.tolerance, progress=progress, **self.how)
