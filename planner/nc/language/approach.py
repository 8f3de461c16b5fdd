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
from dataclasses import dataclass, replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import IN_PLANE, Arc, at_place, in_plane
from planner.nc.language.corner_moves import OffsetMoves
from planner.nc.language.travel_rows import STANDS, Move, TravelRow

_FULL = 360.0  # largest angle CCA
_NORMAL = 2  # the tool axis is Z
KINDS = ("LT", "LN", "CT", "LCT")


@dataclass(frozen=True)
class ContourWay:
    """An APPR or DEP block. Raises ValueError for what is missing or makes no sense."""

    name: str  # APPR or DEP
    kind: str  # one of KINDS
    row: TravelRow  # its line, its call, and its F word, if there is one
    at: int  # byte offset
    length: float  # LEN [mm]
    radius: float  # R [mm]
    angle: float  # CCA [degrees]

    def __post_init__(self) -> None:
        length, angle = (self.length > 0.0, "length LEN, above 0"), 0.0 < self.angle <= _FULL
        needed = {
            **dict.fromkeys(("LT", "LN"), (length,)),
            "CT": ((angle, "angle CCA, above 0 and up to 360 degrees"), (self.radius != 0.0, "radius R")),
            "LCT": ((self.radius > 0.0, "radius R, above 0"),),
        }
        for what in (what for given, what in needed[self.kind] if not given):
            raise ValueError(f"{self.name} {self.kind} needs its {what}")

    def move(
        self, begin: FloatArray, end: FloatArray, arc: Arc | None = None, *, rises: bool = False
    ) -> Move:
        """A move from `begin` to `end` (3,), in the plane or along the tool axis, at the F of the block."""
        return Move(self.row, self.at, 1, begin, end, [_NORMAL] if rises else IN_PLANE[_NORMAL], arc)

    def far_end(
        self, contour: complex, inwards: complex, normal: complex, other: complex, *, leaves: bool
    ) -> tuple[complex, Arc | None]:
        """The other end of the way at a contour point, and its arc, None for a straight way and where the
        line of LCT is tangent to the contour already. Raises ValueError if `other` is inside the circle.

        inwards, normal : unit tangent towards the contour point, and normal towards the side of the tool
        other           : where the line of LCT comes from, or leads to
        leaves          : the way begins at the contour
        """
        if self.kind in ("LT", "LN"):
            return contour + self.length * (normal if self.kind == "LN" else -inwards), None
        centre = contour + self.radius * normal
        turning = 1 if (normal / inwards).imag * self.radius > 0 else -1
        way = -turning if leaves else turning
        if self.kind == "CT":
            far = centre + (contour - centre) * cmath.rect(1.0, -turning * math.radians(self.angle))
            sweep = way * math.radians(self.angle)
        else:
            away, size = other - centre, abs(self.radius)
            if abs(away) < size:
                where = f"the other end of the straight move lies inside the arc of radius {size:.6g} mm"
                raise ValueError(f"{where}: there is no tangent to it")
            touching = math.acos(size / abs(away))
            far = centre + away / abs(away) * size * cmath.rect(1.0, turning * touching)
            if abs(far - contour) < STANDS:
                return far, None
            start, end = (contour, far) if leaves else (far, contour)
            angle = cmath.phase((end - centre) / (start - centre)) * way
            sweep = way * (angle if angle > 0.0 else angle + 2.0 * math.pi)
        return far, Arc(np.array([centre.real, centre.imag, 0.0]), sweep)

    def departure(
        self, offset: OffsetMoves, end: FloatArray, *, raised: bool
    ) -> tuple[list[TravelRow], FloatArray]:
        """DEP: the way from a contour, for LCT to `end` (3,) [mm] and where it is `raised` to its z, and where
        it ends (3,). Raises ValueError."""
        place, plane, other = offset.place, in_plane(offset.place, _NORMAL), in_plane(end, _NORMAL)
        # the way of an approach backwards: the path reversed has the tangent -t
        normal = 1j * offset.side * offset.leaving
        far, arc = self.far_end(plane, -offset.leaving, normal, other, leaves=True)
        places = [at_place(far, place, _NORMAL)]
        moves = [] if self.kind == "LCT" and arc is None else [self.move(place, places[0], arc)]
        if self.kind == "LCT":
            places.append(at_place(other, place, _NORMAL))
            moves.append(self.move(places[0], places[1]))
        if raised:
            places.append(at_place(in_plane(places[-1], _NORMAL), end, _NORMAL))
            moves.append(self.move(places[-2], places[-1], rises=True))
        return [row for one in moves for row in one.rows(_NORMAL)], places[-1]

    def approach(
        self, start: FloatArray, first: FloatArray, motion: int, radius: float, side: int, move: Move
    ) -> tuple[list[TravelRow], OffsetMoves | None]:
        """APPR: the way to a contour, whose first move is given, and its compensation. Raises ValueError.

        start, first : (3,) where the tool is, and the first contour point, both in the work system [mm]
        motion       : the code that leads to the way, 0 or 1
        radius, side : of the tool that is compensated [mm], else 0; 1 left, -1 right
        """
        if move.stands(_NORMAL):
            raise ValueError("behind APPR a move in the plane is expected, the first of the contour")
        tangent, offset = move.tangent(_NORMAL), None
        normal = 1j * side * tangent
        if radius > 0.0:
            offset = OffsetMoves(first, radius, side, _NORMAL)
            offset.begin_at(first, tangent)
        contour = in_plane(first, _NORMAL) + radius * normal
        before, arc = self.far_end(contour, tangent, normal, in_plane(start, _NORMAL), leaves=False)
        there, deep = (at_place(before, height, _NORMAL) for height in (start, first))
        moves = [self.move(start, there)]
        if self.kind != "LCT" or not self.row.words:
            moves[0] = replace(moves[0], rest=replace(self.row, words=[]), code=motion)
        if deep[_NORMAL] != there[_NORMAL]:
            moves.append(self.move(there, deep, rises=True))
        moves.append(self.move(deep, at_place(contour, first, _NORMAL), arc))
        return [row for one in moves for row in one.rows(_NORMAL)], offset
