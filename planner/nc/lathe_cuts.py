"""Cycles of single cuts on Fanuc and Haas lathes, G90 G92 G94, those that peck, G74 G75, and the threading
cycle G76: from their words to moves.

Points are complex numbers, z + i x in radii [mm]; the tool stands at S, the words give E = (Z, X) and a taper
r along x (in G94 z).

    G90    fast in x to x_E + r, cut to E, cut in x back to x_S, fast back to S; G92 the same as a thread; G94 with x and z exchanged
    G74    pecks along z from z_S to z_E, each q deeper than the last and drawn back by e; at the bottom, but not of the first one, away
           by the relief against the shift; fast back to z_S, and the same p further in x until x_E; then fast
           back to S; G75 the same with x and z exchanged

With s = sign(x_S - x_E) and t = sign(z_E - z_S) a pass of G76 of depth c below the crest, x_E + s k, cuts at
x_E + s (k - c), from z_S + t c tan(a / 2): with the angle a of the tool it advances along the flank. A taper
i moves the beginning of the cut by i; a chamfer of length g leaves the thread at 45 degrees before z_E. The
depths are

    c_n = max(d sqrt(n), c_(n-1) + d_min)  while below k - r,    then k - r, then k, as often as the cycle says

Sources: the formats of Fanuc's lathes (series 0i-T) and of Haas (haascnc.com) as they are known; the order of
the moves of G75, and that the first groove has no relief: the programming manual of ADTECH's CNC4620, page
55.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from planner.nc.turning import PASSES_MAX, SAME, Leg


@dataclass(frozen=True)
class LatheThread:
    """A thread; lengths in mm, x as radii."""

    start: complex  # (z, x) where the tool stands
    end: complex  # (z, x) of the root at the thread's end
    height: float  # k, from the crest to the root
    first: float  # d
    lead: float  # of a turn, along the longer of z and x
    least: float = 0.0  # d_min
    finish: float = 0.0  # r
    springs: int = 1  # how often the full depth is cut
    angle: float = 0.0  # of the tool [degrees]
    taper: float = 0.0  # i, x at the beginning less x at the end
    chamfer: float = 0.0  # g


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


def thread_passes(thread: LatheThread) -> Iterator[Leg]:
    """The moves of the cycle, from its start and back to it. Raises ValueError."""
    _require(thread)
    start, end = thread.start, thread.end
    out, ahead = math.copysign(1.0, start.imag - end.imag), math.copysign(1.0, end.real - start.real)
    slope = math.tan(math.radians(thread.angle / 2.0))
    for depth in lathe_depths(thread):
        begin = start.real + ahead * depth * slope
        low = end.imag + out * (thread.height - depth)
        cut, leave = complex(begin, low + thread.taper), complex(end.real, low)
        along = leave - cut
        pitch = thread.lead * abs(along) / max(abs(along.real), abs(along.imag))
        yield Leg(complex(begin, start.imag), fast=True)
        yield Leg(cut, fast=True)
        if thread.chamfer > 0.0:
            leave -= along * (thread.chamfer / abs(along.real))
            yield Leg(leave, pitch=pitch)
            leave += complex(ahead, out) * thread.chamfer
            yield Leg(leave, pitch=thread.lead * math.sqrt(2.0))
        else:
            yield Leg(leave, pitch=pitch)
        yield Leg(complex(leave.real, start.imag), fast=True)
    yield Leg(start, fast=True)


def _require(thread: LatheThread) -> None:
    along, across = abs(thread.end.real - thread.start.real), abs(thread.end.imag - thread.start.imag)
    first, finish, height = thread.first, thread.finish, thread.height
    depths, angle = "the first depth and the finishing allowance of a thread", thread.angle
    shape = 0.0 <= angle < 180.0 and 0.0 <= thread.chamfer < along
    cut = thread.lead > 0.0 and 1 <= thread.springs <= PASSES_MAX
    for right, wrong in (
        (along and across, "a thread needs room in x and z between where the tool stands and X Z"),
        (0.0 < first <= height and 0.0 <= finish < height, f"{depths} lie between 0 and its height"),
        (not finish or first + finish <= height * (1.0 + 1e-12), f"{depths} are more than its height"),
        (cut, "a thread needs a lead above 0 and at least one pass at its full depth"),
        (shape, "a thread's angle is 0 to 180 degrees, and its chamfer shorter than the thread"),
        (height <= first * math.sqrt(PASSES_MAX), f"the thread makes more than {PASSES_MAX} passes"),
        (across >= height, "the tool stands below the thread's crest: between X and X plus its height"),
    ):
        if not right:
            raise ValueError(f"G76: {wrong}")


@dataclass(frozen=True)
class Pecking:
    """The words of G74, or with x and z exchanged of G75; lengths in mm."""

    start: complex  # (z, x) where the tool stands
    end: complex  # (z, x) of the bottom of the last hole or groove
    peck: float  # q, how much deeper each peck goes; inf for all at once
    shift: float  # p, from one to the next along x; inf for one to the end at once
    retract: float  # e
    relief: float = 0.0  # at the bottom, against the shift, at most the way of the shift


def single_cut(start: complex, end: complex, taper: float, pitch: float = 0.0) -> Iterator[Leg]:
    """The moves of G90, and of G92 with a pitch along the cut [mm]; those of G94 with x and z exchanged."""
    yield Leg(complex(start.real, end.imag + taper), fast=True)
    yield Leg(end, pitch=pitch)
    yield Leg(complex(end.real, start.imag), fast=pitch > 0.0)
    yield Leg(start, fast=True)


def single_thread(start: complex, end: complex, taper: float, lead: float) -> Iterator[Leg]:
    """The moves of G92 [mm]; `lead` is that along the longer of z and x. Raises ValueError."""
    along = end - complex(start.real, end.imag + taper)
    if not lead > 0.0 or not abs(along.real) > SAME:
        room = "room in z between where the tool stands and Z"
        raise ValueError(f"G92: a thread needs a lead above 0 and {room}")
    return single_cut(start, end, taper, lead * abs(along) / max(abs(along.real), abs(along.imag)))


def pecked(given: Pecking) -> Iterator[Leg]:
    """The moves of G74 [mm]; those of G75 with x and z exchanged. Raises ValueError."""
    deep, wide = given.end.real - given.start.real, given.end.imag - given.start.imag
    retract, peck, relief = given.retract, given.peck, given.relief
    if abs(deep) < SAME:
        raise ValueError("the cycle needs room between where the tool stands and its bottom")
    if not peck > 0.0 or not given.shift > 0.0:
        raise ValueError("the peck and the shift of the cycle must be above 0")
    if (1.0 + abs(wide) / given.shift) * (1.0 + abs(deep) / peck) > PASSES_MAX:
        raise ValueError(f"the cycle makes more than {PASSES_MAX} pecks")
    if retract > peck:
        raise ValueError(f"the retract of the cycle, {retract:g} mm, is longer than its peck, {peck:g} mm")
    if relief > min(given.shift, abs(wide)):
        long = f"the relief of the cycle, {relief:g} mm, is longer than the way to the next cut"
        raise ValueError(f"{long}: the tool would gouge")
    down, on = math.copysign(1.0, deep), math.copysign(1.0, wide)
    for x in _stations(given.start.imag, given.end.imag, given.shift, from_start=True):
        yield Leg(complex(given.start.real, x), fast=True)
        for z in _stations(given.start.real, given.end.real, given.peck, from_start=False):
            yield Leg(complex(z, x))
            if z != given.end.real:
                yield Leg(complex(z - down * given.retract, x), fast=True)
        away = x - on * given.relief if x != given.start.imag else x
        yield Leg(complex(given.end.real, away), fast=True)
        yield Leg(complex(given.start.real, away), fast=True)
    yield Leg(given.start, fast=True)


def _stations(begin: float, end: float, step: float, *, from_start: bool) -> Iterator[float]:
    """Places from begin to end, each `step` from the last, the last one at the end itself."""
    whole, way = abs(end - begin), math.copysign(1.0, end - begin)
    n = 0 if from_start else 1
    while n * step < whole - SAME if n else whole > SAME:
        yield begin + way * n * step
        n += 1
    yield end
