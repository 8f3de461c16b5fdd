"""Setpoints for LinuxCNC's HAL: the rows of the file, and the rows that HAL puts out."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from planner.controls.export.tables import write_stream
from planner.machine import load_machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.methods.stop import StopMethod
from planner.report.trajectory_file import write_trajectory
from tests.commands.command_line import run


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    plan = StopMethod().plan(parse_program("G21 F6000\nG1 X4 Y1\nX8 Z1"), load_machine("mill"))
    assert plan.trajectory is not None
    return plan.trajectory


@pytest.mark.shows("export-stream", "exact: the rows are the setpoints")
def test_rows_are_the_setpoints(tmp_path: Path, motion: Trajectory) -> None:
    write_stream(tmp_path, motion)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["setpoints.txt", "stream.hal", "try.hal"]
    rows = np.loadtxt(tmp_path / "setpoints.txt")
    assert np.abs(rows - motion.position).max() <= 0.5000001e-9
    inches = tmp_path / "inch"
    inches.mkdir()
    write_stream(inches, motion, "inch")
    assert np.loadtxt(inches / "setpoints.txt") * 25.4 == pytest.approx(rows, abs=2e-8)


def as_ordinary_user(directory: Path) -> list[str]:
    """What to put before a command so that it does not run as root, which HAL refuses; it may write into the directory."""
    home = ["env", f"HOME={directory}"]
    if os.getuid():
        return home
    for place in (directory, *directory.parents):
        if place != Path("/"):
            place.chmod(place.stat().st_mode | 0o755)
    user = pwd.getpwnam("nobody")
    for file in (directory, *directory.iterdir()):
        os.chown(file, user.pw_uid, user.pw_gid)
    return ["runuser", "-u", "nobody", "--", *home]


@pytest.mark.shows("export-stream", "compared: LinuxCNC's HAL puts out every row, where it is installed")
@pytest.mark.slow
@pytest.mark.skipif(
    not shutil.which("halrun"), reason="LinuxCNC's HAL (package linuxcnc-uspace) is not installed"
)
def test_hal_puts_out_every_row(tmp_path: Path, motion: Trajectory) -> None:
    write_stream(tmp_path, motion)
    command = [*as_ordinary_user(tmp_path), "halrun", "-f", "try.hal"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    played = np.loadtxt(tmp_path / "played.txt")
    position, empty = played[:, :-1], played[:, -1]
    first = int(np.flatnonzero(empty == 0)[0])
    rows = position[first : first + len(motion)]
    assert not empty[first : first + len(motion) - 1].any()
    assert np.abs(rows - motion.position).max() <= 1e-6  # halsampler prints six decimals
    assert (position[first + len(motion) :] == rows[-1]).all()


@pytest.mark.parametrize(("between", "refused"), [("linear", False), ("hold", False), ("cubic", True)])
def test_a_stream_is_not_for_drives_that_need_velocities(between, refused, tmp_path, motion) -> None:
    """Cubics of positions and velocities are what the verdict was on; a stream has the positions alone."""
    (tmp_path / "plan").mkdir()
    machine = load_machine("mill").model_copy(update={"interpolation": between})
    metadata = {"machine": machine.model_dump(mode="json", exclude_none=True)}
    write_trajectory(tmp_path / "plan" / "trajectory.parquet", motion, metadata)
    made = run("export", tmp_path / "plan", "--for", "linuxcnc-stream", "-o", tmp_path / "stream")
    assert made.exit_code == (2 if refused else 0)
    assert ("--for pvt" in made.output) == refused
    pvt = run("export", tmp_path / "plan", "--for", "pvt", "-o", tmp_path / "pvt")
    assert pvt.exit_code == 0, pvt.output
    assert (f'interpolation = "{between}"' in pvt.output) != refused


def test_command_writes_new_directories_only(tmp_path: Path, motion: Trajectory) -> None:
    (tmp_path / "plan").mkdir()
    write_trajectory(tmp_path / "plan" / "trajectory.parquet", motion)
    stream = run("export", tmp_path / "plan", "--for", "linuxcnc-stream", "-o", tmp_path / "stream")
    assert stream.exit_code == 0, stream.output
    assert f"{len(motion):,} rows, one every 1 ms" in stream.output
    pvt = run(
        "export",
        tmp_path / "plan" / "trajectory.parquet",
        "--for",
        "pvt",
        "-o",
        tmp_path / "pvt",
        "--within",
        "0.01",
    )
    assert pvt.exit_code == 0, pvt.output
    assert "µm of the setpoints" in pvt.output
    assert (tmp_path / "pvt" / "pvt.csv").exists()
    for arguments, said in [
        ((tmp_path / "plan", "--for", "pvt", "-o", tmp_path / "pvt"), "exists already"),
        ((tmp_path, "--for", "pvt", "-o", tmp_path / "new"), "no trajectory in this directory"),
        (
            (tmp_path / "plan", "--for", "linuxcnc-stream", "-o", tmp_path / "new", "--within", "1"),
            "--within is for pvt",
        ),
        ((tmp_path / "plan", "--for", "pvt", "-o", tmp_path / "new", "--within", "0"), "no length above 0"),
    ]:
        refused = run("export", *arguments)
        assert refused.exit_code == 2
        assert said in refused.output
    assert sorted(file.name for file in tmp_path.iterdir()) == ["plan", "pvt", "stream"]


@pytest.mark.parametrize("purpose", ["linuxcnc-stream", "pvt"])
def test_a_motion_that_failed_its_verdict_is_said_first(tmp_path: Path, purpose: str) -> None:
    """Drives and controls would run it, and nothing in the output told."""
    job, out = tmp_path / "job.ngc", tmp_path / "out"
    job.write_text(
        "G21 G90\nG1 X10 F6000\n" + "".join(f"G1 X{10 - k} Y{k % 2}\n" for k in range(1, 9)) + "M2\n"
    )
    method = ("--method", "fir-plain", "--tolerance", "0.1")
    assert run("plan", job, "-m", "mill", *method, "-o", out).exit_code == 1
    done = run("export", out, "--for", purpose, "-o", tmp_path / "made")
    assert done.exit_code == 1
    assert done.stdout.startswith("verdict FAILED, and these files hold that motion: ")
    assert (tmp_path / "made").is_dir()
    (out / "summary.json").unlink()
    alone = run("export", out, "--for", purpose, "-o", tmp_path / "alone")
    assert alone.exit_code == 0
    assert "'planner verify' judges it" in alone.output
