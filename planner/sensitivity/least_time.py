"""A time that no motion within the limits of the axes, the feed and the tolerance falls short of.

A motion passes the waypoints P_k of the path (vertices, and points on arcs and curves) in order, each within its
tolerance e_k at a time t_k, and from t_k to t_{k+1} no faster than F_k and within the tolerance of leg k. Six facts:

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

**Bends.** To be so far off a chord between two waypoints takes an acceleration, and so a time (bends.py).

**Turning back.** Between a maximum of n.q and the next minimum, for any direction n, n.v is 0 at both and the way is
n.(P_a - P_b) - 2 e at least. Such parts, from one extreme to a later one, stand for all legs between the vertices beside
them where that is more.

What is added belongs to parts of the motion that have no time in common; the best division is found from the start to
the end. Where legs end, and a part begins, e |y| is lost of what they add, and where they begin again. Lines by samples count
where the legs beside them go on, as their programme has y of these. All limits but those of axes, feed and tolerance are left
out, so the bound holds with them too.
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.sensitivity.bends import Chains, best_division, turns_of
from planner.sensitivity.sampled_lines import chain_times, chains_of, sampled_legs
from planner.sensitivity.straight_time import TINY, End, straight_time
from planner.sensitivity.waypoints import Way, legs_between, way_of

ROUNDING = 2e-6  # by how much limits may be exceeded by a motion that passes [-]
HEADS = 60  # numbers of legs that are tried as one straight way from rest, evenly in their logarithm
RUNS = 1000  # of which ends and turning back are looked at, the longest ones
ROUNDS, LARGE, ROUNDS_OF_LARGE = 100, 100_000, 30  # of fitting y, and for more legs than so many
LINEAR = "xyz"


def least_time(toolpath: Toolpath, machine: Machine, not_limited: tuple[str, ...] = ()) -> float | None:
    """A time that no motion falls short of [s], with dwells; None behind filters and for axes beside x, y, z.

    not_limited : of velocity, acceleration and jerk, what the motions need not keep
    """
    if machine.fir is not None or not set(toolpath.axes) <= set(LINEAR) or any(toolpath.speeds):
        return None
    way = way_of(toolpath, machine, not_limited)
    direction, by_axis = way.coordinates()
    bounds, y = way.along(direction, way.feed)
    # what each line takes longer than at its feed, because of the corners and stops at its ends, in the
    # coordinate that bounds it; where that is an axis the speed at corners is not known
    legs = legs_between(way, bounds, (direction * np.diff(way.point, axis=0)).sum(axis=1), ~by_axis)
    more = np.where(way.line, legs.time - legs.way / bounds.speed, 0.0)
    stops = np.flatnonzero(way.stop)
    of_run, y, leg = _best_of_runs(way, y, more, stops[:-1])
    chains = _chains(way, y, leg)
    longest = np.argsort(-of_run)[:RUNS]
    for k in longest[np.diff(stops)[longest] > 1]:
        begin, end = stops[k], stops[k + 1]
        run, mine = way.part(begin, end), (chains.begin >= begin) & (chains.end <= end)
        inside = Chains(chains.begin[mine] - begin, chains.end[mine] - begin, chains.gain[mine])
        of_run[k] = max(of_run[k], _with_parts(run, y[begin:end], leg[begin:end], inside))
    return float(of_run.sum() * (1.0 - ROUNDING) + toolpath.dwell.sum())


def _best_of_runs(
    way: Way, y: FloatArray, more: FloatArray, runs: Array
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(Q,) what the legs of each run take at least, its y (N, A), and what each leg adds (N,): of tangents, of y that fit
    the tolerance, and of these but on lines with corners; `runs` (Q,) begin at these legs."""
    fitted, step = _fitted(way, y), np.diff(way.point, axis=0)
    mixed = np.where((more > 0.0)[:, None], y, fitted)
    of_legs = ((y, more), (fitted, 0.0 * more), (mixed, more))
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


def _chains(way: Way, y: FloatArray, leg: FloatArray) -> Chains:
    """Lines one after the other, and what they take longer than with y and what legs add."""
    sampled = sampled_legs(way)
    found = chains_of(way, sampled)
    begin, end = found.T
    if not len(found):
        return Chains(begin, end, np.zeros(0))
    jumps = np.concatenate([[0.0], _jumps(way, y), [0.0]])
    sums, jumped = np.append(0.0, np.cumsum(leg)), np.append(0.0, np.cumsum(jumps))
    before = sums[end] - sums[begin] - (jumped[end + 1] - jumped[begin])
    return Chains(begin, end, chain_times(way, sampled, found, y) - before)


def _from_rest(run: Way, behind: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N+1,) the least time of a straight way from rest to waypoints; and the same where the legs behind, of y `behind` (N+1, A),
    go on from there with what it has for y, which costs less than to begin anew [s]. -inf where it is not looked at."""
    alone, joined = np.full((2, len(behind)), -np.inf)
    m = np.unique(np.geomspace(1, len(behind) - 1, HEADS).astype(int))
    way, within = run.point[m] - run.point[0], run.tolerance[m]
    size = np.linalg.norm(way, axis=1)
    feed = np.maximum.accumulate(run.feed)[m - 1]
    bounds, y = run.along(way / np.maximum(size, TINY)[:, None], feed)
    begin = End(np.zeros(len(m)), np.ones(len(m), dtype=bool))
    end = End(np.where(run.stop[m], 0.0, bounds.speed), run.stop[m])
    least = np.maximum(size - within, 0.0)
    alone[m] = straight_time(least, begin, end, bounds)
    of_y, of_behind, change = (np.linalg.norm(one, axis=1) for one in (y, behind[m], behind[m] - y))
    joined[m] = alone[m] + (size - least) * of_y + within * (of_behind - change)
    return alone, joined


def _with_parts(run: Way, y: FloatArray, leg: FloatArray, chains: Chains) -> float:
    """The bound of a run: its legs and chains, or parts from and to rest, or that bend or turn back, where these take longer.

    Up to waypoint k the legs take total[k], with what y jumps by there. They may end there and a part begin, or begin
    there behind a part; then y ends or begins at 0.
    """
    within, size = run.tolerance, np.linalg.norm(y, axis=1)
    jump, rest = np.concatenate([[0.0], _jumps(run, y), [0.0]]), 0.0 * y[:1]
    total = np.append(0.0, np.cumsum(leg)) - np.cumsum(jump)
    ended = total + jump - within * np.append(0.0, size)
    from_rest = _from_rest(run, np.vstack([y, rest]))
    to_rest = [one[::-1] for one in _from_rest(run.backwards(), np.vstack([-y[::-1], rest]))]
    known = np.stack([total, ended, within * np.append(size, 0.0), *from_rest, *to_rest])
    return float(best_division(run.point, within, run.limit[1], known, chains, turns_of(run)))
