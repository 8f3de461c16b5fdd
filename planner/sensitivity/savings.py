"""The saving by a tenth more of a limit where corners are rounded: the problem solved again with it.

A price is a slope, and ten per cent of a limit are a long way down a curve that flattens: soon another limit
holds, a feed that an axis cannot follow, a corner's normal acceleration. On a given path of rounded corners
the problem is solved once more for each change that is worth it, as long as all of these together have no
more than `POINTS` points. The corners are rounded again for the changed machine (their size depends on
accelerations and tolerance) and keep their grid (path.moved_grid). Splines would adapt their shape.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from planner.base.sizes import SIZES
from planner.corners.smooth import SmoothPath, round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.limits import LIMITS
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import moved_grid
from planner.feedrate.solution import FeedrateSolution
from planner.machine import Machine
from planner.machine.user_limit import ScaledLimit

POINTS = SIZES.priced  # of all problems that are solved again
SOLVER = JerkLimited(tol=1e-5)  # with a gap a tenth of the usual one: differences of times are wanted


@dataclass(frozen=True, eq=False, kw_only=True)
class Change:
    """More of something, as functions of the share that is added [-]."""

    machine: Callable[[float], Machine]  # share -> the machine with so much more
    feed: Callable[[float], float] = lambda share: 1.0  # share -> factor on the programmed feed [-]
    tolerance: Callable[[float], float] = lambda share: 0.0  # share -> what is added to the tolerance [mm]


def solved_again(
    samples: PathSamples, problem: FeedrateProblem, changes: Mapping[str, Change], share: float
) -> dict[str, float]:
    """Time that a share more [-] of each of some changes saves on a path of rounded corners, as many as
    `POINTS` allow, by name [s]; those that have no solution are not among them."""
    many = POINTS // len(samples) - 1
    if not changes or many < 1:
        return {}
    before = SOLVER.solve(problem)
    saved = {}
    for name, change in [*changes.items()][:many]:
        try:
            moved, machine = _changed(samples, change, share)
            again = SOLVER.solve(
                dataclasses.replace(
                    feedrate_problem(moved, machine), limit_scale=problem.limit_scale, margin=problem.margin
                )
            )
        except ValueError:  # the grid has no room for it
            continue
        if before.solved and again.solved:
            saved[name] = before.cycle_time - again.cycle_time - opened(samples, before, moved.path)
    return saved


def _changed(samples: PathSamples, change: Change, share: float) -> tuple[PathSamples, Machine]:
    """Grid and machine with a share more of something."""
    path, machine = samples.path, change.machine(share)
    toolpath = dataclasses.replace(
        path.toolpath,
        feed=path.toolpath.feed * change.feed(share),
        tolerance=path.toolpath.tolerance + change.tolerance(share),
    )
    return moved_grid(samples, round_corners(toolpath, machine, path.corner, blend_tangents=True)), machine


def opened(samples: PathSamples, solution: FeedrateSolution, path: SmoothPath) -> float:
    """Time on parts of legs that another rounding leaves free and this one does not: the grid has no
    intervals there [s]."""
    element = samples.element
    inside = np.ones(len(element) - 1, dtype=bool)
    inside[samples.piece[1:-1] - 1] = False
    meet = 1 + np.flatnonzero(inside & (element[1:] < 0) & (element[:-1] < 0) & (element[1:] != element[:-1]))
    leg = ~element[meet - 1]
    free = path.legs.length[leg] - path.d_out[leg] - path.d_in[leg + 1]
    v = np.sqrt(solution.feed_sq[meet])
    return float(np.divide(np.maximum(free, 0.0), v, out=np.zeros(len(v)), where=v > 0.0).sum())


def more_of(machine: Machine, name: str) -> Callable[[float], Machine]:
    """A function that makes the machine with a given share more of a limit: "velocity.x" of an axis, one with
    a key of its own in the machine file, or "velocity.NAME" of a limit of one's own, whose bound of that
    quantity is then so much larger everywhere."""
    quantity, _, of = name.partition(".")
    keys = {limit.name: limit.key for limit in LIMITS if limit.key}

    def more_of_key(share: float) -> Machine:
        return machine.model_copy(update={keys[name]: getattr(machine, keys[name]) * (1.0 + share)})

    def more(share: float) -> Machine:
        limits = machine.axes[of]
        larger = limits.model_copy(update={quantity: getattr(limits, quantity) * (1.0 + share)})
        return machine.model_copy(update={"axes": machine.axes | {of: larger}})

    def more_of_own(share: float) -> Machine:
        return machine.with_own(
            [
                ScaledLimit(limit, quantity, 1.0 + share) if limit.name == of else limit
                for limit in machine.own
            ]
        )

    if name in keys:
        return more_of_key
    return more if of in machine.axes else more_of_own
