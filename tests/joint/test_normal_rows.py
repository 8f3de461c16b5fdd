"""The rows of the normal acceleration between nodes: enough for the whole step, hardly more than needed, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_pieces import normal_curvature, normal_rows

from planner.joint.normal_rows import LEAST, TURNED, turns_far

PACE = 1.0


def step_of(rng, axes, turn):
    """A node (3 A,) and controls (A+1,) of a step that turns by about `turn` [rad] at a speed of about 1."""
    h = rng.uniform(0.2, 1.0)
    v, w = rng.normal(size=axes), rng.normal(size=axes)
    v /= np.linalg.norm(v)
    w -= (w @ v) * v
    far = rng.uniform(0.7, 1.4) * (np.cos(turn) * v + np.sin(turn) * w / np.linalg.norm(w))
    a = (far - v) / h + rng.normal(size=axes) * turn / h
    jerk = (far - v - a * h) * 2.0 / h**2
    return np.concatenate([np.zeros(axes), v, a]), np.append(jerk, h)


def largest(x, u):
    """The largest normal acceleration of a step, and that of its nodes."""
    axes = len(u) - 1
    t = np.linspace(0.0, u[axes], 401)[:, None]
    v = x[axes : 2 * axes] + t * (x[2 * axes :] + t * u[:axes] / 2)
    a = x[2 * axes :] + t * u[:axes]
    unit = v / np.linalg.norm(v, axis=1)[:, None]
    across = np.linalg.norm(a - (a * unit).sum(axis=1)[:, None] * unit, axis=1)
    return across.max(), across[[0, -1]].max()


def row_of(x, u, bound, turns=False):
    return normal_rows(bound, PACE, turns, x, u)


def formula(x, u, bound):
    """(|c|^2 - X^2 d |d|)/2 of both ordinates, and d, by products of matrices and Bernstein's formula."""
    axes = len(u) - 1
    h, v, a, j = u[axes], x[axes : 2 * axes], x[2 * axes :], u[:axes]
    b, w = (a, a + h * j), (v, v + h * a / 2, v + h * a + h * h * j / 2)

    def times(m, n):
        return np.outer(b[m], w[n]) - np.outer(w[n], b[m])

    c = (times(1, 0) + 2 * times(0, 1)) / 3, (2 * times(1, 1) + times(0, 2)) / 3
    e = [w[k] / np.sqrt((w[k] ** 2).sum() + 1e-6) for k in (0, 2)]
    d = (w[0] @ e[1] + 2 * w[1] @ e[0]) / 3, (2 * w[1] @ e[1] + w[2] @ e[0]) / 3
    found = [(one**2).sum() / 2 - bound**2 * along * abs(along) for one, along in zip(c, d, strict=True)]
    return np.array(found) / 2, np.array(d), np.array([np.sqrt(w[k] @ w[k] + 1e-6) for k in (0, 2)])


@pytest.mark.shows("normal-acceleration", "certified: rows that hold between the nodes of the search")
@pytest.mark.parametrize("axes", [2, 3, 6])
def test_no_row_above_0_is_enough_for_the_whole_step_and_little_more_than_needed(axes):
    rng = np.random.default_rng(axes)
    for turn in rng.uniform(0.02, 0.9, 60):
        x, u = step_of(rng, axes, turn)
        needed, at_nodes = largest(x, u)
        low, high = 1e-6, 1e3 * needed
        for _ in range(60):  # the least bound that the rows allow
            middle = np.sqrt(low * high)
            low, high = (low, middle) if (row_of(x, u, middle)[0] <= 0.0).all() else (middle, high)
        enough = max(high, at_nodes)
        assert enough >= needed * (1.0 - 1e-9)
        if turn < 0.2 and needed == pytest.approx(at_nodes):
            assert enough <= 1.2 * needed


@pytest.mark.parametrize("turns", [False, True])
def test_values_and_slopes_are_those_of_the_formula(turns):
    rng, eps = np.random.default_rng(5), 1e-6
    for axes in (2, 3):
        for turn in (0.1, 0.6, 2.5):
            x, u = step_of(rng, axes, turn)
            bound = largest(x, u)[0]
            value, slope = row_of(x, u, bound, turns)
            _, d, speeds = formula(x, u, bound)
            over = 1.0 if turns else (bound * np.maximum(d, LEAST * speeds.sum())) ** 2

            def rows(x, u, axes=axes, bound=bound, over=over):
                if turns:
                    ends = x[2 * axes :], x[2 * axes :] + u[axes] * u[:axes]
                    return np.array([((a @ a) / bound**2 - 1.0) / 2.0 for a in ends])
                return formula(x, u, bound)[0] / over

            np.testing.assert_allclose(value, rows(x, u), rtol=1e-9, atol=1e-12)
            found = np.array(
                [
                    (
                        rows(x + one[: 3 * axes], u + one[3 * axes :])
                        - rows(x - one[: 3 * axes], u - one[3 * axes :])
                    )
                    / (2 * eps)
                    for one in eps * np.eye(4 * axes + 1)
                ]
            ).T
            np.testing.assert_allclose(slope, found, rtol=1e-4, atol=1e-6 * np.abs(found).max())


def test_their_curvature_is_positive_and_that_of_a_step_that_turns_is_exact():
    rng, axes = np.random.default_rng(7), 3
    size = 4 * axes + 1
    for turns in (False, True):
        x, u = step_of(rng, axes, 0.5)
        W = normal_curvature(2.0, PACE, turns, x, u, np.array([0.3, 0.7]))
        W += np.tril(W, -1).T
        assert np.linalg.eigvalsh(W).min() >= -1e-9 * np.abs(W).max()
        assert np.abs(W).max() > 0.0
        if turns:
            slope = row_of(x, u, 2.0, turns)[1][1]
            d = rng.normal(size=size)
            # of |b|^2/(2 X^2) along d, as if b were linear: (db)^2/X^2
            db = d[2 * axes : 3 * axes] + u[axes] * d[3 * axes : 4 * axes] + u[:axes] * d[4 * axes]
            first = d[2 * axes : 3 * axes]
            assert d @ W @ d == pytest.approx((0.3 * first @ first + 0.7 * db @ db) / 4.0)
            assert slope[2 * axes : 3 * axes].any()


def test_which_steps_turn_far():
    angle = np.array([0.0, 0.2, 0.2 + 1.1 * TURNED, 0.2 + 1.1 * TURNED, np.pi])
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array([1.0, 2.0, 1e-9, 3.0, 1.0])[:, None]
    np.testing.assert_array_equal(turns_far(way), [False, True, False, True])
    resting = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [0.0, 0.0]])
    np.testing.assert_array_equal(turns_far(resting), [False, False, True, False])
