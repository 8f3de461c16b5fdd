"""Cycles of lathes while a program runs: the profile is read by executing its blocks aside, and the passes
become rows of words.

Rows are those of a lathe under LinuxCNC: G7 (diameters), G18, G33 for threads; so what a cycle was expanded
to can be read by others.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from planner.base.arrays import FloatArray
from planner.nc import lathe_cuts, turning
from planner.nc.faults import Notes
from planner.nc.language.making import Given, Maker, Making, Row
from planner.nc.language.rows import require
from planner.nc.program import Kind, Program
from planner.nc.turning import Leg

RETRACT = 0.5  # e where the program does not give it; controls have a setting [mm]
_NEEDS = "a cycle of a lathe needs G18, G90 and G40, and a work system that is not turned"
_WRONG = {(Kind.DWELL, Kind.STOP): "a dwell or a stop", (Kind.SPLINE,): "a spline"}
_START = "_cycle x", "_cycle z"  # shared names of where the tool stood [mm]


def start(making: Making, given: Given) -> None:
    """G70 begins."""
    _keep_start(making)


def back(making: Making, given: Given) -> list[Row]:
    """G70 ends where it began."""
    return [[("G", 0.0), *_to(making, _start(making))]]


def read_profile(making: Making, given: Given) -> None:
    """The blocks that follow are read aside, as the profile of a cycle. Raises ValueError."""
    if making.interpreter.aside is None:
        _here(making)
    making.interpreter.read_aside(making.place)


def _contour(making: Making) -> turning.Contour:
    """The blocks executed aside as a profile; the state is as before them. Raises ValueError."""
    interpreter = making.interpreter
    program, offset = interpreter.table.finish("", Notes()), interpreter.state.offset.copy()
    interpreter.take_back()
    making.travel.look_again()
    if (offset != interpreter.state.offset).any():
        raise ValueError("the profile changes an offset; write it before the cycle")
    return _contour_of(program, offset, _start(making))


def removal(making: Making, given: Given, *, cycle: str) -> Iterable[Row]:
    """G71 and G72."""
    contour, unit = _contour(making), making.unit
    roughing = turning.Roughing(
        depth=abs(given["D"]) * unit,
        retract=_retract(making, given, cycle),
        allowance=_allowance(making, given),
        more=complex(given.get("K", 0.0), given.get("I", 0.0)) * unit,
    )
    if turning.has_pocket(turning.exchanged(contour) if cycle == "G72" else contour):
        text = f"{cycle} with a pocket in its profile (type II): the order of its passes is this reader's"
        making.interpreter.findings.assume(text, making.place.line)
    return _cut(making, cycle == "G72", turning.stock_removal, contour, roughing)


def pattern(making: Making, given: Given) -> Iterable[Row]:
    """G73."""
    contour = _contour(making)
    shift = complex(given.get("K", 0.0), given.get("I", 0.0)) * making.unit
    allowance = _allowance(making, given)
    return _rows(making, turning.pattern_repeat(contour, round(given["D"]), shift, allowance))


def thread(making: Making, given: Given) -> Iterable[Row]:
    """G76."""
    start, unit, part = _point(making.interpreter.state.programmed()), making.unit, 1.0 / making.per_radius
    x = part * given.get("X", start.imag / (part * unit))
    thread = lathe_cuts.LatheThread(
        start=start,
        end=complex(given.get("Z", start.real / unit), x) * unit,
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
    return _rows(making, lathe_cuts.thread_passes(thread), start)


def single_cut(making: Making, given: Given, *, cycle: str) -> Iterable[Row]:
    """G90, G94 and, with a lead F, G92."""
    start, taper = _here(making), given.get("R", 0.0) * making.unit
    end = _end(making, given, start)
    if cycle == "G92":
        return _rows(making, lathe_cuts.single_thread(start, end, taper, given["F"] * making.unit))
    return _cut(making, cycle == "G94", lathe_cuts.single_cut, start, end, taper)


def pecking(making: Making, given: Given, *, cycle: str) -> Iterable[Row]:
    """G74 and G75."""
    start, unit = _here(making), making.unit
    pecking = lathe_cuts.Pecking(
        start=start,
        end=_end(making, given, start),
        peck=abs(given["K"]) * unit if "K" in given else math.inf,
        shift=abs(given["I"]) * unit if "I" in given else math.inf,
        retract=_retract(making, given, cycle, abs(given["K"]) * unit) if "K" in given else 0.0,
        relief=abs(given.get("D", 0.0)) * unit,
    )
    return _cut(making, cycle == "G75", lathe_cuts.pecked, pecking)


def _retract(making: Making, given: Given, cycle: str, at_most: float = math.inf) -> float:
    if "R" in given:
        return abs(given["R"]) * making.unit
    retract = min(RETRACT, at_most)
    text = f"the retract of {cycle} is not given: {retract:g} mm"
    making.interpreter.findings.assume(text, making.place.line)
    return retract


def _allowance(making: Making, given: Given) -> complex:
    return complex(given.get("W", 0.0), given.get("U", 0.0) / making.per_radius) * making.unit


def _here(making: Making) -> complex:
    """Where the tool stands; it is the start of the cycle too. Raises ValueError."""
    state = making.interpreter.state
    if state.actual is not None or state.rotated or state.normal != 1 or not state.absolute:
        raise ValueError(_NEEDS)
    return _keep_start(making)


def _keep_start(making: Making) -> complex:
    place = _point(making.interpreter.state.programmed())
    making.shared.update(zip(_START, (place.imag, place.real), strict=True))
    return place


def _start(making: Making) -> complex:
    x, z = (making.shared[name] for name in _START)
    return complex(z, x)


def _point(position: FloatArray) -> complex:
    return complex(position[2], position[0])


def _end(making: Making, given: Given, start: complex) -> complex:
    x = given["X"] / making.per_radius * making.unit if "X" in given else start.imag
    return complex(given["Z"] * making.unit if "Z" in given else start.real, x)


def _cut(making: Making, faces: bool, cycle: Callable[..., Iterator[Leg]], *given: Any) -> list[Row]:
    """The moves of a cycle from where it began; where it `faces` with x and z exchanged."""
    return _rows(making, turning.facing(cycle, *given) if faces else cycle(*given))


def _rows(making: Making, legs: Iterable[Leg], start: complex | None = None) -> list[Row]:
    """The moves of a cycle from `start`, else from where it began."""
    rows, at = [], _start(making) if start is None else start
    for leg in legs:
        if not leg.turning and not leg.pitch and abs(leg.end - at) < turning.SAME:
            continue
        code, centre, more = 0.0 if leg.fast else 1.0, (leg.centre - at) / making.unit, Row()
        if leg.pitch and not leg.fast:
            code, more = 33.0, [("K", leg.pitch / making.unit)]
        elif leg.turning and not leg.fast:
            code, more = 3.0 if leg.turning > 0 else 2.0, [("I", centre.imag), ("K", centre.real)]
        rows.append([("G", code), *_to(making, leg.end), *more])
        at = leg.end
    return rows


def _to(making: Making, point: complex) -> Row:
    return [("X", making.per_radius * point.imag / making.unit), ("Z", point.real / making.unit)]


def _contour_of(program: Program, offset: FloatArray, start: complex) -> turning.Contour:
    """Blocks as a profile in programmed coordinates. Raises ValueError for no line or arc in the plane."""
    legs, arcs = [], iter(zip(program.arc_center, program.arc_normal, program.arc_sweep, strict=True))
    for kind, end in zip(program.kind.tolist(), program.end, strict=True):
        for kinds, what in _WRONG.items():
            require(kind not in kinds, f"{what} in the profile of a cycle; write it after the cycle")
        point = complex(end[2] - offset[2], end[0] - offset[0])
        if kind == Kind.ARC:
            centre, normal, sweep = next(arcs)
            if normal != 1 or abs(sweep) > 2.0 * math.pi:
                raise ValueError("an arc of the profile lies in another plane than z x; write G18 before it")
            middle = complex(centre[2] - offset[2], centre[0] - offset[0])
            legs.append(Leg(point, 1 if sweep > 0 else -1, middle))
        else:
            legs.append(Leg(point, fast=kind == Kind.RAPID))
    require(legs, "the profile of the cycle has no moves")
    require(not legs[0].turning, "the first move of a profile is straight: G0 or G1 to its first point")
    return turning.Contour(start, legs[0].fast, tuple(legs))


MAKERS: dict[str, Maker] = {
    **{cycle: partial(removal, cycle=cycle) for cycle in ("G71", "G72")},
    "G73": pattern,
    **{cycle: partial(pecking, cycle=cycle) for cycle in ("G74", "G75")},
    "G76": thread,
    **{cycle: partial(single_cut, cycle=cycle) for cycle in ("G90", "G92", "G94")},
}
