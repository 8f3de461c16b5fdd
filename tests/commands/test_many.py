"""`planner plan` with several programs: the table, exit codes, names, and Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import run
from hand_made import SQUARE

from planner.base.errors import InputError
from planner.commands.many import folders_of
from planner.report.tables import programs_table

ROOT = Path(__file__).resolve().parents[2]


def test_places_of_the_files() -> None:
    jobs = [Path(name) for name in ("a.ngc", "b/c.nc", "c.ngc")]
    assert folders_of(jobs, Path("out")) == [Path("out/a"), Path("out/c.nc"), Path("out/c.ngc")]
    with pytest.raises(InputError, match=r"x/a\.ngc and y/a\.ngc would be written into the same out/a\.ngc"):
        folders_of([Path("x/a.ngc"), Path("y/a.ngc")], Path("out"))


def test_the_table_of_programs() -> None:
    from rich.console import Console

    summary = {
        "cycle_time_s": 2.5,
        "blocks": 1234,
        "beside_motion": {"total_s": 10.5, "complete": False},
        "verdict": {"contour_error_mm": 0.019, "faults": []},
        "timings_s": {"read": 0.25, "solve": 1.0},
    }
    failed = summary | {"verdict": {"contour_error_mm": 0.5, "faults": ["contour: 0.5 mm"]}}
    rows = [
        ("a.ngc", "passed", summary, ""),
        ("b.ngc", "failed", failed, ""),
        ("c.ngc", "refused", {}, "c.ngc:3: no"),
    ]
    console = Console(width=200)
    with console.capture() as got:
        console.print(programs_table(rows))
    lines = [line.split() for line in got.get().splitlines()]
    assert lines[2] == ["a.ngc", "1,234", "2.5000", "10.5000", "19", "1.25", "passed"]
    assert lines[4] == ["c.ngc", "-", "-", "-", "-", "-", "refused"]
    assert " ".join(lines[5]).startswith(
        "1 of 3 programs passed: 2.5000 s of motion, 10.5000 s in all; some of what"
    )
    assert [" ".join(line) for line in lines[6:]] == ["b.ngc: contour: 0.5 mm", "c.ngc:3: no"]


def test_what_is_refused_before_any_work(tmp_path: Path) -> None:
    one, other = tmp_path / "one.ngc", tmp_path / "other.ngc"
    for path in (one, other):
        path.write_text(SQUARE)
    for arguments, said in (
        ([one, one], "named twice"),
        ([one, other, "--corners"], "--corners is for one program"),
        ([one, other, "--trace", tmp_path / "t.json"], "--trace is for one program"),
        ([one, other, "--method", "stop", "--effort", "quick"], "method stop does not use it"),
        ([one, other, "--plot"], "-o DIR"),
        (["-", other], "one program"),
    ):
        result = run("plan", *arguments)
        assert (result.exit_code, said in result.stderr) == (2, True), (arguments, result.stderr)


@pytest.mark.slow
def test_several_programs(tmp_path: Path) -> None:
    """Each is planned as it is alone; what cannot be is listed, and the exit code is the largest."""
    for name, text in (("a.ngc", SQUARE), ("b.ngc", SQUARE.replace("X10", "X20")), ("bad.ngc", "G1 X1 ?\n")):
        (tmp_path / name).write_text(text)
    jobs = [tmp_path / name for name in ("a.ngc", "bad.ngc", "b.ngc", "none.ngc")]
    done = run("plan", *jobs, "--method", "stop", "--tolerance", "0.03", "-o", tmp_path / "out")
    assert done.exit_code == 2
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines[2:6]] == [str(job) for job in jobs]
    assert [line.split()[-1] for line in lines[2:6]] == ["passed", "refused", "passed", "refused"]
    assert lines[6].startswith("2 of 4 programs passed")
    assert lines[7].startswith(f"{jobs[1]}:1:7")
    assert sorted(os.listdir(tmp_path / "out")) == ["a", "b"]
    summary = json.loads((tmp_path / "out" / "b" / "summary.json").read_text())
    alone = json.loads(run("plan", jobs[2], "--method", "stop", "--tolerance", "0.03", "--json").stdout)
    assert (summary["cycle_time_s"], summary["tolerance_mm"]) == (alone["cycle_time_s"], 0.03)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_loses_only_what_is_not_finished(tmp_path: Path) -> None:
    (tmp_path / "small.ngc").write_text(SQUARE)
    zigzag = "\n".join(f"G1 X{k % 2} Y{k * 0.01:.2f}" for k in range(200_000))
    (tmp_path / "large.ngc").write_text(f"G21 F6000\n{zigzag}\n")
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "planner",
        "plan",
        "small.ngc",
        "large.ngc",
        "-o",
        str(out),
        "--threads",
        "2",
    ]
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stderr is not None
        told = process.stderr.readline()
        while "small.ngc" not in told:
            assert process.poll() is None
            told = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        text = process.communicate(timeout=120)[0]
    assert process.returncode == 130
    assert time.monotonic() - began < 60.0
    assert [line.split()[-1] for line in text.splitlines()[2:4]] == ["passed", "interrupted"]
    assert text.splitlines()[4].startswith("1 of 2 programs passed")
    assert "run_id" in json.loads((out / "small" / "summary.json").read_text())
    assert os.listdir(out) == ["small"]
