"""Where a program goes, block by block, and whether the axes reach it: the travel of a machine file.

Travel counts in machine coordinates. Where the machine file has no G54 they are not known, but on the controls
of printers, which have none: then only what no G54 can help is a fault, a program longer than the travel.
"""

import re

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.units import RAD_PER_DEG
from planner.machine import LINEAR_AXES, ROTARY_AXES, Machine
from planner.machine.kinematics.chain import kinematics_of
from planner.nc.arcs import IN_PLANE
from planner.nc.bezier import at, homogeneous, lengths
from planner.nc.faults import Fault
from planner.nc.offsets import NO_G54
from planner.nc.program import Program

SPLINE_PLACES = 513  # on a piece of a spline, at which its extent is looked at: good to 5e-7 of its size
PIECES_AT_ONCE = 1000  # of splines: 12 MB for three axes
TIP_PLACES = 9  # of a block of the tool's tip at which the joints are looked at
NO_OFFSETS = ("klipper", "marlin", "reprapfirmware")  # controls whose programs are in machine coordinates
_COMMENT = re.compile(rb"\(.*?\)|;.*")
_SETS = re.compile(rb"G0*(?:10|52)(?!\d)", re.IGNORECASE)  # offsets: their words are no places of the motion
ALL = slice(None)
ROUNDING = 1e-6  # of coordinates [mm, deg]: no axis is beyond its travel by less


def block_boxes(program: Program) -> tuple[FloatArray, FloatArray]:
    """(B, A) least and greatest position on the way of each block, its start left out [mm, rad].

    An arc reaches centre + radius along an axis where its sweep passes that direction; a spline is looked at
    in `SPLINE_PLACES` places of each piece.
    """
    low, high = program.end.copy(), program.end.copy()
    splines = program.splines
    for first in range(0, len(splines), PIECES_AT_ONCE):
        part = slice(first, first + PIECES_AT_ONCE)
        pieces = homogeneous(splines.points[part], splines.weights[part])
        on, _, _ = at(pieces, np.linspace(0.0, 1.0, SPLINE_PLACES))
        np.minimum.at(low, splines.block[part], on.min(axis=1))
        np.maximum.at(high, splines.block[part], on.max(axis=1))
    (ua, ub), to_end = spokes(program)
    radius = np.maximum(np.hypot(ua, ub), np.hypot(*to_end))
    axes, rows = plane_axes(program), np.arange(len(radius))
    for quarter in range(4):
        turn = (quarter * np.pi / 2 - np.arctan2(ub, ua)) * np.sign(program.arc_sweep)
        passed = turn % (2 * np.pi) <= np.abs(program.arc_sweep)
        axis, side = axes[quarter % 2], 1.0 if quarter < 2 else -1.0
        reach = program.arc_center[rows, axis] + side * radius
        bound, extreme = (np.maximum, high) if quarter < 2 else (np.minimum, low)
        place = program.arc_block[passed], axis[passed]
        extreme[place] = bound(extreme[place], reach[passed])
    return low, high


def starts(program: Program) -> FloatArray:
    """(B, A) position before each block."""
    return np.vstack([program.start, program.end])[:-1]


def spokes(program: Program) -> tuple[FloatArray, FloatArray]:
    """(2, K) vectors from the centre to the start and to the end of each arc, in its plane."""
    k, axes = program.arc_block, plane_axes(program)
    centre = program.arc_center[np.arange(len(k)), axes]
    return starts(program)[k, axes] - centre, program.end[k, axes] - centre


def rise(program: Program) -> FloatArray:
    """(K,) how far each arc goes along its axis [mm]."""
    k, n = program.arc_block, program.arc_normal
    return program.end[k, n] - starts(program)[k, n]


def block_lengths(program: Program, axes: slice = ALL) -> FloatArray:
    """(B,) path length of every block along some axes [mm]; an arc whose radii differ counts with their mean."""
    length = np.linalg.norm((program.end - starts(program))[:, axes], axis=1)
    from_start, from_end = spokes(program)
    radius = (np.hypot(*from_start) + np.hypot(*from_end)) / 2.0
    length[program.arc_block] = np.hypot(radius * program.arc_sweep, rise(program))
    splines = program.splines
    if len(splines):
        length[np.unique(splines.block)] = 0.0
        np.add.at(length, splines.block, lengths(homogeneous(splines.points[..., axes], splines.weights)))
    return length


def plane_axes(program: Program) -> Array:
    """(2, K) indices of the axes in the plane of each arc."""
    return np.array([IN_PLANE[n] for n in range(3)])[program.arc_normal].T.reshape(2, -1)


def work_box(program: Program, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """(3,) least and greatest x, y and z of blocks as the program has them, without its offsets [mm]; None
    where they are those of the machine, or a turned system has no such box.

    low, high : (B, A) as `block_boxes` has them
    """
    origins = program.origins
    row = np.searchsorted(origins.block, np.arange(len(program)), side="right") - 1
    if not (row >= 0).any() or not origins.offset.any() or origins.turned.any():
        return None
    offset = np.where(row[:, None] >= 0, origins.offset[row], 0.0)
    linear = slice(len(LINEAR_AXES))
    return (low[:, linear] - offset).min(axis=0), (high[:, linear] - offset).max(axis=0)


def travel_faults(
    program: Program, machine: Machine | None, text: bytes = b""
) -> tuple[list[Fault], list[str]]:
    """What of a program the travel of a machine's axes does not reach: a fault for each axis, by how far and
    on which line first; and notes on what is not known.

    text : of the program, for the column of the axis' word
    """
    ends = np.array([travel_of(machine, letter) for letter in program.axes]).reshape(-1, 2)
    if not len(program) or not np.isfinite(ends).any():
        return [], []
    assert machine is not None
    low, high = _of_joints(program, machine) if program.tool_point else block_boxes(program)
    before = starts(program)
    moves = (low != high) | (before != program.end)
    faults, notes = [], []
    known = coordinates_known(machine)
    lines = text.splitlines()
    for a, letter in enumerate(program.axes):
        on = np.flatnonzero(moves[:, a])
        unit = RAD_PER_DEG if letter in ROTARY_AXES else 1.0
        if not len(on) or not np.isfinite(ends[a]).any():
            continue
        least, most = low[on, a] / unit, high[on, a] / unit
        if _named_before(lines, int(program.line[on[0]]), letter):  # a move of no length is no block
            begin = before[on[0], a] / unit
            least[0], most[0] = min(least[0], begin), max(most[0], begin)
        room = f"{ends[a, 0]:g} to {ends[a, 1]:g} {'mm' if unit == 1.0 else 'deg'}"
        over = np.maximum(ends[a, 0] - least, most - ends[a, 1])
        if known and over.max() > ROUNDING:
            first, worst = on[np.argmax(over > ROUNDING)], int(over.argmax())
            place = least[worst] if ends[a, 0] - least[worst] == over[worst] else most[worst]
            said = (
                f"in machine coordinates {letter} goes to {place:.6g} on line {program.line[on[worst]]}, "
                f"{over[worst]:.4g} beyond its travel of {room} (blocks beyond it: {int((over > ROUNDING).sum()):,})"
            )
        elif not known and (most.max() - least.min()) - (ends[a, 1] - ends[a, 0]) > ROUNDING:
            first, span = on[least.argmin()], most.max() - least.min()
            said = (
                f"{letter} goes from {least.min():.6g} to {most.max():.6g} on line {program.line[on[most.argmax()]]}, "
                f"{span - (ends[a, 1] - ends[a, 0]):.4g} more than its travel of {room}, wherever G54 is"
            )
        else:
            continue
        line = int(program.line[first])
        found = re.search(letter.encode(), lines[line - 1], re.IGNORECASE) if line <= len(lines) else None
        column = found.start() + 1 if found else 1
        faults.append(Fault(line, column, letter.upper(), f"{said}; --ignore-travel plans it"))
    if not known:
        mixed = any(NO_G54 in text for text in program.assumptions)
        both = "nothing is compared: the program mixes both coordinates"
        compared = both if mixed else "only lengths are compared"
        notes.append(f"travel: the machine file has no G54 ([work_offsets.g54]), so {compared}")
        faults = [] if mixed else faults
    return sorted(faults, key=lambda fault: fault.line), notes


def coordinates_known(machine: Machine) -> bool:
    """Whether the machine coordinates of a program are known: by G54, or where the control has no offsets."""
    control = machine.control
    return "g54" in machine.work_offsets or (control is not None and control.name in NO_OFFSETS)


def travel_of(machine: Machine | None, letter: str) -> tuple[float, float]:
    """The travel of an axis [mm, deg]; infinite where none is known, and on a wrapped axis, which turns on."""
    axis = machine.axes.get(letter) if machine else None
    if axis is None or axis.wrapped:
        return -np.inf, np.inf
    low, high = axis.travel_min, axis.travel_max
    return -np.inf if low is None else low, np.inf if high is None else high


def _of_joints(program: Program, machine: Machine) -> tuple[FloatArray, FloatArray]:
    """(B, A) least and greatest position of the joints of a program of the tool's tip, in `TIP_PLACES` places
    of each block as if it were a line."""
    assert program.tool_point is not None
    chain = kinematics_of(machine, program.tool_point.length)
    share = np.linspace(0.0, 1.0, TIP_PLACES)[1:, None, None]
    before = starts(program)
    places = before + share * (program.end - before)
    joints = places.copy()
    found = chain.joints({letter: places[..., a] for a, letter in enumerate(program.axes)})
    for a, letter in enumerate(program.axes):
        joints[..., a] = found.get(letter, places[..., a])
    return joints.min(axis=0), joints.max(axis=0)


def _named_before(lines: list[bytes], line: int, letter: str) -> bool:
    """Whether a program names an axis before a line: its start is a place of it then, and not assumed."""
    word = re.compile(rb"(?<![A-Z#<])" + letter.encode() + rb"\s*[-+=\d.\[#]", re.IGNORECASE)
    words = (_COMMENT.sub(b"", text) for text in lines[: line - 1])
    return any(word.search(text) and not _SETS.search(text) for text in words)
