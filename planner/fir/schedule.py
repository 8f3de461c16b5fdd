"""How fast each leg is commanded, and where the command waits: the plan of a course for given filters.

Two ways to turn at a joint within the tolerance:

* wait:  the gap Td - Tk of eq. 15 between two pulses at full speed. Right for sharp corners between long legs.
* flow:  no gap, but a speed so low that the filters cut the corner by no more than the tolerance. Right for the joints of curves.

Flow joints are judged together, since on short legs many of them lie within one delay. Run through at the constant speed V the
error E and the acceleration a at joint i are, exactly (docs/papers.md A8), the vectors

    E = V sum_j Du_j R(Td/2 - |s_j - s_i| / V),      a = V sum_j Du_j h(Td/2 - |s_j - s_i| / V)

over the joints within V Td/2; on a circle E = V^2 kappa (T1^2 + T2^2)/24, paper 001's error; noise that turns to and fro cancels.
Where there are very many of them E and a come from the mean of the path with the kernel as weight, by a rule with two nodes,

    D = p(s_i + V x) + p(s_i - V x) - 2 p(s_i),      E = w |D|,      a = D / x^2,      x^2 = mu4/mu2,  w = mu2^2 / (2 mu4).

Where the command comes to rest before V x, its way ends there, and D is corrected by what that shifts along the path.
What constant speed leaves out is measured afterwards (audit.py).

A speed that a joint or a slow block asks for holds on V Td/2 of the course to both sides: the mean time the command spends there
puts the motion past the place before a faster command has any effect on it. Long legs are cut for that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.fir.command import Cells
from planner.fir.course import Course
from planner.fir.overlap import overlap_beside, overlap_within, overlap_within_limits
from planner.machine import Machine

# Legs are cut where a speed limit ends on them only if they take longer than this share of Td at their own speed [-].
CUT_LEGS = 0.25
# More joints than this to one side of a flow joint are taken together.
FLOW_JOINTS = 24
# Steps in which the speed of a flow joint is lowered, and what one may leave of it [-].
FLOW_STEPS = 40
FLOW_STEP_MIN = 0.3


@dataclass(frozen=True, eq=False, kw_only=True)
class Schedule:
    """Speeds and overlaps of a course of R legs, for the filters T1, T2 (S,) of its stretches.

    speed   : (R,) largest speed on each leg [mm/s]
    passing : (R+1,) largest speed at a flow joint, inf where there is no such limit [mm/s]
    overlap : (R+1,) Tk [s]: Td at flow joints, less where the command waits, 0 at full stops
    holding : (R,) True for legs whose feed has to hold on V Td/2 beyond their ends too
    """

    T1: FloatArray
    T2: FloatArray
    speed: FloatArray
    passing: FloatArray
    overlap: FloatArray
    holding: Array

    def __post_init__(self) -> None:
        legs = len(self.speed)
        freeze(self, "T1", np.float64, (None,))
        freeze(self, "T2", np.float64, self.T1.shape)
        freeze(self, "speed", np.float64, (legs,))
        freeze(self, "passing", np.float64, (legs + 1,), finite=False)
        freeze(self, "overlap", np.float64, (legs + 1,))
        freeze(self, "holding", np.bool_, (legs,))

    def at_joints(self, course: Course) -> tuple[FloatArray, FloatArray]:
        """T1 and T2 (R+1,) of the stretch that each joint lies in (the last joint: of the last one)."""
        stretch = np.append(course.stretch, course.stretches - 1)
        return self.T1[stretch], self.T2[stretch]

    def gap(self, course: Course) -> FloatArray:
        """(R+1,) standstill of the command at each joint [s]; full stops not counted."""
        T1, T2 = self.at_joints(course)
        return np.where(course.inner, np.maximum(T1 + T2 - self.overlap, 0.0), 0.0)

    def pick(self, course: Course, chosen: Array) -> Schedule:
        """The plan of the stretches `chosen` (S,) of its course."""
        legs = np.flatnonzero(chosen[course.stretch])
        joints = np.append(legs, len(course))
        return Schedule(
            T1=self.T1[chosen],
            T2=self.T2[chosen],
            speed=self.speed[legs],
            passing=self.passing[joints],
            overlap=self.overlap[joints],
            holding=self.holding[legs],
        )

    def put(self, course: Course, chosen: Array, part: Schedule) -> Schedule:
        """This plan with `part` for the stretches `chosen` (S,)."""
        legs = chosen[course.stretch]
        new = {
            name: getattr(self, name).copy()
            for name in ("T1", "T2", "speed", "passing", "overlap", "holding")
        }
        for name in ("T1", "T2"):
            new[name][chosen] = getattr(part, name)
        for name in ("speed", "holding"):
            new[name][legs] = getattr(part, name)
        for name in ("passing", "overlap"):
            new[name][:-1][legs] = getattr(part, name)[:-1]
        return Schedule(**new)


def schedule(
    course: Course, machine: Machine, speed_max: FloatArray, T1: FloatArray, T2: FloatArray
) -> Schedule:
    """Speeds and overlaps for given filters: what isolated corners and even curves need.

    speed_max : (R,) largest speed on each leg [mm/s]
    T1, T2    : (S,) [s]
    """
    a, j = (machine.limits(q, course.lines.axes) for q in ("acceleration", "jerk"))
    filters = np.stack([T1, T2])[:, course.stretch]  # of each leg
    speed = np.minimum(speed_max, filters[0] * np.minimum(course.a_max, filters[1] * course.j_max))
    overlap, passing = np.zeros(len(course) + 1), np.full(len(course) + 1, np.inf)
    inner = np.flatnonzero(course.inner)
    T1_at, T2_at = filters[:, inner]
    overlap[inner] = T1_at + T2_at
    waits, waiting = _waiting(course, machine, speed, inner, T1_at, T2_at)
    tied = np.zeros(len(course) + 1, bool)  # where the command stands still
    tied[course.first], tied[inner[waits]] = True, True
    speed = _apart(course, speed, tied, filters)
    passing[inner[~waits]] = _flowing(
        course, machine, speed, inner[~waits], tied, T1_at[~waits], T2_at[~waits]
    )

    at, delay = inner[waits], filters.sum(axis=0)
    overlap[at] = waiting[waits]
    for side in (-1, 0):  # the leg before, the leg behind
        leg, other = at + side, at + 2 * side + 1
        shorter = overlap_beside(overlap[at], overlap[other], course.length[leg] / speed[leg], delay[leg])
        waiting[waits] = np.minimum(waiting[waits], np.where(tied[other], shorter, np.inf))
    w = course.direction * speed[:, None]
    overlap[at] = overlap_within_limits(waiting[waits], w[at - 1], w[at], T1_at[waits], T2_at[waits], a, j)
    return Schedule(T1=T1, T2=T2, speed=speed, passing=passing, overlap=overlap, holding=course.slower)


def _waiting(
    course: Course, machine: Machine, speed: FloatArray, inner: Array, T1: FloatArray, T2: FloatArray
) -> tuple[Array, FloatArray]:
    """At which of the joints `inner` (n,) waiting costs less time than flowing, and the overlap [s] it then has."""
    before, after = speed[inner - 1], speed[inner]
    lower, delay = np.minimum(before, after), T1 + T2
    tol, sin_half = course.tol[inner], course.sin_half[inner]
    overlap = overlap_within(tol, np.sqrt(before * after), sin_half, T1, T2, machine.dt)
    with np.errstate(divide="ignore"):
        alone = np.minimum(lower, 12 * T1 * tol / (sin_half * (3 * T1**2 + T2**2)))  # eq. 14 at Tk = Td
    share = (course.length[inner - 1] + course.length[inner]) / 2
    slowing = np.minimum(delay * (1 - alone / lower), share * (1 / alone - 1 / lower))
    return delay - overlap < slowing, overlap


def _apart(course: Course, speed: FloatArray, tied: Array, filters: FloatArray) -> FloatArray:
    """Slow down legs between two standstills on which the jerks of speeding up and slowing down would meet.

    They do for |Tv - T1| < T2 (docs/papers.md, short segments), and then add up to twice V/(T1 T2).
    """
    T1, T2 = filters
    twice = 2 * speed > course.j_max * T1 * T2
    meet = twice & tied[:-1] & tied[1:] & (np.abs(course.length / speed - T1) < T2)
    slower = np.maximum(course.length / (T1 + T2), speed / 2)
    return np.where(meet, np.minimum(speed, slower), speed)


def _flowing(
    course: Course,
    machine: Machine,
    speed: FloatArray,
    joint: Array,
    tied: Array,
    T1: FloatArray,
    T2: FloatArray,
) -> FloatArray:
    """Largest speeds (n,) at the flow joints `joint` [mm/s]: the rule of the module's text."""
    return _flow_speeds(
        joint,
        np.flatnonzero(tied),
        course.s,
        course.point,
        course.direction,
        np.maximum(speed[joint - 1], speed[joint]),
        course.tol[joint]
        / (1 + 3 * machine.dt**2 / (T1**2 + T2**2)),  # the rest is the chord error of samples
        machine.limits("acceleration", course.lines.axes),
        machine.normal_acceleration or np.inf,
        T1,
        T2,
    )


def cells_of(course: Course, plan: Schedule) -> Cells:
    """The legs with their speeds, cut where a slower place reaches into a leg."""
    T1, T2 = plan.at_joints(course)
    delay = T1 + T2
    low, high = course.s[course.first[:-1]], course.s[course.first[1:]]
    stretch = np.append(course.stretch, course.stretches - 1)

    slow = np.flatnonzero(plan.passing < np.inf)
    legs = np.flatnonzero(plan.holding)
    value = np.concatenate([plan.passing[slow], course.feed[legs]])
    where = np.concatenate([stretch[slow], stretch[legs]])
    reach = value * delay[np.concatenate([slow, legs])] / 2
    begin = np.maximum(np.concatenate([course.s[slow], course.s[legs]]) - reach, low[where])
    end = np.minimum(np.concatenate([course.s[slow], course.s[legs + 1]]) + reach, high[where])

    cuts = np.concatenate([begin, end])
    leg = np.clip(np.searchsorted(course.s, cuts, side="right") - 1, 0, len(course) - 1)
    worth = course.length[leg] > CUT_LEGS * delay[leg] * plan.speed[leg]
    edge = np.unique(np.concatenate([course.s, cuts[worth]]))
    first = np.searchsorted(edge, begin, side="right") - 1
    last = np.searchsorted(edge, end, side="left")
    leg = np.searchsorted(course.s, edge[:-1], side="right") - 1
    speed = plan.speed[leg].copy()
    lower_between(np.argsort(value), value, first, last, speed)

    keep = np.insert(
        (np.diff(leg) > 0) | (np.diff(speed) != 0), 0, True
    )  # neighbours of one speed are one cell
    at = np.append(edge[:-1][keep], edge[-1])
    return Cells(leg=leg[keep], length=np.diff(at), speed=speed[keep])


def plan_time(course: Course, plan: Schedule) -> FloatArray:
    """How long each stretch takes (S,) [s], dwells not counted."""
    cells = cells_of(course, plan)
    running = np.bincount(cells.leg, cells.length / cells.speed, len(course))
    return course.total(running + plan.gap(course)[1:]) + plan.T1 + plan.T2


@njit(cache=True, error_model="numpy")
def lower_between(order, value, first, last, speed):
    """speed[n] = min(speed[n], value[b]) for all cells first[b] <= n < last[b]; every cell is visited once, the lowest value first."""
    onward = np.arange(len(speed) + 1)  # the next cell that is not yet painted, or a step towards it
    for b in order:
        n = first[b]
        while True:
            root = n
            while onward[root] != root:
                root = onward[root]
            while onward[n] != root:
                onward[n], n = root, onward[n]
            n = root
            if n >= last[b]:
                break
            speed[n] = min(speed[n], value[b])
            onward[n] = n + 1


@njit(cache=True, error_model="numpy")
def _flow_speeds(joint, tied, s, point, direction, speed, tol, a_max, n_max, T1, T2):
    """Largest speeds at the joints [mm/s], inf where `speed` (n,) is not too fast."""
    out = np.empty(len(joint))
    k = 0
    for n in range(len(joint)):
        while tied[k + 1] < joint[n]:
            k += 1
        V = speed[n]
        for _ in range(FLOW_STEPS):
            over = _over(
                joint[n], tied[k], tied[k + 1], V, s, point, direction, tol[n], a_max, n_max, T1[n], T2[n]
            )
            if over <= 1.0:
                break
            V *= max(FLOW_STEP_MIN, 0.99 / np.sqrt(over))
        out[n] = V if speed[n] > V else np.inf
    return out


@njit(cache=True, error_model="numpy")
def _over(i, low, high, V, s, point, direction, tol, a_max, n_max, T1, T2):
    """Error and acceleration at joint i, run through at V, over what is allowed; the larger ratio."""
    first, last, reach = i, i, V * (T1 + T2) / 2.0
    while first - 1 > low and s[i] - s[first - 1] < reach and i - first < FLOW_JOINTS:
        first -= 1
    while last + 1 < high and s[last + 1] - s[i] < reach and last - i < FLOW_JOINTS:
        last += 1
    if i - first == FLOW_JOINTS or last - i == FLOW_JOINTS:
        return _over_dense(i, low, high, V, s, point, direction, tol, a_max, n_max, T1, T2)
    error_sq, bend_sq, over = 0.0, 0.0, 0.0
    for c in range(direction.shape[1]):
        error, acceleration = 0.0, 0.0
        for j in range(first, last + 1):
            x = (T1 + T2) / 2.0 - abs(s[j] - s[i]) / V
            turn = V * (direction[j, c] - direction[j - 1, c])
            if x <= T2:
                h, ramp = x / (T1 * T2), x * x * x / (6.0 * T1 * T2)
            else:
                h, ramp = 1.0 / T1, (3.0 * x * x - 3.0 * T2 * x + T2 * T2) / (6.0 * T1)
            error += turn * ramp
            acceleration += turn * h
        error_sq += error * error
        bend_sq += acceleration * acceleration
        over = max(over, abs(acceleration) / a_max[c])
    return max(over, np.sqrt(error_sq) / tol, np.sqrt(bend_sq) / n_max)


@njit(cache=True, error_model="numpy")
def _over_dense(i, low, high, V, s, point, direction, tol, a_max, n_max, T1, T2):
    """The same by two nodes, -+V x with weights w, that have the kernel's second and fourth moment."""
    second, fourth = (T1 * T1 + T2 * T2) / 12.0, (T1**4 + T2**4) / 80.0 + T1 * T1 * T2 * T2 / 24.0
    x, weight = np.sqrt(fourth / second), second * second / (2.0 * fourth)
    a, b = last_not_after(s, s[i] - V * x, low, i - 1), last_not_after(s, s[i] + V * x, i, high - 1)
    sa, sb = max(s[i] - V * x, s[low]), min(s[i] + V * x, s[high])
    error_sq, over = 0.0, 0.0
    for c in range(point.shape[1]):
        D = point[a, c] + (sa - s[a]) * direction[a, c] + point[b, c] + (sb - s[b]) * direction[b, c]
        along = (direction[i - 1, c] + direction[i, c]) / 2.0
        D -= 2.0 * point[i, c] + along * (sa + sb - 2.0 * s[i])
        error_sq += D * D
        over = max(over, abs(D) / (x * x * a_max[c]))
    return max(over, weight * np.sqrt(error_sq) / tol, np.sqrt(error_sq) / (x * x * n_max))
