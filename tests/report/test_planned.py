"""`planned.ngc` among the files of a plan: written where it can be right, left out with a reason where it cannot."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from hand_made import SQUARE, make_plan, trajectory_along

import planner
from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.nc.lexer import LINE_MAX
from planner.nc.reader import parse_program, read_program
from planner.report.export import write_plan


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.ngc"
    path.write_bytes(SQUARE.encode())
    return path


def plan_of(path: Path) -> object:
    plan = make_plan()
    plan.program = read_program(path, plan.machine)
    return plan


def notes(out: Path) -> list[str]:
    return json.loads((out / "summary.json").read_text())["notes"]


def test_blocks_have_their_planned_feed(job: Path, tmp_path: Path) -> None:
    """10 mm in 0.2 s each: more than F3000, the programmed feed. In 0.5 s: 15/8 of the mean of 20 mm/s, which is F2250, and the
    thousandth that rounding may take: one F word for all of them."""
    plan = plan_of(job)
    names = write_plan(plan, tmp_path / "out")
    assert "planned.ngc" in names
    assert (tmp_path / "out" / "planned.ngc").read_bytes() == SQUARE.encode()
    assert notes(tmp_path / "out") == [
        "planned.ngc equals the program: no block is planned slower than its F word"
    ]

    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    write_plan(plan, tmp_path / "out")
    text = (tmp_path / "out" / "planned.ngc").read_text()
    assert notes(tmp_path / "out") == []
    assert text == "G21 G90 G17\nF3000\nG1 X10 F2252\nY10\nX0\nY0\nM2\n"


def test_a_program_that_is_no_file(tmp_path: Path) -> None:
    assert "planned.ngc" not in write_plan(make_plan(), tmp_path / "out")
    assert "which have no F words" in notes(tmp_path / "out")[0]


@pytest.mark.parametrize("now", ["G1 X1 F3000\n", SQUARE.replace("3000", "2999"), "", "G1 X\n"])
def test_a_program_that_has_changed(job: Path, tmp_path: Path, now: str) -> None:
    """The files are those of the program that was planned, whatever its file holds by now."""
    plan, before = plan_of(job), job.read_bytes()
    job.write_text(now)
    write_plan(plan, tmp_path / "out")
    assert (tmp_path / "out" / "program.ngc").read_bytes() == before
    assert (tmp_path / "out" / "planned.ngc").read_bytes() == before


def test_what_it_calls_has_changed(tmp_path: Path) -> None:
    job, called = tmp_path / "job.nc", tmp_path / "O2.nc"
    job.write_text("O1\nG21 G90 F600\nM98 P2\nM30\n")
    called.write_text("O2\nG1 X10\nM99\n")
    plan = planner.plan(job, "mill", method="stop")
    called.write_text("O2\nG1 X12\nM99\n")
    assert "planned.ngc" not in write_plan(plan, tmp_path / "out")
    assert "has what it calls changed?" in notes(tmp_path / "out")[-1]


def test_a_line_that_would_grow_too_long(tmp_path: Path) -> None:
    job = tmp_path / "job.ngc"
    job.write_text(SQUARE.replace("X10", "X10" + " " * (LINE_MAX - 8)))
    plan = plan_of(job)
    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    assert "planned.ngc" not in write_plan(plan, tmp_path / "out")
    assert "does not read back" in notes(tmp_path / "out")[0]


def test_an_old_one_goes_with_its_set(job: Path, tmp_path: Path) -> None:
    write_plan(plan_of(job), tmp_path / "out")
    write_plan(make_plan(), tmp_path / "out")
    assert not (tmp_path / "out" / "planned.ngc").exists()


@pytest.mark.parametrize("elsewhere", [False, True])
def test_the_program_itself_is_never_replaced(
    job: Path, tmp_path: Path, elsewhere: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planning out/planned.ngc into out; by another spelling of its name, too."""
    out = tmp_path / "out"
    write_plan(plan_of(job), out)
    before = (out / "planned.ngc").read_bytes()
    source = out / "planned.ngc"
    if elsewhere:
        monkeypatch.chdir(out)
        source = Path(os.curdir) / "planned.ngc"
    plan = plan_of(source)
    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    assert "planned.ngc" not in write_plan(plan, out)
    assert (out / "planned.ngc").read_bytes() == before
    assert "stays as it is" in notes(out)[0]


def test_feeds_in_the_file_s_own_units(tmp_path: Path) -> None:
    """10 inches in 0.5 s are 1200 inches per minute, 2250 at most, and the thousandth."""
    job = tmp_path / "job.ngc"
    job.write_bytes(b"G20 F9000\r\nG20 F9000 G1 X10 (far)\r\n")
    machine = load_machine("mill")
    plan = make_plan()
    plan.program = read_program(job, machine)
    plan.toolpath = toolpath_from_program(plan.program, machine)
    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    write_plan(plan, tmp_path / "out")
    text = (tmp_path / "out" / "planned.ngc").read_bytes()
    assert text == b"G20 F9000\r\nG20 F2252 G1 X10 (far)\r\n"
    np.testing.assert_allclose(parse_program(text).feed, 254 / 0.5 * 15 / 8, rtol=1e-3)


def test_it_is_said_where_the_original_serves_better(job: Path, tmp_path: Path) -> None:
    """Blocks that last 0.5 s, and a period of 0.6 s."""
    plan = plan_of(job)
    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    plan.machine = plan.machine.model_copy(update={"dt": 0.6})
    write_plan(plan, tmp_path / "out")
    (said,) = notes(tmp_path / "out")
    assert said.startswith("planned.ngc: 4 of 4 blocks last less than a period of 600 ms")


def test_of_a_program_that_computes_the_expanded_one_is_written(tmp_path: Path) -> None:
    """Two turns of one line at two feeds; 10 mm in 0.5 s are F2250 at most, and the thousandth."""
    job = tmp_path / "job.ngc"
    job.write_text("G21 F9000\no1 repeat [2]\n#1=[#1+10]\nG1 X#1\no1 endrepeat\nM2\n")
    machine = load_machine("mill")
    plan = make_plan()
    plan.program = read_program(job, machine)
    plan.toolpath = toolpath_from_program(plan.program, machine)
    plan.trajectory = trajectory_along(plan.toolpath, time=0.5)
    write_plan(plan, tmp_path / "out")
    lines = (tmp_path / "out" / "planned.ngc").read_text().splitlines()
    assert "expanded" in lines[0]
    assert lines[1:] == ["G21 F9000", "G1 X10 F2252", "G1 X20", "M2"]
    assert notes(tmp_path / "out") == [
        "planned.ngc is the expanded program: parameters, loops and calls are written out"
    ]


def test_splines_with_computed_numbers_are_written_expanded_too(tmp_path: Path) -> None:
    """Seven digits of a fraction: their points read back within the tolerance of the path, not to the last digit."""
    job = tmp_path / "job.ngc"
    job.write_text("G21 F9000\n#1=[2/7]\nG5.1 X3 Y[#1*2] I0 J#1\nM2\n")
    machine = load_machine("mill")
    write_plan(planner.plan(job, machine, method="stop"), tmp_path / "out")
    lines = (tmp_path / "out" / "planned.ngc").read_text().splitlines()
    assert lines[2].startswith("G5.1 X3 Y0.5714286 I0 J0.2857143")
