"""A step of path and feed together: its rows are derivatives, its problem is solved to the optimum, and its promise comes true."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.jobs import problems
from planner.base.threads import use_threads
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.reshape import reshape, run_times
from planner.smoothing import combined
from planner.smoothing.basis import knots_at
from planner.smoothing.combined_places import places_of_run
from planner.smoothing.combined_rows import first_state, predict, rows_of_window, weigh
from planner.smoothing.combined_solver import CombinedProblem, balls_of, improve_window
from planner.smoothing.forms import SplineMotion
from planner.smoothing.sites import Sites
from planner.smoothing.spline_path import spline_shape, with_spline

MACHINE = problems.machine()
SOLVER = JerkLimited(tol=1e-7)
AXES, SPANS = 2, 8
LIMITS = np.array([[1.5, 1.0], [4.0, 5.0], [50.0, 60.0]])
BOUNDS = 2.0, 3.0  # of the feed, and of the acceleration across the path


def planned(rounded, shape):
    path = with_spline(rounded, shape)
    samples = refine_for_jerk(sample_path(path, MACHINE, 2e-3, third_order=True), MACHINE)
    problem = feedrate_problem(samples, MACHINE, measured=True)
    problem = dataclasses.replace(problem, margin=np.zeros(len(samples)))
    return OnPath(path=path, samples=samples, problem=problem, solution=SOLVER.solve(problem), shape=shape)


@pytest.fixture(scope="module")
def pentagon():
    toolpath = toolpath_from_program(problems.all_jobs()["pentagon"], MACHINE)
    rounded = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    shape = spline_shape(rounded, MACHINE)
    return rounded, shape, planned(rounded, shape)


def test_a_run_in_ranges_gains_what_it_gains_as_a_whole(monkeypatch):
    angle = np.deg2rad(np.random.default_rng(8).uniform(10.0, 40.0, 340)) * np.where(
        np.arange(340) % 2, 1, -1
    )
    points = np.cumsum(0.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    toolpath = toolpath_from_program(problems.polyline(points), MACHINE)
    rounded = round_corners(toolpath, MACHINE, BezierCorner(), blend_tangents=True)
    start = planned(rounded, spline_shape(rounded, MACHINE))
    pull = np.full(len(start.shape.splines.fits), 0.5)
    _, whole = reshape(start, pull, 1e-4)
    monkeypatch.setattr(combined, "RANGE", 450)
    swept = []
    sweep = combined.improve_range
    monkeypatch.setattr(
        combined, "improve_range", lambda *given: (swept.append(given[2:4]), sweep(*given))[1]
    )
    found = []
    try:
        for threads in (1, 3):
            use_threads(threads)
            found.append(reshape(start, pull, 1e-4))
    finally:
        use_threads(None)
    assert len(swept) == 2 * 3
    np.testing.assert_array_equal(found[0][0].splines.control, found[1][0].splines.control)
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert whole.sum() > 0.0
    np.testing.assert_allclose(found[0][1].sum(), whole.sum(), rtol=0.02)


def motion(rng, control, knots):
    """Some motion over the middle of the spline, two intervals in each span."""
    n = 2 * SPANS
    tau = np.column_stack([np.tile([0.0, 0.5], SPANS), np.tile([0.5, 1.0], SPANS)])
    return SplineMotion(
        interval=np.array([0, n]),
        span=np.repeat(np.arange(SPANS), 2),
        tau=tau,
        feed=rng.uniform(1.0, 3.0, (n, 2)),
        acc=rng.uniform(-9.0, 9.0, (n, 2)),
        jerk=rng.uniform(-90.0, 90.0, n),
        duration=rng.uniform(0.05, 0.1, n),
        price=np.zeros((n, 2, AXES, 3)),
    )


def some_places(seed=1):
    rng = np.random.default_rng(seed)
    knots = knots_at(np.cumsum(np.append(0.0, rng.uniform(0.5, 1.5, SPANS))))
    n = SPANS + 5
    control = np.column_stack([np.arange(n), rng.normal(size=n)]) * 0.7
    bound = np.full((2 * SPANS, 2), BOUNDS)
    places = places_of_run(knots, control, motion(rng, control, knots), bound, LIMITS, 0, 2 * SPANS)
    return rng, control, places


def dense(rows, n):
    """(R, n, A+1) the rows as they are defined (combined.py), from their places, kinds and factors."""
    out = np.zeros((len(rows.kind), n, AXES + 1))
    for p in range(len(rows.span)):
        basis = rows.basis[p].reshape(4, 6)
        for r in range(rows.first[p], rows.first[p + 1]):
            own, kind = slice(rows.span[p], rows.span[p] + 6), rows.kind[r]
            if kind < 3 * AXES:
                out[r, own, kind % AXES] = rows.factor[r, 0] * basis[kind // AXES + 1]
            else:
                way = kind - 3 * AXES
                out[r, own, :AXES] = rows.factor[r, 0] * np.outer(basis[way + 1], rows.along[p, way])
            out[r, own, AXES] = rows.factor[r, 1:4] @ basis[:3]
    return out


def no_sites():
    empty = np.zeros((0, AXES))
    return Sites(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 6)), empty, empty, np.zeros(0), np.zeros(0))


def test_rows_are_the_derivatives_of_what_a_slower_motion_on_another_shape_does():
    """v/(1+theta), and what comes of it by the chain rule in time, against the rows, by central differences."""
    rng, _, places = some_places()
    rows = rows_of_window(places, 0, len(places.span), 0)
    y = rng.normal(size=(SPANS + 5, AXES + 1))
    values = np.einsum("rnk,nk->r", dense(rows, len(y)), y)
    seen = set()
    for p in range(len(places.span)):
        own = slice(places.span[p], places.span[p] + 6)
        shift = places.basis[p] @ y[own]  # (4, A+1): values and three time derivatives
        theta, rate, bend = shift[:3, AXES]

        def shares(h, p=p, shift=shift, theta=theta, rate=rate, bend=bend):
            velocity, acceleration, jerk = places.jet[p] + h * shift[1:, :AXES]
            # d/dt' = 1/(1 + theta) d/dt, three times
            s, ds, dds = 1.0 / (1.0 + h * theta), h * rate, h * bend
            ds, dds = -(s**2) * ds, 2.0 * s**3 * ds**2 - s**2 * dds
            first = velocity * s
            second = (acceleration * s + velocity * ds) * s
            third = (
                jerk * s**2
                + 2 * acceleration * s * ds
                + velocity * s * dds
                + acceleration * s * ds
                + velocity * ds**2
            ) * s
            across = places.along[p, 1] @ (acceleration * s**2)
            ways = [places.along[p, 0] @ first / BOUNDS[0], across / BOUNDS[1]]
            return np.concatenate([(np.stack([first, second, third]) / LIMITS).ravel(), ways])

        slope = (shares(1e-5) - shares(-1e-5)) / 2e-5
        here = slice(rows.first[p], rows.first[p + 1])
        np.testing.assert_allclose(values[here], slope[rows.kind[here]], rtol=1e-5, atol=1e-7)
        seen |= set(rows.kind[here].tolist())
    assert seen == set(range(3 * AXES + 2))


def test_the_newton_matrix_and_the_forces_are_those_of_dense_rows():
    """weigh: sum (z/s) row row', sum (z_up - z_low) row; predict: sum of rows over their slacks."""
    rng, control, places = some_places(3)
    rows = rows_of_window(places, 0, len(places.span), 0)
    n, columns = len(control), AXES + 1
    y = rng.normal(size=(n, columns)) * 0.1
    state = first_state(rows, y, 1.0)
    state.sides[:, [3, 5]] = rng.uniform(0.1, 2.0, (len(rows.kind), 2))  # multipliers
    up, z_up, low, z_low = state.sides[:, 2:6].T.copy()
    every = dense(rows, n)
    np.testing.assert_allclose(state.sides[:, 0], np.einsum("rnk,nk->r", every, y), rtol=1e-9, atol=1e-12)
    band, residual, push = (np.zeros(shape) for shape in ((n * columns, 6 * columns), y.shape, y.shape))
    balls = balls_of(no_sites(), control, y, 1.0)
    products, _ = weigh(rows, state, (0.0, 0.0), balls, band, residual, push)
    assert products == pytest.approx((up * z_up + low * z_low).sum())
    flat = every.reshape(len(every), -1)
    matrix = flat.T @ ((z_up / up + z_low / low)[:, None] * flat)
    for d in range(6 * columns):
        np.testing.assert_allclose(band[: n * columns - d, d], np.diagonal(matrix, d), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(residual, np.einsum("rnk,r->nk", every, z_up - z_low), rtol=1e-9, atol=1e-9)
    barrier, bent = np.zeros_like(y), np.zeros_like(y)
    predict(rows, state, y, barrier, bent, np.zeros(5))
    np.testing.assert_allclose(
        barrier, np.einsum("rnk,r->nk", every, 1.0 / low - 1.0 / up), rtol=1e-9, atol=1e-9
    )


def test_a_window_ends_at_the_optimum_of_its_problem():
    """Stationary, with multipliers that are found again by least squares over the rows that are active."""
    scipy = pytest.importorskip("scipy.optimize")
    rng, control, places = some_places(2)
    rows = rows_of_window(places, 0, len(places.span), 0)
    n, columns = control.shape[0], AXES + 1
    band = np.zeros((n * columns, 6 * columns))
    band[:, 0] = rng.uniform(1.0, 2.0, n * columns)
    linear = rng.normal(size=(n, columns))
    free = np.ones((n, columns), bool)
    free[0, :AXES] = free[-1, :AXES] = False
    y, _ = improve_window(
        CombinedProblem(band, linear, free, rows, control, no_sites()), np.zeros((n, columns)), 1.0, 1e-7, 60
    )
    every = dense(rows, n).reshape(len(rows.kind), -1)[:, free.ravel()]
    lower, upper = rows.factor[:, 4:].T
    at = every @ y.ravel()[free.ravel()]
    assert (at <= upper + 1e-4).all()
    assert (at >= -lower - 1e-4).all()
    assert not y[~free].any()
    found = scipy.minimize(
        lambda z: (0.5 * band[free.ravel(), 0] * z**2 + linear.ravel()[free.ravel()] * z).sum(),
        np.zeros(free.sum()),
        jac=lambda z: band[free.ravel(), 0] * z + linear.ravel()[free.ravel()],
        constraints=[
            {"type": "ineq", "fun": lambda z: upper - every @ z, "jac": lambda z: -every},
            {"type": "ineq", "fun": lambda z: lower + every @ z, "jac": lambda z: every},
        ],
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-12},
    )
    own = (0.5 * band[:, 0] * y.ravel() ** 2 + linear.ravel() * y.ravel()).sum()
    assert own == pytest.approx(found.fun, abs=2e-3 * (1.0 + abs(found.fun)))


def test_what_a_short_step_promises_comes_true(pentagon):
    """To first order the time changes by the promise: against the motion solved again on the new shape."""
    rounded, _, before = pentagon
    shape, promised = reshape(before, np.full(len(before.shape.splines.fits), 20.0), 1e-6)
    gained = run_times(before).sum() - run_times(planned(rounded, shape)).sum()
    assert promised.sum() > 2e-4 * before.solution.cycle_time
    assert gained == pytest.approx(promised.sum(), rel=0.25)


def test_a_shape_keeps_its_certificate(pentagon):
    _, _, before = pentagon
    shape, promised = reshape(before, np.full(len(before.shape.splines.fits), 0.5), 1e-4)
    assert shape.splines.fits.all()
    assert (shape.left >= 0.0).all()
    assert (shape.used < shape.splines.sites.radius).all()
    assert promised.sum() > 0.0
