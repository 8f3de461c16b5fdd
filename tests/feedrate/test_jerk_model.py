"""The model of one iteration: gradients of rows and time against differences, the step against a dense solution, block by block."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.solvers.random_paths import random_path
from planner.feedrate.jerk.layout import (
    BY_P,
    BY_U,
    BY_X,
    CONVEX,
    CURVED,
    DYN,
    GRADIENT,
    LAM_UP,
    LANES,
    ROW,
    STEP,
    STEP_END,
    VALUE,
    X_END,
    Blocks,
    H,
    P,
    Room,
    U,
    X,
    columns_of,
    put,
    rows_of,
)
from planner.feedrate.jerk.riccati import forward, offsets, riccati
from planner.feedrate.jerk.rows import PASSING, linearise
from planner.feedrate.jerk.window import ScaledWindow

STEP_SIZE = 1e-6  # of the differences, share of each quantity's size
N = LANES + 9  # one full block and a part of a second one


def window(seed: int) -> Blocks:
    """The first N intervals of a path from rest to rest, on exact kinematics, with some multipliers."""
    problem = random_path(seed)
    own = ScaledWindow.of(columns_of(problem), 0, N, Room())
    found, _, _ = own.solve(None, 1e-2, 100)
    assert found is not None
    blocks = own.blocks
    put(blocks, found.x / own.feed**2, found.u * own.time / own.feed)
    blocks.rows[:, LAM_UP : LAM_UP + LANES] = 0.1
    return blocks


def model(blocks: Blocks) -> None:
    for b in range(len(blocks.work)):
        linearise(blocks, b, np.empty(PASSING), np.zeros(LANES))


def of_interval(array: np.ndarray, quantity: int) -> np.ndarray:
    """(N,) a quantity of all intervals."""
    return array[:, quantity : quantity + LANES].ravel()[:N].copy()


def with_dynamics(blocks: Blocks) -> None:
    """Move the ends of all intervals, each by itself, until the kinematics hold."""
    for _ in range(8):
        model(blocks)
        blocks.work[:, X_END : X_END + LANES] += blocks.work[:, DYN + 3 * LANES : DYN + 4 * LANES]
    model(blocks)


@pytest.mark.parametrize("seed", [0, 1, 4])
@pytest.mark.parametrize(("quantity", "by", "of_time"), [(X, BY_X, 0), (U, BY_U, 1), (P, BY_P, 2)])
def test_gradients_of_rows_and_time_are_those_of_differences(seed, quantity, by, of_time):
    blocks = window(seed)
    model(blocks)
    inner = slice(1, N - 1)  # the states of first and last interval are given
    size = max(np.abs(of_interval(blocks.work, quantity)).max(), 1e-3) * STEP_SIZE
    expected = [
        of_interval(blocks.work, DYN + of_time * LANES),
        of_interval(blocks.work, GRADIENT + of_time * LANES),
    ]
    rows = range(rows_of(blocks.axes, blocks.jumps))
    expected += [of_interval(blocks.rows, r * ROW + by) for r in rows]
    seen = []
    for side in (1.0, -1.0):
        moved = blocks._replace(work=blocks.work.copy(), rows=blocks.rows.copy())
        moved.work[:, quantity : quantity + LANES] += side * size
        with_dynamics(moved)
        values = [of_interval(moved.work, X_END), of_interval(moved.work, H)]
        seen.append(values + [of_interval(moved.rows, r * ROW + VALUE) for r in rows])
    for found, up, down in zip(expected, *seen, strict=True):
        difference = (up - down)[inner] / (2.0 * size)
        np.testing.assert_allclose(
            found[inner], difference, rtol=1e-4, atol=1e-5 * np.abs(difference).max() + 1e-9
        )


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_the_recursion_finds_the_step_of_the_dense_problem(seed):
    blocks = window(seed)
    model(blocks)
    assert riccati(blocks, 0.0)
    offsets(blocks, 0.0)
    forward(blocks, 0.9)
    hessian, gradient, kept, asked = dense(blocks)
    kkt = np.block([[hessian, kept.T], [kept, np.zeros((len(kept), len(kept)))]])
    z = np.linalg.lstsq(kkt, np.concatenate([-gradient, asked]), rcond=1e-14)[0][: 3 * N].reshape(N, 3)
    for k in range(3):
        step = of_interval(blocks.work, STEP + k * LANES)
        np.testing.assert_allclose(step, z[:, k], atol=1e-6 * np.abs(z[:, k]).max() + 1e-12)
    np.testing.assert_array_equal(of_interval(blocks.work, STEP_END)[:-1], of_interval(blocks.work, STEP)[1:])


def dense(blocks: Blocks) -> tuple[np.ndarray, ...]:
    """Hessian and gradient of the model without curvature of the rows, and the equations of dynamics and ends."""
    assert (blocks.work[:, CURVED : CURVED + 6 * LANES] != 0.0).any()
    hessian, gradient = np.zeros((3 * N, 3 * N)), np.zeros(3 * N)
    kept, asked = np.zeros((2 * N + 2, 3 * N)), np.zeros(2 * N + 2)
    h = [of_interval(blocks.work, CONVEX + k * LANES) for k in range(6)]
    g = [of_interval(blocks.work, GRADIENT + k * LANES) for k in range(3)]
    d = [of_interval(blocks.work, DYN + k * LANES) for k in range(4)]
    for i in range(N):
        own = slice(3 * i, 3 * i + 3)
        xx, xu, xp, uu, up, pp = (part[i] for part in h)
        hessian[own, own] = [[xx, xu, xp], [xu, uu, up], [xp, up, pp]]
        gradient[own] = [part[i] for part in g]
        kept[2 * i, own] = [part[i] for part in d[:3]]
        kept[2 * i + 1, own] = [0.0, 1.0, 1.0]
        if i < N - 1:  # the states at the end are given
            kept[2 * i, 3 * i + 3] = kept[2 * i + 1, 3 * i + 4] = -1.0
        asked[2 * i] = -d[3][i]
    kept[2 * N, 0] = kept[2 * N + 1, 1] = 1.0
    return hessian, gradient, kept, asked
