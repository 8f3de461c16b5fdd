"""Programmed frames: shifts, rotations, mirror images and scales.

Siemens: TRANS, ROT, SCALE and MIRROR replace the frame, ATRANS, AROT, ASCALE and AMIRROR add to it in the coordinates in force,

    p -> A (B p + b) + t      from      p -> A p + t.

Heidenhain: cycles 7, 8, 10, 11 and 26 each set one part of

    p -> d + R D M p + (c - D c),

d the datum shift, M the mirror image, D the scale (about c), R the rotation about the datum. In which order the parts act is not
documented in what could be read; what depends on it is refused: a mirror image or a scale of single axes together with a rotation,
and a datum shift (other than back to 0) while one of the others is in force.

Where the frame is a shift alone it becomes a G52; else the rows are written in the coordinates of the work system (`travel`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from planner.nc.language.coordinates import turned
from planner.nc.language.making import Making, Row

AXES = "XYZ"
SIEMENS = ("TRANS", "ROT", "SCALE", "MIRROR")  # by `kind`; + ADDED for A...
ADDED = 10  # more than the indices in SIEMENS


def siemens(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """TRANS and the others; `kind` is the index in SIEMENS. Raises ValueError for turns out of the plane."""
    kind = round(given["kind"])
    matrix, shift = making.travel.programmed if kind >= ADDED else (np.eye(3), np.zeros(3))
    name = SIEMENS[kind % ADDED]
    own, by = np.eye(3), np.zeros(3)
    for axis, letter in enumerate(AXES):
        if letter not in given:
            continue
        if name == "TRANS":
            by[axis] = given[letter] * making.unit
        elif name == "ROT":
            if axis != making.interpreter.state.normal and given[letter] % 360.0:
                raise ValueError(
                    f"a rotation about {letter} tilts the plane; axes that turn are not planned here, and a tilted plane needs them"
                )
            own = own @ turned(given[letter], axis)
        elif name == "SCALE":
            if given[letter] == 0.0:
                raise ValueError("a scale of 0 makes a point of everything")
            own[axis, axis] = given[letter]
        else:
            own[axis, axis] = -1.0
    if "RPL" in given:
        own = own @ turned(given["RPL"], making.interpreter.state.normal)
    making.travel.programmed = matrix @ own, matrix @ by + shift
    return _origin(making)


def heidenhain(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """Cycles 7, 8, 10, 11 and 26; `cycle` is the number. Letters behind I are incremental. Raises ValueError."""
    parts, cycle, unit = making.travel.parts, round(given["cycle"]), making.unit
    if cycle == 7:
        datum = parts.datum.copy()
        for axis, letter in enumerate(AXES):
            if letter in given:
                datum[axis] = given[letter] * unit
            elif "I" + letter in given:
                datum[axis] += given["I" + letter] * unit
        if not parts.only_shifted and datum.any():
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


def in_force(making: Making, given: Mapping[str, float]) -> Iterable[Row]:
    """The frame, behind the row of `siemens` or `heidenhain`."""
    matrix, shift = making.travel.programmed
    if (matrix == np.eye(3)).all():
        shift = np.zeros(3)  # a G52
    if making.travel.active or (matrix != np.eye(3)).any():
        making.travel.set_frame(matrix, shift)
    return []


def _factor(given: float) -> float:
    if not given > 0.0:
        raise ValueError(f"a scaling factor is above 0; {given:g} is given")
    return given


def _origin(making: Making) -> list[Row]:
    """G52 with the shift where the frame is nothing else."""
    matrix, shift = making.travel.programmed
    if making.travel.compensated:
        raise ValueError(
            "the frame changes while cutter radius compensation is on; switch it off before (R0, G40)"
        )
    only = (matrix == np.eye(3)).all()
    values = shift / making.unit if only else np.zeros(3)
    return [[("G", 52.0), *zip(AXES, values.tolist(), strict=True)]]
