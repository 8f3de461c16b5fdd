"""Lines one after the other, as a linear programme over samples of a motion (least_time.py).

Around each waypoint P_k a motion q is sampled at fixed times s_n from when it passes, up to half of the time
that each line beside it takes at least. What is left of a line, from the last sample behind its begin to the
first one before its end, has an unknown duration tau. A divided difference of order m, times m!, is a mean of
the m-th derivative, weighted by a B-spline (Peano). With [..] for it, per axis, and for knots on both sides of
t_k too,

    |6 q[s_n .. s_n+3]| <= J,    |2 q[s_n .. s_n+2]| <= A,    |q[s_n, s_n+1]| <= V,    u.q[s_n, s_n+1] <= speed

with the line's direction u and speed: its feed, or the largest one between corners with known speeds, before
and behind which the motion slows down no faster than the limits allow and covers no more than the line and
twice its tolerance. Samples are within the tolerance of their line, or a square around it; q(t_k) of P_k. From
the last sample a to the next one b, |q_b - q_a| <= V tau and u.(q_b - q_a) <= speed tau. Differences of first
and second order at a and b, means of velocity and acceleration, differ by at most A and J times the time
between the middles of their knots, which is tau and what they are off a and b. At rest all samples before or
behind are the waypoint.

All this is linear in samples and tau: every motion is a point of the programme, so that what any multipliers
bound its least time by (linear_program.py) is below all motions'. Where lines end at other legs whose time is
bounded by vectors y, these make y_before.(q - P) - y_behind.(q - P) of where the lines begin and end.

The samples around a corner alone bound the speeds there, by the parabola through three of them; with these
each line takes longer, and its largest speed is lower.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.sensitivity.linear_program import Programme, bounds_by_part, multipliers_by_part
from planner.sensitivity.sampled_rows import (
    Layout,
    Lines,
    Rows,
    add_derivatives,
    add_gaps,
    add_places,
    differences,
)
from planner.sensitivity.straight_time import TINY, Bounds, End, largest_speed, straight_time
from planner.sensitivity.waypoints import Legs, Way, legs_between

SAMPLES = 20  # of a line on each side
OF_CORNER = 10  # the same where a corner is looked at alone
NEARBY = 8.0  # up to when it is sampled then, of the time in which the tolerance is crossed [-]
FIRST = 0.15  # the time of the first sample, of that in which the tolerance is crossed [-]
DENSER = 2.5  # power by which samples are closer to corners
SETTLING = 1.5  # up to where samples go, of the time in which a line gets to its largest speed [-]
LASTING = 0.8  # lines that are sampled take so long from an end to the middle, of that time [-]
ROOM = 0.1  # by which the start of the programme takes longer [-]
ENOUGH, ITERATIONS = 2e-5, 40  # gap at which a programme ends [-], and after how many iterations at last
NEAR = 1e-4  # the same of speeds at corners [-]
# lines that are sampled, those that take longest for their tolerance; 5,000 take five times as long, for 0.1 % at most
MOST = 1000


class Sampled(NamedTuple):
    """(n,) of lines: their limits, their ends, the largest speed along them, the time in which they get to it, up to when they
    are sampled from each end, and the time in which the tolerance is crossed."""

    bounds: Bounds
    legs: Legs
    speed: FloatArray
    settles: FloatArray
    half: FloatArray
    crossed: FloatArray

    def only(self, leg: Array) -> "Sampled":
        """Some of them, `leg` (m,)."""
        bounds = Bounds(*(one[leg] for one in self.bounds))
        begin, end = (End(one.speed[leg], one.rests[leg]) for one in (self.legs.begin, self.legs.end))
        legs = Legs(self.legs.way[leg], self.legs.time[leg], begin, end)
        return Sampled(bounds, legs, *(one[leg] for one in self[2:]))


def sampled_legs(run: Way) -> Sampled:
    """Of all legs."""
    bounds, _ = run.along(run.tangent, run.feed)
    legs = legs_between(run, bounds, run.length, np.ones(len(run.length), dtype=bool))
    within = np.maximum(run.tolerance[:-1], run.tolerance[1:])
    speed = largest_speed(run.length + 2.0 * within, legs.begin.speed, legs.end.speed, bounds)
    crossed = np.maximum(np.cbrt(within / bounds.jerk), np.sqrt(within / bounds.acceleration))
    settles = SETTLING * (speed / bounds.acceleration + bounds.acceleration / bounds.jerk) + crossed
    return Sampled(bounds, legs, speed, settles, np.minimum(legs.time / 2.0, settles), crossed)


def chains_of(run: Way, sampled: Sampled) -> Array:
    """(P, 2) first line of lines one after the other that take long enough for samples to tell more than their ends do, and the
    leg behind the last one."""
    held = (run.tolerance > 0.0) | run.stop
    some = run.line & held[:-1] & held[1:] & ~(run.stop[:-1] & run.stop[1:])
    longer = np.where(some, sampled.half / np.maximum(LASTING * sampled.crossed, TINY), 0.0)
    fits = np.zeros(len(longer), dtype=bool)
    fits[np.argsort(-longer, kind="stable")[:MOST]] = True
    fits &= longer > 1.0
    joined = fits[1:] & fits[:-1] & ~run.stop[1:-1]
    begin = np.flatnonzero(fits & ~np.append(False, joined))
    end = np.flatnonzero(fits & ~np.append(joined, False)) + 1
    return np.column_stack([begin, end])


def chain_times(run: Way, sampled: Sampled, chains: Array, y: FloatArray) -> FloatArray:
    """(P,) what chains of lines take at least, with what y (N, A) of the legs beside them makes of their ends [s]."""
    lines, at, outer, programme = programme_of(run, sampled, chains, y)
    part = at.part[at.gap]
    fixed = np.bincount(part, lines.front[:, -1] + lines.back[:, -1])
    total = fixed + np.bincount(part, programme.start[at.gap])
    z = multipliers_by_part(programme, at.part, total, ENOUGH, ITERATIONS)
    # what motions with a longer tau than the programme's reach take is not below this
    within = np.abs(outer).sum(axis=(0, 2)) * lines.way.tolerance.max()
    return np.minimum(fixed + bounds_by_part(programme, z, at.part), total - within)


def programme_of(
    run: Way, sampled: Sampled, chains: Array, y: FloatArray
) -> tuple[Lines, Layout, FloatArray, Programme]:
    """The programme of chains, and y of the legs before them and behind them (2, P, A), 0 at stops."""
    moved = np.abs(run.tangent[run.line]).max(axis=0) > 0.0  # others have nothing to tell
    leg = np.concatenate([np.arange(*ends) for ends in chains])
    lines = lines_of(run, sampled.only(leg), chains, moved)
    at = layout_of(lines)
    padded = np.pad(y, ((1, 1), (0, 0)))
    beside = np.stack([padded[chains[:, 0]], padded[chains[:, 1] + 1]])
    outer = np.where(run.stop[chains.T][..., None], 0.0, beside)[..., moved]
    lines = _with_corners(lines, at, sampled.only(leg), outer)
    at = layout_of(lines)
    rows = Rows()
    add_derivatives(rows, lines, at)
    add_places(rows, lines, at, outer)
    add_gaps(rows, lines, at)
    way, cost, start = lines.way, np.zeros(len(at.part)), np.zeros(len(at.part))
    step = np.abs(np.diff(way.point, axis=0))[lines.window]
    needs = (step / way.limit[0]).max(axis=1)
    for along, speed in lines.speeds:
        needs = np.maximum(needs, (np.abs(along) * step).sum(axis=1) / speed)
    cost[at.gap], start[at.gap] = 1.0, (1.0 + ROOM) * needs
    axis = np.arange(way.point.shape[1])
    cost[at.waypoint[lines.begins][:, None] + axis] += outer[0]
    cost[at.waypoint[lines.ends][:, None] + axis] -= outer[1]
    reach, part = _reach(lines, at), at.part[at.gap]
    total = np.bincount(part, start[at.gap] + lines.front[:, -1] + lines.back[:, -1])
    reach[at.gap] = 2.0 * (total + np.abs(outer).sum(axis=(0, 2)) * way.tolerance.max())[part]
    return lines, at, outer, rows.programme(cost, start, reach)


def _reach(lines: Lines, at: Layout) -> FloatArray:
    """(n,) how far samples are from their waypoints at most: they are beside their line. What reaches further lowers the bound
    by more of what rounding leaves of the residual, and takes more iterations."""
    way, window, reach = lines.way, lines.window, np.zeros(len(at.part))
    far = way.length + 2.0 * np.maximum(way.tolerance[window], way.tolerance[window + 1])
    for first in (at.front, at.back, at.waypoint[window, None], at.waypoint[window + 1, None]):
        reach[first[..., None] + np.arange(way.point.shape[1])] = far[:, None, None]
    return reach


def _coordinates(way: Way, bounds: Bounds) -> tuple[FloatArray, FloatArray, Bounds]:
    """(L, A) direction in which each line is looked at, its length there (L,), and the limits: along it, or the axis that its
    jerk is least for, as no line can use all axes' limits, unless along it they are less."""
    size = np.maximum(np.abs(way.tangent), TINY)
    axis, rows = (way.limit[2] / size).argmin(axis=1), np.arange(len(size))
    velocity, push, jerk = way.limit[:, axis]
    slower = jerk / size[rows, axis] < bounds.jerk
    unit = np.zeros(size.shape)
    unit[rows, axis] = np.sign(way.tangent[rows, axis])
    along = np.where(slower[:, None], unit, way.tangent)
    limits = (np.minimum(velocity, way.feed), push, jerk)
    of_axis = Bounds(*(np.where(slower, one, other) for one, other in zip(limits, bounds, strict=True)))
    return along, np.where(slower, way.length * size[rows, axis], way.length), of_axis


def _with_corners(lines: Lines, at: Layout, sampled: Sampled, outer: FloatArray) -> Lines:
    """Lines that take longer and have a lower largest speed, by their speeds at corners."""
    way, legs = lines.way, sampled.legs
    along, length, bounds = _coordinates(way, sampled.bounds)
    begin, end = ends_at_corners(lines, at, legs, outer, (along, bounds))
    one, other = way.tolerance[lines.window], way.tolerance[lines.window + 1]
    time = straight_time(np.maximum(length - one - other, 0.0), begin, end, bounds)
    speed = largest_speed(length + 2.0 * np.maximum(one, other), begin.speed, end.speed, bounds)
    half = np.minimum(np.maximum(time, legs.time) / 2.0, sampled.settles)
    lines = _timed(lines, half, sampled.crossed, SAMPLES)
    return lines._replace(speeds=((way.tangent, sampled.speed), (along, speed)))


def ends_at_corners(
    lines: Lines, at: Layout, legs: Legs, outer: FloatArray, coordinate: tuple[FloatArray, Bounds]
) -> tuple[End, End]:
    """(L,) the ends of lines in a coordinate, directions (L, A) and limits in them, by programmes of the samples around each
    corner alone; `legs` of these lines, `outer` (2, P, A) as for all of them."""
    rows, way = Rows(), lines.way
    add_derivatives(rows, lines, at)
    add_places(rows, lines, at, outer)
    n, axes = len(at.part), way.point.shape[1]
    window = np.isin(np.arange(n), np.append(at.gap, at.waypoint[lines.begins])).cumsum() - 1
    inner = np.flatnonzero(~lines.begins & ~lines.ends)
    behind = np.searchsorted(lines.window, inner)
    h, h_behind = lines.back[behind - 1, 0], lines.front[behind, 0]
    # the derivative of the parabola through three samples, which a third derivative up to J is off by h h' J / 6
    middle = differences(np.stack([-h, 0.0 * h, h_behind], axis=1), 2)[:, 0] * (h / 2.0)[:, None]
    middle += np.stack([-1.0 / h, 1.0 / h, 0.0 * h], axis=1)
    variables = np.stack([at.back[behind - 1, 0], at.waypoint[inner], at.front[behind, 0]], axis=1)
    variables = variables[..., None] + np.arange(axes)
    free = rows.programme(np.zeros(n), np.zeros(n), _reach(lines, at))
    along, bounds = coordinate
    ends = []
    for line, end in ((behind, legs.begin), (behind - 1, legs.end)):
        speed = np.where(end.rests, 0.0, bounds.speed)
        unit, direction = end.speed[line], along[line]  # what is known, as a unit
        cost = np.zeros(n)
        cost[variables] = -middle[..., None] * (direction / unit[:, None])[:, None]
        programme = free._replace(cost=cost)
        z = multipliers_by_part(programme, window, np.ones(window[-1] + 1), NEAR, ITERATIONS)
        found = -bounds_by_part(programme, z, window)[window[at.waypoint[inner]]] * unit
        found += np.abs(direction) @ way.limit[2] * h * h_behind / 6.0
        speed[line] = np.minimum(speed[line], np.maximum(found, 0.0))
        ends.append(End(speed, end.rests))
    return ends[0], ends[1]


def lines_of(run: Way, sampled: Sampled, chains: Array, moved: Array) -> Lines:
    """The lines of `chains` (P, 2) when corners are looked at alone, in the axes that `moved` (A,)."""
    first, behind = chains.T
    count = behind - first
    chain = np.repeat(np.arange(len(first)), count)
    leg = np.concatenate([np.arange(*ends) for ends in chains])
    node = np.concatenate([np.arange(begin, end + 1) for begin, end in chains])
    window = np.arange(len(leg)) + chain
    way = run.of(node, leg)
    way = way._replace(point=way.point[:, moved], tangent=way.tangent[:, moved], limit=run.limit[:, moved])
    begins, ends = np.zeros(len(node), dtype=bool), np.zeros(len(node), dtype=bool)
    begins[np.append(0, np.cumsum(count + 1)[:-1])] = ends[np.cumsum(count + 1) - 1] = True
    speeds = ((way.tangent, sampled.speed),)
    lines = Lines(window, way, sampled.half, sampled.half, begins, ends, speeds)
    return _timed(lines, np.minimum(sampled.half, NEARBY * sampled.crossed), sampled.crossed, OF_CORNER)


def _timed(lines: Lines, half: FloatArray, crossed: FloatArray, samples: int) -> Lines:
    """Lines with so many samples up to `half`."""
    n = np.arange(1, samples + 1)
    even = np.minimum(FIRST * crossed, half / samples)[:, None]
    time = even * n + (half[:, None] - even * samples) * (n / samples) ** DENSER
    return lines._replace(front=time, back=time)


def layout_of(lines: Lines) -> Layout:
    """The n variables in order: of each chain its first waypoint, then of each line the samples behind its begin, tau, those before
    its end, and the waypoint there."""
    (count, samples), axes = lines.front.shape, lines.way.point.shape[1]
    n = np.arange(samples)
    chain = np.cumsum(lines.begins) - 1
    of_line = chain[lines.window]
    block = (2 * samples + 1) * axes + 1
    begin = (of_line + 1) * axes + np.arange(count) * block
    waypoint = np.empty(len(chain), dtype=int)
    waypoint[lines.window + 1] = begin + block - axes
    waypoint[lines.begins] = begin[lines.begins[lines.window]] - axes
    part = np.empty(int(waypoint[-1]) + axes, dtype=int)
    first = np.append(waypoint[lines.begins], len(part))
    part[:] = np.repeat(np.arange(len(first) - 1), np.diff(first))
    gap = begin + samples * axes
    front, back = begin[:, None] + n * axes, gap[:, None] + 1 + (samples - 1 - n) * axes
    return Layout(waypoint, front, back, gap, part)
