"""The limits of the machine and of the program, sample by sample.

Twice per axis: on the delivered columns, and on divided differences of the delivered positions (worst.py).

The columns must belong to the positions. With |acceleration| <= A over a period h, |jerk| <= J (or inf),

    |dx/h - (v0 + v1)/2| <= min(A h / 4, J h^2 / 12),      |dv/h - (a0 + a1)/2| <= J h / 4

each up to a rounding of the columns of `RATIO_ROUNDING` times their limit. A and J are the larger of the
limit and of what was measured, so that a motion beyond a limit is not also called a liar. Without a limit on
jerk acceleration may jump within every period, and the acceleration column cannot be refuted; nor can the
jerk column, which may jump anyhow.

The row of the feed, |v| over all axes with rotary ones at the radius of the path, is of feed.py. Normal
acceleration is |a - (a.t) t| with t = v/|v| over x, y and z; its share of the chord error over a period is
|normal acceleration| h^2 / 8. Where velocity or acceleration was not delivered it is taken from the second
difference, a mean of a(t) over w = t2 - t0, across the chord's direction u. With normal acceleration <= N,
|a| <= A and speed >= v the motion's direction turns by at most N w / v in that time, and u lies within its turn,
so that of the mean

    |a - (a.u) u| <= N + A sin(min(N w / v, pi/2)),      v = chord / w - A w,

where the second term is taken off.

Only columns that were delivered are judged as columns, and compared with the positions.
"""

import math

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.motion.trajectory import Trajectory
from planner.verifier.between import Between
from planner.verifier.given import DERIVATIVES, Given
from planner.verifier.pieces import RATIO_ROUNDING
from planner.verifier.power import units_of
from planner.verifier.worst import (
    COLUMN,
    DIFFERENCE,
    Limits,
    SampleBlock,
    Worst,
    differences,
    less_error,
    position_error,
)

# [mm/s] below this the direction of the velocity is rounding: 1e-12 mm/s of it is 1e-6 of the direction
FEED_AT_REST = 1e-6
NORMAL_NAME, TANGENTIAL_NAMES = "normal_acceleration", ("acceleration.tangential", "jerk.tangential")
UNITS = ("/s", "/s2", "/s3")

# Rows of `Worst`: six groups of one row per axis, then some of their own, then the power of each axis, and three per user limit.
VELOCITY, ACCELERATION, JERK, GAP_BY_ACCELERATION, GAP_BY_JERK, GAP_OF_ACCELERATION = range(6)
GROUPS = 6
FEED, NORMAL, CHORD, TANGENTIAL = range(4)  # the last of two rows: acceleration, jerk
ROWS_ALONE = 5


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
        tangential=np.array(
            [machine.tangential_acceleration or math.inf, machine.tangential_jerk or math.inf]
        ),
        power=np.array([machine.axes[letter].power or math.inf for letter in axes]),
        power_unit=units_of(machine, axes),
        acceleration_at_stop=np.where("acceleration" in not_limited, np.inf, per_axis[1]),
        jerk_limited="jerk" not in not_limited,
        user=tuple(limit for limit in machine.own if not getattr(limit, "of_extruder", False)),
    )


def _rounding(trajectory: Trajectory, given: Given, acceleration: FloatArray) -> FloatArray:
    """(A,) largest error of a position by its digits and those of the last time, at its speed there [mm]."""
    rounding = np.zeros(len(acceleration))
    if len(given.position_rounding):
        rounding = rounding + given.position_rounding
    if given.end_rounding and len(trajectory) > 1:
        h = float(trajectory.t[-1] - trajectory.t[-2])
        speed = np.abs(trajectory.position[-1] - trajectory.position[-2]) / h + acceleration * h
        rounding = rounding + given.end_rounding * speed
    return rounding


def normal_limit(machine: Machine) -> float:
    """The machine's limit of the normal acceleration [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or math.inf


def rows_of(limits: Limits) -> list[tuple[str, str]]:
    """Name and unit of every row that is looked at; the gaps and the chord error have no name."""
    unit = ["deg" if letter in ROTARY_AXES else "mm" for letter in limits.axes]
    rows = [
        (f"{quantity}.{letter}", length + per)
        for quantity, per in zip(DERIVATIVES, UNITS, strict=True)
        for letter, length in zip(limits.axes, unit, strict=True)
    ]
    rows += [("", "")] * (GROUPS * len(limits.axes) - len(rows))
    rows += [("feed", "mm/s"), (NORMAL_NAME, "mm/s2"), ("", "mm")]
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
) -> None:
    """Take in what a block of samples shows of the axes, of the normal acceleration and of the columns.

    between : what lies between the samples too, of velocity and acceleration
    sure    : the columns are those of the positions, nothing lies between that they do not show, and no acceleration jumps
    """
    t, axes, linear = block.t, len(limits.axes), limits.linear
    columns = [block.velocity, block.acceleration, block.jerk]
    if between is not None:
        columns[:2] = between.velocity, between.acceleration
    for order, column in enumerate(columns):
        if limits.judged[order]:
            worst.take(order * axes, np.abs(column), limits.per_axis[order], COLUMN, block, span=order)
    period = np.diff(t, prepend=-np.inf)[:, None]
    if not sure:
        seen = differences(t, block.position, position_error(block, limits))
        for order, difference in enumerate(seen):
            allowed = limits.per_axis[order]
            worst.take(order * axes, less_error(difference), allowed, DIFFERENCE, block)
        if limits.judged[0]:
            _look_at_gaps(block, limits, worst, seen[0], 1.0 / period)
    how = COLUMN if limits.judged[:2].all() else DIFFERENCE
    if how == COLUMN:
        normal = _normal(block.velocity[:, linear], block.acceleration[:, linear])
        taken_off = np.zeros_like(normal)
    else:
        normal, taken_off = _mean_normal(block, limits, *seen[1])
    row, span = GROUPS * axes, ACCELERATION + 3 if how == COLUMN else None
    worst.take(row + NORMAL, (normal - taken_off)[:, None], limits.normal, how, block, span=span)
    period[0] = 0.0
    worst.take(row + CHORD, normal[:, None] * period * period / 8.0, 1.0, how, block)


def _look_at_gaps(
    block: SampleBlock,
    limits: Limits,
    worst: Worst,
    difference: tuple[FloatArray, FloatArray],
    over: FloatArray,
) -> None:
    """By how much the columns miss the differences (module text), over h, h^2, h; `over` (n, 1) is 1/h."""
    axes, (v_max, a_max, j_max) = len(limits.axes), limits.per_axis
    gap = np.abs(difference[0] - _means(block.velocity)) - difference[1] - RATIO_ROUNDING * v_max
    gap = np.maximum(gap, 0.0) * over
    worst.take(GAP_BY_ACCELERATION * axes, gap, a_max / 4.0, COLUMN, block)
    worst.take(GAP_BY_JERK * axes, gap * over, j_max / 12.0, COLUMN, block)
    if limits.judged[1]:
        change = np.diff(block.velocity, axis=0, prepend=block.velocity[:1]) * over
        noise = RATIO_ROUNDING * (v_max * over + a_max)
        gap = np.maximum(np.abs(change - _means(block.acceleration)) - noise, 0.0) * over
        worst.take(GAP_OF_ACCELERATION * axes, gap, j_max / 4.0, COLUMN, block)


def _means(column: FloatArray) -> FloatArray:
    """(n, A) mean of each sample and the one before it; of the first itself."""
    mean: FloatArray = 0.5 * (column + np.concatenate([column[:1], column[:-1]]))
    return mean


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
