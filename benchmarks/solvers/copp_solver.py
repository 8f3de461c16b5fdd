"""The package copp (copp-py, MIT; https://copp.pro), TOPP3-SOCP and TOPP3-LP through its Python interface: a peer for the solvers with
jerk limits.

Copp has x = feed^2 and u = acceleration at the stations, du/ds constant between them, and the jerk rows |g| sqrt(x) <= j made convex
around a given profile; one conic program for Clarabel per pass. The first pass is around its own second-order optimum, the next ones
are around the pass before, as its documentation advises. TOPP3-LP has a linear objective in place of the time. Next to rest both have
constant jerk ("stationary" intervals).

It is given every problem in units in which the mean interval and its duration at second order are 1: in millimetres and seconds
Clarabel's tolerances let its times be off by 1 to 4 % on the curves here, and it takes three times as many iterations.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import ModuleType

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.piecewise import slowed_to_limits, with_exact_kinematics
from planner.feedrate.solution import FeedrateSolution, Status

INSTALL = "copp-py is not installed (pip install '.[bench]'): its columns are left out"
JUMP_ROUNDING = 1e-6  # jumps of r''' below this share of it are rounding [-]


def copp() -> ModuleType | None:
    """The package, or None where it is not installed."""
    try:
        import copp_py
    except ModuleNotFoundError:
        return None
    return copp_py


@dataclass(frozen=True, kw_only=True)
class CoppSocp:
    """TOPP3-SOCP, or TOPP3-LP, with copp's settings.

    passes : as many at most; copp's published figures are for one
    tol    : a pass that gains a smaller share of the time is the last [-]
    linear : TOPP3-LP
    """

    passes: int = 10
    tol: float = 1e-5
    linear: bool = False

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """One piece, from rest to rest. The jerk is the mean of each interval, the durations are copp's."""
        package = copp()
        if package is None:
            raise ModuleNotFoundError(INSTALL)
        solver = package.solver.topp3_lp if self.linear else package.solver.topp3_socp
        began = time.perf_counter()
        length = float(np.diff(problem.s).mean())
        second = Reachability().solve(problem).cycle_time / (len(problem) - 1)
        s, speed = problem.s / length, length / second
        fastest, profile, arrival, iterations = np.inf, None, problem.s, 0
        status, sentence = Status.ACCEPTABLE, f"not converged after {self.passes} passes"
        try:
            constraints = _constraints(package, problem, length, second)
            around = {"a_linearization": _second_order(package, constraints, len(problem))}
            for _ in range(self.passes):
                found = solver.solve_expert(solver.Problem(constraints, **around))
                iterations += found.iterations
                if found.profile is None:
                    sentence = f"Clarabel ended with {found.solver_status}"
                    break
                total, at = package.interpolation.s_to_t_topp3(s, found.profile)
                profile, arrival, gained, fastest = found.profile, at, fastest - total, total
                if gained <= self.tol * total:
                    status, sentence = Status.OPTIMAL, "converged"
                    break
                around = {"a_linearization": profile.a, "b_linearization": profile.b}
        except package.CoppError as fault:
            sentence = f"copp refused: {str(fault).splitlines()[0]}"
        took = time.perf_counter() - began
        if profile is None:
            return FeedrateSolution.failed(
                problem, Status.NUMERICAL_ERROR, sentence, repr(self), took, iterations
            )
        x, u = np.maximum(profile.a, 0.0) * speed**2, profile.b * speed / second
        duration = np.append(np.diff(arrival), 0.0) * second
        return FeedrateSolution(
            status=status,
            sentence=f"{sentence}; largest ratio to a jerk limit {_worst_jerk(problem, x, u):.6f}",
            solver=repr(self),
            feed_sq=x,
            acc_s=u,
            jerk_s=np.append(np.diff(u) / duration[:-1], 0.0),
            duration=duration,
            solve_time=took,
            iterations=iterations,
            jerk_limited=True,
        )


@dataclass(frozen=True, kw_only=True)
class CoppMotion:
    """Copp for whole plans: every piece by `CoppSocp`, then brought onto constant jerks within all limits (piecewise.py).

    solver : for one piece
    """

    solver: CoppSocp = field(default_factory=CoppSocp)

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces; a failure of any piece is the status of the whole."""
        found = []
        for g in range(len(problem.piece) - 1):
            found.append(self.solver.solve(problem.part(np.array([g]))))
            if not found[-1].solved:
                return FeedrateSolution.failed(
                    problem, found[-1].status, found[-1].sentence, repr(self), found[-1].solve_time
                )
            if progress is not None:
                progress((g + 1) / (len(problem.piece) - 1))
        columns = {
            name: np.concatenate([getattr(one, name) for one in found])
            for name in ("feed_sq", "acc_s", "jerk_s", "duration")
        }
        took = sum(one.solve_time for one in found)
        whole = replace(found[0], **columns, solve_time=took, iterations=max(one.iterations for one in found))
        exact = with_exact_kinematics(problem, whole)
        if exact is None:
            reason = "no motion with constant jerk on every interval is near the profile that copp found"
            return FeedrateSolution.failed(problem, Status.NUMERICAL_ERROR, reason, repr(self), took)
        return slowed_to_limits(problem, exact)


def _constraints(package: ModuleType, problem: FeedrateProblem, length: float, second: float) -> object:
    """The problem in copp's terms, in the given units. Copp knows one value of r''' per station: where it jumps, rows with
    that of the left side are added."""
    points, axes = problem.d1.shape
    robot = package.Robot(axes, capacity=points)
    robot.append_s(problem.s / length)
    d1, d2, d3 = problem.d1, problem.d2_right * length, problem.d3_right * length**2
    robot.set_q(np.zeros((points, axes)), d1, d2, 0, dddq=d3)
    robot.constraints.add_constraint_1st(problem.feed_sq_max[:, None] * (second / length) ** 2, 0)
    acceleration, jerk = problem.acceleration * second**2 / length, problem.jerk * second**3 / length
    robot.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=points)
    robot.add_jerk_limits(jerk, -jerk, start_idx_s=0, length=points)
    jump = np.abs(problem.d3_right - problem.d3_left).max(axis=1)
    for k in np.flatnonzero(jump > JUMP_ROUNDING * np.abs(problem.d3_right).max(axis=1)):
        for sign in (1.0, -1.0):
            left = (problem.d3_left[k] * length**2, 3.0 * problem.d2_left[k] * length, d1[k], np.zeros(axes))
            rows = [sign * of_axes[None, :] for of_axes in left]
            robot.constraints.add_constraint_3rd(*rows, jerk[None, :], int(k))
    return robot.constraints


def _second_order(package: ModuleType, constraints: object, points: int) -> FloatArray:
    """Copp's own second-order optimum."""
    problem = package.solver.topp2_ra.Problem(constraints, (0, points - 1), (0.0, 0.0))
    return package.solver.topp2_ra.solve(problem)


def _worst_jerk(problem: FeedrateProblem, x: FloatArray, u: FloatArray) -> float:
    """Largest ratio of an axis's jerk to its limit at either end of all intervals but those next to rest."""
    w = (np.diff(u) / np.diff(problem.s))[1:-1, None]
    worst = 0.0
    for own, d2, d3 in (
        (slice(1, -2), problem.d2_right, problem.d3_right),
        (slice(2, -1), problem.d2_left, problem.d3_left),
    ):
        turning = problem.d1[own] * w + 3.0 * d2[own] * u[own, None] + d3[own] * x[own, None]
        worst = max(worst, float((np.abs(turning) * np.sqrt(x[own, None]) / problem.jerk).max()))
    return worst
