"""Method `optimal`: smoothed path, all limits with jerk, time-optimal by the interior-point kernel.

1. Corners are rounded, tangent joints with a jump of the curvature too: a jump would need infinite jerk.
2. The second-order problem is solved first: it says where straight stretches need grid points (feedrate/grid.py).
3. The jerk-limited problem is solved on that grid (feedrate/jerk.py).
4. Each run between full stops is slowed down by whatever its densely sampled motion exceeds a limit between grid points; usually
   less than 0.1 %. Slowing down by lam divides speeds by lam, accelerations by lam^2, jerks by lam^3, so it always ends.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from planner.arrays import FloatArray
from planner.constraints.assemble import feedrate_problem
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk import JerkLimited
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.methods.activity import history
from planner.methods.closed_form import corner_table
from planner.methods.geometry import AUTO, SPLINE, on_spline
from planner.methods.plan import Plan
from planner.methods.prices import price_list
from planner.methods.reshape import OnPath, tube_prices
from planner.methods.stages import Progress, Stages, deliver, stop_time
from planner.methods.toppra import corner_shape
from planner.nc.program import Program
from planner.path import RESOLUTION, sample_path
from planner.timing import Motion, TimeLaw, dense_motion, law_of_solution, sample_motion
from planner.verify import Verdict

# The shape number of Bezier corners that is fastest with jerk limits; 0.9, which has the smaller curvature, takes 0.1 to 0.9 % longer
# (pentagon, zig-zag, circle and spiral of chords at 2e5 mm/s3; 0.92 to 0.97 are within 0.3 % of each other).
SIGMA2 = 0.94
# Slowing down moves the samples, which may then find a little more; it is repeated until nothing is left, at most so often.
SLOWING_ROUNDS = 6
# What is slowed down is slowed down by this much more [-], so that the next round finds nothing; less is rounding.
SLOWING_MORE = 1e-5
EXCESS_ROUNDING = 1e-9
# A verdict's excess up to this is made good by slowing down [-]; more is a mistake to be seen.
SEEN_EXCESS_MAX = 5e-3
SEEN_ROUNDS = 3  # at most, each with ten times the margin of the one before


@dataclass(frozen=True, kw_only=True)
class OptimalMethod:
    """Time-optimal planning with jerk limits on rounded corners.

    corner : "auto", "spline", the name of a corner shape, "bezier", "fir" or "kinematic", or a shape with settings of your own
    solver : a solver of third order
    rounds : of reshaping splines (methods/reshape.py); None for as many as the size of the job lets pay
    """

    corner: str | CornerShape = AUTO
    solver: JerkLimited = field(default_factory=JerkLimited)
    rounds: int | None = None

    def plan(
        self,
        program: Program,
        machine: Machine,
        tolerance: float | None = None,
        progress: Progress | None = None,
    ) -> Plan:
        """Plan a program. Raises InputError for what cannot be planned; an unsolved problem is the plan's status."""
        stages = Stages(progress)
        with stages.stage("geometry"):
            toolpath = toolpath_from_program(program, machine, tolerance)
            spline = self.corner in (SPLINE, AUTO)
            shape = (
                BezierCorner(sigma2=SIGMA2)
                if spline or self.corner == "bezier"
                else corner_shape(self.corner, machine, toolpath)
            )
            path = round_corners(toolpath, machine, shape, blend_tangents=True)
        if spline:
            best = on_spline(
                path,
                machine,
                lambda path, finer: self._on_path(path, machine, stages, finer=finer),
                auto=self.corner == AUTO,
                rounds=self.rounds,
                stages=stages,
            )
        else:
            best = self._on_path(path, machine, stages)
        samples, problem, solution = best.samples, best.problem, best.solution
        trajectory = verdict = corners = grid = prices = None
        if solution.solved:
            with stages.stage("solve"):
                motion = Motion(samples=samples, law=law_of_solution(samples, solution))
                motion = slowed(motion, toolpath, machine)
            trajectory, verdict = deliver(motion, toolpath, machine, stages)
            for again in range(SEEN_ROUNDS):
                factor = seen_excess(verdict)
                if factor <= 1.0:
                    break
                more = SLOWING_MORE * 10.0**again
                motion = _slower(motion, np.full(len(samples.piece) - 1, factor * (1.0 + more)))
                trajectory, verdict = deliver(motion, toolpath, machine, stages)
            with stages.stage("report"):
                corners = corner_table(samples, problem, solution)
                grid = history(problem, solution, motion.law)
                if solution.multipliers:
                    by_site = (
                        (best.shape.laid.place, tube_prices(best, best.shape))
                        if best.shape and len(best.path.spline)
                        else None
                    )
                    prices = price_list(samples, problem, solution, machine, by_site)
        return Plan(
            method="optimal",
            corner=str(self.corner) if spline else shape.name,
            solver=solution.solver,
            program=program,
            machine=machine,
            toolpath=toolpath,
            status=solution.status,
            sentence=solution.sentence,
            trajectory=trajectory,
            verdict=verdict,
            corners=corners,
            grid=grid,
            prices=prices,
            stop_time=stop_time(toolpath, machine),
            grid_points=len(samples),
            timings=stages.timings,
        )

    def _on_path(self, path: SmoothPath, machine: Machine, stages: Stages, finer: float = 1.0) -> OnPath:
        """The time-optimal motion on a path; `finer` divides the grid's resolution."""
        with stages.stage("geometry"):
            samples = sample_path(
                path, machine, None if finer == 1.0 else RESOLUTION * finer, third_order=True
            )
        with stages.stage("solve") as report:
            samples = refine_for_jerk(samples, machine)
            problem = feedrate_problem(samples, machine)
            return OnPath(
                path=path, samples=samples, problem=problem, solution=self.solver.solve(problem, report)
            )


def slowed(motion: Motion, toolpath: Toolpath, machine: Machine) -> Motion:
    """The same motion with every run slowed down until its speeds, accelerations and jerks keep all limits, on the samples and
    densely between them."""
    for _ in range(SLOWING_ROUNDS):
        factor = _excess(motion, toolpath, machine)
        slow = factor > 1.0 + EXCESS_ROUNDING
        if not slow.any():
            break
        motion = _slower(motion, np.where(slow, factor * (1.0 + SLOWING_MORE), 1.0))
        if factor.max() <= 1.0 + SEEN_EXCESS_MAX:
            break  # what the samples of the slower motion may find more, the verifier will see
    return motion


def seen_excess(verdict: Verdict) -> float:
    """By what factor a motion has to be slowed down to keep the limits that its verdict says it exceeds, if that is next to nothing:
    the verifier looks between the places that `slowed` looks at, and at differences of positions. Else 1."""
    order = {"feed": 1, "velocity": 1, "acceleration": 2, "normal_acceleration": 2, "jerk": 3}
    limited = [check for check in verdict.limits.values() if check.limited]
    if max((check.ratio for check in limited), default=0.0) > 1.0 + SEEN_EXCESS_MAX:
        return 1.0
    over = (check for check in limited if check.broken)
    return max((check.ratio ** (1.0 / order[check.name.partition(".")[0]]) for check in over), default=1.0)


def _slower(motion: Motion, factor: FloatArray) -> Motion:
    """Every run (G,) slowed down by its factor."""
    law = motion.law
    by = factor[law.run]
    lasting = np.diff(np.append(law.t, law.end))
    closing = np.append(law.run[1:] != law.run[:-1], True)  # the last piece of a run is its standstill
    t = law.t[0] + np.concatenate([[0.0], np.cumsum(np.where(closing, lasting, lasting * by))])
    slower = TimeLaw(
        t=t[:-1],
        s=law.s,
        feed=law.feed / by,
        acc_s=law.acc_s / by**2,
        jerk_s=law.jerk_s / by**3,
        run=law.run,
        end=float(t[-1]),
    )
    return dataclasses.replace(motion, law=slower)


def _excess(motion: Motion, toolpath: Toolpath, machine: Machine) -> FloatArray:
    """(G,) by what factor each run has to be slowed down to keep its limits, <= 1 where it keeps them."""
    axes = toolpath.axes
    limits = [machine.limits(q, axes) for q in ("velocity", "acceleration", "jerk")]
    programmed = np.full(int(toolpath.block[-1]) + 1, np.inf)
    programmed[toolpath.block] = toolpath.feed
    factor = np.zeros(len(motion.samples.piece) - 1)
    for chunk in chain([sample_motion(motion, machine.dt)], dense_motion(motion, machine.dt)):
        worst = chunk.feed / programmed[chunk.block]
        motions = (chunk.velocity, chunk.acceleration, chunk.jerk)
        for order, (values, limit) in enumerate(zip(motions, limits, strict=True), start=1):
            worst = np.maximum(worst, (np.abs(values) / limit).max(axis=1) ** (1.0 / order))
        at = np.searchsorted(motion.law.t, chunk.t, side="right") - 1
        np.maximum.at(factor, motion.law.run[np.maximum(at, 0)], worst)
    return factor
