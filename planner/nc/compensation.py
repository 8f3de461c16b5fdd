"""G40, G41, G42, G41.1 and G42.1: the words that switch cutter radius compensation (cutter.py), and what is refused while it is on."""

from __future__ import annotations

from planner.nc import codes
from planner.nc.block import Block, WordFault
from planner.nc.block_table import BlockTable
from planner.nc.cutter import Cutter
from planner.nc.faults import Findings
from planner.nc.moves import integer
from planner.nc.state import SYSTEMS, State

# Ten times G codes: which switch compensation off, to the left of the path, by a diameter on the line; and which are refused.
_OFF = 400
_LEFT = (410, 411)
_DYNAMIC = (411, 421)
_REFUSED_GROUPS = ("plane", "work offset", "tool length", "path control", "retract mode")
_REFUSED_ONE_SHOTS = (280, 281, 300, 301, 520, 530, 920, 921, 922, 923)  # while it is on


def check_unchanged(state: State, block: Block) -> None:
    """Raise WordFault for words that must not stand in a block while compensation is on."""
    for group in _REFUSED_GROUPS:
        code = block.g.get(group)
        if code is not None and not (group == "plane" and code == {2: 170, 1: 180, 0: 190}[state.normal]):
            raise WordFault(block.at[group], _refusal(f"G{codes.number(code)}"))
    one_shot = block.g.get("one-shot")
    sets_system = one_shot == 100 and block.value.get("L") in (2.0, 20.0)
    refused = one_shot in _REFUSED_ONE_SHOTS or (sets_system and _system_in_force(state, block))
    if one_shot is not None and refused:
        raise block.fault(_refusal(f"G{codes.number(one_shot)}"), "one-shot")
    if block.homing:
        raise WordFault(min(block.at.values(), default=0), _refusal("homing"))
    if "tool change" in block.m:
        raise block.fault(_refusal("M6"), "tool change")


def _system_in_force(state: State, block: Block) -> bool:
    number = round(block.value.get("P", 0.0))
    return number == 0 or (state.system in SYSTEMS and SYSTEMS.index(state.system) + 1 == number)


def _refusal(name: str) -> str:
    return f"{name} while cutter radius compensation is on; write G40 before it"


def check_motion(state: State, block: Block) -> None:
    """Cycles and threads are not compensated. Raises WordFault."""
    if state.motion > 3:
        raise block.fault(_refusal(f"G{codes.number(state.motion)}"))


def switch(
    state: State, table: BlockTable, block: Block, on: Cutter | None, findings: Findings
) -> Cutter | None:
    """The compensation after G40 to G42.1, given the one in force. Raises WordFault."""
    code = block.g["cutter compensation"]
    if code == _OFF:
        if on is not None:
            on.fix()
            if not on.started:
                state.actual = None
        return None
    name = f"G{codes.number(code)}"
    word = block.at["cutter compensation"]
    if on is not None:
        raise WordFault(word, f"{name} while cutter radius compensation is on; write G40 before it")
    if state.normal == 0:
        raise WordFault(word, f"{name} in the y z plane is not supported; write G17 or G18 before it")
    if state.normal == 1 and state.rotated:
        raise WordFault(word, f"{name} in G18 while the work system is rotated is not supported")
    if "L" in block.value:
        raise block.fault(
            f"the edge orientation L of {name} is not supported; remove it and write the tool's path", "L"
        )
    diameter = _diameter(state, block, code, findings)
    if diameter == 0.0:
        return None
    left = (code in _LEFT) == (diameter > 0)
    return Cutter(state, table, radius=abs(diameter) / 2.0, left=left, normal=state.normal)


def _diameter(state: State, block: Block, code: int, findings: Findings) -> float:
    """[mm]"""
    name = f"G{codes.number(code)}"
    if code in _DYNAMIC:
        if "D" not in block.value:
            raise block.fault(f"{name} needs the tool's diameter as a D word", "cutter compensation")
        return block.value["D"] * state.unit
    number = integer(block, "D", 0) if "D" in block.value else state.tool_loaded
    tool = state.tools.get(number)
    if tool is None or tool.diameter == 0.0:
        text = f"tool {number} has no diameter in the machine file: {name} does not move the path"
        findings.assume(text, block.line, block.at["cutter compensation"])
    return 0.0 if tool is None else tool.diameter
