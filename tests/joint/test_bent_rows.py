"""Rows of the tolerance on arcs and curves, in the kernel of windows: against the formulas of the legs by themselves."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_pieces import Alone, look, rows_out
from starts import begun

from planner.base.arrays import read_only
from planner.base.kernels import CONTRACT, njit
from planner.joint import own
from planner.joint import row_kinds as rows
from planner.joint.bends import cos_sin
from planner.joint.legs import LegFormulas, formula_point, nearest_point
from planner.joint.problem import window_of


@njit(cache=True, error_model="numpy", fastmath=CONTRACT)
def _turned(angle, out):
    for n in range(len(angle)):
        out[n, 0], out[n, 1] = cos_sin(angle[n])


def test_cosine_and_sine():
    rng = np.random.default_rng(1)
    angle = np.concatenate(
        [rng.uniform(-8.0, 8.0, 20_000), rng.uniform(-6e5, 6e5, 20_000), np.arange(-40, 41) * np.pi / 4]
    )
    out = np.empty((len(angle), 2))
    _turned(angle, out)
    np.testing.assert_allclose(out, np.column_stack([np.cos(angle), np.sin(angle)]), rtol=0.0, atol=4e-16)


def points_of(window, i):
    """Control points (2, 4, A) of both sets of step i."""
    A = window.u.shape[1] - 1
    p, v, a = window.x[i].reshape(3, A)
    j, h = window.u[i, :A], window.u[i, A]
    for m, sag in enumerate(window.limits.sag):
        q, w = p + sag * a, v + sag * j
        rest = m * window.limits.rest[i]
        cubic = [q, q + h * w / 3, q + h / 3 * (2 * w + h * a / 2), q + h * (w + h * (a / 2 + h * j / 6))]
        yield [one + rest[0] + part / 3 * (rest[1] - rest[0]) for part, one in enumerate(cubic)]


@pytest.mark.parametrize("name", ["arcs", "curves"])
def test_nodes_belong_to_nearest_places_and_control_points_to_the_tangents_there(name):
    """Places, found by many steps, and rows, which are distances, in a motion that is nowhere on its legs."""
    run, guess = begun(name)
    window = window_of(run, guess, 0, len(guess), own.MISSED)
    window.x[1:-1] += 3e-3 * np.random.default_rng(6).normal(size=window.x[1:-1].shape)
    alone, limits = Alone.of(window), window.limits
    # as those of a run are, or the kernels of legs would be compiled once more
    legs = LegFormulas(*map(read_only, window.legs))
    for _ in range(4):  # places come nearer every time
        look(alone)
    g, axes = rows_out(window, alone.work.g)[:, 8 * (window.u.shape[1] - 1) :], window.u.shape[1] - 1
    seen = 0
    for i in np.flatnonzero(legs.radius[limits.leg] > 0.0):
        r, last = limits.leg[i], i == len(window.u) - 1
        length, ends = legs.length[r], not last and limits.leg[i + 1] != r
        point, tangent, bend = np.zeros((3, axes))

        def off(y, x, far=0.0, r=r, point=point, tangent=tangent, bend=bend):
            formula_point(legs, r, x, point, tangent, bend)
            return np.linalg.norm(y - point - far * tangent)

        for m, y in enumerate(points_of(window, i)):
            foot = [
                0.0 if limits.at_vertex[i] else window.place[i, 0],
                length if ends else window.place[i, 2],
            ]
            for _ in range(30):
                foot = [nearest_point(legs, r, y[3 * n], foot[n], point, tangent) for n in (0, 1)]
                foot = [0.0 if limits.at_vertex[i] else foot[0], length if ends else foot[1]]
            wanted, place = [off(y[0], foot[0])], [foot[0]]
            for n in (0, 1):
                off(y[1], foot[n])
                far = (y[1 + n] - point) @ tangent / (tangent @ tangent)
                far = np.clip(far, 0.0, length - foot[0]) if n == 0 else np.clip(far, -foot[1], 0.0)
                wanted.append(off(y[1 + n], foot[n], far))
                place.append(foot[n] + far)
            room = np.array([limits.room_node[i], limits.room[i], limits.room[i]])
            on = limits.on[i, 8 * axes + rows.TUBE_NODE + 3 * m :][:3]
            found = g[i, rows.TUBE_NODE + 3 * m :][:3]
            np.testing.assert_allclose(
                found[on], (((np.array(wanted) / room) ** 2 - 1) / 2)[on], rtol=1e-6, atol=1e-6
            )
            np.testing.assert_allclose(alone.place[i, 3 * m : 3 * m + 3, 0], place, atol=1e-6)
            seen += 1
    assert seen > 40
