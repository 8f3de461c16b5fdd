"""The block of every point: within the tolerance of its path, in order, none left out that takes longer than a sample."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from quick import slow_but

import planner
from planner.geometry.build import toolpath_from_program
from planner.geometry.point_matching import CHORD_FRACTION, SAME_PLACE, SegmentsInOrder
from planner.geometry.toolpath import Toolpath
from planner.machine import load_machine
from planner.nc.reader import parse_program

MACHINE = load_machine("router")
EPS = 0.05


def path_of(text: str, tolerance: float = EPS) -> Toolpath:
    return toolpath_from_program(parse_program("G21 F3000\n" + text, MACHINE), MACHINE, tolerance)


def distance(toolpath: Toolpath, point: np.ndarray, segment: int) -> float:
    """Distance of a point from a segment: arcs by their own formula at many places, and at many between those beside the nearest."""
    if toolpath.arc[segment] < 0:
        start, u = toolpath.start[segment], toolpath.end[segment] - toolpath.start[segment]
        share = min(max((point - start) @ u / (u @ u), 0.0), 1.0)
        return float(np.linalg.norm(point - start - share * u))
    arcs, row = toolpath.arcs, toolpath.arc[segment]
    low, high = 0.0, toolpath.length[segment]
    for _ in range(2):
        x = np.linspace(low, high, 201)[:, None]
        c, s = np.cos(arcs.rate[row] * x), np.sin(arcs.rate[row] * x)
        on = arcs.center[row] + arcs.radius[row] * (c * arcs.e1[row] + s * arcs.e2[row]) + arcs.drift[row] * x
        away = np.linalg.norm(on - point, axis=1)
        nearest = int(away.argmin())
        low, high = x[max(nearest - 1, 0), 0], x[min(nearest + 1, 200), 0]
    return float(away.min())


def segments_at(toolpath, point, feed):
    """(T,) segment that each point (T, A) is at; None where that cannot be told."""
    found = SegmentsInOrder(toolpath)
    found.take(point, feed)
    runs = found.runs()
    return None if runs is None else np.repeat(runs[1], np.diff(np.append(runs[0], len(point))))


def at(text: str, points: list[tuple[float, float]], feed: float = 1.0) -> list[int] | None:
    xyz = np.array([(x, y, 0.0) for x, y in points])
    found = segments_at(path_of(text), xyz, np.full(len(xyz), feed))
    return None if found is None else found.tolist()


def test_a_point_is_at_the_nearest_block() -> None:
    assert at("G1 X1\nY1", [(0, 0), (0.5, 0), (0.96, 0.01), (0.99, 0.04), (1, 1)]) == [0, 0, 0, 1, 1]


def test_standing_on_a_joint_is_the_block_before() -> None:
    assert at("G1 X1\nG4 P1\nX2", [(0, 0), (1, 0), (1, 0), (1, 0), (1.1, 0), (2, 0)]) == [0, 0, 0, 0, 1, 1]


def test_order_tells_blocks_apart_that_lie_on_each_other() -> None:
    there_and_back = [0, 0.5, 1.0, 0.6, 0.02, 0.3, 0.9, 1.0]
    assert at("G1 X1\nX0\nX1", [(x, 0) for x in there_and_back]) == [0, 0, 0, 1, 1, 2, 2, 2]


def test_a_crossing_is_no_short_cut() -> None:
    loop = "G1 X1\nX1 Y1\nX0.5 Y1\nX0.5 Y-1"  # crosses its first block at X0.5
    points = [
        (0, 0),
        (0.5, 0),
        (0.98, 0.02),
        (1, 0.5),
        (1, 0.98),
        (0.7, 1),
        (0.5, 0.98),
        (0.5, 0.02),
        (0.5, -1),
    ]
    assert at(loop, points) == [0, 0, 0, 1, 1, 2, 3, 3, 3]


def test_blocks_without_room_for_a_sample_are_passed_over() -> None:
    micro = "\n".join(f"G1 X{k / 1000}" for k in range(1, 101))
    found = at(micro, [(0, 0), (0.0305, 0), (0.0705, 0), (0.1, 0)])
    assert found == [0, 30, 70, 99]


def test_the_faster_block_is_named_where_both_can_be_meant() -> None:
    text = "G1 F60 X1\nF6000 X2"
    points = [(0, 0), (0.99, 0), (1.01, 0), (2, 0)]
    assert at(text, points, feed=0.5) == [0, 0, 1, 1]
    assert at(text, points, feed=50.0) == [0, 1, 1, 1]


def test_a_block_inside_the_tolerance_is_not_entered_before_its_start_is_reached() -> None:
    """The second block comes back over the first: its start is missed by 57 um at X4.96 and by 47 um at X4.975."""
    text = "G1 X5\nX4.95 Y0.05\nY1"
    points = [(0, 0), (4.9, 0.04), (4.96, 0.04), (4.975, 0.04), (4.955, 0.045), (4.95, 0.5), (4.95, 1)]
    assert at(text, points) == [0, 0, 0, 1, 1, 2, 2]


def test_no_block_is_named_where_the_motion_leaves_the_path_or_does_not_end() -> None:
    assert at("G1 X1\nY1", [(0, 0), (0.5, 99), (1, 1)]) is None
    assert at("G1 X1\nY1", [(0, 0), (0.5, 0)]) is None


@pytest.mark.parametrize("seed", range(4))
def test_laws_on_random_paths(seed: int) -> None:
    """A motion made of the path itself, moved by up to 0.9 tolerances: named in order, within the tolerance."""
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.uniform(-2.5, 2.5, 150))
    length = rng.choice([0.003, 0.03, 0.3, 3.0], 150)
    xy = np.cumsum(length[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1), axis=0)
    toolpath = path_of("\n".join(f"G1 X{x:.5f} Y{y:.5f}" for x, y in xy))
    place = np.append(0.0, np.cumsum(toolpath.length))
    s = np.append(np.arange(0.0, place[-1], 0.02), place[-1])
    point = np.stack(
        [np.interp(s, place, np.append(toolpath.start[:, k], toolpath.end[-1, k])) for k in range(3)], axis=1
    )
    slide = rng.normal(size=(7, 3)) @ np.diag([1, 1, 0])
    offset = np.stack([np.interp(s, np.linspace(0, s[-1], 7), slide[:, k]) for k in range(3)], axis=1)
    offset *= 0.9 * EPS / np.maximum(np.linalg.norm(offset, axis=1), 1.0)[:, None]
    offset[[0, -1]] = 0.0
    segment = segments_at(toolpath, point + offset, np.ones(len(s)))
    assert segment is not None
    assert (np.diff(segment) >= 0).all()
    off = [distance(toolpath, p, i) for p, i in zip(point + offset, segment, strict=True)]
    assert max(off) <= EPS * (1.0 + CHORD_FRACTION) + 2.0 * SAME_PLACE
    missing = np.setdiff1d(np.arange(len(toolpath)), segment)
    assert (toolpath.length[missing] <= 0.02 + 2.0 * EPS).all()
    np.testing.assert_array_equal(in_parts(toolpath, point + offset, rng), segment)


def in_parts(toolpath: Toolpath, point: np.ndarray, rng: np.random.Generator) -> np.ndarray | None:
    """The segments of points that come in parts of one to nine."""
    found, done = SegmentsInOrder(toolpath), 0
    while done < len(point):
        part = point[done : done + rng.integers(1, 10)]
        found.take(part, np.ones(len(part)))
        done += len(part)
    runs = found.runs()
    if runs is None:
        return None
    first, segment = runs
    assert (np.diff(segment) != 0).all()
    return np.repeat(segment, np.diff(np.append(first, len(point))))


def test_what_later_points_decide_is_decided_in_parts_too() -> None:
    """Two blocks on each other: only the end tells on which of them each point is."""
    x = np.concatenate([np.linspace(0, 1, 40), np.full(30, 0.99), np.linspace(0.99, 0, 40)])
    point = np.stack([x, 0.01 * np.sin(7 * x), 0 * x], axis=1)
    point[[0, -1], 1] = 0.0
    toolpath = path_of("G1 X1\nX0")
    found = in_parts(toolpath, point, np.random.default_rng(0))
    assert found is not None
    np.testing.assert_array_equal(found, segments_at(toolpath, point, np.ones(len(x))))
    assert in_parts(toolpath, point[:30], np.random.default_rng(0)) is None


def mixed(blocks: int) -> str:
    """Lines of very different lengths, an arc, a dwell, and feeds that change."""
    rng = random.Random(1)
    x = y = turn = 0.0
    lines = ["G21 G90 G17 G64 P0.05 F3000"]
    for k in range(blocks):
        turn += rng.uniform(-1.5, 1.5)
        step = rng.choice([0.03, 0.1, 0.3, 2.0, 4.0])
        x, y = x + step * math.cos(turn), y + step * math.sin(turn)
        feed = f" F{rng.choice([1000, 2000, 3000])}" if k % 5 == 0 else ""
        lines.append(f"G1 X{x:.4f} Y{y:.4f}{feed}")
        if k == blocks // 2:
            lines.append("G4 P0.05")
            lines.append(f"G3 X{x + 2:.4f} Y{y:.4f} I1")
            x += 2.0
    return "\n".join([*lines, "M2"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "method",
    slow_but(
        ("second-order", "stop"),
        ["optimal", "second-order", "bezier", "kinematic", "fir", "fir-spline", "stop"],
    ),
)
def test_every_method_names_the_block_it_is_at(method: str) -> None:
    program = parse_program(mixed(16), MACHINE)
    plan = planner.plan(program, MACHINE, method=method).require()
    toolpath, trajectory = plan.toolpath, plan.trajectory
    assert trajectory is not None
    assert plan.verdict is not None
    assert plan.verdict.passed
    segment = np.searchsorted(toolpath.block, trajectory.block)
    assert (trajectory.line == toolpath.line[segment]).all()
    assert (np.diff(segment) >= 0).all()
    off = [distance(toolpath, p, i) for p, i in zip(trajectory.position, segment, strict=True)]
    assert max(off) <= EPS * (1.0 + CHORD_FRACTION) + 2.0 * SAME_PLACE
    step = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
    for missing in np.setdiff1d(np.arange(len(toolpath)), segment):
        before = int(np.searchsorted(segment, missing)) - 1
        assert toolpath.length[missing] <= step[max(before - 1, 0) : before + 2].max()
    assert (trajectory.feed <= toolpath.feed[segment] * (1.0 + 1e-6)).all()
