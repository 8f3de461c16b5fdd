"""What a step of path and feed together minimises (combined.py), and what it gains."""

from __future__ import annotations

import numpy as np

from planner.base.kernels import njit
from planner.smoothing.basis import ORDER
from planner.smoothing.combined_matrix import add_objective, blocks_of, scatter

SLOWER = 10.0  # how much theta counts beside jerks in the pull [-]
HELD = 0.8  # of the programmed feed: from there on the feed is held [-]


@njit(cache=True, error_model="numpy")
def sideways(places, p):
    """What a square of the velocity across the path costs at a place [s3/mm2] (combined.py): where the feed is held."""
    axes = places.jet.shape[2]
    share = places.share[p, 3 * axes]
    return places.weight[p] / (share * places.limit[p, 3 * axes]) ** 2 if share > HELD else 0.0


@njit(cache=True, error_model="numpy")
def objective_of_window(places, window, pull, pulled, band, linear):
    """Add to the matrix `band` and to linear (n, A+1) the objective of combined.py.

    window       : first and last + 1 of the places, and the control point from which they count
    pull, pulled : as there, and the jerks (A,) that it counts in
    """
    axes, (first, last, lo) = len(pulled), window
    values, source, target = blocks_of(axes + 1)
    basis, of_axes = places.basis.reshape(-1, 4 * ORDER), np.empty(axes)
    for p in range(first, last):
        time = places.weight[p]
        for k in range(axes):
            of_axes[k] = pull * time / pulled[k] ** 2
        add_objective(values, basis, places.along, p, of_axes, SLOWER * pull * time, sideways(places, p))
        i = places.span[p] - lo
        for b in range(ORDER):
            linear[i + b, axes] += time * basis[p, b]
        if p + 1 == last or places.span[p + 1] != places.span[p]:
            scatter(values, source, target, i, axes + 1, band)


@njit(cache=True, error_model="numpy")
def gain_of_step(places, y):
    """By how much the step y (n, A+1) shortens the time (combined.py) [s]."""
    axes = places.jet.shape[2]
    gain = 0.0
    for p in range(len(places.span)):
        i, basis = places.span[p], places.basis[p]
        theta, square, along = 0.0, 0.0, 0.0
        for b in range(ORDER):
            theta += basis[0, b] * y[i + b, axes]
        for k in range(axes):
            step = 0.0
            for b in range(ORDER):
                step += basis[1, b] * y[i + b, k]
            square += step * step
            along += step * places.along[p, 0, k]
        gain -= places.weight[p] * theta + 0.5 * sideways(places, p) * (square - along * along)
    return gain
