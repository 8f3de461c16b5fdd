"""Quintic B-splines in the form the kernels use: on every span, six polynomials of a local parameter.

A spline over the knots k_0 <= ... <= k_{n+5} with the control points c_0 .. c_{n-1} is, on the span k_i <= u
<= k_{i+1} with h = k_{i+1} - k_i and tau = (u - k_i)/h in [0, 1],

    p(u) = sum_b N_b(tau) c_{i-5+b},     N_b(tau) = sum_m basis[span, b, m] tau^m,     b, m = 0..5.

The polynomials come from the recursion of Cox and de Boor, carried out on polynomials of tau.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit

DEGREE = 5  # the least with four continuous derivatives: the jerk along the path is then differentiable
ORDER = DEGREE + 1  # control points that a span depends on


class Knots(NamedTuple):
    """The knots of one spline with S spans."""

    breaks: FloatArray  # (S+1,) ends of the spans, ascending
    basis: FloatArray  # (S, 6, 6) their polynomials (module text)


@njit(cache=True, error_model="numpy")
def put(out, begin, numbers):
    """The numbers (n,) into out from `begin` on: with slices numba compiles the text of an error, too."""
    for k in range(len(numbers)):
        out[begin + k] = numbers[k]


@njit(cache=True, error_model="numpy")
def put_rows(out, begin, rows):
    """`put` of rows (n, m)."""
    for k in range(len(rows)):
        put(out[begin + k], 0, rows[k])


@njit(cache=True, error_model="numpy")
def clamped(breaks):
    """Knots (n + 6,) of splines that begin and end at their first and last control point, from the spans'
    ends (S + 1,)."""
    knots = np.empty(len(breaks) + 2 * DEGREE)
    for i in range(len(knots)):
        knots[i] = breaks[min(max(i - DEGREE, 0), len(breaks) - 1)]
    return knots


@njit(cache=True, error_model="numpy")
def span_basis(knots):
    """(S, 6, 6) basis polynomials of all spans of clamped knots (module text)."""
    spans = len(knots) - 2 * DEGREE - 1
    basis = np.zeros((spans, ORDER, ORDER))
    lower = np.zeros((ORDER, ORDER))
    for span in range(spans):
        i = span + DEGREE
        h = knots[i + 1] - knots[i]
        out = basis[span]
        out[0, 0] = 1.0
        for p in range(1, ORDER):
            for b in range(p):
                for m in range(p):
                    lower[b, m] = out[b, m]
                    out[b, m] = 0.0
            for b in range(p + 1):  # N_{i-p+b} of degree p from N_{i-p+b} and N_{i-p+b+1} of degree p - 1
                for m in range(ORDER):
                    out[b, m] = 0.0
                if b > 0:
                    first = knots[i - p + b]
                    width = knots[i + b] - first
                    for m in range(p):
                        out[b, m] += lower[b - 1, m] * (knots[i] - first) / width
                        out[b, m + 1] += lower[b - 1, m] * h / width
                if b < p:
                    last = knots[i + b + 1]
                    width = last - knots[i - p + b + 1]
                    for m in range(p):
                        out[b, m] += lower[b, m] * (last - knots[i]) / width
                        out[b, m + 1] -= lower[b, m] * h / width
    return basis


@njit(cache=True, error_model="numpy")
def knots_at(breaks):
    """Clamped knots at the spans' ends (S + 1,)."""
    return Knots(breaks, span_basis(clamped(breaks)))


@njit(cache=True, error_model="numpy")
def derivatives(poly, tau, h, out):
    """Values and first three u-derivatives of the six polynomials `poly` (6, 6) at tau, into out (4, 6)."""
    for b in range(ORDER):
        value, first, second, third = 0.0, 0.0, 0.0, 0.0
        for m in range(DEGREE, -1, -1):
            third = third * tau + 3.0 * second
            second = second * tau + 2.0 * first
            first = first * tau + value
            value = value * tau + poly[b, m]
        out[0, b], out[1, b], out[2, b], out[3, b] = value, first / h, second / (h * h), third / (h * h * h)
