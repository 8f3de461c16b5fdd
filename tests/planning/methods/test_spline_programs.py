"""Programs with splines: every method plans them, and they obey the laws of the same path written otherwise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from curves import chord_error, curve_named

from benchmarks.jobs.nurbs_chords import chord_program
from planner.machine import Machine, load_machine, machine_from_dict
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.registry import plan

ROUTER = load_machine("router")
JOB = "G1 X20\nG5 I10 J0 P0 Q-10 X40 Y20\nG1 Y40"  # tangent at both ends
CORNERS = "G1 X20\nG5 I5 J8 P-3 Q-10 X40 Y20\nG5.1 X60 Y10 I0 J-9\nG1 Y40"  # not
LOOP = "G5.2 P1 L4\nX10 Y0\nX20 Y20 P2\nX-10 Y20\nX0 Y5 P0.5\nX20 Y-5\nG5.3"


class Cubic(NamedTuple):
    """The control points of a cubic, (x, y) [mm]."""

    start: tuple[float, float]
    first: tuple[float, float]
    second: tuple[float, float]
    end: tuple[float, float]

    def block(self) -> str:
        """As a block G5."""
        (i, j), (p, q) = np.subtract(self.first, self.start), np.subtract(self.second, self.end)
        return f"G5 I{i} J{j} P{p} Q{q} X{self.end[0]} Y{self.end[1]}"

    def chords(self, count: int) -> str:
        """As so many lines."""
        t = np.linspace(0.0, 1.0, count + 1)[1:, None]
        weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        return "\n".join(f"G1 X{x:.6f} Y{y:.6f}" for x, y in weights @ np.array(self))


def program(text: str, feed: float = 3000.0) -> Program:
    return parse_program(f"G21 G17 G90 G64 P0.01\nF{feed}\n{text}\nM2\n".encode())


def planned(text: str, method: str, machine: Machine = ROUTER, feed: float = 3000.0, **more) -> Plan:
    effort = {"effort": "quick"} if method in ("optimal", "second-order") else {}
    return plan(program(text, feed), machine, method=method, **effort, **more)


def time_of(made: Plan) -> float:
    assert made.verdict is not None
    assert made.verdict.passed, made.verdict.faults
    assert made.trajectory is not None
    return made.trajectory.cycle_time


@pytest.mark.parametrize(
    "method", ["stop", "kinematic", "bezier", "fir", "fir-spline", "second-order", "optimal"]
)
def test_every_method_plans_splines(method: str) -> None:
    assert time_of(planned(CORNERS, method)) > 0.5


def test_the_reference_solvers_leave_the_start_where_there_are_curves_and_say_so() -> None:
    made = planned(CORNERS, "tube", solver="ipopt")
    assert "not curves" in made.sentence
    assert time_of(made) <= time_of(planned(CORNERS, "optimal")) * (1.0 + 1e-9)


def test_a_spline_takes_as_long_as_its_fine_chords() -> None:
    """Path and feed are found together along the curve as along the lines that stand for it, in a tolerance of 10 um."""
    bends = [
        Cubic((20.0, 0.0), (25.0, 8.0), (37.0, 10.0), (40.0, 20.0)),
        Cubic((40.0, 20.0), (41.0, 25.0), (52.0, 20.0), (60.0, 21.0)),
    ]
    curves = "G1 X20\n" + "\n".join(bend.block() for bend in bends) + "\nG1 Y40"
    lines = "G1 X20\n" + "\n".join(bend.chords(60) for bend in bends) + "\nG1 Y40"
    made = planned(curves, "optimal")
    assert made.sentence.startswith("path and feed optimised together")
    assert time_of(made) == pytest.approx(time_of(planned(lines, "optimal")), rel=5e-4)


@pytest.mark.parametrize("text", [JOB, LOOP])
def test_stop_runs_on_the_curve(text: str) -> None:
    made = planned(text, "stop")
    assert time_of(made) == pytest.approx(made.stop_time, rel=1e-6)
    verdict = made.verdict
    assert verdict is not None
    assert verdict.contour_error_mm is not None
    assert verdict.contour_error_mm <= 1.001 * chord_error(made.trajectory) + 1e-8  # between samples
    assert 0.7 < max(limit.ratio for limit in verdict.limits.values() if limit.limited) <= 1.0 + 1e-6


@pytest.mark.parametrize(("method", "near"), [("stop", 1e-9), ("second-order", 1e-4), ("optimal", 1e-4)])
def test_a_circle_takes_as_long_as_the_arc(method: str, near: float) -> None:
    side = np.sqrt(0.5)
    corners = [
        (0, 0, 1),
        (0, -10, side),
        (10, -10, 1),
        (20, -10, side),
        (20, 0, 1),
        (20, 10, side),
        (10, 10, 1),
        (0, 10, side),
        (0, 0, 1),
    ]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    rows = [f"K{k} X{x} Y{y} R{w:.17f}" for k, (x, y, w) in zip(knots, corners, strict=False)]
    spline = "G6.2 P3 " + "\n".join(rows + [f"K{k}" for k in knots[9:]])
    arc = "G3 X0 Y0 I10 J0"
    lead = "G0 Y10\nG1 Y0\n{}\nG1 Y-10"
    one = time_of(planned(lead.format(spline), method, feed=2000.0))
    other = time_of(planned(lead.format(arc), method, feed=2000.0))
    assert one == pytest.approx(other, rel=near)


@pytest.mark.slow
def test_a_spline_is_as_fast_as_its_fine_chords_or_faster() -> None:
    curve = curve_named("trident")
    how = {"method": "second-order", "effort": "quick", "tolerance": 0.01}
    exact = time_of(plan(curve.exact_program(50.0), ROUTER, **how))
    chords = time_of(plan(chord_program(curve, 1e-3, 50.0), ROUTER, **how))
    assert exact < 1.01 * chords
    assert chords < 1.05 * exact


def test_the_units_of_a_program_do_not_matter() -> None:
    inch = "G20\nF{}\nG1 X[20/25.4]\nG5 I[10/25.4] J0 P0 Q[-10/25.4] X[40/25.4] Y[20/25.4]\nG1 Y[40/25.4]"
    one = time_of(planned(inch.format(3000 / 25.4), "second-order"))
    assert one == pytest.approx(time_of(planned(JOB, "second-order")), rel=1e-9)


def test_a_job_run_backwards_takes_as_long() -> None:
    back = "G0 X40 Y40\nG4 P0\nG1 Y20\nG5 I0 J-10 P10 Q0 X20 Y0\nG1 X0"
    made = planned(back, "optimal")
    there = planned("G1 X20\nG5 I10 J0 P0 Q-10 X40 Y20\nG1 Y40\nG4 P0\nG0 X0 Y0", "optimal")
    assert time_of(made) == pytest.approx(time_of(there), rel=1e-4)


def scaled(factor: float) -> Machine:
    axis = {"velocity": 200.0 * factor, "acceleration": 2000.0 * factor, "jerk": 5e4 * factor}
    return machine_from_dict(
        {"name": "scaled", "dt": 1e-3, "tolerance": 0.01 * factor, "axes": {"x": axis, "y": axis, "z": axis}}
    )


def test_a_job_and_a_machine_twice_as_large_take_as_long() -> None:
    twice = "G1 X40\nG5 I20 J0 P0 Q-20 X80 Y40\nG1 Y80"
    small = plan(program("G64\n" + JOB, 3000.0), scaled(1.0), method="second-order")
    large = plan(program("G64\n" + twice, 6000.0), scaled(2.0), method="second-order")
    assert time_of(large) == pytest.approx(time_of(small), rel=1e-6)


@pytest.mark.parametrize("method", ["stop", "optimal"])
def test_a_cusp_and_an_arm_of_length_zero_are_run_and_said(method: str) -> None:
    made = planned("G5 X10 Y0 I10 J10 P-10 Q10\nG5 X20 Y5 I0 J0 P0 Q4", method)
    assert time_of(made) > 0.3
    assert any("stands still" in note for note in made.notes)


def test_exact_path_with_splines_is_kept_and_what_cannot_says_so() -> None:
    made = planned("G61\n" + JOB, "kinematic")
    assert any("G61" in note and "chords" in note for note in made.notes)
    assert time_of(planned("G61\n" + JOB, "optimal")) > 0.0
