"""The limits of the machine and of the program, sample by sample.

Twice per axis: on the delivered columns, and on divided differences of the delivered positions (worst.py).

The columns must belong to the positions. With |acceleration| <= A over a period h, |jerk| <= J (or inf),

    |dx/h - (v0 + v1)/2| <= min(A h / 4, J h^2 / 12),      |dv/h - (a0 + a1)/2| <= J h / 4

each up to a rounding of the columns of `RATIO_ROUNDING` times their limit. A and J are the larger of the
limit and of what was measured, so that a motion beyond a limit is not also called a liar. Without a limit on
jerk acceleration may jump within every period, and the acceleration column cannot be refuted; nor can the
jerk column, which may jump anyhow.

The row of the feed, |v| over all axes with rotary ones at the radius of the path, is of feed.py. Normal
acceleration is |a - (a.t) t| with t = v/|v| over x, y and z. Where velocity or acceleration was not delivered it
is taken from the second difference, a mean of a(t) over w = t2 - t0, across the chord's direction u. With normal
acceleration <= N, |a| <= A and speed >= v the motion's direction turns by at most N w / v in that time, and u lies
within its turn, so that of the mean

    |a - (a.u) u| <= N + A sin(min(N w / v, pi/2)),      v = chord / w - A w,

where the second term is taken off. Only columns that were delivered are judged, and compared with the positions.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.motion.trajectory import Trajectory
from planner.verifier.between import Between
from planner.verifier.excess import NAMES
from planner.verifier.given import DERIVATIVES, Given
from planner.verifier.kernel import kernel
from planner.verifier.pieces import RATIO_ROUNDING
from planner.verifier.worst import (
    COLUMN,
    DIFFERENCE,
    ROUNDING_ULPS,
    Limits,
    SampleBlock,
    Worst,
    differences,
    position_error,
)

# [mm/s] below this the direction of the velocity is rounding: 1e-12 mm/s of it is 1e-6 of the direction
FEED_AT_REST = 1e-6
NORMAL_NAME, TANGENTIAL_NAMES = "normal_acceleration", ("acceleration.tangential", "jerk.tangential")
UNITS = ("/s", "/s2", "/s3")
PER_MM2 = 1e-6  # m2 in a mm2: 1 mm2/s3 is 1e-6 W/kg, of rotary axes W/(kg m2) at the machine's radius

# Rows of `Worst`: six groups of one row per axis, then some of their own, then the power of each axis, and three per user limit.
VELOCITY, ACCELERATION, JERK, GAP_BY_ACCELERATION, GAP_BY_JERK, GAP_OF_ACCELERATION = range(6)
GROUPS = 6
FEED, NORMAL, TANGENTIAL = range(3)  # the last of two rows: acceleration, jerk
ROWS_ALONE = 4
OF_NORMAL = NAMES.index(NORMAL_NAME)


def limits_of(machine: Machine, trajectory: Trajectory, given: Given, not_limited: tuple[str, ...]) -> Limits:
    """The limits of a delivered motion on a machine."""
    axes = trajectory.axes
    per_axis = np.array([machine.limits(name, axes) for name in DERIVATIVES])  # type: ignore[arg-type]
    return Limits(
        axes=axes,
        per_axis=per_axis,
        linear=np.array([letter in LINEAR_AXES for letter in axes]),
        judged=np.array([name in given.columns for name in DERIVATIVES]),
        rounding=_rounding(trajectory, given, per_axis[1]),
        time_rounding=given.time_rounding,
        normal=normal_limit(machine),
        tangential=np.array([machine.tangential_acceleration or np.inf, machine.tangential_jerk or np.inf]),
        power=np.array([machine.axes[letter].power or np.inf for letter in axes]),
        power_unit=np.array([machine.radius**-2.0 if a in ROTARY_AXES else PER_MM2 for a in axes]),
        acceleration_at_stop=np.where("acceleration" in not_limited, np.inf, per_axis[1]),
        jerk_limited="jerk" not in not_limited,
        user=tuple(limit for limit in machine.own if not getattr(limit, "of_extruder", False)),
    )


def _rounding(trajectory: Trajectory, given: Given, acceleration: FloatArray) -> FloatArray:
    """(A,) largest error of a position by its digits and those of the last time, at its speed there [mm]."""
    rounding: FloatArray = np.zeros(len(acceleration))
    if len(given.position_rounding):
        rounding = rounding + given.position_rounding
    if given.end_rounding and len(trajectory) > 1:
        h = float(trajectory.t[-1] - trajectory.t[-2])
        speed = np.abs(trajectory.position[-1] - trajectory.position[-2]) / h + acceleration * h
        rounding = rounding + given.end_rounding * speed
    return rounding


def normal_limit(machine: Machine) -> float:
    """The machine's limit of the normal acceleration [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or np.inf


def rows_of(limits: Limits) -> list[tuple[str, str]]:
    """Name and unit of every row that is looked at; the gaps have no name."""
    unit = ["deg" if letter in ROTARY_AXES else "mm" for letter in limits.axes]
    rows = [
        (f"{quantity}.{letter}", length + per)
        for quantity, per in zip(DERIVATIVES, UNITS, strict=True)
        for letter, length in zip(limits.axes, unit, strict=True)
    ]
    rows += [("", "")] * (GROUPS * len(limits.axes) - len(rows))
    rows += [("feed", "mm/s"), (NORMAL_NAME, "mm/s2")]
    rows += zip(TANGENTIAL_NAMES, ("mm/s2", "mm/s3"), strict=True)
    rows += [
        (f"power.{letter}" if np.isfinite(most) else "", "W/kg" if length == "mm" else "W/(kg m2)")
        for letter, length, most in zip(limits.axes, unit, limits.power, strict=True)
    ]
    return rows + [
        (f"{quantity}.{limit.name}", limit.unit + per)
        for limit in limits.user
        for quantity, per in zip(DERIVATIVES, UNITS, strict=True)
    ]


def look_at_axes(
    block: SampleBlock, limits: Limits, worst: Worst, between: Between | None = None, sure: bool = False
) -> float:
    """Take in what a block of samples shows of the axes, of the normal acceleration and of the columns. -> path length run to
    its end [mm]

    between : what lies between the samples too, of velocity and acceleration
    sure    : the columns are those of the positions, nothing lies between that they do not show, and no acceleration jumps
    """
    axes, linear, alone = len(limits.axes), limits.linear, GROUPS * len(limits.axes)
    nothing = np.empty((0, axes))
    widest = (nothing, nothing) if between is None else (between.velocity, between.acceleration)
    allowed = (
        limits.per_axis,
        linear,
        limits.judged,
        limits.rounding,
        float(limits.time_rounding),
        float(limits.normal),
    )
    most, found = np.zeros(len(NAMES)), (worst.row, worst.time, worst.at, worst.piece)
    travelled = _look(
        block.t, block.state, widest, block.piece, block.skip, block.travelled, allowed, sure, np.zeros((5, axes)),
        found, most,
    )  # fmt: skip
    for order, column in enumerate((*widest, nothing)):
        if limits.judged[order] or not sure:
            worst.bound(order * axes, limits.per_axis[order])
        if most[order] > 1.0:
            column = column if len(column) else np.abs(block.state[:, 1 + order])
            worst.exceeded(order, column / limits.per_axis[order], block)
    if limits.judged[:2].all():
        worst.bound(alone + NORMAL, limits.normal)
        if most[OF_NORMAL] > 1.0:
            normal = _normal(block.velocity[:, linear], block.acceleration[:, linear])[:, None]
            worst.exceeded(OF_NORMAL, normal / limits.normal, block)
        return float(travelled)
    second = differences(block.t, block.position, position_error(block, limits))[1]
    normal, taken_off = _mean_normal(block, limits, *second)
    worst.take(alone + NORMAL, (normal - taken_off)[:, None], limits.normal, DIFFERENCE, block)
    return float(travelled)


@kernel()
def _look(t, state, widest, piece, skip, travelled, allowed, sure, work, found, most):
    """The columns of samples, the differences of their positions (worst.py), by how much the columns miss these (module text)
    over h, h^2, h, and the normal acceleration by the columns.

    t, state, piece, skip, travelled : as in `SampleBlock`
    widest  : (n, A) velocities and accelerations in place of the columns, which the differences are compared with; or (0, A)
    allowed : per_axis, linear, judged, rounding, time_rounding and normal of `Limits`
    work    : (5, A) zeros: of the sample before its error, first and second difference with theirs
    found   : row, time, at and piece of `Worst`
    most    : (6,) largest ratio of the columns of each quantity of `NAMES`, where it is above 1

    -> path length run to the last sample [mm]
    """
    n, _, axes = state.shape
    (v_max, a_max, j_max), linear, judged, rounding, time_rounding, normal_max = allowed
    ulp, run, none = ROUNDING_ULPS * 2.0**-52, 0.0, -1
    for k in range(n):
        here = k, t, state, piece
        h = t[k] - t[k - 1] if k else np.inf
        over = 1.0 / h
        over2 = 2.0 / (t[k] - t[k - 2]) if k > 1 else 0.0
        over3 = 3.0 / (t[k] - t[k - 3]) if k > 2 else 0.0
        if k >= max(skip, 1):
            step_sq = 0.0
            for i in range(axes):
                step_sq += (state[k, 0, i] - state[k - 1, 0, i]) ** 2
            run += np.sqrt(step_sq)
        speed_sq, along = 0.0, 0.0
        for i in range(axes):
            x, v, a = state[k, 0, i], state[k, 1, i], state[k, 2, i]
            if linear[i]:
                speed_sq, along = speed_sq + v * v, along + v * a
            if k >= skip:
                if judged[0]:
                    most_v = widest[0][k, i] if len(widest[0]) else abs(v)
                    _keep(found, most, 0, i, most_v, v_max[i], COLUMN, here)
                if judged[1]:
                    most_a = widest[1][k, i] if len(widest[1]) else abs(a)
                    _keep(found, most, 1, axes + i, most_a, a_max[i], COLUMN, here)
                if judged[2]:
                    _keep(found, most, 2, 2 * axes + i, abs(state[k, 3, i]), j_max[i], COLUMN, here)
            if sure:
                continue
            off = ulp * (abs(x) + (travelled + run) + v_max[i] * t[k]) + rounding[i]
            if k == 0:
                work[0, i] = off
                continue
            change = x - state[k - 1, 0, i]
            if time_rounding > 0.0:
                late = time_rounding * (abs(change) / h + a_max[i] * h)
                off += late
                work[0, i] += late if k == 1 else 0.0
            first, wrong = over * change, over * (off + work[0, i])
            second, wrong2 = over2 * (first - work[1, i]), over2 * (wrong + work[2, i])
            third, wrong3 = over3 * (second - work[3, i]), over3 * (wrong2 + work[4, i])
            work[0, i], work[1, i], work[2, i], work[3, i], work[4, i] = off, first, wrong, second, wrong2
            if k < skip:
                continue
            _keep(found, most, none, i, abs(first) - wrong, v_max[i], DIFFERENCE, here)
            _keep(found, most, none, axes + i, abs(second) - wrong2, a_max[i], DIFFERENCE, here)
            _keep(found, most, none, 2 * axes + i, abs(third) - wrong3, j_max[i], DIFFERENCE, here)
            if judged[0]:
                v0, a0 = state[k - 1, 1, i], state[k - 1, 2, i]
                gap = abs(first - 0.5 * (v + v0)) - wrong - RATIO_ROUNDING * v_max[i]
                gap = max(gap, 0.0) * over
                _keep(found, most, none, GAP_BY_ACCELERATION * axes + i, gap, a_max[i] / 4.0, COLUMN, here)
                _keep(found, most, none, GAP_BY_JERK * axes + i, gap * over, j_max[i] / 12.0, COLUMN, here)
                if judged[1]:
                    noise = RATIO_ROUNDING * (v_max[i] * over + a_max[i])
                    gap, row = (
                        max(abs((v - v0) * over - 0.5 * (a + a0)) - noise, 0.0) * over,
                        GAP_OF_ACCELERATION * axes + i,
                    )
                    _keep(found, most, none, row, gap, j_max[i] / 4.0, COLUMN, here)
        if k >= skip and judged[0] and judged[1] and speed_sq > FEED_AT_REST * FEED_AT_REST:
            across = 0.0
            for i in range(axes):
                if linear[i]:
                    across += (state[k, 2, i] - along / speed_sq * state[k, 1, i]) ** 2
            _keep(found, most, OF_NORMAL, GROUPS * axes + NORMAL, np.sqrt(across), normal_max, COLUMN, here)
    return travelled + run


@kernel(inline=True)
def _keep(found, most, span, row, value, limit, how, here):
    """Take in a value of a row, always of one limit: its ratio is the largest where the value is."""
    seen, time, at, piece = found
    if value > seen[row, 1] or (span >= 0 and value > limit):
        ratio = value / limit
        if span >= 0:
            most[span] = max(most[span], ratio)
        if ratio > seen[row, 0]:
            seen[row, 0], seen[row, 1], seen[row, 2], seen[row, 3] = ratio, value, limit, how
            k, t, state, pieces = here
            time[row], piece[row] = t[k], pieces[k]
            for i in range(at.shape[1]):
                at[row, i] = state[k, 0, i]


def _normal(v: FloatArray, a: FloatArray) -> FloatArray:
    """(n,) part of accelerations (n, 3) across velocities (n, 3) [mm/s2]; 0 at rest."""
    speed_sq = np.einsum("na,na->n", v, v)
    moves = speed_sq > FEED_AT_REST * FEED_AT_REST
    along = np.divide(np.einsum("na,na->n", v, a), speed_sq, out=np.zeros_like(speed_sq), where=moves)
    return np.where(moves, np.linalg.norm(a - along[:, None] * v, axis=1), 0.0)


def _mean_normal(
    block: SampleBlock, limits: Limits, second: FloatArray, error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n,) second differences (n, A) across the chord over their two periods [mm/s2], and what of them may be
    other than normal acceleration."""
    linear, t, x = limits.linear, block.t, block.position
    normal, taken_off = np.zeros((2, len(t)))
    if len(t) < 3:
        return normal, taken_off
    chord, lasting = x[2:, linear] - x[:-2, linear], t[2:] - t[:-2]
    way = np.linalg.norm(chord, axis=1)
    moves = way > FEED_AT_REST * lasting
    most = float(np.linalg.norm(limits.per_axis[1, linear]))
    slowest = way / lasting - most * lasting
    turned = np.divide(limits.normal * lasting, slowest, out=np.full(len(way), np.inf), where=slowest > 0.0)
    turn = np.minimum(turned, 0.5 * np.pi)
    normal[2:] = _normal(chord / lasting[:, None], second[2:, linear])
    taken_off[2:] = np.where(moves, most * np.sin(turn) + np.linalg.norm(error[2:, linear], axis=1), 0.0)
    return normal, taken_off
