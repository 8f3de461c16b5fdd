"""The limits of the machine and of the program, sample by sample.

Twice per axis: on the delivered columns, and on divided differences of the delivered positions. The n-th divided difference is
a mean of the n-th derivative (Hermite-Genocchi), so n! times it can exceed the limit only if the motion does, whatever the
spacing of the samples:

    d1 = dx / dt,    d2 = 2 (d1' - d1) / (t2 - t0),    d3 = 3 (d2' - d2) / (t3 - t0)

No slack is needed but for rounding. A position carries an error of `ROUNDING_ULPS` units in the last place of what it is
computed from: the coordinate, the path length run so far and (limit times) the time. It is carried through the same
recursion and taken off: at 1 m of coordinates, 100 m of path and 1 ms it is worth 2e-10 mm, 1e-7 mm/s, 4e-4 mm/s2, 2 mm/s3.

The columns must belong to the positions. With |acceleration| <= A over a period h, and |jerk| <= J where jerk is limited,

    |dx/h - (v0 + v1)/2| <= min(A h / 4, J h^2 / 12),      |dv/h - (a0 + a1)/2| <= J h / 4

each up to a rounding of the columns of `RATIO_ROUNDING` times their limit. A and J are the larger of the limit and of what was
measured, so that a motion beyond a limit is not also called a liar.
Without a limit on jerk acceleration may jump within every period, and the acceleration column cannot be refuted; nor can the
jerk column, which may jump anyhow.

Normal acceleration is |a - (a.t) t| with t = v/|v| over the linear axes; its share of the chord error over a period is
|normal acceleration| h^2 / 8.
"""

from __future__ import annotations

import math

from planner.arrays import Array, FloatArray
from planner.verify.pieces import RATIO_ROUNDING, kernel

ROUNDING_ULPS = 4.0  # of the position, in units of 2^-52 of the numbers it is computed from
FEED_AT_REST = 1e-6  # [mm/s] below this the direction of the velocity is rounding: 1e-12 mm/s of it is 1e-6 of the direction
COLUMN, DIFFERENCE = 0, 1  # how a value was seen

# Rows of the tables: six groups of one row per axis, then three rows of their own.
VELOCITY, ACCELERATION, JERK, GAP_BY_ACCELERATION, GAP_BY_JERK, GAP_OF_ACCELERATION = range(6)
GROUPS = 6
FEED, NORMAL, CHORD = range(3)
ROWS_ALONE = 3


@kernel()
def scan(
    t: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
    skip: int,
    limits: FloatArray,
    linear: Array,
    normal_max: float,
    feed_max: FloatArray,
    travelled: float,
    worst: FloatArray,
    sample: Array,
    work: FloatArray,
) -> float:
    """Find the worst of samples `skip` to the last; up to three samples before them serve the differences.

    limits           : (3, A) velocity, acceleration, jerk
    linear           : (A,) True on linear axes, which make up the feed
    normal_max       : [mm/s2], or inf
    feed_max         : (n,) programmed feed at each sample [mm/s]
    travelled        : path length run before [mm]
    worst, sample    : (GROUPS A + ROWS_ALONE, 4) ratio, value, limit, `COLUMN` or `DIFFERENCE`, and the sample's index;
                       written. The gaps are those of the module's text over h, h^2 and h, with the limits in place of A, J.

    work             : (4, A, 4) room for d0 .. d3 and their rounding, now and at the sample before

    -> path length run at the last sample [mm]
    """
    n, axes = position.shape
    alone = GROUPS * axes
    difference, error, before, error_before = work[0, 0], work[1, 0], work[2], work[3]
    ulp, resolution = ROUNDING_ULPS * 2.0**-52, RATIO_ROUNDING
    first = max(skip - 3, 0)
    for k in range(first, n):
        period = t[k] - t[k - 1] if k > first else math.inf
        step_sq = 0.0
        for axis in range(axes):
            if k > first and linear[axis]:
                step_sq += (position[k, axis] - position[k - 1, axis]) ** 2
        step = math.sqrt(step_sq)
        if k >= max(skip, 1):
            travelled += step
        for axis in range(axes):
            difference[0] = position[k, axis]
            error[0] = ulp * (abs(position[k, axis]) + travelled + limits[0, axis] * t[k])
            for order in range(1, min(3, k - first) + 1):
                over = order / (t[k] - t[k - order])
                difference[order] = over * (difference[order - 1] - before[axis, order - 1])
                error[order] = over * (error[order - 1] + error_before[axis, order - 1])
                if k >= skip:
                    value = max(abs(difference[order]) - error[order], 0.0)
                    _keep(
                        worst,
                        sample,
                        (order - 1) * axes + axis,
                        value,
                        limits[order - 1, axis],
                        k,
                        DIFFERENCE,
                    )
            for order in range(3):
                before[axis, order], error_before[axis, order] = difference[order], error[order]
            if k < skip:
                continue
            _keep(worst, sample, VELOCITY * axes + axis, abs(velocity[k, axis]), limits[0, axis], k, COLUMN)
            _keep(
                worst,
                sample,
                ACCELERATION * axes + axis,
                abs(acceleration[k, axis]),
                limits[1, axis],
                k,
                COLUMN,
            )
            _keep(worst, sample, JERK * axes + axis, abs(jerk[k, axis]), limits[2, axis], k, COLUMN)
            if k == first:
                continue
            mean = 0.5 * (velocity[k, axis] + velocity[k - 1, axis])
            gap = max(abs(difference[1] - mean) - error[1] - resolution * limits[0, axis], 0.0) / period
            _keep(worst, sample, GAP_BY_ACCELERATION * axes + axis, gap, limits[1, axis] / 4.0, k, COLUMN)
            _keep(worst, sample, GAP_BY_JERK * axes + axis, gap / period, limits[2, axis] / 12.0, k, COLUMN)
            mean = 0.5 * (acceleration[k, axis] + acceleration[k - 1, axis])
            change = (velocity[k, axis] - velocity[k - 1, axis]) / period
            noise = resolution * (limits[0, axis] / period + limits[1, axis])
            gap = max(abs(change - mean) - noise, 0.0) / period
            _keep(worst, sample, GAP_OF_ACCELERATION * axes + axis, gap, limits[2, axis] / 4.0, k, COLUMN)
        if k < skip:
            continue
        feed, normal = _feed_and_normal(velocity, acceleration, k, linear)
        _keep(worst, sample, alone + FEED, feed, feed_max[k], k, COLUMN)
        _keep(worst, sample, alone + NORMAL, normal, normal_max, k, COLUMN)
        if k > first:
            allowed = max(feed_max[k], feed_max[k - 1])
            rounding = math.sqrt(float(axes)) * error[1]
            _keep(worst, sample, alone + FEED, max(step / period - rounding, 0.0), allowed, k, DIFFERENCE)
            _keep(worst, sample, alone + CHORD, normal * period * period / 8.0, 1.0, k, COLUMN)
    return travelled


@kernel()
def _feed_and_normal(
    velocity: FloatArray, acceleration: FloatArray, k: int, linear: Array
) -> tuple[float, float]:
    feed_sq, along = 0.0, 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            feed_sq += velocity[k, axis] ** 2
            along += velocity[k, axis] * acceleration[k, axis]
    feed = math.sqrt(feed_sq)
    if feed <= FEED_AT_REST:
        return feed, 0.0
    normal_sq = 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            normal_sq += (acceleration[k, axis] - along * velocity[k, axis] / feed_sq) ** 2
    return feed, math.sqrt(normal_sq)


@kernel(inline=True)
def _keep(worst: FloatArray, sample: Array, row: int, value: float, limit: float, k: int, seen: int) -> None:
    if value > worst[row, 0] * limit:  # false where the limit is inf
        worst[row, 0], worst[row, 1], worst[row, 2], worst[row, 3] = value / limit, value, limit, seen
        sample[row] = k
