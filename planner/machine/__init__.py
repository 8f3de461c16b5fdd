"""The machine: limits of the axes, interpolation period, tolerance, filters. Read from TOML, checked, frozen.

    parts.py    records of the tables of a machine file, [kinematics] among them
    whole.py    `Machine`, the record of all of them, and its faults in words
    files.py    machine files and built-in machines

Files and records are in mm, s and, for rotary axes, degrees; `Machine.limits` returns lengths at
`Machine.radius`. `planner machine init FILE` writes a template with every key and its unit.
"""

from planner.machine.files import builtin_machines, builtin_text, load_machine, machine_from_dict
from planner.machine.parts import (
    Axis,
    ControlData,
    DialectData,
    Fir,
    KinematicsData,
    Mode,
    Plotter,
    Times,
    ToolData,
)
from planner.machine.whole import (
    ALL_AXES,
    EXTRUDER,
    LINEAR_AXES,
    PARALLEL_AXES,
    ROTARY_AXES,
    TANGENTIAL,
    WORK_OFFSETS,
    Machine,
)

__all__ = [
    "ALL_AXES",
    "EXTRUDER",
    "LINEAR_AXES",
    "PARALLEL_AXES",
    "ROTARY_AXES",
    "TANGENTIAL",
    "WORK_OFFSETS",
    "Axis",
    "ControlData",
    "DialectData",
    "Fir",
    "KinematicsData",
    "Machine",
    "Mode",
    "Plotter",
    "Times",
    "ToolData",
    "builtin_machines",
    "builtin_text",
    "load_machine",
    "machine_from_dict",
]
