"""The legs of the free optimum (run.py): where they begin, and their coefficients."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Toolpath


def edges_of(toolpath: Toolpath) -> Array:
    """(R+1,) joints between legs: those of geometry/legs.py, and where feed or budget, the larger one of its
    joints', change on a line."""
    budget = np.maximum(toolpath.tolerance[:-1], toolpath.tolerance[1:])
    edge = np.zeros(len(toolpath) + 1, dtype=bool)
    edge[legs_of(toolpath).first] = True
    edge[1:-1] |= (toolpath.feed[1:] != toolpath.feed[:-1]) | (np.diff(budget) != 0)
    return np.flatnonzero(edge)


def shapes_of(toolpath: Toolpath, row: Array, vertex: FloatArray) -> dict[str, FloatArray]:
    """The coefficients of the legs (`TubeRun`).

    row    : (R,) the segments that the legs begin with
    vertex : (R+1, A) [mm]
    """
    arc, arcs, curve = toolpath.arc[row], toolpath.arcs, np.flatnonzero(toolpath.curve[row] >= 0)
    chord = np.diff(vertex, axis=0)
    length = np.where(toolpath.straight[row], np.linalg.norm(chord, axis=1), toolpath.length[row])
    shape = {
        "length": length,
        "base": vertex[:-1].copy(),
        "drift": chord / length[:, None],
        "e1": np.zeros_like(chord),
        "e2": np.zeros_like(chord),
        "radius": np.zeros(len(row)),
        "rate": np.zeros(len(row)),
    }
    curved = arc >= 0
    for name in shape.keys() - {"length"}:
        shape[name][curved] = getattr(arcs, "center" if name == "base" else name)[arc[curved]]
    if len(curve):
        bend = toolpath.curvature[row[curve]]
        third, fourth = toolpath.curves.part(toolpath.curve[row[curve]]).further_bounds(length[curve])
        shape["drift"][curve], shape["radius"][curve] = 0.0, 1.0 / bend
        shape["rate"][curve] = np.maximum(third / bend, np.sqrt(fourth / bend))
    return shape
