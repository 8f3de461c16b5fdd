"""The limits of the machine and of the program, sample by sample.

Twice per axis: on the delivered columns, and on divided differences of the delivered positions. The n-th divided difference is
a mean of the n-th derivative (Hermite-Genocchi), so n! times it can exceed the limit only if the motion does, whatever the
spacing of the samples:

    d1 = dx / dt,    d2 = 2 (d1' - d1) / (t2 - t0),    d3 = 3 (d2' - d2) / (t3 - t0)

No slack is needed but for rounding. A position carries an error of `ROUNDING_ULPS` units in the last place of what it is
computed from: the coordinate, the path length run so far and (limit times) the time. It is carried through the same
recursion and taken off: at 1 m of coordinates, 100 m of path and 1 ms it is worth 2e-10 mm, 1e-7 mm/s, 4e-4 mm/s2, 2 mm/s3.
To it come the digits that a file was written with: those of the position, and those of the time at the speed there.

The columns must belong to the positions. With |acceleration| <= A over a period h, and |jerk| <= J where jerk is limited,

    |dx/h - (v0 + v1)/2| <= min(A h / 4, J h^2 / 12),      |dv/h - (a0 + a1)/2| <= J h / 4

each up to a rounding of the columns of `RATIO_ROUNDING` times their limit. A and J are the larger of the limit and of what was
measured, so that a motion beyond a limit is not also called a liar.
Without a limit on jerk acceleration may jump within every period, and the acceleration column cannot be refuted; nor can the
jerk column, which may jump anyhow.

The row of the feed, |v| over all axes with rotary ones at the radius of the path, is of feed.py. Normal acceleration is
|a - (a.t) t| with t = v/|v| over x, y and z; its share of the chord error over a period is
|normal acceleration| h^2 / 8. Where velocity or acceleration was not delivered it is taken from the second difference, a mean of
a(t) over w = t2 - t0, across the chord's direction u. With normal acceleration <= N, |a| <= A and speed >= v the motion's direction
turns by at most N w / v in that time, and u lies within its turn, so that of the mean

    |a - (a.u) u| <= N + A sin(min(N w / v, pi/2)),      v = chord / w - A w,

where the second term is taken off.

Only columns that were delivered are judged as columns, and compared with the positions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planner.base.arrays import Array, FloatArray
from planner.machine import Machine
from planner.verifier.pieces import RATIO_ROUNDING, kernel

ROUNDING_ULPS = 4.0  # of the position, in units of 2^-52 of the numbers it is computed from
FEED_AT_REST = 1e-6  # [mm/s] below this the direction of the velocity is rounding: 1e-12 mm/s of it is 1e-6 of the direction
COLUMN, DIFFERENCE = 0, 1  # how a value was seen
NORMAL_NAME = "normal_acceleration"

# Rows of the tables: six groups of one row per axis, then three rows of their own.
VELOCITY, ACCELERATION, JERK, GAP_BY_ACCELERATION, GAP_BY_JERK, GAP_OF_ACCELERATION = range(6)
GROUPS = 6
FEED, NORMAL, CHORD = range(3)
ROWS_ALONE = 3
BACK = 3  # periods that a third difference reaches back
OVER = 5  # velocity, acceleration and jerk of any axis, feed, normal acceleration


class SampleColumns(NamedTuple):
    """The samples: times (n,) [s], and positions and their derivatives (n, A); zeros where they were not delivered."""

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


class Allowed(NamedTuple):
    """What samples are held against.

    limits     : (3, A) velocity, acceleration, jerk
    linear     : (A,) True on x, y and z, of which the normal acceleration is
    normal     : limit of the normal acceleration [mm/s2], or inf
    judged     : (3,) True if velocity, acceleration, jerk were delivered
    digits     : (A+1,) largest error of a position [mm], last of a time [s], by the digits they were written with
    """

    limits: FloatArray
    linear: Array
    normal: float
    judged: Array
    digits: FloatArray


class Worst(NamedTuple):
    """The worst so far of R = GROUPS A + ROWS_ALONE rows, and where limits are exceeded.

    row    : (R, 4) ratio, value, limit, `COLUMN` or `DIFFERENCE`. The gaps are those of the module's text over h, h^2 and h, with the
             limits in place of A, J.
    sample : (R,) its index
    over   : (n, OVER) by what ratio the columns of each sample exceed velocity, acceleration, jerk, feed and normal acceleration; 0
             where they keep them
    """

    row: FloatArray
    sample: Array
    over: FloatArray


def normal_limit(machine: Machine) -> float:
    """The machine's limit of the normal acceleration [mm/s2]; inf if it names none."""
    return machine.normal_acceleration or math.inf


@kernel()
def scan(
    columns: SampleColumns,
    skip: int,
    allowed: Allowed,
    travelled: float,
    worst: Worst,
    work: FloatArray,
) -> float:
    """Write into `worst` what is worse in samples `skip` to the last; up to three samples before them serve the differences.

    travelled : path length run before [mm]
    work      : (4, A, 4) room for d0 .. d3 and their rounding, now and at the sample before

    -> path length run at the last sample [mm]
    """
    t, position, velocity, acceleration, _ = columns
    limits, linear, normal_max, judged, _ = allowed
    n, axes = position.shape
    alone = GROUPS * axes
    before, error_before = work[2], work[3]
    ulp = ROUNDING_ULPS * 2.0**-52
    first = max(skip - 3, 0)
    most_sq = 0.0
    for axis in range(axes):
        most_sq += limits[1, axis] ** 2 if linear[axis] else 0.0
    most = math.sqrt(most_sq)
    for k in range(first, n):
        period = t[k] - t[k - 1] if k > first else math.inf
        step_sq = 0.0
        for axis in range(axes):
            if k > first:
                step_sq += (position[k, axis] - position[k - 1, axis]) ** 2
        step = math.sqrt(step_sq)
        if k >= max(skip, 1):
            travelled += step
        for axis in range(axes):
            rounding = ulp * (abs(position[k, axis]) + travelled + limits[0, axis] * t[k])
            work[1, 0, 0] = rounding + _of_digits(columns, allowed, first, k, axis)
            _differences(columns, allowed, worst, work, first, skip, k, axis)
            if k >= skip:
                _of_columns(columns, allowed, worst, work, first, k, axis)
        if k < skip:
            continue
        how = COLUMN if judged[0] and judged[1] else DIFFERENCE
        if how == COLUMN:
            normal = _normal(velocity, acceleration, k, linear)
            _keep(worst, alone + NORMAL, normal, normal_max, k, COLUMN)
        else:
            normal = 0.0
            if k - first >= 2:
                normal, taken_off = _mean_normal(
                    t, position, before, error_before, k, linear, normal_max, most
                )
                _keep(worst, alone + NORMAL, normal - taken_off, normal_max, k, DIFFERENCE)
        if k > first:
            _keep(worst, alone + CHORD, normal * period * period / 8.0, 1.0, k, how)
    return travelled


@kernel()
def _of_digits(columns: SampleColumns, allowed: Allowed, first: int, k: int, axis: int) -> float:
    """Error of a position by the digits of it and of its time, at the speed the motion can have there [mm]."""
    t, position = columns.t, columns.position
    n, axes = position.shape
    error = allowed.digits[axis]
    if allowed.digits[axes] > 0.0 and n > first + 1:
        to = max(k, first + 1)
        lasting = t[to] - t[to - 1]
        speed = abs(position[to, axis] - position[to - 1, axis]) / lasting
        error += allowed.digits[axes] * (speed + allowed.limits[1, axis] * lasting)
    return float(error)


@kernel()
def _differences(
    columns: SampleColumns,
    allowed: Allowed,
    worst: Worst,
    work: FloatArray,
    first: int,
    skip: int,
    k: int,
    axis: int,
) -> None:
    """Differences d0 .. d3 of an axis at sample k and their rounding, into `work`, where they replace those of the sample before."""
    t, axes = columns.t, columns.position.shape[1]
    difference, error, before, error_before = work[0, 0], work[1, 0], work[2], work[3]
    difference[0] = columns.position[k, axis]
    for order in range(1, min(3, k - first) + 1):
        over = order / (t[k] - t[k - order])
        difference[order] = over * (difference[order - 1] - before[axis, order - 1])
        error[order] = over * (error[order - 1] + error_before[axis, order - 1])
        if k >= skip:
            value = max(abs(difference[order]) - error[order], 0.0)
            _keep(worst, (order - 1) * axes + axis, value, allowed.limits[order - 1, axis], k, DIFFERENCE)
    for order in range(3):
        before[axis, order], error_before[axis, order] = difference[order], error[order]


@kernel()
def _of_columns(
    columns: SampleColumns, allowed: Allowed, worst: Worst, work: FloatArray, first: int, k: int, axis: int
) -> None:
    """Judge the columns of an axis at sample k, and by how much they miss the differences in `work` (module text)."""
    t, _, velocity, acceleration, jerk = columns
    limits, judged = allowed.limits, allowed.judged
    axes, resolution = velocity.shape[1], RATIO_ROUNDING
    if judged[0]:
        _keep(worst, VELOCITY * axes + axis, abs(velocity[k, axis]), limits[0, axis], k, COLUMN)
    if judged[1]:
        _keep(worst, ACCELERATION * axes + axis, abs(acceleration[k, axis]), limits[1, axis], k, COLUMN)
    if judged[2]:
        _keep(worst, JERK * axes + axis, abs(jerk[k, axis]), limits[2, axis], k, COLUMN)
    if k == first or not judged[0]:
        return
    over = 1.0 / (t[k] - t[k - 1])
    mean = 0.5 * (velocity[k, axis] + velocity[k - 1, axis])
    gap = max(abs(work[0, 0, 1] - mean) - work[1, 0, 1] - resolution * limits[0, axis], 0.0) * over
    _keep(worst, GAP_BY_ACCELERATION * axes + axis, gap, limits[1, axis] / 4.0, k, COLUMN)
    _keep(worst, GAP_BY_JERK * axes + axis, gap * over, limits[2, axis] / 12.0, k, COLUMN)
    if not judged[1]:
        return
    mean = 0.5 * (acceleration[k, axis] + acceleration[k - 1, axis])
    change = (velocity[k, axis] - velocity[k - 1, axis]) * over
    noise = resolution * (limits[0, axis] * over + limits[1, axis])
    gap = max(abs(change - mean) - noise, 0.0) * over
    _keep(worst, GAP_OF_ACCELERATION * axes + axis, gap, limits[2, axis] / 4.0, k, COLUMN)


@kernel()
def _normal(velocity: FloatArray, acceleration: FloatArray, k: int, linear: Array) -> float:
    linear_sq, along = 0.0, 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            linear_sq += velocity[k, axis] ** 2
            along += velocity[k, axis] * acceleration[k, axis]
    if linear_sq <= FEED_AT_REST * FEED_AT_REST:
        return 0.0
    normal_sq = 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            normal_sq += (acceleration[k, axis] - along * velocity[k, axis] / linear_sq) ** 2
    return math.sqrt(normal_sq)


@kernel()
def _mean_normal(
    t: FloatArray,
    position: FloatArray,
    difference: FloatArray,
    error: FloatArray,
    k: int,
    linear: Array,
    normal_max: float,
    most: float,
) -> tuple[float, float]:
    """Second difference at samples k-2 .. k across their chord [mm/s2], and what of it may be other than normal acceleration.

    difference, error : (A, 4) differences at sample k by order, and their rounding
    most              : largest norm of the acceleration of the linear axes [mm/s2]
    """
    chord_sq, along, rounding_sq = 0.0, 0.0, 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            step = position[k, axis] - position[k - 2, axis]
            chord_sq += step * step
            along += step * difference[axis, 2]
            rounding_sq += error[axis, 2] ** 2
    lasting = t[k] - t[k - 2]
    if math.sqrt(chord_sq) <= FEED_AT_REST * lasting:
        return 0.0, 0.0
    normal_sq = 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            step = position[k, axis] - position[k - 2, axis]
            normal_sq += (difference[axis, 2] - along * step / chord_sq) ** 2
    slowest = math.sqrt(chord_sq) / lasting - most * lasting
    turn = 0.5 * math.pi
    if slowest > 0.0:
        turn = min(turn, normal_max * lasting / slowest)
    return math.sqrt(normal_sq), most * math.sin(turn) + math.sqrt(rounding_sq)


@kernel(inline=True)
def _keep(worst: Worst, row: int, value: float, limit: float, k: int, seen: int) -> None:
    rows = worst.row
    if value > rows[row, 0] * limit:  # false where the limit is inf
        rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3] = value / limit, value, limit, seen
        worst.sample[row] = k
    if seen == COLUMN and value > (1.0 + RATIO_ROUNDING) * limit:
        axes = (len(rows) - ROWS_ALONE) // GROUPS
        column = row // axes if row < GROUPS * axes else 3 + row - GROUPS * axes
        if column < 3 or (row >= GROUPS * axes and column < OVER):
            worst.over[k, column] = max(worst.over[k, column], value / limit)
