"""Short models of the planners inside grbl, Klipper and Marlin: how long such a control takes for a polyline.

They are ours, written from what these controls document, and predict; nothing here runs the controls' own
code. All three move with constant acceleration along straight blocks, know no jerk, and stay on the path; at
a corner the speed steps. With the turning angle theta, s = cos(theta/2) and the acceleration a along the
bisector they pass it at

    grbl 1.1, Marlin 2   v^2 = a delta s / (1 - s)                       delta: junction deviation [mm]
    Marlin 2 besides     v^2 <= a l / theta                               on blocks shorter than 1 mm that turn by less than 45 degrees
    Marlin with jerk     v |u2 - u1| <= J for each axis                   J: the jump of velocity it may have (M205 X Y Z) [mm/s]
                         v max(|u1|, |u2|) <= J                           where the axis turns back
    Klipper              v^2 <= a delta s / (1 - s),  delta = (2^(1/2) - 1) c^2 / A,   c: square corner velocity [mm/s]
                         v^2 <= a l / (2 tan(theta/2))                    of the blocks on both sides, with their lengths l

The acceleration a of a block is what its axes allow along it, and no more than A, that along the path, where
the control has one: max_accel of Klipper, which holds along the path for x and y together, M204 of Marlin.
Klipper's max_velocity likewise. Where a machine does not say them, Klipper's are the smaller limits of x and
y: with more, one of the two would exceed its own on some move.

and the speeds along the path follow from a backward and a forward pass: with S the running sum of 2 a l,

    v_i^2 <= min over k >= i of (V_k^2 + S_k - S_i)        and the same from the left,

V the junction's own bound. grbl and Marlin look `blocks` blocks ahead, their buffer without the block under
way, at the end of which the motion must be able to stand: v_i^2 <= S_{i+blocks} - S_i. Klipper looks far
ahead, and lets a move speed up only as far as it would with a share 1 - r of A for what it gains and loses
at once (r: "minimum cruise ratio", 0.5): its speed in between is at most that of such a triangle.

A block takes at least `block_time`, the time to send and read its line. What [control] of the machine file
says of the same control takes the place of the values here.

tests/controls/timing/test_models.py and benchmarks/results/control-time.md hold them against the controls'
own code.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.machine import Machine

STRAIGHT = 1e-6  # turning angles below this pass at any speed [rad]: 1 - s would be lost in rounding
STANDING = 1e-12  # a speed of nothing [mm/s]: pieces without a length where the motion stands take no time
CHORD_MIN = 0.1  # of Marlin's chords, MIN_ARC_SEGMENT_MM [mm]
SMALL_BLOCK, SMALL_TURN = 1.0, np.pi / 4  # Marlin's "small segments": shorter [mm], and turning by less [rad]


@dataclass(frozen=True, kw_only=True)
class Control:
    """A control's planner; the names are those of [control] in a machine file."""

    name: str
    junction_deviation: float | None = None  # [mm]; None for Klipper
    square_corner_velocity: float | None = None  # at a corner of 90 degrees [mm/s]; None for grbl and Marlin
    minimum_cruise_ratio: float = 0.5  # of Klipper [-]
    acceleration: float | None = None  # largest along the path [mm/s2]; None where it has none of its own
    corner_jump: Mapping[str, float] = field(default_factory=dict)  # by axis, instead of a deviation [mm/s]
    blocks: int | None = None  # how many blocks it looks ahead; None for all
    block_time: float = 0.0  # least time of a block [s]
    factor: float = 1.0  # by which it is slower than this model (timing/fit.py) [-]
    chord_miss: float | None = None  # of chords of an arc: how far they may miss it [mm] ...
    chord_length: float | None = None  # ... or how long they may be [mm]
    chords_least: int = 1  # of a full turn
    rapid_feed: bool = False  # G0 moves at the F in force


# The values that these controls come with. grbl 1.1: config.h and defaults.h, BLOCK_BUFFER_SIZE 16, $11 =
# 0.01, $12 = 0.002; Marlin 2: Configuration.h, JUNCTION_DEVIATION_MM 0.013, BLOCK_BUFFER_SIZE 16,
# MAX_ARC_SEGMENT_MM 1, MIN_CIRCLE_SEGMENTS 72; Klipper: Config_Reference, square_corner_velocity 5,
# minimum_cruise_ratio 0.5, [gcode_arcs] resolution 1. Lines of some 30 characters at 115,200 baud take 2.6 ms
# (grbl, Marlin); Klipper reads a file.
GRBL = Control(name="grbl", junction_deviation=0.01, blocks=14, block_time=0.0026, chord_miss=0.002)
KLIPPER = Control(name="klipper", square_corner_velocity=5.0, chord_length=1.0, rapid_feed=True)
MARLIN = dataclasses.replace(
    GRBL,
    name="marlin",
    junction_deviation=0.013,
    chord_miss=None,
    chord_length=1.0,
    chords_least=72,
    rapid_feed=True,
)
CONTROLS = {control.name: control for control in (GRBL, KLIPPER, MARLIN)}


def as_set(control: Control, machine: Machine) -> Control:
    """The control with what the machine's [control] says of it."""
    given = machine.control
    if given is None or given.name != control.name:
        return control
    return dataclasses.replace(control, **given.model_dump(exclude_defaults=True))


def moving(points: FloatArray, feed: FloatArray, stop: Array) -> tuple[FloatArray, FloatArray, Array, Array]:
    """Vertices (k+1, A), feeds (k,) and stops (k+1,) without the moves that move nothing, and which moves are left (n,): a
    stop between these belongs to the vertex before. points (n+1, A), feed (n,) and stop (n+1,) are those of `predicted_times`.
    Raises InputError where nothing moves."""
    moves = (np.diff(points, axis=0) != 0.0).any(axis=1)
    if not moves.any():
        raise InputError("the path moves nowhere")
    ends = np.append(0, np.flatnonzero(moves) + 1)
    return points[ends], feed[moves], np.add.reduceat(stop, ends) > 0, moves


def predicted_times(
    points: FloatArray,
    feed: FloatArray,
    stop: Array,
    machine: Machine,
    axes: tuple[str, ...],
    control: Control,
) -> FloatArray:
    """(n,) times that a control takes for the moves of a polyline [s], from rest to rest.

    points : (n+1, A) vertices [mm]
    feed   : (n,) programmed feed of each block [mm/s]; inf for rapid moves
    stop   : (n+1,) where the program has it stand still
    axes   : letters of the A axes; their velocities and accelerations are the machine's

    Raises InputError for vertices without a move between them.
    """
    points, feed, stands, moves = moving(points, feed, stop)
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    way = step / length[:, None]
    control = as_set(control, machine)
    velocity, acceleration = (machine.limits(name, axes) for name in ("velocity", "acceleration"))
    speed, accel_max = np.inf, control.acceleration or np.inf  # along the path, whatever the axes allow
    if control.square_corner_velocity is not None:
        plane = [machine.axes[letter] for letter in "xy"]
        speed = machine.feed_max or min(axis.velocity for axis in plane)
        accel_max = control.acceleration or min(axis.acceleration for axis in plane)
    top = np.minimum(np.minimum(feed, along(way, velocity)), speed)
    if control.block_time:
        top = np.minimum(top, length / control.block_time)
    accel = np.minimum(along(way, acceleration), accel_max)
    jump = np.array([control.corner_jump.get(letter, np.inf) for letter in axes])
    corner = _corner_sq(way, length, accel, acceleration, accel_max, jump, control)
    bound = np.append(np.append(0.0, np.minimum(corner, np.minimum(top[1:], top[:-1]) ** 2)), 0.0)
    bound[stands] = 0.0
    times = np.zeros(len(moves))
    if control.square_corner_velocity is not None:
        lost = 2.0 * length * np.minimum(accel, (1.0 - control.minimum_cruise_ratio) * accel_max)
        parts = pairwise([0, *(np.flatnonzero(stands[1:-1]) + 1), len(length)])
        found = [
            _smoothed_times(length[i:k], top[i:k] ** 2, accel[i:k], bound[i : k + 1], lost[i:k])
            for i, k in parts
        ]
        times[moves] = control.factor * np.concatenate(found)
        return times
    gain = 2.0 * accel * length
    v_sq = reachable(bound, gain)
    if control.blocks is not None:
        v_sq = reachable(np.minimum(v_sq, stoppable(gain, control.blocks, np.ones(len(gain)))), gain)
    peak = np.minimum(top**2, 0.5 * (v_sq[1:] + v_sq[:-1] + gain))
    times[moves] = control.factor * move_times(length, accel, v_sq[:-1], peak, v_sq[1:])
    return times


def chords(control: Control, length: FloatArray, sweep: FloatArray, radius: FloatArray) -> Array:
    """(n,) into how many chords a control cuts arcs of a `length` (n,) [mm], rise included, a `sweep` (n,)
    [rad] and a `radius` (n,) [mm]."""
    if control.chord_miss is not None:
        miss = np.minimum(control.chord_miss, radius)
        count = 0.5 * sweep * radius / np.sqrt(miss * (2.0 * radius - miss))
    else:
        least = np.minimum(control.chords_least * sweep / (2.0 * np.pi), length / CHORD_MIN)
        count = np.maximum(length / (control.chord_length or np.inf), least)
    found: Array = np.maximum(np.floor(count), 1.0).astype(np.int64)
    return found


def along(way: FloatArray, limit: FloatArray) -> FloatArray:
    """(n,) what the limits of the axes allow along directions: limit (A,), way (n, A) unit vectors."""
    with np.errstate(divide="ignore"):
        allowed: FloatArray = (limit / np.abs(way)).min(axis=1)
    return allowed


def _corner_sq(
    way: FloatArray,
    length: FloatArray,
    accel: FloatArray,
    limit: FloatArray,
    accel_max: float,
    jump: FloatArray,
    control: Control,
) -> FloatArray:
    """(n-1,) square of the speed at the corners between blocks [mm2/s2]."""
    bisector = way[1:] - way[:-1]
    half_turn = np.arctan2(np.linalg.norm(bisector, axis=1), np.linalg.norm(way[1:] + way[:-1], axis=1))
    straight = 2.0 * half_turn < STRAIGHT
    if control.corner_jump:
        back = way[1:] * way[:-1] < 0.0
        change = np.where(back, np.maximum(np.abs(way[1:]), np.abs(way[:-1])), bisector)
        return np.where(straight, np.inf, along(change, jump) ** 2)
    half_turn = np.where(straight, 1.0, half_turn)
    s = np.cos(half_turn)
    ratio = s / (1.0 - s)
    if control.square_corner_velocity is not None:
        a = np.minimum(accel[1:], accel[:-1])
        found = ratio * (np.sqrt(2.0) - 1.0) * control.square_corner_velocity**2 * a / accel_max
        shorter = np.minimum(accel[1:] * length[1:], accel[:-1] * length[:-1])
        found = np.minimum(found, 0.5 * shorter / np.tan(half_turn))
    else:
        assert control.junction_deviation is not None
        size = np.linalg.norm(bisector, axis=1, keepdims=True)
        a = along(np.divide(bisector, size, out=np.zeros_like(bisector), where=size > 0), limit)
        a = np.minimum(a, accel_max)
        found = a * control.junction_deviation * ratio
        if control.name == "marlin":
            small = (length[1:] < SMALL_BLOCK) & (2.0 * half_turn < SMALL_TURN)
            found = np.where(small, np.minimum(found, a * length[1:] / (2.0 * half_turn)), found)
    return np.where(straight, np.inf, found)


def reachable(bound: FloatArray, gain: FloatArray) -> FloatArray:
    """(n+1,) squares of speeds at most `bound` (n+1,) that blocks with 2 a l = gain (n,) lead to and on
    from."""
    s = np.append(0.0, np.cumsum(gain))
    back = np.minimum.accumulate((bound + s)[::-1])[::-1] - s
    found: FloatArray = np.minimum.accumulate(back - s) + s
    return np.maximum(found, 0.0)


def stoppable(gain: FloatArray, blocks: int, seen: Array) -> FloatArray:
    """(n+1,) squares of speeds from which the motion can stand within so many blocks.

    gain : (n,) 2 a l of the pieces
    seen : (n,) 1 where a piece is a block, 0 where it belongs to the one after it
    """
    s, number = np.append(0.0, np.cumsum(gain)), np.append(0, np.cumsum(seen))
    ahead = np.searchsorted(number, number + blocks)
    found: FloatArray = np.where(ahead < len(s), s[np.minimum(ahead, len(s) - 1)] - s, np.inf)
    return found


def move_times(
    length: FloatArray, accel: FloatArray, x0: FloatArray, peak: FloatArray, x1: FloatArray
) -> FloatArray:
    """(n,) times of blocks of some length from x0 over a peak to x1, squares of speeds, with constant accel, (n,) all."""
    v0, v, v1 = np.sqrt(x0), np.sqrt(np.maximum(peak, np.maximum(x0, x1))), np.sqrt(x1)
    even = np.maximum(length - (2.0 * v * v - x0 - x1) / (2.0 * accel), 0.0)  # way without acceleration
    times: FloatArray = (2.0 * v - v0 - v1) / accel + even / np.maximum(v, STANDING)
    return times


def _smoothed_times(
    length: FloatArray, top: FloatArray, accel: FloatArray, bound: FloatArray, half: FloatArray
) -> FloatArray:
    """(n,) times of a run of blocks with Klipper's lower acceleration for what is gained and lost at once, from
    rest to rest [s].

    top (n,), bound (n+1,) and half (n,), what the lower acceleration gains on each block, are squares of
    speeds. Two profiles: the fast one keeps all bounds; the smooth one tells, where a braking begins, the
    highest speed that is worth it: the peak of its triangle. A block that the smooth profile brakes all along
    is passed at no more than the peak before it, and than where it begins.
    """
    gain = 2.0 * accel * length
    fast, smooth = [0.0], [0.0]
    for i in range(1, len(length)):
        fast.append(min(bound[i], fast[-1] + gain[i - 1]))
        smooth.append(min(fast[-1], smooth[-1] + half[i - 1]))
    first, peak, last = np.empty((3, len(length)))
    end = smooth_end = highest = 0.0
    braking: list[tuple[int, float, float]] = []
    for i in range(len(length) - 1, -1, -1):
        reach, smooth_reach = end + gain[i], smooth_end + half[i]
        start, smooth_start = min(fast[i], reach), min(smooth[i], smooth_reach)
        if smooth_start < smooth_reach:  # it may speed up here
            if smooth_start + half[i] > smooth_end or braking:
                held = highest = min(top[i], 0.5 * (smooth_start + smooth_reach))
                for k, begins, ends in reversed(braking):
                    held = min(held, begins)
                    first[k], peak[k], last[k] = held, held, min(ends, held)
                braking.clear()
            peak[i] = min(0.5 * (start + reach), top[i], highest)
            first[i], last[i] = min(start, peak[i]), min(end, peak[i])
        else:
            braking.append((i, start, end))
        end, smooth_end = start, smooth_start
    return move_times(length, accel, first, peak, last)
