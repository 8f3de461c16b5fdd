"""The command line: exit codes, messages, and that nothing bad goes further than a message."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_made import SQUARE, make_plan, trajectory_along
from rich.text import Text
from typer.testing import CliRunner, Result

import planner
from planner.base.errors import InputError
from planner.cli import app
from planner.commands.terminal import show
from planner.geometry.build import toolpath_from_program
from planner.machine import builtin_machines, load_machine
from planner.nc.reader import parse_program
from planner.report.trajectory_file import write_trajectory

TEMPLATE = Path(planner.__file__).parent / "templates" / "machine.toml"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "square.ngc"
    path.write_text(SQUARE)
    return path


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Let `plan` answer with a plan made by hand, or raise."""

    def answer(**how: Any) -> None:
        def plan(*_: object, **__: object) -> Any:
            if "raises" in how:
                raise how["raises"]
            return make_plan(**how)

        monkeypatch.setitem(vars(planner), "plan", plan)

    return answer


# ------------------------------------------------------------------------------------------ plan


def test_plan_writes_and_exits_0(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned()
    result = run("plan", job, "-o", tmp_path / "out", "--plot", "--corners")
    assert result.exit_code == 0, result.output
    assert "cycle time" in result.stdout
    assert "feed / its own" in result.stdout  # the corner table
    files = {"profiles.png", "summary.json", "toolpath.png", "trajectory.parquet"}
    assert {file.name for file in (tmp_path / "out").iterdir()} == files
    assert all(str(tmp_path / "out" / name) in result.stdout for name in files)


def test_that_there_are_no_corners_is_said(planned: Callable[..., None], job: Path) -> None:
    planned(turns=False)
    assert "no corners to list" in run("plan", job, "--corners").stdout
    assert "no corners to list" not in run("plan", job).stdout


def test_json_is_all_there_is_on_stdout(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned()
    result = run("plan", job, "--json", "--quiet", "-o", tmp_path / "out")
    assert json.loads(result.stdout)["cycle_time_s"] == pytest.approx(0.8)
    assert result.stderr == ""


def test_failed_verdict_exits_1_and_is_written(
    planned: Callable[..., None], job: Path, tmp_path: Path
) -> None:
    planned(passed=False)
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["verdict"]["passed"] is False


def test_unsolved_exits_3_and_writes_nothing(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned(solved=False)
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert result.stderr.startswith("not solved: no feed satisfies all limits; loosen the tolerance")
    assert not (tmp_path / "out").exists()


def test_bad_input_exits_2(planned: Callable[..., None], job: Path) -> None:
    planned(raises=InputError("G41: cutter compensation", source="job.ngc", line=3, column=7))
    result = run("plan", job)
    assert result.exit_code == 2
    assert result.stderr == "job.ngc:3:7: G41: cutter compensation\n"
    assert result.stdout == ""


def test_a_bug_exits_70_with_its_traceback(planned: Callable[..., None], job: Path) -> None:
    planned(raises=ZeroDivisionError("oops"))
    result = run("plan", job)
    assert result.exit_code == 70
    assert "Traceback" in result.stderr
    assert "ZeroDivisionError: oops" in result.stderr
    assert "Please report it" in result.stderr


def test_interrupt_exits_130(planned: Callable[..., None], job: Path, tmp_path: Path) -> None:
    planned(raises=KeyboardInterrupt())
    result = run("plan", job, "-o", tmp_path / "out")
    assert result.exit_code == 130
    assert result.stderr == "interrupted\n"
    assert not (tmp_path / "out").exists()


def test_plot_needs_a_directory(job: Path) -> None:
    result = run("plan", job, "--plot")
    assert result.exit_code == 2
    assert "-o DIR" in result.stderr


def test_unwritable_output(planned: Callable[..., None], job: Path) -> None:
    planned()
    result = run("plan", job, "-o", job)
    assert result.exit_code == 2
    assert result.stderr == f"{job}: cannot be written: is a file, not a directory\n"


@pytest.mark.parametrize(
    "arguments",
    [["plan"], ["plan", "x", "--method", "magic"], ["plan", "x", "--tolerance", "thin"], ["nonsense"]],
)
def test_usage_errors_exit_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


# ------------------------------------------------------------------------------------------ verify


def test_verify_needs_a_trajectory_that_fits(job: Path, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("t,x\n0,0\n1,1\n")
    result = run("verify", tmp_path / "t.csv", job)
    assert result.exit_code == 2
    assert "column 'y' is missing" in result.stderr


def test_verify_takes_the_recorded_machine(job: Path, tmp_path: Path) -> None:
    machine = load_machine("router")
    program = parse_program(SQUARE, machine)
    path = tmp_path / "t.parquet"
    write_trajectory(
        path,
        trajectory_along(toolpath_from_program(program, machine), time=1.5),
        {"machine": machine.model_dump(mode="json", exclude_none=True), "tolerance_mm": 0.01},
    )
    result = run("verify", path, job, "--json")
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout)
    assert said["machine"] == "router"
    assert said["contour_error_mm"] < 1e-9
    assert said["tolerance_mm"] == 0.01
    assert said["cycle_time_s"] == 6.0
    assert said["notes"] == [
        "the file says: machine router (taken)",
        "the file says: tolerance 0.01 mm (taken)",
    ]
    other = run("verify", path, job, "-m", "mill")
    assert other.exit_code == 0
    assert "the file says: tolerance 0.01 mm (not taken, -m or --tolerance is given)" in other.stderr
    assert ["tolerance", f"{load_machine('mill').tolerance:g}", "mm"] in [
        row.split() for row in other.stdout.splitlines()
    ]
    assert ["cycle", "time", "6.0000", "s"] in [row.split() for row in other.stdout.splitlines()]
    assert json.loads(run("verify", path, job, "--tolerance", "0.5", "--json").stdout)["tolerance_mm"] == 0.5
    unknown = run("verify", path, job, "--not-limited", "yerk")
    assert unknown.exit_code == 2
    assert "jerk" in unknown.stderr
    fast = tmp_path / "fast.csv"
    write_trajectory(fast, trajectory_along(toolpath_from_program(program, machine), time=0.1))
    result = run("verify", fast, job, "-m", "router")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout


def test_verify_does_not_believe_what_a_file_says_of_its_limits(job: Path, tmp_path: Path) -> None:
    machine = load_machine("router")
    program = parse_program(SQUARE, machine)
    path = tmp_path / "fast.npz"
    about = {
        "machine": machine.model_dump(mode="json", exclude_none=True),
        "not_limited": ["jerk", "acceleration", 5],
    }
    write_trajectory(path, trajectory_along(toolpath_from_program(program, machine), time=0.1), about)
    result = run("verify", path, job)
    assert result.exit_code == 1
    assert "the file says: not limited: jerk, acceleration (judged all the same" in result.stderr
    assert (
        "jerk is exceeded; the file says that its plan did not limit it: --not-limited jerk reports it"
        in result.stderr
    )


@pytest.mark.parametrize(
    "said", [{"tolerance_mm": "wide"}, {"tolerance_mm": -1.0}, {"not_limited": None}, {"machine": 7}]
)
def test_verify_takes_no_harm_from_what_a_file_says_of_itself(job: Path, tmp_path: Path, said: dict) -> None:
    machine = load_machine("mill")
    path = tmp_path / "t.npz"
    write_trajectory(
        path, trajectory_along(toolpath_from_program(parse_program(SQUARE, machine), machine), time=1.5), said
    )
    assert run("verify", path, job, "-m", "mill").exit_code == 0
    assert run("verify", path, job).exit_code == 0


# ------------------------------------------------------------------------------------------ info


def test_info(job: Path, tmp_path: Path) -> None:
    result = run("info", job)
    assert result.exit_code == 0
    assert "every construct is supported" in result.stdout
    assert json.loads(run("info", job, "--json").stdout)["blocks"]["line"] == 4
    (tmp_path / "bad.ngc").write_text("G21 G90\nG41 D1\nG1 X5 F100\nG81 X1 Z-3 R1\n")
    result = run("info", tmp_path / "bad.ngc")
    assert result.exit_code == 2
    assert "2:1" in result.stdout
    assert "4:1" in result.stdout


@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "not found"), (b"", "empty"), (b"\x7fELF\x00\x01\x02\x00", "")],
)
def test_no_program_at_all(tmp_path: Path, content: bytes | None, said: str) -> None:
    path = tmp_path / "job.ngc"
    if content is not None:
        path.write_bytes(content)
    result = run("info", path)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{path}:")
    assert said in result.stderr
    assert "Traceback" not in result.stderr


# ------------------------------------------------------------------------------------------ machine files


def with_line(old: str, new: str) -> str:
    text = TEMPLATE.read_text()
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "machine file not found"),
        ("name = ", "not valid TOML"),
        ("", "name: missing"),
        (
            with_line("[axes.y]\nvelocity = 500.0\nacceleration = 4000.0\njerk = 100000.0\n", ""),
            "axis 'y' is missing",
        ),
        (with_line("velocity = 500.0", "velocity = 0.0"), "axes.x.velocity"),
        (with_line("velocity = 500.0", "velocity = -1.0"), "axes.x.velocity"),
        (with_line("velocity = 500.0", "velocity = nan"), "axes.x.velocity"),
        (with_line("jerk = 100000.0", "jerk = inf"), "axes.x.jerk"),
        (with_line("jerk = 100000.0", ""), "axes.x.jerk: missing"),
        (with_line("tolerance = 0.02", "tolerance = 0"), "tolerance"),
        (with_line("tolerance = 0.02", "tolerance = 'thin'"), "tolerance"),
        (with_line("dt = 0.001", "dt = 0.001\nspeed = 3"), "speed: unknown key"),
        (with_line("[axes.z]", "[axes.w]"), "axis 'w' is not known"),
        (with_line('path_control = "blend"', 'path_control = "round"'), "path_control"),
        (TEMPLATE.read_text() + "[positions.g99]\nx = 1\n", "'g99' is not known"),
        (TEMPLATE.read_text() + "[tools]\nlong = 1\n", "not a tool number"),
    ],
)
def test_bad_machine_files(job: Path, tmp_path: Path, content: str | None, said: str) -> None:
    path = tmp_path / "machine.toml"
    if content is not None:
        path.write_text(content)
    result = run("info", job, "-m", path)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{path}: ")
    assert said in result.stderr
    assert "Traceback" not in result.stderr


def test_a_machine_file_that_is_no_text(job: Path, tmp_path: Path) -> None:
    (tmp_path / "machine.toml").write_bytes(b"\xff\xfe\x00\x00")
    assert "cannot be read" in run("info", job, "-m", tmp_path / "machine.toml").stderr
    assert "cannot be read" in run("info", job, "-m", tmp_path).stderr


def test_list_and_show() -> None:
    assert "mill" in builtin_machines()
    listed = run("machine", "list")
    assert listed.exit_code == 0
    assert all(name in listed.stdout for name in builtin_machines())
    assert run("machine", "show", "mill").stdout.startswith("# ")
    missing = run("machine", "show", "lathe")
    assert missing.exit_code == 2
    assert "no built-in machine 'lathe'" in missing.stderr


def test_init_writes_once(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert run("machine", "init", path).exit_code == 0
    assert load_machine(path).name == "my-machine"
    path.write_text("changed")
    again = run("machine", "init", path)
    assert again.exit_code == 2
    assert "not overwritten" in again.stderr
    assert path.read_text() == "changed"
    assert run("machine", "init", tmp_path / "none" / "mine.toml").exit_code == 2


def test_every_key_of_the_template_is_valid_and_every_key_is_in_it(tmp_path: Path) -> None:
    """With all optional keys uncommented the file loads, and sets every field of the record."""
    text = re.sub(r"^# (?=\[|[\w.]+ = )", "", TEMPLATE.read_text(), flags=re.MULTILINE)
    # the optional keys of the top level stand before the first table, as TOML demands
    (tmp_path / "full.toml").write_text(text)
    machine = load_machine(tmp_path / "full.toml")
    assert machine.model_fields_set == set(type(machine).model_fields)
    assert machine.fir is not None
    assert machine.fir.phase_lag_max == 30.0
    assert "a" in machine.axes
    assert machine.work_offsets["g55"]["x"] == 120.0


# ------------------------------------------------------------------------------------------ all commands


def test_version_and_short_help() -> None:
    assert run("--version").stdout == f"planner {planner.__version__}\n"
    for words in ([], ["plan"], ["machine"], ["machine", "init"]):
        assert run(*words, "-h").stdout == run(*words, "--help").stdout != ""


def test_memory_used_up_exits_3(planned: Callable[..., None], job: Path) -> None:
    planned(raises=MemoryError("Unable to allocate 428. MiB"))
    result = run("plan", job)
    assert result.exit_code == 3
    assert result.stderr.startswith("not solved: the memory is used up (Unable to allocate 428. MiB); split")


def test_control_characters_are_not_sent_to_the_terminal(
    planned: Callable[..., None], tmp_path: Path
) -> None:
    evil = tmp_path / "a\x1b[31m\x9b.ngc"
    evil.write_text(SQUARE)
    machine = tmp_path / "m.toml"
    machine.write_text(with_line('name = "my-machine"', 'name = "m\\u001b[31m"'))
    planned()
    for result in (
        run("info", evil, "-m", machine),
        run("info", tmp_path / "no\x1b.ngc"),
        run("info", tmp_path / "a\x1b[31m\x9b.ngc", "-m", tmp_path / "no\x1b.toml"),
        run("plan", evil, "-o", tmp_path / "out\x1b"),
    ):
        assert "\x1b" not in result.output + result.stderr
        assert "\x9b" not in result.output + result.stderr
        assert "\\x1b" in result.output + result.stderr


def test_rows_are_not_cut_in_pipes(job: Path, tmp_path: Path) -> None:
    show(Text("wide " * 100 + "end"))
    name = "long-" * 30 + ".ngc"
    (tmp_path / name).write_text(SQUARE)
    assert run("info", tmp_path / name).stdout.splitlines()[0].startswith(str(tmp_path / name))


# ------------------------------------------------------------------------------------------ outputs


def test_outputs_do_not_replace_what_is_not_ours(
    planned: Callable[..., None], job: Path, tmp_path: Path
) -> None:
    planned()
    (tmp_path / "summary.json").write_text("mine")
    refused = run("plan", job, "-o", tmp_path)
    assert refused.exit_code == 2
    assert "summary.json: was not written by planner" in refused.stderr
    assert (tmp_path / "summary.json").read_text() == "mine"
    assert run("plan", job, "-o", tmp_path, "--force").exit_code == 0
    assert run("plan", job, "-o", tmp_path).exit_code == 0


def test_a_job_is_not_overwritten(planned: Callable[..., None], tmp_path: Path) -> None:
    planned()
    job = tmp_path / "trajectory.parquet"
    job.write_text(SQUARE)
    result = run("plan", job, "-o", tmp_path, "--force")
    assert result.exit_code == 2
    assert "read as input" in result.stderr
    assert job.read_text() == SQUARE


@pytest.mark.parametrize("name", ["n" * 300, "n" * 300 + "/out"])
def test_names_that_are_too_long(planned: Callable[..., None], job: Path, tmp_path: Path, name: str) -> None:
    planned()
    for arguments in (
        ["plan", job, "-o", tmp_path / name],
        ["compare", job, "--method", "stop", "-o", tmp_path / f"{name}.json"],
        ["machine", "init", tmp_path / name],
        ["info", tmp_path / name],
        ["info", job, "-m", tmp_path / name],
        ["verify", tmp_path / f"{name}.csv", job],
        ["pulses", tmp_path / f"{name}.csv", "--steps", "x=1"],
    ):
        result = run(*arguments)
        assert result.exit_code == 2, arguments
        assert "File name too long" in result.stderr
        assert "Traceback" not in result.stderr


# ------------------------------------------------------------------------------------------ inputs


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices")
def test_files_that_do_not_end(job: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    for file, said in ((pipe, "this is a named pipe"), (tmp_path / "zero.csv", "this is a device")):
        for arguments in (["info", file], ["info", job, "-m", file], ["verify", file, job]):
            result = run(*arguments)
            assert result.exit_code == 2
            assert said in result.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 100_000, "nested too deep"),
        ("dt = " + "1" * 5000, "not valid TOML"),
        (TEMPLATE.read_text() + "[tools]\n" + "1" * 5000 + " = 1\n", "not a tool number"),
    ],
)
def test_machine_files_beyond_reason(job: Path, tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "machine.toml").write_text(text)
    result = run("info", job, "-m", tmp_path / "machine.toml")
    assert result.exit_code == 2
    assert said in result.stderr
    assert len(result.stderr) < 1000


@pytest.mark.parametrize(
    "about", ['{"not_limited": null}', '{"not_limited": 3}', "[" * 100_000, '{"a": ' + "1" * 5000 + "}"]
)
def test_metadata_beyond_reason(job: Path, tmp_path: Path, about: str) -> None:
    (tmp_path / "t.csv").write_text("t,x,y,z\n" + "".join(f"{k},{k},0,0\n" for k in range(9)))
    (tmp_path / "t.meta.json").write_text(about)
    result = run("verify", tmp_path / "t.csv", job)
    assert result.exit_code == (1 if "null" in about or "3}" in about else 2), result.output
    assert "Traceback" not in result.stderr


def test_an_array_named_npz(job: Path, tmp_path: Path) -> None:
    with (tmp_path / "t.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    result = run("verify", tmp_path / "t.npz", job)
    assert result.exit_code == 2
    assert "a single array" in result.stderr


@pytest.mark.parametrize("method", ["optimal", "stop", "fir"])
@pytest.mark.parametrize(
    "move", ["F0.0001\nG1 X10", "F3000\nG2 X10 Y0 R900000000", "F3000\nG1 X10\nG4 P1000000"]
)
def test_motions_that_take_for_ever_are_refused_at_once(tmp_path: Path, method: str, move: str) -> None:
    (tmp_path / "job.ngc").write_text(f"G21 G90 G17\n{move}\nM2\n")
    result = run("plan", tmp_path / "job.ngc", "--method", method)
    assert result.exit_code == 2
    assert "samples are made: raise the feed" in result.stderr
