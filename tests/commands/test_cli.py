"""The command line: messages, exit codes, and that nothing bad goes further than a message."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import run
from hand_made import SQUARE
from rich.text import Text
from typer.testing import CliRunner, Result

import planner
from planner.cli import app
from planner.commands.terminal import show
from planner.machine import builtin_machines, load_machine


@pytest.mark.shows("command-line", "sampled: wrong options and files exit with their code and a sentence")
@pytest.mark.parametrize(
    "arguments",
    [["plan"], ["plan", "x", "--method", "magic"], ["plan", "x", "--tolerance", "thin"], ["nonsense"]],
)
def test_usage_errors_exit_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


def test_info(job: Path, tmp_path: Path) -> None:
    result = run("info", job)
    assert result.exit_code == 0
    assert "every construct is supported" in result.stdout
    assert json.loads(run("info", job, "--json").stdout)["blocks"]["line"] == 4
    (tmp_path / "bad.ngc").write_text("G21 G90\nG38.2 X1\nG1 X5 F100\nG29\n")
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


def test_a_bad_machine_file_exits_2(job: Path, tmp_path: Path) -> None:
    """What is said of it: tests/machine/test_machine.py."""
    path = tmp_path / "machine.toml"
    for content in ("", "name = ", "a = " + "[" * 100_000):
        path.write_text(content)
        result = run("info", job, "-m", path)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"{path}: ")
        assert "Traceback" not in result.stderr


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
    run("machine", "init", machine)
    machine.write_text(machine.read_text().replace('name = "my-machine"', 'name = "m\\u001b[31m"'))
    assert "u001b" in machine.read_text()
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
    ("line", "note"),
    [
        ("G4 X1.5", ""),
        ("G52 X10.", "line 4: G52 is none of its codes"),
        ("G83 X5. Y0. Z-3. R1. Q1. P300 F100", "line 4: P0.3: P word without"),
    ],
)
def test_what_an_expanded_program_keeps_of_another_control_is_said(
    tmp_path: Path, line: str, note: str
) -> None:
    """Help promised lines that every control reads, and G4 X stayed, which is an error elsewhere."""
    job = tmp_path / "job.nc"
    job.write_text(
        f"%\nO10\n#1=5.\nWHILE [#1 LT 5] DO1\nEND1\nG21 G90 G94 G98\nG0 X#1 Y0 Z5.\n{line}\nG80 G4 U2\nG4 P500\nM30\n%\n"
    )
    done = run("expand", job)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[4:6] == ["G80 G4 P2.", "G4 P0.5"]
    assert done.stdout.splitlines()[3].startswith("G4 P1.5" if not note else line[:3])
    assert (f"note: LinuxCNC would not read it: {note}" in done.stderr) == bool(note)


def test_expand(tmp_path: Path) -> None:
    job, out = tmp_path / "job.ngc", tmp_path / "flat.ngc"
    job.write_text("G21 F600\no1 sub\nG1 X[#1*2] Y[1/3]\no1 endsub\no1 call [4]\no1 call [5]\nM2\n")
    printed = run("expand", job)
    assert printed.exit_code == 0
    assert printed.stdout.splitlines()[1:] == ["G21 F600", "G1 X8 Y0.3333333", "G1 X10 Y0.3333333", "M2"]
    written = run("expand", job, "-o", out)
    assert written.stdout.strip().endswith("flat.ngc: 4 lines executed, 2 blocks")
    assert out.read_text() == printed.stdout
    assert run("expand", job, "-o", out).exit_code == 2  # it exists
    assert run("expand", out).stdout == out.read_text()  # nothing to expand
    shown = " ".join(run("info", job).stdout.split())
    assert "as linuxcnc: called 1 2 times" in shown
    assert "4 lines executed" in shown
    assert json.loads(run("info", job, "--json").stdout)["expansion"]["calls"] == [["1", 2]]
    job.write_text("G21 F600\nG1 X[1/0]\n")
    assert run("expand", job, "-o", out, "--force").exit_code == 2
    assert "division by zero" in run("expand", job).stderr


# ------------------------------------------------------------------------------------------ what a shell and a user may write


def test_names_that_are_nearly_right(job: Path) -> None:
    for arguments, said in (
        (["plam", job], "Did you mean 'plan'?"),
        (["plan", job, "--toleranse", "1"], "--tolerance"),
        (["plan", job, "--method", "optimel"], "did you mean 'optimal'?"),
        (["plan", job, "-m", "mil"], "did you mean 'mill'?"),
        (["machine", "show", "mil"], "did you mean 'mill'?"),
        (["compare", job, "--method", "stopp"], "did you mean 'stop'?"),
        (["verify", job, job, "--not-limited", "jrek"], "did you mean 'jerk'?"),
    ):
        result = run(*arguments)
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr


@pytest.mark.shows("command-line", "sampled: wrong options and files exit with their code and a sentence")
def test_options_without_an_effect_are_refused(job: Path) -> None:
    for arguments, said in (
        (["plan", job, "--json", "--corners"], "--json prints none"),
        (["plan", job, "-v", "-q"], "--quiet"),
        (["plan", job, "--force"], "without -o or --trace"),
        (["compare", job, "--force"], "name one with -o FILE"),
        (["expand", job, "--force"], "name one with -o FILE"),
    ):
        result = run(*arguments)
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr


def test_a_program_on_the_standard_input(job: Path) -> None:
    def piped(text: str, *arguments: object) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments], input=text)

    alone = json.loads(run("info", job, "--json").stdout)
    told = json.loads(piped(SQUARE, "info", "-", "--json").stdout)
    assert told == alone | {"source": "<stdin>"}
    planned = json.loads(piped(SQUARE, "plan", "-", "--method", "stop", "--json").stdout)
    assert (planned["program"], planned["verdict"]["passed"]) == ("<stdin>", True)
    assert piped(SQUARE, "expand", "-").stdout == SQUARE
    assert piped("G1 X5 ?", "plan", "-").stderr.startswith("<stdin>:1:7: ")
    assert piped("", "info", "-").stderr.startswith("<stdin>:1:1: the program is empty")


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("planner plan --method ki", "kinematic"),
        ("planner plan -m pl", "plotter"),
        ("planner what", "what-if"),
    ],
)
def test_completion(words: str, offered: str) -> None:
    env = {
        "_PLANNER_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    done = CliRunner().invoke(app, [], env=env, prog_name="planner")
    assert done.stdout.split() == [offered]


def test_units_in_brackets_are_printed(job: Path) -> None:
    """They were taken for markup."""
    assert "extent [mm]" in run("info", job).stdout
