"""Settings are read as their control reads them: order of included files, which of equal keys counts, units, defaults, old files."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.controls.machine_import.convert import Imported, import_machine
from planner.nc.reader import parse_program

INIVAR = Path("/usr/bin/inivar")  # LinuxCNC's own reader of INI files, of Debian's package linuxcnc-uspace
SAVED = """
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [printer]
#*# max_accel = 4100
#*# square_corner_velocity = 7
"""
PRINTER = """[printer]
kinematics: cartesian
max_velocity: 210
max_accel: 1900
max_z_velocity: 11
max_z_accel: 70
"""
MILL = """[TRAJ]
COORDINATES = X Y Z A
LINEAR_UNITS = inch
ANGULAR_UNITS = deg
[KINS]
KINEMATICS = trivkins coordinates=XYZA
[AXIS_X]
MAX_VELOCITY = 2
MAX_ACCELERATION = 12
MIN_LIMIT = -3
MAX_LIMIT = 4.5
[AXIS_Y]
MAX_VELOCITY = 2
MAX_ACCELERATION = 12
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 9
[AXIS_A]
MAX_VELOCITY = 70
MAX_ACCELERATION = 350
"""


def imported(tmp_path: Path, text: str, **options) -> Imported:
    file = tmp_path / "settings.ini"
    file.write_text(text)
    return import_machine(file, **options)


def limits(found: Imported, letter: str) -> tuple[float, float]:
    axis = found.machine.axes[letter]
    return axis.velocity, axis.acceleration


def travel(found: Imported, letter: str) -> tuple[float | None, float | None]:
    axis = found.machine.axes[letter]
    return axis.travel_min, axis.travel_max


def said(found: Imported, words: str) -> bool:
    return any(words in sentence for sentence in found.assumed)


def test_klipper_reads_an_included_file_at_its_place(tmp_path: Path) -> None:
    """What stands behind the include counts before it, what stands in front of it does not."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "fast.cfg").write_text("[printer]\nmax_velocity: 333\nmax_accel: 8800\n")
    assert limits(imported(tmp_path, "[include more/fast.cfg]\n" + PRINTER), "x") == (210.0, 1900.0)
    assert limits(imported(tmp_path, PRINTER + "[include more/*.cfg]\n"), "x") == (333.0, 8800.0)
    indented = PRINTER + " [include more/fast.cfg]\n"  # belongs to the value above it
    assert limits(imported(tmp_path, indented), "x") == (210.0, 1900.0)


def test_klipper_takes_saved_settings_only_where_the_rest_says_nothing(tmp_path: Path) -> None:
    found = imported(tmp_path, PRINTER + SAVED)
    assert limits(found, "y") == (210.0, 1900.0)
    assert found.machine.control is not None
    assert found.machine.control.square_corner_velocity == 7.0
    found = imported(tmp_path, PRINTER.replace("max_accel: 1900\n", "") + SAVED)
    assert found.machine.axes["y"].acceleration == 4100.0
    changed = imported(tmp_path, PRINTER + SAVED + "max_velocity: 5\n")
    assert said(changed, "changed by hand")
    assert changed.machine.control is not None
    assert changed.machine.control.square_corner_velocity == 5.0
    (tmp_path / "saved.cfg").write_text(SAVED)
    included = imported(tmp_path, PRINTER + "[include saved.cfg]\n")
    assert included.machine.control is not None
    assert included.machine.control.square_corner_velocity == 5.0, "only in the first file"


def test_klipper_reads_values_comments_and_tables_as_its_parser_does(tmp_path: Path) -> None:
    text = PRINTER.replace("max_accel: 1900", "MAX_ACCEL = 2000 ; old\nmax_accel: 1700#new")
    assert limits(imported(tmp_path, text), "x") == (210.0, 1700.0)
    text = (
        PRINTER
        + "[Printer]\nmax_accel: 5\n[gcode_macro M600]\nrename_existing: M600.1\ngcode:\n  M117 hi\n[stepper_x]\nposition_max: 220\n"
    )
    found = imported(tmp_path, text)
    assert limits(found, "x") == (210.0, 1900.0), "tables differ in upper and lower case"
    assert said(found, "macros of this machine replace are read as usual: M600")
    assert travel(found, "x") == (0, 220)
    assert said(found, "no G2 and G3")
    (tmp_path / "more.cfg").write_text("[mcu]\n")
    with pytest.raises(InputError, match=r"settings\.ini:2: 'max_accel: 3' is in no table"):
        imported(tmp_path, "[include more.cfg]\nmax_accel: 3\n" + PRINTER)


@pytest.mark.parametrize(
    ("line", "ratio"),
    [
        ("", 0.5),
        ("minimum_cruise_ratio: 0.2\n", 0.2),
        ("max_accel_to_decel: 475\n", 0.75),
        ("max_accel_to_decel: 9000\n", 0.0),
    ],
)
def test_klipper_has_a_cruise_ratio_by_both_names(tmp_path: Path, line: str, ratio: float) -> None:
    """1 - max_accel_to_decel / max_accel, at least 0 (klippy/toolhead.py)."""
    control = imported(tmp_path, PRINTER + line).machine.control
    assert control is not None
    assert (control.name, control.acceleration) == ("klipper", 1900.0)
    assert control.minimum_cruise_ratio == pytest.approx(ratio)


def test_linuxcnc_takes_the_first_table_and_the_first_key(tmp_path: Path) -> None:
    (tmp_path / "early.inc").write_text("[AXIS_Y]\nMAX_VELOCITY = 0.5\nMAX_ACCELERATION = 3\n")
    text = "#INCLUDE early.inc\n" + MILL.replace("MAX_VELOCITY = 70", "MAX_VELOCITY = 60\nMAX_VELOCITY = 70")
    found = imported(tmp_path, text + "[AXIS_X]\nMAX_JERK = 1\n# MAX_VELOCITY = 4\n")
    assert limits(found, "y") == pytest.approx((0.5 * 25.4, 3 * 25.4))
    assert found.machine.axes["a"].velocity == 60.0
    assert found.machine.axes["x"].jerk == pytest.approx(12 * 25.4 / 0.04), "nothing of the second [AXIS_X]"
    assert said(found, "the second [AXIS_X] is left out")
    assert said(found, "the second [AXIS_Y] is left out")


def test_linuxcnc_reads_a_file_of_includes_and_leaves_out_what_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "all.inc").write_text(MILL)
    found = imported(tmp_path, "#INCLUDE all.inc\n#INCLUDE gone.inc\n")
    assert limits(found, "z") == pytest.approx((25.4, 9 * 25.4))
    assert said(found, "line 2: the file 'gone.inc' cannot be read")


def test_linuxcnc_reads_lines_that_go_on_and_numbers_with_words_behind_them(tmp_path: Path) -> None:
    text = MILL.replace("COORDINATES = X Y Z A", "COORDINATES = X Y \\\nZ A")
    text = text.replace("MAX_VELOCITY = 70", "MAX_VELOCITY=  7.5e1 deg").replace("[AXIS_Y]", "\t[AXIS_Y]")
    found = imported(tmp_path, text.replace("\n", "\r\n"))
    assert limits(found, "a") == (75.0, 350.0)


def test_rotary_axes_are_in_angular_units_whatever_the_lengths(tmp_path: Path) -> None:
    assert limits(imported(tmp_path, MILL), "a") == (70.0, 350.0)
    for unit, degrees in (("rad", 180 / np.pi), ("gon", 0.9), ("0.5", 2.0), ("degree", 1.0)):
        found = imported(tmp_path, MILL.replace("= deg\n", f"= {unit}\n"))
        assert limits(found, "a") == pytest.approx((70 * degrees, 350 * degrees))
        assert limits(found, "x") == pytest.approx((2 * 25.4, 12 * 25.4))


@pytest.mark.parametrize(
    ("unit", "mm"),
    [("1.0", 1.0), ("0.03937007874016", 25.4), ("0.001", 1000.0), ("metric", 1.0), ("in", 25.4)],
)
def test_a_linear_unit_may_be_a_number_of_units_per_mm(tmp_path: Path, unit: str, mm: float) -> None:
    found = imported(tmp_path, MILL.replace("= inch", f"= {unit}"))
    assert limits(found, "z") == pytest.approx((mm, 9 * mm))
    assert (found.machine.dialect is not None) == (mm == 25.4)
    assert travel(found, "x") == pytest.approx((-3 * mm, 4.5 * mm))


def test_programs_without_units_are_in_those_of_the_machine(tmp_path: Path) -> None:
    """LinuxCNC's interpreter starts with the unit of the INI file, or that of the start-up code."""
    code = b"G1 X2 F60\nM2\n"
    for text, mm in (
        (MILL, 25.4),
        (MILL + "[RS274NGC]\nRS274NGC_STARTUP_CODE = G21 G18 G64 P0.1\n", 1.0),
        (MILL.replace("= inch", "= mm"), 1.0),
    ):
        found = imported(tmp_path, text)
        program = parse_program(code, found.machine, source="t")
        assert program.end[0, 0] == pytest.approx(2 * mm)
        assert program.feed[0] == pytest.approx(mm)
        assert said(found, "STARTUP_CODE: G18 is left out") == ("G18" in text)
    assert (
        parse_program(b"G21 G1 X2 F60\nM2\n", imported(tmp_path, MILL).machine, source="t").end[0, 0] == 2.0
    )


def test_what_is_not_set_has_the_control_s_default(tmp_path: Path) -> None:
    found = imported(
        tmp_path,
        MILL.replace("MAX_VELOCITY = 70\n", "").replace("[AXIS_Z]\nMAX_VELOCITY = 1\n", "[AXIS_Z]\n"),
    )
    assert found.machine.axes["a"].velocity == 1.0
    assert found.machine.axes["z"].velocity == 25.4
    assert "MAX_VELOCITY of z, a is not set; LinuxCNC's default is 1 unit a second" in found.assumed
    found = imported(tmp_path, MILL.replace("MAX_ACCELERATION = 12\nMIN", "MIN"))
    assert said(found, "MAX_ACCELERATION of x")
    assert said(found, " unit a second squared")


def test_joints_move_the_axes_of_the_kinematics_not_of_the_coordinates(tmp_path: Path) -> None:
    """Plain trivkins numbers its joints x y z a ..., so joint 2 of a lathe is z, and joint 1 nothing."""
    lathe = MILL.replace("X Y Z A", "X Z").replace(" coordinates=XYZA", "")
    joints = "[JOINT_1]\nMAX_VELOCITY = 0.1\n[JOINT_2]\nMAX_VELOCITY = 0.25\n"
    found = imported(tmp_path, lathe + joints)
    assert found.machine.axes["z"].velocity == pytest.approx(0.25 * 25.4)
    assert limits(found, "y") == limits(found, "x") == pytest.approx((2 * 25.4, 12 * 25.4))
    assert said(found, "y: the machine has none")
    assert "a" not in found.machine.axes, "axes are those of COORDINATES"
    assert found.machine.dialect is not None
    assert found.machine.dialect.lathe is False
    other = imported(tmp_path, lathe.replace("= trivkins", "= trivkins coordinates=xz") + joints)
    assert other.machine.axes["z"].velocity == pytest.approx(0.1 * 25.4)


def test_files_of_older_versions_have_numbers_for_axes(tmp_path: Path) -> None:
    text = MILL.replace("AXIS_X", "AXIS_0").replace("AXIS_Y", "AXIS_1").replace("AXIS_Z", "AXIS_2")
    text = text.replace("AXIS_A", "AXIS_3").replace(
        "= deg\n", "= deg\nMAX_VELOCITY = 1.5\nMAX_ACCELERATION = 10\n"
    )
    found = imported(tmp_path, text.replace("MAX_VELOCITY = 70", "MAX_VELOCITY = 70\nWRAPPED_ROTARY = 1"))
    assert limits(found, "x") == pytest.approx((2 * 25.4, 10 * 25.4)), "the smaller one along the path"
    assert limits(found, "a") == (70.0, 350.0)
    assert found.machine.feed_max == pytest.approx(1.5 * 25.4)
    assert found.machine.axes["a"].wrapped


def test_a_wrapped_axis_is_wrapped_in_the_machine_file(tmp_path: Path) -> None:
    """From 340 on to 20 is 40 degrees, not 320 back."""
    found = imported(tmp_path, MILL.replace("= 70", "= 70\nWRAPPED_ROTARY = 1"))
    assert found.machine.axes["a"].wrapped
    code = b"G21 G0 A340\nG1 A20 F900\nA20\nA-20\nA-10\nM2\n"
    angles = np.rad2deg(parse_program(code, found.machine, source="t").end[:, 3])
    assert angles == pytest.approx(np.array([340.0, 380.0, 380.0, 380.0, 370.0]), rel=1e-7)
    plain = imported(tmp_path, MILL.replace("= 70", "= 70\nWRAPPED_ROTARY = 0"))
    assert not plain.machine.axes["a"].wrapped


def test_a_share_for_offsets_from_outside_is_taken_off(tmp_path: Path) -> None:
    found = imported(tmp_path, MILL.replace("MAX_VELOCITY = 70", "MAX_VELOCITY = 70\nOFFSET_AV_RATIO = 0.2"))
    assert limits(found, "a") == pytest.approx((56.0, 280.0))


TILTING = MILL.replace("X Y Z A", "X Y Z A C").replace(
    "trivkins coordinates=XYZA", "xyzac-trt-kins sparm=identityfirst"
) + (
    "[AXIS_C]\nMAX_VELOCITY = 90\nMAX_ACCELERATION = 500\n[JOINT_4]\nMAX_VELOCITY = 45\n[SIZES]\nZ = 1.5\n"
    "[HAL]\nHALFILE = own.hal\nHALCMD = net :y xyzac-trt-kins.y-offset gui.y\nHALCMD = sets :y -2 # down\n"
    "[RS274NGC]\nREMAP = M428 ngc=on\nREMAP = M6 ngc=change\n"
)


def test_a_tilting_table_has_its_kinematics(tmp_path: Path) -> None:
    (tmp_path / "own.hal").write_text(
        "setp xyzac-trt-kins.z-offset [SIZES]Z\nsetp xyzac-trt-kins.z-rot-point -10\n"
    )
    found = imported(tmp_path, TILTING)
    kinematics = found.machine.kinematics
    assert kinematics is not None
    assert kinematics.type == "xyzac-trt"
    assert (kinematics.y_offset, kinematics.z_offset, kinematics.z_rot_point) == pytest.approx(
        (-50.8, 38.1, -254)
    )
    assert found.machine.axes["c"].velocity == 45.0, "joint 4 moves c"
    alone = imported(tmp_path, TILTING.replace(" gui.y", "")).machine
    assert alone.kinematics == kinematics, "a signal may have one pin only"
    assert said(found, "codes that this machine has of its own are left out: M6 (REMAP)")
    assert not said(found, "begins with the tool centre point on")
    on = imported(tmp_path, TILTING.replace(" sparm=identityfirst", ""))
    assert said(on, "begins with the tool centre point on")
    turned = imported(tmp_path, TILTING + "[EMCIO]\nTOOL_TABLE = t.tbl\n")
    assert said(turned, "lengths and diameters of tools are in t.tbl")
    other = imported(tmp_path, TILTING.replace("xyzac-trt-kins", "pumakins"))
    assert other.machine.kinematics is None
    assert said(other, "KINEMATICS is pumakins")


@pytest.mark.parametrize("module", ["xyzac-trt-kins", "xyzbc-trt-kins"])
def test_kinematics_need_their_axes(tmp_path: Path, module: str) -> None:
    with pytest.raises(InputError, match=r"kinematics: axis '[bc]' is missing"):
        imported(tmp_path, MILL.replace("trivkins coordinates=XYZA", module))


LEGACY = "echo:  M203 X250 Y240 Z5\necho:  M201 X1300 Y1000 Z80\necho:  M204 S700 T1600\n"


@pytest.mark.parametrize(
    ("line", "along"),
    [
        ("M204 S700 T1600", 700.0),  # T of old firmware is for filament
        ("M204 T300 S700", 700.0),
        ("M204 P900 R100 T600", 600.0),
        ("M204 P500 T600", 500.0),
        ("M204 S650", 650.0),
    ],
)
def test_marlin_has_an_acceleration_along_the_path_by_old_and_new_words(
    tmp_path: Path, line: str, along: float
) -> None:
    found = imported(tmp_path, LEGACY.replace("M204 S700 T1600", line))
    assert [found.machine.axes[letter].acceleration for letter in "xyz"] == [along, along, 80.0]
    assert found.machine.control is not None
    assert (found.machine.control.name, found.machine.control.acceleration) == ("marlin", along)
    assert said(found, "the smaller one is taken for both") == (" P" in line)


def test_marlin_has_a_junction_deviation_or_jumps_at_corners(tmp_path: Path) -> None:
    found = imported(tmp_path, "G20\n" + LEGACY + "M205 B20000 S0 T0 J0.002\n").machine.control
    assert found is not None
    assert found.junction_deviation == pytest.approx(0.002 * 25.4)
    assert found.corner_jump == {}
    found = imported(tmp_path, LEGACY + "M205 S0 T0 X9. Z.3 E5\n").machine.control
    assert found is not None
    assert found.corner_jump == {"x": 9.0, "y": 9.0, "z": 0.3}, "old firmware has one for x and y"


def test_reprapfirmware_has_jumps_per_minute_and_travel(tmp_path: Path) -> None:
    text = "M203 X15000 Y15000 Z300\nM201 X900 Y800 Z60\nM566 X480 Y480 Z24\nM208 X-5 Y0 Z0 S1\nM208 X230 Y210 Z200 S0\n"
    found = imported(tmp_path, text)
    assert limits(found, "x") == (250.0, 900.0)
    assert found.machine.control is not None
    assert found.machine.control.name == "reprapfirmware"
    assert found.machine.control.corner_jump == {"x": 8.0, "y": 8.0, "z": 0.4}
    assert [travel(found, letter) for letter in "xyz"] == [(-5, 230), (0, 210), (0, 200)]
    assert travel(imported(tmp_path, text.replace("M208 X-5 Y0 Z0 S1\n", "M208 X-5:230\n")), "x") == (-5, 230)


@pytest.mark.shows("import-linuxcnc", "compared: LinuxCNC's own reader of INI files, where it is installed")
@pytest.mark.skipif(not INIVAR.exists(), reason="LinuxCNC's inivar is not installed")
def test_linuxcnc_s_own_reader_finds_the_same(tmp_path: Path) -> None:
    """`inivar` prints the value that LinuxCNC takes; of included files it knows nothing: the script `linuxcnc` puts them in."""
    text = MILL.replace("MAX_VELOCITY = 70", "\tMAX_VELOCITY=60 \\\n.5\nMAX_VELOCITY = 70") + (
        "[AXIS_Y]\nMAX_VELOCITY = 9\n[AXIS_Z ]\nMAX_VELOCITY = 8\n[axis_x]\nMAX_VELOCITY = 7\n"
    )
    found = imported(tmp_path, text)
    for letter in "xyza":
        table = f"AXIS_{letter.upper()}"
        command = [str(INIVAR), "-ini", str(tmp_path / "settings.ini"), "-sec", table, "-var", "MAX_VELOCITY"]
        value = float(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()[0])
        assert found.machine.axes[letter].velocity == pytest.approx(value * (1.0 if letter == "a" else 25.4))
