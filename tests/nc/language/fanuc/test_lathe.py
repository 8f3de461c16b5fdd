"""Programs of Fanuc and Haas lathes against the same moves written out, and their flat programs against LinuxCNC's interpreter."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from language_programs import same
from oracle import ask_oracle, needs_oracle
from test_agreement import MACHINE, assert_same_motion, offsets_in_inches

from planner.base.errors import InputError
from planner.machine import DialectData, Machine
from planner.nc.program import Kind, Program
from planner.nc.reader import interpret, parse_program
from planner.nc.reading import AS_USUAL
from planner.nc.writer import flat_program

HEAD = "G21 G98 F100\nG0 X40 Z2\n"
PROFILE = "N10 G0 X20\nG1 Z-10 F50\nX30 Z-15\nG2 X40 Z-20 R5\nN20 G1 W-5\n"
WRITTEN = "G7 G18 G94 G21 F100\nG0 X40 Z2\n"
G71 = "G71 U3. R1.\nG71 P10 Q20 U1. W0.2 F200\n"
ROUGH = (
    "F200\nG0 X41 Z2.2\nG0 X35 Z2.2\nG1 X35 Z{z}\nG0 X[35+2*{e}] Z[{z}+{e}]\nG0 Z2.2\nG0 X29 Z2.2\nG1 X29 Z-13.8\n"
    "G0 X[29+2*{e}] Z[-13.8+{e}]\nG0 Z2.2\nG0 X23 Z2.2\nG1 X23 Z-10.8\nG0 X[23+2*{e}] Z[-10.8+{e}]\nG0 Z2.2\n"
    "G0 X21 Z2.2\nG1 X21 Z-9.8\nX31 Z-14.8\nG2 X41 Z-19.8 I5 K0\nG1 X41 Z-24.8\nG0 X40 Z2\n"
)
# x = 35 crosses the arc about (x 41, z -14.8), radius 5, of the moved profile, 3 mm from its centre in radius
Z_ON_ARC = -14.8 - math.sqrt(25 - 9)
ROUGHED = ROUGH.format(z=f"{Z_ON_ARC:.15f}", e=1)


def read(text: str, machine: Machine | None = None) -> Program:
    return parse_program(text, machine)


def written(text: str) -> Program:
    return read(WRITTEN + text + "M30")


CASES = {
    "increments": ("X30 W-1\nU-2. W3.\nG28 U0 W0\nM30", "G0 X30 Z1\nX28 Z4\nG28 X28 Z4\n"),
    "feeds": ("G99 S500 M3\nG1 U1 F0.2\nG98 W1 F80\nM30", "S500 M3\nG95 G1 X41 F0.2\nG94 Z3 F80\n"),
    "dwells": ("G1 W-1\nG4 U1.5\nG4 X2\nG4 P500\nM30", "G1 Z1\nG4 P1.5\nG4 P2\nG4 P0.5\n"),
    "a tool": ("T0203\nG0 W1\nT0200\nM30", "T2 M6\nG43 H3\nG0 Z3\nG49\n"),
    "positions": ("#1=#5001\n#2=#5002\nG0 X[#1-4] Z[#2*2]\nU0\nM30", "G0 X36 Z4\nX36\n"),
    "thread": ("S600 M3\nG0 X20\nG32 W-10 F2.\nG0 U5\nW10\nM30", "S600 M3\nG0 X20\nG33 Z-8 K2\nG0 X25\nG0 Z2\n"),
    "thread on": ("S600 M3\nG32 W-10 F2.\nU2 W-1\nG0 U5\nM30", "S600 M3\nG33 Z-8 K2\nG33 X42 Z-9 K2.8284271247461903\nG0 X47\n"),
    "thread that is wider than long": ("S600 M3\nG0 X20\nG32 U40. W-10 F2.\nX70.\nG0 U5\nM30",
                                       "S600 M3\nG0 X20\nG33 X60 Z-8 K2.23606797749979\nG33 X70 K2\nG0 X75\n"),
    "roughing": (G71 + PROFILE + "G0 X50\nM30", ROUGHED + "G0 X50\n"),
    "roughing in one block": ("G71 P10 Q20 D3. U1. W0.2 F200\n" + PROFILE + "M30", ROUGH.format(z=f"{Z_ON_ARC:.15f}", e=0.5)),
    "finishing": (
        PROFILE + "G0 X40 Z2\nG70 P10 Q20\nX50\nM30\nG71 P10 Q20 D1.",
        2 * "G0 X20\nG1 Z-10 F50\nX30 Z-15\nG2 X40 Z-20 R5\nG1 Z-25\nG0 X40 Z2\n" + "X50\n",
    ),
    "pattern": (
        "G73 U4. W2. R2\nG73 P10 Q20 U1. W0.2\nN10 G0 X20 Z0\nN20 G1 X30 Z-5\nG0 Z9\nM30",
        "G0 X49 Z4.2\nG0 X29 Z2.2\nG1 X39 Z-2.8\nG0 X41 Z2.2\nG0 X21 Z0.2\nG1 X31 Z-4.8\nG0 X40 Z2\nG0 Z9\n",
    ),
    "pattern in one block": (
        "G73 P10 Q20 U1. W0.2 I4. K2. D2\nN10 G0 X20 Z0\nN20 G1 X30 Z-5\nG0 Z9\nM30",
        "G0 X49 Z4.2\nG0 X29 Z2.2\nG1 X39 Z-2.8\nG0 X41 Z2.2\nG0 X21 Z0.2\nG1 X31 Z-4.8\nG0 X40 Z2\nG0 Z9\n",
    ),
    "facing": (
        "G72 W2. R0.5\nG72 P10 Q20 U0 W0.5\nN10 G0 Z-6\nG1 X30\nN20 X20 Z1\nM30",
        "G0 X40 Z2.5\nG0 Z0.5\nG1 X21.4285714285714286\nG0 X22.4285714285714286 Z1\nG0 X40\n"
        "G0 Z-1.5\nG1 X24.2857142857142857\nG0 X25.2857142857142857 Z-1\n"
        "G0 X40\nG0 Z-3.5\nG1 X27.1428571428571429\nG0 X28.1428571428571429 Z-3\n"
        "G0 X40\nG0 Z-5.5\nG1 X30\nX20 Z1.5\nG0 Z2.5\nG0 X40 Z2\n",
    ),
    "turning in one cut": (
        "G90 X36 Z-20 F80\nX32\nU-12 W-12\nX30 Z-22 R-2\nX20\nG0 X50\nM30",
        "F80\nG0 X36\nG1 Z-20\nX40\nG0 Z2\nG0 X32\nG1 Z-20\nX40\nG0 Z2\nG0 X28\nG1 Z-10\nX40\nG0 Z2\n"
        "G0 X26\nG1 X30 Z-22\nX40\nG0 Z2\nG0 X16\nG1 X20 Z-22\nX40\nG0 Z2\nG0 X50\n",
    ),
    "facing in one cut": (
        "G94 X10 Z0 F60\nZ-1\nM8\nG4 U1\nX12 W-4 K1.5\nG1 Z0\nM30",
        "F60\nG0 Z0\nG1 X10\nZ2\nG0 X40\nG0 Z-1\nG1 X10\nZ2\nG0 X40\nM8\nG4 P1\n"
        "G0 Z-.5\nG1 X12 Z-2\nZ2\nG0 X40\nG1 Z0\n",
    ),
    "a thread in one cut": (
        "S600 M3\nG92 X38 W-22 F2.\nX37.2\nX36 R-1\nG0 X50\nM30",
        "S600 M3\nG0 X38\nG33 Z-20 K2\nG0 X40\nZ2\nX37.2\nG33 Z-20 K2\nG0 X40\nZ2\n"
        "X34\nG33 X36 Z-20 K[2*SQRT[485]/22]\nG0 X40\nZ2\nX50\n",
    ),
    "pecks along z": (
        "G74 R0.5\nG74 X36 W-10 P1500 Q4000 R1. F50\nM30",
        "F50\nG1 Z-2\nG0 Z-1.5\nG1 Z-6\nG0 Z-5.5\nG1 Z-8\nG0 Z2\nX37\nG1 Z-2\nG0 Z-1.5\nG1 Z-6\nG0 Z-5.5\nG1 Z-8\n"
        "G0 X39\nZ2\nX36\nG1 Z-2\nG0 Z-1.5\nG1 Z-6\nG0 Z-5.5\nG1 Z-8\nG0 X38\nZ2\nX40\n",
    ),
    "a drill in one block": (
        "G74 W-5 K3. F50\nM30",
        "F50\nG1 Z-1\nG0 Z-.5\nG1 Z-3\nG0 Z2\n",
    ),
    "grooves": (
        "G75 R0.5\nG75 X34 W-6 P2000 Q4000 R1 F50\nM30",
        "F50\nG1 X36\nG0 X37\nG1 X34\nG0 X40\nZ-2\nG1 X36\nG0 X37\nG1 X34\nG0 Z-1\nX40\nZ-4\n"
        "G1 X36\nG0 X37\nG1 X34\nG0 Z-3\nX40\nZ2\n",
    ),
    "grooves in one block": (
        "G75 U-6 Z-2 I2 K4 F50\nM30",
        "F50\nG1 X36\nG0 X37\nG1 X34\nG0 X40\nZ-2\nG1 X36\nG0 X37\nG1 X34\nG0 X40\nZ2\n",
    ),
}  # fmt: skip


@pytest.mark.shows("read-lathes", "exact: the same moves written out")
@pytest.mark.parametrize("name", CASES)
def test_lathe_words_and_cycles(name: str) -> None:
    text, out = CASES[name]
    same(read(HEAD + text), written(out), apart=1e-9)


def thread(cycle: str) -> Program:
    return read("G21 S800 M3\nG0 U0\nG0 X24 Z5\n" + cycle + "G0 X30\nM30")


def test_both_forms_of_the_threading_cycle() -> None:
    two = thread("G76 P010060 Q0 R0\nG76 X16.932 Z-25. P1534 Q485 F2.5\n")
    one = thread("G76 X16.932 Z-25. K1.534 D.485 A60 F2.5\n")
    same(two, one, apart=1e-12)
    cuts = two.end[two.kind == Kind.LINE]
    assert len(cuts) == 11  # ceil((1.534 / 0.485)^2)
    assert cuts[0] == pytest.approx([8.466 + 1.534 - 0.485, 0, -25])
    assert cuts[-1] == pytest.approx([8.466, 0, -25])
    assert two.feed[two.kind == Kind.LINE] == pytest.approx(2.5 * 800 / 60)
    inch = read("G20 S800 M3\nG0 U0\nG0 X1 Z.2\nG76 P020000 Q0 R0\nG76 U-0.2 W-1. P400 Q100 F.1\nM30")
    assert inch.end[inch.kind == Kind.LINE][-1] == pytest.approx([25.4 * 0.4, 0, -25.4 * 0.8])
    assert (inch.kind == Kind.LINE).sum() == 16 + 1


def test_a_feed_per_turn_at_a_constant_surface_speed() -> None:
    """The time of a facing cut is the integral of 2 pi r dr / (F v), to the step of the spindle's speed, and never less."""
    text = "G21 G96 S100\nG50 S3000\nG0 G99 F0.2 M3 U0\nG0 X80 Z0\nG1 X{}\nM30"
    for end in (20.0, 4.0, 0.0, -1.6):
        program = read(text.format(end))
        cut = np.flatnonzero(program.kind == Kind.LINE)
        x = np.concatenate([[40.0], program.end[cut, 0]])
        time = (np.abs(np.diff(x)) / program.feed[cut]).sum()
        r = np.abs(np.linspace(40.0, end / 2.0, 200_001))
        turns = np.minimum(100e3 / (2.0 * np.pi * np.maximum(r, 1e-9)), 3000.0)
        exact = np.trapezoid(60.0 / (0.2 * turns), dx=(40.0 - end / 2.0) / 200_000)
        assert exact <= time * (1 + 1e-9) <= 1.05 * exact
        assert program.end[-1, 0] == end / 2.0
        assert (program.line[cut] == program.line[cut[0]]).all()
    arc = read("G21 G96 S100\nG50 S3000\nG0 G99 F0.2 M3 U0\nG0 X20 Z0\nG3 X40 Z-10 R10\nM30")
    assert arc.feed[arc.kind == Kind.ARC] == pytest.approx(0.2 * 100e3 / (2 * np.pi * 20) / 60)


@pytest.mark.parametrize("unit", ["G20", "G21"])
def test_a_surface_speed_is_in_feet_or_metres(unit: str) -> None:
    """At a diameter of 2 inches 300 feet a minute are 300 * 12 / (2 pi) turns; of 2 mm 3 metres are 3000 / (2 pi)."""
    speed = 300 if unit == "G20" else 3
    text = f"{unit} G96 S{speed}\nG50 S9000\nG0 G99 F0.01 M3 U0\nG0 X2 Z0\nG1 Z-4\nM30"
    turns, inch = (300 * 12 / (2 * math.pi), 25.4) if unit == "G20" else (3000 / (2 * math.pi), 1.0)
    program = read(text)
    assert program.feed[program.kind == Kind.LINE] == pytest.approx(0.01 * inch * turns / 60, rel=1e-12)
    own = read(f"{unit} G7 G18 G95 G96 D9000 S{speed} M3\nG0 X2 Z0\nG1 Z-4 F0.01\nM2")
    assert own.feed[own.kind == Kind.LINE] == pytest.approx(0.01 * inch * turns / 60, rel=1e-12)


END_INSIDE = "G71 P10 Q20 D1.\nN10 G0 X20\nM30\nN20 G1 Z-5\nM30"
REFUSED = {
    # all found by benchmarks/fuzz: on a machine with further axes they were a bug, and a program that ended there was lost
    "an end in the profile": (END_INSIDE, "ends inside the profile"),
    "the end of the file in the profile": (END_INSIDE.replace("M30", "%", 1), "ends inside the profile"),
    "a fault in the profile": ("G71 P10 Q20 D1.\nN10 G0 X20\n#1=[1/0]\nN20 G1 Z-5\nM30", "division by zero"),
    "a cycle in its profile": ("N10 G0 X20\nG73 P10 Q20 D3\nN20 G1 Z-5\nM30", "in the profile of another"),
    "z back": ("G71 P10 Q20 D1.\nN10 G0 X20\nG1 Z-5\nX24 Z-3\nN20 X30 Z-20\nM30", "z turns back"),
    "no profile": ("G71 P10 Q30 D1.\nN10 G0 X20\nN20 G1 Z-5 U0\nM30", "no profile from N10 to N30"),
    "no depth": ("G71 P10 Q20 U1.\nN10 G0 X20\nN20 G1 Z-5\nM30", "depth of a pass is not given"),
    "a dwell": ("G71 P10 Q20 D1.\nN10 G0 X20\nG4 U1\nN20 G1 Z-5\nM30", "a dwell or a stop in the profile"),
    "H": ("H90\nU1\nM30", "as the axis C"),
    "G75 without its bottom": ("G75 R1.\nG75 Z-9 P1000 Q1000\nU1\nM30", "G75 needs the bottom as X or U"),
    "G74 without a shift": ("G74 Z-9 X30 Q1000\nU1\nM30", "G74 with X needs P or I"),
    "a retract longer than a peck": ("G74 R1.\nG74 Z-9 Q500\nU1\nM30", "longer than its peck"),
    "a relief without a point": ("G74 R.1\nG74 X30 Z-9 P1000 Q500 R250\nU1\nM30", "would gouge"),
    "a peck of nothing": ("G75 X30 P0\nU1\nM30", "must be above 0"),
    "a million pecks": ("G75 R0\nG75 X30 P1 Q1 W-5\nU1\nM30", "more than 10000 pecks"),
    "G87": ("G87 X10 Z-10 R2 F10\nU1\nM30", "drills from the side"),
    "G112": ("G112\nG1 X10 C30\nU1\nM30", "the spindle's angle"),
    "G90 of system B": ("G90 G0 U-1 Z-10\nM30", "G code system A"),
    "half of G90": ("G90 U-1\nZ-10\nM30", "needs X or U, and Z or W"),
    "a wrong taper": ("G94 U-1 Z-10 I1\nM30", "does not use I"),
    "G92 without a lead": ("F2.\nG92 X10 Z-10\nU1\nM30", "needs the lead"),
    # found by benchmarks/fuzz: the second line repeated a thread without a lead
    "G92 without a lead, and on": ("T0101\nG0 U1 W2\nG92 X30 Z-10\nX29 Z-11\nM30", "needs the lead"),
    "G92 without room": ("S500 M3\nG0 X20 Z0\nG92 X10 W0 F1\nM30", "room in z"),
    "G50 X": ("G50 X100 Z100\nU1\nM30", "sets a position"),
    "G76 without a lead": ("G76 X10 Z-10 K1. D.2\nU1\nM30", "lead"),
    "G76 below its crest": ("S500 M3 F1\nG0 X11 Z0\nG76 X10 Z-10 K1. D.2\nU1\nM30", "crest"),
    "half a thread": ("F1\nG76 X10 Z-10 P1000 Q200\nU1\nM30", "P and Q with a block"),
    "no speed": ("G99\nG1 W-1 F0.2\nM30", "spindle speed"),
    "to the axis": ("G99 G96 S100 M3\nG1 X0 F0.2\nU0\nM30", "without a largest speed"),
    "an arc first": (
        "G71 P10 Q20 D1.\nN10 G3 X44 Z-2 R5\nN20 G1 Z-5\nM30",
        "first move of a profile is straight",
    ),
}


@pytest.mark.parametrize("axes", ["xyz", "xyza"])
@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str, axes: str) -> None:
    text, said = REFUSED[name]
    machine = MACHINE.model_copy(update={"axes": dict.fromkeys(axes, MACHINE.axes["x"])})
    with pytest.raises(InputError, match=said):
        read(text if "F1\n" in text or "a lead" in name else HEAD + text, machine)


def test_what_was_read_before_a_profile_stays() -> None:
    """The program of a run that ends inside a profile was the profile."""
    program, faults = interpret(HEAD + END_INSIDE, None, source="a.nc")
    assert [fault.line for fault in faults] == [3]
    assert program.end.tolist() == [[20.0, 0.0, 2.0]]


def test_the_machine_says_whether_it_is_a_lathe() -> None:
    def given(lathe: bool | None) -> Machine:
        return MACHINE.model_copy(update={"dialect": DialectData(lathe=lathe)})

    text = "G21 G0 X40 Z2\nM30"
    radius, diameter = (
        read(text, given(lathe)).end[-1, 0] - read("G21 G0 X0", MACHINE).end[-1, 0] for lathe in (None, True)
    )
    assert (radius, diameter) == (40.0, 20.0)
    with pytest.raises(InputError, match="second linear axis"):
        read("G21 G0 X40 Z2 U1\nU2\nM30", given(False))
    assert "lathe" in read("G21 G0 X40 Z2\nU2\nM30").notes[0]


def test_blocks_of_a_cycle_say_where_they_come_from() -> None:
    program = read(HEAD + G71 + PROFILE + "G70 P10 Q20\nM30")
    places = [program.place(k) for k in range(len(program))]
    assert any(place == "line 4" for place in places)
    assert any("profile N10 to N20" in place and place.endswith("called from line 10") for place in places)
    assert program.expansion is not None
    assert dict(program.expansion.calls) == {"profile N10 to N20": 2}


@pytest.mark.shows(
    "read-fanuc",
    "compared: LinuxCNC's rs274 reads the flat programs of lathes the same, where it is installed",
)
@needs_oracle
def test_linuxcnc_reads_the_flat_program(tmp_path: Path) -> None:
    source = (
        HEAD + G71 + PROFILE + "G70 P10 Q20\nT0101\nG97 S800 M3\nG0 X24 Z5\n"
        "G76 P020560 Q50 R0.02\nG76 X16.932 Z-25. R-0.5 P1534 Q485 F2.5\n"
        "G0 X40 Z2\nG98\nG90 X36 Z-20 R-1 F80\nX32\nG94 X10 Z0\nG75 R.5\nG75 X34 W-6 P2000 Q4000 R1 F50\n"
        "G0 Z5\nG92 X38 Z-20 R-1 F2.\nX37\nG0 X24 Z5\n"
        "G0 U6. W2.\nG73 U4. W2. R3\nG73 P30 Q40 U1. W0.2\nN30 G0 X20 Z0\nN40 G1 X30 Z-5\nM30\n"
    )  # fmt: skip
    program = parse_program(source, MACHINE)
    found = flat_program(source.encode(), MACHINE, AS_USUAL, source="lathe.nc")
    assert found is not None
    again = parse_program(found[0], MACHINE)
    same(again, program, apart=1e-6)
    (tmp_path / "flat.ngc").write_text(found[0])
    canon = ask_oracle([{"path": str(tmp_path / "flat.ngc"), **offsets_in_inches()}], tmp_path)[0]
    assert_same_motion(again, canon, centre=1e-6, feeds=False)


def test_an_axis_of_the_machine_is_no_increment_of_a_lathe() -> None:
    own = MACHINE.model_copy(update={"axes": MACHINE.axes | {"w": MACHINE.axes["z"]}})
    text = "G21 G91 F1000\nG1 X-6.4\nX26 Z12 W20\nM2\n"
    found = read(text, own)
    assert np.allclose(
        found.end[-1],
        found.start + [19.6 if axis == "x" else {"z": 12, "w": 20}.get(axis, 0) for axis in own.axes],
    )
    with pytest.raises(InputError, match="G95"):
        read(text, MACHINE)


def test_words_of_a_call_are_no_corners() -> None:
    """I, K and C behind G65 and G66 are arguments, while G1 is on, too."""
    called = "G98 G0 X40 Z2\nX10 W-2\nG1 X12 F80\nG65 P9000 I14. C2. K-3.\nM30\nO9000\nG1 X#4 Z[#6-#3]\nM99"
    same(read("O1\n" + called), written("G0 X10 Z0\nG1 X12 F80\nX14 Z-5\n"))


def test_a_pocket_of_mills_is_refused_on_a_lathe() -> None:
    with pytest.raises(InputError, match="G13 needs G17, its depth as Z and a radius as I"):
        read("O1\nG98 G0 X10 Z0\nG1 X12 F80\nG13 I1. Z-1. D1\nG99\nM30")
