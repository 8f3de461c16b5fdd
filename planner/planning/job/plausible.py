"""Numbers that are allowed and hardly meant: other units, a tolerance longer than the blocks.

A machine file in m, mm/min or ms is valid, and its plan passes every check. So a note asks.
"""

import numpy as np

from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.geometry.toolpath import Toolpath
from planner.machine import LINEAR_AXES, Machine
from planner.nc.points import in_inches, own_text
from planner.nc.program import Program

# Velocities [mm/s] outside of which a number is rather in m/s (6 m/h) or in mm/min (900 m/min).
VELOCITY_MIN, VELOCITY_MAX = 1.67, 15_000.0
# Times to build up the acceleration, acceleration / jerk [s]; of built-in machines 0.01 to 0.04.
RAMP_MIN, RAMP_MAX = 2.5e-4, 0.5
PERIOD_MIN, PERIOD_MAX = 1e-5, 0.05  # interpolation periods [s]: one of 1 is rather 1 ms


def unit_notes(machine: Machine) -> list[str]:
    """Sentences on numbers of a machine that are rather in other units."""
    notes = []
    for letter in LINEAR_AXES:
        if letter not in machine.axes:
            continue
        axis = machine.axes[letter]
        if not VELOCITY_MIN <= axis.velocity <= VELOCITY_MAX:
            unit = "m/s" if axis.velocity < VELOCITY_MIN else "mm/min"
            notes.append(f"axis {letter} has a velocity of {axis.velocity:g} mm/s: is the number in {unit}?")
        ramp = axis.acceleration / axis.jerk
        if not RAMP_MIN <= ramp <= RAMP_MAX:
            notes.append(
                f"axis {letter} takes {ramp:.3g} s to build up its acceleration of {axis.acceleration:g} mm/s2 with a jerk of "
                f"{axis.jerk:g} mm/s3: are both in mm and s?"
            )
    if not PERIOD_MIN <= machine.dt <= PERIOD_MAX:
        unit = "ms" if machine.dt > PERIOD_MAX else "another unit"
        notes.append(f"the interpolation period dt is {machine.dt:g} s: is the number in {unit}?")
    return notes


def inch_notes(program: Program, machine: Machine) -> list[str]:
    """A sentence where a program in inches asks for more than any axis can: it may be one in mm."""
    fed = np.where(np.isfinite(program.feed), program.feed, 0.0)
    most = max((machine.axes[axis].velocity for axis in LINEAR_AXES if axis in machine.axes), default=np.inf)
    if fed.max(initial=0.0) <= most or not in_inches(program, own_text(program) or b""):
        return []
    k, unit = int(fed.argmax()), MM_PER_INCH / SECONDS_PER_MINUTE
    return [
        f"line {program.line[k]}: F{fed[k] / unit:.5g} in inches (G20) is more than any axis can, {most / unit:.5g} in/min: is the "
        "program in mm (G21)?"
    ]


def short_block_notes(toolpath: Toolpath) -> list[str]:
    """A sentence if most of the blocks that cut are shorter than the tolerance, which may round them away."""
    cutting = ~toolpath.rapid
    if not cutting.any():
        return []
    tolerance = float(toolpath.tolerance.max())
    middle = float(np.median(toolpath.length[cutting]))
    if middle >= tolerance:
        return []
    return [
        f"half of the blocks are not longer than {middle:.3g} mm, and the tolerance is {tolerance:g} mm: details of their size may "
        "be rounded away"
    ]
