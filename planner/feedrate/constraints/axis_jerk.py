"""The limits of the axis jerks, by differentiating r(s(t)) three times:

    | r'_k j + 3 r''_k feed u + r'''_k feed^3 | <= j_k         rows, at both ends of every interval

and at a constant speed, u = j = 0, feed <= (j_k / |r'''_k|)^(1/3). Methods of second order do not use them.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.feedrate.constraints.limit import RowLimit, RowPoint


def feed_sq_at_constant_speed(d3: FloatArray, limits: FloatArray) -> FloatArray:
    """(P,) x <= min_k (j_k/|r'''_k|)^(2/3) [mm2/s2]; r''' in d3 (P, A), limits (P, A) or (A,); or inf."""
    with np.errstate(divide="ignore"):
        return (np.abs(d3) / limits).max(axis=1) ** (-2.0 / 3.0)


class AxisJerk(RowLimit):
    """|r'_k j + 3 r''_k feed u + r'''_k feed^3| <= j_k."""

    name, unit, order = "jerk", "mm/s3", 3

    def row(self, at: RowPoint) -> FloatArray:
        turning = np.sqrt(at.x) * (3.0 * at.d2 * at.u + at.d3 * at.x)
        return at.d1 * at.jerk + turning
