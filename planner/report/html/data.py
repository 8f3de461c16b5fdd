"""The data of a report: samples of the motion, the NC lines with their times, limits.

An hour of motion has millions of samples. A report has `SAMPLES_MAX` of them at most, at equal steps and with
the highest feed of each step beside its first sample, so that no peak of the feed is lost; `step` says so.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.sizes import SIZES
from planner.controls.timing.times import named_parts, tools_of
from planner.geometry.chords import polyline
from planner.geometry.distance import distance_near
from planner.machine import LINEAR_AXES
from planner.motion.trajectory import Trajectory, joined
from planner.nc.points import own_text
from planner.nc.program import Kind
from planner.planning.job.at_tip import of_axes
from planner.report.word_feed import WordFeed, planned_blocks

if TYPE_CHECKING:
    from planner.geometry.toolpath import Toolpath
    from planner.nc.program import Program
    from planner.planning.job.plan import Plan

SAMPLES_MAX = SIZES.page_samples
PROGRAMMED_MAX = SIZES.page_programmed
ARC_POINTS = 48  # of every arc and curve that are shown
NO_LIMIT = "none"
# Around a joint its price is shown within so many tolerances, a rounded corner reaches back some ten of them,
# and at least within this share of the path's extent, some ten pixels of the picture.
NEAR, NEAR_SHARE = 20, 0.012


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples:
    """N samples of the motion."""

    step: int  # every so many samples of the trajectory are shown
    shown: Trajectory  # the samples, rotary axes in rad
    limit: Array  # (N,) index in `limits` of the limit that holds the motion there
    limits: tuple[str, ...]  # their names; the last one is `NO_LIMIT`
    feed: FloatArray  # (N,) as F words mean it [mm/s, deg/s where rotary axes move alone]
    programmed: FloatArray  # (N,) F of the block; inf for rapids
    rapid: Array  # (N,) whether the block is a rapid move
    deviation: FloatArray  # (N,) distance from the programmed path near the block of the sample [mm]
    # (N,) time saved per tolerance at the joint beside the sample [s/mm], 0 far from joints; None where it is
    # not known
    price: FloatArray | None
    # by "tool", "operation" and "layer", where there are several: their names and the index (N,) of each sample
    parts: dict[str, tuple[list[str], Array]] = field(default_factory=dict)


def samples_of(plan: Plan, most: int = SAMPLES_MAX) -> Samples:
    """The samples that a report shows. The plan must have a trajectory."""
    trajectory = plan.trajectory
    assert trajectory is not None
    step = max(1, -(-len(trajectory) // (most if len(trajectory) <= most else most // 2)))
    shown = _thinned(trajectory, step)
    names, limit = _limits(plan, shown)
    word = WordFeed(plan.toolpath)
    segment = plan.toolpath.segment_at(shown.block)
    return Samples(
        step=step,
        shown=shown,
        limit=limit,
        limits=names,
        feed=word.of(shown),
        programmed=word.programmed(plan.program, shown.block),
        rapid=plan.program.kind[np.clip(shown.block, 0, None)] == Kind.RAPID,
        deviation=distance_near(plan.toolpath, shown.position, segment),
        price=_price(plan, shown.position, segment),
        parts=_parts(plan.program, shown.block),
    )


def _parts(program: Program, block: Array) -> dict[str, tuple[list[str], Array]]:
    """Tools, operations (line types of slicers) and layers that the blocks `block` (n,) stand in, where they are
    several."""
    operations, layers = named_parts(program, own_text(program) or b"")
    found = {}
    for kind, of_block in {"tool": tools_of(program), "operation": operations, "layer": layers}.items():
        if of_block is None:
            continue
        names = list(dict.fromkeys(of_block))
        if len(names) > 1:
            index = {name: k for k, name in enumerate(names)}
            of = np.array([index[name] for name in of_block])
            found[kind] = [name or "before" for name in names], of[np.clip(block, 0, None)]
    return found


def _price(plan: Plan, position: FloatArray, segment: Array) -> FloatArray | None:
    """(n,) what tolerance at the nearer joint of its segment (n,) saves each sample's place (n, A) [s/mm]; 0
    far from joints (`NEAR`), None where it is not known."""
    places = plan.prices.places if plan.prices is not None else None
    if places is None or places.tolerance is None:
        return None
    toolpath = plan.toolpath
    before = np.linalg.norm(position - toolpath.start[segment], axis=1)
    behind = np.linalg.norm(position - toolpath.end[segment], axis=1)
    joint = np.where(before <= behind, segment, segment + 1)
    extent = float(np.ptp(toolpath.end, axis=0).max())
    near = np.minimum(before, behind) <= np.maximum(NEAR * toolpath.tolerance[joint], NEAR_SHARE * extent)
    price: FloatArray = np.where(near, np.maximum(-places.tolerance[joint], 0.0), 0.0)
    return price


def _thinned(trajectory: Trajectory, step: int) -> Trajectory:
    """Every so many samples, the fastest one of each step, and the last one."""
    if step == 1:
        return joined(list(trajectory.chunks()))
    parts, first = [], 0
    for chunk in trajectory.chunks():
        n = len(chunk)
        starts = np.arange(-first % step, n, step)
        bounds = np.append(starts, n)
        fastest = [a + int(np.argmax(chunk.feed[a:b])) for a, b in itertools.pairwise(bounds)]
        last = [n - 1] if first + n >= len(trajectory) else []
        parts.append(chunk.rows(np.unique(np.array([*starts, *fastest, *last], dtype=np.int64))))
        first += n
    return joined(parts)


def _limits(plan: Plan, shown: Trajectory) -> tuple[tuple[str, ...], Array]:
    """Names of the limits, and which holds each sample: that of the solution, or where there is none the one
    closest to its limit."""
    if plan.grid is not None and len(plan.grid.t):
        at = np.clip(np.searchsorted(plan.grid.t, shown.t, side="right") - 1, 0, None)
        return used_limits(plan.grid.active_names, plan.grid.active[at])
    axes = of_axes(plan, shown)
    names, ratios = [NO_LIMIT], [np.full(len(shown), 0.99)]
    for quantity in ("velocity", "acceleration", "jerk"):
        share = np.abs(getattr(axes, quantity)) / plan.machine.limits(quantity, shown.axes)
        names += [f"{quantity}.{axis}" for axis in shown.axes]
        ratios += list(share.T)
    names.append("feed")
    word = WordFeed(plan.toolpath)
    ratios.append(word.of(shown) / word.programmed(plan.program, shown.block))
    return used_limits(tuple(names), np.argmax(np.stack(ratios), axis=0))


def used_limits(names: tuple[str, ...], index: Array) -> tuple[tuple[str, ...], Array]:
    """Of `names` those that occur in an `index` (n,), `NO_LIMIT` last, and the indices (n,) among them."""
    used = sorted(set(np.unique(index).tolist()), key=lambda k: (names[k] == NO_LIMIT, k))
    place = np.zeros(len(names), np.int64)
    place[used] = np.arange(len(used))
    found = tuple(names[k] for k in used)
    return (found if NO_LIMIT in found else (*found, NO_LIMIT)), place[index]


def lines_of(plan: Plan, samples: Samples) -> dict[str, Array]:
    """The L NC lines of a plan that move, in the order of the motion, in columns (L,):

    line       : number
    planned    : time of the motion [s], dwells not included
    programmed : time at the programmed feed without any acceleration [s]; NaN for rapids
    highest    : highest feed of the samples shown, or what is known of lines without one [mm/s]
    limit      : index in `Samples.limits` of the limit that holds the motion there for the longest time
    deviation  : largest distance of the samples shown from the programmed path [mm]; NaN where no sample is shown
    more_feed  : time that a tenth more of this line's feed would save [s], where it is known
    more       : time that a tenth more of all limits on this line would save [s], where it is known
    """
    toolpath, trajectory = plan.toolpath, plan.trajectory
    assert trajectory is not None
    blocks = planned_blocks(trajectory, toolpath)
    fresh = np.append(True, np.diff(toolpath.line) != 0)
    row = np.cumsum(fresh) - 1  # of each segment
    rows = int(row[-1]) + 1 if len(row) else 0
    at = row[toolpath.segment_at(samples.shown.block)]
    highest, unseen, deviation = np.full(rows, -1.0), np.zeros(rows), np.full(rows, -1.0)
    np.maximum.at(highest, at, samples.feed)
    np.maximum.at(unseen, row, WordFeed(toolpath).of_segments(blocks.highest))
    np.maximum.at(deviation, at, samples.deviation)
    programmed = np.where(toolpath.rapid, np.nan, toolpath.length / toolpath.feed)
    columns: dict[str, Array] = {
        "line": toolpath.line[fresh],
        "planned": np.bincount(row, blocks.duration, rows).astype(np.float64),
        "programmed": np.bincount(row, programmed, rows).astype(np.float64),
        "highest": np.where(highest < 0.0, unseen, highest),
        "limit": _longest(at, samples, rows),
        "deviation": np.where(deviation < 0.0, np.nan, deviation),
    }
    if plan.prices is not None and (places := plan.prices.places) is not None:
        for name, saved in (("more_feed", places.feed), ("more", places.limits)):
            columns[name] = np.bincount(row, saved, rows).astype(np.float64)
    return columns


def _longest(at: Array, samples: Samples, rows: int) -> Array:
    """(rows,) the limit that holds each row's samples for the longest time; `NO_LIMIT` where there is
    none."""
    kinds = len(samples.limits)
    lasting = np.diff(samples.shown.t, append=samples.shown.t[-1:])
    time = np.bincount(at * kinds + samples.limit, lasting, rows * kinds).reshape(rows, kinds)
    longest: Array = np.where(time.sum(axis=1) > 0, time.argmax(axis=1), samples.limits.index(NO_LIMIT))
    return longest


def programmed_path(toolpath: Toolpath, most: int = PROGRAMMED_MAX) -> FloatArray:
    """(n, 3) points of the programmed path [mm]: its vertices, and `ARC_POINTS` on every arc and curve; every
    so many where they are more than `most`."""
    linear = [k for k, axis in enumerate(toolpath.axes) if axis in LINEAR_AXES]
    if not len(toolpath):
        return np.zeros((0, 3))
    count = np.where(toolpath.straight, 1, ARC_POINTS)
    points = polyline(toolpath, count)[0][:, linear]
    points = points[:: max(1, -(-len(points) // most))]
    return np.pad(points, ((0, 0), (0, 3 - len(linear))))
