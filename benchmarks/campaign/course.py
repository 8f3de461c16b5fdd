"""The programmed path as chords, for the second judge of the campaign (judge.py): numpy alone.

A program comes in as arrays (`Blocks`, the fields of a read program), and is laid out by the formulas of the language:

    line     from the end of the block before to its own
    arc      about its centre, the angle proportional to the way; a difference of the radii at both ends is spread over it
    spline   rational Bezier cubics,  p(u) = sum w_i B_i(u) P_i / sum w_i B_i(u)
    feed     F is the speed of x, y and z; where they stand of u, v, w; where these stand too of the rotary axes
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

Array = np.ndarray
RAPID, LINE, ARC, DWELL, STOP, SPLINE = range(6)
BLEND, EXACT_PATH, EXACT_STOP = range(3)
NOWHERE = 1e-9  # [mm] a move shorter than this is none
SAG = 0.004  # of chords, as a share of the tolerance [-]
ARC_CHORDS = 1500  # of an arc at most
SPLINE_CHORDS = 160  # of a cubic
RATIO, PLACE = 1e-6, 2e-6  # [-], [mm]: what is rounding
STRAIGHT = 1e-8  # [rad] a turn below this is none


@dataclass(frozen=True, eq=False, kw_only=True)
class Blocks:
    """A program, its rotary axes in angle times `radius`; names as in the package's record of a program.

    tolerance : (B,) in force [mm]
    rotary    : (A,) True for a, b and c; `linear` for x, y and z
    """

    kind: Array
    start: Array
    end: Array
    feed: Array
    dwell: Array
    control: Array
    tolerance: Array
    arc_block: Array
    arc_center: Array
    arc_normal: Array
    arc_sweep: Array
    spline_block: Array
    spline_points: Array
    spline_weights: Array
    linear: Array
    rotary: Array
    radius: float
    feed_max: float = np.inf
    blend_rapids: bool = False


@dataclass(frozen=True, kw_only=True)
class Vertex:
    """The end of a block: its place, what is allowed there [mm], and whether the motion stands still there for how long [s]."""

    place: Array
    block: int
    tolerance: float
    stop: bool = False
    dwell: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Course:
    """N chords: points (N + 1, A), the block of each, its feed along all axes, how far the motion may be off, and the vertices.

    wide   : (N,) the tolerance there, with what the chords are off [mm]
    strict : (N,) the same, and next to nothing where the path is to be followed exactly
    """

    points: Array
    block: Array
    feed: Array
    wide: Array
    strict: Array
    vertices: tuple[Vertex, ...]

    def reversed(self) -> Course:
        """The chords from the last to the first; no vertices."""
        return dataclasses.replace(
            self, points=self.points[::-1], block=self.block[::-1], feed=self.feed[::-1], wide=self.wide[::-1],
            strict=self.strict[::-1], vertices=(),
        )  # fmt: skip


def course(blocks: Blocks) -> Course:
    """Lay out a program. Raises ValueError where nothing moves."""
    at, parts, sags = blocks.start, [], []
    owner = []
    for k, kind in enumerate(blocks.kind):
        points, sag = _points(blocks, k, at)
        at = blocks.end[k]
        if kind in (DWELL, STOP) or (
            kind in (RAPID, LINE) and np.linalg.norm(points[-1] - points[0]) <= NOWHERE
        ):
            continue
        if np.ptp(points, axis=0).max() <= NOWHERE:
            continue
        parts.append(points)
        sags.append(sag)
        owner.append(k)
    if not parts:
        raise ValueError("nothing moves")
    tolerance = blocks.tolerance[owner]
    allowed = np.maximum(tolerance, np.append(tolerance[:1], tolerance[:-1]))
    sag = np.array(sags)
    wide = allowed * (1 + RATIO) + sag + PLACE
    exact = blocks.control[owner] != BLEND
    held = exact & np.append(True, exact[:-1]) & np.append(exact[1:], True)
    count = np.array([len(points) - 1 for points in parts])
    feed = np.array([_feed(blocks, k, points) for k, points in zip(owner, parts, strict=True)])
    return Course(
        points=np.vstack([parts[0][:1], *(points[1:] for points in parts)]),
        block=np.repeat(owner, count),
        feed=np.repeat(feed, count),
        wide=np.repeat(wide, count),
        strict=np.repeat(np.where(held, sag + PLACE, wide), count),
        vertices=tuple(_vertices(blocks, owner, parts)),
    )


def _points(blocks: Blocks, k: int, at: Array) -> tuple[Array, float]:
    """(n, A) points of a block from its start to its end, and how far the chords are off [mm]."""
    kind, end = blocks.kind[k], blocks.end[k]
    if kind == ARC:
        return _arc(blocks, int(np.flatnonzero(blocks.arc_block == k)[0]), at, end)
    if kind == SPLINE:
        return _spline(blocks, k)
    return np.array([at, end]), 0.0


def _arc(blocks: Blocks, row: int, at: Array, end: Array) -> tuple[Array, float]:
    normal, sweep = int(blocks.arc_normal[row]), float(blocks.arc_sweep[row])
    i, j = (normal + 1) % 3, (normal + 2) % 3
    center = blocks.arc_center[row][[i, j]]
    radial, last = at[[i, j]] - center, end[[i, j]] - center
    r0, r1 = np.hypot(*radial), np.hypot(*last)
    tolerance = float(blocks.tolerance[blocks.arc_block[row]])
    step = np.sqrt(8 * SAG * tolerance / max(r0, r1))
    count = int(np.clip(np.ceil(abs(sweep) / step), 4, ARC_CHORDS))
    u = np.linspace(0.0, 1.0, count + 1)
    points = at + u[:, None] * (end - at)
    angle = np.arctan2(radial[1], radial[0]) + u * sweep
    gap = last - r0 * np.array([np.cos(angle[-1]), np.sin(angle[-1])])
    points[:, i] = center[0] + r0 * np.cos(angle) + u * gap[0]
    points[:, j] = center[1] + r0 * np.sin(angle) + u * gap[1]
    return points, max(r0, r1) * (sweep / count) ** 2 / 8


def _spline(blocks: Blocks, k: int) -> tuple[Array, float]:
    u = np.linspace(0.0, 1.0, 2 * SPLINE_CHORDS + 1)[:, None]
    basis = np.hstack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
    parts, sag = [], 0.0
    for row in np.flatnonzero(blocks.spline_block == k):
        weight = blocks.spline_weights[row]
        fine = basis @ (weight[:, None] * blocks.spline_points[row]) / (basis @ weight)[:, None]
        middle = (fine[2::2] + fine[:-2:2]) / 2
        sag = max(sag, float(np.linalg.norm(fine[1::2] - middle, axis=1).max()))
        parts.append(fine[::2] if not parts else fine[2::2])
    return np.vstack(parts), 2 * sag


def _feed(blocks: Blocks, k: int, points: Array) -> float:
    """Largest speed along all axes [mm/s]."""
    if blocks.kind[k] == RAPID:
        return np.inf
    change = np.abs(np.diff(points, axis=0))
    groups = (blocks.linear, ~blocks.linear & ~blocks.rotary, blocks.rotary)
    ways = [np.linalg.norm(change[:, group], axis=1) for group in groups]
    whole = np.linalg.norm(change, axis=1)
    for way, by in zip(ways, (1.0, 1.0, 1.0 / blocks.radius), strict=True):
        if way.sum() > NOWHERE:
            goes = way > 0.0
            per = (
                (whole[goes] / (way[goes] * by)).max()
                if blocks.kind[k] == SPLINE
                else whole.sum() / (way.sum() * by)
            )
            return min(float(blocks.feed[k] * per), blocks.feed_max)
    return np.inf


def _vertices(blocks: Blocks, owner: list[int], parts: list[Array]) -> list[Vertex]:
    """The ends of the blocks that move, and where the program stands still before the first of them."""
    found = []
    for n in range(-1, len(owner)):
        block = owner[n] if n >= 0 else -1
        after = owner[n + 1] if n + 1 < len(owner) else len(blocks.kind)
        between = slice(block + 1, after)
        dwell = float(blocks.dwell[between].sum())
        stop = bool(np.isin(blocks.kind[between], (DWELL, STOP)).any()) or n < 0 or n + 1 == len(owner)
        if not stop:
            stop = _stops(blocks, block, after, parts[n], parts[n + 1])
        place = parts[n][-1] if n >= 0 else parts[0][0]
        tolerance = float(blocks.tolerance[max(block, 0)])
        found.append(Vertex(place=place, block=block, tolerance=tolerance, stop=stop, dwell=dwell))
    return found


def _stops(blocks: Blocks, block: int, after: int, before: Array, behind: Array) -> bool:
    """Whether there is a full stop between two blocks that move."""
    if blocks.control[block] == EXACT_STOP:
        return True
    rapid = blocks.kind[[block, after]] == RAPID
    if not blocks.blend_rapids and rapid[0] != rapid[1]:
        return True
    straight = np.isin(blocks.kind[[block, after]], (RAPID, LINE)).all()
    u1, u2 = before[-1] - before[-2], behind[1] - behind[0]
    angle = 2 * np.arctan2(
        np.linalg.norm(u2 / np.linalg.norm(u2) - u1 / np.linalg.norm(u1)),
        np.linalg.norm(u2 / np.linalg.norm(u2) + u1 / np.linalg.norm(u1)),
    )
    return bool(straight and blocks.control[block] == EXACT_PATH and angle > STRAIGHT)
