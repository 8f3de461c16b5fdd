"""What a machine makes of setpoints, with numpy alone: the signal between them, its mean behind moving averages, and whether that is
near enough to a path in order. It shares nothing with the package."""

from __future__ import annotations

from itertools import pairwise
from math import inf, sqrt

import numpy as np

from planner.motion.trajectory import Trajectory

Array = np.ndarray
AGES = 4_001  # at which the kernel of the moving averages is taken
# Places of a filtered signal in a period, and in the shortest filter; where setpoints jump, and each leaves a kink, and elsewhere.
FINE_PERIOD, FINE_FILTER, FINE_HELD = 8, 16, 64


def trajectory_of(t: Array, position: Array, velocity: Array) -> Trajectory:
    """Setpoints with these columns, and nothing in the others."""
    zeros, none = np.zeros_like(position), np.zeros(len(t))
    return Trajectory(
        axes=tuple("xyz"[: position.shape[1]]),
        dt=float(t[1] - t[0]),
        t=t,
        position=position,
        velocity=velocity,
        acceleration=zeros,
        jerk=zeros,
        s=none,
        feed=none,
        block=none.astype(int),
        line=none.astype(int),
    )


def between(setpoints: Trajectory, kind: str, times: Array) -> Array:
    """(T, A) where the machine is at times, before the first setpoint and after the last one too [mm].

    kind : "linear", "cubic" or "hold"
    """
    t, p, v = setpoints.t, setpoints.position, setpoints.velocity
    k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    h = (t[k + 1] - t[k])[:, None]
    w = np.clip((times - t[k])[:, None] / h, 0.0, 1.0)
    if kind == "hold":
        return np.where(w < 1.0, p[k], p[k + 1])
    if kind == "linear":
        return (1 - w) * p[k] + w * p[k + 1]
    near = (1 + 2 * w) * (1 - w) ** 2 * p[k] + w * (1 - w) ** 2 * h * v[k]
    return near + w**2 * (3 - 2 * w) * p[k + 1] - w**2 * (1 - w) * h * v[k + 1]


def behind(setpoints: Trajectory, kind: str, lengths: tuple[float, ...], times: Array) -> Array:
    """(T, A) the mean of that over the last sum of the lengths, weighted with the kernel of moving averages in series [mm].

    The kernel is the density of a sum of uniform numbers, by convolution of their boxes on a fine grid.
    """
    step = sum(lengths) / (AGES - 1)
    kernel = np.ones(1)
    for length in lengths:
        whole, rest = divmod(length / step, 1.0)
        box = np.append(np.ones(int(whole)), rest)
        kernel = np.convolve(kernel, box / box.sum())
    # the kernel's middle is the mean delay, whatever the grid rounds
    mean = kernel @ np.arange(len(kernel))
    ages = (np.arange(len(kernel)) - mean) * step + sum(lengths) / 2.0
    return np.array([kernel @ between(setpoints, kind, time - ages) for time in times])


def averaged(setpoints: Trajectory, kind: str, lengths: tuple[float, ...]) -> Array:
    """(n, A) the signal behind moving averages, one after the other, on a fine grid until they are empty [mm]."""
    places = FINE_HELD if kind == "hold" else FINE_FILTER
    parts = max(FINE_PERIOD, int(np.ceil(places * setpoints.dt / min(lengths, default=np.inf))))
    h = setpoints.dt / parts
    t = h * np.arange(int((setpoints.t[-1] + sum(lengths)) / h) + 2)
    x = between(setpoints, kind, t)
    for n, length in enumerate(lengths):
        # a signal that is held has a new place at the right end of a cell, and the old one in all of it
        cell = x[:-1] if kind == "hold" and not n else (x[1:] + x[:-1]) / 2
        area = np.vstack([np.zeros(x.shape[1]), np.cumsum(cell - x[0], axis=0)]) * h
        early = np.maximum(t - length, 0.0)
        k = np.minimum((early / h).astype(int), len(t) - 2)
        w = (early / h - k)[:, None]
        slope = 0.0 if kind == "hold" and not n else x[k + 1] - x[k]
        before = area[k] + h * w * (x[k] - x[0] + w * slope / 2)
        x = x[0] + (area - before) / length
    return x


def within(motion: Array, path: Array, distance: float) -> bool:
    """Whether two polylines can be run through from start to end, neither going back, never more than a distance apart (Alt and Godau).

    motion   : (m+1, A) [mm]
    path     : (n+1, A) [mm]
    distance : [mm]
    """
    q, p = motion.tolist(), path.tolist()
    if distance < 0.0 or _free(q[0], p[0], p[1], distance)[0] > 0.0:
        return False
    lowest = {0: 0.0}  # of the segments that the motion's point can belong to, the lowest place
    for before, point in pairwise(q):
        new: dict[int, float] = {}
        j, entry = min(lowest), inf  # where on the motion's segment the path's segment j is entered
        while j < len(p) - 1 and (j in lowest or entry < inf or j < max(lowest)):
            low, leave = lowest.get(j, inf), inf
            if low < inf or entry < inf:
                a, b = _free(point, p[j], p[j + 1], distance)
                place = a if entry < inf else max(a, low)
                if place <= b:
                    new[j] = place
                a, b = _free(p[j + 1], before, point, distance)
                begin = a if low < inf else max(a, entry)
                leave = begin if begin <= b else inf
            j, entry = j + 1, leave
        if not new:
            return False
        lowest = new
    return len(p) - 2 in lowest and _free(q[-1], p[-2], p[-1], distance)[1] >= 1.0


def _free(point: list[float], start: list[float], end: list[float], distance: float) -> tuple[float, float]:
    """From which share to which a segment is within a distance of a point; from 2 to -1 if nowhere."""
    way = [b - a for a, b in zip(start, end, strict=True)]
    off = [b - a for a, b in zip(start, point, strict=True)]
    square = sum(x * x for x in way)
    along = sum(x * y for x, y in zip(way, off, strict=True)) / square if square > 0.0 else 0.0
    left = distance**2 - sum((y - along * x) ** 2 for x, y in zip(way, off, strict=True))
    if left < 0.0:
        return 2.0, -1.0
    half = sqrt(left / square) if square > 0.0 else inf
    low, high = max(along - half, 0.0), min(along + half, 1.0)
    return (low, high) if low <= high else (2.0, -1.0)
