"""How long a control takes for a program as it is, by the models of the controls' planners, and for what of it: tools,
operations, layers.

A model gets the moves that the control's planner gets: lines as they are, arcs as the control cuts them (LinuxCNC has
arcs), rapids of Klipper and Marlin at the F in force. Where the program dwells, stops, or switches spindle or
coolant the motion stands.

An operation is named by the last comment that stands alone on a line before its moves; what has the same name counts
together. Where slicers have comments ;TYPE:, only these count. Layers are counted by ;LAYER: or ;LAYER_CHANGE.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.controls.timing import linuxcnc
from planner.controls.timing.models import CONTROLS, Control, chords, predicted_times
from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import polyline
from planner.geometry.toolpath import Toolpath
from planner.machine import Machine
from planner.nc.points import UNIT_WORD, own_text
from planner.nc.program import FEED_MOVES, Kind, PathControl, Program
from planner.planning.job.beside import codes_of

LINUXCNC = "linuxcnc"
TIMED = (LINUXCNC, *CONTROLS)  # names of the controls that there are models of
SWITCHES = (3, 4, 5, 7, 8, 9)  # M codes of spindle and coolant, at which the motion stands
CHANGE = 6  # M code of a tool change
FIRST_FEED = 25.0  # of rapids before the first F word, as Klipper begins [mm/s]
# Of a control point of a spline LinuxCNC makes four pairs; third differences below this are rounding [mm].
ARCS_OF_POINT, QUADRATIC = 8.0, 1e-9
_COMMENT = re.compile(rb"^[ \t]*(?:N\d+[ \t]*)?(?:\(([^)\n]*)\)|;([^\n]*?))[ \t]*\r?$", re.MULTILINE)
_LAYER = re.compile(r"(?:LAYER|layer):?[ _]*(-?\d+)|LAYER_CHANGE|CHANGE_LAYER")
_F_WORD = re.compile(rb"^[^(;\n]*?[Ff][ \t]*(\d*\.?\d+)", re.MULTILINE)
_JOINING = re.compile(rb"^[^(;\n]*?[Gg]64[^(;\n]*?[Qq][ \t]*(\d*\.?\d+)", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class ControlTimes:
    """What a control takes for a program."""

    control: str  # its name
    seconds: float  # in all, dwells included [s]
    dwells: float  # of that, standing still [s]
    moves: int  # that its planner gets
    # seconds by name, in the order of the program; empty where there are none
    tools: dict[str, float] = field(default_factory=dict)
    operations: dict[str, float] = field(default_factory=dict)
    layers: dict[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()  # sentences


def control_named(name: str | None, machine: Machine) -> str:
    """The control to be timed, named or the machine's. Raises InputError where there is no model of it."""
    found = name or (machine.control.name if machine.control is not None else None)
    if found not in TIMED:
        what = "the machine names no control" if found is None else f"there is no model of {found}"
        raise InputError(f"{what}; give one: --control {', '.join(TIMED)}")
    return found


def control_times(
    program: Program, machine: Machine, control: str, tolerance: float | None = None
) -> ControlTimes:
    """What a control takes for a program as it is.

    control   : "grbl", "klipper", "marlin" or "linuxcnc"
    tolerance : G64 P [mm] in place of that of the program and the machine; None for those

    Raises InputError for programs with the tool centre point on, and as `toolpath_from_program` does.
    """
    if program.tool_point is not None:
        said = "with the tool centre point on the control's time is not known: its planner sees the joints"
        raise InputError(said, source=program.source, line=program.tool_point.line)
    toolpath = toolpath_from_program(program, machine, tolerance)
    text = own_text(program) or b""
    timed = _on_linuxcnc if control == LINUXCNC else _on_the_path
    block, found, moves, assumed = timed(program, toolpath, machine, control, text)
    of_block = np.bincount(block, weights=found, minlength=len(program)).astype(np.float64)
    dwells = float(toolpath.dwell.sum())
    np.add.at(of_block, toolpath.block[np.maximum(np.arange(len(toolpath.dwell)) - 1, 0)], toolpath.dwell)
    operations, layers = named_parts(program, text)
    return ControlTimes(
        control=control,
        seconds=float(of_block.sum()),
        dwells=dwells,
        moves=moves,
        tools=by_name(of_block, tools_of(program)),
        operations=by_name(of_block, operations),
        layers=by_name(of_block, layers),
        assumed=assumed,
    )


def standing(program: Program, block: Array, *, switches: bool) -> Array:
    """(n+1,) where the motion stands of moves that belong to blocks `block` (n,), not decreasing; at the
    switches of spindle and coolant too, if these hold it up."""
    still = np.flatnonzero(np.isin(program.kind, (Kind.DWELL, Kind.STOP)))
    if switches:
        at, code = codes_of(program, "M")
        still = np.append(still, at[np.isin(code, SWITCHES)])
    stands = np.zeros(len(block) + 1, dtype=bool)
    stands[np.searchsorted(block, still)] = True
    return stands


# Block and seconds (n,) of moves, how many there are, what is assumed.
_Timed = tuple[Array, FloatArray, int, tuple[str, ...]]


def _on_the_path(program: Program, toolpath: Toolpath, machine: Machine, name: str, text: bytes) -> _Timed:
    """The moves on controls that stay on the path."""
    control = CONTROLS[name]
    points, segment = control_points(toolpath, control)
    feed, block = toolpath.feed[segment], toolpath.block[segment]
    if control.rapid_feed:
        feed = np.where(toolpath.rapid[segment], feed_in_force(program, text)[block], feed)
    stands = standing(program, block, switches=name != "klipper")
    found = predicted_times(points, feed, stands, machine, toolpath.axes, control)
    own = machine.control is not None and machine.control.name == name
    assumed = () if own else (f"{name}'s defaults: the machine says nothing of {name}'s planner",)
    return block, found, len(segment), assumed


def control_points(toolpath: Toolpath, control: Control) -> tuple[FloatArray, Array]:
    """The path (n+1, A) as a control cuts it [mm], and the segment of each move (n,)."""
    count, arc = np.ones(len(toolpath), np.int64), toolpath.arc >= 0
    row, length = toolpath.arc[arc], toolpath.length[arc]
    count[arc] = chords(control, length, np.abs(toolpath.arcs.rate[row]) * length, toolpath.arcs.radius[row])
    curve = toolpath.curve >= 0
    chord = np.sqrt(8.0 * toolpath.along[curve] / toolpath.curvature[curve])
    count[curve] = np.ceil(toolpath.length[curve] / chord).astype(np.int64)
    return polyline(toolpath, count)


def _on_linuxcnc(program: Program, toolpath: Toolpath, machine: Machine, name: str, text: bytes) -> _Timed:
    """The moves on LinuxCNC."""
    stands = standing(program, toolpath.block, switches=True)
    mode = program.path_control[toolpath.block]
    stands[1:] |= mode == PathControl.EXACT_STOP
    p = np.where(mode == PathControl.EXACT_PATH, 0.0, toolpath.tolerance[1:])
    q = _joining(program, toolpath, text)
    points = np.vstack([toolpath.start[:1], toolpath.end])
    feed = np.where(toolpath.rapid, np.inf, toolpath.feed)
    alone = toolpath.rapid | ~toolpath.straight | (mode != PathControl.BLEND)
    kept = linuxcnc.joined_moves(points, feed, alone, stands, q)
    last = kept[1:] - 1  # move that each kept one ends with
    bends = _with_arcs(linuxcnc.lines(points[kept]), program, toolpath, last)
    moves = points[kept], feed[last], stands[kept]
    found = linuxcnc.linuxcnc_times(*moves, machine, toolpath.axes, p[last[:-1]], bends)
    blends = mode == PathControl.BLEND
    without = bool(blends.any() and np.isnan(program.tolerance[toolpath.block[blends]]).all())
    said = f"G64 P{float(toolpath.tolerance[-1]):g}: the program says no P, LinuxCNC's own G64 without P blends further"
    return toolpath.block[last], found, len(kept) - 1, (said,) if without else ()


def _with_arcs(lines: linuxcnc.Bends, program: Program, toolpath: Toolpath, segment: Array) -> linuxcnc.Bends:
    """Moves (n,) with what they are where the segments of the same number are arcs or curves."""
    found = {name: column.copy() for name, column in vars(lines).items()}
    on = np.flatnonzero(~toolpath.straight[segment])
    of, arc = segment[on], toolpath.arc[segment]
    found["first"][on], found["last"][on] = toolpath.tangent_start[of], toolpath.tangent_end[of]
    found["length"][on], found["radius"][on] = toolpath.length[of], 1.0 / toolpath.curvature[of]
    arcs = np.flatnonzero(arc >= 0)
    found["radius"][arcs] = toolpath.arcs.radius[arc[arcs]]
    found["parts"][on] = _arcs_of_curves(program, toolpath)[of]
    found["radial"][arcs], found["across"][arcs] = toolpath.arcs.e1[arc[arcs]], toolpath.arcs.e2[arc[arcs]]
    return linuxcnc.Bends(**found)


def _arcs_of_curves(program: Program, toolpath: Toolpath) -> FloatArray:
    """(M,) into how many arcs LinuxCNC cuts segments: 1, and of a spline its share of `ARCS_OF_POINT` times its control
    points, as many as pieces and the degree."""
    splines, block, blocks = program.splines, toolpath.block, len(program)
    third = splines.points[:, 3] - splines.points[:, 0] - 3.0 * (splines.points[:, 2] - splines.points[:, 1])
    points = np.bincount(splines.block, minlength=blocks).astype(np.float64)
    degree = np.full(blocks, 2.0)
    np.maximum.at(degree, splines.block, np.where((abs(third) > QUADRATIC).any(axis=1), 3.0, 2.0))
    share = toolpath.length / np.bincount(block, weights=toolpath.length, minlength=blocks)[block]
    return np.where(toolpath.curve >= 0, ARCS_OF_POINT * (points + degree)[block] * share, 1.0)


def _joining(program: Program, toolpath: Toolpath, text: bytes) -> float:
    """Q of G64 [mm], which is P where a program gives P alone; 0 without one."""
    given = _JOINING.findall(text)
    if given:
        return float(given[-1]) * (MM_PER_INCH if UNIT_WORD.findall(text)[:1] == [b"20"] else 1.0)
    p = program.tolerance[np.isfinite(program.tolerance)]
    return float(p[-1]) if len(p) and float(toolpath.tolerance[-1]) == float(p[-1]) else 0.0


def feed_in_force(program: Program, text: bytes) -> FloatArray:
    """(B,) the F in force on each block [mm/s]: of the last feed move or F word up to its line."""
    number, units = _line_number(text), [*UNIT_WORD.finditer(text)]
    scale = np.array([MM_PER_INCH if one[1] == b"20" else 1.0 for one in units])
    unit_at = np.array([number(one) for one in units])
    words = [(number(one), float(one[1])) for one in _F_WORD.finditer(text)]
    line, value = np.array(words).reshape(-1, 2).T
    unit = np.append(1.0, scale)[np.searchsorted(unit_at, line, side="right")]
    value = np.append(FIRST_FEED, value * unit / SECONDS_PER_MINUTE)
    if program.frames or not len(line):  # lines come more than once
        feeds = np.isin(program.kind, FEED_MOVES) & np.isfinite(program.feed)
        last = np.maximum.accumulate(np.where(feeds, np.arange(1, len(program) + 1), 0))
        found: FloatArray = np.append(FIRST_FEED, program.feed)[last]
        return found
    in_force: FloatArray = value[np.searchsorted(line, program.line, side="right")]
    return np.maximum(in_force, 1e-3)


def _line_number(text: bytes) -> Callable[[re.Match[bytes]], int]:
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n"))
    return lambda found: int(np.searchsorted(ends, found.start(found.lastindex or 0))) + 1


def tools_of(program: Program) -> list[str] | None:
    """(B,) the tool of each block, "T1"; None for programs without one. Without M6 a T word changes the tool at once."""
    (m_at, code), (t_at, tool) = codes_of(program, "M"), codes_of(program, "T")
    if not len(tool):
        return None
    changes = m_at[code == CHANGE]
    at = changes if len(changes) else t_at
    number = np.searchsorted(t_at, at, side="right")  # T words up to each change
    names = [f"T{tool[k - 1]:g}" if k else "" for k in number.tolist()]
    which = np.searchsorted(at, np.arange(len(program)), side="right")
    return [names[k - 1] if k else "" for k in which.tolist()]


def named_parts(program: Program, text: bytes) -> tuple[list[str] | None, list[str] | None]:
    """(B,) the operation and the layer of each block; None where the text names none."""
    number = _line_number(text)
    comments = ((number(one), one[1] or one[2] or b"") for one in _COMMENT.finditer(text))
    texts = [(line, words.decode("utf-8", "replace")) for line, words in comments]
    said = [(line, name.strip()) for line, name in texts if name.strip()]
    types = [(line, name[5:]) for line, name in said if name.startswith("TYPE:")]
    marked = [(line, found[1]) for line, name in said if (found := _LAYER.match(name))]
    layers = [(line, f"layer {k if of is None else of}") for k, (line, of) in enumerate(marked, start=1)]
    plain = [] if layers else said

    def at_blocks(named: list[tuple[int, str]]) -> list[str] | None:
        names = ["", *(name for _, name in named)]
        found = np.searchsorted([line for line, _ in named], program.line, side="left")
        return [names[k] for k in found.tolist()] if named else None

    return at_blocks(types or plain), at_blocks(layers)


def by_name(seconds: FloatArray, names: list[str] | None) -> dict[str, float]:
    """`seconds` (B,) by the `names` (B,) of the blocks, in the order of the program; empty where none has a name."""
    found: dict[str, float] = {}
    for name, more in zip(names or (), seconds.tolist(), strict=False):
        if more:
            found[name] = found.get(name, 0.0) + more
    return found if found.keys() - {""} else {}
