"""All stages of a second-order plan in one call, without sampling and verification, for tests of stages and laws."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.blend import CORNER_DTYPE, corner_point
from planner.corners.elements import to_arc_length
from planner.corners.own import PolynomialCorner
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.grid import add_switching_points
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.path_samples import PathSamples
from planner.feedrate.sampling.samples import RESOLUTION, sample_path
from planner.feedrate.solution import FeedrateSolution
from planner.geometry.build import toolpath_from_program
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.motion.timing import Motion, MotionInTime, TimeLaw, in_chunks, inside_pieces, law_of_solution
from planner.motion.trajectory import Trajectory
from planner.nc.program import Program
from planner.planning.optimal.geometry import corner_shape

CORNERS = ("bezier", "fir", "kinematic")


@dataclass(frozen=True, kw_only=True)
class Solved:
    """What the stages of one plan made."""

    toolpath: Toolpath
    path: SmoothPath
    samples: PathSamples
    problem: FeedrateProblem
    solution: FeedrateSolution
    law: TimeLaw

    @property
    def motion(self) -> Motion:
        return Motion(samples=self.samples, law=self.law)

    @property
    def time(self) -> float:
        """Cycle time, dwells included [s]."""
        return self.law.end


def smooth_path(
    program: Program, machine: Machine, corner: str | CornerShape = "bezier", tolerance: float | None = None
) -> SmoothPath:
    toolpath = toolpath_from_program(program, machine, tolerance)
    if isinstance(corner, str):
        corner = corner_shape(corner, machine, toolpath)
    return round_corners(toolpath, machine, corner)


def solve(
    program: Program,
    machine: Machine,
    corner: str | CornerShape = "bezier",
    tolerance: float | None = None,
    resolution: float = RESOLUTION,
) -> Solved:
    path = smooth_path(program, machine, corner, tolerance)
    samples = sample_path(path, machine, resolution)
    problem = feedrate_problem(samples, machine)
    solution = Reachability().solve(problem).require()
    samples = add_switching_points(samples, problem, solution, machine)
    problem = feedrate_problem(samples, machine)
    solution = Reachability().solve(problem).require()
    return Solved(
        toolpath=path.toolpath,
        path=path,
        samples=samples,
        problem=problem,
        solution=solution,
        law=law_of_solution(samples, solution),
    )


class Apexes(NamedTuple):
    """Corners that are rounded one by one, at their apexes: what eq. (19) says of their very shape, and a profile there."""

    joint: Array
    index: Array
    theta: FloatArray
    d_in: FloatArray
    tol_ap: FloatArray
    kappa: FloatArray
    closed_form: FloatArray
    planned: FloatArray


def apexes(samples: PathSamples, feed: FloatArray) -> Apexes:
    """The corners of a path on a grid of P points, passed at `feed` (P,) [mm/s]."""
    middle = (samples.element < 0) & (samples.w0 == 0.5)
    middle[samples.piece[1:] - 1] = False  # they repeat what is said of the interval before
    index = np.flatnonzero(middle)
    path, joint = samples.path, ~samples.element[index]
    kappa = np.linalg.norm(samples.d2_right[index], axis=1)
    closed = np.sqrt(path.normal_max[joint] / kappa)
    return Apexes(
        joint, index, path.theta[joint], path.d_in[joint], path.tol_ap[joint], kappa, closed, feed[index]
    )


@dataclass(frozen=True, kw_only=True)
class Corner:
    """One corner evaluated: w-derivatives (n, 4, A) and arc-length derivatives (n, 4, A); row 0 is the point."""

    by_w: FloatArray
    by_s: FloatArray
    vertex: FloatArray


def evaluate_corner(
    toolpath: Toolpath,
    joint: int,
    shape: CornerShape,
    params: FloatArray,
    w: FloatArray,
    side: FloatArray | None = None,
    scale: tuple[float, float] = (1.0, 1.0),
) -> Corner:
    """Evaluate a corner of given shape parameters (4,) at the joint between legs joint-1 and joint.

    side : (n,) parameters that choose the branch where two pieces meet; None means w itself
    """
    path = legs_of(toolpath)
    legs = path.table
    corners = np.zeros(len(legs) + 1, CORNER_DTYPE)
    corners["shape"], corners["params"][joint] = int(shape.shape), params
    corners["scale"][joint] = scale
    if isinstance(shape, PolynomialCorner):
        corners["own"][joint] = shape.coefficients
    axes = len(toolpath.axes)
    by_w, by_s = np.empty((len(w), 4, axes)), np.empty((len(w), 4, axes))
    one, two = np.empty((4, axes)), np.empty((4, axes))
    for i in range(len(w)):
        ref = w[i] if side is None else side[i]
        corner_point(legs, corners, joint, w[i], ref, one, two, by_w[i])
        by_s[i] = by_w[i]
        to_arc_length(by_s[i])
    return Corner(by_w=by_w, by_s=by_s, vertex=path.vector("start")[joint].copy())


def dense_motion(motion: MotionInTime, dt: float) -> Iterator[Trajectory]:
    """The motion between its samples at dt [s]: half-way between them and inside every piece, in chunks."""
    halves = np.arange(0.5 * dt, motion.end, dt)
    return in_chunks(
        motion, dt, np.concatenate([[0.0, motion.end], inside_pieces(motion)[1].ravel(), halves])
    )
