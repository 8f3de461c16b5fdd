"""The planned motion as a polyline: setpoints between which straight moves miss no other setpoint by more
than a given distance.

A chord of length l over curvature kappa misses by kappa l^2 / 8. So the density of the vertices along the path is
(kappa / 8 miss)^(1/2), and they are the setpoints at which its integral passes whole numbers. Chords that miss by
more, which is measured, are divided, and their parts are measured again. The ends of rapid moves, standstills and
places where something else happens (an M word) are vertices in any case.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.controls.export.rows import Row
from planner.geometry.chords import polyline
from planner.geometry.distance import distance_near
from planner.motion.trajectory import Trajectory
from planner.nc import codes
from planner.nc.program import Kind, Program
from planner.planning.job.plan import Plan

DENSER = 1.2  # than for an even curvature: chords that miss by a little more are halved
DECIMALS = 4  # of a coordinate in mm
LINEAR = 3  # axes that chords have: x, y, z
PLACES = 5  # of a chord at which its distance from the path is measured


@dataclass(frozen=True, eq=False, kw_only=True)
class Polyline:
    """Straight moves between n+1 points."""

    points: FloatArray  # (n+1, A) [mm], rounded to `DECIMALS`
    feed: FloatArray  # (n,) planned feed: the highest of the setpoints from one point to the next [mm/s]
    block: Array  # (n,) block of the program of each move
    rapid: Array  # (n,) whether that is a rapid move
    miss: float  # how far the moves miss a setpoint at most [mm]


@dataclass(frozen=True, slots=True)
class Group:
    """Blocks from `first` to before `last`, whether chords replace them, and the axes placed before them."""

    first: int
    last: int
    replaced: bool
    placed: frozenset[str]


def planned_polyline(plan: Plan, within: float, breaks: Array) -> Polyline:
    """The planned motion as a polyline that misses no setpoint by more than `within` [mm], above the rounding
    of coordinates; `breaks` (K,) are the blocks before which something else happens, ascending.

    Raises ValueError for a plan without a trajectory.
    """
    trajectory = plan.require().trajectory
    assert trajectory is not None
    position, moved = _switched(plan.program, trajectory, breaks, within)
    rows, miss = _vertices(trajectory, position, _fixed(plan, trajectory, breaks), within - moved)
    miss += moved
    points = _rounded(position[rows])
    feed = np.maximum(np.maximum.reduceat(trajectory.feed, rows[:-1]), trajectory.feed[rows[1:]])
    block = trajectory.block[np.minimum(rows[:-1] + 1, rows[1:])]
    moves = (np.diff(points, axis=0) != 0).any(axis=1)
    points, feed, block = points[np.append(True, moves)], feed[moves], block[moves]
    rapid = plan.program.kind[block] == Kind.RAPID
    return Polyline(points=points, feed=feed, block=block, rapid=rapid, miss=miss)


def programmed_polyline(plan: Plan, within: float) -> Polyline:
    """The programmed path as a polyline, at the programmed feeds: straight moves as they are, arcs and curves
    as chords that are `within` of them [mm]."""
    toolpath = plan.toolpath
    chord = np.sqrt(8.0 * within / np.maximum(toolpath.curvature, 1e-12))
    count = np.where(toolpath.straight, 1, np.ceil(toolpath.length / chord)).astype(np.int64)
    points, segment = polyline(toolpath, count)
    return Polyline(
        points=_rounded(points),
        feed=toolpath.feed[segment],
        block=toolpath.block[segment],
        rapid=toolpath.rapid[segment],
        miss=within if (count > 1).any() else 0.0,
    )


def spliced(planned: Polyline, own: Polyline, program: Program, groups: Sequence[Group]) -> Polyline:
    """The polyline of a program of which chords replace a part: theirs there, and else that of the program's
    own words.

    Chords begin and end where the program has its blocks end, and leave axes alone that the program has not
    placed: the words around them may be relative, or shift the coordinates.
    """
    points = [own.points[:1]]
    parts: list[tuple[FloatArray, Array, Array]] = []  # feed, block and whether it is rapid, of the moves
    for group in groups:
        line = planned if group.replaced else own
        begin, end = np.searchsorted(line.block, [group.first, group.last]).tolist()
        ends, here = line.points[begin + 1 : end + 1].copy(), points[-1][-1]
        of, fast, which = line.feed[begin:end], line.rapid[begin:end], line.block[begin:end]
        if group.replaced:
            last, k = here.copy(), group.last - 1
            last[:LINEAR] = _rounded(program.end[k, :LINEAR])
            if not len(ends) and (last != here).any():  # shorter than a period
                ends, of, which = last[None].copy(), program.feed[k : k + 1], np.array([k])
                fast = program.kind[k : k + 1] == Kind.RAPID
            ends[-1:] = last
            for a, letter in enumerate(program.axes):
                if a >= LINEAR or letter.upper() not in group.placed:
                    ends[:, a] = here[a]
        if len(ends):
            points.append(ends)
            parts.append((of, which, fast))
    feed, block, rapid = (np.concatenate(column) for column in zip(*parts, strict=True))
    vertices, miss = np.vstack(points), max(planned.miss, own.miss)
    return Polyline(points=vertices, feed=feed, block=block, rapid=rapid, miss=miss)


def groups(rows: list[Row], replaced: Array) -> list[Group]:
    """The blocks in groups: those that chords replace one after the other, and those of the rows' own words;
    `replaced` (R,)."""
    found: list[Group] = []
    parted = True
    for row, chords in zip(rows, replaced.tolist(), strict=True):
        shifts = any(codes.G_GROUP[code] in ("one-shot", "work offset", "tool length") for code in row.g())
        parted |= shifts or bool(row.text) or row.feeds
        if row.last == row.first:
            continue
        last = found[-1] if found else None
        if last is not None and last.replaced == chords and not (parted and chords):
            found[-1] = Group(last.first, row.last, last.replaced, last.placed)
        else:
            found.append(Group(row.first, row.last, chords, row.placed))
        parted = shifts or row.feeds
    return found


def breaks(rows: list[Row], replaced: Array) -> Array:
    """(K,) the blocks before which something else than a chord stands, ascending; chords replace the rows
    `replaced` (R,)."""
    found: set[int] = set()
    for row, chords in zip(rows, replaced.tolist(), strict=True):
        switches = any(word.letter in "SMT" for word in row.words)
        if not chords or row.others or row.feeds or switches or row.motion > 30:
            found |= {row.first, row.last}
    return np.array(sorted(found), dtype=np.int64)


def off_the_path(line: Polyline, plan: Plan, groups: Sequence[Group]) -> float:
    """How far the first and last straight moves of the groups that chords replace are from the programmed
    path [mm]: these end where the program does, not at a setpoint."""
    toolpath = plan.toolpath
    replaced = [group for group in groups if group.replaced]
    first = np.searchsorted(line.block, [group.first for group in replaced])
    last = np.searchsorted(line.block, [group.last for group in replaced]) - 1
    moves = np.unique(np.concatenate([first, last]))
    moves = moves[(moves >= 0) & (moves < len(line.block))]
    start, step = line.points[moves], line.points[moves + 1] - line.points[moves]
    segment = np.minimum(np.searchsorted(toolpath.block, line.block[moves]), len(toolpath) - 1)
    places = (start + share * step for share in np.linspace(0.0, 1.0, PLACES))
    return max(float(distance_near(toolpath, place, segment).max(initial=0.0)) for place in places)


def _rounded(points: FloatArray) -> FloatArray:
    """Points (n, A) as they are written."""
    found: FloatArray = np.round(points, DECIMALS)
    return found


def _switched(
    program: Program, trajectory: Trajectory, breaks: Array, within: float
) -> tuple[FloatArray, float]:
    """(T, A) setpoints, of which the last before each of the breaks goes on to where its block ends, on the way to
    the next: what is switched there was switched up to a period early. And by how much chords through these miss the
    setpoints that went on, at most half of `within` [mm]; where that would be more they stay."""
    position = trajectory.position
    last = np.searchsorted(trajectory.block, breaks, side="left") - 1
    inside = (last > 0) & (last < len(position) - 1) & (breaks > 0)
    last, ends = last[inside], program.end[breaks[inside] - 1]
    before, here, step = position[last - 1], position[last], position[last + 1] - position[last]
    size = (step * step).sum(axis=1)
    u = np.divide(((ends - here) * step).sum(axis=1), size, out=np.zeros(len(size)), where=size > 0.0)
    there = here + np.clip(u, 0.0, 1.0)[:, None] * step
    chord = there - before
    size = (chord * chord).sum(axis=1)
    u = np.divide(((here - before) * chord).sum(axis=1), size, out=np.zeros(len(size)), where=size > 0.0)
    off = np.linalg.norm(here - before - np.clip(u, 0.0, 1.0)[:, None] * chord, axis=1)
    good = off <= 0.5 * within
    moved = position.copy()
    moved[last[good]] = there[good]
    return moved, float(off[good].max(initial=0.0))


def _fixed(plan: Plan, trajectory: Trajectory, breaks: Array) -> Array:
    """(T,) setpoints that are vertices: ends, standstills, those beside turning back, where rapid moves begin
    and end, and the last before each of the breaks."""
    fixed = np.zeros(len(trajectory), dtype=bool)
    fixed[[0, -1]] = True
    fixed |= trajectory.feed <= 1e-9 * max(float(trajectory.feed.max()), 1e-9)
    back = (trajectory.velocity[1:] * trajectory.velocity[:-1]).sum(axis=1) < 0.0
    fixed[1:] |= back
    fixed[:-1] |= back
    rapid = plan.program.kind[trajectory.block] == Kind.RAPID
    fixed[:-1] |= rapid[1:] != rapid[:-1]
    if len(breaks):
        passed = np.searchsorted(breaks, trajectory.block, side="right")
        fixed[:-1] |= passed[1:] != passed[:-1]
    return fixed


def _density(trajectory: Trajectory, within: float) -> FloatArray:
    """(T,) vertices per mm of path, at least one for the whole of it."""
    v, a = trajectory.velocity, trajectory.acceleration
    speed_sq = (v * v).sum(axis=1)
    moving = speed_sq > 1e-12 * max(float(speed_sq.max()), 1e-12)
    along = np.divide((v * a).sum(axis=1), speed_sq, out=np.zeros(len(v)), where=moving)
    across = np.linalg.norm(a - along[:, None] * v, axis=1)
    kappa = np.divide(across, speed_sq, out=np.zeros(len(v)), where=moving)
    density: FloatArray = np.sqrt(kappa / (8.0 * within)) + 1.0 / max(float(trajectory.s[-1]), 1e-9)
    return density


def _vertices(
    trajectory: Trajectory, position: FloatArray, fixed: Array, within: float
) -> tuple[Array, float]:
    """(n+1,) the setpoints, at places (T, A), between which chords miss no other by more than `within` [mm], and by how much
    at most; those that are `fixed` (T,) are among them."""
    density = DENSER * _density(trajectory, within)
    along = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(trajectory.s)))
    rows = np.flatnonzero(np.append(True, np.diff(np.floor(along)) > 0) | fixed)
    found, miss = [rows], 0.0
    begin, end = rows[:-1], rows[1:]
    while len(begin):
        off = _misses(position, begin, end)
        divided = (off > within) & (end - begin > 1)
        miss = max(miss, float(off[~divided].max(initial=0.0)))
        begin, end, off = begin[divided], end[divided], off[divided]
        parts = np.minimum(np.maximum(np.ceil(np.sqrt(off / within)), 2), end - begin).astype(np.int64)
        of = np.repeat(np.arange(len(begin)), parts - 1)
        number = np.arange(len(of)) - np.repeat(np.cumsum(parts - 1) - parts + 1, parts - 1) + 1
        target = along[begin[of]] + (along[end[of]] - along[begin[of]]) * number / parts[of]
        found.append(np.clip(np.searchsorted(along, target), begin[of] + 1, end[of] - 1))
        nodes = np.unique(np.append(begin, found[-1]))
        chord = np.searchsorted(begin, nodes, side="right") - 1
        last = np.append(np.diff(chord) > 0, True) if len(nodes) else np.zeros(0, dtype=bool)
        begin, end = nodes, np.where(last, end[chord], np.append(nodes[1:], 0))
    return np.unique(np.concatenate(found)), miss


def _misses(position: FloatArray, begin: Array, end: Array) -> FloatArray:
    """(n,) how far chords miss the setpoints (T, A) from `begin` (n,) to before `end` (n,) at most, or how far these go
    back along them, if that is more: a way there and back lies on the chord, which would leave it out."""
    count = end - begin
    first = np.cumsum(count) - count
    move = np.repeat(np.arange(len(begin)), count)
    seen = position[np.arange(len(move)) - np.repeat(first - begin, count)]
    a = _rounded(position[begin])
    chord = _rounded(position[end]) - a
    size = (chord * chord).sum(axis=1)[move]
    from_start = seen - a[move]
    u = np.divide((from_start * chord[move]).sum(axis=1), size, out=np.zeros(len(move)), where=size > 0)
    off = np.linalg.norm(from_start - np.clip(u, 0.0, 1.0)[:, None] * chord[move], axis=1)
    along = u * np.sqrt(size)
    along += move * 2.0 * float(np.abs(along).max(initial=1.0))  # each move above all before it
    worst: FloatArray = np.maximum.reduceat(np.maximum(off, np.maximum.accumulate(along) - along), first)
    return worst
