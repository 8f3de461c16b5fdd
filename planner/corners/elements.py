"""Elements: the smooth path as curves, free parts of legs, corners, spans, each over its own w.

Of a path with R legs an element is numbered r in [0, R) for what is free of leg r (w is the leg's x [mm]), ~k
< 0 for the corner at joint k (w in [0, 1]), and R + i for span i of the spline (w in [0, 1]). This file is
the one place where an element's geometry is turned from w to arc length:

    r'   = T = B'/|B'|
    r''  = (B'' - T (T.B'')) / |B'|^2
    r''' = (B''' - (|B'| r''.B'' + T.B''') T - |B'| (T.B'') r'')/|B'|^3 - 2 (T.B'') r''/|B'|^2

with ' on the left for d/ds and on the right for d/dw.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.corners.blend import CORNER_DTYPE, corner_point, shape_at
from planner.corners.own import PolynomialCorner
from planner.corners.smooth import SmoothPath
from planner.geometry.legs import leg_point, leg_tangent
from planner.geometry.spline import span_point, span_tangent

# Eight-point Gauss-Legendre rule on [0, 1]: on the widest grid interval, a quarter of a corner, good to 1e-10
# of the length (four points leave 4e-6, which shows as feed when positions are differenced).
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
GAUSS_NODES, GAUSS_WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0


class ElementTable(NamedTuple):
    """The records of a smooth path with R legs, for the kernels."""

    legs: Array  # (R,) records, geometry/legs.py
    corners: Array  # (R+1,) records, corners/blend.py
    spans: Array  # (S,) records, geometry/spline.py


class ElementIntervals(NamedTuple):
    """P intervals on the elements of a smooth path, for kernels; the first three are its `ElementTable`."""

    legs: Array
    corners: Array
    spans: Array
    element: Array  # (P,) number of the element
    w0: FloatArray  # (P,) its parameter at the interval's left end
    w1: FloatArray  # (P,) and at the right one


def element_table(path: SmoothPath) -> ElementTable:
    """The records of a path that the kernels evaluate."""
    corners = np.zeros(len(path.params), CORNER_DTYPE)
    corners["shape"], corners["params"] = int(path.corner.shape), path.params
    corners["scale"] = path.scale
    if isinstance(path.corner, PolynomialCorner):
        corners["own"] = path.corner.coefficients
    return ElementTable(path.legs.table, corners, path.spline.spans)


@njit(cache=True, error_model="numpy")
def is_straight(legs, element):
    """True for the element that is free of a straight leg; legs (R,): records of geometry/legs.py."""
    return 0 <= element < len(legs) and not legs[element].round


@njit(cache=True, error_model="numpy")
def element_point(legs, corners, spans, element, w, w_ref, work, out):
    """Point [mm] and three w-derivatives of an element at w, into out (4, A).

    w_ref : a parameter inside the interval that is meant; it chooses the branch where two curves of a corner
            meet
    work  : (2, 4, A) scratch
    """
    if element >= len(legs):
        span_point(spans, element - len(legs), w, out)
    elif element >= 0:
        leg_point(legs, element, w, out)
    else:
        corner_point(legs, corners, ~element, w, w_ref, work[0], work[1], out)


@njit(cache=True, error_model="numpy")
def to_arc_length(out):
    """Turn the w-derivatives in out (4, A) into arc-length derivatives, in place (module text); returns
    |dB/dw| [mm]."""
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
def _element_speed(legs, corners, spans, element, w, w_ref, out):
    """|dB/dw| at w; out (4, A) is scratch."""
    if element >= len(legs):
        span_tangent(spans, element - len(legs), w, out[0])
    elif element >= 0:
        leg_tangent(legs, element, w, out[0])
    else:
        k = ~element
        X, Y = shape_at(corners[k], w, w_ref)
        leg_tangent(legs, k - 1, legs[k - 1].length - X[0], out[0])
        leg_tangent(legs, k, Y[0], out[1])
        for a in range(out.shape[1]):
            out[0, a] = Y[1] * out[1, a] - X[1] * out[0, a]
    speed_sq = 0.0
    for a in range(out.shape[1]):
        speed_sq += out[0, a] * out[0, a]
    return np.sqrt(speed_sq)


@njit(cache=True, error_model="numpy")
def element_length(legs, corners, spans, element, w0, w1, w_ref, out):
    """Arc length of an element between w0 and w1 [mm], by eight Gauss points; `w_ref` as of `element_point`,
    out (4, A) is scratch."""
    if is_straight(legs, element):
        return w1 - w0
    total = 0.0
    for g in range(len(GAUSS_NODES)):
        w = w0 + (w1 - w0) * GAUSS_NODES[g]
        total += GAUSS_WEIGHTS[g] * _element_speed(legs, corners, spans, element, w, w_ref, out)
    return total * (w1 - w0)
