"""Plans that may be faster than the time-optimal motion on splines and Bezier corners, and how to tell cheaply that they are not.

A smooth path is not always the fastest: where every corner is sharp and the legs are short, stopping at each takes no tolerance and no
grid; other corner shapes use the tolerance otherwise; and a verdict that fails at a long interpolation period may be another's pass.

stop         its time is known before it is planned, as the sum of closed forms over the blocks
corner shape its time without jerk limits on a coarse grid is less than what it takes (optimal/geometry.py); where that leaves a chance,
             its time with jerk limits on a coarse grid is more, by less than `CHANCE` says
kinematic    runs, with less freedom, on the corners of its own shape: a chance like theirs

Beyond `RIVAL_POINTS` grid points only stopping is looked at, and `kinematic` where nothing passes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial

from planner.corners.smooth import SmoothPath, round_corners
from planner.job.job import Job
from planner.job.plan import Plan
from planner.methods.kinematic import KinematicMethod
from planner.methods.stop import StopMethod
from planner.optimal.geometry import corner_bounds
from planner.optimal.on_path import corner_shape
from planner.optimal.reshape import OnPath

RIVAL_POINTS = 20_000
SHAPES = "kinematic", "fir"  # "auto" has planned Bezier corners itself
# On a grid of so many times the usual resolution a jerk-limited motion takes up to 1.009 times as long as on the usual one (60 shapes
# on random jobs of benchmarks/never_slower.py): one that takes more than `CHANCE` times the best there is not the fastest [-].
COARSER, CHANCE = 25.0, 1.03
# A rival that is faster by less is taken for the same motion without the grid's error: what holds it and what limits cost is what the
# plan says of itself [-].
SAME_MOTION = 2e-3
FASTER = 1e-4  # less is the same time [-]: the solver's own gap


def fastest(
    plan: Plan,
    job: Job,
    on_corner: Callable[..., Plan],
    on_path: Callable[[SmoothPath, float], OnPath],
) -> Plan:
    """The plan, or a rival that passes its verdict in less time, or while the plan does not; its sentence says which.

    on_corner : plans a job on a corner shape, `corner`, by its name
    on_path   : solves the feedrate problem on a path, on a grid of so many times the usual resolution
    """
    best = plan
    if job.stop_time < _time(best):
        best = _better(best, _alone(job, StopMethod().plan_job), "full stops at all blocks take less time")
    if plan.grid_points <= RIVAL_POINTS:
        for name in _chances(best, job, on_path):
            on_shape = _alone(job, partial(on_corner, corner=name))
            best = _better(best, on_shape, f"{name} corners take less time")
            if name == "kinematic":
                kinematic = _alone(job, KinematicMethod().plan_job)
                best = _better(best, kinematic, "method kinematic takes less time")
    if _time(best) == float("inf"):
        best = _better(
            best, _alone(job, KinematicMethod().plan_job), "method kinematic keeps all limits in less time"
        )
    if best is plan:
        return plan
    best = dataclasses.replace(best, method=plan.method, corner=plan.corner, timings=job.stages.timings)
    if _time(plan) < (1.0 + SAME_MOTION) * _time(best):
        return dataclasses.replace(best, prices=plan.prices, grid=plan.grid)
    return best


def _chances(best: Plan, job: Job, on_path: Callable[[SmoothPath, float], OnPath]) -> Iterator[str]:
    """Corner shapes that may be faster than the plan."""
    dwell = float(job.toolpath.dwell.sum())
    for name in SHAPES:
        with job.stage("geometry"):
            shape = corner_shape(name, job.machine, job.toolpath)
            path = round_corners(job.toolpath, job.machine, shape, blend_tangents=True)
        with job.stage("solve"):
            bounds = corner_bounds(path, job.machine)
        if bounds.points.sum() > RIVAL_POINTS or bounds.time.sum() + dwell >= _time(best):
            continue
        coarse = on_path(path, COARSER).solution
        if coarse.solved and coarse.cycle_time + dwell < CHANCE * _time(best):
            yield name


def _alone(job: Job, plan: Callable[[Job], Plan]) -> Plan:
    """A plan that does not say what another one gave up."""
    return plan(dataclasses.replace(job, noted=[]))


def _time(plan: Plan) -> float:
    """Cycle time [s], inf unless the verdict is passed, or nothing but chords between samples stands against it: then the job is
    planned again with less tolerance (delivery/periods.py)."""
    if plan.trajectory is None or plan.verdict is None:
        return float("inf")
    chords = all(fault.startswith(("vertex", "contour", "eq. 18")) for fault in plan.verdict.faults)
    return plan.trajectory.cycle_time if chords else float("inf")


def _better(best: Plan, rival: Plan, why: str) -> Plan:
    if _time(rival) < (1.0 - FASTER) * _time(best):
        return dataclasses.replace(rival, sentence=f"{why} than splines; {rival.sentence}")
    return best
