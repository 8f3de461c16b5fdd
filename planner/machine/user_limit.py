"""Limits of one's own: beside the axes' limits, what else of a machine may not be exceeded, as a class of
some ten lines.

    class SpindlePower(PathLimit):
        name = "spindle power"

        def velocity(self, at):                       # [mm/s], from the place: a number or an array
            return np.where(at.x < 30.0, 100.0, 40.0)

    class Turntable(JointLimit):
        name, unit = "turntable", "rad"
        velocity, acceleration, jerk, turn = 3.0, 40.0, 2000.0, 2 * np.pi

        def joint(self, at):                          # any smooth function of the position
            return np.arctan2(at.y, at.x)

`PathLimit` bounds velocity, acceleration and jerk along the path by functions of position and direction;
`JointLimit` bounds those of a function q of the position, such as a joint of the kinematics that carry the
tool. Along a path r(s), with ' for d/ds,

    velocity      q' feed                                       <= velocity
    acceleration  q' u + q'' feed^2                             <= acceleration
    jerk          q' jerk + 3 q'' feed u + q''' feed^3          <= jerk

the same rows as an axis has; q', q'', q''' follow from r', r'', r''' exactly (base/series.py). The length of
the path is such a q with q' = 1. Between grid points the same measures hold as for the axes: points where the
rows are not close to linear and a margin (feedrate/sampling/user_rows.py), tightening
(planning/optimal/tighten.py). Methods `optimal` and `second-order` plan with these limits; the verdict judges
the motions of all methods by them, from the delivered positions (verifier/other_limits.py).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.series import Series

QUANTITIES = ("velocity", "acceleration", "jerk")
# Below this speed [mm/s] the direction of a motion is rounding, and what it does along its path is not told.
AT_REST = 1e-6


class Place:
    """n places on a path: `x`, `y` ... [mm], `direction`, the unit tangent there (n, A), for limits that
    depend on it, and `block`, the program's block there (n,), where it is known."""

    def __init__(
        self, axes: tuple[str, ...], columns: Sequence[Any], direction: FloatArray, block: Array | None = None
    ):
        self.axes, self.direction, self.block = axes, direction, block
        self._columns = dict(zip(axes, columns, strict=True))

    def __getattr__(self, letter: str) -> Any:
        if letter.startswith("_") or letter not in self._columns:
            raise AttributeError(f"a place has no '{letter}'; there are {', '.join(self.axes)} and direction")
        return self._columns[letter]


class OwnLimit(Protocol):
    """The protocol of a limit, for planner and judge. Built-in ones may have `bounded`, those of `QUANTITIES`
    that they bound, and `searched`, False where the joint search cannot keep them."""

    name: str  # what the verdict calls it: "velocity.NAME", "acceleration.NAME", "jerk.NAME"
    unit: str  # of q
    turn: float | None  # by which q may jump as it starts again, 2 pi of an arctan2; None where it does not

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """Largest velocity, acceleration and jerk at the places; inf where nothing limits."""
        ...

    def value(self, at: Place) -> Any:
        """q at the places; None where it is the length of the path."""
        ...


class PathLimit:
    """Bounds on speed, acceleration and jerk along the path; override those that are bounded."""

    name: str = ""
    unit: str = "mm"
    turn: float | None = None
    counts: ClassVar[tuple[str, ...] | None] = None  # the axes whose common way it is; None: all

    def velocity(self, at: Place) -> Any:
        """Largest speed [mm/s] at the places (n,)."""
        return np.inf

    def acceleration(self, at: Place) -> Any:
        """Largest acceleration along the path, and deceleration [mm/s2]."""
        return np.inf

    def jerk(self, at: Place) -> Any:
        """Largest jerk along the path [mm/s3]."""
        return np.inf

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """Largest velocity, acceleration and jerk along the path [mm/s, mm/s2, mm/s3]."""
        return self.velocity(at), self.acceleration(at), self.jerk(at)

    def value(self, at: Place) -> None:
        """None: the length of the path."""
        return None


class JointLimit(ABC):
    """Bounds on velocity, acceleration and jerk of a function of the position; inf for none."""

    name: str = ""
    unit: str = "mm"
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
    turn: float | None = None

    @abstractmethod
    def joint(self, at: Place) -> Any:
        """q at the places, computed with numpy from `at.x`, `at.y` ...: it is called with arrays, and with
        their derivatives (base/series.py), so that it may use operators and numpy's functions, but no
        conditions."""

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """Largest velocity, acceleration and jerk of q, the same everywhere [`unit`/s, /s2, /s3]."""
        return self.velocity, self.acceleration, self.jerk

    def value(self, at: Place) -> Any:
        """q at the places (n,) [`unit`]."""
        return self.joint(at)

    @property
    def constant(self) -> bool:
        """Whether the bounds are the same everywhere."""
        return type(self).bounds is JointLimit.bounds


class ScaledLimit:
    """A limit with `factor` times the bounds of one of its `QUANTITIES`, else the same."""

    def __init__(self, limit: OwnLimit, quantity: str, factor: float):
        self.name, self.unit, self.turn = limit.name, limit.unit, limit.turn
        self.counts, self.constant = getattr(limit, "counts", None), getattr(limit, "constant", False)
        self._limit, self._which, self._factor = limit, QUANTITIES.index(quantity), factor

    def bounds(self, at: Place) -> tuple[Any, Any, Any]:
        """Velocity, acceleration and jerk of the limit at the places, the scaled one times `factor`."""
        bounds = list(self._limit.bounds(at))
        bounds[self._which] = bounds[self._which] * self._factor
        return tuple(bounds)

    def value(self, at: Place) -> Any:
        """q of the limit at the places; scaling does not change it."""
        return self._limit.value(at)


def check_names(limits: Sequence[OwnLimit], taken: Sequence[str]) -> None:
    """Raise InputError unless every limit has a name of its own."""
    for limit in limits:
        if isinstance(limit, type):
            raise InputError(f"limits: {limit.__name__} is a class; give an object of it, {limit.__name__}()")
        for method in ("bounds", "value"):
            if not callable(getattr(limit, method, None)):
                said = f"limits: {limit!r} is not a limit; derive its class from PathLimit or JointLimit"
                raise InputError(said)
        if not limit.name or "." in limit.name:
            said = f"limits: {type(limit).__name__} is called '{limit.name}'; a name without dots is needed"
            raise InputError(said)
        if limit.name in taken or sum(limit.name == other.name for other in limits) > 1:
            said = f"limits: the name '{limit.name}' is taken; axes and limits need names of their own"
            raise InputError(said)


def bounds_at(limit: OwnLimit, at: Place, count: int) -> FloatArray:
    """(n, 3) bounds of velocity, acceleration and jerk at n = `count` places, in the limit's unit and s. Raises
    InputError for one that is not above 0, with its place, and for an array of another shape than (n,)."""
    found = np.empty((count, 3))
    for k, bound in enumerate(limit.bounds(at)):
        said = f"limit '{limit.name}': {QUANTITIES[k]}"
        if np.ndim(bound) and np.shape(bound) != (count,):
            shape = np.shape(bound)
            raise InputError(
                f"{said} has the shape {shape}; it must be one number, or one for each of the {count} places"
            )
        found[:, k] = bound
        if not (found[:, k] > 0.0).all():
            worst = int((~(found[:, k] > 0.0)).argmax())
            where = " ".join(f"{letter}{np.atleast_1d(getattr(at, letter))[worst]:.6g}" for letter in at.axes)
            raise InputError(f"{said} {found[worst, k]:.6g} at {where}; it must be positive")
    return found


class Moving(NamedTuple):
    """A motion through n places: their `Place` with derivatives, and the motion (4, n, A) itself."""

    place: Place
    table: FloatArray

    @classmethod
    def of(cls, axes: tuple[str, ...], motion: Sequence[FloatArray]) -> Moving:
        """Of a `motion`, 4 arrays (n, A): the position and its derivatives with respect to anything."""
        table = np.stack(motion)
        return cls(Place(axes, [Series(table[:, :, k]) for k in range(len(axes))], table[1]), table)


def limit_derivatives(limit: OwnLimit, moving: Moving) -> FloatArray:
    """(3, n) the first three derivatives of q with respect to what those of the motion are. Raises InputError where they are not
    finite."""
    found, table, axes = limit.value(moving.place), moving.table, moving.place.axes
    if found is None:
        counts = np.isin(axes, getattr(limit, "counts", None) or axes)
        return along_path(*table[1:, :, counts])[0]
    if not isinstance(found, Series):
        return np.zeros((3, table.shape[1]))  # a constant
    if not np.isfinite(found.derivatives).all():
        worst = int((~np.isfinite(found.derivatives)).any(axis=0).argmax())
        where = " ".join(f"{a}{x:.6g}" for a, x in zip(axes, table[0, worst], strict=True))
        raise InputError(f"limit '{limit.name}': its joint has no derivatives at {where}")
    return found.derivatives[1:]


def along_path(
    velocity: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(3, n) speed, acceleration and jerk along the path of a motion, and its direction (n, A); none at rest.

    velocity, acceleration, jerk : (n, A) of the axes [mm/s], [mm/s2], [mm/s3]
    """
    speed = np.linalg.norm(velocity, axis=1)
    moving = speed > AT_REST
    direction = np.divide(velocity, speed[:, None], out=np.zeros_like(velocity), where=moving[:, None])
    along = (acceleration * direction).sum(axis=1)
    across_sq = ((acceleration - along[:, None] * direction) ** 2).sum(axis=1)
    turning = np.divide(across_sq, speed, out=np.zeros_like(speed), where=moving)
    change = np.where(moving, (jerk * direction).sum(axis=1) + turning, 0.0)
    return np.stack([speed, along, change]), direction
