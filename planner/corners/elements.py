"""Elements: the smooth path as a sequence of curves, the free part of a leg or a corner, each over its own parameter w.

An element is numbered r >= 0 for the free part of leg r (w is the leg's x [mm]) and ~k < 0 for the corner at joint k (w in [0, 1]).
This file is the one place where an element's geometry is turned from w to arc length:

    r'   = T = B'/|B'|
    r''  = (B'' - T (T.B'')) / |B'|^2
    r''' = (B''' - (|B'| r''.B'' + T.B''') T - |B'| (T.B'') r'')/|B'|^3 - 2 (T.B'') r''/|B'|^2

with ' on the left for d/ds and on the right for d/dw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planner.arrays import FloatArray
from planner.corners.blend import corner_point
from planner.corners.smooth import SmoothPath
from planner.geometry.legs import CurveTable, leg_point

# Four-point Gauss-Legendre rule on [0, 1].
_ROOT_INNER, _ROOT_OUTER = (np.sqrt(3 / 7 + sign * 2 / 7 * np.sqrt(6 / 5)) for sign in (-1, 1))
_HALF_INNER, _HALF_OUTER = ((18 + sign * np.sqrt(30)) / 72 for sign in (1, -1))
GAUSS_NODES = np.array([1 - _ROOT_OUTER, 1 - _ROOT_INNER, 1 + _ROOT_INNER, 1 + _ROOT_OUTER]) / 2
GAUSS_WEIGHTS = np.array([_HALF_OUTER, _HALF_INNER, _HALF_INNER, _HALF_OUTER])


class ElementTable(NamedTuple):
    """What the kernels need of a smooth path."""

    curves: CurveTable
    shape: int
    params: FloatArray  # (R+1, 4)


def element_table(path: SmoothPath) -> ElementTable:
    """The kernels' view of `path`."""
    return ElementTable(path.legs.table, int(path.corner.shape), path.params)


@njit(cache=True, error_model="numpy")
def element_point(table, element, w, w_ref, work, out):
    """Point and three w-derivatives of an element at w, into out (4, A); work is (2, 4, A) scratch."""
    if element >= 0:
        leg_point(table.curves, element, w, out)
    else:
        corner_point(table.curves, ~element, table.shape, table.params, w, w_ref, work[0], work[1], out)


@njit(cache=True, error_model="numpy")
def to_arc_length(out):
    """Turn w-derivatives in out (4, A) into arc-length derivatives, in place; returns |dB/dw|."""
    axes = out.shape[1]
    speed_sq = 0.0
    along2 = 0.0  # T . B''
    along3 = 0.0  # T . B'''
    for k in range(axes):
        speed_sq += out[1, k] * out[1, k]
    speed = np.sqrt(speed_sq)
    for k in range(axes):
        out[1, k] /= speed
        along2 += out[1, k] * out[2, k]
        along3 += out[1, k] * out[3, k]
    bend = 0.0  # r'' . B''
    for k in range(axes):
        second = (out[2, k] - out[1, k] * along2) / speed_sq
        bend += second * out[2, k]
        out[3, k] = (out[3, k] - out[1, k] * along3 - speed * second * along2) / (speed_sq * speed)
        out[3, k] -= 2.0 * along2 * second / speed_sq
        out[2, k] = second
    for k in range(axes):
        out[3, k] -= out[1, k] * bend / speed_sq
    return speed


@njit(cache=True, error_model="numpy")
def element_length(table, element, w0, w1, w_ref, work, out):
    """Arc length of an element between w0 and w1 [mm]."""
    if element >= 0 and table.curves.arc[element] < 0:
        return w1 - w0
    total = 0.0
    for g in range(4):
        element_point(table, element, w0 + (w1 - w0) * GAUSS_NODES[g], w_ref, work, out)
        speed_sq = 0.0
        for k in range(out.shape[1]):
            speed_sq += out[1, k] * out[1, k]
        total += GAUSS_WEIGHTS[g] * np.sqrt(speed_sq)
    return total * (w1 - w0)
