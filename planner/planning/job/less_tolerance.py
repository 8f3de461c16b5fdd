"""A job planned again with less tolerance where the chords between samples leave it."""

import dataclasses
from collections.abc import Callable

import numpy as np

from planner.delivery import periods
from planner.geometry.toolpath import Joint, Toolpath
from planner.planning.job.choice import inside
from planner.planning.job.job import Job
from planner.planning.job.plan import Plan
from planner.verifier import Verdict

# At most so often: first less at corners, then on the arcs beside them too and twice as much, then inside
# blocks. What one phase of the samples may do to a corner is known after the first.
PERIOD_ROUNDS = 8
SAME_TIME = 1e-12  # share of a time that is rounding [-]


def with_less_tolerance(job: Job, made: Plan, planned: Callable[[Job], Plan]) -> Plan:
    """The plan with less and less tolerance until chords keep it, as long as it beats `job.most`."""
    path, (machine, programmed) = job.toolpath, job.real
    before, times = np.nan, 1.0
    for again in range(1, PERIOD_ROUNDS + 1):
        if made.making is None or inside(made) or made.cycle_time > job.most:
            break
        with job.stage("geometry"):
            near, far = periods.missed(made.making.motion, programmed, machine.dt)
            same = abs(made.cycle_time - before) <= SAME_TIME * made.cycle_time
            times = 2.0 * times if same else 1.0
            before = made.cycle_time
            less = periods.with_less_tolerance(path, programmed, near, far, times, beside=same)
            if less is None and made.verdict is not None and (worst := _worst(made.verdict)) is not None:
                less = periods.with_less_inside(path, programmed, *worst, far, times)
        if less is None:
            break
        path = less
        stops = int((less.joint == Joint.STOP).sum() - (programmed.joint == Joint.STOP).sum())
        corners = int((less.tolerance < job.toolpath.tolerance).sum())
        job.tell("less for the period", round=again, corners=corners, stops=stops)
        made = planned(dataclasses.replace(job, toolpath=path, judged=(machine, programmed)))
    if path is job.toolpath:
        return made
    # what less tolerance costs is not in the problem's prices
    making = made.making and made.making._replace(priced=None)
    notes = (*made.notes, _said(made, job.toolpath, path))
    return dataclasses.replace(made, prices=None, making=making, notes=notes)


def _worst(verdict: Verdict) -> tuple[int, float] | None:
    """Where chords are most off in the judge's eyes: the NC line, and how far off as a share of the
    tolerance; None where they keep it. Eq. (18) bounds them by the curvature at the vertex, which can be more
    than any phase of the samples shows."""
    for check in (verdict.contour, verdict.vertex):
        if check.broken:
            return check.line, check.ratio
    corners = verdict.corners
    if not corners.overdrawn.any():
        return None
    at = int(corners.budget_ratio.argmax())
    return int(corners.line[at]), float(corners.budget_ratio[at])


def _said(made: Plan, programmed: Toolpath, planned: Toolpath) -> str:
    """The tolerance that the period took from the corners, for the notes."""
    stops = (planned.joint == Joint.STOP) & (programmed.joint != Joint.STOP)
    less = (planned.tolerance < programmed.tolerance) & ~stops
    first = programmed.line[max(int(np.flatnonzero(stops | less)[0]) - 1, 0)]
    return (
        f"samples {made.machine.dt * 1e3:g} ms apart: {less.sum()} corners are planned with less of the tolerance, and "
        f"{stops.sum()} are full stops; the first is at the end of line {first}"
    )
