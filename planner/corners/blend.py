"""One construction for every corner: two legs superposed.

Let p1(-x) be the point on the incoming leg a distance x before the vertex P, and p2(y) the point on the
outgoing leg a distance y after it. A corner is the curve

    B(w) = p1(-X(w)) + p2(Y(w)) - P,        w in [0, 1],

where the *retreat* X falls from d to 0 and the *advance* Y rises from 0 to d. Between straight legs (u1, u2)
this is P - X u1 + Y u2: the Bezier pair of paper 002 has X = d (1-w)^3, Y = d w^3 (or their rational
relatives), the FIR corner of paper 000 has X = V R(Tk-tau), Y = V R(tau). On arcs the same two functions bend
with the legs, and since Y, Y', Y'' vanish at w = 0 (and X, X', X'' at w = 1) the corner leaves every leg,
straight or circular, with its tangent *and* its curvature: G2.

**Error (proof).** Let theta be the turning angle at P, kappa1, kappa2 bounds of the legs' curvature, s =
sin(theta/2), and m = X = Y the common value at the middle. Let both shapes obey X Y <= m^2 (it holds for
every shape here and is tested). Match B(w) to the programmed point p1(-(X-Y)) while X >= Y, to p2(Y-X)
afterwards; this matching is in order. In the first half

    |B - p1(-X+Y)| = | int_0^Y  t2(y) - t1(-X+y)  dy |  <=  int_0^Y  |u2-u1| + kappa2 y + kappa1 (X-y)  dy
                   <= 2 s Y + kappa2 Y^2/2 + kappa1 X Y   <=   2 s m + (kappa1 + kappa2) m^2  =:  E(m),

because unit tangents turn by at most kappa per mm; the second half is the mirror image. So B and the
programmed path are within E(m) of each other *in both directions and in order* (Frechet distance), and the
vertex is met within E(m). Between straight legs E(m) = 2 s m is the exact vertex distance of papers 000 and
002 (d = 8 m gives eps = (d/4) s, eq. (15)). Solved for m:

    m = eps / (s + sqrt(s^2 + (kappa1 + kappa2) eps)).

**Regularity.** B' = -X' t1 + Y' t2 with -X', Y' >= 0 vanishes only where the tangents oppose each other, so
the corner is kept short enough that theta plus what the legs bend by stays below `BEND_MAX`.
"""

from abc import abstractmethod
from enum import IntEnum
from typing import Self

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.geometry.legs import leg_point

# Largest angle between the two tangents that are superposed [rad]; at pi the corner would have a cusp.
BEND_MAX = np.deg2rad(176.0)


class Shape(IntEnum):
    """Which pair of functions X(w), Y(w) a corner has; its parameters are a row of four numbers."""

    BEZIER = 0  # (d, w1, w2, -): tangent length [mm] and the inner weights of the rational cubic
    FIR = 1  # (V, T1, T2, Tk): feed [mm/s], filter lengths and overlap time [s]
    OWN = 2  # (d, -, -, -): tangent length [mm]; the polynomial is in the record (corners/own.py)


class ScaledShape:
    """A shape that is the same at all corners but for its size: a base of corner shapes."""

    @property
    @abstractmethod
    def share(self) -> float:
        """m / d: retreat and advance at the middle, over the tangent length [-]."""

    def at(self, change: FloatArray) -> Self:
        """The same shape at all n corners, whatever the `change` (n, A) of direction there."""
        return self

    def reach(self, middle: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) tangent lengths d [mm] for middle values m (n,) [mm], at any feed (n,)."""
        return middle / self.share

    def middle(self, reach: FloatArray, feed: FloatArray) -> FloatArray:
        """(n,) middle values m [mm] for tangent lengths d = `reach` (n,) [mm], at any feed (n,)."""
        return reach * self.share

    def breaks(self, params: FloatArray) -> tuple[float, ...]:
        """The middle, where the matched side changes or two curves of a pair meet, whatever `params` (4,)."""
        return (0.5,)


SHAPE_BEZIER, SHAPE_OWN = int(Shape.BEZIER), int(Shape.OWN)  # numba reads plain integers
OWN_TERMS = 10  # coefficients of a shape of one's own

# What the kernels know of a corner: its shape, the shape's parameters, and factors on X and Y
# (`SmoothPath.scale`). Scaling X and Y is an affine map, which keeps every geometric continuity.
CORNER_DTYPE = np.dtype(
    [
        ("shape", np.int64),
        ("params", np.float64, (4,)),
        ("scale", np.float64, (2,)),
        ("own", np.float64, (OWN_TERMS,)),
    ]
)


def middle_from_tolerance(tol: FloatArray, sin_half: FloatArray, curvature: FloatArray) -> FloatArray:
    """(n,) largest m with E(m) <= tol [mm]; infinite where nothing bends.

    tol       : (n,) contour error [mm]
    sin_half  : (n,) sine of half the turning angle [-]
    curvature : (n,) kappa1 + kappa2 of the legs [1/mm]
    """
    with np.errstate(divide="ignore"):
        return tol / (sin_half + np.sqrt(sin_half**2 + curvature * tol))


def error_from_middle(middle: FloatArray, sin_half: FloatArray, curvature: FloatArray) -> FloatArray:
    """(n,) E(m) [mm]: bound of the two-sided, in-order deviation of a corner; exact between straight legs.

    middle              : (n,) m [mm]
    sin_half, curvature : (n,) as of `middle_from_tolerance`
    """
    return 2.0 * sin_half * middle + curvature * middle**2


@njit(cache=True, error_model="numpy")
def _cubic(c0, c1, c2, c3, t):
    """Cubic Bernstein polynomial and its three derivatives at t."""
    a = 1.0 - t
    return (
        c0 * a * a * a + 3.0 * t * a * (c1 * a + c2 * t) + c3 * t * t * t,
        3.0 * ((c1 - c0) * a * a + 2.0 * (c2 - c1) * a * t + (c3 - c2) * t * t),
        6.0 * ((c2 - 2.0 * c1 + c0) * a + (c3 - 2.0 * c2 + c1) * t),
        6.0 * (c3 - 3.0 * c2 + 3.0 * c1 - c0),
    )


@njit(cache=True, error_model="numpy")
def _quotient(n, q):
    """Value and three derivatives of n/q, each given as value and three derivatives."""
    v0 = n[0] / q[0]
    v1 = (n[1] - v0 * q[1]) / q[0]
    v2 = (n[2] - 2.0 * v1 * q[1] - v0 * q[2]) / q[0]
    v3 = (n[3] - 3.0 * v2 * q[1] - 3.0 * v1 * q[2] - v0 * q[3]) / q[0]
    return v0, v1, v2, v3


@njit(cache=True, error_model="numpy")
def _scaled(v, scale, rate):
    """scale * v(rate * w): value and derivatives with respect to w."""
    return scale * v[0], scale * rate * v[1], scale * rate * rate * v[2], scale * rate * rate * rate * v[3]


@njit(cache=True, error_model="numpy")
def _bezier_shape(d, w1, w2, w, w_ref):
    """Paper 002: the halves have control values (1, 1/2, 1/4, 1/8) on the near leg, (0, 0, 0, 1/8) on the far
    one."""
    first = w_ref <= 0.5
    t = 2.0 * w if first else 2.0 - 2.0 * w
    weight = _cubic(1.0, w1, w2, 1.0, t)
    near = _quotient(_cubic(1.0, 0.5 * w1, 0.25 * w2, 0.125, t), weight)
    far = _quotient(_cubic(0.0, 0.0, 0.0, 0.125, t), weight)
    if first:
        return _scaled(near, d, 2.0), _scaled(far, d, 2.0)
    return _scaled(far, d, -2.0), _scaled(near, d, -2.0)


@njit(cache=True, error_model="numpy")
def _ramp(t, t_ref, T1, T2):
    """Ramp response R of two FIR filters and its three derivatives (S, h, h'), on the branch of t_ref
    (docs/papers.md 0)."""
    if t_ref <= T2:
        q = 1.0 / (T1 * T2)
        return q * t * t * t / 6.0, q * t * t / 2.0, q * t, q
    if t_ref <= T1:
        return (3.0 * t * t - 3.0 * T2 * t + T2 * T2) / (6.0 * T1), (2.0 * t - T2) / (2.0 * T1), 1.0 / T1, 0.0
    delay = T1 + T2
    q = 1.0 / (T1 * T2)
    r = delay - t
    return t - delay / 2.0 + q * r * r * r / 6.0, 1.0 - q * r * r / 2.0, q * r, -q


@njit(cache=True, error_model="numpy")
def _fir_shape(V, T1, T2, Tk, w, w_ref):
    """Paper 000: X = V R(Tk - tau), Y = V R(tau), tau = Tk w."""
    near = _ramp(Tk * (1.0 - w), Tk * (1.0 - w_ref), T1, T2)
    far = _ramp(Tk * w, Tk * w_ref, T1, T2)
    return _scaled(near, V, -Tk), _scaled(far, V, Tk)


@njit(cache=True, error_model="numpy")
def _own_at(c, z):
    """sum c_n z^(n + 3) and its three derivatives."""
    g0, g1, g2, g3 = 0.0, 0.0, 0.0, 0.0  # of sum c_n z^n, over k!
    for n in range(len(c) - 1, -1, -1):
        g3, g2, g1, g0 = g3 * z + g2, g2 * z + g1, g1 * z + g0, g0 * z + c[n]
    g2, g3 = 2.0 * g2, 6.0 * g3
    return (
        z * z * z * g0,
        z * z * (3.0 * g0 + z * g1),
        z * (6.0 * g0 + z * (6.0 * g1 + z * g2)),
        6.0 * g0 + z * (18.0 * g1 + z * (9.0 * g2 + z * g3)),
    )


@njit(cache=True, error_model="numpy")
def _own_shape(d, c, w):
    """Own polynomials: X = d f(w), Y = d f(1 - w), f given in z = 1 - w."""
    return _scaled(_own_at(c, 1.0 - w), d, -1.0), _scaled(_own_at(c, w), d, 1.0)


@njit(cache=True, error_model="numpy")
def shape_at(corner, w, w_ref):
    """Retreat X and advance Y of a corner record at w, each with three derivatives: ((X, X', X'', X'''), (Y,
    ...)).

    w_ref : a parameter inside the interval that is meant; it chooses the branch where two curves of a corner
            meet
    """
    p = corner.params
    if corner.shape == SHAPE_BEZIER:
        X, Y = _bezier_shape(p[0], p[1], p[2], w, w_ref)
    elif corner.shape == SHAPE_OWN:
        X, Y = _own_shape(p[0], corner.own, w)
    else:
        X, Y = _fir_shape(p[0], p[1], p[2], p[3], w, w_ref)
    return _scaled(X, corner.scale[0], 1.0), _scaled(Y, corner.scale[1], 1.0)


@njit(cache=True, error_model="numpy")
def corner_point(legs, corners, k, w, w_ref, work1, work2, out):
    """Point [mm] and three w-derivatives of corner k (between legs k-1 and k) at w, into out (4, A).

    w_ref        : as of `shape_at`
    work1, work2 : (4, A) scratch
    """
    X, Y = shape_at(corners[k], w, w_ref)
    leg_point(legs, k - 1, legs[k - 1].length - X[0], work1)
    leg_point(legs, k, Y[0], work2)
    vertex = legs[k].start
    for a in range(out.shape[1]):
        p1, p2, p3 = work1[1, a], work1[2, a], work1[3, a]
        q1, q2, q3 = work2[1, a], work2[2, a], work2[3, a]
        out[0, a] = work1[0, a] + work2[0, a] - vertex[a]
        out[1, a] = -X[1] * p1 + Y[1] * q1
        out[2, a] = -X[2] * p1 + X[1] * X[1] * p2 + Y[2] * q1 + Y[1] * Y[1] * q2
        out[3, a] = (
            -X[3] * p1
            + 3.0 * X[1] * X[2] * p2
            - X[1] * X[1] * X[1] * p3
            + Y[3] * q1
            + 3.0 * Y[1] * Y[2] * q2
            + Y[1] * Y[1] * Y[1] * q3
        )
