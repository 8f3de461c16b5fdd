"""A short model of LinuxCNC 2.9's planner: how long it takes for straight moves with G64 P.

It is ours, written from what LinuxCNC documents and does, and predicts; nothing here runs its code. At a
corner that turns by 2 h between legs l, LinuxCNC puts an arc into the corner that misses it by P at most and
takes half of a leg at most:

    d = min(P sin(h) / (1 - cos(h)), l / 2)        tangent length            R = d / tan(h)          v^2 = N a R

with N = 3^(1/2)/2 of the acceleration a across: a is what the axes allow in every direction of the corner's
plane, the smallest of a_k / |e_k| with e_k the part of axis k's direction in that plane. Where the feed is
lower, the arc is as long as a blend by overlapping ramps with a/2 would be, but no larger than R. On arcs
half of the acceleration is left along the path. So a path of many short chords, which becomes one chain of
arcs, is braked and sped up with half of the acceleration, and corners with long legs lose less: a smooth path
can be the slower one here. Where it is faster, the corner is a kink: passed within one period dt as long as
the step of the velocity takes no more than a tenth (K) of what an axis may do in it,

    v <= K v_max / max_axes |u2 - u1| (v_max / dt + a) / a,

at nine tenths of the acceleration beside it. A rest of a line that is passed in less than four periods
belongs to the arc after it. The last move ends with half of the acceleration. Moves are seen `BLOCKS` ahead,
at the end of which the motion must be able to stand. Q joins moves before all that: points within Q of the
straight line from the first point to the last are left out.

Held against LinuxCNC's own planner on five programs, and on their planned paths with chords of 0.2 um to 25
um and P of 1 um and more: -2.1 to +0.9 % (tests/controls/export/test_linuxcnc_model.py has some of them).
"""

from itertools import pairwise

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.controls.export.models import along, move_times, moving, reachable, stoppable
from planner.machine import Machine

NORMAL = np.sqrt(3.0) / 2.0  # share of the acceleration that an arc takes across, at most
TANGENTIAL = 0.5  # share that is left along it then
LAST = 0.5  # share of the acceleration with which the last move ends
KINK = 0.1  # arcBlendTangentKinkRatio, its default
GAP_CYCLES = 4  # arcBlendGapCycles, its default
CHAIN = 100  # moves that Q joins at most
STRAIGHT = 1e-9  # half turns below this have no arc [rad]: 1 - cos would be lost in rounding
HALF_TURN = 0.5 * np.pi  # half of turning back [rad]
BLOCKS = 50  # ARC_BLEND_OPTIMIZATION_DEPTH, its default


def joined_moves(points: FloatArray, feed: FloatArray, rapid: Array, stop: Array, within: float) -> Array:
    """Indices of the vertices that LinuxCNC keeps with G64 Q.

    points : (n+1, A) [mm]
    feed   : (n,) [mm/s]; only moves of one feed are joined, and no rapids
    rapid  : (n,)
    stop   : (n+1,) where the motion stands
    within : Q [mm]; 0 joins nothing
    """
    kept, first = [0], 0
    for k in range(1, len(points) - 1):
        chain = points[first + 1 : k + 1]
        chord = points[k + 1] - points[first]
        size = float(chord @ chord)
        same = feed[k] == feed[first] and not rapid[k] and not rapid[first] and not stop[k]
        if within > 0.0 and same and size > 0.0 and k - first <= CHAIN:
            u = np.clip((chain - points[first]) @ chord / size, 0.0, 1.0)
            off = np.linalg.norm(chain - points[first] - u[:, None] * chord, axis=1)
            if (off <= within).all():
                continue
        kept.append(k)
        first = k
    return np.array([*kept, len(points) - 1])


def linuxcnc_time(
    points: FloatArray,
    feed: FloatArray,
    stop: Array,
    machine: Machine,
    axes: tuple[str, ...],
    tolerance: float,
) -> float:
    """Time that LinuxCNC takes for straight moves with G64 P [s], from rest to rest.

    points    : (n+1, A) vertices [mm]
    feed      : (n,) programmed feed of each move [mm/s]; inf for rapid moves
    stop      : (n+1,) where the program has it stand still
    axes      : letters of the A axes; velocities, accelerations and the period are the machine's
    tolerance : P [mm]
    """
    points, feed, stop = moving(points, feed, stop)
    ends = [0, *(np.flatnonzero(stop[1:-1]) + 1), len(points) - 1]
    return sum(
        _moving_time(points[first : last + 1], feed[first:last], machine, axes, tolerance)
        for first, last in pairwise(ends)
    )


def _moving_time(
    points: FloatArray, feed: FloatArray, machine: Machine, axes: tuple[str, ...], tolerance: float
) -> float:
    """`linuxcnc_time` between two stops: nothing is blended with what comes after a stop."""
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    way = step / length[:, None]
    velocity, acceleration = (machine.limits(name, axes) for name in ("velocity", "acceleration"))
    top = np.minimum(np.minimum(feed, along(way, velocity)), length / machine.dt)
    top = np.minimum(top, machine.feed_max or np.inf)  # [TRAJ] MAX_LINEAR_VELOCITY holds for rapids too
    across = _in_the_plane(way, acceleration)
    cut, arc, speed, left = _corners(way, length, top, acceleration, across, tolerance, machine.dt)
    rest = np.maximum(length - np.append(0.0, cut) - np.append(cut, 0.0), 0.0)
    straight = along(way, acceleration)
    kinks = arc == 0
    straight *= np.where(np.append(False, kinks) | np.append(kinks, False), 1.0 - KINK, 1.0)
    swallowed = np.append(~kinks, False) & (rest < GAP_CYCLES * machine.dt * np.append(speed, 0.0))
    straight = np.where(swallowed, np.minimum(straight, np.append(np.inf, left)), straight)
    straight[-1] *= LAST
    pieces, tops, accels = (_alternate(*pair) for pair in ((rest, arc), (top, speed), (straight, left)))
    bound = np.append(np.append(0.0, np.minimum(tops[1:], tops[:-1]) ** 2), 0.0)
    gain = 2.0 * accels * pieces
    seen = _alternate(np.where(swallowed, 0, 1), np.where(kinks, 0, 1))
    v_sq = reachable(np.minimum(bound, stoppable(gain, BLOCKS, seen)), gain)
    peak = np.minimum(tops**2, 0.5 * (v_sq[1:] + v_sq[:-1] + gain))
    return float(move_times(pieces, accels, v_sq[:-1], peak, v_sq[1:]).sum())


def _alternate(lines: FloatArray, arcs: FloatArray) -> FloatArray:
    """(2 n - 1,) line, arc, line, ..., line."""
    found = np.empty(2 * len(lines) - 1)
    found[::2], found[1::2] = lines, arcs
    return found


def _in_the_plane(way: FloatArray, acceleration: FloatArray) -> FloatArray:
    """(n-1,) acceleration that the axes allow in every direction of the plane of two moves [mm/s2]: way (n,
    A), acceleration (A,)."""
    first = way[:-1]
    second = way[1:] - (way[1:] * first).sum(axis=1, keepdims=True) * first
    size = np.linalg.norm(second, axis=1, keepdims=True)
    second = np.divide(second, size, out=np.zeros_like(second), where=size > STRAIGHT)
    return along(np.sqrt(first**2 + second**2), acceleration)


def _corners(
    way: FloatArray,
    length: FloatArray,
    top: FloatArray,
    acceleration: FloatArray,
    a: FloatArray,
    tolerance: float,
    dt: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The n-1 corners of n moves: tangent length, length of the arc (0 of a kink), speed, and the
    acceleration left along it."""
    half = np.arctan2(
        np.linalg.norm(np.diff(way, axis=0), axis=1), np.linalg.norm(way[1:] + way[:-1], axis=1)
    )
    slow, fast = np.minimum(top[1:], top[:-1]), np.maximum(top[1:], top[:-1])
    h = np.clip(half, STRAIGHT, HALF_TURN - STRAIGHT)
    cut = np.minimum(
        tolerance * np.sin(h) / np.maximum(1.0 - np.cos(h), 1e-300), 0.5 * np.minimum(length[1:], length[:-1])
    )
    widest = cut / np.tan(h)
    speed = np.minimum(np.sqrt(NORMAL * a * widest), fast)
    blended = np.minimum(np.sqrt(a * cut), speed) / (0.5 * a) * speed  # length of a parabolic blend
    radius = np.maximum(speed**2 / (NORMAL * a), np.minimum(blended / (2.0 * h), widest))
    arc = 2.0 * h * radius
    speed = np.minimum(speed, arc / dt)
    change = (np.abs(np.diff(way, axis=0)) / acceleration).max(axis=1) * (slow / dt + a)
    kink = slow * np.minimum(1.0, KINK / np.maximum(change, 1e-12))
    is_kink = kink >= speed
    left = TANGENTIAL * a
    return (
        np.where(is_kink, 0.0, radius * np.tan(h)),
        np.where(is_kink, 0.0, arc),
        np.where(is_kink, kink, speed),
        left,
    )
