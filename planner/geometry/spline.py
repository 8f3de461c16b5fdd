"""Splines: smooth curves that replace legs and corners, in runs, as polynomials of degree five, one per span.

On a span the point is sum_m coef[m] tau^m, tau in [0, 1]; it stands for the programmed path from the place
`begin` to `begin + width`, counted along the legs from the start of the job [mm].
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray, freeze, room
from planner.base.kernels import njit

DEGREE = 5  # of every span: r''' is continuous where spans meet, so that jerk is, and r'''' jumps


def span_dtype(axes: int) -> np.dtype:
    """Record of one span over `axes` axes, with `room` for more (module text)."""
    coef = ("coef", np.float64, (DEGREE + 1, room(axes)))
    return np.dtype([("begin", np.float64), ("width", np.float64), coef])


@dataclass(frozen=True, eq=False, kw_only=True)
class Spline:
    """Q runs of spans, in the order of the path; S spans in all."""

    first: Array  # (Q+1,) run q holds the spans first[q] : first[q+1]
    # joint_first and joint_last: (Q,) the joints between legs that run q replaces; it begins on the leg
    # before the first of them and ends on the leg after the last
    joint_first: Array
    joint_last: Array
    # x_first and x_last: (Q,) where on those legs [mm]
    x_first: FloatArray
    x_last: FloatArray
    spans: Array  # (S,) records of `span_dtype`
    budget: FloatArray  # (S,) what the shape leaves of the tolerance for chord and filter errors, proved [mm]

    def __post_init__(self) -> None:
        runs = len(self.joint_first)
        freeze(self, "first", np.int64, (runs + 1,))
        freeze(self, "joint_first joint_last", np.int64, (runs,))
        freeze(self, "x_first x_last", np.float64, (runs,))
        freeze(self, "budget", np.float64, (len(self.spans),))

    def __len__(self) -> int:
        return len(self.joint_first)


def no_spline(axes: int) -> Spline:
    """The spline of a path on which no corner is replaced, over `axes` axes."""
    none = np.zeros(0, np.int64)
    return Spline(
        first=np.zeros(1, np.int64),
        joint_first=none,
        joint_last=none,
        x_first=np.zeros(0),
        x_last=np.zeros(0),
        spans=np.zeros(0, span_dtype(axes)),
        budget=np.zeros(0),
    )


@njit(cache=True, error_model="numpy")
def span_point(spans, i, tau, out):
    """Point [mm] and three tau-derivatives of span i at tau in [0, 1], into out (4, A); spans: records of
    `span_dtype`."""
    coef = spans[i].coef
    for k in range(out.shape[1]):
        value, first, second, third = 0.0, 0.0, 0.0, 0.0
        for m in range(DEGREE, -1, -1):
            third = third * tau + 3.0 * second
            second = second * tau + 2.0 * first
            first = first * tau + value
            value = value * tau + coef[m, k]
        out[0, k], out[1, k], out[2, k], out[3, k] = value, first, second, third


@njit(cache=True, error_model="numpy")
def span_tangent(spans, i, tau, out):
    """First tau-derivative of span i at tau in [0, 1], into out (A,); spans: records of `span_dtype`."""
    coef = spans[i].coef
    for k in range(len(out)):
        value = 0.0
        for m in range(DEGREE, 0, -1):
            value = value * tau + m * coef[m, k]
        out[k] = value
