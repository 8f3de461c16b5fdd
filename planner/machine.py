"""The machine: limits of the axes, interpolation period, tolerance, filters. Read from TOML, checked, frozen.

Files and records are in mm, s and, for rotary axes, degrees; `Machine.limits` returns rad. `planner machine init FILE` writes a
template with every key and its unit.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.base.names import known_name
from planner.base.units import RAD_PER_DEG
from planner.constraints.own import OwnLimit, check_names

LINEAR_AXES = ("x", "y", "z")
ROTARY_AXES = ("a", "b", "c")
M_DIGITS = 5  # of an M code: no control has more
TIMED_BY_NAME = {
    3: "spindle_start",
    4: "spindle_start",
    5: "spindle_stop",
    6: "tool_change",
}  # keys of [times]
TOOL_DIGITS = 9  # of a tool number: more do not fit the 32 bits of a control

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)

    def __setattr__(self, name: str, value: object) -> None:
        if name in type(self).model_fields:
            raise AttributeError(
                f"{type(self).__name__}.{name} cannot be set: records do not change; make another one with "
                f"model_copy(update={{'{name}': {value!r}}})"
            )
        super().__setattr__(name, value)


class Axis(_Record):
    """Limits of one axis: velocity [mm/s], acceleration [mm/s2], jerk [mm/s3]; in degrees for rotary axes."""

    velocity: Positive
    acceleration: Positive
    jerk: Positive


class Fir(_Record):
    """Moving averages in series in the drives or in the control, behind the delivered setpoints.

    The motion behind them stays within the tolerance, whatever the method. Filters by which a method makes its setpoints are a setting
    of that method instead.

    time_constants : their lengths [s], any number, in any order
    phase_lag_max  : largest turning of the path within half of their delay, kappa feed sum T / 2 [deg]; kept by methods `optimal` and
                     `second-order` everywhere and by `bezier` at its corners; the other methods do not use it
    """

    time_constants: Annotated[tuple[Positive, ...], Field(min_length=1)]
    phase_lag_max: Positive | None = None


class Mode(_Record):
    """A vibration mode of the machine: frequency [Hz], damping ratio [-]."""

    frequency: Positive
    damping: Annotated[float, Field(ge=0, lt=1)] = 0.0


class Plotter(_Record):
    """How plotter files (HPGL) are read: length of a plotter unit [mm], standstills while the pen or knife goes down and up [s]."""

    unit: Positive = 0.025
    pen_down: NotNegative = 0.0
    pen_up: NotNegative = 0.0


class ToolData(_Record):
    """A tool: length (along z) and offset along x (lathes), which G43 adds, and diameter, which G41 and G42 use [mm]."""

    length: Finite = 0.0
    x: Finite = 0.0
    diameter: NotNegative = 0.0


class Times(_Record):
    """What takes time while the axes stand still, beside dwells [s]; None where it is not known, and left out of totals.

    tool_change   : M6, with stopping the spindle, and of plotters another pen
    spindle_start : M3 and M4, until the spindle turns as it should
    spindle_stop  : M5, and the stop before it turns the other way
    m_code        : every other M code that `m_codes` does not name
    m_codes       : of single codes, such as {"M8": 0.5}; M0, M1 and M60 too, which otherwise wait for a person
    """

    tool_change: NotNegative | None = None
    spindle_start: NotNegative | None = None
    spindle_stop: NotNegative | None = None
    m_code: NotNegative | None = None
    m_codes: dict[str, NotNegative] = {}

    @field_validator("m_codes")
    @classmethod
    def _codes_known(cls, codes: dict[str, float]) -> dict[str, float]:
        found = {}
        for code, seconds in codes.items():
            name = code.strip().upper().removeprefix("M")
            if not name.isdecimal() or len(name) > M_DIGITS:
                raise ValueError(f"'{code[:10]}' is not an M code; write e.g. M8 = 0.5")
            if int(name) in TIMED_BY_NAME:
                raise ValueError(f"M{int(name)} has a key of its own: {TIMED_BY_NAME[int(name)]}")
            found[f"M{int(name)}"] = seconds
        return found


class DialectData(_Record):
    """How the control reads programs: `least_increment` [mm] is the length of a number without a point, or None: a whole unit; `lathe`
    says whether they are a lathe's, or None: their words tell."""

    least_increment: Positive | None = None
    lathe: bool | None = None


class Machine(_Record):
    """A machine. The template explains every key. Raises InputError for all faults at once.

    name                : of the machine
    axes                : limits by axis letter, at least x and y
    dt                  : interpolation period [s]
    tolerance           : contour tolerance eps [mm]
    path_control        : what holds before the first G61, G61.1 or G64 of a program
    feed_max            : largest feed along the path [mm/s], or None
    feed_default        : feed of moves before the first F word of a program [mm/s], or None: they are refused
    normal_acceleration : largest normal acceleration [mm/s2], A_max of paper 002 eq. (19), or None
    blend_rapids        : whether joints between G0 and feed moves are rounded
    """

    name: str
    dt: Positive
    tolerance: Positive
    path_control: Literal["blend", "exact_path", "exact_stop"] = "blend"
    axes: dict[str, Axis]
    feed_max: Positive | None = None
    feed_default: Positive | None = None
    normal_acceleration: Positive | None = None
    blend_rapids: bool = False
    fir: Fir | None = None
    modes: tuple[Mode, ...] = ()
    plotter: Plotter | None = None
    dialect: DialectData | None = None
    times: Times | None = None
    tools: dict[str, ToolData] = {}
    positions: dict[str, dict[str, Finite]] = {}
    work_offsets: dict[str, dict[str, Finite]] = {}
    _own: tuple[OwnLimit, ...] = PrivateAttr(default=())

    def __init__(self, **data: Any):
        try:
            super().__init__(**data)
        except ValidationError as fault:
            raise InputError(faults_in_words(fault)) from None

    @field_validator("axes")
    @classmethod
    def _axes_known(cls, axes: dict[str, Axis]) -> dict[str, Axis]:
        known = LINEAR_AXES + ROTARY_AXES
        for letter in axes:
            if letter not in known:
                raise ValueError(f"axis '{letter}' is not known; allowed are {', '.join(known)}")
        for letter in ("x", "y"):
            if letter not in axes:
                raise ValueError(f"axis '{letter}' is missing; write a table [axes.{letter}]")
        return {letter: axes[letter] for letter in known if letter in axes}

    @field_validator("tools", mode="before")
    @classmethod
    def _lengths_alone(cls, tools: object) -> object:
        """A number alone is a tool's length."""
        if not isinstance(tools, dict):
            return tools
        return {n: {"length": t} if isinstance(t, int | float | str) else t for n, t in tools.items()}

    @model_validator(mode="after")
    def _names_known(self) -> Machine:
        for table, allowed in (("positions", ("g28", "g30")), ("work_offsets", WORK_OFFSETS)):
            for key, values in getattr(self, table).items():
                if key not in allowed and not (table == "work_offsets" and _FURTHER_OFFSET.fullmatch(key)):
                    raise ValueError(f"{table}: '{key}' is not known; allowed are {', '.join(allowed)}")
                for letter in values:
                    if letter not in LINEAR_AXES:
                        raise ValueError(f"{table}.{key}: axis '{letter}' is not known; allowed are x, y, z")
        for tool in self.tools:
            if not tool.isdecimal() or len(tool) > TOOL_DIGITS:
                raise ValueError(f"tools: '{tool[:TOOL_DIGITS]}' is not a tool number; write e.g. 1 = 25.0")
        return self

    def limits(
        self, quantity: Literal["velocity", "acceleration", "jerk"], axes: tuple[str, ...]
    ) -> FloatArray:
        """Limits (A,) of the axes for one quantity, in mm or rad and s.

        Raises InputError if the machine lacks one of the axes.
        """
        for letter in axes:
            if letter not in self.axes:
                raise InputError(
                    f"machine '{self.name}' has no axis '{letter}', which the program uses; add a table "
                    f"[axes.{letter}] with velocity, acceleration and jerk"
                )
        scale = [RAD_PER_DEG if letter in ROTARY_AXES else 1.0 for letter in axes]
        return np.array([getattr(self.axes[letter], quantity) for letter in axes]) * scale

    @property
    def own(self) -> tuple[OwnLimit, ...]:
        """Limits beside those of a machine file (constraints/own.py)."""
        return self._own

    def with_own(self, limits: Sequence[OwnLimit]) -> Machine:
        """The machine with these limits of one's own, and no others.

        Raises InputError for limits without a name, and for a name that is there already.
        """
        check_names(limits, [*self.axes])
        machine = self.model_copy()
        machine._own = tuple(limits)
        return machine


_FURTHER_OFFSET = re.compile(r"g54\.1p([1-9]|[1-9]\d|[12]\d\d|300)")  # G54.1 P1 to P300
WORK_OFFSETS = ("g54", "g55", "g56", "g57", "g58", "g59", "g59.1", "g59.2", "g59.3")


def load_machine(path: str | Path) -> Machine:
    """Read a machine file, or a built-in machine if the path is a name without a suffix.

    Raises InputError naming file, key, value and what is allowed, for all faults at once.
    """
    if str(path) in builtin_machines():
        text, source = builtin_text(str(path)), str(path)
    else:
        text, source = _read(Path(path)), str(path)
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise InputError("not a machine file: its values are nested too deep", source=source) from None
    except ValueError as fault:  # a TOMLDecodeError, or a number of more digits than Python reads
        raise InputError(f"not valid TOML: {fault}", source=source) from fault
    return machine_from_dict(data, source=source)


def machine_from_dict(data: dict, *, source: str | None = None) -> Machine:
    """A machine from nested dictionaries with the keys of a machine file. Raises InputError for all faults at once."""
    try:
        return Machine(**data)
    except InputError as fault:
        raise InputError(fault.message, source=source) from None
    except TypeError as fault:
        raise InputError(str(fault), source=source) from fault


def builtin_machines() -> tuple[str, ...]:
    """Names of the machines that come with the package."""
    folder = resources.files("planner") / "machines"
    return tuple(sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml")))


def builtin_text(name: str) -> str:
    """The commented TOML of a built-in machine. Raises InputError for an unknown name."""
    if name not in builtin_machines():
        known_name("built-in machine", name, builtin_machines())
    return (resources.files("planner") / "machines" / f"{name}.toml").read_text(encoding="utf-8")


def _read(path: Path) -> str:
    try:
        require_ending(path)
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as fault:
        names = ", ".join(builtin_machines())
        near = difflib.get_close_matches(str(path), builtin_machines(), n=1)
        hint = f" (did you mean '{near[0]}'?)" if near else ""
        raise InputError(
            f"machine file not found; give a TOML file or one of the built-in machines: {names}{hint}",
            source=str(path),
        ) from fault
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(f"machine file cannot be read: {fault}", source=str(path)) from fault


_TABLES: dict[str, type[_Record]] = {
    "axes": Axis,
    "fir": Fir,
    "modes": Mode,
    "plotter": Plotter,
    "dialect": DialectData,
    "times": Times,
    "tools": ToolData,
}


def _near(place: tuple[int | str, ...]) -> str:
    """A key of the same table of a machine file that is spelled nearly like an unknown one, as a question; or nothing."""
    table = Machine if len(place) == 1 else _TABLES.get(str(place[0]))
    near = difflib.get_close_matches(str(place[-1]), table.model_fields if table else (), n=1)
    return f" (did you mean '{near[0]}'?)" if near else ""


# What is needed where pydantic finds a fault of a type; {gt} and so on are its context.
_NEEDED = {
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than": "must be below {lt:g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be a text",
    "literal_error": "must be {expected}",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "tuple_type": "must be a list",
    "too_short": "must have at least {min_length} entry",
}


def faults_in_words(fault: ValidationError) -> str:
    """The faults of a record, each with the key, what is needed and what was found."""
    said = []
    for error in fault.errors():
        key = ".".join(str(part) for part in error["loc"])
        if error["type"] == "missing":
            said.append(f"{key}: missing")
        elif error["type"] == "extra_forbidden":
            said.append(f"{key}: unknown key{_near(error['loc'])}")
        elif error["type"] == "value_error":
            text = error["msg"].removeprefix("Value error, ")
            said.append(f"{key}: {text}" if key else text)
        else:
            needed = _NEEDED.get(error["type"], error["msg"]).format(**error.get("ctx", {}))
            said.append(f"{key}: {needed}, found {error['input']!r}")
    return "; ".join(said)
