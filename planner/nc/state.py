"""The modal state of the interpreter, and where the offsets put a coordinate.

    machine position = origin of the work system + tool offset + R (programmed coordinate * unit + G92 offset)

R turns about z by the rotation of the work system (G10 L2 R). All lengths are kept in mm, angles of rotary
axes in degrees, and all positions in machine coordinates, so that changing an offset moves nothing. Vectors are
over the A axes that are read: x, y, z and those of `LETTERS` that the machine has.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.kernels import njit
from planner.base.units import MM_PER_INCH, RAD_PER_DEG, SECONDS_PER_MINUTE
from planner.machine import Machine
from planner.nc.program import PathControl

NO_MOTION = -1  # no motion code in force: at the start, and after G80
REFUSED_MOTION = -2  # a motion code that is not supported is in force (only `info` reads on)
# Work systems of G10 P1 to P9, by ten times their G codes.
SYSTEMS = (540, 550, 560, 570, 580, 590, 591, 592, 593)
_HOMES = {"g28": 280, "g30": 300}  # codes of positions by their names in a machine file
_QUARTERS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}  # cosine and sine, exact
FURTHER_SYSTEMS = 54_100  # and P: the further work systems of Fanuc, G54.1 P1 to P300
FURTHER_MAX = 300
NAMED = 100_000  # number of the first tool, and of the first label, that has a name instead
FeedMode = Literal["per minute", "inverse time", "per turn"]
LETTERS = "ABCUVW"  # of axes beside x, y and z
DEGREES = "ABC"  # of rotary axes, whose places are in degrees


@cache
def _turns(letters: str) -> Array:
    return np.array([letter in DEGREES for letter in letters])


@njit(cache=True)
def straight_feed(feed, step, turns, unit, together):
    """`Program.feed` of a straight move [mm/s; rad/s where only rotary axes move].

    feed     : F in force [mm/s]
    step     : (A,) the move [mm; degrees]
    turns    : (A,) True for rotary axes
    unit     : mm per programmed unit of length when F was given
    together : F is the speed of all axes, a degree counting as a unit of length
    """
    first, further, turned = 0.0, 0.0, 0.0
    for axis in range(len(step)):
        if turns[axis]:
            turned += (step[axis] * unit) ** 2
        elif axis < 3:
            first += step[axis] ** 2
        else:
            further += step[axis] ** 2
    goes = first if first > 0.0 else further
    if goes == 0.0 and turned > 0.0:
        return feed / unit * RAD_PER_DEG
    return feed * math.sqrt(goes / (first + further + turned)) if together and goes > 0.0 else feed


@dataclass(frozen=True)
class Tool:
    """A tool: offset (A,) that G43 adds and diameter, both in mm."""

    offset: FloatArray
    diameter: float = 0.0


def tool_name(number: int) -> str:
    """What messages call a tool."""
    named = "a tool with a name (write its number)"
    return named if number >= NAMED else f"tool {number}"


@dataclass(frozen=True)
class System:
    """A work coordinate system: origin (A,) in machine coordinates [mm] and rotation about z [degrees]."""

    origin: FloatArray
    rotation: float = 0.0

    def turn(self, vector: FloatArray, sign: float = 1.0) -> FloatArray:
        """A vector (A,) or (3,) of the system in the machine's axes; with sign -1 the other way."""
        if self.rotation == 0.0:
            return vector
        cosine, sine = _QUARTERS.get(self.rotation % 360.0) or (  # type: ignore[call-overload]
            math.cos(math.radians(self.rotation)),
            math.sin(math.radians(self.rotation)),
        )
        x, y, *others = vector
        return np.array([cosine * x - sign * sine * y, sign * sine * x + cosine * y, *others])


@dataclass(slots=True)
class Spindle:
    """The spindle: speed [1/min], turning (+1 M3, -1 M4, 0), whether S is a surface speed (G96) [m/min or
    ft/min], and the largest speed then [1/min], 0 where it has no bound."""

    speed: float = 0.0
    turning: int = 0
    surface_speed: bool = False
    speed_max: float = 0.0


@dataclass(slots=True)
class CycleSeries:
    """Canned cycles in a row: motion code, words in force, level before the first, all as programmed."""

    code: int
    words: dict[str, float]
    level: float


@dataclass(slots=True)
class State:
    """Modal state; starts as RS274NGC does: G21 G90 G17 G94 G40 G49 G54 G91.1 G99 G8 and no motion code."""

    # 0 ... 3, the tenths of another motion code (81 is 810), NO_MOTION or REFUSED_MOTION
    motion: int = NO_MOTION
    normal: int = 2  # index of the axis normal to the arc plane
    unit: float = 1.0  # mm per programmed length unit
    absolute: bool = True
    absolute_centre: bool = False
    diameters: bool = False  # X words are diameters (G7)
    feed: float = 0.0  # [mm/s], 0 where none has been given
    feed_factor: float = 1.0  # by which F counts (M220), in `feed` already
    feed_mode: FeedMode = "per minute"
    feed_per_turn: float = 0.0  # F of G95 [mm]
    feed_zero: str = ""  # where F0 stands, while no other F has come
    fed: bool = False  # a feed has been in force
    feed_unit: float = 1.0  # mm per programmed length unit when the feed was given
    spindle: Spindle = field(default_factory=Spindle)
    path_control: PathControl = PathControl.BLEND
    tolerance: float = np.nan  # P of G64 [mm], NaN where none
    letters: str = "XYZ"  # of the axes
    wrapped: str = ""  # those of the axes that are wrapped
    position: FloatArray = field(default_factory=lambda: np.zeros(3))  # (A,) machine position [mm]
    # (A,) machine position of the programmed zero, without rotation [mm]
    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotated: bool = False  # whether the work system in force is rotated
    system: int = 540
    systems: dict[int, System] = field(default_factory=dict)  # by code (54 is 540, 54.1 P3 is 54103)
    g92: FloatArray = field(default_factory=lambda: np.zeros(3))
    g92_saved: FloatArray = field(default_factory=lambda: np.zeros(3))  # what G92.3 brings back [mm]
    # (A,) positions of G28 (280) and G30 (300) [mm]
    homes: dict[int, FloatArray] = field(default_factory=dict)
    tools: dict[int, Tool] = field(default_factory=dict)  # by number
    tool_offset: FloatArray = field(default_factory=lambda: np.zeros(3))  # (A,) in force (G43) [mm]
    tool_selected: int = 0
    tool_loaded: int = 0
    to_level: bool = False  # canned cycles retract to the level before them (G98), not to R (G99)
    retract_given: bool = False  # a G98 or G99 was read
    numbers: dict[str, float] = field(default_factory=dict)  # of D beside G41, G42, and of H beside G43
    series: CycleSeries | None = None  # canned cycles in force
    cycle_dwell: float = 0.0  # the last P of a canned cycle [s], for G74 and G84 without P, as in LinuxCNC
    # (A,) where the tool is instead of at `position`, which cutter radius compensation moves it from; or None
    actual: FloatArray | None = None
    change_timed: bool = False  # how long a tool change takes is known
    uncompensated: bool = False  # a profile is read for its passes, which G41 and G42 do not move
    in_thread: bool = False  # the last block was cut in step with the spindle
    strict: bool = False  # nothing is assumed (`Reading.strict`)
    fanuc: bool = False  # G10 L2 and L20 are those of Fanuc and Haas, dwells are in milliseconds
    # F is the speed of all axes together, degrees counting as units of length, in the unit of its own line: Fanuc, grbl
    own_feed: bool = False
    at_tip: bool = False  # the tool centre point is on
    entering: bool = False  # lines up to G11 are data of the control (G10 L50)
    seconds_meant: bool = False  # the unit of dwells is known
    centres_known: bool = False  # the dialect has no G90.1
    plane_known: bool = True  # G17, G18 or G19 was read, or the control starts with G17

    @property
    def others(self) -> str:
        """Letters of the axes beside x, y and z."""
        return self.letters[3:]

    @property
    def turns(self) -> Array:
        """(A,) True for rotary axes."""
        return _turns(self.letters)

    @property
    def scale(self) -> FloatArray:
        """(A,) mm, or degrees of rotary axes, per programmed unit."""
        return np.where(self.turns, 1.0, self.unit)

    def zeros(self) -> FloatArray:
        """(A,) zeros."""
        return np.zeros(len(self.letters))

    @property
    def place(self) -> FloatArray:
        """(A,) where the tool is [mm]."""
        return self.position if self.actual is None else self.actual

    @property
    def feeds_all(self) -> bool:
        """True if F counts so in the mode in force."""
        return self.own_feed and not self.at_tip and self.feed_mode != "inverse time"

    @property
    def word_feed(self) -> float:
        """F in force as a program writes it now, per minute or per turn; 0 for none."""
        feed = (
            self.feed_per_turn
            if self.feed_mode == "per turn"
            else self.feed / self.feed_factor * SECONDS_PER_MINUTE
        )
        return feed / self.unit

    @property
    def is_plain(self) -> bool:
        """True if straight moves need nothing but offsets, units and F: what the compiled loop knows."""
        further = self.rotated or self.diameters or self.in_thread or self.actual is not None
        return self.feed_mode == "per minute" and not further

    def work_system(self, code: int = 0) -> System:
        """A work system by its code, or the one in force."""
        return self.systems.get(code or self.system) or System(self.zeros())

    def apply_offsets(self) -> None:
        """Sum the offsets in force into `offset`."""
        system = self.work_system()
        self.rotated = system.rotation % 360.0 != 0.0
        self.offset[:] = self.g92 + system.origin + self.tool_offset

    def in_system(self, code: int = 0) -> FloatArray:
        """(A,) the position in a work system, or the one in force, before G92 is taken off [mm]."""
        system = self.work_system(code)
        return system.turn(self.position - system.origin - self.tool_offset, -1.0)

    def programmed(self) -> FloatArray:
        """(A,) the position in programmed coordinates [mm]."""
        return self.in_system() - self.g92 if self.rotated else self.position - self.offset

    def machine(self, point: FloatArray) -> FloatArray:
        """(A,) machine position of `point` (A,) in programmed coordinates [mm]."""
        if not self.rotated:
            return point + self.offset
        system = self.work_system()
        return system.origin + self.tool_offset + system.turn(point + self.g92)


def state_of(machine: Machine | None, left_out: Container[str] = ()) -> State:
    """The modal state at the start of a program, with the machine's offsets, positions and tools; axes that
    are `left_out` are not read."""
    state = State()
    if machine is not None:
        unit = MM_PER_INCH if begins_in_inches(machine) else 1.0
        letters = "XYZ" + "".join(c for c in LETTERS if c.lower() in machine.axes and c not in left_out)
        tools = {int(number): ({"x": t.x, "z": t.length}, t.diameter) for number, t in machine.tools.items()}
        vectors = ("position", "offset", "g92", "g92_saved", "tool_offset")
        at_zero: dict[str, Any] = {name: np.zeros(len(letters)) for name in vectors}
        state = State(
            letters=letters,
            wrapped="".join(c for c in letters[3:] if machine.axes[c.lower()].wrapped),
            unit=unit,
            feed_unit=unit,
            path_control=PathControl[machine.path_control.upper()],
            systems={system_code(n): System(_vector(at, letters)) for n, at in machine.work_offsets.items()},
            homes={_HOMES[name]: _vector(place, letters) for name, place in machine.positions.items()},
            tools={n: Tool(_vector(size, letters), diameter) for n, (size, diameter) in tools.items()},
            change_timed=machine.times is not None and machine.times.tool_change is not None,
            **at_zero,
        )
    state.apply_offsets()
    return state


def begins_in_inches(machine: Machine | None) -> bool:
    """True if the machine file says that programs begin in inches."""
    return machine is not None and machine.dialect is not None and machine.dialect.inch


def system_code(name: str) -> int:
    """The code of a work system by its name in a machine file: "g54", "g54.1p3"."""
    first, _, further = name.partition("p")
    return FURTHER_SYSTEMS + int(further) if further else round(10.0 * float(first[1:]))


def system_name(code: int) -> str:
    """A work system as programs write it: G54, G54.1 P3."""
    if code > FURTHER_SYSTEMS:
        return f"G54.1 P{code - FURTHER_SYSTEMS}"
    return f"G{code // 10}" + (f".{code % 10}" if code % 10 else "")


def _vector(given: dict[str, float], letters: Iterable[str]) -> FloatArray:
    return np.array([given.get(letter.lower(), 0.0) for letter in letters])
