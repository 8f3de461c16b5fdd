"""The short models of controls' planners: closed forms, laws, and times of the controls' own code on five programs."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from planner.controls.timing.models import CONTROLS, Control, predicted_times
from planner.machine import Machine

SHARED = Path(os.environ.get("PLANNER_SHARED", Path(__file__).resolve().parents[4] / "shared"))
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


def predicted_time(*moves: Any) -> float:
    return float(predicted_times(*moves).sum())


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


@pytest.mark.shows("time-klipper, time-marlin, time-grbl", "exact: closed forms of corners")
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
    """From any speed the motion can stand within 14 blocks of 0.01 mm: v^2 <= 2 a 14 l, ramps aside."""
    points = np.stack([np.linspace(0, 50.0, 5001), np.zeros(5001)], axis=1)
    v = np.sqrt(2 * 2000.0 * 14 * 0.01)
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
    assert whole == pytest.approx(sum(parts))


SLOW_Z = Machine(
    name="printer",
    dt=0.001,
    tolerance=0.05,
    feed_max=180.0,
    axes={
        "x": {"velocity": 180.0, "acceleration": 1400.0, "jerk": 1e5},
        "y": {"velocity": 180.0, "acceleration": 1400.0, "jerk": 1e5},
        "z": {"velocity": 9.0, "acceleration": 120.0, "jerk": 1e4},
    },
)


def klipper_time(points: np.ndarray, feed: np.ndarray, *, corner: float, ratio: float) -> float:
    """Klipper's look-ahead on `SLOW_Z`, move by move, as its documentation (Kinematics.md) and klippy/toolhead.py have it."""
    v_max, a_max, z_v, z_a = 180.0, 1400.0, 9.0, 120.0
    moves = []
    for a, b, f in zip(points, points[1:], feed, strict=False):
        d, v, acc = np.linalg.norm(b - a), min(f, v_max), a_max
        if b[2] != a[2]:
            share = d / abs(b[2] - a[2])
            v, acc = min(v, z_v * share), min(acc, z_a * share)
        dv, smooth = 2 * d * acc, min(2 * d * a_max * (1 - ratio), 2 * d * acc)
        begin = begin_smooth = 0.0
        if moves:
            u, w, before = (b - a) / d, moves[-1]["way"], moves[-1]
            cos = float(np.clip(-(u @ w), -1, 1))
            s, c = np.sqrt(0.5 * (1 - cos)), np.sqrt(0.5 * (1 + cos))
            begin = min(v * v, before["v"] ** 2, before["begin"] + before["dv"])
            if s < 1 and c > 0:
                arc = corner**2 * (np.sqrt(2) - 1) / a_max * s / (1 - s)
                begin = min(begin, arc * acc, arc * before["acc"], dv * s / c / 4, before["dv"] * s / c / 4)
            begin_smooth = min(begin, before["begin_smooth"] + before["smooth"])
        moves.append(
            {"way": (b - a) / d, "d": d, "v": v, "acc": acc, "dv": dv, "smooth": smooth, "begin": begin}
            | {"begin_smooth": begin_smooth}
        )
    total, end, end_smooth, peak, waiting = 0.0, 0.0, 0.0, 0.0, []

    def passed(move, x0, x, x1):
        v0, v, v1 = np.sqrt([x0, x, x1])
        way = (x - x0) / (2 * move["acc"]), (x - x1) / (2 * move["acc"])
        return (v - v0) / move["acc"] + (v - v1) / move["acc"] + (move["d"] - sum(way)) / v

    for move in reversed(moves):
        reach, reach_smooth = end + move["dv"], end_smooth + move["smooth"]
        start, start_smooth = min(move["begin"], reach), min(move["begin_smooth"], reach_smooth)
        if start_smooth < reach_smooth:
            if start_smooth + move["smooth"] > end_smooth or waiting:
                peak = held = min(move["v"] ** 2, (start_smooth + reach_smooth) / 2)
                for other, x0, x1 in waiting[::-1]:
                    held = min(held, x0)
                    total += passed(other, min(x0, held), held, min(x1, held))
                waiting = []
            x = min((start + reach) / 2, move["v"] ** 2, peak)
            total += passed(move, min(start, x), x, min(end, x))
        else:
            waiting.append((move, start, end))
        end, end_smooth = start, start_smooth
    return total


@pytest.mark.parametrize("seed", range(8))
def test_klipper_holds_z_apart_and_the_rest_along_the_path(seed: int) -> None:
    """Moves in x and y know nothing of z's acceleration, and a diagonal one has no more than x has."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0, rng.choice([0.2, 2.0, 20.0]), (40, 3)) * [1, 1, rng.choice([0.0, 0.01, 0.4])]
    points, feed = np.cumsum(np.vstack([np.zeros(3), steps]), axis=0), rng.choice([20.0, 90.0, 300.0], 40)
    for corner, ratio in ((5.0, 0.5), (9.0, 0.1)):
        given = {"name": "klipper", "square_corner_velocity": corner, "minimum_cruise_ratio": ratio}
        machine = Machine(**{**SLOW_Z.model_dump(exclude_none=True), "control": given})
        found = predicted_time(
            points, feed, np.zeros(41, bool), machine, ("x", "y", "z"), CONTROLS["klipper"]
        )
        assert found == pytest.approx(klipper_time(points, feed, corner=corner, ratio=ratio), rel=1e-12)


def triangle(length: float, a: float, end: float) -> float:
    """Time from rest over a peak to a speed [s]."""
    peak = np.sqrt(0.5 * (end**2 + 2 * a * length))
    return (2 * peak - end) / a


@pytest.mark.parametrize(("degrees", "bounded"), [(40.0, True), (44.0, True), (46.0, False), (60.0, False)])
def test_marlin_slows_on_short_blocks_that_turn_little(degrees: float, bounded: bool) -> None:
    """Two blocks of 0.05 mm: v^2 <= a l / theta counts below 45 degrees (Marlin, planner.cpp, "small segments") and not above."""
    theta, size, limit = np.deg2rad(degrees), 0.05, 2000.0
    points = np.array([[0, 0], [size, 0], [size + size * np.cos(theta), size * np.sin(theta)]])
    s = np.cos(theta / 2)
    across = limit / np.cos(theta / 2)  # along the bisector y has the larger part
    v_sq = min(across * 0.013 * s / (1 - s), 2 * limit * size)
    if bounded:
        assert across * size / theta < v_sq
        v_sq = across * size / theta
    after = limit / max(np.cos(theta), np.sin(theta))
    found = time_of(points, unhurried("marlin"))
    assert found == pytest.approx(triangle(size, limit, np.sqrt(v_sq)) + triangle(size, after, np.sqrt(v_sq)))


def with_control(**given: object) -> Machine:
    return Machine(**{**MACHINE.model_dump(exclude_none=True), "control": given})


def corner_time(machine: Machine, name: str, size: float = 20.0) -> float:
    points = np.array([[0, 0], [size, 0], [size, size]])
    feed, stop = np.full(2, 1e9), np.zeros(3, bool)
    return predicted_time(points, feed, stop, machine, ("x", "y"), unhurried(name))


def test_what_the_machine_says_of_its_control_counts_for_that_control() -> None:
    """Right angles: each side loses (100 - v)^2 / (2 a 100), with v by the junction deviation, the jump or the corner speed given."""

    def time(v: float, a: float = 2000.0) -> float:
        return 40 / 100 + 100 / a + 2 * (100 - v) ** 2 / (2 * a * 100)

    s = np.sqrt(0.5)
    grbl = with_control(name="grbl", junction_deviation=0.04)
    assert corner_time(grbl, "grbl") == pytest.approx(time(np.sqrt(2000 * np.sqrt(2) * 0.04 * s / (1 - s))))
    assert corner_time(grbl, "marlin") == corner_time(MACHINE, "marlin"), "another control's"
    jump = with_control(name="marlin", corner_jump={"x": 8.0, "y": 6.0, "z": 0.3})
    assert corner_time(jump, "marlin") == pytest.approx(time(6.0))
    slow = with_control(name="marlin", acceleration=500.0, junction_deviation=0.02)
    v = np.sqrt(500 * 0.02 * s / (1 - s))
    assert corner_time(slow, "marlin") == pytest.approx(time(v, 500.0))
    assert corner_time(with_control(name="klipper", square_corner_velocity=11.0), "klipper") == pytest.approx(
        time(11.0)
    )


@pytest.mark.shows(
    "time-grbl, time-klipper", "compared: recorded times of their own code, on programs in ../shared"
)
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


def test_still_paths_are_refused() -> None:
    with pytest.raises(planner.InputError, match="moves nowhere"):
        time_of(np.zeros((3, 2)), CONTROLS["grbl"])
