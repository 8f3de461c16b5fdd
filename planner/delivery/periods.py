"""The share of the interpolation period in the contour error, and what is done about it.

The machine runs the chords between samples dt apart, which are off the motion by |e(t)| <= dt^2/8 max |q''|,
whatever the direction of the acceleration q'': where the motion q misses a vertex by m, they miss it by at
most so much more. Error allocation (eq. 18-20) uses the normal acceleration, as along a smooth path the other
part shifts the chord along itself; not so at full stops, and at corners that are passed within a few periods.

1. Full stops: where the motion arrives between two samples, the chord cuts the vertex off, by |q''|
   (dt/2)^2/2 at most. If that is too much, `standing` lets the motion stand for less than dt.
2. Corners: `missed` measures by how much the chords miss every vertex, wherever the samples fall;
   `with_less_tolerance` subtracts what is too much from the tolerance of the corner, and from that of the
   arcs beside it only where this was not enough. A corner whose chords would use nearly all becomes a full
   stop.
3. Curves: where feed changes within a period the acceleration along the path has a share after all. Where the
   verdict finds it too large inside a block, or by eq. (18), `with_less_inside` takes it from the block's
   tolerance, and then what the worst phase of the samples shows at the vertices inside.
"""

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple, TypeVar

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Joint, Toolpath, lesser_end
from planner.machine import Machine
from planner.motion.timing import CHUNK, MotionInTime, in_chunks
from planner.motion.trajectory import Trajectory, joined
from planner.motion.vertex_times import STANDING, passing_times_of

# Phases of the samples that are looked at, and places of a period at which motions near rests are tabulated:
# halving the step changes the worst miss by less than 1 %.
PHASES, PLACES = 16, 64
# A motion is looked at so many times in a period to find its vertices.
PER_PERIOD = 8
# A rest that a chord could cut off lasts so long at least [s]: a piece that who looks at pieces sees.
LEAST_REST = 1e-6
# Chords may miss a vertex by this fraction of its tolerance [-]; the rest is for what lies between.
USED = 0.99
# An excess above that by so little needs no other round [-]: it gets less with every one.
ABOVE = 2e-3
# By how many times an excess a corner's tolerance is reduced [-]: rounding has half of it, eq. (20).
REDUCED_BY = 1.5
# The same inside a block, whose chords have a share of the tolerance only.
REDUCED_INSIDE = 2.0
# A corner is stopped at instead where less than this fraction of its tolerance would be left to it [-].
LEFT_MIN = 0.1


WaitingT = TypeVar("WaitingT", bound=MotionInTime)


class Standing(NamedTuple):
    """Standstills that samples need: a motion at rest at `at` (n,), stands `by` (n,) [s] longer."""

    at: FloatArray
    by: FloatArray


def standing(
    motion: MotionInTime, toolpath: Toolpath, machine: Machine, jerk_limited: bool = False
) -> Standing:
    """How much longer a motion has to stand where chords would cut off a full stop by too much; it need not be looked at
    where it is known to leave a full stop with limited jerk (`jerk_limited`), and that is enough."""
    half = machine.dt / 2
    acceleration, jerk = (
        float(np.linalg.norm(machine.limits(q, toolpath.axes))) for q in ("acceleration", "jerk")
    )
    from_rest = min(acceleration * half**2 / 2, jerk * half**3 / 6 if jerk_limited else np.inf)
    nothing = Standing(np.empty(0), np.empty(0))
    if from_rest <= USED * toolpath.tolerance.min():
        return nothing
    *rests, block = _rests(motion, machine.dt)
    if not len(block):
        return nothing
    segment = np.searchsorted(toolpath.block, block)
    allowed = USED * np.minimum(toolpath.tolerance[segment], toolpath.tolerance[segment + 1])
    waits = _waits(motion, (rests[0], rests[1], rests[2]), allowed, machine.dt)
    return Standing(rests[0][waits > 0], waits[waits > 0])


def with_standstills(motion: WaitingT, stands: Standing) -> WaitingT:
    """The motion with these standstills."""
    return motion.waiting(*stands) if len(stands.at) else motion


def _rests(motion: MotionInTime, dt: float) -> tuple[FloatArray, FloatArray, FloatArray, Array]:
    """When the motion comes to rest between its ends, when it leaves (n,) [s], where (n, A), the block."""
    seen = joined(list(in_chunks(motion, dt, np.append(motion.t, motion.end))))
    still = seen.feed <= STANDING * seen.feed.max()
    begin = np.flatnonzero(still & ~np.append(False, still[:-1]))
    end = np.flatnonzero(still & ~np.append(still[1:], False))
    inner = (begin > 0) & (end < len(seen) - 1)
    begin, end = begin[inner], end[inner]
    return seen.t[begin], seen.t[end], seen.position[begin], seen.block[begin]


def _waits(
    motion: MotionInTime, rests: tuple[FloatArray, FloatArray, FloatArray], allowed: FloatArray, dt: float
) -> FloatArray:
    """(n,) by how much longer the motion has to rest at each of the `rests`, arrival, departure and place [s]."""
    arrival, departure, place = rests
    tau = np.linspace(0.0, dt, PLACES + 1)
    waits, waited = np.zeros(len(arrival)), 0.0
    gap = np.append(arrival[1:] - departure[:-1], np.inf)
    rows = max(CHUNK // len(tau), 1)
    for first in range(0, len(arrival), rows):
        some = slice(first, first + rows)
        before = _positions(motion, arrival[some, None] - tau, dt) - place[some, None]
        behind = _positions(motion, departure[some, None] + tau, dt) - place[some, None]
        apart = [np.linalg.norm(off, axis=2) for off in (before, behind[:, ::-1])]
        risky = np.minimum(*apart).max(axis=1) > allowed[some]
        for r in np.flatnonzero(risky):
            k = first + r
            since = (arrival[k] + waited) % dt  # from the last sample
            rest = dt - since - (departure[k] - arrival[k])  # from leaving to the next one
            waits[k] = max(LEAST_REST - (departure[k] - arrival[k]), 0.0)
            waited += waits[k]
            if min(since, dt - since) <= 1e-9 * dt or rest <= LEAST_REST:
                continue
            last = np.array([np.interp(since, tau, column) for column in before[r].T])
            at = np.append(rest, tau[(tau < rest) & ((tau <= gap[k]) | (tau == 0.0))][::-1])
            next_ = np.stack([np.interp(at, tau, column) for column in behind[r].T], axis=1)
            enough = _from_chord(np.broadcast_to(last, next_.shape), next_) <= allowed[k]
            enough[-1] = True  # on the sample
            more = max(rest - at[enough.argmax()] - LEAST_REST, 0.0)
            waits[k] += more
            waited += more
    return waits


def _positions(motion: MotionInTime, times: FloatArray, dt: float) -> FloatArray:
    """(*times.shape, A) where the motion is [mm]."""
    single, which = np.unique(np.clip(times, 0.0, motion.end), return_inverse=True)
    found: FloatArray = motion.at(single, dt).position[which.ravel()]
    return found.reshape(*times.shape, -1)


def _from_chord(a: FloatArray, b: FloatArray) -> FloatArray:
    """(...,) distance of 0 from the chords a to b (..., A)."""
    step = b - a
    size = (step**2).sum(axis=-1)
    fraction = np.divide(-(a * step).sum(axis=-1), size, out=np.zeros_like(size), where=size > 0)
    near: FloatArray = np.linalg.norm(a + np.clip(fraction, 0.0, 1.0)[..., None] * step, axis=-1)
    return near


def missed(motion: MotionInTime, toolpath: Toolpath, dt: float) -> tuple[FloatArray, FloatArray]:
    """Two arrays (M+1,) [mm]: by how much a motion itself misses each vertex, and by how much the chords between samples dt
    [s] apart miss it in the worst phase; 0 where the motion rests."""
    fastest = 0.0

    def seen() -> Iterator[Trajectory]:
        nonlocal fastest
        for part in _looks(motion, dt / PER_PERIOD, dt):
            fastest = max(fastest, float(part.feed.max()))
            yield part

    when = passing_times_of(seen(), toolpath)
    vertex = np.vstack([toolpath.start, toolpath.end[-1:]])
    place, of = np.unique(np.minimum(when, motion.end), return_inverse=True)
    moving = motion.at(place, dt).feed[of] > STANDING * fastest
    near, far = np.zeros(len(vertex)), np.zeros(len(vertex))
    shift = (np.arange(-1, 3)[None, :] - np.arange(PHASES)[:, None] / PHASES) * dt
    at = np.flatnonzero(moving)
    rows = max(CHUNK // shift.size, 1)
    for first in range(0, len(at), rows):
        some = at[first : first + rows]
        off = _positions(motion, when[some, None, None] + shift, dt) - vertex[some, None, None]
        far[some] = _from_chord(off[:, :, :-1], off[:, :, 1:]).min(axis=2).max(axis=1)
        fine_off = _positions(motion, when[some, None] + np.linspace(-0.5, 0.5, PLACES + 1) * dt, dt)
        near[some] = np.linalg.norm(fine_off - vertex[some, None], axis=2).min(axis=1)
    return near, far


def _looks(motion: MotionInTime, step: float, dt: float) -> Iterator[Trajectory]:
    """The motion every `step` [s], at the ends of its pieces and at its own, in chunks."""
    count, pieces = int(np.ceil(motion.end / step)), motion.t
    for first in range(0, count, CHUNK):
        beyond = min(first + CHUNK, count)
        begin, end = first * step, beyond * step if beyond < count else motion.end
        low, high = np.searchsorted(pieces, [begin, end], side="right")
        times = np.concatenate(
            [np.arange(first, beyond) * step, pieces[low:high], [motion.end] * (beyond == count)]
        )
        yield motion.at(np.unique(np.clip(times, 0.0, motion.end)), dt)


def with_less_tolerance(
    planned: Toolpath,
    programmed: Toolpath,
    near: FloatArray,
    far: FloatArray,
    times: float = 1.0,
    beside: bool = False,
) -> Toolpath | None:
    """The path to be planned so that chords keep the programmed path's tolerance; None if they do.

    planned   : the path that the motion was planned on
    near, far : by how much motion and chords miss the vertices (M+1,) [mm], from `missed`
    times     : how often what is too much is subtracted [-]: more than once where that changed nothing
                before, because the motion did not use what was taken from it
    beside    : take from the arcs beside the corners too, whose chords may be what misses them
    """
    allowed = USED * programmed.tolerance
    # where the path turns slowly chords have all of the tolerance, eq. (20): the verdict says the rest
    over = (far > allowed + ABOVE * programmed.tolerance) & (programmed.joint != Joint.SMOOTH)
    if not over.any():
        return None
    tolerance = planned.tolerance - times * REDUCED_BY * np.where(over, far - allowed, 0.0)
    hopeless = (tolerance < LEFT_MIN * programmed.tolerance) | (far - near > (1.0 - LEFT_MIN) * allowed)
    hopeless &= over
    tolerance[hopeless] = planned.tolerance[hopeless]
    along = np.minimum(planned.along, lesser_end(tolerance)) if beside else planned.along
    return _with_tolerance(planned.with_joints(hopeless, Joint.STOP), tolerance, along)


def with_less_inside(
    planned: Toolpath, programmed: Toolpath, line: int, ratio: float, far: FloatArray, times: float
) -> Toolpath | None:
    """The path to be planned with less of the tolerance on the blocks of an NC line, on which the chords are
    `ratio` times the tolerance off while they keep it at the corners for all that `missed` sees; None where
    next to nothing would be left.

    far   : by how much chords miss the vertices (M+1,) in the worst phase of the samples [mm]: where the path
            turns slowly, that counts if more than once is subtracted
    times : how often what is too much is subtracted [-], as in `with_less_tolerance`
    """
    segment = np.flatnonzero(planned.line == line)
    joints = np.union1d(segment, segment + 1)
    if times > 1.0:
        ratio = max(ratio, float((far[joints] / programmed.tolerance[joints]).max(initial=0.0)))
    tolerance = planned.tolerance.copy()
    by = max(1.0 - times * REDUCED_INSIDE * (ratio - 1.0), 0.5)
    tolerance[joints] *= by
    if not len(joints) or (tolerance[joints] < LEFT_MIN * programmed.tolerance[joints]).any():
        return None
    along = planned.along.copy()
    along[segment] *= by
    return _with_tolerance(planned, tolerance, along)


def _with_tolerance(toolpath: Toolpath, tolerance: FloatArray, along: FloatArray) -> Toolpath:
    """The path with other tolerances at its joints (M+1,) and along its segments (M,) [mm]."""
    inside = along / lesser_end(tolerance)
    return dataclasses.replace(toolpath, tolerance=tolerance, inside=inside)
