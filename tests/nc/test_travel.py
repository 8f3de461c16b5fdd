"""The travel of the axes: where a program goes, in machine coordinates, and what of it a machine does not reach."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.chords import points_on
from planner.machine import Machine, load_machine
from planner.nc.extents import block_boxes, starts, travel_faults
from planner.nc.reading import Reading
from tests.commands.command_line import run

MILL = load_machine("mill")
PLACES = 20_001  # of a segment at which its path is looked at


def reaching(offset: dict[str, float] | None = None, **ends: tuple[float | None, float | None]) -> Machine:
    """The mill with travel, and with G54 where an offset is given."""
    axes = {
        letter: axis.model_copy(update=dict(zip(("travel_min", "travel_max"), ends[letter], strict=True)))
        if letter in ends
        else axis
        for letter, axis in MILL.axes.items()
    }
    return MILL.model_copy(update={"axes": axes, "work_offsets": {} if offset is None else {"g54": offset}})


def found(text: str, machine: Machine) -> list[tuple[int, int, str]]:
    program = planner.read_program(text=text, machine=machine)
    faults, _ = travel_faults(program, machine, text.encode())
    return [(fault.line, fault.column, fault.word) for fault in faults]


@pytest.mark.shows("travel", "exact: boxes of lines, arcs and curves")
def test_boxes_are_those_of_the_path() -> None:
    """Of lines, arcs of all quadrants in all planes, helices and splines, block by block: against samples of the path."""
    text = (
        "G21 F3000\nG0 X3 Y-4\nG1 Z2\nG2 X9 Y2 I6 J0 Z5\nG3 X9 Y2 I-3 J4\nG18 G2 X2 Z1 I-3.5 K-2\nG19 G3 Y6 Z7 J2 K3\n"
        "G17 G5 I3 J9 P-9 Q2 X20 Y3\nG1 X-5\n"
    )
    program = planner.read_program(text=text)
    low, high = block_boxes(program)
    path = toolpath_from_program(program, MILL)
    for block in range(len(program)):
        begin = starts(program)[block]  # where the block before ends, which has it in its box
        on = [begin[None], program.end[block : block + 1]]
        for k in np.flatnonzero((path.block == block) & ~path.straight):
            share = np.linspace(0.0, 1.0, PLACES)[1:]
            on.append(points_on(path, np.full(len(share), k), share * path.length[k]))
        places = np.vstack(on)
        np.testing.assert_allclose(places.min(axis=0), np.minimum(low[block], begin), atol=2e-5)
        np.testing.assert_allclose(places.max(axis=0), np.maximum(high[block], begin), atol=2e-5)


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("G1 X100 F600", []),
        ("G1 X100.0000001 F600", []),
        ("G1 X100.01 F600", [(1, 4, "X")]),
        ("G1 X90 F600\nY-3\nX-0.5 Y5\nX120", [(2, 1, "Y"), (3, 1, "X")]),
        ("G1 X50 Y50 F600\nG2 I60 J0", [(2, 1, "X"), (2, 1, "Y")]),  # a full circle: to X170, Y110 and Y-10
        ("G1 X50 Y50 F600\nG2 X60 Y60 I5 J5", []),
        ("G20 G1 X4 F20", [(1, 8, "X")]),
        ("G91 G1 X60 F600\nX60", [(2, 1, "X")]),
        ("G92 X-50\nG1 X40 F600\nX80", [(3, 1, "X")]),
        ("G53 G0 X101", [(1, 8, "X")]),
    ],
)
def test_what_is_beyond(text: str, places: list[tuple[int, int, str]]) -> None:
    assert found(text, reaching({}, x=(0.0, 100.0), y=(0.0, 100.0))) == places


def test_in_machine_coordinates_of_the_work_offset() -> None:
    """The travel is the machine's: with G54 at -200 its X0 is there."""
    machine = reaching({"x": -200.0}, x=(-300.0, 0.0))
    assert found("G1 X100 F600\nX199", machine) == []
    assert found("G1 X100 F600\nX201", machine) == [(2, 1, "X")]
    with pytest.raises(
        InputError,
        match=r":2:1: X: in machine coordinates x goes to 3 on line 3, 3 beyond its travel of -300 to 0 mm \(blocks beyond it: 2\)",
    ):
        planner.plan(planner.read_program(text="G1 X100 F600\nX201\nX203", machine=machine), machine)


@pytest.mark.parametrize(("to", "is_fault"), [(299.0, False), (301.0, True)])
def test_without_g54_only_lengths_are_known(to: float, is_fault: bool) -> None:
    """Wherever G54 is, a program that is longer than the travel does not fit; a shorter one may."""
    machine = reaching(None, x=(-300.0, 0.0))
    text = f"G0 X10 F600\nG1 X{to + 10}\nX10"
    assert bool(found(text, machine)) == is_fault
    program = planner.read_program(text=text, machine=machine)
    assert "only lengths are compared" in travel_faults(program, machine)[1][0]
    # with G53 among them even lengths are not known
    mixed = planner.read_program(text=f"G53 G0 X0\n{text}", machine=machine)
    assert travel_faults(mixed, machine)[0] == []
    assert "mixes both coordinates" in travel_faults(mixed, machine)[1][0]


@pytest.mark.parametrize(
    ("before", "is_fault"),
    [
        ("G0 X0 Y0\n", True),  # a move of no length: the program says where it begins
        ("G92 X0\n", True),
        ("(G0 X0)\nG1 Y3 ; X0\n", False),  # where it begins is assumed
        ("G10 L2 P1 X0\n", False),
    ],
)
def test_a_start_that_the_program_names_counts(before: str, is_fault: bool) -> None:
    machine = reaching(x=(0.0, 300.0))
    faults = found(f"G21 G90 F3000\n{before}G1 X305\nX301 Y5\n", machine)
    assert [word for _, _, word in faults] == ["X"] * is_fault
    known = reaching({"x": -5.0}, x=(0.0, 300.0))
    assert [word for _, _, word in found("G21 G90 F3000\nG0 X0\nG1 X30\n", known)] == ["X"]


def test_printers_have_no_work_offset() -> None:
    ender = load_machine("ender3")
    x = ender.axes["x"].model_copy(update={"travel_min": 0.0, "travel_max": 235.0})
    machine = ender.model_copy(update={"axes": {**ender.axes, "x": x}})
    assert found("G1 X100 F600\nX-1", machine) == [(2, 1, "X")]


def test_an_axis_that_stands_is_not_looked_at() -> None:
    """Where it stands at the start nobody knows."""
    assert found("G1 X50 F600\nX60", reaching({}, z=(-100.0, -5.0))) == []
    assert found("G1 X50 F600\nZ-1", reaching({}, z=(-100.0, -5.0))) == [(2, 1, "Z")]


def test_rotary_axes_in_degrees_and_wrapped_ones_turn_on() -> None:
    turn = {"velocity": 100, "acceleration": 1000, "jerk": 1e5, "travel_min": -90, "travel_max": 30}
    for wrapped in (False, True):
        data = MILL.model_dump(exclude_none=True) | {"work_offsets": {"g54": {}}}
        data["axes"]["a"] = turn | {"wrapped": wrapped}
        assert bool(found("G1 X1 A29 F600\nA31", Machine(**data))) != wrapped


def test_the_tool_centre_point_counts_where_the_joints_go() -> None:
    """The tip stays at X0; the table tilts by 90 degrees about a point 200 mm away, and the joint y goes there."""
    data = MILL.model_dump(exclude_none=True) | {"work_offsets": {"g54": {}}, "rotary_radius": 50.0}
    for letter in "ac":
        data["axes"][letter] = {"velocity": 100, "acceleration": 1000, "jerk": 1e5}
    data["kinematics"] = {"type": "xyzac-trt", "z_rot_point": -200.0}
    text = "G21 G90 F1000\nG43.4\nG1 X0 Y0 Z0\nA90\n"
    data["axes"]["y"] |= {"travel_min": -150.0, "travel_max": 150.0}
    assert [word for _, _, word in found(text, Machine(**data))] == ["Y"]
    data["axes"]["y"] |= {"travel_min": -250.0, "travel_max": 250.0}
    assert found(text, Machine(**data)) == []


def _machine_file(folder: Path) -> Path:
    file = folder / "m.toml"
    axis = "velocity = 100\nacceleration = 1000\njerk = 1e5\ntravel_min = 0\ntravel_max = 100\n"
    file.write_text(
        'name = "m"\ndt = 0.001\ntolerance = 0.02\n'
        + "".join(f"[axes.{c}]\n{axis}" for c in "xyz")
        + "[work_offsets.g54]\nx = 5\n"
    )
    return file


def test_commands_refuse_and_plan_when_told_to(tmp_path: Path) -> None:
    job = tmp_path / "job.ngc"
    job.write_text("G21 G90 F3000\nG1 X50\nX100\nX10\n")
    machine = _machine_file(tmp_path)
    info = run("info", job, "-m", machine)
    assert info.exit_code == 2
    assert "3:1 X" in info.output
    assert run("info", job, "-m", machine, "--ignore-travel").exit_code == 0
    for words in (["plan", job], ["compare", job], ["what-if", job, "--set", "x.jerk=+10%"]):
        refused = run(*words, "-m", machine)
        assert refused.exit_code == 2, refused.output
        assert (
            "job.ngc:3:1: X: in machine coordinates x goes to 105 on line 3, 5 beyond its travel of 0 to 100 mm"
            in refused.output
        )
        assert "--ignore-travel" in refused.output
    out = tmp_path / "out"
    done = run("plan", job, "-m", machine, "--ignore-travel", "-o", out, "--method", "kinematic", "--json")
    assert done.exit_code == 0, done.output
    said = json.loads((out / "summary.json").read_text())
    assert any("5 beyond its travel" in note and "--ignore-travel" in note for note in said["notes"])
    told = dict(said["told"])
    assert told["extent [mm]"].startswith("x 15.000 to 105.000")
    assert told["in its own zero"].startswith("x 10.000 to 100.000")
    for words in (["verify", out], ["report", out], ["export", out, "--for", "grbl", "-o", tmp_path / "g"]):
        assert run(*words).exit_code == 0, "what was told once holds for the directory"
    assert Reading.saved(said["reading"]).ignore_travel


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"travel_min": 5, "travel_max": 5}, "travel_min 5 must be below travel_max 5"),
        ({"travel_max": "far"}, "axes.x.travel_max: must be a number"),
        ({"travel_min": float("-inf")}, "axes.x.travel_min: must be a finite number"),
        ({"travel": 5}, "unknown key"),
    ],
)
def test_wrong_travel_in_a_machine_file(keys: dict[str, object], said: str) -> None:
    data = MILL.model_dump(exclude_none=True)
    data["axes"]["x"] |= keys
    with pytest.raises(InputError, match=said):
        Machine(**data)
    data = MILL.model_dump(exclude_none=True)
    data["axes"]["e"] = data["axes"]["y"] | {"travel_max": 5}
    with pytest.raises(InputError, match="an extruder has no travel"):
        Machine(**data)
