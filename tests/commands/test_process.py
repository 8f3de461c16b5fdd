"""The command as a process: interrupts, pipes, encodings, and a cache of kernels without a place."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import rich.progress
from hand_made import SQUARE

from planner.commands import progress as progress_bar
from planner.commands.progress import ProgressBar

PYTHON = [sys.executable, "-c"]
COMMAND = [*PYTHON, "from planner.cli import main; main()"]
TELLS = [*PYTHON, "print('begun', flush=True); from planner.cli import main; main()"]
ROOT = Path(__file__).resolve().parents[2]
ENDED_BY_US, ENDED_BY_PYTHON = 130, -signal.SIGINT  # both are 130 to a shell

unix = pytest.mark.skipif(sys.platform == "win32", reason="signals and descriptors of Unix")


def run(*arguments: object, **how: object) -> subprocess.CompletedProcess[str]:
    command = [*COMMAND, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **how)  # type: ignore[call-overload]


# ------------------------------------------------------------------------------------------ Ctrl-C


@pytest.mark.slow
@unix
def test_ctrl_c_at_random_times(job: Path, tmp_path: Path) -> None:
    """During imports, work and writing: exit code 130, one word, and the outputs whole or not there."""
    command = [*TELLS, "plan", str(job), "--method", "stop", "-o", str(tmp_path / "out")]
    began = time.monotonic()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    takes = time.monotonic() - began
    written = sorted(os.listdir(tmp_path / "out"))
    rng = random.Random(13)
    for _ in range(5):
        with subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # a shell's background jobs, these tests perhaps among them, are born with interrupts ignored
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        ) as process:
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(rng.uniform(0.0, 0.8) * takes)
            process.send_signal(signal.SIGINT)
            err = process.communicate(timeout=60)[1]
        assert process.returncode in (ENDED_BY_US, ENDED_BY_PYTHON, 0), err
        if process.returncode == ENDED_BY_US:
            assert err == "interrupted\n"
        assert sorted(os.listdir(tmp_path / "out")) == written
        assert "run_id" in json.loads((tmp_path / "out" / "summary.json").read_text())


@unix
def test_ctrl_c_ends_at_once_and_removes_temporaries(tmp_path: Path) -> None:
    """The handler does not raise: code that swallows exceptions cannot keep the process alive."""
    code = f"""
from pathlib import Path
from planner.commands.interrupt import end_at_interrupts
from planner.report.replace import replacing
end_at_interrupts()
with replacing(Path({str(tmp_path / "out")!r})) as new:
    (new / "summary.json").write_text("half")
    print("begun", flush=True)
    while True:
        try:
            for _ in iter(int, 1):
                pass
        except BaseException:
            pass
"""
    with subprocess.Popen(
        [*PYTHON, code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=60)[1] == b"interrupted\n"
    assert process.returncode == 130
    assert os.listdir(tmp_path) == []


@unix
def test_ignored_interrupts_stay_ignored() -> None:
    """A job in a shell's background does not end at the Ctrl-C of the job before it."""
    code = """
import os, signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
from planner.commands.interrupt import end_at_interrupts
end_at_interrupts()
os.kill(os.getpid(), signal.SIGINT)
print("alive")
"""
    assert subprocess.run([*PYTHON, code], capture_output=True, text=True, check=True).stdout == "alive\n"


@unix
@pytest.mark.parametrize("code", [0, 3])
def test_a_command_whose_work_is_done_ends_with_its_own_code(code: int) -> None:
    """Python takes handlers away before it leaves; an interrupt then must not end a command that has written everything."""
    leaving = f"""
import atexit, os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from planner import cli
from planner.commands import app
app.app = lambda prog_name: sys.exit({code})
atexit.register(os.kill, os.getpid(), signal.SIGINT)
cli.main()
"""
    done = subprocess.run([*PYTHON, leaving], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (code, "")


# ------------------------------------------------------------------------------------------ output


@pytest.mark.slow
def test_broken_pipe_is_quiet(job: Path) -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [*COMMAND, "info", str(job)], stdout=write_end, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write_end)
    assert done.stderr == ""
    assert done.returncode == 141


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_output_that_cannot_be_written_or_is_closed() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, "machine", "list"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr == "the output cannot be written: No space left on device\n"
    shell = f"{sys.executable} -m planner machine list >&-"
    closed = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=False, cwd=ROOT)
    assert (closed.returncode, closed.stderr) == (0, "")


@pytest.mark.slow
@unix
def test_any_encoding_and_any_file_name(tmp_path: Path) -> None:
    """The units have plain names where an encoding lacks theirs; bytes of a name that are no UTF-8 are escaped."""
    with contextlib.suppress(OSError):  # file systems that take UTF-8 only
        name = os.fsdecode(b"job\xff.ngc")
        (tmp_path / name).write_text(SQUARE)
        done = run("info", tmp_path / name, env={**os.environ, "PYTHONIOENCODING": "ascii"})
        assert (done.returncode, done.stderr) == (0, "")
        assert "job\\udcff.ngc" in done.stdout
    listed = run("machine", "list", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (listed.returncode, listed.stderr) == (0, "")
    assert "mm/s2" in listed.stdout


# ------------------------------------------------------------------------------------------ progress


def test_progress_without_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(progress_bar, "PROGRESS_AFTER", 0.0)
    monkeypatch.setattr(progress_bar, "LINE_EVERY", -1.0)
    monkeypatch.setattr(progress_bar, "LINE_SHARE", -1.0)
    with ProgressBar() as progress:
        progress("solve", 0.0)
        progress("solve", 1.0)
        progress("solve", 0.0)
        progress("solve", 0.5)
    said = [line.partition(": ")[2] for line in capsys.readouterr().err.splitlines()]
    assert said == ["solve", "solve", "solve, pass 2", "solve, pass 2, 50%"]
    with ProgressBar(quiet=True) as progress:
        progress("solve", 0.0)
    assert capsys.readouterr().err == ""


def test_the_clock_of_the_bar_runs_on_after_a_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress_bar, "PROGRESS_AFTER", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    bars: list[rich.progress.Progress] = []

    class Recorded(rich.progress.Progress):
        def __init__(self, *columns: Any, **how: Any) -> None:
            super().__init__(*columns, **how)
            bars.append(self)

    monkeypatch.setattr(rich.progress, "Progress", Recorded)
    with ProgressBar() as progress:
        progress("read", 0.0)
        (bar,) = bars
        progress("read", 1.0)
        clock, before = bar.columns[0], time.monotonic()
        progress("solve", 0.0)
        assert bars == [bar]
        assert [task.description for task in bar.tasks] == ["solve"]
        monkeypatch.setattr(time, "monotonic", lambda: before + 7.0)
        assert str(clock(bar.tasks[0])) == "7 s"


# ------------------------------------------------------------------------------------------ kernels

KERNEL = """
from planner.base.kernels import njit

@njit()
def twice(x):
    return 2 * x
"""
USE = "import sys; sys.path.insert(0, sys.argv[1]); import kernel; print(kernel.twice(21), kernel.twice(1.5))"


def use_kernel(folder: Path, **how: object) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"} | how.pop("env", {})  # type: ignore[operator]
    command = [*PYTHON, USE, str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=env, **how)  # type: ignore[call-overload]


@pytest.fixture
def kernel(tmp_path: Path) -> Path:
    (tmp_path / "kernel.py").write_text(KERNEL)
    return tmp_path


@pytest.mark.slow
@unix
def test_kernels_without_a_place_for_their_cache(kernel: Path) -> None:
    """A file stands where the directory would be made: nothing can be written, not by root either."""
    done = use_kernel(kernel, env={"NUMBA_CACHE_DIR": str(kernel / "kernel.py" / "cache")})
    assert done.stdout == "42 3.0\n"
    assert done.stderr.count("cannot be looked at (Not a directory)") == 1


@pytest.mark.slow
@unix
def test_kernels_on_a_full_disk(kernel: Path) -> None:
    import resource

    done = use_kernel(
        kernel,
        env={"NUMBA_CACHE_DIR": str(kernel / "cache")},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64)),
    )
    assert done.stdout == "42 3.0\n"
    assert done.stderr.count("compiled kernels cannot be kept (File too large)") == 1


@pytest.mark.slow
def test_kernels_are_kept_where_they_can(kernel: Path) -> None:
    done = use_kernel(kernel, env={"NUMBA_CACHE_DIR": str(kernel / "cache")})
    assert (done.stdout, done.stderr) == ("42 3.0\n", "")
    assert len(list((kernel / "cache").rglob("*.kernel"))) == 2
