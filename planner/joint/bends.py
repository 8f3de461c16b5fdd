"""Rows of the tolerance of a step on an arc or a curve (rows.py), of numbers or lanes (base/lanes.py).

Leg and its derivatives by the place x are

    P(x) = base + c1(x) w1 + c2(x) w2 + c3(x) w3

of an arc with the vectors w = drift, radius e1, radius e2 and the numbers c = x, cos(rate x), sin(rate x); of a curve
(geometry/curves.py) with the three control points behind the first, seen from that, and the Bernstein polynomials of u(x) times
their weights over the sum of all.

A node belongs to the nearest place, its inner control points to the tangents at the places of both nodes (run.py).
With the foot P(x) of the nearest point on the tangent, off = c - P - far P', dx = P'.dy/(P'.P' - (y - P).P'') where the node is
at y. The inner control point stays as it is where it touches the end of what it may use of the tangent.
"""

from planner.base.kernels import CONTRACT, njit
from planner.base.lanes import anywhere, larger, smaller, where, whole
from planner.base.views import matrix, size
from planner.joint.row_kinds import OF_SET, SETS, TUBE, TUBE_NODE

_THREE = size(3)
NEAREST_STEPS = 3  # Gauss-Newton steps to the nearest place, from the last one
# A quarter of a turn, the first 33 digits of it and the rest, and the polynomials of sin x/x and cos x up to that in x^2
# (fdlibm, k_sin.c and k_cos.c).
PER_QUARTER, QUARTER, QUARTER_REST = 0.6366197723675814, 1.5707963267341256, 6.077100506506192e-11
SIN = (
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
)
COS = (
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _sum_of(series, x):
    """A polynomial of six coefficients, the lowest first."""
    a, b, c, d, e, f = series
    return a + x * (b + x * (c + x * (d + x * (e + x * f))))


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def cos_sin(angle):
    """Cosine and sine of up to some 1e5 turns, within 1e-15."""
    quarters = whole(angle * PER_QUARTER + 0.5)
    x = (angle - quarters * QUARTER) - quarters * QUARTER_REST
    square = x * x
    sin = x + x * square * _sum_of(SIN, square)
    cos = 1.0 - 0.5 * square + square * square * _sum_of(COS, square)
    turned = quarters - 4.0 * whole(0.25 * quarters)
    odd = turned - 2.0 * whole(0.5 * turned) > 0.5
    across, along = where(odd, cos, sin), where(odd, sin, cos)
    away = (turned - 1.5) * (turned - 1.5) < 1.0
    return where(away, -along, along), where(turned > 1.5, -across, across)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _share(b, db, ddb, sum_of, u_1, u_2):
    """A Bernstein polynomial over the weights' sum, both with two derivatives by u, as c of the module text with two by x."""
    w, dw, ddw = sum_of
    c = b * w
    dc = (db - dw * c) * w
    ddc = (ddb - 2.0 * dw * dc - ddw * c) * w
    return c, dc * u_1, ddc * u_1 * u_1 + dc * u_2


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _of_curve(shape, length, x):
    """c1, c2 and c3 of a curve at the place x with two derivatives each; shape as of `Group`."""
    t, one, two = x / length, shape[0], shape[1]
    s = 1.0 - t
    # u by its ordinates 0, b1 .. b4, 1 (de Casteljau)
    b_0, b_1, b_2, b_3, b_4 = (
        t * shape[2],
        s * shape[2] + t * shape[3],
        s * shape[3] + t * shape[4],
        s * shape[4] + t * shape[5],
        s * shape[5] + t,
    )
    b_0, b_1, b_2, b_3 = s * b_0 + t * b_1, s * b_1 + t * b_2, s * b_2 + t * b_3, s * b_3 + t * b_4
    b_0, b_1, b_2 = s * b_0 + t * b_1, s * b_1 + t * b_2, s * b_2 + t * b_3
    u_2 = 20.0 * (b_0 - 2.0 * b_1 + b_2) / (length * length)
    b_0, b_1 = s * b_0 + t * b_1, s * b_1 + t * b_2
    u_1, u = 5.0 * (b_1 - b_0) / length, s * b_0 + t * b_1
    v = 1.0 - u
    p, q = one - 1.0, two - 1.0
    sum_of = (
        1.0 / (1.0 + 3.0 * u * v * (p * v + q * u)),
        3.0 * (p * v * v + 2.0 * (q - p) * u * v - q * u * u),
        6.0 * ((q - 2.0 * p) * v + (p - 2.0 * q) * u),
    )
    first = one * 3.0 * u * v * v, one * 3.0 * v * (v - 2.0 * u), one * 6.0 * (u - 2.0 * v)
    second = two * 3.0 * u * u * v, two * 3.0 * u * (2.0 * v - u), two * 6.0 * (v - 2.0 * u)
    third = u * u * u, 3.0 * u * u, 6.0 * u
    return (
        _share(*first, sum_of, u_1, u_2),
        _share(*second, sum_of, u_1, u_2),
        _share(*third, sum_of, u_1, u_2),
    )


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _chosen(condition, a, b):
    """`where` of three numbers."""
    return where(condition, a[0], b[0]), where(condition, a[1], b[1]), where(condition, a[2], b[2])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put_leg(axes, group, i, x, out):
    """out (3, A): the point of a step's leg at the place x, and two derivatives."""
    rate = group.rate[i]
    cos, sin = cos_sin(rate * x)
    one, none = 1.0 + 0.0 * x, 0.0 * x
    of_1, of_2, of_3 = (
        (x, one, none),
        (cos, -rate * sin, -rate * rate * cos),
        (sin, rate * cos, -rate * rate * sin),
    )
    is_curve = group.shape[i, 0] > 0.0
    if anywhere(is_curve):
        by_1, by_2, by_3 = _of_curve(group.shape[i], group.length[i], x)
        of_1, of_2, of_3 = (
            _chosen(is_curve, by_1, of_1),
            _chosen(is_curve, by_2, of_2),
            _chosen(is_curve, by_3, of_3),
        )
    for k in range(axes):
        w_1, w_2, w_3 = group.way[i, 0, k], group.way[i, 1, k], group.way[i, 2, k]
        out[0, k] = group.base[i, k] + of_1[0] * w_1 + of_2[0] * w_2 + of_3[0] * w_3
        out[1, k] = of_1[1] * w_1 + of_2[1] * w_2 + of_3[1] * w_3
        out[2, k] = of_1[2] * w_1 + of_2[2] * w_2 + of_3[2] * w_3


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _nearest(axes, group, i, c, x, low, high, out):
    """The place between `low` and `high` on a step's leg that is nearest to c (A,), from the place x; out as `_put_leg`."""
    x = smaller(larger(x, low), high)
    for n in range(NEAREST_STEPS + 1):
        _put_leg(axes, group, i, x, out)
        if n < NEAREST_STEPS:
            miss, square = 0.0 * x, 0.0 * x
            for k in range(axes):
                miss += (c[k] - out[0, k]) * out[1, k]
                square += out[1, k] * out[1, k]
            x = smaller(larger(x + miss / square, low), high)
    return x


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def _put(sizes, group, rows, i, c, g, place, moves):
    """A row of an arc or a curve, its place, and whether that moves with the point."""
    bent, row = group.bent[i] > 0.0, 8 * len(sizes.axes) + TUBE_NODE + c
    inside = where(place > 0.0, where(place < group.length[i], moves, 0.0 * g), 0.0 * g)
    rows.g[i, row] = where(bent, g, rows.g[i, row])
    rows.place[i, c] = where(bent, place, rows.place[i, c])
    rows.moves[i, c] = where(bent, inside, group.line[i] * rows.moves[i, c])


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _put_inner(sizes, group, rows, i, c, y, node, leg, foot, reach, stays):
    """The row of an inner control point y (A,): its distance from the tangent at the place `foot` of a node (A,), where the
    leg (3, A) is as of `_put_leg`; how far the tangent counts, from and to; `stays`: 1 for a foot that does not move."""
    axes, bent, per = len(sizes.axes), group.bent[i] > 0.0, group.room[i]
    miss, long, turned = 0.0 * foot, 0.0 * foot, 0.0 * foot
    for k in range(axes):
        miss += (y[k] - leg[0, k]) * leg[1, k]
        long += leg[1, k] * leg[1, k]
        turned += (node[k] - leg[0, k]) * leg[2, k]
    far = smaller(larger(miss / long, reach[0]), reach[1])
    at_end = where(far > reach[0], where(far < reach[1], 0.0, 1.0 + 0.0 * far), 1.0 + 0.0 * far)
    square, slope = 0.0 * foot, 0.0 * foot
    for k in range(axes):
        off = y[k] - leg[0, k] - far * leg[1, k]
        square += off * off
        slope += off * (far * leg[2, k] + at_end * leg[1, k])
        rows.n[i, c, k] = where(bent, off * per, rows.n[i, c, k])
    by_node = where(stays > 0.0, 0.0, -slope * per / (long - turned))
    rows.by_node[i, c] = where(bent, by_node, 0.0)
    at = tangent_at(sizes, i, c)
    for k in range(axes):
        rows.tangent[at, k] = where(bent, leg[1, k], rows.tangent[at, k])
    _put(sizes, group, rows, i, c, 0.5 * (square * per - 1.0), foot + far, 1.0 + 0.0 * foot)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def tangent_at(sizes, i, c):
    """Where the tangent is in `Rows.tangent` that the point c (0 to 5) of step i belongs to: lines have one for all."""
    return i * (1 + 5 * sizes.bends) + c * sizes.bends


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def put_bent(sizes, group, i, y, rows):
    """The rows of the tolerance of a step in the lanes where it is on an arc or a curve."""
    axes = len(sizes.axes)
    first, last = matrix(y, _THREE, sizes.axes), matrix(y, _THREE, sizes.axes)
    length, bent = group.length[i], group.bent[i] > 0.0
    none, one = 0.0 * length, 1.0 + 0.0 * length
    at_vertex, ends = group.at_vertex[i], where(group.last[i] > 0.0, none, group.ends[i])
    for m in range(SETS):
        at, c = TUBE + OF_SET * m, 3 * m
        high = where(at_vertex > 0.0, none, length)
        begin = _nearest(axes, group, i, y[at], rows.place[i, c], none, high, first)
        low = where(ends > 0.0, length, none)
        end = _nearest(axes, group, i, y[at + 3], rows.place[i, c + 2], low, length, last)
        square, per = none, group.room_node[i]
        for k in range(axes):
            off = y[at, k] - first[0, k]
            square += off * off
            rows.n[i, c, k] = where(bent, off * per, rows.n[i, c, k])
            at_node = tangent_at(sizes, i, c)
            rows.tangent[at_node, k] = where(bent, first[1, k], rows.tangent[at_node, k])
        _put(sizes, group, rows, i, c, 0.5 * (square * per - 1.0), begin, 1.0 - at_vertex)
        stays = where(begin > none, where(begin < length, at_vertex, one), one)
        reach = none, length - begin
        _put_inner(sizes, group, rows, i, c + 1, y[at + 1], y[at], first, begin, reach, stays)
        stays = where(end > none, where(end < length, ends, one), one)
        reach = -end, none
        _put_inner(sizes, group, rows, i, c + 2, y[at + 2], y[at + 3], last, end, reach, stays)
