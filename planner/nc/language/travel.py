"""Commands that ask and set the way from a program's rows to the interpreter (`rows_through`): frame,
compensation, corners."""

from collections.abc import Callable
from functools import partial

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.language.approach import ContourWay
from planner.nc.language.corner_moves import CornerMove, OffsetMoves
from planner.nc.language.rows_through import RowsThrough
from planner.nc.state import tool_name

FRAME_CHANGES = "the frame changes while cutter radius compensation is on; switch it off before (R0, G40)"


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
        if found < 0.0:
            raise ValueError(f"the tool's radius and DR are together {found:g} mm")
        return found

    def set_frame(self, matrix: FloatArray, shift: FloatArray) -> None:
        """Points are at matrix (3, 3) times them and shift (3,) [mm] from now on. Raises ValueError."""
        self._no_corner()
        if self.compensated:
            raise ValueError(FRAME_CHANGES.removesuffix(" (R0, G40)"))
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
        if self.compensated:
            raise ValueError("APPR while cutter radius compensation is on; write R0 or DEP before")
        self._begin()
        radius = self._known_radius(assume) if side else 0.0
        side = (side or -1) * (-1 if self.mirrored else 1)
        mapped = self.mapped(first)
        motion = min(self.motion, 1)
        self._approach = partial(way.approach, self._mapped.copy(), mapped, motion, radius, side)
        self.place, self._mapped, self.lost = first.copy(), mapped.copy(), True

    def corner(self, kind: str, size: float, line: int, *, modal: bool = False) -> None:
        """A rounding or chamfer at the end of the next move, of a size in mm; where it is `modal` there is
        none if no move in the plane follows. Raises ValueError."""
        if self._coming is not None and not self._coming.modal:
            raise ValueError("a second rounding or chamfer before the next move")
        self._begin()
        self._coming = CornerMove(kind, size * self.scale(), line, modal)

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
