"""Random polylines."""

from __future__ import annotations

import numpy as np


def random_polyline(rng, corners, axes=3, shortest=-2.0, sharpest=170.0):
    """Steps of 10^shortest to 10 mm, turning by up to `sharpest` degrees."""
    steps = np.empty((corners + 1, axes))
    direction = rng.normal(size=axes)
    for k in range(corners + 1):
        direction /= np.linalg.norm(direction)
        steps[k] = direction * 10.0 ** rng.uniform(shortest, 1.0)
        side = rng.normal(size=axes)
        side -= side @ direction * direction
        angle = np.deg2rad(sharpest) * rng.uniform() ** 2
        direction = np.cos(angle) * direction + np.sin(angle) * side / np.linalg.norm(side)
    return np.vstack([np.zeros(axes), np.cumsum(steps, axis=0)])
