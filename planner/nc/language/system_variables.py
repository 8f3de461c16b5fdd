"""Parameters that hold the state of the control: positions, offsets, modes, tool, spindle. LinuxCNC's and
Fanuc's numbers and names.

Lengths are in the program's unit where LinuxCNC has them so (5420 and the named ones), else in mm, the unit
of a machine here: offsets, G28 and G30 positions and tool lengths are kept by a LinuxCNC control in the
machine's unit.
"""

from collections.abc import Callable

import numpy as np

from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.codes import CYCLES
from planner.nc.interpreter import Interpreter
from planner.nc.language import tree
from planner.nc.language.rows import FrameParts, require
from planner.nc.language.travel import Travel
from planner.nc.program import PathControl
from planner.nc.state import FURTHER_SYSTEMS, SYSTEMS, State, System, system_name

# Words that restore modes, line by line.
Modes = tuple[tuple[tuple[str, float], ...], ...]
# G codes in force, that parameters answer with.
_PATH = {PathControl.EXACT_PATH: 61.0, PathControl.EXACT_STOP: 61.1, PathControl.BLEND: 64.0}
_PLANE = {2: 17.0, 1: 18.0, 0: 19.0}
_OF_ONE = 20  # parameters of one work system
_FURTHER = range(FURTHER_SYSTEMS + 1, FURTHER_SYSTEMS + 301)
_OFFSETS = ((5221, 5340, SYSTEMS), (7001, 7960, _FURTHER), (14_001, 19_980, _FURTHER))
_ROTATION = 9  # behind the axes of a work coordinate system
# G code of a feed mode.
_FEED_MODES = {"inverse time": 93.0, "per minute": 94.0, "per turn": 95.0}
_AXES = 9  # x y z a b c u v w; the last six are zero here
# Parameters of the tree that hold the position, behind those that programs of Heidenhain and Siemens can
# name: x, y, z.
FIRST_POSITION = 2001
POSITIONS = "XYZABC"


def position(axis: str) -> tree.Numbered:
    """Where an axis is, in the program's coordinates, for languages whose parameters are `PositionVariables`."""
    return tree.numbered(FIRST_POSITION + POSITIONS.index(axis))


PER_RADIUS = tree.numbered(
    FIRST_POSITION + len(POSITIONS)
)  # X words per radius: 2 where they are diameters, else 1


def _numbers(*ranges: tuple[int, int]) -> frozenset[int]:
    return frozenset(number for first, last in ranges for number in range(first, last))


class SystemVariables:
    """Answers for one interpreter. Subclasses name the parameters."""

    numbers: frozenset[int] = frozenset()
    names: frozenset[str] = frozenset()

    def __init__(self, interpreter: Interpreter):
        self.interpreter = interpreter
        self.travel: Travel | None = None

    def get(self, parameter: int | str, depth: int) -> float:
        """The value of a parameter, by number or name; `depth` calls are open."""
        raise NotImplementedError

    def put(self, number: int, value: float | None) -> None:
        """Assign to a parameter of the control. Raises ValueError: a program changes its state by codes."""
        remedy = "write G10, G92, G28.1 or a tool change instead"
        raise ValueError(f"parameter #{number} belongs to the control and is only read here; {remedy}")

    def here(self, axis: int) -> float:
        """The position in the program's coordinates and unit."""
        state, travel = self.interpreter.state, self.travel
        if travel is not None and travel.active and axis < 3:
            return float(travel.place[axis]) / state.unit
        return float(state.programmed()[axis] / state.unit) if axis < 3 else 0.0

    def machine(self, axis: int) -> float:
        """The position in the machine's coordinates and the program's unit."""
        state = self.interpreter.state
        return float(state.position[axis] / state.unit) if axis < 3 else 0.0

    def offset(self, system: int, axis: int) -> float:
        """The offset of a work coordinate system, G54 is 0 [mm], or its rotation [degrees]."""
        given = self.interpreter.state.work_system(SYSTEMS[system])
        if axis == _ROTATION:
            return given.rotation
        return float(given.origin[axis]) if axis < 3 else 0.0

    def event(self, letter: str, values: tuple[float, ...] = ()) -> float | None:
        """The last event with that letter, and one of the values if any are given."""
        table = self.interpreter.table
        seen = slice(0, table.events)
        found = table.event.letter[seen] == ord(letter)
        if values:
            found &= np.isin(table.event.value[seen], values)
        at = np.flatnonzero(found)
        return float(table.event.value[at[-1]]) if len(at) else None

    def feed(self) -> float:
        """The feed in the program's unit per minute."""
        state = self.interpreter.state
        return state.feed / state.unit * SECONDS_PER_MINUTE

    def system(self) -> int:
        """The work coordinate system in force, G54 is 0."""
        system = self.interpreter.state.system
        require(system in SYSTEMS, f"{system_name(system)} has no number that a program can ask for here")
        return SYSTEMS.index(system)

    def modes(self) -> Modes:
        """The words that bring back the present modes, all but the motion code: M70 and M72."""
        state = self.interpreter.state
        path: list[tuple[str, float]] = [("G", _PATH[state.path_control])]
        if state.path_control == PathControl.BLEND and not np.isnan(state.tolerance):
            path.append(("P", state.tolerance / state.unit))
        system = SYSTEMS[self.system()] / 10
        distance = 90.0 if state.absolute else 91.0
        codes = _PLANE[state.normal], distance, 90.1 if state.absolute_centre else 91.1
        rows = [
            [("G", 21.0 if state.unit == 1.0 else 20.0), ("G", 7.0 if state.diameters else 8.0)],
            [*(("G", code) for code in (*codes, system, 98.0 if state.to_level else 99.0)), *path],
            [("G", _FEED_MODES[state.feed_mode])],
        ]
        lengths = zip("XYZ", (state.tool_offset[:3] / state.unit).tolist(), strict=True)
        offset = state.tool_offset.any()
        rows.append([("G", 43.1), *(pair for pair in lengths if pair[1])] if offset else [("G", 49.0)])
        if state.feed > 0 and state.feed_mode == "per minute":
            rows.append([("F", self.feed())])
        events = [("S", ()), ("M", (3.0, 4.0, 5.0)), ("M", (7.0, 8.0, 9.0)), ("M", (48.0, 49.0))]
        last = ((letter, self.event(letter, group)) for letter, group in events)
        rows += [[(letter, value)] for letter, value in last if value is not None]
        return tuple(tuple(row) for row in rows)


def _motion_mode(motion: int) -> float:
    """The motion code in force in tenths, as `State.motion` keeps it; G80 where there is none."""
    return 800.0 if motion < 0 else 10.0 * motion if motion <= 3 else float(motion)


# By name: what the state, or all that is known, answers; true is 1.
_LINUXCNC_NAMES: dict[str, Callable[[State, SystemVariables], float]] = {
    "_vmajor": lambda s, a: 2.9,
    **dict.fromkeys(("_vminor", "_task", "_remap_level", "_adaptive_feed", "_feed_hold"), lambda s, a: 0.0),
    "_motion_mode": lambda s, a: _motion_mode(s.motion),
    "_plane": lambda s, a: 10.0 * _PLANE[s.normal],
    "_ccomp": lambda s, a: 400.0,
    "_metric": lambda s, a: s.unit == 1.0,
    "_imperial": lambda s, a: s.unit != 1.0,
    "_absolute": lambda s, a: s.absolute,
    "_incremental": lambda s, a: not s.absolute,
    "_inverse_time": lambda s, a: s.feed_mode == "inverse time",
    "_units_per_minute": lambda s, a: s.feed_mode == "per minute",
    "_units_per_rev": lambda s, a: s.feed_mode == "per turn",
    "_coord_system": lambda s, a: s.system,
    "_tool_offset": lambda s, a: bool(s.tool_offset.any()),
    "_retract_r_plane": lambda s, a: not s.to_level,
    "_retract_old_z": lambda s, a: s.to_level,
    "_spindle_rpm_mode": lambda s, a: not s.spindle.surface_speed,
    "_spindle_css_mode": lambda s, a: s.spindle.surface_speed,
    "_ijk_absolute_mode": lambda s, a: s.absolute_centre,
    "_lathe_diameter_mode": lambda s, a: s.diameters,
    "_lathe_radius_mode": lambda s, a: not s.diameters,
    "_spindle_on": lambda s, a: s.spindle.turning != 0,
    "_spindle_cw": lambda s, a: s.spindle.turning > 0,
    "_mist": lambda s, a: a.event("M", (7.0, 9.0)) == 7.0,
    "_flood": lambda s, a: a.event("M", (8.0, 9.0)) == 8.0,
    **dict.fromkeys(("_speed_override", "_feed_override"), lambda s, a: a.event("M", (48.0, 49.0)) != 49.0),
    "_feed": lambda s, a: a.feed(),
    "_rpm": lambda s, a: s.spindle.speed,
    **dict.fromkeys(("_current_tool", "_current_pocket"), lambda s, a: s.tool_loaded),
    **dict.fromkeys(("_selected_tool", "_selected_pocket"), lambda s, a: s.tool_selected),
    **{f"_{letter}": lambda s, a, axis=axis: a.here(axis) for axis, letter in enumerate("xyzabcuvw")},  # type: ignore[misc]
    **{f"_abs_{letter}": lambda s, a, axis=axis: a.machine(axis) for axis, letter in enumerate("xyzabc")},  # type: ignore[misc]
}


def _linuxcnc_number(system: SystemVariables, number: int) -> float:
    state = system.interpreter.state
    tool, none = state.tools.get(state.tool_loaded), state.zeros()
    homes = {5161: state.homes.get(280, none), 5181: state.homes.get(300, none)}
    places = homes | {5211: state.g92, 5401: state.tool_offset}
    for first, place in places.items():  # others than x y z are 0
        if first <= number < first + 3:
            return float(place[number - first])
    if 5221 <= number < 5221 + _OF_ONE * len(SYSTEMS):
        return system.offset(*divmod(number - 5221, _OF_ONE))
    if 5420 <= number < 5420 + _AXES:
        return system.here(number - 5420)
    if number == 5220:
        return system.system() + 1.0
    others = {5210: bool(state.g92.any()), 5400: state.tool_loaded, 5410: tool.diameter if tool else 0.0}
    return float(others.get(number, 0.0))


class PositionVariables(SystemVariables):
    """Positions of the axes alone, X as programs have it, for languages whose parameters do not hold the state of the control."""

    numbers = frozenset(range(FIRST_POSITION, FIRST_POSITION + len(POSITIONS) + 1))

    def get(self, parameter: int | str, depth: int) -> float:
        axis, state = int(parameter) - FIRST_POSITION, self.interpreter.state
        per_radius = 2.0 if state.diameters else 1.0
        if axis == len(POSITIONS):
            return per_radius
        if axis < 3:
            return self.here(axis) * (per_radius if axis == 0 else 1.0)
        letter = POSITIONS[axis]
        return float(state.programmed()[state.letters.index(letter)]) if letter in state.letters else 0.0


class LinuxcncVariables(SystemVariables):
    """Numbers 5161 to 5428 and the predefined names of LinuxCNC 2.9."""

    numbers = _numbers((5161, 5170), (5181, 5190), (5210, 5401), (5400, 5414), (5420, 5429))
    names = frozenset((*_LINUXCNC_NAMES, "_call_level"))

    def get(self, parameter: int | str, depth: int) -> float:
        if parameter == "_call_level":
            return float(depth)
        if isinstance(parameter, str):
            return float(_LINUXCNC_NAMES[parameter](self.interpreter.state, self))
        return _linuxcnc_number(self, parameter)


class FanucVariables(SystemVariables):
    """Modal information 4001 to 4130 and 4201 to 4330, positions 5001 to 5048, work offsets 5201 to 5326, 7001 to
    7960 and 14001 to 19980."""

    numbers = _numbers((1000, 1200), (2000, 3020), (4001, 4131), (4201, 4331), (5001, 5009), (5021, 5029),
                       (5041, 5049), (5201, 5209), (5221, 5327), (7001, 7961), (10_001, 20_000))  # fmt: skip

    def get(self, parameter: int | str, depth: int) -> float:
        """A parameter by its number, `depth` calls open. Raises ValueError for what is not known."""
        assert isinstance(parameter, int)
        state, cutter, number = self.interpreter.state, self.interpreter.cutter, parameter
        parts = FrameParts() if self.travel is None else self.travel.parts
        if 4201 <= number <= 4330:
            number -= 200
        cycle = state.motion in CYCLES  # of a group of its own there
        modal: dict[int, Callable[[], float]] = {
            4001: lambda: _motion_mode(self.interpreter.before_cycles if cycle else state.motion) / 10.0,
            4002: lambda: _PLANE[state.normal],
            4003: lambda: 90.0 if state.absolute else 91.0,
            4005: lambda: _FEED_MODES[state.feed_mode],
            4006: lambda: 21.0 if state.unit == 1.0 else 20.0,
            4004: lambda: 23.0,
            4007: lambda: 40.0 if cutter is None else 41.0 if cutter.sign > 0 else 42.0,
            4008: lambda: 43.0 if state.tool_offset.any() else 49.0,
            4009: lambda: state.motion / 10.0 if cycle else 80.0,
            4010: lambda: 98.0 if state.to_level else 99.0,
            4011: lambda: 50.0 + (parts.scale != 1.0).any(),
            4013: lambda: 96.0 if state.spindle.surface_speed else 97.0,
            4014: lambda: 54.1 if state.system > FURTHER_SYSTEMS else min(54.0 + self.system(), 59.0),
            4015: lambda: _PATH[state.path_control] // 1.0,
            4016: lambda: 68.0 if parts.rotation else 69.0,
            4022: lambda: 50.1 + (parts.mirror < 0.0).any(),
            4107: lambda: state.numbers.get("D", 0.0),
            4109: self.feed,
            4111: lambda: state.numbers.get("H", 0.0),
            4113: lambda: self.event("M") or 0.0,
            4119: lambda: self.event("S") or 0.0,
            4120: lambda: float(state.tool_selected),
            4130: lambda: float(max(state.system - FURTHER_SYSTEMS, 0)),
        }
        if number in modal:
            return modal[number]()
        if 5001 <= number <= 5008 or 5041 <= number <= 5048:
            return self.here((number - 1) % 20)
        if 5021 <= number <= 5028:
            return self.machine(number - 5021)
        if (place := _work_offset(number)) is not None:
            system, axis = place
            return float(state.work_system(system).origin[axis]) / state.unit if axis < 3 else 0.0
        if 5201 <= number <= 5208:
            return 0.0
        remedy = "assign the value it has there to a parameter of your own"
        raise ValueError(f"parameter #{parameter} is known by the control only; {remedy}")

    def put(self, number: int, value: float | None) -> None:
        """Assign to a work offset. Raises ValueError for an alarm, and a state that codes change."""
        require(number != 3000, f"the program raises its alarm {value or 0:g} here")
        if 3001 <= number <= 3007:
            return  # timers and what the operator may do: nothing moves
        system, axis = _work_offset(number) or (0, 3)
        if axis >= 3:
            super().put(number, value)
        state = self.interpreter.state
        old = state.work_system(system)
        origin = old.origin.copy()
        origin[axis] = (value or 0.0) * state.unit
        state.systems[system] = System(origin, old.rotation)
        state.apply_offsets()


def _work_offset(number: int) -> tuple[int, int] | None:
    """The work system and the axis that a parameter of Fanuc holds; of G54.1 P in two ranges."""
    for first, last, systems in _OFFSETS:
        if first <= number <= last:
            at, axis = divmod(number - first, _OF_ONE)
            return systems[at], axis
    return None
