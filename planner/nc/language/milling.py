"""Pockets and slots as rows: depth passes, paths from inside to outside, plunging, finishing.

Roughing divides the depth into equal passes; each plunges where the core begins and clears the pocket up to
the allowance at the walls. Finishing runs along the walls, which it meets and leaves on quarter circles, and
clears the bottom in one pass. Manuals tell this; the single paths are this reader's own.

Paths are complex numbers in the plane of the pocket. `loop(d)` of a shape is the closed path at the distance
d from the walls, 0 <= d < room; what is left at d = room is a line or an arc, the `core`, or a point. Two
paths s apart have corners s sqrt(2) apart. A point between them on the diagonal, t inside the outer path, is
t from its sides and (s - t) sqrt(2) from the inner corner; both are more than the tool's radius r somewhere
if s > (1 + 1/sqrt(2)) r. So that is the most.
"""

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass

from planner.nc.language.making import HolePlan, Row, equal_steps, helix
from planner.nc.language.rows import require
from planner.nc.turning import Leg

_SHORT = 1e-9  # relative length of a leg that is left out
Path = tuple[complex, list[Leg]]  # a start and the legs from there
CORNERS_CLEAR = 1.0 + math.sqrt(0.5)  # tool radii between two paths at most (module text)
RAPID, STRAIGHT, HELIX = 0, 1, 2  # ways to plunge
_NARROW = 1e-9  # relative room beside the tool below which there is none


@dataclass(frozen=True)
class RoundedRectangle:
    """Half length a along x, half width b along y, radius of the corners."""

    a: float
    b: float
    corner: float

    @property
    def room(self) -> float:
        """The largest distance of a point of it from the walls: half the shorter side."""
        return min(self.a, self.b)

    def loop(self, inset: float, turning: int) -> Path:
        """From the middle of the left wall round, counter-clockwise (turning 1) or clockwise."""
        a, b = self.a - inset, self.b - inset
        r = min(max(self.corner - inset, 0.0), a, b)
        legs: list[Leg] = []
        place = start = complex(-a, 0.0)
        for corner, before, after in (
            (complex(-a, -b), -1j, 1),
            (complex(a, -b), 1, 1j),
            (complex(a, b), 1j, -1),
            (complex(-a, b), -1, -1j),
        ):
            first, last = corner - r * before, corner + r * after
            if abs(first - place) > _SHORT * (a + b):
                legs.append(Leg(first))
            if r > _SHORT * (a + b):
                legs.append(Leg(last, 1, corner - r * before + r * after))
            place = last
        if abs(start - place) > _SHORT * (a + b):
            legs.append(Leg(start))
        if turning < 0:
            legs = [Leg(leg.end.conjugate(), -leg.turning, leg.centre.conjugate()) for leg in legs]
        return start, legs

    def to_wall(self) -> list[Leg]:
        """From the core's start to where a straight leg to a loop stays inside: none is needed."""
        return []

    def core(self) -> Path:
        """From the middle to the one end and to the other."""
        along = complex(self.a - self.room, self.b - self.room)
        return 0j, [] if along == 0 else [Leg(along), Leg(-along)]


@dataclass(frozen=True)
class ArcSlot:
    """A slot of half width b on an arc about 0, from an angle by a sweep, counter-clockwise [rad]."""

    radius: float
    b: float
    begin: float
    sweep: float

    @property
    def room(self) -> float:
        """Half the width."""
        return self.b

    def loop(self, inset: float, turning: int) -> Path:
        """From the tip of the far end round."""
        w, way = self.b - inset, 1 if self.sweep > 0 else -1
        near, far = cmath.rect(1.0, self.begin), cmath.rect(1.0, self.begin + self.sweep)
        inner, outer = self.radius - w, self.radius + w
        start = far * (self.radius + 1j * way * w)
        # the far end, inwards; the inner wall back; the near end; the outer wall forth; and the far end again
        legs = [
            Leg(inner * far, way, self.radius * far),
            Leg(inner * near, -way),
            Leg(outer * near, way, self.radius * near),
            Leg(outer * far, way),
            Leg(start, way, self.radius * far),
        ]
        return (start, legs) if turning == way else (start, backwards(start, legs))

    def to_wall(self) -> list[Leg]:
        """Along the arc to the far end."""
        return self.core()[1]

    def core(self) -> Path:
        """Along the arc."""
        near, far = cmath.rect(self.radius, self.begin), cmath.rect(self.radius, self.begin + self.sweep)
        return near, [Leg(far, 1 if self.sweep > 0 else -1)]


PocketShape = RoundedRectangle | ArcSlot


def backwards(start: complex, legs: list[Leg]) -> list[Leg]:
    """The legs from their end to the start."""
    ends = [start, *(leg.end for leg in legs)]
    return [
        Leg(end, -leg.turning, leg.centre)
        for end, leg in zip(reversed(ends[:-1]), reversed(legs), strict=True)
    ]


def loops(shape: PocketShape, outermost: float, step: float, turning: int) -> list[Path]:
    """The core and the closed paths from inside to outside that clear a pocket. Raises ValueError if the
    pocket is too narrow for the tool.

    outermost : distance of the last path from the walls: the tool's radius and the allowance
    step      : most between two paths
    """
    width = shape.room - outermost
    room = f"the pocket leaves room for a tool of radius {shape.room:.6g} mm less its allowance"
    require(width >= -_SHORT * shape.room, f"{room}; the tool is larger")
    if width <= _SHORT * shape.room:
        return [shape.core()]
    count = max(1, math.ceil(width / step - _SHORT))
    insets = (outermost + k * width / count for k in range(count - 1, -1, -1))
    return [shape.core(), *(shape.loop(inset, turning) for inset in insets)]


@dataclass(frozen=True)
class PocketPlan:
    """How a pocket is cut; lengths in the program's unit, feeds per minute."""

    depth: HolePlan  # z of the clearance, the surface, the bottom, and the end
    radius: float  # of the tool
    infeed: float  # most per pass, 0 for one pass
    step: float  # most between two paths
    feed: float
    plunge_feed: float
    finish_feed: float
    turning: int  # 1 counter-clockwise, -1 clockwise
    # side and floor: allowances
    side: float = 0.0
    floor: float = 0.0
    rough: bool = True  # cut up to the allowances
    # walls and base: finish them
    walls: bool = False
    base: bool = False
    finish_infeed: float = 0.0  # most per pass along the walls, 0 for one pass
    plunge: int = STRAIGHT  # RAPID, STRAIGHT or HELIX, with the radius and the pitch of the helix
    helix: tuple[float, float] = (0.0, 0.0)

    def check(self) -> None:
        """Raises ValueError for values that make no sense."""
        if self.depth.top - self.depth.bottom <= self.floor:
            raise ValueError("the finishing allowance at the bottom is the whole depth")
        if min(self.side, self.floor, self.infeed, self.step, self.finish_infeed) < 0.0:
            raise ValueError("an infeed or allowance of the pocket is negative")
        for name, feed in (("in the plane", self.feed), ("of plunging", self.plunge_feed)):
            if not feed > 0.0 and not (name == "of plunging" and self.plunge == RAPID):
                raise ValueError(f"the feed {name} of the pocket is not given")


def pocket_rows(shape: PocketShape, plan: PocketPlan, at: complex, angle: float) -> Iterator[Row]:
    """The rows of a pocket whose zero is at a place, turned by an angle [degrees]. Raises ValueError."""
    plan.check()
    cut = _Cutting(plan, at, cmath.rect(1.0, math.radians(angle)) if angle else 1 + 0j)
    step = min(plan.step or math.inf, CORNERS_CLEAR * plan.radius)
    start, _ = shape.core()
    yield cut.rapid(z=max(plan.depth.clear, plan.depth.retract))
    yield cut.rapid(start)
    yield cut.rapid(z=plan.depth.clear)
    if plan.rough:
        paths = loops(shape, plan.radius + plan.side, step, plan.turning)
        yield from _passes(cut, shape, paths, plan.depth.bottom + plan.floor, plan.infeed, plan.feed)
    if plan.walls:
        paths = [(start, shape.to_wall()), _wall(shape, plan)]
        yield from _passes(cut, shape, paths, plan.depth.bottom, plan.finish_infeed, plan.finish_feed)
    if plan.base:
        paths = loops(shape, plan.radius, step, plan.turning)
        yield from _passes(cut, shape, paths, plan.depth.bottom, 0.0, plan.finish_feed)
    yield cut.rapid(z=max(plan.depth.clear, plan.depth.retract))


def _wall(shape: PocketShape, plan: PocketPlan) -> Path:
    """Along the walls, with quarter circles to and from them."""
    loops(shape, plan.radius, plan.radius, plan.turning)  # is there room?
    width = shape.room - plan.radius
    if width <= _NARROW * shape.room:
        return shape.core()
    start, legs = shape.loop(plan.radius, plan.turning)
    first = legs[0]
    way = first.end - start if not first.turning else 1j * first.turning * (start - first.centre)
    tangent = way / abs(way)
    size = min(plan.radius, width) / 2.0
    centre = start + 1j * plan.turning * tangent * size
    come, go = centre - size * tangent, centre + size * tangent
    return come, [Leg(start, plan.turning, centre), *legs, Leg(go, plan.turning, centre)]


class _Cutting:
    def __init__(self, plan: PocketPlan, at: complex, turned: complex):
        self.plan, self.at, self.turned = plan, at, turned

    def rapid(self, point: complex | None = None, z: float | None = None) -> Row:
        return [("G", 0.0), *self._ends(point, z)]

    def line(self, feed: float, point: complex | None = None, z: float | None = None) -> Row:
        return [("G", 1.0), ("F", feed), *self._ends(point, z)]

    def legs(self, start: complex, legs: list[Leg], feed: float) -> Iterator[Row]:
        place = start
        for leg in legs:
            if leg.turning:
                to = (leg.centre - place) * self.turned
                code = 3.0 if leg.turning > 0 else 2.0
                yield [("G", code), ("F", feed), *self._ends(leg.end, None), ("I", to.real), ("J", to.imag)]
            else:
                yield self.line(feed, leg.end)
            place = leg.end

    def plunge(self, start: complex, begin: float, z: float) -> Iterator[Row]:
        """Down to z at a place, from `begin`."""
        plan = self.plan
        if plan.plunge == RAPID:
            yield self.rapid(z=z)
        elif plan.plunge == STRAIGHT:
            yield self.line(plan.plunge_feed, z=z)
        else:
            size, pitch = plan.helix
            yield self.line(plan.plunge_feed, start + size)
            side, centre = (self.at + self.turned * place for place in (start + size, start))
            yield from helix(side, centre, (begin, z), pitch, plan.turning, plan.plunge_feed)
            yield self.line(plan.feed, start)

    def _ends(self, point: complex | None, z: float | None) -> Row:
        found: Row = []
        if point is not None:
            place = self.at + self.turned * point
            found = [("X", place.real), ("Y", place.imag)]
        return found if z is None else [*found, ("Z", z)]


def _passes(
    cut: _Cutting, shape: PocketShape, paths: list[Path], bottom: float, infeed: float, feed: float
) -> Iterator[Row]:
    """Passes of equal depth to the bottom, each along all paths and back to the start, and up at the end."""
    plan, start = cut.plan, paths[0][0]
    out = shape.to_wall()
    back = backwards(start, out)
    count = equal_steps(plan.depth.top - bottom, infeed)
    begin = plan.depth.clear
    yield cut.rapid(z=plan.depth.clear)
    yield cut.rapid(start)
    for k in range(1, count + 1):
        z = bottom if k == count else plan.depth.top + (bottom - plan.depth.top) * k / count
        yield from cut.plunge(start, begin, z)
        for first, legs in paths:
            if legs:
                yield cut.line(feed, first)
            yield from cut.legs(first, legs, feed)
        yield cut.line(feed, out[-1].end if out else start)
        yield from cut.legs(out[-1].end if out else start, back, feed)
        begin = z
    yield cut.rapid(z=plan.depth.clear)
