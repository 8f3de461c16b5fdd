"""The makers of rows by their names in `tree.MadeRows`; here those of frames, compensation and arcs.

Siemens: TRANS, ROT, SCALE and MIRROR replace the frame, ATRANS, AROT, ASCALE and AMIRROR add to it in the
coordinates in force. Heidenhain: cycles 7, 8, 10, 11 and 26 each set one part of

    p -> d + R D M p + (c - D c),

d the datum shift, M the mirror image, D the scale (about c), R the rotation about the datum. What depends on
their order, which is not documented, is refused. A shift alone becomes a G52; else the rows are written in
the coordinates of the work system (`travel`).
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.arcs import IN_PLANE, at_place, in_plane
from planner.nc.interpreter import Interpreter
from planner.nc.language import swivel
from planner.nc.language.approach import KINDS, Approach, Departure
from planner.nc.language.corner_moves import KINDS as CORNERS
from planner.nc.language.heidenhain import cycles as heidenhain_cycles
from planner.nc.language.heidenhain.moves import OUT_OF_PLANE
from planner.nc.language.making import ASSUMED, TAPPED, Maker, Making, Row, around
from planner.nc.language.run import ProgramRun
from planner.nc.language.siemens import cycles as siemens_cycles
from planner.nc.language.travel_rows import STANDS, turned
from planner.nc.program import Kind

AXES = "XYZ"
SIEMENS = ("TRANS", "ROT", "SCALE", "MIRROR")  # by `kind`; + ADDED for A...
ADDED = 10  # more than the indices in SIEMENS
_G63 = 63.0
_FLAT = 1e-9  # relative, below which three points are on a line


def siemens(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """TRANS and the others; `kind` is the index in SIEMENS. Raises ValueError."""
    kind = round(given["kind"])
    matrix, shift = making.travel.programmed if kind >= ADDED else (np.eye(3), np.zeros(3))
    name = SIEMENS[kind % ADDED]
    step, by = np.eye(3), np.zeros(3)
    for axis in (2, 1, 0) if name == "ROT" else (0, 1, 2):  # ROT: about Z, the new Y, the new X
        letter = AXES[axis]
        if letter not in given:
            continue
        if name == "TRANS":
            by[axis] = given[letter] * making.unit
        elif name == "ROT":
            step = step @ turned(given[letter], axis)
        elif name == "SCALE":
            if given[letter] == 0.0:
                raise ValueError("a scale of 0 makes a point of everything")
            step[axis, axis] = given[letter]
        else:
            step[axis, axis] = -1.0
    if "RPL" in given:
        step = step @ turned(given["RPL"], making.interpreter.state.normal)
    making.travel.programmed = matrix @ step, matrix @ by + shift
    return _origin(making)


def heidenhain(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """Cycles 7, 8, 10, 11, 26 by `cycle`; letters behind I are incremental. Raises ValueError."""
    parts, cycle, unit = making.travel.parts, round(given["cycle"]), making.unit
    if cycle == 7:
        datum = parts.datum.copy()
        for axis, letter in enumerate(AXES):
            if letter in given:
                datum[axis] = given[letter] * unit
            elif "I" + letter in given:
                datum[axis] += given["I" + letter] * unit
        only_shifted = (parts.mirror * parts.scale == 1.0).all() and parts.rotation % 360.0 == 0.0
        if not only_shifted and datum.any():
            raise ValueError(
                "a datum shift while a rotation, mirror image or scale is in force is not read: in whose axes it counts is "
                "not documented; define the shift first"
            )
        parts.datum = datum
    elif cycle == 8:
        parts.mirror = np.array([-1.0 if letter in given else 1.0 for letter in AXES])
    elif cycle == 10:
        parts.rotation = given["ROT"] if "ROT" in given else parts.rotation + given["IROT"]
    elif cycle == 11:
        parts.scale = np.full(3, _factor(given["SCL"]))
        parts.centre = np.zeros(3)
    else:
        parts.scale = np.array([_factor(given.get(letter, 1.0)) for letter in AXES])
        parts.centre = np.array([given.get("CC" + letter, 0.0) * unit for letter in AXES])
    making.travel.programmed = parts.affine()
    return _origin(making)


def in_force(making: Making, given: Mapping[str, float]) -> None:
    """The frame, behind the row of `siemens` or `heidenhain`."""
    matrix, shift = making.travel.programmed
    if (matrix == np.eye(3)).all() and not making.travel.tilted:
        shift = np.zeros(3)  # a G52
    if making.travel.active or (matrix != np.eye(3)).any():
        making.travel.set_frame(matrix, shift)


def _factor(given: float) -> float:
    if not given > 0.0:
        raise ValueError(f"a scaling factor is above 0; {given:g} is given")
    return given


def _origin(making: Making) -> list[Row]:
    """G52 with the shift where the frame is nothing else."""
    matrix, shift = making.travel.programmed
    if making.travel.compensated:
        text = "the frame changes while cutter radius compensation is on; switch it off before (R0, G40)"
        raise ValueError(text)
    if making.travel.tilted:
        if making.interpreter.state.g92.any():
            raise ValueError(
                "a shift in a tilted plane on top of one before the plane is not read; end the plane, or the shift, first"
            )
        return []
    only = (matrix == np.eye(3)).all()
    values = shift / making.unit if only else np.zeros(3)
    return [[("G", 52.0), *zip(AXES, values.tolist(), strict=True)]]


def compensate(making: Making, given: Mapping[str, float]) -> None:
    """Radius compensation: side 1 left, -1 right, 0 off."""
    making.travel.compensate(round(given["side"]), making.assume)


def _oversize(making: Making, given: Mapping[str, float]) -> None:
    """DR of a tool call, by which the tool's radius is larger than in its table until the next call."""
    making.travel.oversize = given["DR"] * making.unit


def _approach(making: Making, given: Mapping[str, float]) -> None:
    """APPR of a kind (index in KINDS), with X Y Z of the first contour point, LEN, R, CCA, F and side."""
    side = round(given["side"])
    first = _target(making, given) * making.unit
    found = Approach(**_way(making, given), first=first, side=side or -1, compensated=side != 0)
    found.check("APPR")
    making.travel.approach(found, making.assume)


def depart(making: Making, given: Mapping[str, float]) -> None:
    """DEP of a kind (index in KINDS), with X Y Z, LEN, R, CCA and F."""
    found = Departure(**_way(making, given), end=_target(making, given) * making.unit, raised="Z" in given)
    found.check("DEP")
    if found.kind == "LCT" and not {"X", "Y"} & set(given):
        raise ValueError("DEP LCT needs its end as X and Y")
    making.travel.depart(found)


def _way(making: Making, given: Mapping[str, float]) -> dict[str, Any]:
    return {
        "kind": KINDS[round(given["kind"])],
        "line": making.place.line,
        "at": making.place.at,
        "frame": making.frame,
        "length": given.get("LEN", 0.0) * making.unit,
        "radius": given.get("R", 0.0) * making.unit,
        "angle": given.get("CCA", 0.0),
        "feed": given.get("F"),
    }


def corner(making: Making, given: Mapping[str, float]) -> None:
    """A rounding or chamfer at the end of the next move: kind (index in corner_moves.KINDS) and size."""
    if given["size"] < 0.0:
        raise ValueError("a rounding or chamfer is not negative")
    kind, size = CORNERS[round(given["kind"])], given["size"] * making.unit
    making.travel.corner(kind, size, making.place.line, modal="modal" in given)


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


def _target(making: Making, given: Mapping[str, float]) -> FloatArray:
    """(3,) coordinates in the program's unit, where the command leads."""
    end = np.array(making.here())
    for axis, letter in enumerate("XYZ"):
        end[axis] = given.get(letter, end[axis])
    return end


def _arc_row(making: Making, given: Mapping[str, float], centre: complex, left: bool) -> list[Row]:
    normal, here = making.interpreter.state.normal, np.array(making.here())
    to = at_place(centre, here, normal) - here
    row: Row = [("G", 3.0 if left else 2.0)]
    row += [(letter, given[letter]) for letter in "F" if letter in given]
    end = _target(making, given)
    row += [("XYZ"[a], float(end[a])) for a in range(3)]
    return [[("G", 90.0)], [*row, *(("IJK"[a], float(to[a])) for a in IN_PLANE[normal])]]


def tangent_arc(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """CT: the arc to X Y Z that goes on in the direction of the last move. Raises ValueError."""
    normal = making.interpreter.state.normal
    t, here = _direction(making), in_plane(np.array(making.here()), normal)
    v = in_plane(_target(making, given), normal) - here
    left = 1j * t
    along = 2.0 * (v.conjugate() * left).real
    if abs(along) <= _FLAT * abs(v):
        raise ValueError("the end of CT lies straight ahead or behind: that is no arc; write G1")
    radius = abs(v) ** 2 / along
    yield from _back(making, _arc_row(making, given, here + radius * left, radius > 0))


def arc_through(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """CIP: the arc to X Y Z through X1 Y1 Z1. Raises ValueError."""
    normal, start, end = making.interpreter.state.normal, np.array(making.here()), _target(making, given)
    middle = np.array([given.get(f"{letter}1", start[k]) for k, letter in enumerate("XYZ")])
    if abs(middle[normal] - start[normal]) > _FLAT or abs(end[normal] - start[normal]) > _FLAT:
        raise ValueError("a CIP out of its plane (G17, G18, G19) is not read; write it with lines")
    a, b, c = (in_plane(point, normal) for point in (start, middle, end))
    turn = ((b - a).conjugate() * (c - a)).imag
    if abs(turn) <= _FLAT * max(abs(b - a), abs(c - a)) ** 2:
        raise ValueError("the three points of CIP lie on a line: that is no arc; write G1")
    u, w = b - a, c - a
    centre = a + (abs(u) ** 2 * w - abs(w) ** 2 * u) * 1j / (2.0 * (u.conjugate() * w).imag) * -1.0
    yield from _back(making, _arc_row(making, given, centre, turn > 0))


def _back(making: Making, rows: list[Row]) -> list[Row]:
    absolute = making.travel.absolute if making.travel.active else making.interpreter.state.absolute
    return rows[1:] if absolute else [*rows, [("G", 91.0)]]


def _alarm(making: Making, given: Mapping[str, float]) -> None:
    raise ValueError("the program raises its error (FN 14) here; run it with values that do not lead there")


def _dwell_turns(making: Making, given: Mapping[str, float]) -> list[Row]:
    """A dwell of so many turns of the spindle. Raises ValueError where it stands."""
    speed = making.interpreter.state.spindle.speed
    if not speed > 0.0:
        raise ValueError("G4 S, a dwell in turns of the spindle, needs the spindle's speed S before it")
    return [[("G", 4.0), ("P", given["turns"] / speed * SECONDS_PER_MINUTE)]]


def _tap_path(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """G331 and G332, in and out at lead times speed, and G63, at F: a straight move between full stops."""
    state = making.interpreter.state
    speed = given.get("S", state.spindle.speed)
    feed = given.get("F", state.feed * SECONDS_PER_MINUTE / making.unit)
    if given["code"] != _G63:
        feed = abs(given["lead"]) * speed
    if not feed > 0.0:
        raise ValueError("tapping by G331 needs the lead (K) and the speed S, G63 its F")
    making.assume(TAPPED)
    ends = [(axis, given[axis]) for axis in AXES if axis in given]
    stop: Row = [("G", 4.0), ("P", 0.0)]
    turn: list[Row] = [[("S", speed)]] if "S" in given else []
    yield from around(making, [*turn, stop, [("G", 1.0), ("F", feed), *ends], stop], feed=True)


def _assume(making: Making, given: Mapping[str, float]) -> None:
    """Sentences of ASSUMED by their names. Raises ValueError where nothing may be assumed."""
    for name in given:
        making.assume(ASSUMED[name])


def out_of_plane(making: Making, given: Mapping[str, float]) -> None:
    """A coordinate that the plane of the pole in force does not allow. Raises ValueError."""
    raise ValueError(f"a coordinate that lies {OUT_OF_PLANE}")


MAKERS: dict[str, Maker] = {
    "compensate": compensate,
    "oversize": _oversize,
    "approach": _approach,
    "depart": depart,
    "siemens frame": siemens,
    "heidenhain frame": heidenhain,
    "out of plane": out_of_plane,
    "assume": _assume,
    **siemens_cycles.MAKERS,
    **heidenhain_cycles.MAKERS,
    "corner": corner,
    "dwell turns": _dwell_turns,
    "tap path": _tap_path,
    "swivel": swivel.siemens,
    "plane": swivel.heidenhain,
    "alarm": _alarm,
    "tangent arc": tangent_arc,
    "arc through": arc_through,
    "frame in force": in_force,
}


def with_makers(run: ProgramRun) -> None:
    """Programs of Heidenhain and Siemens have these makers."""
    run.makers = MAKERS
