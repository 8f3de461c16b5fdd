"""Threads: the run-in against an integration of the jerk-limited step, and cuts without room or beyond the machine's speed."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.run_in import run_in
from planner.machine import Machine
from planner.nc.reader import parse_program

AXES = {"x": (100, 2000, 4e4), "y": (100, 1000, 1e4), "z": (150, 500, 2e4)}  # velocity, acceleration, jerk
M = Machine(
    name="test",
    dt=1e-3,
    tolerance=0.01,
    axes={a: dict(zip(("velocity", "acceleration", "jerk"), v, strict=True)) for a, v in AXES.items()},
)  # type: ignore[arg-type]
HEAD = "G21 G90 M3 S{}\nG0 X10 Z5\n"


def built(cut: str, speed: float = 600.0, machine: Machine = M):
    return toolpath_from_program(parse_program(HEAD.format(speed) + cut + "\nG0 X20\nM2", machine), machine)


@pytest.mark.shows("threads", "exact: the run-in by integration")
@pytest.mark.parametrize("pitch", [0.25, 1.0, 2.5, 8.0])
@pytest.mark.parametrize("end", ["Z-50", "X-30 Z-20", "X-40"])
def test_the_run_in_is_that_of_the_jerk_limited_step(pitch: float, end: str) -> None:
    """The shortest way from rest to the feed with a and j: the acceleration goes up at j, stays at a, and goes down at j."""
    toolpath = built(f"G33 {end} K{pitch}")
    k = int(np.flatnonzero(toolpath.held)[0])
    along = np.abs(toolpath.tangent_start[k])
    a, j = (min(AXES[letter][n] / u for letter, u in zip("xyz", along, strict=True) if u) for n in (1, 2))
    feed, step = toolpath.feed[k], 2e-6
    assert feed == pytest.approx(10 * pitch)
    rise = min(a / j, np.sqrt(feed / j))
    stay = feed / (j * rise) - rise
    t = np.arange(0.0, 2 * rise + stay, step)
    acceleration = np.minimum(np.minimum(j * t, j * rise), j * (2 * rise + stay - t))
    speed = np.cumsum(acceleration) * step
    assert speed[-1] == pytest.approx(feed, rel=1e-3)
    assert run_in(toolpath, M)[k] == pytest.approx(speed.sum() * step, rel=2e-3)
    assert (run_in(toolpath, M)[~toolpath.held] == 0).all()


def test_a_thread_needs_room_for_run_in_and_run_out() -> None:
    toolpath = built("G33 Z-5 K4", 600)
    need = 2 * run_in(toolpath, M).max()
    assert need < 10
    for length in (1.001 * need, 0.999 * need):
        cut = f"G33 Z{5 - length:.9f} K4"
        if length > need:
            built(cut)
            continue
        with pytest.raises(InputError, match=r"run-in and run-out take .* start further away") as found:
            built(cut)
        assert found.value.line == 3


def test_a_thread_faster_than_the_machine_is_refused() -> None:
    built("G33 Z-50 K2", 4499)
    with pytest.raises(InputError, match="the machine allows F9000 there; take a smaller S"):
        built("G33 Z-50 K2", 4501)
    slow = M.model_copy(update={"feed_max": 20.0})
    with pytest.raises(InputError, match="the machine allows F1200 there"):
        built("G33 Z-50 K2", 601, slow)


def test_of_a_cut_of_several_moves_one_must_have_room() -> None:
    """Tapers at the ends of a thread are shorter than the run-in, and part of it."""
    toolpath = built("G33 X9.9 Z4.9 K1.4\nG33 Z-30 K1\nG33 X10 Z-30.1 K1.4")
    assert toolpath.held.sum() == 3
    with pytest.raises(InputError, match="run-in"):
        built("G33 X9.9 Z4.9 K1.4\nG33 Z4.8 K1\nG33 X10 Z4.7 K1.4")
    with pytest.raises(InputError, match="run-in"):  # a stop parts them: the second has no room
        built("G33 Z-30 K1\nG4 P0.1\nG33 Z-30.1 K1")
