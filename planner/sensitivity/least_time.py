"""A time that no motion within the limits of the axes, the feed and the tolerance falls short of.

A motion passes the waypoints P_k of the path (vertices, and points on arcs and curves) in order, each within its
tolerance e_k at a time t_k, and from t_k to t_{k+1} no faster than F_k and within the tolerance of leg k. Five facts:

**Feed.** For any vectors y_k whose product with a velocity that leg k allows is at most 1,

    T >= sum y_k.(P_{k+1} - P_k) - sum e_k |y_k - y_{k-1}|,

since each term is y_k.(q_{k+1} - q_k) but for what the q_k are off, and that product is the time at least. y_k is the
tangent over the feed; where an axis is slower than the feed, its unit vector over its velocity.

**Corners.** Until t_k the motion is within e of leg k - 1, behind it of leg k. A coordinate with |f| <= e for long enough
has |f'| <= min(sqrt(4 A e), (243/8 e2 J)^(1/3)) at the end (a parabola; Landau's inequality of third order on a half line,
Matorin 1955). So at t_k both components across the legs are small, and so are those along, u.v <= (|cos| n1 + n2)/sin of
the turn: from there to the next corner leg k takes what a straight way takes between ends with these speeds
(straight_time.py), which is longer than at its feed. Where the path turns back by more than 90 degrees the component
along is confined on one side: at most sqrt(4 A e).

**Lines.** Of lines one after the other that take long enough, whatever is between two corners depends on both. Samples of the
motion around their corners are points of a linear programme, whose least time is below every motion's (sampled_lines.py).

**Ends.** From rest, the first legs are taken as one straight way in whatever direction counts most; the last ones too.

**Turning back.** Between a maximum of n.q and the next minimum, for any direction n, n.v is 0 at both and the way is
n.(P_a - P_b) - 2 e at least. Such parts, from one extreme to a later one, stand for all legs between the vertices beside
them where that is more.

What is added belongs to parts of the motion that have no time in common; the best division is found from the start to
the end. A part that turns back may begin within lines or an end, and then only what is known up to there counts: the legs at
their feed, or a shorter end. All limits but those of axes, feed and tolerance are left out, so the bound holds with them too.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.sensitivity.corner_speeds import legs_between
from planner.sensitivity.sampled_lines import chain_times, chains_of, sampled_legs
from planner.sensitivity.straight_time import TINY, Bounds, End, straight_time
from planner.sensitivity.turning_back import Turns, turns_of
from planner.sensitivity.waypoints import Way, way_of

ROUNDING = 2e-6  # by how much limits may be exceeded by a motion that passes [-]
HEADS = 60  # numbers of legs that are tried as one straight way from rest, evenly in their logarithm
RUNS = 1000  # of which ends and turning back are looked at, the longest ones
LONG = 20.0  # tolerances: of lines whose y stays their tangent, for what their corners add
ROUNDS, LARGE, ROUNDS_OF_LARGE = 100, 100_000, 30  # of fitting y, and for more legs than so many
LINEAR = "xyz"


def least_time(toolpath: Toolpath, machine: Machine, not_limited: tuple[str, ...] = ()) -> float | None:
    """A time that no motion falls short of [s], with dwells; None behind filters and for axes beside x, y, z.

    not_limited : of velocity, acceleration and jerk, what the motions need not keep
    """
    if machine.fir is not None or not set(toolpath.axes) <= set(LINEAR):
        return None
    way = way_of(toolpath, machine, not_limited)
    direction, by_axis = way.coordinates()
    bounds, y = way.along(direction, way.feed)
    more = _beside_feed(way, bounds, (direction * np.diff(way.point, axis=0)).sum(axis=1), by_axis)
    stops = np.flatnonzero(way.stop)
    of_run, y, leg = _best_of_runs(way, y, more, stops[:-1])
    chains, gain = _chains(way, y, leg)
    longest = np.argsort(-of_run)[:RUNS]
    for k in longest[np.diff(stops)[longest] > 1]:
        begin, end = stops[k], stops[k + 1]
        run = way.part(begin, end)
        turns = turns_of(run)
        mine = (chains[:, 0] >= begin) & (chains[:, 1] <= end)
        for whole in ((chains[:0], gain[:0]), (chains[mine] - begin, gain[mine])):
            of_run[k] = max(
                of_run[k], _with_turns(run, turns, *_with_ends(run, y[begin:end], leg[begin:end], *whole))
            )
    return float(of_run.sum() * (1.0 - ROUNDING) + toolpath.dwell.sum())


def _best_of_runs(
    way: Way, y: FloatArray, more: FloatArray, runs: Array
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(Q,) what the legs of each run take at least, its y (N, A), and what each leg adds (N,): of tangents, of y that fit
    the tolerance, and of these but on long lines with corners; `runs` (Q,) begin at these legs."""
    fitted, step = _fitted(way, y), np.diff(way.point, axis=0)
    clear = (more > 0.0) & (way.length > LONG * np.maximum(way.tolerance[:-1], way.tolerance[1:]))
    mixed = np.where(clear[:, None], y, fitted)
    of_legs = ((y, more), (fitted, 0.0 * more), (mixed, np.where(clear, more, 0.0)))
    legs = [(one * step).sum(axis=1) + added for one, added in of_legs]
    jumps = [np.append(_jumps(way, one), 0.0) for one, _ in of_legs]
    values = np.array([np.add.reduceat(leg - jump, runs) for leg, jump in zip(legs, jumps, strict=True)])
    which = values.argmax(axis=0)
    of_leg = np.repeat(which, np.diff(np.append(runs, len(step))))
    rows = np.arange(len(step))
    return values.max(axis=0), np.stack([y, fitted, mixed])[of_leg, rows], np.stack(legs)[of_leg, rows]


def _fitted(way: Way, y: FloatArray) -> FloatArray:
    """Vectors y that cost less at corners: nearer to the best ones, whose legs are the shortest way through the
    tolerances, by the method of Chambolle and Pock (2011) with steps as long as each leg allows."""
    most = 1.0 / way.feed
    fixed = np.linalg.norm(y, axis=1) > most * (1.0 + 1e-9)  # where an axis is slower than the feed
    weight = most / np.maximum((way.tolerance[:-1] + way.tolerance[1:]) / 2.0, TINY + 1e-9 * way.length)
    place = ahead = way.point
    y, begun = y.copy(), y
    per_node = 1.0 / (np.append(weight, 0.0) + np.append(0.0, weight))[:, None]
    for _ in range(ROUNDS if len(y) <= LARGE else ROUNDS_OF_LARGE):
        y += 0.5 * weight[:, None] * np.diff(ahead, axis=0)
        y *= np.minimum(most / np.maximum(np.linalg.norm(y, axis=1), TINY), 1.0)[:, None]
        y[fixed] = begun[fixed]
        pull = np.diff(y, axis=0, prepend=0.0, append=0.0)
        off = place + per_node * pull - way.point
        off *= np.minimum(way.tolerance / np.maximum(np.linalg.norm(off, axis=1), TINY), 1.0)[:, None]
        place, ahead = way.point + off, 2.0 * (way.point + off) - place
    return y


def _jumps(way: Way, y: FloatArray) -> FloatArray:
    """(N-1,) what a change of y costs at the inner waypoints [s]; nothing at stops, which are passed exactly."""
    return way.tolerance[1:-1] * np.linalg.norm(np.diff(y, axis=0), axis=1)


def _beside_feed(way: Way, bounds: Bounds, length: FloatArray, by_axis: Array) -> FloatArray:
    """(N,) what each line takes longer than at its feed, because of the corners and stops at its ends [s]; `length` (N,)
    in the coordinate that bounds it, of which the speed at corners is not known where that is an axis."""
    legs = legs_between(way, bounds, length, ~by_axis)
    return np.where(way.line, legs.time - legs.way / bounds.speed, 0.0)


def _chains(way: Way, y: FloatArray, leg: FloatArray) -> tuple[Array, FloatArray]:
    """(P, 2) first line of lines one after the other and the leg behind the last one, and what they take longer than with y
    and what legs add [s], where they do."""
    sampled = sampled_legs(way)
    found = chains_of(way, sampled)
    if not len(found):
        return found, np.zeros(0)
    begin, end = found.T
    jumps = np.concatenate([[0.0], _jumps(way, y), [0.0]])
    sums, jumped = np.append(0.0, np.cumsum(leg)), np.append(0.0, np.cumsum(jumps))
    before = sums[end] - sums[begin] - (jumped[end + 1] - jumped[begin])
    gain = chain_times(way, sampled, found, y) - before
    return found[gain > 0.0], gain[gain > 0.0]


def _with_ends(
    run: Way, y: FloatArray, leg: FloatArray, chains: Array, gain: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """y and what each leg adds, where chains gain so much, and the first legs of a run and the last ones before or behind
    them are taken as one straight way if that is more; and (2, N+1) how much less is known up to a waypoint within what is
    one, and behind it."""
    y, leg, less = y.copy(), leg.copy(), np.zeros((2, len(leg) + 1))
    for (begin, end), more in zip(chains, gain, strict=True):
        leg[begin] += more
        less[0, begin + 1 : end] = more
    count = len(leg)
    # y of the legs beside a chain stay
    head = max(chains[0, 0] - 1, 0) if len(chains) else count
    first, spare = _from_rest(run, y, leg, head)
    less[0, 1:first] = spare
    tail = max(count - chains[-1, 1] - 1, 0) if len(chains) else count - first
    y, leg = -y[::-1], leg[::-1].copy()
    last, spare = _from_rest(run.backwards(), y, leg, tail)
    less[1, count - last + 1 : count] = spare[::-1]
    return -y[::-1], leg[::-1], less


def _from_rest(run: Way, y: FloatArray, leg: FloatArray, most: int) -> tuple[int, FloatArray]:
    """Put the first legs of a run, at most so many, as one straight way into y and `leg`; returns how many, and how much
    less of it is known up to each waypoint within them, by the best shorter way [s]."""
    count = len(leg)
    if most < 1:
        return 0, np.zeros(0)
    m = np.unique(np.geomspace(1, most, HEADS).astype(int))
    way = run.point[m] - run.point[0]
    size = np.linalg.norm(way, axis=1)
    all_of_it, rests = m == count, run.stop[m]
    bounds, heads = run.along(way / np.maximum(size, TINY)[:, None], np.maximum.accumulate(run.feed)[m - 1])
    least = np.maximum(size - run.tolerance[m], 0.0)
    begin = End(np.zeros(len(m)), np.ones(len(m), dtype=bool))
    end = End(np.where(rests, 0.0, bounds.speed), rests)
    longer = straight_time(least, begin, end, bounds) - least / bounds.speed
    after = np.where(all_of_it[:, None], 0.0, y[np.minimum(m, count - 1)])
    jumps = np.append(_jumps(run, y), 0.0)
    gain = (heads * way).sum(axis=1) + longer - run.tolerance[m] * np.linalg.norm(after - heads, axis=1)
    gain -= np.cumsum(leg - jumps)[m - 1]
    best = int(gain.argmax())
    if gain[best] <= 0.0:
        return 0, np.zeros(0)
    first = int(m[best])
    within = run.tolerance[1:first]
    shorter = np.zeros(first)  # at each waypoint, what ends before it are worth
    shorter[m[:best]] = np.maximum(gain[:best], 0.0)
    known = np.maximum.accumulate(shorter)[:-1] + np.cumsum(leg - jumps)[: first - 1] + jumps[: first - 1]
    known -= within * np.linalg.norm(y[: first - 1], axis=1)
    y[:first] = heads[best]
    leg[:first] = (heads[best] * np.diff(run.point[: first + 1], axis=0)).sum(axis=1)
    leg[0] += longer[best]
    return first, np.cumsum(leg)[: first - 1] - within * np.linalg.norm(heads[best]) - known


def _with_turns(run: Way, turns: list[Turns], y: FloatArray, leg: FloatArray, less: FloatArray) -> float:
    """The bound of a run: its legs, or parts that turn back where these take longer.

    Up to waypoint k the legs take total[k], with what y jumps by there. They may end there and a part begin, or begin
    there behind a part; then y ends or begins at 0, and so much less (2, N+1) is known of what is before or behind.
    `gain` is what parts up to where the scan is have been worth.
    """
    size, within = np.linalg.norm(y, axis=1), run.tolerance
    jump = np.concatenate([[0.0], _jumps(run, y), [0.0]])
    total = np.append(0.0, np.cumsum(leg)) - np.cumsum(jump)
    ended = total + jump - within * np.append(0.0, size) - less[0]
    begun = total + within * np.append(size, 0.0) + less[1]
    reached = [np.zeros(len(one.begin)) for one in turns]  # the best up to each extreme
    events = [(int(k), 1, d, n) for d, one in enumerate(turns) for n, k in enumerate(one.begin) if n]
    events += [
        (int(k), 0, d, n) for d, one in enumerate(turns) for n, k in enumerate(one.end) if n and k >= 0
    ]
    gain = 0.0
    for k, begins, d, n in sorted(events):
        if begins:
            entered = ended[k] + gain if turns[d].stands_out[n] else 0.0
            reached[d][n] = max(reached[d][n - 1] + turns[d].time[n - 1], entered)
        else:
            gain = max(gain, reached[d][n] - begun[k])
    return float(total[-1] + gain)
