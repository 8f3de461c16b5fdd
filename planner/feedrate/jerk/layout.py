"""How a window lies in memory: blocks of `LANES` intervals, every quantity of a block in one row.

All but the recursions along the path is the same arithmetic for every interval. So a window of N intervals is
cut into blocks, a block is one row of a two-dimensional array, and quantity Q of interval `LANES b + l` is
`array[b, Q + l]`: Q, one of the names below, is a multiple of `LANES` known to the compiler, which then does
several intervals in one instruction. The last block may be shorter.

    grid  (B, FIXED + A AXIS)    what does not change: lengths and limits, in scaled units
    work  (B, WORK)              profile, model, feedback and step of the intervals
    rows  (B, R ROW)             the inequalities -1 <= g <= 1, with slacks and multipliers of both sides

A axes have R = 3A + 2 rows, or 4A + 2 where r'' jumps.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.feedrate.constraints.problem import FeedrateProblem

LANES = 32  # intervals of a block: a multiple of the 4 or 8 doubles that one instruction takes
# What the compiler may do to the arithmetic of a block: multiply and add in one instruction, multiply by the
# inverse of a constant, take -0 for 0. Sums keep their order, NaN stays NaN.
LANE_MATH = {"contract", "arcp", "nsz"}


def _names(count: int) -> range:
    return range(0, count * LANES, LANES)


# grid: length; 1/x_max at the start, 2/x_max in the middle; 1 but in the last interval; 1 in the first and
# the last interval, else 0
DS, PER_X, PER_MIDDLE, INNER_END, EDGE = _names(5)
FIXED = 5 * LANES
# ... and of each axis, after `FIXED`: factors of the rows (rows.py) of x and u (acceleration), of j, v u and v x (jerk at the start and
# at the end), of x and u (acceleration before the jump at the end)
A_X, A_U, B_J, B_U, B_X, C_J, C_U, C_X, D_X, D_U = _names(10)
AXIS = 10 * LANES

# work, profile: x at both ends, u, p; multiplier of the dynamics; duration
X, X_END, U, P, PI, H = _names(6)
# ... model: the dynamics dx_{i+1} = DYN dx + (DYN+1) du + (DYN+2) dp + (DYN+3); gradient of the cost in (x, u, p); its Hessian
# (xx, xu, xp, uu, up, pp) that is convex, and the rest, of rows and dynamics; pi = COSTATE (dV/dx + REST)
DYN, GRADIENT, CONVEX, CURVED, COSTATE, REST = (k * LANES for k in (6, 10, 13, 19, 25, 26))
# ... feedback dp = GAIN dx + (GAIN+1) du + (GAIN+2); cost to go from the end (xx, xu, uu) and its slope in x; one over the curvature
# along p (riccati.py)
GAIN, TO_GO, TO_GO_X, ALONG_P = (k * LANES for k in (27, 30, 33, 34))
# ... step: dx, du, dp; dx at the end; dpi
STEP, STEP_END, STEP_PI = (k * LANES for k in (35, 38, 39))
# ... what the corrector adds to the gradient: per mu, and for the terms of second order
BY_BARRIER, BY_BENT = (k * LANES for k in (40, 43))
WORK = 46 * LANES

# rows, of each: value; gradient in (x, u, p); and of its upper and its lower side: slack, multiplier, one
# over their product, step of the slack (before that the predicted step as a share of the slack)
VALUE, BY_X, BY_U, BY_P = _names(4)
SLACK_UP, LAM_UP, PER_GAP_UP, MOVE_UP, SLACK_LOW, LAM_LOW, PER_GAP_LOW, MOVE_LOW = (
    k * LANES for k in range(4, 12)
)
ROW = 12 * LANES

JUMP_ROUNDING = 1e-6  # jumps of r'' below this share of it are rounding [-]


class ProblemColumns(NamedTuple):
    """A problem of P points and A axes, in its own units."""

    unit: float  # of accelerations
    s: FloatArray  # (P,)
    x_max: FloatArray  # (P,)
    d1: FloatArray  # (P, A), like the rest
    d2_left: FloatArray
    d2_right: FloatArray
    d3_left: FloatArray
    d3_right: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def with_rows(problem: FeedrateProblem) -> Array | slice:
    """(A,) which axes have rows, or all: not a limit of one's own that bounds the velocity alone."""
    if problem.own_least is None:
        return slice(None)
    bounded = np.isfinite(problem.own_least[1:]).any(axis=0)
    return np.append(np.ones(problem.machine_axes, dtype=bool), bounded)


def columns_of(problem: FeedrateProblem, of: Array | slice = slice(None)) -> ProblemColumns:
    """The columns of a problem for the kernel; `of` (A,): its axes."""
    return ProblemColumns(
        unit=float(problem.acceleration[: problem.machine_axes].max()),
        s=problem.s,
        x_max=problem.feed_sq_limit,
        d1=problem.d1[:, of],
        d2_left=problem.d2_left[:, of],
        d2_right=problem.d2_right[:, of],
        d3_left=problem.d3_left[:, of],
        d3_right=problem.d3_right[:, of],
        acceleration=acceleration_limits(problem)[:, of],
        jerk=problem.jerk_limit[:, of],
    )


def acceleration_limits(problem: FeedrateProblem) -> FloatArray:
    """(P, A) axis accelerations less the larger margin of the intervals beside each point [mm/s2]."""
    margin = problem.margin.copy()
    margin[problem.piece[1:] - 1] = 0.0
    before = np.concatenate([[0.0], margin[:-1]])
    return problem.acceleration_limit * (1.0 - np.maximum(margin, before))[:, None]


class Blocks(NamedTuple):
    """The arrays of a window of n intervals (module text); its profile: x, u (n+1,), p and pi (n,)."""

    n: int
    axes: int
    jumps: int  # 1 if r'' jumps at any inner point, else 0
    grid: FloatArray
    work: FloatArray
    rows: FloatArray


@njit(cache=True, error_model="numpy")
def rows_of(axes, jumps):
    """Number of rows R of an interval."""
    return (3 + jumps) * axes + 2


@njit(cache=True, error_model="numpy")
def _jumps(columns, begin, end):
    """1 if r'' jumps by more than rounding at an inner point of begin..end."""
    left, right = columns.d2_left, columns.d2_right
    for i in range(begin + 1, end):
        most, jump = 0.0, 0.0
        for k in range(left.shape[1]):
            most = max(most, abs(right[i, k]))
            jump = max(jump, abs(left[i, k] - right[i, k]))
        if jump > JUMP_ROUNDING * most:
            return 1
    return 0


class Room:
    """Memory for one window at a time, used again and again."""

    def __init__(self) -> None:
        self._kept: dict[str, FloatArray] = {}

    def blocks(self, columns: ProblemColumns, begin: int, end: int, feed: float, time: float) -> Blocks:
        """`Blocks` with the grid of the points begin..end, in units of speed and time; all is overwritten."""
        n, axes, jumps = end - begin, columns.d1.shape[1], _jumps(columns, begin, end)
        blocks = Blocks(
            n=n,
            axes=axes,
            jumps=jumps,
            grid=self._room("grid", n, FIXED + axes * AXIS),
            work=self._room("work", n, WORK),
            rows=self._room("rows", n, rows_of(axes, jumps) * ROW),
        )
        _fill(blocks, columns, begin, feed, time)
        return blocks

    def _room(self, name: str, n: int, width: int) -> FloatArray:
        count = -(-n // LANES)
        kept = self._kept.get(name)
        if kept is None or kept.size < count * width:
            kept = self._kept[name] = np.zeros(count * width)
        return kept[: count * width].reshape(count, width)


@njit(cache=True, error_model="numpy", nogil=True)
def _fill(blocks, columns, begin, feed, time):
    """Write the grid of the window that starts at a point."""
    n, length = blocks.n, feed * time
    feed_sq, acceleration, jerk = feed * feed, feed / time, feed / (time * time)
    for b in range(len(blocks.grid)):
        g = blocks.grid[b]
        for o in range(min(LANES, n - b * LANES)):
            i = b * LANES + o
            a, z = begin + i, begin + i + 1
            inner = 1.0 if i > 0 else 0.0  # the first point is given: its own rows have no step to limit
            free = 1.0 if i < n - 1 else 0.0  # so is the last
            g[DS + o] = (columns.s[z] - columns.s[a]) / length
            g[INNER_END + o], g[EDGE + o] = free, 1.0 - inner * free
            g[PER_X + o] = inner * feed_sq / columns.x_max[a]
            g[PER_MIDDLE + o] = 4.0 * feed_sq / (columns.x_max[a] + columns.x_max[z])
        for k in range(blocks.axes):
            f = g[FIXED + k * AXIS :]
            for o in range(min(LANES, n - b * LANES)):
                i = b * LANES + o
                a, z = begin + i, begin + i + 1
                inner, free = 1.0 if i > 0 else 0.0, 1.0 if i < n - 1 else 0.0
                per_a, per_a_end = (
                    acceleration / columns.acceleration[a, k],
                    acceleration / columns.acceleration[z, k],
                )
                per_j, per_j_end = jerk / columns.jerk[a, k], jerk / columns.jerk[z, k]
                f[A_X + o] = inner * columns.d2_right[a, k] * length * per_a
                f[A_U + o] = inner * columns.d1[a, k] * per_a
                f[B_J + o], f[C_J + o] = columns.d1[a, k] * per_j, columns.d1[z, k] * per_j_end
                f[B_U + o] = 3.0 * columns.d2_right[a, k] * length * per_j
                f[C_U + o] = 3.0 * columns.d2_left[z, k] * length * per_j_end
                f[B_X + o] = columns.d3_right[a, k] * length * length * per_j
                f[C_X + o] = columns.d3_left[z, k] * length * length * per_j_end
                f[D_X + o] = free * columns.d2_left[z, k] * length * per_a_end
                f[D_U + o] = free * columns.d1[z, k] * per_a_end


@njit(cache=True, error_model="numpy", nogil=True)
def put(blocks, x, u):
    """Make x, u (n+1,) the profile."""
    for i in range(blocks.n):
        w, o = blocks.work[i // LANES], i % LANES
        w[X + o], w[X_END + o], w[U + o], w[P + o] = x[i], x[i + 1], u[i], u[i + 1] - u[i]


@njit(cache=True, error_model="numpy", nogil=True)
def profile(blocks):
    """The profile: x, u (n+1,)."""
    n = blocks.n
    x, u = np.empty(n + 1), np.empty(n + 1)
    for i in range(n):
        w, o = blocks.work[i // LANES], i % LANES
        x[i], u[i] = w[X + o], w[U + o]
        x[i + 1], u[i + 1] = w[X_END + o], w[U + o] + w[P + o]
    return x, u
