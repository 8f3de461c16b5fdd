"""What a machine makes of setpoints, by the tests' own code: the signal between them, and its mean behind moving averages."""

from __future__ import annotations

import numpy as np

from planner.motion.trajectory import Trajectory

AGES = 4_001  # at which the kernel of the moving averages is taken


def trajectory_of(t, position, velocity):
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


def between(setpoints, kind, times):
    """(T, A) where the machine is at times, before the first setpoint and after the last one too."""
    t, p, v = setpoints.t, setpoints.position, setpoints.velocity
    k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    h = (t[k + 1] - t[k])[:, None]
    w = np.clip((times - t[k])[:, None] / h, 0.0, 1.0)
    if kind == "hold":
        return np.where(w < 1.0, p[k], p[k + 1])
    if kind == "linear":
        return (1 - w) * p[k] + w * p[k + 1]
    assert kind == "cubic"
    near = (1 + 2 * w) * (1 - w) ** 2 * p[k] + w * (1 - w) ** 2 * h * v[k]
    return near + w**2 * (3 - 2 * w) * p[k + 1] - w**2 * (1 - w) * h * v[k + 1]


def behind(setpoints, kind, lengths, times):
    """(T, A) the mean of that over the last sum of the lengths, weighted with the kernel of moving averages in series.

    The kernel is the density of a sum of uniform numbers, from the lengths' convolution on a fine grid.
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
