"""The second process beside a first run."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from planner.base import kernels
from planner.base.names import METHODS
from planner.commands import first_run
from planner.commands.first_run import BESIDE, Helper, compile_beside
from planner.commands.progress import ProgressBar
from planner.machine import load_machine
from planner.nc.reader import parse_program


@pytest.mark.slow
@pytest.mark.parametrize("method", ["optimal", "second-order", "kinematic"])
def test_the_plans_beside_are_made(method: str) -> None:
    """A plan that ends early would leave kernels to the first process."""
    plans = compile_beside("mill", method)
    assert [plan.verdict is not None and plan.verdict.passed for plan in plans] == [True] * len(plans)
    assert len(plans) == len(BESIDE.get(method, first_run.OTHERS))


def test_every_plan_beside_is_of_a_method_that_there_is() -> None:
    assert set(BESIDE) | {name for plans in BESIDE.values() for name, _ in plans} <= set(METHODS)


def test_one_core_has_no_second_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_run, "cores", lambda: 1)
    with Helper("mill", "stop") as helper:
        helper.start()
    assert not helper.started


def test_the_process_starts_once_with_the_first_kernel_and_ends_with_the_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(first_run, "cores", lambda: 2)
    started: list[subprocess.Popen[bytes]] = []
    real = subprocess.Popen

    def recorded(command: list[str], **how: object) -> subprocess.Popen[bytes]:
        assert command[0] == sys.executable
        started.append(real([sys.executable, "-c", "import time; time.sleep(60)"], **how))  # type: ignore[call-overload]
        return started[0]

    monkeypatch.setattr(subprocess, "Popen", recorded)
    with Helper("mill", "stop") as helper, ProgressBar(quiet=True, at_first_kernel=helper.start):
        kernels.compilation().begins(False)
        assert started == []  # what is compiled by another process could not be kept
        kernels.compilation().begins(True)
        kernels.compilation().begins(True)
        (process,) = started
        assert process.poll() is None
    assert process.returncode not in (None, 0)


@pytest.mark.slow
def test_a_second_process_that_fails_says_nothing(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_run, "cores", lambda: 2)
    with Helper("no such machine", "stop") as helper:
        helper.start()
        assert helper._process is not None
        assert helper._process.wait(60) == 1
    assert capfd.readouterr() == ("", "")


def test_the_three_lines_are_as_a_program_that_was_read() -> None:
    """Kernels are compiled for types of arrays: others would be compiled beside, in vain."""
    made = first_run.three_lines()
    text = "G21 G90 G64 F600\n" + "".join(f"G1 X{x} Y{y} Z{z}\n" for x, y, z in first_run.POINTS)
    read = parse_program(text, load_machine("mill"))
    for field in dataclasses.fields(made):
        a, b = getattr(made, field.name), getattr(read, field.name)
        if isinstance(a, np.ndarray):
            assert (a.dtype, a.ndim, a.flags.writeable) == (b.dtype, b.ndim, b.flags.writeable), field.name
            if field.name not in ("line", "tolerance"):
                assert np.array_equal(a, b), field.name
