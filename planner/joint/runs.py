"""The runs of a toolpath (run.py): what all legs have is worked out at once, as programs may have thousands of short runs."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.corners.budget import chord_rate, filter_rate, largest_normal
from planner.feedrate.constraints.limits import JERK, Limits
from planner.geometry.curves import Curves
from planner.geometry.toolpath import Joint, Toolpath
from planner.joint.leg_shapes import edges_of, shapes_of, with_words, word_shares, words_of
from planner.joint.own_laws import Law, RunLaws, laws_of
from planner.joint.run import STRAIGHT, TubeRun
from planner.machine import Machine
from planner.machine.user_limit import QUANTITIES

# Of a limit, how far below it a run begins or ends in motion at most [-]: rows are narrowed by 2e-6 (problem.py), and where both
# ends are at the feed nothing else is left for a search to be in.
BELOW = 4e-6
_AS_IT_IS = np.array([[0.0, 1.0]])  # `TubeRun.lag` without filters
THREAD, EXACT = "a thread is cut in step with the spindle", "G61 asks for the exact path"


def tube_runs_of(toolpath: Toolpath, machine: Machine, *, jerk_limited: bool = True) -> Iterator[TubeRun]:
    """The runs between full stops, in order; without limits of the jerk if it is not `jerk_limited`. Raises
    InputError if the machine lacks an axis of the toolpath."""
    limits = Limits.of(machine, toolpath.axes)
    edges = edges_of(toolpath)
    stops = np.flatnonzero(toolpath.joint[edges] == Joint.STOP)
    (of_legs, of_vertices), shares = budgets_of(toolpath, edges), word_shares(toolpath)
    sag, chord = filter_rate(machine) + chord_rate(machine), float(np.sqrt(2.0 * chord_rate(machine)))
    normal, lag = largest_normal(machine), _lag(machine)
    ends, feeds = toolpath.velocities, toolpath.feed[[0, -1]]
    share = np.maximum(np.array(toolpath.speeds) / feeds, (np.abs(ends) / limits.velocity).max(axis=1))
    ends /= np.maximum(share / (1.0 - BELOW), 1.0)[:, None]
    row, ended = edges[:-1], toolpath.end[edges[1:] - 1]  # the segment that stands for each leg
    ended[:-1] = np.where(
        np.isin(np.arange(1, len(row)), stops)[:, None], ended[:-1], toolpath.start[row[1:]]
    )
    shape, curved, runs = shapes_of(toolpath, row, ended), toolpath.curve[row] >= 0, stops[:-1]
    turned = np.abs(shape["e1"]) + np.abs(shape["e2"])
    moving = np.logical_or.reduceat(np.abs(shape["drift"]) + shape["radius"][:, None] * turned != 0.0, runs)
    bent = np.logical_or.reduceat(curved | (shape["radius"] != 0.0), runs)
    apart = np.maximum.reduceat(shape["drift"], runs) - np.minimum.reduceat(shape["drift"], runs)
    # chords of a motion along a line, and its mean, are on it: what they are ahead or behind by is no distance
    straight = ~bent & (apart.max(axis=1) < STRAIGHT)
    held, exact = (np.logical_or.reduceat(column, edges[runs]) for column in (toolpath.held, toolpath.exact))
    worded, curvy = np.logical_or.reduceat(with_words(toolpath, row, shares), runs), curved.any()
    of_axes: dict[bytes, _OfAxes] = {}
    for n, (begin, end) in enumerate(pairwise(stops.tolist())):
        legs, vertices = slice(begin, end), slice(begin, end + 1)
        first, moves = edges[vertices], moving[n]
        vertex = np.vstack([toolpath.start[row[legs]], ended[end - 1 : end]])
        curves, word, counts, differs = None, np.empty((end - begin, 0)), np.ones(len(moves)), ""
        if curvy and curved[legs].any():
            curves = toolpath.curves.part(toolpath.curve[row[legs]][curved[legs]])
            moves = moves | np.ptp(curves.points, axis=1).any(axis=0)
        if worded[n]:
            word, counts, differs = words_of(toolpath, row[legs], shares)
        key = moves.tobytes() + bytes(worded[n : n + 1]) + counts.tobytes()
        if key not in of_axes:
            of_axes[key] = _of_axes(toolpath, limits, moves, counts, jerk_limited, bool(word.shape[1]))
        of = of_axes[key]
        vertex_budget = of_vertices[vertices].copy()
        vertex_budget[[0, -1]] = 0.0
        yield TubeRun(
            axis=of.axis,
            left=(THREAD if held[n] else EXACT if exact[n] else "") or differs,
            word=word,
            counts=counts[moves],
            first=first,
            curvature=toolpath.curvature[row[legs]],
            curve=np.where(curved[legs], np.cumsum(curved[legs]) - 1, -1),
            curves=of.no_curves if curves is None else replace(curves, points=curves.points[:, :, moves]),
            budget=of_legs[legs],
            feed=toolpath.feed[row[legs]],
            across_max=np.full(end - begin, normal if normal < of.strongest * (1 - 1e-12) else np.inf),
            vertex=vertex[:, moves],
            vertex_budget=vertex_budget,
            ends=ends[:, moves] * [[begin == 0], [end == len(edges) - 1]],
            sag=0.0 if straight[n] else sag,
            lag=_AS_IT_IS if straight[n] else lag,
            chord=0.0 if straight[n] else chord,
            velocity=of.velocity,
            acceleration=of.acceleration,
            jerk=of.jerk,
            laws=_laws(toolpath, of, first, word),
            **{name: value[legs, moves] if value.ndim == 2 else value[legs] for name, value in shape.items()},
        )


class _OfAxes(NamedTuple):
    """What runs on which the same axes move have in common (`TubeRun`).

    no_curves : over them, for a run without any
    strongest : acceleration of all of them together [mm/s2]
    """

    axis: Array
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    no_curves: Curves
    laws: tuple[Law, ...]
    strongest: float


def _of_axes(
    toolpath: Toolpath, limits: Limits, moves: Array, counts: FloatArray, jerk_limited: bool, words: bool
) -> _OfAxes:
    """Of runs on which the axes in `moves` (all,) move; counts (all,): `TubeRun.counts` over all axes; words: whether the feed
    in these is a law of its own."""
    none = toolpath.curves.part(np.empty(0, dtype=np.int64))
    return _OfAxes(
        axis=np.flatnonzero(moves),
        velocity=limits.velocity[moves],
        acceleration=limits.acceleration[moves],
        jerk=np.where(jerk_limited, limits.jerk[moves], np.inf),
        no_curves=replace(none, points=none.points[:, :, moves]),
        laws=tuple(
            law
            for law in laws_of(limits, moves, words, counts)
            if jerk_limited or law.limit is None or QUANTITIES[law.quantity] != JERK.name
        ),
        strongest=float(np.linalg.norm(limits.acceleration[moves])),
    )


def _laws(toolpath: Toolpath, of: _OfAxes, first: Array, word: FloatArray) -> RunLaws:
    """The laws of the run over the segments first[0] : first[-1]; word: `TubeRun.word`."""
    if not of.laws:
        return RunLaws()
    segments = slice(first[0], first[-1])
    return RunLaws(
        laws=of.laws,
        axes=toolpath.axes,
        axis=of.axis,
        still=toolpath.start[first[0]],
        word=word,
        edges=np.cumsum(toolpath.length[segments])[:-1],
        block=toolpath.block[segments],
    )


def _lag(machine: Machine) -> FloatArray:
    """`TubeRun.lag`: every filter is the mean over its length, here by Gauss at three places."""
    places, weights = np.polynomial.legendre.leggauss(3)
    later, share = np.zeros(1), np.ones(1)
    for length in machine.fir.time_constants if machine.fir else ():
        later = np.add.outer(later, length / 2.0 * places).ravel()
        share = np.outer(share, weights / 2.0).ravel()
    return np.column_stack([later, share])


def budgets_of(toolpath: Toolpath, first: Array) -> tuple[FloatArray, FloatArray]:
    """The tolerances (R,) of legs that hold the segments first[r] : first[r+1], first (R+1,), and those (R+1,) of the
    vertices around them, as all tolerances beside them allow [mm]."""
    row = first[:-1]  # the segment that stands for its leg
    leg = np.maximum(toolpath.tolerance[row], toolpath.tolerance[row + 1])
    beside = np.minimum(np.append(leg, np.inf), np.append(np.inf, leg))
    return leg, np.minimum(toolpath.tolerance[first], beside)
