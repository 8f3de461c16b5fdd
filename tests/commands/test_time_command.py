"""`planner time`, and settings of a control as `-m`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from planner.cli import app
from planner.commands.terminal import BAD_INPUT

JOB = "G21 G90 G94\n(POCKET)\nG0 X0 Y0 Z5\nG1 Z0 F600\nX40 F1200\n(CONTOUR)\nY30\nX0\nM2\n"
SETTINGS = {
    "klipper": (
        "printer.cfg",
        "[printer]\nkinematics: cartesian\nmax_velocity: 300\nmax_accel: 3000\nmax_z_velocity: 15\nmax_z_accel: 100\n",
    ),
    "grbl": (
        "settings.txt",
        "$11=0.010\n$110=5000\n$111=5000\n$112=500\n$120=400\n$121=400\n$122=100\n",
    ),
    "marlin": (
        "m503.txt",
        "echo:  M203 X500.00 Y500.00 Z5.00 E25.00\necho:  M201 X500 Y500 Z100 E5000\necho:  M205 J0.02\n",
    ),
    "linuxcnc": (
        "mill.ini",
        "[TRAJ]\nLINEAR_UNITS = mm\nCOORDINATES = XYZ\n[EMCMOT]\nSERVO_PERIOD = 1000000\n"
        + "".join(f"[AXIS_{c}]\nMAX_VELOCITY = 50\nMAX_ACCELERATION = 500\n" for c in "XYZ"),
    ),
}


@pytest.fixture
def job(tmp_path: Path) -> Path:
    file = tmp_path / "part.nc"
    file.write_text(JOB)
    return file


def run(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, done.stderr


@pytest.mark.parametrize("control", SETTINGS)
def test_settings_of_a_control_are_a_machine(control: str, tmp_path: Path, job: Path) -> None:
    """They name the control, and tell what they leave open; the same as by machine import."""
    name, text = SETTINGS[control]
    settings, machine = tmp_path / name, tmp_path / "machine.toml"
    settings.write_text(text)
    code, out, said = run("time", job, "-m", settings, "--json")
    assert code == 0, said
    found = json.loads(out)
    assert found["control"] == control
    assert list(found["operations"]) == ["POCKET", "CONTOUR"]
    assert "note: jerk of x, y, z" in said
    assert run("machine", "import", settings, "-o", machine)[0] == 0
    assert json.loads(run("time", job, "-m", machine, "--json")[1])["seconds"] == found["seconds"]
    assert run("info", job, "-m", settings)[0] == 0


def test_the_table_and_the_plan_beside_it(job: Path) -> None:
    code, out, said = run("time", job, "-m", "shapeoko", "--plan", "-q")
    assert code == 0, said
    assert out.startswith("grbl takes")
    assert "POCKET" in out
    assert "planned within 0.045 mm" in out
    assert "exported, program as it is" in out


def test_what_cannot_be_exported_is_timed_and_planned(tmp_path: Path) -> None:
    """Klipper knows no M3."""
    file = tmp_path / "part.nc"
    file.write_text(JOB.replace("(POCKET)", "S1000 M3"))
    code, out, said = run("time", file, "-m", "voron", "--plan", "-q")
    assert code == 0, said
    assert "planned within" in out
    assert "exported" not in out
    assert "note: nothing to export" in said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["-m", "mill"], "the machine names no control; give one: --control"),
        (["--control", "grlb"], "no control 'grlb'"),
        (["-m", "no.cfg"], "machine file not found"),
        (["--control", "grbl", "--tolerance", "-1"], "no length above 0"),
    ],
)
def test_wrong_options(words: list[str], says: str, job: Path) -> None:
    code, _, said = run("time", job, *words)
    assert code == BAD_INPUT
    assert says in said


def test_a_fault_of_the_settings_names_file_and_line(tmp_path: Path, job: Path) -> None:
    settings = tmp_path / "settings.txt"
    settings.write_text(SETTINGS["grbl"][1].replace("$120=400", "$120=fast"))
    code, _, said = run("time", job, "-m", settings)
    assert code == BAD_INPUT
    assert "settings.txt:5: $120: a number is needed, found 'fast'" in said
