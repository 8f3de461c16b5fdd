"""The interior-point method for splines in a tube against ipopt on the same problem."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from planner.smoothing.basis import DEGREE, ORDER, clamped, span_basis
from planner.smoothing.forms import third_derivative_forms
from planner.smoothing.interior_point import minimise


def random_tube(seed, spans, axes, sites):
    """A zigzag with a tube around it: bands, sites and the first control points, which are inside."""
    rng = np.random.default_rng(seed)
    breaks = np.arange(spans + 1.0)
    basis = span_basis(clamped(breaks))
    H = np.zeros((axes, spans + DEGREE, ORDER))
    third_derivative_forms(np.array([0, spans]), breaks, np.ones(axes), H)
    control = np.cumsum(rng.normal(size=(spans + DEGREE, axes)), axis=0)
    u = np.sort(rng.uniform(0.0, spans, sites))
    first = np.minimum(u.astype(int), spans - 1)
    weights = np.einsum("jbm,jm->jb", basis[first], (u - first)[:, None] ** np.arange(ORDER))
    place = np.einsum("jb,jbk->jk", weights, control[first[:, None] + np.arange(ORDER)])
    along = rng.normal(size=(sites, axes))
    along /= np.linalg.norm(along, axis=1)[:, None]
    slide = rng.choice([0.1, 1.0], sites)
    radius = rng.uniform(0.1, 1.0, sites)
    place += 0.3 * radius[:, None] * rng.uniform(-1.0, 1.0, (sites, axes)) / np.sqrt(axes)
    return H, first, weights, place, along, slide, radius, control


def by_ipopt(H, first, weights, place, along, slide, radius, control, linear):
    n, axes = control.shape
    c = ca.MX.sym("c", n, axes)
    value = 0
    for k in range(axes):
        full = np.zeros((n, n))
        for i in range(n):
            for d in range(min(i, DEGREE) + 1):
                full[i, i - d] = full[i - d, i] = H[k, i, DEGREE - d]
        value += 0.5 * ca.bilin(ca.DM(full), c[:, k], c[:, k])
    value += ca.dot(ca.DM(linear), c)
    rows = []
    for j in range(len(first)):
        d = ca.mtimes(ca.DM(weights[j][None]), c[int(first[j]) : int(first[j]) + ORDER, :]) - ca.DM(
            place[j][None]
        )
        e = d - (1.0 - slide[j]) * ca.dot(d, ca.DM(along[j][None])) * ca.DM(along[j][None])
        rows.append(ca.dot(e, e) / radius[j] ** 2)
    ends = [c[0, :].T - ca.DM(control[0]), c[n - 1, :].T - ca.DM(control[-1])]
    constraints = ca.vertcat(*rows, *ends)
    upper = np.concatenate([np.ones(len(first)), np.zeros(2 * axes)])
    lower = np.concatenate([np.full(len(first), -np.inf), np.zeros(2 * axes)])
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-10}
    solver = ca.nlpsol("tube", "ipopt", {"x": ca.vec(c), "f": value, "g": constraints}, quiet)
    found = solver(x0=control.T.ravel(), lbg=lower, ubg=upper)
    assert solver.stats()["success"]
    return float(found["f"])


def objective(H, linear, c):
    total = float((linear * c).sum())
    for k in range(c.shape[1]):
        for d in range(ORDER):
            part = float((H[k, d:, DEGREE - d] * c[d:, k] * c[: len(c) - d, k]).sum())
            total += part if d else 0.5 * part
    return total


@pytest.mark.parametrize("linear_part", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_same_optimum_as_ipopt(seed, linear_part):
    axes = 2 + seed % 2
    H, first, weights, place, along, slide, radius, control = random_tube(
        seed, 10 + 5 * seed, axes, 20 + 5 * seed
    )
    linear = np.random.default_rng(seed).normal(size=control.shape) if linear_part else np.zeros_like(control)
    free = np.ones(len(control), bool)
    free[[0, -1]] = False
    expected = by_ipopt(H, first, weights, place, along, slide, radius, control, linear)
    start = objective(H, linear, control)
    c = control.copy()
    z = np.empty(len(first))
    gap, iterations = minimise(
        H, linear, free, first, weights, place, along, slide, radius, c, z, 0.0, abs(start), 1e-7 * abs(start), 0.0, 100
    )  # fmt: skip
    assert iterations < 40
    assert gap <= 1e-7 * abs(start)
    assert objective(H, linear, c) == pytest.approx(expected, abs=1e-6 * abs(start))
    np.testing.assert_array_equal(c[[0, -1]], control[[0, -1]])


@pytest.mark.parametrize("iterations", [1, 2, 3, 5])
def test_every_iterate_is_inside_the_tube(iterations):
    H, first, weights, place, along, slide, radius, control = random_tube(7, 20, 3, 40)
    c = control.copy()
    start = objective(H, np.zeros_like(c), c)
    z = np.empty(len(first))
    minimise(
        H, np.zeros_like(c), np.ones(len(c), bool), first, weights, place, along, slide, radius, c, z, start, start, 0.0, 1e-6,
        iterations,
    )  # fmt: skip
    d = np.einsum("jb,jbk->jk", weights, c[first[:, None] + np.arange(ORDER)]) - place
    e = d - (1.0 - slide)[:, None] * (d * along).sum(axis=1)[:, None] * along
    assert (np.linalg.norm(e, axis=1) < radius).all()
    assert objective(H, np.zeros_like(c), c) < start
