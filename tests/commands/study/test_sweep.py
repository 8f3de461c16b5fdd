"""Sweeps: values, points that are kept and taken up again, the table, and a cluster one of whose workers is killed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hand_made import SQUARE
from typer.testing import CliRunner, Result

from planner.base.errors import InputError
from planner.cli import app
from planner.commands.study.points import PASSED, SweepFolder, planned_point
from planner.commands.study.settings import Setting, StudiedJob, grid_of, parse_varied
from planner.machine import load_machine
from planner.nc.reader import parse_program

ROOT = Path(__file__).resolve().parents[2]
MILL = load_machine("mill")


def studied(**how: object) -> StudiedJob:
    return StudiedJob(program=parse_program(SQUARE, MILL), machine=MILL, how={"method": "stop"} | how)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["sweep", *(str(argument) for argument in arguments)])


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "square.ngc"
    path.write_text(SQUARE)
    return path


# ------------------------------------------------------------------------------------------ values


@pytest.mark.parametrize(
    ("text", "name", "values"),
    [
        ("tolerance=0.01:0.16:5:log", "tolerance", (0.01, 0.02, 0.04, 0.08, 0.16)),
        ("x.velocity=100:300:3", "axes.x.velocity", (100.0, 200.0, 300.0)),
        ("axes.y.jerk=1e5,2e5,1e5", "axes.y.jerk", (1e5, 2e5)),
        ("tolerance=10um:0.02:2", "tolerance", (0.01, 0.02)),
        ("x.acceleration=-50%:+50%:3", "axes.x.acceleration", (2000.0, 4000.0, 6000.0)),
        ("feed=1:2:1", "feed", (1.0,)),
    ],
)
def test_values(text: str, name: str, values: tuple[float, ...]) -> None:
    found = parse_varied(text, MILL, 0.02)
    assert (found.name, found.values) == (name, pytest.approx(values, rel=1e-12))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tolerance", "write a name and a range"),
        ("tolerance=1:2", "write FIRST:LAST:COUNT"),
        ("tolerance=0.01-0.05", "for a range write FIRST:LAST:COUNT"),
        ("tolerance=0.01..0.05", "for a range write FIRST:LAST:COUNT"),
        ("tolerance=1:2:3:4", "write FIRST:LAST:COUNT"),
        ("tolerance=1:2:0", "'0' values"),
        ("tolerance=0:2:3:log", "must be positive"),
        ("tolerence=1:2:3", "did you mean 'tolerance'?"),
    ],
)
def test_values_that_are_none(text: str, said: str) -> None:
    with pytest.raises(InputError) as fault:
        parse_varied(text, MILL, 0.02)
    assert said in str(fault.value)


def test_a_setting_twice_and_grids_without_end() -> None:
    twice = [parse_varied(f"tolerance={values}", MILL, 0.02) for values in ("0.1:0.2:2", "0.3,0.4")]
    with pytest.raises(InputError, match="varied twice"):
        grid_of(twice)
    large = [parse_varied(f"{axis}.jerk=1e4:1e5:2000", MILL, 0.02) for axis in "xy"]
    with pytest.raises(InputError, match="4,000,000 combinations"):
        grid_of(large)


# ------------------------------------------------------------------------------------------ points


@pytest.mark.shows("sweep", "exact: a point is the plan with its settings, on processes and on a cluster")
def test_a_point_is_the_plan_with_its_settings() -> None:
    """A square from stop to stop: four times as much jerk saves 1 - 4^(-1/3) of the time, as long as nothing else limits it."""
    machine = MILL.model_copy(
        update={"axes": {k: v.model_copy(update={"velocity": 1e4, "acceleration": 1e6}) for k, v in MILL.axes.items()}}
    )  # fmt: skip
    job = StudiedJob(
        program=parse_program(SQUARE.replace("F3000", "F600000"), machine),
        machine=machine,
        how={"method": "stop"},
    )
    slow, fast = (
        planned_point(job, [Setting(name=f"axes.{axis}.jerk", value=jerk) for axis in "xy"])
        for jerk in (1e5, 4e5)
    )
    assert (slow["outcome"], slow["axes.x.jerk"]) == (PASSED, 1e5)
    assert fast["cycle_time_s"] / slow["cycle_time_s"] == pytest.approx(4 ** (-1 / 3), abs=2e-3)
    refused = planned_point(studied(), [Setting(name="dt", value=1e-9)])
    assert refused["outcome"] == "refused"
    assert "samples" in refused["sentence"]


@pytest.mark.slow
def test_a_sweep_is_taken_up_again(job: Path, tmp_path: Path) -> None:
    out, ranges = tmp_path / "out", ("--vary", "tolerance=0.01,0.02", "--vary", "x.jerk=1e5:2e5:3")
    first = run(job, "-o", out, *ranges, "--method", "stop", "--threads", 1)
    assert first.exit_code == 0, first.output + first.stderr
    table = pq.read_table(out / "sweep.parquet").to_pydict()
    assert table["tolerance"] == [0.01] * 3 + [0.02] * 3
    assert table["axes.x.jerk"] == [1e5, 1.5e5, 2e5] * 2
    assert table["outcome"] == [PASSED] * 6
    assert (out / "sweep.png").read_bytes().startswith(b"\x89PNG")
    files = sorted((out / "points").iterdir())
    assert len(files) == 6
    written = {file: file.stat().st_mtime_ns for file in files}
    files[0].unlink()
    files[1].write_text('{"outcome": "pas')  # half a file, as no run of ours leaves it
    again = json.loads(run(job, "-o", out, *ranges, "--method", "stop", "--threads", 1, "--json").stdout)
    assert again["reused"] == 4
    assert {f for f in files if f.stat().st_mtime_ns == written[f]} == set(files[2:])
    time = {k: v for k, v in table.items() if k != "planning_cpu_s"}
    assert {k: v for k, v in pq.read_table(out / "sweep.parquet").to_pydict().items() if k in time} == time
    fewer = ("--vary", "tolerance=0.01,0.02,0.03", "--vary", "x.jerk=1e5")
    more = run(job, "-o", out, *fewer, "--method", "stop", "--threads", 1)
    assert "3, 2 of them planned before: 3 passed" in more.stdout


@pytest.mark.slow
def test_what_has_changed_is_refused(job: Path, tmp_path: Path) -> None:
    out, ranges = tmp_path / "out", ("--vary", "tolerance=0.01,0.02", "--threads", 1)
    assert run(job, "-o", out, *ranges, "--method", "stop").exit_code == 0
    job.write_text(SQUARE + "\n(another comment)\n")
    assert run(job, "-o", out, *ranges, "--method", "stop").exit_code == 0
    other = run(job, "-o", out, *ranges, "--method", "bezier")
    assert (other.exit_code, "with another method" in other.stderr) == (2, True)
    assert "another machine" in run(job, "-o", out, *ranges, "--method", "stop", "-m", "router").stderr
    job.write_text(SQUARE.replace("X10", "X11"))
    changed = run(job, "-o", out, *ranges, "--method", "stop")
    assert (changed.exit_code, "with another program" in changed.stderr) == (2, True)
    anew = run(job, "-o", out, *ranges, "--method", "stop", "--force")
    assert (anew.exit_code, "points   2: 2 passed" in anew.stdout) == (0, True)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("")
    assert "holds no sweep" in run(job, "-o", tmp_path / "mine", *ranges).stderr
    assert "is a file" in run(job, "-o", job, *ranges).stderr


def test_failures_are_rows_and_the_exit_code(job: Path, tmp_path: Path) -> None:
    done = run(job, "-o", tmp_path / "out", "--vary", "dt=1e-3,1e-9", "--method", "stop", "--threads", 1)
    assert done.exit_code == 3
    assert "1 passed, 1 refused" in done.stdout
    assert "1 refused: " in done.stdout
    for wrong, said in (
        (["--cluster", "tcp://127.0.0.1:9", "--threads", "2"], "a cluster has the workers that it has"),
        (["--vary", "x.jrk=1:2:3"], "did you mean 'axes.x.jerk'?"),
        (["--vary", "feed=1,2", "--corner", "fir", "--method", "stop"], "method stop does not use it"),
    ):
        result = run(
            job, "-o", tmp_path / "other", *(["--vary", "feed=1,2"] if "--vary" not in wrong else []), *wrong
        )
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
    assert not (tmp_path / "other").exists()


@pytest.mark.shows("sweep", "exact: a point is the plan with its settings, on processes and on a cluster")
@pytest.mark.slow
def test_processes_of_this_machine_find_the_same(job: Path, tmp_path: Path) -> None:
    ranges = ("--vary", "tolerance=0.01,0.02,0.04", "--method", "stop")
    tables = []
    for threads in (1, 2):
        assert run(job, "-o", tmp_path / str(threads), *ranges, "--threads", threads).exit_code == 0
        table = pq.read_table(tmp_path / str(threads) / "sweep.parquet").drop_columns(["planning_cpu_s"])
        tables.append(table.to_pydict())
    assert tables[0] == tables[1]


# ------------------------------------------------------------------------------------------ cluster


@pytest.fixture
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[str]], subprocess.Popen[str]]]:
    """A scheduler with two workers, as processes: its address, the workers and itself."""
    pytest.importorskip(
        "distributed", reason="distributed is not installed: pip install feedrate-planner[cluster]"
    )
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    started: list[subprocess.Popen[str]] = []

    def start(module: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments]
        started.append(
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=env)
        )
        return started[-1]

    try:
        scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        assert scheduler.stderr is not None
        found = next(
            found for line in scheduler.stderr if (found := re.search(r"Scheduler at:\s+(tcp://\S+)", line))
        )
        address = found[1]
        workers = [
            start("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard") for _ in range(2)
        ]
        for worker in workers:
            assert worker.stderr is not None
            assert any("Registered to" in line for line in worker.stderr)
        yield address, workers, scheduler
    finally:
        for process in started:
            process.kill()
            process.communicate()


def sweep_on(address: str, job: Path, out: Path, count: int) -> tuple[object, ...]:
    """What the command is given for so many points on a cluster."""
    ranges = ("--vary", f"x.jerk=1e5:2e5:{count}", "--method", "stop")
    return (job, "-o", out, *ranges, "-q", "--cluster", address)


def killed_on_the_way(
    given: tuple[object, ...], out: Path, victim: subprocess.Popen[str]
) -> tuple[int, Result]:
    """A process of the cluster is killed when the sweep has its first points: how many were there, and how the command ended."""
    there: list[int] = []

    def kill() -> None:
        while not (found := list((out / "points").glob("*.json"))) and not ended.is_set():
            time.sleep(0.02)
        there.append(len(found))
        victim.send_signal(signal.SIGKILL)

    ended, killer = threading.Event(), threading.Thread(target=kill)
    killer.start()
    try:
        done = run(*given)
    finally:
        ended.set()
        killer.join()
    return there[0], done


@pytest.mark.shows("sweep", "exact: a point is the plan with its settings, on processes and on a cluster")
@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_a_cluster_goes_on_without_a_worker_that_is_killed_and_ends_with_its_scheduler(
    cluster: tuple[str, list[subprocess.Popen[str]], subprocess.Popen[str]], job: Path, tmp_path: Path
) -> None:
    """Without its scheduler a sweep ends with a sentence; what was planned stays, and the same command goes on with it."""
    address, workers, scheduler = cluster
    out, count = tmp_path / "out", 16
    there, done = killed_on_the_way(sweep_on(address, job, out, count), out, workers[0])
    assert 0 < there < count  # it was on its way
    assert done.exit_code == 0, done.stderr
    assert f"points   {count}: {count} passed" in done.stdout
    table = pq.read_table(out / "sweep.parquet").to_pydict()
    np.testing.assert_allclose(table["axes.x.jerk"], np.linspace(1e5, 2e5, count))
    here = SweepFolder(tmp_path / "here", studied())
    assert here.known([Setting(name="axes.x.jerk", value=1e5)]) is None
    own = planned_point(studied(), [Setting(name="axes.x.jerk", value=2e5)])
    assert own["cycle_time_s"] == pytest.approx(table["cycle_time_s"][-1], rel=1e-12)
    assert workers[1].poll() is None

    out, count = tmp_path / "second", 24
    _, done = killed_on_the_way(sweep_on(address, job, out, count), out, scheduler)
    there = len(list((out / "points").glob("*.json")))
    assert 0 < there < count
    assert done.exit_code == 3, done.stderr
    assert "the scheduler has gone" in done.stderr
    assert "Traceback" not in done.stderr, done.stderr
    done = run(job, "-o", out, "--vary", f"x.jerk=1e5:2e5:{count}", "--method", "stop", "-q", "--threads", 1)
    assert f"points   {count}, {there} of them planned before: {count} passed" in done.stdout


@pytest.mark.slow
def test_an_address_without_a_scheduler(job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(
        "distributed", reason="distributed is not installed: pip install feedrate-planner[cluster]"
    )
    monkeypatch.setattr("planner.commands.study.sweep.WAIT", 0.5)
    done = run(job, "-o", tmp_path / "out", "--vary", "feed=1,2", "--cluster", "tcp://127.0.0.1:9")
    assert (done.exit_code, "no scheduler answers there" in done.stderr) == (2, True)
