"""Too little memory is told as that, whatever library notices it (found by benchmarks/faults)."""

from __future__ import annotations

import errno
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from planner.commands import terminal
from planner.commands.many import plan_many
from planner.commands.terminal import NOT_SOLVED
from tests.commands.command_line import run


def chained() -> Exception:
    """An error of a library that came of the loader's."""
    try:
        try:
            raise ImportError("libarrow.so.2600: failed to map segment from shared object")
        except ImportError as fault:
            raise ValueError("no such format") from fault
    except ValueError as fault:
        return fault


@pytest.mark.parametrize(
    "fault",
    [MemoryError(), OSError(errno.ENOMEM, "x"), RuntimeError("can't start new thread"), chained()],
    ids=["MemoryError", "ENOMEM", "threads", "library"],
)
def test_what_comes_of_too_little_memory(fault: Exception) -> None:
    assert terminal.is_of_memory(fault)


@pytest.mark.parametrize("fault", [ValueError("x"), OSError(errno.ENOENT, "x"), KeyError("memory")])
def test_other_faults_are_bugs(fault: Exception) -> None:
    assert not terminal.is_of_memory(fault)


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space")
def test_a_library_that_is_not_found_under_a_limit(tmp_path: Path) -> None:
    """Llvmlite says that its library cannot be found, and no more."""
    code = (
        "import resource\n"
        "from planner.commands.terminal import is_of_memory\n"
        "assert not is_of_memory(OSError('Could not find'))\n"
        "resource.setrlimit(resource.RLIMIT_AS, (200 << 20, 200 << 20))\n"
        "assert is_of_memory(OSError('Could not find'))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_command_that_runs_out_of_memory_is_no_bug(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "job.ngc").write_text("G1 X1 F600\n")

    def fail(*_: object, **__: object) -> None:
        raise ImportError("libarrow.so: failed to map segment from shared object")

    monkeypatch.setattr("planner.report.summary.summary", fail)
    done = run("plan", tmp_path / "job.ngc", "--method", "stop")
    assert done.exit_code == NOT_SOLVED
    assert "the memory is used up" in done.output
    assert "bug" not in done.output


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space")
@pytest.mark.parametrize("megabytes", [60, 64, 140, 200])
def test_libraries_that_do_not_fit_are_no_traceback(megabytes: int, tmp_path: Path) -> None:
    """Found by benchmarks/faults: what planner imports may already be too large."""
    (tmp_path / "job.ngc").write_text("G1 X1 F600\n")
    code = (
        "import resource\n"
        f"resource.setrlimit(resource.RLIMIT_AS, ({megabytes} << 20, {megabytes} << 20))\n"
        f"import sys; sys.argv = ['planner', 'info', {str(tmp_path / 'job.ngc')!r}]\n"
        "from planner.cli import main; main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if "OpenBLAS" not in done.stderr:  # OpenBLAS ends the process by itself
        assert done.stderr.startswith(
            ("not solved: there is too little memory", "not solved: the memory is used up")
        )
        assert "Traceback" not in done.stderr
        assert done.returncode == NOT_SOLVED


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_a_process_that_is_killed_from_outside_is_no_bug(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kill = f"import os; os.kill(os.getpid(), {signal.SIGKILL:d})"
    monkeypatch.setattr("planner.commands.many.CHILD", kill)
    jobs = [tmp_path / name for name in ("a.ngc", "b.ngc")]
    assert plan_many(jobs, [], None, threads=1, quiet=True, as_json=False) == NOT_SOLVED
    said = capsys.readouterr().out
    assert "ended from outside (signal 9)" in said
    assert "bug" not in said
