"""The reference solver of the jerk-limited feedrate problem: one nonlinear program per piece, for ipopt or fatrop through casadi.

Every interval of a piece has constant jerk j_i along the path and a duration h_i; every point a feed v_i and an acceleration a_i.
The kinematics are exact cubics in time, so that a start or a stop (v = a = 0) needs no trick:

    minimise   T = sum_i h_i
    subject to v_{i+1} = v_i + a_i h_i + j_i h_i^2/2,     a_{i+1} = a_i + j_i h_i
               ds_i = v_i h_i + a_i h_i^2/2 + j_i h_i^3/6
               0 <= v_i <= c_i = sqrt(feed_sq_limit_i),     v_i + a_i h_i/2 <= (c_i + c_{i+1})/2,     h_i >= 0
    and at both ends of every interval (r', r'', r''' of that side; jerk of that interval), for every axis k
               | r'_k a + r''_k v^2 |                     <= a_k (1 - margin_i)
               | r'_k j + 3 r''_k v a + r'''_k v^3 |      <= j_k
               v = sqrt(feed_sq_start), sqrt(feed_sq_end) at the ends; a = 0 where that is rest, free where it is not
               (a piece that starts in motion continues something whose acceleration the problem does not know).

The row v + a h/2 keeps the feed within its bounds between the points as well: v(t) is a parabola whose Bezier ordinates are v_i,
v_i + a_i h_i/2 and v_{i+1}. Without it, coarse grids overshoot the programmed feed where the acceleration ends (0.2 % of the time
of a line of 100 mm). It costs nothing where a ramp of constant jerk ends in a constant feed: there all ordinates are on the bound.

So that all rows of a point depend on that point alone, as fatrop's stages ask for, the jerk of the interval to its left is a state
of the point as well. A stage is the state (v, a, j_left), the control (j, h), and the gap  state_{i+1} - f(state_i, control_i) = 0;
fatrop's interface wants exactly this sign and order (gap rows of a stage, then its other rows), ipopt does not mind.

Not convex, and no certificate of a global optimum; from many starting points both solvers end in the same optimum. Every
row is scaled by its limit and every piece has its own units (mean interval 1, mean guessed duration 1), so that the iterates do not
depend on the unit of length or time.

Prices are Lagrange multipliers: with rows scaled by their limit c, |g| <= 1, the optimum obeys dT/dc = -sum |lambda| / c. They hold
for the given grid: `margin`, which depends a little on the limits, stays. Where two limits coincide (an axis velocity and the
programmed feed), the first in `bound_names` has the price of loosening both.

Costs 2-6 ms per grid point with ipopt; fatrop's iterations take half as long, but building its interface grows with the square of
the points and costs more than it saves above a few hundred (17 ms per point at 6000).
References: Waechter & Biegler 2006, doi 10.1007/s10107-004-0559-y (ipopt); Vanroye et al. 2023, arXiv 2303.16746 (fatrop).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.constraints.problem import FeedrateProblem
from planner.feedrate.reachability import Reachability
from planner.feedrate.reference.piecewise import INTERVALS_MIN, Found, solve_pieces, too_few
from planner.feedrate.solution import FeedrateSolution, Prices, Status

# The guess is the second-order optimum, everywhere this much slower [-]. Of 0.3 to 1, and of optima at a third or a tenth of the
# acceleration, the best by iterations (23-41); all of them lead to the same optimum.
SLOWER = 0.7
# Largest violation of a scaled row or bound that a solution may have [-].
VIOLATION_MAX = 1e-6
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
        "no motion keeps all limits on this grid; refine it, or change the speeds asked for at the ends",
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
    """The jerk-limited reference.

    solver         : "ipopt" (with mumps), or "fatrop", which uses the stages (for pieces of at most some hundred points)
    tol            : relative tolerance of optimality [-]
    max_iterations : per piece
    """

    solver: Literal["ipopt", "fatrop"] = "ipopt"
    tol: float = 1e-8
    max_iterations: int = 500

    def __post_init__(self) -> None:
        if self.solver not in ("ipopt", "fatrop"):
            raise ValueError(f"JerkLimitedNLP.solver: '{self.solver}'; there are ipopt and fatrop")
        if not self.tol > 0:
            raise ValueError(f"JerkLimitedNLP.tol: {self.tol} must be positive")

    def solve(self, problem: FeedrateProblem) -> FeedrateSolution:
        """Time-optimal jerk-limited profile with prices; a failure of any piece is the status of the whole."""
        began = time.perf_counter()
        guess = Reachability().solve(problem)
        if not guess.solved:
            took = time.perf_counter() - began
            return FeedrateSolution.failed(problem, guess.status, guess.sentence, repr(self), took)
        found = solve_pieces(problem, lambda g: _solve_piece(problem, g, guess, self))
        took = time.perf_counter() - began
        if found.columns is None:
            return FeedrateSolution.failed(
                problem, found.status, found.sentence, repr(self), took, found.iterations
            )
        v, acc, jerk, duration, *_ = found.columns.T
        prices = found.columns[:, 4:]
        axes = len(problem.axes)
        relative = prices[:, 0] * problem.feed_sq_limit  # dT / d(ln feed_sq_max)
        return FeedrateSolution(
            status=found.status,
            sentence=found.sentence,
            solver=repr(self),
            feed_sq=v**2,
            acc_s=acc,
            jerk_s=jerk,
            duration=duration,
            solve_time=took,
            iterations=found.iterations,
            jerk_limited=True,
            prices=Prices.from_relative(
                problem, prices[:, 1 : 1 + axes].sum(axis=0), prices[:, 1 + axes :].sum(axis=0), relative
            ),
        )


def _solve_piece(
    problem: FeedrateProblem, g: int, guess: FeedrateSolution, settings: JerkLimitedNLP
) -> Found:
    """Transcribe and solve piece g; the whole formulation, from top to bottom.

    The columns are v, a, j, h and dT/d(feed_sq_limit), then dT/d(ln limit) of acceleration and jerk, one for each axis.
    """
    import casadi as ca

    here = slice(problem.piece[g], problem.piece[g + 1])
    ds = np.diff(problem.s[here])
    intervals, axes = len(ds), len(problem.axes)
    points = intervals + 1
    v_start, v_end = np.sqrt(problem.feed_sq_start[g]), np.sqrt(problem.feed_sq_end[g])
    if v_start == 0.0 and v_end == 0.0 and intervals < INTERVALS_MIN:
        return too_few(intervals)

    # ---- scaling: units in which the mean interval and its guessed duration are 1 --------------------------------------------
    h_guess = guess.duration[here][:-1] / SLOWER
    length, second = ds.mean(), h_guess.mean()
    speed, acc, jerk = length / second, length / second**2, length / second**3

    # ---- variables: state (v, a, j_left) and control (j, h) of each point; the last has no control ----------------------------
    w = ca.MX.sym("w", 5 * points - 2)
    stages = ca.reshape(ca.vertcat(w, ca.DM.zeros(2)), 5, points)

    # ---- objective ------------------------------------------------------------------------------------------------------------
    total = ca.sum2(stages[4, :])

    # ---- dynamics and constraints of one stage; its numbers are parameters ----------------------------------------------------
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

    # ---- constraints of all stages, in stage order; the last one has no interval ----------------------------------------------
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

    # ---- boundary -------------------------------------------------------------------------------------------------------------
    for end, v_there in ((0, v_start), (-1, v_end)):
        lower[end, 0] = upper[end, 0] = v_there / speed
        if v_there == 0.0:
            lower[end, 1] = upper[end, 1] = 0.0
    lower[0, 2] = upper[0, 2] = 0.0  # nothing to the left of the first point

    # ---- initial guess: the second-order optimum, slower; its acceleration made continuous ------------------------------------
    start = np.zeros((points, 5))
    start[:, 0] = np.sqrt(guess.feed_sq[here]) * SLOWER / speed
    u = guess.acc_s[here][:-1] * SLOWER**2 / acc
    start[1:-1, 1] = (u[:-1] + u[1:]) / 2
    start[:-1, 4] = h_guess / second
    start[:-1, 3] = start[1:, 2] = np.diff(start[:, 1]) / start[:-1, 4]

    # ---- solve ----------------------------------------------------------------------------------------------------------------
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

    # ---- unpack ---------------------------------------------------------------------------------------------------------------
    found = np.append(result["x"], [0.0, 0.0]).reshape(points, 5)
    columns = found[:, [0, 1, 3, 4]] * [speed, acc, jerk, second]
    columns[:, 0] = np.clip(columns[:, 0], 0.0, feed_max)
    columns[[0, -1], 0] = v_start, v_end
    shadow = np.abs(np.insert(result["lam_g"], -4 * axes, np.zeros(5)).reshape(points, -1)[:, 4:])
    of_axes = shadow[:, 1:].reshape(points, 2, 2, axes).sum(axis=1).reshape(points, 2 * axes)
    of_feed = np.append(result["lam_x"], [0.0, 0.0]).reshape(points, 5)[:, 0] / speed
    of_feed = np.maximum(of_feed, 0.0)  # the other bound of v is rest
    of_feed[[0, -1]] = 0.0  # given, not limited
    of_feed[:-1] += shadow[:-1, 0] / (2.0 * cap)
    of_feed[1:] += shadow[:-1, 0] / (2.0 * cap)
    of_feed /= 2.0 * feed_max  # from feed to feed^2
    prices = -second * np.column_stack([of_feed, of_axes])
    return Found(
        status=status, sentence=sentence, iterations=iterations, columns=np.column_stack([columns, prices])
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
    """(n, 2 + 10 A) what a stage needs to know: length and cap of its interval, then for the right and the left side the factors
    of a, v^2 (acceleration) and j, v a, v^3 (jerk), all rows as shares of their limits; 0 on the side where a piece ends."""
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
