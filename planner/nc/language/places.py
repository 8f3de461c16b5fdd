"""Where the words of a row lead in a frame: coordinates that may be polar or diameters, holes of drilling
cycles, and the point on the way of G28."""

import cmath
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import codes
from planner.nc.arcs import IN_PLANE, Arc, ArcWay, arc_from_centre, arc_from_radius, at_place, in_plane
from planner.nc.interpreter import Interpreter
from planner.nc.language.rows import (
    AXES,
    CENTRES,
    RADIUS,
    STANDS,
    TURNS,
    FrameParts,
    G,
    TravelRow,
    require,
    tilted_rows,
    turned,
)

CYCLES = frozenset(code / 10 for code in codes.CYCLES)
_EVEN = 1e-9  # relative error of a frame that still counts as even
_ZEROS = frozenset((43.0, 49.0, *(float(code) for code in range(54, 60))))  # beside coordinates


class Places:
    """The place of the program in its frame, where a point p of it is at matrix p + shift; lengths in mm.

    matrix, shift : (3, 3) and (3,)
    programmed    : the frame as the program has it; a shift alone is a G52 and not in `matrix` and `shift`
    parts         : of a conversational program's frame
    normal        : axis normal to the plane
    polar         : pole in the plane about which coordinates are a radius and an angle (G16), or None
    place         : (3,) the programmed position
    absolute      : G90 is in force
    """

    def __init__(self, interpreter: Interpreter):
        self.matrix, self.shift = np.eye(3), np.zeros(3)
        self.programmed = np.eye(3), np.zeros(3)
        self.parts, self.normal = FrameParts(), 2
        self.polar: complex | None = None
        self.interpreter = interpreter
        self.place, self.absolute = np.zeros(3), True
        self._angle = 0.0  # of polar coordinates [degrees]
        self._stepped = False  # the last radius was one after G91
        self._level: float | None = None  # before the drilling cycle in force [mm]
        # the tilted plane in force, and with it frames that tilt; where rows have come to in it
        self.swivelled = self._tilt = np.eye(3), np.zeros(3)
        self._flat = np.zeros(3)

    @property
    def is_plain(self) -> bool:
        """True if the program's points are those of the work system."""
        return self.polar is None and not self.shift.any() and bool((self.matrix == np.eye(3)).all())

    @property
    def mirrored(self) -> bool:
        """True if the frame mirrors the plane."""
        return self._plane_size < 0.0

    def scale(self) -> float:
        """By what the frame multiplies lengths in the plane. Raises ValueError where it does so unevenly."""
        self.check_even()
        return math.sqrt(abs(self._plane_size))

    def mapped(self, point: FloatArray) -> FloatArray:
        """(3,) where a point (3,) of the program is."""
        return self.matrix @ point + self.shift

    def unmapped(self, point: FloatArray) -> FloatArray:
        """(3,) the point of the program that is there."""
        return np.asarray(np.linalg.solve(self.matrix, point - self.shift), dtype=np.float64)

    def _out_of_plane(self, matrix: FloatArray) -> bool:
        """True if a matrix (3, 3) turns the plane out of itself."""
        plane, normal = list(IN_PLANE[self.normal]), self.normal
        return bool(matrix[normal, plane].any() or matrix[plane, normal].any())

    def check_even(self) -> None:
        """Arcs stay arcs. Raises ValueError."""
        plane, normal = list(IN_PLANE[self.normal]), self.normal
        inner = self.matrix[np.ix_(plane, plane)]
        size = abs(self._plane_size)
        off = max(abs(inner.T @ inner - size * np.eye(2)).max(), abs(self.matrix[normal, plane]).max())
        even = max(off, abs(self.matrix[plane, normal]).max()) <= _EVEN * max(size, 1.0)
        require(even, "an arc whose plane the frame scales unevenly, or turns out of itself, is no arc")

    def arc(
        self, start: FloatArray, end: FloatArray, given: Mapping[int, float], clockwise: bool, unit: float
    ) -> Arc:
        """The arc of a row in the work system. Raises ValueError for one that does not close.

        start, end : (3,) in the program's coordinates
        given      : lengths and turns by letter code
        """
        self.check_even()
        require(RADIUS in given or set(CENTRES) & set(given), "an arc needs a centre or a radius")
        way = ArcWay(self.normal, clockwise, round(given.get(TURNS, 1.0)), unit)
        if RADIUS in given:
            arc = arc_from_radius(start, end, given[RADIUS], way)
        else:
            centre = start + np.array([given.get(letter, 0.0) for letter in CENTRES])
            arc = arc_from_centre(start, end, centre, way)
        return Arc(self.mapped(arc.centre), -arc.sweep if self.mirrored else arc.sweep)

    @property
    def _plane_size(self) -> float:
        plane = list(IN_PLANE[self.normal])
        return float(np.linalg.det(self.matrix[np.ix_(plane, plane)]))

    @property
    def _unit(self) -> float:
        return self.interpreter.state.unit

    def _lengths(self, words: list[tuple[int, float, int]]) -> dict[int, float]:
        """Values by letter, lengths in mm and X as a radius."""
        return {c: v / self._per_mm(c) if c != TURNS else v for c, v, _ in words if c != G}

    def _target(self, given: dict[int, float]) -> FloatArray:
        """(3,) where coordinates lead in the program's own, which may be polar."""
        if self.polar is not None:
            return self._polar_target(self.polar, given)
        target = self.place.copy()
        for axis, letter in enumerate(AXES):
            if letter in given:
                target[axis] = given[letter] + (0.0 if self.absolute else self.place[axis])
        return target

    def _polar_target(self, pole: complex, given: dict[int, float]) -> FloatArray:
        """A radius and an angle about a pole in the plane, each as it is where no word gives it; a radius after
        G91 is about where the tool is. Raises ValueError."""
        first, second = (AXES[axis] for axis in IN_PLANE[self.normal])
        here, steps = in_plane(self.place, self.normal), first in given and not self.absolute
        text = "an angle alone behind a radius after G91 has no known centre; write the radius, too"
        require(second not in given or first in given or not self._stepped, text)
        if abs(here - pole) > STANDS and not self._stepped:
            self._angle = math.degrees(cmath.phase(here - pole))
        place, radius, angle = (here if steps else pole), abs(here - pole), self._angle
        if first in given:
            radius, self._stepped = given[first], steps
        if second in given:  # the angle is no length
            angle = given[second] * self._per_mm(second) + (0.0 if self.absolute else angle)
        target = self.place.copy()
        if first in given or second in given:
            self._angle = angle
            place += radius * complex(*turned(angle, 2)[:2, 0])
            target = at_place(place, target, self.normal)
        axis = AXES[self.normal]
        if axis in given:
            target[self.normal] = given[axis] + (0.0 if self.absolute else target[self.normal])
        return target

    def _moved(self, given: dict[int, float]) -> list[int]:
        """The axes that coordinates move."""
        named = [axis for axis in range(3) if AXES[axis] in given]
        if self.polar is not None and set(named) & set(IN_PLANE[self.normal]):
            named = sorted({*named, *IN_PLANE[self.normal]})
        return [axis for axis in range(3) if (self.matrix[axis, named] != 0.0).any()]

    def _through(self, words: list[tuple[int, float, int]]) -> list[tuple[int, float, int]]:
        """The words of G28, whose point on the way is one of the program."""
        given = self._lengths(words)
        place, at = self.mapped(self._target(given)), words[0][2]
        axes = [(AXES[a], float(place[a]) * self._per_mm(AXES[a]), at) for a in self._moved(given)]
        return [*(word for word in words if word[0] not in AXES), *axes]

    def _hole(self, row: TravelRow, code: set[float], out: list[TravelRow]) -> None:
        """A row of a drilling cycle: its place is mapped, its depth as it is. Raises ValueError."""
        axis, given = AXES[self.normal], self._lengths(row.words)
        along = self.matrix[self.normal].copy()
        along[self.normal] -= 1.0
        if self.tilted or along.any() or self.matrix[:, self.normal].sum() != 1.0 or self.shift[self.normal]:
            raise ValueError("a cycle in an axis that a frame scales, mirrors, shifts or tilts is not read")
        self._level = self.place[self.normal] if self._level is None else self._level
        words = [word for word in row.words if word[0] not in AXES and not (word[0] == G and word[1] in code)]
        if not self.absolute:  # R counts from the level before the cycle, the depth from R
            clear = given.get(RADIUS, 0.0) + self._level
            rows = {RADIUS: clear, axis: given.get(axis, 0.0) + clear}
            given |= {c: v for c, v in rows.items() if c in given}
            if axis in given and RADIUS not in given:
                raise ValueError("a depth of a cycle after G91 needs R on its line while a frame is in force")
            words = [(c, given[c] * self._per_mm(c) if c == RADIUS else v, at) for c, v, at in words]
        at = row.words[0][2]
        words += [(axis, given[axis] * self._per_mm(axis), at)] if axis in given else []
        words += [(G, number, at) for number in code]
        repeats = {ord("L"), ord("K")} if not self.absolute and self._moved(given) else set()
        times = max((round(v) for c, v, _ in words if c in repeats), default=1)
        words = [word for word in words if word[0] not in repeats]
        place = {c: v for c, v in given.items() if c in AXES and c != axis}
        for n in range(times):
            self.place = self._target(place)
            mapped = self.mapped(self.place)
            holes = [(AXES[a], float(mapped[a]) * self._per_mm(AXES[a]), at) for a in self._moved(place)]
            out.append(TravelRow([*(words if n == 0 else []), *holes], row.line, row.frame))

    def _per_mm(self, letter: int) -> float:
        """By what a length in mm is multiplied where a word writes it: X may be a diameter."""
        diameter = 2.0 if letter == AXES[0] and self.interpreter.state.diameters else 1.0
        return diameter / self._unit

    @property
    def tilted(self) -> bool:
        """True if a plane is tilted or moved beside the frame."""
        return bool(self._tilt[1].any() or (self._tilt[0] != np.eye(3)).any())

    def _in_units(self, row: TravelRow) -> TravelRow:
        if self._unit == 1.0 and not self.interpreter.state.diameters:
            return row
        lengths = {*AXES, *CENTRES}
        words = [(c, v * self._per_mm(c) if c in lengths else v, at) for c, v, at in row.words]
        return replace(row, words=words)

    def _parts(self, row: TravelRow) -> list[TravelRow]:
        """The row, in two where the frame maps its coordinates and another code moves their zero."""
        zero = [word for word in row.words if word[0] == G and word[1] in _ZEROS]
        if not zero or not any(word[0] in AXES for word in row.words):
            return [row]
        zero += [word for word in row.words if word[0] == ord("H")]
        others = [word for word in row.words if word not in zero]
        return [replace(row, words=zero), replace(row, words=others)]

    def _through_tilt(self, rows: list[TravelRow]) -> list[TravelRow]:
        """Rows of the tilted plane in the work system."""
        if not self.tilted:
            return rows
        out: list[TravelRow] = []
        for row in rows:
            moves, self._flat = tilted_rows(row, self._flat, self._tilt, self._unit, self.normal)
            out += moves
        return out
