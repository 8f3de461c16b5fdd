"""One file has one meaning: for the verdict of a plan, for that on its file, and for other code that filters what is in between."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.jobs import problems
from benchmarks.judge.one_meaning import agrees, row
from benchmarks.judge.setpoints import averaged, within
from planner.machine import Fir
from planner.nc.reader import parse_program
from planner.planning.methods.registry import plan
from planner.report.trajectory_file import write_trajectory
from planner.report.trajectory_reader import read_trajectory
from planner.verifier import verify

KINDS = ["linear", "cubic", "hold"]
ARC = parse_program("G21 F9000\nG1 X4\nG3 X4 Y4 I0 J2\nG1 X1\n", source="a half circle")


@pytest.mark.shows("filters", "exact: means of the motion, by the judge and by the planner")
@pytest.mark.parametrize("seed", [2, 3, 10, 20, 27, 29])
def test_plan_file_and_other_code_agree(seed):
    """Random jobs by every method, with periods of 0.25 to 8 ms and one to three filters of 1 to 60 ms."""
    found = row(seed)
    assert found["planned"], found["said"]
    assert agrees(found), found
    assert found["plan passed"], found["said"]


@pytest.mark.parametrize("ending", ["parquet", "csv"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_what_was_judged(kind, ending, tmp_path):
    """To the digits of the file, which holds them all."""
    fir = Fir(time_constants=(0.011, 0.004))
    machine = problems.machine(dt=0.004, fir=fir, interpolation=kind)
    made = plan(ARC, machine, method="kinematic")
    write_trajectory(tmp_path / f"t.{ending}", made.trajectory)
    read = read_trajectory(tmp_path / f"t.{ending}")
    found = verify(read.trajectory, made.toolpath, machine, given=read.given)
    assert found.passed == made.verdict.passed
    for name in ("contour_error_mm", "vertex_error_mm"):
        said = getattr(found.after_filters, name)
        assert said == pytest.approx(getattr(made.verdict.after_filters, name), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_between_setpoints_the_verdict_measures_the_way_of_the_machine(kind):
    """At 8 ms chords of this half circle are 25 um off, and cubics less than 1 um: found as far off as other code finds them."""
    machine = problems.machine(dt=0.008, tolerance=0.2, interpolation=kind)
    made = plan(ARC, machine, method="stop")
    found = verify(made.trajectory, made.toolpath, machine)
    assert found.passed
    motion = averaged(made.trajectory, kind, ())[:, :2]
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    arc = np.stack([4 + 2 * np.cos(angle), 2 + 2 * np.sin(angle)], axis=1)
    path = np.vstack([[[0.0, 0.0]], arc, [[1.0, 4.0]]])
    error = found.contour_error_mm
    assert (error > 0.01) == (kind != "cubic")
    chords = 3e-4  # [mm] of the other code's places, an eighth of a period apart
    assert within(motion, path, max(error, found.vertex_error_mm) + chords)
    assert not within(motion, path, error - chords)


def test_the_other_code_tells_distances_apart():
    """Of a corner that is cut by 0.1 mm, and of a place passed in the wrong order."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    cut = np.array([[0.0, 0.0], [1.0 - 0.1 * np.sqrt(2.0), 0.0], [1.0, 0.1 * np.sqrt(2.0)], [1.0, 1.0]])
    assert within(cut, corner, 0.1001)
    assert not within(cut, corner, 0.0999)
    back = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 0.0], [4.0, 0.0]])
    straight = np.array([[0.0, 0.0], [4.0, 0.0]])
    assert within(back, straight, 1.001)
    assert not within(back, straight, 0.999)
