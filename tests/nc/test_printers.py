"""Programs of 3-D printers as slicers write them are read without an option, and lead where they should."""

from __future__ import annotations

import numpy as np
import pytest
from same_program import STRICT, machine

from planner.base.errors import InputError
from planner.machine import load_machine
from planner.nc.program import Kind
from planner.nc.reader import parse_program

MOVES = (Kind.RAPID, Kind.LINE, Kind.ARC)
PRUSA = """M73 P0 R12
M201 X1000 Y1000 Z200 E5000
M862.3 P "MK3S" ; printer model check
M115 U3.13.2+7
M555 X90 Y90 W60 H60
M83
G28 W
G80
G29 P1 X0 Y0 W50 H20 C
M486 Acube (Instance 1).stl
G1 X60.0 E9.0 F1000.0
M221 S95
G1 E-.8 F2100
G2 X64 Y4 I0 J4 E.05
M84 X Y E
"""
BAMBU = """M17 X1.2 Y1.2 Z0.75
M104 S75
M83
M1002 gcode_claim_action : 2
M620 S0A
T0
M621 S0A
M1006 A0 B10 L100 C37 D10 M60 E37 F10 N60
G29.1 Z0
G380 S2 Z30 F300
M622 J1
    G1 X65 E2 F12000
M623
M970.3 Q1 A7 B30 C80  H15 K0
M624 BAAAAAAAAAA=
M142 P1 R35 S40 T45 U0.3 V0.5 W0.8 O45 L1
G1 Y5
G1 Z.2
M73 P100 R0
"""
KLIPPER = """EXCLUDE_OBJECT_DEFINE NAME=a CENTER=1,2 POLYGON=[[1,2],[3,4]]
PRINT_START BED=60 EXTRUDER=200
SET_PRESSURE_ADVANCE ADVANCE=0.04
G1 X50 Y0 F6000
TIMELAPSE_TAKE_FRAME
_MY_MACRO
M117 layer (1 of 2
G1 X0
END_PRINT
"""
CHECKED = "N0 M110*35\nN1 M82*2\nN2 G1 X10 Y10 F3000*100\nN3 G1 X20.5 E1*91 ; comment\n"
REPRAP = 'M83\nM98 P"start.g"\nM568 P0 R150 S210 A2\nG10 P0 S200\nG1 X7 F600\nG60 S1\nG1 X9 Y2\nG61 S1 X\nP0 S1 L1\nT1\nG1 Y5'
PROGRAMS = {
    "Prusa": (PRUSA, [[0, 0, 0], [60, 0, 0], [64, 4, 0]]),
    "Bambu": (BAMBU, [[65, 0, 0], [65, 5, 0], [65, 5, 0.2]]),
    "Klipper": (KLIPPER, [[50, 0, 0], [0, 0, 0]]),
    "checksums": (CHECKED, [[10, 10, 0], [20.5, 10, 0]]),
    "RepRapFirmware": (REPRAP, [[7, 0, 0], [9, 2, 0], [7, 2, 0], [7, 5, 0]]),
    "macro first": ("print_start bed=60\nG1 X3 F600\nPRINT_END\n", [[3, 0, 0]]),
    "homing": ("M140 S60\nG1 X9 Y9 F600\nG28 X0\nG28 O\n", [[9, 9, 0], [0, 9, 0], [0, 0, 0]]),
    "shift": (
        "M83\nG1 Z2 F600\nSET_GCODE_OFFSET Z=0.5\nG1 Z2\nSET_GCODE_OFFSET Z_ADJUST=-0.2 MOVE=1\nG1 X1",
        [[0, 0, 2], [0, 0, 2.5], [0, 0, 2.3], [1, 0, 2.3]],
    ),
    "states": (
        "M83\nG1 X5 F600\nSAVE_GCODE_STATE NAME=a\nG91\nG1 X1 F60\nG92 X0\nRESTORE_GCODE_STATE NAME=a MOVE=1\nG1 X8",
        [[5, 0, 0], [6, 0, 0], [5, 0, 0], [8, 0, 0]],
    ),
    "place": ("M83\nSET_KINEMATIC_POSITION X=100\nG1 X110 F600", [[10, 0, 0]]),
}


@pytest.mark.shows("read-printers", "exact: the ends of moves in files as five slicers write them")
@pytest.mark.parametrize("name", PROGRAMS)
def test_lead_where_they_should(name: str) -> None:
    text, places = PROGRAMS[name]
    program = parse_program(text, machine())
    np.testing.assert_allclose(program.end[np.isin(program.kind, MOVES)], places, atol=1e-12)
    with pytest.raises(InputError):
        parse_program(text, machine(), STRICT)


def test_what_may_move_is_said_first() -> None:
    said = "\n".join(parse_program(KLIPPER, machine()).assumptions)
    assert "3 macros of the printer" in said
    said = "\n".join(parse_program(PRUSA, machine()).assumptions)
    assert "2 codes of a 3-D printer that level, wipe or probe" in said


def test_a_restored_state_has_its_feed() -> None:
    program = parse_program(PROGRAMS["states"][0], machine())
    assert program.feed.tolist() == [10.0, 1.0, 10.0, 10.0]


def test_a_move_before_the_first_feed_has_that_of_printers() -> None:
    program = parse_program("M83\nG1 X1\nSET_GCODE_OFFSET Z=1 MOVE=1\nG1 X2 F60", machine())
    assert program.feed.tolist() == [25.0, 25.0, 1.0]
    assert any("what Marlin and Klipper begin with, F1500" in text for text in program.assumptions)


@pytest.mark.parametrize(
    "line", ["FORCE_MOVE STEPPER=x DISTANCE=5", "G999", "RESTORE_GCODE_STATE NAME=b", "G61 S3"]
)
def test_what_moves_and_is_not_known_is_refused(line: str) -> None:
    with pytest.raises(InputError, match=r"^<text>:3:"):
        parse_program(f"M83\nG1 X1 F60\n{line}\nG1 X2", machine())


@pytest.mark.parametrize(
    "code",
    ["M104", "M109", "M109 P501", "M105", "M140", "M190", "M106", "M107", "M17", "M84", "M203", "M250"],
)
def test_codes_that_mills_have_too_do_not_make_a_printer(code: str) -> None:
    """Probe arms and questions of Haas, C axes and barriers of Okuma: dwells stay in seconds, E words and G61 what they are."""
    program = parse_program(f"G21 F600\n{code}\nG1 X5\nG4 P2\nG61\nG0 X9\n")
    assert program.dwell.sum() == 2.0
    assert not [note for note in program.notes if "printers" in note]
    with pytest.raises(InputError, match="extruder"):
        parse_program(f"G21 F600\n{code}\nG1 X5 E2\n")


@pytest.mark.parametrize(
    "code", ["M104 S200", "N5 M109 R180", "M140 S60", "M106 S255", "M82", "M83", "M204 S900", "M221 S95"]
)
def test_codes_that_only_printers_have_make_one_wherever_they_stand(code: str) -> None:
    for text in (f"{code}\nG4 P2000\nG1 X5 F600\n", f"G4 P2000\nG1 X5 F600\n{code}\n"):
        assert parse_program("G21\n" + text).dwell.sum() == 2.0


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("@2L", "messages"),
        ("@7", "messages"),
        ("G1 H1 X-200 F3000", "levels, wipes or probes"),
        ("M25", "parks the head"),
        ("M226", "parks the head"),
        ("M601", "parks the head"),
    ],
)
def test_commands_that_are_no_moves(line: str, said: str) -> None:
    """Names with a digit in front; moves of RepRapFirmware to a switch; pauses."""
    program = parse_program(f"G21 F600\nM83\nG1 X5\n{line}\nG1 X10\n")
    assert any(said in note for note in program.notes)
    assert program.end[:, 0].tolist() == ([5.0, 5.0, 10.0] if "head" in said or "levels" in said else [5, 10])
    assert (program.kind == Kind.STOP).sum() == len(program) - 2


def test_the_feed_of_a_move_to_a_switch_stays() -> None:
    """RepRapFirmware's G1 with H is not planned; its F is modal all the same, and holds for what follows."""
    program = parse_program("G21\nM83\nG1 X5 F6000\nG1 H1 Z-10 F300\nG1 X10\n")
    assert program.feed[program.kind == Kind.LINE].tolist() == [100.0, 5.0]
    with pytest.raises(InputError, match="positive"):
        parse_program("G21\nM83\nG1 X5 F6000\nG1 H1 Z-10 F-300\nG1 X10\n")


def test_the_seconds_of_a_dwell_are_no_speed() -> None:
    program = parse_program("G21 F600\nM83\nM106 S255\nG1 X5\nG4 S2\nG1 X10\n")
    assert program.dwell.tolist() == [0.0, 2.0, 0.0]
    assert not [event for event in program.events if event.text[0] == "S"]
    spoken = parse_program("G21 F600\nG1 X5\nG4 P2 S900\nG1 X10\n")
    assert [event.text for event in spoken.events] == ["S900"]


def test_klipper_does_not_wait_for_the_seconds_of_a_dwell() -> None:
    """toolhead.py, cmd_G4: P in ms, and nothing else."""
    text = "G21\nG90\nM83\nG1 X10 F3000\nG4 S3\nG1 X20\nG4 S3 P500\nG1 X30\nG4 P250\n"
    program = parse_program(text, load_machine("voron"))
    assert program.dwell[program.kind == Kind.DWELL].tolist() == [0.5, 0.25]
    assert any("S of G4 does nothing in Klipper" in said for said in program.assumptions)
    other = parse_program(text, load_machine("ender3"))
    assert other.dwell[other.kind == Kind.DWELL].tolist() == [3.0, 3.0, 0.25]


def test_turns_of_an_arc_are_refused_which_firmwares_count_otherwise() -> None:
    """Marlin adds P circles where it is built to, Klipper passes over P; P1 is Bambu's, one turn of a spiral lift."""
    lift = parse_program("G21 F600\nM83\nG2 X5 Y0 Z1 I2.5 J0 P1\n")
    assert np.abs(lift.arc_sweep).tolist() == pytest.approx([np.pi])
    with pytest.raises(InputError, match="more circles in Marlin") as fault:
        parse_program("G21 F600\nM83\nG2 X5 Y0 I2.5 J0 P2 E1\n")
    assert fault.value.line == 3
