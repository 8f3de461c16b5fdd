"""Arithmetic with functions of one variable to third order: derivatives of functions along a motion.

A `Series` holds a value and its first three derivatives with respect to the same variable (arc length or
time), for n places at once. What numpy computes with it has the derivatives of the result, exact but for
rounding: sums, products, quotients, powers, and the functions of `FUNCTIONS`. For f(c) with c = c(s), ' for
d/ds on c and for d/dc on f (Faa di Bruno):

    f(c)'   = f' c'
    f(c)''  = f' c'' + f'' c'^2
    f(c)''' = f' c''' + 3 f'' c' c'' + f''' c'^3
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from planner.base.arrays import FloatArray


class Series(NDArrayOperatorsMixin):
    """(4, n) value, first, second and third derivative at n places."""

    def __init__(self, derivatives: FloatArray):
        self.derivatives = derivatives

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **settings: Any) -> Any:
        if method != "__call__" or settings or ufunc not in (*FUNCTIONS, *OPERATIONS):
            known = ", ".join(sorted(f.__name__ for f in (*FUNCTIONS, *OPERATIONS)))
            raise TypeError(f"{ufunc.__name__} has no derivatives here; there are {known}")
        given = [a if isinstance(a, Series) else _constant(a, self.derivatives) for a in inputs]
        if ufunc in FUNCTIONS:
            return Series(_chain(given[0].derivatives, FUNCTIONS[ufunc](given[0].derivatives[0])))
        if ufunc is np.power and not isinstance(inputs[1], Series):
            base = given[0].derivatives
            return Series(_chain(base, _power_derivatives(base[0], float(inputs[1]))))
        return Series(OPERATIONS[ufunc](*(a.derivatives for a in given)))


def _constant(value: Any, like: FloatArray) -> Series:
    derivatives = np.zeros_like(like)
    derivatives[0] = value
    return Series(derivatives)


def _chain(c: FloatArray, f: tuple[FloatArray, ...]) -> FloatArray:
    """The module's text: f holds the function and its derivatives at c[0]."""
    first, second = f[1] * c[1], f[1] * c[2] + f[2] * c[1] ** 2
    third = f[1] * c[3] + 3.0 * f[2] * c[1] * c[2] + f[3] * c[1] ** 3
    return np.stack([f[0] + 0.0 * c[0], first, second, third])


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    first, second = a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]
    third = a[3] * b[0] + 3.0 * (a[2] * b[1] + a[1] * b[2]) + a[0] * b[3]
    return np.stack([a[0] * b[0], first, second, third])


def _quotient(a: FloatArray, b: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return _product(a, _chain(b, _power_derivatives(b[0], -1.0)))


def _power_derivatives(c: FloatArray, n: float) -> tuple[FloatArray, ...]:
    found, factor = [], 1.0
    for k in range(4):
        found.append(factor * c ** (n - k) if factor else np.zeros_like(c))
        factor *= n - k
    return tuple(found)


def _angle(y: FloatArray, x: FloatArray) -> FloatArray:
    """arctan2(y, x), whose derivative is (x y' - y x')/(x^2 + y^2)."""
    zero = np.zeros_like(x[:1])
    dx, dy = np.vstack([x[1:], zero]), np.vstack([y[1:], zero])  # good to second order, which is needed
    rate = _quotient(_product(x, dy) - _product(y, dx), _product(x, x) + _product(y, y))
    return np.vstack([np.arctan2(y[0], x[0])[None], rate[:3]])


def _length(x: FloatArray, y: FloatArray) -> FloatArray:
    square = _product(x, x) + _product(y, y)
    return _chain(square, _power_derivatives(square[0], 0.5))


def _arcsin(x: FloatArray) -> tuple[FloatArray, ...]:
    root = np.sqrt(1.0 - x * x)
    return np.arcsin(x), 1.0 / root, x / root**3, (1.0 + 2.0 * x * x) / root**5


def _arccos(x: FloatArray) -> tuple[FloatArray, ...]:
    return np.arccos(x), *(-d for d in _arcsin(x)[1:])


def _arctan(x: FloatArray) -> tuple[FloatArray, ...]:
    d = 1.0 / (1.0 + x * x)
    return np.arctan(x), d, -2.0 * x * d**2, (6.0 * x * x - 2.0) * d**3


def _log(x: FloatArray) -> tuple[FloatArray, ...]:
    return np.log(x), 1.0 / x, -1.0 / x**2, 2.0 / x**3


def _tan(x: FloatArray) -> tuple[FloatArray, ...]:
    t = np.tan(x)
    d = 1.0 + t * t
    return t, d, 2.0 * t * d, d * (2.0 + 6.0 * t * t)


OPERATIONS: dict[np.ufunc, Callable[..., FloatArray]] = {
    np.add: lambda a, b: a + b,
    np.subtract: lambda a, b: a - b,
    np.multiply: _product,
    np.divide: _quotient,
    np.power: lambda a, b: _chain(_product(b, _chain(a, _log(a[0]))), (np.power(a[0], b[0]),) * 4),
    np.negative: lambda a: -a,
    np.positive: lambda a: a,
    np.arctan2: _angle,
    np.hypot: _length,
}
FUNCTIONS: dict[np.ufunc, Callable[[FloatArray], tuple[FloatArray, ...]]] = {
    np.sqrt: lambda x: _power_derivatives(x, 0.5),
    np.square: lambda x: _power_derivatives(x, 2.0),
    np.reciprocal: lambda x: _power_derivatives(x, -1.0),
    np.absolute: lambda x: (np.abs(x), np.sign(x), 0.0 * x, 0.0 * x),
    np.exp: lambda x: (np.exp(x),) * 4,
    np.log: _log,
    np.sin: lambda x: (np.sin(x), np.cos(x), -np.sin(x), -np.cos(x)),
    np.cos: lambda x: (np.cos(x), -np.sin(x), -np.cos(x), np.sin(x)),
    np.tan: _tan,
    np.arcsin: _arcsin,
    np.arccos: _arccos,
    np.arctan: _arctan,
    np.sinh: lambda x: (np.sinh(x), np.cosh(x)) * 2,
    np.cosh: lambda x: (np.cosh(x), np.sinh(x)) * 2,
}
