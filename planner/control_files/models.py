"""Short models of the planners inside grbl, Klipper and Marlin: how long such a control takes for a polyline.

They are ours, written from what these controls document, and predict; nothing here runs the controls' own code. All three move with
constant acceleration along straight blocks, know no jerk, and stay on the path; at a corner the speed steps. With the turning angle
theta, s = cos(theta/2) and the acceleration a along the bisector they pass it at

    grbl 1.1, Marlin 2   v^2 = a delta s / (1 - s)                       delta: junction deviation [mm]
    Marlin 2 besides     v^2 <= a l / theta                               on blocks shorter than 1 mm that turn by less than 45 degrees
    Klipper              v^2 <= a delta s / (1 - s),  delta = (2^(1/2) - 1) c^2 / a,   c: square corner velocity [mm/s]
                         v^2 <= a l / (2 tan(theta/2))                    of the blocks on both sides, with their lengths l

and the speeds along the path follow from a backward and a forward pass: with S the running sum of 2 a l,

    v_i^2 <= min over k >= i of (V_k^2 + S_k - S_i)        and the same from the left,

V the junction's own bound. grbl and Marlin look `blocks` blocks ahead, at the end of which the motion must be able to stand:
v_i^2 <= S_{i+blocks} - S_i. Klipper looks far ahead, and lets a move speed up only as far as it would with half of the acceleration
for what it gains and loses at once ("minimum cruise ratio" 0.5): its speed in between is at most that of such a triangle.

A block takes at least `block_time`, the time to send and read its line.

Tested against these controls' own code on five programs where their times are at hand (tests/control_files/test_models.py); Marlin's
were not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.names import known_name
from planner.machine import Machine

ControlName = Literal["grbl", "klipper", "marlin"]
# Turning angles below this pass at any speed [rad]: 1 - s would be lost in rounding.
STRAIGHT = 1e-6
STANDING = (
    1e-12  # a speed of nothing [mm/s], so that pieces without a length where the motion stands take no time
)
SMALL_BLOCK, SMALL_TURN = 1.0, np.pi / 4  # Marlin's "small segments": shorter [mm], and turning by less [rad]


@dataclass(frozen=True, kw_only=True)
class Control:
    """A control's planner.

    deviation     : junction deviation [mm]; None for Klipper
    square_corner : speed at a corner of 90 degrees [mm/s]; None for grbl and Marlin
    blocks        : how many blocks it looks ahead; None for all
    block_time    : least time of a block [s]
    """

    name: str
    deviation: float | None = None
    square_corner: float | None = None
    blocks: int | None = None
    block_time: float = 0.0


# The values that these controls come with. grbl 1.1: config.h and defaults.h, BLOCK_BUFFER_SIZE 16, $11 = 0.01; Marlin 2:
# Configuration.h, JUNCTION_DEVIATION_MM 0.013, BLOCK_BUFFER_SIZE 16; Klipper: Config_Reference, square_corner_velocity 5. Lines of some
# 30 characters at 115,200 baud take 2.6 ms (grbl, Marlin); Klipper reads a file.
CONTROLS: dict[str, Control] = {
    "grbl": Control(name="grbl", deviation=0.01, blocks=15, block_time=0.0026),
    "klipper": Control(name="klipper", square_corner=5.0),
    "marlin": Control(name="marlin", deviation=0.013, blocks=15, block_time=0.0026),
}


def control_of(name: str) -> Control:
    """The control of a name. Raises InputError for another name."""
    return CONTROLS[known_name("control", name, CONTROLS)]


def predicted_time(
    points: FloatArray,
    feed: FloatArray,
    stop: Array,
    machine: Machine,
    axes: tuple[str, ...],
    control: Control,
) -> float:
    """Time that a control takes for a polyline [s], from rest to rest.

    points : (n+1, A) vertices [mm]
    feed   : (n,) programmed feed of each block [mm/s]; inf for rapid moves
    stop   : (n+1,) where the program has it stand still
    axes   : letters of the A axes; their velocities and accelerations are the machine's

    Raises InputError for vertices without a move between them.
    """
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    moves = length > 0
    if not moves.any():
        raise InputError("the path moves nowhere")
    ends = np.append(
        0, np.flatnonzero(moves) + 1
    )  # vertices between moves; a stop without one belongs to the vertex before
    stands = np.add.reduceat(stop, ends) > 0
    way, length, feed = step[moves] / length[moves, None], length[moves], feed[moves]
    velocity, acceleration = (machine.limits(name, axes) for name in ("velocity", "acceleration"))
    top = np.minimum(feed, along(way, velocity))
    if control.block_time:
        top = np.minimum(top, length / control.block_time)
    accel = np.full(len(length), acceleration.min()) if control.square_corner else along(way, acceleration)
    corner = _corner_sq(way, length, accel, acceleration, control)
    bound = np.append(np.append(0.0, np.minimum(corner, np.minimum(top[1:], top[:-1]) ** 2)), 0.0)
    bound[stands] = 0.0
    if control.square_corner is not None:
        return float(_smoothed_times(length, top**2, accel, bound).sum())
    gain = 2.0 * accel * length
    v_sq = reachable(bound, gain)
    if control.blocks is not None:
        v_sq = reachable(np.minimum(v_sq, stoppable(gain, control.blocks)), gain)
    peak = np.minimum(top**2, 0.5 * (v_sq[1:] + v_sq[:-1] + gain))
    return float(move_times(length, accel, v_sq[:-1], peak, v_sq[1:]).sum())


def along(way: FloatArray, limit: FloatArray) -> FloatArray:
    """(n,) what the limits of the axes allow along directions: limit (A,), way (n, A) unit vectors."""
    with np.errstate(divide="ignore"):
        allowed: FloatArray = (limit / np.abs(way)).min(axis=1)
    return allowed


def _corner_sq(
    way: FloatArray, length: FloatArray, accel: FloatArray, limit: FloatArray, control: Control
) -> FloatArray:
    """(n-1,) square of the speed at the corners between blocks [mm2/s2]."""
    bisector = way[1:] - way[:-1]
    half_turn = np.arctan2(np.linalg.norm(bisector, axis=1), np.linalg.norm(way[1:] + way[:-1], axis=1))
    straight = 2.0 * half_turn < STRAIGHT
    half_turn = np.where(straight, 1.0, half_turn)
    s = np.cos(half_turn)
    ratio = s / (1.0 - s)
    if control.square_corner is not None:
        a = np.minimum(accel[1:], accel[:-1])
        found = ratio * (np.sqrt(2.0) - 1.0) * control.square_corner**2
        shorter = np.minimum(length[1:], length[:-1])
        found = np.minimum(found, 0.5 * a * shorter / np.tan(half_turn))
    else:
        assert control.deviation is not None
        size = np.linalg.norm(bisector, axis=1, keepdims=True)
        a = along(np.divide(bisector, size, out=np.zeros_like(bisector), where=size > 0), limit)
        found = a * control.deviation * ratio
        if control.name == "marlin":
            small = (length[1:] < SMALL_BLOCK) & (2.0 * half_turn < SMALL_TURN)
            found = np.where(small, np.minimum(found, a * length[1:] / (2.0 * half_turn)), found)
    return np.where(straight, np.inf, found)


def reachable(bound: FloatArray, gain: FloatArray) -> FloatArray:
    """(n+1,) squares of speeds, each at most its bound (n+1,), that blocks with 2 a l = gain (n,) lead to, and lead on from."""
    s = np.append(0.0, np.cumsum(gain))
    back = np.minimum.accumulate((bound + s)[::-1])[::-1] - s
    found: FloatArray = np.minimum.accumulate(back - s) + s
    return np.maximum(found, 0.0)


def stoppable(gain: FloatArray, blocks: int) -> FloatArray:
    """(n+1,) squares of speeds from which the motion can stand within so many blocks, gain (n,)."""
    s = np.append(0.0, np.cumsum(gain))
    ahead = np.minimum(np.arange(len(s)) + blocks, len(s) - 1)
    found: FloatArray = np.where(np.arange(len(s)) + blocks < len(s), s[ahead] - s, np.inf)
    return found


def move_times(
    length: FloatArray, accel: FloatArray, x0: FloatArray, peak: FloatArray, x1: FloatArray
) -> FloatArray:
    """(n,) times of blocks of a length from x0 over a peak to x1, squares of speeds, with constant accel, (n,) all."""
    v0, v, v1 = np.sqrt(x0), np.sqrt(np.maximum(peak, np.maximum(x0, x1))), np.sqrt(x1)
    ramps = (2.0 * v * v - x0 - x1) / (2.0 * accel)
    times: FloatArray = (2.0 * v - v0 - v1) / accel + np.maximum(length - ramps, 0.0) / np.maximum(
        v, STANDING
    )
    return times


def _smoothed_times(length: FloatArray, top: FloatArray, accel: FloatArray, bound: FloatArray) -> FloatArray:
    """(n,) times with Klipper's half acceleration for what is gained and lost at once; top (n,) and bound (n+1,) are squares.

    Two profiles: the fast one keeps all bounds with a; the smooth one with a/2 tells, run by run of braking, the highest speed that is
    worth it: the peak of its triangle before the braking begins.
    """
    gain = 2.0 * accel * length
    half = 0.5 * gain
    fast = reachable(bound, gain)
    along = np.append(0.0, np.cumsum(half))
    forward = np.minimum.accumulate(bound - along) + along
    smooth = reachable(bound, half)
    peak = np.empty(len(length))
    held, brakes = 0.0, False
    for i in range(len(length) - 1, -1, -1):
        reach = smooth[i + 1] + half[i]
        if min(forward[i], reach) < reach:  # it may speed up here
            if forward[i] + half[i] > smooth[i + 1] or brakes:
                held = min(top[i], 0.5 * (smooth[i] + reach))
            brakes = False
            peak[i] = held
        else:
            brakes, peak[i] = True, np.nan  # known once the speeding up before it is
    before = 0.0
    for i in range(len(length)):
        before = peak[i] if not np.isnan(peak[i]) else before
        peak[i] = before
    highest = np.minimum(np.minimum(top, 0.5 * (fast[1:] + fast[:-1] + gain)), peak)
    return move_times(length, accel, np.minimum(fast[:-1], highest), highest, np.minimum(fast[1:], highest))
