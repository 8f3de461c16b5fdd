"""CL files (APT): places and arcs worked out by hand, directions by the rotation of the axes, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Machine, load_machine, machine_from_dict
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import AS_USUAL, Reading
from planner.nc.writer import flat_program

PART = """$$ made by hand
PARTNO/A PART OF 3 IPM
UNITS/MM
LOADTL/3
SPINDL/RPM,2000,CLW
FROM/0,0,50
RAPID
GOTO/10,0,5
FEDRAT/300,MMPM
GOTO/10,0,$
  -1
CIRCLE/0,0,-1,0,0,1,10
GOTO/0,10,-1
CIRCLE/0,0,-1,0,0,-1,10
GOTO/10,0,-1
INDIRV/0,1,0
TLON,GOFWD/(CIRCLE/0,0,-1,$
10),ON,(LINE/0,0,-1,$
-10,0,-1)
CIRCLE/-20,0,-1,0,1,0,10
GOTO/-20,0,9
godlta / 0, 1, 0
DELAY/2
RAPID
GOTO/0,0,50 $$ away
COOLNT/OFF
CYCLE/OFF
SPINDL/OFF
FINI
"""


def five_axes() -> Machine:
    """A machine with a tilting table: u = Rz(-c) Rx(-a) e_z is the tool as seen from the workpiece."""
    about = load_machine("mill").model_dump(exclude_none=True)
    for letter in "ac":
        about["axes"][letter] = {"velocity": 60.0, "acceleration": 300.0, "jerk": 5000.0}
    about["kinematics"] = {"type": "xyzac-trt", "z_rot_point": -50.0, "tool_length": 60.0}
    return machine_from_dict(about | {"tolerance_angle": 2.0})


@pytest.mark.shows("read-cl", "exact: places and arcs worked out by hand")
def test_moves_arcs_and_stops() -> None:
    program = parse_program(PART)
    kinds = [Kind.STOP, Kind.RAPID, Kind.RAPID, Kind.LINE, *[Kind.ARC] * 4, Kind.LINE, Kind.DWELL, Kind.RAPID]
    assert list(program.kind) == kinds
    places = [
        (0, 0, 0),
        (0, 0, 50),
        (10, 0, 5),
        (10, 0, -1),
        (0, 10, -1),
        (10, 0, -1),
        (-10, 0, -1),
        (-20, 0, 9),
    ]
    assert program.end == pytest.approx(np.array([*places, (-20, 1, 9), (-20, 1, 9), (0, 0, 50)]))
    # a quarter left, a quarter right, half a turn left; from +x about +y by way of -z and -x to +z: 270 degrees
    assert program.arc_sweep / np.pi == pytest.approx([0.5, -0.5, 1.0, 1.5])
    assert list(program.arc_normal) == [2, 2, 2, 1]
    assert program.feed[3:9] * 60 == pytest.approx(300.0)
    assert program.dwell.sum() == 2.0
    assert list(program.line) == [4, 6, 8, 11, 13, 15, 19, 21, 22, 23, 25]
    assert [event.text for event in program.events if event.text[0] in "ST"] == ["T3", "S2000"]


def moved(text: str, machine: Machine | None = None, reading: Reading = AS_USUAL) -> Program:
    return parse_program(f"PARTNO/A\n{text}\nFINI\n", machine, reading)


@pytest.mark.parametrize(
    ("text", "place", "feed"),
    [
        ("UNITS/INCHES\nFEDRAT/10\nGOTO/1,0,0", 25.4, 254.0),
        ("FEDRAT/10,IPM\nGOTO/1,0,0", 25.4, 254.0),
        ("FEDRAT/MMPM,10\nGOTO/1,0,0", 1.0, 10.0),
        ("UNITS/MM\nFEDRAT/1,IPM\nGOTO/1,0,0", 1.0, 25.4),
        ("SPINDL/500,RPM,CLW\nFEDRAT/0.2,MMPR\nGOTO/1,0,0", 1.0, 100.0),
        ("FEDRAT/5\nGOTO/1E0,0,0,0,0,1", 1.0, 5.0),
    ],
)
def test_units_of_lengths_and_feeds(text: str, place: float, feed: float) -> None:
    program = moved(text)
    assert program.end[-1, 0] == pytest.approx(place)
    assert program.feed[program.kind == Kind.LINE] * 60 == pytest.approx([feed])


def test_the_control_of_the_machine_changes_nothing() -> None:
    about = load_machine("mill").model_dump(exclude_none=True)
    odd = machine_from_dict(about | {"dialect": {"lathe": True, "least_increment": 0.001}})
    for reading in (AS_USUAL, Reading(dialect="fanuc")):
        program = moved("FEDRAT/5\nDELAY/2\nGOTO/10,0,4", odd, reading)
        assert program.end[-1] == pytest.approx([10, 0, 4])
        assert program.dwell.sum() == 2.0


def test_directions_turn_the_axes_with_the_tip_where_it_is() -> None:
    rng = np.random.default_rng(4)
    tilt, turn = np.linspace(0.3, 0.9, 40), np.cumsum(rng.uniform(0.0, 0.02, 40))
    directions = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    tips = rng.uniform(-20.0, 20.0, (40, 3)).round(4)
    lines = [",".join(map(str, (*tip, *u))) for tip, u in zip(tips, 3.0 * directions, strict=True)]
    text = "MULTAX/ON\nFEDRAT/500,MMPM\n" + "".join(f"GOTO/{line}\n" for line in lines)
    program = moved(text, five_axes())
    assert program.axes == ("x", "y", "z", "a", "c")
    assert program.end[:, :3] == pytest.approx(tips, abs=1e-9)
    a, c = program.end[:, 3], program.end[:, 4]
    turned = np.stack([np.sin(a) * np.sin(c), np.sin(a) * np.cos(c), np.cos(a)], axis=1)
    assert turned == pytest.approx(directions, abs=1e-6)


def test_a_plan_writes_the_codes_with_its_feeds() -> None:
    text = PART.encode()
    found = flat_program(text, None, AS_USUAL, source="part.cl")
    assert found is not None
    again = parse_program(found[0])
    assert again.end == pytest.approx(found[1].end, abs=1e-9)
    assert "GOTO" not in found[0]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("FEDRAT/5\nCYCLE/DRILL,5,2", 3, "CYCLE/DRILL,5,2: a record that may move"),
        ("CUTCOM/LEFT", 2, "may move"),
        ("TRANS/0,0,5", 2, "may move"),
        ("WOBBLE", 2, "may move"),
        ("GOTO/1,2", 2, "three numbers are needed"),
        ("GOTO/1,2,Q", 2, "three numbers are needed"),
        ("GOTO/1,2,3,0,0,0", 2, "without a length"),
        ("GOTO/1,2,1e300", 2, "a number beyond"),
        ("FEDRAT/5\nGOTO/1,0,0\nCIRCLE/0,0,0,1,1,0,1\nGOTO/0,1,0", 5, "arcs lie in"),
        ("FEDRAT/5\nGOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nGOTO/0,2,0", 5, "G3"),
        ("FEDRAT/5\nGOTO/1,0,0,0,1,1", 3, r"\[kinematics\]"),
        ("SPINDL/100,SFM", 2, "may move"),
        ("GOTO/1,2,3", 2, "feed"),
    ],
)
def test_what_is_refused_names_its_record(text: str, line: int, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        moved(text)
    assert caught.value.line == line


def test_zero_shifts_and_ends_of_cycles_move_nothing() -> None:
    program = moved("FEDRAT/5\nTRANS/0,0,0\nCUTCOM/OFF\nCYCLE/OFF\nGOTO/1,0,0")
    assert program.end.tolist() == [[1.0, 0.0, 0.0]]
