"""Runs of a motion between standstills, timed anew."""

from __future__ import annotations

import numpy as np
import pytest

from planner.delivery.pacing import runs_of, slower_runs, standing_longer
from planner.motion.axis_motion import AxisMotion


def hops(*heights: float) -> AxisMotion:
    """Motions to and fro of one axis, each from rest to rest in four phases of the jerk `height`."""
    h, state, rows = 0.1, np.zeros(3), []
    for height in heights:
        for sign in (1.0, -1.0, -1.0, 1.0):
            p, v, a = state
            j = sign * height
            rows.append((p, v, a, j))
            state = np.array([p + h * (v + h * (a / 2 + h * j / 6)), v + h * (a + h * j / 2), a + h * j])
        state[1:] = 0.0
    p, v, a, j = (np.array(column)[:, None] for column in zip(*rows, strict=True))
    count = np.arange(len(rows))
    return AxisMotion(
        axes=("x",), t=h * count, position=p, velocity=v, acceleration=a, jerk=j, block=count, line=count + 1,
        end=h * len(rows),
    )  # fmt: skip


def test_runs_stay_the_same_when_they_are_slowed_down():
    """The second run is so slow that it counts as standing beside the first one, and not when that is slowed down."""
    motion = hops(1e3, 4e-5, 1e3)
    runs = runs_of(motion)
    factor = np.where(np.arange(len(runs)) == len(runs) - 1, 1.0, 30.0)
    slower = slower_runs(motion, runs, factor)
    assert len(runs_of(slower_runs(motion, runs, np.full(len(runs), 30.0)))) >= len(runs)
    timed = runs.of(slower)
    assert len(timed) == len(runs)
    assert timed.end - timed.begin == pytest.approx(factor * (runs.end - runs.begin))
    by = np.full(len(runs), 0.05)
    begin, end = timed.behind(by)
    longer = standing_longer(slower, runs, by)
    assert end[-1] == pytest.approx(longer.end)
    at = longer.at(begin, 1e-3)
    assert at.velocity == pytest.approx(np.zeros((len(runs), 1)), abs=1e-6)
    assert np.diff(begin)[0] == pytest.approx(timed.begin[1] - timed.begin[0] + 0.05)
