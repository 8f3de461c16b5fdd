"""Faults that a verdict finds are mended where they are: the motion is run slower there only.

A limit that is exceeded, a feed, a corner passed too fast, and an error of the chords between samples or of
filters all get less where the motion is slower (verifier/excess.py says by what power), so that each says by
how much it has to be. What does not get less, a path that leaves the tolerance by itself, is not mended here;
nor is a motion that takes more than `MOST_SLOWER` times as long anywhere, which is a mistake to be seen.

All of the motion is judged again in each round: behind the first place that is slower everything comes later
by no whole number of periods, so that other setpoints are delivered there.
"""

import dataclasses

import numpy as np

from planner.base.arrays import FloatArray
from planner.delivery.periods import Standing
from planner.motion.shaping import ShapedMotion
from planner.motion.slowed import FAR, Place, Slowed, reach, without_stands
from planner.motion.timing import MotionInTime
from planner.verifier import OF_CHORDS, Kind, Verdict

# So often a motion is mended and judged again, each time at other times.
ROUNDS = 6
# Rounds may find a few other places each time, between those that were looked at: from this round on all of the
# motion is slower, by so many times what its worst place asks for, if that is no more than `LITTLE` [-].
EVERYWHERE, TWICE, LITTLE = 4, 2.0, 1e-3
MOST_SLOWER = 2.0  # [-]
# What is slowed down is slowed down by this much more [-], and so many times that each time again.
MORE, MORE_AGAIN = 1e-5, 4.0
# Of an error whose share of the path is unknown: slowed down by so many times that in each further round [-].
AGAIN = 2.0
# A place reaches so many periods to both sides: that far what is judged is made of [-].
PERIODS = 3.0
# Two places are one where that costs less: each costs twice its reach to either side.
JOINED = 4.0
# A motion that is not faster [mm/s], nor accelerated more [mm/s2], rests: less is rounding of long sums.
STANDS = 1e-6, 1e-3
AT_REST = 1e-6  # as near to a rest as that [s] is at it
BOTH_SIDES = 2  # from this round on what is found at a rest is taken to be of the run before it too
PART = 32  # ends of pieces that are looked at for a rest at first
MENDED = OF_CHORDS | {Kind.LIMIT, Kind.FILTERS, Kind.CORNER_SPEED, Kind.EXACT}


def mended(
    motion: MotionInTime, stands: Standing, verdict: Verdict, dt: float, again: int
) -> MotionInTime | None:
    """The motion run slower where its verdict finds something; None where that does not mend it.

    stands : of the motion that was judged, which stood longer in places (delivery/periods.py)
    again  : rounds before this one
    """
    slower = np.array([each.slower for each in verdict.excesses])
    if not len(slower) or not verdict.kinds <= MENDED or slower.max() > MOST_SLOWER:
        return None
    more = MORE * MORE_AGAIN**again
    unknown = np.array([each.kind in (Kind.CONTOUR, Kind.FILTERS) for each in verdict.excesses])
    by = slower * (1.0 + more) - 1.0
    by = np.where(unknown, by * AGAIN**again, by)
    edges = np.array([[each.begin, each.end] for each in verdict.excesses])
    if again >= BOTH_SIDES:
        edges[:, 0] -= 2.0 * AT_REST
    edges = without_stands(np.stack(stands, axis=1), edges.ravel())[0].reshape(-1, 2)
    if again >= EVERYWHERE and slower.max() <= 1.0 + LITTLE:
        edges, by = np.array([[0.0, np.inf]]), np.array([TWICE * (slower.max() - 1.0) + MORE])
    w, pad = reach_of(verdict), PERIODS * dt
    jerk_limited = any(name.startswith("jerk") and check.limited for name, check in verdict.limits.items())
    if isinstance(motion, ShapedMotion):  # what its copies are of
        edges[:, 0] -= motion.shaper.length
        return dataclasses.replace(motion, motion=_slowed(motion.motion, edges, by, w, pad, jerk_limited))
    return _slowed(motion, edges, by, w, pad, jerk_limited)


def _slowed(
    motion: MotionInTime, edges: FloatArray, by: FloatArray, w: float, pad: float, jerk_limited: bool
) -> Slowed:
    """The motion slower by `by` (n,) [-] between `edges` (n, 2) [s] and `pad` [s] around them, as far as the
    rests there; one place for those that cost less together."""
    slowed = motion if isinstance(motion, Slowed) else Slowed(motion=motion, places=())
    edges = slowed.was_at_any(np.clip(edges, 0.0, motion.end))
    order = np.argsort(edges[:, 0], kind="stable")
    begin, end, by = edges[order, 0], np.maximum.accumulate(edges[order, 1]), by[order]
    places: list[Place] = []
    for a, b, d in zip(begin.tolist(), end.tolist(), by.tolist(), strict=True):
        last = places[-1] if places else Place(0.0, 0.0, 0.0, w, -1.0, -1.0)
        inside = last.low <= a and b <= last.high
        low, high = last[-2:] if inside else _rests(slowed.motion, a, b, FAR * w, jerk_limited)
        place = Place(max(a - pad, low), min(b + pad, high), d, w, low, high)
        if inside and place.begin <= last.end + JOINED * w:
            place = place._replace(begin=last.begin, by=max(d, last.by))
            places.pop()
        places.append(place)
    now = zip(places, slowed.slowest(places), strict=True)
    return Slowed(
        motion=slowed.motion, places=(*slowed.places, *(each._replace(by=each.by * p) for each, p in now))
    )


def _rests(
    motion: MotionInTime, begin: float, end: float, within: float, jerk_limited: bool
) -> tuple[float, float]:
    """The last rest up to `begin` and the first from `end` on, within `within` [s]; its own ends beyond."""
    edges = np.append(motion.t, motion.end)
    k, n = np.searchsorted(edges, [begin + AT_REST, end + AT_REST])  # jumps are of what is behind the rest
    low, high = np.searchsorted(edges, begin - within), np.searchsorted(edges, end + within, side="right")

    def first(times: FloatArray, none: float) -> float:
        """The first of some times, in any order, at which nothing moves, looked for in larger and larger parts."""
        part = PART
        while len(times):
            single, which = np.unique(times[:part], return_inverse=True)
            seen = motion.at(single, 1.0)
            still = seen.feed <= STANDS[0]
            if jerk_limited:  # nor begins to with a jump of the acceleration
                still &= np.abs(seen.acceleration).max(axis=1) <= STANDS[1]
            if still.any():
                return float(times[still[which].argmax()])
            times, part = times[part:], 4 * part
        return none

    return first(edges[low:k][::-1], 0.0), first(edges[n:high], np.inf)


def reach_of(verdict: Verdict) -> float:
    """How far before and behind a place a motion has to be slower [s], by its verdict (motion/slowed.py)."""
    groups = {name.partition(".")[2] for name, check in verdict.limits.items() if check.limited} - {""}

    def largest(quantity: str, name: str) -> float:
        """What the motion has of it at most; along the path, where that alone is not judged, no more than of all axes together."""
        own = verdict.limits.get(f"{quantity}.{name}")
        of_axes = (check for each, check in verdict.limits.items() if each.startswith(f"{quantity}."))
        return float(np.linalg.norm([each.value for each in ([own] if own is not None else of_axes)]))

    found = [0.0]
    for name in groups:
        checks = (verdict.limits.get(f"{quantity}.{name}") for quantity in ("acceleration", "jerk"))
        A, J = (check.limit if check is not None and check.limited else np.inf for check in checks)
        if np.isfinite(J) and not np.isfinite(A):
            A = largest("acceleration", name)
        found.append(reach(largest("velocity", name), A, J))
    return max(found)
