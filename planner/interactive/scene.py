"""The first view of a path in 3-D: along its thinnest direction if it is flat, and as large as the box allows.

plotly's orthographic camera shows two units of its scene to the height of the box, from any distance; what a scene measures in those
units is its aspect ratio. The report's pages do the same in the browser, where the size of the box is known (report/html/view.js).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import LINEAR_AXES

FLAT = 0.12  # third extent over the largest below which a path is seen along it
THIN = (
    FLAT / 4
)  # an axis is drawn as long as this share of the longest one at least [-], so that a line has a scene
FILLED = 0.8  # share of the box that the path fills [-]; titles of axes stand in the rest
ROOM = 1.0  # width of the box without its colour bar over its height [-], at least: a notebook's column
DISTANCE = 2.0  # of the eye, in units of the scene [-]; it changes nothing in an orthographic view
AWAY = np.array([1.2, -1.3, 0.9])  # where a path that is not flat is seen from


def fitted_scene(points: FloatArray) -> dict[str, Any]:
    """plotly's `scene` of a path: `aspectratio`, `camera`, and the ranges of the axes.

    points : (n, 3) x, y, z [mm]
    """
    low, high = points.min(axis=0), points.max(axis=0)
    length = high - low
    size = max(float(length.max()), 1e-9)
    thin = int(length.argmin())
    flat = bool(length[thin] < FLAT * size)
    right, up = _flat_view(thin, length) if flat else _view_of_a_body()
    ratio = np.maximum(length / size, THIN)
    zoom = FILLED * 2.0 * min(ROOM / float(ratio @ np.abs(right)), 1.0 / float(ratio @ np.abs(up)))
    middle, half = 0.5 * (low + high), 0.5 * ratio * size
    axes = {
        f"{letter}axis": {
            "title": {"text": f"{letter} [mm]"},
            "range": [float(middle[k] - half[k]), float(middle[k] + half[k])],
            "visible": not (flat and k == thin),
        }
        for k, letter in enumerate(LINEAR_AXES)
    }
    camera = {
        "projection": {"type": "orthographic"},
        "eye": _named(np.cross(right, up) * DISTANCE),
        "up": _named(up if flat else np.array([0.0, 0.0, 1.0])),
    }
    return {"aspectmode": "manual", "aspectratio": _named(ratio * zoom), "camera": camera, **axes}


def _flat_view(thin: int, length: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Right and up of a view along axis `thin`; what is longer along z than along x, a turned part, lies down."""
    x, y, z = np.eye(3)
    if thin == 1:
        return (z, x) if length[2] > length[0] else (x, z)
    return (y, z) if thin == 0 else (x, y)


def _view_of_a_body() -> tuple[FloatArray, FloatArray]:
    eye = AWAY / np.linalg.norm(AWAY)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return right, np.cross(eye, right)


def _named(values: FloatArray) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))
