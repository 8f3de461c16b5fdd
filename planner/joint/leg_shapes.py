"""The legs of the free optimum (run.py): where they begin, their coefficients, and their feed in the axes of F."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.build import feed_groups, path_per_length
from planner.geometry.curves import Curves
from planner.geometry.legs import legs_of
from planner.geometry.toolpath import Toolpath
from planner.geometry.word_feed import ROTARY, goes_by

ROUNDING = 1e-9  # of the length in the axes of F over that in all axes [-]


def edges_of(toolpath: Toolpath) -> Array:
    """(R+1,) joints between legs: those of geometry/legs.py, and where feed or budget, the larger one of its
    joints', change on a line."""
    budget = np.maximum(toolpath.tolerance[:-1], toolpath.tolerance[1:])
    edge = np.zeros(len(toolpath) + 1, dtype=bool)
    edge[legs_of(toolpath).first] = True
    edge[1:-1] |= (toolpath.feed[1:] != toolpath.feed[:-1]) | (np.diff(budget) != 0)
    return np.flatnonzero(edge)


@dataclass(frozen=True, eq=False, kw_only=True)
class LegShapes:
    """R legs over the A axes that move on them, by the formula of run.py.

    axis                : (A,) indices of the axes among those of the toolpath
    length              : (R,) [mm]
    base, drift, e1, e2 : (R, A) [mm], [-]
    radius, rate        : (R,) [mm], [rad/mm]; of curves the rate bounds derivatives
    curve               : (R,) row in `curves`, or -1
    curves              : over the A axes
    """

    axis: Array
    length: FloatArray
    base: FloatArray
    drift: FloatArray
    e1: FloatArray
    e2: FloatArray
    radius: FloatArray
    rate: FloatArray
    curve: Array
    curves: Curves

    def points(self, leg: Array, x: FloatArray) -> FloatArray:
        """(n, A) points of the path [mm] at the places x (n,) [mm] on the legs `leg` (n,)."""
        found = self.base[leg] + self.drift[leg] * x[:, None]
        if self.radius.any():
            turned = (self.rate[leg] * x)[:, None]
            circle = np.cos(turned) * self.e1[leg] + np.sin(turned) * self.e2[leg]
            found += self.radius[leg, None] * circle
        return self._on_curves(leg, x, 0, found)

    def tangents(self, leg: Array, x: FloatArray) -> FloatArray:
        """(n, A) dP/dx [-] at the places x (n,) [mm] on the legs `leg` (n,)."""
        found = self.drift[leg]
        if self.radius.any():
            turned = (self.rate[leg] * x)[:, None]
            across = np.cos(turned) * self.e2[leg] - np.sin(turned) * self.e1[leg]
            found += (self.radius * self.rate)[leg, None] * across
        return self._on_curves(leg, x, 1, found)

    def _on_curves(self, leg: Array, x: FloatArray, order: int, others: FloatArray) -> FloatArray:
        """The x-derivative of this order of the legs that are curves, the `others` (n, A) of those that are
        not."""
        of = np.flatnonzero(self.curve[leg] >= 0)
        if len(of):
            others[of] = self.curves.at(self.curve[leg[of]], self.length[leg[of]], x[of])[:, order]
        return others


def together(parts: Sequence[LegShapes], axes: int) -> LegShapes:
    """The legs of one after the other, over all `axes` of the toolpath; those that do not move stand at 0."""

    def all_of(name: str) -> Array:
        return np.concatenate([getattr(one, name) for one in parts])

    def wide(name: str) -> FloatArray:
        whole, end = np.zeros((sum(len(one.length) for one in parts), axes)), 0
        for one in parts:
            begin, end = end, end + len(one.length)
            whole[begin:end, one.axis] = getattr(one, name)
        return whole

    count = [len(one.curves) for one in parts]
    before = np.repeat(np.cumsum(count) - count, [len(one.length) for one in parts])
    points = np.zeros((sum(count), 4, axes))
    for one, end in zip(parts, np.cumsum(count).tolist(), strict=True):
        points[end - len(one.curves) : end, :, one.axis] = one.curves.points
    weight, twist = (
        np.concatenate([getattr(one.curves, name) for one in parts]) for name in ("weight", "twist")
    )
    curve = all_of("curve")
    return LegShapes(
        axis=np.arange(axes),
        curve=np.where(curve >= 0, curve + before, -1),
        curves=Curves(points=points, weight=weight, twist=twist),
        **{name: all_of(name) for name in ("length", "radius", "rate")},
        **{name: wide(name) for name in ("base", "drift", "e1", "e2")},
    )


def shapes_of(toolpath: Toolpath, row: Array, ended: FloatArray) -> dict[str, FloatArray]:
    """The coefficients of the legs (`TubeRun`).

    row   : (R,) the segments that the legs begin with
    ended : (R, A) where they end [mm]
    """
    arc, arcs, curve = toolpath.arc[row], toolpath.arcs, np.flatnonzero(toolpath.curve[row] >= 0)
    base = toolpath.start[row]
    chord = ended - base
    length = np.where(toolpath.straight[row], np.linalg.norm(chord, axis=1), toolpath.length[row])
    shape = {
        "length": length,
        "base": base,
        "drift": chord / length[:, None],
        "e1": np.zeros_like(chord),
        "e2": np.zeros_like(chord),
        "radius": np.zeros(len(row)),
        "rate": np.zeros(len(row)),
    }
    curved = arc >= 0
    for name in shape.keys() - {"length"}:
        shape[name][curved] = getattr(arcs, "center" if name == "base" else name)[arc[curved]]
    if len(curve):
        bend = toolpath.curvature[row[curve]]
        third, fourth = toolpath.curves.part(toolpath.curve[row[curve]]).further_bounds(length[curve])
        shape["drift"][curve], shape["radius"][curve] = 0.0, 1.0 / bend
        shape["rate"][curve] = np.maximum(third / bend, np.sqrt(fourth / bend))
    return shape


def word_shares(toolpath: Toolpath) -> tuple[Array, FloatArray]:
    """(M,) the group of axes that F goes by on each segment, and the share of the length in all axes that they
    move [-]."""
    by = goes_by(toolpath)
    share = np.where(by == ROTARY, toolpath.radius, 1.0)
    return by, share / path_per_length(toolpath.axes, toolpath.radius, toolpath)


def with_words(toolpath: Toolpath, row: Array, of: tuple[Array, FloatArray]) -> Array:
    """(R,) on which of the legs that the segments `row` (R,) stand for, from `word_shares`, F is a limit of its own."""
    return np.asarray(np.isfinite(toolpath.feed[row]) & (of[1][row] < 1.0 - ROUNDING))


def words_of(
    toolpath: Toolpath, row: Array, of: tuple[Array, FloatArray]
) -> tuple[FloatArray, FloatArray, str]:
    """`word` (R, 1) and `counts` over all axes, of the legs of a run with such legs that the segments `row` (R,) stand for, from
    `word_shares`; and why no motion can be looked for. Inside the tolerance x, y and z may take what the rotary axes need not,
    so that F is a limit of its own; it has to be of the same axes everywhere, and to change with the feed in all of them."""
    groups, by, share = feed_groups(toolpath.axes), of[0][row], of[1][row]
    feed, finite = toolpath.feed[row], np.isfinite(toolpath.feed[row])
    every, word = np.ones(len(groups)), (feed * share)[:, None]
    if len(np.unique(by[finite])) > 1:
        return word, every, "F goes by other axes from block to block"
    if (np.sign(np.diff(feed, prepend=feed[0])) * word_change(word) < 0.0).any():
        return word, every, "F rises where the feed in all axes falls"
    return word, (groups == by[finite][0]).astype(np.float64), ""


def word_change(word: FloatArray) -> FloatArray:
    """(R,) 1 where the feed in the axes that F goes by, `word` (R, W), rises with a leg, -1 where it falls; 0
    but for rounding of it."""
    if not word.shape[1]:
        return np.zeros(len(word))
    known = np.where(np.isfinite(word[:, 0]), word[:, 0], np.finfo(np.float64).max)
    change = np.diff(known, prepend=known[0])
    return np.where(np.abs(change) > ROUNDING * known, np.sign(change), 0.0)
