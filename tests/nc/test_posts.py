"""Programs as posts, slicers and old hands write them (posts.txt). Before each stands what comes of it: the places of
all its moves in their order ("x y z|..." [mm], worked out from the manual of its control), "? words" of what is
assumed, or "! words" of the refusal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import load_machine, machine_from_dict
from planner.nc.program import MOVES
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

POSTS = [post.split("\n", 1) for post in Path(__file__).with_name("posts.txt").read_text().split("=== ")[1:]]
ABOUT = load_machine("mill").model_dump(exclude_none=True) | {
    "feed_default": 10.0,
    "tools": {"1": {"length": 20.0, "diameter": 4.0}, "2": {"length": 5.0, "diameter": 8.0}},
}
TURNING = {c: {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5} for c in "abc"}
MACHINES = {
    "mill": machine_from_dict(ABOUT),
    "four-axis": machine_from_dict(ABOUT | {"axes": ABOUT["axes"] | {"a": TURNING["a"]}}),
    "five-axis": machine_from_dict(
        ABOUT
        | {
            "axes": ABOUT["axes"] | {"a": TURNING["a"], "c": TURNING["c"]},
            "kinematics": {"type": "xyzac-trt"},
        }
    ),
}
SAME = 1e-3  # [mm]; the places have three decimals


@pytest.mark.parametrize(("name", "post"), POSTS, ids=[name for name, _ in POSTS])
def test_what_comes_of_it(name: str, post: str) -> None:
    lines = post.splitlines(keepends=True)
    expected = [line for line in lines if line[:2] in ("? ", "! ", "= ")]
    text, machine = "".join(lines[len(expected) :]), MACHINES[name.partition(" ")[0]]
    refused = [line[2:].strip() for line in expected if line[0] == "!"]
    if refused:
        with pytest.raises(InputError) as caught:
            parse_program(text, machine)
        assert refused[0] in str(caught.value)
        return
    program = parse_program(text, machine)
    for line in expected:
        if line[0] == "?":
            assert any(line[2:].strip() in one for one in program.assumptions), program.assumptions
            continue
        places = np.array([place.split() for place in line[2:].split("|")], dtype=float)
        moves = program.end[np.isin(program.kind, MOVES)]
        moves[:, 3:] = np.degrees(moves[:, 3:])
        np.testing.assert_allclose(moves[:, : places.shape[1]], places, atol=SAME)
    assert expected, "nothing is expected of it"


def test_each_has_a_name_of_its_own() -> None:
    assert len({name for name, _ in POSTS}) == len(POSTS) > 0


def test_hidden_blocks_are_read_where_they_are_asked_for() -> None:
    text = "BEGIN PGM A MM\nL X+2 F100\n/L X+9\n12 /  L X+8\nL X+1\nEND PGM A MM\n"
    for skips, places in ((False, [2.0, 9.0, 8.0, 1.0]), (True, [2.0, 1.0])):
        assert parse_program(text, None, Reading(block_delete=skips)).end[:, 0].tolist() == places


def test_a_motor_of_its_own_is_left_out_on_demand() -> None:
    text = "M83\nG1 X5 F600\nMANUAL_STEPPER STEPPER=lift MOVE=5\nG1 X10\n"
    assert parse_program(text, None, Reading(ignore=("MANUAL_STEPPER",))).end[:, 0].tolist() == [5.0, 10.0]
