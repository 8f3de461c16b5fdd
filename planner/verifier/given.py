"""The state of knowledge about a trajectory: which numbers were delivered, and to how many digits."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.base.arrays import FloatArray, freeze
from planner.base.errors import InputError
from planner.geometry.toolpath import Toolpath
from planner.machine import ROTARY_AXES
from planner.motion.trajectory import Trajectory
from planner.verifier.matching import STILL

DERIVATIVES = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False, kw_only=True)
class Given:
    """How much of a trajectory was given, and how exactly; without arguments all of it, in float64."""

    # derivatives that were delivered; the others were derived from the positions by whoever read them, which alone are judged
    columns: tuple[str, ...] = DERIVATIVES
    position_rounding: (
        FloatArray | tuple[float, ...]
    ) = ()  # (A,) largest error by the digits [mm, rad], or () for none
    time_rounding: float = 0.0  # the same of every time [s]
    end_rounding: float = 0.0  # of the last time alone [s]: the others may lie on a grid, and be known by it
    extruder_rounding: float = 0.0  # largest error of the extruder's place by its digits [mm of filament]

    def __post_init__(self) -> None:
        freeze(self, "position_rounding", float, (None,))
        if unknown := ", ".join(sorted(set(self.columns) - set(DERIVATIVES))):
            raise ValueError(f"Given.columns: {unknown}; there are {', '.join(DERIVATIVES)}")


WHOLE = Given()


def fit_axes(
    trajectory: Trajectory, given: Given, toolpath: Toolpath
) -> tuple[Trajectory, Given, tuple[str, ...]]:
    """The trajectory and what is given of it, with the program's axes in its order; and what was done.

    An axis that the program does not move may be missing: it stands where the program has it. One that the program does
    not have is left out if it stands still. Raises InputError for other missing axes, and others that the program lacks.
    """
    trajectory, given = _at_radius(trajectory, given, toolpath.radius)
    if trajectory.axes == toolpath.axes:
        return trajectory, given, ()
    notes = []
    for k, letter in enumerate(trajectory.axes):
        if letter not in toolpath.axes:
            moved = float(np.ptp(trajectory.position[:, k]))
            if moved > STILL:
                raise InputError(
                    f"the trajectory moves {letter} by {moved:.6g}, an axis that the program and its machine do not have "
                    f"({' '.join(toolpath.axes)})"
                )
            notes.append(f"{letter} stands still; the program and its machine do not have it")
    columns: dict[str, Any] = {
        name: np.zeros((len(trajectory), len(toolpath.axes))) for name in ("position", *DERIVATIVES)
    }
    rounding = np.zeros(len(toolpath.axes))
    for k, letter in enumerate(toolpath.axes):
        if letter in trajectory.axes:
            own = trajectory.axes.index(letter)
            for name, column in columns.items():
                column[:, k] = getattr(trajectory, name)[:, own]
            rounding[k] = given.position_rounding[own] if len(given.position_rounding) else 0.0
            continue
        stands = _standing(toolpath, k)
        if stands is None:
            found = f"found are the axes {' '.join(trajectory.axes)}"
            raise InputError(f"column '{letter}' is missing: the program moves {letter}; {found}")
        notes.append(f"{letter} is missing, and stands at {stands:g} as in the program")
        columns["position"][:, k] = stands
    fitted = dataclasses.replace(trajectory, axes=toolpath.axes, **columns)
    return fitted, dataclasses.replace(given, position_rounding=rounding), tuple(notes)


def _at_radius(trajectory: Trajectory, given: Given, radius: float) -> tuple[Trajectory, Given]:
    """The trajectory with its angles as lengths at another radius [mm]."""
    if trajectory.radius == radius or not set(trajectory.axes) & set(ROTARY_AXES):
        return dataclasses.replace(trajectory, radius=radius), given
    scale = np.array([radius / trajectory.radius if a in ROTARY_AXES else 1.0 for a in trajectory.axes])
    columns = {name: getattr(trajectory, name) * scale for name in ("position", *DERIVATIVES)}
    if len(given.position_rounding):
        given = dataclasses.replace(given, position_rounding=np.asarray(given.position_rounding) * scale)
    return dataclasses.replace(trajectory, radius=radius, **columns), given


def _standing(toolpath: Toolpath, axis: int) -> float | None:
    """Where the axis stands [mm], or None if the program moves it."""
    place = float(toolpath.start[0, axis])
    arcs = toolpath.arcs
    still = (toolpath.start[:, axis] == place).all() and (toolpath.end[:, axis] == place).all()
    flat = not any(getattr(arcs, name)[:, axis].any() for name in ("e1", "e2", "drift"))
    flat &= not np.ptp(toolpath.curves.points[:, :, axis], axis=1).any()
    return place if still and flat else None
