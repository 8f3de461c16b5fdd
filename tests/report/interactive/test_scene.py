"""All of a path is in sight when its figure is first shown."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.report.plotly_figure import scene_in_box

TITLES = dict.fromkeys("xyz", "")
PATHS = {
    "an L as wide as high": [[0, 0, 0], [20, 0, 0], [20, 20, 0]],
    "an L three times as high as wide": [[0, 0, 0], [20, 0, 0], [20, 60, 0]],
    "an L five times as wide as high": [[-80, 3, 0], [20, 3, 0], [20, 23, 0]],
    "a turned part": [[5, 0, -70], [9, 0, -30], [10, 0, 0]],
    "a wall": [[0, 4, 0], [0, 30, 0], [0, 30, 25]],
    "a cube": [[0, 0, 0], [30, 0, 0], [30, 30, 0], [30, 30, 30], [0, 0, 30]],
    "a tower": [[0, 0, 0], [10, 0, 30], [10, 10, 60], [0, 10, 120]],
    "a line": [[0, 0, 0], [0, 0, 15]],
}


def on_screen(scene: dict, points: np.ndarray) -> np.ndarray:
    """(n, 2) places right and up [half heights of the box], as plotly's orthographic camera has them: the scene is `aspectratio` long
    over the ranges of its axes, with its middle in the middle of the box."""
    ratio, camera = np.array(list(scene["aspectratio"].values())), scene["camera"]
    ranges = np.array([scene[f"{letter}axis"]["range"] for letter in "xyz"])
    placed = (points - ranges.mean(axis=1)) / np.ptp(ranges, axis=1) * ratio
    eye, up = (np.array([camera[name][letter] for letter in "xyz"]) for name in ("eye", "up"))
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    above = np.cross(eye, right)
    return placed @ np.stack([right, above / np.linalg.norm(above)], axis=1)


@pytest.mark.parametrize("name", PATHS)
def test_the_whole_path_is_in_sight_and_fills_the_box(name):
    points = np.array(PATHS[name], dtype=float)
    places = on_screen(scene_in_box(points, TITLES), points)
    assert np.abs(places).max() <= 0.9, "half of the height of the box is 1, and titles need some of it"
    assert np.ptp(places, axis=0).max() >= 1.2


def test_lengths_have_one_scale():
    """A circle is no ellipse: a millimetre is as long along every axis."""
    scene = scene_in_box(np.array(PATHS["an L three times as high as wide"], dtype=float), TITLES)
    scales = [scene["aspectratio"][letter] / np.ptp(scene[f"{letter}axis"]["range"]) for letter in "xyz"]
    np.testing.assert_allclose(scales, scales[0], rtol=1e-12)


def test_the_figure_of_a_plan_shows_the_corner():
    corner = planner.path([[0, 0], [20, 0], [20, 20]], feed=100.0)
    figure = planner.plan(corner, "mill", method="stop").plot.path(color="limit")
    scene = figure.layout.scene.to_plotly_json()
    points = np.array([[0, 0, 0], [20, 0, 0], [20, 20, 0]], dtype=float)
    assert np.abs(on_screen(scene, points)).max() <= 0.9
