"""What commands of printers and settings of grbl set: speed factors, limits, coordinates and kept states.

    M220 S50            F of what follows counts half; B keeps the factor, R brings it back (Marlin); Klipper and RepRapFirmware too
    M201, M202 X Y Z E  accelerations of axes [units/s2]; M202 those of Repetier's travels
    M203 X Y Z E        speeds of axes: in units/s in Marlin, in units/min in RepRapFirmware, whose numbers go beyond `PER_MINUTE`
    M204 S, P, T        acceleration along the path [units/s2], of printing and travelling moves; R of the extruder alone
    SET_VELOCITY_LIMIT  VELOCITY and ACCEL of Klipper, along the path
    $110= to $125=      speeds [mm/min, deg/min] and accelerations of grbl's axes

Rotary and second axes have their letters there; of rotary ones they are in degrees, in programs in inch too.
A factor is one of F and holds block by block. Limits are those of a machine, which is one for the whole
motion: of all that were in force on a move the lowest holds throughout, which keeps each of them, and is said
first where they change on the way. A limit of the acceleration along the path is one of every axis: on a
diagonal the axes' own let the path have up to sqrt(3) of it, which is said too. Limits above the machine's
change nothing.

Commands of printers that set coordinates, keep the state of a program or bring it back.

    SET_GCODE_OFFSET Z=0.1, Z_ADJUST=0.05    shifts what follows; with MOVE=1 the head goes along, at MOVE_SPEED [mm/s]
    SET_KINEMATIC_POSITION X=0               what the place of the head is called
    SAVE_GCODE_STATE NAME=a                  keeps G90 and G91, offsets, F, its factor (M220) and the place
    RESTORE_GCODE_STATE NAME=a MOVE=1        brings them back; with MOVE=1 the head goes to the place, at MOVE_SPEED
    G60 S0, G61 S0 X Y F                     keeps the place, goes back to it (Marlin), with the axes named, or all

How E counts is kept and brought back in extruder.py, by the `marks` of these commands.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.machine import EXTRUDER, ROTARY_AXES, Machine
from planner.machine.parts import TOLERANCE_MIN
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings
from planner.nc.moves import WordFault
from planner.nc.printer import OFFSET, PLACE, RESTORE, SAVE
from planner.nc.program import MOVES, Kind, SetLimit
from planner.nc.reading import MARLIN, REPRAP
from planner.nc.settings import CORNERS, GRBL, PRINTER_FEED, SMOOTHNESS, VELOCITY_LIMIT, Setting
from planner.nc.state import State

SPEED_FACTOR, SPEEDS, ACCELERATIONS, ALONG_PATH = "M220", "M203", ("M201", "M202"), "M204"
# From this value on M203 is in units per minute: no printer moves at a metre a second, and RepRapFirmware's x
# and y are above 17 mm/s.
PER_MINUTE = 1000.0
EVERY_AXIS = "xyzabcuvw"
_AXES = EVERY_AXIS + EXTRUDER
_LIMITING = ("velocity", "accel")
FEED = "feed"  # what VELOCITY bounds beside the axes
_XYZ = "xyz"
_Kept = tuple[State, FloatArray]  # what SAVE_GCODE_STATE and G60 keep, with the `shift` of SET_GCODE_OFFSET


class LimitsInForce:
    """The limits in force, and of those that were so on a move the lowest.

    dialect : as `Reading.dialect`, which tells the unit of M203
    """

    def __init__(self, dialect: str) -> None:
        self._dialect = dialect
        self.factors: list[tuple[int, float]] = []  # by which F counts from a row on, as M220 sets them
        self._now: dict[tuple[str, str], float] = {}
        self._seen: list[dict[tuple[str, str], float]] = []  # on moves
        self._blocks = 0  # that were looked at
        self._line = self._along = 0  # of the first that is set, of the first acceleration along the path
        self._kept_factor = 1.0  # factor that M220 B keeps

    def take(self, setting: Setting, state: State, table: BlockTable, line: int, findings: Findings) -> None:
        """Execute a command. Raises WordFault for a value that is not positive."""
        self._look(table)
        name = setting.name
        if name == VELOCITY_LIMIT and any(map(math.isnan, setting.values.values())):
            raise WordFault(setting.word, f"{VELOCITY_LIMIT} needs numbers, such as ACCEL=5000")
        given = {key: value for key, value in setting.values.items() if not math.isnan(value)}
        for key, value in given.items():
            if not (value > 0.0 or (name == VELOCITY_LIMIT and key not in _LIMITING)):
                raise WordFault(setting.word, f"{name} {key.upper()} must be positive, found {value:g}")
        if name == SMOOTHNESS:
            state.tolerance = max(given["e"] * state.unit, TOLERANCE_MIN)
            findings.note("E of G187 is the tolerance of what follows", line)
        elif name == SPEED_FACTOR:
            given = setting.values
            if "b" in given:
                self._kept_factor = state.feed_factor
            factor = self._kept_factor if "r" in given else state.feed_factor
            factor = given["s"] / 100.0 if given.get("s", 0.0) > 0.0 else factor
            state.feed *= factor / state.feed_factor
            state.feed_factor = factor
            self.factors.append((table.frame, factor))
        else:
            self._line = self._line or line
            self._take_limits(name, given, state.unit, line, findings)

    def throughout(
        self, table: BlockTable, machine: Machine | None, findings: Findings
    ) -> tuple[SetLimit, ...]:
        """The limits that hold throughout, and what is to be said of them."""
        self._look(table)
        if not self._line:
            return ()
        lowest: dict[tuple[str, str], float] = {}
        for seen in self._seen:
            lowest |= {key: min(value, lowest.get(key, math.inf)) for key, value in seen.items()}
        limits = tuple(SetLimit(quantity=q, axis=a, value=v) for (q, a), v in sorted(lowest.items()))
        if len(self._seen) > 1:
            text = (
                "the program changes its limits of speed or acceleration on the way: the lowest of each holds throughout, and what "
                "has higher ones takes longer than on the machine"
            )
            findings.assume(text, self._line)
        elif limits:
            text = "limits that the program sets hold where they are lower than the machine's"
            findings.note(text, self._line)
        if self._along and (machine is None or limited(machine, limits) is not machine):
            text = "an acceleration along the path (M204, ACCEL) limits each axis: a diagonal may have up to 1.7 times as much"
            findings.assume(text, self._along)
        if machine is not None and limited(machine, limits, above=True) is not machine:
            findings.assume("the program sets limits above those of the machine file, which hold", self._line)
        return limits

    def _look(self, table: BlockTable) -> None:
        kinds = table.block.kind[self._blocks : table.blocks]
        self._blocks = table.blocks
        if np.isin(kinds, MOVES).any() and self._now not in self._seen:
            self._seen.append(dict(self._now))

    def _take_limits(
        self, name: str, given: Mapping[str, float], unit: float, line: int, findings: Findings
    ) -> None:
        if name == SPEEDS:
            known = self._dialect in (MARLIN, REPRAP)
            per_minute = self._dialect == REPRAP or (
                not known and max(given.values(), default=0.0) >= PER_MINUTE
            )
            unit_of = "minute, as RepRapFirmware has them" if per_minute else "second, as Marlin has them"
            if not known:
                findings.assume(f"speeds of {SPEEDS} are read per {unit_of}", line)
            self._set("velocity", given, unit, SECONDS_PER_MINUTE if per_minute else 1.0)
        elif name in ACCELERATIONS:
            self._set("acceleration", given, unit)
        elif name == ALONG_PATH:
            of_path = [given[key] for key in "spt" if key in given]
            if len(set(of_path)) > 1:
                findings.assume(f"of S, P and T of {name} the lowest holds for every move", line)
            if of_path:
                self._along = self._along or line
                self._set("acceleration", dict.fromkeys(EVERY_AXIS, min(of_path)), unit)
            if "r" in given:
                self._set("acceleration", {"e": given["r"]}, unit)
        elif name == VELOCITY_LIMIT:
            if "accel" in given:
                self._along = self._along or line
                self._set("acceleration", dict.fromkeys(EVERY_AXIS, given["accel"]))
            if "velocity" in given:
                self._set("velocity", dict.fromkeys(EVERY_AXIS, given["velocity"]))
                self._set(FEED, {"": given["velocity"]})
            if rest := sorted(given.keys() - {*_LIMITING}):
                findings.assume(f"{', '.join(rest).upper()} of {VELOCITY_LIMIT}: {CORNERS}", line)
        else:
            quantity, axis = GRBL[name]
            per = SECONDS_PER_MINUTE if quantity == "velocity" else 1.0
            self._set(quantity, {axis: given[""]}, per=per)

    def _set(self, quantity: str, values: Mapping[str, float], unit: float = 1.0, per: float = 1.0) -> None:
        """Values by axis, in units of so many mm, or degrees, per so many seconds."""
        for axis, value in values.items():
            if axis in _AXES or quantity == FEED:
                self._now[quantity, axis] = value * (1.0 if axis in ROTARY_AXES else unit) / per


def limited(machine: Machine, limits: Sequence[SetLimit], *, above: bool = False) -> Machine:
    """The machine, with the limits of a program where they are lower; with `above` those that are higher."""
    axes, feed_max = dict(machine.axes), machine.feed_max
    of_two = max if above else min
    for limit in limits:
        if limit.quantity == FEED:
            feed_max = limit.value if feed_max is None else of_two(feed_max, limit.value)
        elif limit.axis in axes:
            axis = axes[limit.axis]
            value = of_two(getattr(axis, limit.quantity), limit.value)
            axes[limit.axis] = axis.model_copy(update={limit.quantity: value})
    if axes == dict(machine.axes) and (feed_max == machine.feed_max or above):
        return machine
    return machine.model_copy(update={"axes": axes, "feed_max": feed_max})


class SavedStates:
    """States by their names; `shift` (3,) is that of SET_GCODE_OFFSET [mm]."""

    def __init__(self) -> None:
        self.kept: dict[str, _Kept] = {}
        self.shift = np.zeros(3)
        self.marks: list[tuple[int, str, bool]] = []  # row, name, and whether the state is brought back

    def take(self, setting: Setting, state: State, table: BlockTable, line: int) -> None:
        """Execute a command. Raises WordFault for a state that was not kept."""
        name, given = setting.name, setting.values
        if name in (SAVE, "G60"):
            kept = replace(state, position=state.position.copy(), g92=state.g92.copy())
            self.kept[name[0] + setting.slot] = kept, self.shift.copy()
            if name == SAVE:
                self.marks.append((table.frame, setting.slot, False))
        elif name in (RESTORE, "G61"):
            back = self.kept.get({RESTORE: "S", "G61": "G"}[name] + setting.slot)
            if back is None:
                raise WordFault(setting.word, f"{name} of a state that was not kept before it")
            self._restore(setting, back, state, table, line)
        elif name == PLACE:
            here = state.programmed()
            for axis, letter in enumerate(_XYZ):
                if letter in given:
                    state.g92[axis] += here[axis] - given[letter]
            state.apply_offsets()
        elif name == OFFSET:
            shift = self.shift.copy()
            for axis, letter in enumerate(_XYZ):
                shift[axis] = given.get(letter, shift[axis] + given.get(f"{letter}_adjust", 0.0))
            by, self.shift = shift - self.shift, shift
            state.g92[:3] += by
            state.apply_offsets()
            if given.get("move"):
                target = state.position.copy()
                target[:3] += by
                _go(target, given.get("move_speed"), state, table, line)

    def homed(self, axes: list[int], state: State) -> None:
        """What G92 has set of axes ends where they are homed, as Klipper and Marlin have it."""
        state.g92[axes] = self.shift[axes]
        state.apply_offsets()

    def _restore(self, setting: Setting, kept: _Kept, state: State, table: BlockTable, line: int) -> None:
        given, (back, shift) = setting.values, kept
        if setting.name == "G61":
            speed = given["f"] * state.unit / SECONDS_PER_MINUTE if "f" in given else None
            target = state.position.copy()
            axes = [axis for axis, letter in enumerate(_XYZ) if letter in given] or [0, 1, 2]
            target[axes] = back.position[axes]
            _go(target, speed, state, table, line)
            return
        self.marks.append((table.frame, setting.slot, True))
        state.absolute, self.shift = back.absolute, shift.copy()
        state.g92[:] = back.g92
        state.apply_offsets()
        state.feed, state.feed_unit, state.feed_factor = back.feed, back.feed_unit, back.feed_factor
        if given.get("move"):
            _go(back.position, given.get("move_speed"), state, table, line)


def _go(target: FloatArray, speed: float | None, state: State, table: BlockTable, line: int) -> None:
    """A straight move at a speed [mm/s], or at F where None is given."""
    before = state.feed
    state.feed = speed or before or PRINTER_FEED
    state.position[:] = target
    table.add(Kind.LINE, line, state)
    state.feed = before
