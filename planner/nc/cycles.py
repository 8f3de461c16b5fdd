"""Canned cycles for holes, G73, G74 and G81 to G89: from the words of a hole to its moves, as LinuxCNC has them.

A cycle works along the normal of the plane (z in G17). The words are, with coordinates as those of G90 or, in G91, from the level
before the series of cycles (R), from R (the depth) and from the depth (K):

    X Y Z   the hole and its depth           R   where the feed begins        L   how many holes, one increment apart in G91
    Q       depth of a peck (G73, G83)       P   dwell [s]                    I J K   offset and counterbore of G87

They stay in force while the same code does. The tool goes to the hole at the height where it is if that is above R, else at the one it
will retract to; then fast to R, makes the hole, and retracts to R (G99) or to the level before the series (G98), if that is higher.

    G81 drill            feed down
    G82 spot             feed down, dwell
    G73, G83 peck        feed down Q by Q; between pecks up by `CLEARANCE` (G73), or to R and back to `CLEARANCE` above the last depth
    G74, G84 tap         feed down, dwell, spindle the other way, feed up
    G85, G89 bore        feed down, (G89: dwell,) feed up
    G86 bore             feed down, dwell, spindle stop
    G87 back bore        beside the hole down, into it, feed up to K and down again, beside it out
    G88 bore             feed down, dwell, full stop: the operator retracts, and the plan has a rapid for it
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from planner.base.units import MM_PER_INCH
from planner.nc.program import Kind

CLEARANCE = 0.01 * MM_PER_INCH  # between pecks [mm]: a hundredth of an inch, as LinuxCNC has it

DWELLING = frozenset((820, 860, 880, 890))  # cycles that need P
PECKING = frozenset((730, 830))  # cycles that need Q
TAPPING = {740: -1, 840: 1}  # how the spindle must turn
STOPPING = frozenset((860, 870, 880))  # cycles that stop the spindle, which must turn


@dataclass(frozen=True)
class Hole:
    """A hole in programmed coordinates and units: in the plane (a, b), along its normal c. (Pecks are counted in programmed units, so
    that decimal fractions of an inch add up as they do in the control.)

    code    : tenths of the G code
    place   : (a, b)
    bottom  : c of its depth
    clear   : c of R
    retract : c after it
    peck    : Q;  dwell : P [s]
    beside  : (a, b) offset of G87;  counterbore : c of its K
    turning : of the spindle, 1 or -1
    unit    : of length [mm]
    """

    code: int
    place: tuple[float, float]
    bottom: float
    clear: float
    retract: float
    peck: float = 0.0
    dwell: float = 0.0
    beside: tuple[float, float] = (0.0, 0.0)
    counterbore: float = 0.0
    turning: int = 1
    unit: float = 1.0


@dataclass(frozen=True)
class CycleStep:
    """One thing a cycle does: a move to (a, b, c), a dwell of so many seconds, a stop, or a spindle code (3, 4, 5)."""

    kind: Kind | None
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seconds: float = 0.0
    spindle: int = 0


def steps(hole: Hole) -> Iterator[CycleStep]:
    """What is done from above the hole at R on."""
    a, b = hole.place
    down, up = CycleStep(Kind.LINE, (a, b, hole.bottom)), CycleStep(Kind.RAPID, (a, b, hole.retract))
    dwell, stop = CycleStep(Kind.DWELL, seconds=hole.dwell), CycleStep(None, spindle=5)
    again = CycleStep(None, spindle=3 if hole.turning > 0 else 4)
    if hole.code in PECKING:
        yield from _pecks(hole)
        yield from (down, up)
    elif hole.code in TAPPING:
        other = CycleStep(None, spindle=4 if hole.turning > 0 else 3)
        yield from (down, stop, other, dwell, CycleStep(Kind.LINE, (a, b, hole.retract)), stop, again)
    elif hole.code == 850:
        yield from (down, CycleStep(Kind.LINE, (a, b, hole.clear)), up)
    elif hole.code == 890:
        yield from (down, dwell, CycleStep(Kind.LINE, (a, b, hole.retract)))
    elif hole.code == 870:
        yield from _back_bore(hole, stop, again)
    elif hole.code in (860, 880):
        halt = (CycleStep(Kind.STOP),) if hole.code == 880 else ()
        yield from (down, dwell, stop, *halt, up, again)
    elif hole.code == 820:
        yield from (down, dwell, up)
    else:
        yield from (down, up)


def _pecks(hole: Hole) -> Iterator[CycleStep]:
    """Everything before the last feed down."""
    a, b = hole.place
    depth = hole.clear - hole.peck
    while depth > hole.bottom:
        yield CycleStep(Kind.LINE, (a, b, depth))
        if hole.code == 830:
            yield CycleStep(Kind.RAPID, (a, b, hole.clear))
        yield CycleStep(Kind.RAPID, (a, b, depth + CLEARANCE / hole.unit))
        depth -= hole.peck


def _back_bore(hole: Hole, stop: CycleStep, again: CycleStep) -> Iterator[CycleStep]:
    (a, b), c = hole.place, hole.bottom
    aside = a + hole.beside[0], b + hole.beside[1]
    yield CycleStep(Kind.RAPID, (*aside, hole.clear))
    yield from (stop, CycleStep(Kind.RAPID, (*aside, c)), CycleStep(Kind.RAPID, (a, b, c)), again)
    yield from (CycleStep(Kind.LINE, (a, b, hole.counterbore)), CycleStep(Kind.LINE, (a, b, c)), stop)
    yield from (CycleStep(Kind.RAPID, (*aside, c)), CycleStep(Kind.RAPID, (*aside, hole.retract)))
    yield from (CycleStep(Kind.RAPID, (a, b, hole.retract)), again)
