"""Motions made by hand, in closed form: for testing the verifier, with nothing of the planner's own sampling.

A motion is a function of time t (T,) -> position, velocity, acceleration, jerk, each (T, A).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine, machine_from_dict
from planner.motion.trajectory import Trajectory
from planner.nc.program import Kind, PathControl, Program

Motion = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]
JERK_FREE = ("jerk",)


def machine(dt=0.001, tolerance=0.05, velocity=100.0, acceleration=2000.0, jerk=2e5, **more) -> Machine:
    axis = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
    return machine_from_dict(
        {"name": "test", "dt": dt, "tolerance": tolerance, "axes": {"x": axis, "y": axis, "z": axis}, **more}
    )


@dataclass
class Moves:
    """A program written down move by move; source lines are 10, 20, 30 ..."""

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self):
        self.rows, self.arcs, self.here = [], [], np.array(self.start, dtype=float)

    def _add(self, kind, end, feed, dwell=0.0, control=PathControl.BLEND):
        self.here = np.array(end, dtype=float)
        self.rows.append((kind, self.here, feed, dwell, control))
        return self

    def line(self, *end, feed=50.0, control=PathControl.BLEND):
        return self._add(Kind.LINE, (*end, 0.0, 0.0)[:3], feed, control=control)

    def rapid(self, *end):
        return self._add(Kind.RAPID, (*end, 0.0, 0.0)[:3], np.inf)

    def arc(self, center, sweep, feed=50.0, rise=0.0):
        center = np.array([*center, self.here[2]])
        r = self.here - center
        c, s = np.cos(sweep), np.sin(sweep)
        self.arcs.append((len(self.rows), center, sweep))
        end = center + np.array([c * r[0] - s * r[1], s * r[0] + c * r[1], rise])
        return self._add(Kind.ARC, np.round(end, 4), feed)

    def dwell(self, seconds):
        return self._add(Kind.DWELL, self.here, np.inf, seconds)

    def toolpath(self, machine: Machine) -> Toolpath:
        kind, end, feed, dwell, control = zip(*self.rows, strict=True)
        return toolpath_from_program(
            Program(
                source="test.ngc",
                axes=("x", "y", "z"),
                start=self.start,
                kind=kind,
                end=end,
                feed=feed,
                dwell=dwell,
                line=10 * (1 + np.arange(len(kind))),
                path_control=control,
                tolerance=np.full(len(kind), np.nan),
                arc_block=[a[0] for a in self.arcs],
                arc_center=np.array([a[1] for a in self.arcs]).reshape(-1, 3),
                arc_normal=[2] * len(self.arcs),
                arc_sweep=[a[2] for a in self.arcs],
            ),
            machine,
        )


def rest_to_rest(length: float, feed: float, acceleration: float, jerk: float = np.inf):
    """s(t) from rest to rest: trapezoid, or with finite jerk a symmetric S-curve that keeps all three limits.

    -> duration, function of t giving s, s', s'', s''' (each (T,)), at rest outside [0, duration]
    """
    if np.isinf(jerk):
        peak = min(feed, np.sqrt(length * acceleration))
        ramp, rounding = peak / acceleration, 0.0
    else:
        peak = _s_curve_peak(length, feed, acceleration, jerk)
        rounding = min(acceleration / jerk, np.sqrt(peak / jerk))
        ramp = peak / (jerk * rounding)
    duration = length / peak + ramp + rounding
    if rounding == 0.0:
        order, scale = 2, peak / ramp
        knots = [(0.0, 1), (ramp, -1), (duration - ramp, -1)]
    else:
        order, scale = 3, peak / (ramp * rounding)
        up = [(0.0, 1), (rounding, -1), (ramp, -1), (ramp + rounding, 1)]
        knots = [*up, *((t + duration - ramp - rounding, -sign) for t, sign in up[:-1])]
    times = np.array([when for when, _ in knots])
    states = np.zeros((len(knots), 4))  # s and its derivatives at the beginning of each phase
    for k, (when, sign) in enumerate(knots):
        if k:
            states[k] = _cubic(states[k - 1], when - times[k - 1])
        states[k, order] += sign * scale

    def from_start(t):
        phase = np.maximum(np.searchsorted(times, t, side="right") - 1, 0)
        return _cubic(states[phase].T, t - times[phase])

    def at(t):
        # from the nearer end, so that s meets the length to the last digit: summed up from the start it misses
        # it by some ten units in the last place, a jump that the verifier tells from rounding
        t = np.clip(t, 0.0, duration)
        back = t > duration / 2
        s, v, a, j = from_start(np.where(back, duration - t, t))
        moves = t < duration
        return np.array([np.where(back, length - s, s), v, np.where(back, -a, a) * moves, j * moves])

    return duration, at


def _cubic(state, tau):
    s, v, a, j = state
    return np.array(
        [s + tau * (v + tau * (a / 2 + tau * j / 6)), v + tau * (a + tau * j / 2), a + tau * j, j + 0 * tau]
    )


def _s_curve_peak(length, feed, acceleration, jerk):
    def needed(peak):
        rounding = min(acceleration / jerk, np.sqrt(peak / jerk))
        return peak * (peak / (jerk * rounding) + rounding)

    if needed(feed) <= length:
        return feed
    low, high = 0.0, feed
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if needed(middle) <= length else (low, middle)
    return low


def along(length: float, curve, profile) -> tuple[float, Motion]:
    """Run curve(s) -> r, r', r'', r''' (each (T, A)) with a profile of `rest_to_rest`."""
    duration, at = profile

    def motion(t):
        s, v, a, j = (each[:, None] for each in at(t))
        r, r1, r2, r3 = curve(s[:, 0])
        return r, r1 * v, r1 * a + r2 * v**2, r1 * j + 3 * r2 * v * a + r3 * v**3

    return duration, motion


def straight(start, end):
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start))
    u = (end - start) / length

    def curve(s):
        zero = np.zeros((len(s), 3))
        # from the nearer end, so that the end itself is met to the last digit
        near = np.where((s < length / 2)[:, None], start + s[:, None] * u, end - (length - s)[:, None] * u)
        return near, zero + u, zero, zero

    return length, curve


def helix(start, center, sweep, rise=0.0):
    r = np.asarray(start, float) - np.array([*center, start[2]])
    radius, phase = np.hypot(r[0], r[1]), np.arctan2(r[1], r[0])
    length = float(np.hypot(radius * sweep, rise))
    rate, climb = sweep / length, rise / length

    def curve(s):
        phi, one = phase + rate * s, np.ones_like(s)
        c, sn = np.cos(phi), np.sin(phi)
        r0 = np.stack([center[0] + radius * c, center[1] + radius * sn, start[2] + climb * s], 1)
        r1 = np.stack([-radius * rate * sn, radius * rate * c, climb * one], 1)
        r2 = np.stack([-radius * rate**2 * c, -radius * rate**2 * sn, 0 * one], 1)
        r3 = np.stack([radius * rate**3 * sn, -radius * rate**3 * c, 0 * one], 1)
        return r0, r1, r2, r3

    return length, curve


def stay(point, seconds) -> tuple[float, Motion]:
    def motion(t):
        zero = np.zeros((len(t), 3))
        return zero + np.asarray(point, float), zero, zero, zero

    return seconds, motion


def chain(*parts: tuple[float, Motion]) -> tuple[float, Motion]:
    ends = np.cumsum([duration for duration, _ in parts])

    def motion(t):
        which = np.minimum(np.searchsorted(ends, t, side="right"), len(parts) - 1)
        out = np.zeros((4, len(t), 3))
        for k in np.unique(which):
            at = which == k
            duration, part = parts[k]
            begin = ends[k] - duration
            out[:, at] = part(np.clip(t[at] - begin, 0.0, duration))
        return tuple(out)

    return float(ends[-1]), motion


@dataclass(frozen=True)
class Asked:
    """A motion that can be asked at any time, with `fine` pieces per period."""

    motion: tuple[float, Motion]
    dt: float
    fine: int = 4

    @property
    def end(self) -> float:
        return self.motion[0]

    @property
    def t(self) -> np.ndarray:
        return np.arange(0.0, self.end, self.dt / self.fine)

    def at(self, times: np.ndarray, dt: float) -> Trajectory:
        position, velocity, acceleration, jerk = self.motion[1](times)
        none, zero = np.full(len(times), -1), np.zeros(len(times))
        return Trajectory(
            axes=("x", "y", "z"), dt=dt, t=times, position=position, velocity=velocity,
            acceleration=acceleration, jerk=jerk, s=zero, feed=zero, block=none, line=none,
        )  # fmt: skip


def sample(motion: tuple[float, Motion], dt: float) -> Trajectory:
    """The motion at dt; the last period is shorter."""
    t = np.arange(int(np.floor(motion[0] / dt - 1e-9)) + 1) * dt
    return Asked(motion, dt).at(np.append(t, motion[0]), dt)


def changed(trajectory: Trajectory, **columns) -> Trajectory:
    fields = {name: getattr(trajectory, name) for name in trajectory.__dataclass_fields__}
    return Trajectory(**{**fields, **columns})


def polyline(points, feed=50.0, acceleration=2000.0, jerk=np.inf) -> tuple[float, Motion]:
    """Rest to rest along every leg."""
    parts = []
    for a, b in pairwise(points):
        length, curve = straight(a, b)
        parts.append(along(length, curve, rest_to_rest(length, feed, acceleration, jerk)))
    return chain(*parts)


def rounded(points, cut, feed) -> tuple[float, Motion]:
    """Constant feed along a polyline, from and to rest is not its business: corners rounded by circles.

    cut : distance of each corner's vertex from the motion [mm]; the circle has radius cut / (1 / cos(theta/2) - 1)
    """
    points = [np.asarray(p, float) for p in points]
    parts, here = [], points[0]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        u1, u2 = (corner - before), (after - corner)
        u1, u2 = u1 / np.linalg.norm(u1), u2 / np.linalg.norm(u2)
        half = np.arctan2(np.linalg.norm(u2 - u1), np.linalg.norm(u1 + u2))
        radius = cut / (1 / np.cos(half) - 1)
        begin = corner - radius * np.tan(half) * u1
        parts.append(_steady(straight(here, begin), feed))
        side = np.sign(u1[0] * u2[1] - u1[1] * u2[0])
        center = begin + side * radius * np.array([-u1[1], u1[0], 0.0])
        parts.append(_steady(helix(begin, center[:2], side * 2 * half), feed))
        here = corner + radius * np.tan(half) * u2
    parts.append(_steady(straight(here, points[-1]), feed))
    return chain(*parts)


def _steady(curve, feed):
    length, at = curve
    return along(length, at, (length / feed, lambda t: (feed * t, feed + 0 * t, 0 * t, 0 * t)))
