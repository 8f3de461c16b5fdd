"""G28 and G30: through the intermediate point, if there is one, to the machine's position; and homing by switches."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc import codes, extra_axis_moves, moves, offsets
from planner.nc.block import Block
from planner.nc.block_table import BlockTable
from planner.nc.faults import Findings
from planner.nc.program import Kind
from planner.nc.state import State


def go_home(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """All axes, or those of the block, go to the position of G28 or G30; in a rotated work system those of the system."""
    code, word = block.g["one-shot"], block.at["one-shot"]
    if code not in state.homes:
        findings.assume(
            f"G{codes.number(code)} has no position in the machine file: machine zero", block.line, word
        )
    else:
        offsets.assume_origin(state, f"G{codes.number(code)}", block, findings)
    if state.actual is not None:  # cutter radius compensation ends here
        state.actual = None
        table.add(Kind.RAPID, block.line, state)
    home = state.homes.get(code, np.zeros(3))
    everything = not block.has(state.letters)
    if everything:
        state.position[:] = home
    else:
        state.position[:] = moves.target(state, block)
        extra_axis_moves.move(state, block)
        table.add(Kind.RAPID, block.line, state)
        state.position[:] = _some_axes(state, block, home)
    extra_axis_moves.go_home(state, block, code, everything=everything)
    table.add(Kind.RAPID, block.line, state)


def go_to_switches(state: State, table: BlockTable, block: Block, findings: Findings) -> None:
    """Homing ($H, or G28 with bare letters on 3-D printers): `block.homing` goes to the position of G28, or to machine zero."""
    if not block.homing:
        return
    home = state.homes.get(280, np.zeros(3))
    for letter in block.homing:
        state.position["XYZ".index(letter)] = home["XYZ".index(letter)]
    table.add(Kind.RAPID, block.line, state)
    findings.assume(
        "homing is planned as a rapid to the machine's g28 position, or machine zero; the search for the switches is not",
        block.line,
    )


def _some_axes(state: State, block: Block, home: FloatArray) -> FloatArray:
    """(3,) the position with the block's axes at home [mm]."""
    system, there = state.work_system(), state.position.copy()
    point, at_home = system.turn(there - system.origin, -1.0), system.turn(home - system.origin, -1.0)
    for axis, letter in enumerate("XYZ"):
        if letter in block.value:
            there[axis], point[axis] = home[axis], at_home[axis]
    if state.rotated and block.has("XY"):
        there[:2] = (system.origin + system.turn(point))[:2]
    return there
