"""LinuxCNC's own planner as a peer: its motion is the one that LinuxCNC makes, and what it cannot do is said."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.runner import linuxcnc
from benchmarks.runner.judged import Judged, NotApplicable, NotHere
from benchmarks.runner.measure import outcome
from benchmarks.runner.peers import modelled
from benchmarks.runner.rows import PEER, SOLVED, Row
from benchmarks.runner.suites import Job
from benchmarks.runner.ways import way_of
from planner.base.errors import NotSolvedError
from planner.machine import Fir, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program

MODEL = 0.03  # by which this project's model of LinuxCNC may be off [-]; planner/controls/timing/linuxcnc.py says 2.1 %
PENTAGON = 1.037  # measured in LinuxCNC 2.9 itself, of this program at G64 P0.05 Q0, without the joints' interpolation [s]
needs_linuxcnc = pytest.mark.skipif(
    not (linuxcnc.MODULE.is_file() and linuxcnc.HEADERS.is_dir()),
    reason="LinuxCNC's planner is missing (apt-get install linuxcnc-uspace linuxcnc-uspace-dev gcc)",
)


def with_rotary() -> Machine:
    machine = problems.machine()
    return machine.model_copy(update={"axes": machine.axes | {"a": machine.axes["x"]}})


def run(program: Program, machine: Machine | None = None) -> Judged:
    return linuxcnc.linuxcnc(program, machine or problems.machine(), None)


@needs_linuxcnc
def test_the_pentagon_takes_the_time_that_linuxcnc_itself_takes() -> None:
    found = run(problems.pentagon())
    assert found.verdict.passed
    assert found.cycle_s == pytest.approx(
        PENTAGON, abs=0.01
    )  # P is a little less, so that the verdict passes
    assert found.free == ("jerk",)
    assert found.verdict.limits["jerk.x"].ratio > 1.0


@needs_linuxcnc
def test_feeds_that_differ_are_exceeded_where_linuxcnc_itself_exceeds_them() -> None:
    """Where it blends a slow move with fast ones: it is many times too fast even from where it is nearest to the vertex on, where F
    changes. In LinuxCNC 2.9 itself the program took 2,053 periods."""
    program = parse_program("G1 X5 F60000\nY1 F30\nX0 F6000\nY0.8 F60\nX0.01 F6000\nX10\nM2\n")
    found = run(program)
    assert found.cycle_s == pytest.approx(2.053, abs=0.01)
    assert found.verdict.limits["feed"].ratio > 10.0
    assert found.verdict.limits["feed"].line == 2


@needs_linuxcnc
@pytest.mark.parametrize(("mode", "share"), [("G64", 0.5), ("G61.1", 1.0)])
def test_a_line_has_the_acceleration_of_its_slowest_axis(mode: str, share: float) -> None:
    """A trapezium; a move that may be blended with the next one gets half of the acceleration."""
    found = run(parse_program(f"{mode}\nG1 F6000 X30 Y40\nM2\n"))
    speed, acceleration = 100.0, share * 2000.0 / 0.8
    assert found.verdict.passed
    assert found.cycle_s == pytest.approx(50.0 / speed + speed / acceleration, abs=0.0025)


@needs_linuxcnc
def test_random_corners_take_the_time_of_the_model() -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        steps = rng.normal(size=(12, 3))
        points = np.cumsum(10.0 * steps / np.linalg.norm(steps, axis=1)[:, None], axis=0)
        text = "".join(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} F4000\n" for x, y, z in points)
        program, machine = parse_program(text), problems.machine()
        assert run(program).cycle_s == pytest.approx(
            modelled("linuxcnc")(program, machine, machine.tolerance), rel=MODEL
        )


@needs_linuxcnc
@pytest.mark.parametrize(
    "plane", ["G17 G2 X0 Y0 I5 J0", "G18 G3 X0 Z0 I5 K0", "G19 G2 Y10 Z0 J5 K0 X3", "G3 X10 Y0 I5 P3"]
)
def test_arcs_and_helices_are_followed(plane: str) -> None:
    found = run(parse_program(f"F3000\nG1 X0\n{plane}\nG1 X20\nM2\n"))
    assert found.verdict.contour.ratio <= 1.0
    assert found.verdict.limits["acceleration.x"].ratio <= 1.01


@needs_linuxcnc
def test_a_dwell_and_a_change_from_rapid_to_feed_are_rests() -> None:
    text = "G0 X10\nG1 F6000 X20 Y5\nG4 P0.25\nG1 X40\nM2\n"
    with_dwell, without = run(parse_program(text)), run(parse_program(text.replace("G4 P0.25\n", "M0\n")))
    assert with_dwell.verdict.passed, with_dwell.verdict.faults
    assert with_dwell.cycle_s - without.cycle_s == pytest.approx(0.25, abs=0.003)


@needs_linuxcnc
def test_a_row_says_what_it_does_not_limit() -> None:
    blank = Row(suite="quick", job="pentagon", way="linuxcnc", kind=PEER, status=SOLVED)
    row = outcome(
        way_of("linuxcnc"), Job(name="pentagon", program=lambda machine: problems.pentagon()), blank
    )
    assert row.verdict == "passed"
    assert not row.comparable


@needs_linuxcnc
def test_what_the_planner_refuses_is_not_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        linuxcnc, "records_of", lambda *given: "machine 0.001 1 1 1 1 1 1\nstart 0 0 0\nspline\n"
    )
    with pytest.raises(NotSolvedError, match="no record"):
        run(problems.pentagon())


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("G1 F100 X1 A5\n", "x, y and z only"),
        ("F100\nG5 X1 Y1 I0.2 J0.3 P-0.2 Q0.1\n", "lines and arcs only"),
    ],
)
def test_what_it_cannot_do_is_said(text: str, why: str) -> None:
    with pytest.raises(NotApplicable, match=why):
        run(parse_program(text, with_rotary()))


def test_filters_are_not_linuxcncs() -> None:
    machine = problems.machine().model_copy(update={"fir": Fir(time_constants=(0.01,))})
    with pytest.raises(NotApplicable, match="filters"):
        run(problems.pentagon(), machine)


def test_without_the_package_the_way_is_not_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(linuxcnc, "MODULE", tmp_path / "tpmod.so")
    with pytest.raises(NotHere, match="linuxcnc-uspace"):
        run(dataclasses.replace(problems.pentagon()))
