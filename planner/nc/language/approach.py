"""APPR and DEP: approach to a contour and departure from it.

With the first contour point A, the unit tangent t of the first move there, and n the unit normal of t towards
the tool's side, the tool's centre begins the contour at C = A + r n. It comes straight to H, and from H to C

    LT    along the tangent          H = C - LEN t
    LN    along the normal           H = C + LEN n
    CT    on an arc of radius R      H: the angle CCA before C on the circle about M = C + R n; R < 0 puts M on the other side
    LCT   on an arc of radius R      H: where a line from where the tool is touches that circle

R is that of the tool's centre. Departure is the same, backwards. The coordinate along the tool axis changes
at H (approach) or at the end (departure): so manuals up to TNC 640 have it, later ones move all axes at once.
"""

import cmath
import math
from dataclasses import dataclass, field, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import IN_PLANE, Arc, at_place, in_plane
from planner.nc.language.corner_moves import OffsetMoves
from planner.nc.language.travel_rows import STANDS, Move, TravelRow

_F = ord("F")
_FULL = 360.0  # largest angle CCA
_NORMAL = 2  # the tool axis is Z
KINDS = ("LT", "LN", "CT", "LCT")


@dataclass
class ContourWay:
    """The words of an APPR or DEP block."""

    kind: str  # one of KINDS
    line: int  # of the block, as its `at` and `frame`
    at: int
    frame: int
    length: float = 0.0  # LEN [mm]
    radius: float = 0.0  # R [mm]
    angle: float = 0.0  # CCA [degrees]
    feed: float | None = None  # F word, or None
    scale: float = 1.0  # by what the frame multiplies lengths

    def check(self, name: str) -> None:
        """Raises ValueError for what is missing or makes no sense."""
        if self.kind in ("LT", "LN") and not self.length > 0.0:
            raise ValueError(f"{name} {self.kind} needs its length LEN, above 0")
        if self.kind == "CT" and not 0.0 < self.angle <= _FULL:
            raise ValueError(f"{name} CT needs its angle CCA, above 0 and up to 360 degrees")
        if self.kind == "CT" and self.radius == 0.0:
            raise ValueError(f"{name} CT needs its radius R")
        if self.kind == "LCT" and not self.radius > 0.0:
            raise ValueError(f"{name} LCT needs its radius R, above 0")

    def move(
        self, begin: FloatArray, end: FloatArray, arc: Arc | None = None, *, rises: bool = False
    ) -> Move:
        """A move from `begin` to `end` (3,), in the plane or along the tool axis, at the F of the block."""
        words = [(_F, self.feed, self.at)] if self.feed is not None else []
        axes = [_NORMAL] if rises else IN_PLANE[_NORMAL]
        return Move(TravelRow(words, self.line, self.frame), self.at, 1, begin, end, axes, arc)

    def turned(
        self, contour: complex, tangent: complex, normal: complex, other: complex
    ) -> tuple[complex, complex, int]:
        """The far end of the arc at a contour point, its centre, and its direction (1 counter-clockwise).
        Raises ValueError if the line's other end is inside the circle.

        tangent, normal : at the contour point, along the path and towards the side of the tool
        other           : where the line comes from (LCT)
        """
        radius = self.radius * self.scale
        centre = contour + radius * normal
        turning = 1 if (normal / tangent).imag * radius > 0 else -1
        if self.kind == "CT":
            far = centre + (contour - centre) * cmath.rect(1.0, -turning * math.radians(self.angle))
            return far, centre, turning
        away, size = other - centre, abs(radius)
        if abs(away) < size:
            where = f"the other end of the straight move lies inside the arc of radius {size:.6g} mm"
            raise ValueError(f"{where}: there is no tangent to it")
        touching = math.acos(size / abs(away))
        return centre + away / abs(away) * size * cmath.rect(1.0, turning * touching), centre, turning

    def _arc(self, start: complex, end: complex, centre: complex, turning: int) -> Arc | None:
        """The arc of CT or LCT; None where the line of LCT is tangent to the contour already."""
        if self.kind == "CT":
            sweep = turning * math.radians(self.angle)
        elif abs(end - start) < STANDS:
            return None
        else:
            angle = cmath.phase((end - centre) / (start - centre)) * turning
            sweep = turning * (angle if angle > 0.0 else angle + 2.0 * math.pi)
        return Arc(np.array([centre.real, centre.imag, 0.0]), sweep)


@dataclass
class Approach(ContourWay):
    """APPR, waiting for the first move of its contour.

    first       : (3,) the first contour point, in the program's coordinates [mm]
    side        : 1 left, -1 right
    compensated : whether the contour is (RL, RR); else the path is that of a tool of radius 0 with RR
    """

    first: FloatArray = field(default_factory=lambda: np.zeros(3))
    side: int = -1
    compensated: bool = True

    def begin(self, start: FloatArray, first: FloatArray, motion: int, radius: float, mirrored: bool) -> None:
        """Take the state: where the tool is, `start` (3,), and the `first` point (3,) in the work system, the
        `motion` code, the `radius` of the tool [mm], and whether the frame is `mirrored`."""
        self._start, self._first = start.copy(), first.copy()
        self._motion = min(motion, 1)
        self._radius = radius if self.compensated else 0.0
        self._side = -self.side if mirrored else self.side

    def rows(self, move: Move) -> tuple[list[TravelRow], OffsetMoves | None]:
        """The way to the contour, whose first move is given, and its compensation. Raises ValueError."""
        if move.stands(_NORMAL):
            raise ValueError("behind APPR a move in the plane is expected, the first of the contour")
        tangent = move.tangent(_NORMAL)
        normal = 1j * self._side * tangent
        offset = None
        if self._radius > 0.0:
            offset = OffsetMoves(self._first, self._radius, self._side, _NORMAL)
            offset.begin_at(self._first, tangent)
        contour = in_plane(self._first, _NORMAL) + self._radius * normal
        start = in_plane(self._start, _NORMAL)
        arc, length = None, self.length * self.scale
        if self.kind == "LT":
            before = contour - length * tangent
        elif self.kind == "LN":
            before = contour + length * normal
        else:
            before, centre, turning = self.turned(contour, tangent, normal, start)
            arc = self._arc(before, contour, centre, turning)
        there = at_place(before, self._start, _NORMAL)
        deep = at_place(before, self._first, _NORMAL)
        end = at_place(contour, self._first, _NORMAL)
        moves = [self.move(self._start, there)]
        if self.kind != "LCT" or self.feed is None:
            moves[0] = replace(moves[0], rest=TravelRow([], self.line, self.frame), code=self._motion)
        if deep[_NORMAL] != there[_NORMAL]:
            moves.append(self.move(there, deep, rises=True))
        moves.append(self.move(deep, end, arc))
        return [row for one in moves for row in one.rows(_NORMAL)], offset


@dataclass
class Departure(ContourWay):
    """DEP. end : (3,) of LCT and the tool axis, as programmed [mm], or None;  raised : its Z was given."""

    end: FloatArray | None = None
    raised: bool = False

    def rows(self, offset: OffsetMoves, end: FloatArray | None) -> tuple[list[TravelRow], FloatArray]:
        """The way from the contour to `end` in the work system, and where it ends (3,). Raises ValueError."""
        place, tangent = offset.place, offset.leaving
        normal = 1j * offset.side * tangent
        contour = in_plane(place, _NORMAL)
        length = self.length * self.scale
        moves: list[Move] = []
        if self.kind in ("LT", "LN"):
            way = length * tangent if self.kind == "LT" else length * normal
            there = at_place(contour + way, place, _NORMAL)
            moves.append(self.move(place, there))
        else:
            # the same arc backwards: the path reversed has the tangent -t
            other = in_plane(end, _NORMAL) if end is not None else contour
            far, centre, back = self.turned(contour, -tangent, normal, other)
            arc = self._arc(contour, far, centre, -back)
            there = at_place(far, place, _NORMAL)
            if arc is not None:
                moves.append(self.move(place, there, arc))
            if self.kind == "LCT":
                begin, there = there, at_place(other, place, _NORMAL)
                moves.append(self.move(begin, there))
        if end is not None and self.raised:
            up = at_place(in_plane(there, _NORMAL), end, _NORMAL)
            moves.append(self.move(there, up, rises=True))
            there = up
        return [row for one in moves for row in one.rows(_NORMAL)], there
