"""The Bezier-pair corner of paper 002.

Two mirrored rational cubics, control points P - d u1, P - d/2 u1, P - d/4 u1, joint, ... of weights:

    sigma1 = w0 w2 / w1^2,   sigma2 = w1 w3 / w2^2            (eq. (2), (3))

With w0 = w3 = 1: w1 = (sigma1^2 sigma2)^(-1/3), w2 = (sigma1 sigma2^2)^(-1/3).

    eps       = (d/4) sin(theta/2)                            (eq. (15), beta = theta/2)
    kappa_max = sigma2 * 8 sin(theta/2) / (3 d cos^2(theta/2))    at the joint   (eq. (17))

The pair is G3 at the joint iff sigma1 = 4 - 3/sigma2 (docs/papers.md C.G3). sigma = (2/3, 0.9) has 10 % less
curvature and a smaller curvature slope than the polynomial pair sigma = (1, 1) for all turning angles, so it
is the default. The maximum is at the joint for every theta in (0, pi) if sigma2 >= 0.83; below, shallow
corners have it beside the joint, at most 0.3 % higher (tested).
"""

from dataclasses import dataclass

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.blend import ScaledShape, Shape

# Up to here retreat times advance is largest in the middle, which the error bound needs (tested).
SIGMA2_MAX = 1.5
PRODUCT_MAX = 3.0  # ... and up to here for sigma1 sigma2


@dataclass(frozen=True, kw_only=True)
class BezierCorner(ScaledShape):
    """Paper 002's corner with shape numbers sigma1, sigma2; sigma1 is fixed by the G3 condition unless given.

    Raises InputError for shape numbers outside the ranges in which the error bound of corners/blend.py holds,
    and, of sigma2, the G3 condition has a solution.
    """

    sigma2: float = 0.9
    sigma1: float | None = None

    name = "bezier"
    shape = Shape.BEZIER
    share = 0.125  # for every pair of weights: the joint is a control point

    def __post_init__(self) -> None:
        if not 0.75 < self.sigma2 <= SIGMA2_MAX:
            raise InputError(
                f"sigma2 = {self.sigma2}; allowed are 3/4 < sigma2 <= {SIGMA2_MAX}: the joint is G3 above the one, "
                "the error bound of corners/blend.py holds up to the other"
            )
        if self.sigma1 is not None and not 0 < self.sigma1 <= PRODUCT_MAX / self.sigma2:
            raise InputError(
                f"sigma1 = {self.sigma1}; allowed are 0 < sigma1 <= {PRODUCT_MAX}/sigma2, for which the error bound of "
                "corners/blend.py holds"
            )

    @property
    def weights(self) -> tuple[float, float]:
        """Inner weights (w1, w2) for w0 = w3 = 1."""
        sigma1 = 4.0 - 3.0 / self.sigma2 if self.sigma1 is None else self.sigma1
        return (sigma1**2 * self.sigma2) ** (-1 / 3), (sigma1 * self.sigma2**2) ** (-1 / 3)

    def params(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n, 4) parameters for tangent lengths d = `reach` (n,) [mm], at any feed (n,)."""
        w1, w2 = self.weights
        rows = np.zeros((len(reach), 4))
        rows[:, 0], rows[:, 1], rows[:, 2] = reach, w1, w2
        return rows
