"""The convex problem of the smoothing as a second-order cone programme for Clarabel: an oracle that shares nothing with the kernels.

Clarabel minimises 1/2 x'Px + q'x over A x + s = b, s in a product of cones. A site |e_j| <= r_j is (1, e_j/r_j) in a cone of A + 1,
and what stays a zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import sparse

from planner.base.arrays import Array, FloatArray
from planner.smoothing.basis import ORDER
from planner.smoothing.interior_point import Problem
from planner.smoothing.sites import Sites

TOL = 1e-10  # of Clarabel's gaps and residuals [-]


def best_value(P: Any, q: FloatArray, blocks: list[tuple[FloatArray, FloatArray, str, int]]) -> float:
    """The least 1/2 x'Px + q'x with b - A x in the cone of every block (A, b, kind, size of one cone)."""
    clarabel = pytest.importorskip("clarabel", reason="clarabel is not installed (pip install '.[test]')")
    kinds = {
        "zero": clarabel.ZeroConeT,
        "cone": clarabel.SecondOrderConeT,
    }
    cones = [kinds[kind](size) for _, b, kind, size in blocks for _ in range(len(b) // size) if len(b)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOL
    A = sparse.csc_matrix(sparse.vstack([sparse.csr_matrix(rows) for rows, *_ in blocks]))
    b = np.concatenate([b for _, b, *_ in blocks])
    found = clarabel.DefaultSolver(sparse.csc_matrix(sparse.triu(P)), q, A, b, cones, settings).solve()
    assert str(found.status) in ("Solved", "AlmostSolved"), found.status
    return float(found.obj_val)


def of_corridor(problem: Problem, control: FloatArray) -> float:
    """The optimum of interior_point.py's problem; what is not free stays as in `control` (n, A)."""
    n, axes = control.shape
    P = sparse.block_diag([_symmetric(problem.H[k][:, ::-1]) for k in range(axes)])  # axis after axis
    flat = np.arange(n * axes).reshape(axes, n).T  # (n, A) number of each variable
    A, b = _cones(problem.sites, np.zeros_like(control), flat, n * axes)
    stays = flat[~problem.free].ravel()
    hold = _picked(stays, n * axes)
    blocks = [(hold, control[~problem.free].ravel(), "zero", 1), (A, b, "cone", axes + 1)]
    return best_value(P, np.zeros(n * axes), blocks)


def _picked(numbers: Array, size: int) -> FloatArray:
    """Rows that pick the variables of these numbers out of so many."""
    rows = np.zeros((len(numbers), size))
    rows[np.arange(len(numbers)), numbers] = 1.0
    return rows


def _symmetric(lower: FloatArray) -> Any:
    """The symmetric matrix with lower[i, d] at (i, i - d)."""
    n, width = lower.shape
    P = sparse.diags([lower[d:, d] for d in range(min(width, n))], [-d for d in range(min(width, n))])
    return sparse.csc_matrix(P + sparse.tril(P, -1).T)


def _cones(sites: Sites, control: FloatArray, flat: Array, size: int) -> tuple[FloatArray, FloatArray]:
    """A and b of (1, e_j/r_j) for the control points `control` (n, A) plus the variables of the numbers `flat` (n, A)."""
    axes, count = flat.shape[1], len(sites.span)
    A, b = np.zeros((count * (axes + 1), size)), np.zeros(count * (axes + 1))
    for j in range(count):
        own = slice(sites.span[j], sites.span[j] + ORDER)
        t = sites.along[j]
        M = (np.eye(axes) - (1.0 - sites.slide[j]) * np.outer(t, t)) / sites.radius[j]
        at = j * (axes + 1)
        b[at] = 1.0
        b[at + 1 : at + 1 + axes] = M @ (sites.weights[j] @ control[own] - sites.target[j])
        for k in range(axes):
            A[at + 1 : at + 1 + axes, flat[own, k]] = -np.outer(M[:, k], sites.weights[j])
    return A, b
