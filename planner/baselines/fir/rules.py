"""Paper 000's first schedule for given filters: how fast each leg is commanded, and where the command waits.

Two ways to turn at a joint within the tolerance:

* wait:  the gap Td - Tk of eq. 15 between two pulses at full speed. Right for sharp corners between long legs.
* flow:  no gap, but a speed so low that the filters cut the corner by no more than the tolerance. Right for the joints of curves.

Flow joints are judged together, since on short legs many of them lie within one delay. Run through at the
constant speed V the error E and the acceleration a at joint i are, exactly (docs/papers.md A8), the vectors

    E = V sum_j Du_j R(Td/2 - |s_j - s_i| / V),      a = V sum_j Du_j h(Td/2 - |s_j - s_i| / V)

over the joints within V Td/2; on a circle E = V^2 kappa (T1^2 + T2^2)/24, paper 001's error; noise that turns
to and fro cancels. Where there are very many of them E and a come from the mean of the path with the kernel
as weight, by a rule with two nodes,

    D = p(s_i + V x) + p(s_i - V x) - 2 p(s_i),      E = w |D|,      a = D / x^2,      x^2 = mu4/mu2,  w = mu2^2 / (2 mu4).

Where the command comes to rest before V x, the path ends there, and D is corrected by what that shifts along
the path. What constant speed leaves out is measured afterwards (measure.py).

A speed that a joint or a slow block asks for holds on V Td/2 of the guide to both sides: the mean time the
command spends there puts the motion past the joint or block before a faster command has any effect on it.
Long legs are cut for that.

Where the command waits (paper 000, eq. 10-15, as corrected in docs/papers.md A.14), pulse 2 starts the gap g
= Td - Tk after pulse 1 has ended; Tk is the overlap time, 0 for a full stop and Td without any gap. With tau
= time since the start of pulse 2, w1 = V1 u1, w2 = V2 u2 and the ramp response R,

    p - P = -R(Tk - tau) w1 + R(tau) w2,     0 <= tau <= Tk.

For V1 = V2 = V the vertex P is missed by (s = sin(theta/2), theta the turning angle)

    eps = 2 V s R(Tk/2) = Tk^3 V s / (24 T1 T2)                         Tk <= 2 T2                     (eq. 14)
                          (4 T2^2 - 6 T2 Tk + 3 Tk^2) V s / (12 T1)     beyond

and eq. 15 is its inverse. For V1 != V2 the same with V = sqrt(V1 V2) is never too small: the exact value in
the cubic zone is V1 V2/(V1^(1/3) + V2^(1/3))^3 <= sqrt(V1 V2)/8, with equality at V1 = V2 only; min(V1, V2)
would be too small.

Neighbours on a leg that is run through in Tv do not disturb each other's error if Tk_i + Tk_{i+1} <= Tv + Td.
Peaks of the axes within an isolated corner (Tv >= Td), with eta = (Tk - T2)/T2 clipped to [0, 1]:

    acceleration  max(|w1 - eta w2|, |w2 - eta w1|) / T1
    jerk          max(|w1|, |w2|;  |w1 + w2| if 0 < Tk < 2 T2;  |w2 - w1| if Tk > T1) / (T1 T2)
"""

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.search import last_not_after
from planner.baselines.fir.guide import LegGuide
from planner.baselines.fir.schedule import Schedule
from planner.corners.budget import largest_normal
from planner.corners.fir import overlap_time
from planner.machine import Machine

# Pulses that were made to reach their limits exactly may exceed them by rounding [-].
LIMIT_ROUNDING = 1e-9


def corner_error(
    overlap: FloatArray, V: FloatArray, sin_half: FloatArray, T1: FloatArray, T2: FloatArray
) -> FloatArray:
    """(n,) by how much the vertex is missed [mm] (eq. 14).

    overlap     : (n,) Tk [s], 0 <= Tk <= Td
    V, sin_half : (n,) speed of the pulses, the geometric mean of two [mm/s]; sine of half the turning angle [-]
    T1, T2      : (n,) filters [s]
    """
    cubic = overlap**3 / (24 * T1 * T2)
    square = (4 * T2**2 - 6 * T2 * overlap + 3 * overlap**2) / (12 * T1)
    return np.where(overlap <= 2 * T2, cubic, square) * V * sin_half


def overlap_within(
    tol: FloatArray, V: FloatArray, sin_half: FloatArray, T1: FloatArray, T2: FloatArray, dt: float
) -> FloatArray:
    """(n,) overlap Tk [s] whose corner error and chord error at dt [s] are within `tol` (n,) [mm].

    At the middle the acceleration is 2 V h(Tk/2) s, the chord over a period leaves the motion by dt^2/8 of
    it: reckoned with the longer overlap that the whole tolerance would allow, and half the tolerance at most.

    V, sin_half, T1, T2 : (n,) as of `corner_error`
    """
    whole = overlap_time(tol, V, sin_half, T1, T2)
    bend = 2 * V * sin_half * np.minimum(whole / 2 / T2, 1.0) / T1
    return overlap_time(np.maximum(tol - bend * dt**2 / 8, tol / 2), V, sin_half, T1, T2)


def overlap_beside(
    overlap: FloatArray, neighbour: FloatArray, duration: FloatArray, delay: FloatArray
) -> FloatArray:
    """(n,) the overlap shortened until Tk_i + Tk_{i+1} <= Tv + Td [s], both ends alike if they need it.

    overlap, neighbour : (n,) Tk at this end of the leg and at the other [s]
    duration, delay    : (n,) Tv of the leg and Td of the filters [s]
    """
    room = duration + delay
    return np.minimum(overlap, np.maximum(room / 2, room - neighbour))


def overlap_within_limits(
    overlap: FloatArray,
    w1: FloatArray,
    w2: FloatArray,
    T1: FloatArray,
    T2: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> FloatArray:
    """The longest overlap (n,), at most `overlap`, at which an isolated corner keeps the axes' limits.

    w1, w2             : (n, A) velocities of the pulses [mm/s], each within the limits by itself
    T1, T2             : (n,) filters [s]
    acceleration, jerk : (A,) limits of the axes [mm/s2], [mm/s3]
    """
    delay = T1 + T2
    a_room = acceleration * T1[:, None] * (1 + LIMIT_ROUNDING)
    j_room = jerk * (T1 * T2)[:, None] * (1 + LIMIT_ROUNDING)
    eta = np.ones(len(overlap))  # the largest that is allowed
    for one, other in ((w1, w2), (w2, w1)):
        free = a_room - np.abs(one)
        room = np.divide(free, np.abs(other), out=np.ones_like(one), where=one * other < 0)
        eta = np.minimum(eta, np.clip(room.min(axis=1), 0.0, 1.0))
    overlap = np.where(eta < 1, np.minimum(overlap, T2 * (1 + eta)), overlap)
    apart = (np.abs(w2 - w1) > j_room).any(axis=1)
    overlap = np.where(apart, np.minimum(overlap, T1), overlap)
    along = (np.abs(w1 + w2) > j_room).any(axis=1)
    partial = (overlap < 2 * T2) & (overlap < delay)
    return np.where(along & partial, 0.0, overlap)


# More joints than this to one side of a flow joint are taken together.
FLOW_JOINTS = 24
# Steps in which the speed of a flow joint is lowered, and what one may leave of it [-].
FLOW_STEPS = 40
FLOW_STEP_MIN = 0.3


def schedule(
    guide: LegGuide, machine: Machine, speed_max: FloatArray, T1: FloatArray, T2: FloatArray
) -> Schedule:
    """Speeds and overlaps for given filters: what isolated corners and even curves need.

    speed_max : (R,) largest speed on each leg [mm/s]
    T1, T2    : (S,) filters of each run [s]
    """
    a, j = (machine.limits(q, guide.lines.axes) for q in ("acceleration", "jerk"))
    filters = np.stack([T1, T2])[:, guide.run]  # of each leg
    speed = np.minimum(speed_max, filters[0] * np.minimum(guide.a_max, filters[1] * guide.j_max))
    overlap, passing = np.zeros(len(guide) + 1), np.full(len(guide) + 1, np.inf)
    inner = np.flatnonzero(guide.inner)
    T1_at, T2_at = filters[:, inner]
    overlap[inner] = T1_at + T2_at
    waits, waiting = _waiting(guide, machine, speed, inner, T1_at, T2_at)
    tied = np.zeros(len(guide) + 1, bool)  # where the command stands still
    tied[guide.first], tied[inner[waits]] = True, True
    speed = _apart(guide, speed, tied, filters)
    flow, T1_flow, T2_flow = inner[~waits], T1_at[~waits], T2_at[~waits]
    tol = guide.tol[flow] / (
        1 + 3 * machine.dt**2 / (T1_flow**2 + T2_flow**2)
    )  # the rest is the chord error of samples
    fastest, allowed = np.maximum(speed[flow - 1], speed[flow]), (tol, a, largest_normal(machine))
    passing[flow] = _flow_speeds(flow, np.flatnonzero(tied), fastest, guide.line, allowed, T1_flow, T2_flow)

    at, delay = inner[waits], filters.sum(axis=0)
    overlap[at] = waiting[waits]
    for side in (-1, 0):  # the leg before, the leg behind
        leg, other = at + side, at + 2 * side + 1
        shorter = overlap_beside(overlap[at], overlap[other], guide.length[leg] / speed[leg], delay[leg])
        waiting[waits] = np.minimum(waiting[waits], np.where(tied[other], shorter, np.inf))
    w = guide.direction * speed[:, None]
    overlap[at] = overlap_within_limits(waiting[waits], w[at - 1], w[at], T1_at[waits], T2_at[waits], a, j)
    return Schedule(
        guide=guide, T1=T1, T2=T2, speed=speed, passing=passing, overlap=overlap, holding=guide.slower
    )


def _waiting(
    guide: LegGuide, machine: Machine, speed: FloatArray, inner: Array, T1: FloatArray, T2: FloatArray
) -> tuple[Array, FloatArray]:
    """At which of the joints `inner` (n,) waiting costs less time than flowing, and the overlap [s]."""
    before, after = speed[inner - 1], speed[inner]
    lower, delay = np.minimum(before, after), T1 + T2
    tol, sin_half = guide.tol[inner], guide.sin_half[inner]
    overlap = overlap_within(tol, np.sqrt(before * after), sin_half, T1, T2, machine.dt)
    with np.errstate(divide="ignore"):
        alone = np.minimum(lower, 12 * T1 * tol / (sin_half * (3 * T1**2 + T2**2)))  # eq. 14 at Tk = Td
    mean_length = (guide.length[inner - 1] + guide.length[inner]) / 2
    slowing = np.minimum(delay * (1 - alone / lower), mean_length * (1 / alone - 1 / lower))
    return delay - overlap < slowing, overlap


def _apart(guide: LegGuide, speed: FloatArray, tied: Array, filters: FloatArray) -> FloatArray:
    """Slow down legs between two standstills on which the jerks of speeding up and slowing down would meet.

    They do for |Tv - T1| < T2 (docs/papers.md, short segments), and then add up to twice V/(T1 T2).
    """
    T1, T2 = filters
    twice = 2 * speed > guide.j_max * T1 * T2
    meet = twice & tied[:-1] & tied[1:] & (np.abs(guide.length / speed - T1) < T2)
    slower = np.maximum(guide.length / (T1 + T2), speed / 2)
    return np.where(meet, np.minimum(speed, slower), speed)


@njit(cache=True, error_model="numpy")
def _flow_speeds(joint, tied, speed, line, allowed, T1, T2):
    """Largest speeds at the flow joints (n,) [mm/s] by the rule of the module's text, inf where `speed` (n,) is
    slow enough."""
    out, k = np.empty(len(joint)), 0
    error_max, a_max, normal_max = allowed
    for n in range(len(joint)):
        while tied[k + 1] < joint[n]:
            k += 1
        V = speed[n]
        for _ in range(FLOW_STEPS):
            between = tied[k], tied[k + 1]
            error, acceleration, normal = _at_speed(joint[n], between, V, line, a_max, T1[n], T2[n])
            over = max(error / error_max[n], acceleration, normal / normal_max)
            if over <= 1.0:
                break
            V *= max(FLOW_STEP_MIN, 0.99 / np.sqrt(over))
        out[n] = V if speed[n] > V else np.inf
    return out


@njit(cache=True, error_model="numpy")
def _at_speed(i, between, V, line, a_max, T1, T2):
    """Error [mm], largest ratio of the axes' accelerations, and acceleration [mm/s2] at joint i, run through at V."""
    s, direction, (low, high) = line.s, line.direction, between
    first, last, reach = i, i, V * (T1 + T2) / 2.0
    while first - 1 > low and s[i] - s[first - 1] < reach and i - first < FLOW_JOINTS:
        first -= 1
    while last + 1 < high and s[last + 1] - s[i] < reach and last - i < FLOW_JOINTS:
        last += 1
    if i - first == FLOW_JOINTS or last - i == FLOW_JOINTS:
        return at_speed_dense(i, between, V, line, a_max, T1, T2)
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
    return np.sqrt(error_sq), over, np.sqrt(bend_sq)


@njit(cache=True, error_model="numpy")
def at_speed_dense(i, between, V, line, a_max, T1, T2):
    """`_at_speed` by two nodes, -+V x with weights w, that have the kernel's second and fourth moment."""
    s, point, direction, (low, high) = line.s, line.point, line.direction, between
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
    return weight * np.sqrt(error_sq), over, np.sqrt(error_sq) / (x * x)
