"""A NURBS curve as chords."""

import numpy as np

from planner.base.arrays import FloatArray
from planner.geometry.nurbs import Nurbs
from planner.nc.points import CURVE, program_of_points
from planner.nc.program import Program

# How many chords of a span to begin with, halvings at most, places where they are measured [fraction].
CHORDS_MIN, HALVINGS = 4, 40
MEASURED = (0.25, 0.5, 0.75)
# The deviation between these places may be larger; chords stay below this fraction of what is allowed [-].
CHORD_SAFETY = 0.9


def chord_program(curve: Nurbs, sagitta: float, feed: float) -> Program:
    """The curve as a program of G1 moves at a feed [mm/s], whose ends are on the curve: off by `sagitta` [mm] at most."""
    points = curve.at(stations(curve, sagitta))
    return program_of_points(points, np.full(len(points) - 1, feed), None, CURVE, curve.axes)


def stations(curve: Nurbs, sagitta: float) -> FloatArray:
    """(k,) parameters, all knots among them, between which chords are off by `sagitta` [mm] at most."""
    breaks = np.unique(curve.knots[curve.degree : len(curve.points) + 1])
    ends = np.linspace(breaks[:-1], breaks[1:], CHORDS_MIN, endpoint=False, axis=1).ravel()
    u = np.append(ends, breaks[-1])
    for _ in range(HALVINGS):
        wide = np.flatnonzero(_deviation(curve, u[:-1], u[1:]) > CHORD_SAFETY * sagitta)
        if not len(wide):
            break
        u = np.insert(u, wide + 1, 0.5 * (u[wide] + u[wide + 1]))
    return u


def _deviation(curve: Nurbs, u0: FloatArray, u1: FloatArray) -> FloatArray:
    """Distances of the curve from the chords between u0 and u1 (n,), the largest of three places."""
    start, end = curve.at(u0), curve.at(u1)
    chord = end - start
    size_sq = np.maximum((chord**2).sum(axis=1), np.finfo(float).tiny)
    worst = np.zeros(len(u0))
    for fraction in MEASURED:
        off = curve.at(u0 + fraction * (u1 - u0)) - start
        along = np.clip((off * chord).sum(axis=1) / size_sq, 0.0, 1.0)
        worst = np.maximum(worst, np.linalg.norm(off - along[:, None] * chord, axis=1))
    return worst
