"""Commands that ask and set the way from a program's rows to the interpreter (`rows_through`): frame,
compensation, corners; and APPR and DEP, approach to a contour and departure from it.

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
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.arcs import IN_PLANE, Arc, at_place, in_plane
from planner.nc.language.corner_moves import CornerMove, OffsetMoves
from planner.nc.language.rows import STANDS, Move, TravelRow, require
from planner.nc.language.rows_through import RowsThrough
from planner.nc.state import tool_name

FRAME_CHANGES = "the frame changes while cutter radius compensation is on; switch it off before (R0, G40)"
_FULL = 360.0  # largest angle CCA
_NORMAL = 2  # the tool axis is Z


@dataclass(frozen=True)
class ContourWay:
    """An APPR or DEP block. Raises ValueError for what is missing or makes no sense."""

    name: str  # APPR or DEP
    kind: str  # LT, LN, CT or LCT
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
            where = f"the other end of the straight move lies inside the arc of radius {size:.6g} mm"
            require(abs(away) >= size, f"{where}: there is no tangent to it")
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


class Travel(RowsThrough):
    """The frame and the compensation in force, and the commands that change them.

    oversize : by which the loaded tool's radius is larger than its table says [mm]
    """

    oversize = 0.0

    def position(self) -> FloatArray:
        """(3,) the programmed position [mm]."""
        return self.place.copy() if self.active else self.interpreter.state.programmed()[:3]

    def radius(self) -> float:
        """Radius of the loaded tool [mm], 0 where none is given. Raises ValueError below 0."""
        tool = self.interpreter.state.tools.get(self.interpreter.state.tool_loaded)
        found = (0.0 if tool is None else tool.diameter / 2.0) + self.oversize
        require(found >= 0.0, f"the tool's radius and DR are together {found:g} mm")
        return found

    def set_frame(self, matrix: FloatArray, shift: FloatArray) -> None:
        """Points are at matrix (3, 3) times them and shift (3,) [mm] from now on. Raises ValueError."""
        self._no_corner()
        require(not self.compensated, FRAME_CHANGES.removesuffix(" (R0, G40)"))
        self._begin()
        out = self._out_of_plane(matrix)
        whole, there = self.swivelled[0] @ matrix, self.swivelled[0] @ shift + self.swivelled[1]
        before = self._tilt[0] @ self._mapped + self._tilt[1]
        self._tilt = (whole, there) if out else self.swivelled
        self.matrix, self.shift = (np.eye(3), np.zeros(3)) if out else (matrix, shift)
        self._mapped = np.asarray(np.linalg.solve(self._tilt[0], before - self._tilt[1]), dtype=np.float64)
        self._flat = self._mapped.copy()
        self.place = self.unmapped(self._mapped)

    def swivel(self, matrix: FloatArray, shift: FloatArray, *, waiting: bool = False) -> None:
        """The programmed frame ends, and points are at matrix (3, 3) times them and shift (3,) [mm] in the
        tilted plane; `waiting` for a move of the rotary axes, behind which the tool centre point is on. Raises
        ValueError."""
        self.swivelled, self.waiting = (matrix, shift), waiting
        self.set_frame(np.eye(3), np.zeros(3))

    def set_polar(self, pole: complex | None) -> None:
        """Coordinates are a radius and an angle about a pole in the plane [mm] from now on; None ends it."""
        if pole is not None:
            self._begin()
        self.polar, self._stepped = pole, False

    def compensate(self, side: int, assume: Callable[[str], None]) -> None:
        """Switch compensation on, to the left (1) or right (-1) of the path, or off (0); `assume` keeps what
        is assumed. Raises ValueError."""
        self._no_corner()
        if side == 0:
            if self._approach is not None:
                raise ValueError("compensation ends before the first move behind its approach")
            if self._offset is not None:
                self._leave()
            return
        side = -side if self.mirrored else side
        if self._approach is not None:
            return
        if self._offset is not None and self._offset.side != side:
            text = "the side of compensation changes between two moves; switch it off before (R0, G40)"
            raise ValueError(text)
        if self._offset is None and (radius := self._known_radius(assume)):
            self._begin()
            self._offset = OffsetMoves(self._mapped, radius, side, self.normal)

    def _known_radius(self, assume: Callable[[str], None]) -> float:
        """Radius of the tool that compensates [mm]; where it is 0 that is said."""
        radius = self.radius()
        if radius == 0.0:
            what = f"{tool_name(self.interpreter.state.tool_loaded)} has no diameter in the machine file"
            assume(f"{what}: radius compensation does not move the path")
        return radius

    def approach(self, way: ContourWay, first: FloatArray, side: int, assume: Callable[[str], None]) -> None:
        """APPR: the contour begins at a point (3,), and the way to it with its first move; compensation is on
        then, to the left (1) or right (-1). With 0 the path is that of a tool of radius 0 on its right. Raises
        ValueError."""
        self._no_corner()
        require(not self.compensated, "APPR while cutter radius compensation is on; write R0 or DEP before")
        self._begin()
        radius = self._known_radius(assume) if side else 0.0
        side = (side or -1) * (-1 if self.mirrored else 1)
        mapped = self.mapped(first)
        motion = min(self.motion, 1)
        self._approach = partial(way.approach, self._mapped.copy(), mapped, motion, radius, side)
        self.place, self._mapped, self.lost = first.copy(), mapped.copy(), True

    def corner(self, kind: str, size: float, line: int, *, modal: bool, feed: float | None = None) -> None:
        """A rounding or chamfer at the end of the next move, of a size in mm, with an F word of its own or that in
        force; where it is `modal` there is none if no move in the plane follows. Raises ValueError."""
        if self._coming is not None and not self._coming.modal:
            raise ValueError("a second rounding or chamfer before the next move")
        self._begin()
        self._coming = CornerMove(kind, size * self.scale(), line, modal, feed)

    def depart(self, way: ContourWay, end: FloatArray, *, raised: bool) -> None:
        """DEP: leave the contour, for LCT to its `end` (3,), and where it is `raised` to the height of that;
        compensation is off behind it. Raises ValueError."""
        self._no_corner()
        if self._offset is None or not self._offset.started:
            raise ValueError("DEP without a contour with radius compensation (RL, RR) before it")
        offset, self._offset = self._offset, None
        rows = offset.finish()
        out, there = way.departure(offset, self.mapped(end), raised=raised)
        self._ahead += [self._in_units(row) for row in (*rows, *out)]
        self._mapped, self._beside, self.lost = there, False, True
        self.place = self.unmapped(there)
        self.motion = 1
