"""A short model of LinuxCNC 2.9's planner: how long it takes for lines and arcs with G64 P.

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

at nine tenths of the acceleration beside it. An arc of the program is passed at v^2 <= N a R, a being what every axis of its
plane allows, with (1 - (v_m^2 / a R)^2)^(1/2) of the acceleration along it, v_m its speed without a feed; a kink
beside one takes twice as much. A rest of a line that is passed in less than four periods
belongs to the arc after it; any other one takes a period at least. A spline is cut into pairs of arcs, four for each of its
control points. The last move ends with half of the acceleration. Moves are seen `BLOCKS` ahead,
at the end of which the motion must be able to stand. Q joins moves before all that: points within Q of the
straight line from the first point to the last are left out.

Held against LinuxCNC's own planner on five programs, and on their planned paths with chords of 0.2 um to 25
um and P of 1 um and more: -2.1 to +0.9 % (tests/controls/timing/test_linuxcnc_model.py has some of them).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.controls.timing.models import along, move_times, reachable, stoppable
from planner.machine import Machine

NORMAL = np.sqrt(3.0) / 2.0  # share of the acceleration that an arc takes across, at most
TANGENTIAL = 0.5  # share that is left along it then
LAST = 0.5  # share of the acceleration with which the last move ends
KINK = 0.1  # arcBlendTangentKinkRatio, its default
GAP_CYCLES = 4  # arcBlendGapCycles, its default
CHAIN = 100  # moves that Q joins at most
STRAIGHT = 1e-9  # half turns below this have no arc [rad]: 1 - cos would be lost in rounding
HALF_TURN = 0.5 * np.pi  # half of turning back [rad]
IN_PLANE = 1e-6  # what is no further than this beside the plane of an arc lies in it [-]
FLAT = 1e12  # radius of what counts as a line [mm]
BLOCKS = 50  # ARC_BLEND_OPTIMIZATION_DEPTH, its default


@njit(cache=True, error_model="numpy")
def joined_moves(points, feed, rapid, stop, within):
    """Indices of the vertices that LinuxCNC keeps with G64 Q.

    points : (n+1, A) [mm]
    feed   : (n,) [mm/s]; only moves of one feed are joined, and no rapids
    rapid  : (n,)
    stop   : (n+1,) where the motion stands
    within : Q [mm]; 0 joins nothing
    """
    kept, count, first = np.zeros(len(points), np.int64), 1, 0
    for k in range(1, len(points) - 1):
        chord = points[k + 1] - points[first]
        size = (chord * chord).sum()
        same = feed[k] == feed[first] and not rapid[k] and not rapid[first] and not stop[k]
        joined = within > 0.0 and same and size > 0.0 and k - first <= CHAIN
        for n in range(first + 1, k + 1):
            if not joined:
                break
            way = points[n] - points[first]
            u = min(max((way * chord).sum() / size, 0.0), 1.0)
            joined = np.sqrt(((way - u * chord) ** 2).sum()) <= within
        if not joined:
            kept[count], count, first = k, count + 1, k
    kept[count] = len(points) - 1
    return kept[: count + 1]


@dataclass(frozen=True, eq=False, kw_only=True)
class Bends:
    """The n moves of a program where some are arcs."""

    first: FloatArray  # (n, A) unit tangents where they begin
    last: FloatArray  # (n, A) and where they end
    length: FloatArray  # (n,) [mm]
    radius: FloatArray  # (n,) [mm]; inf of lines
    radial: FloatArray  # (n, A) unit vector from the centre to where an arc begins; 0 of lines
    across: FloatArray  # (n, A) and in its plane at a right angle to that
    parts: FloatArray  # (n,) into how many arcs it is cut, each of which takes a period at least

    def of(self, moves: Array | slice) -> "Bends":
        """Some of the moves, by their numbers (k,), a mask (n,) or a slice."""
        return Bends(**{name: column[moves] for name, column in vars(self).items()})


def lines(points: FloatArray) -> Bends:
    """The straight moves between points (n+1, A)."""
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    way = step / np.maximum(length, 1e-300)[:, None]
    flat = np.full(len(length), np.inf)
    none, one = np.zeros_like(way), np.ones(len(length))
    return Bends(first=way, last=way, length=length, radius=flat, radial=none, across=none, parts=one)


def linuxcnc_times(
    points: FloatArray,
    feed: FloatArray,
    stop: Array,
    machine: Machine,
    axes: tuple[str, ...],
    tolerance: float | FloatArray,
    bends: Bends | None = None,
) -> FloatArray:
    """(n,) times that LinuxCNC takes for moves with G64 P [s], from rest to rest.

    points    : (n+1, A) vertices [mm]
    feed      : (n,) programmed feed of each move [mm/s]; inf for rapid moves
    stop      : (n+1,) where the program has it stand still
    axes      : letters of the A axes; velocities, accelerations and the period are the machine's
    tolerance : P [mm], or (n-1,) of the corners between the moves; 0 is an exact path
    bends     : of the moves; None for lines, and lines move nothing where both ends are the same
    """
    velocity, acceleration = (machine.limits(name, axes) for name in ("velocity", "acceleration"))
    if bends is None:
        bends = lines(points)
    moves = bends.length > 0.0
    ends = np.append(np.flatnonzero(moves), len(moves))
    stop = np.maximum.reduceat(stop, np.append(0, ends[1:]))
    within = np.broadcast_to(tolerance, len(moves) - 1)[ends[1:-1] - 1]
    bends, times = bends.of(moves), np.zeros(len(moves))
    limits = _Limits(velocity, acceleration, machine.dt, machine.feed_max or np.inf)
    times[moves] = _times(bends, feed[moves], stop[1:-1], within, limits)
    given = machine.control
    return times * (given.factor or 1.0) if given is not None and given.name == "linuxcnc" else times


class _Limits(NamedTuple):
    velocity: FloatArray  # (A,) of the axes [mm/s]
    acceleration: FloatArray  # (A,) [mm/s2]
    dt: float  # [s]
    feed_max: float  # [TRAJ] MAX_LINEAR_VELOCITY, which holds for rapids too [mm/s]


def _times(bends: Bends, feed: FloatArray, stop: Array, tolerance: FloatArray, limits: _Limits) -> FloatArray:
    """`linuxcnc_times` of moves that all have a length, with stops and tolerances (n-1,) between them."""
    length = bends.length
    most, straight = _along(bends, limits)
    top = np.minimum(np.minimum(feed, most), np.minimum(length / (bends.parts * limits.dt), limits.feed_max))
    # nothing is rounded at stops, and between rapids and feed moves
    exact = stop | (np.isinf(feed[1:]) != np.isinf(feed[:-1]))
    outside = _not_in_one_plane(bends)
    cut, arc, speed, left = _corners(bends, top, np.where(outside, 0.0, tolerance), limits)
    overlap = np.where(outside & ~exact, _overlaps(bends, speed, top, straight, tolerance), 0.0)
    ramps = overlap > 0.0
    exact |= ramps
    cut, arc, speed = (np.where(exact, 0.0, of) for of in (cut, arc, speed))
    rest = np.maximum(length - np.append(0.0, cut) - np.append(cut, 0.0), 0.0)
    kinks = (arc == 0) & ~exact
    straight *= np.where(np.append(False, kinks) | np.append(kinks, False), 1.0 - KINK, 1.0)
    swallowed = np.append(arc > 0, False) & (rest < GAP_CYCLES * limits.dt * np.append(speed, 0.0))
    swallowed &= np.isinf(bends.radius)
    top = np.where(swallowed | (rest <= 0.0), top, np.minimum(top, rest / limits.dt))
    straight = np.where(swallowed, np.minimum(straight, np.append(np.inf, left)), straight)
    straight *= np.where(np.append(ramps | stop, True) | np.append(False, ramps), LAST, 1.0)
    pieces, tops, accels = (_alternate(*pair) for pair in ((rest, arc), (top, speed), (straight, left)))
    bound = np.append(np.append(0.0, np.minimum(tops[1:], tops[:-1]) ** 2), 0.0)
    gain = 2.0 * accels * pieces
    seen = _alternate(np.where(swallowed, 0, 1), np.where(kinks, 0, 1))
    v_sq = reachable(np.minimum(bound, stoppable(gain, BLOCKS, seen)), gain)
    peak = np.minimum(tops**2, 0.5 * (v_sq[1:] + v_sq[:-1] + gain))
    found = move_times(pieces, accels, v_sq[:-1], peak, v_sq[1:])
    found[::2][:-1] += found[1::2] - overlap  # what rounds a corner belongs to the move before it
    times: FloatArray = found[::2]
    return times


def _along(bends: Bends, limits: _Limits) -> tuple[FloatArray, FloatArray]:
    """(n,) largest speed without a feed [mm/s], and acceleration along the moves [mm/s2]."""
    speed = _in_the_plane(bends.first, bends.radial, limits.velocity)
    accel = _in_the_plane(bends.first, bends.radial, limits.acceleration)
    share = speed**2 / (accel * bends.radius)  # of the acceleration that is needed across
    top = np.where(share > NORMAL, np.sqrt(NORMAL * accel * np.minimum(bends.radius, FLAT)), speed)
    return top, accel * np.where(share > NORMAL, TANGENTIAL, np.sqrt(np.maximum(1.0 - share**2, 0.0)))


def _not_in_one_plane(bends: Bends) -> Array:
    """(n-1,) corners beside arcs that no arc in one plane rounds."""
    before, after = slice(None, -1), slice(1, None)
    is_arc = np.isfinite(bends.radius)
    found = np.zeros(len(is_arc) - 1, dtype=bool)
    for own, other in ((before, after), (after, before)):
        e1, e2 = bends.radial[own], bends.across[own]
        for way in (bends.last[before], bends.first[after], bends.radial[other], bends.across[other]):
            off = way - (way * e1).sum(axis=1)[:, None] * e1 - (way * e2).sum(axis=1)[:, None] * e2
            found |= is_arc[own] & (np.linalg.norm(off, axis=1) > IN_PLANE)
    return found


def _overlaps(
    bends: Bends, kink: FloatArray, top: FloatArray, accel: FloatArray, tolerance: FloatArray
) -> FloatArray:
    """(n-1,) how long the ramps of two moves overlap [s], of corners without an arc; 0 where the kink is faster."""
    before, after = slice(None, -1), slice(1, None)
    half = LAST * accel
    peak = np.minimum(top, np.sqrt(half * bends.length))  # of a move from rest to rest
    ramp, lasts = peak / half, bends.length / peak
    most = np.minimum(np.minimum(lasts[before], lasts[after]), np.maximum(ramp[before], ramp[after]))
    turn = np.linalg.norm(bends.first[after] - bends.last[before], axis=1) / 2.0  # sine of half of it
    within = 2.0 * np.sqrt(half[before] * tolerance / np.maximum(turn, STRAIGHT))
    speed = np.minimum(np.minimum(peak[before], most * half[before]), within)
    faster = 0.5 * speed * np.sqrt(np.maximum(1.0 - turn**2, 0.0)) > kink
    return np.where(faster, speed / half[before], 0.0)


def _alternate(lines: FloatArray, arcs: FloatArray) -> FloatArray:
    """(2 n - 1,) line, arc, line, ..., line."""
    found = np.empty(2 * len(lines) - 1)
    found[::2], found[1::2] = lines, arcs
    return found


def _in_the_plane(first: FloatArray, second: FloatArray, limit: FloatArray) -> FloatArray:
    """(n,) what the limits (A,) of the axes allow in every direction of the plane of two directions (n, A)."""
    second = second - (second * first).sum(axis=1, keepdims=True) * first
    size = np.linalg.norm(second, axis=1, keepdims=True)
    second = np.divide(second, size, out=np.zeros_like(second), where=size > STRAIGHT)
    return along(np.sqrt(first**2 + second**2), limit)


def _corners(
    bends: Bends, top: FloatArray, tolerance: FloatArray, limits: _Limits
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Of the n-1 corners: tangent length, length of the arc (0 of a kink), speed, acceleration along it."""
    before, after, length = bends.last[:-1], bends.first[1:], bends.length
    a = _in_the_plane(before, after, limits.acceleration)
    half = np.arctan2(np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1))
    slow, fast = np.minimum(top[1:], top[:-1]), np.maximum(top[1:], top[:-1])
    h = np.clip(half, STRAIGHT, HALF_TURN - STRAIGHT)
    short = 0.5 * np.minimum(length[1:], length[:-1])
    cut = np.minimum(tolerance * np.sin(h) / np.maximum(1.0 - np.cos(h), 1e-300), short)
    widest = cut / np.tan(h)
    speed = np.minimum(np.sqrt(NORMAL * a * widest), fast)
    blended = np.minimum(np.sqrt(a * cut), speed) / (0.5 * a) * speed  # length of a parabolic blend
    radius = np.maximum(speed**2 / (NORMAL * a), np.minimum(blended / (2.0 * h), widest))
    arc = 2.0 * h * radius
    speed = np.minimum(speed, arc / limits.dt)
    change = (np.abs(after - before) / limits.acceleration).max(axis=1) * (slow / limits.dt + a)
    change = change / np.where(np.isfinite(np.minimum(bends.radius[1:], bends.radius[:-1])), TANGENTIAL, 1.0)
    kink = slow * np.minimum(1.0, KINK / np.maximum(change, 1e-12))
    is_kink = (kink >= speed) | (change <= KINK)
    cut, arc = (np.where(is_kink, 0.0, of) for of in (radius * np.tan(h), arc))
    return cut, arc, np.where(is_kink, kink, speed), TANGENTIAL * a
