"""Machine files from the settings of controls: numbers, units, what is assumed, what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from planner.base.errors import InputError
from planner.controls.machine_import.convert import RAMP_TIME, Imported, import_machine
from planner.machine import load_machine, machine_from_dict
from planner.nc.reader import parse_program
from tests.commands.command_line import run

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis")  # Debian's package linuxcnc-uspace

LINUXCNC = """
[EMC]
MACHINE = sim
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = inch
MAX_LINEAR_VELOCITY = 4
[EMCMOT]
SERVO_PERIOD = 2000000  # ns
[RS274NGC]
RS274NGC_STARTUP_CODE = G20 G40 G64 P0.001 G90
[KINS]
KINEMATICS = trivkins coordinates=XYYZ kinstype=BOTH
[AXIS_X]
  MAX_VELOCITY = 3
MAX_ACCELERATION = 20
MAX_ACCELERATION = 99
[AXIS_Y]
MAX_VELOCITY = 5
MAX_ACCELERATION = 30
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 10
MAX_JERK = 200
[JOINT_0]
MAX_VELOCITY = 2
[JOINT_2]
MAX_ACCELERATION = 25
"""

GRBL = """$10=1
$11=0.010 (junc dev, mm)
$100=250.000
$110=6000.000 (x max rate, mm/min)
$111=3000.000
$112=600.000
$120=500.000 (x accel, mm/sec^2)
$121=400.000
$122=50.000
ok
"""

KLIPPER = """
[mcu]
serial: /dev/serial
[printer]
kinematics: corexy
max_velocity: 300   # mm/s
max_accel: 3000
max_z_velocity: 15
square_corner_velocity: 5.0
[gcode_macro PARK]
gcode:
    max_velocity: 1
    G1 X0 ; away

#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [input_shaper]
#*# shaper_freq_x = 57.2
#*# shaper_freq_y = 34.0
#*# damping_ratio_y = 0.05
"""

MARLIN = """echo:; Linear Units:
echo:  G21 ; (mm)
echo:; Maximum feedrates (units/s):
echo:  M203 X500.00 Y400.00 Z5.00 E25.00
echo:; Maximum Acceleration (units/s2):
echo:  M201 X500.00 Y500.00 Z100.00 E5000.00
echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
echo:  M204 P400.00 R500.00 T1000.00
echo:  M205 B20000.00 S0.00 T0.00 X8.00 Y8.00 Z0.40 E5.00
echo:  M593 X F40.00 D0.10
echo:  M593 Y F50.00 D0.10
"""


def imported(tmp_path: Path, text: str, **options) -> Imported:
    file = tmp_path / "settings.txt"
    file.write_text(text)
    return import_machine(file, **options)


@pytest.mark.shows("import-linuxcnc", "exact: numbers and units worked out by hand")
def test_linuxcnc_has_the_smallest_limit_of_axis_and_joints_in_mm(tmp_path: Path) -> None:
    machine = imported(tmp_path, LINUXCNC).machine
    x, y, z = (machine.axes[letter] for letter in "xyz")
    assert (x.velocity, y.velocity, z.velocity) == pytest.approx((2 * 25.4, 5 * 25.4, 25.4))
    assert (x.acceleration, y.acceleration, z.acceleration) == pytest.approx((508.0, 25 * 25.4, 254.0))
    assert x.jerk == pytest.approx(508.0 / RAMP_TIME)
    assert z.jerk == pytest.approx(200 * 25.4)
    assert machine.dt == pytest.approx(0.002)
    assert machine.tolerance == pytest.approx(0.0254)
    assert machine.feed_max == pytest.approx(4 * 25.4)


@pytest.mark.shows("import-grbl", "exact: numbers and units worked out by hand")
def test_grbl_has_rates_per_minute(tmp_path: Path) -> None:
    found = imported(tmp_path, GRBL, ramp_time=0.02)
    x, z = found.machine.axes["x"], found.machine.axes["z"]
    assert (x.velocity, x.acceleration, x.jerk) == pytest.approx((100.0, 500.0, 25_000.0))
    assert (z.velocity, z.acceleration, z.jerk) == pytest.approx((10.0, 50.0, 2500.0))
    assert found.machine.control is not None
    assert found.machine.control.junction_deviation == 0.01
    assert any("jerk of x, y, z" in said for said in found.assumed)


def test_klipper_takes_saved_settings_and_skips_macros(tmp_path: Path) -> None:
    machine = imported(tmp_path, KLIPPER).machine
    assert machine.axes["x"].velocity == machine.axes["y"].velocity == machine.feed_max == 300.0
    assert (machine.axes["z"].velocity, machine.axes["z"].acceleration) == (15.0, 3000.0)
    assert [(mode.frequency, mode.damping) for mode in machine.modes] == [(57.2, 0.1), (34.0, 0.05)]


@pytest.mark.shows("import-klipper", "exact: numbers and units worked out by hand")
def test_klipper_takes_the_last_of_equal_settings_and_included_files(tmp_path: Path) -> None:
    (tmp_path / "limits.cfg").write_text("[printer]\nmax_accel: 700\n")
    found = imported(tmp_path, KLIPPER.replace("[mcu]", "[include lim*.cfg]\n[mcu]"))
    assert found.machine.axes["x"].acceleration == 3000.0, "what stands behind it counts"
    found = imported(tmp_path, KLIPPER.replace("[gcode_macro", "[include lim*.cfg]\n[gcode_macro"))
    assert found.machine.axes["x"].acceleration == 700.0
    with pytest.raises(InputError, match=r"gone\.cfg: included in .*settings\.txt, line 3: "):
        imported(tmp_path, "[printer]\nkinematics: cartesian\n[include gone.cfg]\n")


def test_a_circle_of_included_files_ends(tmp_path: Path) -> None:
    (tmp_path / "a.cfg").write_text("[printer]\n[include a.cfg]\n")
    with pytest.raises(InputError, match="is it a circle"):
        import_machine(tmp_path / "a.cfg")


@pytest.mark.shows("import-marlin", "exact: numbers and units worked out by hand")
def test_marlin_has_the_smaller_of_axis_and_path_acceleration(tmp_path: Path) -> None:
    found = imported(tmp_path, MARLIN)
    axes = found.machine.axes
    assert [axes[letter].velocity for letter in "xyz"] == [500.0, 400.0, 5.0]
    assert [axes[letter].acceleration for letter in "xyz"] == [400.0, 400.0, 100.0]
    assert [mode.frequency for mode in found.machine.modes] == [40.0, 50.0]
    assert found.machine.control is not None
    assert found.machine.control.corner_jump == {"x": 8.0, "y": 8.0, "z": 0.4}
    assert found.machine.control.acceleration == 400.0
    inches = imported(tmp_path, MARLIN.replace("G21", "G20"))
    assert inches.machine.axes["x"].velocity == pytest.approx(500.0 * 25.4)


@pytest.mark.shows("import-reprapfirmware", "exact: numbers and units worked out by hand")
def test_reprapfirmware_has_the_same_commands_but_velocities_per_minute(tmp_path: Path) -> None:
    found = imported(tmp_path, MARLIN + "M566 X600 Y600\n")
    assert [found.machine.axes[letter].velocity for letter in "xyz"] == pytest.approx(
        [500.0 / 60, 400.0 / 60, 5.0 / 60]
    )
    assert found.machine.axes["x"].acceleration == 400.0
    assert any("RepRapFirmware" in said for said in found.assumed)


SHOWN = GRBL, KLIPPER, MARLIN, MARLIN.replace("G21", "G20"), MARLIN + "M566 X600 Y600\n"


@pytest.mark.parametrize("text", SHOWN, ids=["grbl", "klipper", "marlin", "inches", "reprapfirmware"])
def test_programs_of_other_controls_begin_in_mm(tmp_path: Path, text: str) -> None:
    """Whatever unit the settings are printed in: only LinuxCNC has a unit of the machine."""
    program = parse_program("G1 X2 F60\n", imported(tmp_path, text).machine)
    assert (program.end[0, 0], program.feed[0]) == (2.0, 1.0)


def test_limits_can_be_given_and_replace_those_of_the_settings(tmp_path: Path) -> None:
    found = imported(tmp_path, GRBL, given={"x.jerk": 9000.0, "y.velocity": 70.0}, tolerance=0.01)
    assert (found.machine.axes["x"].jerk, found.machine.axes["y"].velocity) == (9000.0, 70.0)
    assert found.machine.tolerance == 0.01
    assert any("jerk of y, z" in said for said in found.assumed)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("G0 X1\n", {}, "no settings found"),
        (
            GRBL.replace("$121=400.000", ""),
            {},
            "do not say y.acceleration; give them in mm and s: planner machine import, --set",
        ),
        (GRBL.replace("400.000", "0"), {}, r"settings\.txt:8: \$121: must be above 0, found 0"),
        (GRBL.replace("400.000", "fast"), {}, r"settings\.txt:8: \$121: a number is needed, found 'fast'"),
        (LINUXCNC.replace("inch", "miles"), {}, "LINEAR_UNITS is 'miles'"),
        (LINUXCNC.replace("LINEAR_UNITS = inch", ""), {}, "mm or inch"),
        (KLIPPER.replace("corexy", "delta"), {}, "kinematics is delta"),
        (GRBL, {"control": "grble"}, "did you mean 'grbl'"),
        (GRBL, {"given": {"q.jerk": 1.0}}, "'q.jerk' is no limit of an axis"),
        (GRBL, {"tolerance": -1.0}, "tolerance"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path: Path, text: str, options: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, text, **options)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_settings_as_windows_saves_them(tmp_path: Path, encoding: str) -> None:
    """What a control prints, sent into a file by its shell, was "no settings found"."""
    file = tmp_path / "saved.txt"
    file.write_bytes(GRBL.replace("\n", "\r\n").encode(encoding))
    assert import_machine(file).text.replace("saved", "settings") == imported(tmp_path, GRBL).text


def test_command_writes_a_machine_file_that_loads(tmp_path: Path) -> None:
    settings, file = tmp_path / "grbl.txt", tmp_path / "my.toml"
    settings.write_text(GRBL)
    result = run("machine", "import", settings, "-o", file, "--ramp-time", "0.1", "--set", "x.jerk=7e3")
    assert result.exit_code == 0, result.output
    assert "note: jerk of y, z: acceleration / 100 ms" in result.output
    assert load_machine(file).axes["y"].jerk == pytest.approx(4000.0)
    again = run("machine", "import", settings, "-o", file)
    assert again.exit_code == 2
    assert "exists already" in again.output
    assert run("machine", "import", settings, "-o", settings, "--force").exit_code == 2
    assert settings.read_text() == GRBL
    forced = run("machine", "import", settings, "-o", file, "--force", "--set", "y.jerk=9e3")
    assert forced.exit_code == 0, forced.output
    assert load_machine(file).axes["y"].jerk == pytest.approx(9000.0)
    assert run("machine", "import", settings, "-o", tmp_path / "b.toml", "--set", "x.jerk").exit_code == 2
    assert not (tmp_path / "b.toml").exists()


@pytest.mark.skipif(not SAMPLES.is_dir(), reason="LinuxCNC's sample configurations are not installed")
@pytest.mark.parametrize(
    "name", ["axis", "axis_mm", "axis_9axis", "histogram_demo", "ini_with_includes/includes_demo"]
)
def test_linuxcnc_samples_are_read(name: str) -> None:
    found = import_machine(SAMPLES / f"{name}.ini")
    assert {"x", "y", "z"} <= found.machine.axes.keys()
    assert found.machine.dt == pytest.approx(0.001)


def test_a_control_character_in_a_value_that_a_note_quotes_is_not_in_the_machine_file(tmp_path: Path) -> None:
    """Found by fuzzing: TOML takes none in a comment, and the written file could not be read."""
    found = imported(tmp_path, LINUXCNC.replace("trivkins", "tr\x1bvkins"))
    assert any("\x1b" in sentence for sentence in found.assumed)
    assert "tr-vkins" in found.text
    assert machine_from_dict(tomllib.loads(found.text)) == found.machine


@pytest.mark.parametrize(("frequency", "modes"), [("0.8", [0.8]), ("0", []), ("40", [40.0])])
def test_marlin_shapes_any_frequency_but_0(tmp_path: Path, frequency: str, modes: list[float]) -> None:
    """M593 F0 turns input shaping off."""
    file = tmp_path / "marlin.txt"
    file.write_text(f"M203 X250 Y240 Z5\nM201 X1300 Y1000 Z80\nM204 S700\nM593 F{frequency} D0.1\n")
    found = import_machine(file).machine.modes
    assert [mode.frequency for mode in found] == modes
    assert [mode.damping for mode in found] == [0.1] * len(modes)
