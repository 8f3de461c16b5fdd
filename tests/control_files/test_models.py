"""The short models of controls' planners: closed forms, laws, and times of the controls' own code on five programs."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.control_files.models import CONTROLS, Control, control_of, predicted_time
from planner.machine import Machine

SHARED = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[3] / "shared"))
AXIS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 200000.0}
MACHINE = Machine(name="m", dt=0.001, tolerance=0.05, axes={"x": AXIS, "y": AXIS, "z": AXIS})
# Times of grbl 1.1h and of Klipper's own motion code on the machine `peers` [s], from its README; junction deviation 0.01 mm, square
# corner velocity 5 mm/s, no time for lines.
PEERS = {
    "a_pentagon": (0.983, 1.013),
    "b_zigzag": (2.500, 2.972),
    "c_circle": (0.678, 0.678),
    "d_starspiral": (2.164, 2.663),
    "e_chips": (28.226, 31.264),
}


def time_of(points: np.ndarray, control: Control, feed: float = 1e9) -> float:
    moves = len(points) - 1
    return predicted_time(
        points,
        np.full(moves, feed),
        np.zeros(moves + 1, bool),
        MACHINE,
        ("x", "y", "z")[: points.shape[1]],
        control,
    )


def unhurried(name: str) -> Control:
    return dataclasses.replace(CONTROLS[name], block_time=0.0)


@pytest.mark.parametrize("name", ["grbl", "klipper", "marlin"])
def test_a_straight_move_is_a_trapezoid(name: str) -> None:
    """v/a + L/v where the feed is reached; on its own a triangle, 2 (L/a)^(1/2)."""
    control = unhurried(name)
    assert time_of(np.array([[0, 0], [20.0, 0]]), control) == pytest.approx(20 / 100 + 100 / 2000)
    assert time_of(np.array([[0, 0], [20.0, 0]]), control, 40.0) == pytest.approx(20 / 40 + 40 / 2000)
    if name != "klipper":  # which lets short moves up to what half of the acceleration reaches
        assert time_of(np.array([[0, 0], [2.0, 0]]), control) == pytest.approx(2 * np.sqrt(2 / 2000))
    parts = np.stack([np.linspace(0, 20.0, 9), np.zeros(9)], axis=1)
    assert time_of(parts, control) == pytest.approx(20 / 100 + 100 / 2000), "straight joints cost nothing"


def test_a_corner_is_passed_at_the_speed_of_its_law() -> None:
    """Two legs of 20 mm with a right angle: each side loses what braking from 100 mm/s to v and back takes."""
    points = np.array([[0, 0], [20.0, 0], [20, 20]])
    s = np.sqrt(0.5)
    accel = 2000.0 * np.sqrt(2.0)  # along the bisector, where two axes share it
    for control, v in (
        (unhurried("grbl"), np.sqrt(accel * 0.01 * s / (1 - s))),
        (CONTROLS["klipper"], 5.0),
    ):
        lost = 2 * (100.0 - v) ** 2 / (2 * 2000.0 * 100.0)
        assert time_of(points, control) == pytest.approx(40 / 100 + 100 / 2000 + lost, rel=1e-9)


def test_looking_ahead_bounds_the_speed_on_short_blocks() -> None:
    """From any speed the motion can stand within 15 blocks of 0.01 mm: v^2 <= 2 a 15 l, ramps aside."""
    points = np.stack([np.linspace(0, 50.0, 5001), np.zeros(5001)], axis=1)
    v = np.sqrt(2 * 2000.0 * 15 * 0.01)
    assert time_of(points, unhurried("grbl")) == pytest.approx(50.0 / v, rel=0.01)
    assert time_of(points, CONTROLS["klipper"]) == pytest.approx(50 / 100 + 100 / 2000, rel=1e-6)
    slow = dataclasses.replace(CONTROLS["grbl"], block_time=0.01)
    assert time_of(points, slow) == pytest.approx(5000 * 0.01, rel=0.01), "a line every 10 ms"


@pytest.mark.parametrize("name", ["grbl", "klipper", "marlin"])
def test_laws(name: str) -> None:
    control = unhurried(name)
    points = np.cumsum(np.random.default_rng(7).normal(0, 3, (60, 3)), axis=0)
    time = time_of(points, control)
    assert time_of(points, control, 50.0) >= time
    assert time_of(points[:, [1, 2, 0]], control) == pytest.approx(time), "all axes are alike"
    if name == "grbl":
        far = dataclasses.replace(control, blocks=None)
        assert time_of(points[::-1], far) == pytest.approx(time_of(points, far)), (
            "backwards as long as forwards"
        )
    stop = np.zeros(60, bool)
    stop[30] = True
    args = (MACHINE, ("x", "y", "z"), control)
    whole = predicted_time(points, np.full(59, 80.0), stop, *args)
    parts = [
        predicted_time(part, np.full(len(part) - 1, 80.0), np.zeros(len(part), bool), *args)
        for part in (points[:31], points[30:])
    ]
    if name != "klipper":
        assert whole == pytest.approx(sum(parts))


@pytest.mark.parametrize("job", PEERS)
def test_predictions_are_near_the_controls_own_code(job: str) -> None:
    file = SHARED / "peers" / "programs" / f"{job}.ngc"
    if not file.exists():
        pytest.skip(f"{file} is not here")
    machine = planner.load_machine(SHARED / "machines" / "peers.toml")
    program = planner.read_program(file, machine)
    points = np.vstack([program.start, program.end])
    stop = np.zeros(len(points), bool)
    for control, known, within in zip(
        (unhurried("grbl"), CONTROLS["klipper"]), PEERS[job], (0.007, 0.02), strict=True
    ):
        found = predicted_time(points, program.feed, stop, machine, program.axes, control)
        assert found == pytest.approx(known, rel=within)


def test_other_names_and_still_paths_are_refused() -> None:
    with pytest.raises(planner.InputError, match=r"no control 'grlb'.*did you mean 'grbl'"):
        control_of("grlb")
    with pytest.raises(planner.InputError, match="moves nowhere"):
        time_of(np.zeros((3, 2)), CONTROLS["grbl"])
