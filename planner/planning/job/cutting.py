"""Feeds and speeds of a program over what its tools are allowed: feed per tooth F / (S z), surface speed pi D S,
and S itself, as [tools] of the machine file limits them. They are said, and change nothing of the plan."""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.machine import Machine
from planner.nc.program import FEED_MOVES, Program
from planner.planning.job.beside import codes_of

TOOL_CHANGE, CONSTANT_SURFACE_SPEED = 6, 96
MM_PER_M = 1000.0


def cutting_notes(program: Program, machine: Machine) -> list[str]:
    """A note for each limit of each tool that the programmed F and S exceed: the first line, and by how much at
    most. None under G96, where S is no number of turns."""
    limited = {int(n): tool for n, tool in machine.tools.items() if tool.model_fields_set & {*_UNITS}}
    _, codes = codes_of(program, "G")
    if not limited or (codes == CONSTANT_SURFACE_SPEED).any():
        return []
    block, code = codes_of(program, "M")
    changes = block[code == TOOL_CHANGE]
    named, number = codes_of(program, "T")
    tool = _in_force(len(program), named, number)
    if len(changes):  # a tool that is named cuts from its change on
        chosen = np.append(tool, tool[-1:])[np.minimum(changes, len(tool) - 1)] if len(tool) else tool
        tool = _in_force(len(program), changes, chosen)
    speed = _in_force(len(program), *codes_of(program, "S"))
    cuts = np.isin(program.kind, FEED_MOVES) & (speed > 0)
    cuts[program.synchronised] = False
    notes = []
    for n, data in limited.items():
        on = np.flatnonzero(cuts & (tool == n))
        of_blocks = {
            "feed_per_tooth_max": program.feed[on] * SECONDS_PER_MINUTE / (speed[on] * (data.flutes or 1)),
            "surface_speed_max": np.pi * data.diameter * speed[on] / MM_PER_M,
            "spindle_max": speed[on],
        }
        for key, found in of_blocks.items():
            most = getattr(data, key)
            over = np.flatnonzero(found > (np.inf if most is None else most * (1.0 + ROUNDING)))
            if len(over):
                notes.append(
                    f"line {program.line[on[over[0]]]}: T{n} has {_UNITS[key].format(found[over[0]])}, above its {key} of {most:g} "
                    f"({len(over):,} blocks, at most {found.max():.4g})"
                )
    return notes


ROUNDING = 1e-9  # by its size: of F and S
_UNITS = {
    "feed_per_tooth_max": "{:.4g} mm per tooth",
    "surface_speed_max": "{:.4g} m/min at its diameter",
    "spindle_max": "S{:g}",
}


def _in_force(blocks: int, at: FloatArray, value: FloatArray) -> FloatArray:
    """(B,) the value in force on each block, of those (K,) that begin before the blocks `at` (K,); 0 before."""
    row = np.searchsorted(at, np.arange(blocks), side="right")
    return np.append(0.0, value)[row]
