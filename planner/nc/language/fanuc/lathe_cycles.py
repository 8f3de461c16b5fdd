"""Cycles of lathes while a program runs: the profile is read by executing its blocks aside, and the passes
become rows of words.

Rows are those of a lathe under LinuxCNC: G7 (diameters), G18, G33 for threads; so what a cycle was expanded
to can be read by others.
"""

import copy
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

import numpy as np

from planner.nc import lathe_cuts, turning
from planner.nc.block_table import BlockTable
from planner.nc.faults import Notes
from planner.nc.language.fanuc.lathe_words import PECKS
from planner.nc.language.makers import MAKERS
from planner.nc.language.making import Maker, Making, Row
from planner.nc.language.run import ProgramRun
from planner.nc.language.tree import SourcePlace
from planner.nc.lexer import Words
from planner.nc.program import Kind, Program
from planner.nc.state import State
from planner.nc.turning import Leg

RETRACT = 0.5  # e where the program does not give it; controls have a setting [mm]
_NEEDS = "a cycle of a lathe needs G18, G90 and G40, and a work system that is not turned"
_WRONG = {(Kind.DWELL, Kind.STOP): "a dwell or a stop", (Kind.SPLINE,): "a spline"}
Given = Mapping[str, float]


class LatheCycles:
    """The cycles of one run: where the tool stood, and what is set aside while a profile is read."""

    def __init__(self, run: ProgramRun):
        self.run = run
        self._start = np.zeros(3)
        self._aside: tuple[State, BlockTable, Callable[[Words], None]] | None = None
        self._place = SourcePlace(0, 0, 0)  # of the cycle whose profile is read
        run.makers, run.leave_profile = {**MAKERS, **self._makers()}, self.leave

    def _makers(self) -> dict[str, Maker]:
        return {
            "start": self._begin_at_once,
            "profile": self._begin,
            "back": lambda making, given: [self._fast(self._point(self._start))],
            "G71": partial(self._removal, cycle="G71"),
            "G72": partial(self._removal, cycle="G72"),
            "G73": self._pattern,
            "G74": partial(self._pecking, cycle="G74"),
            "G75": partial(self._pecking, cycle="G75"),
            "G76": self._thread,
            "G90": partial(self._single, cut=lathe_cuts.single_cut),
            "G92": self._single_thread,
            "G94": partial(self._single, cut=partial(turning.facing, lathe_cuts.single_cut)),
        }

    def _begin_at_once(self, making: Making, given: Given) -> None:
        self._start = self._state.programmed().copy()

    def _begin(self, making: Making, given: Given) -> None:
        """The blocks that follow are read aside."""
        if self._aside is not None:
            raise ValueError("a cycle stands in the profile of another one; write it behind that")
        self._here()
        self._place, interpreter = making.place, self.run.interpreter
        state = interpreter.state
        self._aside = copy.deepcopy(state), interpreter.table, self.run.tee
        interpreter.go_on_with(state, BlockTable(len(state.letters)))
        self.run.tee = lambda words: None
        # any feed does: moves whose feed depends on the diameter are divided
        state.feed_mode, state.feed, state.uncompensated = "per minute", 1.0, True

    def leave(self) -> SourcePlace | None:
        """Take back what a profile without an end set aside; returns where its cycle stands, or None."""
        if self._aside is None:
            return None
        state, table, self.run.tee = self._aside
        self.run.interpreter.go_on_with(state, table)
        self.run.travel.look_again()
        self._aside = None
        return self._place

    def _contour(self) -> turning.Contour:
        """The blocks executed aside as a profile; the state is as before them. Raises ValueError."""
        interpreter = self.run.interpreter
        program, offset = interpreter.table.finish("", Notes()), interpreter.state.offset.copy()
        self.leave()
        if (offset != interpreter.state.offset).any():
            raise ValueError("the profile changes an offset; write it before the cycle")
        return _contour_of(program, offset, self._point(self._start))

    @staticmethod
    def _point(position: np.ndarray) -> complex:
        return complex(position[2], position[0])

    def _removal(self, making: Making, given: Given, *, cycle: str) -> Iterable[Row]:
        contour, unit = self._contour(), self._unit
        roughing = turning.Roughing(
            depth=abs(given["D"]) * unit,
            retract=self._retract(making, given, cycle),
            allowance=self._allowance(given),
            more=complex(given.get("K", 0.0), given.get("I", 0.0)) * unit,
        )
        if turning.has_pocket(turning.exchanged(contour) if cycle == "G72" else contour):
            text = f"{cycle} with a pocket in its profile (type II): the order of its passes is this reader's"
            making.interpreter.findings.assume(text, making.place.line)
        if cycle == "G72":
            return self._rows(turning.facing(turning.stock_removal, contour, roughing))
        return self._rows(turning.stock_removal(contour, roughing))

    def _retract(self, making: Making, given: Given, cycle: str) -> float:
        if "R" in given:
            return abs(given["R"]) * self._unit
        retract = min(RETRACT, self._unit * abs(given.get("K", math.inf) if cycle in PECKS else math.inf))
        text = f"the retract of {cycle} is not given: {retract:g} mm"
        making.interpreter.findings.assume(text, making.place.line)
        return retract

    def _pattern(self, making: Making, given: Given) -> Iterable[Row]:
        contour = self._contour()
        shift = complex(given.get("K", 0.0), given.get("I", 0.0)) * self._unit
        return self._rows(turning.pattern_repeat(contour, round(given["D"]), shift, self._allowance(given)))

    def _allowance(self, given: Given) -> complex:
        return complex(given.get("W", 0.0), given.get("U", 0.0) / self._of_radius) * self._unit

    def _thread(self, making: Making, given: Given) -> Iterable[Row]:
        start, unit, part = self._point(self._state.programmed()), self._unit, 1.0 / self._of_radius
        thread = lathe_cuts.LatheThread(
            start=start,
            end=complex(given.get("Z", start.real / unit), part * given.get("X", start.imag / (part * unit)))
            * unit,
            height=given["K"] * unit,
            first=given["D"] * unit,
            lead=given["F"] * unit,
            least=given.get("Q", 0.0) * unit,
            finish=given.get("R", 0.0) * unit,
            springs=round(given.get("L", 1.0)),
            angle=given.get("A", 0.0),
            taper=given.get("I", 0.0) * unit,
            chamfer=given.get("E", 0.0) * given["F"] * unit,
        )
        return self._rows(lathe_cuts.thread_passes(thread), start)

    def _single(self, making: Making, given: Given, *, cut: Callable[..., Iterator[Leg]]) -> Iterable[Row]:
        start = self._here()
        return self._rows(cut(start, self._end(given, start), given.get("R", 0.0) * self._unit))

    def _single_thread(self, making: Making, given: Given) -> Iterable[Row]:
        start = self._here()
        taper, lead = given.get("R", 0.0) * self._unit, given["F"] * self._unit
        return self._rows(lathe_cuts.single_thread(start, self._end(given, start), taper, lead))

    def _pecking(self, making: Making, given: Given, *, cycle: str) -> Iterable[Row]:
        start = self._here()
        pecking = lathe_cuts.Pecking(
            start=start,
            end=self._end(given, start),
            peck=abs(given["K"]) * self._unit if "K" in given else math.inf,
            shift=abs(given["I"]) * self._unit if "I" in given else math.inf,
            retract=self._retract(making, given, cycle) if "K" in given else 0.0,
            relief=abs(given.get("D", 0.0)) * self._unit,
        )
        if cycle == "G75":
            return self._rows(turning.facing(lathe_cuts.pecked, pecking))
        return self._rows(lathe_cuts.pecked(pecking))

    def _here(self) -> complex:
        """Where the tool stands; it is the start of the cycle too. Raises ValueError."""
        state = self._state
        if state.actual is not None or state.rotated or state.normal != 1 or not state.absolute:
            raise ValueError(_NEEDS)
        self._start = state.programmed().copy()
        return self._point(self._start)

    def _end(self, given: Given, start: complex) -> complex:
        x = given["X"] / self._of_radius * self._unit if "X" in given else start.imag
        return complex(given["Z"] * self._unit if "Z" in given else start.real, x)

    @property
    def _state(self) -> State:
        return self.run.interpreter.state

    @property
    def _unit(self) -> float:
        return self._state.unit

    @property
    def _of_radius(self) -> float:
        """X words per radius: 2 where they are diameters, else 1."""
        return 2.0 if self._state.diameters else 1.0

    def _rows(self, legs: Iterable[Leg], start: complex | None = None) -> list[Row]:
        """The moves of a cycle from `start`, else from where it began."""
        rows, at = [], self._point(self._start) if start is None else start
        for leg in legs:
            if not leg.turning and not leg.pitch and abs(leg.end - at) < turning.SAME:
                continue
            if leg.fast:
                rows.append(self._fast(leg.end))
            elif leg.pitch:
                rows.append([("G", 33.0), *self._to(leg.end), ("K", leg.pitch / self._unit)])
            elif leg.turning:
                centre = (leg.centre - at) / self._unit
                code = 3.0 if leg.turning > 0 else 2.0
                rows.append([("G", code), *self._to(leg.end), ("I", centre.imag), ("K", centre.real)])
            else:
                rows.append([("G", 1.0), *self._to(leg.end)])
            at = leg.end
        return rows

    def _fast(self, point: complex) -> Row:
        return [("G", 0.0), *self._to(point)]

    def _to(self, point: complex) -> Row:
        return [("X", self._of_radius * point.imag / self._unit), ("Z", point.real / self._unit)]


def _contour_of(program: Program, offset: np.ndarray, start: complex) -> turning.Contour:
    """Blocks as a profile in programmed coordinates. Raises ValueError for no line or arc in the plane."""
    legs, arcs = [], iter(zip(program.arc_center, program.arc_normal, program.arc_sweep, strict=True))
    for kind, end in zip(program.kind.tolist(), program.end, strict=True):
        for kinds, what in _WRONG.items():
            if kind in kinds:
                raise ValueError(f"{what} in the profile of a cycle; write it after the cycle")
        point = complex(end[2] - offset[2], end[0] - offset[0])
        if kind == Kind.ARC:
            centre, normal, sweep = next(arcs)
            if normal != 1 or abs(sweep) > 2.0 * math.pi:
                raise ValueError("an arc of the profile lies in another plane than z x; write G18 before it")
            middle = complex(centre[2] - offset[2], centre[0] - offset[0])
            legs.append(Leg(point, 1 if sweep > 0 else -1, middle))
        else:
            legs.append(Leg(point, fast=kind == Kind.RAPID))
    if not legs:
        raise ValueError("the profile of the cycle has no moves")
    if legs[0].turning:
        raise ValueError("the first move of a profile is straight: G0 or G1 to its first point")
    return turning.Contour(start, legs[0].fast, tuple(legs))
