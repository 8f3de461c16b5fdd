"""Paths of pockets: their distance from the walls, that they close, and what a tool along them clears."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from planner.base.arrays import Array, FloatArray
from planner.nc.language.milling import CORNERS_CLEAR, ArcSlot, Path, PocketShape, RoundedRectangle, loops

SHAPES = {
    "rectangle": RoundedRectangle(30.0, 20.0, 6.0),
    "upright": RoundedRectangle(12.0, 25.0, 5.0),
    "square": RoundedRectangle(20.0, 20.0, 5.0),
    "circle": RoundedRectangle(18.0, 18.0, 18.0),
    "slot": RoundedRectangle(30.0, 7.0, 7.0),
    "arc": ArcSlot(40.0, 8.0, 0.3, 1.9),
    "arc back": ArcSlot(25.0, 6.0, -1.0, -2.5),
}


def depth_in(shape: PocketShape, points: Array) -> FloatArray:
    """Distance of points (N,), complex, from the walls; negative outside."""
    if isinstance(shape, RoundedRectangle):
        x = np.abs(points.real) - (shape.a - shape.corner)
        y = np.abs(points.imag) - (shape.b - shape.corner)
        outside = np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0)
        return shape.corner - outside
    assert isinstance(shape, ArcSlot)
    middle = shape.begin + shape.sweep / 2
    off = np.angle(points * cmath.rect(1, -middle))
    along = np.clip(off, -abs(shape.sweep) / 2, abs(shape.sweep) / 2)
    return shape.b - np.abs(points - shape.radius * np.exp(1j * (middle + along)))


def corner_of(shape: PocketShape) -> float:
    """The smallest radius that the walls turn inwards with."""
    return shape.corner if isinstance(shape, RoundedRectangle) else shape.b


def along(path: Path, apart: float = 0.02) -> Array:
    """Points along a path, complex."""
    place, legs = path
    found = [np.array([place])]
    for leg in legs:
        if leg.turning:
            spoke = place - leg.centre
            angle = cmath.phase((leg.end - leg.centre) / spoke) * leg.turning % (2 * math.pi)
            assert abs(leg.end - leg.centre) == pytest.approx(abs(spoke))
            count = 2 + int(angle * abs(spoke) / apart)
            found.append(leg.centre + spoke * np.exp(1j * leg.turning * np.linspace(0, angle, count)))
        else:
            found.append(np.linspace(place, leg.end, 2 + int(abs(leg.end - place) / apart)))
        place = leg.end
    return np.concatenate(found)


@pytest.mark.parametrize("turning", [1, -1])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_a_loop_is_closed_and_lies_as_far_from_the_walls_as_asked(shape: PocketShape, turning: int) -> None:
    for part in (0.0, 0.3, 0.9):
        start, legs = shape.loop(part * shape.room, turning)
        points = along((start, legs))
        assert abs(points[-1] - start) < 1e-9
        depth = depth_in(shape, points)
        # inside of the corners' radius the path has sharp corners, which are further from the walls
        assert depth.min() == pytest.approx(part * shape.room, abs=1e-9)
        if part * shape.room <= corner_of(shape):
            assert depth.max() == pytest.approx(part * shape.room, abs=1e-9)
        area = 0.5 * np.sum((points.conj() * np.roll(points, -1)).imag)
        assert np.sign(area) == turning


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("allowance", [0.0, 0.7])
def test_the_paths_clear_everything_up_to_the_allowance(shape: PocketShape, allowance: float) -> None:
    radius = min(corner_of(shape), shape.room) * 0.6
    paths = loops(shape, radius + allowance, CORNERS_CLEAR * radius, 1)
    places = np.concatenate([along(path) for path in paths])
    assert depth_in(shape, places).min() >= radius + allowance - 1e-9
    size = shape.radius + shape.b if isinstance(shape, ArcSlot) else max(shape.a, shape.b)
    grid = np.arange(-size, size, 0.25)
    points = (grid[:, None] + 1j * grid[None, :]).ravel()
    inside = points[depth_in(shape, points) >= allowance + 1e-3]
    if allowance:  # corners keep the rounding of the path
        inside = inside[depth_in(shape, inside) >= allowance * (1 + math.sqrt(2))]
    tree = cKDTree(np.stack([places.real, places.imag], axis=1))
    far, _ = tree.query(np.stack([inside.real, inside.imag], axis=1))
    assert far.max() <= radius + 1e-3


def test_wider_steps_would_leave_stock_in_corners() -> None:
    radius = 4.0
    for step, cleared in ((CORNERS_CLEAR * radius, True), (1.05 * CORNERS_CLEAR * radius, False)):
        size = radius + 4 * step
        shape, points = RoundedRectangle(size, size, radius), np.linspace(0, size - radius, 500) * (1 + 1j)
        places = np.concatenate([along(path) for path in loops(shape, radius, step, 1)])
        far = np.abs(points[:, None] - places[None, ::3]).min(axis=1)
        assert bool(far.max() <= radius + 1e-3) is cleared


def test_a_pocket_narrower_than_the_tool_is_refused() -> None:
    with pytest.raises(ValueError, match="the tool is larger"):
        loops(RoundedRectangle(10, 3, 3), 3.1, 1.0, 1)
    assert loops(RoundedRectangle(10, 3, 3), 3.0, 1.0, 1) == [RoundedRectangle(10, 3, 3).core()]
