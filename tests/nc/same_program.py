"""Whether two programs are the same motion, a machine to read them for, and settings of the reader."""

from __future__ import annotations

import numpy as np

from planner.machine import Machine
from planner.nc.program import Program
from planner.nc.reading import Reading

STRICT = Reading(strict=True)
NO_EXTRUDER = Reading(extruder="ignore")
FIELDS = ("kind", "end", "feed", "dwell", "line", "path_control", "arc_block", "arc_center", "arc_sweep")


def machine(**given: object) -> Machine:
    """A machine with three equal axes; the others are keys of a machine file."""
    axes = {a: {"velocity": 100, "acceleration": 1000, "jerk": 1e4} for a in "xyz"}
    return Machine(name="test", dt=1e-3, tolerance=0.05, axes=axes, **given)  # type: ignore[arg-type]


def same_motion(one: Program, other: Program, *, lines: bool = True) -> bool:
    """Whether blocks and arcs are equal to the last bit; `lines`: on the same lines."""
    return all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS if lines or name != "line"
    )
