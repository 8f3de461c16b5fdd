"""Cycles of single cuts on Fanuc and Haas lathes, G90 G92 G94, and those that peck, G74 G75: from their words
to moves.

Points are complex numbers, z + i x in radii [mm]; the tool stands at S, the words give E = (Z, X) and a taper
r along x (in G94 z).

    G90    fast in x to x_E + r, cut to E, cut in x back to x_S, fast back to S
    G92    the same as a thread: in step with the spindle to E, then fast
    G94    fast in z to z_E + r, cut to E, cut in z back to z_S, fast back to S
    G74    pecks along z from z_S to z_E, each q deeper than the last and drawn back by e; at the bottom, but not of the first one, away
           by the relief against the shift; fast back to z_S, and the same p further in x until x_E; then fast
           back to S
    G75    the same with x and z exchanged

Sources: the formats of Fanuc's lathes (series 0i-T) and of Haas (haascnc.com) as they are known; the order of
the moves of G75, and that the first groove has no relief: the programming manual of ADTECH's CNC4620, which
has Fanuc's format, page 55.

The threading cycle G76 of Fanuc and Haas lathes: from its words to passes.

The thread runs from the start S = (z_S, x_S) to the root E = (z_E, x_E), x in radii; s = sign(x_S - x_E)
points away from it and t = sign(z_E - z_S) along it. A pass of depth c below the crest, x_E + s k, cuts at
x_E + s (k - c), from z_S + t c tan(a / 2): with the angle a of the tool it advances along the flank. A taper
i moves the beginning of the cut by i. The depths are

    c_n = max(d sqrt(n), c_(n-1) + d_min)  while below k - r,    then k - r, then k, as often as the cycle says

so that every pass takes the same section of chip. A chamfer of length g leaves the thread at 45 degrees
before z_E.

Sources: Haas' description of G76 (haascnc.com); the two-block format as in Fanuc's operator's manuals for
series 0i-T.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from planner.nc.turning import PASSES_MAX, SAME, ContourFault, Leg, TurningStep, exchanged


class ThreadFault(ValueError):
    """The words of a thread contradict each other; the text says how."""


@dataclass(frozen=True)
class LatheThread:
    """A thread; lengths in mm, x as radii."""

    # start and end: (z, x) where the tool stands, and the root at the thread's end
    start: complex
    end: complex
    height: float  # k, from the crest to the root;  first : d;  least : d_min;  finish : r
    first: float
    lead: float  # of a turn, along the longer of z and x
    least: float = 0.0
    finish: float = 0.0
    springs: int = 1  # how often the full depth is cut
    # of the tool [degrees];  taper : i, x at the beginning less x at the end;  chamfer : g
    angle: float = 0.0
    taper: float = 0.0
    chamfer: float = 0.0


@dataclass(frozen=True)
class Pass:
    """A move of the cycle to `end` (z + i x): fast, or in step with the spindle by `pitch` a turn."""

    end: complex
    pitch: float = 0.0


def lathe_depths(thread: LatheThread) -> Iterator[float]:
    """Depths of the passes below the crest [mm]."""
    left, n, depth = thread.height - thread.finish, 1, thread.first
    while depth < left * (1.0 - 1e-12):
        yield depth
        n += 1
        depth = max(thread.first * math.sqrt(n), depth + thread.least)
    if thread.finish > 0.0:
        yield left
    for _ in range(thread.springs):
        yield thread.height


def thread_passes(thread: LatheThread) -> Iterator[Pass]:
    """The moves of the cycle, from its start and back to it. Raises ThreadFault."""
    _require(thread)
    start, end = thread.start, thread.end
    out, ahead = (math.copysign(1.0, start.imag - end.imag), math.copysign(1.0, end.real - start.real))
    slope = math.tan(math.radians(thread.angle / 2.0))
    for depth in lathe_depths(thread):
        begin = start.real + ahead * depth * slope
        low = end.imag + out * (thread.height - depth)
        cut, leave = complex(begin, low + thread.taper), complex(end.real, low)
        along = leave - cut
        pitch = thread.lead * abs(along) / max(abs(along.real), abs(along.imag))
        yield Pass(complex(begin, start.imag))
        yield Pass(cut)
        if thread.chamfer > 0.0:
            leave -= along * (thread.chamfer / abs(along.real))
            yield Pass(leave, pitch)
            leave += complex(ahead, out) * thread.chamfer
            yield Pass(leave, thread.lead * math.sqrt(2.0))
        else:
            yield Pass(leave, pitch)
        yield Pass(complex(leave.real, start.imag))
    yield Pass(start)


def _require(thread: LatheThread) -> None:
    along = abs(thread.end.real - thread.start.real)
    if thread.start.imag == thread.end.imag or not along > 0.0:
        raise ThreadFault("a thread needs room in x and z between where the tool stands and X Z")
    if not 0.0 < thread.first <= thread.height or not 0.0 <= thread.finish < thread.height:
        raise ThreadFault(
            "the first depth and the finishing allowance of a thread lie between 0 and its height"
        )
    if thread.first + thread.finish > thread.height * (1.0 + 1e-12) and thread.finish:
        raise ThreadFault("the first depth and the finishing allowance of a thread are more than its height")
    if not thread.lead > 0.0 or not 1 <= thread.springs <= PASSES_MAX:
        raise ThreadFault("a thread needs a lead above 0 and at least one pass at its full depth")
    if not 0.0 <= thread.angle < 180.0 or not 0.0 <= thread.chamfer < along:
        raise ThreadFault("a thread's angle is 0 to 180 degrees, and its chamfer shorter than the thread")
    if thread.height > thread.first * math.sqrt(PASSES_MAX):
        raise ThreadFault(f"the thread makes more than {PASSES_MAX} passes")
    if abs(thread.start.imag - thread.end.imag) < thread.height:
        raise ThreadFault("the tool stands below the thread's crest: between X and X plus its height")


@dataclass(frozen=True)
class Pecking:
    """The words of G74, or with x and z exchanged of G75; lengths in mm."""

    # start and end: (z, x) where the tool stands, and the bottom of the last hole or groove
    start: complex
    end: complex
    peck: float  # q, how much deeper each peck goes; inf for all at once
    shift: float  # p, from one to the next along x; inf for one to the end at once
    retract: float  # e;  relief : at the bottom, against the shift, at most the way of the shift
    relief: float = 0.0


def single_cut(start: complex, end: complex, taper: float, *, facing: bool) -> Iterator[TurningStep]:
    """The moves of G90, or with `facing` of G94 [mm]."""
    if facing:
        yield from map(exchanged, single_cut(exchanged(start), exchanged(end), taper, facing=False))
        return
    yield TurningStep(Leg(complex(start.real, end.imag + taper)), fast=True)
    yield TurningStep(Leg(end))
    yield TurningStep(Leg(complex(end.real, start.imag)))
    yield TurningStep(Leg(start), fast=True)


def single_thread(start: complex, end: complex, taper: float, lead: float) -> Iterator[Pass]:
    """The moves of G92 [mm]; `lead` is that along the longer of z and x. Raises ThreadFault."""
    begin = complex(start.real, end.imag + taper)
    along = end - begin
    if not lead > 0.0 or not abs(along.real) > SAME:
        raise ThreadFault("a thread needs a lead above 0 and room in z between where the tool stands and Z")
    yield Pass(begin)
    yield Pass(end, lead * abs(along) / max(abs(along.real), abs(along.imag)))
    yield Pass(complex(end.real, start.imag))
    yield Pass(start)


def pecked(given: Pecking, *, grooving: bool) -> Iterator[TurningStep]:
    """The moves of G74, or with `grooving` of G75 [mm]. Raises ContourFault."""
    if grooving:
        yield from map(exchanged, pecked(exchanged(given), grooving=False))
        return
    deep, wide = given.end.real - given.start.real, given.end.imag - given.start.imag
    if abs(deep) < SAME:
        raise ContourFault("the cycle needs room between where the tool stands and its bottom")
    if not given.peck > 0.0 or not given.shift > 0.0:
        raise ContourFault("the peck and the shift of the cycle must be above 0")
    if (1.0 + abs(wide) / given.shift) * (1.0 + abs(deep) / given.peck) > PASSES_MAX:
        raise ContourFault(f"the cycle makes more than {PASSES_MAX} pecks")
    if given.retract > given.peck:
        raise ContourFault(
            f"the retract of the cycle, {given.retract:g} mm, is longer than its peck, {given.peck:g} mm"
        )
    if given.relief > min(given.shift, abs(wide)):
        raise ContourFault(
            f"the relief of the cycle, {given.relief:g} mm, is longer than the way to the next cut: the tool would gouge"
        )
    down, on = math.copysign(1.0, deep), math.copysign(1.0, wide)
    for x in _stations(given.start.imag, given.end.imag, given.shift, from_start=True):
        yield TurningStep(Leg(complex(given.start.real, x)), fast=True)
        for z in _stations(given.start.real, given.end.real, given.peck, from_start=False):
            yield TurningStep(Leg(complex(z, x)))
            if z != given.end.real:
                yield TurningStep(Leg(complex(z - down * given.retract, x)), fast=True)
        away = x - on * given.relief if x != given.start.imag else x
        yield TurningStep(Leg(complex(given.end.real, away)), fast=True)
        yield TurningStep(Leg(complex(given.start.real, away)), fast=True)
    yield TurningStep(Leg(given.start), fast=True)


def _stations(begin: float, end: float, step: float, *, from_start: bool) -> Iterator[float]:
    """Places from begin to end, each `step` from the last, the last one at the end itself."""
    whole, way = abs(end - begin), math.copysign(1.0, end - begin)
    n = 0 if from_start else 1
    while n * step < whole - SAME if n else whole > SAME:
        yield begin + way * n * step
        n += 1
    yield end
