"""The runner: pairs are measured in processes of their own, kept at once, resumed, and failures are rows."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import main
from benchmarks.jobs import problems
from benchmarks.runner.judged import NotApplicable, NotHere
from benchmarks.runner.measure import Calibration, Protocol, measured, outcome
from benchmarks.runner.rows import ERROR, NOT_APPLICABLE, OVER_LIMIT, SKIPPED, SOLVED, Row, read
from benchmarks.runner.run import Request, Worker, run
from benchmarks.runner.suites import ROOT, SUITES, Job
from benchmarks.runner.ways import MODELS, PEERS, Way, way_of
from planner.base.errors import InputError
from planner.machine import Machine
from planner.nc.program import Program

PENTAGON = Job(name="pentagon", program=lambda machine: problems.pentagon())
CLOCK = 0.01  # what the timer of the limit and the count of processor time may differ by: a tick of the kernel [s]
BLANK = Row(suite="quick", job="pentagon", way="way", kind="method", status=ERROR)


@pytest.mark.slow
def test_a_run_appends_rows_and_resumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = [
        "run",
        "quick",
        "--only",
        "pentagon",
        "circle",
        "--methods",
        "stop",
        "--peers",
        "none",
        "--repeats",
        "1",
    ]
    assert main([*command, "--count", "1", "--folder", str(tmp_path)]) == 0
    (row,) = read(tmp_path / "quick.jsonl").rows.values()
    assert (row.job, row.way, row.status, row.verdict) == ("pentagon", "stop", SOLVED, "passed")
    assert row.cpu_s is not None
    assert row.cpu_s > 0.0
    assert row.quiet is not None
    assert row.quiet >= 1.0
    (about,) = read(tmp_path / "quick.jsonl").abouts
    assert about["planner"] == row.commit
    capsys.readouterr()
    if "+" in row.commit or not row.commit:
        pytest.skip("the planner has changes that no commit has: nothing is resumed")
    assert main([*command, "--resume", "--folder", str(tmp_path)]) == 0
    assert "circle / stop" in (said := capsys.readouterr().out)
    assert "pentagon" not in said
    assert len(read(tmp_path / "quick.jsonl").rows) == 2


@pytest.mark.slow
def test_ways_side_by_side_give_the_same_rows_but_their_times(tmp_path: Path) -> None:
    request = {
        "suites": ("quick",), "only": ("pentagon", "circle"), "methods": ("stop", "kinematic"), "peers": ("none",),
        "repeats": 1,
    }  # fmt: skip
    one, two = (run(Request(**request, processes=n, folder=tmp_path / str(n)))["quick"] for n in (1, 2))

    def what(made: list[Row]) -> set[tuple[object, ...]]:
        return {(*row.key, row.status, row.verdict, row.cycle_s) for row in made}

    assert len(what(one)) == 4
    assert what(one) == what(two)
    assert {row.beside for row in one} == {0}
    assert {row.beside for row in two} == {1}
    assert all(row.noisy for row in two)
    written = read(tmp_path / "2" / "quick.jsonl").rows
    assert {key: row.cpu_s for key, row in written.items()} == {row.key: row.cpu_s for row in two}


@pytest.mark.slow
def test_a_process_that_dies_is_a_row_and_says_why() -> None:
    worker = Worker("stop")
    row = worker.answer(
        {"suite": "quick", "job": "none of that name", "repeats": 1, "limit": 1.0, "commit": ""}, 60.0
    )
    assert (row.status, row.message) == (ERROR, "the process died: KeyError: 'none of that name'")
    assert not worker.alive


@pytest.mark.slow
def test_a_process_that_its_processor_limit_ends_is_over_the_limit() -> None:
    worker = Worker("stop")
    worker._process.send_signal(signal.SIGVTALRM)
    row = worker.answer({"suite": "quick", "job": "pentagon", "repeats": 1, "limit": 1.0, "commit": ""}, 60.0)
    assert (row.status, row.message) == (OVER_LIMIT, "more than 1 CPU s in a call that did not come back")


COMPILED = """
from benchmarks.runner.measure import Calibration, Protocol, measured
from benchmarks.runner.rows import Row
from benchmarks.runner.suites import SUITES
from benchmarks.runner.ways import Way
way = Way(name="way", kind="peer", plan=lambda *given: sum(range(10**12)))  # no handler runs within
blank = Row(suite="quick", job="pentagon", way="way", kind="peer", status="error")
measured(way, SUITES["quick"].jobs()[0], blank, Protocol(limit=0.1), Calibration())
"""


@pytest.mark.slow
def test_compiled_code_that_does_not_come_back_ends_with_its_process() -> None:
    ran = subprocess.run([sys.executable, "-c", COMPILED], cwd=ROOT, timeout=120.0, check=False)
    assert ran.returncode == -signal.SIGVTALRM


def failing(fault: BaseException) -> Way:
    def planned(program: Program, machine: Machine, tolerance: float | None) -> float:
        raise fault

    return Way(name="way", kind="peer", plan=planned)


@pytest.mark.parametrize(
    ("fault", "status", "message"),
    [
        (InputError("line 3: no such word"), NOT_APPLICABLE, "line 3: no such word"),
        (NotApplicable("lines only"), NOT_APPLICABLE, "lines only"),
        (NotHere("no package"), SKIPPED, "no package"),
        (ZeroDivisionError("by\nzero"), ERROR, "ZeroDivisionError: by zero"),
    ],
)
def test_failures_are_rows(fault: Exception, status: str, message: str) -> None:
    row = outcome(failing(fault), PENTAGON, BLANK)
    assert (row.status, row.message, row.verdict, row.blocks) == (status, message, "", 5)


def test_a_call_over_its_limit_is_ended() -> None:
    def endless(program: Program, machine: Machine, tolerance: float | None) -> float:
        while True:
            pass

    way = Way(name="way", kind="peer", plan=endless)
    row = measured(way, PENTAGON, BLANK, Protocol(repeats=3, limit=0.05), Calibration())
    assert (row.status, row.message) == (OVER_LIMIT, "more than 0.05 CPU s")
    assert len(row.cpu_all) == 1
    assert 0.05 - CLOCK <= row.cpu_all[0] < 1.0


def test_the_least_of_the_repeats_counts() -> None:
    row = measured(way_of("stop"), PENTAGON, BLANK, Protocol(repeats=3), Calibration())
    assert row.status == SOLVED
    assert row.cpu_s == min(row.cpu_all)
    assert len(row.cpu_all) == 3


def test_peers_and_models_judge_and_predict_the_same_job() -> None:
    stops = outcome(way_of("stop"), PENTAGON, BLANK)
    assert stops.cycle_s is not None
    resting = outcome(way_of("ruckig"), PENTAGON, BLANK)
    if resting.status == SKIPPED:
        pytest.skip(resting.message)
    assert resting.verdict == "passed"
    assert resting.cycle_s is not None
    # both move from rest to rest in the shortest time; ruckig's lines are whole periods long
    assert 0.0 <= resting.cycle_s - stops.cycle_s <= 5 * problems.machine().dt
    for name in MODELS:
        row = outcome(way_of(name), PENTAGON, BLANK)
        assert (row.status, row.verdict) == (SOLVED, "")
        assert row.cycle_s is not None
        assert 0.5 * stops.cycle_s < row.cycle_s < stops.cycle_s


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"suites": ("fast",)}, "no suite 'fast'; there are quick"),
        ({"suites": ("quick",), "methods": ("optimum",)}, "did you mean 'optimal'"),
        ({"suites": ("quick",), "methods": ("stop:quick",)}, "method stop has no corner and no effort"),
        ({"suites": ("quick",), "methods": ("optimal/round",)}, "no corner 'round'"),
        ({"suites": ("quick",), "limit": 0.0}, "limit 0"),
        ({"suites": ("quick",), "processes": 0}, "processes 0"),
    ],
)
def test_wrong_requests_are_refused(given: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Request(**given)


def test_ways_are_the_suites_or_those_asked_for() -> None:
    request = Request(suites=("papers",), methods=("stop",), peers=("none",))
    assert request.ways("papers") == ["stop"]
    assert "copp:quick" in Request(suites=("papers",), methods=("none",)).ways("papers")
    assert "copp:quick" not in Request(suites=("papers",), peers=("none",)).ways("papers")
    assert set(Request(suites=("papers",)).ways("papers")) == set(SUITES["papers"].ways)
    assert Request(suites=("quick",), peers=("all",)).ways("quick")[-len(PEERS) - len(MODELS) :] == [
        *PEERS,
        *MODELS,
    ]


def test_job_names_are_unique_and_ways_known() -> None:
    for suite in SUITES.values():
        for way in suite.ways:
            way_of(way)
        names = [job.name for job in suite.jobs()] if suite.absent() is None else []
        assert len(names) == len(set(names))
