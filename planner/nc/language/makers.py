"""Makers of rows of several dialects: frames, compensation, approach and departure, arcs, taps.

Siemens: TRANS, ROT, SCALE and MIRROR replace the frame, ATRANS, AROT, ASCALE and AMIRROR add to it in the
coordinates in force. Heidenhain: cycles 7, 8, 10, 11 and 26 each set one part of

    p -> d + R D M p + (c - D c),

d the datum shift, M the mirror image, D the scale (about c), R the rotation about the datum. What depends on
their order, which is not documented, is refused. A shift alone becomes a G52; else the rows are written in
the coordinates of the work system (`travel`).
"""

import math
from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc import arcs
from planner.nc.arcs import IN_PLANE, at_place, in_plane
from planner.nc.interpreter import Interpreter
from planner.nc.language.making import TAPPED, Given, Maker, Making, Row, around
from planner.nc.language.rows import STANDS, F, TravelRow, require, turned
from planner.nc.language.travel import FRAME_CHANGES, ContourWay
from planner.nc.language.tree import Expression, MadeRows, SourcePlace, made
from planner.nc.program import Kind

AXES = "XYZ"
FRAMES = ("TRANS", "ROT", "SCALE", "MIRROR")  # of Siemens, with A before them where they add
_G63 = 63.0
_FLAT = 1e-9  # relative, below which three points are on a line


def siemens_frame(making: Making, given: Given, *, name: str) -> Iterator[Row]:
    """TRANS and the others. Raises ValueError."""
    adds, kind = name not in FRAMES, name.removeprefix("A")
    matrix, shift = making.travel.programmed if adds else (np.eye(3), np.zeros(3))
    step, by = np.eye(3), np.zeros(3)
    for axis in (2, 1, 0) if kind == "ROT" else (0, 1, 2):  # ROT: about Z, the new Y, the new X
        letter = AXES[axis]
        if letter not in given:
            continue
        if kind == "TRANS":
            by[axis] = given[letter] * making.unit
        elif kind == "ROT":
            step = step @ turned(given[letter], axis)
        elif kind == "SCALE":
            require(given[letter] != 0.0, "a scale of 0 makes a point of everything")
            step[axis, axis] = given[letter]
        else:
            step[axis, axis] = -1.0
    if "RPL" in given:
        step = step @ turned(given["RPL"], making.interpreter.state.normal)
    making.travel.programmed = matrix @ step, matrix @ by + shift
    return _in_force(making)


def heidenhain_frame(making: Making, given: Given, *, cycle: int) -> Iterator[Row]:
    """Cycles 7, 8, 10, 11, 26; letters behind I are incremental. Raises ValueError."""
    parts, unit = making.travel.parts, making.unit
    if cycle == 7:
        datum = parts.datum.copy()
        for axis, letter in enumerate(AXES):
            if letter in given:
                datum[axis] = given[letter] * unit
            elif "I" + letter in given:
                datum[axis] += given["I" + letter] * unit
        only_shifted = (parts.mirror * parts.scale == 1.0).all() and parts.rotation % 360.0 == 0.0
        if not only_shifted and datum.any():
            what = "a datum shift while a rotation, mirror image or scale is in force is not read"
            raise ValueError(f"{what}: in whose axes it counts is not documented; define the shift first")
        parts.datum = datum
    elif cycle == 8:
        parts.mirror = np.array([-1.0 if letter in given else 1.0 for letter in AXES])
    elif cycle == 10:
        parts.rotation = given["ROT"] if "ROT" in given else parts.rotation + given["IROT"]
    else:
        factors = [given.get("SCL", given.get(letter, 1.0)) for letter in AXES]
        if wrong := [factor for factor in factors if not factor > 0.0]:
            raise ValueError(f"a scaling factor is above 0; {wrong[0]:g} is given")
        parts.scale = np.array(factors)
        parts.centre = np.array([given.get("CC" + letter, 0.0) * unit for letter in AXES])
    uneven = len({*np.abs(parts.scale)}) > 1
    if parts.rotation % 360.0 and (uneven or (parts.mirror != 1.0).any()):
        what = "a rotation (cycle 10) together with a mirror image (8) or a scale of single axes (26) is not read"
        why = "which acts first is not documented; let the CAM system write the moves out"
        raise ValueError(f"{what}: {why}")
    making.travel.programmed = parts.affine()
    return _in_force(making)


def _in_force(making: Making) -> Iterator[Row]:
    """The programmed frame holds from here on; G52 where it is a shift alone. Raises ValueError."""
    matrix, shift = making.travel.programmed
    require(not making.travel.compensated, FRAME_CHANGES)
    if not making.travel.tilted:
        values = shift / making.unit if (matrix == np.eye(3)).all() else np.zeros(3)
        yield [("G", 52.0), *zip(AXES, values.tolist(), strict=True)]
        making.flush()
    elif making.interpreter.state.g92.any():
        what = "a shift in a tilted plane on top of one before the plane"
        raise ValueError(f"{what} is not read; end the plane, or the shift, first")
    set_frame(making)


def set_frame(making: Making) -> None:
    """The programmed frame holds for the rows that follow, without a shift alone, which is a G52."""
    matrix, shift = making.travel.programmed
    only = bool((matrix == np.eye(3)).all())
    if making.travel.active or not only:
        making.travel.set_frame(matrix, np.zeros(3) if only and not making.travel.tilted else shift)


def compensate(making: Making, given: Given) -> None:
    """Radius compensation: side 1 left, -1 right, 0 off."""
    making.travel.compensate(round(given["side"]), making.assume)


def approach(making: Making, given: Given, *, kind: str, side: int) -> None:
    """APPR of a kind, with X Y Z of the first contour point, LEN, R, CCA and F."""
    making.travel.approach(_way(making, given, "APPR", kind), _target(making, given), side, making.assume)


def depart(making: Making, given: Given, *, kind: str) -> None:
    """DEP of a kind, with X Y Z, LEN, R, CCA and F."""
    way = _way(making, given, "DEP", kind)
    require(kind != "LCT" or {"X", "Y"} & set(given), "DEP LCT needs its end as X and Y")
    making.travel.depart(way, _target(making, given), raised="Z" in given)


def _way(making: Making, given: Given, name: str, kind: str) -> ContourWay:
    scale = making.travel.scale()
    words = [(F, given["F"], making.place.at)] if "F" in given else []
    row, angle = TravelRow(words, making.place.line, making.frame), given.get("CCA", 0.0)
    length, radius = (given.get(word, 0.0) * making.unit * scale for word in ("LEN", "R"))
    return ContourWay(name, kind, row, making.place.at, length, radius, angle)


def corner(
    place: SourcePlace, kind: str, size: Expression, *, modal: bool = False, feed: Expression | None = None
) -> MadeRows:
    """The statement of a rounding or chamfer (corner_moves.KINDS) at the end of the next move, with its `feed`."""
    fed = {} if feed is None else {"F": feed}
    return made(place, partial(_corner, kind=kind, modal=modal), size=size, **fed)


def _corner(making: Making, given: Given, *, kind: str, modal: bool) -> None:
    require(given["size"] >= 0.0, "a rounding or chamfer is not negative")
    size, feed = given["size"] * making.unit, given.get("F")
    making.travel.corner(kind, size, making.place.line, modal=modal, feed=feed)


def _direction(making: Making) -> complex:
    """Unit tangent at the end of the last move in the program's plane. Raises ValueError for none."""
    travel, normal = making.travel, making.interpreter.state.normal
    last = travel.last if travel.active else None
    way = _executed(making.interpreter, normal) if last is None else last.leaving(normal)
    back = travel.unmapped(at_place(way, np.zeros(3), normal) + travel.shift)
    found = in_plane(back, normal)
    if abs(found) == 0.0 or travel.lost:
        raise ValueError("CT goes on in the direction of the move before it, and there is none in the plane")
    return found / abs(found)


def _executed(interpreter: Interpreter, normal: int) -> complex:
    """Tangent at the end of the last move in the plane that was executed, of any length; 0 for none."""
    table = interpreter.table
    arcs = {block: (centre, about, sweep) for block, centre, about, sweep in table.arcs}
    for k in range(table.blocks - 1, -1, -1):
        end = in_plane(table.block.end[k], normal)
        way = end - (in_plane(table.block.end[k - 1], normal) if k else 0j)
        if k in arcs:
            centre, about, sweep = arcs[k]
            return (end - in_plane(centre, normal)) * (1j if sweep > 0 else -1j) * (about == normal)
        if table.block.kind[k] == Kind.SPLINE or abs(way) > STANDS:
            return way * (table.block.kind[k] != Kind.SPLINE)
    return 0j


def _target(making: Making, given: Given) -> FloatArray:
    """(3,) where the command leads [mm], in the program's coordinates."""
    here = zip(AXES, making.here(), strict=True)
    return np.array([given.get(letter, at) for letter, at in here]) * making.unit


def _arc(making: Making, given: Given, centre: complex, left: bool) -> list[Row]:
    """The row of an arc about a centre in the plane [programmed units], counter-clockwise or not (`left`)."""
    normal, here = making.interpreter.state.normal, np.array(making.here())
    to = at_place(centre, here, normal) - here
    row: Row = [("G", 3.0 if left else 2.0), *((letter, given[letter]) for letter in "F" if letter in given)]
    row += [(letter, given.get(letter, float(at))) for letter, at in zip(AXES, here, strict=True)]
    row = [(letter, value * (making.per_radius if letter == "X" else 1.0)) for letter, value in row]
    row += [("IJK"[a], float(to[a])) for a in IN_PLANE[normal]]
    return [row] if making.absolute else [[("G", 90.0)], row, [("G", 91.0)]]


def _in_its_plane(making: Making, given: Given, behind: str = "") -> complex:
    """The point in the plane of X Y Z, or of these with something `behind` them [programmed units]."""
    here = zip(AXES, making.here(), strict=True)
    point = np.array([given.get(letter + behind, at) for letter, at in here])
    return in_plane(point, making.interpreter.state.normal)


def tangent_arc(making: Making, given: Given) -> Iterable[Row]:
    """CT: the arc to X Y Z that goes on in the direction of the last move. Raises ValueError."""
    normal, given = making.interpreter.state.normal, making.as_radii(given)
    left, here = 1j * _direction(making), in_plane(np.array(making.here()), normal)
    way = _in_its_plane(making, given) - here
    along = 2.0 * (way.conjugate() * left).real
    if abs(along) <= _FLAT * abs(way):
        raise ValueError("the end of CT lies straight ahead or behind: that is no arc; write G1")
    radius = abs(way) ** 2 / along
    return _arc(making, given, here + radius * left, radius > 0)


def arc_through(making: Making, given: Given) -> Iterable[Row]:
    """CIP: the arc to X Y Z through X1 Y1 Z1. Raises ValueError."""
    axis, given = AXES[making.interpreter.state.normal], making.as_radii(given)
    level = making.here()[AXES.index(axis)]
    if any(abs(given.get(letter, level) - level) > _FLAT for letter in (axis, axis + "1")):
        raise ValueError("a CIP out of its plane (G17, G18, G19) is not read; write it with lines")
    here = in_plane(np.array(making.here()), making.interpreter.state.normal)
    end = _in_its_plane(making, given)
    found = arcs.arc_through(here, _in_its_plane(making, given, "1"), end)
    if found is None or end == here:
        raise ValueError("the three points of CIP lie on a line: that is no arc; write G1")
    return _arc(making, given, found[0], found[1] > 0)


def dwell_turns(making: Making, given: Given) -> list[Row]:
    """A dwell of so many turns of the spindle. Raises ValueError where it stands."""
    speed = making.interpreter.state.spindle.speed
    require(speed > 0.0, "G4 S, a dwell in turns of the spindle, needs the spindle's speed S before it")
    return [[("G", 4.0), ("P", given["turns"] / speed * SECONDS_PER_MINUTE)]]


def tap_path(making: Making, given: Given, *, code: float) -> Iterator[Row]:
    """G331 and G332, in and out at lead times speed, and G63, at F: a straight move between full stops."""
    state = making.interpreter.state
    speed = given.get("S", state.spindle.speed)
    feed = given.get("F", state.word_feed)
    if code != _G63:
        feed = abs(given["lead"]) * speed
    require(feed > 0.0, "tapping by G331 needs the lead (K) and the speed S, G63 its F")
    making.assume(TAPPED)
    ends = [(axis, given[axis]) for axis in AXES if axis in given]
    stop: Row = [("G", 4.0), ("P", 0.0)]
    turn: list[Row] = [[("S", speed)]] if "S" in given else []
    return around(making, [*turn, stop, [("G", 1.0), ("F", feed), *ends], stop], feed=True)


def threaded(making: Making, given: Given) -> list[Row]:
    """G33 to absolute X, Y, Z, its lead K along the axis that moves most, as on Fanuc's controls and a Sinumerik: the
    pitch of LinuxCNC's G33 is along the cut."""
    to, here = making.as_radii(given), zip(AXES, making.here(), strict=True)
    ways = [to[axis] - at for axis, at in here if axis in to]
    longest = max(map(abs, ways), default=0.0)
    pitch = given["K"] * (math.hypot(*ways) / longest if longest else 1.0)
    row: Row = [("G", 33.0), *((axis, given[axis]) for axis in AXES if axis in given), ("K", pitch)]
    return [row] if making.absolute else [[("G", 90.0)], row, [("G", 91.0)]]


def refuse(message: str) -> Maker:
    """A maker that raises ValueError with a message."""

    def maker(making: Making, given: Given) -> None:
        raise ValueError(message)

    return maker
