"""The jerk-limited feedrate problem once more, in the path domain: a sequence of convex problems.

Where nlp.py has time, this formulation has arc length: x = feed^2 and u = acceleration along the path at the
points, w = du/ds on the intervals. There u goes from one point to the next along a given shape, and x with
it, so that all dynamics are linear:

    minimise   T = sum_i integral over interval i of ds / sqrt(x(s))
    subject to x_{i+1} = x_i + 2 ds_i (u_i + m_i (u_{i+1} - u_i))          m_i: mean of the shape, 1/2 where w is constant
               0 <= x_i <= c_i = feed_sq_limit_i,            x_i + u_i ds_i <= (c_i + c_{i+1})/2
    and at both ends of every interval (r', r'', r''' of that side; w there, in that interval), for every axis
    k
               | r'_k u + r''_k x |                         <= a_k (1 - margin_i)
               | r'_k w + 3 r''_k u + r'''_k x | sqrt(x)    <= j_k          (the jerk along the path is w sqrt(x))
               x = u = 0 at both ends.

The row x + u ds keeps the feed within its bounds between the points: where w is constant it is the middle
Bezier ordinate of x(s). The time is convex, because x(s) is linear in the unknowns and 1/sqrt is convex; it
is taken by Gauss's rule, which has positive weights and keeps that. Only the jerk rows are not convex.
Divided by sqrt(x) they read |g| <= j x^(-1/2), and x^(-1/2), which is convex, lies above its tangent at the
last profile X:

    | r'_k w + 3 r''_k u + r'''_k x |  <=  j_k X^(-1/2) (3/2 - x/(2 X))  <=  j_k x^(-1/2).

Each pass solves the convex problem with the tangent. Its solution keeps the true rows. The last profile, if
it keeps them, keeps the tangent's as well, which touches there: no pass is slower than the one before. The
first X need keep nothing, because whatever X > 0, a profile that is slow enough obeys the tangent's rows. It
is the second-order optimum.

**Rest.** With constant w a motion never leaves x = u = 0 (x = w s^2 takes forever). With constant jerk in
time, s = j t^3/6, it is

    u = j^(2/3) (6 s)^(1/3),     x = (3/2) u s,     duration 3 s / sqrt(x),     j = (2/(9 s^2)) x^(3/2):

u is linear in the cube root of the distance from rest. So on intervals nearer to rest than `NEAR` times their
length the shape is that of the cube root (m = 3/4 on the first), elsewhere w is constant. The dynamics stay
linear, the time is exact on the first interval, and its jerk rows are exact bounds on the x_1 at its end, d
from rest, without a tangent:

    | (2/(9 d^2)) r'_0 | x_1^(3/2) <= j_k,       | (2/(9 d^2)) r' + (2/d) r'' + r''' | x_1^(3/2) <= j_k.

The last interval is its mirror image (r'' has the other sign). With constant w on all intervals but the first
and the last, a line from rest to rest, all of it limited by jerk, takes 1 to 3 % longer, and refining the
grid helps only with its cube root.

**What is delivered.** A `FeedrateSolution` means constant jerk in time on every interval; here the jerk
varies on it. Its `feed_sq`, `acc_s` and `duration` (the integral above) are those of this formulation,
`jerk_s` is the time mean of the jerk on the interval, (u_{i+1} - u_i)/h. The rows above hold at the points to
1e-6; those of `constraint_ratios`, which takes the jerk for constant, do not where it varies much on an
interval. `ExactMotion` makes a motion of it.

On one grid its optimum differs from nlp.py's by the transcription: 3 % where few intervals make a motion,
half of it or less with each halving of the spacing, 0.01 % on fine grids. Not convex as a whole, and no
certificate of a global optimum. It takes 2 to 5 passes.
References: Debrouwere et al. 2013, doi 10.1109/TRO.2013.2277565 (the tangent of x^(-1/2)); Verscheure et al.
2009, doi 10.1109/TAC.2009.2028959 (path domain); Waechter & Biegler 2006, doi 10.1007/s10107-004-0559-y
(ipopt).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.solvers.near_rest import NODES, WEIGHTS, IntervalShape, beside_rest
from planner.base.arrays import FloatArray
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.piecewise import (
    INTERVALS_MIN,
    Found,
    slowed_to_limits,
    solution_of,
    solve_pieces,
    too_few,
    too_large,
    with_exact_kinematics,
)
from planner.feedrate.solution import FeedrateSolution, Status

# Largest violation of a scaled row or bound that a solution may have, and the residual asked of ipopt [-].
VIOLATION_MAX = 1e-6
FEASIBILITY = 1e-8
CONVEX_TOL = 1e-8  # relative tolerance of optimality of each convex problem [-]

CONVERGED = (Status.OPTIMAL, "time-optimal for the limits with jerk, in the path domain, to first order")
STOPPED = (
    Status.ACCEPTABLE,
    "keeps all limits with jerk, but more passes would make it faster; raise max_passes",
)
TOO_LONG = (
    Status.ITERATION_LIMIT,
    "a convex problem did not converge within the iterations allowed; raise max_iterations",
)
BROKE_DOWN = (Status.NUMERICAL_ERROR, "the solver broke down; look for nearly coincident grid points")


@dataclass(frozen=True, kw_only=True)
class SequentialConvex:
    """The jerk-limited problem as a sequence of convex ones.

    tol            : a pass that gains a smaller share of the time is the last [-]
    max_passes     : per piece
    max_iterations : of ipopt, per pass
    points_max     : larger problems are refused: this one takes about a minute
    """

    tol: float = 1e-5
    max_passes: int = 20
    max_iterations: int = 200
    points_max: int = 10_000  # benchmarks/results/solver-sizes.md

    def __post_init__(self) -> None:
        if not self.tol > 0:
            raise ValueError(f"SequentialConvex.tol: {self.tol} must be positive")
        if not self.max_passes > 0:
            raise ValueError(f"SequentialConvex.max_passes: {self.max_passes} must be positive")

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces, which must start and end at rest; a failure of any piece is the
        status of the whole. `iterations` are those of ipopt, summed over the passes, of the piece that took
        most."""
        began = time.perf_counter()
        if len(problem) > self.points_max:
            return too_large(problem, self.points_max, "sequential-convex", repr(self))
        guess = Reachability().solve(problem).require()  # from rest to rest there always is one
        found = solve_pieces(problem, lambda g: _solve_piece(problem, g, guess, self), progress)
        return solution_of(problem, found, repr(self), began)


def _solve_piece(
    problem: FeedrateProblem, g: int, guess: FeedrateSolution, settings: SequentialConvex
) -> Found:
    """Transcribe piece g and solve it pass by pass; the whole formulation, from top to bottom.

    The columns are those of `piecewise.Found`; the jerk is the mean of each interval.
    """
    here = slice(problem.piece[g], problem.piece[g + 1])
    ds = np.diff(problem.s[here])
    n, axes = len(ds), len(problem.axes)
    if n < INTERVALS_MIN:
        return too_few(n)

    # ---- scaling: units in which the mean interval and its guessed duration are 1
    length, second = ds.mean(), guess.duration[here][:-1].mean()
    speed, acc = length / second, length / second**2
    ds = ds / length

    # ---- variables: x and u at the points; the profile X at which the tangents touch is a parameter
    x, u, last = ca.MX.sym("x", n + 1), ca.MX.sym("u", n + 1), ca.MX.sym("last", n + 1)
    inner = slice(1, n - 1)  # the intervals, or their left ends, that do not touch rest

    # ---- objective: the time, by Gauss's rule; exact on the first and the last interval
    shape = IntervalShape.of(problem.s[here])
    gain = u[1:] - u[:-1]
    times = ca.vertcat(3.0 * ds[0] / ca.sqrt(x[1]), ca.MX(n - 2, 1), 3.0 * ds[-1] / ca.sqrt(x[n - 1]))
    for node, weight, part in zip(NODES, WEIGHTS, shape.integrals, strict=True):
        between = x[:-1] + 2.0 * ds * (node * u[:-1] + part * gain)
        times[inner] += weight * ds[inner] / ca.sqrt(between[inner])

    # ---- dynamics
    gap = x[1:] - x[:-1] - 2.0 * ds * (u[:-1] + shape.mean * gain)

    # ---- constraints: the feed between the points, then acceleration and tangents of the jerk at both ends
    # of every interval --
    cap = problem.feed_sq_limit[here] / speed**2
    rows = [(x[inner] + ds[inner] * u[inner]) / ((cap[inner] + cap[2:n]) / 2.0)]
    row_min, row_max = [np.full(n - 2, -np.inf)], [np.ones(n - 2)]
    room = 1.0 - problem.margin[here][:-1, None]
    for to, slope, d2, d3 in (
        (0, shape.slope_start, problem.d2_right[here], problem.d3_right[here]),
        (1, shape.slope_end, problem.d2_left[here], problem.d3_left[here]),
    ):
        w = (slope / ds)[inner] * gain[inner]
        end = slice(to, n + to)  # the points at this end of the intervals, all and inner ones
        own = slice(to + 1, n - 1 + to)
        limit, jerk_limit = problem.acceleration_limit[here][end] * room, problem.jerk_limit[here][own]
        for k in range(axes):
            along, across = problem.d1[here][:, k], d2[:, k] * length
            rows.append((along[end] * u[end] + across[end] * x[end]) * (acc / limit[:, k]))
            turning = along[own] * w + 3.0 * across[own] * u[own] + d3[own, k] * length**2 * x[own]
            share_of_jerk = turning * ca.sqrt(last[own]) * (acc / second / jerk_limit[:, k])
            nearer = x[own] / (2.0 * last[own])
            rows += [share_of_jerk + nearer, share_of_jerk - nearer]
            row_min += [np.full(n, -1.0), np.full(n - 2, -np.inf), np.full(n - 2, -1.5)]
            row_max += [np.full(n, 1.0), np.full(n - 2, 1.5), np.full(n - 2, np.inf)]

    # ---- boundary: rest, and what the jerk of the first and last interval allows next to it
    free = np.full(n + 1, np.inf)
    lower, upper = np.concatenate([np.zeros(n + 1), -free]), np.concatenate([cap, free])
    beside = (1, *beside_rest(problem, here.start, 1)), (n - 1, *beside_rest(problem, here.stop - 1, -1))
    for i, x_max, _ in beside:
        upper[i] = min(upper[i], x_max / speed**2)
    for at_rest in (0, n):
        lower[[at_rest, n + 1 + at_rest]] = upper[[at_rest, n + 1 + at_rest]] = 0.0

    # ---- initial guess: the feed of the second-order optimum; without acceleration, x is positive between
    # the points too -------
    profile = np.concatenate([guess.feed_sq[here] / speed**2, np.zeros(n + 1)])

    # ---- solve, pass by pass; nlpsol returns numbers whatever happened: only its statistics tell
    bounds = {
        "lbx": lower,
        "ubx": upper,
        "lbg": np.concatenate([np.zeros(n), *row_min]),
        "ubg": np.concatenate([np.zeros(n), *row_max]),
    }
    program = {"x": ca.vertcat(x, u), "f": ca.sum1(times), "g": ca.vertcat(gap, *rows), "p": last}
    solver = ca.nlpsol("solver", "ipopt", program, _options(settings))
    passed = _passes(solver, profile, bounds, settings)
    if passed.result is None:
        return Found(status=passed.status, sentence=passed.sentence, iterations=passed.iterations)

    # ---- unpack
    lam_x, lam_g = passed.result["lam_x"], passed.result["lam_g"]
    profile = np.clip(passed.result["x"], lower, upper)
    x_found, u_found = profile[: n + 1] * speed**2, profile[n + 1 :] * acc
    h = np.array(ca.Function("times", [x, u], [times])(profile[: n + 1], profile[n + 1 :])).ravel() * second
    profile_columns = np.zeros((n + 1, 4))
    profile_columns[:, 0], profile_columns[:, 1] = x_found, u_found
    profile_columns[:-1, 2], profile_columns[:-1, 3] = np.diff(u_found) / h, h

    # ---- multipliers of the last pass, in time [s]: where the tangents touch, their rows have the gradients
    # of the true ones --------
    of_gap, of_feed, *of_axes = np.split(
        second * lam_g, np.cumsum([n, n - 2, *[n, n - 2, n - 2] * 2 * axes])[:-1]
    )
    of_x = second * np.maximum(lam_x[: n + 1], 0.0)
    multipliers = np.zeros((n + 1, 3 + 4 * axes))
    multipliers[1:n, 0] = of_x[1:n] * cap[1:n]
    multipliers[inner, 1] = of_feed
    multipliers[:-1, 2] = -of_gap / speed**2
    of_rows = np.zeros((n + 1, axes, 4))  # in the order of `Multipliers.rows`
    for place, (of_acceleration, of_jerk) in enumerate(((0, 1), (3, 2))):
        for k in range(axes):
            along, over, under = of_axes[3 * (place * axes + k) :][:3]
            of_rows[:-1, k, of_acceleration], of_rows[inner, k, of_jerk] = along, over + under
    for i, x_max, (k, row) in beside:
        if x_max / speed**2 <= cap[i]:  # the bound of x there is that of a jerk, which goes with x^(3/2)
            of_rows[i - 1 if i == 1 else i, k, row], multipliers[i, 0] = of_x[i] * upper[i] / 1.5, 0.0
    multipliers[:, 3:] = of_rows.reshape(n + 1, -1)
    return Found(
        status=passed.status,
        sentence=passed.sentence,
        iterations=passed.iterations,
        columns=np.column_stack([profile_columns, multipliers]),
    )


@dataclass(frozen=True, kw_only=True)
class _Passed:
    """How the passes ended: the last result of ipopt that keeps all limits, None if there is none."""

    status: Status
    sentence: str
    iterations: int
    result: dict[str, FloatArray] | None


def _passes(
    solver: Any, profile: FloatArray, bounds: dict[str, FloatArray], settings: SequentialConvex
) -> _Passed:
    """Solve pass by pass from a profile (2 n + 2,) of x and u, until one gains little."""
    n = len(profile) // 2 - 1
    (status, sentence), result = STOPPED, None
    iterations, fastest = 0, np.inf
    for done in range(settings.max_passes):
        touching = np.where(profile[: n + 1] > 0.0, profile[: n + 1], 1.0)  # not used where the profile rests
        found = {name: np.array(v).ravel() for name, v in solver(x0=profile, p=touching, **bounds).items()}
        stats = solver.stats()
        iterations += int(stats["iter_count"])
        kept = _violation(found, bounds) <= VIOLATION_MAX
        if not (stats["return_status"] in ("Solve_Succeeded", "Solved_To_Acceptable_Level") and kept):
            too_long = stats["return_status"] == "Maximum_Iterations_Exceeded"
            status, sentence = TOO_LONG if too_long else BROKE_DOWN
            if done > 0:
                status = STOPPED[0]
                sentence = f"the result of {done} passes, which keeps all limits; then {sentence}"
            break
        gained, fastest = fastest - found["f"][0], found["f"][0]
        result, profile = found, found["x"]
        if gained <= settings.tol * fastest:
            status, sentence = CONVERGED
            break
    return _Passed(status=status, sentence=sentence, iterations=iterations, result=result)


def _violation(result: dict[str, FloatArray], bounds: dict[str, FloatArray]) -> float:
    """Largest violation of a scaled row or bound; NaN if there is one in the result."""
    excess = [bounds[f"lb{name}"] - result[name] for name in "xg"]
    excess += [result[name] - bounds[f"ub{name}"] for name in "xg"]
    return float(np.concatenate(excess).max())


def _options(settings: SequentialConvex) -> dict[str, Any]:
    """Options of casadi's interface to ipopt; within a pass all rows are linear."""
    return {
        "print_time": False,
        "show_eval_warnings": False,  # of trial steps to x < 0, which ipopt shortens
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.mu_strategy": "adaptive",
        "ipopt.tol": CONVEX_TOL,
        "ipopt.max_iter": settings.max_iterations,
        "ipopt.constr_viol_tol": FEASIBILITY,
        "ipopt.acceptable_constr_viol_tol": VIOLATION_MAX,
    }


@dataclass(frozen=True, kw_only=True)
class ExactMotion:
    """A solver whose profiles are brought onto constant jerk on every interval."""

    solver: SequentialConvex  # makes the profiles

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Jerk-limited profile of all pieces, which must start and end at rest; a failure of any piece is the
        status of the whole."""
        began = time.perf_counter()
        found = self.solver.solve(problem, progress)
        if not found.solved:
            return found
        exact = with_exact_kinematics(problem, found)
        if exact is None:
            return FeedrateSolution.failed(
                problem,
                Status.NUMERICAL_ERROR,
                "no motion with constant jerk on every interval is near the profile found; refine the grid, or use solver own",
                repr(self.solver),
                time.perf_counter() - began,
                found.iterations,
            )
        slower = slowed_to_limits(problem, exact)
        later = slower.cycle_time / found.cycle_time - 1.0
        sentence = (
            f"{found.sentence}; with constant jerks between the points {100.0 * later:+.2g} % of the time"
        )
        return replace(slower, sentence=sentence, solve_time=time.perf_counter() - began)
