"""Courses, commands and motions for the tests of paper 000, on as many axes as one likes."""

from __future__ import annotations

import dataclasses

import numpy as np

from benchmarks.jobs import problems
from planner.base.arrays import FloatArray
from planner.baselines.fir.guide import LegGuide, guide_of_legs
from planner.baselines.fir.schedule import Schedule
from planner.geometry.build import toolpath_from_program
from planner.machine import Axis, Machine

RAD = 180.0 / np.pi  # an axis "a" with limits that come out in plain numbers


def machine_of(axes: int = 3, **settings) -> Machine:
    """`problems.machine` with up to four axes of the same limits; dt so short that chords between samples leave nothing."""
    made = problems.machine(**({"dt": 1e-7} | settings))
    x = made.axes["x"]
    a = Axis(velocity=x.velocity * RAD, acceleration=x.acceleration * RAD, jerk=x.jerk * RAD)
    return made.model_copy(update={"rotary_radius": 1.0, "axes": made.axes | ({"a": a} if axes == 4 else {})})


def guide_through(points: FloatArray, machine: Machine, feed: float | FloatArray = 100.0) -> LegGuide:
    """The guide of G1 moves through points (n+1, A), A up to 4."""
    points = np.asarray(points, float)
    program = problems.polyline(points[:, : min(3, points.shape[1])], feed=feed)
    if points.shape[1] == 4:
        program = dataclasses.replace(
            program, axes=("x", "y", "z", "a"), start=points[0], end=points[1:], arc_center=np.zeros((0, 4))
        )
    return guide_of_legs(toolpath_from_program(program, machine), machine)


def corner(theta: float, length: float = 50.0, axes: int = 2) -> FloatArray:
    """Two legs that turn by theta [rad]."""
    points = np.zeros((3, axes))
    points[0, 0], points[2, :2] = -length, length * np.array([np.cos(theta), np.sin(theta)])
    return points


def overlapping(guide: LegGuide, overlap: float | FloatArray, T1: float, T2: float) -> Schedule:
    """Every leg at its feed, every inner joint with the overlap [s]."""
    inner = guide.inner
    return Schedule(
        guide=guide,
        T1=np.full(guide.runs, T1),
        T2=np.full(guide.runs, T2),
        speed=guide.feed,
        passing=np.full(len(guide) + 1, np.inf),
        overlap=np.where(inner, overlap, 0.0),
        holding=np.zeros(len(guide), bool),
    )


def distance_to_polyline(points: FloatArray, vertices: FloatArray) -> FloatArray:
    """Smallest distance (n,) of points (n, A) from a polyline (m+1, A), by brute force."""
    start, step = vertices[:-1], np.diff(vertices, axis=0)
    along = ((points[:, None] - start) * step).sum(axis=2) / (step**2).sum(axis=1)
    nearest = start + np.clip(along, 0, 1)[..., None] * step
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)
