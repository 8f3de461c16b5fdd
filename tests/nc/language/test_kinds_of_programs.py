"""Sixty programs as posts and old hands write them for lathes, Sinumerik and Heidenhain (kinds.txt): each passes its
places, worked out by hand, in their order, or is refused with the words that stand there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import load_machine, machine_from_dict
from planner.nc.reader import parse_program

FILE = Path(__file__).with_name("kinds.txt")
KINDS = [kind.split("\n", 2) for kind in FILE.read_text(encoding="utf-8").split("=== ")[1:]]
SAME = 1e-4  # [mm]; the places have four decimals
ABOUT = load_machine("mill").model_dump(exclude_none=True) | {"feed_default": 5.0}
MACHINES = {
    "lathe": machine_from_dict(ABOUT),
    "mill": machine_from_dict(ABOUT | {"tools": {"1": {"diameter": 8.0}}}),
}


def test_there_are_twenty_of_each() -> None:
    controls = [name.split()[0] for name, _, _ in KINDS]
    assert {control: controls.count(control) for control in controls} == dict.fromkeys(
        ("lathe", "siemens", "heidenhain"), 20
    )


@pytest.mark.parametrize(("name", "expected", "text"), KINDS, ids=[kind[0] for kind in KINDS])
def test_places(name: str, expected: str, text: str) -> None:
    machine = MACHINES["lathe" if name.startswith("lathe") else "mill"]
    if expected.startswith("!"):
        with pytest.raises(InputError) as caught:
            parse_program(text, machine)
        assert expected[1:] in str(caught.value)
        return
    program = parse_program(text, machine)
    ends = iter(program.end[:, :3])
    for place in expected.split("|"):
        wanted = np.array(place.split(), dtype=float)
        assert any(np.abs(end - wanted).max() < SAME for end in ends), (
            f"{name}: {place} is not passed in turn"
        )
