"""The reference solver of the jerk-limited problem: a nonlinear program per piece, ipopt or fatrop.

Every interval of a piece has constant jerk j_i along the path and a duration h_i; every point a feed v_i and
an acceleration a_i. The kinematics are exact cubics in time, so that a start or a stop (v = a = 0) needs no
trick:

    minimise   T = sum_i h_i
    subject to v_{i+1} = v_i + a_i h_i + j_i h_i^2/2,     a_{i+1} = a_i + j_i h_i
               ds_i = v_i h_i + a_i h_i^2/2 + j_i h_i^3/6
               0 <= v_i <= c_i = sqrt(feed_sq_limit_i),     v_i + a_i h_i/2 <= (c_i + c_{i+1})/2,     h_i >= 0
    and at both ends of every interval (r', r'', r''' of that side; jerk of that interval), for every axis k
               | r'_k a + r''_k v^2 |                     <= a_k (1 - margin_i)
               | r'_k j + 3 r''_k v a + r'''_k v^3 |      <= j_k
               v = a = 0 at the ends.

The row v + a h/2 keeps the feed within its bounds between the points as well: v(t) is a parabola whose Bezier
ordinates are v_i, v_i + a_i h_i/2 and v_{i+1}. Without it, coarse grids overshoot the programmed feed where
the acceleration ends (0.2 % of the time of a line of 100 mm).

So that all rows of a point depend on that point alone, as fatrop's stages ask for, the jerk of the interval
to its left is a state of the point as well. A stage is the state (v, a, j_left), the control (j, h), and the
gap state_{i+1} - f(state_i, control_i) = 0; fatrop wants exactly this sign and order.

Not convex; from many starting points both solvers end in the same optimum. Every row is scaled by its limit
and every piece has its own units (mean interval 1, mean guessed duration 1), so that the iterates do not
depend on the unit of length or time.

The multipliers are told in the coordinates of the own kernel (feedrate/jerk/rows.py). Rows of axis limits are
the same there; a bound on v is one on x = v^2, with half of its multiplier when both count relative changes.
The kernel's only equation is x_{i+1} = x_i + (2 a + p)(ds + p h^2/12) + e with p = j h; an error e in it shifts v_{i+1} by e/(2
vm), vm = (v_i + v_{i+1})/2, and the length of the interval by h e/(4 vm), so that with the multipliers nu_v
of v's gap and nu_s of the row of ds_i

    pi = dT/de = (nu_s h/(2 ds) - nu_v) / (2 vm).

What both cost: docs/methods.md. References: Waechter & Biegler 2006, doi 10.1007/s10107-004-0559-y (ipopt); Vanroye et al. 2023,
arXiv 2303.16746 (fatrop).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import import_needed
from planner.feedrate.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.piecewise import (
    INTERVALS_MIN,
    Found,
    polished,
    solution_of,
    solve_pieces,
    too_few,
    too_large,
)
from planner.feedrate.solution import FeedrateSolution, Status

# The guess is the second-order optimum, slower everywhere by this [-]: the best of 0.3 to 1 by iterations.
SLOWER = 0.7
# Largest violation of a scaled row or bound that a solution may have [-].
VIOLATION_MAX = 1e-6
# Grid points of the largest problem tried, about a minute (benchmarks/results/solver-sizes.md).
POINTS_MAX = {"ipopt": 20_000, "fatrop": 5_000}
# Residual of ipopt's rows [-]; its default of 1e-4 leaves ratios to the limits of 1 + 1e-5 on long pieces.
FEASIBILITY = 1e-8

OUTCOMES = {
    "Solve_Succeeded": (Status.OPTIMAL, "time-optimal for the limits with jerk"),
    "Solved_To_Acceptable_Level": (
        Status.ACCEPTABLE,
        "keeps all limits with jerk, but optimal only to a coarser tolerance than asked for",
    ),
    "Infeasible_Problem_Detected": (
        Status.INFEASIBLE,
        "no motion keeps all limits on this grid; refine it",
    ),
    "Maximum_Iterations_Exceeded": (
        Status.ITERATION_LIMIT,
        "not converged within the iterations allowed; raise max_iterations or loosen tol",
    ),
}
BROKE_DOWN = (
    Status.NUMERICAL_ERROR,
    "the solver broke down; solve with the other one (ipopt, fatrop), or look for nearly coincident grid points",
)


@dataclass(frozen=True, kw_only=True)
class JerkLimitedNLP:
    """The jerk-limited reference."""

    solver: Literal["ipopt", "fatrop"] = "ipopt"  # "ipopt" (with mumps), or "fatrop", which uses the stages
    tol: float = 1e-8  # relative tolerance of optimality [-]
    max_iterations: int = 500  # per piece
    points_max: int | None = None  # larger problems are refused; None for `POINTS_MAX` of the solver

    def __post_init__(self) -> None:
        if self.solver not in ("ipopt", "fatrop"):
            raise ValueError(f"JerkLimitedNLP.solver: '{self.solver}'; there are ipopt and fatrop")
        if not self.tol > 0:
            raise ValueError(f"JerkLimitedNLP.tol: {self.tol} must be positive")

    def solve(
        self, problem: FeedrateProblem, progress: Callable[[float], None] | None = None
    ) -> FeedrateSolution:
        """Time-optimal jerk-limited profile with multipliers and prices; a failure of any piece is the status
        of the whole. Its kinematics are exact."""
        began = time.perf_counter()
        most = POINTS_MAX[self.solver] if self.points_max is None else self.points_max
        if len(problem) > most:
            return too_large(problem, most, self.solver, repr(self))
        guess = Reachability().solve(problem)
        if not guess.solved:
            took = time.perf_counter() - began
            return FeedrateSolution.failed(problem, guess.status, guess.sentence, repr(self), took)
        found = solve_pieces(problem, lambda g: _solve_piece(problem, g, guess, self), progress)
        solution = solution_of(problem, found, repr(self), began)
        return polished(problem, solution) if solution.solved else solution


def _solve_piece(
    problem: FeedrateProblem, g: int, guess: FeedrateSolution, settings: JerkLimitedNLP
) -> Found:
    """Transcribe and solve piece g; the whole formulation, from top to bottom."""
    ca = import_needed("casadi", f"solver {settings.solver}")

    here = slice(problem.piece[g], problem.piece[g + 1])
    ds = np.diff(problem.s[here])
    intervals, axes = len(ds), len(problem.axes)
    points = intervals + 1
    if intervals < INTERVALS_MIN:
        return too_few(intervals)

    # ---- scaling: units in which the mean interval and its guessed duration are 1
    h_guess = guess.duration[here][:-1] / SLOWER
    lasts = np.isfinite(h_guess)  # not where the guess stands still at both ends of a tiny interval
    # what they take at the largest speed of the segment
    slow = ds / np.sqrt(problem.feed_sq_limit[here].max())
    h_guess = np.where(lasts, h_guess, h_guess[lasts].mean() if lasts.any() else slow)
    length, second = ds.mean(), h_guess.mean()
    speed, acc, jerk = length / second, length / second**2, length / second**3

    # ---- variables: state (v, a, j_left) and control (j, h) of each point; the last has no control
    w = ca.MX.sym("w", 5 * points - 2)
    stages = ca.reshape(ca.vertcat(w, ca.DM.zeros(2)), 5, points)

    # ---- objective
    total = ca.sum2(stages[4, :])

    # ---- dynamics and constraints of one stage; its numbers are parameters
    v, a, j_left, j, h, ds_i, cap_i = (
        ca.SX.sym(name) for name in ("v", "a", "j_left", "j", "h", "ds", "cap")
    )
    rows_of = [ca.SX.sym("rows", axes, 5) for _ in range(2)]  # right and left of the point
    following = ca.vertcat(v + h * (a + h * j / 2), a + h * j, j)
    rows = [h * (v + h * (a / 2 + h * j / 6)) / ds_i - 1, (v + h * a / 2) / cap_i]
    for c, own_jerk in zip(rows_of, (j, j_left), strict=True):
        rows += [c[:, 0] * a + c[:, 1] * v**2, c[:, 2] * own_jerk + c[:, 3] * v * a + c[:, 4] * v**3]
    numbers = ca.vertcat(ds_i, cap_i, *(ca.vec(c) for c in rows_of))
    stage = ca.Function("stage", [ca.vertcat(v, a, j_left, j, h), numbers], [following, ca.vertcat(*rows)])

    # ---- constraints of all stages, in stage order; the last one has no interval
    feed_max = np.sqrt(problem.feed_sq_limit[here])
    cap = (feed_max[:-1] + feed_max[1:]) / 2  # of v + a h/2
    data = _stage_numbers(problem, here, ds / length, cap / speed, speed, acc, jerk)
    after, limited = stage.map(points)(stages, ca.DM(data.T))
    gap = stages[:3, 1:] - after[:, :-1]
    constraints = ca.vertcat(ca.vec(ca.vertcat(gap, limited[:, :-1])), limited[2:, -1])
    of_stage = np.repeat([0.0, 1.0], [4, 1 + 4 * axes])  # equations, then rows as shares of their limits
    row_max = np.append(np.tile(of_stage, intervals), of_stage[5:])
    lower, upper = np.full((points, 5), -np.inf), np.full((points, 5), np.inf)
    lower[:, 0], upper[:, 0] = 0.0, feed_max / speed
    lower[:, 4] = 0.0

    # ---- boundary
    lower[[0, -1], :2] = upper[[0, -1], :2] = 0.0
    lower[0, 2] = upper[0, 2] = 0.0  # nothing to the left of the first point

    # ---- initial guess: the second-order optimum, slower; its acceleration made continuous
    start = np.zeros((points, 5))
    start[:, 0] = np.sqrt(guess.feed_sq[here]) * SLOWER / speed
    u = guess.acc_s[here][:-1] * SLOWER**2 / acc
    start[1:-1, 1] = (u[:-1] + u[1:]) / 2
    start[:-1, 4] = h_guess / second
    start[:-1, 3] = start[1:, 2] = np.diff(start[:, 1]) / start[:-1, 4]

    # ---- solve
    program = {"x": w, "f": total, "g": constraints}
    solver = ca.nlpsol(
        "solver", settings.solver, program, _options(settings, points, row_max == 0.0, 4 * axes + 2)
    )
    bounds = {"lbx": lower.ravel()[:-2], "ubx": upper.ravel()[:-2], "lbg": -row_max, "ubg": row_max}
    result = {
        name: np.array(value).ravel() for name, value in solver(x0=start.ravel()[:-2], **bounds).items()
    }
    status, sentence, iterations = _outcome(solver.stats(), settings)
    violation = max(
        (bounds["lbx"] - result["x"]).max(),
        (result["x"] - bounds["ubx"]).max(),
        (np.abs(result["g"]) - row_max).max(),
    )
    if status in (Status.OPTIMAL, Status.ACCEPTABLE) and not violation <= VIOLATION_MAX:
        status, sentence = BROKE_DOWN
    if status not in (Status.OPTIMAL, Status.ACCEPTABLE):
        return Found(status=status, sentence=sentence, iterations=iterations)

    # ---- unpack
    found = np.append(result["x"], [0.0, 0.0]).reshape(points, 5)
    v, h = found[:, 0], found[:, 4]
    profile = found[:, [0, 1, 3, 4]] * [speed, acc, jerk, second]
    profile[:, 0] = np.clip(profile[:, 0], 0.0, feed_max)
    profile[[0, -1], 0] = 0.0

    # ---- multipliers, in time [s]: gaps of v, a, j_left; length; feed between the points; then right and
    # left of the point ------
    lam = second * np.insert(result["lam_g"], -4 * axes, np.zeros(5)).reshape(points, -1)
    of_speed = second * np.maximum(np.append(result["lam_x"], [0.0, 0.0]).reshape(points, 5)[:, 0], 0.0)
    of_speed[[0, -1]] = 0.0  # given, not limited
    sides = lam[:, 5:].reshape(points, 2, 2, axes)  # point, side, acceleration or jerk, axis
    multipliers = np.zeros((points, 3 + 4 * axes))
    multipliers[:, 0] = of_speed * (feed_max / speed) / 2.0
    multipliers[:-1, 1] = lam[:-1, 4] / 2.0
    multipliers[:-1, 2] = (lam[:-1, 3] * h[:-1] / (2.0 * ds / length) - lam[:-1, 0]) / (v[:-1] + v[1:])
    multipliers[:, 2] /= speed**2
    of_rows = np.zeros((points, axes, 4))  # in the order of `Multipliers.rows`
    of_rows[:, :, 0], of_rows[:, :, 1] = sides[:, 0, 0], sides[:, 0, 1]
    of_rows[:-1, :, 2], of_rows[:-1, :, 3] = sides[1:, 1, 1], sides[1:, 1, 0]
    multipliers[:, 3:] = of_rows.reshape(points, -1)
    return Found(
        status=status,
        sentence=sentence,
        iterations=iterations,
        columns=np.column_stack([profile[:, 0] ** 2, profile[:, 1:], multipliers]),
    )


def _stage_numbers(
    problem: FeedrateProblem,
    here: slice,
    ds: FloatArray,
    cap: FloatArray,
    speed: float,
    acc: float,
    jerk: float,
) -> FloatArray:
    """(n, 2 + 10 A) what a stage needs to know: length and cap of its interval, then for the right and the
    left side the factors of a, v^2 (acceleration) and j, v a, v^3 (jerk), all rows as shares of their limits;
    0 on the side where a piece ends."""
    d1 = problem.d1[here]
    acceleration, jerk_limit = problem.acceleration_limit[here], problem.jerk_limit[here]
    room = 1.0 - problem.margin[here, None]
    sides = []
    for d2, d3, of_interval, outside in (
        (problem.d2_right[here], problem.d3_right[here], acceleration * room, -1),
        (problem.d2_left[here], problem.d3_left[here], acceleration * np.roll(room, 1, axis=0), 0),
    ):
        factors = np.stack(
            [
                d1 * acc / of_interval,
                d2 * speed**2 / of_interval,
                d1 * jerk / jerk_limit,
                3.0 * d2 * speed * acc / jerk_limit,
                d3 * speed**3 / jerk_limit,
            ],
            axis=1,
        )
        factors[outside] = 0.0
        sides.append(factors.reshape(len(d1), -1))
    return np.column_stack([np.append(ds, 1.0), np.append(cap, 1.0), *sides])


def _options(settings: JerkLimitedNLP, points: int, equality: Array, rows: int) -> dict[str, Any]:
    """Options of casadi's interface. Fatrop is told the stages: left to find them, it finds wrong ones."""
    if settings.solver == "ipopt":
        return {
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.mu_strategy": "adaptive",
            "ipopt.tol": settings.tol,
            "ipopt.max_iter": settings.max_iterations,
            "ipopt.constr_viol_tol": FEASIBILITY,
            "ipopt.acceptable_constr_viol_tol": VIOLATION_MAX,
        }
    return {
        "print_time": False,
        "structure_detection": "manual",
        "equality": equality.tolist(),
        "N": points - 1,
        "nx": [3] * points,
        "nu": [2] * (points - 1) + [0],
        "ng": [rows] * (points - 1) + [rows - 2],
        "fatrop": {"print_level": 0, "tol": settings.tol, "max_iter": settings.max_iterations},
    }


def _outcome(stats: dict[str, Any], settings: JerkLimitedNLP) -> tuple[Status, str, int]:
    """Status, sentence and iterations. nlpsol returns numbers whatever happened; only its statistics tell."""
    iterations = int(stats["iter_count"])
    if settings.solver == "ipopt":
        return *OUTCOMES.get(stats["return_status"], BROKE_DOWN), iterations
    if stats["success"]:
        return *OUTCOMES["Solve_Succeeded"], iterations
    if iterations >= settings.max_iterations:  # fatrop has one code for every failure
        return *OUTCOMES["Maximum_Iterations_Exceeded"], iterations
    return *BROKE_DOWN, iterations
