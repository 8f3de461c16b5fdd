"""Method `fir` (paper 000): verified motions, what the plain mode exceeds, given filters, vibration modes."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import residual_vibration

from benchmarks.jobs import problems
from planner.base.errors import InputError
from planner.machine import Axis, Machine, Mode
from planner.motion.filters import damped_period
from planner.nc.program import PathControl
from planner.nc.reader import parse_program
from planner.planning.methods.fir import FirMethod
from planner.planning.methods.fir_spline import FirSplineMethod
from planner.planning.methods.registry import plan
from planner.verifier.pieces import RATIO_ROUNDING

JOBS = problems.all_jobs()
MACHINE = problems.machine()


def fir(program, machine=MACHINE):
    made = FirMethod().plan(program, machine)
    assert made.require().verdict.passed, made.verdict.faults
    return made


@pytest.mark.shows("fir", "sampled: verified on the shared jobs")
@pytest.mark.parametrize("name", sorted(JOBS))
def test_jobs_are_verified(name):
    made = fir(JOBS[name])
    assert max(check.ratio for check in made.verdict.limits.values()) <= 1 + RATIO_ROUNDING
    assert made.trajectory.cycle_time <= made.stop_time * (1 + 4e-3)  # arcs as chords
    np.testing.assert_allclose(made.trajectory.position[-1], made.toolpath.end[-1], atol=1e-9)
    assert not made.trajectory.velocity[-1].any()


def test_times_of_the_shared_jobs():
    """From `planner plan`; a change is a change of the method."""
    times = {name: fir(JOBS[name]).trajectory.cycle_time for name in ("pentagon", "circle", "arcs")}
    assert times == pytest.approx({"pentagon": 1.0299, "circle": 0.8364, "arcs": 3.8063}, abs=2e-3)


def test_the_papers_pentagon():
    """docs/papers.md E (i): 5 corners of 72 degrees of turn, V = 100, filters of 50 and 30 ms, eps 0.1, six legs of 93.6 mm in all: the
    saving of 5 x 39.42 ms from a point-to-point time of 1.416 s."""
    side = 93.6 / 6
    angle = np.deg2rad(72.0) * np.arange(6)
    points = np.vstack(
        [[0.0, 0.0], np.cumsum(side * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)]
    )
    program = problems.polyline(points)
    machine = problems.machine(tolerance=0.1, dt=1e-4)
    method = FirMethod(plain=True, profile_filters=(0.05, 0.03))
    whole = method.plan(program, machine)
    stops = problems.polyline(points, path_control=PathControl.EXACT_STOP)
    assert method.plan(stops, machine).trajectory.cycle_time == pytest.approx(1.416, abs=1e-6)
    assert whole.trajectory.cycle_time == pytest.approx(1.2189, abs=1e-4)
    assert whole.verdict.vertex_error_mm == pytest.approx(0.1, rel=2e-3)


@pytest.mark.shows("fir-plain", "sampled: what they exceed is said, and is no more than proved")
def test_the_plain_mode_says_what_it_exceeds():
    """At 72 degrees the axis acceleration of an overlap goes up to 1.18 of V/T1; the safe mode pays for it with 2 % of the time."""
    plain, safe = FirMethod(plain=True).plan(JOBS["pentagon"], MACHINE), fir(JOBS["pentagon"])
    assert not plain.verdict.passed
    assert 1.1 < plain.verdict.limits["acceleration.y"].ratio < 1.2
    assert plain.trajectory.cycle_time < safe.trajectory.cycle_time < 1.05 * plain.trajectory.cycle_time
    assert (plain.method, safe.method) == ("fir-plain", "fir")


@pytest.mark.parametrize("name", ["pentagon", "zigzag", "arcs"])
def test_filters_that_are_given_are_kept(name):
    made = FirMethod(profile_filters=(0.012, 0.06)).plan(JOBS[name], MACHINE)
    assert made.verdict.passed, made.verdict.faults
    assert made.sentence.endswith("filters of 72 to 72 ms in all")


def test_filters_matched_to_modes_leave_nothing_of_them():
    """Eq. (10): before and after, on the motion itself; undamped modes at 18 and 41 Hz. What remains is the samples' doing."""
    modes = (Mode(frequency=18.0), Mode(frequency=41.0))
    matched = fir(JOBS["pentagon"], problems.machine(modes=modes, dt=1e-4))
    ignorant = fir(JOBS["pentagon"], problems.machine(dt=1e-4))
    for mode in modes:
        left, before = (
            residual_vibration(m.trajectory.t, m.trajectory.acceleration[:, :2], mode.frequency, 0.0).max()
            for m in (matched, ignorant)
        )
        assert left < 1e-3 * before
    assert matched.trajectory.cycle_time > ignorant.trajectory.cycle_time


@pytest.mark.parametrize("method", [FirMethod, FirSplineMethod])
@pytest.mark.parametrize("filters", [(0.01,), (0.03, 0.02, 0.01), (0.01, 0.0), (0.01, np.nan)])
def test_its_profile_is_made_by_two_filters(method, filters):
    with pytest.raises(InputError, match="give two lengths"):
        method(profile_filters=filters)


def test_stops_dwells_rapids_and_feeds():
    text = "G21 F6000\nG4 P0.25\nG1 X10\nG61.1\nX20\nG64\nX30 Y5 F2000\nG4 P0.5\nG1 X40\nG0 X50 Y0\nX0\nG1 X-5 Y3 F6000\n"
    made = fir(parse_program(text))
    assert (~made.trajectory.velocity.any(axis=1)).sum() * MACHINE.dt == pytest.approx(0.75, abs=0.02)


def test_a_larger_feed_costs_no_time():
    """40 and 80 mm at 200 mm/s2 are run best at about sqrt(40 x 200) = 90 mm/s, whatever the feed: a filter of V/A pays for more."""
    axis = Axis(velocity=200.0, acceleration=200.0, jerk=20000.0)
    machine = Machine(name="soft", dt=0.001, tolerance=0.05, axes=dict.fromkeys("xy", axis))
    times = [
        fir(parse_program(f"G1 X40 F{feed}\nG1 Y80\nM2\n"), machine).cycle_time
        for feed in (5000, 7000, 11000)
    ]
    assert times[2] <= times[1] * (1 + 1e-3)
    assert times[1] <= times[0] * (1 + 1e-3)


def test_it_has_a_name():
    made = plan(JOBS["pentagon"], MACHINE, method="fir")
    assert (made.method, made.corner, made.solver) == ("fir", "fir", "pulses")
    assert "corners are waited at" in made.sentence


def test_the_plain_mode_overlaps_corners_between_two_feeds_by_their_geometric_mean():
    """docs/papers.md: eq. (14) with V = sqrt(V1 V2) is safe where the feeds differ; the overlap is what the corner saves of the
    delay."""
    program = problems.polyline([[0, 0], [20, 0], [20, 10]], feed=np.array([100.0, 25.0]))
    made = FirMethod(plain=True, profile_filters=(0.05, 0.03)).plan(program, problems.machine(dt=1e-4))
    overlap = (24 * 0.05 * 0.03 * 0.05 / (np.sqrt(100.0 * 25.0) * np.sin(np.pi / 4))) ** (1 / 3)
    assert overlap < 2 * 0.03  # the cubic branch
    assert made.trajectory.cycle_time == pytest.approx(20 / 100 + 10 / 25 + 2 * 0.08 - overlap, abs=2e-4)


def test_the_period_of_a_damped_mode():
    """A free vibration of damping 0.6 has 0.8 of the undamped frequency."""
    assert damped_period(10.0, 0.6) == pytest.approx(0.125)
    w, z = 2 * np.pi * 10.0, 0.6
    t = damped_period(10.0, z) * np.array([0.0, 0.5, 1.0])
    assert np.abs(np.sin(w * np.sqrt(1 - z**2) * t)).max() < 1e-12
