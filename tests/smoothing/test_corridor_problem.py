"""The interior-point method for splines in a corridor against ipopt on the same problem."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from planner.smoothing.basis import DEGREE, ORDER, knots_at
from planner.smoothing.interior_point import Accuracy, Problem, minimise_in_corridor
from planner.smoothing.relax import add_third_derivatives
from planner.smoothing.sites import Sites


def random_corridor(seed, spans, axes, sites):
    """A zigzag with a corridor around it: a problem, and the first control points, which are inside."""
    rng = np.random.default_rng(seed)
    knots = knots_at(np.arange(spans + 1.0))
    H = np.zeros((axes, spans + DEGREE, ORDER))
    add_third_derivatives(knots, np.ones(axes), H)
    control = np.cumsum(rng.normal(size=(spans + DEGREE, axes)), axis=0)
    u = np.sort(rng.uniform(0.0, spans, sites))
    first = np.minimum(u.astype(int), spans - 1)
    weights = np.einsum("jbm,jm->jb", knots.basis[first], (u - first)[:, None] ** np.arange(ORDER))
    target = np.einsum("jb,jbk->jk", weights, control[first[:, None] + np.arange(ORDER)])
    along = rng.normal(size=(sites, axes))
    along /= np.linalg.norm(along, axis=1)[:, None]
    slide = rng.choice([0.1, 1.0], sites)
    radius = rng.uniform(0.1, 1.0, sites)
    target += 0.3 * radius[:, None] * rng.uniform(-1.0, 1.0, (sites, axes)) / np.sqrt(axes)
    where = Sites(first, u, weights, target, along, slide, radius)
    return Problem(H, np.ones(len(control), bool), where), control


def by_ipopt(problem, control):
    (n, axes), H = control.shape, problem.H
    first, _, weights, place, along, slide, radius = problem.sites
    c = ca.MX.sym("c", n, axes)
    value = 0
    for k in range(axes):
        full = np.zeros((n, n))
        for i in range(n):
            for d in range(min(i, DEGREE) + 1):
                full[i, i - d] = full[i - d, i] = H[k, i, DEGREE - d]
        value += 0.5 * ca.bilin(ca.DM(full), c[:, k], c[:, k])
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


def objective(problem, c):
    H, total = problem.H, 0.0
    for k in range(c.shape[1]):
        for d in range(ORDER):
            part = float((H[k, d:, DEGREE - d] * c[d:, k] * c[: len(c) - d, k]).sum())
            total += part if d else 0.5 * part
    return total


@pytest.mark.shows("splines", "compared: Clarabel and ipopt on the same problems")
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_same_optimum_as_ipopt(seed):
    axes = 2 + seed % 2
    problem, control = random_corridor(seed, 10 + 5 * seed, axes, 20 + 5 * seed)
    problem.free[[0, -1]] = False
    expected = by_ipopt(problem, control)
    start = objective(problem, control)
    accuracy = Accuracy(value=0.0, first=abs(start), last=1e-7 * abs(start), relative=0.0)
    found = minimise_in_corridor(problem, control, accuracy, 100)
    assert found.iterations < 40
    assert found.gap <= 1e-7 * abs(start)
    assert objective(problem, found.control) == pytest.approx(expected, abs=1e-6 * abs(start))
    np.testing.assert_array_equal(found.control[[0, -1]], control[[0, -1]])


@pytest.mark.shows("splines", "compared: Clarabel and ipopt on the same problems")
@pytest.mark.parametrize("iterations", [1, 2, 3, 5])
def test_every_iterate_is_inside_the_corridor(iterations):
    problem, control = random_corridor(7, 20, 3, 40)
    start = objective(problem, control)
    accuracy = Accuracy(value=start, first=start, last=0.0, relative=1e-6)
    c = minimise_in_corridor(problem, control, accuracy, iterations).control
    first, _, weights, place, along, slide, radius = problem.sites
    d = np.einsum("jb,jbk->jk", weights, c[first[:, None] + np.arange(ORDER)]) - place
    e = d - (1.0 - slide)[:, None] * (d * along).sum(axis=1)[:, None] * along
    assert (np.linalg.norm(e, axis=1) < radius).all()
    assert objective(problem, c) < start
