"""A user's corner shape: the retreat X = d f(w) as a polynomial, the advance Y = d f(1 - w).

    class Wide(PolynomialCorner):
        name = "wide"

        def retreat(self, w):
            return (1 - w) ** 3 * (1 + w)

f falls from 1 to 0 on [0, 1] and ends with f = f' = f'' = 0, so that the corner leaves every leg with its
tangent and its curvature (corners/blend.py, where the error bound asks for f(w) f(1 - w) <= f(1/2)^2 as
well). All of that is checked. The kernels know f by the coefficients of z^3 ... z^12 with z = 1 - w.
"""

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.corners.blend import OWN_TERMS, ScaledShape, Shape

LOWEST = 3  # power of z
PLACES = 1001  # at which f is looked at
POLYNOMIAL = 1e-9  # f may differ from its polynomial by so much [-]
ROUNDING = 1e-12  # of the values of f [-]


class PolynomialCorner(ScaledShape, ABC):
    """A shape of corners with the retreat and advance of the module's text; `name` is what plans call it."""

    name: str = ""
    shape = Shape.OWN

    @abstractmethod
    def retreat(self, w: FloatArray) -> FloatArray:
        """(n,) f at the parameters w (n,) in [0, 1] [-]."""

    @cached_property
    def coefficients(self) -> FloatArray:
        """(K,) coefficients of z^3, z^4 ... [-], K = `OWN_TERMS`. Raises InputError for other f."""
        z = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, PLACES))
        f = np.broadcast_to(np.asarray(self.retreat(1.0 - z), dtype=np.float64), z.shape)
        if not np.isfinite(f).all() or abs(f[-1] - 1.0) > POLYNOMIAL or abs(f[0]) > POLYNOMIAL:
            self._refuse(f"it must fall from 1 to 0, and goes from {f[-1]:.6g} to {f[0]:.6g}")
        basis = z[:, None] ** LOWEST * np.polynomial.chebyshev.chebvander(2.0 * z - 1.0, OWN_TERMS - 1)
        found, *_ = np.linalg.lstsq(basis, f, rcond=None)
        if np.abs(basis @ found - f).max() > POLYNOMIAL:
            self._refuse(
                f"it must be a polynomial of degree {LOWEST + OWN_TERMS - 1} at most that ends with a triple zero"
            )
        power = np.polynomial.Chebyshev(found, domain=[0.0, 1.0]).convert(kind=np.polynomial.Polynomial).coef
        coefficients = np.zeros(OWN_TERMS)
        coefficients[: len(power)] = power / power.sum()
        if (np.diff(f) < -ROUNDING).any() or f[-1] - f[-2] <= ROUNDING:
            self._refuse("it must fall all the way, from its beginning on")
        product = f * np.interp(1.0 - z, z, f)  # the places are symmetric
        if product.max() > f[PLACES // 2] ** 2 * (1.0 + POLYNOMIAL):
            self._refuse("f(w) f(1 - w) must be largest at w = 1/2, or the corner's deviation has no bound")
        return coefficients

    def _refuse(self, why: str) -> None:
        """Raise InputError."""
        raise InputError(f"corner '{self.name or type(self).__name__}': retreat(w): {why}")

    @cached_property
    def share(self) -> float:
        """f(1/2)."""
        return float(self.coefficients @ 0.5 ** np.arange(LOWEST, LOWEST + OWN_TERMS))

    def params(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n, 4) parameters for tangent lengths d = `reach` (n,) [mm], at any feed (n,)."""
        rows = np.zeros((len(reach), 4))
        rows[:, 0] = reach
        return rows
