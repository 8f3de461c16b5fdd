"""How far motions are from their path, as planning measures it: known distances, and the judge's own matching as an oracle."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from planner.delivery.path_errors import NOT_PASSED, SPARE, Errors, PathErrors
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Toolpath
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.verifier.pieces import program_pieces, widened
from planner.verifier.stream import follow

MACHINE = load_machine("router")
EPS = 0.05


def path_of(text: str) -> Toolpath:
    return toolpath_from_program(parse_program("G21 F3000\n" + text, MACHINE), MACHINE, EPS)


def along(toolpath: Toolpath, steps: int) -> np.ndarray:
    """(n, 3) places along the lines of a path, evenly spaced on each."""
    share = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    lines = [a + share * (b - a) for a, b in zip(toolpath.start, toolpath.end, strict=True)]
    return np.vstack([*lines, toolpath.end[-1:]])


def errors(toolpath: Toolpath, point: np.ndarray) -> Errors:
    t = np.arange(len(point)) * 1e-3
    half = len(t) // 2
    return PathErrors(toolpath).of([(t[:half], point[:half]), (t[half:], point[half:])])


def test_a_line_beside_the_path_is_as_far_off_all_along() -> None:
    toolpath = path_of("G1 X10\nY10\n")
    shifted = along(toolpath, 200) + np.array([0.0, 0.0, 3.0 * EPS])
    found = errors(toolpath, shifted)
    np.testing.assert_allclose(found.worst, 3.0)
    np.testing.assert_allclose(found.near, 3.0)
    assert len(found.time) == len(shifted)
    assert found.over
    inside = errors(toolpath, along(toolpath, 200) + np.array([0.0, 0.0, (1.0 - 2.0 * SPARE) * EPS]))
    assert not inside.over
    np.testing.assert_allclose(inside.worst, 1.0 - 2.0 * SPARE)


def test_a_cut_corner_is_missed_by_the_height_of_the_cut() -> None:
    toolpath = path_of("G1 X10\nY10\n")
    on, cut = along(toolpath, 1000), 1.0
    way = np.linspace(0.0, 1.0, 300)[:, None]
    chord = [10.0 - cut, 0.0, 0.0] + way * [cut, cut, 0.0]
    before, after = on[on[:, 0] < 10.0 - cut], on[on[:, 1] > cut]
    found = errors(toolpath, np.vstack([before, chord, after]))
    assert found.near[1] == pytest.approx(cut / np.sqrt(2.0) / EPS, rel=1e-4)
    assert found.worst[0] == pytest.approx(
        cut / 2.0 / EPS, rel=5e-3
    )  # halfway the chord is nearer to the other line
    assert found.near_time[1] == pytest.approx((len(before) + 150) * 1e-3, abs=2e-3)


def test_on_a_circle_the_distance_is_that_from_the_circle_itself() -> None:
    toolpath = path_of("G2 X0 Y0 I5 J0\n")
    angle = np.pi - np.linspace(0.0, 2.0 * np.pi, 4001)
    circle = np.stack([5.0 + 5.03 * np.cos(angle), 5.03 * np.sin(angle), 0.0 * angle], axis=1)
    found = errors(toolpath, circle)
    np.testing.assert_allclose(found.worst, 0.03 / EPS, rtol=1e-9)
    assert len(found.worst) == 16  # at most 22.5 degrees each
    np.testing.assert_allclose(found.near, 0.03 / EPS, rtol=1e-3)


def test_a_circle_left_out_is_seen_although_its_ends_coincide() -> None:
    toolpath = path_of("G1 X10\nG2 X10 Y0 I5 J0\nG1 X20\n")
    straight = np.stack([np.linspace(0.0, 20.0, 801), np.zeros(801), np.zeros(801)], axis=1)
    assert errors(toolpath, straight).near.max() > 0.5 * 10.0 / EPS


def test_what_a_motion_does_not_come_to_is_missed() -> None:
    toolpath = path_of("G1 X10\nX10 Y10\n")
    on = along(toolpath, 100)
    found = errors(toolpath, on[:50])
    assert (found.near[1:] == NOT_PASSED).all()
    assert found.near[0] == 0.0


PATHS = {
    "lines": "G1 X5\nX7 Y4\nX2 Y5\nX-1 Y0.4\n",
    "reversal": "G1 X5\nX1\nX6 Y0.2\n",
    "arcs": "G1 X5\nG3 X5 Y6 J3\nG2 X5 Y12 Z1 J3\nG1 X0\n",
    "curve": "G1 X2\nG5 I2 J3 P-1 Q-3 X8 Y4\nG1 X12\n",
}


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("length", [4, 15, 60])
def test_a_mean_of_the_motion_is_as_far_off_as_the_judge_finds(name: str, length: int) -> None:
    """A moving average over `length` places, the error of filters, measured by two matchings that share no code."""
    toolpath = path_of(PATHS[name])
    pieces = program_pieces(toolpath)
    vertex = pieces.vertex
    share = np.linspace(0.0, 1.0, 100, endpoint=False)[:, None]
    point = np.vstack([*(a + share * (b - a) for a, b in pairwise(vertex)), vertex[-1:]])
    padded = np.vstack([np.repeat(point[:1], length, axis=0), point, np.repeat(point[-1:], length, axis=0)])
    total = np.cumsum(padded, axis=0)
    mean = (total[length:] - total[:-length]) / length
    t = np.arange(len(mean)) * 1e-3
    wider = 16.0  # so that the judge's matching follows
    ratios: list[np.ndarray] = []
    look = follow([(t, mean)], widened(pieces, wider), each=lambda _t, ratio, _place: ratios.append(ratio))
    joint = np.flatnonzero(pieces.joint["real"])
    near = look.match.passed["near"][joint] / toolpath.tolerance
    measure = PathErrors(toolpath)
    found = measure.of([(t, mean)])
    assert found.worst.max() == pytest.approx(wider * np.concatenate(ratios).max(), abs=1e-3)
    np.testing.assert_allclose(found.near[measure.joint], near, atol=1e-4)
