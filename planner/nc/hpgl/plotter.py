"""Executing the instructions of a plotter file: where the pen goes, at which speed, and when it rises and
falls.

The plotter unit is 0.025 mm unless the machine file says otherwise. Pen up the plotter moves as fast as it
can, pen down at VS, in cm/s, without VS at the limits of its axes. A pen is changed with the pen up; CI and
EA leave pen and position as they found them. A file starts at (0, 0) with the pen up, without scaling, in
absolute coordinates. A fault is recorded and reading goes on, so that `info` can show them all.
"""

import dataclasses
import math
from bisect import bisect_left
from collections.abc import Callable, Sequence

import numpy as np

from planner.base.errors import InputError
from planner.base.units import RAD_PER_DEG
from planner.machine import Machine, Plotter
from planner.nc.arcs import Arc, arc_through
from planner.nc.block_table import BlockTable
from planner.nc.faults import Fault, Notes
from planner.nc.hpgl import instructions as written
from planner.nc.hpgl.drawing import NotDrawn, Point, Scaling
from planner.nc.hpgl.instructions import FORMS, IGNORED, Instruction
from planner.nc.program import Kind, Program
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.state import State, state_of

# The pen is an event with a full stop, because it takes its time to rise and to fall.
PEN_DOWN, PEN_UP, PEN_CHANGE = 3.0, 5.0, 6.0  # M3, M5 and M6
_NORMAL = 2  # a drawing lies in x and y
MM_PER_CM = 10.0  # the speed of VS is in cm/s
FULL_TURN = 360.0  # [deg]
WORD_SHOWN = 20  # characters of an instruction in a message
# Below this an arc is a straight line [rad]: NC programs take so short an arc for a full turn.
SWEEP_MIN = 1e-6


def read_drawing(
    data: bytes, machine: Machine | None, source: str, reading: Reading = AS_USUAL
) -> tuple[Program, Sequence[Fault]]:
    """Read a plotter file past everything that is not supported; the faults in the order of the file. Raises
    InputError for a file without any instruction."""
    run = _Run(data, machine, reading)
    found = 0
    for instruction in written.instructions(data, run.report, run.note):
        found += 1
        try:
            run.execute(instruction)
        except NotDrawn as fault:
            run.report(instruction.at, instruction.end, str(fault))
    if not found and not run.reports:
        text = "the plotter file is empty: there is no instruction in it"
        raise InputError(text, source=source, line=1, column=1)
    program = run.table.finish(source, run.all_notes(), reading=reading)
    return dataclasses.replace(program, pen=True), run.faults()


class _Run:
    """The state of the plotter; one method per instruction."""

    def __init__(self, data: bytes, machine: Machine | None, reading: Reading):
        self.data = data
        self._line_ends = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n")).tolist()
        self.strict = reading.strict
        self.unknown: list[int] = []
        self.plotter = (machine.plotter if machine is not None else None) or Plotter()
        self.table, self.state = BlockTable(), State(path_control=state_of(machine).path_control)
        self.reports: list[tuple[int, int, str]] = []
        self.notes: dict[str, None] = {}  # ordered, each once
        self.ignored: dict[str, list[int]] = {}
        self.changing: dict[str, list[int]] = {}  # of these, what may change the path or its time
        self.position: Point = (0.0, 0.0)
        self.down = False
        self.drawn = False
        self.page_end: Instruction | None = None
        self.pen = 0
        self._initialise()
        self._add_event("M", PEN_UP, 0)

    def _initialise(self) -> None:
        self.scaling = Scaling()
        self.absolute = True
        self.speed, self.speed_of_pen = math.inf, dict[int, float]()

    def report(self, at: int, end: int, message: str) -> None:
        self.reports.append((at, end, message))

    def note(self, text: str) -> None:
        self.notes[text] = None

    def faults(self) -> list[Fault]:
        """All faults in the order of the file."""
        return [Fault(*self._place(at), self._word(at, end), said) for at, end, said in sorted(self.reports)]

    def _word(self, at: int, end: int) -> str:
        text = self.data[at:end].decode("latin-1").strip()[:WORD_SHOWN]
        return text if text.isprintable() else ""

    def all_notes(self) -> Notes:
        notes = [f"read as a plotter file (HPGL), 1 plotter unit = {self.plotter.unit:g} mm"]
        assumed = []
        block, used = self.table.block, slice(0, self.table.blocks)
        at_will = np.isin(block.kind[used], (Kind.LINE, Kind.ARC)) & np.isinf(block.feed[used])
        if at_will.any():
            text = "no speed (VS) before it; the pen runs as fast as the machine allows"
            assumed.append(f"line {block.line[at_will.argmax()]}: {text}")
        for ignored, notes_of in ((self.changing, assumed), (self.ignored, notes)):
            for name, places in ignored.items():
                times = f"{len(places)} times, first " if len(places) > 1 else ""
                why = IGNORED.get(name, "the end of a page")
                notes_of.append(f"{name} ignored, {times}on line {self._place(places[0])[0]}: {why}")
        if self.unknown:
            count, first = len(self.unknown), self.unknown[0]
            what = f"{count:,} instruction{'s' if count > 1 else ''} that this reader does not know"
            word, line = self._word(first, first + 2), self._place(first)[0]
            assumed.append(f"{what}: left out, as plotters do; first {word} line {line}")
        return Notes(tuple(assumed), (*notes, *self.notes))

    def _place(self, at: int) -> tuple[int, int]:
        line = bisect_left(self._line_ends, at)
        return line + 1, at - (self._line_ends[line - 1] if line else -1)

    def execute(self, it: Instruction) -> None:
        name, numbers = it.name, it.numbers
        form = FORMS.get(name)
        no_symbol = name == "SM" and not it.text.strip(b"; \r\n")
        known = self.strict or name in IGNORED or name in written.REFUSED or name == "SM"
        if (form is None or (name == "RT" and not form.fits(len(numbers)))) and not known:
            self.unknown.append(it.at)  # RT is an arc of HP's plotters, and something else of other makers
        elif form is None and (name in IGNORED or no_symbol):
            changes = name in written.CHANGING or (name in written.WITH_NUMBERS and numbers)
            if changes and self.strict:
                raise NotDrawn(f"{IGNORED[name]} (assumed without --strict)")
            (self.changing if changes else self.ignored).setdefault(name, []).append(it.at)
        elif form is None:
            allowed = f"there is no such instruction; allowed are {written.ALLOWED}"
            raise NotDrawn(written.REFUSED.get(name, allowed))
        elif not form.fits(len(numbers)):
            raise NotDrawn(f"{len(numbers)} numbers found; write {form}")
        else:
            _EXECUTE[name](self, it)

    def _end_page(self, it: Instruction) -> None:
        self.ignored.setdefault(it.name, []).append(it.at)
        self.page_end = self.page_end or (it if self.drawn else None)

    def _scale(self, it: Instruction) -> None:
        change = self.scaling.with_points if it.name == "IP" else self.scaling.with_range
        self.scaling = change(it.numbers)
        self.absolute |= it.name == "DF"

    def _begin_anew(self, it: Instruction) -> None:
        self._move_pen(False, it.at)
        self._initialise()

    def _plot(self, it: Instruction) -> None:
        if it.name in ("PA", "PR"):
            self.absolute = it.name == "PA"
        else:
            self._move_pen(it.name == "PD", it.at)
        for x, y in zip(it.numbers[::2], it.numbers[1::2], strict=True):
            self._go(self._point(x, y, absolute=self.absolute), it.at)

    def _arc(self, it: Instruction) -> None:
        centre = self._point(*it.numbers[:2], absolute=it.name == "AA")
        degrees = it.numbers[2]
        if not 0 < abs(degrees) <= FULL_TURN:
            raise NotDrawn(f"a sweep of {degrees:g} degrees; allowed are -360 to 360, but not 0")
        sweep = degrees * RAD_PER_DEG * self.scaling.handedness()
        dx, dy = self.position[0] - centre[0], self.position[1] - centre[1]
        if not math.hypot(dx, dy) > 0:
            raise NotDrawn("the arc has no radius: the pen stands on its centre")
        end = self.position
        if abs(degrees) < FULL_TURN:
            cos, sin = math.cos(sweep), math.sin(sweep)
            end = centre[0] + cos * dx - sin * dy, centre[1] + sin * dx + cos * dy
        self._turn(centre, sweep, end, it.at)

    def _arc_through(self, it: Instruction) -> None:
        """An arc through a point to an end: straight where they lie on a line, a circle at its start."""
        self.scaling.handedness()
        through = self._point(*it.numbers[:2], absolute=it.name == "AT")
        end = self._point(*it.numbers[2:4], absolute=it.name == "AT")
        found = arc_through(complex(*self.position), complex(*through), complex(*end))
        if found is None:
            self._go(end, it.at)
        else:
            self._turn((found[0].real, found[0].imag), found[1], end, it.at)

    def _circle(self, it: Instruction) -> None:
        radius, at = it.numbers[0], it.at
        if radius == 0:
            raise NotDrawn("a circle of radius 0; write its radius, such as CI400")
        handedness = self.scaling.handedness()
        centre, was_down = self.position, self.down
        start = self._point(radius, 0.0, absolute=False)
        self._move_pen(False, at)
        self._go(start, at)
        self._move_pen(True, at)
        self._turn(centre, 2.0 * math.pi * handedness, start, at)
        self._move_pen(False, at)
        self._go(centre, at)
        self._move_pen(was_down, at)

    def _rectangle(self, it: Instruction) -> None:
        (x0, y0), was_down = self.position, self.down
        x1, y1 = self._point(*it.numbers, absolute=it.name == "EA")
        self._move_pen(True, it.at)
        for corner in ((x1, y0), (x1, y1), (x0, y1), (x0, y0)):
            self._go(corner, it.at)
        self._move_pen(was_down, it.at)

    def _select_pen(self, it: Instruction) -> None:
        pen = it.numbers[0] if it.numbers else 0.0
        if pen != round(pen) or pen < 0:
            raise NotDrawn("a pen is a whole number, 0 (put the pen away) or more")
        if pen == self.pen:
            return
        was_down = self.down
        self._move_pen(False, it.at)
        self.pen = int(pen)
        self._add_event("T", pen, it.at)
        self._add_event("M", PEN_CHANGE, it.at)
        self.table.add_dwell(0.0, self._ready(it.at), self.state)
        self._move_pen(was_down, it.at)

    def _select_speed(self, it: Instruction) -> None:
        numbers = it.numbers
        speed = numbers[0] * MM_PER_CM if numbers else math.inf
        if not speed > 0:
            raise NotDrawn("a speed must be positive; write the pen's speed in cm/s, such as VS20")
        if len(numbers) == 2:
            self.speed_of_pen[round(numbers[1])] = speed
        else:
            self.speed, self.speed_of_pen = speed, {}

    def _point(self, x: float, y: float, *, absolute: bool) -> Point:
        unit, (fx, fy), (x0, y0) = self.plotter.unit, self.scaling.factor, self.position
        if absolute:
            x, y = self.scaling.place(x, y)
            return x * unit, y * unit
        return x0 + x * fx * unit, y0 + y * fy * unit

    def _go(self, end: Point, at: int) -> None:
        if self.down:
            self._begin_to_draw()
        self.position = end
        self.table.add(Kind.LINE if self.down else Kind.RAPID, self._ready(at), self.state)

    def _turn(self, centre: Point, sweep: float, end: Point, at: int) -> None:
        if not self.down or abs(sweep) < SWEEP_MIN:
            self._go(end, at)
            return
        self._begin_to_draw()
        self.position = end
        self.table.add_arc(Arc(np.array([*centre, 0.0]), sweep), _NORMAL, self._ready(at), self.state)

    def _ready(self, at: int) -> int:
        """Bring the state to where the pen is; returns the line."""
        self.state.position[:2] = self.position
        self.state.feed = self.speed_of_pen.get(self.pen, self.speed)
        return self._place(at)[0]

    def _add_event(self, letter: str, value: float, at: int) -> None:
        self.table.add_event(letter, value, self._ready(at))

    def _begin_to_draw(self) -> None:
        self.drawn = True
        if self.page_end is not None:
            message = "the drawing goes on after the end of a page; write one file for each page"
            self.report(self.page_end.at, self.page_end.end, message)
            self.page_end = None

    def _move_pen(self, down: bool, at: int) -> None:
        """Lower or raise the pen, if it is not there already, at a full stop."""
        if down != self.down:
            self.down = down
            self._add_event("M", PEN_DOWN if down else PEN_UP, at)
            seconds = self.plotter.pen_down if down else self.plotter.pen_up
            self.table.add_dwell(seconds, self._ready(at), self.state)


_EXECUTE: dict[str, Callable[[_Run, Instruction], None]] = {
    **dict.fromkeys(("PU", "PD", "PA", "PR"), _Run._plot),
    **dict.fromkeys(("AA", "AR"), _Run._arc),
    **dict.fromkeys(("AT", "RT"), _Run._arc_through),
    "CI": _Run._circle,
    **dict.fromkeys(("EA", "ER"), _Run._rectangle),
    "SP": _Run._select_pen,
    "VS": _Run._select_speed,
    **dict.fromkeys(("IP", "SC", "DF"), _Run._scale),
    **dict.fromkeys(written.PAGE_ENDS, _Run._end_page),
    "IN": _Run._begin_anew,
}
