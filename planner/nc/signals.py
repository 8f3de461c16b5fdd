"""M62 to M68: signals of the control. Outputs are events; an input that is waited for is refused."""

from __future__ import annotations

from planner.nc.block import Block
from planner.nc.moves import WordFault
from planner.nc.store import Store

# Ten times M codes: the one that reads an input, and the words that each needs.
_READ_INPUT = 660
_NEEDED = {620: "P", 630: "P", 640: "P", 650: "P", _READ_INPUT: "", 670: "EQ", 680: "EQ"}


def signal(store: Store, block: Block) -> None:
    """Execute the block's code. Raises WordFault if a word is missing, or for an input that is waited for."""
    code = block.m["signals"]
    for letter in _NEEDED[code]:
        if letter not in block.value:
            raise WordFault(
                block.at["signals"], f"M{code // 10} needs the words {' and '.join(_NEEDED[code])}"
            )
    if code == _READ_INPUT and block.value.get("L", 0.0) != 0.0:
        raise WordFault(
            block.at["signals"],
            "M66 waits for an input of the control, which only the machine knows; plan the parts before and after it",
        )
    store.add_event("M", code / 10, block.line)
