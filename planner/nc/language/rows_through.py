"""Between the rows of a program and the interpreter: the programmed frame q = A p + t in the coordinates of
the work system, and radius compensation as Heidenhain and Siemens have it.

Arcs stay arcs where A turns, mirrors and scales their plane evenly; where it mirrors the plane, their
direction and the side of compensation change. Rows come out absolute (G90), with centres as I J K, so that
the expanded program needs neither frames nor compensation. With none in force rows pass as they are.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from planner.nc.arcs import IN_PLANE, PLANES
from planner.nc.interpreter import Interpreter
from planner.nc.language.corner_moves import CornerMove, OffsetMoves
from planner.nc.language.places import CYCLES, Places
from planner.nc.language.rows import (
    AXES,
    CENTRES,
    RADIUS,
    ROTARY,
    TURNS,
    AppendedRows,
    F,
    G,
    M,
    Move,
    TravelRow,
    require,
    rows_from,
    travel_rows_of,
)
from planner.nc.language.tree import ProgramFault, SourcePlace
from planner.nc.lexer import Words
from planner.nc.settings import TOOL_POINT_OFF, TOOL_POINT_ON

# M codes that end the program.
_ENDS = (2.0, 30.0)
_SWITCHES = (*TOOL_POINT_ON, *TOOL_POINT_OFF)  # M codes behind which x, y, z are others
# G codes behind which the position is asked of the interpreter.
_PLACING = frozenset((10.0, 28.0, 30.0, 43.0, 43.1, 43.2, 49.0, 52.0, 53.0, 59.1, 59.2, 59.3, *range(54, 60)))
_HOMES = frozenset((28.0, 30.0))
_SIDES = {41.0: 42.0, 42.0: 41.0, 41.1: 42.1, 42.1: 41.1}  # of compensation, in a mirror image
# G codes that leave the position and the coordinates as they are.
_NEUTRAL = frozenset((4, 40, 41, 42, 41.1, 42.1, 61, 61.1, 64, 80, 91.1, *range(93, 100)))


class RowsThrough(Places):
    """The frame and the compensation in force.

    active : rows are looked at; `place`, `absolute` and `motion`, the motion code, hold while they are
    moves  : how many moves have been taken
    last   : the last move in the plane since rows are looked at, or None
    lost   : an approach or departure came behind it: its direction is not that of the path
    """

    def __init__(self, interpreter: Interpreter, rows: AppendedRows):
        super().__init__(interpreter)
        self.rows = rows
        self.active = False
        self.moves = 0
        self._mapped = np.zeros(3)  # `place` in the work system
        self._beside = False  # the tool is not at `place`: compensation has just ended
        self._offset: OffsetMoves | None = None
        # APPR, waiting for the first move of its contour
        self._approach: Callable[[Move], tuple[list[TravelRow], OffsetMoves | None]] | None = None
        self._coming: CornerMove | None = None  # of the next move
        self._corner: CornerMove | None = None  # of the last move, which waits for the next one
        self._between: list[TravelRow] = []  # rows without a move behind it
        self.motion = 0
        self._feed = 0.0  # the F word in force
        self.last: Move | None = None
        self.lost = False
        self._ahead: list[TravelRow] = []  # rows that come before the next ones
        self.waiting = False  # for a move of the rotary axes, behind which the tool centre point is on

    @property
    def compensated(self) -> bool:
        """True if compensation is on, or waits for its approach."""
        return self._offset is not None or self._approach is not None

    def through(self, words: Words) -> Iterator[Words]:
        """The rows to execute instead, in pieces that are executed one by one. Raises ProgramFault."""
        if not self.active:
            yield words
            return
        out = self._taken()
        for row, one in enumerate(travel_rows_of(words)):
            if self._idle():
                rest = rows_from(words, row)
                out += self._restored(rest)
                if out:
                    yield self._words(out)
                self.active = self.lost = False
                yield rest
                return
            for part in self._parts(one):
                try:
                    foreign = self._take(part, out)
                except ValueError as fault:
                    raise self._fault(one, str(fault)) from fault
                if foreign:
                    yield self._words(out)
                    out = []
                    self._look()
        if out:
            yield self._words(out)

    def end(self) -> list[TravelRow]:
        """Rows left to execute when the program has ended without M2 or M30. Raises ValueError."""
        self._no_corner()
        if self._approach is not None:
            raise ValueError("APPR is followed by no contour")
        if self._offset is not None:
            self._leave()
        return self._through_tilt(self._taken())

    def _words(self, rows: list[TravelRow]) -> Words:
        return self.rows.words_of(self._through_tilt(rows))

    def _taken(self) -> list[TravelRow]:
        out, self._ahead = self._ahead, []
        return out

    def _fault(self, row: TravelRow, message: str) -> ProgramFault:
        at = row.words[0][2] if row.words else 0
        return ProgramFault(
            SourcePlace(sum(begin <= at for begin, _ in self.rows.files), row.line, at), message
        )

    def _take(self, row: TravelRow, out: list[TravelRow]) -> bool:
        """Take a row; True if the position is to be asked of the interpreter behind it."""
        codes = {value for letter, value, _ in row.words if letter == G}
        self._feed = next((value for letter, value, _ in row.words if letter == F), self._feed)
        others = codes - {0.0, 1.0, 2.0, 3.0, 90.0, 91.0}
        for code in codes & {90.0, 91.0}:
            self.absolute = code == 90.0
        for code in codes & {0.0, 1.0, 2.0, 3.0}:
            self.motion, self._level = int(code), None
        if 80.0 in others:
            self._level = None
        for code in others & PLANES.keys():
            if PLANES[code] != self.normal:
                require(not self.compensated, "the plane changes while cutter radius compensation is on")
                self._no_corner(out)
            self.normal = PLANES[code]
        if others & {20.0, 21.0} and (20.0 in others) != (self._unit != 1.0):
            raise ValueError("the unit changes while a frame or compensation is in force")
        moved = {letter for letter, _, _ in row.words} & {*AXES, *CENTRES}
        distance = [(G, 90.0), (G, 91.0)]
        words = [word for word in row.words if word[:2] not in distance]
        if self.mirrored:
            words = [(c, _SIDES.get(v, v) if c == G else v, at) for c, v, at in words]
        if others & CYCLES or (self._level is not None and moved):
            self._no_corner(out)
            self._hole(TravelRow(words, row.line, row.frame), others & CYCLES, out)
            return True
        foreign = others - _NEUTRAL - PLANES.keys() - {20.0, 21.0}
        ends = any(letter == M and value in _ENDS for letter, value, _ in row.words)
        changes = any(letter == M and value == 6.0 for letter, value, _ in row.words)
        if foreign or changes:
            self._no_corner(out)
        if (foreign or changes) and self.compensated:
            what = "a tool change" if changes else f"G{min(foreign):g}"
            raise ValueError(f"{what} while cutter radius compensation is on; switch it off before (R0, G40)")
        if foreign & _HOMES:
            words = self._through(words)
        if foreign - _PLACING:
            raise ValueError(f"G{min(foreign - _PLACING):g} while a frame is in force is not read")
        if foreign:
            row = TravelRow(words, row.line, row.frame)
            on = self.tilted and self.interpreter.tool_point.on and 53.0 in foreign
            switches = (float(TOOL_POINT_OFF[1]), float(TOOL_POINT_ON[1]))
            off, back = (TravelRow([(M, code, words[0][2])], row.line, row.frame) for code in switches)
            out += [off, row, back] if on else [row]
            return True
        if moved and 4.0 not in others:
            self._move(TravelRow(words, row.line, row.frame), out)
        elif words:
            self._pass(TravelRow(words, row.line, row.frame), out, last=ends)
            turning = self.waiting and any(letter in ROTARY for letter, _, _ in words)
            if turning:
                out.append(TravelRow([(M, float(TOOL_POINT_ON[1]), words[0][2])], row.line, row.frame))
                self.waiting = False
            return changes or turning or any(word[0] == M and word[1] in _SWITCHES for word in words)
        return False

    def _pass(self, row: TravelRow, out: list[TravelRow], *, last: bool) -> None:
        if last and self._approach is not None:
            raise ValueError("APPR is followed by no contour")
        if self._corner is not None and not last:
            self._between.append(row)
            return
        if self._corner is not None:
            self._no_corner(out)
        if self._offset is not None and not last:
            out += [self._in_units(one) for one in self._offset.pass_row(row)]
            return
        if self._offset is not None:
            self._leave()
            out += self._taken()
        out.append(row)

    def _move(self, row: TravelRow, out: list[TravelRow]) -> None:
        text = "an axis word while no motion code is in force; write G0, G1, G2 or G3 before it"
        require(self.motion >= 0, text)
        given = self._lengths(row.words)
        target = self._target(given)
        mapped, arc = self.mapped(target), None
        if self.motion in (2, 3):
            arc = self.arc(self.place, target, given, self.motion == 2, self._unit)
        axes = self._moved(given)
        if arc is not None or (self._beside and set(axes) & set(IN_PLANE[self.normal])):
            axes = sorted({*axes, *IN_PLANE[self.normal]})
        if set(axes) & set(IN_PLANE[self.normal]):
            self._beside = False
        geometry = {G, ord("N"), *AXES, *CENTRES, RADIUS}
        geometry |= {TURNS} if arc is not None else set()
        # all but the number, the motion code, coordinates and centre
        rest = [word for word in row.words if word[0] not in geometry or (word[0] == G and word[1] > 3.0)]
        at = row.words[0][2]
        move = Move(TravelRow(rest, row.line, row.frame), at, self.motion, self._mapped, mapped, axes, arc)
        self.place, self._mapped = target, mapped
        self.moves += 1
        if not move.stands(self.normal):
            self.last, self.lost = move, False
        if self._corner is not None:
            (one, *between), move = self._corner.joined(move, self.normal)
            if between and self._corner.feed is not None and self._feed > 0.0:
                words = [(F, self._feed, move.at), *(word for word in move.rest.words if word[0] != F)]
                move = replace(move, rest=TravelRow(words, row.line, row.frame))
            self._corner, waiting, self._between = None, self._between, []
            self._go(one, out)
            for row in waiting:
                self._pass(row, out, last=False)
            for one in between:
                self._go(one, out)
        if self._coming is not None:
            self._coming.first = move
            self._corner, self._coming = self._coming, None
        else:
            self._go(move, out)

    def _go(self, move: Move, out: list[TravelRow]) -> None:
        rows: list[TravelRow] = []
        if self._approach is not None:
            rows, self._offset = self._approach(move)
            self._approach = None
        rows += move.rows(self.normal) if self._offset is None else self._offset.move(move)
        out += [self._in_units(one) for one in rows]

    def _no_corner(self, out: list[TravelRow] | None = None) -> None:
        """No move follows that a corner might lead to; a modal one is none then, and its move comes."""
        waits = self._corner or self._coming
        if waits is None:
            return
        what = f"the rounding or chamfer of line {waits.line}"
        require(waits.modal, f"{what} needs a move in the plane before and behind")
        first, self._corner, self._coming = waits.first, None, None
        waiting, self._between = self._between, []
        rows: list[TravelRow] = []
        if first is not None:
            self._go(first, rows)
        for row in waiting:
            self._pass(row, rows, last=False)
        (self._ahead if out is None else out).extend(rows)

    def _begin(self) -> None:
        if self.active:
            return
        state = self.interpreter.state
        self.active, self.absolute, self.normal = True, state.absolute, state.normal
        self.last, self._feed = None, state.word_feed
        self.motion = max(state.motion, -1 if state.fanuc else 0) if state.motion <= 3 else 0
        self._level = None if state.series is None else state.series.level * state.unit
        require(not state.absolute_centre, "frames and compensation with absolute arc centres are not read")
        self._look()
        if not state.absolute:
            self._ahead.append(TravelRow([(G, 90.0, 0)], 1, 0))

    def _look(self) -> None:
        there = self.interpreter.state.programmed()[:3] - self._tilt[1]
        self._mapped = np.asarray(np.linalg.solve(self._tilt[0], there))
        self._flat = self._mapped.copy()
        self.place = self.unmapped(self._mapped)
        self._beside = False

    def look_again(self) -> None:
        """The interpreter is elsewhere than the rows so far have led to. Raises ValueError for a corner."""
        self._no_corner()
        if self.active:
            self._look()

    def _leave(self) -> None:
        """Compensation ends: its moves come, and the next move in the plane leads to its programmed end."""
        offset, self._offset = self._offset, None
        assert offset is not None
        self._ahead += [self._in_units(row) for row in offset.finish()]
        self._beside = offset.started

    def _idle(self) -> bool:
        """True if rows may pass as they are: nothing waits, and no turned round G2 or G3 counts behind."""
        waits = self.compensated or self._beside or self._coming is not None or self._corner is not None
        turned = self.motion in (2, 3) and self.motion != self.interpreter.state.motion
        return self.is_plain and not (waits or turned or self.tilted)

    def _restored(self, words: Words) -> list[TravelRow]:
        """Rows that bring back G91 and the motion code, where rows behind them count on them."""
        if not len(words.line):
            return []
        at, line, frame = int(words.at[0]), int(words.line[0]), int(words.frame[0])
        codes = [] if self.absolute else [91.0]
        if self.motion in (0, 1) and self.motion != self.interpreter.state.motion:
            codes.append(float(self.motion))
        return [TravelRow([(G, code, at)], line, frame) for code in codes]
