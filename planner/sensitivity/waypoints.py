"""The waypoints of a job: vertices, and points on arcs and curves, that every motion within the tolerance passes in order;
how fast it is at corners at most, and what lines take between them at least (least_time.py).
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limits import Limits
from planner.geometry.chords import polyline
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.sensitivity.straight_time import TINY, UNLIMITED, Bounds, End, straight_time

TURN = 0.05  # of a chord of an arc or a curve at most [rad]: their lengths are 1e-4 short
NODES = ("point", "tolerance", "stop", "vertex")
LEGS = ("tangent", "length", "feed", "line")


class Way(NamedTuple):
    """The waypoints of a job, and the N legs between them.

    point, tolerance, stop, vertex : (N+1, A) [mm], (N+1,) [mm], whether it is a full stop, or a corner
    tangent, length                : (N, A), (N,) [mm]
    feed, line                     : (N,) [mm/s], whether the leg is a line
    limit                          : (3, A) of velocity, acceleration and jerk
    """

    point: FloatArray
    tolerance: FloatArray
    stop: Array
    vertex: Array
    tangent: FloatArray
    length: FloatArray
    feed: FloatArray
    line: Array
    limit: FloatArray

    def of(self, nodes: Array | slice, legs: Array | slice) -> "Way":
        """Some of the waypoints, `nodes` (k,) of them, and of the legs, `legs` (l,)."""
        cut = {name: getattr(self, name)[nodes] for name in NODES}
        return self._replace(**cut, **{name: getattr(self, name)[legs] for name in LEGS})

    def part(self, begin: int, end: int) -> "Way":
        """The legs `begin` to `end` - 1."""
        return self.of(slice(begin, end + 1), slice(begin, end))

    def backwards(self) -> "Way":
        """From the end to the start."""
        turned = self.of(slice(None, None, -1), slice(None, None, -1))
        return turned._replace(tangent=-turned.tangent)

    def along(self, direction: FloatArray, feed: FloatArray) -> tuple[Bounds, FloatArray]:
        """The limits along unit vectors `direction` (n, A), with a `feed` (n,) [mm/s], and vectors y (n, A)
        whose product with a velocity is at most 1 then."""
        size = np.maximum(np.abs(direction), TINY)
        speed = np.minimum(feed, size @ self.limit[0])
        return Bounds(speed, size @ self.limit[1], size @ self.limit[2]), direction / speed[:, None]

    def coordinates(self) -> tuple[FloatArray, Array]:
        """(N, A) the direction that bounds each leg: its tangent, or, (N,), an axis slower than the feed."""
        of_axis = self.limit[0] / np.maximum(np.abs(self.tangent), TINY)
        slowest, rows = of_axis.argmin(axis=1), np.arange(len(of_axis))
        by_axis = of_axis[rows, slowest] < self.feed
        axis = np.zeros_like(self.tangent)
        axis[rows, slowest] = np.sign(self.tangent[rows, slowest])
        return np.where(by_axis[:, None], axis, self.tangent), by_axis


def way_of(toolpath: Toolpath, machine: Machine, not_limited: tuple[str, ...]) -> Way:
    """The waypoints of a toolpath and the legs between them; lines that go straight on at the same feed are
    one leg. Of velocity, acceleration and jerk, `not_limited` have no limit."""
    limits = Limits.of(machine, toolpath.axes)
    of_axes = np.minimum(limits.of_axes, UNLIMITED)
    for k, name in enumerate(("velocity", "acceleration", "jerk")):
        if name in not_limited:
            of_axes[k] = UNLIMITED
    line = (toolpath.arc < 0) & (toolpath.curve < 0)
    turn = np.where(line, 0.0, toolpath.curvature * toolpath.length)
    count = np.maximum(np.ceil(turn / TURN), 1).astype(int)
    point, segment = polyline(toolpath, count)
    last = np.append(np.diff(segment) > 0, True)  # of a segment: its end is a joint
    joint = segment + 1
    wider = np.maximum(toolpath.tolerance[segment], toolpath.tolerance[joint])
    tolerance = np.where(last, toolpath.tolerance[joint], wider)
    kind = np.where(last, toolpath.joint[joint], Joint.SMOOTH)
    feed = np.where(toolpath.rapid, np.inf, np.minimum(toolpath.feed, machine.feed_max or np.inf))[segment]
    feed = np.minimum(feed, np.linalg.norm(of_axes[0]))
    straight = (kind[:-1] == Joint.SMOOTH) & line[segment[:-1]] & line[segment[1:]] & (feed[:-1] == feed[1:])
    keep = np.append(~straight, True)
    point, tolerance, kind = point[np.append(True, keep)], tolerance[keep], kind[keep]
    tolerance, kind = np.append(toolpath.tolerance[0], tolerance), np.append(Joint.STOP, kind)
    way = np.diff(point, axis=0)
    length = np.linalg.norm(way, axis=1)
    stop = kind == Joint.STOP
    tangent = way / np.maximum(length, TINY)[:, None]
    return Way(
        point=point,
        tolerance=np.where(stop, 0.0, tolerance),
        stop=stop,
        vertex=kind == Joint.CORNER,
        tangent=tangent,
        length=length,
        feed=feed[keep],
        line=line[segment[keep]],
        limit=of_axes,
    )


class Legs(NamedTuple):
    """(N,) the least way of each leg in a coordinate [mm], the least time for it [s], and the speeds at its ends."""

    way: FloatArray
    time: FloatArray
    begin: End
    end: End


def legs_between(way: Way, bounds: Bounds, length: FloatArray, known: Array) -> Legs:
    """Lines between corners and stops; `length` (N,) in the coordinate that bounds each, and whether it is its tangent, as
    otherwise its speed at corners is not known."""
    u, corner = way.tangent, way.vertex[1:-1] & way.line[:-1] & way.line[1:]
    least = np.maximum(length - way.tolerance[:-1] - way.tolerance[1:], 0.0)
    within = np.maximum(way.tolerance[:-1], way.tolerance[1:])
    lasting = least / bounds.speed
    cosine = np.clip((u[:-1] * u[1:]).sum(axis=1), -1.0, 1.0)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, TINY))
    of_before = confined(way, u[1:] - cosine[:, None] * u[:-1], within[:-1], lasting[:-1])
    of_after = confined(way, u[:-1] - cosine[:, None] * u[1:], within[1:], lasting[1:])
    before = (np.abs(cosine) * of_before + of_after) / sine
    after = (np.abs(cosine) * of_after + of_before) / sine
    back = np.where(cosine < 0.0, 4.0 * np.maximum(within[:-1], within[1:]), np.inf)
    before = np.minimum(before, np.sqrt(bounds.acceleration[:-1] * back))
    after = np.minimum(after, np.sqrt(bounds.acceleration[1:] * back))
    begin = np.append(np.inf, np.where(corner & known[1:], after, np.inf))
    end = np.append(np.where(corner & known[:-1], before, np.inf), np.inf)
    at_begin = End(np.where(way.stop[:-1], 0.0, np.minimum(begin, bounds.speed)), way.stop[:-1])
    at_end = End(np.where(way.stop[1:], 0.0, np.minimum(end, bounds.speed)), way.stop[1:])
    time = np.where(way.line, straight_time(least, at_begin, at_end, bounds), lasting)
    return Legs(least, time, at_begin, at_end)


def confined(way: Way, across: FloatArray, within: FloatArray, lasting: FloatArray) -> FloatArray:
    """(n,) the largest speed across a leg at its end [mm/s], UNLIMITED where the time is too short to tell:
    in directions `across` (n, A) of any length, `within` (n,) of the leg [mm], for `lasting` (n,) before at
    least [s]."""
    size = np.maximum(np.linalg.norm(across, axis=1), TINY)
    direction = np.abs(across) / size[:, None]
    push, jerk = (np.maximum(direction @ limit, TINY) for limit in way.limit[1:])
    by_push, by_jerk = np.sqrt(4.0 * push * within), np.cbrt(243.0 / 8.0 * within**2 * jerk)
    by_push = np.where(lasting * push >= by_push, by_push, UNLIMITED)
    return np.minimum(by_push, np.where(lasting >= 2.0 * np.cbrt(24.0 * within / jerk), by_jerk, UNLIMITED))
