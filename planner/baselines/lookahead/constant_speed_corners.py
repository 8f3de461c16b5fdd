"""Corners at constant speed (paper 002): how fast each may be, and their chain for the look-ahead.

At the constant speed v an axis has r'_k v, r''_k v^2 and r'''_k v^3, so that over a corner

    v <= v_k / max |r'_k|,   v <= (a_k / max |r''_k|)^(1/2),   v <= (j_k / max |r'''_k|)^(1/3)         for every axis k,

besides the bounds on kappa v^2 of eq. (18)-(20), the chord error and the programmed feed
(feedrate/constraints/assemble.py). The maxima of r'' and r''' are taken from five samples per grid interval;
with the samples g_i of one component a smooth function exceeds them by at most max |g_{i-1} - 2 g_i +
g_{i+1}| / 8 but for terms of fourth order, which is added. What is added depends on where intervals end.
"""

from typing import NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.baselines.lookahead.ramps import LEG, WAY, JointKind, records
from planner.baselines.lookahead.rest_to_rest import block_limits
from planner.corners.elements import ElementIntervals, element_point, to_arc_length
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.sampling.path_samples import PathSamples
from planner.machine import Machine

STEPS = 4  # in which a grid interval is sampled: peaks are then good to the fourth order (module text)
# Limits along blocks that differ by less are the same [-]: coordinates are rounded.
SAME = 1e-9


def constant_speeds(samples: PathSamples, machine: Machine) -> FloatArray:
    """(R+1,) the largest speed at which each corner of a sampled path can be run through from end to end
    (module text) [mm/s]; inf where there is no corner."""
    axes = samples.path.toolpath.axes
    limits = np.array([machine.limits("acceleration", axes), machine.limits("jerk", axes)])
    problem = feedrate_problem(samples, machine.with_own(()))
    interval = samples.intervals
    at = interval[samples.element[interval] < 0]
    joint = ~samples.element[at]
    bends = np.zeros((len(at), 2))
    on = ElementIntervals(*samples.table, samples.element[at], samples.w0[at], samples.w1[at])
    _bends(on, limits, bends)
    feed_sq = np.minimum(problem.feed_sq_max[at], problem.feed_sq_max[at + 1])
    with np.errstate(divide="ignore"):
        bounds = np.sqrt(feed_sq), bends[:, 0] ** -0.5, bends[:, 1] ** (-1.0 / 3.0)
    speed = np.full(len(samples.path.d), np.inf)
    np.minimum.at(speed, joint, np.min(bounds, axis=0))
    return speed


class CornerChain(NamedTuple):
    """A smooth path as n legs with joints: corners at constant speed, full stops, changes of limits."""

    # (n,) records `LEG`: what is free between two joints, and what the corners took of their legs
    legs: np.recarray
    passage: np.recarray  # (n+1,) records `WAY`
    joint: Array  # (n+1,) the path's joint if it is a corner, -1 otherwise
    run: Array  # (n,) run between full stops that a leg belongs to
    begin: FloatArray  # (n,) where each leg begins, or the corner before it [mm]


def corner_chain(samples: PathSamples, machine: Machine, corner_speed: FloatArray) -> CornerChain:
    """The chain of legs and corners of a sampled path.

    corner_speed : (R+1,) largest speed of each joint's corner [mm/s]

    Raises ValueError if two corners, or a corner and a full stop, leave nothing of the leg between them free.
    """
    path, at = samples.path, samples.intervals
    element = samples.element[at]
    run = np.searchsorted(samples.piece, at, side="right") - 1
    joint = np.where(element < 0, ~element, -1)
    limits = np.stack(block_limits(path.toolpath, machine))[:, samples.segment[at]]
    # Blocks that cut a line must not make two legs of it, and their directions differ by rounding.
    other = (np.abs(np.diff(limits)) > SAME * limits[:, 1:]).any(axis=0) & (joint[1:] < 0)
    change = (np.diff(run) != 0) | (np.diff(joint) != 0) | other
    first = np.insert(np.flatnonzero(change) + 1, 0, 0)
    begin = samples.s[at[first]]
    length = samples.s[at[np.append(first[1:], len(at)) - 1] + 1] - begin
    joint, run, limits = joint[first], run[first], np.minimum.reduceat(limits, first, axis=1)
    corner = joint >= 0
    bare = (corner[:-1] & corner[1:]) | ((np.diff(run) != 0) & (corner[:-1] | corner[1:]))
    if bare.any() or corner[0] or corner[-1]:
        raise ValueError("corner_chain: corners must leave something of every leg free")

    leg = np.flatnonzero(~corner)
    v, a, j = limits[:, leg]
    before = np.insert(leg[1:] - 1, 0, 0)  # what is before each leg: a corner, or a leg
    where = np.append(np.where(corner[before], joint[before], -1), -1)
    turns = where >= 0
    d_in, d_out = (np.where(turns, d[where], 0.0) for d in (path.d_in, path.d_out))
    stop = np.append(np.insert(np.diff(run[leg]) != 0, 0, True), True)
    beside = np.minimum(np.append(v, np.inf), np.insert(v, 0, np.inf))
    passage = records(
        WAY,
        kind=np.where(stop, JointKind.STOP, np.where(turns, JointKind.CONSTANT, JointKind.PASS)),
        V=np.where(stop, 0.0, np.where(turns, np.minimum(corner_speed[where], beside), beside)),
        p=d_in,
        q=d_out,
        r=np.where(turns, np.append(length[before], 0.0), 0.0),
    )
    return CornerChain(
        legs=records(LEG, length=length[leg] + d_out[:-1] + d_in[1:], v=v, a=a, j=j),
        passage=passage,
        joint=where,
        run=run[leg],
        begin=np.where(turns[:-1], begin[before], begin[leg]),
    )


@njit(cache=True, error_model="numpy")
def _bends(on, limits, bends):
    """The largest |r''_k|/a_k and |r'''_k|/j_k over each of the `ElementIntervals` into bends (n, 2); limits (2, A): a, j."""
    axes = limits.shape[1]
    work, here = np.empty((2, 4, axes)), np.empty((4, axes))
    values = np.empty((2, axes, STEPS + 1))
    for i in range(len(on.element)):
        w_ref = 0.5 * (on.w0[i] + on.w1[i])
        for p in range(STEPS + 1):
            w = on.w0[i] + (on.w1[i] - on.w0[i]) * p / STEPS
            element_point(on.legs, on.corners, on.spans, on.element[i], w, w_ref, work, here)
            to_arc_length(here)
            for k in range(axes):
                values[0, k, p], values[1, k, p] = here[2, k], here[3, k]
        for q in range(2):
            for k in range(axes):
                g = values[q, k]
                largest, second = 0.0, 0.0
                for p in range(STEPS + 1):
                    largest = max(largest, abs(g[p]))
                    if 0 < p < STEPS:
                        second = max(second, abs(g[p - 1] - 2.0 * g[p] + g[p + 1]))
                bends[i, q] = max(bends[i, q], (largest + second / 8.0) / limits[q, k])
