"""Records of the tables of a machine file, in mm, s and, for rotary axes, degrees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

M_DIGITS = 5  # of an M code: no control has more
# Keys of [times].
TIMED_BY_NAME = {3: "spindle_start", 4: "spindle_start", 5: "spindle_stop", 6: "tool_change"}

# Smallest and largest magnitude of a number of a machine file, in the unit of its key: products and quotients
# of what machines have are numbers then.
MAGNITUDE_MIN, MAGNITUDE_MAX = 1e-12, 1e12
# Smallest tolerance [mm], finer than a machine follows. The shorter the way through a corner, the shorter the
# steps in which its feed is sought: `planner plan` takes 1.4 CPU s for two blocks with 1e-5 mm, 28 with 1e-6,
# and 53 with 1e-7.
TOLERANCE_MIN = 1e-5
# Of velocities and accelerations, 1e5 times gravity [mm/s, mm/s2]: how closely the verifier looks between
# samples, and how long it takes, grows with the acceleration.
AXIS_LIMIT_MAX = 1e9


def _up_to(largest: float, least: float = MAGNITUDE_MIN) -> Callable[[float], float]:
    """A check that a number is 0 or of a magnitude between `least` and `largest`."""

    def checked(value: float) -> float:
        if value and not least <= abs(value) <= largest:
            raise ValueError(f"must be of a magnitude between {least:g} and {largest:g}, found {value:g}")
        return value

    return checked


Finite = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_up_to(MAGNITUDE_MAX))]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), AfterValidator(_up_to(MAGNITUDE_MAX))]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(_up_to(MAGNITUDE_MAX))]
Tolerance = Annotated[
    float, Field(gt=0, allow_inf_nan=False), AfterValidator(_up_to(MAGNITUDE_MAX, TOLERANCE_MIN))
]
AxisLimit = Annotated[float, Field(gt=0, allow_inf_nan=False), AfterValidator(_up_to(AXIS_LIMIT_MAX))]


class Record(BaseModel):
    """Frozen, without other keys than its own. To set one raises AttributeError, which says how to make another record."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)

    def __setattr__(self, name: str, value: object) -> None:
        if name in type(self).model_fields:
            raise AttributeError(
                f"{type(self).__name__}.{name} cannot be set: records do not change; make another one with "
                f"model_copy(update={{'{name}': {value!r}}})"
            )
        super().__setattr__(name, value)


class Axis(Record):
    """Limits of one axis: velocity [mm/s], acceleration [mm/s2], jerk [mm/s3]; in degrees for rotary axes.

    power   : of its drive, speed times acceleration, for each kg that it moves [W/kg], or None; of a rotary
              axis for each kg m2 of its moment of inertia [W/(kg m2)]
    wrapped : of a rotary axis: programs give its positions within a turn, with the sign of the direction
              (LinuxCNC's WRAPPED_ROTARY)
    travel_min, travel_max : ends of its travel in machine coordinates [mm, deg], or None
    """

    velocity: AxisLimit
    acceleration: AxisLimit
    jerk: Positive
    power: Positive | None = None
    wrapped: bool = False
    travel_min: Finite | None = None
    travel_max: Finite | None = None

    @model_validator(mode="after")
    def _ends_in_order(self) -> Axis:
        low, high = self.travel_min, self.travel_max
        if low is not None and high is not None and not low < high:
            raise ValueError(f"travel_min {low:g} must be below travel_max {high:g}")
        return self


class Fir(Record):
    """Moving averages in series in the drives or in the control, behind the delivered setpoints.

    The motion behind them stays within the tolerance, whatever the method. Filters by which a method makes
    its setpoints are a setting of that method instead.

    time_constants : their lengths [s], any number, in any order
    phase_lag_max  : largest turning of the path within half of their delay, kappa feed sum T / 2 [deg]; kept by methods
                     `optimal` and `second-order` everywhere, by `bezier` at its corners, by the others not
    """

    time_constants: Annotated[tuple[Positive, ...], Field(min_length=1)]
    phase_lag_max: Positive | None = None


class Mode(Record):
    """A vibration mode of the machine: frequency [Hz], damping ratio [-]."""

    frequency: Positive
    damping: Annotated[float, Field(ge=0, lt=1)] = 0.0


class Plotter(Record):
    """How plotter files (HPGL) are read: length of a plotter unit [mm], standstills while the pen or knife
    goes down and up [s]."""

    unit: Positive = 0.025
    pen_down: NotNegative = 0.0
    pen_up: NotNegative = 0.0


class ToolData(Record):
    """A tool: length (along z) and offset along x (lathes), which G43 adds, and diameter, which G41 and G42
    use [mm]. What F and S are compared with (planning/job/notes.py): its number of `flutes`,
    `feed_per_tooth_max` [mm], `surface_speed_max` [m/min] and `spindle_max` [1/min], or None."""

    length: Finite = 0.0
    x: Finite = 0.0
    diameter: NotNegative = 0.0
    flutes: Annotated[int, Field(gt=0)] | None = None
    feed_per_tooth_max: Positive | None = None
    surface_speed_max: Positive | None = None
    spindle_max: Positive | None = None

    @model_validator(mode="after")
    def _what_limits_need(self) -> ToolData:
        for key, needed in (("feed_per_tooth_max", "flutes"), ("surface_speed_max", "diameter")):
            if getattr(self, key) is not None and not getattr(self, needed):
                raise ValueError(f"{key} needs {needed}")
        return self


class Times(Record):
    """The times of events while the axes stand still, beside dwells [s]; None where it is not known, and left
    out of totals."""

    tool_change: NotNegative | None = None  # M6, with stopping the spindle, and of plotters another pen
    spindle_start: NotNegative | None = None  # M3 and M4, until the spindle turns as it should
    spindle_stop: NotNegative | None = None  # M5, and the stop before it turns the other way
    m_code: NotNegative | None = None  # every other M code that `m_codes` does not name
    # of single codes, such as {"M8": 0.5}; M0, M1 and M60 too, which otherwise wait for a person
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


class DialectData(Record):
    """How the control reads programs: `least_increment` [mm] is the length of a number without a point, or
    None: a whole unit; `lathe` says whether they are a lathe's, or None: their words tell; `inch` whether
    lengths are inches before the first G20 or G21; `subprograms` names those of the machine's builder that
    move nothing."""

    least_increment: Positive | None = None
    lathe: bool | None = None
    inch: bool = False
    subprograms: tuple[str, ...] = ()


class ControlData(Record):
    """The settings of the control's own planner, for predictions of how long it takes
    (controls/timing/models.py); None for its default."""

    name: Literal["grbl", "klipper", "marlin", "reprapfirmware", "linuxcnc"]
    acceleration: Positive | None = None  # largest along the path [mm/s2]: Klipper's max_accel, Marlin's M204
    square_corner_velocity: NotNegative | None = None  # of Klipper, speed at a corner of 90 degrees [mm/s]
    # of Klipper [-]: the share of the way that is not to be sped up and braked on
    minimum_cruise_ratio: Annotated[float, Field(ge=0, lt=1)] | None = None
    junction_deviation: NotNegative | None = None  # of grbl ($11) and Marlin (M205 J) [mm]
    # of Marlin (M205 X Y Z), by axis: the jump of velocity that a corner may have [mm/s]
    corner_jump: dict[str, Positive] = {}
    factor: Positive | None = None  # by which it was measured to be slower than the model of it [-]


XYZAC, XYZBC, HEAD_TABLE, HEAD_HEAD = "xyzac-trt", "xyzbc-trt", "head-table", "head-head"
# What each type has beside the point of rotation and the tool's length.
_OFFSETS, _HEAD = ("x_offset", "y_offset", "z_offset"), ("x_offset", "y_offset", "pivot_length", "tilt")
_KEYS = {XYZAC: _OFFSETS[1:], XYZBC: _OFFSETS[::2], HEAD_TABLE: _HEAD, HEAD_HEAD: _HEAD}
_POINT = ("x_rot_point", "y_rot_point", "z_rot_point")


class KinematicsData(Record):
    """How the rotary axes carry the workpiece and the tool; machine/kinematics/chain.py has the formulas.

    type         : "xyzac-trt", "xyzbc-trt" (both axes turn the table), "head-table" (the head tilts, the
                   table turns about z) or "head-head" (an axis c carries the axis that tilts the tool)
    x_rot_point, y_rot_point, z_rot_point : point on the axis of c where it turns the table, in machine
                                            coordinates [mm]
    x_offset, y_offset, z_offset : tables: from that point to the tilting axis; heads: from the tilting axis
                                   to the tool's axis [mm]
    pivot_length : heads: from the tilting axis down to the spindle's nose [mm]
    tool_length  : where the program names no tool of another length [mm]
    tilt         : heads: letter of the tilting axis, "a" or "b"
    reversed     : letters of axes whose positive direction is the left-handed one
    """

    type: Literal["xyzac-trt", "xyzbc-trt", "head-table", "head-head"]
    x_rot_point: Finite = 0.0
    y_rot_point: Finite = 0.0
    z_rot_point: Finite = 0.0
    x_offset: Finite = 0.0
    y_offset: Finite = 0.0
    z_offset: Finite = 0.0
    pivot_length: NotNegative = 0.0
    tool_length: Finite = 0.0
    tilt: Literal["a", "b"] = "b"
    reversed: tuple[Literal["a", "b", "c"], ...] = ()

    @model_validator(mode="after")
    def _of_this_type(self) -> KinematicsData:
        allowed = _KEYS[self.type]
        for key in (*_OFFSETS, "pivot_length", "tilt"):
            if key in self.model_fields_set and key not in allowed:
                raise ValueError(f"'{key}' is not used by type {self.type}; it has {', '.join(allowed)}")
        for key in _POINT if self.type == HEAD_HEAD else ():
            if key in self.model_fields_set:
                raise ValueError(f"'{key}' is not used by type {self.type}: its table does not turn")
        for letter in self.reversed:
            if letter not in self.rotary:
                raise ValueError(f"reversed: '{letter}' is no axis of type {self.type}; it has {self.axes}")
        return self

    @model_serializer(mode="wrap")
    def _keys_of_this_type(self, written: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The keys that its type has, as they are read again."""
        found: dict[str, Any] = written(self)
        absent = {*_OFFSETS, *_HEAD} - {*_KEYS[self.type]} | {*(_POINT if self.type == HEAD_HEAD else ())}
        return {key: value for key, value in found.items() if key not in absent}

    @property
    def rotary(self) -> tuple[str, str]:
        """Letters of the tilting axis and of the one that turns about z."""
        return {XYZAC: "a", XYZBC: "b"}.get(self.type, self.tilt), "c"

    @property
    def axes(self) -> str:
        """All five letters: "xyzac"."""
        return "xyz" + "".join(self.rotary)
