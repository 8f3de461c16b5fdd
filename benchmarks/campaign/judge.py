"""A second judge of delivered motions: numpy alone, from the positions and the times, sharing nothing with the package.

    limits     the n-th divided difference of the positions times n! is a mean of the n-th derivative, so that it cannot exceed the
               limit unless the motion does; what rounding of the positions adds is carried through the differences
    feed       the speed of a chord is a mean of the speed, and at most the largest feed of the blocks that the chord can belong to
    contour    every sample and the middle of every chord lies within the tolerance of a place of the programmed path, and these
               places do not go back (matched from the first sample on, and once more from the last); under G61 the samples lie on it
    vertices   every end of a block is reached within the tolerance, in order; full stops and dwells by samples that stand there
    ends       start, end, and rest at both
    filters    the contour of the moving averages of the chords between the setpoints too

Curves are compared as chords; by how much these are off (`Course.sag`) is allowed on top. A bound that allows too much misses a small
fault; one that allows too little would call a right motion wrong, so every bound errs to the first side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from benchmarks.campaign.course import Course

Array = np.ndarray
ULPS = 8.0  # rounding of a position, in units of 2^-52 of the coordinates and of the way [-]
RATIO = 1e-6  # share of a limit that is rounding [-]
PLACE = 2e-6  # [mm] places closer than this are the same
STILL = 1e-12  # [mm/s] slower is standing
NEAR = 32  # segments that are looked at first
FINE = 8  # places of a filtered motion in a period or in the shortest filter
FINE_MOST = 40_000  # places of a filtered motion at most


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """What was delivered and asked for.

    t, q                : (T,) [s], (T, A) [mm]; rotary axes in angle times radius
    limits              : (3, A) of velocity, acceleration, jerk; inf where a method does not limit one
    normal_acceleration : [mm/s2], inf without
    linear              : (A,) True for x, y and z
    filters             : lengths of the moving averages behind the setpoints [s]
    """

    t: Array
    q: Array
    dt: float
    limits: Array
    linear: Array
    normal_acceleration: float = np.inf
    filters: tuple[float, ...] = field(default=())


def faults(motion: Motion, course: Course) -> list[str]:
    """A sentence for each kind of fault; empty for a motion without one."""
    found = list(_times(motion)) or list(_limits(motion))
    found += [*_ends(motion, course), *_contour_and_feed(motion, course), *_vertices(motion, course)]
    return found + (list(_filtered(motion, course)) if motion.filters else [])


def rounding(motion: Motion) -> float:
    """Of a position [mm]."""
    way = float(np.abs(np.diff(motion.q, axis=0)).sum()) if len(motion.q) > 1 else 0.0
    return ULPS * 2.0**-52 * (float(np.abs(motion.q).max(initial=0.0)) + way + 1.0)


def _times(motion: Motion) -> Iterator[str]:
    steps = np.diff(motion.t)
    if not len(steps) or motion.t[0] != 0.0 or not np.isfinite(motion.q).all():
        yield "no motion that begins at time 0 with numbers as positions"
        return
    late = np.abs(steps[:-1] - motion.dt).max(initial=0.0)
    if late > RATIO * motion.dt or not 0 < steps[-1] <= motion.dt * (1 + RATIO):
        yield f"periods differ from dt by {max(late, abs(steps[-1] - motion.dt)):.3g} s"


def differences(t: Array, q: Array, noise: float) -> Iterator[tuple[Array, Array]]:
    """Means of the first three derivatives, and what rounding adds to them."""
    value, error = q, np.full(len(q), noise)
    for order in range(1, 4):
        span = t[order:] - t[:-order]
        if not len(span):
            return
        value = np.diff(value, axis=0) * order / span[:, None]
        error = (error[1:] + error[:-1]) * order / span
        yield value, error


def _limits(motion: Motion) -> Iterator[str]:
    noise = rounding(motion)
    found = list(differences(motion.t, motion.q, noise))
    for name, (value, error), limit in zip(
        ("velocity", "acceleration", "jerk"), found, motion.limits, strict=False
    ):
        over = (np.abs(value) - error[:, None]) / limit
        if over.size and over.max() > 1 + RATIO:
            k, axis = np.unravel_index(over.argmax(), over.shape)
            yield f"{name} of axis {axis}: {over.max():.6g} of the limit at t = {motion.t[k]:.6g} s"
    if np.isfinite(motion.normal_acceleration) and len(found) > 1:
        yield from _normal(motion, found[1])


def _normal(motion: Motion, second: tuple[Array, Array]) -> Iterator[str]:
    """Normal acceleration from second differences, whose mean turns with the motion by at most N w / v."""
    value, error = second[0][:, motion.linear], second[1]
    chord, span = motion.q[2:, motion.linear] - motion.q[:-2, motion.linear], motion.t[2:] - motion.t[:-2]
    way = np.linalg.norm(chord, axis=1)
    size = np.linalg.norm(value, axis=1)
    speed = way / span - np.linalg.norm(motion.limits[1][motion.linear]) * span
    along = chord / np.maximum(way, 1e-300)[:, None]
    across = np.linalg.norm(value - (value * along).sum(axis=1)[:, None] * along, axis=1) - 3.0 * error
    most = float(np.linalg.norm(motion.limits[1][motion.linear]))
    turn = np.minimum(motion.normal_acceleration * span / np.maximum(speed, STILL), np.pi / 2)
    over = across - np.minimum(motion.normal_acceleration * (1 + RATIO) + most * np.sin(turn), np.inf)
    over[(speed <= 0) | (size == 0)] = -1.0
    if over.size and over.max() > 0:
        yield f"normal acceleration: {over.max():.6g} mm/s2 too much at t = {motion.t[int(over.argmax())]:.6g} s"


def _ends(motion: Motion, course: Course) -> Iterator[str]:
    for name, off in (("start", motion.q[0] - course.points[0]), ("end", motion.q[-1] - course.points[-1])):
        if np.linalg.norm(off) > PLACE:
            yield f"{name}: {np.linalg.norm(off):.6g} mm off"
    h = np.array([motion.t[1] - motion.t[0], motion.t[-1] - motion.t[-2]])[:, None]
    step = np.abs([motion.q[1] - motion.q[0], motion.q[-1] - motion.q[-2]])
    most = np.minimum(motion.limits[1] * h**2 / 2, motion.limits[2] * h**3 / 6 + motion.limits[1] * h**2 / 2)
    if (step > most * (1 + RATIO) + PLACE).any():
        yield f"not at rest at an end: {(step - most).max():.6g} mm more than from rest"


# ---- contour -----------------------------------------------------------------------------------------------------------------


def _contour_and_feed(motion: Motion, course: Course) -> Iterator[str]:
    early, fault = matched(motion.q, course, course.strict)
    if fault:
        yield fault.replace("sample", f"contour: sample (dt {motion.dt:g} s)")
        return
    late, fault = matched(motion.q[::-1], course.reversed(), course.strict[::-1])
    if fault:
        yield "contour, from the end: " + fault
        return
    middle = (motion.q[1:] + motion.q[:-1]) / 2
    _, fault = matched(middle, course, course.wide)
    if fault:
        yield "middles of chords: " + fault
    last = len(course.block) - 1 - late[::-1]
    first = np.minimum(early[:-1], last[1:])
    speed = np.linalg.norm(np.diff(motion.q, axis=0), axis=1) / np.diff(motion.t)
    error = 2 * rounding(motion) / np.diff(motion.t)
    for k in np.flatnonzero(speed > course.feed.min() * (1 + RATIO)):
        allowed = course.feed[first[k] : max(last[k + 1], first[k]) + 1].max()
        if speed[k] - error[k] > allowed * (1 + RATIO):
            yield f"feed: {speed[k] / allowed:.6g} of {allowed:.6g} mm/s at t = {motion.t[k]:.6g} s"
            return


def matched(q: Array, course: Course, within: Array) -> tuple[Array, str]:
    """(T,) the first segment that each place can be matched with after those before, and a sentence where there is none.

    within : (N,) distance that is allowed at each segment [mm]
    """
    begin, way = course.points[:-1], np.diff(course.points, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    at, share = 0, 0.0
    found = np.zeros(len(q), dtype=int)
    for k, place in enumerate(q):
        width = NEAR
        while True:
            rows = slice(at, min(at + width, len(way)))
            low, ok = _near(place - begin[rows], way[rows], square[rows], within[rows], share)
            if ok.any() or rows.stop == len(way):
                break
            width *= 8
        if not ok.any():
            off = np.linalg.norm(
                place - begin[at:] - _clipped(place - begin[at:], way[at:], square[at:]) * way[at:], axis=1
            )
            near = int((off - within[at:]).argmin())
            return found, (
                f"sample {k} of {len(q)} is {off[near]:.6g} mm from what follows, allowed {within[at + near]:.6g}, "
                f"block {course.block[at + near]}"
            )
        j = int(ok.argmax())
        at, share = at + j, float(low[j])
        found[k] = at
    return found, ""


def _clipped(radial: Array, way: Array, square: Array) -> Array:
    return np.clip((radial * way).sum(axis=1) / square, 0.0, 1.0)[:, None]


def _near(radial: Array, way: Array, square: Array, within: Array, share: float) -> tuple[Array, Array]:
    """(n,) where segments come within the distance, as a share, and whether they do; the first one only from a share on."""
    along = (radial * way).sum(axis=1) / square
    off = ((radial - along[:, None] * way) ** 2).sum(axis=1)
    half = np.sqrt(np.maximum(within**2 - off, 0.0) / square)
    low = np.maximum(along - half, 0.0)
    low[0] = max(low[0], share)
    return low, (off <= within**2) & (low <= np.minimum(along + half, 1.0))


# ---- vertices ----------------------------------------------------------------------------------------------------------------


def _vertices(motion: Motion, course: Course) -> Iterator[str]:
    h = motion.dt
    begin, way = motion.q[:-1], np.diff(motion.q, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    bow = np.zeros(len(motion.q))
    if len(motion.q) > 2:
        bow[1:-1] = np.linalg.norm(np.diff(motion.q, 2, axis=0), axis=1)
    bow = np.maximum(bow[1:], bow[:-1]) / 4
    at, share = 0, 0.0
    stand = PLACE + float(np.linalg.norm(motion.limits[1])) * h**2 / 8
    for vertex in course.vertices:
        off = np.linalg.norm(motion.q[at:] - vertex.place, axis=1)
        if vertex.stop:
            reached = np.flatnonzero(off <= stand)
            if vertex.dwell > 2 * h:
                there = np.append(np.append(0, off <= PLACE), 0)
                edge = np.flatnonzero(np.diff(there))
                long = (edge[1::2] - 1 - edge[::2]) * h >= vertex.dwell - 2 * h - RATIO
                reached = edge[::2][long]
            if not len(reached):
                yield f"no stop of {vertex.dwell:g} s at the end of block {vertex.block}: {off.min():.6g} mm off"
                return
            at, share = min(at + int(reached[0]), len(way) - 1), 0.0
            continue
        within = vertex.tolerance * (1 + RATIO) + PLACE + bow[at:]
        low, ok = _near(vertex.place - begin[at:], way[at:], square[at:], within, share)
        if not ok.any():
            yield f"the end of block {vertex.block} is {off.min():.6g} mm from the motion, allowed {vertex.tolerance:.6g}"
            return
        at, share = at + int(ok.argmax()), float(low[ok.argmax()])


# ---- filters -----------------------------------------------------------------------------------------------------------------


def filtered(motion: Motion) -> tuple[Array, float]:
    """(n, A) the moving averages of the chords between the setpoints on a fine grid, and how far that grid makes them wrong [mm]."""
    delay = sum(motion.filters)
    total = motion.t[-1] + delay
    h = max(min(motion.dt, *motion.filters) / FINE, total / FINE_MOST)
    times = np.arange(0.0, total + 2 * h, h)
    columns = [np.interp(times, motion.t, column) for column in motion.q.T]
    out = np.stack(columns, axis=1)
    for length in motion.filters:
        sums = np.vstack([np.zeros(out.shape[1]), np.cumsum((out[1:] + out[:-1]) * h / 2, axis=0)])
        for axis in range(out.shape[1]):
            before = (
                np.interp(times - length, times, sums[:, axis]) + np.minimum(times - length, 0) * out[0, axis]
            )
            out[:, axis] = (sums[:, axis] - before) / length
    speed = np.linalg.norm(np.diff(motion.q, axis=0), axis=1).max(initial=0.0) / motion.dt
    return out, speed * h * 0.02 * len(motion.filters)


def _filtered(motion: Motion, course: Course) -> Iterator[str]:
    places, error = filtered(motion)
    _, fault = matched(places, course, course.wide + error)
    if fault:
        yield "behind the filters: " + fault
