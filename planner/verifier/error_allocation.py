"""The papers' check at every programmed corner: eq. (18)-(20) of paper 002 on the motion's curvature.

At the motion's point nearest to the vertex, in the program's order (matching.py knows when), let v be the
speed, t = v/|v|, a_n the part of the acceleration a across t, n = a_n/|a_n|, kappa = |a_n| / v^2 the motion's
own curvature, all over the linear axes.

**Eq. (19), the speed.** A corner may be passed at sqrt(A/kappa). With A(n) the most that is left along n,

    A(n) = min( sum_k |n_k| a_k,  A_max ),       a_k the axes' acceleration limits, A_max the machine's normal acceleration,

    feed / sqrt(A(n)/kappa) = sqrt( |a_n| / A(n) ) <= 1.

Proof: n is a unit vector along a_n, so |a_n| = a_n.n = a.n (t.n = 0) = sum_k a_k(t) n_k <= sum_k a_k |n_k|
for every acceleration within the axes' limits; and |a_n| <= A_max is the other limit itself. It holds for every
method, corner, path and direction t, so that errors of the velocity cannot break it, and it is attained where every axis
gives all it has.

**Eq. (18), the budget.** Let the motion pass the vertex at the distance d from it. What drives are given are
samples: over a period dt the chord bows from the motion by c a, c <= dt^2/8, wherever the samples fall (to second
order in dt, as in the paper), and a cubic, where the machine runs these, by a quarter of that (filtered.py). Hence the
chord passes the vertex V at no more than

    max( |p - V|, |p + a dt^2/8 - V| )  <=  eps         at any one time t; <= miss + kappa feed^2 dt^2/8 at the nearest point

and the budget is kept for all phases of the samples. This is the sum of the paper where both errors point the same way, as
at the apex of its corner. It is looked at where the motion is nearest to V, and where that is not enough within a period of
that. Where there are samples alone, the distance of the vertex from their chords has both errors in it. Both are judged:
this, and the chords that were delivered. What filters behind the drives add is not in here.

**Eq. (20), the gain.** The paper's own corner, the polynomial Bezier pair between straight legs that are long
enough, has kappa = (2/3) tan^2(theta/2) / eps_ap, and with c = dt^2/8 + sum_i T_i^2/24 (filters of lengths
T_i) its budget is used up best by

    X = min(A, eps / (2c)),     eps_ap = eps - c X,     v20 = sqrt(1.5 X eps_ap) / tan(theta/2)

(X (eps - c X) is a parabola with its top at eps/(2c)), A taken along the bisector u2 - u1. feed / v20 is what
the motion gains over it. It is no bound: other shapes within eps may be faster, and dense programs need not
turn at each of their corners.
"""

from functools import partial, reduce
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import LINEAR_AXES, Machine
from planner.motion.trajectory import AnyMotion, Trajectory
from planner.verifier.corners import CornerCheck
from planner.verifier.excess import Excess, Fault, Kind, first_of, of_place, placed
from planner.verifier.filtered import bow_share
from planner.verifier.limits import ACCELERATION, FEED_AT_REST, normal_limit
from planner.verifier.matching import NEAR_MISS
from planner.verifier.pieces import ProgramPieces
from planner.verifier.stream import Observed
from planner.verifier.worst import ROUNDING_ULPS, Limits

# Steps of Newton's method to the motion's nearest point, from at most a period away.
NEAREST_STEPS = 3
# Times within a period of it at which eq. (18) is looked at, and then around the best of them, so many times.
TIMES, CLOSER = 17, 4
AT_ONCE = SIZES.corners_at_once


class _Reading(NamedTuple):
    """The motion near C vertices: time [s], speed [mm/s], |a_n|, A(n) [mm/s2], distance [mm]."""

    time: FloatArray
    feed: FloatArray
    normal: FloatArray
    allowed: FloatArray
    distance: FloatArray

    @property
    def speed_ratio(self) -> FloatArray:
        return np.sqrt(self.normal / self.allowed)


def check_corners(
    trajectory: Trajectory,
    readings: list[Observed],
    pieces: ProgramPieces,
    toolpath: Toolpath,
    machine: Machine,
    *,
    motion: AnyMotion | None,
    limits: Limits,
    judged: bool,
) -> CornerCheck:
    """Hold the motion against eq. (18)-(20) at every corner of the program.

    motion : what the samples were taken from; None to look at the samples alone
    limits : what accelerations that were derived from positions can be off by
    judged : False if the limit of acceleration is reported only

    A corner is not looked at where the motion misses it by so much that its place on the path is not known
    (`NEAR_MISS`; then `order` or `vertex` says so), and where there are samples alone so far apart that the
    axes could bow by more than eps between them.
    """
    corner = np.flatnonzero(toolpath.joint == Joint.CORNER)
    at = np.flatnonzero(pieces.joint["real"])[corner]
    vertex, eps = pieces.vertex[at], pieces.joint["budget"][at]
    near = [each.match.passed[at] for each in readings]
    miss = near[0]["near"]
    parts = [slice(first, first + AT_ONCE) for first in range(0, max(len(corner), 1), AT_ONCE)]
    found = [_nearest_sample(trajectory, near[0]["near_time"][n], vertex[n], machine, limits) for n in parts]
    reading, period = _joined([one[0] for one in found]), np.concatenate([one[1] for one in found])
    chord, budget_ratio, speed_ratio = np.zeros(len(corner)), miss / eps, reading.speed_ratio
    delivered = speed_ratio, budget_ratio
    looked = miss <= NEAR_MISS * eps
    if motion is None or not len(corner):
        most = float(np.linalg.norm(machine.limits("acceleration", toolpath.axes)))
        looked &= most * period**2 / 8.0 <= eps  # the farthest that the axes can leave the chord of a period
    else:
        looked &= near[1]["near"] <= NEAR_MISS * eps
        when = near[1]["near_time"]
        reading = _joined([_nearest_point(motion, when[n], trajectory.dt, vertex[n], machine) for n in parts])
        speed_ratio = np.maximum(speed_ratio, reading.speed_ratio)
        miss, chord = reading.distance, bow_share(machine) * reading.normal * trajectory.dt**2
        together = miss + chord
        over = np.flatnonzero(together > eps)
        bow = bow_share(machine) * trajectory.dt**2
        together[over] = _least_miss(motion, reading.time[over], trajectory.dt, vertex[over], bow)
        budget_ratio = np.maximum(budget_ratio, together / eps)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = np.where(reading.normal > 0, reading.feed * np.sqrt(reading.allowed / reading.normal), np.inf)
    seen = {
        "time": reading.time,
        "feed_planned": reading.feed,
        "feed_closed_form": own,
        "speed_ratio": speed_ratio,
    }
    seen |= {"miss": miss, "chord_error": chord, "budget_ratio": budget_ratio}
    seen |= {"delivered_speed": delivered[0], "delivered_budget": delivered[1]}
    return CornerCheck(
        line=toolpath.line[corner - 1],
        position=vertex,
        theta=toolpath.theta[corner],
        budget=eps,
        feed_paper=_paper_speed(toolpath, corner, machine),
        feed_programmed=np.minimum(toolpath.feed[corner - 1], toolpath.feed[corner]),
        judged=judged,
        **{name: np.where(looked, values, np.nan) for name, values in seen.items()},
    )


def faults(check: CornerCheck, axes: tuple[str, ...]) -> list[Fault]:
    """Corners that are passed too fast, and corners whose budget is overdrawn."""
    found: list[Fault] = []
    for kind, broken, ratio, *_ in _kinds(check):
        worst = np.flatnonzero(broken)[np.argsort(-ratio[broken], kind="stable")]
        found += first_of(worst, partial(_fault, check, ratio, kind, axes), "corners")
    return found


def excesses(check: CornerCheck) -> list[Excess]:
    """Both, as data. A slower motion has less of a chord error, and misses the vertex by as much."""
    return [
        of_place(kind, float(check.time[k]), float(ratio[k]), power, float(still[k]))
        for kind, broken, ratio, power, still in _kinds(check)
        for k in np.flatnonzero(broken)
    ]


def _kinds(check: CornerCheck) -> tuple[tuple[Kind, Array, FloatArray, int, FloatArray], ...]:
    """Eq. (19) and (18): where they are broken and ratios, by which power of a slower pace these get less, and their part
    that does not; (C,) each."""
    return (
        (Kind.CORNER_SPEED, check.too_fast & check.judged, check.speed_ratio, 1, np.zeros(len(check))),
        (Kind.CORNER_BUDGET, check.overdrawn, check.budget_ratio, 2, check.miss / check.budget),
    )


def _fault(check: CornerCheck, ratios: FloatArray, kind: Kind, axes: tuple[str, ...], k: int) -> Fault:
    line, time, ratio = int(check.line[k]), float(check.time[k]), float(ratios[k])
    if kind is Kind.CORNER_SPEED:
        said = f"passed at {check.feed_planned[k]:.6g} mm/s, {ratio:.7g} of what the axes' acceleration leaves a motion of "
        said += "its curvature"
    else:
        budget = check.budget[k]
        said = f"missed by {ratio * budget:.7g} mm with the chord error, {ratio:.7g} of the budget {budget:.6g} mm"
    found = f"{said}, at the end of line {line}, {placed(axes, check.position[k])}, t = {time:.6g} s"
    return Fault(kind, kind.value, found, ratio=ratio, time=time, line=line)


def _nearest_sample(
    trajectory: Trajectory, near_time: FloatArray, vertex: FloatArray, machine: Machine, limits: Limits
) -> tuple[_Reading, FloatArray]:
    """The nearer sample at each vertex' nearest chord, which ends at near_time; the period there [s].

    Accelerations derived from the positions are means of the motion's, which keep its limits. What the
    positions' rounding r makes of them over the period h, at most 4 r / h^2, is taken off.
    """
    after = np.clip(trajectory.first_not_before(near_time), 1, max(len(trajectory) - 1, 1))
    after = np.minimum(after, len(trajectory) - 1)  # a single sample is both
    before = np.maximum(after - 1, 0)
    rows = np.unique(np.concatenate([before, after]))
    near = trajectory.rows(rows)
    before, after = np.searchsorted(rows, before), np.searchsorted(rows, after)
    distance = [np.linalg.norm(near.position[k] - vertex, axis=1) for k in (before, after)]
    k = np.where(distance[0] < distance[1], before, after)
    there, period = _read(near, k, np.minimum(*distance), machine), near.t[after] - near.t[before]
    if not limits.judged[ACCELERATION]:
        ulp = ROUNDING_ULPS * 2.0**-52 * np.abs(near.position[k]).max(axis=1, initial=0.0)
        rounding = np.linalg.norm(limits.rounding) + ulp + limits.time_rounding * there.feed
        there = there._replace(normal=np.maximum(there.normal - 4.0 * rounding / period**2, 0.0))
    return there, period


def _nearest_point(
    motion: AnyMotion, start: FloatArray, period: float, vertex: FloatArray, machine: Machine
) -> _Reading:
    """The motion's nearest point to each vertex, within a period of `start` [s]: Newton on (p - P).p' = 0."""
    time, readings = start, []
    for _ in range(NEAREST_STEPS + 1):
        unique, row = np.unique(np.clip(time, 0.0, motion.end), return_inverse=True)
        there = motion.at(unique, period)
        off, velocity = there.position[row] - vertex, there.velocity[row]
        readings.append(_read(there, row, np.linalg.norm(off, axis=1), machine))
        slope = (velocity**2).sum(axis=1) + (off * there.acceleration[row]).sum(axis=1)
        change = np.divide((off * velocity).sum(axis=1), slope, out=np.zeros_like(time), where=slope > 0)
        time = np.clip(time - change, start - period, start + period)
    return reduce(_nearer, readings)


def _least_miss(
    motion: AnyMotion, nearest: FloatArray, period: float, vertex: FloatArray, bow: float
) -> FloatArray:
    """(C,) the least distance [mm] at which chords pass the vertices (C, A) near the times `nearest` (C,) [s] of the motion's
    nearest points, up to a period away; bow: dt^2/8 [s2]."""
    if not len(nearest):
        return nearest
    least: FloatArray = np.full(len(nearest), np.inf)
    for width in period * (2.0 / (TIMES - 1)) ** np.arange(1 + CLOSER):
        times = nearest[:, None] + width * np.linspace(-1.0, 1.0, TIMES)
        unique, row = np.unique(np.clip(times.ravel(), 0.0, motion.end), return_inverse=True)
        there = motion.at(unique, period)
        off = there.position[row].reshape(*times.shape, -1) - vertex[:, None]
        chord = off + bow * there.acceleration[row].reshape(off.shape)
        apart = np.maximum(*(np.linalg.norm(way, axis=-1) for way in (off, chord)))
        best = apart.argmin(axis=1)[:, None]
        nearest = np.take_along_axis(times, best, 1)[:, 0]
        least = np.minimum(least, np.take_along_axis(apart, best, 1)[:, 0])
    return least


def _joined(readings: list[_Reading]) -> _Reading:
    return _Reading(*map(np.concatenate, zip(*readings, strict=True)))


def _nearer(a: _Reading, b: _Reading) -> _Reading:
    return _Reading(*(np.where(a.distance < b.distance, *both) for both in zip(a, b, strict=True)))


def _read(motion: Trajectory, rows: Array, distance: FloatArray, machine: Machine) -> _Reading:
    """The motion at its samples `rows` (C,)."""
    linear = _linear(motion.axes)
    velocity, acceleration = motion.velocity[rows][:, linear], motion.acceleration[rows][:, linear]
    feed = np.linalg.norm(velocity, axis=1)
    moves = feed > FEED_AT_REST
    tangent = np.divide(velocity, feed[:, None], out=np.zeros_like(velocity), where=moves[:, None])
    across = acceleration - (acceleration * tangent).sum(axis=1)[:, None] * tangent
    normal = np.where(moves, np.linalg.norm(across, axis=1), 0.0)
    allowed = allowed_across(across, motion.axes, machine)
    return _Reading(time=motion.t[rows], feed=feed, normal=normal, allowed=allowed, distance=distance)


def allowed_across(direction: FloatArray, axes: tuple[str, ...], machine: Machine) -> FloatArray:
    """(C,) A(n) [mm/s2] for vectors `direction` (C, L) along n; where that is 0, the least of all n."""
    limits = machine.limits("acceleration", axes)[_linear(axes)]
    size = np.linalg.norm(direction, axis=1)
    given = np.abs(direction) @ limits
    support = np.divide(given, size, out=np.full(len(size), limits.min()), where=size > 0)
    return np.minimum(support, normal_limit(machine))


def _paper_speed(toolpath: Toolpath, corner: Array, machine: Machine) -> FloatArray:
    """Eq. (20)'s speed of the paper's corner at the joints `corner` (C,) [mm/s]."""
    linear = _linear(toolpath.axes)
    across = (toolpath.tangent_start[corner] - toolpath.tangent_end[corner - 1])[:, linear]
    eps, filters = toolpath.tolerance[corner], machine.fir.time_constants if machine.fir else ()
    rate = bow_share(machine) * machine.dt**2 + sum(T * T for T in filters) / 24.0
    X = np.minimum(allowed_across(across, toolpath.axes, machine), eps / (2.0 * rate))
    speed: FloatArray = np.sqrt(1.5 * X * (eps - rate * X)) / np.tan(toolpath.theta[corner] / 2.0)
    return speed


def _linear(axes: tuple[str, ...]) -> Array:
    return np.array([letter in LINEAR_AXES for letter in axes])
